//! Contiguous folds of time blocks, and the error held out over them.

use std::ops::Range;

/// How time blocks are held out.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldSettings {
    /// Number of folds; at most the number of blocks is used. Default 5.
    pub folds: usize,
    /// Blocks left out of the training set on each side of the held-out fold, because the filter leaks into
    /// them. Default 1.
    pub dropped_neighbours: usize,
}

impl Default for FoldSettings {
    fn default() -> Self {
        Self { folds: 5, dropped_neighbours: 1 }
    }
}

/// Held-out error with its spread over folds.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOutError {
    /// Mean over folds.
    pub mean: f64,
    /// Standard error of the mean, sample standard deviation over `√folds`; zero for a single fold.
    pub standard_error: f64,
}

/// Mean and standard error of the errors of folds; `None` without any.
pub(crate) fn held_out_error(errors: impl Iterator<Item = f64>) -> Option<HeldOutError> {
    let errors: Vec<f64> = errors.collect();
    let count = errors.len() as f64;
    if errors.is_empty() {
        return None;
    }
    let mean = errors.iter().sum::<f64>() / count;
    let spread = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>();
    let standard_error = if errors.len() > 1 { (spread / (count - 1.0) / count).sqrt() } else { 0.0 };
    Some(HeldOutError { mean, standard_error })
}

/// Splits blocks `0..blocks` into contiguous folds whose sizes differ by at most one.
pub fn contiguous_folds(blocks: usize, folds: usize) -> Vec<Range<usize>> {
    let folds = folds.clamp(1, blocks.max(1));
    (0..folds).map(|k| k * blocks / folds..(k + 1) * blocks / folds).filter(|r| !r.is_empty()).collect()
}
