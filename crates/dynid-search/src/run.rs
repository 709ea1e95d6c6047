//! One run: what algorithms draw from and evaluate with, counting and keeping the best.

use super::bounds::Bounds;
use super::checkpoint::Checkpoint;
use super::history::HistoryPoint;
use super::objective::Objective;
use super::random::Random;
use super::settings::Settings;
use dynid_words::Transfer;

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
    /// Value at the best point.
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
    /// Value at the best point, `+∞` without one.
    pub value: f64,
    pub(super) save: &'a dyn Fn() -> Checkpoint,
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
    pub(super) evaluations: u64,
    pub(super) not_finite: u64,
    /// Some candidates were not evaluated for want of budget: the state is of no whole iteration.
    pub(super) truncated: bool,
    pub(super) best: Vec<f64>,
    pub(super) best_value: f64,
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
        let left = usize::try_from(self.limit.saturating_sub(self.evaluations)).unwrap_or(usize::MAX);
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

    pub(super) fn fields(&mut self, transfer: &mut Transfer<'_>) {
        self.random.fields(transfer);
        transfer.integer(&mut self.evaluations);
        transfer.integer(&mut self.not_finite);
        transfer.reals(&mut self.best);
        transfer.real(&mut self.best_value);
    }
}
