//! Drives that log commands and positions only: gains, rotor inertia, friction, delay and zeros by closed-loop simulation.
//!
//! [`identify_servo`] reads robot and logs and runs [`dynid_servo::identify`]; [`ServoFile`] is what it leaves behind, beside
//! the robot file with what was found, tables of actuators for simulators and a page.

pub mod config;
mod files;
mod found;
mod gears;
mod logs;
mod record;
mod report;

pub use config::ServoConfig;
pub use files::ServoFiles;
pub use files::stated;
pub use found::{FoundDrives, set_terms};
pub use record::member;
pub use record::{
    AdditionRecord, BodyParameterRecord, BodyTrialRecord, DirectionRecord, HorizonRecord, ServoBodyRecord,
    ServoEffortRecord, ServoEffortVerdict, ServoFile, ServoFit, ServoGroupKind, ServoGroupRecord, ServoLaw,
    ServoLogFit, ServoParameterRecord, ServoSimulation, ServoSpread, ServoVerdict,
};

use std::collections::BTreeMap;
use std::path::Path;

use dynid_servo::fit::{Evaluation, ServoProblem, blocks};
use dynid_servo::identify::{LEAST_ROWS, ServoError, ServoIdentification, identify};
use dynid_servo::{Channel, ServoLog, ServoSettings, ServoValues, Simulated, Term};

use dynid_identify::estimate::InputRecord;
use dynid_identify::robot::{Robot, RobotOptions, refuse_loops};
use dynid_identify::{Error, Fault};
use dynid_model::JointKind;

/// What is being worked on.
#[derive(Debug, Clone, PartialEq)]
pub enum ServoStep {
    /// Reading a file.
    Read(String),
    /// Fits by simulation.
    Fit,
}

