//! The visible space of a model in units of prior standard deviations.

use dynid_linalg::Mat;

use super::verdict::verdict;
use super::{Assessment, Identifiability};
use dynid_factor::factor::Factor;
use dynid_factor::rank::numerical_rank;

/// What any motion could see, with prior standard deviations as units: `C0^½ Kᵀ = Q T`.
///
/// Made once for a model and its prior, used for any number of logs.
#[derive(Debug, Clone)]
pub struct VisibleSpace {
    /// `Q`, `p × r`: orthonormal basis of the row space of `K C0^½`.
    visible: Mat,
    /// Per parameter: squared length in the orthogonal complement, `1 - p_j`.
    hidden: Vec<f64>,
    /// `T`, `r × r` upper triangular.
    triangle: Mat,
    /// Per base parameter: prior standard deviation, the length of its column of `T`.
    base_std: Vec<f64>,
    prior_std: Vec<f64>,
}

/// What a log excites: the singular values of `R_β Tᵀ`.
struct Excitation {
    /// Right singular vectors, `r × r`: those of the excited directions first.
    directions: Mat,
    /// Singular values of the excited directions.
    strengths: Vec<f64>,
}

/// Shares of the prior variance of one direction of parameter space.
struct Shares {
    achieved: f64,
    log_limit: f64,
    /// Visible in principle, not excited by this log.
    unexcited: f64,
    /// Left over in the excited directions.
    left: f64,
}

impl VisibleSpace {
    /// Visible space of the regrouping `K` (`r × p`) with `p` prior standard deviations.
    ///
    /// Panics if shapes disagree or a standard deviation is not positive and finite.
    pub fn new(regrouping: &Mat, prior_std: &[f64]) -> Self {
        let (r, p) = (regrouping.nrows(), regrouping.ncols());
        assert_eq!(prior_std.len(), p, "one standard deviation per parameter");
        assert!(r <= p, "no more base parameters than parameters");
        assert!(
            prior_std.iter().all(|s| s.is_finite() && *s > 0.0),
            "prior standard deviations are positive"
        );
        let whitened = Mat::from_fn(p, r, |j, i| regrouping[(i, j)] * prior_std[j]);
        let qr = whitened.qr();
        let all = qr.q();
        let triangle = qr.r().to_mat();
        VisibleSpace {
            visible: Mat::from_fn(p, r, |j, k| all[(j, k)]),
            hidden: (0..p).map(|j| (r..p).map(|k| all[(j, k)].powi(2)).sum()).collect(),
            base_std: (0..r).map(|i| triangle.col_norm(i)).collect(),
            triangle,
            prior_std: prior_std.to_vec(),
        }
    }

    /// Assesses all parameters; arguments and panics as for [`super::assess`].
    pub fn assess(&self, information: &Factor, inflation: f64) -> Identifiability {
        let excitation = self.excitation(information, inflation);
        let parameters = self
            .parameter_shares(&excitation)
            .into_iter()
            .enumerate()
            .map(|(j, shares)| assessment(&shares, self.hidden[j], self.prior_std[j]))
            .collect();
        let base = self
            .base_std
            .iter()
            .enumerate()
            .map(|(i, std)| {
                let along = |k: usize| -> f64 {
                    let column = excitation.directions.col(k);
                    (0..=i).map(|m| self.triangle[(m, i)] * column[m]).sum::<f64>() / std
                };
                assessment(&excitation.shares(along), 0.0, *std)
            })
            .collect();
        Identifiability { parameters, base, excited: excitation.strengths.len() }
    }

    /// Achieved shares `s_j` of the standard parameters alone; arguments and panics as for [`super::assess`].
    pub fn shares(&self, information: &Factor, inflation: f64) -> Vec<f64> {
        let excitation = self.excitation(information, inflation);
        self.parameter_shares(&excitation).iter().map(|s| s.achieved).collect()
    }

