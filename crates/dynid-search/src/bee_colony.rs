//! Artificial bee colony.
//!
//! `n` food sources hold a point `x_i` with value `J_i` each. Per iteration:
//!
//! - *employed bees*: one candidate per source, `v_d = x_id + φ_d (x_id - x_jd)` for the coordinates that change, `φ_d`
//!   uniform on `[-a, a]`, `j ≠ i` random, clipped to the bounds; it replaces its source if it is not worse, else the
//!   source counts one more failed trial;
//! - *onlookers*: `n` more candidates alike, for sources drawn with probability `f_i/Σf`;
//! - *scouts*: sources with `L` failed trials are replaced by random points.
//!
//! Candidates of a phase are formed from the sources at its beginning and evaluated as one group. The best point ever is
//! remembered outside the population. Two named presets:
//!
//! - [`BeeColony::published`] (the default): all coordinates change, `a = 0.5`, `L = 600`, `f = exp(-J/mean J)`.
//!   Sources without a finite value have `f = 0` and do not enter the mean. If there are
//!   negative values, all are counted from the least.
//! - [`BeeColony::general`]: about one coordinate in ten changes (one for certain), `a = 1`, `L = n d/2`, and every step
//!   has a pull `ψ_d (best_d - x_id)`, `ψ_d` uniform on `[0, 1.5]`, towards the best point (Zhu & Kwong 2010).
//!
//! Evaluations: `n + 2n` per iteration and one per scout; 40 100 with 100 sources and 200 iterations, plus scouts.
//!
//! Sources: Karaboga & Basturk 2007; Akay & Karaboga 2012 for the share of coordinates.

use super::error::SearchError;
use super::population::Population;
use super::range::{inside, positive};
use super::run::{Method, Run, Step};
use dynid_words::Transfer;

/// Parameters of a bee colony.
#[derive(Debug, Clone, PartialEq)]
pub struct BeeColony {
    /// `a`: largest factor of a step, positive.
    pub acceleration: f64,
    /// `C`: largest factor of a pull towards the best source (Zhu & Kwong 2010); 0 for none.
    pub guidance: f64,
    /// Probability that a coordinate changes, in (0, 1]; one always does.
    pub changed_share: f64,
    /// `L`: failed trials after which a source is given up. `None`: half the population times the dimensions.
    pub trial_limit: Option<u64>,
    /// Default of [`Settings::population`](super::Settings::population): food sources.
    pub sources: usize,
}

impl BeeColony {
    /// Settings published for the X-Y pointing mechanism: 100 sources, 200 iterations.
    pub fn published() -> Self {
        BeeColony {
            acceleration: 0.5,
            guidance: 0.0,
            changed_share: 1.0,
            trial_limit: Some(600),
            sources: 100,
        }
    }

    /// For general use: 25 sources.
    pub fn general() -> Self {
        BeeColony { acceleration: 1.0, guidance: 1.5, changed_share: 0.1, trial_limit: None, sources: 25 }
    }

    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        positive(algorithm, "acceleration", self.acceleration)?;
        super::range::not_negative(algorithm, "guidance", self.guidance)?;
        inside(algorithm, "changed_share", self.changed_share, 0.0, 1.0 + f64::EPSILON, "in (0, 1]")?;
        if self.trial_limit == Some(0) {
            let (parameter, expected) = ("trial_limit", "at least 1");
            return Err(SearchError::Parameter { algorithm, parameter, expected, found: 0.0 });
        }
        Ok(())
    }
}

impl Default for BeeColony {
    fn default() -> Self {
        Self::published()
    }
}

#[derive(Clone)]
pub(super) struct Colony {
    parameters: BeeColony,
    sources: Population,
    candidates: Population,
    trials: Vec<u64>,
    trial_limit: u64,
    /// Best point met, in search coordinates.
    best: Population,
}

impl Colony {
    pub(super) fn new(parameters: &BeeColony, sources: usize, dimensions: usize) -> Colony {
        Colony {
            parameters: parameters.clone(),
            sources: Population::new(sources, dimensions),
            candidates: Population::new(sources, dimensions),
            trials: vec![0; sources],
            trial_limit: parameters.trial_limit.unwrap_or((sources * dimensions / 2).max(1) as u64),
            best: Population::new(1, dimensions),
        }
    }

