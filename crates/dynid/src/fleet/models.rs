//! Models that a fleet gives: of the type, and of single robots, with bodies that can exist.
//!
//! What robots say of their type are rows of unit variance ([`FleetFit::said_by_robots`]), which are solved like any others, robots in the
//! place of time blocks. A robot is what its logs and the fleet make of it, `N(x_r, C_x)`, with what all share as the type has it.

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};

use dynid_estimate::metrics::FitSums;
use dynid_factor::Factor;
use dynid_factor::groups::ReducedGroup;
use dynid_fleet::{FleetError, FleetFit};
use dynid_identify::Identification;
use dynid_identify::caution::{self, Caution};
use dynid_identify::preflight::Finding;
use dynid_identify::reduction::{LogFacts, Pooled, TrainedLog};
use dynid_linalg::triangular::solve_lower_in_place;
use dynid_linalg::{Cholesky, Mat};
use dynid_record::Basis;
use rayon::prelude::*;

use super::record::{FleetFile, RobotRecord};
use super::{FleetFault, FleetResult, build, changes_of};
use crate::Error;
use crate::estimate::Estimate;

/// Share of its prior weight that a type has in each of its robots: enough to split what base values leave open as it is split in the type
/// (the solver stops at 1e-6), and too little to draw a second time at what logs tell.
const SPLIT: f64 = 1e-2;
/// Logs differ in what they carry where that scatters by so many standard deviations of one log.
const DIFFERS: f64 = 3.0;
/// What rounding takes from the smallest eigenvalue of a matrix of correlations at least.
const ROUNDING: f64 = 1e-12;
/// Where the pages and records of a fleet tell more.
const LOOK: &str = "`fleet.json` and the page of the fleet tell which robots and logs";

impl FleetResult {
    /// The model that robots of the type share, at the mean of the covariates: bodies that can exist, friction of the middle of the fleet,
    /// intervals by leaving out one robot at a time.
    ///
    /// # Errors
    /// [`Error::Consistency`].
    pub fn type_model(&self, file: &FleetFile) -> Result<Identification, Error> {
        let logs: Vec<usize> = (0..self.fleet.logs.len()).collect();
        let name = format!("{} logs of {} robots", logs.len(), self.fleet.robots.len());
        let mut pooled = self.pooled(&name, &logs, &self.fit.values, Basis::Robots);
        let without = self.without_unexplained(&pooled)?;
        let fit = without.as_deref().unwrap_or(&self.fit);
        if fit.jackknife.is_none() {
            pooled.basis = Basis::Fleet;
        }
        let said = fit.said_by_robots().map_err(|error| self.fault(error))?;
        let delays: Vec<usize> = (self.recipe.columns.len()..self.fleet.columns).collect();
        let of_bodies = |(_, factor): (usize, Factor)| match &delays[..] {
            [] => factor,
            delays => factor.freed_of(delays),
        };
        pooled.blocks = said.into_iter().map(of_bodies).collect();
        pooled.covariance = self.of_efforts(fit.jackknife.as_ref().unwrap_or(&fit.covariance));
        pooled.cautions.extend(file.warnings.iter().map(|w| Caution::warn(caution::FLEET, w, LOOK)));
        pooled.cautions.extend(carried(file));
        self.recipe.solve_pooled(pooled)
    }

