//! Evolution strategy with covariance matrix adaptation and restarts with growing population (IPOP-CMA-ES).
//!
//! Each coordinate is scaled so that its bounds are 0 and 1. Per iteration, with `C = B D² Bᵀ`:
//!
//! ```text
//! y_k = B D z_k, z_k ~ N(0, 1),   x_k = m + σ y_k,   k = 1..λ;   y_w = Σ_{i≤μ} w_i y_{i:λ},   m ← m + σ y_w
//! p_σ ← (1 - c_σ) p_σ + √(c_σ (2 - c_σ) μ_w) C^{-1/2} y_w,      σ ← σ exp[(c_σ/d_σ)(‖p_σ‖/E‖N(0, 1)‖ - 1)]
//! p_c ← (1 - c_c) p_c + h_σ √(c_c (2 - c_c) μ_w) y_w
//! C ← (1 - c₁ - c_μ + c₁ (1 - h_σ) c_c (2 - c_c)) C + c₁ p_c p_cᵀ + c_μ Σ w_i y_{i:λ} y_{i:λ}ᵀ
//! ```
//!
//! with Hansen's defaults for all coefficients (positive weights only), and `λ = 4 + ⌊3 ln d⌋` by default.
//!
//! *Bounds.* The strategy moves in all of `ℝᵈ`; what is evaluated is `T(x)`, coordinate by coordinate the identity on
//! `[a, 1 - a]`, `(x + a)²/(4a)` on `[-a, a]`, its mirror image at 1, and mirrored with period `2 (1 + 2a)` elsewhere,
//! `a = 0.05`: smooth, onto the box, and bounds themselves can be reached. (Hansen's boundary transformation.)
//!
//! *Restarts.* A descent ends when values of its last `10 + ⌈30 d/λ⌉` iterations differ by less than 1e-12 (or a few units
//! in the last place), steps fall below 1e-12 of the box, the condition number of `C` exceeds 1e14, or after
//! `100 + 50 (d + 3)²/√λ` iterations; the next starts at a random mean with twice the population. Without restarts left:
//! converged.
//!
//! Sources: Hansen 2016 (arXiv 1604.00772); Auger & Hansen 2005 for restarts.

mod descent;
mod fold;

use super::error::SearchError;
use super::population::Population;
use super::range::inside;
use super::run::{Method, Run, Step};
use descent::Descent;
use dynid_words::Transfer;

/// Parameters of the evolution strategy.
#[derive(Debug, Clone, PartialEq)]
pub struct CmaEs {
    /// First step size over the width of the bounds, in (0, 1]. Default 0.3.
    pub step: f64,
    /// Most restarts, each with twice the population. Default 9.
    pub restarts: usize,
}

impl Default for CmaEs {
    fn default() -> Self {
        CmaEs { step: 0.3, restarts: 9 }
    }
}

impl CmaEs {
    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        inside(algorithm, "step", self.step, 0.0, 1.0 + f64::EPSILON, "in (0, 1]")?;
        if self.restarts > MOST_RESTARTS {
            let (parameter, expected) = ("restarts", "at most 20");
            return Err(SearchError::Parameter {
                algorithm,
                parameter,
                expected,
                found: self.restarts as f64,
            });
        }
        Ok(())
    }
}

/// Twenty doublings of the population are beyond any budget; more would overflow.
const MOST_RESTARTS: usize = 20;

#[derive(Clone)]
pub(super) struct Strategy {
    parameters: CmaEs,
    population: usize,
    restarts: usize,
    descent: Descent,
    candidates: Population,
}

impl Strategy {
    pub(super) fn new(parameters: &CmaEs, population: usize, dimensions: usize) -> Strategy {
        Strategy {
            parameters: parameters.clone(),
            population,
            restarts: 0,
            descent: Descent::new(vec![0.5; dimensions], parameters.step, population),
            candidates: Population::new(population, dimensions),
        }
    }

    fn begin(&mut self, mean: Vec<f64>) {
        let population = self.population << self.restarts;
        self.candidates = Population::new(population, mean.len());
        self.descent = Descent::new(mean, self.parameters.step, population);
    }

    fn random_mean(run: &mut Run<'_>) -> Vec<f64> {
        (0..run.bounds.dimensions()).map(|_| run.random.uniform()).collect()
    }
}

impl Method for Strategy {
    fn start(&mut self, run: &mut Run<'_>) {
        let share = |(i, u): (usize, &f64)| {
            let ((lower, _), width) = (run.bounds.search(i), run.bounds.width(i));
            fold::unfold(if width > 0.0 { (u - lower) / width } else { 0.5 })
        };
        let start: Option<Vec<f64>> = run.start().map(|start| start.iter().enumerate().map(share).collect());
        let mean = start.unwrap_or_else(|| Self::random_mean(run));
        self.begin(mean);
    }

    fn iterate(&mut self, run: &mut Run<'_>) -> Step {
        self.descent.sample(&mut run.random);
        for k in 0..self.candidates.len() {
            let point = self.candidates.point_mut(k);
            for (i, (u, x)) in point.iter_mut().zip(self.descent.sampled(k)).enumerate() {
                *u = run.bounds.clip(i, run.bounds.search(i).0 + run.bounds.width(i) * fold::fold(x));
            }
        }
        self.candidates.evaluate(run);
        self.descent.update(&self.candidates.values);
        if !self.descent.is_over() {
            return Step::GoOn;
        }
        if self.restarts == self.parameters.restarts {
            return Step::Converged;
        }
        self.restarts += 1;
        let mean = Self::random_mean(run);
        self.begin(mean);
        Step::GoOn
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        let before = self.restarts;
        transfer.count(&mut self.restarts, self.parameters.restarts + 1);
        if self.restarts != before {
            self.begin(self.descent.mean().to_vec());
        }
        self.descent.fields(transfer);
    }
}
