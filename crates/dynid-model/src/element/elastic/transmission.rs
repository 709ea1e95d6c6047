//! The element between a motor's coordinate and its link.

use std::fmt;

use super::CubicSpring;
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::friction::VISCOUS;
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::parameter::Parameter;

const STIFFNESS: [&str; 2] = ["N m/rad", "N/m"];
const CUBIC_STIFFNESS: [&str; 2] = ["N m/rad³", "N/m³"];

/// Elastic transmission between a motor and its link, each with a coordinate of its own: torque
/// `T_k = k1 Δ + k2 Δ³ + d Δ̇` over the deformation `Δ = θ/N - q`, on the link's side.
///
/// ```text
/// motor row:  drive effort = J θ̈ + e_in(θ̇) + T_k/N
/// link row:              0 = rigid_j + e_out(q̇) + cyclic(q) - T_k
/// ```
///
/// Columns `[Δ/N, -Δ]` of `<link>.k1`, `[Δ³/N, -Δ³]` of `<link>.k2`, `[Δ̇/N, -Δ̇]` of `<link>.d` on the rows (motor, link).
/// Units are those of the link: N m/rad, N m/rad³, N m s/rad, or N/m, N/m³, N s/m. Bounds: `k1 >= 0`, `d >= 0`; `k2` may be
/// negative for a spring that softens, see [`CubicSpring::is_passive`]. What else acts on the motor's side are the ordinary
/// elements on the motor's rate. With a torque sensor behind the transmission the link is a
/// [`Coordinate`](crate::Coordinate) without bodies too, whose effort is the negative reading,
/// `-T_out = e_out + cyclic - T_k`.
///
/// The rotor turns about an axis fixed in the body that carries it: its gyroscopic torques and its inertia as felt by other
/// joints are neglected (Spong 1987, *Modeling and control of elastic joint robots*), as good as the ratio is large.
///
/// Degenerate: with `|Δ|` constant (one load, whatever its sign) `k1` and `k2` are collinear, see
/// [`ElasticTransmission::doubt`]. Without a measured position of the motor `Δ` is not seen, and only the sum of both rows
/// (`N` times the motor's, plus the link's) can be identified: a stiff joint. With a stiff spring `Δ̇` is small, and `d`
/// hard to tell from viscous friction on either side. Noise of `Δ` biases `k1` and `k2`: filter before cubing.
///
/// Source: Sun, Shi, Zhang, Wang & Liu, *Parameters Identification Applied to Large Space Robotic Manipulators*, Eqs. 22 to
/// 24, with `Δ` of the sign that makes the spring stable.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticTransmission {
    /// Rate of the link, with one position.
    pub link: usize,
    /// Rate of the motor, with one position; another than the link's.
    pub motor: usize,
    /// Ratio `N`: motor travel over link travel with a stiff spring; not 0, negative where they turn against each other.
    pub ratio: f64,
    /// Whether there is a `k2`.
    pub cubic: bool,
    /// Whether there is a `d`.
    pub damping: bool,
}

/// Why a motion says little about the parameters of a spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElasticDoubt {
    /// The spring is never deformed: perhaps the motor's position was formed from that of the link.
    NoDeformation,
    /// `|Δ|` hardly changes: `k1` and `k2` stand in for each other. The share of the length of `Δ³` that `Δ` does not
    /// explain.
    ConstantDeformation(f64),
}

impl fmt::Display for ElasticDoubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ElasticDoubt::NoDeformation => f.write_str(
                "the spring is never deformed: is the motor's position measured, or formed from the link's?",
            ),
            ElasticDoubt::ConstantDeformation(share) => write!(
                f,
                "the spring's deformation hardly changes in size ({:.2} % of its cube is not proportional to it): k1 and k2 \
                 stand in for each other, vary the load",
                100.0 * share
            ),
        }
    }
}

impl ElasticTransmission {
    /// Share of `Δ³` not explained by `Δ` below which [`ElasticTransmission::doubt`] speaks; a load that swings evenly
    /// between nothing and its largest value leaves 0.4.
    pub const LEAST_SHARE: f64 = 0.02;

    /// With a cubic part and without damping.
    pub fn new(link: usize, motor: usize, ratio: f64) -> Self {
        ElasticTransmission { link, motor, ratio, cubic: true, damping: false }
    }

