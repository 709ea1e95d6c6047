//! One joint within its friction: motion of a milliradian, in which bristles bend and hardly slip.
//!
//! ```text
//! J q̈ = τ(t) - b - τ_f
//! τ_f = σ0 z + σ1 ż + s(v) f_v(|v|),   ż = v - σ0 |v| z / g(|v|)
//! ```
//!
//! `J`: inertia at the joint; `b`: constant effort (gravity in this pose, offset); `g`: steady friction without the viscous
//! part; `f_v`: viscous part. At the start the joint is at rest in equilibrium, `σ0 z = τ(0) - b`.
//!
//! Runge-Kutta of order four, with as many equal steps per sample as keep its largest rate (`σ1/J`, `√(σ0/J)`) within a
//! quarter per step, far inside the region of stability (2.8) and with some 1e-5 of the motion as error. `g` and `f_v` come
//! from the steady law as a table over the logarithm of speed, so that their equations stay where elements are.

use dynid_model::{EffortModel, MotionBlock, RobotModel};

use crate::error::{SimError, demand, demand_length};

/// Largest product of step and rate.
const STEP_RATE: f64 = 0.25;
/// Most steps within one sample.
const MOST_STEPS: f64 = 4096.0;
/// Points of a table, and the decades below its largest speed that it covers.
const POINTS: usize = 2400;
const DECADES: f64 = 12.0;

/// Steady friction of one joint over speed, split into what bristles carry and what is viscous, as a table.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyTable {
    first: f64,
    per_step: f64,
    bristles: Vec<f64>,
    viscous: Vec<f64>,
}

impl SteadyTable {
    /// From an effort model of one joint at one temperature.
    ///
    /// `bristles`, `viscous`: linear parameters of the model with all but the part in question set to zero. `largest_speed`:
    /// end of the table, rad/s or m/s; it begins twelve decades below, and its ends stand for what lies beyond. Between
    /// points it is linear in the logarithm of speed: within 2e-5 of the curve.
    ///
    /// # Errors
    /// [`SimError::Length`] for a list of the wrong length, [`SimError::Setting`] for a speed that is not positive, a model
    /// of more than one joint, or bristles without friction somewhere.
    pub fn new(
        model: &RobotModel,
        shape: &[f64],
        [bristles, viscous]: [&[f64]; 2],
        temperature: f64,
        largest_speed: f64,
    ) -> Result<Self, SimError> {
        let linear = model.parameters().linear.len();
        demand_length("bristles", linear, bristles.len())?;
        demand_length("viscous", linear, viscous.len())?;
        demand_length("shape", model.parameters().shape.len(), shape.len())?;
        demand(model.outputs().len() == 1, "model", "one joint", model.outputs().len())?;
        demand(
            largest_speed > 0.0 && largest_speed.is_finite(),
            "largest_speed",
            "a positive number",
            largest_speed,
        )?;
        let step = DECADES * std::f64::consts::LN_10 / (POINTS - 1) as f64;
        let first = largest_speed.ln() - step * (POINTS - 1) as f64;
        let speeds: Vec<f64> = (0..POINTS).map(|k| (first + step * k as f64).exp()).collect();
        let (zeros, warm) = (vec![0.0; POINTS], vec![temperature; POINTS]);
        let channels: Vec<(&str, &[f64])> =
            model.channels().iter().map(|name| (name.as_str(), warm.as_slice())).collect();
        // Gravity is no matter: the bodies' parameters are zero.
        let motion =
            MotionBlock { channels: &channels, ..MotionBlock::plain(POINTS, &zeros, &speeds, &zeros) };
        let curve = |linear: &[f64]| {
            let mut effort = vec![0.0; POINTS];
            model.efforts(&motion, shape, linear, POINTS, &mut effort);
            effort
        };
        let table =
            SteadyTable { first, per_step: 1.0 / step, bristles: curve(bristles), viscous: curve(viscous) };
        let least = table.bristles.iter().copied().fold(f64::INFINITY, f64::min);
        demand(least > 0.0, "bristles", "positive friction at all speeds", least)?;
        Ok(table)
    }

