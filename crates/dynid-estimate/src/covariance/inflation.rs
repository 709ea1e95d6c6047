//! Variance inflation of each output by itself.

use crate::least_squares::ols;
use dynid_factor::factor::Factor;
use dynid_factor::groups::ReducedGroup;

/// Per output, by how much its coloured residuals inflate the variance that white ones would give:
/// `κ_j = max(1, Σ_b ‖R_j⁻ᵀ g_jb‖² / rank_j)` with the block scores `g_jb` and the factor `R_j` of the output's weighted rows
/// in the columns that it excites.
///
/// `groups`: factors of all groups and time blocks; `weights`: one per group; `x`: the estimate in all `total` columns.
/// For white residuals of unit weighted variance every summand has the expectation 1. `None` for outputs without rows or
/// with fewer than `rank + 1` blocks, whose scores say too little.
///
/// Panics unless there is one weight per group.
pub fn output_inflation(groups: &[ReducedGroup], weights: &[f64], x: &[f64]) -> Vec<Option<f64>> {
    assert_eq!(groups.len(), weights.len(), "one weight per group");
    let outputs = groups.iter().map(|g| g.output + 1).max().unwrap_or(0);
    (0..outputs).map(|output| inflation(groups, weights, x, output)).collect()
}

/// By how much coloured residuals inflate the variances that white ones would give, from the scores of time blocks, however few:
/// `κ = max(1, Σ_b ‖R⁻ᵀ g_b‖² / (p - Σ_b ‖R⁻ᵀ R_bᵀ R_b R⁻¹‖²_F))`.
///
/// `blocks`: weighted factors in `p` independent columns, one per time block; `x`: their joint least-squares solution. `R` is their joint factor,
/// `g_b` the score of a block at `x`. For white residuals of unit weighted variance the numerator has the denominator as its expectation,
/// since the fit takes part of every score away. One number for all parameters, where a [jackknife](super::jackknife()) has one for each but needs
/// ten blocks or more. `None` with fewer than two blocks, and where one block holds everything.
///
/// Source: Bell & McCaffrey 2002 for the correction.
pub fn block_inflation(blocks: &[Factor], x: &[f64]) -> Option<f64> {
    /// Share of the expectation below which a score says nothing of the residuals.
    const LEAST: f64 = 0.1;
    if blocks.len() < 2 || x.is_empty() {
        return None;
    }
    let merged = Factor::merge(&blocks.iter().collect::<Vec<_>>());
    let inverse = dynid_linalg::triangular::inverse(&merged.r_matrix());
    let (mut sum, mut taken) = (0.0, 0.0);
    for block in blocks {
        let score = block.score(x);
        for j in 0..x.len() {
            sum += (0..=j).map(|i| inverse[(i, j)] * score[i]).sum::<f64>().powi(2);
        }
        let share = block.r_matrix() * &inverse;
        taken += (share.transpose() * &share).norm_l2().powi(2);
    }
    let expected = x.len() as f64 - taken;
    let found = sum / expected;
    (expected > LEAST * x.len() as f64 && found.is_finite()).then(|| found.max(1.0))
}

fn inflation(groups: &[ReducedGroup], weights: &[f64], x: &[f64], output: usize) -> Option<f64> {
    let own: Vec<(&ReducedGroup, f64)> =
        groups.iter().zip(weights.iter().copied()).filter(|(g, _)| g.output == output).collect();
    let columns = own.first()?.0.columns.clone();
    let values: Vec<f64> = columns.iter().map(|c| x[*c]).collect();
    let mut blocks: Vec<Factor> = Vec::new();
    for log in 0..=own.iter().map(|(g, _)| g.log).max()? {
        let of_log: Vec<&(&ReducedGroup, f64)> = own.iter().filter(|(g, _)| g.log == log).collect();
        for b in 0..of_log.iter().map(|(g, _)| g.blocks.len()).max().unwrap_or(0) {
            let parts: Vec<Factor> = of_log
                .iter()
                .filter_map(|(g, w)| {
                    g.blocks.get(b).filter(|f| f.rows() > 0).map(|f| f.scaled(*w).centred(&values))
                })
                .collect();
            if !parts.is_empty() {
                blocks.push(Factor::merge(&parts.iter().collect::<Vec<_>>()));
            }
        }
    }
    let merged = Factor::merge(&blocks.iter().collect::<Vec<_>>());
    let kept = ols(&merged).kept;
    if kept.is_empty() || blocks.len() <= kept.len() {
        return None;
    }
    let r = merged.select(&kept);
    let zero = vec![0.0; columns.len()];
    let sum: f64 = blocks
        .iter()
        .map(|block| {
            let score = block.score(&zero);
            // R⁻ᵀ g by forward substitution.
            let mut u: Vec<f64> = kept.iter().map(|c| score[*c]).collect();
            for i in 0..u.len() {
                let before: f64 = (0..i).map(|k| r.r(k, i) * u[k]).sum();
                u[i] = (u[i] - before) / r.r(i, i);
            }
            u.iter().map(|v| v * v).sum::<f64>()
        })
        .sum();
    Some((sum / kept.len() as f64).max(1.0))
}
