//! Ridge regression towards a prior.

use super::ols::{LinearSolution, ols};
use dynid_factor::factor::Factor;
use dynid_linalg::Mat;

/// Solution of [`ridge`].
#[derive(Debug, Clone, PartialEq)]
pub struct RidgeSolution {
    /// `p` parameters.
    pub x: Vec<f64>,
    /// Residual sum of squares of the samples alone, effort² (weighted if the factor was).
    pub rss: f64,
    /// Penalty `κ Σ ((x_i - x0_i)/scale_i)²`.
    pub penalty: f64,
    /// Solution of the factor with the prior rows merged in, for the deviation `x - x0`. Its dropped columns, if
    /// any, are those whose prior is too weak to be felt beside rounding: they stay at `x0`.
    pub deviation: LinearSolution,
}

impl RidgeSolution {
    /// `(RᵀR + κD²)⁻¹`: the posterior covariance when the factor is weighted by `1/σ`, `κ = 1`, and the prior is
    /// Gaussian with standard deviations `scale`.
    pub fn unit_covariance(&self) -> Mat {
        self.deviation.unit_covariance()
    }
}

/// Ridge estimate `min ‖z - R x‖² + κ ‖D (x - x0)‖²`, `D = diag(1/scale)`, by QR of `[R z; √κD √κD x0]`.
///
/// `scale`: prior standard deviation of each parameter, in its unit; `kappa ≥ 0` its weight, 1 for a Gaussian
/// prior on a factor weighted by `1/σ`. Panics unless `x0` and `scale` have `p` entries, all scales and `κ` are
/// positive and finite.
pub fn ridge(factor: &Factor, x0: &[f64], scale: &[f64], kappa: f64) -> RidgeSolution {
    assert!(kappa > 0.0 && kappa.is_finite(), "the weight of the prior is positive");
    assert!(scale.iter().all(|s| *s > 0.0 && s.is_finite()), "prior scales are positive");
    let weights: Vec<f64> = scale.iter().map(|s| kappa.sqrt() / s).collect();
    let deviation = ols(&factor.with_prior_rows(&weights, x0).centred(x0));
    let x: Vec<f64> = deviation.x.iter().zip(x0).map(|(d, x0)| x0 + d).collect();
    let penalty = deviation.x.iter().zip(&weights).map(|(d, w)| (w * d).powi(2)).sum();
    RidgeSolution { rss: factor.rss(&x), penalty, x, deviation }
}