    /// The model of one robot, at the mean of the covariates: bodies of its type, and what its own logs and the fleet say of the rest.
    ///
    /// `of_type`: of [`FleetResult::type_model`]. A robot that has changed is what it is at its last log. Cautions tell of changes, and of what
    /// is out of the spread of the fleet.
    ///
    /// # Errors
    /// [`FleetFault::Setting`] for a robot that the fleet does not have; [`Error::Consistency`].
    pub fn robot_model(
        &self,
        file: &FleetFile,
        robot: &RobotRecord,
        of_type: &Identification,
    ) -> Result<Identification, Error> {
        let r = self.built.robots.iter().position(|name| *name == robot.name);
        let Some((r, fitted)) = r.and_then(|r| Some((r, self.robot_fit(r)?))) else {
            let expected = "a robot of the fleet".to_owned();
            return Err(FleetFault::Setting { setting: "robot", expected, found: robot.name.clone() }.into());
        };
        let logs: Vec<usize> =
            (0..self.fleet.logs.len()).filter(|k| self.fleet.logs[*k].robot == r).collect();
        let name = format!("{} logs of {}", logs.len(), robot.name);
        let mut pooled = self.pooled(&name, &logs, &fitted.values, Basis::Fleet);
        let without = match (self.without_unexplained(&pooled)?, changes_of(self.drift.as_ref(), r)) {
            (None, _) => None,
            (Some(fit), []) => fit.robots[r].clone(),
            (Some(fit), changes) => {
                fit.robots_now(&self.fleet, &[(r, changes)]).map_err(|error| self.fault(error))?.remove(0)
            }
        };
        let fitted = without.as_ref().unwrap_or(fitted);
        let p = self.recipe.columns.len();
        let (values, covariance) = (&fitted.values[..p], self.of_efforts(&fitted.covariance));
        let of_type_columns = of_type.base.values(of_type.values());
        let shared: Vec<usize> = self.fleet.shared().into_iter().filter(|c| *c < p).collect();
        let values = given_shared(values, &covariance, &shared, &of_type_columns);
        let rows: usize = pooled.rows.iter().map(ReducedGroup::rows).sum();
        pooled.blocks = vec![around(&values, &covariance, rows)];
        pooled.covariance = covariance;
        let chosen = of_type.consistent.prior_trials.get(of_type.consistent.chosen);
        pooled.prior = chosen.map(|trial| (trial.distance, SPLIT * trial.weight));
        pooled.cautions.extend(reservations(robot));
        pooled.cautions.extend(carried(file));
        self.recipe.solve_pooled(pooled)
    }

    /// [`FleetResult::robot_model`] of several robots, on all threads.
    ///
    /// # Errors
    /// As [`FleetResult::robot_model`].
    pub fn robot_models(
        &self,
        file: &FleetFile,
        robots: &[&RobotRecord],
        of_type: &Identification,
    ) -> Result<Vec<Identification>, Error> {
        robots.par_iter().map(|robot| self.robot_model(file, robot, of_type)).collect()
    }

    /// The result file of a model of this fleet.
    pub fn estimate(&self, model: &Identification) -> Estimate {
        let mut estimate = crate::reduce::estimate(model, &self.recipe);
        if let (Some(settings), Ok(own)) =
            (estimate.provenance.settings.as_object_mut(), serde_json::to_value(&self.settings))
        {
            settings.insert("fleet".to_owned(), own);
        }
        estimate
    }

    /// The fit without the rows of efforts that are mostly something else than the model; `None` where there are none.
    fn without_unexplained(&self, pooled: &Pooled) -> Result<Option<Arc<FleetFit>>, Error> {
        let explained = pooled.explained();
        if explained.iter().all(|e| *e) {
            return Ok(None);
        }
        // Robots mostly share what is not explained with their type. The lock is not held while a fit is made: its threads may take up another robot.
        let known = || self.without.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known().get(&explained).cloned();
        if found.is_some() {
            return Ok(found);
        }
        let scales = self.recipe.choices.scales_hz.len();
        let silent: Vec<bool> =
            (0..self.fleet.channels).map(|c| explained.get(c / scales) == Some(&false)).collect();
        let fit = Arc::new(self.fit.without(&self.fleet, &silent).map_err(|error| self.fault(error))?);
        known().insert(explained, Arc::clone(&fit));
        Ok(Some(fit))
    }

    /// A covariance of columns of the model alone.
    fn of_efforts(&self, covariance: &Mat) -> Mat {
        let p = self.recipe.columns.len();
        Mat::from_fn(p, p, |i, j| covariance[(i, j)])
    }

