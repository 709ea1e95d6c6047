//! Arguments of commands for single things: friction, payloads, drive gains, backlash, clearance.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::logs::stated_in_the_configuration;
use super::robot::joint_value;
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
pub(crate) struct ServoArgs {
    /// Configuration (TOML), or a robot file together with --log.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Log of commands and positions, of any format that is read; repeat for several. The first argument is a robot file then.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// Log to predict only, beside --log; repeat for several.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath, requires = "log")]
    pub(crate) validate: Vec<PathBuf>,
    /// Hold a joint at a position, rad or m, beside --log.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value, requires = "log")]
    pub(crate) lock: Vec<(String, f64)>,
    /// Position gain of all drives where it is known, N m/rad, beside --log.
    #[arg(long, value_name = "GAIN", requires = "log")]
    pub(crate) position_gain: Option<f64>,
    /// Velocity gain of all drives where it is known, N m s/rad, beside --log.
    #[arg(long, value_name = "GAIN", requires = "log")]
    pub(crate) velocity_gain: Option<f64>,
    /// Output folder (default: the configuration's, else dynid-servo).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
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
