//! One run: counting, keeping the best, deciding when to end.

use std::ops::ControlFlow;

use super::bounds::Bounds;
use super::checkpoint::{Checkpoint, CheckpointError, Transfer};
use super::error::SearchError;
use super::history::{History, HistoryPoint};
use super::objective::Objective;
use super::random::Random;
use super::settings::Settings;

/// Whether an algorithm has more to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    GoOn,
    Converged,
}

/// An algorithm: what one iteration does, and its state.
pub(super) trait Method: Clone {
    fn start(&mut self, run: &mut Run<'_>);
    fn iterate(&mut self, run: &mut Run<'_>) -> Step;
    /// All state between iterations.
    fn fields(&mut self, transfer: &mut Transfer<'_>);
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All iterations or evaluations are used.
    BudgetUsed,
    /// The target value is reached.
    TargetReached,
    /// The algorithm's own criterion is met: it would not move any more.
    Converged,
    /// No improvement for [`Settings::stall`] iterations.
    Stalled,
    /// The observer asked to stop.
    Stopped,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    /// The best point, within the bounds.
    pub point: Vec<f64>,
    /// Its value.
    pub value: f64,
    /// Iterations made (without the initial population).
    pub iterations: u64,
    /// Evaluations made, those without a finite value included.
    pub evaluations: u64,
    /// Evaluations without a finite value.
    pub not_finite: u64,
    /// Best value so far against evaluations; values never rise.
    pub history: Vec<HistoryPoint>,
    /// How it ended.
    pub status: Status,
}

/// State of a run after an iteration, for its observer.
pub struct Progress<'a> {
    /// Iterations made.
    pub iteration: u64,
    /// Evaluations made.
    pub evaluations: u64,
    /// Evaluations without a finite value.
    pub not_finite: u64,
    /// The best point so far; `None` as long as no value was finite.
    pub point: Option<&'a [f64]>,
    /// Its value, `+∞` without one.
    pub value: f64,
    save: &'a dyn Fn() -> Checkpoint,
}

impl Progress<'_> {
    /// All that is needed to [`resume`](super::resume) the run from here.
    pub fn checkpoint(&self) -> Checkpoint {
        (self.save)()
    }
}

/// Counters and best point of a run, and what algorithms draw from.
#[derive(Clone)]
pub(super) struct Run<'a> {
    pub(super) bounds: &'a Bounds,
    pub(super) random: Random,
    objective: &'a dyn Objective,
    start: Option<Vec<f64>>,
    limit: u64,
    evaluations: u64,
    not_finite: u64,
    /// Some candidates were not evaluated for want of budget: the state is of no whole iteration.
    truncated: bool,
    best: Vec<f64>,
    best_value: f64,
    points: Vec<f64>,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        objective: &'a dyn Objective,
        bounds: &'a Bounds,
        settings: &Settings,
        limit: u64,
    ) -> Run<'a> {
        Run {
            bounds,
            random: Random::new(settings.seed),
            objective,
            start: settings.start.as_ref().map(|start| bounds.search_point(start)),
            limit,
            evaluations: 0,
            not_finite: 0,
            truncated: false,
            best: vec![0.0; bounds.dimensions()],
            best_value: f64::INFINITY,
            points: Vec::new(),
        }
    }

    /// Start point in search coordinates.
    pub(super) fn start(&self) -> Option<&[f64]> {
        self.start.as_deref()
    }

    /// A point uniform in the bounds, in search coordinates.
    pub(super) fn draw(&mut self, point: &mut [f64]) {
        for (i, u) in point.iter_mut().enumerate() {
            let (lower, upper) = self.bounds.search(i);
            *u = self.random.between(lower, upper);
        }
    }

    /// Values of candidates in search coordinates; `+∞` where there is none, or no budget left.
    pub(super) fn evaluate(&mut self, candidates: &[f64], values: &mut [f64]) {
        let d = self.bounds.dimensions();
        let left = usize::try_from(self.limit - self.evaluations).unwrap_or(usize::MAX);
        let count = values.len().min(left);
        self.truncated |= count < values.len();
        let (values, beyond) = values.split_at_mut(count);
        beyond.fill(f64::INFINITY);
        self.points.resize(count * d, 0.0);
        for (point, search) in self.points.chunks_exact_mut(d).zip(candidates.chunks_exact(d)) {
            self.bounds.point(search, point);
        }
        if count > 0 {
            self.objective.evaluate(&self.points, values);
        }
        self.evaluations += count as u64;
        for (value, point) in values.iter_mut().zip(self.points.chunks_exact(d)) {
            if !value.is_finite() {
                self.not_finite += 1;
                *value = f64::INFINITY;
            }
            if *value < self.best_value {
                self.best_value = *value;
                self.best.copy_from_slice(point);
            }
        }
    }

    /// Value of one candidate.
    pub(super) fn evaluate_one(&mut self, candidate: &[f64]) -> f64 {
        let mut value = [0.0];
        self.evaluate(candidate, &mut value);
        value[0]
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        self.random.fields(transfer);
        transfer.integer(&mut self.evaluations);
        transfer.integer(&mut self.not_finite);
        transfer.reals(&mut self.best);
        transfer.real(&mut self.best_value);
    }
}

