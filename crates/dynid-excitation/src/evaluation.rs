//! Given trajectories judged by a problem's criterion and limits.

use crate::feasibility::{LimitPoint, worst_points};
use crate::grid::{Grid, GridMotion};
use crate::parametrisation::Parametrisation;
use crate::problem::Problem;
use crate::search::Observation;

/// Fisher information `M_f = RᵀR` as its triangle `R`.
pub type Information = dynid_linalg::Mat;

/// Triangle `R` of the weighted observation matrix of a trajectory on `samples` equidistant samples of its period, prior
/// information included, with exact signs of velocities: `M_f = RᵀR`.
///
/// `coefficients`: `[q0, a_1.., b_1..]` of every coordinate, plain amplitudes.
///
/// # Panics
/// If the coefficients do not fit the problem.
pub fn information(problem: &Problem, coefficients: &[Vec<f64>], samples: usize) -> Information {
    with_grid(problem, samples, |grid| {
        let motion = GridMotion::new(problem, coefficients, &grid.basis);
        Observation::new(problem, &motion, 0.0).triangle
    })
}

/// Criterion with smoothed signs, and its gradient with respect to the coefficients; `None` where it is not defined.
///
/// # Panics
/// Panics as [`information`] does.
pub fn criterion_gradient(
    problem: &Problem,
    coefficients: &[Vec<f64>],
    samples: usize,
) -> Option<(f64, Vec<Vec<f64>>)> {
    with_grid(problem, samples, |grid| {
        let motion = GridMotion::new(problem, coefficients, &grid.basis);
        let observation = Observation::new(problem, &motion, problem.sign_width);
        let (value, sensitivity) = problem.criterion.sensitivity(&observation.triangle, None)?;
        let adjoint = observation.adjoint(problem, &motion, problem.sign_width, &sensitivity);
        let gradient = coefficients
            .iter()
            .enumerate()
            .map(|(coordinate, x)| {
                let mut gradient = vec![0.0; x.len()];
                for (derivative, channel) in [&adjoint.q, &adjoint.dq, &adjoint.ddq].into_iter().enumerate() {
                    let weights = &channel[coordinate * samples..][..samples];
                    grid.basis.accumulate(derivative, weights, &mut gradient);
                }
                gradient
            })
            .collect();
        Some((value, gradient))
    })
}

/// Worst instant of every limit on `samples` equidistant samples; those whose normalised excess is above `least`, worst
/// first. `least = 0`: broken limits; `-1e-3`: limits that act.
///
/// # Panics
/// Panics as [`information`] does.
pub fn limit_points(
    problem: &Problem,
    coefficients: &[Vec<f64>],
    samples: usize,
    least: f64,
) -> Vec<LimitPoint> {
    with_grid(problem, samples, |grid| {
        let values = grid.values_of(GridMotion::new(problem, coefficients, &grid.basis));
        worst_points(problem, grid, &values, least)
    })
}

fn with_grid<T>(problem: &Problem, samples: usize, work: impl FnOnce(&Grid<'_>) -> T) -> T {
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    work(&Grid::exact(problem, &map, samples))
}
