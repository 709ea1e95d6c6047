//! Rows held in memory.

use super::{GroupShape, RowSource, RowVisitor, Rows, RowsError, visit_all};
use crate::factor::FactorError;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rows of all groups in memory.
#[derive(Debug, Clone, Default)]
pub struct MemoryRows {
    shapes: Vec<GroupShape>,
    runs: Vec<Vec<Run>>,
}

#[derive(Debug, Clone)]
struct Run {
    block: usize,
    samples: Vec<usize>,
    /// Column-major with stride `effort.len()`.
    regressor: Vec<f64>,
    effort: Vec<f64>,
}

impl MemoryRows {
    /// No groups.
    pub fn new() -> Self {
        MemoryRows::default()
    }

    /// Adds a group without rows and returns its index.
    pub fn add_group(&mut self, shape: GroupShape) -> usize {
        self.shapes.push(shape);
        self.runs.push(Vec::new());
        self.runs.len() - 1
    }

    /// Appends rows to a group.
    ///
    /// Panics if the group does not exist, the slices do not fit its columns, or the block is out of order.
    pub fn push(&mut self, group: usize, rows: &Rows<'_>) {
        let shape = &self.shapes[group];
        assert!(rows.block < shape.blocks, "the block exists");
        assert!(self.runs[group].last().is_none_or(|r| r.block <= rows.block), "blocks come in order");
        assert_eq!(rows.samples.len(), rows.effort.len(), "one sample per row");
        self.runs[group].push(Run::copy(rows, shape.columns.len()));
    }

    /// Copies all rows of a source, or returns `None` if they take more than `limit` bytes.
    ///
    /// # Errors
    /// [`RowsError`] of the source.
    pub fn collect(source: &dyn RowSource, limit: usize) -> Result<Option<MemoryRows>, RowsError> {
        let shapes = source.groups().to_vec();
        let used = AtomicUsize::new(0);
        let mut keepers: Vec<Keeper<'_>> = shapes
            .iter()
            .map(|s| Keeper { columns: s.columns.len(), limit, used: &used, runs: vec![] })
            .collect();
        visit_all(source, &mut keepers)?;
        let runs = keepers.into_iter().map(|k| k.runs).collect();
        Ok((used.into_inner() <= limit).then_some(MemoryRows { shapes, runs }))
    }
}

impl Run {
    fn copy(rows: &Rows<'_>, columns: usize) -> Self {
        let count = rows.effort.len();
        Run {
            block: rows.block,
            samples: rows.samples.to_vec(),
            regressor: (0..columns)
                .flat_map(|c| rows.regressor[c * rows.stride..][..count].iter().copied())
                .collect(),
            effort: rows.effort.to_vec(),
        }
    }
}

/// Keeps rows until the common limit is passed, then drops what it holds.
struct Keeper<'a> {
    columns: usize,
    limit: usize,
    used: &'a AtomicUsize,
    runs: Vec<Run>,
}

impl RowVisitor for Keeper<'_> {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        let bytes = rows.effort.len() * (self.columns + 2) * size_of::<f64>();
        if self.used.fetch_add(bytes, Ordering::Relaxed) + bytes > self.limit {
            self.runs = Vec::new();
        } else {
            self.runs.push(Run::copy(rows, self.columns));
        }
        Ok(())
    }
}

impl RowSource for MemoryRows {
    fn groups(&self) -> &[GroupShape] {
        &self.shapes
    }

    fn visit(&self, visitors: &mut [&mut dyn RowVisitor]) -> Result<(), RowsError> {
        assert_eq!(visitors.len(), self.runs.len(), "one visitor per group");
        let outcomes: Vec<Result<(), RowsError>> = visitors
            .par_iter_mut()
            .zip(&self.runs)
            .enumerate()
            .map(|(group, (visitor, runs))| {
                runs.iter().try_for_each(|run| {
                    let rows = Rows {
                        block: run.block,
                        samples: &run.samples,
                        regressor: &run.regressor,
                        stride: run.effort.len(),
                        effort: &run.effort,
                    };
                    visitor.take(&rows).map_err(|source| RowsError { group, source })
                })
            })
            .collect();
        outcomes.into_iter().collect()
    }
}
