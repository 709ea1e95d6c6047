//! Bootstrap over time blocks.

use crate::whitened::{Whitened, cholesky, upper_times};
use dynid_factor::factor::Factor;
use dynid_linalg::Mat;
use dynid_linalg::triangular::symmetric_from;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Settings of [`bootstrap`].
#[derive(Debug, Clone, PartialEq)]
pub struct BootstrapSettings {
    /// Number of replicates. Default 500; 200 to 1000 are usual.
    pub replicates: usize,
    /// Seed; every replicate draws from a stream of its own. Default 1.
    pub seed: u64,
}

impl Default for BootstrapSettings {
    fn default() -> Self {
        Self { replicates: 500, seed: 1 }
    }
}

/// Estimates on blocks drawn with replacement.
#[derive(Debug, Clone, PartialEq)]
pub struct Bootstrap {
    /// The estimate on the blocks as they are.
    pub x: Vec<f64>,
    /// Standard errors of `x` by the block sandwich.
    pub standard_errors: Vec<f64>,
    /// Estimate `x*` of every replicate.
    pub replicates: Vec<Vec<f64>>,
    /// `t* = (x* - x)/s*` with the replicate's own block-sandwich error.
    pub studentised: Vec<Vec<f64>>,
    /// Replicates whose draw left some direction unexcited; they stay near `x` there, so the spread is understated.
    pub deficient: usize,
}

impl Bootstrap {
    /// Covariance of the replicates about their mean; `None` with fewer than two.
    pub fn covariance(&self) -> Option<Mat> {
        let count = self.replicates.len();
        if count < 2 {
            return None;
        }
        let mean: Vec<f64> = (0..self.x.len())
            .map(|i| self.replicates.iter().map(|x| x[i]).sum::<f64>() / count as f64)
            .collect();
        Some(symmetric_from(self.x.len(), |i, j| {
            let products = self.replicates.iter().map(|x| (x[i] - mean[i]) * (x[j] - mean[j]));
            products.sum::<f64>() / (count - 1) as f64
        }))
    }

    /// Percentile intervals of the given level: quantiles of `x*`. `None` unless the level is inside (0, 1).
    pub fn percentile_intervals(&self, level: f64) -> Option<Vec<(f64, f64)>> {
        let tail = tail(level)?;
        let of = |i: usize| {
            let sorted = sorted(self.replicates.iter().map(|x| x[i]));
            Some((quantile(&sorted, tail)?, quantile(&sorted, 1.0 - tail)?))
        };
        (0..self.x.len()).map(of).collect()
    }

    /// Studentised intervals of the given level, `[x - q_{1-α/2}(t*) s, x - q_{α/2}(t*) s]`: like Student's t they know
    /// that few blocks leave the error itself uncertain. `None` unless the level is inside (0, 1).
    pub fn studentised_intervals(&self, level: f64) -> Option<Vec<(f64, f64)>> {
        let tail = tail(level)?;
        let of = |i: usize| {
            let sorted = sorted(self.studentised.iter().map(|t| t[i]));
            let (x, s) = (self.x[i], self.standard_errors[i]);
            Some((x - s * quantile(&sorted, 1.0 - tail)?, x - s * quantile(&sorted, tail)?))
        };
        (0..self.x.len()).map(of).collect()
    }
}