    fn fault(&self, error: FleetError) -> FleetFault {
        FleetFault::Fit(build::said(&error, &self.built), error)
    }

    /// Figures of logs, each at its own values; blocks and covariance are left empty.
    pub(super) fn pooled(&self, name: &str, logs: &[usize], values: &[f64], basis: Basis) -> Pooled {
        let (outputs, scales) = (self.recipe.outputs.len(), self.recipe.choices.scales_hz.len());
        let p = self.recipe.columns.len();
        let mut left = vec![(0, 0.0); outputs * scales];
        let mut sums = Vec::with_capacity(logs.len());
        for k in logs {
            let own = self.fit.values_of_log(&self.fleet, *k);
            let own = own.as_deref().unwrap_or(values);
            let mut of_log = vec![(0, 0.0); outputs];
            let of_efforts = |c: &&dynid_fleet::ChannelFactor| c.channel < outputs * scales;
            for channel in self.fleet.logs[*k].channels.iter().filter(of_efforts) {
                let x: Vec<f64> = channel.columns.iter().map(|c| own[*c]).collect();
                let (rows, rss) = (channel.factor.rows(), channel.factor.rss(&x));
                let all: &mut (usize, f64) = &mut left[channel.channel];
                (all.0, all.1) = (all.0 + rows, all.1 + rss);
                if channel.channel % scales == 0 {
                    of_log[channel.channel / scales] = (rows, rss);
                }
            }
            sums.push(self.built.facts[*k].row_sums(&of_log));
        }
        // Of these rows nothing is asked but how many they are and what they leave.
        let group = |(channel, (rows, rss)): (usize, &(usize, f64))| ReducedGroup {
            log: 0,
            output: channel / scales,
            scale: channel % scales,
            columns: (0..p).collect(),
            blocks: vec![Factor::from_triangle(p, |_, _| 0.0, rss.sqrt(), *rows)],
        };
        let facts: Vec<&LogFacts> = logs.iter().map(|k| &self.built.facts[*k]).collect();
        Pooled {
            blocks: Vec::new(),
            covariance: Mat::zeros(0, 0),
            basis,
            robots: self.fleet.robots.len(),
            prior: None,
            rows: left.iter().enumerate().map(group).collect(),
            sums: FitSums::pooled(&sums),
            log: as_one(name, self.recipe.choices.rate_hz, &facts),
            findings: findings(&facts),
            cautions: cautions(&facts),
        }
    }
}

/// Values `x` of covariance `c`, those of the shared columns given.
fn given_shared(x: &[f64], c: &Mat, shared: &[usize], values: &[f64]) -> Vec<f64> {
    let n = shared.len();
    let (sd, root) = correlation(n, |i, j| c[(shared[i], shared[j])]);
    let moved = root.solve(&Mat::from_fn(n, 1, |i, _| (values[shared[i]] - x[shared[i]]) / sd[i]));
    let mut out = x.to_vec();
    for (i, x) in out.iter_mut().enumerate() {
        match shared.binary_search(&i) {
            Ok(_) => *x = values[i],
            Err(_) => *x += (0..n).map(|j| c[(i, shared[j])] / sd[j] * moved[(j, 0)]).sum::<f64>(),
        }
    }
    out
}

/// Rows of unit variance whose least squares are `x`, with covariance `c`.
fn around(x: &[f64], c: &Mat, rows: usize) -> Factor {
    let p = x.len();
    let (sd, root) = correlation(p, |i, j| c[(i, j)]);
    let mut inverse = Mat::from_fn(p, p, |i, j| if i == j { sd[i].recip() } else { 0.0 });
    solve_lower_in_place(&root.lower(), &mut inverse);
    let effort = inverse.times(x);
    Factor::from_triangle(p, |i, j| if j < p { inverse[(i, j)] } else { effort[i] }, 0.0, rows)
}

