//! Several weighted problems whose parameters are shared in part.

use dynid_estimate::separable::{EffortProblem, RowGroup, SeparableProblem, ShapedColumns};
use dynid_model::ShapeParameter;

/// One effort problem with row weights; its parameters are those of the whole at the listed places.
pub(super) struct Part<'a> {
    pub(super) problem: EffortProblem<'a>,
    /// Per row.
    pub(super) weights: Vec<f64>,
    /// Rows of a block of time.
    pub(super) block: usize,
    /// Place of every linear parameter.
    pub(super) linear: Vec<usize>,
    /// Place of every shape parameter.
    pub(super) shape: Vec<usize>,
}

/// Parts side by side, one group of rows each.
pub(super) struct Shared<'a> {
    parts: Vec<Part<'a>>,
    linear: usize,
    parameters: Vec<ShapeParameter>,
    groups: Vec<RowGroup>,
}

impl<'a> Shared<'a> {
    /// `linear`, `parameters`: of the whole.
    pub(super) fn new(parts: Vec<Part<'a>>, linear: usize, parameters: Vec<ShapeParameter>) -> Self {
        let groups = parts.iter().map(weighted).collect();
        Shared { parts, linear, parameters, groups }
    }
}

fn weighted(part: &Part<'_>) -> RowGroup {
    let mut group = part.problem.groups()[0].clone();
    let rows = group.rows();
    let block = part.block.max(1);
    group.block_rows = (0..rows).step_by(block).map(|start| block.min(rows - start)).collect();
    for column in group.fixed_values.chunks_exact_mut(rows.max(1)) {
        scale(column, &part.weights);
    }
    scale(&mut group.effort, &part.weights);
    for index in group.fixed.iter_mut().chain(group.shaped.iter_mut().flatten()) {
        *index = part.linear[*index];
    }
    for (_, shape) in &mut group.dependence {
        *shape = part.shape[*shape];
    }
    group
}

fn scale(column: &mut [f64], weights: &[f64]) {
    column.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
}

impl SeparableProblem for Shared<'_> {
    fn linear(&self) -> usize {
        self.linear
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.parameters
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        for ((part, group), out) in self.parts.iter().zip(&self.groups).zip(out) {
            let own: Vec<f64> = part.shape.iter().map(|k| shape[*k]).collect();
            part.problem.shaped(&own, std::slice::from_mut(out));
            (0..group.shaped.len()).for_each(|k| scale(out.value_mut(k), &part.weights));
            (0..group.dependence.len()).for_each(|d| scale(out.derivative_mut(d), &part.weights));
        }
    }
}
