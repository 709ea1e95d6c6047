//! The shortest motion: one period, whose length and speed are looked for.

use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::{DEFAULT_SAMPLES_PER_HARMONIC, Design, Infeasible, Outcome, Settings};
use dynid_factor::Factor;
use dynid_identify::Error;
use dynid_identify::Log;
use dynid_identify::caution::Caution;
use dynid_identify::knowledge::Knowledge;
use dynid_identify::reduction::Reducer;
use dynid_linalg::{Mat, triangular};
use dynid_model::{EffortModel, MotionBlock};
use dynid_motion::JointSignals;
use dynid_motion::trajectory::{Form, FourierTrajectory, RowOrder, Sampled};

use super::super::DesignStep;
use super::super::config::DesignConfig;
use super::super::problem::RobotProblem;
use crate::design::DesignError;

/// Order of the smooth maximum over the wanted intervals.
const ORDER: f64 = 8.0;
/// Speeds of motion that are tried: frequencies of harmonics in units of those that the configuration asks for.
const SPEEDS: [f64; 3] = [1.0, 2.0, 4.0];
/// Highest frequency of a motion, as a share of the widest kernel's cut-off, which would take away what lies above.
const IN_BAND: f64 = 0.5;
/// Most harmonics: the search takes a time that goes with their square.
const MOST_HARMONICS: usize = 20;
/// Starts that tell which speed is best, and how long.
const FIRST_STARTS: usize = 2;
/// Searches at one speed, each for the time that the one before asked for.
const ROUNDS: usize = 4;
/// A motion is made shorter where less than this share of it is needed.
const WORTH_SHORTENING: f64 = 0.93;
/// Times are whole parts of a second, so many.
const PARTS_OF_SECOND: f64 = 2.0;
/// Least samples of the motion on which the criterion is reported.
const REPORT_SAMPLES: usize = 1000;
/// Records are looked at that are so many times as long as a motion, for what it does not reach.
const BEYOND: f64 = 1e4;

/// A motion, and how much of it is needed.
pub(super) struct Found {
    pub(super) design: Design,
    pub(super) period_s: f64,
    pub(super) harmonics: usize,
    /// Share of the motion after which all is reached, more than 1 where more of its kind is needed; `None`: not within ten thousand.
    needed: Option<f64>,
    /// What the recipe leaves of its rows.
    pub(super) rows: Factor,
    /// What reducing it gave cause for.
    pub(super) cautions: Vec<Caution>,
}

impl Found {
    fn reaches(&self) -> bool {
        self.needed.is_some_and(|share| share <= 1.0)
    }

    /// Time after which motion of the kind reaches all.
    fn needed_s(&self) -> Option<f64> {
        self.needed.map(|share| share * self.period_s)
    }

    /// What is better is less: the time to record where all is reached, else how many times as much would be needed.
    fn rank(&self) -> (bool, f64, f64) {
        let needed = self.needed.unwrap_or(f64::INFINITY);
        let first = if self.reaches() { self.period_s } else { needed };
        (!self.reaches(), first, needed)
    }
}

/// What the search makes small: the largest deviation of combinations in units of what is wanted of them.
pub(super) fn criterion(wanted: &Mat) -> Criterion {
    Criterion::raw(Measure::Largest { of: wanted.clone(), order: ORDER })
}