    /// Deformations `Δ = θ/N - q` of a motion.
    pub fn deformation(&self, joints: &[JointInfo], motion: &MotionBlock<'_>) -> Vec<f64> {
        let theta = motion.position(joints[self.motor].position);
        let q = motion.position(joints[self.link].position);
        theta.iter().zip(q).map(|(theta, q)| theta / self.ratio - q).collect()
    }

    /// The spring with given parameters, in the order of the element's own; the rest count as 0.
    pub fn spring(&self, linear: &[f64]) -> CubicSpring {
        let at = |k: usize| linear.get(k).copied().unwrap_or(0.0);
        CubicSpring { k1: at(0), k2: if self.cubic { at(1) } else { 0.0 } }
    }

    /// What makes a motion a poor one for the parameters of the spring, if anything.
    pub fn doubt(&self, joints: &[JointInfo], motion: &MotionBlock<'_>) -> Option<ElasticDoubt> {
        let deformation = self.deformation(joints, motion);
        let largest = deformation.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let travel = motion.position(joints[self.link].position).iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        // What the difference of two equal positions leaves by rounding.
        if largest <= 8.0 * f64::EPSILON * travel {
            return Some(ElasticDoubt::NoDeformation);
        }
        if !self.cubic {
            return None;
        }
        let sums = deformation.iter().fold([0.0; 3], |[a, b, c], x| {
            let square = (x / largest).powi(2);
            [a + square, b + square * square, c + square.powi(3)]
        });
        let share = (1.0 - sums[1] * sums[1] / (sums[0] * sums[2])).max(0.0).sqrt();
        (share < Self::LEAST_SHARE).then_some(ElasticDoubt::ConstantDeformation(share))
    }

    /// Fills the motor's and the link's column of a torque.
    fn put(&self, entry: usize, torque: impl Iterator<Item = f64>, out: &mut ElementColumns<'_>) {
        let [motor, link] = out.columns(entry);
        for ((m, l), t) in motor.iter_mut().zip(link).zip(torque) {
            *m = t / self.ratio;
            *l = -t;
        }
    }

    /// Entry of the motor's row of the damping; the link's is the next.
    fn damping_entry(&self) -> usize {
        if self.cubic { 4 } else { 2 }
    }
}

impl JointElement for ElasticTransmission {
    fn rates(&self) -> Vec<usize> {
        vec![self.motor, self.link]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let link = &joints[self.link];
        let mut out = vec![link.parameter("k1", STIFFNESS, Some(0.0))];
        if self.cubic {
            out.push(link.parameter("k2", CUBIC_STIFFNESS, None));
        }
        if self.damping {
            out.push(link.parameter("d", VISCOUS, Some(0.0)));
        }
        out
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        let parameters = 1 + usize::from(self.cubic) + usize::from(self.damping);
        (0..parameters).flat_map(|k| [(self.motor, k), (self.link, k)]).collect()
    }
    fn elastic(&self) -> Option<&ElasticTransmission> {
        Some(self)
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let deformation = self.deformation(joints, motion);
        self.put(0, deformation.iter().copied(), out);
        if self.cubic {
            self.put(2, deformation.iter().map(|x| x * x * x), out);
        }
        if self.damping {
            let speeds = motion.rate(self.motor).iter().zip(motion.rate(self.link));
            self.put(self.damping_entry(), speeds.map(|(theta, q)| theta / self.ratio - q), out);
        }
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let (theta, q) = (joints[self.motor].position, joints[self.link].position);
        let n = motion.samples;
        let torque =
            |entry: usize, s: usize| weights.column(entry)[s] / self.ratio - weights.column(entry + 1)[s];
        for (s, x) in self.deformation(joints, motion).into_iter().enumerate() {
            let cubic = if self.cubic { 3.0 * x * x * torque(2, s) } else { 0.0 };
            let slope = torque(0, s) + cubic;
            out.q[theta * n + s] += slope / self.ratio;
            out.q[q * n + s] -= slope;
            if self.damping {
                let slope = torque(self.damping_entry(), s);
                out.dq[self.motor * n + s] += slope / self.ratio;
                out.dq[self.link * n + s] -= slope;
            }
        }
    }
}
