//! From a robot and logs to parameters, each with an interval and a verdict.
//!
//! 1. [Linear start](crate::start), then [output error](crate::fit) of the plain law: rotor inertia, viscous and Coulomb friction,
//!    delay, and position gains where they are not known.
//! 2. Readings that stand out alone of what that misses are left out.
//! 3. Efforts and currents that were measured, as far as they are those of the drives that the positions tell: they join the sum of squares, each
//!    weighted by its own noise.
//! 4. Bodies, where they are to be found: they deviate from those of the robot file as far as folds that were not fitted ask for it.
//! 5. Gears that give way, where they are to be found.
//! 6. [`Addition`]s one by one, as far as they predict folds of the logs that they were not fitted to.
//! 7. The step of the simulation is halved until it does not matter. Where nothing but rounding is left, encoders that stand still count less, row by
//!    row, and the step is halved once more.
//! 8. Intervals: block jackknife, and what the estimate moves by under half the step, without folds of the logs, under richer laws and
//!    other gains ([`Spread`]). Where the model is wrong these decide.
//! 9. Verdicts and groups of parameters that only act together.

mod bodies;
mod channels;
mod efforts;
mod gears;
mod outliers;
mod result;
mod verdict;

use bodies::FoundBodies;
use std::collections::BTreeSet;

use dynid_model::Mechanism;

use crate::chain::Chain;
use crate::channel::Channel;
use crate::fit::{Block, Evaluation, Fitted, GaussNewton, ServoProblem, blocks, deviations, fit, readings};
use crate::free::{Free, ServoValues};
use crate::joint::Scheme;
use crate::log::ServoLog;
use crate::measured::Measured;
use crate::rollout::Lost;
use crate::settings::{Addition, Bodies, Choice, ServoSettings};
use crate::start::{StartSettings, linear_start};
use crate::term::Term;
pub use result::{
    AdditionTrial, BodyTrial, DirectionTrial, EffortUse, EffortVerdict, GroupKind, HorizonError, Outliers,
    ServoBody, ServoError, ServoGroup, ServoIdentification, ServoParameter, ServoVerdict, Spread,
    TOLD_DIRECTION,
};
pub(crate) use verdict::groups;
use verdict::parameters;

/// Folds of the logs that additions are judged on.
const FOLDS: usize = 3;

/// Least gain of the held-out error that takes an addition which does not win on every fold.
const LEAST_GAIN: f64 = 0.02;

/// Least gain of the held-out error that takes an addition which wins on every fold.
const LEAST_SURE_GAIN: f64 = 0.005;

/// Share of the residual that half the step may move the simulation by.
const STEP_SHARE: f64 = 0.1;

/// Halvings of the step at most.
const HALVINGS: usize = 4;

/// Fits that leave a fold out begin at the estimate of all: a few steps are enough.
const OF_FOLDS: GaussNewton = GaussNewton { evaluations: 4, tolerance: 1e-3, reweighted: 0 };

/// Residual over the encoder's rounding from which the model counts as wrong.
pub const MISFIT: f64 = 1.3;

/// Time from which an encoder that stands still says less with every row, s: a joint at 0.03 rad/s moves by two steps of an encoder of 12 bits.
const STILL_S: f64 = 0.1;

/// Relative half width of an interval up to which a scale is no open one.
const SETTLED_SCALE: f64 = 0.1;

/// Rows that a log needs at least.
pub const LEAST_ROWS: usize = 50;

/// Sweeps over the joints whose directions are looked for.
const SWEEPS: usize = 3;

