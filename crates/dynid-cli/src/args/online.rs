//! Arguments of `dynid online`.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

use super::logs::row_range;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum StreamArg {
    /// A header line, then numbers between commas.
    Csv,
    /// One JSON object per line.
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct OnlineArgs {
    /// Configuration as for `identify`; keys of its own are under [online].
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) config: PathBuf,
    /// Read samples from stdin, one per line, instead of the configuration's logs.
    #[arg(long, value_name = "FORMAT")]
    pub(crate) stream: Option<StreamArg>,
    /// Log to follow instead of those of the configuration; may be given more than once.
    #[arg(long, value_name = "FILE", conflicts_with = "stream", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// First and last data row of the logs, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range, conflicts_with = "stream")]
    pub(crate) rows: Option<(usize, usize)>,
    /// Write the state to this file, and go on from it if it exists (default: the configuration's).
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// The stream begins again from its start: pass over what the checkpoint has seen (logs always do).
    #[arg(long, requires = "stream")]
    pub(crate) replay: bool,
    /// Print JSON lines on a terminal too, in place of the live view.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but the result and errors: no progress, notes or warnings.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}
