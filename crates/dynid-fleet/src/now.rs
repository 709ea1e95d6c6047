//! Robots that have changed, as they are at their last logs.

use dynid_linalg::{AsView, Mat};
use rayon::prelude::*;

use crate::data::{Fleet, FleetError};
use crate::drift::{Change, Kind};
use crate::fit::{FleetFit, RobotFit};
use crate::split::places;
use crate::sweep::{Deviation, Sweep, deviation, whitened};
use crate::triangle::{of_stacked, squares, times};

/// Standard deviation that a change may have beforehand, over its size: as good as none is known.
const FREE: f64 = 1e3;
/// Dates of a change that are tried beside the best, evenly over its interval.
const DATES: usize = 16;

impl FleetFit {
    /// What is known of robots at their last logs, their changes fitted beside their deviations from the type; at the mean of the covariates.
    ///
    /// The logs of a robot as [`FleetFit::robots`] has them, with a column more for every change: that of the parameter times the pattern, 1
    /// at the last log. Logs that stood out by the parameter are logs like the others beside it. What dates, and kinds where either explains
    /// the logs, leave open of today is in the covariance: values are means over them by their likelihood.
    ///
    /// `robots`: indices with their changes; the result is in their order, `None` for a robot without logs.
    ///
    /// # Errors
    /// None that the fit had not.
    pub fn robots_now(
        &self,
        fleet: &Fleet,
        robots: &[(usize, &[Change])],
    ) -> Result<Vec<Option<RobotFit>>, FleetError> {
        let sweep = Sweep::new(&self.splits, &self.variances, self.prior.as_ref())?;
        let of_robot = |(r, changes): &(usize, &[Change])| {
            let known = self.robots[*r].as_ref()?;
            Some(RobotLogs { fit: self, sweep: &sweep, fleet, robot: *r }.now(changes, known))
        };
        Ok(robots.par_iter().map(of_robot).collect())
    }
}

/// A pattern of a change: its kind, and when.
#[derive(Clone, Copy)]
struct When {
    step: bool,
    time_s: f64,
}

/// A robot at its last log by patterns of its changes.
struct Today {
    /// Per coordinate: deviation from the type.
    deviation: Vec<f64>,
    /// Covariance of that, `q × q`.
    own: Mat,
    /// What it has in common with the parameters of the type, `q × p`.
    with_type: Mat,
    /// Logarithm of the likelihood of the logs by these patterns, but for a constant.
    likelihood: f64,
}

struct RobotLogs<'a> {
    fit: &'a FleetFit,
    sweep: &'a Sweep<'a>,
    fleet: &'a Fleet,
    robot: usize,
}

