//! How logs and tables of states are read.

use std::path::PathBuf;

use clap::{Args, ValueHint};

/// How log columns are understood.
#[derive(Debug, Args)]
pub(crate) struct LogArgs {
    /// Sample rate for logs without a time column, Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) rate_hz: Option<f64>,
    /// Drive gains for current columns, N m/A, one per joint.
    #[arg(long, value_name = "K1,K2,..", value_delimiter = ',')]
    pub(crate) gains: Option<Vec<f64>>,
    /// Hold joints without columns still at zero instead of refusing the log.
    #[arg(long)]
    pub(crate) allow_unlogged: bool,
}

impl LogArgs {
    /// The first flag that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        match (self.rate_hz, &self.gains, self.allow_unlogged) {
            (Some(_), _, _) => Some("--rate-hz"),
            (_, Some(_), _) => Some("--gains"),
            (_, _, true) => Some("--allow-unlogged"),
            (None, None, false) => None,
        }
    }
}

/// How the logs of a command that works with an estimate are read.
#[derive(Debug, Args)]
pub(crate) struct ReadingArgs {
    /// First and last data row of the logs, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range, requires = "log")]
    pub(crate) rows: Option<(usize, usize)>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Configuration whose [columns] and [motor_side] the logs follow (default: as the estimate records).
    #[arg(long, value_name = "FILE.toml", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
}

pub(super) fn row_range(text: &str) -> Result<(usize, usize), String> {
    let fault = || format!("expected FIRST:LAST, found `{text}`");
    let (first, last) = text.split_once(':').ok_or_else(fault)?;
    Ok((first.parse().map_err(|_| fault())?, last.parse().map_err(|_| fault())?))
}

/// Refuses `--log` where only a configuration can say what a log carries, and tells the lines to write.
pub(super) fn stated_in_the_configuration(file: &str) -> Result<PathBuf, String> {
    Err(format!(
        "what a log carries is stated in the configuration; the lines to write:\n[[log]]\npath = \"{file}\"\npayload = \"NAME\""
    ))
}