/// Block bootstrap with fixed weights: each replicate draws `B` blocks with replacement and solves
/// `min Σ_b m_b ‖z_b - R_b x‖²` with the multiplicities `m_b`.
///
/// `blocks`: weighted factors of the time blocks in independent columns; `fixed`: rows of every replicate, such as those
/// of a prior. The sums are formed in the coordinates in which the whole problem is orthonormal, so a replicate costs
/// `B p² + p³/3` operations and no digits. Replicate `k` uses stream `k` of ChaCha8: the same for any number of threads.
/// `None` with fewer than two blocks or dependent columns.
///
/// Source: Efron & Tibshirani 1993, chapters 12 and 13; Carlstein 1986 for blocks.
pub fn bootstrap(
    blocks: &[Factor],
    fixed: Option<&Factor>,
    settings: &BootstrapSettings,
) -> Option<Bootstrap> {
    let count = blocks.len();
    if count < 2 {
        return None;
    }
    let problem = Problem::new(blocks, fixed)?;
    let (_, errors, _) = problem.replicate(&vec![1; count])?;
    let drawn: Vec<(Vec<f64>, Vec<f64>, bool)> = (0..settings.replicates)
        .into_par_iter()
        .map(|k| {
            let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
            rng.set_stream(k as u64);
            let mut multiplicity = vec![0; count];
            (0..count).for_each(|_| multiplicity[rng.random_range(0..count)] += 1);
            problem.replicate(&multiplicity)
        })
        .collect::<Option<_>>()?;
    let deficient = drawn.iter().filter(|d| d.2).count();
    let studentised = drawn
        .iter()
        .map(|(change, s, _)| change.iter().zip(s).map(|(c, s)| if *s > 0.0 { c / s } else { 0.0 }).collect())
        .collect();
    let shift = |change: &[f64]| problem.x.iter().zip(change).map(|(x, c)| x + c).collect::<Vec<f64>>();
    let replicates = drawn.iter().map(|(change, ..)| shift(change)).collect();
    Some(Bootstrap { standard_errors: errors, replicates, studentised, deficient, x: problem.x })
}

/// Blocks centred at the estimate: Gram matrices and scores.
struct Problem {
    x: Vec<f64>,
    inverse: Mat,
    grams: Vec<Mat>,
    scores: Vec<Vec<f64>>,
    fixed: Option<(Mat, Vec<f64>)>,
}

impl Problem {
    fn new(blocks: &[Factor], fixed: Option<&Factor>) -> Option<Self> {
        let Whitened { merged, inverse, blocks, fixed } = Whitened::new(blocks, fixed)?;
        let d = merged.z();
        let parts = |b: &crate::whitened::WhitenedBlock| (b.gram(), b.transposed(&b.residual(&d)));
        let (grams, scores) = blocks.iter().map(parts).unzip();
        Some(Problem {
            x: upper_times(&inverse, &d),
            fixed: fixed.as_ref().map(parts),
            inverse,
            grams,
            scores,
        })
    }

    /// Change of the estimate, its standard errors, and whether a direction was unexcited.
    fn replicate(&self, multiplicity: &[usize]) -> Option<(Vec<f64>, Vec<f64>, bool)> {
        let p = self.x.len();
        let (mut gram, mut score) = self.fixed.clone().unwrap_or_else(|| (Mat::zeros(p, p), vec![0.0; p]));
        let drawn = || multiplicity.iter().enumerate().filter(|(_, m)| **m > 0).map(|(b, m)| (b, *m as f64));
        for (b, m) in drawn() {
            gram += &self.grams[b] * m;
            score.iter_mut().zip(&self.scores[b]).for_each(|(s, g)| *s += m * g);
        }
        let (factor, deficient) = cholesky(&gram)?;
        let change = factor.solve_vector(&score);
        let mut variances = vec![0.0; p];
        for (b, m) in drawn() {
            let moved = Mat::from_fn(p, 1, |i, _| change[i]);
            let shifted = &self.grams[b] * moved;
            let own: Vec<f64> = (0..p).map(|i| self.scores[b][i] - shifted[(i, 0)]).collect();
            let influence = upper_times(&self.inverse, &factor.solve_vector(&own));
            variances.iter_mut().zip(influence).for_each(|(v, u)| *v += m * u * u);
        }
        let blocks = multiplicity.len() as f64;
        let errors = variances.into_iter().map(|v| (v * blocks / (blocks - 1.0)).sqrt()).collect();
        Some((upper_times(&self.inverse, &change), errors, deficient))
    }
}

/// Probability beyond each end.
fn tail(level: f64) -> Option<f64> {
    (level > 0.0 && level < 1.0).then_some(0.5 * (1.0 - level))
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// Linearly interpolated quantile of sorted values (the seventh definition of Hyndman & Fan 1996).
fn quantile(sorted: &[f64], probability: f64) -> Option<f64> {
    let place = probability * (sorted.len().checked_sub(1)?) as f64;
    let (below, share) = (place.floor() as usize, place.fract());
    let above = (below + 1).min(sorted.len() - 1);
    Some(sorted[below] + share * (sorted[above] - sorted[below]))
}
