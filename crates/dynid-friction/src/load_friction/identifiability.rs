//! What the rows determine at a solution, and how well.

use super::bounded::acts;
use super::error::{LoadFrictionError, in_range, same_size};
use super::problem::Problem;
use dynid_factor::rank::rank_tolerance;
use dynid_linalg::Mat;

/// A parameter or combination counts as determined when its share in the null directions is below this.
const DETERMINED: f64 = 1e-6;

/// Scaled singular values, rank, null directions and covariance of the Jacobian `J` at a solution.
///
/// Everything is decided on `J S/√rows` with scales `S` of the parameters, so that a singular value is the RMS change of
/// effort, per unit share of the scales. The covariance comes from the singular values above the rank tolerance; nothing is
/// inverted that the rows do not determine. Standard deviations take residuals for independent.
#[derive(Debug, Clone)]
pub struct Identifiability {
    /// Scales `S_k` used.
    pub scales: Vec<f64>,
    /// Singular values of `J S/√rows`, descending, in units of effort.
    pub singular_values: Vec<f64>,
    /// Number of singular values above [`Self::tolerance`].
    pub rank: usize,
    /// `100 ε max(rows, p + 4) σ_1`.
    pub tolerance: f64,
    /// `σ_r/σ_{r+1}`; `None` at full rank or rank 0, infinite for `σ_{r+1} = 0`. Below 1e4 the rank is in doubt.
    pub gap: Option<f64>,
    /// Directions in `θ` that change no effort to first order, (p + 4) × (p + 4 - rank), in units of the parameters;
    /// orthonormal after division by the scales.
    pub null_directions: Mat,
    /// Per parameter: whether the efforts depend on it at all here.
    pub acts: Vec<bool>,
    /// Per parameter: whether no null direction contains it (and it acts).
    pub determined: Vec<bool>,
    /// `J/(rows - rank)`, effort²; `None` without a row to spare.
    pub residual_variance: Option<f64>,
    /// `S V_r Σ_r⁻¹/√rows`: covariance of estimable combinations is `σ² K Kᵀ`.
    root: Mat,
    theta: Vec<f64>,
}

/// A linear combination of the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CombinationValue {
    /// Value of the combination.
    pub value: f64,
    /// Whether no null direction changes it.
    pub determined: bool,
    /// Standard deviation; `None` if it is not determined or no row is to spare.
    pub std: Option<f64>,
}

impl Problem {
    /// What the rows determine at `θ`, usually a solution.
    ///
    /// `scales`: what counts as one unit of every parameter, positive; `None`: `|θ_k|`, and 1 where that is 0.
    ///
    /// # Errors
    /// Fails as [`Problem::residuals`] does; scales of a wrong number or not positive.
    pub fn identifiability(
        &self,
        theta: &[f64],
        scales: Option<&[f64]>,
    ) -> Result<Identifiability, LoadFrictionError> {
        let mut jacobian = self.jacobian(theta)?;
        let n = self.parameters();
        let scales: Vec<f64> = match scales {
            Some(given) => given.to_vec(),
            None => theta.iter().map(|t| if *t == 0.0 { 1.0 } else { t.abs() }).collect(),
        };
        same_size("scales", n, scales.len())?;
        for (k, s) in scales.iter().enumerate() {
            in_range(format!("scale of parameter {k}"), "a positive number", *s, s.is_finite() && *s > 0.0)?;
        }
        let rows = jacobian.nrows();
        let root_rows = (rows as f64).sqrt();
        let mut acting = vec![false; n];
        for k in 0..n {
            let factor = scales[k] / root_rows;
            jacobian.col_mut(k).iter_mut().for_each(|v| *v *= factor);
            acting[k] = acts(self, k) && jacobian.col(k).iter().any(|v| *v != 0.0);
        }
        let (singular_values, v) = right_singular(&jacobian)?;
        let tolerance = rank_tolerance(rows, n, singular_values[0]);
        let rank = singular_values.iter().take_while(|s| **s > tolerance).count();
        let hidden = |k: usize| (rank..n).map(|i| v[(k, i)].powi(2)).sum::<f64>().sqrt();
        let spare = rows.checked_sub(rank).filter(|f| *f > 0);
        let rss = self.sum_of_squares(theta)?;
        Ok(Identifiability {
            tolerance,
            rank,
            gap: (rank > 0 && rank < n).then(|| singular_values[rank - 1] / singular_values[rank]),
            null_directions: Mat::from_fn(n, n - rank, |k, i| scales[k] * v[(k, rank + i)]),
            determined: (0..n).map(|k| acting[k] && hidden(k) < DETERMINED).collect(),
            acts: acting,
            residual_variance: spare.map(|f| rss / f as f64),
            root: Mat::from_fn(n, rank, |k, i| scales[k] * v[(k, i)] / (singular_values[i] * root_rows)),
            singular_values,
            scales,
            theta: theta.to_vec(),
        })
    }
}

