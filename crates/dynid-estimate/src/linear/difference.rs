//! What the difference of two estimates is made of.

use dynid_linalg::Mat;
use dynid_linalg::triangular::solve_lower_in_place;

use super::LinearEstimate;

/// Least singular value of the whitened columns, relative to the largest, below which unknowns are not told apart.
const LEAST_SINGULAR: f64 = 1e-9;

/// Outcome of [`explain_difference`].
#[derive(Debug, Clone, PartialEq)]
pub struct DifferenceFit {
    /// The unknowns `x`.
    pub x: Vec<f64>,
    /// Covariance of `x`.
    pub covariance: Mat,
}

/// Generalised least squares for `β₁ - β₂ = K x` with the weight `(κ₁ C₁ + κ₂ C₂)⁻¹`, `C` the covariances of both
/// estimates for white residuals.
///
/// `estimates`: in the same columns, which both must see alike; `inflation`: `κ₁`, `κ₂`; `map`: `K`, one row per column of
/// the estimates. `None` if the estimates kept other columns, or these do not tell the unknowns apart.
///
/// # Panics
/// If `map` has another number of rows than the estimates have columns.
pub fn explain_difference(
    estimates: [&LinearEstimate; 2],
    inflation: [f64; 2],
    map: &Mat,
) -> Option<DifferenceFit> {
    let [first, second] = estimates;
    assert!(map.nrows() == first.x.len() && map.nrows() == second.x.len(), "rows of the map");
    let kept = &first.solution.kept;
    if *kept != second.solution.kept {
        return None;
    }
    let (n, p) = (kept.len(), map.ncols());
    let sum = first.model_covariance() * inflation[0] + second.model_covariance() * inflation[1];
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / sum[(i, i)].sqrt()).collect();
    let factor = Mat::from_fn(n, n, |i, j| scale[i] * sum[(i, j)] * scale[j]).cholesky()?;
    let mut white = Mat::from_fn(n, p + 1, |i, j| {
        let row = kept[i];
        scale[i] * if j == p { first.x[row] - second.x[row] } else { map[(row, j)] }
    });
    solve_lower_in_place(&factor.lower(), &mut white);
    let lengths: Vec<f64> = (0..p).map(|j| white.col_norm(j)).collect();
    if n < p || !lengths.iter().all(|l| *l > 0.0) {
        return None;
    }
    let unit = Mat::from_fn(n, p, |i, j| white[(i, j)] / lengths[j]);
    let svd = unit.thin_svd()?;
    let (singular, v) = (svd.values, svd.v);
    if singular[p - 1] < LEAST_SINGULAR * singular[0] {
        return None;
    }
    let target = Mat::from_fn(n, 1, |i, _| white[(i, p)]);
    let solved = unit.qr().solve_least_squares(&target);
    let covariance = |i: usize, j: usize| {
        let sum: f64 = (0..p).map(|k| v[(i, k)] * v[(j, k)] / (singular[k] * singular[k])).sum();
        sum / (lengths[i] * lengths[j])
    };
    Some(DifferenceFit {
        x: (0..p).map(|j| solved[(j, 0)] / lengths[j]).collect(),
        covariance: Mat::from_fn(p, p, covariance),
    })
}
