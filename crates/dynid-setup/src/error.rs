//! One error type for the pipeline, made of those of the rooms below.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// Why a run could not be done. [`Error::hint`] says what a user can do about it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// Logs that cannot be reduced, factors that cannot be merged or solved.
    #[error(transparent)]
    Reduction(#[from] crate::reduction_error::ReductionError),
    /// A robot file cannot be read.
    #[error(transparent)]
    RobotFile(#[from] dynid_robots::RobotFileError),
    /// The robot's structure is impossible.
    #[error("{file}: {source}")]
    Mechanism {
        /// Robot file.
        file: String,
        /// The fault.
        source: dynid_model::MechanismError,
    },
    /// The robot's loops cannot be closed, or its drives do not control it.
    #[error("{file}: {source}")]
    Loops {
        /// Robot file.
        file: String,
        /// The fault.
        source: Box<dynid_model::closed::ClosedError>,
    },
    /// A log or table of states in which a closed mechanism cannot be where its drives say.
    #[error("{file}: row {row}: {fault}")]
    Pose {
        /// Log file.
        file: String,
        /// Data row, from 1.
        row: usize,
        /// Why.
        fault: Box<dynid_model::closed::PoseError>,
    },
    /// A log cannot be read.
    #[error(transparent)]
    LogFile(#[from] dynid_logs::LogFileError),
    /// The inertias of a robot file cannot serve as a prior.
    #[error(transparent)]
    Prior(#[from] crate::prior::PriorError),
    /// Columns of a log do not fit the robot.
    #[error("{file}: {source}")]
    Columns {
        /// Log file.
        file: String,
        /// The fault.
        source: Box<dynid_logs::MappingError>,
    },
    /// Columns of a log do not fit the reading that an estimate records.
    #[error("{file}: {source}; columns are those by which the logs of {estimate} were read")]
    RecordedColumns {
        /// Log file.
        file: String,
        /// Estimate file.
        estimate: String,
        /// The fault.
        source: Box<dynid_logs::MappingError>,
    },
    /// Signals of a log contradict each other.
    #[error(transparent)]
    Log(#[from] dynid_motion::LogError),
    /// A states table cannot be read.
    #[error(transparent)]
    States(#[from] dynid_logs::StatesError),
    /// States lack a channel that the model reads.
    #[error("states: expected the channel `{channel}`, which the model reads, found none")]
    StatesChannel {
        /// Name of the channel.
        channel: String,
    },
    /// Positions look like degrees although radians are said.
    #[error("{file}: joint `{joint}`: position {largest:.1} rad {}: these look like degrees", limit.map_or_else(|| "is more than two turns".to_owned(), |l| format!("is far beyond the limit of {l:.2} rad")))]
    Degrees {
        /// Log file.
        file: String,
        /// Joint.
        joint: String,
        /// Largest position found.
        largest: f64,
        /// Limit of the robot file, rad.
        limit: Option<f64>,
    },
    /// A temperature that no joint has.
    #[error(
        "{file}: row {row}: joint `{joint}`: expected a temperature between -40 and 120 °C, found {found}"
    )]
    Temperature {
        /// Log file.
        file: String,
        /// Joint.
        joint: String,
        /// Data row, from 1.
        row: usize,
        /// Value found.
        found: f64,
    },
    /// A position that no joint reaches.
    #[error("{file}: joint `{joint}`: expected positions up to {limit:e} rad or m, found {largest:e}")]
    FarPosition {
        /// Log file.
        file: String,
        /// Joint.
        joint: String,
        /// Largest position accepted, rad or m.
        limit: f64,
        /// Largest position found.
        largest: f64,
    },
    /// A trajectory file cannot be used.
    #[error(transparent)]
    TrajectoryFile(#[from] dynid_logs::TrajectoryFileError),
    /// A trajectory file belongs to another robot.
    #[error("{file}: joints: expected {expected}, found {found}")]
    TrajectoryJoints {
        /// File.
        file: String,
        /// What fits the robot.
        expected: String,
        /// What the file has.
        found: String,
    },
    /// Numbered columns for more joints than the robot moves.
    #[error(
        "{file}: position: expected {expected} numbered columns, one per moving joint, found one more: `{column}`"
    )]
    SurplusColumn {
        /// Log file.
        file: String,
        /// Moving joints.
        expected: usize,
        /// The first column too many.
        column: String,
    },
    /// A log cannot be conditioned.
    #[error(transparent)]
    Conditioning(#[from] dynid_rows::conditioning::ConditioningError),
    /// The pre-flight found a log of which nonsense would come.
    #[error(
        "{}: {}{}: {}",
        .0.log,
        .0.id,
        .0.joint.as_ref().map_or_else(String::new, |j| format!(" of `{j}`")),
        .0.evidence
    )]
    PreflightFault(Box<crate::finding::Finding>),
    /// Two models that say nothing about each other.
    #[error("{a} and {b} cannot be compared: {fault}")]
    NotComparable {
        /// First file.
        a: String,
        /// Second file.
        b: String,
        /// Why.
        fault: String,
    },
    /// A log cannot be examined.
    #[error(transparent)]
    Preflight(#[from] dynid_rows::preflight::PreflightError),
    /// An element name is unknown.
    #[error("unknown element `{name}` for joint `{joint}`, expected one of {}", known.join(", "))]
    UnknownElement {
        /// The name.
        name: String,
        /// The joint.
        joint: String,
        /// Names that there are.
        known: Vec<String>,
    },
    /// An element setting is wrong.
    #[error("element `{element}` of joint `{joint}`: {fault}")]
    ElementSetting {
        /// Element.
        element: String,
        /// Joint.
        joint: String,
        /// What is wrong.
        fault: String,
    },
    /// Two elements of a joint that no motion can tell apart.
    #[error("elements `{first}` and `{second}` of joint `{joint}` depend on each other: {reason}")]
    EqualElements {
        /// Joint.
        joint: String,
        /// The element to leave out.
        first: String,
        /// The second of the two.
        second: String,
        /// Why.
        reason: String,
    },
    /// A coupling is wrong.
    #[error("coupling of joints {joints}: {fault}")]
    Coupling {
        /// Joints.
        joints: String,
        /// What is wrong.
        fault: String,
    },
    /// A joint cannot be elastic as it is stated.
    #[error("element `elastic` at joint `{joint}`: {fault}")]
    Elastic {
        /// Joint.
        joint: String,
        /// What is wrong.
        fault: crate::error::ElasticFault,
    },
    /// A joint that the run names does not exist.
    #[error("no joint is named `{name}`, the robot has {}", known.join(", "))]
    UnknownJoint {
        /// The name.
        name: String,
        /// Joints of the robot.
        known: Vec<String>,
    },
    /// A link that a bound names is no moving link of the robot.
    #[error("no moving link is named `{name}`{}, the robot has {}", welded_or_meant(name, welded_to.as_deref(), known), known.join(", "))]
    UnknownLink {
        /// The name.
        name: String,
        /// The link that it is welded to, if it is.
        welded_to: Option<String>,
        /// Moving links of the robot.
        known: Vec<String>,
    },
    /// A parameter that the run names does not exist.
    #[error("no parameter is named `{name}`{}", meant.as_ref().map_or_else(String::new, |m| format!(", did you mean `{m}`?")))]
    UnknownParameter {
        /// The name.
        name: String,
        /// A name that looks like it.
        meant: Option<String>,
    },
    /// A tie does not fit the model.
    #[error("tie {{ {tie} }}: {fault}")]
    Tie {
        /// The tie, as the file says it.
        tie: String,
        /// Why, in words.
        fault: String,
    },
    /// A law that is stated by formulas cannot be one.
    #[error("law `{name}`: {fault}")]
    Law {
        /// Its name.
        name: String,
        /// Why.
        fault: Box<dynid_robots::LawFault>,
    },
    /// The linear estimator has no estimate.
    #[error("estimator: {0}")]
    Linear(#[from] dynid_estimate::linear::LinearError),
    /// Shape parameters cannot be found.
    #[error("shape parameters: {0}")]
    Shapes(#[from] dynid_rows::conditioning::RefineError),
    /// No physically consistent parameters meet the bounds.
    #[error("consistent estimate: {0}")]
    Consistency(#[from] dynid_estimate::consistent::ProblemError),
    /// An on-line estimator cannot be set up.
    #[error("on-line estimator: {0}")]
    OnlineSettings(#[from] dynid_estimate::online::SettingsError),
    /// Rows that an on-line estimator cannot take.
    #[error("on-line estimator: {0}")]
    OnlineSample(#[from] dynid_estimate::online::SampleError),
    /// A configuration file cannot be parsed.
    #[error("{file}{}: {message}", line.map_or_else(String::new, |l| format!(":{l}")))]
    Config {
        /// File.
        file: String,
        /// Line, from 1.
        line: Option<usize>,
        /// What is wrong.
        message: String,
    },
    /// What a file says makes no sense.
    #[error("{file}: {source}")]
    InFile {
        /// File.
        file: String,
        /// What is wrong.
        source: Box<Error>,
    },
    /// A fault of a job that is built on identifications.
    #[error("{0}")]
    Job(Box<dyn Fault>),
    /// A trajectory cannot be made.
    #[error("trajectory: {0}")]
    Trajectory(#[from] dynid_motion::trajectory::TrajectoryError),
    /// A checkpoint belongs to another problem, or is none.
    #[error("{file}: not a checkpoint of this design: {message}")]
    Checkpoint {
        /// File.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// A virtual experiment cannot be run.
    #[error(transparent)]
    Experiment(#[from] dynid_sim::SimError),
    /// No joint of the robot has a known friction law.
    #[error("{file}: expected a friction law of {}, found {}", joints.join(", "), if stated.is_empty() { "none".to_owned() } else { format!("usable ones of none of these (joints of the file: {})", stated.join(", ")) })]
    NoKnownFriction {
        /// Where the laws come from.
        file: String,
        /// Joints there.
        stated: Vec<String>,
        /// Moving joints of the robot.
        joints: Vec<String>,
    },
    /// A coefficient of known friction makes no sense.
    #[error("{file}: joint `{joint}`: {fault}")]
    KnownFriction {
        /// Where the law comes from.
        file: String,
        /// Joint.
        joint: String,
        /// What is wrong.
        fault: String,
    },
    /// A setting has a value that makes no sense.
    #[error("setting `{name}`: expected {expected}, found {found}")]
    Setting {
        /// Name.
        name: String,
        /// What is accepted.
        expected: String,
        /// What was given.
        found: String,
    },
    /// A cut-off that a log's sample rate does not allow.
    #[error("{file}: setting `{name}`: expected less than {:.3} Hz (half the sample rate), found {found} Hz", 0.5 * rate_hz)]
    Cutoff {
        /// Log file.
        file: String,
        /// Name.
        name: String,
        /// Sample rate of the log, Hz.
        rate_hz: f64,
        /// What was given, Hz.
        found: f64,
    },
    /// The mechanism cannot be identified from joint logs.
    #[error("{0}")]
    Unsupported(String),
    /// No usable rows.
    #[error("{file}: {message}")]
    TooShort {
        /// Log.
        file: String,
        /// What is missing.
        message: String,
    },
    /// An estimate file cannot be read.
    #[error("{file}: not an estimate: {message}")]
    EstimateFile {
        /// File.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// A file cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// File.
        file: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// An output cannot be written.
    #[error(transparent)]
    Output(#[from] dynid_files::OutputError),
}

/// A fault of a job that is built on identifications, such as a friction experiment or an own estimator.
pub trait Fault: std::error::Error + Send + Sync + 'static {
    /// What a user can do about it.
    fn hint(&self) -> Option<String> {
        None
    }
}

impl Error {
    /// The fault of a job, if it is of this kind.
    pub fn job<T: Fault>(&self) -> Option<&T> {
        let Error::Job(fault) = self else { return None };
        let fault: &dyn std::error::Error = &**fault;
        fault.downcast_ref()
    }

    /// A setting whose value makes no sense.
    pub fn setting(name: &str, expected: &str, found: impl ToString) -> Self {
        Error::Setting { name: name.to_owned(), expected: expected.to_owned(), found: found.to_string() }
    }

    /// What a user can do about it.
    pub fn hint(&self) -> Option<String> {
        use dynid_estimate::consistent::ProblemError as P;
        use dynid_estimate::linear::LinearError as L;
        use dynid_model::MechanismError as M;
        use dynid_model::closed::{ClosedError as Loops, PoseError as Pose};
        use dynid_model::element::is_temperature;
        use dynid_rows::conditioning::ConditioningError as C;
        match self {
            Error::Reduction(e) => e.hint(),
            Error::RobotFile(e) => e.hint(),
            Error::LogFile(e) => e.hint(),
            Error::PreflightFault(found) => Some(format!(
                "{}: `dynid check` with `--fix FILE.toml` writes the configuration; `preflight = \"warn\"` goes on regardless; `dynid explain {}` says \
                 more",
                found.remedy, found.id
            )),
            Error::NotComparable { .. } => Some(
                "compare an estimate with one of the same robot, identified with the same joints held, or with its robot file".to_owned(),
            ),
            Error::Elastic { fault, .. } => Some(fault.hint().to_owned()),
            Error::Job(e) => e.hint(),
            Error::NoKnownFriction { .. } => Some(
                "a friction file of this robot names its joints; laws with status `invalid` are not used".to_owned(),
            ),
            Error::KnownFriction { .. } => Some("run `dynid friction` again, or correct the coefficient".to_owned()),
            Error::EqualElements { first, .. } => Some(format!("leave out one `{first}`")),
            Error::Checkpoint { .. } => Some("delete the file, or name another one".to_owned()),
            Error::Columns { source, .. } => source.hint(),
            Error::RecordedColumns { .. } => Some(
                "give a configuration whose [columns] name those of this log (--config FILE.toml), or name the log's columns as the \
                 training logs had them"
                    .to_owned(),
            ),
            Error::States(e) => e.hint(),
            Error::StatesChannel { .. } => {
                Some("read the states with it: a column of this name, temperatures in degrees Celsius".to_owned())
            }
            Error::Output(e) => e.hint(),
            Error::Prior(_) => Some(
                "correct the mass; a link without an inertia gets a default body as its prior".to_owned(),
            ),
            Error::TrajectoryFile(e) => e.hint(),
            Error::TrajectoryJoints { .. } => {
                Some("use the trajectory that this robot ran, with the joint names of its robot file".to_owned())
            }
            Error::Conditioning(C::ShorterThanPeriod { .. }) => Some(
                "record at least one whole period, or leave out `trajectory` and `period_s`: any motion will do then"
                    .to_owned(),
            ),
            Error::Conditioning(C::FewPeriods { .. }) => Some(
                "record two periods or more, or leave out `average_periods`: Fourier series need one".to_owned(),
            ),
            Error::Conditioning(C::PeriodOffGrid { .. }) => Some(
                "leave out `average_periods` and take `smoothing = \"frequency\"`, which needs no whole number of samples"
                    .to_owned(),
            ),
            Error::Conditioning(C::NoPeriod { .. }) => {
                Some("state `period_s` or `trajectory` of the log, or take another `smoothing`".to_owned())
            }
            Error::Conditioning(C::OtherPeriod { .. }) => {
                Some("check that the log belongs to the trajectory; `part` can leave out what does not repeat".to_owned())
            }
            Error::Degrees { .. } => Some(
                "state the unit: `q1[deg]` in the header, or `[columns] position = { columns = \"q{}\", unit = \"deg\" }`"
                    .to_owned(),
            ),
            Error::Mechanism { source, .. } => Some(match source {
                M::Cycle { .. } => "cut the loop: a URDF is a tree".to_owned(),
                M::ManyRoots { .. } => "join the roots by fixed joints, or remove links that hang on nothing".to_owned(),
                M::ZeroAxis { .. } => "give <axis xyz=\"..\"/> a direction such as 0 0 1".to_owned(),
                M::MissingLink { .. } => "add the link, or correct its name in the joint".to_owned(),
                M::TwoParents { .. } => "a link hangs on one joint only; remove one of the two".to_owned(),
                M::NothingMoves { .. } => "a model needs at least one joint that is not fixed".to_owned(),
                M::TooManyJoints { .. } => "lock joints that do not move, or split the robot".to_owned(),
                _ => return None,
            }),
            Error::Loops { source, .. } => Some(match source.as_ref() {
                Loops::NotClosed { .. } => "check the frames of the loop (lengths in m, angles in rad) and give `home` near a closed pose".to_owned(),
                Loops::UnderActuated { .. } => "name more joints in `actuated`, or lock what does not move".to_owned(),
                Loops::Dependent { .. } => "name other joints in `actuated`".to_owned(),
                Loops::SingularHome { .. } => "give a `home` away from the singular pose".to_owned(),
                _ => return None,
            }),
            Error::Pose { fault, .. } => Some(match fault.as_ref() {
                Pose::Singular { .. } => "leave out this part of the log (`part`), or plan a motion that stays away from singular poses".to_owned(),
                _ => "check the units, signs and zeros of the position columns, the lengths of the robot file, and that `home` is of the assembly mode of the log".to_owned(),
            }),
            Error::Conditioning(C::NothingMoves { .. }) => {
                Some("a model of motion needs motion: check the columns, or record an excitation trajectory (`dynid design` makes one)".to_owned())
            }
            Error::Conditioning(C::ConstantEffort { .. }) => {
                Some("check that the effort column is the measured torque or current of this joint".to_owned())
            }
            Error::Conditioning(C::NoRows { .. }) => {
                Some("record a longer motion, or set a higher `kernel_hz`".to_owned())
            }
            Error::Temperature { .. } => Some(
                "state the unit: `[columns] temperature = { columns = \"temp{}\", unit = \"K\" }` (or \"F\")".to_owned(),
            ),
            Error::Conditioning(C::MissingChannel { channel, .. }) => is_temperature(channel).then(|| {
                "name the column under [columns] (`temperature`), or state a constant one: in the [[log]], of known friction under [elements], \
                 `temperature = 30`, of an element in the robot file, `exponential_viscous = { temperature = 30 }`"
                    .to_owned()
            }),
            Error::FarPosition { .. } => Some(
                "encoder counts need a scale: `[columns] position = { columns = \"q{}\", scale = .. }`".to_owned(),
            ),
            Error::SurplusColumn { .. } => Some(
                "the log belongs to another robot, or joints are locked: say which column is which joint's under [columns]"
                    .to_owned(),
            ),
            Error::Conditioning(C::Clock(dynid_motion::ClockError::TooFewSamples { .. })) => {
                Some("record a longer log; samples whose time does not advance do not count".to_owned())
            }
            Error::Log(dynid_motion::LogError::TooFewRows { .. }) => {
                Some("record a longer log, or widen its `rows` or `part`".to_owned())
            }
            Error::Conditioning(C::Clock(_)) => {
                Some("check the time column; `rate_hz` in [columns] states a sample rate instead".to_owned())
            }
            Error::Conditioning(C::Signal(_)) => Some("record a longer log, or set cut-offs below half the sample rate".to_owned()),
            Error::UnknownElement { name, known, .. } => {
                let meant = dynid_files::closest(name, known);
                let meant = meant.map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
                Some(format!(
                    "{meant}elements are given by --elements, under [elements] in a configuration, under [defaults] and \
                     [element.<joint>] in a robot file; a law of your own stands there under `[law.NAME]`, one of a program's own is known to that program alone"
                ))
            }
            Error::EstimateFile { .. } => {
                Some("an estimate is the estimate.json that `dynid identify` writes".to_owned())
            }
            Error::Read { source, .. } => Some(match source.kind() {
                std::io::ErrorKind::NotFound => "check the path".to_owned(),
                _ => "check that the path is a text file and may be read".to_owned(),
            }),
            Error::TooShort { .. } => Some("record a longer motion".to_owned()),
            Error::UnknownLink { .. } => {
                Some("[[bound]] is for moving links; each stands for everything welded to it".to_owned())
            }
            Error::UnknownParameter { .. } => {
                Some("`dynid inspect ROBOT` lists links and joints; parameters are `<link>.Izz`, `<joint>.fc`".to_owned())
            }
            Error::Law { .. } => Some(dynid_robots::LawFault::HINT.to_owned()),
            Error::Tie { .. } => Some(
                "`[[tie]]` has `equal = [\"j1\", \"j2\"]`, `ratio = { \"j1.fc\" = 1, \"j2.fc\" = 2 }`, `sum = { \"a.m\" = 1, \"b.m\" = 1 }` with `value`, \
                 `known = { \"a.m\" = 2.5 }` or `massless = [\"a\"]`"
                    .to_owned(),
            ),
            Error::Consistency(P::Contradiction { .. } | P::Infeasible { .. }) => {
                Some("drop or widen one of the bounds under [[bound]]; limits are in kg, m and the parameter's unit".to_owned())
            }
            Error::Linear(L::Tls(_)) => Some(
                "use `wls`, or state larger noise only for columns that have it under [estimator] column_noise".to_owned(),
            ),
            Error::InFile { source, .. } => source.hint(),
            Error::Setting { name, .. } => setting_hint(name).map(str::to_owned),
            Error::Cutoff { .. } => Some("set a cut-off below half the sample rate".to_owned()),
            _ => None,
        }
    }
}

/// Why a link does not move, or which one was meant.
fn welded_or_meant(name: &str, welded_to: Option<&str>, known: &[String]) -> String {
    match (welded_to, dynid_files::closest(name, known)) {
        (Some(link), _) => format!(" (it is welded to `{link}`)"),
        (None, Some(link)) => format!(" (did you mean `{link}`?)"),
        (None, None) => String::new(),
    }
}

/// What a user can do about a setting that makes no sense.
fn setting_hint(name: &str) -> Option<&'static str> {
    Some(match name {
        _ if name.starts_with("channels.") => {
            "for example `channels = { temperature = [[0, 20], [600, 35]] }`: time in s, value; `temperature_<joint>` for one joint"
        }
        "log" => {
            "`[[log]]` with `path = \"log.csv\"`; in the library `log: vec![LogConfig { path, ..LogConfig::default() }]`"
        }
        "robot" => "`robot = \"robot.urdf\"`, a URDF, an MJCF, an SDF, each as xacro too, or a robot in TOML",
        "bound" => {
            "for example `links = [\"forearm\"]`, `mass = [0.5, 2.0]`; one entry of [[bound]] for each subject"
        }
        "bound.links" => "the total mass counts a link as often as it is named",
        "consistency" => "drop the bounds, or `none`: only a consistent estimate is bounded",
        "prior" => "use `consistency = \"pseudo-inertia\"`, or leave `prior` out",
        "prior_weight" => "leave it out: held-out folds then say how much the robot file may count",
        "ridge_weight" => "leave it out: 1 is a Gaussian prior; less trusts the robot file less",
        "capsule" => "give the base, or an obstacle that stands on it, a capsule of its own",
        "criterion.name" => {
            "leave `name` out, or state inertias: `dynid inspect ROBOT` shows what the file holds"
        }
        "effort_noise" => "state it under [estimator], in N m or N",
        _ if name.starts_with("bound.") => "`-inf` and `inf` leave one side open: `mass = [0.5, inf]`",
        _ if name.starts_with("limits.velocity.") => {
            "for example `velocity = 1.5` or `velocity = { j1 = 1.5 }` under [limits], or a limit in the robot file"
        }
        _ if name.starts_with("limits.position.") => {
            "for example `position = { j1 = [-1.0, 1.0] }` under [limits], or a limit in the robot file"
        }
        "trajectory.start_pose" => {
            "a start pose names every joint that moves; leave it out to let the search choose"
        }
        _ if name.starts_with("trajectory.parking.") => {
            "a pose within the limits; joints left out are at zero or the nearest position within theirs"
        }
        "payload" => {
            "for example `[[payload]]` with `name = \"tool\"`, and `payload = \"tool\"` in the logs that carry it"
        }
        _ if name.starts_with("payload.") && name.ends_with(".link") => {
            "`dynid inspect ROBOT` shows the links that move; a payload is mounted on one of them"
        }
        _ if name.starts_with("payload.") => {
            "`[[payload]]` states `name`, `link`, `rated_mass`, and what is known: `mass`, `mass_std`, `com`, `inertia`; logs say `payload = \"name\"`"
        }
        "validation.like" | "validation.own" | "log.like" => {
            "a validation log says `like = \"name\"` with the name (or file name) of the `[[log]]` whose own terms it shares"
        }
        "log.name" => "the default is the file's name up to its first dot",
        _ if name.starts_with("column_noise.") => {
            "a name of `dynid inspect ROBOT` among the base parameters with a standard deviation; 0: exact"
        }
        _ => return None,
    })
}

/// Why a joint cannot be elastic as it is stated.
#[derive(Debug, Clone, PartialEq)]
pub enum ElasticFault {
    /// The joint floats.
    Floats,
    /// The joint does not move.
    Fixed,
    /// The joint follows another joint, or others follow it.
    Follows,
    /// The motor is one of a coupling of joints.
    Coupled,
    /// The joint has a sensor, but bodies act on other joints, which have none.
    OthersWithoutSensor(Vec<String>),
    /// `elastic` is among its elements, but nothing states the ratio.
    NoRatio,
    /// The position of the joint is logged, that of its motor is not.
    MotorNotLogged(String),
}

impl fmt::Display for ElasticFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ElasticFault::Floats => f.write_str("expected a joint with one coordinate, found a floating one"),
            ElasticFault::Fixed => f.write_str("expected a joint that moves, found a fixed one"),
            ElasticFault::Follows => f.write_str(
                "expected a joint that moves by itself, found one that is coupled to others (mimic)",
            ),
            ElasticFault::Coupled => f.write_str(
                "expected a motor of its own, found one of a `[[coupling]]`, which has stiff gears",
            ),
            ElasticFault::OthersWithoutSensor(joints) => {
                write!(f, "expected a sensor at every joint or at none, found none at {}", joints.join(", "))
            }
            ElasticFault::NoRatio => f.write_str("expected a ratio, found none"),
            ElasticFault::MotorNotLogged(motor) => {
                write!(f, "expected position and effort of its motor `{motor}` in the log, found none")
            }
        }
    }
}

impl ElasticFault {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            ElasticFault::Floats | ElasticFault::Fixed | ElasticFault::Follows => {
                "leave `elastic` out: the joint counts as stiff then"
            }
            ElasticFault::Coupled => "leave out the coupling, or `elastic`",
            ElasticFault::OthersWithoutSensor(_) => {
                "a measured torque takes the place of the bodies behind it: state `sensor = true` at all joints, lock the others, \
                 or leave `sensor` out"
            }
            ElasticFault::NoRatio => {
                "state it in the robot file: `[element.<joint>] elastic = { ratio = 100 }`"
            }
            ElasticFault::MotorNotLogged(_) => {
                "without it the deformation is not seen: name its columns under [columns], or leave `elastic` out"
            }
        }
    }
}
