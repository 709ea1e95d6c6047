//! The misfit as an objective of searches.

use super::law::{Model, decay, split};
use super::problem::{Problem, add_product, dot};
use dynid_search::Objective;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Rows at a time: columns of a drive and its sums stay in the cache.
const ROWS: usize = 256;
/// Residuals of all candidates above which groups are worth several threads.
const PARALLEL: usize = 30_000;

/// `J(θ) = Σ_j Σ_t (τ_meas - τ(θ))²` over the used samples: the objective of Rosyid & El-Khasawneh 2020,
/// `θ = [φ, μ_c, f_v, μ_s, v_s]`.
///
/// Exponentials are kept for the last Stribeck speed, which most candidates of a pattern search share; they are used for
/// a candidate with exactly that speed only, so a value depends on its candidate alone, whatever the group and the number
/// of threads.
pub struct SquaredResiduals<'a> {
    problem: &'a Problem,
    decays: Mutex<Option<Arc<Decays>>>,
}

/// `E` of all used samples at one Stribeck speed.
struct Decays {
    speed: u64,
    drives: Vec<Vec<f64>>,
}

impl<'a> SquaredResiduals<'a> {
    /// The objective of a problem.
    pub fn new(problem: &'a Problem) -> Self {
        SquaredResiduals { problem, decays: Mutex::new(None) }
    }

    fn decays(&self, stribeck: f64) -> Arc<Decays> {
        let speed = stribeck.to_bits();
        let kept = self.decays.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(kept) = kept.filter(|k| k.speed == speed) {
            return kept;
        }
        let settings = &self.problem.settings;
        let of = |v: &f64| decay(settings.model, settings.exponent, *v, stribeck).0;
        let drives = self.problem.drives.iter().map(|d| d.speed.iter().map(of).collect()).collect();
        let fresh = Arc::new(Decays { speed, drives });
        *self.decays.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&fresh));
        fresh
    }

    fn value(&self, theta: &[f64]) -> f64 {
        let (problem, x) = (self.problem, split(theta));
        let frozen = problem.settings.model == Model::Constant;
        let decays = self.decays(x.stribeck);
        let mut total = 0.0;
        let (mut residual, mut force, mut normal) = ([0.0; ROWS], [0.0; ROWS], [0.0; ROWS]);
        for (j, used) in problem.drives.iter().enumerate() {
            let constant = x.coulomb * dot(&problem.record.drives()[j].weight, x.inertial);
            let mean = if frozen { problem.mean_normal_force(j, x.inertial) } else { 0.0 };
            for first in (0..used.rows()).step_by(ROWS) {
                let n = ROWS.min(used.rows() - first);
                let (residual, force, normal) = (&mut residual[..n], &mut force[..n], &mut normal[..n]);
                residual.fill(0.0);
                add_product(residual, &used.regressor, used.rows(), first, x.inertial);
                normal.fill(mean);
                for reaction in used.reactions.iter().filter(|_| !frozen) {
                    force.fill(0.0);
                    add_product(force, reaction, used.rows(), first, x.inertial);
                    normal.iter_mut().zip(&*force).for_each(|(n, f)| *n += f.abs());
                }
                let (effort, speed) = (&used.effort[first..][..n], &used.speed[first..][..n]);
                let (sign, decay) = (&used.sign[first..][..n], &decays.drives[j][first..][..n]);
                let motion = effort.iter().zip(speed).zip(sign.iter().zip(decay));
                for ((r, f), ((y, v), (s, e))) in residual.iter_mut().zip(&*normal).zip(motion) {
                    let stribeck = x.coulomb + (x.stick - x.coulomb) * e;
                    *r = y - (*r + s * (stribeck * f + constant) + x.viscous * v);
                }
                total += squares(residual);
            }
        }
        total
    }
}

impl Objective for SquaredResiduals<'_> {
    fn dimensions(&self) -> usize {
        self.problem.parameters()
    }

    fn evaluate(&self, candidates: &[f64], values: &mut [f64]) {
        let d = self.dimensions();
        if values.len() * self.problem.rows() < PARALLEL {
            values.iter_mut().zip(candidates.chunks_exact(d)).for_each(|(v, x)| *v = self.value(x));
        } else {
            values.par_iter_mut().zip(candidates.par_chunks_exact(d)).for_each(|(v, x)| *v = self.value(x));
        }
    }
}

/// `Σ r²` in eight partial sums, which the compiler can keep in vector registers.
fn squares(residuals: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let whole = residuals.chunks_exact(8);
    let rest: f64 = whole.remainder().iter().map(|r| r * r).sum();
    for part in whole {
        sums.iter_mut().zip(part).for_each(|(s, r)| *s += r * r);
    }
    sums.iter().sum::<f64>() + rest
}
