//! The configuration of a servo identification, a TOML file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_config::config::{LogConfig, toml_file};
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_identify::settings::PerJoint;
use dynid_logs::MappingSpec;
use dynid_logs::columns::SignalSpec;
use dynid_servo::{
    Addition, Bodies, Channel, Choice, EffortAt, EncoderAt, Hold, Limited, LoadOf, ServoSettings, Shared,
    Term,
};

use serde::{Deserialize, Serialize};

use super::gears::Gears;

/// A robot, its logs of commands and positions, and what is known of its drives. Every key but `robot` and `log` has a default.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ServoConfig {
    /// Robot file (URDF, MJCF or TOML), relative to the configuration. Its base is taken as clamped, a floating one where the file puts it.
    pub robot: PathBuf,
    /// Output folder, relative to the configuration. Without it the program writes to `dynid-servo` in the current folder.
    pub out: Option<PathBuf>,
    /// Joints held at a position, rad or m.
    pub lock: BTreeMap<String, f64>,
    /// Gravity in base axes, m/s². Default: the robot file's.
    pub gravity: Option<[f64; 3]>,
    /// Columns of all logs: positions, time, efforts and velocities where there are any, names, units. A log may bring its own.
    #[serde(skip_serializing)]
    pub columns: MappingSpec,
    /// Columns of what the drives are told.
    #[serde(skip_serializing)]
    pub command: CommandColumns,
    /// Columns of measured currents, A unless a unit is stated. Torque constants are found, or stated in `[servo]`. Default: the columns that bear the usual names,
    /// in logs without efforts.
    #[serde(skip_serializing)]
    pub current: Option<SignalSpec>,
    /// Logs to identify from.
    pub log: Vec<ServoLogConfig>,
    /// Logs that are predicted only.
    pub validation: Vec<ServoLogConfig>,
    /// What is known of the drives, and what is to be found.
    pub servo: DriveConfig,
}

/// Columns of what the drives are told, in the units of the positions.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CommandColumns {
    /// Commanded positions. Default: the columns whose names are those of the joints behind or before a word such as `cmd`, `command`,
    /// `target`, `desired`, `reference` or `action`.
    pub position: Option<SignalSpec>,
    /// Commanded velocities. Default: none, and the drives damp the velocity itself.
    pub velocity: Option<SignalSpec>,
    /// Efforts that are fed forward. Default: none.
    pub effort: Option<SignalSpec>,
}

/// One log.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ServoLogConfig {
    /// File of any format that is read, relative to the configuration; a pattern, a folder or a list stands for its logs; `FILE#MEMBER`: an
    /// episode, a group, or topics of it.
    pub path: PathBuf,
    /// First and last data row, from 1, both included. Default: all.
    #[serde(deserialize_with = "dynid_identify::settings::lists::pair")]
    pub rows: Option<(usize, usize)>,
    /// First and last part of the record, as shares of its rows, e.g. `[0.0, 0.7]`. Default: all.
    #[serde(deserialize_with = "dynid_identify::settings::lists::pair")]
    pub part: Option<(f64, f64)>,
    /// Columns of this log in place of the run's.
    #[serde(skip_serializing)]
    pub columns: Option<MappingSpec>,
}

impl ServoLogConfig {
    pub(super) fn plain(&self) -> LogConfig {
        LogConfig {
            path: self.path.clone(),
            rows: self.rows,
            part: self.part,
            columns: self.columns.clone(),
            ..LogConfig::default()
        }
    }
}