/// Identifies a robot on a fixed base from commands and positions, and efforts or currents where logs have them.
///
/// # Errors
/// [`ServoError`].
pub fn identify(
    mechanism: &Mechanism,
    logs: &[ServoLog],
    settings: &ServoSettings,
) -> Result<ServoIdentification, ServoError> {
    check(mechanism, logs, settings)?;
    let chains = Chain::all(mechanism);
    let mut known = ServoValues { joints: settings.joints.clone(), inertias: mechanism.inertia_vector() };
    if settings.find.contains(&Term::RateLimit) {
        // A limit that the fastest command reaches: one that is never reached has no slope.
        for (j, joint) in known.joints.iter_mut().enumerate() {
            let speed = |log: &ServoLog| {
                let pairs = log.time.windows(2).zip(log.command[j].windows(2));
                pairs.map(|(t, u)| ((u[1] - u[0]) / (t[1] - t[0])).abs()).fold(0.0, f64::max)
            };
            let fastest = logs.iter().map(speed).fold(0.0, f64::max);
            joint.set(Term::RateLimit, (0.8 * fastest).max(1e-3));
        }
    }
    let period = logs.iter().map(ServoLog::period).fold(0.0_f64, f64::max);
    let mut work = Work {
        chains: &chains,
        logs: logs.to_vec(),
        settings,
        channels: vec![Channel::Position],
        measured: Measured::none(settings.joints.len()),
        efforts: Vec::new(),
        outliers: Vec::new(),
        by_span: Vec::new(),
        bodies: Vec::new(),
        gears: Vec::new(),
        settle_s: logs.iter().map(|log| log.settle_s).collect(),
        blocks: blocks(logs, settings.blocks),
        // A clock that jitters a little is no reason for another step.
        scheme: Scheme {
            step_s: settings.step_s.unwrap_or(1.1 * period),
            sign_width: 0.0,
            middle: true,
            load: settings.load,
            hold: settings.hold,
            effort_at: settings.effort_at,
            effort_span_s: period,
        },
        evaluations: 0,
    };
    let own_gains = settings.own_gains.then_some(Addition::OwnGains);
    let plain = settings.free(&chains, &own_gains.into_iter().collect(), &work.measured);
    let mut laws: BTreeSet<Addition> = match &settings.choice {
        Choice::HeldOut => BTreeSet::new(),
        Choice::Given(given) => given.iter().copied().collect(),
    };
    if settings.own_gains {
        laws.insert(Addition::OwnGains);
    }
    let directions = work.directions(&mut known, &plain, &laws)?;
    let start = work.start(&known, &plain)?;
    let begin = work.begin(&start.values, &laws, None);
    work.forget_starts(&begin);
    work.follow_gears(&begin);
    let mut free = work.free(&laws);
    let mut fitted = work.first_fit(&free, begin, &GaussNewton::default())?;
    if work.leave_out(&fitted, 0)? {
        fitted = work.refit(&free, &fitted.values, work.scheme, &GaussNewton::default())?;
    }
    work.take_channels(&free, &mut fitted)?;
    if work.channels.len() > 1 {
        free = work.free(&laws);
        fitted = work.fit_channels(&free, &fitted.values)?;
        if work.leave_out(&fitted, 1)? {
            fitted = work.refit(&free, &fitted.values, work.scheme, &GaussNewton::default())?;
        }
    }
    let mut trials = Vec::new();
    let mut richer = Vec::new();
    // One measure of all laws: by joint the residual of the first.
    let sigma: Vec<f64> =
        fitted.evaluation.variances(&|_| true).iter().map(|s| s.sqrt().max(1e-12)).collect();
    let mut folds = work.held_out(&free, &fitted, &sigma);
    let mut of_bodies = FoundBodies::default();
    if settings.bodies == Bodies::Found {
        of_bodies = work.find_bodies(mechanism, &laws, &mut fitted, &mut folds, &sigma)?;
    }
    if settings.find.iter().any(|t| t.is_of_gear()) {
        work.find_gears(&laws, &mut fitted, &mut folds, &sigma)?;
    }
    if settings.choice == Choice::HeldOut {
        loop {
            let round = work.round(&laws, &fitted, &folds, &sigma);
            trials.extend(round.iter().map(|t| t.trial.clone()));
            let Some(at) = round.iter().position(|t| t.trial.taken) else {
                richer = round;
                break;
            };
            laws.insert(round[at].trial.addition);
            fitted = work.fit(&laws, &round[at].fitted.values)?;
            folds = round[at].folds.clone();
        }
    }
    let other_step = work.settle_step(&laws, &mut fitted)?;
    if richer.is_empty() && is_wrong(work.misfit(&fitted)) {
        // A law that is stated has neighbours all the same.
        richer = work.neighbours(&laws, &fitted, &sigma);
    }
    let found = work.judge(mechanism, laws, fitted, (trials, &richer), &other_step, start)?;
    let FoundBodies { trials: body_trials, repairs: body_repairs } = of_bodies;
    Ok(ServoIdentification { directions, body_trials, body_repairs, ..found })
}

