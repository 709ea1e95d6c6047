//! Patterns of change over time, and how well a series fits them.

use dynid_estimate::distribution::chi_squared_exceedance;

use super::series::Background;
use super::series::Series;

/// Ramps are tried from so many onsets ...
const ONSETS: usize = 35;
/// ... the last of them at this share of the span.
const LAST_ONSET: f64 = 0.85;
/// Distance of two of them.
pub(crate) const ONSET_STEP: f64 = LAST_ONSET / (ONSETS - 1) as f64;
/// Patterns whose statistic is less than this below the best are as good.
pub(crate) const AS_GOOD: f64 = 5.0;

/// How a parameter changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// From one value to another between two logs that follow one another.
    Step {
        /// Index of the first log behind it.
        first: usize,
    },
    /// Evenly from a time on.
    Ramp {
        /// That time, on the axis of the series.
        onset: f64,
    },
}

/// A pattern that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The pattern.
    pub pattern: Pattern,
    /// Height of the step; of a ramp its rise per unit of the axis.
    pub size: f64,
    /// Standard deviation of the size.
    pub sd: f64,
    /// `T = (hᵀQy)²/(hᵀQh)`, `χ²` with one degree of freedom where nothing changes and the pattern was given beforehand.
    pub statistic: f64,
}

impl Pattern {
    /// Its value at every log: 0 before it, 1 behind a step, the time since the onset of a ramp.
    pub fn values(self, times: &[f64]) -> Vec<f64> {
        match self {
            Pattern::Step { first } => (0..times.len()).map(|l| if l >= first { 1.0 } else { 0.0 }).collect(),
            Pattern::Ramp { onset } => times.iter().map(|t| (t - onset).max(0.0)).collect(),
        }
    }

    /// Whether it is a step.
    pub fn is_step(self) -> bool {
        matches!(self, Pattern::Step { .. })
    }
}

/// Patterns for a series on an axis from 0 to 1: steps with two logs on either side at least, ramps from evenly spaced onsets.
pub fn patterns(series: &Series) -> Vec<Pattern> {
    let onsets = (0..ONSETS).map(|k| LAST_ONSET * k as f64 / (ONSETS - 1) as f64);
    let steps = (2..series.len().saturating_sub(1)).map(|first| Pattern::Step { first });
    steps.chain(onsets.map(|onset| Pattern::Ramp { onset })).collect()
}

/// Tries patterns of coordinate `k`; `precision`: per covariate and coordinate, of the robot's own slope about the fleet's.
pub fn candidates(series: &Series, precision: &[Vec<f64>], k: usize, patterns: &[Pattern]) -> Vec<Candidate> {
    of_background(&Background::new(series, precision, Vec::new()), series, k, patterns)
}

pub(crate) fn of_background(
    background: &Background<'_>,
    series: &Series,
    k: usize,
    patterns: &[Pattern],
) -> Vec<Candidate> {
    let values: Vec<Vec<f64>> = patterns.iter().map(|p| p.values(&series.times)).collect();
    let told = background.of(k, &values);
    let all = patterns.iter().zip(told).zip(&values);
    all.map(|((pattern, (y, h)), values)| {
        // A pattern that the level and the covariates explain tells nothing.
        let raw: f64 = values.iter().zip(&series.information).map(|(h, m)| h * h * m[(k, k)]).sum();
        if h <= 1e-9 * raw {
            return Candidate { pattern: *pattern, size: 0.0, sd: f64::INFINITY, statistic: 0.0 };
        }
        Candidate { pattern: *pattern, size: y / h, sd: h.sqrt().recip(), statistic: y * y / h }
    })
    .collect()
}

/// Mean of the onsets of ramps by their likelihood `exp(T/2)`, the statistic `T` being twice its logarithm; `None` without ramps that tell something.
pub(crate) fn mean_onset(candidates: &[Candidate]) -> Option<f64> {
    let ramps = candidates.iter().filter_map(|c| match c.pattern {
        Pattern::Ramp { onset } => Some((onset, c.statistic)),
        Pattern::Step { .. } => None,
    });
    let most = ramps.clone().map(|(_, t)| t).fold(0.0, f64::max);
    let (sum, weight) = ramps.fold((0.0, 0.0), |(sum, weight), (onset, t)| {
        let own = (0.5 * (t - most)).exp();
        (sum + own * onset, weight + own)
    });
    (most > 0.0).then(|| sum / weight)
}

/// Probability that the largest statistic over all patterns of one coordinate exceeds `statistic` where nothing changes.
///
/// Neighbouring patterns are alike, so that the search over them costs less than their number: 1.4 `ln² L` for `L` logs (5 for 6 logs, 12 for
/// 20, 38 for 200). That is what white series show at `T = 15` within 10 %, and more than they show below.
pub fn probability(statistic: f64, logs: usize) -> f64 {
    let single = chi_squared_exceedance(statistic, 1.0).unwrap_or(1.0);
    (1.4 * (logs.max(2) as f64).ln().powi(2) * single).min(1.0)
}
