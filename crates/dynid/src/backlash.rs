//! Backlash of the drives of an identified robot, from ordinary logs: whether the residual of the effort holds what gaps would do.

use std::path::Path;

use dynid_clearance::backlash::{
    BacklashSettings, BacklashSignals, BacklashVerdict as Found, estimate as look_for,
};
use dynid_logs::MappingSpec;
use dynid_model::{EffortModel, MotionBlock, RobotModel};
use dynid_motion::filter::{anti_alias, pick};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, States};
use serde::Serialize;

use crate::Error;
use crate::agreement::{Alignment, compare};
use crate::config::{LogConfig, MotorSide};
use crate::estimate::{Estimate, Split};
use crate::logs;

/// What a log says about the gap of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BacklashVerdict {
    /// The residual holds the trace of a gap, beyond what else looks like one.
    Found,
    /// The log does not show a gap.
    NotFound,
    /// The load changes its sign too seldom away from reversals.
    NoCrossings,
    /// Too few samples away from reversals and gaps of the clock.
    TooShort,
    /// The joint does not move in this log.
    AtRest,
}

impl From<Found> for BacklashVerdict {
    fn from(of: Found) -> Self {
        match of {
            Found::Found => BacklashVerdict::Found,
            Found::NotFound => BacklashVerdict::NotFound,
            Found::NoCrossings => BacklashVerdict::NoCrossings,
            Found::TooShort => BacklashVerdict::TooShort,
        }
    }
}

/// Backlash of one joint by one log.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct JointBacklash {
    /// Joint.
    pub joint: String,
    /// Unit of gaps: `rad` or `m`.
    pub unit: &'static str,
    /// Verdict.
    pub verdict: BacklashVerdict,
    /// Gap from flank to flank; if found.
    pub gap: Option<f64>,
    /// Gaps that explain the residual about as well; if found.
    pub interval: Option<(f64, f64)>,
    /// Root of twice the log-likelihood ratio of the most likely gap against none.
    pub evidence: f64,
    /// Evidence for flanks that part at loads where they have no reason to: what else looks like a gap; `None` if the load is
    /// too uncertain for a comparison.
    pub elsewhere: Option<f64>,
    /// Share of the joint's friction behind the transmission, as the most likely gap has it.
    pub friction_share: f64,
    /// Crossings of the gap away from reversals.
    pub crossings: usize,
    /// Smallest gap that would have shown, and with it every larger one, if friction acts at the drive.
    pub would_show: Option<f64>,
    /// Per load at which flanks part, N m or N: largest evidence over gaps.
    pub profile: Vec<(f64, f64)>,
}

/// Backlash of all joints by one log.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LogBacklash {
    /// Log file.
    pub log: String,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Joint by joint.
    pub joints: Vec<JointBacklash>,
}

/// Lowest cut-off of the states where the identification's kernel lies below, Hz.
const LOWEST_HZ: f64 = 10.0;
/// Highest sample rate that is used, Hz.
const FASTEST_HZ: f64 = 1000.0;
/// Gaps that are looked for where joints slide, m.
const SLIDING_RANGE: (f64, f64) = (1e-6, 3e-3);