fn check(mechanism: &Mechanism, logs: &[ServoLog], settings: &ServoSettings) -> Result<(), ServoError> {
    let n = mechanism.rates();
    let demand = |what: &str, found: usize| {
        if found == n {
            Ok(())
        } else {
            Err(ServoError::Joints { what: what.to_owned(), expected: n, found })
        }
    };
    demand("settings", settings.joints.len())?;
    for log in logs {
        demand(&log.name, log.joints())?;
        for channel in [Channel::Velocity, Channel::Effort, Channel::Current] {
            let rows = (0..n).filter_map(|j| log.measured(channel, j)).find(|v| v.len() != log.rows());
            if let Some(values) = rows {
                let (log, expected, found) = (log.name.clone(), log.rows(), values.len());
                return Err(ServoError::Rows { log, channel: channel.name(), expected, found });
            }
        }
        if log.rows() < LEAST_ROWS {
            let (expected, found) = (LEAST_ROWS, log.rows());
            return Err(ServoError::Short { log: log.name.clone(), expected, found });
        }
    }
    if logs.is_empty() {
        return Err(ServoError::Short { log: "no log".to_owned(), expected: LEAST_ROWS, found: 0 });
    }
    Ok(())
}

/// An addition that was fitted and scored.
struct Tried {
    trial: AdditionTrial,
    fitted: Fitted,
    free: Vec<Free>,
    folds: Folds,
    /// Loss over that without it.
    gain: f64,
}

/// An estimate with another step of the simulation: half of it, or twice.
struct OtherStep {
    estimate: Vec<f64>,
    /// Error of the chosen step over what the estimate moves by: of second order, four thirds with half of it; with twice a third, counted thrice.
    error: f64,
    /// RMS by which half the step moves the readings, over that of the residual.
    share: f64,
}

/// Fits that leave a fold out each.
#[derive(Debug, Clone, Default)]
struct Folds {
    errors: Vec<f64>,
    estimates: Vec<Vec<f64>>,
}

struct Work<'a> {
    chains: &'a [Chain],
    logs: Vec<ServoLog>,
    settings: &'a ServoSettings,
    /// What the sum of squares holds.
    channels: Vec<Channel>,
    measured: Measured,
    efforts: Vec<EffortUse>,
    outliers: Vec<Outliers>,
    /// What parameters move by with the time over which efforts are read, where the logs do not tell it.
    by_span: Vec<(Free, f64)>,
    /// Numbers of bodies that deviate.
    bodies: Vec<Free>,
    /// Terms of gears that give way.
    gears: Vec<Free>,
    /// Least time behind the beginning of a rollout that no sum holds, by log.
    settle_s: Vec<f64>,
    blocks: Vec<Block>,
    scheme: Scheme,
    evaluations: usize,
}

