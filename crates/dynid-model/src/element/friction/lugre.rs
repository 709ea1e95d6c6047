//! LuGre friction: bristles that bend before they slip.

use super::{EFFORT, NUMBER, PER_ANGLE, VISCOUS, remembered};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::laws::falling;
use crate::element::shape::{places, values};
use crate::element::{
    ElementColumns, ElementWeights, JointElement, JointInfo, ShapeSetting, ShapeTerm, sign,
};
use crate::parameter::{Parameter, ShapeParameter};
use dynid_algebra::scalar::{Cross, Dual, Scalar};
use dynid_algebra::scalar::{Curve, map_curve, map_decay};

/// Bristles with deflection `z`, `ż = v - σ0 |v| z / g(v)` with `g = F_c + (F_s - F_c) E`, `E = exp(-|v/v_s|^δ)`, and effort
/// `σ0 z + σ1 ż` (Canudas de Wit, Olsson, Åström & Lischinsky 1995), in a form that is linear in `F_c` and `σ1`: with
/// `w = σ0 z / F_c`, `κ = σ0 / F_c`, `ρ = F_s / F_c`, `γ = 1 + (ρ - 1) E`
///
/// `ẇ = κ (v - |v| w / γ)`, effort `F_c w + σ1 ẇ / κ`.
///
/// Two columns `[w, ẇ/κ]` for `fc`, `sigma1`; shape parameters `kappa`, `rho`, `vs`, `delta`. It takes the place of
/// [`Coulomb`](super::Coulomb) and [`Stribeck`](super::Stribeck); viscous friction stands beside it.
///
/// The columns depend on the motion before: they are signals that [`JointElement::remember`] forms sample after sample, with
/// the velocity held over each step, `w⁺ = s γ + (w - s γ) exp(-κ |v| Δt / γ)`, exact and stable for any step. A record
/// starts at `w = s(v) γ(v)`, the steady state, which is 0 at rest; signs are exact there, whatever a block smooths. Where a motion block comes without these signals, the
/// steady state `[s γ, 0]` stands in for them: away from reversals, after a travel of some `5 γ / κ`, there is no difference.
///
/// `κ` and `σ1` are seen in pre-sliding motion alone, measured at the motor; elsewhere hold them.
/// See [`LuGre::least_passive_viscosity`] for passivity.
#[derive(Debug, Clone, PartialEq)]
pub struct LuGre {
    /// Rate it acts on.
    pub rate: usize,
    /// Stiffness of the bristles per Coulomb friction, `κ = σ0 / F_c`, 1/rad or 1/m, positive. Default: held at 1000 (bounds
    /// 100 .. 1e5).
    pub kappa: ShapeSetting,
    /// `ρ = F_s / F_c`, positive. Default: 1 .. 3, from 1.3.
    pub rho: ShapeSetting,
    /// Stribeck speed, positive. Default: between 0.001 and 0.3 of the scale of speed, from their geometric mean.
    pub vs: ShapeSetting,
    /// Exponent `δ`, positive. Default: held at 2 (bounds 0.5 .. 2).
    pub delta: ShapeSetting,
}

/// Shape parameters.
const SHAPES: usize = 4;
/// Endings of the signals' names: `w`, `ẇ/κ`, then both by `κ`, `ρ`, `v_s`, `δ`.
const SIGNALS: [&str; 2 * (1 + SHAPES)] = [
    LuGre::BRISTLE,
    "bristle_rate",
    "bristle_by_kappa",
    "bristle_rate_by_kappa",
    "bristle_by_rho",
    "bristle_rate_by_rho",
    "bristle_by_vs",
    "bristle_rate_by_vs",
    "bristle_by_delta",
    "bristle_rate_by_delta",
];

impl LuGre {
    /// Name of the signal `w`, after that of the joint and a dot.
    pub const BRISTLE: &str = "bristle";

    /// Its shape parameters `kappa`, `rho`, `vs`, `delta`.
    pub const TERMS: [ShapeTerm; SHAPES] = [
        ShapeTerm::positive("kappa", PER_ANGLE, 1e2, 1e5).held_at(1e3),
        ShapeTerm::positive("rho", NUMBER, 1.0, 3.0).from(1.3),
        ShapeTerm::speed("vs", 1e-3, 0.3),
        ShapeTerm::positive("delta", NUMBER, 0.5, 2.0).held_at(2.0),
    ];

