//! The problem linearised in all parameters: regressor `J_f = [Φ, D_1 c, D_2 c, ..]`, target `y - known columns`.
//!
//! The least-squares solution is `(c + Δc, Δα)`, so at a minimum the last entries vanish and everything that works on
//! rows and factors (variances, jackknife, sandwich, HAC, robust losses) gives the figures of `(c, α)` together.

use super::problem::{RowGroup, SeparableProblem, ShapedColumns};
use super::reduction::{Target, remainder};
use crate::linear::LinearError;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{GroupShape, MemoryRows, Rows, reduce_rows};
use rayon::prelude::*;

/// Rows and factors of the linearised problem.
pub(super) struct Linearisation<'a> {
    problem: &'a dyn SeparableProblem,
    /// Factors of the groups that no shape parameter changes.
    constant: Vec<Option<ReducedGroup>>,
}

impl<'a> Linearisation<'a> {
    pub(super) fn new(problem: &'a dyn SeparableProblem) -> Result<Self, LinearError> {
        let one = |group: &RowGroup| {
            group.shaped.is_empty().then(|| reduced(rows_of(group, None, &[], &[]), group)).transpose()
        };
        let constant = problem.groups().par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
        Ok(Linearisation { problem, constant })
    }

    fn columns(&self, shape: &[f64]) -> Vec<ShapedColumns> {
        let mut columns: Vec<ShapedColumns> = self.problem.groups().iter().map(ShapedColumns::new).collect();
        self.problem.shaped(shape, &mut columns);
        columns
    }

    /// Factors of all groups and time blocks; column `linear + i` is that of the shape parameter `active[i]`.
    pub(super) fn reduced(
        &self,
        linear: &[f64],
        shape: &[f64],
        active: &[usize],
    ) -> Result<Vec<ReducedGroup>, LinearError> {
        let columns = self.columns(shape);
        let groups = self.problem.groups();
        (0..groups.len())
            .into_par_iter()
            .map(|g| match &self.constant[g] {
                Some(done) => Ok(done.clone()),
                None => reduced(rows_of(&groups[g], Some(&columns[g]), linear, active), &groups[g]),
            })
            .collect()
    }

    /// The rows themselves, for losses that look at single residuals.
    pub(super) fn rows(&self, linear: &[f64], shape: &[f64], active: &[usize]) -> MemoryRows {
        let columns = self.columns(shape);
        let mut all = MemoryRows::new();
        for (group, columns) in self.problem.groups().iter().zip(&columns) {
            let rows = rows_of(group, Some(columns), linear, active);
            put(&rows, group, &mut all);
        }
        all
    }

    /// Residuals `y - Φ(α) c` of every group.
    pub(super) fn residuals(&self, linear: &[f64], shape: &[f64]) -> Vec<Vec<f64>> {
        let columns = self.columns(shape);
        let groups = self.problem.groups().iter().zip(&columns);
        groups.map(|(group, columns)| remainder(group, columns, Target::Residual(linear))).collect()
    }
}

/// All rows of one group, columns ascending.
struct LinearisedRows {
    columns: Vec<usize>,
    values: Vec<f64>,
    target: Vec<f64>,
}

fn rows_of(
    group: &RowGroup,
    shaped: Option<&ShapedColumns>,
    linear: &[f64],
    active: &[usize],
) -> LinearisedRows {
    let rows = group.rows();
    let place = |s: usize| active.iter().position(|a| *a == s).map(|i| linear.len() + i);
    let derivatives = group.dependence.iter().enumerate().filter_map(|(d, (k, s))| Some((d, *k, place(*s)?)));
    let derivatives: Vec<(usize, usize, usize)> = derivatives.collect();
    let mut columns: Vec<usize> = group.fixed.iter().chain(group.shaped.iter().flatten()).copied().collect();
    columns.extend(derivatives.iter().map(|d| d.2));
    columns.sort_unstable();
    columns.dedup();
    let mut values = vec![0.0; rows * columns.len()];
    let mut add = |column: usize, factor: f64, from: &[f64]| {
        let at = columns.partition_point(|c| *c < column);
        dynid_linalg::vector::add_scaled(&mut values[at * rows..][..rows], factor, from);
    };
    for (k, &column) in group.fixed.iter().enumerate() {
        add(column, 1.0, group.fixed_column(k));
    }
    let mut target = group.effort.clone();
    if let Some(shaped) = shaped {
        for (k, column) in group.shaped.iter().enumerate() {
            if let Some(column) = column {
                add(*column, 1.0, shaped.value(k));
            }
        }
        for (d, k, column) in derivatives {
            add(column, group.shaped[k].map_or(1.0, |c| linear[c]), shaped.derivative(d));
        }
        target = remainder(group, shaped, Target::Effort);
    }
    LinearisedRows { columns, values, target }
}

fn reduced(rows: LinearisedRows, group: &RowGroup) -> Result<ReducedGroup, LinearError> {
    let mut memory = MemoryRows::new();
    put(&rows, group, &mut memory);
    let reduced = reduce_rows(&memory)?.pop();
    reduced.ok_or(LinearError::NoGroups)
}

fn put(rows: &LinearisedRows, group: &RowGroup, to: &mut MemoryRows) {
    let index = to.add_group(GroupShape {
        log: group.log,
        output: group.output,
        scale: group.scale,
        columns: rows.columns.clone(),
        blocks: group.block_rows.len(),
    });
    let samples: Vec<usize> = (0..group.rows()).collect();
    let mut start = 0;
    for (block, &count) in group.block_rows.iter().enumerate() {
        if count > 0 {
            to.push(
                index,
                &Rows {
                    block,
                    samples: &samples[start..start + count],
                    regressor: rows.values.get(start..).unwrap_or(&[]),
                    stride: group.rows(),
                    effort: &rows.target[start..start + count],
                },
            );
        }
        start += count;
    }
}
