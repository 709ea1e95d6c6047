//! Weighted rows of a log split at the parameters that vary: what knows of the log's own deviation, and what does not.

use dynid_linalg::Mat;
use rayon::prelude::*;

use crate::data::{ChannelFactor, Fleet, FleetLog};
use crate::noise::Noise;
use crate::tree;
use crate::triangle::{corner, head, of_stacked};

/// Rows of one log.
#[derive(Debug)]
pub(crate) struct LogSplit {
    /// Covariates, counted from the mean of the fleet.
    pub(crate) covariates: Vec<f64>,
    /// `[R_ff, R_fβ, z_f]`: `q` rows; `q + s + 1` columns.
    pub(crate) top: Mat,
}

/// Rows of all logs.
#[derive(Debug)]
pub(crate) struct Splits {
    /// Columns that vary (`q`), in the order of the fleet's coordinates, then shared ones (`s`).
    pub(crate) order: Vec<usize>,
    pub(crate) q: usize,
    pub(crate) covariates: usize,
    /// Per coordinate: [`crate::Coordinate::watched`].
    pub(crate) watched: Vec<bool>,
    /// Per log.
    pub(crate) logs: Vec<LogSplit>,
    /// Per robot: its logs in the order of their keys.
    pub(crate) by_robot: Vec<Vec<usize>>,
    /// Per robot: `[[R_ββ, z_β], [0, ρ]]` of its logs, which no variance changes; absent without logs.
    pub(crate) lower: Vec<Option<Mat>>,
    /// Robots that have logs, by key.
    pub(crate) robots: Vec<(u64, usize)>,
    /// Logs in the fleet's own order.
    pub(crate) ordered: Vec<usize>,
}

impl Splits {
    /// Splits all logs, weighted by their noise.
    pub(crate) fn new(fleet: &Fleet, noise: &Noise) -> Splits {
        let order: Vec<usize> = fleet.varying.iter().map(|v| v.column).chain(fleet.shared()).collect();
        let q = fleet.varying.len();
        let means = means(fleet);
        let place = places(&order);
        let split = |(k, log): (usize, &FleetLog)| {
            let triangle = of_stacked(stacked(&log.channels, &place, |at| {
                noise.weight(k, at, log.channels[at].channel)
            }));
            let covariates = log.covariates.iter().zip(&means).map(|(u, mean)| u - mean).collect();
            (LogSplit { covariates, top: head(&triangle, q) }, corner(&triangle, q, q))
        };
        let (logs, below): (Vec<LogSplit>, Vec<Mat>) = fleet.logs.par_iter().enumerate().map(split).unzip();
        let by_robot = fleet.by_robot();
        let merged = |of_robot: &Vec<usize>| {
            let parts: Vec<(u64, &Mat)> = of_robot.iter().map(|k| (fleet.logs[*k].key, &below[*k])).collect();
            tree::merge(&parts)
        };
        let lower = by_robot.par_iter().map(merged).collect();
        let mut robots: Vec<(u64, usize)> =
            (0..by_robot.len()).filter(|r| !by_robot[*r].is_empty()).map(|r| (fleet.robots[r], r)).collect();
        robots.sort_unstable();
        Splits {
            order,
            q,
            covariates: fleet.covariates,
            watched: fleet.varying.iter().map(|v| v.watched).collect(),
            logs,
            by_robot,
            lower,
            robots,
            ordered: fleet.ordered(),
        }
    }

    /// Parameters of the type: those that vary, their slopes over the covariates, those that are shared.
    pub(crate) fn parameters(&self) -> usize {
        self.order.len() + self.q * self.covariates
    }

    /// Rows `[f | Γ | β | z]` of a log's rows `[f | β | z]`: slopes see the columns that vary times the covariates.
    pub(crate) fn with_slopes(&self, rows: &Mat, covariates: &[f64]) -> Mat {
        let (q, slopes) = (self.q, self.q * self.covariates);
        Mat::from_fn(rows.nrows(), rows.ncols() + slopes, |i, j| match j {
            _ if j < q => rows[(i, j)],
            _ if j < q + slopes => rows[(i, (j - q) % q)] * covariates[(j - q) / q],
            _ => rows[(i, j - slopes)],
        })
    }
}

/// Mean of every covariate over the logs.
pub(crate) fn means(fleet: &Fleet) -> Vec<f64> {
    let order = fleet.ordered();
    let count = order.len().max(1) as f64;
    (0..fleet.covariates)
        .map(|c| order.iter().map(|k| fleet.logs[*k].covariates[c]).sum::<f64>() / count)
        .collect()
}

/// Per column of the problem its place in the order of the fit.
pub(crate) fn places(order: &[usize]) -> Vec<usize> {
    let mut place = vec![0; order.len()];
    for (at, column) in order.iter().enumerate() {
        place[*column] = at;
    }
    place
}

/// Weighted triangles of a log's channels over one another, columns in the order of the fit, `ρ` below each.
pub(crate) fn stacked(channels: &[ChannelFactor], place: &[usize], weight: impl Fn(usize) -> f64) -> Mat {
    let width = place.len() + 1;
    let heights = channels.iter().map(|c| c.factor.height() + 1);
    let mut out = Mat::zeros(heights.sum(), width);
    let mut first = 0;
    for (at, channel) in channels.iter().enumerate() {
        let (w, factor) = (weight(at), &channel.factor);
        let (triangle, height) = (factor.triangle(), factor.height());
        for (j, column) in channel.columns.iter().enumerate() {
            for i in 0..height.min(j + 1) {
                out[(first + i, place[*column])] = w * triangle[(i, j)];
            }
        }
        for i in 0..height {
            out[(first + i, width - 1)] = w * triangle[(i, factor.columns())];
        }
        out[(first + height, width - 1)] = w * factor.rho();
        first += height + 1;
    }
    out
}
