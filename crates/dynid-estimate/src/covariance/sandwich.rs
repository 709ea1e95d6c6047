//! Sandwich covariance with block sums of scores.

use super::sandwich;
use dynid_factor::factor::Factor;
use dynid_linalg::Mat;
use dynid_linalg::triangular::{gram_inverse, symmetric_from};

/// `V = B/(B-1) · C (Σ_b s_b s_bᵀ) C` with block scores `s_b = R_bᵀ(z_b - R_b x)` and `C = (RᵀR)⁻¹`.
///
/// `blocks`: weighted factors of the time blocks in independent columns; `x` their joint least-squares solution.
/// `None` with fewer than two blocks.
///
/// Source: Newey & West 1987, with the block as the unit of dependence.
pub fn block_sandwich(blocks: &[Factor], x: &[f64]) -> Option<Mat> {
    block_sandwich_with(blocks, None, x)
}

/// Covariance as by [`block_sandwich`], with rows that belong to no block, such as those of a prior: they add to `C` but have no
/// score of their own, being fixed numbers.
pub fn block_sandwich_with(blocks: &[Factor], fixed: Option<&Factor>, x: &[f64]) -> Option<Mat> {
    let count = blocks.len();
    if count < 2 {
        return None;
    }
    let merged = Factor::merge(&blocks.iter().chain(fixed).collect::<Vec<_>>());
    let scores: Vec<Vec<f64>> = blocks.iter().map(|b| b.score(x)).collect();
    let correction = count as f64 / (count - 1) as f64;
    let filling =
        symmetric_from(x.len(), |i, j| correction * scores.iter().map(|s| s[i] * s[j]).sum::<f64>());
    Some(sandwich(&gram_inverse(&merged.r_matrix()), &filling))
}
