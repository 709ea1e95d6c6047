//! How logs and tables of states are read.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

use super::ForceArgs;

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
    /// Names of the columns of a file without a header, in their order.
    #[arg(long, value_name = "T,Q1,..", value_delimiter = ',')]
    pub(crate) names: Option<Vec<String>>,
    /// What becomes of rows in which a signal has no value (default: drop for formats that leave cells empty, else error).
    #[arg(long, value_enum, value_name = "POLICY")]
    pub(crate) missing: Option<MissingArg>,
}

/// What becomes of rows in which a signal has no value.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MissingArg {
    /// The log is refused.
    Error,
    /// They are left out.
    Drop,
    /// Signals are interpolated at the rows that have all positions.
    Interpolate,
}

impl LogArgs {
    /// The first flag that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let flags = [
            ("--rate-hz", self.rate_hz.is_some()),
            ("--gains", self.gains.is_some()),
            ("--allow-unlogged", self.allow_unlogged),
            ("--names", self.names.is_some()),
            ("--missing", self.missing.is_some()),
        ];
        flags.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag)
    }
}

#[derive(Debug, Args)]
pub(crate) struct InitArgs {
    /// Robot file: URDF, MJCF, SDF or TOML.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) robot: PathBuf,
    /// Logs: of several the last one is kept for validation.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// Configuration to write.
    #[arg(long, value_name = "FILE.toml", default_value = "dynid.toml", value_hint = ValueHint::AnyPath)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Print nothing but results and errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// Log; `FILE#MEMBER`: an episode, a group, or topics of it.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) log: PathBuf,
    /// File to write: .csv, .csv.gz, .parquet, .npz or .mcap.
    #[arg(value_hint = ValueHint::AnyPath)]
    pub(crate) out: PathBuf,
    /// Robot file: write the signals of its joints, in SI (default: all columns as they are).
    #[arg(long, value_name = "ROBOT", value_hint = ValueHint::FilePath)]
    pub(crate) robot: Option<PathBuf>,
    /// First and last data row, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range)]
    pub(crate) rows: Option<(usize, usize)>,
    /// Configuration whose [columns] the log follows.
    #[arg(long, value_name = "FILE.toml", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
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
