//! Cuckoo search, plain and improved.
//!
//! `n` nests hold a point each. Every iteration proposes two candidates per nest:
//!
//! 1. a Lévy flight away from or towards the best nest, `x' = x + α L ∘ (x - x_best) ∘ ν`, `ν ~ N(0, 1)`, with
//!    `L = u/|v|^{1/λ}`, `v ~ N(0, 1)`, `u ~ N(0, σ²)`,
//!    `σ = [Γ(1+λ) sin(πλ/2) / (Γ((1+λ)/2) λ 2^{(λ-1)/2})]^{1/λ}` (Mantegna 1994);
//! 2. a walk on which every coordinate changes with probability `1 - P_a`, `x' = x + r (x_j - x_k)`, `r` uniform on
//!    (0, 1) and one per nest, `j` and `k` from two random orders of the nests.
//!
//! Candidates are clipped to the bounds. Plain: a candidate replaces its nest if it is better. Improved: `α` is scaled by
//! the chaotic number `c` of the iteration ([`TentMap`]), and a candidate replaces its nest if `c < e`,
//! `e = -k ln(S(ΔF)/S₀) = k (ln S₀ - ΔF)` with `S(u) = eᵘ`: deteriorations `ΔF` of up to about half a unit of the
//! objective pass. The best nest keeps to the plain rule, so the best point is never lost.
//!
//! Evaluations: `n + 2 n` per iteration; 10 025 with the defaults.
//!
//! Sources: Yang & Deb 2009 (plain); Ding, Li, Li & Chao 2018 (improved).

use super::error::SearchError;
use super::population::Population;
use super::range::{inside, positive};
use super::run::{Method, Run, Step};
use super::tent::TentMap;
use dynid_words::Transfer;
use statrs::function::gamma::gamma;

/// Parameters of plain cuckoo search; population 25 and 200 iterations by default.
#[derive(Debug, Clone, PartialEq)]
pub struct CuckooSearch {
    /// `P_a`: probability that a coordinate stays in the second step, in (0, 1). Default 0.4.
    pub abandon: f64,
    /// `α`: scale of Lévy flights, positive. Default 0.25.
    pub step: f64,
    /// `λ`: exponent of Lévy flights, in (0, 2). Default 1.5.
    pub levy_exponent: f64,
}

impl Default for CuckooSearch {
    fn default() -> Self {
        CuckooSearch { abandon: 0.4, step: 0.25, levy_exponent: 1.5 }
    }
}

impl CuckooSearch {
    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        inside(algorithm, "abandon", self.abandon, 0.0, 1.0, "inside (0, 1)")?;
        positive(algorithm, "step", self.step)?;
        inside(algorithm, "levy_exponent", self.levy_exponent, 0.0, 2.0, "inside (0, 2)")
    }
}

/// Parameters of improved cuckoo search; population 25 and 200 iterations by default.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprovedCuckooSearch {
    /// What it shares with plain cuckoo search.
    pub cuckoo: CuckooSearch,
    /// `γ` of the tent map, in (0, 1). Default 0.6.
    pub tent: f64,
    /// `k`: weight of the emotional acceptance, positive. Default 1.
    pub acceptance: f64,
    /// `ln S₀`: the deterioration whose acceptance `e` is 0, in units of the objective. Default 1 (`S₀ = e`).
    pub tolerance: f64,
}

impl Default for ImprovedCuckooSearch {
    fn default() -> Self {
        ImprovedCuckooSearch { cuckoo: CuckooSearch::default(), tent: 0.6, acceptance: 1.0, tolerance: 1.0 }
    }
}

impl ImprovedCuckooSearch {
    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        self.cuckoo.check(algorithm)?;
        inside(algorithm, "tent", self.tent, 0.0, 1.0, "inside (0, 1)")?;
        positive(algorithm, "acceptance", self.acceptance)?;
        positive(algorithm, "tolerance", self.tolerance)
    }
}

/// Emotional acceptance and the chaotic numbers behind it.
#[derive(Clone)]
struct Emotion {
    tent: TentMap,
    acceptance: f64,
    tolerance: f64,
}

