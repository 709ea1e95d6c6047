//! Designs for robots whose drives are told positions and whose logs hold no effort.
//!
//! The trajectory is the command. The search takes the drives' loops for linear ([`ServoExcitation`]); the forecast simulates them.

mod known;
mod record;

use dynid_drives::{FoundDrives, ServoFault, ServoGroupRecord, clamped, member, set_terms};
use dynid_excitation::constraint::ConstraintKind;
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::{
    ColumnInfo, Design, Forecast, LimitKind, MotionLimits, Outcome, PositionLoop, Problem, ServoColumn,
    ServoExcitation, Settings, StartOutcome, forecast_by,
};
use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_linalg::Mat;
use dynid_model::{EffortModel, MotionBlock, RobotModel};
use dynid_motion::trajectory::FourierBasis;
use dynid_servo::forecast::{ServoForecast, forecast};
use dynid_servo::{Chain, Free, Measured, Scheme, ServoJoint, ServoLog, ServoSettings, ServoValues, Term};

use super::config::{CriterionName, DesignConfig};
use super::limits::joint_limits;
use super::problem::{self, RobotProblem, Subject};
use known::{complete, laws, mean_inertias, model, noise, refuse, symbol, typical};
pub use record::{BrokenBehind, FollowedJoint, FollowedRecord};

/// Searches that go on within smaller limits, at most.
const ROUNDS: usize = 6;
/// Room that they leave, as a part of the half range.
const ROOM: f64 = 0.005;
/// Parts of the half range, and of the limit, by which a simulated joint may leave what its command keeps.
const POSITION_EXCESS: f64 = 0.01;
const SPEED_EXCESS: f64 = 0.05;
const EFFORT_EXCESS: f64 = 0.01;
/// Distance by which it may leave places that its command keeps, m.
const PLACE_EXCESS: f64 = 1e-3;

/// The drives of a robot that a motion is designed for.
pub(super) struct Drives {
    values: ServoValues,
    chains: Vec<Chain>,
    free: Vec<Free>,
    scheme: Scheme,
    /// Standard deviation of the readings' noise by joint.
    sigma: Vec<f64>,
    /// Samples that count as one.
    together: f64,
    rate_hz: f64,
    periods: usize,
    slides: Vec<bool>,
    joints: Vec<String>,
    pub(super) source: Option<SourceFile>,
    /// Doubts about the robot file and what was taken for granted, in words.
    pub(super) warnings: Vec<String>,
}

/// The robot of a configuration with drives, its base clamped, joints without drives held.
pub(super) fn load(config: &DesignConfig) -> Result<Option<(Robot, Drives)>, Error> {
    refuse(config)?;
    let period = 1.0 / config.form().sample_rate_hz;
    match (&config.drives, &config.servo) {
        (None, None) => Ok(None),
        (Some(_), Some(_)) => {
            Err(Error::setting("drives", "either a result of `dynid servo` or the table `[servo]`", "both"))
        }
        (Some(path), None) => {
            let found = FoundDrives::read(path, &config.robot, &config.locked, config.gravity)?;
            let settings = found.settings(period)?;
            let mut warnings = found.warnings.clone();
            if !found.file.bodies.is_empty() {
                warnings.push(
                    "bodies are those that were found, and count as known: forecasts leave their errors out"
                        .to_owned(),
                );
            }
            let drives = Drives::new(&found.robot, config, settings, Some(&found), warnings)?;
            Ok(Some((found.robot, drives)))
        }
        (None, Some(known)) => {
            known.check()?;
            let (robot, mut warnings) = clamped(&config.robot, config.gravity, &config.locked)?;
            let mut settings = known.settings(&robot, period)?;
            typical(&robot, config, &mut settings, &mut warnings)?;
            let drives = Drives::new(&robot, config, settings, None, warnings)?;
            Ok(Some((robot, drives)))
        }
    }
}