/// Singular values, as many as columns, and right singular vectors.
pub(super) fn right_singular(matrix: &Mat) -> Result<(Vec<f64>, Mat), LoadFrictionError> {
    let n = matrix.ncols();
    // Rows of zeros change nothing and make the decomposition complete.
    let tall = match matrix.nrows() {
        rows if rows >= n => matrix.clone(),
        rows => Mat::from_fn(n, n, |i, j| if i < rows { matrix[(i, j)] } else { 0.0 }),
    };
    let qr = tall.qr();
    let triangle = qr.r().to_mat();
    let svd = triangle.svd().ok_or(LoadFrictionError::Decomposition { what: "the scaled rows" })?;
    Ok((svd.values, svd.v))
}

impl Identifiability {
    /// Value and standard deviation of `b · θ`.
    ///
    /// # Errors
    /// A wrong number of factors.
    pub fn combination(&self, factors: &[f64]) -> Result<CombinationValue, LoadFrictionError> {
        same_size("factors of a combination", self.theta.len(), factors.len())?;
        let along = |m: &Mat, i: usize| -> f64 { factors.iter().zip(m.col(i)).map(|(f, v)| f * v).sum() };
        let size = factors.iter().zip(&self.scales).map(|(f, s)| (f * s).powi(2)).sum::<f64>().sqrt();
        let hidden = (0..self.null_directions.ncols()).map(|i| along(&self.null_directions, i).powi(2));
        let determined = size > 0.0 && hidden.sum::<f64>().sqrt() < DETERMINED * size;
        let spread = (0..self.rank).map(|i| along(&self.root, i).powi(2)).sum::<f64>();
        let std = self.residual_variance.filter(|_| determined).map(|v| (v * spread).sqrt());
        let value = factors.iter().zip(&self.theta).map(|(f, t)| f * t).sum();
        Ok(CombinationValue { value, determined, std })
    }

    /// `b = B φ` with standard deviations: base parameters for a matrix of p (or p + 4) columns.
    ///
    /// # Errors
    /// A wrong number of columns.
    pub fn combinations(&self, rows: &Mat) -> Result<Vec<CombinationValue>, LoadFrictionError> {
        let n = self.theta.len();
        if rows.ncols() != n {
            same_size("columns of the combinations", n - 4, rows.ncols())?;
        }
        let padded = |i: usize| -> Vec<f64> {
            (0..n).map(|k| if k < rows.ncols() { rows[(i, k)] } else { 0.0 }).collect()
        };
        (0..rows.nrows()).map(|i| self.combination(&padded(i))).collect()
    }

    /// Standard deviations of the parameters that are determined one by one.
    pub fn standard_deviations(&self) -> Vec<Option<f64>> {
        let one = |k: usize| {
            let spread: f64 = (0..self.rank).map(|i| self.root[(k, i)].powi(2)).sum();
            self.residual_variance.filter(|_| self.determined[k]).map(|v| (v * spread).sqrt())
        };
        (0..self.theta.len()).map(one).collect()
    }

    /// The parameters at which this was evaluated.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Null space in scaled coordinates, orthonormal: row `k` belongs to parameter `k`.
    pub(super) fn scaled_null_space(&self) -> Mat {
        let null = &self.null_directions;
        Mat::from_fn(null.nrows(), null.ncols(), |k, i| null[(k, i)] / self.scales[k])
    }
}
