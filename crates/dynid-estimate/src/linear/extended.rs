//! Ordinary least squares on a factor in double-double arithmetic.

use crate::least_squares::{LinearSolution, ols};
use dynid_factor::factor::{DoubleDouble, ExtendedFactor};
use dynid_linalg::triangular::symmetric_from;
use faer::Mat;

/// Least squares on the merged rows of one extended factor.
///
/// The rules are those of [`ols`], the rank being decided on the rounded factor by the same rule; but parameters, residual sum of
/// squares and `C` of [`LinearSolution::unit_covariance`] come from the double-double triangle and are rounded
/// once, at the end. [`LinearSolution::factor`] is rounded: what is computed from it has double precision.
pub fn ols_extended(factor: &ExtendedFactor) -> LinearSolution {
    let mut solution = ols(&factor.rounded());
    let selected = (!solution.dropped.is_empty()).then(|| factor.select(&solution.kept));
    let reduced = selected.as_ref().unwrap_or(factor);
    let z: Vec<DoubleDouble> = (0..reduced.columns()).map(|i| reduced.z(i)).collect();
    for (&column, value) in solution.kept.iter().zip(substitute(reduced, z)) {
        solution.x[column] = value.to_f64();
    }
    solution.rss = (reduced.rho() * reduced.rho()).to_f64();
    solution.factor = reduced.rounded();
    solution.extended_covariance = Some(gram_inverse(reduced));
    solution
}

/// `R⁻¹ b`. The diagonal of `R` must not hold zeros.
fn substitute(factor: &ExtendedFactor, mut b: Vec<DoubleDouble>) -> Vec<DoubleDouble> {
    for j in (0..b.len()).rev() {
        b[j] = b[j] / factor.r(j, j);
        let (above, solved) = b.split_at_mut(j);
        for (i, value) in above.iter_mut().enumerate() {
            *value = *value - factor.r(i, j) * solved[0];
        }
    }
    b
}

/// `(RᵀR)⁻¹ = R⁻¹R⁻ᵀ`, rounded.
fn gram_inverse(factor: &ExtendedFactor) -> Mat<f64> {
    let n = factor.columns();
    let unit = |k: usize| {
        let mut e = vec![DoubleDouble::ZERO; n];
        e[k] = DoubleDouble::ONE;
        e
    };
    let inverse: Vec<Vec<DoubleDouble>> = (0..n).map(|k| substitute(factor, unit(k))).collect();
    symmetric_from(n, |i, j| {
        let products = inverse[j..].iter().map(|column| column[i] * column[j]);
        products.fold(DoubleDouble::ZERO, |sum, product| sum + product).to_f64()
    })
}
