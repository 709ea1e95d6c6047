//! A robot that has changed, as it is at its last log.

use dynid_linalg::{AsView, Mat};

use crate::data::{Fleet, FleetError};
use crate::drift::Change;
use crate::fit::{FleetFit, RobotFit};
use crate::split::places;
use crate::sweep::{Deviation, Sweep, deviation, whitened};
use crate::triangle::of_stacked;

/// Standard deviation that a change may have beforehand, over its size: as good as none is known.
const FREE: f64 = 1e3;

impl FleetFit {
    /// What is known of a robot at its last log, its changes fitted beside its deviation from the type; at the mean of the covariates.
    ///
    /// Its own logs as [`FleetFit::robots`] has them, with a column more for every change: that of the parameter times the pattern, 1 at the
    /// last log. Logs that stood out by the parameter are logs like the others beside it. `None` without logs.
    ///
    /// # Errors
    /// None that the fit had not.
    pub fn robot_now(
        &self,
        fleet: &Fleet,
        robot: usize,
        changes: &[Change],
    ) -> Result<Option<RobotFit>, FleetError> {
        let splits = &*self.splits;
        let of_robot = &splits.by_robot[robot];
        let last = of_robot.iter().map(|k| fleet.logs[*k].time_s).fold(f64::NEG_INFINITY, f64::max);
        let Some(fit) = self.robots[robot].as_ref().filter(|_| !of_robot.is_empty()) else { return Ok(None) };
        let sweep = Sweep::new(splits, &self.variances, self.prior.as_ref())?;
        let (q, m, p) = (splits.q, changes.len(), splits.parameters());
        let pattern = |change: &Change, t: f64| match change.step {
            true => f64::from(t >= change.time_s),
            false => (t - change.time_s).max(0.0) / (last - change.time_s),
        };
        // Columns: deviation, changes, parameters of the type, effort.
        let mut rows = Mat::zeros(of_robot.len() * q, q + m + p + 1);
        for (at, k) in of_robot.iter().enumerate() {
            let mut weights = self.variances.log_weights[*k].clone();
            changes.iter().for_each(|change| weights[change.coordinate] = 1.0);
            let scatter: Vec<f64> = self.variances.logs.iter().zip(&weights).map(|(v, w)| v / w).collect();
            let (own, _) = whitened(&splits.logs[*k].top, q, &scatter);
            let own = splits.with_slopes(&own, &splits.logs[*k].covariates);
            let time = fleet.logs[*k].time_s;
            let all = Mat::from_fn(q, q + m + p + 1, |i, j| match j {
                _ if j < q => own[(i, j)],
                _ if j < q + m => {
                    let change = &changes[j - q];
                    own[(i, change.coordinate)] * pattern(change, time)
                }
                _ => own[(i, j - q - m)],
            });
            rows.set_rows(at * q, &all);
        }
        let mut variances = self.variances.of_robot(robot);
        variances.extend(changes.iter().map(|change| (FREE * change.size).powi(2)));
        let (rows, _) = whitened(&of_stacked(rows), q + m, &variances);
        let (Deviation { mean, given, added }, map) =
            deviation(rows.view(), (q + m, q + m), &variances, &sweep.theta, &sweep.covariance);
        // Per coordinate what its deviation at the last log is the sum of.
        let parts = |k: usize| {
            let changed = (0..m).filter(move |c| changes[*c].coordinate == k).map(move |c| q + c);
            std::iter::once(k).chain(changed)
        };
        let now: Vec<f64> = (0..q).map(|k| parts(k).map(|i| mean[i]).sum()).collect();
        let own = Mat::from_fn(q, q, |k, l| {
            let of = |i: usize| parts(l).map(|j| given[(i, j)] + added[(i, j)]).sum::<f64>();
            parts(k).map(of).sum()
        });
        let with_type = Mat::from_fn(q, p, |k, j| parts(k).map(|i| map[(i, j)]).sum());
        let (slopes, place) = (q * splits.covariates, places(&splits.order));
        let at = |column: usize| if place[column] < q { place[column] } else { place[column] + slopes };
        let covariance = |a: usize, b: usize| {
            let (i, j) = (at(a), at(b));
            let mut out = sweep.covariance[(i, j)];
            if i < q {
                out -= with_type[(i, j)];
            }
            if j < q {
                out -= with_type[(j, i)];
            }
            if i < q && j < q { out + own[(i, j)] } else { out }
        };
        let columns = splits.order.len();
        let value = |column: usize| {
            let i = at(column);
            sweep.theta[i] + if i < q { now[i] } else { 0.0 }
        };
        Ok(Some(RobotFit {
            values: (0..columns).map(value).collect(),
            covariance: Mat::from_fn(columns, columns, covariance),
            deviation_sd: (0..q).map(|k| own[(k, k)].max(0.0).sqrt()).collect(),
            deviation: now,
            weights: fit.weights.clone(),
        }))
    }
}