impl RobotLogs<'_> {
    fn now(&self, changes: &[Change], known: &RobotFit) -> RobotFit {
        let best: Vec<When> = changes.iter().map(|c| When { step: c.step, time_s: c.time_s }).collect();
        let mut today = self.by(changes, &best);
        for (c, change) in changes.iter().enumerate() {
            let tried: Vec<Today> = patterns(change)
                .into_iter()
                .map(|when| {
                    let mut all = best.clone();
                    all[c] = when;
                    self.by(changes, &all)
                })
                .collect();
            today.spread_over(&tried, &self.by(changes, &best).deviation);
        }
        let splits = self.sweep.splits;
        let (q, slopes) = (splits.q, splits.q * splits.covariates);
        let place = places(&splits.order);
        let at = |column: usize| if place[column] < q { place[column] } else { place[column] + slopes };
        let covariance = |a: usize, b: usize| {
            let (i, j) = (at(a), at(b));
            let mut out = self.sweep.covariance[(i, j)];
            if i < q {
                out -= today.with_type[(i, j)];
            }
            if j < q {
                out -= today.with_type[(j, i)];
            }
            if i < q && j < q { out + today.own[(i, j)] } else { out }
        };
        let columns = splits.order.len();
        let value = |column: usize| {
            let i = at(column);
            self.sweep.theta[i] + if i < q { today.deviation[i] } else { 0.0 }
        };
        RobotFit {
            values: (0..columns).map(value).collect(),
            covariance: Mat::from_fn(columns, columns, covariance),
            deviation_sd: (0..q).map(|k| today.own[(k, k)].max(0.0).sqrt()).collect(),
            deviation: today.deviation,
            weights: known.weights.clone(),
        }
    }

    /// By patterns that are given.
    fn by(&self, changes: &[Change], when: &[When]) -> Today {
        let splits = self.sweep.splits;
        let variances = &self.fit.variances;
        let of_robot = &splits.by_robot[self.robot];
        let time = |k: &usize| self.fleet.logs[*k].time_s;
        let last = of_robot.iter().map(time).fold(f64::NEG_INFINITY, f64::max);
        let pattern = |when: &When, t: f64| match when.step {
            true => f64::from(t >= when.time_s),
            false => (t - when.time_s).max(0.0) / (last - when.time_s),
        };
        let (q, m, p) = (splits.q, changes.len(), splits.parameters());
        // Columns: deviation, changes, parameters of the type, effort.
        let mut rows = Mat::zeros(of_robot.len() * q, q + m + p + 1);
        for (at, k) in of_robot.iter().enumerate() {
            let mut weights = variances.log_weights[*k].clone();
            changes.iter().for_each(|change| weights[change.coordinate] = 1.0);
            let scatter: Vec<f64> = variances.logs.iter().zip(&weights).map(|(v, w)| v / w).collect();
            let (own, _) = whitened(&splits.logs[*k].top, q, &scatter);
            let own = splits.with_slopes(&own, &splits.logs[*k].covariates);
            let all = Mat::from_fn(q, q + m + p + 1, |i, j| match j {
                _ if j < q => own[(i, j)],
                _ if j < q + m => own[(i, changes[j - q].coordinate)] * pattern(&when[j - q], time(k)),
                _ => own[(i, j - q - m)],
            });
            rows.set_rows(at * q, &all);
        }
        let mut priors = variances.of_robot(self.robot);
        priors.extend(changes.iter().map(|change| (FREE * change.size).powi(2)));
        let (rows, logdet) = whitened(&of_stacked(rows), q + m, &priors);
        let (theta, covariance) = (&self.sweep.theta, &self.sweep.covariance);
        let fitted = times(&rows.columns(q + m..q + m + p), theta);
        let misfit = squares(fitted.iter().enumerate().map(|(i, f)| rows[(i, q + m + p)] - f));
        let (Deviation { mean, given, added }, map) =
            deviation(rows.view(), (q + m, q + m), &priors, theta, covariance);
        // Per coordinate what its deviation at the last log is the sum of.
        let parts = |k: usize| {
            let changed = (0..m).filter(move |c| changes[*c].coordinate == k).map(move |c| q + c);
            std::iter::once(k).chain(changed)
        };
        let own = |k: usize, l: usize| {
            let of = |i: usize| parts(l).map(|j| given[(i, j)] + added[(i, j)]).sum::<f64>();
            parts(k).map(of).sum()
        };
        Today {
            deviation: (0..q).map(|k| parts(k).map(|i| mean[i]).sum()).collect(),
            own: Mat::from_fn(q, q, own),
            with_type: Mat::from_fn(q, p, |k, j| parts(k).map(|i| map[(i, j)]).sum()),
            likelihood: -0.5 * (logdet + misfit),
        }
    }
}

/// Patterns that may explain a change as well as its best.
fn patterns(change: &Change) -> Vec<When> {
    let kinds: &[bool] = match change.kind {
        Kind::Either => &[true, false],
        Kind::Step => &[true],
        Kind::Ramp => &[false],
    };
    let date = |i: usize| change.from_s + (change.to_s - change.from_s) * i as f64 / (DATES - 1) as f64;
    let of = |step: &bool| (0..DATES).map(|i| When { step: *step, time_s: date(i) }).collect::<Vec<_>>();
    kinds.iter().flat_map(of).collect()
}

impl Today {
    /// Takes in what patterns of one change leave open. `best`: the deviation by the best of them.
    fn spread_over(&mut self, tried: &[Today], best: &[f64]) {
        let most = tried.iter().map(|t| t.likelihood).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = tried.iter().map(|t| (t.likelihood - most).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let all = || tried.iter().zip(weights.iter().map(|w| w / sum));
        let q = best.len();
        let mean: Vec<f64> = (0..q).map(|k| all().map(|(t, w)| w * t.deviation[k]).sum()).collect();
        for k in 0..q {
            self.deviation[k] += mean[k] - best[k];
            for l in 0..q {
                let of = |(t, w): (&Today, f64)| w * (t.deviation[k] - mean[k]) * (t.deviation[l] - mean[l]);
                self.own[(k, l)] += all().map(of).sum::<f64>();
            }
        }
    }
}
