//! The linear system behind a direction: normal equations, or QR of the stacked rows where rounding forbids these.

use dynid_linalg::{Cholesky, Mat, Qr};
use dynid_model::symmetric::{Square, cholesky, congruence, inner, lower_inverse, product, transpose};

use super::super::cone::{LINK, Lmi};
use super::super::program::Program;
use super::Scalings;

/// What slack and multiplier shall sum up to after the step, in scaled form: `m d⁻¹ - c` per cone.
pub(super) struct Target<const N: usize> {
    pub links: Vec<Square<N>>,
    pub rays: Vec<f64>,
}

/// Factorised `2 AᵀA + 2 diag w + BᵀB + γ B_LᵀB_L`, `B` the scaled cones, `B_L` the entropic distance; with equalities on the
/// directions in their plane.
pub(super) enum Newton {
    /// Normal equations with the matrix, for refinement, and `∇F`.
    Normal(Box<Cholesky>, Mat, Vec<f64>),
    /// QR of the stack `[√2 A; √(2w); B; √γ B_L]`.
    Stack(Box<Qr>),
}

/// Matrix inequalities of the entropic distance at a point: `L⁻¹ E_j L⁻ᵀ` per link, with `L`.
type Entropic<const N: usize> = Vec<([Square<N>; LINK], Square<N>)>;

fn entropic<const N: usize>(program: &Program<N>, xi: &[f64]) -> Option<Entropic<N>> {
    if program.entropy == 0.0 {
        return Some(Vec::new());
    }
    let of = |cone: &Lmi<N>| {
        let l = cholesky(&cone.matrix(xi))?;
        let inverse = lower_inverse(&l);
        Some((std::array::from_fn(|j| congruence(&inverse, &cone.basis[j])), l))
    };
    program.cones.iter().map(of).collect()
}

fn add_gram<const N: usize>(h: &mut Mat, first: usize, factor: f64, basis: &[Square<N>; LINK]) {
    for j in 0..LINK {
        for k in 0..=j {
            let entry = factor * inner(&basis[j], &basis[k]);
            h[(first + j, first + k)] += entry;
            if k != j {
                h[(first + k, first + j)] += entry;
            }
        }
    }
}

impl Newton {
    /// `None` if the matrix is not positive definite to rounding.
    pub(super) fn new<const N: usize>(
        program: &Program<N>,
        quadratic: &Mat,
        xi: &[f64],
        scalings: &Scalings<N>,
        orthogonal: bool,
    ) -> Option<Self> {
        let entropic = entropic(program, xi)?;
        if orthogonal {
            let stack = program.in_plane(stack(program, scalings, &entropic));
            return Some(Newton::Stack(Box::new(stack.qr())));
        }
        let mut h = quadratic.clone();
        for (i, (cone, scaling)) in program.cones.iter().zip(&scalings.links).enumerate() {
            add_gram(&mut h, cone.first, 1.0, &scaling.basis);
            if let Some((basis, _)) = entropic.get(i) {
                add_gram(&mut h, cone.first, program.entropy, basis);
            }
        }
        for (ray, (_, ratio)) in program.rays.iter().zip(&scalings.rays) {
            for (j, f) in &ray.terms {
                for (k, g) in &ray.terms {
                    h[(*j, *k)] += ratio * ratio * f * g;
                }
            }
        }
        if let Some(plane) = &program.plane {
            h = plane.directions().transpose() * program.in_plane(h);
        }
        let factor = h.cholesky()?;
        Some(Newton::Normal(Box::new(factor), h, program.gradient(xi)?))
    }

    /// Change of the unknowns; `None` if it is not finite.
    pub(super) fn solve<const N: usize>(
        &self,
        program: &Program<N>,
        xi: &[f64],
        scalings: &Scalings<N>,
        target: &Target<N>,
    ) -> Option<Vec<f64>> {
        let change = match self {
            Newton::Normal(factor, h, gradient) => {
                let mut rhs = normal_side(program, gradient, scalings, target);
                if let Some(plane) = &program.plane {
                    rhs = plane.directions().transpose() * &rhs;
                }
                let mut change = factor.solve(&rhs);
                let left = &rhs - h * &change;
                change += factor.solve(&left);
                change
            }
            Newton::Stack(factor) => factor.solve_least_squares(&stack_side(program, xi, target)?),
        };
        let change = program.out_of_plane(change);
        let change: Vec<f64> = (0..program.unknowns()).map(|k| change[(k, 0)]).collect();
        change.iter().all(|x| x.is_finite()).then_some(change)
    }
}

