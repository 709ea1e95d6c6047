//! Covariance of an estimate that stays true when filtering or model error correlate the residuals.
//!
//! The model-based `C = (RᵀR)⁻¹` assumes independent residuals and is too small for filtered logs. The jackknife
//! over time blocks is the default; the block sandwich, the HAC estimator and the block bootstrap are second opinions.
//! All work on independent columns: select [`crate::linear::LinearSolution::kept`] first.

mod block_length;
mod bootstrap;
mod hac;
mod inflation;
mod jackknife;
mod sandwich;

pub use block_length::{BlockLength, BlockLengthSettings, BlockLengthStatus, ResidualSignal, block_length};
pub use bootstrap::{Bootstrap, BootstrapSettings, bootstrap};
pub use hac::{hac_bartlett, hac_bartlett_logs, hac_lag};
pub use inflation::{block_inflation, output_inflation};
pub use jackknife::{Jackknife, MIN_BLOCKS, jackknife, jackknife_by, jackknife_with};
pub(crate) use jackknife::{change_without, jackknife_of, running_merges};
pub use sandwich::{block_sandwich, block_sandwich_with};

use dynid_linalg::Mat;

/// Variance inflation `κ = max(1, median_i V_ii/C_ii)`: by how much `model` understates `robust`.
///
/// The effective number of samples is `N/κ`. `None` for empty matrices or without a positive `C_ii`.
pub fn variance_inflation(robust: &Mat, model: &Mat) -> Option<f64> {
    let mut ratios: Vec<f64> =
        (0..model.nrows()).filter(|&i| model[(i, i)] > 0.0).map(|i| robust[(i, i)] / model[(i, i)]).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let middle = ratios.len() / 2;
    let median = match ratios.len() {
        0 => return None,
        n if n % 2 == 1 => ratios[middle],
        _ => 0.5 * (ratios[middle - 1] + ratios[middle]),
    };
    Some(median.max(1.0))
}

/// `C Ω C` for symmetric matrices, symmetric to the last bit.
pub(crate) fn sandwich(bread: &Mat, filling: &Mat) -> Mat {
    let product = bread * filling * bread;
    dynid_linalg::triangular::symmetric_from(bread.nrows(), |i, j| 0.5 * (product[(i, j)] + product[(j, i)]))
}
