//! `dynid completions`.

use dynid_terminal::message::{Failure, bytes};

use crate::args::{CompletionsArgs, definition};

pub(crate) fn run(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut definition(), "dynid", &mut script);
    bytes(&script)?;
    Ok(0)
}