/// What is known of the drives, and what is to be found. Units are N m and rad, N and m for joints that slide.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct DriveConfig {
    /// Position gains where they are known, N m/rad. Default: found.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub position_gain: PerJoint,
    /// Relative error that these may have. Default 0.1.
    pub gain_error: f64,
    /// Whether position gains that are not known are one number or one per joint. Default `shared`.
    pub gains: GainSharing,
    /// Velocity gains where they are known, N m s/rad. Default: found where efforts of the drive are measured, else 0, and the viscous friction that is
    /// found holds the drive's damping too.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub velocity_gain: PerJoint,
    /// What the sum of squares holds beside positions, each weighted by its own noise, where logs measure it: `effort`, `current`, `velocity`. Default
    /// `effort` and `current`, as far as they are those of the drives that the positions tell; `[]`: positions alone.
    pub fit: Vec<ChannelName>,
    /// Where efforts are measured. Default `drive`.
    pub effort_at: EffortAtName,
    /// Effort per measured current behind the gear, where it is known, N m/A. Default: found.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub torque_constant: PerJoint,
    /// Largest effort of the drives, N m. Default: none.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub effort_limit: PerJoint,
    /// What that limits. Default `whole`.
    pub limited: LimitedName,
    /// Least and largest commanded reading that a drive takes, where it clamps its commands, rad: `{ j1 = [-1.5, 1.5] }`. Default: it takes all.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub command_limits: BTreeMap<String, (f64, f64)>,
    /// Direction of encoder and command against the joint of the robot file, 1 or -1. Default 1.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub direction: PerJoint,
    /// Whether directions that `direction` does not state are found: gravity tells them. Default false.
    pub find_directions: bool,
    /// Position of the joint where its encoder reads zero, where it is known, rad. Default: 0, and found if held-out data ask for it.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub zero: PerJoint,
    /// Standard deviation of zeros that are found about 0, rad. Default 0.5.
    pub zero_std: f64,
    /// Time from a command in the log to what it does, s, where it is known. Default: found.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub delay: PerJoint,
    /// Which joints share a delay that is found. Default `chain`.
    pub delays: DelaySharing,
    /// What a command does between two samples. Default `held`.
    pub hold: HoldName,
    /// What is added to rotor inertia, viscous and Coulomb friction: `offset`, `stiction`, `load_friction`, `zero`. Default: what held-out
    /// data ask for.
    pub law: Option<Vec<LawName>>,
    /// Where masses, centres and moments of inertia of the links come from. Default `file`.
    pub bodies: BodiesName,
    /// Relative error that masses of the robot file may have, 95 %, beside `bodies = "found"`. Default 0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_error: Option<f64>,
    /// Stiffness of gears that give way, where it is known, N m/rad. Default: the `k1` of joints that are `elastic` in the robot file, else gears are stiff.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub gear_stiffness: PerJoint,
    /// Damping of such gears, where it is known, N m s/rad. Default: the `d` of the robot file, else 0.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub gear_damping: PerJoint,
    /// Backlash of such gears, from flank to flank, where it is known, rad. Default: 0.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub backlash: PerJoint,
    /// Which side of gears that give way encoders sit on. Default `motor`.
    pub encoder: EncoderName,
    /// Terms that are found besides, one per joint: `dead_band`, `rate_limit`, `smoothing_time`, `effort_limit`; `compliance`, `gear_damping` and `backlash` of gears, where they
    /// are not stated. Default: none.
    pub find: Vec<FoundName>,
    /// What load friction grows with. Default `drive`.
    pub load: LoadName,
    /// Longest step of the simulation, s. Default: the sample period, halved until it does not matter.
    pub step_s: Option<f64>,
    /// Blocks of time that the jackknife leaves out. Default 24.
    pub blocks: usize,
}

impl Default for DriveConfig {
    fn default() -> Self {
        DriveConfig {
            position_gain: PerJoint::default(),
            gain_error: 0.1,
            gains: GainSharing::Shared,
            velocity_gain: PerJoint::default(),
            fit: vec![ChannelName::Effort, ChannelName::Current],
            effort_at: EffortAtName::Drive,
            torque_constant: PerJoint::default(),
            effort_limit: PerJoint::default(),
            limited: LimitedName::Whole,
            command_limits: BTreeMap::new(),
            direction: PerJoint::default(),
            find_directions: false,
            zero: PerJoint::default(),
            zero_std: 0.5,
            delay: PerJoint::default(),
            delays: DelaySharing::Chain,
            hold: HoldName::Held,
            law: None,
            bodies: BodiesName::File,
            body_error: None,
            gear_stiffness: PerJoint::default(),
            gear_damping: PerJoint::default(),
            backlash: PerJoint::default(),
            encoder: EncoderName::Motor,
            find: Vec::new(),
            load: LoadName::Drive,
            step_s: None,
            blocks: 24,
        }
    }
}

/// What a sum of squares may hold beside positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChannelName {
    /// Measured efforts.
    Effort,
    /// Measured currents.
    Current,
    /// Measured velocities, of columns that `[columns]` states or that bear the usual names. Filters of theirs are not modelled.
    Velocity,
}