#[derive(Clone)]
pub(super) struct Cuckoo {
    parameters: CuckooSearch,
    levy_deviation: f64,
    emotion: Option<Emotion>,
    nests: Population,
    candidates: Population,
}

impl Cuckoo {
    pub(super) fn plain(parameters: &CuckooSearch, nests: usize, dimensions: usize) -> Cuckoo {
        let lambda = parameters.levy_exponent;
        let numerator = gamma(1.0 + lambda) * (0.5 * std::f64::consts::PI * lambda).sin();
        let denominator = gamma(0.5 * (1.0 + lambda)) * lambda * 2.0_f64.powf(0.5 * (lambda - 1.0));
        Cuckoo {
            parameters: parameters.clone(),
            levy_deviation: (numerator / denominator).powf(1.0 / lambda),
            emotion: None,
            nests: Population::new(nests, dimensions),
            candidates: Population::new(nests, dimensions),
        }
    }

    pub(super) fn improved(parameters: &ImprovedCuckooSearch, nests: usize, dimensions: usize) -> Cuckoo {
        let emotion = Emotion {
            tent: TentMap { slope: parameters.tent, value: 0.5 },
            acceptance: parameters.acceptance,
            tolerance: parameters.tolerance,
        };
        Cuckoo { emotion: Some(emotion), ..Cuckoo::plain(&parameters.cuckoo, nests, dimensions) }
    }

    fn fly(&mut self, run: &mut Run<'_>, step: f64) {
        let best = self.nests.point(self.nests.best()).to_vec();
        let power = -1.0 / self.parameters.levy_exponent;
        for nest in 0..self.nests.len() {
            let from = self.nests.point(nest);
            for (i, to) in self.candidates.point_mut(nest).iter_mut().enumerate() {
                let flight =
                    self.levy_deviation * run.random.normal() * run.random.normal().abs().powf(power);
                let moved = from[i] + step * flight * (from[i] - best[i]) * run.random.normal();
                *to = run.bounds.clip(i, moved);
            }
        }
    }

    fn walk(&mut self, run: &mut Run<'_>) {
        let first = run.random.permutation(self.nests.len());
        let second = run.random.permutation(self.nests.len());
        for nest in 0..self.nests.len() {
            let share = run.random.uniform();
            let (a, b) = (self.nests.point(first[nest]), self.nests.point(second[nest]));
            let from = self.nests.point(nest);
            for (i, to) in self.candidates.point_mut(nest).iter_mut().enumerate() {
                let changes = run.random.uniform() > self.parameters.abandon;
                *to = if changes { run.bounds.clip(i, from[i] + share * (a[i] - b[i])) } else { from[i] };
            }
        }
    }

    fn select(&mut self, run: &mut Run<'_>) {
        self.candidates.evaluate(run);
        let best = self.nests.best();
        for nest in 0..self.nests.len() {
            let change = self.candidates.values[nest] - self.nests.values[nest];
            let better = self.candidates.values[nest] < self.nests.values[nest];
            let accepted = match &self.emotion {
                Some(e) if nest != best => e.tent.value < e.acceptance * (e.tolerance - change),
                _ => better,
            };
            if accepted {
                self.nests.take(nest, &self.candidates, nest);
            }
        }
    }
}

impl Method for Cuckoo {
    fn start(&mut self, run: &mut Run<'_>) {
        if let Some(emotion) = &mut self.emotion {
            emotion.tent.value = run.random.uniform();
        }
        self.nests.draw(run);
    }

    fn iterate(&mut self, run: &mut Run<'_>) -> Step {
        let chaos = self.emotion.as_mut().map_or(1.0, |e| e.tent.advance());
        self.fly(run, self.parameters.step * chaos);
        self.select(run);
        self.walk(run);
        self.select(run);
        Step::GoOn
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        if let Some(emotion) = &mut self.emotion {
            transfer.real(&mut emotion.tent.value);
        }
        self.nests.fields(transfer);
    }
}
