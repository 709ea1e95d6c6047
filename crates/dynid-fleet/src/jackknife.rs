//! How parameters of the type move when one robot is left out.

use dynid_linalg::triangular::solve_upper;
use dynid_linalg::{AsView, Mat};
use rayon::prelude::*;

use crate::sweep::Sweep;
use crate::triangle::triangle;

/// Covariance of the type's parameters, robot by robot.
#[derive(Debug)]
pub(crate) struct Jackknife {
    /// `(R - 1)/R Σ d dᵀ` of what every robot moves.
    pub(crate) covariance: Mat,
    /// Per robot with logs, by key: how the parameters move without it.
    pub(crate) moves: Vec<Vec<f64>>,
}

/// Leaves out one robot after the other, the variances as they are; `None` where the others do not tell all parameters.
///
/// What is left is merged from the robots before and behind, as the difference of two informations loses digits where one robot tells
/// most.
pub(crate) fn over_robots(sweep: &Sweep<'_>, prior: Option<&Mat>) -> Option<Jackknife> {
    let parts: Vec<&Mat> = sweep.factors.iter().map(|(_, factor)| factor).collect();
    let (count, p) = (parts.len(), sweep.theta.len());
    let merged = |before: &Mat, next: &Mat| triangle(&[before.view(), next.view()]);
    let first = || prior.map_or_else(|| Mat::zeros(0, p + 1), Clone::clone);
    let mut before = vec![first()];
    for part in &parts[..count - 1] {
        before.push(merged(&before[before.len() - 1], part));
    }
    let mut behind = vec![Mat::zeros(0, p + 1)];
    for part in parts[1..].iter().rev() {
        behind.push(merged(part, &behind[behind.len() - 1]));
    }
    behind.reverse();
    let left = |r: usize| {
        let factor = merged(&before[r], &behind[r]);
        if factor.nrows() < p || (0..p).any(|i| factor[(i, i)] <= 1e-10 * factor.col_norm(i)) {
            return None;
        }
        let (r, z) = (Mat::from_fn(p, p, |i, j| factor[(i, j)]), Mat::from_fn(p, 1, |i, _| factor[(i, p)]));
        let x = solve_upper(&r, &z);
        Some((0..p).map(|i| x[(i, 0)] - sweep.theta[i]).collect::<Vec<f64>>())
    };
    let moves: Vec<Vec<f64>> = (0..count).into_par_iter().map(left).collect::<Option<_>>()?;
    let share = (count as f64 - 1.0) / count as f64;
    let covariance = Mat::from_fn(p, p, |i, j| share * moves.iter().map(|d| d[i] * d[j]).sum::<f64>());
    Some(Jackknife { covariance, moves })
}