    fn propose(&mut self, run: &mut Run<'_>, candidate: usize, source: usize) {
        let n = self.sources.len();
        let d = run.bounds.dimensions();
        let other = self.sources.point(run.random.below_except(n, source));
        let from = self.sources.point(source);
        let best = self.best.point(0);
        let BeeColony { acceleration: a, guidance, changed_share, .. } = self.parameters;
        let certain = run.random.below(d);
        for (i, to) in self.candidates.point_mut(candidate).iter_mut().enumerate() {
            *to = from[i];
            if i == certain || changed_share >= 1.0 || run.random.uniform() < changed_share {
                let mut moved = from[i] + run.random.between(-a, a) * (from[i] - other[i]);
                if guidance > 0.0 {
                    moved += run.random.between(0.0, guidance) * (best[i] - from[i]);
                }
                *to = run.bounds.clip(i, moved);
            }
        }
    }

    fn select(&mut self, candidate: usize, source: usize) {
        let found = self.candidates.values[candidate];
        // Equal infinities are no reason to stay where nothing is known.
        if found <= self.sources.values[source] && found.is_finite() {
            self.sources.take(source, &self.candidates, candidate);
            self.trials[source] = 0;
        } else {
            self.trials[source] = self.trials[source].saturating_add(1);
        }
    }

    fn remember(&mut self) {
        let best = self.sources.best();
        if self.sources.values[best] < self.best.values[0] {
            self.best.take(0, &self.sources, best);
        }
    }

    fn employed(&mut self, run: &mut Run<'_>) {
        (0..self.sources.len()).for_each(|source| self.propose(run, source, source));
        self.candidates.evaluate(run);
        (0..self.sources.len()).for_each(|source| self.select(source, source));
        self.remember();
    }

    fn onlookers(&mut self, run: &mut Run<'_>) {
        let sums = self.cumulative_fitness();
        let total = sums.last().copied().unwrap_or(0.0);
        let n = self.sources.len();
        let chosen: Vec<usize> = (0..n)
            .map(|_| match total > 0.0 {
                true => {
                    let place = total * run.random.uniform();
                    sums.partition_point(|sum| *sum <= place).min(n - 1)
                }
                false => run.random.below(n),
            })
            .collect();
        for (candidate, &source) in chosen.iter().enumerate() {
            self.propose(run, candidate, source);
        }
        self.candidates.evaluate(run);
        for (candidate, &source) in chosen.iter().enumerate() {
            self.select(candidate, source);
        }
        self.remember();
    }

    /// Sums of `f_0, ..., f_i`, `f = exp(-J/mean J)`.
    fn cumulative_fitness(&self) -> Vec<f64> {
        let finite = || self.sources.values.iter().copied().filter(|v| v.is_finite());
        let count = finite().count() as f64;
        let zero = finite().fold(0.0, f64::min);
        let mean = finite().map(|v| (v - zero) / count).sum::<f64>();
        let fitness = |v: f64| match v.is_finite() {
            true if mean > 0.0 => (-(v - zero) / mean).exp(),
            true => 1.0,
            false => 0.0,
        };
        let mut sum = 0.0;
        let of = |v: &f64| {
            sum += fitness(*v);
            sum
        };
        self.sources.values.iter().map(of).collect()
    }

    fn scouts(&mut self, run: &mut Run<'_>) {
        for source in 0..self.sources.len() {
            if self.trials[source] >= self.trial_limit {
                let mut point = vec![0.0; run.bounds.dimensions()];
                run.draw(&mut point);
                self.sources.values[source] = run.evaluate_one(&point);
                self.sources.point_mut(source).copy_from_slice(&point);
                self.trials[source] = 0;
            }
        }
        self.remember();
    }
}

impl Method for Colony {
    fn start(&mut self, run: &mut Run<'_>) {
        self.sources.draw(run);
        self.remember();
    }

    fn iterate(&mut self, run: &mut Run<'_>) -> Step {
        self.employed(run);
        self.onlookers(run);
        self.scouts(run);
        Step::GoOn
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        self.sources.fields(transfer);
        self.trials.iter_mut().for_each(|trial| transfer.integer(trial));
        self.best.fields(transfer);
    }
}
