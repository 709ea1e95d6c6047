//! What a fleet that was fitted says of its type, for estimators that know nothing of robots.

use dynid_factor::Factor;
use dynid_linalg::{AsView, Mat};

use crate::data::{Fleet, FleetError};
use crate::fit::{FleetFit, Found, finish};
use crate::split::{Splits, places};
use crate::sweep::Sweep;
use crate::triangle::triangle;

/// Variance of rows that count for nothing: enough weight is left to tell "too noisy" from "not excited".
const TRACE: f64 = 1e12;

impl FleetFit {
    /// What every robot with logs says of the type, in the order of their keys: its index, and rows `[W y]` of unit variance in the order of
    /// the fleet's columns.
    ///
    /// Deviations of the robot and of its logs are integrated out. Slopes over covariates are at the values found, so that `W θ` is the type at
    /// the mean of the covariates. Merged, and with the prior of the fit beside them, they give [`FleetFit::values`].
    ///
    /// # Errors
    /// None that the fit had not.
    pub fn said_by_robots(&self) -> Result<Vec<(usize, Factor)>, FleetError> {
        let splits = &*self.splits;
        let sweep = Sweep::new(splits, &self.variances, self.prior.as_ref())?;
        let (q, slopes) = (splits.q, splits.q * splits.covariates);
        let (p, place) = (splits.order.len(), places(&splits.order));
        let at = |column: usize| if place[column] < q { place[column] } else { place[column] + slopes };
        let of_robot = |((_, r), (_, rows)): (&(u64, usize), &(u64, Mat))| {
            // The last row of a full triangle is the residual that no parameter of the type explains: it has no variance of one.
            let height = rows.nrows().min(p + slopes);
            let effort = |i: usize| {
                let of_slopes: f64 = (q..q + slopes).map(|j| rows[(i, j)] * sweep.theta[j]).sum();
                rows[(i, p + slopes)] - of_slopes
            };
            let unit = Mat::from_fn(height, p + 1, |i, j| if j < p { rows[(i, at(j))] } else { effort(i) });
            let reduced = triangle(&[unit.view()]);
            let entry = |i: usize, j: usize| if i < reduced.nrows() { reduced[(i, j)] } else { 0.0 };
            let rho = if reduced.nrows() > p { reduced[(p, p)] } else { 0.0 };
            (*r, Factor::from_triangle(p, entry, rho, height))
        };
        Ok(splits.robots.iter().zip(&sweep.factors).map(of_robot).collect())
    }

    /// Parameters of a log: those of its robot, its own deviations, and what its covariates add.
    pub fn values_of_log(&self, fleet: &Fleet, log: usize) -> Option<Vec<f64>> {
        let of = &fleet.logs[log];
        let mut values = self.robots[of.robot].as_ref()?.values.clone();
        for (k, coordinate) in fleet.varying.iter().enumerate() {
            let followed: f64 = (0..fleet.covariates)
                .map(|c| self.slopes[c][k] * (of.covariates[c] - self.covariate_means[c]))
                .sum();
            values[coordinate.column] += self.logs[log].deviation[k] + followed;
        }
        Some(values)
    }

    /// The same fit at the same variances with channels whose rows count for nothing, such as those of an effort that is mostly something
    /// else than the model; `silent`: per channel.
    ///
    /// # Errors
    /// [`FleetError::NotExcited`], [`FleetError::Confounded`].
    pub fn without(&self, fleet: &Fleet, silent: &[bool]) -> Result<FleetFit, FleetError> {
        let mut noise = self.noise.clone();
        for (colour, _) in noise.colours.iter_mut().zip(silent).filter(|(_, silent)| **silent) {
            *colour *= TRACE;
        }
        let found = Found {
            splits: Splits::new(fleet, &noise),
            noise,
            variances: self.variances.clone(),
            robust: self.robust.clone(),
            settled: self.settled,
            prior: self.prior.clone(),
        };
        finish(fleet, found, self.freedom)
    }
}
