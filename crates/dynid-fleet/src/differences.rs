//! By how much logs differ in a coordinate, whatever it is in all of them.

use dynid_linalg::{AsView, Mat};
use rayon::prelude::*;

use crate::data::{ChannelFactor, Fleet, FleetError};
use crate::fit::FleetFit;
use crate::split::{places, stacked};
use crate::sweep::{Sweep, deviation, whitened};
use crate::triangle::{head, of_stacked};

/// Variances between logs are so many times those of the fleet where halves of logs are told apart, so that each half tells its own values; more would
/// leave of a well-told variance, `D - M_f D`, little but rounding.
const FREE: f64 = 100.0;
/// Fewer logs in halves than this do not tell how far they scatter.
pub const LEAST_HALVED: usize = 20;
/// Share of the logs, and what `χ²` with one degree of freedom stays below with that probability: errors of slow logs have long tails, which a middle does
/// not show, and a log in ten may be broken.
const WITHIN: (f64, f64) = (0.9, 2.705_543_454_095_404);

/// A log in two halves of its time.
#[derive(Debug, Clone, PartialEq)]
pub struct LogHalves {
    /// Its index.
    pub log: usize,
    /// Factors of either half, of the same channels in the order of the log's.
    pub halves: [Vec<ChannelFactor>; 2],
}

/// What a log has of coordinates beyond the mean over all logs.
#[derive(Debug, Clone, PartialEq)]
pub struct LogDifference {
    /// Per coordinate: its value in the log ([`FleetFit::values_of_log`]) less the mean over all logs.
    pub value: Vec<f64>,
    /// Per coordinate: standard deviation of that, as halves of logs tell it. What nobody knows of the type, and what is the same error in all logs, is not in it.
    pub sd: Vec<f64>,
}

impl FleetFit {
    /// Differences of all logs in some coordinates, in the order of the logs.
    ///
    /// With the value `v_l = A_l (A_r θ + b_r) + c_l` of a log, `A` the part of an error of what is above that its own deviation does not take up, the
    /// variance of `v_l - v̄` is `(H_l - H̄) C (H_l - H̄)ᵀ + A_l B_r A_lᵀ + C_l` with `H_l = A_l A_r`, `C` the covariance of the type, `B_r` and `C_l`
    /// those of deviations where what is above is known; the share of these in the mean is left out.
    ///
    /// Noise that is slower than the rows of a fit, and errors of the model, weigh most on what moves the efforts slowest. Where logs are free to
    /// differ, the fit takes all of it for a difference of the log, and no residual shows it; `halves` of at least [`LEAST_HALVED`] logs do, and raise the
    /// deviations by what they scatter beyond their noise. Without them the deviations are those of noise alone.
    ///
    /// # Errors
    /// None that the fit had not.
    ///
    /// # Panics
    /// If `fleet` is not the one that was fitted, or halves have other channels than their log.
    pub fn differences(
        &self,
        fleet: &Fleet,
        coordinates: &[usize],
        halves: &[LogHalves],
    ) -> Result<Vec<LogDifference>, FleetError> {
        let splits = &*self.splits;
        let sweep = Sweep::new(splits, &self.variances, self.prior.as_ref())?;
        let (q, p, n) = (splits.q, sweep.theta.len(), coordinates.len());
        let of_robots: Vec<Option<(Mat, Mat)>> = (0..splits.by_robot.len())
            .into_par_iter()
            .map(|r| (!splits.by_robot[r].is_empty()).then(|| sweep.errors_of_robot(r)))
            .collect();
        // H of a log, and the variances of what is its robot's and its own.
        let of_log = |k: usize| -> (Mat, Vec<f64>) {
            let (a, given) = sweep.errors_of_log(k);
            let Some((map, of_robot)) = &of_robots[fleet.logs[k].robot] else {
                unreachable!("a log of a robot without logs")
            };
            let a = Mat::from_fn(n, p, |i, j| a[(coordinates[i], j)]);
            let varying = a.columns(0..q);
            let followed = varying * map;
            let robot = varying * of_robot;
            let own = |i: usize| {
                let of_robot: f64 = (0..q).map(|j| robot[(i, j)] * varying[(i, j)]).sum();
                of_robot + given[(coordinates[i], coordinates[i])]
            };
            (Mat::from_fn(n, p, |i, j| a[(i, j)] - followed[(i, j)]), (0..n).map(own).collect())
        };
        let excess = excess(self, &sweep, fleet, (coordinates, halves));
        let number = fleet.logs.len().max(1) as f64;
        // Robot by robot and log by log in the fleet's own order, so that sums keep their bits.
        let sums: Vec<Mat> = (splits.robots.par_iter())
            .map(|(_, r)| {
                let zero = Mat::zeros(n, p);
                splits.by_robot[*r].iter().fold(zero, |sum, k| &sum + &of_log(*k).0)
            })
            .collect();
        let mean = sums.iter().fold(Mat::zeros(n, p), |sum, of_robot| &sum + of_robot);
        let mean = &mean * (1.0 / number);
        let values = |k: usize| -> Vec<f64> {
            let values = self.values_of_log(fleet, k).unwrap_or_default();
            coordinates.iter().map(|c| values[fleet.varying[*c].column]).collect()
        };
        let mut middle = vec![0.0; n];
        for k in &splits.ordered {
            middle.iter_mut().zip(values(*k)).for_each(|(sum, value)| *sum += value / number);
        }
        let difference = |k: usize| {
            let (h, own) = of_log(k);
            let apart = &h - &mean;
            let followed = &apart * &sweep.covariance;
            let variance = |i: usize| -> f64 {
                let of_type: f64 = (0..p).map(|j| followed[(i, j)] * apart[(i, j)]).sum();
                (of_type + own[i]).max(0.0)
            };
            LogDifference {
                value: values(k).iter().zip(&middle).map(|(value, mean)| value - mean).collect(),
                sd: (0..n).map(|i| (excess[i] * variance(i)).sqrt()).collect(),
            }
        };
        Ok((0..fleet.logs.len()).into_par_iter().map(difference).collect())
    }
}

