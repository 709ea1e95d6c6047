//! The three friction laws as formulas.

use super::error::{LoadFrictionError, in_range};

/// Which friction law a problem assumes, for a normal force `F` that moves with the mechanism, a constant one `G` and
/// `E = exp(-(|v|/v_s)^δ)` (Rosyid & El-Khasawneh 2020, equations 23 to 25 and 39).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// `[μ_c + (μ_s - μ_c) E] F sign v + μ_c G sign v + f_v v` with `F = Σ_k |N_k φ|` of the sample.
    #[default]
    Stribeck,
    /// `μ_c (F + G) sign v + f_v v`: `μ_s` and `v_s` have no effect.
    CoulombViscous,
    /// The law of [`Model::Stribeck`] with `F` replaced by its mean over all samples of the record that is fitted; on another
    /// record the mean is carried over.
    Constant,
}

/// Friction parameters beside the `p` inertial ones, in the order in which they follow them in `θ`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrictionParameter {
    /// `μ_c`, Coulomb coefficient.
    Coulomb,
    /// `f_v`, viscous coefficient, effort per speed.
    Viscous,
    /// `μ_s`, static coefficient.
    Static,
    /// `v_s`, Stribeck speed.
    StribeckSpeed,
}

impl FrictionParameter {
    /// All four in order.
    pub const ALL: [FrictionParameter; 4] = [
        FrictionParameter::Coulomb,
        FrictionParameter::Viscous,
        FrictionParameter::Static,
        FrictionParameter::StribeckSpeed,
    ];

    /// Index in `θ` behind `inertial` inertial parameters.
    pub fn index(self, inertial: usize) -> usize {
        inertial + self as usize
    }

    /// Short name.
    pub fn name(self) -> &'static str {
        match self {
            FrictionParameter::Coulomb => "mu_c",
            FrictionParameter::Viscous => "f_v",
            FrictionParameter::Static => "mu_s",
            FrictionParameter::StribeckSpeed => "v_s",
        }
    }

    /// Whether the efforts of a model depend on it.
    pub fn acts_in(self, model: Model) -> bool {
        model != Model::CoulombViscous
            || matches!(self, FrictionParameter::Coulomb | FrictionParameter::Viscous)
    }
}

/// `θ` taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Split<'a> {
    pub(super) inertial: &'a [f64],
    pub(super) coulomb: f64,
    pub(super) viscous: f64,
    pub(super) stick: f64,
    pub(super) stribeck: f64,
}

/// `θ` has at least four entries.
pub(super) fn split(theta: &[f64]) -> Split<'_> {
    let (inertial, f) = theta.split_at(theta.len() - 4);
    Split { inertial, coulomb: f[0], viscous: f[1], stick: f[2], stribeck: f[3] }
}

/// `E` and `∂E/∂v_s` of a speed; zero for a law without it.
pub(super) fn decay(model: Model, exponent: f64, speed: f64, stribeck: f64) -> (f64, f64) {
    if model == Model::CoulombViscous {
        return (0.0, 0.0);
    }
    let ratio = speed.abs() / stribeck;
    let power = if exponent == 1.0 { ratio } else { ratio.powf(exponent) };
    let value = (-power).exp();
    // Far beyond the Stribeck speed `power` may be infinite where the value is zero.
    let slope = if value > 0.0 { value * power * exponent / stribeck } else { 0.0 };
    (value, slope)
}

/// Sign of a speed, 0 at rest.
pub(super) fn direction(speed: f64, rest: f64) -> f64 {
    if speed.abs() < rest || speed == 0.0 { 0.0 } else { speed.signum() }
}

pub(super) fn check_theta(model: Model, inertial: usize, theta: &[f64]) -> Result<(), LoadFrictionError> {
    super::error::same_size("parameters", inertial + 4, theta.len())?;
    for (k, value) in theta.iter().enumerate() {
        in_range(format!("parameter {k}"), "a finite number", *value, value.is_finite())?;
    }
    let stribeck = theta[inertial + 3];
    in_range(
        "Stribeck speed",
        "a positive number",
        stribeck,
        stribeck > 0.0 || model == Model::CoulombViscous,
    )
}