/// Looks for backlash of every joint in logs of an identified robot ([`dynid_clearance::backlash`]).
///
/// Load and inertia are those of the identified bodies, friction that of the joints' elements; what the fit gave to a motor's
/// inertia counts as the drive's. `file`: of the estimate, for messages.
///
/// # Errors
/// [`Error`]: bad input; a robot with loops or elastic joints, whose transmissions are no single gap.
pub fn backlash(
    (estimate, file): (&Estimate, &Path),
    log_entries: &[LogConfig],
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<Vec<LogBacklash>, Error> {
    let model = estimate.effort_model(file, Split::Consistent)?;
    if model.closed().is_some() || !model.coordinates().is_empty() {
        return Err(Error::Unsupported(format!(
            "{}: backlash is looked for in robots without loops and elastic joints",
            file.display()
        )));
    }
    let values = estimate.values(Split::Consistent);
    let settings = ConditioningSettings::default();
    let alignment = Alignment {
        // Noise of the acceleration would part flanks that the motion does not.
        state_hz: estimate.model.state_hz.min(estimate.model.kernel_hz.max(LOWEST_HZ)),
        delay_samples: estimate.conditioning.delay_samples,
        delay_rate_hz: estimate.conditioning.delay_rate_hz,
        filter_hz: estimate.model.kernel_hz,
    };
    let mut out = Vec::new();
    for entry in log_entries {
        let prepared =
            logs::load(entry, &crate::log::axes(&model), columns, motor_side)?.prepare(&model, &settings)?;
        let agreement = compare(&model, &values, &prepared, &alignment, &settings)?;
        let cutoff = alignment.state_hz.min(settings.cutoff.state_rate * prepared.rate_hz);
        let states = States::new(&prepared, cutoff, &settings)?;
        let parts = Parts::new(&model, &values, &prepared, &states);
        let n = states.samples;
        let mut joints = Vec::new();
        for (output, info) in model.outputs().iter().enumerate() {
            let slides = info.unit == "N";
            let unit = if slides { "m" } else { "rad" };
            if !prepared.moves[output] {
                joints.push(JointBacklash::at_rest(&info.name, unit));
                continue;
            }
            let pairs = agreement.measured[output].iter().zip(agreement.predicted[output].iter());
            let residual: Vec<f64> = pairs.map(|(m, p)| m - p).collect();
            // Flights last hundredths of a second: faster samples cost time and tell no more.
            let factor = ((prepared.rate_hz / FASTEST_HZ) as usize).max(1);
            let of = |signal: &[f64]| pick(&signal[output * n..(output + 1) * n], factor, 0);
            let residual = anti_alias(&residual, factor)
                .map_err(|e| Error::Conditioning(e.into()))
                .map(|signal| pick(&signal, factor, 0))?;
            let signals = BacklashSignals {
                residual: &residual,
                load: &of(&parts.load),
                friction: &of(&parts.friction),
                inertia: &of(&parts.inertia),
                velocity: &pick(&states.velocity(output), factor, 0),
                counted: &pick(&agreement.counted, factor, 0),
                step_s: factor as f64 / prepared.rate_hz,
                state_hz: cutoff,
            };
            let mut settings = BacklashSettings::default();
            if slides {
                settings.range = SLIDING_RANGE;
            }
            let found = look_for(&signals, &settings).map_err(|error| {
                Error::Unsupported(format!("{}: joint `{}`: {error}", prepared.name, info.name))
            })?;
            let is_found = found.verdict == Found::Found;
            joints.push(JointBacklash {
                joint: info.name.clone(),
                unit,
                verdict: found.verdict.into(),
                gap: is_found.then_some(found.gap),
                interval: is_found.then_some(found.interval),
                evidence: found.evidence,
                elsewhere: found.elsewhere,
                friction_share: found.share,
                crossings: found.crossings,
                would_show: found.would_show,
                profile: found.profile,
            });
        }
        out.push(LogBacklash { log: prepared.name.clone(), rate_hz: prepared.rate_hz, joints });
    }
    Ok(out)
}

impl JointBacklash {
    fn at_rest(joint: &str, unit: &'static str) -> Self {
        JointBacklash {
            joint: joint.to_owned(),
            unit,
            verdict: BacklashVerdict::AtRest,
            gap: None,
            interval: None,
            evidence: 0.0,
            elsewhere: None,
            friction_share: 0.0,
            crossings: 0,
            would_show: None,
            profile: Vec::new(),
        }
    }
}

/// What the effort of every output consists of, output after output.
struct Parts {
    load: Vec<f64>,
    friction: Vec<f64>,
    /// Of an output's own acceleration, other joints held.
    inertia: Vec<f64>,
}

impl Parts {
    fn new(model: &RobotModel, values: &[f64], log: &PreparedLog, states: &States) -> Self {
        let (n, outputs) = (states.samples, model.outputs().len());
        let shape = model.parameters().shape_start();
        let inertial = model.mechanism().inertial_parameters();
        let (mut bodies, mut elements) = (values.to_vec(), values.to_vec());
        bodies[inertial..].fill(0.0);
        elements[..inertial].fill(0.0);
        let nothing = vec![0.0; values.len()];
        let remembered = states.remembered(model, &shape, &log.channels);
        let motion = states.block(0..n);
        let still = vec![0.0; motion.q.len()];
        let efforts = |linear: &[f64], velocity: &[f64], acceleration: &[f64]| {
            let mut effort = vec![0.0; outputs * n];
            states.with_block(0..n, &log.channels, &remembered, |motion| {
                let motion = MotionBlock { dq: velocity, ddq: acceleration, ..*motion };
                model.efforts(&motion, &shape, linear, n, &mut effort);
            });
            effort
        };
        let difference =
            |a: Vec<f64>, b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let known = efforts(&nothing, &motion.dq, &motion.ddq);
        let load = difference(efforts(&bodies, &motion.dq, &motion.ddq), &known);
        let friction = efforts(&elements, &motion.dq, &still);
        let resting = efforts(&bodies, &still, &still);
        let mut inertia = vec![0.0; outputs * n];
        for output in 0..outputs {
            let own = output * n..(output + 1) * n;
            let mut unit = still.clone();
            unit[own.clone()].fill(1.0);
            let moved = efforts(&bodies, &still, &unit);
            inertia[own.clone()].copy_from_slice(&difference(moved[own.clone()].to_vec(), &resting[own]));
        }
        Parts { load, friction, inertia }
    }
}
