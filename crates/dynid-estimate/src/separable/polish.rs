//! The last digits: Gauss-Newton steps on linear and shape parameters together.

use super::dense::{Columns, PivotedQr};
use super::projection::Projection;
use super::reduction::Target;
use super::scale::SearchBox;
use dynid_linalg::vector::norm;

/// Most steps; two are the rule, slow ones belong to large residuals.
const MOST_STEPS: usize = 60;
/// Steps in a row that do not shorten before the end is taken for rounding.
const PATIENCE: usize = 3;

/// `(c, α)` after polishing.
#[derive(Debug, Clone)]
pub(super) struct Polished {
    pub(super) linear: Vec<f64>,
    pub(super) shape: Vec<f64>,
    /// Weighted rss.
    pub(super) rss: f64,
}

/// Full steps `min ‖r - Φ Δc - D c Δα‖` while they shorten; residuals are formed from the rows each time, so that nothing
/// cancels. Parameters in `held` and those at a bound stay; a step that would leave the bounds ends the polishing.
pub(super) fn polish(
    projection: &Projection<'_>,
    bounds: &SearchBox,
    linear: Vec<f64>,
    shape: Vec<f64>,
    held: &[bool],
) -> Option<Polished> {
    let free: Vec<usize> = (0..shape.len())
        .filter(|k| {
            let u = bounds.searched(*k, shape[*k]);
            !held[*k] && !bounds.at_lower(*k, u) && !bounds.at_upper(*k, u)
        })
        .collect();
    let mut best = Polished { linear, shape, rss: f64::INFINITY };
    let (mut current, mut shortest, mut waited) = (best.clone(), f64::INFINITY, 0);
    for _ in 0..MOST_STEPS {
        let Some(point) = projection.at(&current.shape, Target::Residual(&current.linear)) else { break };
        let mut jacobian = Columns::zeros(point.residual.len(), free.len());
        for (j, k) in free.iter().enumerate() {
            jacobian.column_mut(j).copy_from_slice(point.jacobian.column(*k));
        }
        let sizes: Vec<f64> = (0..free.len()).map(|j| norm(jacobian.column(j))).collect();
        let qr = PivotedQr::new(jacobian, &sizes, projection.rows());
        let mut target = point.residual.clone();
        qr.rotate(&mut target);
        let step: Vec<f64> = qr.solve(&target).iter().map(|s| -s).collect();
        let mut next = current.clone();
        for (s, k) in step.iter().zip(&free) {
            next.shape[*k] += s;
        }
        for (i, value) in next.linear.iter_mut().enumerate() {
            let coupled: f64 = step.iter().zip(&free).map(|(s, k)| s * point.coupling[*k][i]).sum();
            *value += point.linear[i] + coupled;
        }
        let inside = free.iter().all(|k| bounds.contains(*k, next.shape[*k]));
        let size = relative_step(&current, &next);
        if !inside || !size.is_finite() {
            break;
        }
        current = next;
        waited = if size < 0.9 * shortest { 0 } else { waited + 1 };
        shortest = shortest.min(size);
        if size <= 4.0 * f64::EPSILON || waited >= PATIENCE {
            break;
        }
    }
    for candidate in [current, best.clone()] {
        let point = projection.at(&candidate.shape, Target::Residual(&candidate.linear));
        let rss = point.map_or(f64::INFINITY, |p| p.rss);
        // Rounding decides between the two where both are minimal: the polished one comes first.
        if !best.rss.is_finite() || rss < best.rss * (1.0 - 1e-12) {
            best = Polished { rss, ..candidate };
        }
    }
    best.rss.is_finite().then_some(best)
}

fn relative_step(from: &Polished, to: &Polished) -> f64 {
    let of = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).map(|(a, b)| if a == b { 0.0 } else { (a - b).abs() / b.abs() }).fold(0.0, f64::max)
    };
    of(&from.linear, &to.linear).max(of(&from.shape, &to.shape))
}
