//! The projected residual `r(α) = (1 - QQᵀ) y` and its Kaufman Jacobian.

use super::dense::{Columns, PARALLEL_VALUES, PivotedQr};
use super::problem::{SeparableProblem, ShapedColumns};
use super::reduction::{GroupReduction, Rotated, Target};
use dynid_linalg::vector::{add_scaled, dot, norm};
use rayon::prelude::*;

/// The problem at one vector of shape parameters.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// Linear parameters, or their corrections for [`Target::Residual`]; dependent ones are zero.
    pub(super) linear: Vec<f64>,
    /// Weighted residual, rotated.
    pub(super) residual: Vec<f64>,
    /// Derivatives of the residual, one column per shape parameter, in its own unit.
    pub(super) jacobian: Columns,
    /// Weighted residual sum of squares.
    pub(super) rss: f64,
    /// Linear parameters that others make up or no row sees, ascending.
    pub(super) dependent: Vec<usize>,
    /// Per shape parameter: correction of the linear parameters per unit of the shape parameter, `-R⁻¹Qᵀ D_k c`.
    pub(super) coupling: Vec<Vec<f64>>,
}

/// A problem whose groups are weighted and whose fixed columns are reduced across groups.
pub(super) struct Projection<'a> {
    problem: &'a dyn SeparableProblem,
    groups: &'a [GroupReduction],
    weights: Vec<f64>,
    /// First head row of each group.
    first_head: Vec<usize>,
    heads: usize,
    /// QR of all heads in the columns that are fixed everywhere.
    fixed: PivotedQr,
    fixed_columns: Vec<usize>,
    /// Linear parameters with a shaped column somewhere.
    changing: Vec<usize>,
    /// Distinct `(linear parameter or known, shape parameter)` that derivatives belong to.
    pairs: Vec<(Option<usize>, usize)>,
    rows: usize,
    constant_rss: f64,
}

