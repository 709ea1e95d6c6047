//! How near a pose is to a singular one.

use dynid_linalg::Mat;

use super::error::NamedMotion;
use super::mechanism::ClosedMechanism;
use super::pose::PoseWorkspace;

/// Nearness to a singular pose.
///
/// Angles count as lengths by the mechanism's length `L_c`, in rows and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Singularity {
    /// `σ_min/σ_max` of the Jacobian of the dependent coordinates: 0 where the independent ones lose control. Efforts
    /// grow with its inverse.
    pub measure: f64,
    /// The motion of dependent coordinates that is nearly free.
    pub motion: NamedMotion,
    /// `σ_r/σ_max` of the whole Jacobian at its usual rank `r`: 0 where the mobility changes.
    pub mobility: f64,
}

impl ClosedMechanism {
    /// Nearness of the pose of a workspace to a singular one.
    pub fn singularity(&self, work: &PoseWorkspace) -> Singularity {
        let dependent = self.scaled(&work.jacobian, &self.dependent);
        let all: Vec<usize> = (0..self.tree.rates).collect();
        let whole = self.scaled(&work.jacobian, &all);
        let (values, vector) = smallest(&dependent);
        let ratio = |values: &[f64], k: usize| match (values.first(), k.checked_sub(1)) {
            (Some(largest), Some(k)) if *largest > 0.0 => values.get(k).map_or(0.0, |v| v / largest),
            _ => 1.0,
        };
        let rates: Vec<f64> =
            vector.iter().zip(&self.dependent).map(|(x, r)| x / self.rate_scale[*r]).collect();
        Singularity {
            measure: ratio(&values, self.dependent.len()),
            motion: self.named_motion(&self.dependent, &rates),
            mobility: ratio(&smallest(&whole).0, self.dependent.len()),
        }
    }

    /// Columns of the Jacobian, in lengths.
    pub(super) fn scaled(&self, jacobian: &[f64], rates: &[usize]) -> Mat {
        let n = self.tree.rates;
        Mat::from_fn(self.rows.len(), rates.len(), |i, j| {
            jacobian[i * n + rates[j]] * self.row_scale[i] / self.rate_scale[rates[j]]
        })
    }
}

/// Singular values, descending, and the right singular vector of the smallest (of a null vector, if there are more
/// columns than rows).
pub(super) fn smallest(matrix: &Mat) -> (Vec<f64>, Vec<f64>) {
    let Some(svd) = matrix.svd() else {
        return (vec![f64::NAN; matrix.ncols().min(matrix.nrows())], vec![f64::NAN; matrix.ncols()]);
    };
    let last = matrix.ncols().checked_sub(1);
    (svd.values, last.map_or_else(Vec::new, |k| svd.v.col(k).to_vec()))
}