impl Drives {
    fn new(
        robot: &Robot,
        config: &DesignConfig,
        mut settings: ServoSettings,
        found: Option<&FoundDrives>,
        mut warnings: Vec<String>,
    ) -> Result<Self, Error> {
        let rate_hz = config.form().sample_rate_hz;
        let joints = robot.rate_names();
        let slides: Vec<bool> = robot.mechanism.effort_units().iter().map(|u| *u == "N").collect();
        let laws = laws(found, &settings);
        for (name, known) in joints.iter().zip(&settings.known_gain) {
            let key = format!("{name}.{}", Term::PositionGain);
            if let Some(guess) = config.values.get(&key).filter(|_| *known) {
                let expected = "no guess beside a gain that is known: `position_gain` of the drives";
                return Err(Error::setting(&format!("values.{key}"), expected, guess));
            }
        }
        set_terms(&joints, &config.values, &mut settings.joints)?;
        complete(&joints, &laws, 1.0 / rate_hz, &mut settings)?;
        // The robot tells its own.
        warnings.retain(|w| !robot.warnings.contains(w));
        let sigma = noise(config, found, &joints, &slides, &mut warnings)?;
        let chains = Chain::all(&robot.mechanism);
        Ok(Drives {
            free: [
                settings.free(&chains, &laws, &Measured::none(settings.joints.len())),
                settings.free_gears(),
            ]
            .concat(),
            chains,
            scheme: Scheme {
                step_s: settings.step_s.unwrap_or(1.1 / rate_hz),
                sign_width: 0.0,
                middle: true,
                load: settings.load,
                hold: settings.hold,
                effort_at: settings.effort_at,
                effort_span_s: 1.0 / rate_hz,
            },
            values: ServoValues { joints: settings.joints, inertias: robot.mechanism.inertia_vector() },
            sigma,
            together: (config.criterion.correlation_time_s * rate_hz).max(1.0),
            rate_hz,
            periods: config.trajectory.periods,
            slides,
            joints,
            source: found.map(|f| f.source.clone()),
            warnings,
        })
    }

    /// The problem of the search.
    pub(super) fn problem(&self, robot: &Robot, config: &DesignConfig) -> Result<RobotProblem, Error> {
        let (model, _) = model(robot)?;
        let mut linear = model.parameters().prior();
        for (joint, values) in self.joints.iter().zip(&self.values.joints) {
            for term in [Term::Coulomb, Term::Viscous, Term::RotorInertia, Term::Offset] {
                let name = symbol(term).map(|s| format!("{joint}.{s}"));
                if let Some(column) = name.and_then(|n| model.parameters().column(&n)) {
                    linear[column] = values.get(term);
                }
            }
        }
        let limits = joint_limits(robot, config, &self.joints, &mut Vec::new())?;
        let inertia = mean_inertias(robot, &limits);
        let of_joint = |(j, values): (usize, &ServoJoint)| PositionLoop {
            position_gain: values.get(Term::PositionGain),
            velocity_gain: values.get(Term::VelocityGain),
            damping: values.get(Term::VelocityGain) + values.get(Term::Viscous),
            inertia: inertia[j] + values.get(Term::RotorInertia),
            delay: values.get(Term::Delay) + values.get(Term::SmoothingTime),
        };
        let loops = self.values.joints.iter().enumerate().map(of_joint).collect();
        let kept: Vec<(usize, ServoColumn)> = (0..self.free.len())
            .filter_map(|k| self.column(&self.free[k], &model).map(|column| (k, column)))
            .collect();
        let name = config.criterion.name.unwrap_or(CriterionName::RelativeStd);
        let criterion = self.criterion(name, config, &kept)?;
        let prior = self.prior(&kept);
        let columns = kept.into_iter().map(|(k, column)| (column, self.info(k))).collect();
        let period = config.form().period_s;
        let excitation = ServoExcitation::new(model.clone(), linear.clone(), loops, period, columns);
        let subject = Subject {
            excitation: Box::new(excitation),
            model,
            nominal: Some(linear),
            noise: Some(self.sigma.clone()),
        };
        let mut set = problem::problem_of(robot, config, subject, name, criterion)?;
        set.problem.prior = prior;
        set.assumptions.splice(0..0, self.warnings.iter().cloned());
        Ok(set)
    }

