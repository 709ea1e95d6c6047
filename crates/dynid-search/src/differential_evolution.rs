//! Differential evolution with success-history adaptation (SHADE).
//!
//! Per iteration, every member `x_i` gets a candidate by mutation towards one of the best and binomial crossover,
//!
//! ```text
//! v = x_i + F (x_pbest - x_i) + F (x_r1 - x_r2),   u_d = v_d with probability CR (one d for certain), else x_id
//! ```
//!
//! `x_pbest`: one of the best `p n`, `p` uniform on `[2/n, 0.2]`; `x_r1` from the population, `x_r2` from population and
//! archive of replaced members. `F ~ Cauchy(M_F, 0.1)` in (0, 1] and `CR ~ N(M_CR, 0.1)` in [0, 1] with centres from a
//! memory of `H` cells, one of which per iteration takes the weighted Lehmer means of the values that brought improvement
//! (weights: improvements). A coordinate beyond a bound is put half way between the member and the bound. A candidate
//! replaces its member if it is not worse.
//!
//! Evaluations: `n + n` per iteration. Nothing depends on the budget, so a longer run begins as the shorter one. Converged:
//! no coordinate of the population spreads over more than 1e-12 of the bounds.
//!
//! Sources: Tanabe & Fukunaga 2013, memory and means as in 2014 (L-SHADE, without its shrinking population); Zhang &
//! Sanderson 2009 for mutation, archive and bounds.

use super::error::SearchError;
use super::population::Population;
use super::random::Random;
use super::range::not_negative;
use super::run::{Method, Run, Step};
use dynid_words::Transfer;

/// Parameters of differential evolution; population 60 by default.
#[derive(Debug, Clone, PartialEq)]
pub struct DifferentialEvolution {
    /// `H`: cells of the memory, at least 1. Default 6.
    pub memory: usize,
    /// Size of the archive over that of the population, not negative. Default 2.
    pub archive: f64,
    /// Largest share `p` of best members that are mutated towards, in (0, 1]. Default 0.2.
    pub best_share: f64,
}

impl Default for DifferentialEvolution {
    fn default() -> Self {
        DifferentialEvolution { memory: 6, archive: 2.0, best_share: 0.2 }
    }
}

impl DifferentialEvolution {
    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        if self.memory == 0 {
            let (parameter, expected) = ("memory", "at least 1");
            return Err(SearchError::Parameter { algorithm, parameter, expected, found: 0.0 });
        }
        not_negative(algorithm, "archive", self.archive)?;
        let wide = 1.0 + f64::EPSILON;
        super::range::inside(algorithm, "best_share", self.best_share, 0.0, wide, "in (0, 1]")
    }
}

#[derive(Clone)]
pub(super) struct Evolution {
    best_share: f64,
    members: Population,
    candidates: Population,
    archive: Vec<f64>,
    archive_limit: usize,
    scale_memory: Vec<f64>,
    /// Negative: improvements came with crossover 0 only, which is then used for good.
    crossover_memory: Vec<f64>,
    cell: usize,
    scales: Vec<f64>,
    crossovers: Vec<f64>,
}

impl Evolution {
    pub(super) fn new(parameters: &DifferentialEvolution, members: usize, dimensions: usize) -> Evolution {
        Evolution {
            best_share: parameters.best_share,
            members: Population::new(members, dimensions),
            candidates: Population::new(members, dimensions),
            archive: Vec::new(),
            archive_limit: (parameters.archive * members as f64).round() as usize,
            scale_memory: vec![0.5; parameters.memory],
            crossover_memory: vec![0.5; parameters.memory],
            cell: 0,
            scales: vec![0.0; members],
            crossovers: vec![0.0; members],
        }
    }

    fn draw_parameters(&mut self, random: &mut Random, member: usize) {
        let cell = random.below(self.scale_memory.len());
        let centre = self.crossover_memory[cell];
        let crossover = if centre < 0.0 { 0.0 } else { centre + 0.1 * random.normal() };
        self.crossovers[member] = crossover.clamp(0.0, 1.0);
        self.scales[member] = loop {
            let scale = self.scale_memory[cell] + 0.1 * random.cauchy();
            if scale > 0.0 {
                break scale.min(1.0);
            }
        };
    }

