//! Random trajectories within all limits, to compare designs with.

use crate::grid::Grid;
use crate::parametrisation::Parametrisation;
use crate::problem::Problem;
use crate::restoration::Restoration;
use crate::start::{feasible_start, generator};

/// Coefficients `[q0, a.., b..]` per coordinate of a random trajectory that keeps the limits at every instant and meets
/// the start conditions, with amplitudes as large as the limits allow; `None` if none is found.
pub fn random_trajectory(problem: &Problem, seed: u64) -> Option<Vec<Vec<f64>>> {
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    let grid = Grid::search(problem, &map, problem.samples);
    let z = feasible_start(&grid, &mut generator(seed))?;
    let restored = Restoration::new(problem, &map).restore(z);
    (restored.excess <= 0.0).then(|| map.coefficients(&restored.z))
}