    /// What stands for a parameter in the linear loops.
    fn column(&self, free: &Free, model: &RobotModel) -> Option<ServoColumn> {
        let (term, joints) = (free.as_term()?, free.joints());
        match term {
            Term::PositionGain => Some(ServoColumn::PositionGain(joints.to_vec())),
            Term::Delay => Some(ServoColumn::Delay(joints.to_vec())),
            Term::Zero => joints.first().map(|j| ServoColumn::Zero(*j)),
            Term::Stiction | Term::StribeckVelocity => {
                let joint = *joints.first()?;
                let values = &self.values.joints[joint];
                let (velocity, stiction) = (values.get(Term::StribeckVelocity), values.get(Term::Stiction));
                Some(match term {
                    Term::Stiction => ServoColumn::Stiction { joint, velocity },
                    _ => ServoColumn::Stribeck { joint, velocity, stiction },
                })
            }
            _ => {
                let name = format!("{}.{}", self.joints[*joints.first()?], symbol(term)?);
                model.parameters().column(&name).map(ServoColumn::Effort)
            }
        }
    }

    fn info(&self, k: usize) -> ColumnInfo {
        let free = &self.free[k];
        let slides = free.joints().first().is_some_and(|j| self.slides[*j]);
        let term = free.as_term().unwrap_or(Term::Offset);
        // Of what lies about zero no share can be told.
        let nominal = Some(self.values.get(free)).filter(|_| counts(term));
        ColumnInfo { name: member(free, &self.joints), unit: term.unit(slides).to_owned(), nominal }
    }

    fn criterion(
        &self,
        name: CriterionName,
        config: &DesignConfig,
        kept: &[(usize, ServoColumn)],
    ) -> Result<Criterion, Error> {
        if name != CriterionName::RelativeStd {
            let columns: Vec<ColumnInfo> = kept.iter().map(|(k, _)| self.info(*k)).collect();
            return problem::criterion(name, config, &columns);
        }
        let size = |term: Term, free: &Free| {
            let alike =
                self.free.iter().filter(|f| f.as_term() == Some(term)).map(|f| self.values.get(f).abs());
            // Of what stands at a bound at zero no share can be asked for.
            let floor = problem::FLOOR_SHARE * alike.fold(0.0, f64::max);
            self.values.get(free).abs().max(floor)
        };
        let weight = |k: usize| match self.free[k].as_term().filter(|term| counts(*term)) {
            Some(term) => match size(term, &self.free[k]) {
                0.0 => 1.0,
                x => 1.0 / (x * x),
            },
            None => 0.0,
        };
        Ok(Criterion::raw(Measure::Trace(kept.iter().map(|(k, _)| weight(*k)).collect())))
    }

    /// Rows of what is known beforehand.
    fn prior(&self, kept: &[(usize, ServoColumn)]) -> Option<Mat> {
        let rows: Vec<(usize, f64)> = kept
            .iter()
            .enumerate()
            .filter_map(|(c, (k, _))| self.free[*k].prior.map(|known| (c, 1.0 / known.std)))
            .collect();
        let mut out = Mat::zeros(rows.len(), kept.len());
        for (row, (column, weight)) in rows.iter().enumerate() {
            out[(row, *column)] = *weight;
        }
        (!rows.is_empty()).then_some(out)
    }

    /// The commands of a trajectory as a log without readings, in the encoders' numbers.
    pub(super) fn commands(&self, problem: &Problem, coefficients: &[Vec<f64>]) -> ServoLog {
        let rows = (self.periods as f64 * problem.period() * self.rate_hz + 1e-6).floor() as usize + 1;
        let time: Vec<f64> = (0..rows).map(|k| k as f64 / self.rate_hz).collect();
        let basis = FourierBasis::new(problem.base, problem.harmonics, time.clone());
        let command: Vec<Vec<f64>> = coefficients
            .iter()
            .zip(&self.values.joints)
            .map(|(x, joint)| {
                let mut q = vec![0.0; rows];
                basis.evaluate(0, x, &mut q);
                q.iter_mut().for_each(|q| *q = joint.reading(*q));
                q
            })
            .collect();
        ServoLog::new("design", time, command.clone(), command)
    }