/// Where efforts are measured.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EffortAtName {
    /// At the drive, as a current tells it: rotor and friction come behind it.
    #[default]
    Drive,
    /// Between gear and link, where a joint torque sensor sits.
    Link,
}

/// Which side of a gear that gives way encoders sit on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EncoderName {
    /// On the motor, as in geared drives of industry.
    #[default]
    Motor,
    /// On the link, as the potentiometer of a hobby servo.
    Link,
}

/// Whether position gains are one number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GainSharing {
    /// One for all joints: equal drives with equal registers.
    #[default]
    Shared,
    /// One per joint.
    Own,
}

/// What an effort limit acts on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitedName {
    /// The whole effort, as a limit of torque or current does.
    #[default]
    Whole,
    /// The part of the control error, as a limit of voltage does, whose back-EMF comes after it.
    Proportional,
}

/// Which joints share a delay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DelaySharing {
    /// All joints.
    All,
    /// Those of a leg or an arm.
    #[default]
    Chain,
    /// Every joint has its own.
    Own,
}

/// What a command does between two samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HoldName {
    /// It stays.
    #[default]
    Held,
    /// It goes on a straight line to the next.
    Line,
}

/// What a law may have beside rotor inertia, viscous and Coulomb friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// A constant effort.
    Offset,
    /// Friction at rest above Coulomb friction, with a Stribeck velocity.
    Stiction,
    /// Friction that grows with the load of the gear.
    LoadFriction,
    /// Zeros of the encoders.
    Zero,
}

/// Where the inertias of links come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BodiesName {
    /// They are those of the robot file.
    #[default]
    File,
    /// They deviate from those of the robot file as far as held-out data ask for it.
    Found,
}

/// Terms that are found on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FoundName {
    /// Half width of the dead band of the control error, rad.
    DeadBand,
    /// Largest speed of the command, rad/s.
    RateLimit,
    /// Time constant of the smoothing of the command, s.
    SmoothingTime,
    /// Largest effort, from the stated one.
    EffortLimit,
    /// Compliance of gears, rad/(N m).
    Compliance,
    /// Damping of gears that give way, N m s/rad.
    GearDamping,
    /// Backlash of gears that give way, rad.
    Backlash,
}

/// What load friction grows with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LoadName {
    /// The effort of the drive.
    #[default]
    Drive,
    /// Gravity, Coriolis and centrifugal effort of the bodies.
    Bodies,
}

/// Starts of terms that are found: any value whose slope is not zero.
const FIRST_DEAD_BAND: f64 = 2e-3;
const FIRST_SMOOTHING: f64 = 5e-3;

/// Relative error of masses, 95 %, from which a robot file says nothing.
const MOST_BODY_ERROR: f64 = 2.0;

impl ServoConfig {
    /// Reads a configuration; paths in it become relative to its folder.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::LogFile`], and as [`ServoConfig::parse`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let (mut config, folder) = toml_file::read(path, Self::parse)?;
        config.robot = folder.join(&config.robot);
        config.out = config.out.map(|o| folder.join(o));
        for logs in [&mut config.log, &mut config.validation] {
            let mut all = Vec::with_capacity(logs.len());
            for log in logs.iter() {
                for path in dynid_logs::log::files(&folder.join(&log.path))? {
                    all.push(ServoLogConfig { path, ..log.clone() });
                }
            }
            *logs = all;
        }
        Ok(config)
    }

    /// Parses a configuration.
    ///
    /// # Errors
    /// [`Error::Config`] with the line; [`Error::InFile`] with what [`ServoConfig::check`] finds.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let config: ServoConfig = toml_file::parse(text, file)?;
        let missing = |what: &str| toml_file::missing(file, what);
        if config.robot.as_os_str().is_empty() {
            return Err(missing("`robot = \"file\"`"));
        }
        if config.log.is_empty() {
            return Err(missing("at least one `[[log]]` with a `path`"));
        }
        if config.log.iter().chain(&config.validation).any(|l| l.path.as_os_str().is_empty()) {
            return Err(missing("a `path` in every `[[log]]` and `[[validation]]`"));
        }
        toml_file::in_file(file, config.check())?;
        Ok(config)
    }

    /// A robot and logs, with defaults for the rest.
    pub fn of(robot: PathBuf, logs: &[PathBuf], validation: &[PathBuf]) -> Self {
        let log = |path: &PathBuf| ServoLogConfig { path: path.clone(), ..ServoLogConfig::default() };
        ServoConfig {
            robot,
            log: logs.iter().map(log).collect(),
            validation: validation.iter().map(log).collect(),
            ..ServoConfig::default()
        }
    }

    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<(), Error> {
        self.servo.check()?;
        if let Some(gravity) = self.gravity.filter(|g| g.iter().any(|x| !x.is_finite())) {
            return Err(Error::setting("gravity", "three finite numbers", format!("{gravity:?}")));
        }
        let parts = self.log.iter().chain(&self.validation).filter_map(|l| l.part);
        for (a, b) in parts {
            if !(0.0 <= a && a < b && b <= 1.0) {
                let found = format!("[{a}, {b}]");
                return Err(Error::setting("log.part", "two shares of the record, e.g. [0.0, 0.7]", found));
            }
        }
        match self.lock.iter().find(|(_, x)| !x.is_finite()) {
            Some((joint, x)) => Err(Error::setting(&format!("lock.{joint}"), "a finite number", x)),
            None => Ok(()),
        }
    }
}

