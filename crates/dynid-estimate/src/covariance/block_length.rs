//! How long a time block must be for blocks to count as independent.

use super::MIN_BLOCKS;
use crate::whiteness::counted_autocorrelation;

/// Settings of [`block_length`].
#[derive(Debug, Clone, PartialEq)]
pub struct BlockLengthSettings {
    /// Shortest block, s. Default 1.
    pub least_s: f64,
    /// Autocorrelation below which residuals count as uncorrelated. Default 0.1.
    pub level: f64,
    /// Correlation times per block. Default 5.
    pub times: f64,
    /// Fewest blocks for an honest interval. Default [`MIN_BLOCKS`].
    pub least_blocks: usize,
}

impl Default for BlockLengthSettings {
    fn default() -> Self {
        Self { least_s: 1.0, level: 0.1, times: 5.0, least_blocks: MIN_BLOCKS }
    }
}

/// Whether the blocks are enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BlockLengthStatus {
    /// At least 20 blocks of this length.
    Enough,
    /// Between the fewest and 20 blocks: intervals deserve a warning.
    Few,
    /// The logs are too short for an honest interval: expected at least this many seconds.
    TooShort {
        /// Seconds that the fewest blocks of this length take.
        expected_s: f64,
    },
}

/// Outcome of [`block_length`].
#[derive(Debug, Clone, PartialEq)]
pub struct BlockLength {
    /// Length of a block, s.
    pub seconds: f64,
    /// Number of whole blocks of this length in all logs.
    pub blocks: usize,
    /// Correlation time of every signal, s: first lag with an autocorrelation below the level. The longest lag looked at
    /// (a quarter of the signal) where none is; `None` for a signal without residuals.
    pub correlation_s: Vec<Option<f64>>,
    /// Index of the signal of the longest correlation time.
    pub worst: Option<usize>,
    /// Whether the blocks are enough.
    pub status: BlockLengthStatus,
}

/// Residual signal of one joint of one log, passed through the same kernel or filter as the rows of the fit.
#[derive(Debug, Clone, Copy)]
pub struct ResidualSignal<'a> {
    /// Index of the log.
    pub log: usize,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Residual, measured minus predicted; exactly zero where samples do not count.
    pub residual: &'a [f64],
}

/// Length of time blocks, `max(1 s, 5 τ)` with the correlation time `τ` of the worst joint.
///
/// `τ` is the first lag at which the autocorrelation is below the level plus `1/√n`, the standard error of `n` white samples.
/// Autocorrelations are taken about zero over pairs of samples that both count. Unfiltered residuals will not do: white
/// sensor noise hides the slow colour that the filter passes.
pub fn block_length(signals: &[ResidualSignal<'_>], settings: &BlockLengthSettings) -> BlockLength {
    let correlation_s: Vec<Option<f64>> = signals
        .iter()
        .map(|s| {
            let longest = s.residual.len() / 4;
            let correlations = counted_autocorrelation(s.residual, longest)?;
            let counted = s.residual.iter().filter(|r| **r != 0.0).count() as f64;
            // One standard error of white noise: of many joints one would else ask for long blocks by chance.
            let level = settings.level + 1.0 / counted.sqrt();
            let first = correlations.iter().position(|r| r.abs() < level);
            Some(first.map_or(longest, |lag| lag + 1) as f64 / s.rate_hz)
        })
        .collect();
    let longest = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0));
    let worst = correlation_s.iter().enumerate().filter_map(|(i, t)| t.map(|t| (i, t))).max_by(longest);
    let seconds = settings.least_s.max(settings.times * worst.map_or(0.0, |w| w.1));
    let mut durations: Vec<f64> = Vec::new();
    for signal in signals {
        durations.resize(durations.len().max(signal.log + 1), 0.0);
        let own = &mut durations[signal.log];
        *own = own.max(signal.residual.len() as f64 / signal.rate_hz);
    }
    // A rounding error of the sample rate must not cost a block.
    let blocks = durations.iter().map(|d| (d / seconds * (1.0 + 1e-9)).floor() as usize).sum();
    let status = match blocks {
        _ if blocks < settings.least_blocks => {
            BlockLengthStatus::TooShort { expected_s: seconds * settings.least_blocks as f64 }
        }
        0..20 => BlockLengthStatus::Few,
        _ => BlockLengthStatus::Enough,
    };
    BlockLength { seconds, blocks, correlation_s, worst: worst.map(|w| w.0), status }
}