impl Work<'_> {
    /// Start of a law from an estimate of the law that it is added to.
    fn begin(&self, from: &ServoValues, laws: &BTreeSet<Addition>, new: Option<Addition>) -> ServoValues {
        let mut out = from.clone();
        let added = |a: Addition| new.map_or(laws.contains(&a), |n| n == a);
        for joint in &mut out.joints {
            let coulomb = joint.get(Term::Coulomb);
            if added(Addition::Stiction) {
                // A peak of a tenth, so that the Stribeck velocity has a slope.
                joint.set(Term::Stiction, 0.1 * coulomb.max(1e-3));
                joint.set(Term::StribeckVelocity, 0.1);
            }
            if added(Addition::Load) {
                joint.set(Term::LoadFriction, 0.02);
            }
        }
        out
    }

    fn start(&self, known: &ServoValues, plain: &[Free]) -> Result<crate::start::LinearStart, ServoError> {
        linear_start(self.chains, &self.logs, known, plain, self.scheme, &StartSettings::default())
            .map_err(|source| ServoError::Signal { log: self.logs[0].name.clone(), source })
    }

    /// Turns directions that are to be found, one joint after the other, as long as the logs are met better. The mirror image of all
    /// joints that gravity tells apart has a negative gain, which no fit takes.
    fn directions(
        &mut self,
        known: &mut ServoValues,
        plain: &[Free],
        laws: &BTreeSet<Addition>,
    ) -> Result<Vec<DirectionTrial>, ServoError> {
        let asked: Vec<usize> =
            (0..known.joints.len()).filter(|j| self.settings.find_direction[*j]).collect();
        if asked.is_empty() {
            return Ok(Vec::new());
        }
        let mut with = laws.clone();
        with.insert(Addition::Zero);
        let free = self.free(&with);
        let short = GaussNewton { evaluations: 14, tolerance: 1e-3, ..GaussNewton::default() };
        let fit_of = |work: &mut Self, known: &ServoValues| -> Result<Fitted, ServoError> {
            let start = work.start(known, plain)?;
            let begin = work.begin(&start.values, &with, None);
            Ok(work.first_fit(&free, begin, &short)?)
        };
        let mut best = fit_of(self, known)?;
        let mut out = Vec::new();
        for _ in 0..SWEEPS {
            let mut turned = false;
            out.clear();
            for j in &asked {
                let mut other = known.clone();
                other.joints[*j].direction = -other.joints[*j].direction;
                let fitted = fit_of(self, &other);
                // By one measure: the residuals of the better fit so far.
                let sigma = &best.evaluation.variances(&|_| true);
                let sigma: Vec<f64> = sigma.iter().map(|s| s.sqrt().max(1e-12)).collect();
                let loss = |f: &Fitted| f.evaluation.loss(&sigma, &|_| true);
                let ratio = fitted.as_ref().map_or(f64::INFINITY, |f| (loss(f) / loss(&best)).sqrt());
                let direction = known.joints[*j].direction;
                match fitted {
                    Ok(fitted) if ratio * TOLD_DIRECTION < 1.0 => {
                        *known = other;
                        best = fitted;
                        turned = true;
                        out.push(DirectionTrial { joint: *j, direction: -direction, other: 1.0 / ratio });
                    }
                    _ => out.push(DirectionTrial { joint: *j, direction, other: ratio }),
                }
            }
            if !turned {
                break;
            }
        }
        Ok(out)
    }

    fn problem<'b>(&'b self, free: &'b [Free], scheme: Scheme) -> ServoProblem<'b> {
        ServoProblem {
            chains: self.chains,
            logs: &self.logs,
            scheme,
            free,
            channels: &self.channels,
            blocks: &self.blocks,
        }
    }

    fn free(&self, laws: &BTreeSet<Addition>) -> Vec<Free> {
        let mut free = self.settings.free(self.chains, laws, &self.measured);
        // Of what gears say of a joint's rotor.
        free.retain(|f| !self.gears.iter().any(|g| g.target == f.target));
        // Bodies stand last: what is said of them is taken off the end.
        free.extend(self.gears.iter().chain(&self.bodies).cloned());
        free
    }

    fn fit(&mut self, laws: &BTreeSet<Addition>, start: &ServoValues) -> Result<Fitted, Lost> {
        let free = self.free(laws);
        self.refit(&free, start, self.scheme, &GaussNewton::default())
    }

    fn refit(
        &mut self,
        free: &[Free],
        start: &ServoValues,
        scheme: Scheme,
        settings: &GaussNewton,
    ) -> Result<Fitted, Lost> {
        let fitted = fit(&self.problem(free, scheme), start, settings, &|_| true)?;
        self.evaluations += fitted.evaluations;
        Ok(fitted)
    }

    /// A fit from a linear start; where signs or units are wrong that is no start, and one that is stable takes its place.
    fn first_fit(
        &mut self,
        free: &[Free],
        begin: ServoValues,
        settings: &GaussNewton,
    ) -> Result<Fitted, Lost> {
        let scheme = self.scheme;
        self.refit(free, &begin, scheme, settings)
            .or_else(|_| self.refit(free, &tame(begin, free), scheme, settings))
    }

    /// The fold that a block belongs to: whole logs where there are enough, else thirds of the time.
    fn fold(&self, block: usize) -> usize {
        if self.logs.len() >= FOLDS {
            self.blocks[block].log % FOLDS
        } else {
            block * FOLDS / self.blocks.len()
        }
    }

    /// Fits that leave a fold out each, and their errors on it in units of `sigma`; `NaN` where the simulation gets lost.
    fn held_out(&mut self, free: &[Free], fitted: &Fitted, sigma: &[f64]) -> Folds {
        let mut out = Folds::default();
        for fold in 0..FOLDS {
            let problem = self.problem(free, self.scheme);
            let other = fit(&problem, &fitted.values, &OF_FOLDS, &|b| self.fold(b) != fold);
            let Ok(other) = other else {
                out.errors.push(f64::NAN);
                continue;
            };
            self.evaluations += other.evaluations;
            let squares = other.evaluation.mean_squares(&|b| self.fold(b) == fold);
            let scaled = squares.iter().zip(sigma).map(|(s, sd)| s / (sd * sd));
            out.errors.push((scaled.sum::<f64>() / sigma.len() as f64).sqrt());
            out.estimates.push(other.estimate);
        }
        out
    }

    /// Fits every addition that is not there yet, and scores them on held-out folds from the one that gains most on all logs, up to the
    /// first that is taken.
    fn round(
        &mut self,
        laws: &BTreeSet<Addition>,
        fitted: &Fitted,
        before: &Folds,
        sigma: &[f64],
    ) -> Vec<Tried> {
        let mut out = self.neighbours(laws, fitted, sigma);
        for tried in &mut out {
            // What does not gain on the logs that it is fitted to gains nowhere.
            if tried.gain.is_nan() || tried.gain > (1.0 - LEAST_SURE_GAIN).powi(2) {
                continue;
            }
            tried.folds = self.held_out(&tried.free, &tried.fitted, sigma);
            let (after, before) = (&tried.folds.errors, &before.errors);
            tried.trial.ratios = after.iter().zip(before).map(|(a, b)| a / b).collect();
            let mean = after.iter().sum::<f64>() / before.iter().sum::<f64>();
            let wins = tried.trial.ratios.iter().all(|r| *r < 1.0) && mean < 1.0 - LEAST_SURE_GAIN;
            // Gains of their own predict better and mean less: gain, gravity and zero of a joint trade off.
            let taken = wins || mean < 1.0 - LEAST_GAIN;
            if taken && tried.trial.addition != Addition::OwnGains {
                tried.trial.taken = true;
                break;
            }
        }
        out
    }

    /// Fits every addition that is not there yet, from the one that gains most on; losses are measured by `sigma`.
    fn neighbours(&mut self, laws: &BTreeSet<Addition>, fitted: &Fitted, sigma: &[f64]) -> Vec<Tried> {
        let without = fitted.evaluation.loss(sigma, &|_| true);
        let short = GaussNewton { evaluations: 8, tolerance: 1e-3, ..GaussNewton::default() };
        let mut out = Vec::new();
        for addition in Addition::ALL {
            if !self.applies(addition, laws) {
                continue;
            }
            let mut with = laws.clone();
            with.insert(addition);
            let begin = self.begin(&fitted.values, &with, Some(addition));
            let free = self.free(&with);
            let Ok(fitted) = self.refit(&free, &begin, self.scheme, &short) else { continue };
            let gain = fitted.evaluation.loss(sigma, &|_| true) / without;
            let beside = laws.iter().copied().collect();
            let trial = AdditionTrial { beside, addition, ratios: Vec::new(), taken: false };
            out.push(Tried { trial, fitted, free, folds: Folds::default(), gain });
        }
        out.sort_by(|a, b| a.gain.total_cmp(&b.gain));
        out
    }

    /// Whether an addition is to be tried beside these. Offset and zero act alike where a joint moves in few postures: one of them is
    /// taken by itself, both on request.
    fn applies(&self, addition: Addition, laws: &BTreeSet<Addition>) -> bool {
        let s = self.settings;
        !laws.contains(&addition)
            && match addition {
                Addition::OwnGains => s.known_gain.iter().filter(|k| !**k).count() > 1,
                Addition::Zero => !laws.contains(&Addition::Offset) && s.known_zero.iter().any(|k| !k),
                Addition::Offset => !laws.contains(&Addition::Zero),
                _ => true,
            }
    }

    /// Residual over the encoders' rounding, the median over joints whose step is known.
    fn misfit(&self, fitted: &Fitted) -> f64 {
        let floors =
            (0..fitted.values.joints.len()).map(|j| self.logs.iter().map(|l| l.floor(j)).fold(0.0, f64::max));
        let squares = fitted.evaluation.mean_squares(&|_| true);
        let told = squares.iter().zip(floors).filter(|(_, floor)| *floor > 0.0);
        median(told.map(|(s, floor)| s.sqrt() / floor).collect())
    }

    /// Halves the step until the simulation hardly moves. Where nothing but rounding is left of the readings, rests of the encoders then count
    /// once, and the step is halved once more, since the intervals are narrower than the error of the step.
    fn settle_step(
        &mut self,
        laws: &BTreeSet<Addition>,
        fitted: &mut Fitted,
    ) -> Result<OtherStep, ServoError> {
        let free = self.free(laws);
        let half = |scheme: Scheme| Scheme { step_s: 0.5 * scheme.step_s, ..scheme };
        let mut share = 0.0;
        for round in 0..=HALVINGS {
            share = self.step_share(fitted)?;
            if self.settings.step_s.is_some() || share <= STEP_SHARE || round == HALVINGS {
                break;
            }
            self.scheme = half(self.scheme);
            *fitted = self.refit(&free, &fitted.values, self.scheme, &GaussNewton::default())?;
        }
        let right = !is_wrong(self.misfit(fitted));
        if right {
            self.logs.iter_mut().for_each(|log| log.still_s = STILL_S);
            *fitted = self.refit(&free, &fitted.values, self.scheme, &GaussNewton::default())?;
        }
        if right && self.settings.step_s.is_none() {
            let estimate = fitted.estimate.clone();
            self.scheme = half(self.scheme);
            *fitted = self.refit(&free, &fitted.values, self.scheme, &GaussNewton::default())?;
            return Ok(OtherStep { estimate, error: 1.0, share: self.step_share(fitted)? });
        }
        let short = GaussNewton { evaluations: 5, tolerance: 1e-6, reweighted: 0 };
        let finer = self.refit(&free, &fitted.values, half(self.scheme), &short)?;
        Ok(OtherStep { estimate: finer.estimate, error: 4.0 / 3.0, share })
    }

    /// RMS by which half the step moves the readings, over that of the residual: of the channel that it moves most.
    fn step_share(&mut self, fitted: &Fitted) -> Result<f64, Lost> {
        let fine = Scheme { step_s: 0.5 * self.scheme.step_s, ..self.scheme };
        let coarse = readings(&self.problem(&[], self.scheme), &fitted.values)?;
        let fine = readings(&self.problem(&[], fine), &fitted.values)?;
        self.evaluations += 2;
        let moved: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| mean_square_between(a, b)).collect();
        let residual = fitted.evaluation.mean_squares(&|_| true);
        let n = fitted.values.joints.len();
        let of_channel = |all: &[f64], c: usize| all[c * n..(c + 1) * n].iter().sum::<f64>();
        let share = |c: usize| (of_channel(&moved, c) / of_channel(&residual, c)).sqrt();
        Ok((0..self.channels.len()).map(share).fold(0.0, f64::max))
    }

    /// Intervals, verdicts, groups and errors of the chosen law.
    fn judge(
        mut self,
        mechanism: &Mechanism,
        laws: BTreeSet<Addition>,
        fitted: Fitted,
        (trials, richer): (Vec<AdditionTrial>, &[Tried]),
        other_step: &OtherStep,
        start: crate::start::LinearStart,
    ) -> Result<ServoIdentification, ServoError> {
        let free = self.free(&laws);
        let n = mechanism.rates();
        let squares = fitted.evaluation.mean_squares(&|_| true);
        let rms: Vec<f64> = squares[..n].iter().map(|s| s.sqrt()).collect();
        let floor: Vec<f64> =
            (0..n).map(|j| self.logs.iter().map(|l| l.floor(j)).fold(0.0, f64::max)).collect();
        let misfit = self.misfit(&fitted);
        let found = deviations(&self.problem(&free, self.scheme), &fitted);
        let mut spreads = self.spreads(&free, &fitted, (richer, other_step), is_wrong(misfit))?;
        for (i, k) in found.inside.iter().enumerate() {
            spreads[*k].knowledge = found.by_knowledge[(i, i)].sqrt();
        }
        let mut groups = groups(&free, &found.inside, &found.correlation);
        let spreads = (spreads.as_slice(), other_step.error);
        let mut parameters = parameters(&free, &fitted, &found, &groups, spreads, self.settings, &self.logs);
        let bodies = verdict::bodies(&parameters, &fitted, &found);
        parameters.truncate(free.len() - self.bodies.len());
        // A scale that measured efforts tell well is none that is open, however much it moves its members together.
        let settled = |k: &usize| {
            let p = &parameters[*k];
            let narrow = p.half_width.is_some_and(|half| half <= SETTLED_SCALE * p.value.abs());
            narrow && p.free.joints().iter().any(|j| self.measured.any(*j))
        };
        let scaled = |k: &&usize| free[**k].as_term().is_some_and(Term::scales_with_effort);
        groups.retain(|g| g.kind != GroupKind::Scale || !g.members.iter().filter(scaled).all(settled));
        let mut horizons = Vec::new();
        for horizon_s in [0.1, 0.5, 2.0, f64::INFINITY] {
            horizons.push(HorizonError { horizon_s, rms: self.horizon(&fitted, horizon_s)? });
        }
        let of_log = |l: usize| -> Vec<f64> {
            let squares = fitted.evaluation.mean_squares(&|b| self.blocks[b].log == l);
            squares[..n].iter().map(|s| s.sqrt()).collect()
        };
        let count = fitted.evaluation.count;
        Ok(ServoIdentification {
            chains: self.chains.to_vec(),
            parameters,
            groups,
            additions: laws.into_iter().collect(),
            trials,
            bodies,
            body_trials: Vec::new(),
            body_repairs: Vec::new(),
            directions: Vec::new(),
            outliers: self.outliers.clone(),
            efforts: self.explained(&fitted),
            channels: self.channels.clone(),
            scheme: self.scheme,
            rms_by_log: (0..self.logs.len()).map(of_log).collect(),
            rms,
            command_rms: command_rms(&self.logs, n),
            floor,
            misfit,
            step_share: other_step.share,
            horizons,
            start_residual: start.residual,
            start: start.values,
            ending: fitted.ending,
            iterations: fitted.iterations,
            evaluations: self.evaluations,
            unsettled: (count.unsettled, count.steps),
            blocks: self.blocks.len(),
            settle_s: self.logs.iter().map(|log| log.settle_s).fold(0.0, f64::max),
            values: fitted.values,
        })
    }

    fn spreads(
        &mut self,
        free: &[Free],
        fitted: &Fitted,
        (richer, other_step): (&[Tried], &OtherStep),
        wrong: bool,
    ) -> Result<Vec<Spread>, ServoError> {
        let mut out = vec![Spread::default(); free.len()];
        let short = GaussNewton { evaluations: 5, tolerance: 1e-6, reweighted: 0 };
        let estimate = &fitted.estimate;
        out.iter_mut().zip(&other_step.estimate).zip(estimate).for_each(|((s, a), b)| s.step = (a - b).abs());
        // Stated gains that are wrong.
        let is_free = |j: usize| {
            free.iter().any(|f| f.as_term() == Some(Term::PositionGain) && f.joints().contains(&j))
        };
        let stated: Vec<usize> = (0..fitted.values.joints.len())
            .filter(|j| self.settings.known_gain[*j] && !is_free(*j))
            .collect();
        if !stated.is_empty() && self.settings.gain_error > 0.0 {
            for side in [-1.0, 1.0] {
                let mut values = fitted.values.clone();
                for (j, joint) in values.joints.iter_mut().enumerate() {
                    if stated.contains(&j) {
                        let factor = 1.0 + side * self.settings.gain_error;
                        joint.set(Term::PositionGain, factor * joint.get(Term::PositionGain));
                    }
                }
                if let Ok(other) = self.refit(free, &values, self.scheme, &short) {
                    for ((s, a), b) in out.iter_mut().zip(&other.estimate).zip(estimate) {
                        s.gain = s.gain.max((a - b).abs());
                    }
                }
            }
        }
        for (f, moved) in &self.by_span {
            if let Some(k) = free.iter().position(|g| g.target == f.target) {
                out[k].reading = *moved;
            }
        }
        if !wrong {
            return Ok(out);
        }
        for tried in richer {
            if matches!(tried.trial.addition, Addition::Zero | Addition::OwnGains) {
                continue;
            }
            for (k, f) in free.iter().enumerate() {
                if let Some(at) = tried.free.iter().position(|g| g.target == f.target) {
                    out[k].law = out[k].law.max((tried.fitted.estimate[at] - estimate[k]).abs());
                }
            }
        }
        let of_folds = self
            .held_out(free, fitted, &vec![1.0; fitted.values.joints.len() * self.channels.len()])
            .estimates;
        let folds = of_folds.len() as f64;
        for (k, spread) in out.iter_mut().enumerate() {
            let mean = of_folds.iter().map(|e| e[k]).sum::<f64>() / folds;
            let squares: f64 = of_folds.iter().map(|e| (e[k] - mean) * (e[k] - mean)).sum();
            spread.folds = ((folds - 1.0) / folds * squares).sqrt();
        }
        Ok(out)
    }

    /// RMS of rollouts that begin from measured states after every horizon.
    fn horizon(&mut self, fitted: &Fitted, horizon_s: f64) -> Result<Vec<f64>, Lost> {
        let rows = |log: &ServoLog| ((horizon_s / log.period()).round() as usize).max(1);
        let cut = |log: &ServoLog| {
            let mut log = log.clone();
            log.settle_s = 0.0;
            if horizon_s.is_finite() {
                let every = rows(&log);
                log.breaks = (1..).map(|k| k * every).take_while(|r| *r < log.rows()).collect();
            }
            log
        };
        let logs: Vec<ServoLog> = self.logs.iter().map(cut).collect();
        let problem = ServoProblem {
            chains: self.chains,
            logs: &logs,
            scheme: self.scheme,
            free: &[],
            channels: &[Channel::Position],
            blocks: &self.blocks,
        };
        let sigma = vec![1.0; fitted.values.joints.len()];
        let evaluation = Evaluation::new(&problem, &fitted.values, &sigma, false)?;
        Ok(evaluation.mean_squares(&|_| true).iter().map(|s| s.sqrt()).collect())
    }
}

