//! `dynid completions`.

use crate::args::{CompletionsArgs, definition};
use crate::message::{Failure, bytes};

pub(crate) fn run(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut definition(), "dynid", &mut script);
    bytes(&script)?;
    Ok(0)
}
