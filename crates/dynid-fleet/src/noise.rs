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
/// Efforts are not known better than this share of their power: rows without noise would weigh without bound.
const EXACT: f64 = 1e-16;

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
    /// Variance of a channel whose efforts are zero in all logs: it tells nothing.
    pub const SILENT: f64 = 1e150;

    /// White noise, its variances from the residuals that no parameter explains: `σ² = ρ²/(N - rank)` of each log and channel.
    ///
    /// A log with few rows leans on the channel's variance in other logs, as if that had been seen in 30 rows less its own. A channel that
    /// has no row beyond its rank in any log tells no noise: its efforts count as noise of their own size.
    pub fn of(fleet: &Fleet) -> Noise {
        let order = fleet.ordered();
        let ranks: Vec<usize> = (0..fleet.channels).into_par_iter().map(|c| rank(fleet, &order, c)).collect();
        let own = |channel: &ChannelFactor| {
            let freedom = channel.factor.rows() as f64 - ranks[channel.channel] as f64;
            (freedom.max(0.0), squares([channel.factor.rho()]))
        };
        let mut seen: Vec<Vec<(f64, f64)>> = vec![Vec::new(); fleet.channels];
        let mut power = vec![(0.0, 0.0); fleet.channels];
        for channel in order.iter().flat_map(|k| &fleet.logs[*k].channels) {
            seen[channel.channel].push(own(channel));
            let (sum, rows) = &mut power[channel.channel];
            *sum += squares([channel.factor.effort_norm()]);
            *rows += channel.factor.rows() as f64;
        }
        let usual = |(seen, (sum, rows)): (Vec<(f64, f64)>, (f64, f64))| {
            let power = if rows > 0.0 { sum / rows } else { 1.0 };
            let firm: Vec<f64> = seen
                .iter()
                .filter(|(freedom, _)| *freedom >= FIRM)
                .map(|(freedom, rss)| rss / freedom)
                .collect();
            let (freedom, rss) =
                seen.iter().fold((0.0, 0.0), |(f, r), (freedom, rss)| (f + freedom, r + rss));
            let found = match () {
                () if !firm.is_empty() => median(firm),
                () if freedom > 0.0 => rss / freedom,
                () => power,
            };
            // Efforts that are zero in all logs are no measurement without noise, but none at all.
            let least = if power > 0.0 { EXACT * power } else { Noise::SILENT };
            (found, least)
        };
        let usual: Vec<(f64, f64)> = seen.into_iter().zip(power).map(usual).collect();
        let variance = |channel: &ChannelFactor| {
            let (freedom, rss) = own(channel);
            let leaning = (FIRM - freedom).max(0.0);
            let (usual, least) = usual[channel.channel];
            ((rss + leaning * usual) / (freedom + leaning)).max(least)
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
fn rank(fleet: &Fleet, order: &[usize], channel: usize) -> usize {
    let all = || order.iter().flat_map(|k| &fleet.logs[*k].channels).filter(|c| c.channel == channel);
    let step = all().count().div_ceil(RANK_LOGS).max(1);
    let factors: Vec<Factor> =
        all().step_by(step).map(|c| c.factor.embed(fleet.columns, &c.columns)).collect();
    if factors.is_empty() {
        0
    } else {
        numerical_rank(&Factor::merge(&factors.iter().collect::<Vec<_>>())).rank
    }
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
