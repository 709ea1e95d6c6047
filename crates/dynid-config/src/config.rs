//! The configuration of a run, a TOML file.

mod instruments;
mod kind;
mod online;
mod settings;
pub mod toml_file;

pub use instruments::{InstrumentsConfig, ReferenceColumns};
pub use kind::is_configuration;
pub use online::{ForgettingRule, OnlineConfig};

pub use dynid_identify::estimate::MotorSide;
pub use dynid_identify::settings::{
    BoundConfig, Clearance, ConditioningConfig, Consistency, EstimatorConfig, Friction, FrictionErrors,
    Method, NominalModel, Own, PayloadConfig, PerJoint, Preflight, PriorDistance, RATED_MASS, Route,
    ShapeConfig, Variances,
};

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_logs::MappingSpec;
use dynid_model::element::ElementRegistry;
use dynid_robots::{CouplingForm, LawSpec, TieSpec};
use serde::{Deserialize, Serialize};

use dynid_identify::Error;
use dynid_identify::settings::lists;

/// What is to be identified from which logs, and how. Every key but `robot` and `log` has a default.
#[derive(Debug, Clone, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The file that the configuration was read from; `None` if it was put together.
    #[serde(skip)]
    pub file: Option<PathBuf>,
    /// The kinds of elements that joints may have; no key: a program puts those of its own here.
    #[serde(skip)]
    pub registry: ElementRegistry,
    /// Robot file (URDF, MJCF, SDF, each as xacro too, or TOML), relative to the configuration.
    pub robot: PathBuf,
    /// Output folder, relative to the configuration. Without it the program writes to `dynid-out` in the current folder.
    pub out: Option<PathBuf>,
    /// Seed of everything random (states of the structural analysis). Default 1.
    pub seed: Option<u64>,
    /// Gravity in base axes, m/s². Default: the robot file's, else 0 0 -9.81.
    #[serde(deserialize_with = "lists::exactly")]
    pub gravity: Option<[f64; 3]>,
    /// Couple mimic joints to their leaders. Default false.
    pub couple_mimics: Option<bool>,
    /// Joints held at a position, rad or m; their links are merged.
    pub locked: BTreeMap<String, f64>,
    /// Elements per joint.
    pub elements: ElementsConfig,
    /// Laws of friction that are stated by formulas, besides those of the robot file; `[elements]` may name them.
    pub law: BTreeMap<String, LawSpec>,
    /// Couplings of joints, besides those of the robot file.
    pub coupling: Vec<CouplingConfig>,
    /// Parameters that are known, or multiples or sums of others, besides those of the robot file; a list of names says that they are equal.
    pub tie: Vec<TieSpec>,
    /// Columns of all logs; a log may bring its own.
    pub columns: MappingSpec,
    /// Logs hold motor positions and motor efforts behind a transmission matrix.
    pub motor_side: Option<MotorSide>,
    /// Conditioning.
    pub conditioning: ConditioningConfig,
    /// The size of the efforts is right, whatever the robot file, its effort limits and other arms say of it: the pre-flight then
    /// tells the difference without a warning. Default false.
    pub known_effort_scale: bool,
    /// Masses that were weighed, kg, by the name of the payload or link: the identified ones against them tell the scale of the efforts. They
    /// are no prior. Default: none.
    pub known_mass: BTreeMap<String, f64>,
    /// What the pre-flight of the training logs may do. Default `refuse`.
    pub preflight: Preflight,
    /// Estimator.
    pub estimator: EstimatorConfig,
    /// Closed loop of the logs, for instrumental variables and the test of least squares against them. Default: none.
    pub instruments: Option<InstrumentsConfig>,
    /// Bounds on masses, centres of mass and parameters.
    pub bound: Vec<BoundConfig>,
    /// Columns to keep as base parameters where there is a choice, by name (`link2.Izz`) or symbol (`Izz2`).
    pub preferred: Vec<String>,
    /// Take elastic joints without torque sensors as stiff ones, read at their motors, even where rows of links and motors bear a stiffness out;
    /// their stiffness is that of their deformation. `dynid reduce` does so by itself. Default false.
    pub stiff_joints: bool,
    /// Trajectory file of every `[[log]]` that states neither `trajectory` nor `period_s` of its own.
    pub trajectory: Option<PathBuf>,
    /// Period of every `[[log]]` that states neither, s.
    pub period_s: Option<f64>,
    /// Bodies that some logs carry.
    pub payload: Vec<PayloadConfig>,
    /// Logs to identify from.
    pub log: Vec<LogConfig>,
    /// Logs to validate on.
    pub validation: Vec<LogConfig>,
    /// On-line identification; nothing else looks at it.
    pub online: OnlineConfig,
}

