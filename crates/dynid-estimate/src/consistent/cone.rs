//! Cones of the interior-point method: linear matrix inequalities on one link, and half-lines.

use dynid_model::symmetric::{
    Square, cholesky, congruence, inner, least_eigenvalue, lower_inverse, product, right_singular,
    singular_values, transpose,
};

/// Unknowns of one link.
pub(super) const LINK: usize = 10;

/// `Σ_j ξ_j E_j - M ⪰ 0` on ten consecutive unknowns.
#[derive(Debug, Clone)]
pub(super) struct Lmi<const N: usize> {
    /// First of its unknowns.
    pub first: usize,
    /// `E_j`.
    pub basis: [Square<N>; LINK],
    /// `M`.
    pub floor: Square<N>,
}

impl<const N: usize> Lmi<N> {
    /// `Σ ξ_j E_j`.
    pub(super) fn matrix(&self, xi: &[f64]) -> Square<N> {
        self.combine(&xi[self.first..self.first + LINK])
    }

    fn combine(&self, ten: &[f64]) -> Square<N> {
        let mut out = [[0.0; N]; N];
        for (x, e) in ten.iter().zip(&self.basis) {
            add_scaled(&mut out, *x, e);
        }
        out
    }

    /// `Σ ξ_j E_j - M`.
    pub(super) fn slack(&self, xi: &[f64]) -> Square<N> {
        let mut slack = self.matrix(xi);
        add_scaled(&mut slack, -1.0, &self.floor);
        slack
    }

    /// `⟨E_j, s⟩` for all j.
    pub(super) fn adjoint(&self, s: &Square<N>) -> [f64; LINK] {
        std::array::from_fn(|j| inner(&self.basis[j], s))
    }
}

/// `Σ factor ξ ≤ upper`.
#[derive(Debug, Clone)]
pub(super) struct Ray {
    pub terms: Vec<(usize, f64)>,
    pub upper: f64,
}

impl Ray {
    pub(super) fn along(&self, xi: &[f64]) -> f64 {
        self.terms.iter().map(|(k, f)| f * xi[*k]).sum()
    }

    pub(super) fn slack(&self, xi: &[f64]) -> f64 {
        self.upper - self.along(xi)
    }
}

/// Nesterov-Todd scaling of a slack `X` and its multiplier `S`: `G⁻¹ X G⁻ᵀ = Gᵀ S G = diag d`.
#[derive(Debug, Clone)]
pub(super) struct Scaling<const N: usize> {
    pub d: [f64; N],
    g_inverse: Square<N>,
    /// `G⁻¹ E_j G⁻ᵀ`.
    pub basis: [Square<N>; LINK],
}

impl<const N: usize> Scaling<N> {
    /// `None` unless both are positive definite to rounding.
    pub(super) fn new(cone: &Lmi<N>, slack: &Square<N>, multiplier: &Square<N>) -> Option<Self> {
        let (l, k) = (cholesky(slack)?, cholesky(multiplier)?);
        let (d, v) = right_singular(&product(&transpose(&k), &l));
        // G⁻¹ = d^{1/2} Vᵀ L⁻¹
        let mut g_inverse = product(&transpose(&v), &lower_inverse(&l));
        for (row, d) in g_inverse.iter_mut().zip(&d) {
            let root = d.sqrt();
            row.iter_mut().for_each(|x| *x *= root);
        }
        let finite =
            d.iter().all(|d| *d > 0.0 && d.is_finite()) && g_inverse.iter().flatten().all(|x| x.is_finite());
        let basis = std::array::from_fn(|j| congruence(&g_inverse, &cone.basis[j]));
        finite.then_some(Scaling { d, g_inverse, basis })
    }

    /// `G⁻¹ (Σ dξ_j E_j) G⁻ᵀ`.
    pub(super) fn scaled(&self, ten: &[f64]) -> Square<N> {
        let mut out = [[0.0; N]; N];
        for (x, e) in ten.iter().zip(&self.basis) {
            add_scaled(&mut out, *x, e);
        }
        out
    }

    /// `G⁻ᵀ s G⁻¹`: a change of the multiplier from its scaled form.
    pub(super) fn unscaled_multiplier(&self, s: &Square<N>) -> Square<N> {
        congruence(&transpose(&self.g_inverse), s)
    }

    /// Largest step that keeps `d + a t ⪰ 0`; infinite if any does.
    pub(super) fn longest(&self, t: &Square<N>) -> f64 {
        let relative: Square<N> =
            std::array::from_fn(|i| std::array::from_fn(|j| t[i][j] / (self.d[i] * self.d[j]).sqrt()));
        longest(least_eigenvalue(&relative))
    }
}

/// Largest step along a direction whose least relative change is `least`.
pub(super) fn longest(least: f64) -> f64 {
    if least < 0.0 { -1.0 / least } else { f64::INFINITY }
}

/// `to += factor · from`.
pub(super) fn add_scaled<const N: usize>(to: &mut Square<N>, factor: f64, from: &Square<N>) {
    for (t, f) in to.iter_mut().flatten().zip(from.iter().flatten()) {
        *t += factor * f;
    }
}

/// `diag(values)`.
pub(super) fn diagonal<const N: usize>(values: [f64; N]) -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { values[i] } else { 0.0 }))
}

/// Least eigenvalue of `X S` for positive definite `X`, `S`; `None` if one is not.
pub(super) fn least_product<const N: usize>(x: &Square<N>, s: &Square<N>) -> Option<f64> {
    let (l, k) = (cholesky(x)?, cholesky(s)?);
    let d = singular_values(&product(&transpose(&k), &l));
    Some(d.iter().map(|d| d * d).fold(f64::INFINITY, f64::min))
}
