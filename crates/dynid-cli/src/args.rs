//! Arguments.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use dynid::estimate::Split;

/// Identifies the dynamic parameters of robots and mechanisms from logs of motion and effort.
#[derive(Debug, Parser)]
#[command(name = "dynid", version, about, propagate_version = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show a robot's tree, its parameters and which combinations of them can be identified.
    Inspect(InspectArgs),
    /// Effort and regressor rows at given states.
    Regressor(RegressorArgs),
    /// Pre-flight of logs: clock, joint order, signs, units, delay, saturation, excitation (exit code 1 on an error).
    Check(CheckArgs),
    /// Every applicable estimator on the same logs, ranked on held-out time.
    Compare(CompareArgs),
    /// Identify a robot from logs: writes estimate.json, report.html and an updated robot file.
    Identify(Box<IdentifyArgs>),
    /// Effort of an identified model at given states.
    Predict(PredictArgs),
    /// Design an excitation trajectory within all limits: writes trajectory files, design.json and report.html.
    Design(Box<DesignArgs>),
    /// Friction from constant-speed tests and pre-sliding motion: writes friction.json and report.html.
    Friction(FrictionTestArgs),
    /// Make a virtual log: by inverse dynamics, or of a controlled robot.
    Simulate(SimulateArgs),
    /// Compare an identified model with other logs.
    Validate(ValidateArgs),
    /// Clearances of an identified robot's joints from a log: by probes at the journals, by their swing in the effort.
    Clearance(ClearanceArgs),
    /// Backlash of an identified robot's drives from ordinary logs: what gaps would have done to the effort.
    Backlash(BacklashArgs),
    /// Payloads from logs with and without them: mass, centre of mass, inertia; writes payload.json, payload.html and a URDF
    /// link.
    Payload(PayloadArgs),
    /// Drive gains from logs with and without a payload of known mass.
    Gains(GainsArgs),
    /// Follow a stream or logs: estimates as JSON lines, alarms when something changes (exit code 1).
    Online(OnlineArgs),
    /// Published systems, every claim of their papers beside what is measured here.
    Study(StudyArgs),
    /// Put identified parameters into a robot file: URDF, MJCF or JSON, read back and checked before it is written.
    Export(ExportArgs),
}

