//! Standard deviations of a fit: from the model, and from leaving out blocks of time.

use dynid_linalg::Mat;

use super::evaluation::ServoProblem;
use super::gauss_newton::{Fitted, Place, damped, with_priors};
use crate::free::Free;

/// Standard deviations of the free parameters; `None` for those at a bound or not seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations {
    /// From the curvature of the loss with the residuals' own size: right only if the model is.
    pub model: Vec<Option<f64>>,
    /// From the estimate without one block of time after the other, linearised.
    pub jackknife: Vec<Option<f64>>,
    /// Correlations by the model of the parameters that are not at a bound.
    pub correlation: Mat,
    /// Covariance by the jackknife of the same parameters; empty where there is none.
    pub covariance: Mat,
    /// Covariance of the same parameters by what is known beforehand and may be off by its own deviation: no block of the readings shows that.
    pub by_knowledge: Mat,
    /// Covariance of the same parameters by the model alone if what is known beforehand were four times as far off: small where the readings themselves tell.
    pub by_readings: Mat,
    /// Those parameters.
    pub inside: Vec<usize>,
    /// Quantiles of Student's distribution for 95 % intervals by the jackknife, one per parameter.
    pub quantile: Vec<f64>,
}

/// Factor on the deviations of what is known beforehand that shows what hangs on it.
const WEAKER: f64 = 4.0;

/// Share of a unit diagonal that keeps a factor of sums alive which a block leaves without a parameter.
const RIDGE: f64 = 1e-12;

/// Quantile 0.975 of Student's distribution; infinite without a degree of freedom.
fn quantile(freedom: f64) -> f64 {
    dynid_estimate::distribution::t_quantile(0.975, freedom).unwrap_or(f64::INFINITY)
}

/// Covariance of the parameters `inside` by what is known beforehand: with the weights `Λ` and true deviations `s` of it the estimate moves by
/// `H⁻¹ Λ s`.
///
/// Parameters at a bound move along: where an open scale has brought one there, the bound tells nothing of the others.
fn by_knowledge(hessian: &Mat, free: &[Free], places: &[Place], inside: &[usize]) -> Mat {
    let m = inside.len();
    let mut out = Mat::zeros(m, m);
    let seen: Vec<usize> = (0..free.len()).filter(|k| places[*k] != Place::Unseen).collect();
    for (k, known) in free.iter().enumerate().filter_map(|(k, f)| Some((k, f.prior?))) {
        if places[k] == Place::Unseen {
            continue;
        }
        let mut pushed = vec![0.0; free.len()];
        pushed[k] = known.weight() * known.std;
        let Some(moved) = damped(hessian, &pushed, &seen, RIDGE) else { return out };
        let moved: Vec<f64> =
            inside.iter().map(|k| seen.binary_search(k).map_or(0.0, |at| moved[at])).collect();
        for (c, by) in moved.iter().enumerate() {
            out.col_mut(c).iter_mut().zip(&moved).for_each(|(to, a)| *to += a * by);
        }
    }
    out
}

/// Covariance of the parameters `inside` by the model with weaker knowledge.
fn by_readings(mut hessian: Mat, free: &[Free], inside: &[usize]) -> Mat {
    for (k, f) in free.iter().enumerate() {
        if let Some(known) = f.prior {
            hessian[(k, k)] += (WEAKER * known.std).powi(-2);
        }
    }
    let m = inside.len();
    let mut out = Mat::zeros(m, m);
    for (c, k) in inside.iter().enumerate() {
        let mut unit = vec![0.0; free.len()];
        unit[*k] = 1.0;
        let column = damped(&hessian, &unit, inside, RIDGE).unwrap_or_else(|| vec![f64::INFINITY; m]);
        out.col_mut(c).copy_from_slice(&column);
    }
    out
}

/// Standard deviations of a fit to all blocks.
///
/// With `H = Jᵀ W J`, blocks `b` of `B`, `g_b = J_bᵀ W r_b`: model `H⁻¹`; jackknife `(B-1)/B Σ δ_b δ_bᵀ` with
/// `δ_b = (H - H_b)⁻¹ g_b`, which has the leverage of every block in it (Efron and Stein 1981, linearised). Parameters at a bound
/// are left out of both: as columns they would widen all others.
pub fn deviations(problem: &ServoProblem<'_>, fitted: &Fitted) -> Deviations {
    let free = problem.free;
    let all = with_priors(fitted.evaluation.normal(&|_| true), free, &fitted.estimate).0;
    let inside: Vec<usize> = (0..free.len()).filter(|k| fitted.places[*k] == Place::Inside).collect();
    let m = inside.len();
    let mut out = Deviations {
        model: vec![None; free.len()],
        jackknife: vec![None; free.len()],
        correlation: Mat::identity(m, m),
        covariance: Mat::zeros(0, 0),
        by_knowledge: by_knowledge(&all, free, &fitted.places, &inside),
        by_readings: by_readings(fitted.evaluation.normal(&|_| true).0, free, &inside),
        inside: inside.clone(),
        quantile: vec![quantile(problem.blocks.len() as f64 - 1.0); free.len()],
    };
    let scale: Vec<f64> = inside.iter().map(|k| all[(*k, *k)].sqrt()).collect();
    let scaled = Mat::from_fn(m, m, |i, j| {
        all[(inside[i], inside[j])] / (scale[i] * scale[j]) + if i == j { RIDGE } else { 0.0 }
    });
    let Some(factor) = scaled.cholesky() else { return out };
    let inverse = factor.solve(&Mat::identity(m, m));
    for (i, k) in inside.iter().enumerate() {
        out.model[*k] = Some(inverse[(i, i)].sqrt() / scale[i]);
    }
    out.correlation = Mat::from_fn(m, m, |i, j| inverse[(i, j)] / (inverse[(i, i)] * inverse[(j, j)]).sqrt());
    let blocks = &fitted.evaluation.blocks;
    let share = (blocks.len() as f64 - 1.0) / blocks.len() as f64;
    let mut covariance = Mat::zeros(m, m);
    let mut fourth = vec![0.0; m];
    for block in blocks {
        let left = Mat::from_fn(free.len(), free.len(), |i, j| all[(i, j)] - block.hessian[(i, j)]);
        let Some(change) = damped(&left, &block.gradient, &inside, RIDGE) else { return out };
        for (c, by) in change.iter().enumerate() {
            let to = covariance.col_mut(c);
            to.iter_mut().zip(&change).for_each(|(t, d)| *t += share * by * d);
            fourth[c] += by.powi(4);
        }
    }
    if blocks.len() > 1 {
        for (i, k) in inside.iter().enumerate() {
            out.jackknife[*k] = Some(covariance[(i, i)].sqrt());
            // Where one block decides, such as the one rest of a record whose encoder stands still, a variance from many is that of one:
            // degrees of freedom by the fourth moment, blocks less one where all count alike (Satterthwaite 1946).
            let squares = covariance[(i, i)] / share;
            let counted = if fourth[i] > 0.0 { 3.0 * squares * squares / fourth[i] - 2.0 } else { 1.0 };
            out.quantile[*k] = quantile(counted.clamp(1.0, blocks.len() as f64 - 1.0));
        }
        out.covariance = covariance;
    }
    out
}
