//! Entropic distance of bodies (Lee, Wensing & Park 2020).
//!
//! `D(P | P0) = ln(det P0 / det P) + tr(P0⁻¹ P) - 4`, the Bregman divergence of `-ln det`: zero for equal bodies,
//! convex in `P`, and the same in every frame and in all units.

use dynid_model::Inertia;
use dynid_model::symmetric::{Square, cholesky, congruence, inner, lower_inverse, product, trace, transpose};

use super::cone::{LINK, add_scaled};

/// Value and derivatives of the distance with respect to the ten parameters of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Divergence {
    /// `D ≥ 0`, nats.
    pub value: f64,
    /// `∂D/∂x_k = tr((P0⁻¹ - P⁻¹) E_k)`.
    pub gradient: [f64; LINK],
    /// `∂²D/∂x_k∂x_l = tr(P⁻¹ E_k P⁻¹ E_l)`, positive definite.
    pub hessian: [[f64; LINK]; LINK],
}

/// Distance `D(P | P0)` of a body from a prior body; `None` unless both pseudo-inertias are positive definite.
pub fn divergence(body: &Inertia, prior: &Inertia) -> Option<Divergence> {
    let l = cholesky(&body.pseudo_inertia())?;
    let l0 = cholesky(&prior.pseudo_inertia())?;
    let (l_inverse, l0_inverse) = (lower_inverse(&l), lower_inverse(&l0));
    let log_det = |l: &Square<4>| 2.0 * (0..4).map(|i| l[i][i].ln()).sum::<f64>();
    let value = log_det(&l0) - log_det(&l) + trace(&congruence(&l0_inverse, &body.pseudo_inertia())) - 4.0;
    let inverse = product(&transpose(&l_inverse), &l_inverse);
    let mut slope = product(&transpose(&l0_inverse), &l0_inverse);
    add_scaled(&mut slope, -1.0, &inverse);
    let basis = parameter_basis();
    let scaled: [Square<4>; LINK] = std::array::from_fn(|k| congruence(&l_inverse, &basis[k]));
    Some(Divergence {
        value,
        gradient: std::array::from_fn(|k| inner(&slope, &basis[k])),
        hessian: std::array::from_fn(|k| std::array::from_fn(|m| inner(&scaled[k], &scaled[m]))),
    })
}

/// Quadratic distance `‖L⁻¹ (P - P0) L⁻ᵀ‖_F²`, `P0 = L Lᵀ`; `None` unless the prior's pseudo-inertia is positive
/// definite. Twice the second-order term of the entropic distance at the prior, and the whitened distance that
/// [`super::estimate`] fills unseen directions by.
pub fn pull_back(body: &Inertia, prior: &Inertia) -> Option<f64> {
    let l_inverse = lower_inverse(&cholesky(&prior.pseudo_inertia())?);
    let mut change = body.pseudo_inertia();
    add_scaled(&mut change, -1.0, &prior.pseudo_inertia());
    let whitened = congruence(&l_inverse, &change);
    Some(inner(&whitened, &whitened))
}

/// `E_k = ∂P/∂x_k`.
fn parameter_basis() -> [Square<4>; LINK] {
    std::array::from_fn(|k| {
        let mut unit = [0.0; LINK];
        unit[k] = 1.0;
        Inertia(unit).pseudo_inertia()
    })
}