/// Standard deviations of a covariance, and the root of its correlations.
///
/// A covariance is a difference where a prior is weak, of robots out of the spread and of changes, and loses digits there: what is short of a
/// positive definite matrix is added to the diagonal, which makes variances larger, never smaller.
fn correlation(n: usize, covariance: impl Fn(usize, usize) -> f64) -> (Vec<f64>, Cholesky) {
    let sd: Vec<f64> = (0..n).map(|i| covariance(i, i).max(f64::MIN_POSITIVE).sqrt()).collect();
    let mut share = ROUNDING;
    loop {
        let entry = |i: usize, j: usize| match i == j {
            true => 1.0 + share,
            // What is no correlation, or no number, is none.
            false => Some(covariance(i, j) / (sd[i] * sd[j])).filter(|r| r.abs() <= 1.0).unwrap_or(0.0),
        };
        if let Some(root) = Mat::from_fn(n, n, entry).cholesky() {
            return (sd, root);
        }
        // Beyond `n` the diagonal outweighs all else: the loop ends.
        share *= 10.0;
    }
}

/// What speaks against taking the model of a robot as it is.
fn reservations(robot: &RobotRecord) -> Vec<Caution> {
    let changed = robot.changes.iter().map(|c| {
        let message = format!(
            "`{}` of {} has changed by {:+.3e} ± {:.1e} ({}): its value is that at the last log, as a {} explains it",
            c.parameter, robot.name, c.size, c.sd, c.date.text, c.kind
        );
        Caution::warn(caution::FLEET, message, "find the cause, and record the robot again: what changes goes on changing")
    });
    let outside = robot.stands_out.iter().map(|o| {
        let message = format!(
            "`{}` of {} lies {:+.1} standard deviations from the type: the fleet tells nothing of it, its own logs alone do",
            o.parameter, robot.name, o.deviation
        );
        Caution::warn(caution::FLEET, message, "look at the robot and at its logs")
    });
    changed.chain(outside).collect()
}

/// What logs carried is in the link of a model, in the mean; nothing of it where all carried the same.
fn carried(file: &FleetFile) -> Option<Caution> {
    let payload = file.payload.as_ref()?;
    let differs = |k: usize| {
        let mut sds: Vec<f64> = payload.logs.iter().map(|log| log.sd[k]).collect();
        sds.sort_by(f64::total_cmp);
        payload.parameters[k].between_logs > DIFFERS * sds.get(sds.len() / 2).copied().unwrap_or(0.0)
    };
    let link = &payload.link;
    (0..payload.parameters.len()).any(differs).then(|| {
        let message = format!("logs carried different bodies on `{link}`: its parameters hold what they carried in the mean");
        let remedy = format!(
            "take off what a log that carried nothing has less (`payload` of `fleet.json`), before a file states `{link}` alone"
        );
        Caution::warn(caution::PAYLOAD, message, remedy)
    })
}

/// Logs as if they were one; `rate_hz`: that at which delays are told.
fn as_one(name: &str, rate_hz: f64, facts: &[&LogFacts]) -> TrainedLog {
    let logs = || facts.iter().map(|facts| &facts.log);
    let outputs = logs().next().map_or(0, |log| log.moves.len());
    let median = |of: &dyn Fn(&TrainedLog) -> f64| {
        let mut all: Vec<f64> = logs().map(of).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    };
    let wider = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
    let mut channels: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for (name, low, high) in logs().flat_map(|log| &log.channels) {
        let range = channels.entry(name).or_insert((*low, *high));
        *range = wider(*range, (*low, *high));
    }
    TrainedLog {
        name: name.to_owned(),
        samples: logs().map(|log| log.samples).sum(),
        duration_s: logs().map(|log| log.duration_s).sum(),
        rate_hz,
        repeats_after_s: None,
        same_motion_as: None,
        position_noise: (0..outputs).map(|j| median(&|log| log.position_noise[j])).collect(),
        effort_noise: (0..outputs).map(|j| median(&|log| log.effort_noise[j])).collect(),
        moves: (0..outputs).map(|j| logs().any(|log| log.moves[j])).collect(),
        velocities: (0..outputs).map(|j| logs().filter_map(|log| log.velocities[j]).reduce(wider)).collect(),
        channels: channels.into_iter().map(|(name, (low, high))| (name.to_owned(), low, high)).collect(),
    }
}

