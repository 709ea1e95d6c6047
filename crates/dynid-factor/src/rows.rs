//! Rows of the regression, streamed again as often as an estimator asks.
//!
//! Squared losses need factors only. What looks at single residuals (robust losses, row scores) takes rows from a
//! [`RowSource`]: in memory ([`MemoryRows`]) or formed anew from the logs on every pass.

mod memory;
mod residuals;

pub use memory::MemoryRows;
pub use residuals::{GroupResiduals, row_residuals};

use crate::factor::{Factor, FactorBuilder, FactorError};
use crate::groups::ReducedGroup;

/// Rows stacked before a triangle is renewed, for groups of one time block.
const CHUNK_ROWS: usize = 256;

/// What a group of rows is, before its rows are seen.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupShape {
    /// Index of the log.
    pub log: usize,
    /// Index of the output.
    pub output: usize,
    /// Index of the kernel scale, 0 = widest.
    pub scale: usize,
    /// Base columns that the regressor's columns stand for.
    pub columns: Vec<usize>,
    /// Number of time blocks of the log.
    pub blocks: usize,
}

/// A run of rows of one group inside one time block.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// Time block, never below that of the run before.
    pub block: usize,
    /// Sample of the log at which each row is centred, ascending within a group.
    pub samples: &'a [usize],
    /// Column-major: `regressor[c * stride + i]` is column `c` of row `i`.
    pub regressor: &'a [f64],
    /// Distance between the starts of two columns, at least the number of rows.
    pub stride: usize,
    /// Effort of each row.
    pub effort: &'a [f64],
}

impl Rows<'_> {
    /// Residuals `y - W x` into `out`. `x`: one entry per column of the group.
    pub fn residuals(&self, x: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend_from_slice(self.effort);
        for (c, value) in x.iter().enumerate() {
            let column = &self.regressor[c * self.stride..][..self.effort.len()];
            for (r, w) in out.iter_mut().zip(column) {
                *r -= w * value;
            }
        }
    }
}

/// Takes the rows of one group.
pub trait RowVisitor: Send {
    /// Takes the next run of rows; how rows are portioned into runs must not matter.
    ///
    /// # Errors
    /// [`FactorError`] for rows that cannot be used.
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError>;
}

/// A row that could not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("group {group}: {source}")]
pub struct RowsError {
    /// Index of the group.
    pub group: usize,
    /// What was found.
    pub source: FactorError,
}

/// Rows of all groups, in time order within each group, the same on every pass.
pub trait RowSource: Sync {
    /// One entry per group.
    fn groups(&self) -> &[GroupShape];

    /// Runs through all rows once and hands those of group `g` to `visitors[g]`; groups may be worked on in parallel.
    ///
    /// # Errors
    /// [`RowsError`] of the first visitor that refuses.
    ///
    /// # Panics
    /// Unless there is one visitor per group.
    fn visit(&self, visitors: &mut [&mut dyn RowVisitor]) -> Result<(), RowsError>;
}

/// Runs one visitor per group through a source.
pub fn visit_all<V: RowVisitor>(source: &dyn RowSource, visitors: &mut [V]) -> Result<(), RowsError> {
    let mut all: Vec<&mut dyn RowVisitor> = visitors.iter_mut().map(|v| v as &mut dyn RowVisitor).collect();
    source.visit(&mut all)
}

/// Reduces the rows of one group to one factor per time block, weighted or not.
pub struct BlockReducer {
    builder: FactorBuilder,
    done: Vec<Factor>,
}

impl BlockReducer {
    /// Reducer of rows with so many columns.
    pub fn new(columns: usize) -> Self {
        BlockReducer { builder: FactorBuilder::with_chunk_rows(columns, CHUNK_ROWS), done: Vec::new() }
    }

    /// Appends rows, each multiplied by its root weight.
    pub fn push(&mut self, rows: &Rows<'_>, root_weights: Option<&[f64]>) -> Result<(), FactorError> {
        self.finish_until(rows.block);
        let columns = self.builder.columns();
        self.builder.push_with(rows.effort.len(), |column, range, out| {
            let source = if column < columns { &rows.regressor[column * rows.stride..] } else { rows.effort };
            out.copy_from_slice(&source[range.clone()]);
            if let Some(weights) = root_weights {
                for (v, w) in out.iter_mut().zip(&weights[range]) {
                    *v *= w;
                }
            }
        })
    }

    fn finish_until(&mut self, block: usize) {
        while self.done.len() < block {
            self.done.push(self.builder.take());
        }
    }

    /// Merges time blocks in pairs, the one at hand too: block `b` is `b / 2` from here on.
    pub fn pair(&mut self) {
        if !self.done.len().is_multiple_of(2)
            && let Some(last) = self.done.pop()
        {
            self.builder.push_factor(&last);
        }
        self.done = self.done.chunks(2).map(|pair| Factor::merge(&pair.iter().collect::<Vec<_>>())).collect();
    }

    /// Factors of all time blocks of a group; blocks without rows are empty, and rows behind the last one belong to it.
    #[must_use]
    pub fn finish(mut self, shape: &GroupShape) -> ReducedGroup {
        if self.done.len() == shape.blocks
            && self.builder.rows() > 0
            && let Some(last) = self.done.pop()
        {
            self.builder.push_factor(&last);
        }
        self.finish_until(shape.blocks);
        ReducedGroup {
            log: shape.log,
            output: shape.output,
            scale: shape.scale,
            columns: shape.columns.clone(),
            blocks: self.done,
        }
    }
}

impl RowVisitor for BlockReducer {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        self.push(rows, None)
    }
}

/// Reduces all rows to factors, one per group and time block.
///
/// # Errors
/// [`RowsError`] if a row is not finite.
pub fn reduce_rows(source: &dyn RowSource) -> Result<Vec<ReducedGroup>, RowsError> {
    let shapes = source.groups();
    let mut reducers: Vec<BlockReducer> = shapes.iter().map(|s| BlockReducer::new(s.columns.len())).collect();
    visit_all(source, &mut reducers)?;
    Ok(reducers.into_iter().zip(shapes).map(|(reducer, shape)| reducer.finish(shape)).collect())
}