    /// For speeds up to about 1 rad/s or m/s.
    pub fn new(rate: usize) -> Self {
        Self::scaled(rate, 1.0)
    }

    /// For speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn scaled(rate: usize, v_max: f64) -> Self {
        let [kappa, rho, vs, delta] = Self::TERMS.map(|term| term.setting(v_max));
        LuGre { rate, kappa, rho, vs, delta }
    }

    /// Least viscous coefficient (effort over speed, N m s/rad or N s/m) with which bristles with a constant `σ1` give no
    /// energy back, `σ1 (F_s - F_c) / F_c` (Barahanov & Ortega 2000). Below it predictions are unharmed, since the bursts
    /// are far shorter than any filter lets pass, but a forward simulation may chatter.
    pub fn least_passive_viscosity(sigma1: f64, coulomb: f64, fixed: f64) -> f64 {
        sigma1 * (fixed - coulomb) / coulomb
    }

    fn settings(&self) -> [&ShapeSetting; SHAPES] {
        [&self.kappa, &self.rho, &self.vs, &self.delta]
    }

    /// Which shape parameters are free, by position among all.
    fn free(&self) -> [bool; SHAPES] {
        self.settings().map(|s| !s.held)
    }

    fn signal(joint: &JointInfo, index: usize) -> String {
        format!("{}.{}", joint.name, SIGNALS[index])
    }

    /// A signal of the motion block; `None` where the steady state stands in.
    fn remembered<'a>(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'a>,
        index: usize,
    ) -> Option<&'a [f64]> {
        remembered(&joints[self.rate], motion, SIGNALS[index])
    }
}

/// `γ` at a speed.
#[inline(always)]
fn gamma<S: Scalar>(v: S, [_, rho, vs, delta]: [S; SHAPES]) -> S {
    S::one() + (rho - S::one()) * falling(v, vs, delta)
}

/// `γ` over a block.
fn fill_gamma(speeds: &[f64], shape: [f64; SHAPES], out: &mut [f64]) {
    struct Gamma([f64; SHAPES]);
    impl Curve for Gamma {
        #[inline(always)]
        fn at(&self, v: f64) -> f64 {
            gamma(v, self.0)
        }
    }
    out.copy_from_slice(speeds);
    map_curve(&Gamma(shape), out);
}

/// Derivatives of `γ` by the shape parameters.
fn gamma_by_shape(v: f64, shape: [f64; SHAPES]) -> [f64; SHAPES] {
    let shape: [Dual<SHAPES>; SHAPES] = std::array::from_fn(|k| Dual::variable(shape[k], k));
    gamma(Dual::from_f64(v), shape).derivative
}

/// `∂γ/∂v`.
fn gamma_slope(v: f64, shape: [f64; SHAPES]) -> f64 {
    gamma(Dual::<1>::variable(v, 0), shape.map(Dual::from_f64)).derivative[0]
}

/// `∂²γ/∂v∂p` for a shape parameter.
fn gamma_bend(v: f64, shape: [f64; SHAPES], parameter: usize) -> f64 {
    let along = |k: usize| if k == parameter { 1.0 } else { 0.0 };
    let shape = std::array::from_fn(|k| Cross { value: shape[k], a: 0.0, b: along(k), ab: 0.0 });
    gamma(Cross { value: v, a: 1.0, b: 0.0, ab: 0.0 }, shape).ab
}

