//! Clearances of an identified robot from a log: by probes at the journals, by the swing of the journals in the effort.

use std::path::Path;

use dynid_clearance::orbit::{self, OrbitSample, OrbitSettings};
use dynid_clearance::swing::{self, SwingSettings};
use dynid_logs::MappingSpec;
use dynid_model::{EffortModel, JournalPath, MotionBlock, RobotModel, journal_channels};
use dynid_motion::Channel;
use dynid_robots::ClearanceSpec;
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, States, prepare};
use serde::Serialize;

use crate::Error;
use crate::agreement::{Alignment, compare};
use crate::config::{LogConfig, MotorSide};
use crate::estimate::{Estimate, Split};
use crate::logs;
use crate::robot::Robot;

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Valued {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

impl From<dynid_clearance::Estimate> for Valued {
    fn from(of: dynid_clearance::Estimate) -> Self {
        Valued { value: of.value, std: of.std }
    }
}

/// What probes at a journal tell.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ProbedClearance {
    /// Radial clearance, m.
    pub gap: Valued,
    /// Friction coefficient.
    pub friction: Valued,
    /// Factor of the law's stiffness; its deviation is relative.
    pub stiffness: Valued,
    /// Share of the prior variance of the stiffness that the log took away.
    pub stiffness_seen: f64,
    /// Length of the offset, clearance and penetration: known whatever the stiffness is, m.
    pub offset: Valued,
    /// Root of the mean square of the residuals, m.
    pub residual: f64,
    /// Samples used: loaded and sliding.
    pub samples: usize,
}

/// What the swing of a journal in the effort of its drive tells.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct SwingClearance {
    /// Whether noise alone would show such a line in fewer than one of a thousand logs.
    pub found: bool,
    /// Frequency of the strongest line, Hz.
    pub frequency_hz: f64,
    /// Root of the mean square of its effort, N m.
    pub amplitude: f64,
    /// Length of the offset, m; without meaning unless found.
    pub offset: Valued,
    /// Radial clearance by the law's penetration, m; `None` unless found.
    pub gap: Option<Valued>,
}

/// The clearance of one joint.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct JointClearance {
    /// Joint.
    pub joint: String,
    /// Clearance that the robot file states, m.
    pub stated_gap: f64,
    /// Mean force on the journal, N.
    pub load: f64,
    /// With probes.
    pub probed: Option<ProbedClearance>,
    /// From the effort; `None` where the log is too slow for the stated clearance, since a line could be an alias.
    pub swing: Option<SwingClearance>,
    /// Friction coefficient of the fit where its journals move; else its Coulomb friction over load and journal radius: a friction
    /// coefficient, if all of that friction is the bearing's.
    pub friction_of_fit: Option<f64>,
    /// What could not be done, and why.
    pub remarks: Vec<String>,
}

