//! Arguments of commands about one model: a robot file's or an identified one's.

use std::path::PathBuf;

use clap::{Args, ValueHint};
use dynid::estimate::Split;

use super::elements::with_elements;
use super::logs::row_range;
use super::{ForceArgs, LogArgs, PrintArgs, ReadingArgs, RobotArgs};

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    pub(crate) robot: RobotArgs,
    /// Elements at every joint, comma separated; `none`: rigid bodies alone (default: the robot file's, else none).
    #[arg(long, value_name = "LIST", value_delimiter = ',', long_help = with_elements("Elements at every joint, comma separated; `none`: rigid bodies alone (default: the robot file's, else none)."))]
    pub(crate) elements: Option<Vec<String>>,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct RegressorArgs {
    #[command(flatten)]
    pub(crate) robot: RobotArgs,
    /// States: CSV with q, dq, ddq (`q_<joint>` or `q1..`), optional gx, gy, gz; `-`: standard input.
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub(crate) states: PathBuf,
    /// First and last data row of the states, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range)]
    pub(crate) rows: Option<(usize, usize)>,
    /// Give base columns instead of standard ones.
    #[arg(long, requires = "json")]
    pub(crate) base: bool,
    /// Print JSON (joints, columns, effort, regressor); without it only efforts, as CSV.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but the result and errors: no progress, notes or warnings.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {
    /// Result: `estimate`, `design`, ..; without one all are listed.
    pub(crate) name: Option<String>,
    /// Print nothing but the result and errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

/// Which of an estimate's parameters.
#[derive(Debug, Args)]
pub(crate) struct SplitArgs {
    /// Use the parameters fitted without constraints in place of the physically consistent ones.
    #[arg(long)]
    pub(crate) unconstrained: bool,
}

impl SplitArgs {
    pub(crate) fn of(&self) -> Split {
        if self.unconstrained { Split::Unconstrained } else { Split::Consistent }
    }
}

#[derive(Debug, Args)]
pub(crate) struct PredictArgs {
    /// estimate.json; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) estimate: PathBuf,
    #[command(flatten)]
    pub(crate) split: SplitArgs,
    /// States: CSV with q, dq, ddq, optional gx, gy, gz; `-`: standard input.
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub(crate) states: PathBuf,
    /// First and last data row of the states, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range)]
    pub(crate) rows: Option<(usize, usize)>,
    /// Output CSV or CSV.gz (default: standard output).
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::AnyPath, conflicts_with = "json")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print JSON (joints, and the effort of every joint at every state) in place of CSV.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but the result and errors: no progress, notes or warnings.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ValidateArgs {
    /// estimate.json; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) estimate: PathBuf,
    #[command(flatten)]
    pub(crate) split: SplitArgs,
    /// Log to compare with; repeat for several; `-`: standard input.
    #[arg(long, value_name = "LOG", required = true, value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Cut-off of the filter for the filtered figures, Hz (default: the kernel's).
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) filter_hz: Option<f64>,
    /// Largest error that passes, percent of the effort, filtered, over all joints of a log: exit code 1 beyond it
    /// (default: any passes).
    #[arg(long, value_name = "PERCENT", value_parser = percent, allow_negative_numbers = true)]
    pub(crate) max_error: Option<f64>,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

fn percent(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').unwrap_or(text).trim_end().parse::<f64>().ok();
    number
        .filter(|x| x.is_finite() && *x > 0.0)
        .ok_or_else(|| format!("expected a positive number, percent, found `{text}`"))
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// estimate.json; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) estimate: PathBuf,
    /// Robot file that was identified (default: the path that the estimate names).
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) robot: Option<PathBuf>,
    /// Write a URDF: inertias, viscous and Coulomb friction; a URDF is edited in place, all else stays byte for byte; `-`:
    /// standard output.
    #[arg(long, value_name = "FILE.urdf", value_hint = ValueHint::AnyPath)]
    pub(crate) urdf: Option<PathBuf>,
    /// Write an MJCF for MuJoCo: inertias, friction, rotor inertias; an MJCF is edited in place, any other robot gets a new file with gravity and
    /// a motor per joint; `-`: standard output.
    #[arg(long, value_name = "FILE.xml", value_hint = ValueHint::AnyPath)]
    pub(crate) mjcf: Option<PathBuf>,
    /// Write the whole identified model, links, joints and all elements, as compact JSON; `-`: standard output.
    #[arg(long, value_name = "FILE.json", value_hint = ValueHint::AnyPath)]
    pub(crate) model: Option<PathBuf>,
    /// Log to compare efforts on; repeat for several (default: random states within the limits).
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// First and last data row of the logs, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range, requires = "log")]
    pub(crate) rows: Option<(usize, usize)>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Configuration whose [columns] and [motor_side] the logs follow.
    #[arg(long, value_name = "FILE.toml", requires = "log", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
    /// Write links that no body could be all the same; simulators refuse them.
    #[arg(long)]
    pub(crate) allow_unphysical: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct DiffArgs {
    /// estimate.json, or the robot file that was identified; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) a: PathBuf,
    /// estimate.json that is compared with it; one of the two at least is an estimate.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) b: PathBuf,
    #[command(flatten)]
    pub(crate) split: SplitArgs,
    /// States to compare efforts at: CSV with q, dq, ddq, optional gx, gy, gz (default: a thousand random states within the
    /// limits).
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub(crate) states: Option<PathBuf>,
    /// First and last data row of the states, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range, requires = "states")]
    pub(crate) rows: Option<(usize, usize)>,
    /// List all parameters that can be compared, not only those that differ.
    #[arg(long)]
    pub(crate) all: bool,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