/// Per coordinate, by how much the variance of what halves of logs tell of it exceeds that of their noise: so much that nine in ten logs have halves no
/// further apart than nine in ten would be by noise; 1 or more, and of fewer than [`LEAST_HALVED`] logs 1.
fn excess(
    fit: &FleetFit,
    sweep: &Sweep<'_>,
    fleet: &Fleet,
    (coordinates, halves): (&[usize], &[LogHalves]),
) -> Vec<f64> {
    let splits = sweep.splits;
    let (q, place) = (splits.q, places(&splits.order));
    let of_log = |LogHalves { log, halves }: &LogHalves| -> Vec<f64> {
        let state = sweep.robot(fleet.logs[*log].robot);
        let channels = &fleet.logs[*log].channels;
        let free: Vec<f64> = sweep.variances.of_log(*log).iter().map(|d| FREE * d).collect();
        let told = |half: &Vec<ChannelFactor>| {
            assert_eq!(half.len(), channels.len(), "channels of a half");
            let weight = |at: usize| fit.noise.weight(*log, at, channels[at].channel);
            let top = head(&of_stacked(stacked(half, &place, weight)), q);
            let (rows, _) = whitened(&top, q, &free);
            let rows = splits.with_slopes(&rows, &splits.logs[*log].covariates);
            deviation(rows.view(), (q, 0), &free, &state.values, &state.covariance).0
        };
        let [a, b] = halves.each_ref().map(told);
        let ratio = |k: &usize| (a.mean[*k] - b.mean[*k]).powi(2) / (a.given[(*k, *k)] + b.given[(*k, *k)]);
        coordinates.iter().map(ratio).collect()
    };
    let ratios: Vec<Vec<f64>> = halves.par_iter().map(of_log).collect();
    let of_coordinate = |k: usize| {
        // A coordinate without spread has neither difference nor variance.
        let mut own: Vec<f64> = ratios.iter().map(|of_log| of_log[k]).filter(|r| r.is_finite()).collect();
        own.sort_by(f64::total_cmp);
        let (share, of_noise) = WITHIN;
        match own.len() {
            n if n < LEAST_HALVED => 1.0,
            n => (own[((share * n as f64) as usize).min(n - 1)] / of_noise).max(1.0),
        }
    };
    (0..coordinates.len()).map(of_coordinate).collect()
}
