//! Heteroscedasticity and autocorrelation consistent covariance from row scores.

use super::sandwich;
use dynid_linalg::Mat;
use dynid_linalg::triangular::symmetric_from;

/// HAC covariance with Bartlett weights, `V = C Ω C · T/(T-p)`,
/// `Ω = Γ_0 + Σ_{i=1..S} (1 - i/(S+1)) (Γ_i + Γ_iᵀ)`, `Γ_i = Σ_k s_k s_{k-i}ᵀ`.
///
/// `scores`: `T × p`, row `k` the score `s_k = Σ_j W_jkᵀ r_jk/σ_j²` of sample `k`, samples equidistant in time;
/// `unit_covariance`: `C = (RᵀR)⁻¹` of the same weighted problem; `lag`: `S`, see [`hac_lag`].
/// `None` unless `T > p`. Panics unless `C` is `p × p`.
///
/// Source: Newey & West 1987.
pub fn hac_bartlett(scores: &Mat, unit_covariance: &Mat, lag: usize) -> Option<Mat> {
    hac_bartlett_logs(std::slice::from_ref(scores), unit_covariance, &[lag])
}

/// Covariance as by [`hac_bartlett`], over several logs that are independent of each other: `Ω = Σ_l Ω_l`, `T = Σ_l T_l`.
///
/// `lags`: one per log. `None` unless `T > p`. Panics unless there is one lag per log and all have `p` columns.
pub fn hac_bartlett_logs(logs: &[Mat], unit_covariance: &Mat, lags: &[usize]) -> Option<Mat> {
    let p = unit_covariance.nrows();
    assert!(unit_covariance.ncols() == p && logs.iter().all(|l| l.ncols() == p), "C is p × p");
    assert_eq!(logs.len(), lags.len(), "one lag per log");
    let samples: usize = logs.iter().map(Mat::nrows).sum();
    if samples <= p {
        return None;
    }
    let mut filling = Mat::zeros(p, p);
    for (scores, lag) in logs.iter().zip(lags) {
        filling += bartlett_sum(scores, *lag);
    }
    let correction = samples as f64 / (samples - p) as f64;
    let covariance = sandwich(unit_covariance, &filling);
    Some(symmetric_from(p, |i, j| correction * covariance[(i, j)]))
}

/// `Γ_0 + Σ_i (1 - i/(S+1)) (Γ_i + Γ_iᵀ)`.
fn bartlett_sum(scores: &Mat, lag: usize) -> Mat {
    let samples = scores.nrows();
    let autocovariance =
        |shift: usize| scores.rows(shift..samples).transpose() * scores.rows(0..samples - shift);
    let mut sum = autocovariance(0);
    for shift in 1..=lag.min(samples.saturating_sub(1)) {
        let weight = 1.0 - shift as f64 / (lag + 1) as f64;
        let gamma = autocovariance(shift);
        sum += symmetric_from(scores.ncols(), |i, j| weight * (gamma[(i, j)] + gamma[(j, i)]));
    }
    sum
}

/// Bartlett lag from the filter, `S = max(⌈2 f_s/f_c⌉, 4)`: residuals stay correlated for about a period of the
/// cut-off. `sample_rate` after decimation and `cut_off` in Hz, both positive.
pub fn hac_lag(sample_rate: f64, cut_off: f64) -> usize {
    ((2.0 * sample_rate / cut_off).ceil() as usize).max(4)
}
