//! Robust losses by iteratively re-weighted least squares.

use super::method::{IrlsSettings, LinearError};
use crate::least_squares::{LinearSolution, ols};
use dynid_factor::factor::{Factor, FactorError};
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::rows::{BlockReducer, RowSource, RowVisitor, Rows, visit_all};

/// `1/Φ⁻¹(3/4)`: the median absolute deviation of a normal law times this is its standard deviation.
const MAD_TO_SIGMA: f64 = 1.4826;

/// Least curvature kept, so that a group of rejected rows does not divide by zero.
const LEAST_CURVATURE: f64 = 0.05;

/// A robust loss of scaled residuals `u = r/ŝ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Loss {
    Huber(f64),
    Tukey(f64),
}

impl Loss {
    /// Weight `ω(u) = ψ(u)/u`.
    pub(super) fn weight(self, u: f64) -> f64 {
        match self {
            Loss::Huber(c) => (c / u.abs()).min(1.0),
            Loss::Tukey(c) => (1.0 - (u / c).powi(2)).max(0.0).powi(2),
        }
    }

    /// Slope `ψ'(u)`.
    fn slope(self, u: f64) -> f64 {
        match self {
            Loss::Huber(c) => f64::from(u8::from(u.abs() <= c)),
            Loss::Tukey(c) => {
                let v = (u / c).powi(2);
                if v < 1.0 { (1.0 - v) * (1.0 - 5.0 * v) } else { 0.0 }
            }
        }
    }

    fn value(self, u: f64) -> f64 {
        match self {
            Loss::Huber(c) if u.abs() <= c => 0.5 * u * u,
            Loss::Huber(c) => c * (u.abs() - 0.5 * c),
            Loss::Tukey(c) => c * c / 6.0 * (1.0 - (1.0 - (u / c).powi(2)).max(0.0).powi(3)),
        }
    }
}

/// Where the iteration starts and what stays fixed.
pub(super) struct Start<'a> {
    pub(super) x: Vec<f64>,
    /// Columns of the solution; the others stay as they are in `x`.
    pub(super) kept: Vec<usize>,
    /// Per group: index of the group whose scale it shares.
    pub(super) classes: &'a [usize],
    /// Per group: least scale.
    pub(super) floors: Vec<f64>,
    /// Per group: scale to keep where residuals cannot tell it, because the fit takes up most of the rows.
    pub(super) given: Vec<Option<f64>>,
    pub(super) total: usize,
}

/// Outcome of the iteration.
pub(super) struct Irls {
    pub(super) x: Vec<f64>,
    /// Columns of the solution; fewer than at the start if rejected rows alone excited some.
    pub(super) kept: Vec<usize>,
    /// Rows multiplied by `√ω`, in the unit of effort.
    pub(super) groups: Vec<ReducedGroup>,
    /// Scale `ŝ` per group.
    pub(super) scales: Vec<f64>,
    pub(super) tallies: Vec<Tally>,
    pub(super) passes: usize,
    pub(super) converged: bool,
    /// Loss at the start of each pass with frozen scales, the last loss only.
    pub(super) losses: Vec<f64>,
}

/// Sums over the rows of a group.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Tally {
    rows: usize,
    down_weighted: usize,
    rejected: usize,
    weight: f64,
    slope: f64,
    loss: f64,
}

impl Tally {
    fn share(&self, count: usize) -> f64 {
        count as f64 / self.rows.max(1) as f64
    }

    /// Share of rows with less than full weight: `ω < 1` for Huber, `ω < 1/2` for Tukey, whose weights are all below 1.
    pub(super) fn down_weighted(&self) -> f64 {
        self.share(self.down_weighted)
    }

    /// Share of rows without weight.
    pub(super) fn rejected(&self) -> f64 {
        self.share(self.rejected)
    }

    /// `mean ψ'/mean ω`: curvature of the loss against that of the weighted square.
    pub(super) fn curvature(&self) -> f64 {
        if self.weight > 0.0 { (self.slope / self.weight).clamp(LEAST_CURVATURE, 1.0) } else { 1.0 }
    }
}

struct ResidualVisitor {
    x: Vec<f64>,
    run: Vec<f64>,
    residuals: Vec<f64>,
}

impl RowVisitor for ResidualVisitor {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        rows.residuals(&self.x, &mut self.run);
        self.residuals.extend_from_slice(&self.run);
        Ok(())
    }
}

struct WeightingVisitor {
    x: Vec<f64>,
    scale: f64,
    loss: Loss,
    run: Vec<f64>,
    reducer: BlockReducer,
    tally: Tally,
}

impl RowVisitor for WeightingVisitor {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        rows.residuals(&self.x, &mut self.run);
        for value in &mut self.run {
            let u = *value / self.scale;
            let weight = self.loss.weight(u);
            let full = if matches!(self.loss, Loss::Huber(_)) { 1.0 } else { 0.5 };
            self.tally.rows += 1;
            self.tally.down_weighted += usize::from(weight < full);
            self.tally.rejected += usize::from(weight == 0.0);
            self.tally.weight += weight;
            self.tally.slope += self.loss.slope(u);
            self.tally.loss += self.loss.value(u);
            *value = weight.sqrt();
        }
        self.reducer.push(rows, Some(&self.run))
    }
}