/// Elements at joints.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ElementsConfig {
    /// For every joint about which nothing else is said.
    pub default: Option<Vec<String>>,
    /// For single joints.
    pub joint: BTreeMap<String, Vec<String>>,
    /// Friction in place of that of the lists, or shapes found beside it. Default `auto`.
    pub friction: Friction,
    /// Friction file whose laws are known: their efforts are taken off, and what remains of Coulomb and viscous friction and
    /// offset of these joints are errors of the laws. Relative to the configuration. Shapes are then found at other joints
    /// alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub known_friction: Option<PathBuf>,
    /// Sign of the errors of known friction. Default `free`.
    #[serde(skip_serializing_if = "is_default")]
    pub friction_errors: FrictionErrors,
    /// Constant temperature of joints with known friction in place of the logged one, °C. Default: none.
    #[serde(skip_serializing_if = "is_default")]
    pub temperature: PerJoint,
    /// Joints whose robot file states clearance: `journals` move in their bearings, as probes say or as their loads press them; `ideal`
    /// joints have friction elements in place of the bearings'. Default `journals`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance: Option<Clearance>,
}

/// Motor-side inertia and friction of joints that share motors; see the robot file's `[[coupling]]`.
#[derive(Debug, Clone, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct CouplingConfig {
    /// Motors, one per row.
    pub motors: Vec<String>,
    /// Joints, one per column.
    pub joints: Vec<String>,
    /// Transmission matrix, motor speeds from joint speeds.
    pub matrix: Vec<Vec<f64>>,
    /// `strict` (one inertia and friction per motor) or `columns` (three coupling terms beside the joints' own).
    #[serde(default)]
    pub form: CouplingForm,
}

/// One log file.
#[derive(Debug, Clone, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct LogConfig {
    /// File, relative to the configuration; `FILE#MEMBER`: an episode, a group, or topics of it. A pattern (`runs/*.csv`), a folder or a list
    /// (`runs.manifest`) stands for several logs, to each of which the other keys apply.
    pub path: PathBuf,
    /// First and last data row, from 1, both included. Default: all.
    #[serde(deserialize_with = "lists::pair")]
    pub rows: Option<(usize, usize)>,
    /// First and last part of the record to use, as shares of its rows, e.g. `[0.0, 0.7]`. Default: all.
    #[serde(deserialize_with = "lists::pair")]
    pub part: Option<(f64, f64)>,
    /// Data rows to leave out, from 1, each range with both ends, e.g. `[[120, 180]]`; what borders on them is not used
    /// either. Default: none.
    pub leave_out: Vec<(usize, usize)>,
    /// Leave out rows in which no signal differs from the row before although a joint moves. Default false.
    pub drop_repeated: bool,
    /// Columns of this log in place of the run's.
    pub columns: Option<MappingSpec>,
    /// Trajectory file of a periodic motion, relative to the configuration: states come from a Fourier series of its period.
    /// Default: the run's for `[[log]]`, none for `[[validation]]`.
    pub trajectory: Option<PathBuf>,
    /// The period alone, s, where the whole record is periodic.
    pub period_s: Option<f64>,
    /// Name in parameters and messages. Default: the file's name up to its first dot.
    pub name: Option<String>,
    /// The payload that it carries. Default: none.
    pub payload: Option<String>,
    /// Temperature of joints throughout this log, °C, in place of the logged one. Default: what is logged.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub temperature: PerJoint,
    /// What it has of its own, beside the other training logs. Default: nothing.
    pub own: Vec<Own>,
    /// Of a validation log: the training log whose own terms it shares. Default: none.
    pub like: Option<String>,
}

