//! Multi-start over the box of shape parameters.

use super::levenberg::{Search, SearchStatus, Stops, search};
use super::projection::Projection;
use super::scale::SearchBox;
use super::sobol::sobol;
use rayon::prelude::*;

/// Most dimensions whose corners are all tried (16 of them); beyond, the lowest and the highest corner only.
const CORNER_DIMENSIONS: usize = 4;
/// Losses that differ by less than this, relative, count as the same.
const SAME_LOSS: f64 = 1e-6;
/// Predicted fall of the loss, relative, that ends a search of a multi-start: the best one goes on from there.
pub(super) const START_FALL: f64 = 1e-9;

/// One search of a multi-start.
#[derive(Debug, Clone, PartialEq)]
pub struct StartOutcome {
    /// Shape parameters it began at.
    pub start: Vec<f64>,
    /// Shape parameters it ended at.
    pub shape: Vec<f64>,
    /// Weighted rss there; `None` where the model is not finite at the start.
    pub rss: Option<f64>,
    /// Iterations.
    pub iterations: usize,
    /// How it ended; `None` without a search.
    pub status: Option<SearchStatus>,
}

/// What the starts of a multi-start say about the minimum found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartReport {
    /// Outcomes in the order of the starts: given start, centre, corners, Sobol points.
    pub outcomes: Vec<StartOutcome>,
    /// Starts that reach the least rss within 1e-6, relative.
    pub reached: usize,
    /// Distinct minima: groups of ends whose rss differ by more than 1e-6, relative.
    pub distinct: usize,
}

/// Starts in searched coordinates: the given one, the centre, corners (all of them up to four parameters, else the
/// lowest and the highest), Sobol points until there are `count`.
pub(super) fn starts(bounds: &SearchBox, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let n = bounds.len();
    let boxed: Vec<usize> = (0..n).filter(|k| bounds.is_finite(*k)).collect();
    let mut all = vec![bounds.start.clone()];
    if boxed.is_empty() {
        return all;
    }
    all.push(bounds.share(&vec![0.5; n]));
    let corner = |bits: usize| {
        let mut shares = vec![0.0; n];
        boxed.iter().enumerate().for_each(|(i, k)| shares[*k] = f64::from(u8::from(bits >> i & 1 == 1)));
        bounds.share(&shares)
    };
    if boxed.len() <= CORNER_DIMENSIONS {
        all.extend((0..1 << boxed.len()).map(corner));
    } else {
        all.extend([bounds.share(&vec![0.0; n]), bounds.share(&vec![1.0; n])]);
    }
    let missing = count.saturating_sub(all.len());
    all.extend(sobol(missing, n, seed).iter().map(|shares| bounds.share(shares)));
    all.truncate(count.max(1));
    all
}

/// Searches from all starts in parallel; the first of the best is returned with the report. `None` if the model is not
/// finite at any start.
pub(super) fn multi_start(
    projection: &Projection<'_>,
    bounds: &SearchBox,
    starts: &[Vec<f64>],
    held: &[bool],
    stops: Stops,
    noise: f64,
) -> Option<(Search, StartReport)> {
    let found: Vec<Option<Search>> =
        starts.par_iter().map(|start| search(projection, bounds, start, held, stops)).collect();
    let outcomes = starts
        .iter()
        .zip(&found)
        .map(|(start, found)| StartOutcome {
            start: bounds.natural(start),
            shape: found.as_ref().map_or_else(|| bounds.natural(start), |f| bounds.natural(&f.u)),
            rss: found.as_ref().map(|f| f.point.rss),
            iterations: found.as_ref().map_or(0, |f| f.iterations),
            status: found.as_ref().map(|f| f.status),
        })
        .collect();
    let mut losses: Vec<f64> = found.iter().flatten().map(|f| f.point.rss).collect();
    losses.sort_unstable_by(f64::total_cmp);
    let least = *losses.first()?;
    let same = |a: f64, b: f64| b - a <= SAME_LOSS * a + noise;
    let reached = losses.iter().filter(|l| same(least, **l)).count();
    let distinct = 1 + losses.windows(2).filter(|w| !same(w[0], w[1])).count();
    let best = found.into_iter().flatten().min_by(|a, b| a.point.rss.total_cmp(&b.point.rss))?;
    Some((best, StartReport { outcomes, reached, distinct }))
}
