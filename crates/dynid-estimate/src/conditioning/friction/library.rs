//! Candidates for the friction of a joint.

use dynid_model::element::{falling_friction, saturating_friction, sign};

use crate::conditioning::states::States;

/// A kind of friction shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ShapeKind {
    /// `|v|`: viscous friction of another size in either direction.
    ViscousMagnitude,
    /// `s(v) exp(-(v/v_s)²)`: friction that falls from rest.
    Stribeck,
    /// `tanh(v/v_c)`: friction that saturates.
    Tanh,
    /// `|τ| s(v)` with the rigid effort `τ` of an earlier fit: friction of loaded gears.
    Load,
}

/// A column of friction over the speed `v` of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionShape {
    /// Which law.
    pub kind: ShapeKind,
    /// `v_s` or `v_c`, rad/s or m/s; 1 and without meaning for the other kinds.
    pub speed: f64,
}

impl FrictionShape {
    /// The column, one entry per speed. `loads`: rigid efforts at the same samples; read by [`ShapeKind::Load`] alone.
    pub(crate) fn column(&self, speeds: &[f64], loads: &[f64]) -> Vec<f64> {
        match self.kind {
            ShapeKind::ViscousMagnitude => speeds.iter().map(|v| v.abs()).collect(),
            ShapeKind::Stribeck => falling_friction(speeds, self.speed),
            ShapeKind::Tanh => saturating_friction(speeds, self.speed),
            ShapeKind::Load => speeds.iter().zip(loads).map(|(v, load)| sign(*v) * load.abs()).collect(),
        }
    }
}

/// Number of Stribeck speeds: steps of at most 1.2.
const STRIBECK: usize = 21;
/// Number of tanh speeds.
const TANH: usize = 10;
/// Least speed in parts of the rms speed, and in standard deviations of velocity noise.
const LEAST: (f64, f64) = (0.03, 3.0);
/// Largest `v_c` in parts of the rms speed.
const WIDEST_TANH: f64 = 2.5;
/// A joint moves in one direction if a smaller share of its samples moves in the other.
const ONE_WAY: f64 = 0.01;

/// Candidates of an output, kind after kind, speeds ascending; none where it moves in one direction only.
pub(super) fn of_output(output: usize, kinds: &[ShapeKind], states: &[States]) -> Vec<FrictionShape> {
    let (mut square, mut noise, mut samples) = (0.0, 0.0, 0.0);
    let mut ways = [0usize; 2];
    for log in states {
        let sigma = log.velocity_sigma[output];
        for v in &log.velocity(output) {
            square += v * v;
            ways[0] += usize::from(*v > LEAST.1 * sigma);
            ways[1] += usize::from(*v < -LEAST.1 * sigma);
        }
        samples += log.samples as f64;
        noise += sigma * sigma * log.samples as f64;
    }
    let fewest = ways[0].min(ways[1]) as f64;
    if fewest == 0.0 || fewest < ONE_WAY * samples {
        return Vec::new();
    }
    let rms = (square / samples).sqrt();
    let least = (LEAST.0 * rms).max(LEAST.1 * (noise / samples).sqrt());
    let speeds = |kind: ShapeKind, most: f64, count: usize| -> Vec<FrictionShape> {
        if least >= most {
            return Vec::new();
        }
        let ratio = (most / least).powf(1.0 / (count - 1) as f64);
        (0..count).map(|k| FrictionShape { kind, speed: least * ratio.powi(k as i32) }).collect()
    };
    kinds
        .iter()
        .flat_map(|kind| match kind {
            ShapeKind::ViscousMagnitude | ShapeKind::Load => vec![FrictionShape { kind: *kind, speed: 1.0 }],
            ShapeKind::Stribeck => speeds(*kind, rms, STRIBECK),
            ShapeKind::Tanh => speeds(*kind, WIDEST_TANH * rms, TANH),
        })
        .collect()
}