impl DriveConfig {
    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<(), Error> {
        let s = self;
        if !(0.0..1.0).contains(&s.gain_error) {
            return Err(Error::setting("servo.gain_error", "at least 0 and less than 1", s.gain_error));
        }
        let positive = [("servo.zero_std", s.zero_std), ("servo.step_s", s.step_s.unwrap_or(1.0))];
        for (name, x) in positive {
            if !(x.is_finite() && x > 0.0) {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        if let Some(error) = s.body_error {
            if !(error > 0.0 && error < MOST_BODY_ERROR) {
                let expected = format!("a positive number below {MOST_BODY_ERROR}");
                return Err(Error::setting("servo.body_error", &expected, error));
            }
            if s.bodies == BodiesName::File {
                return Err(Error::setting("servo.body_error", "`bodies = \"found\"` beside it", "`file`"));
            }
        }
        if !(4..=1000).contains(&s.blocks) {
            return Err(Error::setting("servo.blocks", "4 to 1000", s.blocks));
        }
        if s.find.contains(&FoundName::EffortLimit) && s.effort_limit.is_none() {
            return Err(Error::setting(
                "servo.find",
                "`effort_limit` beside a stated one to start from",
                "none",
            ));
        }
        Ok(())
    }

    /// What is known and asked of the joints of a robot.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::UnknownJoint`].
    pub fn settings(&self, robot: &Robot, period: f64) -> Result<ServoSettings, Error> {
        let s = self;
        let names = robot.rate_names();
        let mut out = ServoSettings::new(names.len());
        let gain = s.position_gain.positive("servo.position_gain", &names)?;
        let damping = s.velocity_gain.not_negative("servo.velocity_gain", &names)?;
        let limit = s.effort_limit.positive("servo.effort_limit", &names)?;
        let constant = s.torque_constant.positive("servo.torque_constant", &names)?;
        let direction = s.direction.finite("servo.direction", &names)?;
        let zero = s.zero.finite("servo.zero", &names)?;
        let delay = s.delay.not_negative("servo.delay", &names)?;
        out.find = s.find.iter().map(|f| f.term()).collect();
        let gears = Gears {
            stiffness: s.gear_stiffness.positive("servo.gear_stiffness", &names)?,
            damping: s.gear_damping.not_negative("servo.gear_damping", &names)?,
            backlash: s.backlash.not_negative("servo.backlash", &names)?,
        };
        let gears = gears.beside(robot, &names, &out.find, s.encoder == EncoderName::Link)?;
        for (joint, (low, high)) in &s.command_limits {
            if !names.contains(joint) {
                return Err(Error::UnknownJoint { name: joint.clone(), known: names.clone() });
            }
            if !(low.is_finite() && high.is_finite() && low < high) {
                let key = format!("servo.command_limits.{joint}");
                return Err(Error::setting(&key, "two finite numbers that grow", format!("[{low}, {high}]")));
            }
        }
        for (j, joint) in out.joints.iter_mut().enumerate() {
            let known = [
                (Term::PositionGain, gain[j]),
                (Term::VelocityGain, damping[j]),
                (Term::EffortLimit, limit[j]),
                (Term::TorqueConstant, constant[j]),
                (Term::Zero, zero[j]),
                (Term::Delay, delay[j]),
            ];
            for (term, value) in known {
                value.into_iter().for_each(|x| joint.set(term, x));
            }
            joint.direction = direction[j].unwrap_or(1.0);
            if joint.direction.abs() != 1.0 {
                let key = format!("servo.direction.{}", names[j]);
                return Err(Error::setting(&key, "1 or -1", joint.direction));
            }
            if let Some(limits) = s.command_limits.get(&names[j]) {
                joint.command_limits = *limits;
            }
            joint.limited = match s.limited {
                LimitedName::Whole => Limited::Whole,
                LimitedName::Proportional => Limited::Proportional,
            };
            for found in &s.find {
                match found {
                    FoundName::DeadBand => joint.set(Term::DeadBand, FIRST_DEAD_BAND),
                    FoundName::SmoothingTime => {
                        joint.set(Term::SmoothingTime, FIRST_SMOOTHING.max(0.5 * period))
                    }
                    // What a gear begins from is looked for.
                    _ => {}
                }
            }
            out.known_gear[j] = gears.set(joint, j);
            joint.encoder = match s.encoder {
                EncoderName::Motor => EncoderAt::Motor,
                EncoderName::Link => EncoderAt::Link,
            };
            out.find_direction[j] = s.find_directions && direction[j].is_none();
            out.known_gain[j] = gain[j].is_some();
            out.known_damping[j] = damping[j].is_some();
            out.known_constant[j] = constant[j].is_some();
            out.known_zero[j] = zero[j].is_some();
        }
        out.known_delay = match delay.iter().filter(|d| d.is_some()).count() {
            0 => false,
            known if known == names.len() => true,
            known => {
                let found = format!("{known} of {}", names.len());
                return Err(Error::setting("servo.delay", "a number for all joints, or for none", found));
            }
        };
        out.gain_error = s.gain_error;
        out.channels = s.fit.iter().map(|c| c.channel()).collect();
        out.effort_at = match s.effort_at {
            EffortAtName::Drive => EffortAt::Drive,
            EffortAtName::Link => EffortAt::Link,
        };
        out.own_gains = s.gains == GainSharing::Own;
        out.delay = match s.delays {
            DelaySharing::All => Shared::All,
            DelaySharing::Chain => Shared::Chain,
            DelaySharing::Own => Shared::Own,
        };
        out.zero_std = s.zero_std;
        if let Some(law) = &s.law {
            out.choice = Choice::Given(law.iter().map(|l| l.addition()).collect());
        }
        out.hold = match s.hold {
            HoldName::Held => Hold::Held,
            HoldName::Line => Hold::Line,
        };
        out.load = match s.load {
            LoadName::Drive => LoadOf::Drive,
            LoadName::Bodies => LoadOf::Bodies,
        };
        out.bodies = match s.bodies {
            BodiesName::File => Bodies::File,
            BodiesName::Found => Bodies::Found,
        };
        if let Some(error) = s.body_error {
            out.body_error = error;
        }
        out.step_s = s.step_s;
        out.blocks = s.blocks;
        Ok(out)
    }
}

impl ChannelName {
    fn channel(self) -> Channel {
        match self {
            ChannelName::Effort => Channel::Effort,
            ChannelName::Current => Channel::Current,
            ChannelName::Velocity => Channel::Velocity,
        }
    }
}

impl LawName {
    fn addition(self) -> Addition {
        match self {
            LawName::Offset => Addition::Offset,
            LawName::Stiction => Addition::Stiction,
            LawName::LoadFriction => Addition::Load,
            LawName::Zero => Addition::Zero,
        }
    }
}

impl FoundName {
    fn term(self) -> Term {
        match self {
            FoundName::DeadBand => Term::DeadBand,
            FoundName::RateLimit => Term::RateLimit,
            FoundName::SmoothingTime => Term::SmoothingTime,
            FoundName::EffortLimit => Term::EffortLimit,
            FoundName::Compliance => Term::Compliance,
            FoundName::GearDamping => Term::GearDamping,
            FoundName::Backlash => Term::Backlash,
        }
    }
}
