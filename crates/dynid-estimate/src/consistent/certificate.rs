//! A proven bound on the excess of a consistent point over the optimum.
//!
//! `F` is convex: `F(y) ≥ F(ξ) + ∇F(ξ)·(y - ξ)`, and the right side is least over
//! `{X_i ⪰ M_i, tr X_i ≤ β_i, scalars in a box}` in closed form. Any multipliers `≥ 0` of the bounds may be used; no
//! centrality is assumed, so that the bound checks any solver's answer.

use dynid_model::symmetric::{Square, cholesky, eigen, inner, least_eigenvalue, trace};

use super::cone::{LINK, Lmi, add_scaled};
use super::program::Program;

/// The box is this many times the size of the point.
const BOX: f64 = 10.0;

/// Gap at `xi` with multipliers `bounds` of the bounds, `equalities` of the equalities, any numbers, and `links` of the matrix
/// inequalities, which only the 6 × 6 form needs. `None` if the point is not consistent.
pub(super) fn gap<const N: usize>(
    program: &Program<N>,
    xi: &[f64],
    bounds: &[f64],
    equalities: &[f64],
    links: Option<&[Square<N>]>,
) -> Option<f64> {
    let gradient = program.gradient(xi)?;
    let mut cost = gradient.clone();
    let mut gap: f64 = gradient.iter().zip(xi).map(|(g, x)| g * x).sum();
    for (ray, y) in program.rays[program.lower.len()..].iter().zip(bounds) {
        if ray.slack(xi) < 0.0 {
            return None;
        }
        ray.terms.iter().for_each(|(k, f)| cost[*k] += y * f);
        gap += y * ray.upper;
    }
    if let Some(plane) = &program.plane {
        gap += plane.charge(equalities, &mut cost);
    }
    for (i, cone) in program.cones.iter().enumerate() {
        let slack = cone.slack(xi);
        if cholesky(&slack).is_none() && least_eigenvalue(&slack) < 0.0 {
            return None;
        }
        let own = &cost[cone.first..cone.first + LINK];
        let limit = BOX * (N as f64).max(trace(&cone.matrix(xi)));
        gap -= match links {
            Some(multipliers) => least_with(cone, own, &multipliers[i], limit),
            None => least_over_bodies(cone, own, limit),
        };
    }
    for k in &program.scalars {
        let size = BOX * xi[*k].abs().max(1.0);
        let low = program.lower.iter().find(|(scalar, _)| scalar == k).map_or(-size, |(_, low)| *low);
        if xi[*k] < low {
            return None;
        }
        gap -= (cost[*k] * low).min(cost[*k] * size);
    }
    Some(gap)
}

/// `min ⟨C, X⟩` over `X ⪰ M`, `tr X ≤ limit`, for an orthonormal basis of all symmetric matrices.
fn least_over_bodies<const N: usize>(cone: &Lmi<N>, cost: &[f64], limit: f64) -> f64 {
    let mut c = [[0.0; N]; N];
    cost.iter().zip(&cone.basis).for_each(|(x, e)| add_scaled(&mut c, *x, e));
    inner(&c, &cone.floor) + (limit - trace(&cone.floor)) * least_eigenvalue(&c).min(0.0)
}

/// Lower bound of `cost · ξ` over the same set in a basis that does not span all symmetric matrices.
///
/// The multiplier is first moved by the least change that makes it reproduce the cost; what the change leaves is rounding
/// and is charged against the longest `ξ` that the trace allows.
fn least_with<const N: usize>(cone: &Lmi<N>, cost: &[f64], multiplier: &Square<N>, limit: f64) -> f64 {
    let gram: Square<LINK> =
        std::array::from_fn(|j| std::array::from_fn(|k| inner(&cone.basis[j], &cone.basis[k])));
    let (values, vectors) = eigen(&gram);
    let mut moved = *multiplier;
    let missing: [f64; LINK] = residual(cone, cost, multiplier);
    for (value, k) in values.iter().zip(0..LINK) {
        let along: f64 = (0..LINK).map(|j| vectors[j][k] * missing[j]).sum();
        for (j, e) in cone.basis.iter().enumerate() {
            add_scaled(&mut moved, along / value * vectors[j][k], e);
        }
    }
    let left = residual(cone, cost, &moved).iter().map(|x| x * x).sum::<f64>().sqrt();
    let longest = limit / values[0].sqrt();
    inner(&moved, &cone.floor) + (limit - trace(&cone.floor)) * least_eigenvalue(&moved).min(0.0)
        - left * longest
}

fn residual<const N: usize>(cone: &Lmi<N>, cost: &[f64], multiplier: &Square<N>) -> [f64; LINK] {
    let given = cone.adjoint(multiplier);
    std::array::from_fn(|j| cost[j] - given[j])
}