/// A start whose loop is stable whatever the bodies are: no friction that sticks, no lag, damping for a tenth of a second. What is known
/// stays.
fn tame(mut start: ServoValues, free: &[Free]) -> ServoValues {
    const TIME: f64 = 0.1;
    const GAIN: f64 = 10.0;
    for (j, joint) in start.joints.iter_mut().enumerate() {
        let gain = joint.get(Term::PositionGain);
        let gain = if gain.is_finite() && gain > 0.0 { gain.min(1e3 * GAIN) } else { GAIN };
        let all = [
            (Term::PositionGain, gain),
            (Term::Viscous, TIME * gain),
            (Term::RotorInertia, TIME * TIME * gain),
            (Term::Coulomb, 0.0),
            (Term::Stiction, 0.0),
            (Term::Offset, 0.0),
            (Term::Delay, 0.0),
        ];
        let is_free = |term: Term| free.iter().any(|f| f.as_term() == Some(term) && f.joints().contains(&j));
        all.into_iter().filter(|(term, _)| is_free(*term)).for_each(|(term, value)| joint.set(term, value));
    }
    start
}

/// Whether a residual over the encoders' rounding says that the model is wrong somewhere, or cannot say that it is right.
fn is_wrong(misfit: f64) -> bool {
    misfit.is_nan() || misfit > MISFIT
}

fn mean_square_between(a: &[f64], b: &[f64]) -> f64 {
    let squares = || a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).filter(|x| !x.is_nan());
    squares().sum::<f64>() / (squares().count() as f64).max(1.0)
}

fn command_rms(logs: &[ServoLog], joints: usize) -> Vec<f64> {
    let rows: usize = logs.iter().map(ServoLog::rows).sum();
    let squares = |j: usize| -> f64 {
        let pairs = logs.iter().flat_map(|l| l.command[j].iter().zip(&l.position[j]));
        pairs.map(|(u, x)| (u - x) * (u - x)).sum()
    };
    (0..joints).map(|j| (squares(j) / rows as f64).sqrt()).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