/// Limits of a run, defaults filled in.
pub(super) struct Limits {
    pub(super) iterations: u64,
    pub(super) evaluations: u64,
}

/// A run together with its algorithm.
#[derive(Clone)]
pub(super) struct Driver<'a, M> {
    method: M,
    run: Run<'a>,
    history: History,
    iteration: u64,
    improved: u64,
    started: bool,
    label: String,
    seed: u64,
}

impl<'a, M: Method> Driver<'a, M> {
    pub(super) fn new(method: M, run: Run<'a>, settings: &Settings, label: String) -> Self {
        let history = History::new(settings.history);
        Driver { method, run, history, iteration: 0, improved: 0, started: false, label, seed: settings.seed }
    }

    /// Continues from a checkpoint.
    pub(super) fn load(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        if checkpoint.algorithm != self.label {
            let (expected, found) = (self.label.clone(), checkpoint.algorithm.clone());
            return Err(CheckpointError::Algorithm { expected, found });
        }
        if checkpoint.seed != self.seed {
            return Err(CheckpointError::Seed { expected: self.seed, found: checkpoint.seed });
        }
        let bounds = self.bounds();
        let words = checkpoint.words.strip_prefix(bounds.as_slice()).ok_or(CheckpointError::Bounds)?;
        let mut transfer = Transfer::Load { words, damaged: false };
        self.fields(&mut transfer);
        if !transfer.complete() {
            return Err(CheckpointError::Damaged);
        }
        self.started = true;
        Ok(())
    }

    fn bounds(&self) -> Vec<u64> {
        let bounds = self.run.bounds;
        let (lower, upper) = (bounds.lower().iter(), bounds.upper().iter());
        let kinds = (0..bounds.dimensions()).map(|i| u64::from(bounds.is_logarithmic(i)));
        let count = std::iter::once(bounds.dimensions() as u64);
        count.chain(lower.chain(upper).map(|b| b.to_bits())).chain(kinds).collect()
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        transfer.integer(&mut self.iteration);
        transfer.integer(&mut self.improved);
        self.run.fields(transfer);
        self.history.fields(transfer);
        self.method.fields(transfer);
    }

    fn into_checkpoint(mut self) -> Checkpoint {
        let mut words = self.bounds();
        self.fields(&mut Transfer::Save(&mut words));
        Checkpoint { algorithm: self.label, seed: self.seed, words }
    }

    /// Runs to the end.
    pub(super) fn finish(
        mut self,
        limits: &Limits,
        settings: &Settings,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<SearchResult, SearchError> {
        if !self.started {
            self.method.start(&mut self.run);
            self.record();
        }
        let status = loop {
            if settings.target.is_some_and(|target| self.run.best_value <= target) {
                break Status::TargetReached;
            }
            if self.run.evaluations >= limits.evaluations || self.iteration >= limits.iterations {
                break Status::BudgetUsed;
            }
            if settings.stall.is_some_and(|stall| self.iteration - self.improved >= stall) {
                break Status::Stalled;
            }
            let before = self.run.best_value;
            let step = self.method.iterate(&mut self.run);
            self.iteration += 1;
            if self.run.best_value < before {
                self.improved = self.iteration;
            }
            self.record();
            if self.run.truncated {
                continue;
            }
            if step == Step::Converged {
                break Status::Converged;
            }
            if self.observe(observer).is_break() {
                break Status::Stopped;
            }
        };
        self.result(status)
    }

    fn record(&mut self) {
        if self.run.best_value.is_finite() {
            self.history.offer(self.run.evaluations, self.run.best_value);
        }
    }

    fn observe(&self, observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>) -> ControlFlow<()> {
        let progress = Progress {
            iteration: self.iteration,
            evaluations: self.run.evaluations,
            not_finite: self.run.not_finite,
            point: self.run.best_value.is_finite().then_some(&self.run.best),
            value: self.run.best_value,
            save: &|| self.clone().into_checkpoint(),
        };
        observer(&progress)
    }

    fn result(self, status: Status) -> Result<SearchResult, SearchError> {
        let Run { best, best_value, evaluations, not_finite, .. } = self.run;
        if best_value.is_infinite() {
            return Err(SearchError::NowhereFinite { evaluations });
        }
        Ok(SearchResult {
            point: best,
            value: best_value,
            iterations: self.iteration,
            evaluations,
            not_finite,
            history: self.history.closed(evaluations, best_value),
            status,
        })
    }
}