/// How a robot file is read.
#[derive(Debug, Args)]
pub(crate) struct RobotArgs {
    /// Robot file: URDF, or TOML with DH rows or bodies.
    pub(crate) robot: PathBuf,
    /// Put a floating joint under the root link.
    #[arg(long)]
    pub(crate) floating_base: bool,
    /// Let mimic joints follow their leaders (default: every joint is a coordinate of its own).
    #[arg(long)]
    pub(crate) couple_mimics: bool,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    /// Gravity in base axes, m/s² (default: the robot file's, else 0,0,-9.81).
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub(crate) gravity: Option<[f64; 3]>,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    pub(crate) robot: RobotArgs,
    /// Elements at every joint, comma separated; `none`: rigid bodies alone (default: the robot file's, else none).
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) elements: Option<Vec<String>>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

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
    pub(crate) config: PathBuf,
    /// Read samples from stdin, one per line, instead of the configuration's logs.
    #[arg(long, value_name = "FORMAT")]
    pub(crate) stream: Option<StreamArg>,
    /// Log to follow instead of those of the configuration; may be given more than once.
    #[arg(long, value_name = "FILE", conflicts_with = "stream")]
    pub(crate) log: Vec<PathBuf>,
    /// Write the state to this file, and go on from it if it exists (default: the configuration's).
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// The stream begins again from its start: pass over what the checkpoint has seen (logs always do).
    #[arg(long, requires = "stream")]
    pub(crate) replay: bool,
    /// Print JSON lines on a terminal too, in place of the live view.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say nothing but data and errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RegressorArgs {
    #[command(flatten)]
    pub(crate) robot: RobotArgs,
    /// States: CSV with q, dq, ddq (`q_<joint>` or `q1..`), optional gx, gy, gz.
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) states: PathBuf,
    /// Give base columns instead of standard ones.
    #[arg(long, requires = "json")]
    pub(crate) base: bool,
    /// Print JSON (joints, columns, effort, regressor); without it only efforts, as CSV.
    #[arg(long)]
    pub(crate) json: bool,
}

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
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Logs, CSV or CSV.gz, together with --robot; or a configuration (TOML), whose logs are examined.
    #[arg(required = true, value_name = "LOG | CONFIG")]
    pub(crate) input: Vec<PathBuf>,
    /// Robot file: URDF or TOML.
    #[arg(long, value_name = "ROBOT")]
    pub(crate) robot: Option<PathBuf>,
    /// Write the configuration that applies the remedies.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) fix: Option<PathBuf>,
    /// Write the report page.
    #[arg(long, value_name = "FILE.html")]
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
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but results and errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Configuration (TOML), or a robot file together with --log.
    pub(crate) input: PathBuf,
    /// Log, CSV or CSV.gz; repeat for several.
    #[arg(long, value_name = "LOG")]
    pub(crate) log: Vec<PathBuf>,
    /// Write the report page.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but results and errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct IdentifyArgs {
    /// Configuration (TOML), or a robot file together with --log.
    pub(crate) input: PathBuf,
    /// Log to identify from, CSV or CSV.gz; repeat for several.
    #[arg(long, value_name = "LOG")]
    pub(crate) log: Vec<PathBuf>,
    /// Log to validate on; repeat for several.
    #[arg(long, value_name = "LOG")]
    pub(crate) validate: Vec<PathBuf>,
    /// Output folder (default: dynid-out).
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Elements at every joint that moves, comma separated; `none`: rigid bodies alone (default: the robot file's, else
    /// coulomb,viscous,offset,rotor).
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) elements: Option<Vec<String>>,
    /// Friction of joints that have any: shapes found on held-out data, or one law for all.
    #[arg(long, value_enum)]
    pub(crate) friction: Option<FrictionArg>,
    /// Friction file of `dynid friction`: its laws count as known, and what is identified of friction are their errors.
    #[arg(long, value_name = "FILE")]
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
    /// Print the estimate as JSON to stdout as well.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say only what went wrong.
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
    /// estimate.json
    pub(crate) estimate: PathBuf,
    #[command(flatten)]
    pub(crate) split: SplitArgs,
    /// States: CSV with q, dq, ddq, optional gx, gy, gz.
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) states: PathBuf,
    /// Output CSV (default: stdout).
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum CriterionArg {
    /// Mean square of the relative standard deviations of the base parameters.
    RelativeStd,
    /// Condition number of the columns at unit length.
    UnitCondition,
    /// Condition number of the columns in SI units.
    Condition,
    /// w1 condition + w2 / smallest singular value.
    Mix,
    /// Mean variance.
    A,
    /// Determinant of the information.
    D,
    /// Smallest singular value.
    E,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum ColumnsArg {
    /// All base parameters: bodies, rotors, friction, offsets.
    All,
    /// Base parameters of the rigid bodies alone.
    Inertial,
}

#[derive(Debug, Args)]
pub(crate) struct DesignArgs {
    /// Configuration (TOML), or a robot file.
    pub(crate) input: PathBuf,
    /// Output folder (default: dynid-design).
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Period, s (default: 20).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(crate) period: Option<f64>,
    /// Harmonics (default: 5).
    #[arg(long, value_name = "N")]
    pub(crate) harmonics: Option<usize>,
    /// Recorded periods (default: 1).
    #[arg(long, value_name = "N")]
    pub(crate) periods: Option<usize>,
    /// Rate of commanded and recorded samples, Hz (default: 500).
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) rate_hz: Option<f64>,
    /// Let the motion start and end at speed instead of at rest.
    #[arg(long)]
    pub(crate) no_rest: bool,
    /// Come from the zero pose (or the nearest within the limits) and go back to it; `[trajectory] parking` names others.
    #[arg(long)]
    pub(crate) park: bool,
    /// Largest acceleration of all joints, rad/s² or m/s² (default: full speed in half a second).
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    pub(crate) acceleration: Option<f64>,
    /// Share of the robot file's limits that may be used (default: 1).
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub(crate) share: Option<f64>,
    /// What is minimised (default: relative-std, without inertias in the robot file unit-condition).
    #[arg(long, value_enum)]
    pub(crate) criterion: Option<CriterionArg>,
    /// Parameters that count (default: all).
    #[arg(long, value_enum)]
    pub(crate) columns: Option<ColumnsArg>,
    /// Standard deviation of the effort's noise at all joints, N m or N.
    #[arg(long, value_name = "STD", allow_negative_numbers = true)]
    pub(crate) noise: Option<f64>,
    /// Trajectory that is recorded as well, so that its information counts; repeat for several.
    #[arg(long, value_name = "TRAJECTORY.json")]
    pub(crate) earlier: Vec<PathBuf>,
    /// Elements at every joint, comma separated; `none`: rigid bodies alone.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) elements: Option<Vec<String>>,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    /// Let links go below the floor (default: the plane through the origin of the base, across gravity).
    #[arg(long)]
    pub(crate) no_floor: bool,
    /// Height of the floor above the origin of the base, m (default: 0).
    #[arg(long, value_name = "M", allow_negative_numbers = true, conflicts_with = "no_floor")]
    pub(crate) floor_height: Option<f64>,
    /// Let links of the robot come near each other.
    #[arg(long)]
    pub(crate) no_self_collision: bool,
    /// Least distance between links, and from the floor, m (default: 0.02).
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) margin: Option<f64>,
    /// Folder that holds packages, for `package://NAME/...` of meshes; repeat for several.
    #[arg(long, value_name = "DIR")]
    pub(crate) package_dir: Vec<PathBuf>,
    /// Random starts (default: 16).
    #[arg(long, value_name = "N")]
    pub(crate) starts: Option<usize>,
    /// Seed of the first start (default: 1).
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Begin no start after this time, and end those that began, s (default: all run).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(crate) time_budget: Option<f64>,
    /// File that keeps finished starts, so that a run can be taken up again.
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Print design.json to stdout as well.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say only what went wrong.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct FrictionTestArgs {
    /// Configuration (TOML).
    pub(crate) input: PathBuf,
    /// Output folder (default: dynid-friction).
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print friction.json to stdout as well.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say only what went wrong.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct PayloadArgs {
    /// Configuration (TOML) with a `[[payload]]`, a `[[log]]` that carries it and one that does not.
    pub(crate) input: PathBuf,
    /// Output folder (default: the configuration's, else dynid-payload).
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print payload.json to stdout in place of the table.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say only what went wrong.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct GainsArgs {
    /// Configuration (TOML) with one `[[payload]]` of known mass, a `[[log]]` that carries it and one that does not.
    pub(crate) input: PathBuf,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say only what went wrong.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    #[command(flatten)]
    pub(crate) robot: RobotArgs,
    /// Settings of the virtual log, TOML.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,
    /// Let a controller move the robot, with all imperfections (default: inverse dynamics of the trajectory).
    #[arg(long)]
    pub(crate) closed_loop: bool,
    /// Follow a trajectory file, approach and return included (`dynid design` writes them).
    #[arg(long, value_name = "TRAJECTORY.json")]
    pub(crate) follow: Option<PathBuf>,
    /// Length, s.
    #[arg(long, value_name = "S", allow_negative_numbers = true, conflicts_with = "follow")]
    pub(crate) duration: Option<f64>,
    /// Sample rate, Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) rate_hz: Option<f64>,
    /// Noise of the effort, share of its rms.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub(crate) effort_noise: Option<f64>,
    /// Encoder resolution, bits per turn; 0: exact.
    #[arg(long, value_name = "BITS")]
    pub(crate) encoder_bits: Option<u32>,
    /// Noise of the logged offsets of journals in their bearings (joints with clearance), m.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) journal_noise: Option<f64>,
    /// Seed of trajectory and noise.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Output log, CSV or CSV.gz.
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) out: PathBuf,
    /// Also write the true states and efforts.
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) clean: Option<PathBuf>,
    /// Also write the true parameters, JSON.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) truth: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ValidateArgs {
    /// estimate.json
    pub(crate) estimate: PathBuf,
    #[command(flatten)]
    pub(crate) split: SplitArgs,
    /// Log to compare with; repeat for several.
    #[arg(long, value_name = "LOG", required = true)]
    pub(crate) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Cut-off of the filter for the filtered figures, Hz (default: the kernel's).
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) filter_hz: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BacklashArgs {
    /// estimate.json of the robot: link parameters for the loads, friction for the residual.
    pub(crate) estimate: PathBuf,
    /// Log to look at; repeat for several (default: the training logs of the configuration).
    #[arg(long, value_name = "LOG", required_unless_present = "config")]
    pub(crate) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Print JSON, with the evidence at every load at which flanks may part.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ClearanceArgs {
    /// Robot file whose joints state a clearance; the gap is a guess.
    pub(crate) robot: PathBuf,
    /// estimate.json of the same robot: link parameters for the loads, friction for the residual.
    pub(crate) estimate: PathBuf,
    /// Log; columns journal_<joint>_x and journal_<joint>_y hold offsets of journals in axes that turn with their links, m.
    #[arg(long, value_name = "LOG")]
    pub(crate) log: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// estimate.json
    pub(crate) estimate: PathBuf,
    /// Robot file that was identified (default: the path that the estimate names).
    #[arg(long, value_name = "FILE")]
    pub(crate) robot: Option<PathBuf>,
    /// Write a URDF: inertias, viscous and Coulomb friction; a URDF is edited in place, all else stays byte for byte.
    #[arg(long, value_name = "FILE.urdf")]
    pub(crate) urdf: Option<PathBuf>,
    /// Write an MJCF for MuJoCo: the same, rotor inertias, gravity, a motor per joint.
    #[arg(long, value_name = "FILE.xml")]
    pub(crate) mjcf: Option<PathBuf>,
    /// Write links and joints as compact JSON.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
    /// Log to compare efforts on, CSV or CSV.gz; repeat for several (default: random states within the limits).
    #[arg(long, value_name = "LOG")]
    pub(crate) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: LogArgs,
    /// Configuration whose [columns] and [motor_side] the logs follow.
    #[arg(long, value_name = "FILE.toml", requires = "log")]
    pub(crate) config: Option<PathBuf>,
    /// Write links that no body could be all the same; simulators refuse them.
    #[arg(long)]
    pub(crate) allow_unphysical: bool,
}

fn joint_value(text: &str) -> Result<(String, f64), String> {
    let (joint, value) = text.split_once('=').ok_or("expected JOINT=POSITION")?;
    let value: f64 = value.parse().map_err(|_| format!("expected a number after `=`, found `{value}`"))?;
    if value.is_finite() { Ok((joint.to_owned(), value)) } else { Err("expected a finite number".to_owned()) }
}

fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|x| x.trim().parse().map_err(|_| format!("expected three numbers X,Y,Z, found `{text}`")))
        .collect::<Result<_, _>>()?;
    <[f64; 3]>::try_from(numbers)
        .ok()
        .filter(|v| v.iter().all(|x| x.is_finite()))
        .ok_or_else(|| format!("expected three finite numbers X,Y,Z, found `{text}`"))
}

fn row_range(text: &str) -> Result<(usize, usize), String> {
    let fault = || format!("expected FIRST:LAST, found `{text}`");
    let (first, last) = text.split_once(':').ok_or_else(fault)?;
    Ok((first.parse().map_err(|_| fault())?, last.parse().map_err(|_| fault())?))
}

#[derive(Debug, Args)]
pub(crate) struct StudyArgs {
    /// Name of the study; `list` shows all.
    pub(crate) name: String,
    /// Folder for study.json and report.html (default: `dynid-study-NAME`).
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Keep every row, shrink statistics: under a minute.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Print nothing but results and errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}
