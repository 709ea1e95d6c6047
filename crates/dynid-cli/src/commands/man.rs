//! `dynid man`.

use clap_mangen::Man;
use dynid_terminal::message::{Failure, Notes, bytes};
use dynid_terminal::outputs::{self, is_stdout, marked_roff};

use crate::args::{ManArgs, definition};

pub(crate) fn run(args: &ManArgs) -> Result<u8, Failure> {
    let pages = pages()?;
    if is_stdout(&args.out) {
        if let Some((_, page)) = pages.first() {
            bytes(page)?;
        }
        return Ok(0);
    }
    let files: Vec<_> = pages.iter().map(|(name, _)| args.out.join(name)).collect();
    let set = outputs::prepare_folder(&files, &[], args.force)?;
    for (number, (_, page)) in pages.iter().enumerate() {
        set.write(number, page)?;
    }
    Notes::new(args.quiet).written(&set.publish()?);
    Ok(0)
}

/// Names and texts of the pages, that of the program first.
fn pages() -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let mut program = definition();
    program.build();
    let commands = program.get_subcommands().filter(|command| command.get_name() != "help");
    let all = std::iter::once(&program).chain(commands);
    all.map(|command| {
        let man = Man::new(command.clone());
        let mut page = Vec::new();
        man.render(&mut page).map_err(Failure::Output)?;
        Ok((man.get_filename(), marked_roff(page)))
    })
    .collect()
}