    fn propose(&mut self, run: &mut Run<'_>, order: &[usize]) {
        let n = self.members.len();
        let d = run.bounds.dimensions();
        for member in 0..n {
            self.draw_parameters(&mut run.random, member);
            let (scale, crossover) = (self.scales[member], self.crossovers[member]);
            let least = 2.0 / n as f64;
            let share = run.random.between(least, self.best_share.max(least));
            let elite = ((share * n as f64) as usize).clamp(1, n);
            let best = self.members.point(order[run.random.below(elite)]);
            let first = run.random.below_except(n, member);
            let second = loop {
                let drawn = run.random.below(n + self.archive.len() / d);
                if drawn != member && drawn != first {
                    break drawn;
                }
            };
            let first = self.members.point(first);
            let second = match second.checked_sub(n) {
                None => self.members.point(second),
                Some(old) => &self.archive[old * d..][..d],
            };
            let from = self.members.point(member);
            let certain = run.random.below(d);
            for (i, to) in self.candidates.point_mut(member).iter_mut().enumerate() {
                *to = from[i];
                if run.random.uniform() < crossover || i == certain {
                    let moved = from[i] + scale * (best[i] - from[i]) + scale * (first[i] - second[i]);
                    let (lower, upper) = run.bounds.search(i);
                    *to = match () {
                        () if moved < lower => 0.5 * (from[i] + lower),
                        () if moved > upper => 0.5 * (from[i] + upper),
                        () => moved,
                    };
                }
            }
        }
    }

    fn select(&mut self, random: &mut Random) {
        let d = self.members.point(0).len();
        let mut successes = Vec::new();
        for member in 0..self.members.len() {
            let (old, new) = (self.members.values[member], self.candidates.values[member]);
            if new < old {
                let gain = if old.is_finite() { old - new } else { 1.0 };
                successes.push((gain, self.scales[member], self.crossovers[member]));
                if self.archive.len() < self.archive_limit * d {
                    self.archive.extend_from_slice(self.members.point(member));
                } else if self.archive_limit > 0 {
                    let place = random.below(self.archive_limit);
                    self.archive[place * d..][..d].copy_from_slice(self.members.point(member));
                }
            }
            if new <= old && new.is_finite() {
                self.members.take(member, &self.candidates, member);
            }
        }
        self.learn(&successes);
    }

    /// Weighted Lehmer means `Σ w s² / Σ w s` of successful parameters into the next cell.
    fn learn(&mut self, successes: &[(f64, f64, f64)]) {
        if successes.is_empty() {
            return;
        }
        // Gains relative to the largest: their squares and products stay finite.
        let largest = successes.iter().fold(0.0, |m: f64, s| m.max(s.0));
        let lehmer = |of: fn(&(f64, f64, f64)) -> f64| {
            let sum = |power: i32| successes.iter().map(|s| s.0 / largest * of(s).powi(power)).sum::<f64>();
            let first = sum(1);
            (first > 0.0).then(|| sum(2) / first)
        };
        if let Some(scale) = lehmer(|s| s.1) {
            self.scale_memory[self.cell] = scale;
        }
        if self.crossover_memory[self.cell] >= 0.0 {
            self.crossover_memory[self.cell] = lehmer(|s| s.2).unwrap_or(-1.0);
        }
        self.cell = (self.cell + 1) % self.scale_memory.len();
    }

    fn has_collapsed(&self, run: &Run<'_>) -> bool {
        (0..run.bounds.dimensions()).all(|i| {
            let coordinates = (0..self.members.len()).map(|k| self.members.point(k)[i]);
            let (low, high) = coordinates
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low <= 1e-12 * run.bounds.width(i)
        })
    }
}

impl Method for Evolution {
    fn start(&mut self, run: &mut Run<'_>) {
        self.members.draw(run);
    }

    fn iterate(&mut self, run: &mut Run<'_>) -> Step {
        let mut order: Vec<usize> = (0..self.members.len()).collect();
        order.sort_by(|a, b| self.members.values[*a].total_cmp(&self.members.values[*b]));
        self.propose(run, &order);
        self.candidates.evaluate(run);
        self.select(&mut run.random);
        if self.has_collapsed(run) { Step::Converged } else { Step::GoOn }
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        let (d, cells) = (self.members.point(0).len(), self.scale_memory.len());
        self.members.fields(transfer);
        transfer.list(&mut self.archive, d);
        if self.archive.len() > self.archive_limit * d {
            transfer.fail();
        }
        transfer.reals(&mut self.scale_memory);
        transfer.reals(&mut self.crossover_memory);
        transfer.count(&mut self.cell, cells);
    }
}
