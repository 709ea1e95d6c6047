//! Efforts that are cut off.

use super::{Run, is_no_accident, runs};

/// Fewest equal samples in the longest run.
const LEAST: usize = 5;

/// An effort that stays at its largest or smallest value.
#[derive(Debug, Clone, PartialEq)]
pub struct Clipping {
    /// The value.
    pub level: f64,
    /// Runs of at least three samples at it.
    pub runs: Vec<Run>,
}

impl Clipping {
    /// Samples at the level.
    pub fn samples(&self) -> usize {
        self.runs.iter().map(|r| r.length).sum()
    }
}

/// Finds flat tops and bottoms: runs of exactly the largest (smallest) value, the longest of them longer than chance makes
/// it, given how often the other values repeat.
pub fn clipped(effort: &[f64]) -> Vec<Clipping> {
    let (low, high) =
        effort.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if low >= high {
        return Vec::new();
    }
    let inner: Vec<&[f64]> = effort.windows(2).filter(|w| w[0] > low && w[0] < high).collect();
    let equal = inner.iter().filter(|w| w[0] == w[1]).count();
    let repeats = equal as f64 / inner.len().max(1) as f64;
    let all = runs(effort, 3);
    [high, low]
        .into_iter()
        .filter_map(|level| {
            let at: Vec<Run> = all.iter().copied().filter(|r| effort[r.first] == level).collect();
            let longest = at.iter().map(|r| r.length).max()?;
            let flat = longest >= LEAST && is_no_accident(longest, repeats, effort.len());
            flat.then_some(Clipping { level, runs: at })
        })
        .collect()
}
