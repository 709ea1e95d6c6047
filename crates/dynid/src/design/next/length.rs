//! The shortest motion: periods and how many of them.

use std::collections::BTreeSet;

use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::{Design, Infeasible, Outcome, Settings};
use dynid_factor::Factor;
use dynid_identify::Log;
use dynid_identify::knowledge::Knowledge;
use dynid_identify::reduction::Reducer;
use dynid_linalg::{Mat, triangular};
use dynid_model::{EffortModel, MotionBlock};
use dynid_motion::JointSignals;
use dynid_motion::trajectory::{Form, FourierTrajectory, RowOrder, Sampled};

use super::super::config::DesignConfig;
use super::super::problem::RobotProblem;
use super::super::{DesignStep, report_samples};
use crate::Error;
use crate::caution::Caution;
use crate::fault::DesignError;

/// Order of the smooth maximum over the wanted intervals.
const ORDER: f64 = 8.0;
/// Periods that are tried, as shares of the longest.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Highest frequency of a motion, as a share of the widest kernel's cut-off, which would take away what lies above.
const IN_BAND: f64 = 0.5;
/// Share of the starts that tell which period is best.
const FIRST_STARTS: usize = 4;
/// Records are looked at that are so many times as long as the longest, for what is not reached.
const BEYOND: f64 = 1e3;
/// Length of the log by which it is told what kernels and masks leave of a motion, s; at least one period.
const REHEARSED_S: f64 = 20.0;
/// Searches for one period, each for as many periods as the one before asked for.
const ROUNDS: usize = 3;

/// A motion with the length that it needs.
pub(super) struct Found {
    pub(super) design: Design,
    pub(super) period_s: f64,
    /// Periods, not whole, after which all is reached, beyond the longest record too; `None`: not within a thousand of these.
    pub(super) periods: Option<f64>,
    /// Fewest periods that logs and motion together want for their intervals, and most that fit into the longest record.
    pub(super) range: (usize, usize),
}

impl Found {
    /// Periods to record.
    pub(super) fn whole(&self) -> usize {
        let (least, most) = self.range;
        self.periods.map_or(most, |periods| whole(periods).clamp(least, most))
    }

    /// Time after which all is reached: in whole periods, and exactly; infinite where it is not.
    fn seconds(&self) -> (f64, f64) {
        let of = |periods: f64| periods * self.period_s;
        let all = |periods: f64| (of(whole(periods).max(self.range.0) as f64), of(periods));
        self.periods.map_or((f64::INFINITY, f64::INFINITY), all)
    }
}

/// Whole periods; a thousandth too much is rounding.
fn whole(periods: f64) -> usize {
    (periods - 1e-3).ceil().max(1.0) as usize
}

/// What the search makes small: the largest deviation of combinations in units of what is wanted of them.
pub(super) fn criterion(wanted: &Mat) -> Criterion {
    Criterion::raw(Measure::Largest { of: wanted.clone(), order: ORDER })
}

/// What a period came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tried {
    pub(super) period_s: f64,
    pub(super) seconds: Option<f64>,
}

/// A search for the shortest motion.
pub(super) struct Lengths<'a> {
    pub(super) config: &'a DesignConfig,
    pub(super) known: &'a Knowledge,
    /// Combinations of the base parameters, a row each, in units of what is wanted.
    pub(super) wanted: Mat,
    pub(super) longest_s: f64,
    /// Reduces motions as it did the logs.
    pub(super) reducer: &'a Reducer,
}

