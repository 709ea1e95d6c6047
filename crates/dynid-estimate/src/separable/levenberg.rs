//! Levenberg-Marquardt with bounds on the projected residual.

use super::boxed::BoxedStep;
use super::dense::{Columns, PivotedQr};
use super::projection::{Point, Projection};
use super::reduction::Target;
use super::scale::SearchBox;
use dynid_linalg::vector::{add_scaled, dot, norm};

/// First damping, in units of the squared column norms.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping at which no step is left.
const MOST_DAMPING: f64 = 1e20;

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchStatus {
    /// The last step was below the tolerance.
    SmallStep,
    /// The projected gradient was below the tolerance, or no parameter is free.
    SmallGradient,
    /// No step lowers the loss any further: rounding.
    NoProgress,
    /// The iteration limit.
    IterationLimit,
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stops {
    pub(super) iterations: usize,
    pub(super) step: f64,
    pub(super) gradient: f64,
    /// Predicted fall of the rss that is not worth a step.
    pub(super) fall: f64,
    /// Predicted fall, as a share of the rss, that is not worth a step.
    pub(super) relative_fall: f64,
}

/// End of a search.
#[derive(Debug, Clone)]
pub(super) struct Search {
    pub(super) u: Vec<f64>,
    pub(super) point: Point,
    pub(super) iterations: usize,
    pub(super) status: SearchStatus,
}

/// Minimises the projected rss from `start`; `held` parameters stay. `None` if the model is not finite at the start.
pub(super) fn search(
    projection: &Projection<'_>,
    bounds: &SearchBox,
    start: &[f64],
    held: &[bool],
    stops: Stops,
) -> Option<Search> {
    let mut u = bounds.clipped(start);
    let mut natural = bounds.natural(&u);
    let mut point = projection.at(&natural, Target::Effort)?;
    let mut scale = vec![0.0_f64; u.len()];
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    let mut iterations = 0;
    let status = loop {
        let model = Model::new(&point, bounds, &natural, &u, held);
        if model.is_stationary(stops.gradient) {
            break SearchStatus::SmallGradient;
        }
        if iterations >= stops.iterations {
            break SearchStatus::IterationLimit;
        }
        scale.iter_mut().zip(&model.norms).for_each(|(s, n)| *s = s.max(*n));
        let Some(trial) = model.trial(damping, &scale, bounds, &u) else {
            break SearchStatus::NoProgress;
        };
        iterations += 1;
        let next = bounds.natural(&trial);
        let small = next.iter().zip(&natural).all(|(n, o)| (n - o).abs() <= stops.step * o.abs());
        let predicted = model.fall(&u, &trial);
        if small {
            break SearchStatus::SmallStep;
        }
        if damping <= 1.0 && predicted < stops.fall.max(stops.relative_fall * point.rss) {
            break SearchStatus::SmallGradient;
        }
        let found = projection.at(&next, Target::Effort).filter(|p| p.rss.is_finite());
        match found {
            Some(better) if better.rss < point.rss => {
                let gain = (point.rss - better.rss) / predicted.max(f64::MIN_POSITIVE);
                damping *= (1.0 - (2.0 * gain.min(1.0) - 1.0).powi(3)).max(1.0 / 3.0);
                growth = 2.0;
                (u, natural, point) = (trial, next, better);
            }
            _ => {
                damping *= growth;
                growth *= 2.0;
                if damping > MOST_DAMPING {
                    break SearchStatus::NoProgress;
                }
            }
        }
    };
    Some(Search { u, point, iterations, status })
}

/// The linear model about a point in searched coordinates.
struct Model {
    /// One column per searched parameter.
    jacobian: Columns,
    residual: Vec<f64>,
    /// `Jᵀ r`.
    gradient: Vec<f64>,
    norms: Vec<f64>,
    /// Parameters that may move: not held, not at a bound that the descent would leave.
    free: Vec<usize>,
    /// Parameters that are not held.
    movable: Vec<usize>,
}

impl Model {
    fn new(point: &Point, bounds: &SearchBox, natural: &[f64], u: &[f64], held: &[bool]) -> Self {
        let mut jacobian = point.jacobian.clone();
        for (k, value) in natural.iter().enumerate() {
            let slope = bounds.slope(k, *value);
            jacobian.column_mut(k).iter_mut().for_each(|v| *v *= slope);
        }
        let gradient: Vec<f64> = (0..u.len()).map(|k| dot(jacobian.column(k), &point.residual)).collect();
        let norms: Vec<f64> = (0..u.len()).map(|k| norm(jacobian.column(k))).collect();
        let leaves = |k: usize| {
            (bounds.at_lower(k, u[k]) && gradient[k] > 0.0) || (bounds.at_upper(k, u[k]) && gradient[k] < 0.0)
        };
        let free = (0..u.len()).filter(|k| !held[*k] && !leaves(*k)).collect();
        let movable = (0..u.len()).filter(|k| !held[*k]).collect();
        Model { jacobian, residual: point.residual.clone(), gradient, norms, free, movable }
    }

    fn is_stationary(&self, tolerance: f64) -> bool {
        let size = norm(&self.residual);
        self.free.iter().all(|k| self.gradient[*k].abs() <= tolerance * self.norms[*k] * size)
    }

    /// The point of a damped step: that of the free parameters where it stays within the bounds, else the minimum of the
    /// same model within them.
    fn trial(&self, damping: f64, scale: &[f64], bounds: &SearchBox, u: &[f64]) -> Option<Vec<f64>> {
        let step = self.step(damping, scale)?;
        let next: Vec<f64> = u.iter().zip(&step).map(|(u, s)| u + s).collect();
        if bounds.clipped(&next) == next {
            return Some(next);
        }
        let moving: Vec<usize> = self.movable.iter().copied().filter(|k| self.norms[*k] > 0.0).collect();
        let mut jacobian = Columns::zeros(self.jacobian.rows(), moving.len() + 1);
        for (j, &k) in moving.iter().enumerate() {
            jacobian.column_mut(j).copy_from_slice(self.jacobian.column(k));
        }
        jacobian.column_mut(moving.len()).copy_from_slice(&self.residual);
        let of = |value: &dyn Fn(usize) -> f64| moving.iter().map(|k| value(*k)).collect::<Vec<f64>>();
        let (lower, upper) = (of(&|k| bounds.lower[k] - u[k]), of(&|k| bounds.upper[k] - u[k]));
        let damping = of(&|k| damping.sqrt() * scale[k]);
        let step = BoxedStep::new(jacobian, damping, lower.clone(), upper.clone()).solve();
        let mut next = u.to_vec();
        for (j, &k) in moving.iter().enumerate() {
            next[k] = match step[j] {
                s if s <= lower[j] => bounds.lower[k],
                s if s >= upper[j] => bounds.upper[k],
                s => u[k] + s,
            };
        }
        step.iter().all(|s| s.is_finite()).then(|| bounds.clipped(&next))
    }

    /// `min ‖r + J δ‖² + λ ‖D δ‖²` over the free parameters.
    fn step(&self, damping: f64, scale: &[f64]) -> Option<Vec<f64>> {
        let moving: Vec<usize> = self.free.iter().copied().filter(|k| self.norms[*k] > 0.0).collect();
        if moving.is_empty() {
            return None;
        }
        let n = moving.len();
        let rows = self.jacobian.rows();
        let mut stack = Columns::zeros(rows + n, n);
        for (j, &k) in moving.iter().enumerate() {
            let column = stack.column_mut(j);
            column[..rows].copy_from_slice(self.jacobian.column(k));
            column[rows + j] = damping.sqrt() * scale[k];
        }
        let sizes: Vec<f64> = (0..n).map(|j| norm(stack.column(j))).collect();
        let qr = PivotedQr::new(stack, &sizes, n);
        let mut target = self.residual.clone();
        target.resize(rows + n, 0.0);
        qr.rotate(&mut target);
        let step = qr.solve(&target);
        let mut all = vec![0.0; self.norms.len()];
        moving.iter().zip(step).for_each(|(k, s)| all[*k] = -s);
        all.iter().all(|s| s.is_finite()).then_some(all)
    }

    /// `‖r‖² - ‖r + J δ‖²` for the step taken, bounds included.
    fn fall(&self, u: &[f64], trial: &[f64]) -> f64 {
        let mut change = vec![0.0; self.residual.len()];
        for k in 0..u.len() {
            add_scaled(&mut change, trial[k] - u[k], self.jacobian.column(k));
        }
        -2.0 * dot(&change, &self.residual) - dot(&change, &change)
    }
}
