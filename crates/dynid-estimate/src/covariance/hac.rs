//! Heteroscedasticity and autocorrelation consistent covariance from row scores.

use super::sandwich;
use dynid_linalg::triangular::symmetric_from;
use faer::Mat;

/// Largest AR(1) coefficient in the plug-in lag: trajectories make scores nearly unit root.
const LARGEST_AR1: f64 = 0.97;

/// HAC covariance with Bartlett weights, `V = C Ω C · T/(T-p)`,
/// `Ω = Γ_0 + Σ_{i=1..S} (1 - i/(S+1)) (Γ_i + Γ_iᵀ)`, `Γ_i = Σ_k s_k s_{k-i}ᵀ`.
///
/// `scores`: `T × p`, row `k` the score `s_k = Σ_j W_jkᵀ r_jk/σ_j²` of sample `k`, samples equidistant in time;
/// `unit_covariance`: `C = (RᵀR)⁻¹` of the same weighted problem; `lag`: `S`, see [`hac_lag`].
/// `None` unless `T > p`. Panics unless `C` is `p × p`.
///
/// Source: Newey & West 1987.
pub fn hac_bartlett(scores: &Mat<f64>, unit_covariance: &Mat<f64>, lag: usize) -> Option<Mat<f64>> {
    hac_bartlett_logs(std::slice::from_ref(scores), unit_covariance, &[lag])
}

/// Covariance as by [`hac_bartlett`], over several logs that are independent of each other: `Ω = Σ_l Ω_l`, `T = Σ_l T_l`.
///
/// `lags`: one per log. `None` unless `T > p`. Panics unless there is one lag per log and all have `p` columns.
pub fn hac_bartlett_logs(logs: &[Mat<f64>], unit_covariance: &Mat<f64>, lags: &[usize]) -> Option<Mat<f64>> {
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
fn bartlett_sum(scores: &Mat<f64>, lag: usize) -> Mat<f64> {
    let samples = scores.nrows();
    let autocovariance = |shift: usize| {
        scores.subrows(shift, samples - shift).transpose() * scores.subrows(0, samples - shift)
    };
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

/// Plug-in lag of Andrews 1991 for the Bartlett kernel, `S = ⌈1.1447 (α(1) T)^{1/3}⌉`, from AR(1) fits to each
/// column of the scores (coefficient clipped at ±0.97), innovations weighted by `C_jj²`.
///
/// Reported for comparison; it asks for too long a lag on smooth trajectories. `None` for all-zero scores.
pub fn andrews_lag(scores: &Mat<f64>, unit_covariance: &Mat<f64>) -> Option<usize> {
    let samples = scores.nrows();
    let (mut numerator, mut denominator) = (0.0, 0.0);
    for (j, column) in scores.col_iter().enumerate() {
        let lagged: f64 = (1..samples).map(|k| column[k] * column[k - 1]).sum();
        let energy: f64 = (1..samples).map(|k| column[k - 1] * column[k - 1]).sum();
        if energy == 0.0 {
            continue;
        }
        let a = (lagged / energy).clamp(-LARGEST_AR1, LARGEST_AR1);
        let innovation: f64 =
            (1..samples).map(|k| (column[k] - a * column[k - 1]).powi(2)).sum::<f64>() / (samples - 1) as f64;
        let share = (innovation * unit_covariance[(j, j)].powi(2)).powi(2);
        numerator += share * 4.0 * a * a / ((1.0 - a).powi(6) * (1.0 + a).powi(2));
        denominator += share / (1.0 - a).powi(4);
    }
    (denominator > 0.0).then(|| (1.1447 * (numerator / denominator * samples as f64).cbrt()).ceil() as usize)
}
