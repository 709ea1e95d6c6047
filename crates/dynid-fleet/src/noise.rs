//! Noise of channels, and how much of it follows the motion.

use dynid_factor::Factor;
use dynid_factor::rank::numerical_rank;
use rayon::prelude::*;

use crate::data::{ChannelFactor, Fleet};
use crate::triangle::squares;

/// Logs whose factors say which of a channel's columns are independent.
const RANK_LOGS: usize = 64;
/// A log with fewer rows beyond its rank than this leans on the noise of the channel in the other logs.
const FIRM: f64 = 30.0;

/// Noise of the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Per channel: columns that are independent of one another in its own rows.
    pub ranks: Vec<usize>,
    /// Per log and channel of the log: variance of a row, effort².
    pub variances: Vec<Vec<f64>>,
    /// Per channel: `κ ≥ 1`, the variance in the directions of the parameters over that between them, which is 1 for white noise.
    pub colours: Vec<f64>,
}

impl Noise {
    /// White noise, its variances from the residuals that no parameter explains: `σ² = ρ²/(N - rank)` of each log and channel.
    ///
    /// A log with few rows takes its variance from the channel's median in other logs as well, as if that had been seen in
    /// [`FIRM`] rows less its own.
    pub fn of(fleet: &Fleet) -> Noise {
        let ranks: Vec<usize> = (0..fleet.channels).into_par_iter().map(|c| rank(fleet, c)).collect();
        let own = |channel: &ChannelFactor| {
            let freedom = channel.factor.rows() as f64 - ranks[channel.channel] as f64;
            let floor = f64::EPSILON * channel.factor.effort_norm();
            (freedom.max(0.0), squares([channel.factor.rho().max(floor)]))
        };
        let mut seen: Vec<Vec<f64>> = vec![Vec::new(); fleet.channels];
        for channel in fleet.logs.iter().flat_map(|log| &log.channels) {
            let (freedom, rss) = own(channel);
            if freedom >= FIRM && rss > 0.0 {
                seen[channel.channel].push(rss / freedom);
            }
        }
        let usual: Vec<f64> = seen.into_iter().map(median).collect();
        let variance = |channel: &ChannelFactor| {
            let (freedom, rss) = own(channel);
            let leaning = (FIRM - freedom).max(0.0);
            let usual = usual[channel.channel];
            // No log of the fleet has rows enough: the channel's own residual, whatever it is worth.
            let usual = if usual > 0.0 { usual } else { rss.max(f64::MIN_POSITIVE) };
            (rss + leaning * usual) / (freedom + leaning)
        };
        let variances = fleet.logs.iter().map(|log| log.channels.iter().map(variance).collect()).collect();
        Noise { colours: vec![1.0; fleet.channels], ranks, variances }
    }

    /// Weight of the rows of the channel that is number `at` of log `log`: `1/(σ √κ)`.
    pub(crate) fn weight(&self, log: usize, at: usize, channel: usize) -> f64 {
        1.0 / (self.variances[log][at] * self.colours[channel]).sqrt()
    }
}

/// Rank of a channel's own columns: a property of its equations, told by the logs of the fleet together.
fn rank(fleet: &Fleet, channel: usize) -> usize {
    let all = || fleet.logs.iter().flat_map(|log| &log.channels).filter(|c| c.channel == channel);
    let step = all().count().div_ceil(RANK_LOGS).max(1);
    let factors: Vec<Factor> = all().step_by(step).map(|c| c.factor.embed(fleet.columns, &c.columns)).collect();
    if factors.is_empty() { 0 } else { numerical_rank(&Factor::merge(&factors.iter().collect::<Vec<_>>())).rank }
}

/// The middle of some numbers; 0 of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 0 => 0.5 * (values[middle - 1] + values[middle]),
        _ => values[middle],
    }
}
