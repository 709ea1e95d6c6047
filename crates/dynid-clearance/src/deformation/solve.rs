//! Weighted least squares by factors, and what single rows contribute to a parameter.

use super::{DeformationError, Rows};
use dynid_estimate::linear::ols;
use dynid_factor::factor::{Factor, FactorBuilder};
use dynid_linalg::triangular::gram_inverse;

/// Columns and right-hand side of one row of the problem over all instants, placed among all unknowns.
pub(super) struct Placed<'a> {
    /// Position among the unknowns, and values.
    pub columns: Vec<(usize, &'a [f64])>,
    pub rhs: &'a [f64],
    pub weight: f64,
}

/// Triangle of rows at the instants that `used` admits.
pub(super) fn factor(
    unknowns: usize,
    rows: &[Placed<'_>],
    used: &dyn Fn(usize) -> bool,
) -> Result<Factor, DeformationError> {
    let mut builder = FactorBuilder::new(unknowns);
    for row in rows {
        let at: Vec<usize> = (0..row.rhs.len()).filter(|t| used(*t)).collect();
        let mut source: Vec<Option<&[f64]>> = vec![None; unknowns + 1];
        row.columns.iter().for_each(|(place, values)| source[*place] = Some(values));
        source[unknowns] = Some(row.rhs);
        builder
            .push_with(at.len(), |column, range, out| match source[column] {
                Some(values) => {
                    out.iter_mut().zip(&at[range]).for_each(|(o, t)| *o = row.weight * values[*t]);
                }
                None => out.fill(0.0),
            })
            .map_err(|_| DeformationError::Rows { expected: "finite numbers" })?;
    }
    Ok(builder.finish())
}

/// Adds what is known of `β`, whose current value is `at`.
pub(super) fn with_prior(factor: Factor, rows: &Rows, at: &[f64]) -> Factor {
    if rows.prior.is_empty() {
        return factor;
    }
    let (mut weights, mut offset) = (vec![0.0; factor.columns()], vec![0.0; factor.columns()]);
    for (k, (mean, std)) in rows.prior.iter().enumerate() {
        weights[k] = 1.0 / std;
        offset[k] = mean - at[k];
    }
    factor.with_prior_rows(&weights, &offset)
}

/// Least-squares solution; zero for columns that others make up.
pub(super) fn solution(factor: &Factor) -> Vec<f64> {
    ols(factor).x
}

/// Per unknown of `wanted`: its row of `(RᵀR)⁻¹`, zero where the unknown is not determined.
pub(super) fn gain(factor: &Factor, wanted: &[usize]) -> Vec<Vec<f64>> {
    let found = ols(factor);
    let inverse = gram_inverse(&found.factor.r_matrix());
    let place = |k: usize| found.kept.binary_search(&k).ok();
    wanted
        .iter()
        .map(|k| {
            let mut out = vec![0.0; factor.columns()];
            if let Some(row) = place(*k) {
                found.kept.iter().enumerate().for_each(|(j, column)| out[*column] = inverse[(row, j)]);
            }
            out
        })
        .collect()
}

/// `Σ_k x_k column_k`.
pub(super) fn combine(columns: &[Vec<f64>], x: &[f64], samples: usize) -> Vec<f64> {
    let mut out = vec![0.0; samples];
    for (column, x) in columns.iter().zip(x).filter(|(_, x)| **x != 0.0) {
        out.iter_mut().zip(column).for_each(|(o, v)| *o += x * v);
    }
    out
}

/// Root mean square at the instants that `used` admits.
pub(super) fn rms(x: &[f64], used: &dyn Fn(usize) -> bool) -> f64 {
    let (sum, n) = x
        .iter()
        .enumerate()
        .filter(|(t, _)| used(*t))
        .fold((0.0, 0usize), |(sum, n), (_, v)| (sum + v * v, n + 1));
    (sum / n.max(1) as f64).sqrt()
}
