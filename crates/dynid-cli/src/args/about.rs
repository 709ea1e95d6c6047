//! Arguments of commands about the program itself.

use std::path::PathBuf;

use clap::{Args, ValueHint};
use clap_complete::Shell;

use super::{ForceArgs, PrintArgs};

#[derive(Debug, Args)]
pub(crate) struct ExplainArgs {
    /// Finding, check, verdict or status, as printed; without one: list all.
    pub(crate) id: Vec<String>,
    /// Print all as the page of the book.
    #[arg(long, conflicts_with_all = ["id", "json"])]
    pub(crate) markdown: bool,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// Shell.
    pub(crate) shell: Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// Folder for the pages, `dynid.1` and one per command; `-`: print the page of `dynid`.
    #[arg(long, value_name = "DIR", default_value = "-", value_hint = ValueHint::DirPath)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}
