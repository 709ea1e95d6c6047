//! Residuals of the rows themselves, in time order.

use super::{RowSource, RowVisitor, Rows, RowsError, visit_all};
use crate::factor::FactorError;

/// Residuals of the rows of one group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupResiduals {
    /// Sample of the log at which each row is centred, ascending.
    pub samples: Vec<usize>,
    /// `y - W x` of each row, effort.
    pub residuals: Vec<f64>,
}

impl GroupResiduals {
    /// The residuals on a uniform grid of row distances, zero where there is no row, with the distance in samples. `None`
    /// with fewer than three rows.
    pub fn on_grid(&self) -> Option<(usize, Vec<f64>)> {
        let mut steps: Vec<usize> = self.samples.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0).collect();
        if steps.len() < 2 {
            return None;
        }
        let middle = steps.len() / 2;
        let step = *steps.select_nth_unstable(middle).1;
        let first = self.samples[0];
        let last = self.samples[self.samples.len() - 1];
        let mut grid = vec![0.0; (last - first) / step + 1];
        for (sample, residual) in self.samples.iter().zip(&self.residuals) {
            grid[(sample - first) / step] = *residual;
        }
        Some((step, grid))
    }

    /// Which of `samples` samples have a row within half a row distance.
    pub fn coverage(&self, samples: usize) -> Vec<bool> {
        let mut covered = vec![false; samples];
        let reach = self.on_grid().map_or(0, |(step, _)| step.div_ceil(2));
        for centre in &self.samples {
            let end = (centre + reach + 1).min(samples);
            covered[centre.saturating_sub(reach).min(end)..end].fill(true);
        }
        covered
    }
}

struct Collector<'a> {
    x: Vec<f64>,
    out: &'a mut GroupResiduals,
    buffer: Vec<f64>,
}

impl RowVisitor for Collector<'_> {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        rows.residuals(&self.x, &mut self.buffer);
        self.out.samples.extend_from_slice(rows.samples);
        self.out.residuals.extend_from_slice(&self.buffer);
        Ok(())
    }
}

/// Residuals of all groups at the estimate `x` (all base columns), one pass through the rows.
///
/// # Errors
/// [`RowsError`] if the source refuses.
pub fn row_residuals(source: &dyn RowSource, x: &[f64]) -> Result<Vec<GroupResiduals>, RowsError> {
    let mut out = vec![GroupResiduals { samples: Vec::new(), residuals: Vec::new() }; source.groups().len()];
    let mut collectors: Vec<Collector<'_>> = out
        .iter_mut()
        .zip(source.groups())
        .map(|(out, shape)| Collector {
            x: shape.columns.iter().map(|c| x[*c]).collect(),
            out,
            buffer: Vec::new(),
        })
        .collect();
    visit_all(source, &mut collectors)?;
    Ok(out)
}
