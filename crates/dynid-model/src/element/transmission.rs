//! Joints that share motors: `q̇_motor = A q̇`, so efforts add up as `τ = Aᵀ τ_motor`.

use super::friction::{EFFORT, VISCOUS};
use super::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::Parameter;

/// Motor-side inertia and friction behind a transmission matrix, the strict form: one `J`, `f_c`, `f_v` per motor,
/// `e = Aᵀ (J A q̈ + f_c s(A q̇) + f_v A q̇)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Transmission {
    /// Rates of the joints, one per column of the matrix.
    pub joints: Vec<usize>,
    /// Transmission matrix `A`, one row per motor.
    pub matrix: Vec<Vec<f64>>,
    /// Names of the motors, one per row.
    pub motors: Vec<String>,
}

impl Transmission {
    fn acting(&self, motor: usize) -> Vec<usize> {
        (0..self.joints.len()).filter(|j| self.matrix[motor][*j] != 0.0).collect()
    }
}

impl JointElement for Transmission {
    fn rates(&self) -> Vec<usize> {
        self.joints.clone()
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let mut out = Vec::new();
        for motor in &self.motors {
            let owner = &joints[self.joints[0]];
            for (symbol, unit) in [("J", "kg m²"), ("fc", "N m"), ("fv", "N m s/rad")] {
                let mut p = owner.parameter(symbol, [unit, unit], Some(0.0));
                p.name = format!("{motor}.{symbol}");
                p.symbol = format!("{symbol}_{motor}");
                out.push(p);
            }
        }
        out
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        (0..self.motors.len())
            .flat_map(|m| self.acting(m).into_iter().flat_map(move |j| (0..3).map(move |k| (j, 3 * m + k))))
            .map(|(j, k)| (self.joints[j], k))
            .collect()
    }
    fn reversal_speeds(&self) -> Vec<Vec<(usize, f64)>> {
        (0..self.motors.len())
            .map(|m| self.acting(m).into_iter().map(|j| (self.joints[j], self.matrix[m][j])).collect())
            .filter(|speed: &Vec<(usize, f64)>| speed.len() > 1)
            .collect()
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let mut entry = 0;
        for (m, row) in self.matrix.iter().enumerate() {
            let acting = self.acting(m);
            for sample in 0..motion.samples {
                let sum = |signal: &[f64]| -> f64 {
                    let at = |j: usize| signal[self.joints[j] * motion.stride + sample];
                    acting.iter().map(|j| row[*j] * at(*j)).sum()
                };
                let (v, a) = (sum(motion.dq), sum(motion.ddq));
                for (k, j) in acting.iter().enumerate() {
                    out.column(entry + 3 * k)[sample] = row[*j] * a;
                    out.column(entry + 3 * k + 1)[sample] = row[*j] * motion.sign(v);
                    out.column(entry + 3 * k + 2)[sample] = row[*j] * v;
                }
            }
            entry += 3 * acting.len();
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let mut entry = 0;
        for (m, row) in self.matrix.iter().enumerate() {
            let acting = self.acting(m);
            for sample in 0..motion.samples {
                let v: f64 = acting
                    .iter()
                    .map(|j| row[*j] * motion.dq[self.joints[*j] * motion.stride + sample])
                    .sum();
                let weight = |parameter: usize| -> f64 {
                    let of =
                        |(k, j): (usize, &usize)| row[*j] * weights.column(entry + 3 * k + parameter)[sample];
                    acting.iter().enumerate().map(of).sum()
                };
                let by_acceleration = weight(0);
                let by_velocity = weight(1) * motion.sign_slope(v) + weight(2);
                for j in &acting {
                    let at = self.joints[*j] * motion.samples + sample;
                    out.dq[at] += row[*j] * by_velocity;
                    out.ddq[at] += row[*j] * by_acceleration;
                }
            }
            entry += 3 * acting.len();
        }
    }
}

/// Coupling terms of a wrist whose second motor also turns with the first joint, as used for the Staubli TX40
/// (Gautier, Janot & Vandanjon): three columns `Iam`, `fvm`, `fsm` on the rows of both joints,
/// `[κ q̈_b; κ q̈_a]`, `[κ q̇_b; κ q̇_a]`, `[κ s(κ q̇_a + q̇_b); s(κ q̇_a + q̇_b)]`.
///
/// The direct terms stay with the joints' own rotor and friction elements.
#[derive(Debug, Clone, PartialEq)]
pub struct CoupledWrist {
    /// Rate of joint `a`, which drags the motor of `b` along.
    pub a: usize,
    /// Rate of joint `b`.
    pub b: usize,
    /// `κ = A[b, a] / A[b, b]`; 1 for the TX40.
    pub ratio: f64,
}

impl JointElement for CoupledWrist {
    fn rates(&self) -> Vec<usize> {
        vec![self.a, self.b]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.b];
        vec![
            joint.parameter("Iam", ["kg m²", "kg"], None),
            joint.parameter("fvm", VISCOUS, None),
            joint.parameter("fsm", EFFORT, Some(0.0)),
        ]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        (0..3).flat_map(|k| [(self.a, k), (self.b, k)]).collect()
    }
    fn reversal_speeds(&self) -> Vec<Vec<(usize, f64)>> {
        vec![vec![(self.a, self.ratio), (self.b, 1.0)]]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let k = self.ratio;
        let (va, vb) = (motion.rate(self.a), motion.rate(self.b));
        out.map(0, motion.acceleration(self.b), |x| k * x);
        out.map(1, motion.acceleration(self.a), |x| k * x);
        out.map(2, vb, |x| k * x);
        out.map(3, va, |x| k * x);
        for sample in 0..motion.samples {
            let s = motion.sign(k * va[sample] + vb[sample]);
            out.column(4)[sample] = k * s;
            out.column(5)[sample] = s;
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let k = self.ratio;
        let (va, vb) = (motion.rate(self.a), motion.rate(self.b));
        weights.add(0, self.b, motion.acceleration(self.b), |_| k, &mut out.ddq);
        weights.add(1, self.a, motion.acceleration(self.a), |_| k, &mut out.ddq);
        weights.add(2, self.b, vb, |_| k, &mut out.dq);
        weights.add(3, self.a, va, |_| k, &mut out.dq);
        for sample in 0..motion.samples {
            let slope = motion.sign_slope(k * va[sample] + vb[sample])
                * (k * weights.column(4)[sample] + weights.column(5)[sample]);
            out.dq[self.a * motion.samples + sample] += k * slope;
            out.dq[self.b * motion.samples + sample] += slope;
        }
    }
}
