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