/// Minimises `Σ_j Σ_k ρ(r_jk/ŝ_j)`, scales being renewed for the first passes and then frozen.
pub(super) fn irls(
    source: &dyn RowSource,
    loss: Loss,
    start: Start<'_>,
    settings: &IrlsSettings,
) -> Result<Irls, LinearError> {
    let Start { mut x, mut kept, classes, floors, given, total } = start;
    let (mut scales, mut losses) = (Vec::new(), Vec::new());
    let mut passes = 0;
    loop {
        let frozen = passes >= settings.scale_passes.max(1);
        if !frozen {
            scales = robust_scales(&residuals(source, &x)?, classes, &floors, &given);
        }
        let (groups, tallies) = weighted(source, &x, &scales, loss)?;
        if frozen {
            losses.push(tallies.iter().map(|t| t.loss).sum());
        }
        let weights: Vec<f64> = scales.iter().map(|s| 1.0 / s).collect();
        let solution = solve(&groups, &weights, total, &kept);
        let moved = largest_move(&solution, &kept, &x);
        for (&column, value) in kept.iter().zip(&solution.x) {
            x[column] = *value;
        }
        if !solution.dropped.is_empty() {
            kept = solution.kept.iter().map(|&k| kept[k]).collect();
        }
        passes += 1;
        let converged = frozen && moved < settings.tolerance;
        if converged || passes >= settings.max_passes {
            return Ok(Irls { x, kept, groups, scales, tallies, passes, converged, losses });
        }
    }
}

fn solve(groups: &[ReducedGroup], weights: &[f64], total: usize, kept: &[usize]) -> LinearSolution {
    let blocks = time_blocks(groups, weights, total);
    ols(&Factor::merge(&blocks.iter().collect::<Vec<_>>()).select(kept))
}

/// `max |Δx_i|/σ_i` over the columns solved for.
fn largest_move(solution: &LinearSolution, kept: &[usize], x: &[f64]) -> f64 {
    let covariance = solution.unit_covariance();
    let moves = solution.kept.iter().enumerate().map(|(i, &k)| {
        let step = (solution.x[k] - x[kept[k]]).abs();
        if step == 0.0 { 0.0 } else { step / covariance[(i, i)].sqrt() }
    });
    moves.fold(0.0, f64::max)
}

fn local(x: &[f64], columns: &[usize]) -> Vec<f64> {
    columns.iter().map(|&c| x[c]).collect()
}

fn residuals(source: &dyn RowSource, x: &[f64]) -> Result<Vec<Vec<f64>>, LinearError> {
    let mut visitors: Vec<ResidualVisitor> = source
        .groups()
        .iter()
        .map(|g| ResidualVisitor { x: local(x, &g.columns), run: Vec::new(), residuals: Vec::new() })
        .collect();
    visit_all(source, &mut visitors)?;
    Ok(visitors.into_iter().map(|v| v.residuals).collect())
}

fn weighted(
    source: &dyn RowSource,
    x: &[f64],
    scales: &[f64],
    loss: Loss,
) -> Result<(Vec<ReducedGroup>, Vec<Tally>), LinearError> {
    let shapes = source.groups();
    let mut visitors: Vec<WeightingVisitor> = shapes
        .iter()
        .zip(scales)
        .map(|(g, &scale)| WeightingVisitor {
            x: local(x, &g.columns),
            scale,
            loss,
            run: Vec::new(),
            reducer: BlockReducer::new(g.columns.len()),
            tally: Tally::default(),
        })
        .collect();
    visit_all(source, &mut visitors)?;
    Ok(visitors.into_iter().zip(shapes).map(|(v, shape)| (v.reducer.finish(shape), v.tally)).unzip())
}

/// `1.4826 median|r - median r|` over the groups of a class.
pub(crate) fn robust_scales(
    residuals: &[Vec<f64>],
    classes: &[usize],
    floors: &[f64],
    given: &[Option<f64>],
) -> Vec<f64> {
    let mut of_class: Vec<Option<f64>> = vec![None; residuals.len()];
    (0..residuals.len())
        .map(|g| {
            let class = classes[g];
            let spread = *of_class[class].get_or_insert_with(|| {
                let members = residuals.iter().zip(classes).filter(|(_, c)| **c == class);
                let mut values: Vec<f64> = members.flat_map(|(r, _)| r.iter().copied()).collect();
                let centre = median(&mut values);
                values.iter_mut().for_each(|v| *v = (*v - centre).abs());
                MAD_TO_SIGMA * median(&mut values)
            });
            given[g].unwrap_or(spread).max(floors[g])
        })
        .collect()
}

/// Median, reordering the values; zero of none.
fn median(values: &mut [f64]) -> f64 {
    let count = values.len();
    if count == 0 {
        return 0.0;
    }
    let (below, &mut upper, _) = values.select_nth_unstable_by(count / 2, f64::total_cmp);
    if count % 2 == 1 {
        return upper;
    }
    let lower = below.iter().copied().max_by(f64::total_cmp).unwrap_or(upper);
    0.5 * (lower + upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_and_slopes_are_those_of_the_loss() {
        for loss in [Loss::Huber(1.345), Loss::Tukey(4.685)] {
            for u in [-6.0, -2.0, -0.7, 0.3, 1.2, 4.0, 5.0] {
                let h = 1e-5;
                let psi = |u: f64| u * loss.weight(u);
                let first = (loss.value(u + h) - loss.value(u - h)) / (2.0 * h);
                assert!((first - psi(u)).abs() < 1e-8, "{loss:?} at {u}");
                assert!(((psi(u + h) - psi(u - h)) / (2.0 * h) - loss.slope(u)).abs() < 1e-8);
            }
            assert_eq!((loss.weight(0.0), loss.value(0.0)), (1.0, 0.0));
        }
    }

    #[test]
    fn medians_of_even_and_odd_counts() {
        assert_eq!(median(&mut [3.0, -1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
        assert_eq!(median(&mut []), 0.0);
    }
}
