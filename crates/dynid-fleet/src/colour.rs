//! How much more noise the directions of the motion hold than what lies between them.

use rayon::prelude::*;

use crate::data::Fleet;
use crate::noise::{Noise, median};
use crate::sweep::Sweep;
use crate::triangle::squares;

/// Per channel `κ ≥ 1`: the median over logs of `(‖z - R x‖² + tr R V Rᵀ)/(σ² rank)` at the log's own parameters `x`, `V` their covariance
/// where those of type and robot are known.
///
/// White noise puts as much variance on each direction that a parameter moves as on each between them; noise that is slower than the
/// rows puts more on the first, as parameters move the efforts slowly.
pub(crate) fn colours(fleet: &Fleet, noise: &Noise, sweep: &Sweep<'_>) -> Vec<f64> {
    let splits = sweep.splits;
    let (q, slopes) = (splits.q, splits.q * splits.covariates);
    let place = crate::split::places(&splits.order);
    let of_robot = |r: &(u64, usize)| {
        let state = sweep.robot(r.1);
        let mut out: Vec<(usize, usize, f64)> = Vec::new();
        for k in &splits.by_robot[r.1] {
            let deviation = sweep.log(*k, &state);
            let u = &splits.logs[*k].covariates;
            let x = |at: usize| {
                if at >= q {
                    return state.values[at + slopes];
                }
                let follows: f64 = u.iter().enumerate().map(|(c, u)| u * state.values[q + c * q + at]).sum();
                state.values[at] + deviation.mean[at] + follows
            };
            for (number, channel) in fleet.logs[*k].channels.iter().enumerate() {
                let rank = noise.ranks[channel.channel].min(channel.factor.rows());
                if rank == 0 {
                    continue;
                }
                let at: Vec<usize> = channel.columns.iter().map(|c| place[*c]).collect();
                let own: Vec<f64> = at.iter().map(|at| x(*at)).collect();
                let factor = &channel.factor;
                let misfit = (factor.rss(&own) - squares([factor.rho()])).max(0.0);
                // tr R V Rᵀ over the columns that vary.
                let varying: Vec<(usize, usize)> =
                    at.iter().enumerate().filter(|(_, at)| **at < q).map(|(j, at)| (j, *at)).collect();
                let mut trace = 0.0;
                for i in 0..factor.height() {
                    for (j, a) in varying.iter().filter(|(j, _)| *j >= i) {
                        let row: f64 = varying
                            .iter()
                            .filter(|(l, _)| *l >= i)
                            .map(|(l, b)| deviation.given[(*a, *b)] * factor.r(i, *l))
                            .sum();
                        trace += factor.r(i, *j) * row;
                    }
                }
                let variance = noise.variances[*k][number];
                out.push((channel.channel, *k, (misfit + trace) / (variance * rank as f64)));
            }
        }
        out
    };
    let mut ratios = vec![Vec::new(); fleet.channels];
    for (channel, _, ratio) in
        splits.robots.par_iter().map(of_robot).collect::<Vec<_>>().into_iter().flatten()
    {
        ratios[channel].push(ratio);
    }
    ratios.into_iter().map(|ratios| median(ratios).max(1.0)).collect()
}