impl<'a> Projection<'a> {
    /// `weights`: `1/σ` per group.
    pub(super) fn new(
        problem: &'a dyn SeparableProblem,
        groups: &'a [GroupReduction],
        weights: Vec<f64>,
    ) -> Self {
        let shapes = problem.groups();
        let mut changing: Vec<usize> =
            shapes.iter().flat_map(|g| g.shaped.iter().flatten().copied()).collect();
        changing.sort_unstable();
        changing.dedup();
        let fixed_columns: Vec<usize> =
            (0..problem.linear()).filter(|c| changing.binary_search(c).is_err()).collect();
        let mut pairs: Vec<(Option<usize>, usize)> =
            shapes.iter().flat_map(|g| g.dependence.iter().map(|(k, s)| (g.shaped[*k], *s))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut heads = 0;
        let first_head = groups
            .iter()
            .map(|g| {
                heads += g.head.rows();
                heads - g.head.rows()
            })
            .collect();
        let mut projection = Projection {
            problem,
            groups,
            constant_rss: groups.iter().zip(&weights).map(|(g, w)| w * w * g.constant_rss()).sum(),
            weights,
            first_head,
            heads,
            fixed: PivotedQr::new(Columns::zeros(0, 0), &[], 0),
            fixed_columns,
            changing,
            pairs,
            rows: shapes.iter().map(super::RowGroup::rows).sum(),
        };
        let mut stack = Columns::zeros(heads, projection.fixed_columns.len());
        projection.put_fixed(&projection.fixed_columns, &mut stack);
        let sizes: Vec<f64> = (0..projection.fixed_columns.len()).map(|j| norm(stack.column(j))).collect();
        projection.fixed = PivotedQr::new(stack, &sizes, projection.rows);
        projection
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Weighted fixed columns of some linear parameters into the head rows of a stack.
    fn put_fixed(&self, parameters: &[usize], stack: &mut Columns) {
        for (g, shape) in self.problem.groups().iter().enumerate() {
            for (k, column) in shape.fixed.iter().enumerate() {
                if let Ok(j) = parameters.binary_search(column) {
                    let to = &mut stack.column_mut(j)[self.first_head[g]..];
                    add_scaled(to, self.weights[g], self.groups[g].head.column(k));
                }
            }
        }
    }

    fn rotated(&self, columns: &[ShapedColumns], target: Target<'_>) -> Vec<Option<Rotated>> {
        let shapes = self.problem.groups();
        let one = |g: usize| self.groups[g].rotated(&shapes[g], &columns[g], target);
        if shapes.iter().any(|s| s.rows() * s.fixed.len() > PARALLEL_VALUES) {
            (0..shapes.len()).into_par_iter().map(one).collect()
        } else {
            (0..shapes.len()).map(one).collect()
        }
    }

    /// All changing columns, derivatives and the target of the whole problem in one stack: heads above, below them what
    /// the fixed columns of each group cannot reach.
    fn stacked(&self, rotated: &[Option<Rotated>], target: Target<'_>) -> Columns {
        let below: usize = rotated.iter().flatten().map(|r| r.below.rows()).sum();
        let (c, d) = (self.changing.len(), self.pairs.len());
        let mut stack = Columns::zeros(self.heads + below, c + d + 1);
        self.put_fixed(&self.changing, &mut stack);
        let mut first_below = self.heads;
        for (g, shape) in self.problem.groups().iter().enumerate() {
            let (first, weight) = (self.first_head[g], self.weights[g]);
            let Some(rotated) = &rotated[g] else {
                if let Some(z) = self.groups[g].constant_target(shape, target) {
                    add_scaled(&mut stack.column_mut(c + d)[first..], weight, &z);
                }
                continue;
            };
            let shaped = shape.shaped.iter().map(|p| p.and_then(|p| self.changing.binary_search(&p).ok()));
            let dependent =
                shape.dependence.iter().map(|(k, s)| self.pairs.binary_search(&(shape.shaped[*k], *s)).ok());
            let places = shaped.chain(dependent.map(|p| p.map(|p| c + p))).chain([Some(c + d)]);
            for (k, place) in places.enumerate() {
                let Some(place) = place else { continue };
                let to = stack.column_mut(place);
                add_scaled(&mut to[first..], weight, rotated.head.column(k));
                add_scaled(&mut to[first_below..], weight, rotated.below.column(k));
            }
            first_below += rotated.below.rows();
        }
        stack
    }

    /// Solves for the linear parameters at given shape parameters; `None` if a column is not finite.
    pub(super) fn at(&self, shape: &[f64], target: Target<'_>) -> Option<Point> {
        let mut columns: Vec<ShapedColumns> = self.problem.groups().iter().map(ShapedColumns::new).collect();
        self.problem.shaped(shape, &mut columns);
        columns.iter().all(ShapedColumns::is_finite).then(|| self.solve(shape.len(), &columns, target))
    }

    fn solve(&self, shapes: usize, columns: &[ShapedColumns], target: Target<'_>) -> Point {
        let (c, d) = (self.changing.len(), self.pairs.len());
        let mut stack = self.stacked(&self.rotated(columns, target), target);
        let sizes: Vec<f64> = (0..c).map(|j| norm(stack.column(j))).collect();
        let fixed_rank = self.fixed.rank();
        stack.columns_from(0).for_each(|column| self.fixed.rotate(&mut column[..self.heads]));
        let mut outside = Columns::zeros(stack.rows() - fixed_rank, c);
        (0..c).for_each(|j| outside.column_mut(j).copy_from_slice(&stack.column(j)[fixed_rank..]));
        let free = PivotedQr::new(outside, &sizes, self.rows);
        stack.columns_from(c).for_each(|column| free.rotate(&mut column[fixed_rank..]));
        let inside = fixed_rank + free.rank();

        let known: Vec<f64> = match target {
            Target::Effort => self.scatter(&self.back_substituted(&free, &stack, stack.column(c + d))),
            Target::Residual(linear) => linear.to_vec(),
        };
        let residual = stack.column(c + d)[inside..].to_vec();
        let mut jacobian = Columns::zeros(residual.len(), shapes);
        let mut inner = Columns::zeros(inside, shapes);
        for (p, (parameter, s)) in self.pairs.iter().enumerate() {
            let factor = parameter.map_or(1.0, |c| known[c]);
            let (above, below) = stack.column(c + p).split_at(inside);
            add_scaled(jacobian.column_mut(*s), -factor, below);
            add_scaled(inner.column_mut(*s), -factor, above);
        }
        let coupling = (0..shapes)
            .map(|s| self.scatter(&self.back_substituted(&free, &stack, inner.column(s))))
            .collect();
        let linear = match target {
            Target::Effort => known,
            Target::Residual(_) => self.scatter(&self.back_substituted(&free, &stack, stack.column(c + d))),
        };
        let rss = dot(&residual, &residual) + self.constant_rss;
        let mut dependent: Vec<usize> =
            self.fixed.dependent().iter().map(|k| self.fixed_columns[*k]).collect();
        dependent.extend(free.dependent().iter().map(|k| self.changing[*k]));
        dependent.sort_unstable();
        Point { linear, residual, jacobian, rss, dependent, coupling }
    }

    /// Changing, then fixed columns' solution of the rotated right-hand side.
    fn back_substituted(&self, free: &PivotedQr, stack: &Columns, rotated: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let fixed_rank = self.fixed.rank();
        let changing = free.solve(&rotated[fixed_rank..]);
        let mut top = rotated[..fixed_rank].to_vec();
        for (j, value) in changing.iter().enumerate() {
            add_scaled(&mut top, -value, stack.column(j));
        }
        (changing, self.fixed.solve(&top))
    }

    fn scatter(&self, (changing, fixed): &(Vec<f64>, Vec<f64>)) -> Vec<f64> {
        let mut linear = vec![0.0; self.problem.linear()];
        self.changing.iter().zip(changing).for_each(|(c, v)| linear[*c] = *v);
        self.fixed_columns.iter().zip(fixed).for_each(|(c, v)| linear[*c] = *v);
        linear
    }
}
