//! Arguments of commands that work from logs towards a model.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

use super::elements::with_elements;
use super::logs::row_range;
use super::robot::{joint_value, vector};
use super::{ForceArgs, LogArgs, PrintArgs};

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum RouteArg {
    /// States at a high cut-off, one compact kernel; everything found from the data.
    Compact,
    /// Zero-phase Butterworth, central differences, decimation.
    Textbook,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodArg {
    /// Ordinary least squares.
    Ols,
    /// Weighted least squares.
    Wls,
    /// Huber's loss, for some per cent of gross errors.
    Huber,
    /// Tukey's biweight: gross errors lose all influence.
    Tukey,
    /// Weighted, with the robot file as a Gaussian prior.
    Ridge,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum FrictionArg {
    /// The elements given, and shapes that held-out blocks ask for (default).
    Auto,
    /// The elements given, nothing else.
    Given,
    /// Coulomb, viscous, offset.
    Linear,
    /// A law of its own for each direction.
    Asymmetric,
    /// Coulomb, viscous, offset and an arctangent.
    Arctangent,
    /// Stribeck in place of Coulomb.
    Stribeck,
    /// A hyperbolic tangent in place of Coulomb.
    Tanh,
    /// A sigmoid in place of Coulomb.
    Sigmoid,
    /// A sigmoid beside an offset.
    SigmoidOffset,
    /// A power of the speed in place of viscous friction.
    Power,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum ConsistencyArg {
    /// Bodies with a mass distribution (4 x 4 pseudo-inertia).
    PseudoInertia,
    /// Positive mass and inertia, triangle inequality or not (6 x 6 spatial inertia).
    SpatialInertia,
    /// Any numbers.
    None,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Configuration (TOML), or a robot file together with --log, or logs together with --robot; `-`: standard input.
    #[arg(required = true, value_name = "CONFIG | ROBOT | LOG", value_hint = ValueHint::FilePath)]
    pub(crate) input: Vec<PathBuf>,
    /// Robot file, URDF, MJCF, SDF or TOML, of the logs named first.
    #[arg(long, value_name = "ROBOT", value_hint = ValueHint::FilePath)]
    pub(crate) robot: Option<PathBuf>,
    /// Log of any format that is read, in place of those of the configuration; repeat for several.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// First and last data row of the training logs, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range)]
    pub(crate) rows: Option<(usize, usize)>,
    /// Write the configuration that applies the remedies; `-`: standard output.
    #[arg(long, value_name = "FILE.toml", value_hint = ValueHint::AnyPath)]
    pub(crate) fix: Option<PathBuf>,
    /// Write the report page; `-`: standard output.
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::AnyPath)]
    pub(crate) report: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    /// Gravity in base axes, m/s² (default: the robot file's, else 0,0,-9.81).
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub(crate) gravity: Option<[f64; 3]>,
    /// The size of the efforts is right, whatever robot file, effort limits and other arms say of it.
    #[arg(long)]
    pub(crate) known_effort_scale: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Configuration (TOML), or a robot file together with --log; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Log of any format that is read, in place of those of the configuration; repeat for several.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// First and last data row of the training logs, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range)]
    pub(crate) rows: Option<(usize, usize)>,
    /// Write the report page; `-`: standard output.
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::AnyPath)]
    pub(crate) report: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct IdentifyArgs {
    /// Configuration (TOML), or a robot file together with --log; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Log to identify from, of any format that is read, in place of those of the configuration; repeat for several.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    /// First and last data row of the training logs, from 1.
    #[arg(long, value_name = "FIRST:LAST", value_parser = row_range)]
    pub(crate) rows: Option<(usize, usize)>,
    /// Log to validate on, beside those of the configuration; repeat for several.
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) validate: Vec<PathBuf>,
    /// Output folder (default: dynid-out).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Elements at every joint that moves, comma separated; `none`: rigid bodies alone (default: the robot file's, else
    /// coulomb,viscous,offset,rotor).
    #[arg(long, value_name = "LIST", value_delimiter = ',', long_help = with_elements("Elements at every joint that moves, comma separated; `none`: rigid bodies alone (default: the robot file's, else coulomb,viscous,offset,rotor)."))]
    pub(crate) elements: Option<Vec<String>>,
    /// Friction of joints that have any: shapes found on held-out data, or one law for all.
    #[arg(long, value_enum)]
    pub(crate) friction: Option<FrictionArg>,
    /// Friction file of `dynid friction`: its laws count as known, and what is identified of friction are their errors.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) known_friction: Option<PathBuf>,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    /// Let mimic joints follow their leaders.
    #[arg(long)]
    pub(crate) couple_mimics: bool,
    /// Gravity in base axes, m/s².
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub(crate) gravity: Option<[f64; 3]>,
    /// The size of the efforts is right, whatever robot file, effort limits and other arms say of it.
    #[arg(long)]
    pub(crate) known_effort_scale: bool,
    /// Way from samples to rows.
    #[arg(long, value_enum)]
    pub(crate) route: Option<RouteArg>,
    /// Estimator.
    #[arg(long, value_enum)]
    pub(crate) estimator: Option<MethodArg>,
    /// Search of the shape parameters of friction over all their range: abc, cs, ics, pso, gps, cma-es, de (default:
    /// Gauss-Newton from several starts).
    #[arg(long, value_name = "ALGORITHM")]
    pub(crate) search: Option<String>,
    /// Which bodies the standard parameters may describe [default: pseudo-inertia].
    #[arg(long, value_enum)]
    pub(crate) consistency: Option<ConsistencyArg>,
    /// Cut-off of the widest kernel (textbook route: of the filter), Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) kernel_hz: Option<f64>,
    /// Cut-off of the state filter, Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) state_hz: Option<f64>,
    /// Delay of the motion behind the logged effort, samples.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) delay_samples: Option<f64>,
    /// Reversal mask, share of rms speed; negative: none.
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true)]
    pub(crate) reversal_mask: Option<f64>,
    /// Textbook route: keep every n-th row.
    #[arg(long, value_name = "N")]
    pub(crate) decimation: Option<usize>,
    /// Parameters to keep as base parameters where there is a choice, comma separated.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) prefer: Vec<String>,
    /// Seed.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
