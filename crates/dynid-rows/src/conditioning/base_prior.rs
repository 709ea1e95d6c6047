//! What is known of base parameters without logs.

use dynid_linalg::Mat;

/// What is known of base parameters without logs: a normal distribution.
#[derive(Debug, Clone)]
pub struct BasePrior {
    pub(crate) values: Vec<f64>,
    pub(crate) precision: Mat,
}

impl BasePrior {
    /// From values and standard deviations of all linear parameters. `regrouping`: `K` of the base parameters,
    /// base × parameters. `None` where `K` has dependent rows.
    ///
    /// # Panics
    /// If a length disagrees with `regrouping`.
    pub fn new(regrouping: &Mat, values: &[f64], std: &[f64]) -> Option<BasePrior> {
        let (base, parameters) = (regrouping.nrows(), regrouping.ncols());
        assert!(
            values.len() == parameters && std.len() == parameters,
            "one value and deviation per parameter"
        );
        let row = |i: usize| regrouping.row(i);
        let covariance = Mat::from_fn(base, base, |i, j| {
            row(i).zip(row(j)).zip(std).map(|((a, b), s)| a * b * s * s).sum::<f64>()
        });
        let unit: Vec<f64> = (0..base).map(|i| 1.0 / covariance[(i, i)].sqrt()).collect();
        let scaled = Mat::from_fn(base, base, |i, j| unit[i] * unit[j] * covariance[(i, j)]);
        let inverse = scaled.cholesky()?.solve(&Mat::identity(base, base));
        Some(BasePrior {
            values: (0..base).map(|i| row(i).zip(values).map(|(k, x)| k * x).sum()).collect(),
            precision: Mat::from_fn(base, base, |i, j| unit[i] * unit[j] * inverse[(i, j)]),
        })
    }
}
