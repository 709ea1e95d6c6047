//! The three stiffnesses of a harmonic drive's catalogue.

use super::CubicSpring;

/// Spring as makers of harmonic drives state it: stiffness `K1` up to the torque `T1`, `K2` up to `T2`, `K3` beyond, odd and
/// continuous (rad, N m; or m, N).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiecewiseSpring {
    /// `T1 < T2`, above 0.
    pub torques: [f64; 2],
    /// `K1`, `K2`, `K3`, above 0.
    pub stiffness: [f64; 3],
}

/// A piecewise spring made from a cubic one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiecewiseFit {
    /// The spring.
    pub spring: PiecewiseSpring,
    /// Deformations of the spring at `T1`, `T2`, rad or m.
    pub knots: [f64; 2],
    /// Largest difference of deformation at the same torque up to `T3`, rad or m.
    pub worst: f64,
}

/// A cubic spring made from a piecewise one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubicFit {
    /// The spring.
    pub spring: CubicSpring,
    /// Largest difference of torque at the same deformation up to that under `T3`, N m or N.
    pub worst: f64,
}

/// Nodes and weights of Gauss and Legendre on -1 .. 1, exact to degree 9.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Nodes and weights between consecutive ends.
fn nodes(ends: &[f64]) -> impl Iterator<Item = (f64, f64)> {
    ends.windows(2).flat_map(|w| {
        let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
        GAUSS.iter().map(move |(x, weight)| (middle + half * x, half * weight))
    })
}

impl PiecewiseSpring {
    /// The parts of a torque that the three stiffnesses carry.
    fn parts(&self, torque: f64) -> [f64; 3] {
        parts(self.torques, torque)
    }

    /// Deformation under a torque.
    pub fn deformation(&self, torque: f64) -> f64 {
        let parts = self.parts(torque.abs());
        let sum: f64 = parts.iter().zip(&self.stiffness).map(|(t, k)| t / k).sum();
        sum.copysign(torque)
    }

    /// Deformations at `T1` and `T2`.
    pub fn knots(&self) -> [f64; 2] {
        self.torques.map(|t| self.deformation(t))
    }

    /// Torque at a deformation.
    pub fn torque(&self, deformation: f64) -> f64 {
        let (x, [a, b], [k1, k2, k3]) = (deformation.abs(), self.knots(), self.stiffness);
        let torque = k1 * x.min(a) + k2 * (x.min(b) - a).max(0.0) + k3 * (x - b).max(0.0);
        torque.copysign(deformation)
    }

    fn is_sound(&self) -> bool {
        let [t1, t2] = self.torques;
        0.0 < t1 && t1 < t2 && t2.is_finite() && self.stiffness.iter().all(|k| *k > 0.0 && k.is_finite())
    }

    /// The cubic spring nearest in torque over `±` the deformation under `T3`:
    /// `min ∫ (k1 Δ + k2 Δ³ - T(Δ))² dΔ`, integrals exact.
    ///
    /// `None` unless `0 < T1 < T2 < T3` and all stiffnesses are positive. `k2` may come out negative for a table that
    /// softens.
    pub fn cubic(&self, t3: f64) -> Option<CubicFit> {
        if !(self.is_sound() && t3 > self.torques[1] && t3.is_finite()) {
            return None;
        }
        let [a, b] = self.knots();
        let end = self.deformation(t3);
        // In units of the largest deformation: ∫x², ∫x⁴, ∫x⁶ are 1/3, 1/5, 1/7.
        let (mut first, mut third) = (0.0, 0.0);
        for (x, weight) in nodes(&[0.0, a / end, b / end, 1.0]) {
            let torque = self.torque(x * end);
            first += weight * x * torque;
            third += weight * x.powi(3) * torque;
        }
        let determinant = 1.0 / 21.0 - 1.0 / 25.0;
        let linear = (first / 7.0 - third / 5.0) / determinant;
        let cubic = (third / 3.0 - first / 5.0) / determinant;
        let spring = CubicSpring { k1: linear / end, k2: cubic / end.powi(3) };
        let differs = |x: f64| (spring.torque(x) - self.torque(x)).abs();
        let worst = worst(&[0.0, a, b, end], |k, (from, to)| {
            let x = ((self.stiffness[k] - spring.k1) / (3.0 * spring.k2)).sqrt();
            [from, to, if from < x && x < to { x } else { to }].map(differs)
        });
        Some(CubicFit { spring, worst })
    }
}

impl CubicSpring {
    /// The maker's three stiffnesses for given `T1`, `T2`, nearest in deformation over `±T3`:
    /// `min ∫ (Δ_K(T) - Δ(T))² dT` over the compliances `1/K1`, `1/K2`, `1/K3`, in which the deformation is linear; integrals
    /// exact.
    ///
    /// `None` unless `0 < T1 < T2 < T3`, the spring carries `T3` on its branch through rest, and the three stiffnesses come
    /// out positive.
    pub fn piecewise(&self, torques: [f64; 2], t3: f64) -> Option<PiecewiseFit> {
        let [t1, t2] = torques;
        if !(0.0 < t1 && t1 < t2 && t2 < t3) {
            return None;
        }
        let (a, b, end) = (self.deformation(t1)?, self.deformation(t2)?, self.deformation(t3)?);
        // Over the deformation, with dT = stiffness dΔ; torques in units of T3.
        let mut gram = [[0.0; 3]; 3];
        let mut right = [0.0; 3];
        for (x, weight) in nodes(&[0.0, a, b, end]) {
            let parts = parts(torques, self.torque(x)).map(|t| t / t3);
            let weight = weight * self.stiffness(x);
            for i in 0..3 {
                right[i] += weight * parts[i] * x;
                for j in 0..3 {
                    gram[i][j] += weight * parts[i] * parts[j];
                }
            }
        }
        let stiffness = solve(gram, right).map(|compliance| t3 / compliance);
        let spring = PiecewiseSpring { torques, stiffness };
        if !spring.is_sound() {
            return None;
        }
        let differs = |x: f64| (spring.deformation(self.torque(x)) - x).abs();
        let worst = worst(&[0.0, a, b, end], |k, (from, to)| {
            let x = ((stiffness[k] - self.k1) / (3.0 * self.k2)).sqrt();
            [from, to, if from < x && x < to { x } else { to }].map(differs)
        });
        Some(PiecewiseFit { spring, knots: spring.knots(), worst })
    }
}

fn parts([t1, t2]: [f64; 2], torque: f64) -> [f64; 3] {
    [torque.min(t1), (torque.min(t2) - t1).max(0.0), (torque - t2).max(0.0)]
}

/// Largest of what is found on the pieces between consecutive ends: at both ends, and where slopes are equal.
fn worst(ends: &[f64; 4], of: impl Fn(usize, (f64, f64)) -> [f64; 3]) -> f64 {
    (0..3).flat_map(|k| of(k, (ends[k], ends[k + 1]))).fold(0.0, f64::max)
}

/// Solution of three equations with a positive definite matrix.
fn solve(mut a: [[f64; 3]; 3], mut x: [f64; 3]) -> [f64; 3] {
    for j in 0..3 {
        for i in j + 1..3 {
            let (pivot, factor) = (a[j], a[i][j] / a[j][j]);
            a[i].iter_mut().zip(pivot).for_each(|(a, p)| *a -= factor * p);
            x[i] -= factor * x[j];
        }
    }
    for j in (0..3).rev() {
        for k in j + 1..3 {
            x[j] -= a[j][k] * x[k];
        }
        x[j] /= a[j][j];
    }
    x
}
