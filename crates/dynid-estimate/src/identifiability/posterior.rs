//! Standard parameters by themselves: data and prior put together, with an interval that colour does not fool.

use dynid_linalg::Mat;

use dynid_factor::factor::Factor;

/// Parameters after the data have been put together with the prior.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// Posterior means, one per standard parameter, in its unit. No constraint is applied.
    pub mean: Vec<f64>,
    /// Standard deviations of these: of the noise as the robust covariance has it, and of the prior where the data leave
    /// room.
    pub std: Vec<f64>,
    /// Covariance that these are the roots of the diagonal of, `p × p`.
    pub covariance: Mat,
}

/// Posterior of `β = K x + noise` with the prior `x ~ N(x0, C0)`.
///
/// `x̂ = x0 + G (β - K x0)` with the gain `G = C0 Kᵀ (K C0 Kᵀ + Σ)⁻¹`; its covariance is
/// `(1 - G K) C0 (1 - G K)ᵀ + G V Gᵀ`, which for `V = Σ` is the posterior covariance `(Kᵀ Σ⁻¹ K + C0⁻¹)⁻¹`.
///
/// - `regrouping`: `K`, `k × p`; `estimate`: `β`, `k` entries.
/// - `white`, `inflation`: `Σ = κ C`, `k × k`, decides how far data and prior count; `covariance`: `V`, `k × k`, the
///   covariance that is believed (jackknife).
/// - `prior`, `prior_std`: `x0` and `√C0`, `p` entries, deviations positive.
///
/// `None` if `K C0 Kᵀ + Σ` is not positive definite to rounding. Panics if shapes disagree.
pub fn posterior(
    regrouping: &Mat,
    estimate: &[f64],
    white: &Mat,
    inflation: f64,
    covariance: &Mat,
    prior: &[f64],
    prior_std: &[f64],
) -> Option<Posterior> {
    let (k, p) = (regrouping.nrows(), regrouping.ncols());
    assert!(estimate.len() == k && prior.len() == p && prior_std.len() == p, "one entry per column or row");
    assert!(white.nrows() == k && covariance.nrows() == k, "covariances of the estimate");
    let whitened = Mat::from_fn(k, p, |i, j| regrouping[(i, j)] * prior_std[j]);
    let sum = &whitened * whitened.transpose() + white * inflation;
    let scale: Vec<f64> = (0..k).map(|i| 1.0 / sum[(i, i)].sqrt()).collect();
    let scaled = Mat::from_fn(k, k, |i, j| sum[(i, j)] * scale[i] * scale[j]);
    let factor = scaled.cholesky()?;
    let rows = Mat::from_fn(k, p, |i, j| scale[i] * whitened[(i, j)]);
    let solved = factor.solve(&rows);
    // Gain in units of the prior deviations, p × k.
    let gain = Mat::from_fn(p, k, |j, i| solved[(i, j)] * scale[i]);
    let missing: Vec<f64> =
        (0..k).map(|i| estimate[i] - (0..p).map(|j| regrouping[(i, j)] * prior[j]).sum::<f64>()).collect();
    let left = Mat::identity(p, p) - &gain * &whitened;
    let of_prior = &left * left.transpose();
    let of_noise = &gain * covariance * gain.transpose();
    let between = |i: usize, j: usize| {
        let noise = if i == j { of_noise[(i, j)].max(0.0) } else { of_noise[(i, j)] };
        prior_std[i] * prior_std[j] * (of_prior[(i, j)] + noise)
    };
    let mean = |j: usize| prior[j] + prior_std[j] * (0..k).map(|i| gain[(j, i)] * missing[i]).sum::<f64>();
    Some(Posterior {
        mean: (0..p).map(mean).collect(),
        std: (0..p).map(|j| between(j, j).sqrt()).collect(),
        covariance: Mat::from_fn(p, p, between),
    })
}

/// Regrouping of the base parameters that a log tells apart: what the dropped columns contribute is folded into the kept
/// ones.
///
/// `factor`: all base columns; `kept`: independent ones; `regrouping`: `K`, `r × p`. Returns `kept × p`.
pub fn excited_regrouping(factor: &Factor, kept: &[usize], regrouping: &Mat) -> Mat {
    if kept.len() == regrouping.nrows() {
        return regrouping.clone();
    }
    let r = factor.r_matrix();
    let independent = Mat::from_fn(r.nrows(), kept.len(), |i, k| r[(i, kept[k])]);
    independent.qr().solve_least_squares(&r) * regrouping
}
