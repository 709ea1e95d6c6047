//! Factors of the groups of rows that share a residual variance.

use crate::factor::Factor;

/// Factors of one output of one log at one kernel scale, all in the base columns that act on the output.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedGroup {
    /// Index of the log.
    pub log: usize,
    /// Index of the output.
    pub output: usize,
    /// Index of the kernel scale, 0 = widest.
    pub scale: usize,
    /// Base columns that the factors' columns stand for.
    pub columns: Vec<usize>,
    /// One factor per time block of the log.
    pub blocks: Vec<Factor>,
}

impl ReducedGroup {
    /// All time blocks merged, in all `total` base columns.
    #[must_use]
    pub fn merged(&self, total: usize) -> Factor {
        Factor::merge(&self.blocks.iter().collect::<Vec<_>>()).embed(total, &self.columns)
    }

    /// Returns the rows without base columns that are not among `columns`: their parameters are held at zero.
    #[must_use]
    pub fn within(&self, columns: &[usize]) -> ReducedGroup {
        let places: Vec<usize> =
            (0..self.columns.len()).filter(|k| columns.contains(&self.columns[*k])).collect();
        ReducedGroup {
            columns: places.iter().map(|k| self.columns[*k]).collect(),
            blocks: self.blocks.iter().map(|b| b.select(&places)).collect(),
            ..*self
        }
    }

    /// Rows of all blocks.
    pub fn rows(&self) -> usize {
        self.blocks.iter().map(Factor::rows).sum()
    }

    /// Returns the rows in blocks `factor` times as long, the last one taking the rest: needed where residuals stay correlated
    /// beyond a block.
    ///
    /// A rest of less than half a block joins the one before. Panics if `factor` is zero.
    #[must_use]
    pub fn coarsened(&self, factor: usize) -> ReducedGroup {
        assert!(factor > 0, "blocks are merged by a positive factor");
        let count = ((self.blocks.len() + factor / 2) / factor).max(1);
        let blocks = (0..count)
            .map(|b| {
                let end = if b + 1 == count { self.blocks.len() } else { (b + 1) * factor };
                Factor::merge(&self.blocks[b * factor..end].iter().collect::<Vec<_>>())
            })
            .collect();
        ReducedGroup { columns: self.columns.clone(), blocks, ..*self }
    }
}

/// Time blocks of the weighted problem in all `total` columns, log after log: per log and block, the factors of all
/// groups multiplied by their weight and merged in the order given. Blocks without rows are left out.
///
/// Panics unless there is one weight per group.
pub fn time_blocks(groups: &[ReducedGroup], weights: &[f64], total: usize) -> Vec<Factor> {
    assert_eq!(groups.len(), weights.len(), "one weight per group");
    let logs = groups.iter().map(|g| g.log + 1).max().unwrap_or(0);
    let mut out = Vec::new();
    for log in 0..logs {
        let of_log: Vec<(&ReducedGroup, f64)> =
            groups.iter().zip(weights.iter().copied()).filter(|(g, _)| g.log == log).collect();
        let blocks = of_log.iter().map(|(g, _)| g.blocks.len()).max().unwrap_or(0);
        for b in 0..blocks {
            let parts: Vec<Factor> = of_log
                .iter()
                .filter_map(|(g, w)| {
                    let block = g.blocks.get(b).filter(|f| f.rows() > 0)?;
                    Some(block.scaled(*w).embed(total, &g.columns))
                })
                .collect();
            if !parts.is_empty() {
                out.push(Factor::merge(&parts.iter().collect::<Vec<_>>()));
            }
        }
    }
    out
}