/// Estimates the clearances that a robot file states from a log of the robot, with the parameters of an estimate.
///
/// Loads on journals come from the identified link parameters on ideal geometry. Probes are the log's columns
/// [`journal_channels`]; where there are none, only the effort speaks. `file`: of the estimate, for messages.
///
/// # Errors
/// [`Error`]: bad input; a robot without clearance, or another than the one identified.
pub fn clearance(
    robot: &Robot,
    (estimate, file): (&Estimate, &Path),
    log: &LogConfig,
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<Vec<JointClearance>, Error> {
    let Some(journals) = robot.with_clearance()? else {
        return Err(Error::Unsupported(format!(
            "{}: no joint has clearance: state it as `[element.<joint>] clearance = {{ journal_radius = ..., gap = ... }}`, the gap as a guess",
            robot.path.display()
        )));
    };
    let model = estimate.effort_model(file, Split::Consistent)?;
    let ours = robot.mechanism.rate_names();
    if model.mechanism().rate_names() != ours || model.joints().len() != ours.len() {
        return Err(Error::Unsupported(format!(
            "{}: expected an estimate of a robot with the joints {}, found one of {}",
            file.display(),
            ours.join(", "),
            model.mechanism().rate_names().join(", ")
        )));
    }
    let settings = ConditioningSettings::default();
    let loaded = logs::load(log, &crate::log::axes(&model), columns, motor_side)?;
    let mut prepared = loaded.prepare(&model, &settings)?;
    // Deviations count samples with noise of their own: offsets as the probes gave them, not as a fit filters them.
    prepared.channels = prepare(&loaded.log, &model, &settings)?.channels;
    let values = estimate.values(Split::Consistent);
    let alignment = Alignment {
        state_hz: estimate.model.state_hz,
        delay_samples: estimate.conditioning.delay_samples,
        delay_rate_hz: estimate.conditioning.delay_rate_hz,
        filter_hz: estimate.model.kernel_hz,
    };
    // A model that followed the probes would leave no swing in the residual.
    let read = |c: &&Channel| model.channels().contains(&c.name);
    let channels = prepared.channels.iter().filter(read).cloned().collect();
    let unprobed = PreparedLog { channels, ..prepared.clone() };
    let agreement = compare(&model, &values, &unprobed, &alignment, &settings)?;
    let cutoff = alignment.state_hz.min(settings.cutoff.state_rate * prepared.rate_hz);
    let states = States::new(&prepared, cutoff, &settings)?;
    let counted = longest_run(&agreement.counted);
    let record = Record {
        robot,
        journals: &journals,
        model: &model,
        values: &values,
        log: &prepared,
        states: &states,
    };
    let loads = record.loads();
    robot
        .elements
        .clearance
        .iter()
        .map(|spec| {
            let residual = |output: usize| -> Vec<f64> {
                let range = counted.clone();
                let pairs =
                    agreement.measured[output][range.clone()].iter().zip(&agreement.predicted[output][range]);
                pairs.map(|(m, p)| m - p).collect()
            };
            record.joint(spec, &loads, counted.clone(), residual)
        })
        .collect()
}

/// The longest stretch without a gap.
fn longest_run(counted: &[bool]) -> std::ops::Range<usize> {
    let (mut best, mut start) = (0..0, 0);
    for k in 0..=counted.len() {
        if k == counted.len() || !counted[k] {
            if k - start > best.len() {
                best = start..k;
            }
            start = k + 1;
        }
    }
    best
}

struct Record<'a> {
    robot: &'a Robot,
    journals: &'a RobotModel,
    model: &'a RobotModel,
    values: &'a [f64],
    log: &'a PreparedLog,
    states: &'a States,
}

