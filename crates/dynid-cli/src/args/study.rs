//! Arguments of `dynid study`.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::{ForceArgs, PrintArgs};

#[derive(Debug, Args)]
pub(crate) struct StudyArgs {
    /// Name of the study; `list` shows all.
    pub(crate) name: String,
    /// Folder for study.json and report.html (default: `dynid-study-NAME`).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Keep every row, shrink statistics: under a minute.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