    /// Prior standard deviations of the base parameters, `√(K C0 Kᵀ)_ii`.
    pub fn base_std(&self) -> &[f64] {
        &self.base_std
    }

    /// The prior of the base parameters as rows of information `P`, one column per base parameter: `PᵀP = (K C0 Kᵀ)⁻¹`.
    pub fn prior_information(&self) -> Mat {
        dynid_linalg::triangular::inverse(&self.triangle).transpose().to_mat()
    }

    /// What base parameters tell of standard parameter `j`: `E[x_j | β] = c β` (about the prior) with `c = (C0 Kᵀ (K C0 Kᵀ)⁻¹)_j`. With the
    /// covariance `(RᵀR + (K C0 Kᵀ)⁻¹)⁻¹` of the base parameters the posterior variance is `c (RᵀR + (K C0 Kᵀ)⁻¹)⁻¹ cᵀ` and what stays
    /// hidden, [`Assessment::hidden`] `σ0_j²`.
    pub fn seen_through(&self, parameter: usize) -> Vec<f64> {
        let r = self.base_std.len();
        let row = Mat::from_fn(r, 1, |k, _| self.prior_std[parameter] * self.visible[(parameter, k)]);
        dynid_linalg::triangular::solve_upper(&self.triangle, &row).col(0).to_vec()
    }

    fn parameter_shares(&self, excitation: &Excitation) -> Vec<Shares> {
        let rotated = &self.visible * &excitation.directions;
        (0..self.prior_std.len()).map(|j| excitation.shares(|k| rotated[(j, k)])).collect()
    }

    fn excitation(&self, information: &Factor, inflation: f64) -> Excitation {
        let r = self.base_std.len();
        assert_eq!(information.columns(), r, "one column of information per base parameter");
        assert!(inflation.is_finite() && inflation > 0.0, "the variance inflation is positive");
        let weight = 1.0 / inflation.sqrt();
        // The rank that least squares goes by: what it would drop must not count as seen.
        let rank = numerical_rank(information).rank;
        let strength = (information.r_matrix() * self.triangle.transpose()) * weight;
        let Some(svd) = strength.svd() else {
            // The iteration of a finite matrix does not fail in practice; nothing is claimed if it did.
            return Excitation { directions: Mat::identity(r, r), strengths: Vec::new() };
        };
        let tolerance = 100.0 * f64::EPSILON * r as f64 * if r > 0 { svd.values[0] } else { 0.0 };
        let strengths = svd.values.iter().copied().take(rank).take_while(|s| *s > tolerance).collect();
        Excitation { directions: svd.v, strengths }
    }
}

impl Excitation {
    /// Shares of a direction with components `along` in the rotated basis of the visible space.
    fn shares(&self, along: impl Fn(usize) -> f64) -> Shares {
        let mut shares = Shares { achieved: 0.0, log_limit: 0.0, unexcited: 0.0, left: 0.0 };
        for k in 0..self.directions.ncols() {
            let part = along(k).powi(2);
            match self.strengths.get(k) {
                Some(d) => {
                    let left = 1.0 / (1.0 + d * d);
                    shares.achieved += part * (d * d * left).min(1.0);
                    shares.left += part * left;
                    shares.log_limit += part;
                }
                None => shares.unexcited += part,
            }
        }
        shares
    }
}

fn assessment(shares: &Shares, hidden: f64, prior_std: f64) -> Assessment {
    // Rounding may carry sums of squares of an orthogonal row past one.
    let structural_limit = (1.0 - hidden).clamp(0.0, 1.0);
    let log_limit = shares.log_limit.min(structural_limit);
    let achieved = shares.achieved.min(log_limit);
    Assessment {
        achieved,
        log_limit,
        structural_limit,
        hidden,
        prior_std,
        // The complement of the share as a sum of squares: 1 - s would lose the digits of what is seen well.
        posterior_std: prior_std * (hidden + shares.unexcited + shares.left).min(1.0).sqrt(),
        verdict: verdict(achieved, log_limit, structural_limit),
    }
}