impl Record<'_> {
    /// Efforts of the rigid bodies at all rates of the tree with clearance, journals centred.
    fn loads(&self) -> Vec<f64> {
        let n = self.states.samples;
        let rates = self.journals.joints().len();
        let centred = |mut of: Vec<f64>| {
            of.truncate(self.model.joints().len() * n);
            of.resize(rates * n, 0.0);
            of
        };
        let motion = self.states.block(0..n);
        let [q, dq, ddq] = [motion.q, motion.dq, motion.ddq].map(centred);
        let mut linear = vec![0.0; self.journals.parameters().linear.len()];
        let bodies = self.robot.mechanism.inertial_parameters();
        linear[..bodies].copy_from_slice(&self.values[..bodies]);
        let mut effort = vec![0.0; rates * n];
        self.journals.efforts(&MotionBlock::plain(n, &q, &dq, &ddq), &[], &linear, n, &mut effort);
        effort
    }

    fn joint(
        &self,
        spec: &ClearanceSpec,
        loads: &[f64],
        counted: std::ops::Range<usize>,
        residual: impl Fn(usize) -> Vec<f64>,
    ) -> Result<JointClearance, Error> {
        let n = self.states.samples;
        let contact =
            self.journals.clearances().find(|c| self.journals.joints()[c.rotation].name == spec.joint);
        let Some(contact) = contact else {
            let known = self.robot.mechanism.rate_names();
            return Err(Error::UnknownJoint { name: spec.joint.clone(), known });
        };
        let output = contact.rotation;
        let speed = self.states.velocity(output);
        let force: Vec<[f64; 2]> = counted
            .clone()
            .map(|s| {
                let position = contact.translations.map(|rate| loads[rate * n + s]);
                let path = JournalPath { position, ..JournalPath::default() };
                path.in_journal([self.states.position(output)[s], 0.0, 0.0]).position
            })
            .collect();
        let sizes: Vec<f64> = force.iter().map(|[x, y]| x.hypot(*y)).collect();
        let load = sizes.iter().sum::<f64>() / sizes.len().max(1) as f64;
        let mut remarks = Vec::new();
        let channel = |name: &String| self.log.channels.iter().find(|c| c.name == *name).map(|c| &c.values);
        let probed = match journal_channels(&spec.joint).each_ref().map(channel) {
            [Some(x), Some(y)] => {
                let samples: Vec<OrbitSample> = counted
                    .clone()
                    .zip(&force)
                    .map(|(s, load)| {
                        let speed = speed[s] * contact.journal_radius;
                        let sliding = orbit::sliding_of(&contact.friction, speed);
                        OrbitSample { offset: [x[s], y[s]], load: *load, sliding }
                    })
                    .collect();
                match orbit::estimate(&samples, &spec.law, &OrbitSettings::default()) {
                    Ok(found) => Some(ProbedClearance {
                        gap: found.clearance.into(),
                        friction: found.friction.into(),
                        stiffness: found.stiffness.into(),
                        stiffness_seen: found.stiffness_seen,
                        offset: found.length.into(),
                        residual: found.residual,
                        samples: found.samples,
                    }),
                    Err(error) => {
                        remarks.push(format!("offsets of the journal: {error}"));
                        None
                    }
                }
            }
            _ => {
                let [x, y] = journal_channels(&spec.joint);
                remarks.push(format!("no offsets of the journal in the log (columns `{x}`, `{y}`, m)"));
                None
            }
        };
        let swing = self.swing(spec, &residual(output), &sizes, load, output, &mut remarks)?;
        let fitted = |symbol: &str| {
            let column = self.model.parameters().column(&format!("{}.{symbol}", spec.joint))?;
            Some(self.values[column])
        };
        let coulomb = || fitted("fc").map(|fc| fc / (load * contact.journal_radius));
        let friction_of_fit = fitted("mu").or_else(coulomb).filter(|f| f.is_finite());
        Ok(JointClearance {
            joint: spec.joint.clone(),
            stated_gap: spec.gap(),
            load,
            probed,
            swing,
            friction_of_fit,
            remarks,
        })
    }

    fn swing(
        &self,
        spec: &ClearanceSpec,
        residual: &[f64],
        sizes: &[f64],
        load: f64,
        output: usize,
        remarks: &mut Vec<String>,
    ) -> Result<Option<SwingClearance>, Error> {
        // All that a joint carries swings with its journal.
        let carried = carried_mass(self.robot, self.values, output);
        let gravity: Vec<f64> = sizes.iter().map(|f| f / carried).collect();
        let settings = SwingSettings { friction: spec.friction.coefficient, ..SwingSettings::default() };
        let found = match swing::estimate(residual, &gravity, 1.0 / self.log.rate_hz, &settings) {
            Ok(found) => found,
            Err(error) => {
                remarks.push(format!("swing in the effort: {error}"));
                return Ok(None);
            }
        };
        if found.shortest > spec.gap() {
            // A line may be the alias of a swing that is too fast.
            remarks.push(format!(
                "swing in the effort: {:.0} Hz are too slow for the stated gap, at least {:.0} Hz are needed",
                self.log.rate_hz,
                // As the root of the offset's length.
                (self.log.rate_hz * (found.shortest / spec.gap()).sqrt()).ceil()
            ));
            return Ok(None);
        }
        let prior = OrbitSettings::default().stiffness_prior;
        let gap = match found.found {
            true => match orbit::clearance_of_length(&spec.law, found.length, load, prior) {
                Ok(gap) => Some(gap.into()),
                Err(error) => {
                    remarks.push(format!("swing in the effort: {error}"));
                    None
                }
            },
            false => None,
        };
        Ok(Some(SwingClearance {
            found: found.found,
            frequency_hz: found.frequency_hz,
            amplitude: found.amplitude,
            offset: found.length.into(),
            gap,
        }))
    }
}

/// Mass of a joint's body and of all behind it, kg.
fn carried_mass(robot: &Robot, values: &[f64], output: usize) -> f64 {
    let bodies = robot.mechanism.bodies();
    let own = robot.mechanism.rate_bodies()[output];
    let behind = |mut body: usize| loop {
        if body == own {
            return true;
        }
        match bodies[body].parent {
            Some(parent) => body = parent,
            None => return false,
        }
    };
    (0..bodies.len()).filter(|b| behind(*b)).map(|b| values[10 * b]).sum()
}
