//! An algorithm at work: iterations, checkpoints, and when to end.

use std::ops::ControlFlow;

use super::checkpoint::{Checkpoint, CheckpointError};
use super::error::SearchError;
use super::history::History;
use super::run::{Method, Progress, Run, SearchResult, Status, Step};
use super::settings::Settings;
use dynid_words::Transfer;

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
            if settings.stall.is_some_and(|stall| self.iteration.saturating_sub(self.improved) >= stall) {
                break Status::Stalled;
            }
            let before = self.run.best_value;
            let step = self.method.iterate(&mut self.run);
            self.iteration = self.iteration.saturating_add(1);
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