    /// What a log of the trajectory will tell by simulation, and where it leads the robot.
    pub(super) fn forecast(
        &self,
        problem: &Problem,
        coefficients: &[Vec<f64>],
        samples: usize,
    ) -> Result<(Option<Forecast>, FollowedRecord), Error> {
        let commands = self.commands(problem, coefficients);
        let simulated = self.simulate(&commands)?;
        let seen = simulated.seen.clone();
        let columns: Vec<ColumnInfo> = seen.iter().map(|k| self.info(*k)).collect();
        let triangle_of = |other: &[Vec<f64>]| {
            let other = self.simulate(&self.commands(problem, other)).ok()?;
            (other.seen == seen).then_some(other.triangle)
        };
        let found = forecast_by(problem, coefficients, samples, &columns, &triangle_of);
        let joints = (0..self.joints.len()).map(|j| self.followed(j, &commands, &simulated)).collect();
        let unseen = (0..self.free.len()).filter(|k| !seen.contains(k));
        let record = FollowedRecord {
            joints,
            breaks: self.broken(problem, &simulated),
            groups: simulated
                .groups
                .iter()
                .map(|g| ServoGroupRecord::of(g, &self.free, &self.joints))
                .collect(),
            unseen: unseen.map(|k| member(&self.free[k], &self.joints)).collect(),
        };
        Ok((found, record))
    }

    /// What the drives are told at positions of all joints, coordinate after coordinate, by joint.
    pub(super) fn told(&self, q: &[f64]) -> Vec<Vec<f64>> {
        let samples = q.len() / self.joints.len().max(1);
        let by_joint = q.chunks_exact(samples.max(1)).zip(&self.values.joints);
        by_joint.map(|(q, joint)| q.iter().map(|q| joint.reading(*q)).collect()).collect()
    }

    /// Limits of places that the simulated robot breaks, each at its worst.
    fn broken(&self, problem: &Problem, simulated: &ServoForecast) -> Vec<BrokenBehind> {
        let (n, rows) = (self.joints.len(), simulated.reading.first().map_or(0, Vec::len));
        let of_joint = |(joint, reading): (&ServoJoint, &Vec<f64>)| -> Vec<f64> {
            reading.iter().map(|x| joint.position(*x)).collect()
        };
        let q: Vec<f64> = self.values.joints.iter().zip(&simulated.reading).flat_map(of_joint).collect();
        // Places know nothing of rates.
        let still = vec![0.0; n * rows];
        let block = MotionBlock::plain(rows, &q, &still, &still);
        let mut out: Vec<BrokenBehind> = Vec::new();
        for constraint in &problem.constraints {
            let about = constraint.rows();
            let mut values = vec![0.0; about.len() * rows];
            constraint.values(&block, rows, &mut values);
            for (row, values) in about.iter().zip(values.chunks_exact(rows.max(1))) {
                let excess = |x: &f64| (x - row.upper).max(row.lower - x) * row.scale;
                let by_m = values.iter().map(excess).fold(f64::NEG_INFINITY, f64::max);
                if row.kind == ConstraintKind::Effort || by_m <= PLACE_EXCESS {
                    continue;
                }
                let (kind, subject) = (LimitKind::Path(row.kind).to_string(), row.subject.clone());
                match out.iter_mut().find(|b| b.kind == kind && b.subject == subject) {
                    Some(known) => known.by_m = known.by_m.max(by_m),
                    None => out.push(BrokenBehind { kind, subject, by_m }),
                }
            }
        }
        out
    }

    fn followed(&self, j: usize, commands: &ServoLog, simulated: &ServoForecast) -> FollowedJoint {
        let (joint, reading) = (&self.values.joints[j], &simulated.reading[j]);
        let rows = reading.len() as f64;
        let squares: f64 = commands.command[j].iter().zip(reading).map(|(u, x)| (u - x) * (u - x)).sum();
        let positions: Vec<f64> = reading.iter().map(|x| joint.position(*x)).collect();
        let largest = |of: &[f64]| of.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        FollowedJoint {
            joint: self.joints[j].clone(),
            behind_rms: (squares / rows).sqrt(),
            position: [
                positions.iter().copied().fold(f64::INFINITY, f64::min),
                positions.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ],
            speed: largest(&simulated.velocity[j]),
            effort: largest(&simulated.effort[j]),
            at_limit: {
                let limit = joint.get(Term::EffortLimit) * (1.0 - 1e-9);
                simulated.effort[j].iter().filter(|e| e.abs() >= limit).count() as f64 / rows
            },
            direction: joint.direction,
            zero: joint.get(Term::Zero),
        }
    }

    fn simulate(&self, commands: &ServoLog) -> Result<ServoForecast, Error> {
        let sigma: Vec<f64> = self.sigma.iter().map(|s| s * self.together.sqrt()).collect();
        forecast(&self.chains, commands, &self.values, &self.free, self.scheme, &sigma)
            .map_err(|lost| ServoFault::Fit(lost.into()).into())
    }