impl JointElement for LuGre {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rate];
        vec![joint.parameter("fc", EFFORT, Some(0.0)), joint.parameter("sigma1", VISCOUS, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let joint = &joints[self.rate];
        let terms = Self::TERMS.iter().zip(self.settings()).filter(|(_, setting)| !setting.held);
        terms.map(|(term, setting)| term.parameter(setting, joint)).collect()
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0), (self.rate, 1)]
    }
    fn signals(&self, joints: &[JointInfo]) -> Vec<String> {
        let derivatives = self.free().into_iter().enumerate().filter(|(_, free)| *free).map(|(p, _)| p + 1);
        let pairs = std::iter::once(0).chain(derivatives);
        pairs.flat_map(|k| [2 * k, 2 * k + 1]).map(|k| Self::signal(&joints[self.rate], k)).collect()
    }
    fn remember(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        step_s: f64,
        shape: &[f64],
        state: &mut Vec<f64>,
        out: &mut [&mut [f64]],
    ) {
        let shape = values(self.settings(), shape);
        let [kappa, ..] = shape;
        let speeds = motion.rate(self.rate);
        let free: Vec<usize> = (0..SHAPES).filter(|p| self.free()[*p]).collect();
        let Some(first) = speeds.first() else { return };
        if state.is_empty() {
            let by_shape = gamma_by_shape(*first, shape);
            let s = sign(*first);
            state.push(s * gamma(*first, shape));
            state.extend(free.iter().map(|p| s * by_shape[*p]));
        }
        let n = speeds.len();
        let mut gamma = vec![0.0; n];
        fill_gamma(speeds, shape, &mut gamma);
        // What is left of the distance from the steady state after a step.
        let mut left: Vec<f64> =
            speeds.iter().zip(&gamma).map(|(v, g)| kappa * step_s * v.abs() / g).collect();
        map_decay(&mut left);
        let (plain, derivatives) = out.split_at_mut(2);
        let [bent, rate] = plain else { unreachable!("two signals come first") };
        if free.is_empty() {
            let mut w = state[0];
            for k in 0..n {
                let (v, g) = (speeds[k], gamma[k]);
                bent[k] = w;
                rate[k] = v - v.abs() * w / g;
                let steady = sign(v) * g;
                w = if v == 0.0 { w } else { steady + (w - steady) * left[k] };
            }
            state[0] = w;
            return;
        }
        for k in 0..n {
            let (v, g, e) = (speeds[k], gamma[k], left[k]);
            let (w, s) = (state[0], sign(v));
            let by_shape = gamma_by_shape(v, shape);
            bent[k] = w;
            rate[k] = v - v.abs() * w / g;
            let steady = s * g;
            let travel = kappa * step_s * v.abs() / g;
            for (i, p) in free.iter().enumerate() {
                let (dw, dg) = (state[1 + i], by_shape[*p]);
                derivatives[2 * i][k] = dw;
                derivatives[2 * i + 1][k] = -v.abs() * (dw * g - w * dg) / (g * g);
                if v != 0.0 {
                    let de = if *p == 0 { -e * travel / kappa } else { e * travel / g * dg };
                    state[1 + i] = s * dg + (dw - s * dg) * e + (w - steady) * de;
                }
            }
            state[0] = if v == 0.0 { w } else { steady + (w - steady) * e };
        }
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if let (Some(bent), Some(rate)) =
            (self.remembered(joints, motion, 0), self.remembered(joints, motion, 1))
        {
            out.column(0).copy_from_slice(bent);
            out.column(1).copy_from_slice(rate);
            return;
        }
        let speeds = motion.rate(self.rate);
        let [bent, rate] = out.columns(0);
        fill_gamma(speeds, values(self.settings(), shape), bent);
        motion.fill_signs(speeds, rate);
        for (w, s) in bent.iter_mut().zip(rate) {
            *w *= *s;
            *s = 0.0;
        }
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places(self.settings()).into_iter().flatten().flat_map(|p| [(0, p), (1, p)]).collect()
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let shape = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        for (p, place) in places(self.settings()).into_iter().enumerate() {
            let Some(place) = place else { continue };
            let signals = [2 * p + 2, 2 * p + 3].map(|index| self.remembered(joints, motion, index));
            let [bent, rate] = out.columns(2 * place);
            if let [Some(by_shape), Some(rate_by_shape)] = signals {
                bent.copy_from_slice(by_shape);
                rate.copy_from_slice(rate_by_shape);
                continue;
            }
            rate.fill(0.0);
            for (to, v) in bent.iter_mut().zip(speeds) {
                *to = motion.sign(*v) * gamma_by_shape(*v, shape)[p];
            }
        }
    }
    fn shape_adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let shape = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        for (p, place) in places(self.settings()).into_iter().enumerate() {
            let Some(place) = place else { continue };
            let bend = |v: f64| {
                motion.sign_slope(v) * gamma_by_shape(v, shape)[p] + motion.sign(v) * gamma_bend(v, shape, p)
            };
            weights.add(2 * place, self.rate, speeds, bend, &mut out.dq);
        }
    }
    /// Derivatives of the steady state: signals of the motion before are held.
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        if self.remembered(joints, motion, 0).is_some() {
            return;
        }
        let shape = values(self.settings(), shape);
        let steady = |v: f64| motion.sign_slope(v) * gamma(v, shape) + motion.sign(v) * gamma_slope(v, shape);
        weights.add(0, self.rate, motion.rate(self.rate), steady, &mut out.dq);
    }
}
