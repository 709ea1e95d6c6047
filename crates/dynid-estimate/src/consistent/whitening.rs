//! Whitened parameters: the prior body is the unit matrix, scalars are in units of their scale.

use dynid_linalg::Mat;
use dynid_linalg::vector::add_scaled;
use dynid_model::Inertia;
use dynid_model::symmetric::{Square, cholesky, congruence, lower_inverse, product, transpose};

use super::cone::{LINK, Lmi, Ray};
use super::manifold::Manifold;
use super::problem::{LinkPrior, Margin, Problem, ProblemError, Settings};
use super::program::Program;

/// Maps between parameters `x` and whitened unknowns `ξ`, which share their indices.
#[derive(Debug)]
pub(super) struct Whitening {
    links: Vec<WhiteLink>,
    /// Column and scale.
    scalars: Vec<(usize, f64)>,
    columns: usize,
}

#[derive(Debug)]
struct WhiteLink {
    first: usize,
    prior: Inertia,
    /// `P0 = L Lᵀ`.
    l: Square<4>,
    l_inverse: Square<4>,
    /// Row `j`: the parameters of the `j`-th whitened unit.
    units: [[f64; LINK]; LINK],
}

/// Orthonormal basis of symmetric 4 × 4 matrices in the order of `svec`.
fn svec_basis() -> [Square<4>; LINK] {
    let mut basis = [[[0.0; 4]; 4]; LINK];
    let pairs = (0..4).flat_map(|i| (i..4).map(move |j| (i, j)));
    for (e, (i, j)) in basis.iter_mut().zip(pairs) {
        let entry = if i == j { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
        (e[i][j], e[j][i]) = (entry, entry);
    }
    basis
}

impl WhiteLink {
    fn new(link: &LinkPrior) -> Option<Self> {
        let l = cholesky(&link.prior.pseudo_inertia())?;
        let units = svec_basis().map(|e| Inertia::from_pseudo_inertia(&congruence(&l, &e)).0);
        Some(WhiteLink {
            first: link.first_column,
            prior: link.prior,
            l,
            l_inverse: lower_inverse(&l),
            units,
        })
    }
}

/// The condition on a link as a matrix inequality of size `N`.
pub(super) trait ConeOf<const N: usize> {
    fn cone(&self, link: usize, margin: Margin) -> Lmi<N>;
}

impl ConeOf<4> for Whitening {
    fn cone(&self, link: usize, margin: Margin) -> Lmi<4> {
        let link = &self.links[link];
        Lmi { first: link.first, basis: svec_basis(), floor: floor(&link.l_inverse, margin) }
    }
}

impl ConeOf<6> for Whitening {
    fn cone(&self, link: usize, margin: Margin) -> Lmi<6> {
        let link = &self.links[link];
        // The spatial inertia of a body with positive definite pseudo-inertia is positive definite.
        let l = cholesky(&link.prior.spatial_inertia())
            .unwrap_or_else(|| unreachable!("a consistent body has a definite spatial inertia"));
        let l_inverse = lower_inverse(&l);
        let basis = link.units.map(|unit| congruence(&l_inverse, &Inertia(unit).spatial_inertia()));
        Lmi { first: link.first, basis, floor: floor(&l_inverse, margin) }
    }
}

fn floor<const N: usize>(l_inverse: &Square<N>, margin: Margin) -> Square<N> {
    let mut floor = match margin {
        Margin::Relative(_) => dynid_model::symmetric::identity(),
        Margin::Absolute(_) => product(l_inverse, &transpose(l_inverse)),
    };
    let (Margin::Relative(size) | Margin::Absolute(size)) = margin;
    floor.iter_mut().flatten().for_each(|x| *x *= size);
    floor
}

impl Whitening {
    pub(super) fn new(problem: &Problem) -> Result<Self, ProblemError> {
        let white = |link: &LinkPrior| {
            let fault = "has a singular pseudo-inertia";
            WhiteLink::new(link).ok_or(ProblemError::Prior { link: link.name.clone(), fault })
        };
        Ok(Whitening {
            links: problem.links.iter().map(white).collect::<Result<_, _>>()?,
            scalars: problem.scalars.iter().map(|s| (s.column, s.scale)).collect(),
            columns: problem.columns(),
        })
    }

    /// `x` of `ξ`.
    pub(super) fn parameters(&self, xi: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.columns];
        for link in &self.links {
            for (unit, value) in link.units.iter().zip(&xi[link.first..]) {
                for (x, u) in x[link.first..].iter_mut().zip(unit) {
                    *x += value * u;
                }
            }
        }
        for (column, scale) in &self.scalars {
            x[*column] = xi[*column] * scale;
        }
        x
    }

    /// `ξ` of `x`.
    pub(super) fn whitened(&self, x: &[f64]) -> Vec<f64> {
        let mut xi = vec![0.0; self.columns];
        let basis = svec_basis();
        for link in &self.links {
            let body = Inertia(std::array::from_fn(|k| x[link.first + k]));
            let white = congruence(&link.l_inverse, &body.pseudo_inertia());
            for (to, e) in xi[link.first..].iter_mut().zip(&basis) {
                *to = dynid_model::symmetric::inner(&white, e);
            }
        }
        for (column, scale) in &self.scalars {
            xi[*column] = x[*column] / scale;
        }
        xi
    }

    /// Cholesky factor of a link's prior pseudo-inertia.
    pub(super) fn factor(&self, link: usize) -> &Square<4> {
        &self.links[link].l
    }

    /// Factors of a combination of `x` as factors of `ξ`.
    fn pulled_back(&self, terms: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let mut dense = vec![0.0; self.columns];
        terms.iter().for_each(|(column, factor)| dense[*column] += factor);
        let mut out = Vec::new();
        for link in &self.links {
            let own = &dense[link.first..link.first + LINK];
            if own.iter().all(|f| *f == 0.0) {
                continue;
            }
            for (j, unit) in link.units.iter().enumerate() {
                out.push((link.first + j, own.iter().zip(unit).map(|(f, u)| f * u).sum()));
            }
        }
        for (column, scale) in &self.scalars {
            if dense[*column] != 0.0 {
                out.push((*column, dense[*column] * scale));
            }
        }
        out
    }

    /// `R T`: rows that act on `x` as rows that act on `ξ`.
    fn whitened_columns(&self, rows: &Mat) -> Mat {
        let mut a = Mat::zeros(rows.nrows(), self.columns);
        for link in &self.links {
            for (j, unit) in link.units.iter().enumerate() {
                let column = a.col_mut(link.first + j);
                for (k, u) in unit.iter().enumerate() {
                    if *u != 0.0 {
                        add_scaled(column, *u, rows.col(link.first + k));
                    }
                }
            }
        }
        for (column, scale) in &self.scalars {
            let to = a.col_mut(*column);
            add_scaled(to, *scale, rows.col(*column));
        }
        a
    }

    /// The problem in whitened unknowns.
    pub(super) fn program<const N: usize>(&self, problem: &Problem, settings: &Settings) -> Program<N>
    where
        Self: ConeOf<N>,
    {
        let mut prior = vec![0.0; self.columns];
        for link in &self.links {
            prior[link.first..link.first + LINK].copy_from_slice(&link.prior.0);
        }
        problem.scalars.iter().for_each(|s| prior[s.column] = s.prior);
        let data_rows = problem.r.nrows();
        let mut b = problem.z.clone();
        let rows = if settings.gaussian_weight > 0.0 {
            let weight: Vec<f64> =
                problem.prior_std.iter().map(|s| settings.gaussian_weight.sqrt() / s).collect();
            b.extend(weight.iter().zip(&prior).map(|(w, x)| w * x));
            &Mat::from_fn(data_rows + self.columns, self.columns, |i, j| match i.checked_sub(data_rows) {
                None => problem.r[(i, j)],
                Some(k) if k == j => weight[j],
                Some(_) => 0.0,
            })
        } else {
            &problem.r
        };
        let least = |scale: f64| match settings.margin {
            Margin::Relative(margin) => margin,
            Margin::Absolute(margin) => margin / scale,
        };
        let positive = problem.scalars.iter().filter(|s| s.nonnegative);
        let lower: Vec<(usize, f64)> = positive.map(|s| (s.column, least(s.scale))).collect();
        let mut rays: Vec<Ray> =
            lower.iter().map(|(k, least)| Ray { terms: vec![(*k, -1.0)], upper: -least }).collect();
        for bound in &problem.bounds {
            // Unit length, so that a violation is in whitened units.
            let terms = self.pulled_back(&bound.terms);
            let length = terms.iter().map(|(_, f)| f * f).sum::<f64>().sqrt();
            let terms = terms.into_iter().map(|(k, f)| (k, f / length)).collect();
            rays.push(Ray { terms, upper: bound.upper / length });
        }
        let equalities: Vec<_> =
            problem.equalities.iter().map(|e| (self.pulled_back(&e.terms), e.value)).collect();
        Program {
            plane: Manifold::new(self.columns, &equalities),
            a: self.whitened_columns(rows),
            b,
            data_rows,
            weight: vec![settings.prior_weight; self.columns],
            centre: self.whitened(&prior),
            entropy: settings.entropic_weight,
            cones: (0..self.links.len()).map(|i| self.cone(i, settings.margin)).collect(),
            rays,
            lower,
            scalars: self.scalars.iter().map(|(column, _)| *column).collect(),
        }
    }
}