    /// `g` and `f_v` at an absolute speed.
    fn at(&self, speed: f64) -> (f64, f64) {
        if speed == 0.0 {
            return (self.bristles[0], 0.0);
        }
        let place = ((speed.ln() - self.first) * self.per_step).clamp(0.0, (POINTS - 1) as f64);
        let k = (place as usize).min(POINTS - 2);
        let share = place - k as f64;
        let between = |list: &[f64]| list[k] + share * (list[k + 1] - list[k]);
        (between(&self.bristles), between(&self.viscous))
    }
}

/// A joint that is moved within its friction.
#[derive(Debug, Clone, PartialEq)]
pub struct PreslidingJoint {
    /// Inertia at the joint, all that moves with it, kg m² or kg.
    pub inertia: f64,
    /// Constant effort `b`, N m or N.
    pub offset: f64,
    /// Bristle stiffness `σ0`, N m/rad or N/m.
    pub stiffness: f64,
    /// Bristle damping `σ1`, N m s/rad or N s/m.
    pub damping: f64,
}

/// The effort between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffortHold {
    /// Held until the next sample, as a drive does.
    Held,
    /// Straight from one sample to the next.
    Linear,
}

/// Positions of the joint at the samples of the effort, from 0.
///
/// `interval`: between samples, s. Numbers that overflow come back as they are, not finite.
///
/// # Errors
/// [`SimError::Setting`] for values that are not positive and finite, [`SimError::TooFast`] if a sample needs more
/// than 4096 steps.
pub fn presliding(
    joint: &PreslidingJoint,
    steady: &SteadyTable,
    effort: &[f64],
    interval: f64,
    hold: EffortHold,
) -> Result<Vec<f64>, SimError> {
    for (name, x) in [
        ("inertia", joint.inertia),
        ("stiffness", joint.stiffness),
        ("damping", joint.damping),
        ("interval", interval),
    ] {
        demand(x > 0.0 && x.is_finite(), name, "a positive number", x)?;
    }
    let rate = (joint.damping / joint.inertia).max((joint.stiffness / joint.inertia).sqrt());
    let steps = (interval * rate / STEP_RATE).ceil().max(1.0);
    if steps > MOST_STEPS {
        return Err(SimError::TooFast { time: 0.0, steps: steps as usize });
    }
    let h = interval / steps;
    let start = effort.first().map_or(0.0, |e| (e - joint.offset) / joint.stiffness);
    let mut state = [0.0, 0.0, start];
    let mut positions = Vec::with_capacity(effort.len());
    for k in 0..effort.len() {
        positions.push(state[0]);
        let (from, to) = (effort[k], effort.get(k + 1).copied().unwrap_or(effort[k]));
        let rise = if hold == EffortHold::Linear { (to - from) / steps } else { 0.0 };
        for step in 0..steps as usize {
            let before = from + rise * step as f64;
            state = runge_kutta(joint, steady, state, [before, before + 0.5 * rise, before + rise], h);
        }
    }
    Ok(positions)
}

/// Rates of position, velocity and bristle.
fn rates(joint: &PreslidingJoint, steady: &SteadyTable, [_, v, z]: [f64; 3], effort: f64) -> [f64; 3] {
    let (g, viscous) = steady.at(v.abs());
    let bend = v - joint.stiffness * v.abs() * z / g;
    let friction = joint.stiffness * z + joint.damping * bend + viscous.copysign(v);
    [v, (effort - joint.offset - friction) / joint.inertia, bend]
}

fn runge_kutta(
    joint: &PreslidingJoint,
    steady: &SteadyTable,
    x: [f64; 3],
    [start, middle, end]: [f64; 3],
    h: f64,
) -> [f64; 3] {
    let ahead = |k: [f64; 3], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
    let k1 = rates(joint, steady, x, start);
    let k2 = rates(joint, steady, ahead(k1, 0.5 * h), middle);
    let k3 = rates(joint, steady, ahead(k2, 0.5 * h), middle);
    let k4 = rates(joint, steady, ahead(k3, h), end);
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}