    /// Moves a design until the simulated robot keeps the limits too, as far as that goes.
    ///
    /// The linear loops of the search keep them; friction, coupling and inertia that changes with the pose take the robot a little beyond. Ranges and
    /// speeds are made smaller by that much, and the search goes on from where it was.
    pub(super) fn within(
        &self,
        problem: &mut Problem,
        settings: &Settings,
        mut found: Design,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Design, Error> {
        let stated = problem.limits.clone();
        for round in 1..=ROUNDS {
            let simulated = self.simulate(&self.commands(problem, &found.coefficients))?;
            let mut beyond = false;
            for (j, (limit, stated)) in problem.limits.iter_mut().zip(&stated).enumerate() {
                let joint = &self.values.joints[j];
                let positions = || simulated.reading[j].iter().map(|x| joint.position(*x));
                let low = positions().fold(f64::INFINITY, f64::min);
                let high = positions().fold(f64::NEG_INFINITY, f64::max);
                let speed = simulated.velocity[j].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let room = ROOM * stated.half_range();
                if low < stated.position.0 {
                    (beyond, limit.position.0) = (true, limit.position.0 + stated.position.0 - low + room);
                }
                if high > stated.position.1 {
                    (beyond, limit.position.1) = (true, limit.position.1 - (high - stated.position.1) - room);
                }
                if speed > (1.0 + SPEED_EXCESS) * stated.velocity {
                    (beyond, limit.velocity) = (true, limit.velocity * stated.velocity / speed);
                }
            }
            if !beyond || problem.limits.iter().any(|l| l.position.0 >= l.position.1) {
                break;
            }
            progress(round);
            let seed = found.best().seed;
            let once =
                Settings { starts: 1, seed, from: Some(found.coefficients.clone()), ..settings.clone() };
            let again = dynid_excitation::design(problem, &once, Vec::new(), &mut |_| {});
            let Ok(Outcome::Found(again)) = again else { break };
            found.coefficients.clone_from(&again.coefficients);
            let evaluations = found.best().evaluations + again.best().evaluations;
            found.starts[found.best] = StartOutcome { evaluations, ..again.best().clone() };
        }
        problem.limits = stated;
        Ok(found)
    }

    /// What the simulated robot does beyond the limits of what it was told, in words.
    /// `efforts`: limits that are kept, by joint.
    pub(super) fn excesses(
        &self,
        limits: &[MotionLimits],
        efforts: &[Option<f64>],
        followed: &FollowedRecord,
    ) -> Vec<String> {
        let mut out = Vec::new();
        for broken in &followed.breaks {
            out.push(format!(
                "the simulated robot, which is not where its command is, breaks a limit that the command keeps: {} of {} by {:.0} mm; raise `margin_m`, or \
                 lower `share` or `acceleration`",
                broken.kind,
                broken.subject,
                1e3 * broken.by_m
            ));
        }
        for (joint, limit) in followed.joints.iter().zip(efforts) {
            if let Some(limit) = limit.filter(|limit| joint.effort > (1.0 + EFFORT_EXCESS) * limit) {
                out.push(format!(
                    "the simulated drive of `{}` pushes with {:.2} where {limit:.2} is the limit: lower `share`, or `acceleration`",
                    joint.joint, joint.effort
                ));
            }
        }
        for ((limit, joint), slides) in limits.iter().zip(&followed.joints).zip(&self.slides) {
            let unit = if *slides { "m" } else { "rad" };
            let [low, high] = joint.position;
            let beyond = (limit.position.0 - low).max(high - limit.position.1);
            if beyond > POSITION_EXCESS * limit.half_range() {
                out.push(format!(
                    "the simulated joint `{}` goes {beyond:.3} {unit} beyond its position limit: lower `share`, or `acceleration`",
                    joint.joint
                ));
            }
            if joint.speed > (1.0 + SPEED_EXCESS) * limit.velocity {
                out.push(format!(
                    "the simulated joint `{}` reaches {:.2} {unit}/s where {:.2} is the limit: lower `share`, or `velocity`",
                    joint.joint, joint.speed, limit.velocity
                ));
            }
        }
        out
    }
}

/// Whether a parameter is what a design is for, beside what is only there to be told apart from it.
fn counts(term: Term) -> bool {
    !matches!(term, Term::Offset | Term::Zero)
}
