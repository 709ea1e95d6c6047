//! Shapes of friction, and the candidates for a joint.

use dynid_model::element::{SlipSpring, Velocity, VelocityLaw as _, laws, sign};

use super::states::States;

/// A kind of friction shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ShapeKind {
    /// `|v|`: viscous friction of another size in either direction.
    ViscousMagnitude,
    /// `s(v) exp(-(v/v_s)²)`: friction that falls from rest.
    Stribeck,
    /// `tanh(v/v_c)`: friction that saturates.
    Tanh,
    /// `s(v) |v|^p` in place of viscous friction: friction that grows less (or more) than the speed does.
    Power,
    /// `|τ| s(v)` with the rigid effort `τ` of an earlier fit: friction of loaded gears.
    Load,
    /// [`MaxwellSlip`](dynid_model::element::MaxwellSlip): friction that gives way over a travel after a reversal.
    MaxwellSlip,
}

impl ShapeKind {
    /// All kinds, in the order in which they are tried.
    pub const ALL: [ShapeKind; 6] = [
        ShapeKind::ViscousMagnitude,
        ShapeKind::Stribeck,
        ShapeKind::Tanh,
        ShapeKind::Power,
        ShapeKind::Load,
        ShapeKind::MaxwellSlip,
    ];

    /// Name of the element that it is one of.
    pub fn element(self) -> &'static str {
        match self {
            ShapeKind::ViscousMagnitude => "viscous_magnitude",
            ShapeKind::Stribeck => "stribeck",
            ShapeKind::Tanh => "tanh",
            ShapeKind::Power => "power",
            ShapeKind::Load => "load",
            ShapeKind::MaxwellSlip => "maxwell_slip",
        }
    }

    /// Whether a joint has one of the two at most: both say how friction bends over speed.
    pub(super) fn excludes(self, other: ShapeKind) -> bool {
        let bends = |kind| matches!(kind, ShapeKind::Tanh | ShapeKind::Power);
        self == other || (bends(self) && bends(other))
    }
}

/// A column of friction of a joint over its speed `v`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionShape {
    /// Which law.
    pub kind: ShapeKind,
    /// `v_s` or `v_c`, rad/s or m/s, the exponent `p`, or the travel, rad or m; 1 and without meaning for the other kinds.
    pub value: f64,
}

impl FrictionShape {
    /// Where a search of the value is to stay: a factor of 3 to either side, of exponents all that a power may have.
    pub fn bounds(&self) -> (f64, f64) {
        match self.kind {
            ShapeKind::Power => POWER,
            _ => (self.value / 3.0, 3.0 * self.value),
        }
    }

    /// The column, one entry per speed. At the same samples: `loads`, rigid efforts, read by [`ShapeKind::Load`] alone, and `positions`, read by
    /// [`ShapeKind::MaxwellSlip`] alone, whose `spring` is taken on to the last of them.
    pub(crate) fn column(
        &self,
        positions: &[f64],
        speeds: &[f64],
        loads: &[f64],
        spring: &mut SlipSpring,
    ) -> Vec<f64> {
        let velocities = speeds.iter().map(|v| Velocity::new(*v));
        match self.kind {
            ShapeKind::ViscousMagnitude => {
                velocities.map(|v| laws::ViscousMagnitude.columns(v, [])[0]).collect()
            }
            ShapeKind::Stribeck => {
                velocities.map(|v| laws::Stribeck.columns(v, [self.value, 2.0])[1]).collect()
            }
            ShapeKind::Tanh => velocities.map(|v| laws::Tanh.columns(v, [self.value])[0]).collect(),
            ShapeKind::Power => velocities.map(|v| laws::Power.columns(v, [self.value])[0]).collect(),
            ShapeKind::Load => speeds.iter().zip(loads).map(|(v, load)| sign(*v) * load.abs()).collect(),
            ShapeKind::MaxwellSlip => {
                let after = |(q, v): (&f64, &f64)| {
                    spring.move_to(*q, *v, self.value);
                    spring.w()
                };
                positions.iter().zip(speeds).map(after).collect()
            }
        }
    }
}

