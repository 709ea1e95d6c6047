//! Arguments of commands for single things: friction, payloads, drive gains, backlash, clearance.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::logs::stated_in_the_configuration;
use super::{ForceArgs, PrintArgs, ReadingArgs};

#[derive(Debug, Args)]
pub(crate) struct FrictionTestArgs {
    /// Configuration (TOML).
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Refused: the configuration says which log carries what.
    #[arg(long, hide = true, value_name = "LOG", value_parser = stated_in_the_configuration)]
    pub(crate) log: Option<PathBuf>,
    /// Output folder (default: dynid-friction).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct PayloadArgs {
    /// Configuration (TOML) with a `[[payload]]`, a `[[log]]` that carries it and one that does not.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Refused: the configuration says which log carries what.
    #[arg(long, hide = true, value_name = "LOG", value_parser = stated_in_the_configuration)]
    pub(crate) log: Option<PathBuf>,
    /// Output folder (default: the configuration's, else dynid-payload).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct GainsArgs {
    /// Configuration (TOML) with one `[[payload]]` of known mass, a `[[log]]` that carries it and one that does not.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Refused: the configuration says which log carries what.
    #[arg(long, hide = true, value_name = "LOG", value_parser = stated_in_the_configuration)]
    pub(crate) log: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct BacklashArgs {
    /// estimate.json of the robot: link parameters for the loads, friction for the residual.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) estimate: PathBuf,
    /// Log to look at; repeat for several (default: the training logs of the configuration).
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath, required_unless_present = "config")]
    pub(crate) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct ClearanceArgs {
    /// Robot file whose joints state a clearance; the gap is a guess.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) robot: PathBuf,
    /// estimate.json of the same robot: link parameters for the loads, friction for the residual.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) estimate: PathBuf,
    /// Log; columns journal_<joint>_x and journal_<joint>_y hold offsets of journals in axes that turn with their links, m.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