impl Config {
    /// Reads a configuration; paths in it become relative to its folder, and patterns, folders and lists become the logs that they stand
    /// for.
    ///
    /// # Errors
    /// [`Error::Read`], as [`Config::parse`], and as [`LogConfig::all`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut config = Self::read_for_stream(path)?;
        let file = path.display().to_string();
        config.demand_logs(&file)?;
        config.find_logs()?;
        toml_file::in_file(&file, config.check_logs())?;
        Ok(config)
    }

    /// Reads a configuration for a run that need not have a log; logs stay as they are stated ([`Config::find_logs`]).
    ///
    /// # Errors
    /// Fails as [`Config::read`] does.
    pub fn read_for_stream(path: &Path) -> Result<Self, Error> {
        let (mut config, folder) = toml_file::read(path, Self::parse_any)?;
        config.file = Some(path.to_owned());
        config.robot = folder.join(&config.robot);
        config.out = config.out.map(|o| folder.join(o));
        config.elements.known_friction = config.elements.known_friction.map(|f| folder.join(f));
        for log in config.log.iter_mut().chain(&mut config.validation) {
            log.path = folder.join(&log.path);
            log.trajectory = log.trajectory.as_ref().map(|t| folder.join(t));
        }
        config.trajectory = config.trajectory.map(|t| folder.join(t));
        if let Some(table) = &mut config.instruments {
            table.trajectory = table.trajectory.as_ref().map(|t| folder.join(t));
        }
        config.online.checkpoint = config.online.checkpoint.map(|c| folder.join(c));
        Ok(config)
    }

    /// Puts the logs that patterns, folders and lists stand for in their place ([`LogConfig::all`]).
    ///
    /// # Errors
    /// Fails as [`LogConfig::all`] does.
    pub fn find_logs(&mut self) -> Result<(), Error> {
        self.log = LogConfig::all(&self.log)?;
        self.validation = LogConfig::all(&self.validation)?;
        Ok(())
    }

    /// Parses a configuration.
    ///
    /// # Errors
    /// [`Error::Config`] with the line; [`Error::InFile`] with what [`Config::check`] finds.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let config = Self::parse_any(text, file)?;
        config.demand_logs(file)?;
        Ok(config)
    }

    fn demand_logs(&self, file: &str) -> Result<(), Error> {
        if !self.log.is_empty() {
            return Ok(());
        }
        Err(toml_file::missing(file, "at least one `[[log]]` with a `path`"))
    }

    fn parse_any(text: &str, file: &str) -> Result<Self, Error> {
        let config: Config = toml_file::parse(text, file)?;
        let missing = |what: &str| toml_file::missing(file, what);
        if config.robot.as_os_str().is_empty() {
            return Err(missing("`robot = \"file\"`"));
        }
        for log in config.log.iter().chain(&config.validation) {
            if log.path.as_os_str().is_empty() {
                return Err(missing("a `path` in every `[[log]]` and `[[validation]]`"));
            }
        }
        toml_file::in_file(file, config.check())?;
        Ok(config)
    }

    /// Fails unless there is a robot and a log to identify it from: a configuration that was read has both, one that a program
    /// made may not.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn demand_inputs(&self) -> Result<(), Error> {
        if self.robot.as_os_str().is_empty() {
            return Err(Error::setting("robot", "a robot file", "none"));
        }
        if self.log.is_empty() {
            return Err(Error::setting("log", "at least one log to identify from", "none"));
        }
        Ok(())
    }

    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::Coupling`].
    pub fn check(&self) -> Result<(), Error> {
        if let Some(g) = self.gravity
            && !g.iter().all(|x| x.is_finite())
        {
            return Err(Error::setting("gravity", "three finite numbers", format!("{g:?}")));
        }
        self.plain_settings().check()?;
        self.check_logs()?;
        self.elements.check()?;
        self.online.check()?;
        self.instruments.iter().try_for_each(InstrumentsConfig::check)?;
        for (joint, position) in &self.locked {
            if !position.is_finite() {
                return Err(Error::setting(&format!("locked.{joint}"), "a finite number", position));
            }
        }
        check_motion(self.trajectory.as_deref(), self.period_s)?;
        for log in self.log.iter().chain(&self.validation) {
            check_motion(log.trajectory.as_deref(), log.period_s)?;
            if let Some((first, last)) =
                log.leave_out.iter().find(|(first, last)| *first == 0 || last < first)
            {
                return Err(Error::setting(
                    "leave_out",
                    "ranges [first, last] of data rows, counted from 1",
                    format!("[{first}, {last}]"),
                ));
            }
            if let Some((a, b)) = log.part
                && !(0.0..1.0).contains(&a) | !(b > a && b <= 1.0)
            {
                return Err(Error::setting(
                    "part",
                    "two increasing shares between 0 and 1",
                    format!("[{a}, {b}]"),
                ));
            }
        }
        Ok(())
    }

    /// Logs to identify from, each with the trajectory or period that applies to it.
    pub fn training_logs(&self) -> Vec<LogConfig> {
        let own = |log: &LogConfig| log.trajectory.is_some() || log.period_s.is_some();
        let with_run = |log: &LogConfig| LogConfig {
            trajectory: self.trajectory.clone(),
            period_s: self.period_s,
            ..log.clone()
        };
        self.log.iter().map(|log| if own(log) { log.clone() } else { with_run(log) }).collect()
    }
}

impl LogConfig {
    /// The logs that entries stand for, in their order: patterns, folders and lists become one entry per log
    /// ([`files`](dynid_logs::log::files)).
    ///
    /// # Errors
    /// [`Error::LogFile`]: there is no such log; [`Error::Setting`]: a name for several logs.
    pub fn all<'a>(stated: impl IntoIterator<Item = &'a LogConfig>) -> Result<Vec<LogConfig>, Error> {
        let mut logs = Vec::new();
        for entry in stated {
            let files = dynid_logs::log::files(&entry.path)?;
            if let (Some(name), 2..) = (&entry.name, files.len()) {
                let found = format!("{name}, and {} logs of {}", files.len(), entry.path.display());
                return Err(Error::setting("log.name", "a name for one log", found));
            }
            logs.extend(files.into_iter().map(|path| LogConfig { path, ..entry.clone() }));
        }
        Ok(logs)
    }
}

impl ElementsConfig {
    /// Checks that what goes with known friction does not stand alone.
    fn check(&self) -> Result<(), Error> {
        if self.known_friction.is_some() {
            return Ok(());
        }
        let expected = "`known_friction` beside it";
        if self.friction_errors != FrictionErrors::default() {
            return Err(Error::setting("elements.friction_errors", expected, "none"));
        }
        if !self.temperature.is_none() {
            return Err(Error::setting("elements.temperature", expected, "none"));
        }
        Ok(())
    }
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn check_motion(trajectory: Option<&Path>, period_s: Option<f64>) -> Result<(), Error> {
    match (trajectory, period_s) {
        (Some(_), Some(period_s)) => {
            Err(Error::setting("period_s", "either `trajectory` or `period_s`", period_s))
        }
        (None, Some(x)) if !(x.is_finite() && x > 0.0) => {
            Err(Error::setting("period_s", "a positive number", x))
        }
        _ => Ok(()),
    }
}