impl Lengths<'_> {
    /// The shortest motion over the periods that are tried, and what each of these came to.
    pub(super) fn shortest(
        &self,
        set: &mut RobotProblem,
        progress: &mut dyn FnMut(DesignStep),
    ) -> Result<(Result<Found, Infeasible>, Vec<Tried>), Error> {
        let longest = self.config.trajectory.period_s;
        let starts = self.config.search.starts;
        let few = starts.div_ceil(FIRST_STARTS).max(2).min(starts);
        let mut tried = Vec::new();
        let mut best: Option<Found> = None;
        for period_s in SHARES.map(|share| share * longest) {
            let highest_hz = self.config.trajectory.harmonics as f64 / period_s;
            let too_fast = highest_hz * self.known.row_spacing_s > 0.25 * IN_BAND && !tried.is_empty();
            if period_s > self.longest_s || too_fast {
                continue;
            }
            let found = match self.with_period(set, period_s, few, progress)? {
                Ok(found) => found,
                // What keeps the longest period from moving keeps shorter ones.
                Err(infeasible) if tried.is_empty() => return Ok((Err(infeasible), tried)),
                Err(_) => continue,
            };
            tried.push(Tried { period_s, seconds: found.periods.map(|n| n * period_s) });
            progress(DesignStep::Length { period_s, periods: found.periods.map(whole) });
            if best.as_ref().is_none_or(|b| found.seconds() < b.seconds()) {
                best = Some(found);
            }
        }
        let Some(first) = best else {
            let shortest = SHARES[SHARES.len() - 1] * longest;
            let expected = format!("at least the shortest period that is tried, {shortest} s");
            return Err(Error::setting("longest", &expected, self.longest_s));
        };
        if few == starts {
            return Ok((Ok(first), tried));
        }
        let from = Some(first.design.coefficients.clone());
        let more = self.search(set, (first.period_s, first.whole()), from, starts, progress)?;
        let found = match more {
            Ok(more) if more.seconds() <= first.seconds() => more,
            _ => first,
        };
        Ok((Ok(found), tried))
    }

    /// Sets the problem to so many periods of a length, beside what is known.
    pub(super) fn pose(&self, set: &mut RobotProblem, period_s: f64, periods: usize) {
        let problem = &mut set.problem;
        problem.base = std::f64::consts::TAU / period_s;
        problem.effective_samples = periods as f64 * period_s / self.known.row_spacing_s;
        problem.prior = Some(self.known.with_prior());
    }

    fn with_period(
        &self,
        set: &mut RobotProblem,
        period_s: f64,
        starts: usize,
        progress: &mut dyn FnMut(DesignStep),
    ) -> Result<Result<Found, Infeasible>, Error> {
        let (least, _) = self.range(period_s);
        let mut best = match self.search(set, (period_s, least), None, starts, progress)? {
            Ok(found) => found,
            Err(infeasible) => return Ok(Err(infeasible)),
        };
        let mut searched = BTreeSet::from([least]);
        while searched.len() < ROUNDS && searched.insert(best.whole()) {
            let from = Some(best.design.coefficients.clone());
            match self.search(set, (period_s, best.whole()), from, starts, progress)? {
                Ok(found) if found.seconds() < best.seconds() => best = found,
                _ => {}
            }
        }
        Ok(Ok(best))
    }

    /// Fewest periods that logs and motion together want for their intervals, and most that fit into the longest record.
    fn range(&self, period_s: f64) -> (usize, usize) {
        let most = (self.longest_s / period_s).floor().max(1.0);
        let least = (self.known.lacking_s / period_s).ceil().clamp(1.0, most);
        (least as usize, most as usize)
    }

    /// Searches for a motion of so many periods of a length, from a given one or from random ones.
    fn search(
        &self,
        set: &mut RobotProblem,
        (period_s, periods): (f64, usize),
        from: Option<Vec<Vec<f64>>>,
        starts: usize,
        progress: &mut dyn FnMut(DesignStep),
    ) -> Result<Result<Found, Infeasible>, Error> {
        self.pose(set, period_s, periods);
        let settings = Settings {
            starts,
            seed: self.config.search.seed,
            time_budget_s: None,
            report_samples: report_samples(self.config),
            from,
        };
        let (mut ended, mut best) = (0, None::<f64>);
        let outcome = dynid_excitation::design(&set.problem, &settings, Vec::new(), &mut |start| {
            ended += 1;
            if start.is_feasible() {
                best = [best, start.criterion].into_iter().flatten().reduce(f64::min);
            }
            progress(DesignStep::Starts { ended, of: starts, best });
        });
        Ok(match outcome.map_err(DesignError::from)? {
            Outcome::Infeasible(infeasible) => Err(infeasible),
            Outcome::Found(design) => {
                let range = self.range(period_s);
                let (one, _) = self.rehearsed(set, period_s, &design.coefficients)?;
                Ok(Found { periods: self.periods(&one, range.1), design, period_s, range })
            }
        })
    }

    /// Information of one period of a motion as the recipe leaves it, and what reducing it gave cause for.
    ///
    /// The log that is reduced holds some periods, without noise: what its ends lose is then little of it.
    pub(super) fn rehearsed(
        &self,
        set: &RobotProblem,
        period_s: f64,
        coefficients: &[Vec<f64>],
    ) -> Result<(Factor, Vec<Caution>), Error> {
        let periods = (REHEARSED_S / period_s).ceil().max(1.0);
        let RobotProblem { problem, model, nominal, .. } = set;
        let base = std::f64::consts::TAU / period_s;
        let order = RowOrder::default();
        let motion = FourierTrajectory::from_rows(base, Form::Plain, &order, coefficients, periods as usize)?;
        let rate_hz = self.reducer.recipe().choices.rate_hz;
        let rows = (periods * period_s * rate_hz).floor() as usize + 1;
        let sampled = Sampled::at_times(&motion, (0..rows).map(|k| k as f64 / rate_hz).collect());
        let block = MotionBlock::plain(rows, &sampled.q, &sampled.dq, &sampled.ddq);
        let mut effort = vec![0.0; model.outputs().len() * rows];
        if let Some(values) = nominal {
            model.efforts(&block, &model.parameters().shape_start(), values, rows, &mut effort);
        }
        let of = |signal: &[f64], k: usize| signal[k * rows..][..rows].to_vec();
        let joints = (problem.coordinates.iter().enumerate())
            .map(|(k, name)| JointSignals {
                name: name.clone(),
                position: of(&sampled.q, k),
                velocity: None,
                effort: of(&effort, k),
            })
            .collect();
        let log = dynid_motion::Log::new("the motion", sampled.time, joints, Vec::new())?;
        let reduced = self.reducer.reduce(Log::new(self.reducer.robot(), log)?)?;
        let share = 1.0 / periods.sqrt();
        Ok((self.known.of_rows(&reduced.groups).scaled(share), reduced.facts.cautions))
    }

    /// Periods after which all is reached.
    fn periods(&self, one: &Factor, most: usize) -> Option<f64> {
        let (earlier, one) = (self.known.with_prior(), one.r_matrix());
        let largest = |periods: f64| largest(&self.wanted, &earlier, &one, periods);
        let (mut low, mut high) = (0.0, most as f64);
        if largest(high) > 1.0 {
            (low, high) = (high, BEYOND * high);
            if largest(high) > 1.0 {
                return None;
            }
        }
        // To a thousandth; information only grows with periods.
        while high - low > 1e-3 * high.clamp(0.1, 1e3) {
            let middle = 0.5 * (low + high);
            if largest(middle) > 1.0 { low = middle } else { high = middle }
        }
        Some(high)
    }
}

/// `max_i f_i (R₀ᵀR₀ + n R₁ᵀR₁)⁻¹ f_iᵀ`.
fn largest(of: &Mat, earlier: &Mat, one: &Mat, periods: f64) -> f64 {
    let n = of.ncols();
    let root = periods.sqrt();
    let mut stacked = Mat::zeros(earlier.nrows() + one.nrows(), n);
    stacked.set_rows(0, earlier);
    stacked.set_rows(earlier.nrows(), &Mat::from_fn(one.nrows(), n, |i, j| root * one[(i, j)]));
    let qr = stacked.qr();
    let r = qr.r();
    let triangle = Mat::from_fn(n, n, |i, j| if i <= j { r[(i, j)] } else { 0.0 });
    let rows = of * &triangular::inverse(&triangle);
    (0..rows.nrows()).map(|i| rows.row(i).map(|x| x * x).sum()).fold(0.0, f64::max)
}
