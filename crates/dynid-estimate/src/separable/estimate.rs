//! Result of a separable fit.

use super::levenberg::SearchStatus;
use super::profile::ShapeFinding;
use super::starts::StartReport;
use crate::covariance::{MIN_BLOCKS, variance_inflation};
use crate::linear::{LinearEstimate, LinearMethod};
use dynid_linalg::Mat;

/// Estimate of linear and shape parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparableEstimate {
    /// Linear parameters `c`; those listed in [`Self::dependent`] are zero.
    pub linear: Vec<f64>,
    /// Shape parameters `α`.
    pub shape: Vec<f64>,
    /// Residual sum of squares, weighted by `1/σ_j²` (and by the rows' weights for robust losses).
    pub rss: f64,
    /// `σ_j²` per group, effort² (the square of the scale for robust losses); all 1 with equal weights and squares.
    pub variances: Vec<f64>,
    /// Residuals `y - Φ(α) c` per group, unweighted.
    pub residuals: Vec<Vec<f64>>,
    /// Root weights `√ω` of the rows, per group, for robust losses.
    pub row_weights: Option<Vec<Vec<f64>>>,
    /// Linear parameters that others make up or no row sees, ascending.
    pub dependent: Vec<usize>,
    /// How the search from the best start ended.
    pub status: SearchStatus,
    /// Passes of re-weighting for robust losses, else 0.
    pub passes: usize,
    /// Whether they settled; true for squares.
    pub settled: bool,
    /// What the starts reached. The rss there is that of the first weights, without robust loss.
    pub starts: StartReport,
    /// One entry per shape parameter.
    pub findings: Vec<ShapeFinding>,
    /// Shape parameters that have a column in [`Self::linearised`], ascending: not held, not unseen, not at a bound.
    pub active: Vec<usize>,
    /// Variance inflation `κ` of the jackknife against independent residuals; 1 with fewer than [`MIN_BLOCKS`] blocks.
    pub inflation: f64,
    /// Least squares on `[Φ, D_1 c, D_2 c, ..]`: its columns are the linear parameters, then those of [`Self::active`].
    /// Covariance of any kind, blocks and scores are taken from it. `None` for [`super::SeparableLoss::Absolute`].
    pub linearised: Option<LinearEstimate>,
}

/// Standard deviations; `None` for parameters that are dependent, held or at a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations {
    /// Of the linear parameters.
    pub linear: Vec<Option<f64>>,
    /// Of the shape parameters.
    pub shape: Vec<Option<f64>>,
}

impl SeparableEstimate {
    /// Standard deviations of linear and shape parameters if all residuals were independent, from
    /// `σ̂² (J_fᵀ J_f)⁻¹`.
    pub fn standard_deviations(&self) -> Option<Deviations> {
        let fit = self.linearised.as_ref()?;
        let covariance = fit.model_covariance();
        Some(self.spread(fit, &covariance, self.residual_variance(fit)))
    }

    /// Standard deviations from the delete-a-block jackknife, which survives filtered residuals; `None` below two time blocks.
    pub fn jackknife_deviations(&self) -> Option<Deviations> {
        let fit = self.linearised.as_ref()?;
        let covariance = fit.jackknife()?.covariance;
        Some(self.spread(fit, &covariance, 1.0))
    }

    /// What `(J_fᵀ J_f)⁻¹` of the weighted rows is to be multiplied by: 1, unless the one variance of equal weights lies
    /// below the floor of the weights and is known from the rss only.
    fn residual_variance(&self, fit: &LinearEstimate) -> f64 {
        let below_floor = fit.method == LinearMethod::Ols && fit.groups.iter().any(|g| g.at_floor);
        let variance = if below_floor { fit.solution.residual_variance() } else { None };
        variance.unwrap_or(1.0)
    }

    fn spread(&self, fit: &LinearEstimate, covariance: &Mat, factor: f64) -> Deviations {
        let mut all = vec![None; fit.x.len()];
        for (i, &column) in fit.solution.kept.iter().enumerate() {
            all[column] = Some((factor * covariance[(i, i)]).sqrt());
        }
        let mut shape = vec![None; self.shape.len()];
        for (i, &k) in self.active.iter().enumerate() {
            shape[k] = all[self.linear.len() + i];
        }
        all.truncate(self.linear.len());
        Deviations { linear: all, shape }
    }
}

/// Inflation of the jackknife against independent residuals.
pub(super) fn kappa(fit: &LinearEstimate) -> f64 {
    if fit.blocks.len() < MIN_BLOCKS {
        return 1.0;
    }
    let robust = fit.jackknife();
    robust.and_then(|j| variance_inflation(&j.covariance, &fit.model_covariance())).unwrap_or(1.0)
}
