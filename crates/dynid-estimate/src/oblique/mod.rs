//! Projection along instruments: what the factor of paired rows says of `(ZᵀW)⁻¹Zᵀ`.

mod paired;

pub use paired::{crossed, half, measured, paired_columns, simulated};

use dynid_linalg::Mat;

use crate::covariance::{Jackknife, jackknife_by};
use crate::least_squares::{LinearSolution, ols};
use dynid_factor::Factor;
use dynid_factor::rank::{certainly_full_rank, numerical_rank, singular_values};
use dynid_linalg::triangular::{inverse, solve_upper};

/// The oblique projection of paired rows onto independent columns.
pub(crate) struct Oblique {
    /// Base columns in use, ascending; the others are not excited, or not by the instruments.
    pub(crate) kept: Vec<usize>,
    /// Number of base columns that the log excites.
    pub(crate) excited: usize,
    /// `[Q_ZᵀW | Q_Zᵀy]` as a factor, `ρ` zero: its least-squares solution is that of `Zᵀ(W x - y) = 0`.
    pub(crate) fitted: Factor,
    /// `A = Z⁺W`, `kept × kept`: fitted regressors are `Z A`.
    pub(crate) fit: Mat,
    /// Smallest singular value of `Q_ZᵀQ_W`: the cosine of the largest angle between instruments and regressors.
    pub(crate) strength: f64,
}

impl Oblique {
    /// From a merged, weighted factor of paired rows in `2 total` columns.
    pub(crate) fn new(paired: &Factor) -> Self {
        let total = paired.columns() / 2;
        let of_w: Vec<usize> = (total..2 * total).collect();
        let independent = numerical_rank(&paired.select(&of_w)).independent;
        let excited = independent.len();
        let kept = chosen(&independent, &numerical_rank(&paired.select(&independent)).independent);
        let mut found = Self { excited, ..Self::on(paired, kept) };
        // Instruments and regressors may each be independent and yet not see each other.
        while !found.kept.is_empty() && !certainly_full_rank(&found.fitted) {
            let seen = ols(&found.fitted).kept;
            if seen.len() == found.kept.len() {
                break;
            }
            found = Self { excited, ..Self::on(paired, chosen(&found.kept, &seen)) };
        }
        found
    }

    /// On given columns, independent among the instruments.
    pub(crate) fn on(paired: &Factor, kept: Vec<usize>) -> Self {
        let p = kept.len();
        let own = paired.select(&pair(&kept, paired.columns() / 2));
        let (zz, zw) = (corner(&own, 0), corner(&own, p));
        let z = own.z();
        let fitted =
            Factor::from_triangle(p, |i, j| if j < p { zw[(i, j)] } else { z[i] }, 0.0, paired.rows());
        let of_w: Vec<usize> = (p..2 * p).collect();
        let angles = zw * inverse(&own.select(&of_w).r_matrix());
        let strength = singular_values(&angles).last().copied().unwrap_or(0.0).min(1.0);
        Oblique { excited: p, fit: solve_upper(&zz, &corner(&own, p)), kept, fitted, strength }
    }

    /// Solution in the kept columns, with rank and conditioning of the fitted regressors.
    pub(crate) fn solution(&self) -> LinearSolution {
        ols(&self.fitted)
    }

    /// Leverage `tr W_g (ZᵀW)⁻¹ Z_gᵀ` of paired rows in `2 total` columns, weighted as the whole.
    pub(crate) fn leverage(&self, group: &Factor) -> f64 {
        let p = self.kept.len();
        let own = group.select(&pair(&self.kept, group.columns() / 2));
        let rows = own.triangle();
        let inverse = inverse(&self.fitted.r_matrix());
        let (z, w) = (rows.columns(0..p), rows.columns(p..2 * p));
        let (left, right) = (w * &inverse, z * &self.fit * &inverse);
        let product = |(i, j): (usize, usize)| left[(i, j)] * right[(i, j)];
        (0..left.nrows()).flat_map(|i| (0..p).map(move |j| (i, j))).map(product).sum()
    }

    /// Combination that turns paired rows in `2 total` columns into fitted ones, `[Z A | Z A x + y - W x]`: `A` in all columns,
    /// and what is added to the effort.
    pub(crate) fn fitted_rows(&self, total: usize, x: &[f64]) -> (Mat, Vec<f64>) {
        let mut a = Mat::zeros(2 * total, total);
        for (j, to) in self.kept.iter().enumerate() {
            for (i, from) in self.kept.iter().enumerate() {
                a[(*from, *to)] = self.fit[(i, j)];
            }
        }
        let mut b: Vec<f64> = (0..2 * total).map(|i| (0..total).map(|j| a[(i, j)] * x[j]).sum()).collect();
        b[total..].iter_mut().zip(x).for_each(|(b, x)| *b -= x);
        (a, b)
    }
}

/// Instrument and regressor columns of the base columns given.
pub(crate) fn pair(kept: &[usize], total: usize) -> Vec<usize> {
    paired_columns(kept, total)
}

fn chosen(of: &[usize], positions: &[usize]) -> Vec<usize> {
    positions.iter().map(|k| of[*k]).collect()
}

/// First `p` rows of `p` columns of a factor in `2 p` columns, from a column on.
fn corner(factor: &Factor, from: usize) -> Mat {
    let p = factor.columns() / 2;
    Mat::from_fn(p, p, |i, j| factor.r(i, from + j))
}

/// Delete-a-block jackknife of `Zᵀ(W x - y) = 0`, solved again without each block, weights fixed.
///
/// `blocks`: weighted paired blocks in the kept columns, instruments first; `x`: the joint solution. A block without which
/// instruments no longer determine all parameters counts as indispensable.
pub(crate) fn jackknife(blocks: &[Factor], x: &[f64]) -> Option<Jackknife> {
    let p = x.len();
    let shift: Vec<f64> = vec![0.0; p].into_iter().chain(x.iter().copied()).collect();
    // Centred at x, the solution without a block is the change itself, free of cancellation.
    let centred: Vec<Factor> = blocks.iter().map(|b| b.centred(&shift)).collect();
    jackknife_by(&centred, &vec![0.0; p], |rest| {
        let z = rest.z();
        let entry = |i: usize, j: usize| if j < p { rest.r(i, p + j) } else { z[i] };
        let instruments: Vec<usize> = (0..p).collect();
        let fitted = Factor::from_triangle(p, entry, 0.0, rest.rows());
        (certainly_full_rank(&rest.select(&instruments)) && certainly_full_rank(&fitted))
            .then(|| fitted.solve())
    })
}
