//! Base columns by preference, and how the others regroup into them.

use super::{numerical_rank, rank_tolerance, scaled_triangle};
use crate::factor::Factor;
use dynid_linalg::Mat;
use dynid_linalg::triangular::solve_upper;

/// Entries of the scaled regrouping below this are rounding and become zero.
const NEGLIGIBLE: f64 = 1e-10;

/// Independent columns chosen by preference, and the regrouping of the rest.
///
/// `W x = W_kept (x_kept + regrouping · x_dependent)` up to the rank tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseColumns {
    /// Independent columns, in the preferred order.
    pub kept: Vec<usize>,
    /// Columns that are combinations of the kept ones, in the preferred order.
    pub dependent: Vec<usize>,
    /// Zero columns: in no combination.
    pub unexcited: Vec<usize>,
    /// `R1⁻¹ R2`, `kept × dependent`, in the units of the parameters.
    pub regrouping: Mat,
    /// Whether the preference gave another rank than the singular values, so that pivoted QR chose instead.
    pub fell_back_to_pivoting: bool,
}

/// Chooses base columns by going through `preference`: a column is kept unless its residual after projection on
/// the columns kept so far is below `τ = 100 ε max(N, p) σ_1` (unit columns).
///
/// Entries of the regrouping are set to zero when, in unit columns, they are below 1e-10. Panics unless
/// `preference` is a permutation of `0..p`.
///
/// Source: Gautier 1991, "Numerical calculation of the base inertial parameters of robots".
pub fn base_columns(factor: &Factor, preference: &[usize]) -> BaseColumns {
    let columns = factor.columns();
    let mut sorted = preference.to_vec();
    sorted.sort_unstable();
    assert!(sorted.iter().copied().eq(0..columns), "preference is a permutation of the columns");

    let report = numerical_rank(factor);
    let unit = scaled_triangle(factor, &report.column_norms);
    let largest = report.singular_values.first().copied().unwrap_or(0.0);
    let tolerance = rank_tolerance(factor.rows(), columns, largest);
    let excited: Vec<usize> = preference.iter().copied().filter(|&c| report.column_norms[c] > 0.0).collect();

    let mut kept = independent_in_order(&unit, &excited, tolerance);
    let fell_back_to_pivoting = kept.len() != report.rank;
    if fell_back_to_pivoting {
        kept = report.pivot_order[..report.rank].to_vec();
    }
    let dependent: Vec<usize> = excited.iter().copied().filter(|c| !kept.contains(c)).collect();
    let regrouping = regroup(factor, &kept, &dependent, &report.column_norms);
    BaseColumns { kept, dependent, unexcited: report.unexcited, regrouping, fell_back_to_pivoting }
}

/// Gram-Schmidt with one repetition ("twice is enough"), in the given order.
fn independent_in_order(unit: &Mat, order: &[usize], tolerance: f64) -> Vec<usize> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut kept = Vec::new();
    for &column in order {
        let mut residual: Vec<f64> = (0..unit.nrows()).map(|i| unit[(i, column)]).collect();
        for _ in 0..2 {
            for direction in &basis {
                let share: f64 = direction.iter().zip(&residual).map(|(d, r)| d * r).sum();
                residual.iter_mut().zip(direction).for_each(|(r, d)| *r -= share * d);
            }
        }
        let norm = residual.iter().map(|r| r * r).sum::<f64>().sqrt();
        if norm > tolerance {
            residual.iter_mut().for_each(|r| *r /= norm);
            basis.push(residual);
            kept.push(column);
        }
    }
    kept
}

fn regroup(factor: &Factor, kept: &[usize], dependent: &[usize], norms: &[f64]) -> Mat {
    let order: Vec<usize> = kept.iter().chain(dependent).copied().collect();
    let sorted = factor.select(&order);
    let k = kept.len();
    let r1 = Mat::from_fn(k, k, |i, j| sorted.r(i, j));
    let r2 = Mat::from_fn(k, dependent.len(), |i, j| sorted.r(i, k + j));
    let mut regrouping = solve_upper(&r1, &r2);
    for j in 0..dependent.len() {
        for i in 0..k {
            if (regrouping[(i, j)] * norms[kept[i]] / norms[dependent[j]]).abs() < NEGLIGIBLE {
                regrouping[(i, j)] = 0.0;
            }
        }
    }
    regrouping
}