/// What the pre-flights of logs found: of every kind at a joint the first, and in how many logs more it is.
fn findings(facts: &[&LogFacts]) -> Vec<Finding> {
    let of_log = |facts: &&LogFacts| -> Vec<Finding> {
        facts.findings.iter().map(|found| found.finding(&facts.name, 0)).collect()
    };
    let alike = |a: &Finding, b: &Finding| (a.id, a.severity, &a.joint) == (b.id, b.severity, &b.joint);
    let told = |found: &mut Finding, more: usize| found.evidence += &format!(" (and {more} logs more)");
    first_of_a_kind(facts.iter().flat_map(of_log), alike, told)
}

/// What reading and motion of logs gave cause for: of every kind the first, and in how many logs more it is.
fn cautions(facts: &[&LogFacts]) -> Vec<Caution> {
    let alike = |a: &Caution, b: &Caution| (&a.name, &a.remedy) == (&b.name, &b.remedy);
    let told =
        |caution: &mut Caution, more: usize| caution.message += &format!(" (and {more} more of the kind)");
    first_of_a_kind(facts.iter().flat_map(|facts| facts.cautions.iter().cloned()), alike, told)
}

/// The first of every kind; `told`: says of one how many more there are.
fn first_of_a_kind<T>(
    all: impl Iterator<Item = T>,
    alike: impl Fn(&T, &T) -> bool,
    told: impl Fn(&mut T, usize),
) -> Vec<T> {
    let mut kinds: Vec<(T, usize)> = Vec::new();
    for one in all {
        match kinds.iter_mut().find(|(first, _)| alike(first, &one)) {
            Some((_, more)) => *more += 1,
            None => kinds.push((one, 0)),
        }
    }
    kinds.iter_mut().filter(|(_, more)| *more > 0).for_each(|(first, more)| told(first, *more));
    kinds.into_iter().map(|(first, _)| first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Covariances that lost their digits to a weak prior, or that are none, make no panic; sound ones are taken as they are.
    #[test]
    fn rows_stand_for_a_covariance_whatever_rounding_left_of_it() {
        let sound = Mat::from_fn(2, 2, |i, j| if i == j { [4.0, 1e-6][i] } else { 1e-3 });
        let x = [1.0, -2.0];
        let factor = around(&x, &sound, 10);
        for (found, expected) in factor.solve().iter().zip(x) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        let r = factor.r_matrix();
        let information = (r.transpose() * &r).lu().inverse();
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            let (found, expected) = (information[(i, j)], sound[(i, j)]);
            assert!((found - expected).abs() < 1e-8 * expected, "{found} {expected}");
        }
        // Correlations of 1 beside one of -1, a variance below zero, no number.
        let indefinite =
            Mat::from_fn(3, 3, |i, j| if (i, j) == (0, 2) || (i, j) == (2, 0) { -1.0 } else { 1.0 });
        let negative = Mat::from_fn(2, 2, |i, j| if i == j { [1.0, -1e-20][i] } else { 0.0 });
        let none = Mat::from_fn(2, 2, |_, _| f64::NAN);
        for c in [indefinite, negative, none] {
            let n = c.nrows();
            assert!(around(&vec![0.0; n], &c, 10).effort_norm().is_finite());
            assert_eq!(given_shared(&vec![0.0; n], &c, &[], &vec![0.0; n]), vec![0.0; n]);
        }
    }
}