/// What a speed of motion came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tried {
    pub(super) highest_hz: f64,
    pub(super) needed_s: Option<f64>,
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
    /// The shortest motion over the speeds that are tried, and what each of these came to.
    pub(super) fn shortest(
        &self,
        set: &mut RobotProblem,
        progress: &mut dyn FnMut(DesignStep),
    ) -> Result<(Result<Found, Infeasible>, Vec<Tried>), Error> {
        let starts = self.config.search.starts;
        let few = FIRST_STARTS.min(starts);
        let mut tried = Vec::new();
        let mut best: Option<Found> = None;
        for highest_hz in self.speeds() {
            let found = match self.at_speed(set, highest_hz, few, progress)? {
                Ok(found) => found,
                // What keeps the slowest from moving keeps faster ones.
                Err(infeasible) if tried.is_empty() => return Ok((Err(infeasible), tried)),
                Err(_) => continue,
            };
            tried.push(Tried { highest_hz, needed_s: found.needed_s() });
            progress(DesignStep::Length { highest_hz, needed_s: found.needed_s() });
            if best.as_ref().is_none_or(|b| found.rank() < b.rank()) {
                best = Some(found);
            }
        }
        let Some(mut best) = best else {
            let least = self.shortest_s(SPEEDS[SPEEDS.len() - 1] * self.slowest_hz());
            let expected = format!("at least {least} s, which {} harmonics take", self.harmonics());
            return Err(Error::setting("longest", &expected, self.longest_s));
        };
        if few < starts {
            // All starts, and once more where they find that less is enough.
            for _ in 0..2 {
                let (period_s, harmonics) = (best.period_s, best.harmonics);
                let from = Some(best.design.coefficients.clone());
                match self.search(set, (period_s, harmonics), from, starts, progress)? {
                    Ok(more) if more.rank() < best.rank() => best = more,
                    _ => {}
                }
                let highest_hz = harmonics as f64 / period_s;
                let Some(shorter) = self.next_length(&best, highest_hz).filter(|t| *t < period_s) else {
                    break;
                };
                let form = (shorter, self.harmonics_of(shorter, highest_hz));
                match self.search(set, form, None, starts, progress)? {
                    Ok(found) if found.rank() < best.rank() => best = found,
                    _ => break,
                }
            }
        }
        Ok((Ok(best), tried))
    }

    /// Sets the problem to a motion of some length, beside what is known.
    pub(super) fn pose(&self, set: &mut RobotProblem, period_s: f64, harmonics: usize) {
        let problem = &mut set.problem;
        problem.base = std::f64::consts::TAU / period_s;
        problem.harmonics = harmonics;
        problem.samples = DEFAULT_SAMPLES_PER_HARMONIC * harmonics;
        problem.effective_samples = period_s / self.known.row_spacing_s;
        problem.prior = Some(self.known.with_prior());
    }

    fn harmonics(&self) -> usize {
        self.config.form().harmonics
    }

    /// The highest frequency that the configuration asks for.
    fn slowest_hz(&self) -> f64 {
        self.harmonics() as f64 / self.config.form().period_s
    }

    /// Highest frequencies of the motions that are tried.
    fn speeds(&self) -> Vec<f64> {
        let in_band = IN_BAND * 0.25 / self.known.row_spacing_s;
        let all = SPEEDS.map(|speed| speed * self.slowest_hz());
        let fits = |hz: &f64| self.shortest_s(*hz) <= self.longest_s;
        let slowest = all.iter().copied().find(fits);
        all.into_iter().filter(|hz| fits(hz) && (*hz <= in_band || Some(*hz) == slowest)).collect()
    }

    /// Shortest motion of a speed: that of as many harmonics as the configuration asks for, and what logs lack in length.
    fn shortest_s(&self, highest_hz: f64) -> f64 {
        let whole = |seconds: f64| (seconds * PARTS_OF_SECOND).ceil() / PARTS_OF_SECOND;
        whole(self.harmonics() as f64 / highest_hz).max(whole(self.known.lacking_s).min(self.longest_s))
    }

    /// Harmonics of a motion of some length and speed.
    fn harmonics_of(&self, period_s: f64, highest_hz: f64) -> usize {
        let wanted = (period_s * highest_hz).round() as usize;
        wanted.clamp(self.harmonics(), MOST_HARMONICS.max(self.harmonics()))
    }

    /// The shortest motion of a speed.
    fn at_speed(
        &self,
        set: &mut RobotProblem,
        highest_hz: f64,
        starts: usize,
        progress: &mut dyn FnMut(DesignStep),
    ) -> Result<Result<Found, Infeasible>, Error> {
        let form = |period_s: f64| (period_s, self.harmonics_of(period_s, highest_hz));
        let mut lengths = vec![self.shortest_s(highest_hz)];
        let mut best = match self.search(set, form(lengths[0]), None, starts, progress)? {
            Ok(found) => found,
            Err(infeasible) => return Ok(Err(infeasible)),
        };
        while let Some(length) = self.next_length(&best, highest_hz)
            && lengths.len() < ROUNDS
            && !lengths.contains(&length)
        {
            lengths.push(length);
            match self.search(set, form(length), None, starts, progress)? {
                Ok(found) if found.rank() < best.rank() => best = found,
                _ => break,
            }
        }
        Ok(Ok(best))
    }

    /// The length that a motion asks for, if it is another one.
    fn next_length(&self, found: &Found, highest_hz: f64) -> Option<f64> {
        let asked = found.needed_s().unwrap_or(f64::INFINITY).min(self.longest_s);
        let length = (asked * PARTS_OF_SECOND).ceil() / PARTS_OF_SECOND;
        let length = length.min(self.longest_s).max(self.shortest_s(highest_hz));
        let differs = length > found.period_s || length < WORTH_SHORTENING * found.period_s;
        differs.then_some(length)
    }

    /// Searches for a motion of some length and number of harmonics, from a given one or from random ones.
    fn search(
        &self,
        set: &mut RobotProblem,
        (period_s, harmonics): (f64, usize),
        from: Option<Vec<Vec<f64>>>,
        starts: usize,
        progress: &mut dyn FnMut(DesignStep),
    ) -> Result<Result<Found, Infeasible>, Error> {
        self.pose(set, period_s, harmonics);
        let settings = Settings {
            starts,
            seed: self.config.search.seed,
            time_budget_s: None,
            report_samples: REPORT_SAMPLES.max(20 * harmonics),
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
                let (rows, cautions) = self.rehearsed(set, period_s, &design.coefficients)?;
                Ok(Found { needed: self.needed(&rows), design, period_s, harmonics, rows, cautions })
            }
        })
    }

    /// Information of a motion as the recipe leaves it, and what reducing it gave cause for: its log without noise is reduced as logs are.
    fn rehearsed(
        &self,
        set: &RobotProblem,
        period_s: f64,
        coefficients: &[Vec<f64>],
    ) -> Result<(Factor, Vec<Caution>), Error> {
        let RobotProblem { problem, model, nominal, .. } = set;
        let base = std::f64::consts::TAU / period_s;
        let order = RowOrder::default();
        let motion = FourierTrajectory::from_rows(base, Form::Plain, &order, coefficients, 1)?;
        let rate_hz = self.reducer.recipe().choices.rate_hz;
        let rows = (period_s * rate_hz).floor() as usize + 1;
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
        Ok((self.known.of_rows(&reduced.groups), reduced.facts.cautions))
    }

    /// Share of a motion after which all is reached.
    fn needed(&self, rows: &Factor) -> Option<f64> {
        let (earlier, rows) = (self.known.with_prior(), rows.r_matrix());
        let largest = |share: f64| largest(&self.wanted, &earlier, &rows, share);
        let (mut low, mut high) = if largest(1.0) > 1.0 { (1.0, BEYOND) } else { (0.0, 1.0) };
        if largest(high) > 1.0 {
            return None;
        }
        // To a thousandth; information only grows with the share.
        while high - low > 1e-3 * high.max(0.1) {
            let middle = if low >= 1.0 { (low * high).sqrt() } else { 0.5 * (low + high) };
            if largest(middle) > 1.0 { low = middle } else { high = middle }
        }
        Some(high)
    }
}

/// `max_i f_i (R₀ᵀR₀ + share R₁ᵀR₁)⁻¹ f_iᵀ`.
fn largest(of: &Mat, earlier: &Mat, rows: &Mat, share: f64) -> f64 {
    let n = of.ncols();
    let root = share.sqrt();
    let mut stacked = Mat::zeros(earlier.nrows() + rows.nrows(), n);
    stacked.set_rows(0, earlier);
    stacked.set_rows(earlier.nrows(), &Mat::from_fn(rows.nrows(), n, |i, j| root * rows[(i, j)]));
    let qr = stacked.qr();
    let r = qr.r();
    let triangle = Mat::from_fn(n, n, |i, j| if i <= j { r[(i, j)] } else { 0.0 });
    let rows = of * &triangular::inverse(&triangle);
    (0..rows.nrows()).map(|i| rows.row(i).map(|x| x * x).sum()).fold(0.0, f64::max)
}
