//! What a log tells about each parameter, against what was known before and what any motion could tell.
//!
//! With prior standard deviations `C0 = diag(σ0²)` and the information `J = RᵀR/κ` of a log, the posterior covariance is
//! `C = (J + C0⁻¹)⁻¹`. For every parameter `j`
//!
//! - achieved share `s_j = 1 - C_jj/C0_jj`: how much of its prior variance the log removes;
//! - limit of this log `l_j = 1 - u_j`, `u_j` the share of its prior variance in the null space of `R C0^½`: what ever
//!   longer logs of the same motion would remove;
//! - structural limit `p_j`: the same for the row space of the regrouping `K`, what any motion could remove;
//!
//! and `s_j ≤ l_j ≤ p_j`. [`Assessment::verdict`] sums them up.
//!
//! A log enters in base columns, `R = R_β K`. All work is orthogonal: a QR of `C0^½ Kᵀ = Q T` gives the visible space,
//! and the singular values of `R_β Tᵀ` what was seen of it. Directions at rounding level count as not seen however large
//! they are next to the prior, so that no verdict rests on rounding.

mod combination;
mod posterior;
mod space;
mod verdict;

pub use combination::{Combination, visible_combinations, with_half_width};
pub use posterior::{Posterior, excited_regrouping, posterior};
pub use space::VisibleSpace;
pub use verdict::{Carried, Verdict, verdict};

use dynid_linalg::Mat;

use dynid_factor::factor::Factor;

/// Half widths beyond this share of the value (or of the prior standard deviation, if larger) are wide.
const WIDE: f64 = 0.3;

/// What is known about one parameter (standard or base) before and after a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Achieved share `s_j`, 0 to 1.
    pub achieved: f64,
    /// Limit of this log `l_j`, `achieved` to 1.
    pub log_limit: f64,
    /// Structural limit `p_j`, `log_limit` to 1; 1 for base parameters.
    pub structural_limit: f64,
    /// Share of the prior variance that no motion removes, `1 - p_j`, without the cancellation: zero to rounding (below
    /// 1e-20) says that the effort determines the parameter by itself. Between that and 0.1 a verdict "seen" leans on the
    /// priors of the parameters that it enters the effort with.
    pub hidden: f64,
    /// Prior standard deviation, in the parameter's unit.
    pub prior_std: f64,
    /// Posterior standard deviation `√C_jj`, in the parameter's unit; model-based (with the inflation `κ`).
    pub posterior_std: f64,
    /// The verdict.
    pub verdict: Verdict,
}

impl Assessment {
    /// Whether an interval `value ± half_width` of a parameter that is seen deserves the remark "wide": beyond 30 % of
    /// the larger of `|value|` and the prior standard deviation.
    pub fn is_wide(&self, value: f64, half_width: f64) -> bool {
        half_width > WIDE * value.abs().max(self.prior_std)
    }
}

/// What a log tells about all parameters of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Standard parameters, in the order of the columns of the regrouping.
    pub parameters: Vec<Assessment>,
    /// Base parameters, prior covariance `K C0 Kᵀ`.
    pub base: Vec<Assessment>,
    /// Number of independent directions that the log excites.
    pub excited: usize,
}

/// Assesses all parameters of a model on one (merged) log.
///
/// - `information`: factor of the regressor in the `r` base columns, rows weighted by `1/σ`. Rank may be anything.
/// - `inflation`: variance inflation `κ ≥ 1` ([`crate::covariance::variance_inflation`]); 1 if the weights hold it already.
/// - `regrouping`: `K`, `r × p`.
/// - `prior_std`: `p` standard deviations in the parameters' units. A vanishing one would make its parameter known
///   beforehand and "seen" without data, hence:
///
/// Panics if shapes disagree, if a standard deviation is not positive and finite, or if `inflation` is not.
///
/// ```
/// use dynid_estimate::identifiability::{Verdict, assess};
/// use dynid_factor::FactorBuilder;
/// use dynid_linalg::Mat;
///
/// // Two parameters that act only as their sum, a third that acts alone and a fourth that never acts.
/// let regrouping = Mat::from_fn(2, 4, |i, j| [[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]][i][j]);
/// let mut log = FactorBuilder::new(2);
/// for k in 0..100 {
///     log.push_row(&[1.0, f64::from(k % 7)], 0.0).unwrap();
/// }
/// let found = assess(&log.finish(), 1.0, &regrouping, &[1.0; 4]);
/// assert!(found.parameters[0].structural_limit < 0.51);
/// assert_eq!(found.parameters[2].verdict, Verdict::Seen);
/// assert_eq!(found.parameters[3].verdict, Verdict::NotIdentifiable);
/// assert_eq!(found.base[0].verdict, Verdict::Seen);
/// ```
pub fn assess(information: &Factor, inflation: f64, regrouping: &Mat, prior_std: &[f64]) -> Identifiability {
    VisibleSpace::new(regrouping, prior_std).assess(information, inflation)
}