/// Number of Stribeck speeds: steps of at most 1.2.
const STRIBECK: usize = 21;
/// Number of tanh speeds.
const TANH: usize = 10;
/// Exponents: their range, and those that are tried. Next to 1 there is nothing to tell them from viscous friction by.
const POWER: (f64, f64) = (0.2, 2.0);
const EXPONENTS: [f64; 7] = [0.25, 0.35, 0.45, 0.55, 0.7, 1.4, 1.8];
/// Least speed in parts of the rms speed, and in standard deviations of velocity noise.
const LEAST: (f64, f64) = (0.03, 3.0);
/// Largest `v_c` in parts of the rms speed.
const WIDEST_TANH: f64 = 2.5;
/// Travels in parts of the range of positions, their number, and standard deviations of position noise that the least one is above.
const TRAVEL: (f64, f64) = (1e-4, 0.02);
const TRAVELS: usize = 9;
const TRAVEL_SIGMAS: f64 = 3.0;
/// A joint moves in one direction if a smaller share of the samples in which it moves goes in the other.
const ONE_WAY: f64 = 0.01;

/// Candidates of an output, kind after kind, speeds ascending; none where it moves in one direction only. Speeds are parts of the rms speed in
/// the log in which it is greatest.
pub(super) fn of_output(output: usize, kinds: &[ShapeKind], states: &[States]) -> Vec<FrictionShape> {
    let (mut rms, mut noise, mut samples, mut range) = (0.0_f64, 0.0, 0.0, 0.0_f64);
    let mut still = 0.0_f64;
    let mut ways = [0usize; 2];
    for log in states {
        let sigma = log.velocity_sigma[output];
        let (low, high) = log
            .position(output)
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(*q), high.max(*q)));
        range = range.max(high - low);
        still = still.max(sigma / log.cutoff_hz);
        let mut square = 0.0;
        for v in &log.velocity(output) {
            square += v * v;
            ways[0] += usize::from(*v > LEAST.1 * sigma);
            ways[1] += usize::from(*v < -LEAST.1 * sigma);
        }
        // Logs in which it stands say nothing of the speeds at which friction is in question.
        rms = rms.max((square / log.samples as f64).sqrt());
        samples += log.samples as f64;
        noise += sigma * sigma * log.samples as f64;
    }
    let fewest = ways[0].min(ways[1]) as f64;
    if fewest == 0.0 || fewest < ONE_WAY * (ways[0] + ways[1]) as f64 {
        return Vec::new();
    }
    let least = (LEAST.0 * rms).max(LEAST.1 * (noise / samples).sqrt());
    let steps = |kind: ShapeKind, least: f64, most: f64, count: usize| -> Vec<FrictionShape> {
        if least >= most {
            return Vec::new();
        }
        let ratio = (most / least).powf(1.0 / (count - 1) as f64);
        (0..count).map(|k| FrictionShape { kind, value: least * ratio.powi(k as i32) }).collect()
    };
    let speeds = |kind: ShapeKind, most: f64, count: usize| steps(kind, least, most, count);
    let travels = || {
        // White noise below a cut-off: its positions in parts of its velocities.
        let noise = still * 3.0_f64.sqrt() / std::f64::consts::TAU;
        let least = (TRAVEL.0 * range).max(TRAVEL_SIGMAS * noise);
        steps(ShapeKind::MaxwellSlip, least, TRAVEL.1 * range, TRAVELS)
    };
    kinds
        .iter()
        .flat_map(|kind| match kind {
            ShapeKind::ViscousMagnitude | ShapeKind::Load => vec![FrictionShape { kind: *kind, value: 1.0 }],
            ShapeKind::Stribeck => speeds(*kind, rms, STRIBECK),
            ShapeKind::Tanh => speeds(*kind, WIDEST_TANH * rms, TANH),
            ShapeKind::Power => EXPONENTS.iter().map(|p| FrictionShape { kind: *kind, value: *p }).collect(),
            ShapeKind::MaxwellSlip => travels(),
        })
        .collect()
}