/// Faults of logs of commands, and simulations that get lost.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServoFault {
    /// No column of commands.
    #[error("{file}: no columns of commanded positions for {joint}")]
    NoCommand {
        /// Log.
        file: String,
        /// Joints.
        joint: String,
    },
    /// A validation log without a joint that the others have.
    #[error("{file}: no columns of positions for {joint}, which the logs of the identification have")]
    NoPosition {
        /// Log.
        file: String,
        /// Joints.
        joint: String,
    },
    /// Commands in another unit than positions.
    #[error(
        "{file}: the command of `{joint}` moves {ratio:.0} times as far as its position: expected the same unit"
    )]
    Unit {
        /// Log.
        file: String,
        /// Joint.
        joint: String,
        /// Standard deviation of the command over that of the position.
        ratio: f64,
    },
    /// Rows without a command.
    #[error("{file}: expected a command in each of {positions} rows, found {commands}")]
    Rows {
        /// Log.
        file: String,
        /// Rows with commands.
        commands: usize,
        /// Rows with positions.
        positions: usize,
    },
    /// Velocities that were asked for.
    #[error("{file}: no columns of velocities in the rows with positions, which `fit` asks for")]
    NoVelocity {
        /// Log.
        file: String,
    },
    /// No joint is left that moves.
    #[error("{robot}: no joint that moves and has columns in the log")]
    NoJoint {
        /// Robot file.
        robot: String,
    },
    /// A file that no identification of drives wrote.
    #[error("{file}: expected a result of `dynid servo`: {message}")]
    File {
        /// File.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// The simulation.
    #[error(transparent)]
    Fit(#[from] ServoError),
}

impl Fault for ServoFault {
    fn hint(&self) -> Option<String> {
        Some(match self {
            ServoFault::NoCommand { .. } => {
                "name them in the configuration, e.g. `[command]` with `position = \"cmd_{joint}\"`".to_owned()
            }
            ServoFault::Unit { .. } => {
                "state the unit, e.g. `[command]` with `position = { columns = \"cmd_{joint}\", unit = \"deg\" }`"
                    .to_owned()
            }
            ServoFault::Rows { .. } => "give commands and positions on the same rows, or `missing = \"drop\"`".to_owned(),
            ServoFault::NoPosition { .. } => "leave the log out, or lock the joint: `lock = { JOINT = 0.0 }`".to_owned(),
            ServoFault::NoVelocity { .. } => {
                "name them in the configuration, e.g. `[columns]` with `velocity = \"dq_{joint}\"`, or leave `\"velocity\"` out of `fit`"
                    .to_owned()
            }
            ServoFault::NoJoint { .. } => "name the columns of positions: `[columns]` with `position`".to_owned(),
            ServoFault::File { .. } => "give the `servo.json` of the output folder of `dynid servo`".to_owned(),
            ServoFault::Fit(ServoError::Lost(_)) => {
                "check signs and units: state `direction`, `position_gain` and `velocity_gain` in `[servo]`; of gears that rattle between their flanks, more `gear_damping` or no `backlash`".to_owned()
            }
            ServoFault::Fit(_) => return None,
        })
    }
}

impl From<ServoFault> for Error {
    fn from(fault: ServoFault) -> Self {
        Error::Job(Box::new(fault))
    }
}

/// An identification with everything that was read for it.
#[derive(Debug)]
pub struct ServoResult {
    /// The robot; joints without columns and locked ones are fixed.
    pub robot: Robot,
    /// Training logs.
    pub logs: Vec<ServoLog>,
    /// Logs that are predicted only.
    pub validation: Vec<ServoLog>,
    /// What was known and asked.
    pub settings: ServoSettings,
    /// What was found.
    pub found: ServoIdentification,
    /// RMS of every joint on every validation log.
    pub validation_rms: Vec<Vec<f64>>,
    /// RMS of every joint over all training logs with the numbers of the robot file, where all position gains are known.
    pub as_it_came: Option<Vec<f64>>,
    /// Warnings, in words.
    pub warnings: Vec<String>,
    inputs: Vec<InputRecord>,
}

/// Reads robot and logs, and identifies.
///
/// # Errors
/// [`Error`]: bad input; [`ServoFault`].
pub fn identify_servo(
    config: &ServoConfig,
    progress: &mut dyn FnMut(ServoStep),
) -> Result<ServoResult, Error> {
    config.check()?;
    progress(ServoStep::Read(config.robot.display().to_string()));
    let (mut robot, mut warnings) = clamped(&config.robot, config.gravity, &config.lock)?;
    let mut inputs = robot.inputs();
    let mut read = |logs: &[config::ServoLogConfig], robot: &Robot| -> Result<Vec<logs::ReadLog>, Error> {
        logs.iter()
            .map(|log| {
                progress(ServoStep::Read(log.path.display().to_string()));
                logs::read(config, log, robot)
            })
            .collect()
    };
    let mut training = read(&config.log, &robot)?;
    let still: Vec<(String, f64)> = training
        .iter()
        .flat_map(|l| l.not_logged.iter())
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .map(|name| (name.clone(), 0.0))
        .collect();
    if !still.is_empty() {
        let names: Vec<&str> = still.iter().map(|(n, _)| n.as_str()).collect();
        warnings.push(format!("no columns, held at 0: {}; `lock` states another position", names.join(", ")));
        robot = without_motors(robot.locked(&still)?);
        training = read(&config.log, &robot)?;
    }
    let validation = read(&config.validation, &robot)?;
    for (log, config) in validation.iter().zip(&config.validation) {
        if !log.not_logged.is_empty() {
            let (file, joint) = (config.path.display().to_string(), log.not_logged.join(", "));
            return Err(ServoFault::NoPosition { file, joint }.into());
        }
        if log.log.rows() < LEAST_ROWS {
            let (log, found) = (log.log.name.clone(), log.log.rows());
            return Err(ServoFault::Fit(ServoError::Short { log, expected: LEAST_ROWS, found }).into());
        }
    }
    warnings.extend(refuse_without(&mut training)?);
    for log in training.iter().chain(&validation) {
        warnings.extend(log.warnings.iter().cloned());
        inputs.extend(log.inputs.iter().cloned());
    }
    let logs: Vec<ServoLog> = training.into_iter().map(|l| l.log).collect();
    let mut validation: Vec<ServoLog> = validation.into_iter().map(|l| l.log).collect();
    if robot.rate_names().is_empty() {
        return Err(ServoFault::NoJoint { robot: config.robot.display().to_string() }.into());
    }
    let period = logs.iter().map(ServoLog::period).fold(0.0, f64::max);
    let settings = config.servo.settings(&robot, period)?;
    refuse_idle(config, &logs)?;
    progress(ServoStep::Fit);
    warnings.extend(beyond_limits(&robot, &logs, &settings)?);
    let found = identify(&robot.mechanism, &logs, &settings).map_err(ServoFault::from)?;
    let rms = |values: &ServoValues, logs: &[ServoLog]| -> Option<Vec<Vec<f64>>> {
        let whole = blocks(logs, logs.len());
        let problem = ServoProblem {
            chains: &found.chains,
            logs,
            scheme: found.scheme,
            free: &[],
            channels: &[Channel::Position],
            blocks: &whole,
        };
        let evaluation = Evaluation::new(&problem, values, &vec![1.0; values.joints.len()], false).ok()?;
        let of = |l: usize| {
            let squares = evaluation.mean_squares(&|b| whole[b].log == l);
            squares.iter().map(|s| s.sqrt()).collect()
        };
        Some((0..logs.len()).map(of).collect())
    };
    // Sums begin where those of the fit do.
    validation.iter_mut().for_each(|log| log.settle_s = found.settle_s);
    let lost = vec![vec![f64::NAN; settings.joints.len()]; validation.len()];
    let validation_rms =
        if validation.is_empty() { Vec::new() } else { rms(&found.values, &validation).unwrap_or(lost) };
    let as_it_came = file_values(&robot, &settings)?
        .and_then(|values| rms(&values, &logs))
        .map(|by_log| over_logs(&by_log, &logs));
    Ok(ServoResult { robot, logs, validation, settings, found, validation_rms, as_it_came, warnings, inputs })
}

/// Share of the rows in which a command must lie beyond the limits of its joint, and share of their range by which positions may.
const BEYOND: f64 = 0.01;

/// Joints whose commands leave the limits of the robot file, those of their actuators or else their own, while their positions do not, in words: drives often clamp what they are told.
fn beyond_limits(robot: &Robot, logs: &[ServoLog], settings: &ServoSettings) -> Result<Vec<String>, Error> {
    let (names, owners) = (robot.rate_names(), robot.mechanism.rate_bodies());
    let actuators = files::position_actuators(robot)?;
    let mut out = Vec::new();
    for (j, (name, joint)) in names.iter().zip(&settings.joints).enumerate() {
        let of_actuator = actuators.iter().find(|a| a.joint == *name).and_then(|a| a.command_limits);
        let limits = of_actuator.or(robot.mechanism.bodies()[owners[j]].joint.limits.position);
        let free = |(low, high): &(f64, f64)| low < high && joint.command_limits.0 == f64::NEG_INFINITY;
        let Some((low, high)) = limits.filter(free) else { continue };
        let margin = BEYOND * (high - low);
        let beyond = |x: &f64| {
            let q = joint.position(*x);
            q < low - margin || q > high + margin
        };
        let rows: usize = logs.iter().map(ServoLog::rows).sum();
        let commands = logs.iter().flat_map(|l| &l.command[j]).filter(|u| beyond(u)).count();
        let stays = !logs.iter().flat_map(|l| &l.position[j]).any(beyond);
        if stays && commands as f64 > BEYOND * rows as f64 {
            let [a, b] = [low, high].map(|q| joint.reading(q));
            out.push(format!(
                "commands of {name} lie beyond the limits of the robot file in {:.0} % of the rows, and its positions never do: if the drive clamps \
                 its commands, say so: `command_limits = {{ {name} = [{:.4}, {:.4}] }}` in `[servo]`",
                100.0 * commands as f64 / rows as f64,
                a.min(b),
                a.max(b)
            ));
        }
    }
    Ok(out)
}

/// Logs need not all measure efforts or currents that the run states columns for; that none does is a fault. Returns what to say of the others.
fn refuse_without(logs: &mut [logs::ReadLog]) -> Result<Vec<String>, Error> {
    let mut out = Vec::new();
    for channel in [Channel::Effort, Channel::Current] {
        let has = |log: &ServoLog| (0..log.joints()).any(|j| log.measured(channel, j).is_some());
        let any = logs.iter().any(|l| has(&l.log));
        let mut names = Vec::new();
        for log in logs.iter_mut() {
            while let Some(at) = log.without.iter().position(|w| w.0 == channel) {
                let (_, error) = log.without.remove(at);
                if !any {
                    return Err(error);
                }
                names.push(log.log.name.clone());
            }
        }
        if !names.is_empty() {
            out.push(format!("no columns of {}s in {}", channel.name(), names.join(", ")));
        }
    }
    Ok(out)
}

/// Refuses what is said of measured efforts where no log has any.
fn refuse_idle(config: &ServoConfig, logs: &[ServoLog]) -> Result<(), Error> {
    let has = |channel| logs.iter().any(|log| (0..log.joints()).any(|j| log.measured(channel, j).is_some()));
    let (effort, current) = (has(Channel::Effort), has(Channel::Current));
    if config.servo.fit.contains(&config::ChannelName::Velocity) && !has(Channel::Velocity) {
        let file = logs.iter().map(|log| log.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(ServoFault::NoVelocity { file }.into());
    }
    let idle = [
        (
            "servo.torque_constant",
            !config.servo.torque_constant.is_none() && !current,
            "a log with columns of currents, e.g. `current = \"i_{joint}\"`",
        ),
        (
            "servo.effort_at",
            config.servo.effort_at != config::EffortAtName::Drive && !effort && !current,
            "a log with columns of efforts, e.g. `[columns]` with `effort = \"tau_{joint}\"`",
        ),
    ];
    match idle.iter().find(|(_, found, _)| *found) {
        Some((key, _, expected)) => Err(Error::setting(key, expected, "none")),
        None => Ok(()),
    }
}

/// RMS over all rows from that by log.
fn over_logs(by_log: &[Vec<f64>], logs: &[ServoLog]) -> Vec<f64> {
    let rows: usize = logs.iter().map(ServoLog::rows).sum();
    let squares = |j: usize| by_log.iter().zip(logs).map(|(r, l)| r[j] * r[j] * l.rows() as f64).sum::<f64>();
    (0..by_log.first().map_or(0, Vec::len)).map(|j| (squares(j) / rows as f64).sqrt()).collect()
}

/// A robot with joints held at positions, its base clamped; warnings in words.
///
/// # Errors
/// [`Error::UnknownJoint`], [`Error::Setting`], [`Error::Unsupported`].
pub fn clamped(
    file: &Path,
    gravity: Option<[f64; 3]>,
    lock: &BTreeMap<String, f64>,
) -> Result<(Robot, Vec<String>), Error> {
    let mut options = RobotOptions {
        gravity,
        couple_mimics: true,
        floating_base: false,
        locked: lock.iter().map(|(name, x)| (name.clone(), *x)).collect(),
    };
    let plain = Robot::load(file, &RobotOptions { locked: Vec::new(), ..options.clone() })?;
    let floating: Vec<String> = plain
        .mechanism
        .bodies()
        .iter()
        .filter(|b| b.joint.kind == JointKind::Floating)
        .map(|b| b.joint.name.clone())
        .collect();
    let mut warnings = Vec::new();
    if !floating.is_empty() {
        warnings.push(format!(
            "the base is taken as clamped where the robot file puts it (`{}`)",
            floating.join("`, `")
        ));
        options.locked.extend(floating.into_iter().map(|name| (name, 0.0)));
    }
    let robot = without_motors(if options.locked.is_empty() { plain } else { Robot::load(file, &options)? });
    refuse_loops(&robot, "identified from commands and positions")?;
    let of_robot = |joint: &String| robot.rate_names().contains(joint);
    let is_spring = |element: &String| ["spring", "balancer"].contains(&element.as_str());
    let own = robot.elements.per_joint.iter().filter(|(_, list)| list.iter().any(is_spring));
    let beside = robot.elements.beside.iter().filter(|(_, e)| is_spring(e)).map(|(joint, _)| joint);
    let sprung: Vec<&str> =
        own.map(|(joint, _)| joint).chain(beside).filter(|j| of_robot(j)).map(String::as_str).collect();
    if !sprung.is_empty() {
        warnings.push(format!(
            "a drive has no spring: those of `{}` are left out, and the fit takes their effort for friction and a constant effort",
            sprung.join("`, `")
        ));
    }
    let cubic = robot.elements.elastic.iter().filter(|e| e.k2.is_some_and(|k| k != 0.0));
    let cubic: Vec<&str> = cubic.map(|e| e.joint.as_str()).collect();
    if !cubic.is_empty() {
        warnings.push(format!(
            "gears of drives are linear springs: the cubic stiffness of `{}` is left out",
            cubic.join("`, `")
        ));
    }
    // What the file says of bodies is what the scale of all efforts hangs on.
    warnings.extend(robot.warnings.iter().cloned());
    Ok((robot, warnings))
}

/// Of a joint that is elastic one position is logged: that of its encoder, on whichever side.
fn without_motors(mut robot: Robot) -> Robot {
    robot.axes.retain(|a| !a.motor);
    robot
}

/// Numbers as the robot file states them, where all position gains are known or stated there: by the position loops of an MJCF.
fn file_values(robot: &Robot, settings: &ServoSettings) -> Result<Option<ServoValues>, Error> {
    let names = robot.rate_names();
    let place = |name: &String| names.iter().position(|n| n == name);
    let (mut joints, mut known) = (settings.joints.clone(), settings.known_gain.clone());
    for actuator in files::position_actuators(robot)? {
        let Some(j) = place(&actuator.joint).filter(|j| !known[*j]) else { continue };
        known[j] = true;
        let joint = &mut joints[j];
        joint.set(Term::PositionGain, actuator.position_gain);
        joint.set(Term::Offset, -actuator.offset);
        if !settings.known_damping[j] {
            joint.set(Term::VelocityGain, actuator.velocity_gain);
        }
        if let Some(limit) = actuator.effort_limit.filter(|_| joint.get(Term::EffortLimit).is_infinite()) {
            joint.set(Term::EffortLimit, limit);
        }
        if let Some(limits) = actuator.command_limits.filter(|_| joint.command_limits.0.is_infinite()) {
            joint.command_limits = limits;
        }
    }
    if known.iter().any(|k| !k) {
        return Ok(None);
    }
    for stated in files::stated(robot)? {
        let Some(j) = place(&stated.joint) else { continue };
        joints[j].set(Term::Viscous, stated.damping);
        joints[j].set(Term::Coulomb, stated.friction_loss);
        joints[j].set(Term::RotorInertia, stated.armature);
    }
    Ok(Some(ServoValues { joints, inertias: robot.mechanism.inertia_vector() }))
}

/// Simulated readings of a log, joint after joint, and the efforts of the drives where the log measures an effort or current.
struct SimulatedLog {
    reading: Vec<Vec<f64>>,
    effort: Vec<Vec<f64>>,
}

fn simulated(found: &ServoIdentification, log: &ServoLog) -> SimulatedLog {
    let nothing = || vec![vec![f64::NAN; log.rows()]; log.joints()];
    let mut out = SimulatedLog { reading: nothing(), effort: nothing() };
    for chain in &found.chains {
        let rollout = dynid_servo::Rollout::new(chain, found.scheme, &[]);
        // What gets lost shows as a gap.
        let _lost = rollout.run_with_efforts(&found.values, log, |seen| match seen {
            Simulated::Row(row) => {
                for (k, j) in chain.joints.iter().enumerate() {
                    out.reading[*j][row.row] = row.reading[k];
                }
            }
            Simulated::Effort(seen) => {
                let j = chain.joints[seen.joint];
                out.effort[j][seen.row] = found.values.joints[j].direction * seen.effort;
            }
        });
    }
    out
}