/// `-∇F + Bᵀ target`.
fn normal_side<const N: usize>(
    program: &Program<N>,
    gradient: &[f64],
    scalings: &Scalings<N>,
    target: &Target<N>,
) -> Mat {
    let mut rhs = Mat::from_fn(program.unknowns(), 1, |k, _| -gradient[k]);
    for (i, (cone, scaling)) in program.cones.iter().zip(&scalings.links).enumerate() {
        for (j, basis) in scaling.basis.iter().enumerate() {
            rhs[(cone.first + j, 0)] += inner(basis, &target.links[i]);
        }
    }
    for (k, (ray, (_, ratio))) in program.rays.iter().zip(&scalings.rays).enumerate() {
        for (variable, f) in &ray.terms {
            rhs[(*variable, 0)] -= ratio * f * target.rays[k];
        }
    }
    rhs
}

/// Rows of a matrix inequality in the stack.
const fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Entries of a symmetric matrix as `svec` holds them.
fn svec<const N: usize>(s: &Square<N>) -> impl Iterator<Item = f64> + '_ {
    let pairs = (0..N).flat_map(|i| (i..N).map(move |j| (i, j)));
    pairs.map(|(i, j)| if i == j { s[i][i] } else { std::f64::consts::SQRT_2 * s[i][j] })
}

fn stack_rows<const N: usize>(program: &Program<N>) -> usize {
    let per_link = if program.entropy > 0.0 { 2 } else { 1 };
    program.a.nrows() + program.unknowns() + per_link * triangle(N) * program.cones.len() + program.rays.len()
}

fn stack<const N: usize>(program: &Program<N>, scalings: &Scalings<N>, entropic: &Entropic<N>) -> Mat {
    let (m, n) = (program.a.nrows(), program.unknowns());
    let mut j = Mat::zeros(stack_rows(program), n);
    for k in 0..n {
        for i in 0..m {
            j[(i, k)] = std::f64::consts::SQRT_2 * program.a[(i, k)];
        }
        j[(m + k, k)] = (2.0 * program.weight[k]).sqrt();
    }
    let mut row = m + n;
    for (i, (cone, scaling)) in program.cones.iter().zip(&scalings.links).enumerate() {
        let curved = entropic.get(i).map(|(basis, _)| (basis, program.entropy.sqrt()));
        for (basis, factor) in [(&scaling.basis, 1.0)].into_iter().chain(curved) {
            for (k, e) in basis.iter().enumerate() {
                svec(e).enumerate().for_each(|(r, x)| j[(row + r, cone.first + k)] = factor * x);
            }
            row += triangle(N);
        }
    }
    for (ray, (_, ratio)) in program.rays.iter().zip(&scalings.rays) {
        ray.terms.iter().for_each(|(k, f)| j[(row, *k)] -= ratio * f);
        row += 1;
    }
    j
}

fn stack_side<const N: usize>(program: &Program<N>, xi: &[f64], target: &Target<N>) -> Option<Mat> {
    let (m, n) = (program.a.nrows(), program.unknowns());
    let fit = Mat::from_fn(n, 1, |k, _| xi[k]);
    let fitted = &program.a * &fit;
    let mut side = Mat::zeros(stack_rows(program), 1);
    for i in 0..m {
        side[(i, 0)] = std::f64::consts::SQRT_2 * (program.b[i] - fitted[(i, 0)]);
    }
    for k in 0..n {
        side[(m + k, 0)] = (2.0 * program.weight[k]).sqrt() * (program.centre[k] - xi[k]);
    }
    let mut row = m + n;
    for (cone, target) in program.cones.iter().zip(&target.links) {
        svec(target).enumerate().for_each(|(r, x)| side[(row + r, 0)] = x);
        row += triangle(N);
        if program.entropy > 0.0 {
            let l = cholesky(&cone.matrix(xi))?;
            let mut pull = product(&transpose(&l), &l);
            for (i, entries) in pull.iter_mut().enumerate() {
                entries.iter_mut().for_each(|x| *x = -*x);
                entries[i] += 1.0;
            }
            svec(&pull).enumerate().for_each(|(r, x)| side[(row + r, 0)] = program.entropy.sqrt() * x);
            row += triangle(N);
        }
    }
    for t in &target.rays {
        side[(row, 0)] = *t;
        row += 1;
    }
    Some(side)
}
