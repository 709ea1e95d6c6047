//! Columns that are measured, and how much of them is noise.

use super::numerical_rank;
use crate::factor::Factor;

/// Per column, the share of what the other columns leave of it that is not its own noise, 0 to 1.
///
/// With `d_j` the norm of what the other columns leave of column `j` and `s_j` the standard deviation of its errors,
/// `1 - (N - p + 1) s_j²/d_j²`: by this factor least squares shrink parameter `j` if the errors of the other columns do not
/// matter. Near 1 the parameter is seen; near 0 its column varies by noise alone, and least squares return nearly zero with
/// a small standard deviation. The numerical rank does not tell: noise makes every column independent of the others. A
/// column that follows from others, or is zero, has 0.
///
/// `noise`: one standard deviation per column, in its unit, the root mean square over all rows; 0: the column is exact.
///
/// # Panics
/// Unless there is one standard deviation per column.
///
/// Source: Fuller 1987, *Measurement Error Models*, section 1.1 (reliability ratio).
pub fn column_reliability(factor: &Factor, noise: &[f64]) -> Vec<f64> {
    let p = factor.columns();
    assert_eq!(noise.len(), p, "one standard deviation per column");
    let report = numerical_rank(factor);
    let freedom = (factor.rows() + 1).saturating_sub(p) as f64;
    (0..p)
        .map(|j| {
            let norm = report.column_norms[j];
            let others: Vec<usize> = (0..p).filter(|c| *c != j).collect();
            // What depends on others has a direction of rounding only, which would take part of this column.
            let independent = numerical_rank(&factor.select(&others)).independent;
            let order: Vec<usize> = independent.iter().map(|k| others[*k]).chain([j]).collect();
            let last = order.len() - 1;
            let left = factor.select(&order).r(last, last).abs();
            if left <= report.tolerance * norm {
                return 0.0;
            }
            (1.0 - freedom * (noise[j] / left).powi(2)).clamp(0.0, 1.0)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FactorBuilder;

    #[test]
    fn noise_is_told_from_signal() {
        let (mut builder, noise, size) = (FactorBuilder::new(3), 0.1, 10_000);
        // Weyl sequences stand in for random numbers: uniform with mean 0, their deviation 1/√12.
        let uniform = |k: usize, step: f64| (k as f64 * step).fract() - 0.5;
        for k in 0..size {
            let (a, b) = (uniform(k, 2f64.sqrt()), uniform(k, 3f64.sqrt()));
            let error = 12f64.sqrt() * noise;
            builder
                .push_row(&[1.0, 3.0 + error * a, 0.2 * b + error * uniform(k, 5f64.sqrt())], 0.0)
                .unwrap();
        }
        let found = column_reliability(&builder.finish(), &[0.0, noise, noise]);
        // The constant is seen through the second column's noise alone, but is exact itself.
        assert_eq!(found[0], 1.0);
        assert!(found[1] < 0.02, "{found:?}");
        let signal = 0.04 / 12.0;
        assert!((found[2] - signal / (signal + noise * noise)).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_column_that_follows_from_others_has_none() {
        let mut builder = FactorBuilder::new(3);
        for k in 0..20 {
            let x = f64::from(k);
            builder.push_row(&[1.0, x, 2.0 * x], 0.0).unwrap();
        }
        let found = column_reliability(&builder.finish(), &[0.0; 3]);
        assert_eq!(found, [1.0, 0.0, 0.0]);
    }
}
