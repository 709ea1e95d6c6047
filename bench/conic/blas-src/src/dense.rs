//! The arithmetic behind the symbols, on column-major matrices.

use num_traits::Float;

/// Most sweeps of a Jacobi iteration; convergence is quadratic, so that six to eight do.
const SWEEPS: usize = 30;

/// Entries of a matrix that an operation touches or that are given.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Part {
    Whole,
    Upper,
    Lower,
}

/// Read access to a matrix or its transpose.
pub(crate) struct View<'a, T> {
    pub data: &'a [T],
    pub stride: usize,
    pub transposed: bool,
}

impl<T: Copy> View<'_, T> {
    pub(crate) fn at(&self, i: usize, j: usize) -> T {
        let (i, j) = if self.transposed { (j, i) } else { (i, j) };
        self.data[i + j * self.stride]
    }

    /// Entry of a symmetric matrix of which one triangle is given.
    pub(crate) fn symmetric(&self, part: Part, i: usize, j: usize) -> T {
        if (part == Part::Upper) == (i <= j) { self.at(i, j) } else { self.at(j, i) }
    }
}

/// Write access to a matrix.
pub(crate) struct Columns<'a, T> {
    pub data: &'a mut [T],
    pub stride: usize,
}

impl<T: Float> Columns<'_, T> {
    fn at(&self, i: usize, j: usize) -> T {
        self.data[i + j * self.stride]
    }

    fn set(&mut self, i: usize, j: usize, value: T) {
        self.data[i + j * self.stride] = value;
    }

    /// `c_ij := β c_ij + Σ_p term(i, j, p)` for a matrix of `m × n` and `p < k`. `β = 0` overwrites what is there.
    pub(crate) fn update(
        &mut self,
        (m, n, k): (usize, usize, usize),
        part: Part,
        beta: T,
        term: impl Fn(usize, usize, usize) -> T,
    ) {
        for j in 0..n {
            let rows = match part {
                Part::Whole => 0..m,
                Part::Upper => 0..j + 1,
                Part::Lower => j..m,
            };
            for i in rows {
                let start = if beta == T::zero() { T::zero() } else { beta * self.at(i, j) };
                self.set(i, j, (0..k).fold(start, |sum, p| sum + term(i, j, p)));
            }
        }
    }

    fn exchange_rows(&mut self, first: usize, second: usize, columns: usize) {
        for j in 0..columns {
            self.data.swap(first + j * self.stride, second + j * self.stride);
        }
    }
}

/// Overwrites the lower triangle by `L`, or the upper by `Lᵀ`, with `A = L Lᵀ`. Answers 0, or the order of the leading
/// minor that is not positive.
pub(crate) fn cholesky<T: Float>(a: &mut Columns<'_, T>, n: usize, part: Part) -> i32 {
    let place = |i: usize, j: usize| if part == Part::Upper { (j, i) } else { (i, j) };
    for j in 0..n {
        for i in j..n {
            let entry = |r: usize, c: usize| {
                let (r, c) = place(r, c);
                a.at(r, c)
            };
            let left = (0..j).fold(entry(i, j), |sum, p| sum - entry(i, p) * entry(j, p));
            let value = if i > j { left / entry(j, j) } else { left.sqrt() };
            if i == j && (left.is_nan() || left <= T::zero()) {
                return j as i32 + 1;
            }
            let (r, c) = place(i, j);
            a.set(r, c, value);
        }
    }
    0
}

/// `B := (L Lᵀ)⁻¹ B`.
pub(crate) fn cholesky_solve<T: Float>(l: &View<'_, T>, b: &mut Columns<'_, T>, n: usize, sides: usize) {
    for k in 0..sides {
        for i in 0..n {
            let left = (0..i).fold(b.at(i, k), |sum, p| sum - l.at(i, p) * b.at(p, k));
            b.set(i, k, left / l.at(i, i));
        }
        for i in (0..n).rev() {
            let left = (i + 1..n).fold(b.at(i, k), |sum, p| sum - l.at(p, i) * b.at(p, k));
            b.set(i, k, left / l.at(i, i));
        }
    }
}

/// `B := A⁻¹ B` by Gaussian elimination with row exchanges, which are reported from 1. Answers 0, or the position of a
/// pivot that is zero, also from 1.
pub(crate) fn eliminate<T: Float>(
    a: &mut Columns<'_, T>,
    b: &mut Columns<'_, T>,
    pivots: &mut [i32],
    n: usize,
    sides: usize,
) -> i32 {
    for (j, exchanged) in pivots.iter_mut().enumerate().take(n) {
        let pivot = (j..n).fold(j, |best, i| if a.at(i, j).abs() > a.at(best, j).abs() { i } else { best });
        *exchanged = pivot as i32 + 1;
        if a.at(pivot, j) == T::zero() {
            return j as i32 + 1;
        }
        a.exchange_rows(j, pivot, n);
        b.exchange_rows(j, pivot, sides);
        for i in j + 1..n {
            let factor = a.at(i, j) / a.at(j, j);
            a.set(i, j, factor);
            (j + 1..n).for_each(|k| a.set(i, k, a.at(i, k) - factor * a.at(j, k)));
            (0..sides).for_each(|k| b.set(i, k, b.at(i, k) - factor * b.at(j, k)));
        }
    }
    for k in 0..sides {
        for i in (0..n).rev() {
            let left = (i + 1..n).fold(b.at(i, k), |sum, p| sum - a.at(i, p) * b.at(p, k));
            b.set(i, k, left / a.at(i, i));
        }
    }
    0
}

/// Cosine and sine of the rotation that annihilates an off-diagonal entry, from `cot 2θ`; the smaller of the two.
fn rotation<T: Float>(cot: T) -> (T, T) {
    let t = cot.signum() / (cot.abs() + (T::one() + cot * cot).sqrt());
    let c = (T::one() + t * t).sqrt().recip();
    (c, t * c)
}

/// Rotates columns `p` and `q`.
fn rotate<T: Float>(a: &mut Columns<'_, T>, rows: usize, (p, q): (usize, usize), (c, s): (T, T)) {
    for i in 0..rows {
        let (x, y) = (a.at(i, p), a.at(i, q));
        a.set(i, p, c * x - s * y);
        a.set(i, q, s * x + c * y);
    }
}

fn unit<T: Float>(n: usize) -> Vec<T> {
    (0..n * n).map(|k| if k % (n + 1) == 0 { T::one() } else { T::zero() }).collect()
}

/// Positions of `values` in ascending order.
fn order<T: Float>(values: &[T]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|i, j| values[*i].partial_cmp(&values[*j]).unwrap_or(std::cmp::Ordering::Equal));
    order
}

/// Eigenvalues, ascending, of a symmetric matrix of which one triangle is given, by Jacobi rotations; the matrix is
/// overwritten.
pub(crate) fn eigen<T: Float>(
    a: &mut Columns<'_, T>,
    n: usize,
    part: Part,
    values: &mut [T],
    vectors: Option<Columns<'_, T>>,
) {
    for j in 0..n {
        for i in 0..j {
            let given = if part == Part::Upper { a.at(i, j) } else { a.at(j, i) };
            a.set(i, j, given);
            a.set(j, i, given);
        }
    }
    let mut all = unit(n);
    let mut v = Columns { data: &mut all, stride: n };
    let square = |x: T| x * x;
    for _ in 0..SWEEPS {
        let total = (0..n * n).fold(T::zero(), |sum, k| sum + square(a.at(k % n, k / n)));
        let off = (0..n).flat_map(|j| (0..j).map(move |i| (i, j)));
        let off = off.fold(T::zero(), |sum, (i, j)| sum + square(a.at(i, j)));
        if off <= square(T::epsilon()) * total {
            break;
        }
        for q in 1..n {
            for p in 0..q {
                let entry = a.at(p, q);
                if entry == T::zero() {
                    continue;
                }
                let (c, s) = rotation((a.at(q, q) - a.at(p, p)) / (entry + entry));
                rotate(a, n, (p, q), (c, s));
                for k in 0..n {
                    let (x, y) = (a.at(p, k), a.at(q, k));
                    a.set(p, k, c * x - s * y);
                    a.set(q, k, s * x + c * y);
                }
                rotate(&mut v, n, (p, q), (c, s));
            }
        }
    }
    let diagonal: Vec<T> = (0..n).map(|k| a.at(k, k)).collect();
    let order = order(&diagonal);
    values.iter_mut().zip(&order).for_each(|(value, k)| *value = diagonal[*k]);
    if let Some(mut out) = vectors {
        for (j, k) in order.iter().enumerate() {
            (0..n).for_each(|i| out.set(i, j, v.at(i, *k)));
        }
    }
}

/// `A = U diag(s) Vᵀ` with `min(m, n)` singular values, descending, by one-sided Jacobi rotations: small singular values of
/// a matrix with columns of very different length keep their relative accuracy (Demmel & Veselić 1992). Left vectors of
/// zero singular values (right ones, if `m < n`) are zero.
pub(crate) fn singular<T: Float>(
    a: &View<'_, T>,
    (m, n): (usize, usize),
    values: &mut [T],
    u: &mut Columns<'_, T>,
    vt: &mut Columns<'_, T>,
) {
    // The longer side stays, the columns of the shorter are rotated.
    let (long, few) = (m.max(n), m.min(n));
    let given = |i: usize, j: usize| if m >= n { a.at(i, j) } else { a.at(j, i) };
    let mut rotated: Vec<T> = (0..long * few).map(|k| given(k % long, k / long)).collect();
    let mut w = Columns { data: &mut rotated, stride: long };
    let mut all = unit(few);
    let mut v = Columns { data: &mut all, stride: few };
    let dot = |w: &Columns<'_, T>, p: usize, q: usize| {
        (0..long).fold(T::zero(), |sum, i| sum + w.at(i, p) * w.at(i, q))
    };
    for _ in 0..SWEEPS {
        let mut settled = true;
        for q in 1..few {
            for p in 0..q {
                let (pp, qq, pq) = (dot(&w, p, p), dot(&w, q, q), dot(&w, p, q));
                if pq.abs() <= T::epsilon() * (pp * qq).sqrt() {
                    continue;
                }
                settled = false;
                let by = rotation((qq - pp) / (pq + pq));
                rotate(&mut w, long, (p, q), by);
                rotate(&mut v, few, (p, q), by);
            }
        }
        if settled {
            break;
        }
    }
    let lengths: Vec<T> = (0..few).map(|k| dot(&w, k, k).sqrt()).collect();
    for (k, from) in order(&lengths).into_iter().rev().enumerate() {
        values[k] = lengths[from];
        let scale = if lengths[from] > T::zero() { lengths[from].recip() } else { T::zero() };
        for i in 0..m {
            u.set(i, k, if m >= n { scale * w.at(i, from) } else { v.at(i, from) });
        }
        for j in 0..n {
            vt.set(k, j, if m >= n { v.at(j, from) } else { scale * w.at(j, from) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries in `[-1, 1)` without a pattern.
    fn entries(count: usize) -> Vec<f64> {
        (0..count).map(|k| ((k as f64 + 1.0) * 0.754_877_666).fract() * 2.0 - 1.0).collect()
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }

    fn symmetric(n: usize) -> Vec<f64> {
        let e = entries(n * n);
        (0..n * n).map(|k| e[k] + e[k / n + k % n * n]).collect()
    }

    #[test]
    fn singular_vectors_and_values_give_back_the_matrix() {
        for (m, n) in [(4, 4), (6, 4), (4, 6), (1, 1)] {
            let (given, few) = (entries(m * n), m.min(n));
            let (mut s, mut u, mut vt) = (vec![0.0; few], vec![0.0; m * few], vec![0.0; few * n]);
            let a = View { data: &given, stride: m, transposed: false };
            let mut left = Columns { data: &mut u, stride: m };
            let mut right = Columns { data: &mut vt, stride: few };
            singular(&a, (m, n), &mut s, &mut left, &mut right);
            assert!(s.is_sorted_by(|a, b| a >= b) && s[few - 1] > 0.0, "{s:?}");
            for i in 0..m {
                for j in 0..n {
                    close(a.at(i, j), (0..few).map(|k| left.at(i, k) * s[k] * right.at(k, j)).sum());
                }
            }
            for k in 0..few {
                close(1.0, (0..m).map(|i| left.at(i, k).powi(2)).sum());
                close(1.0, (0..n).map(|j| right.at(k, j).powi(2)).sum());
            }
        }
    }

    #[test]
    fn eigenvectors_diagonalise_whichever_triangle_is_given() {
        let given = symmetric(6);
        let mut of_both = Vec::new();
        for part in [Part::Upper, Part::Lower] {
            let (mut a, mut values, mut z) = (given.clone(), vec![0.0; 6], vec![0.0; 36]);
            for k in (0..36).filter(|k| (part == Part::Upper) == (k % 6 > k / 6)) {
                a[k] = if k % 6 == k / 6 { a[k] } else { f64::NAN };
            }
            let vectors = Columns { data: &mut z, stride: 6 };
            eigen(&mut Columns { data: &mut a, stride: 6 }, 6, part, &mut values, Some(vectors));
            assert!(values.is_sorted());
            for i in 0..6 {
                for k in 0..6 {
                    let along: f64 = (0..6).map(|j| given[i + 6 * j] * z[j + 6 * k]).sum();
                    close(along, values[k] * z[i + 6 * k]);
                }
            }
            of_both.push(values);
        }
        of_both[0].iter().zip(&of_both[1]).for_each(|(a, b)| close(*a, *b));
    }

    #[test]
    fn solutions_of_both_factorisations_fit() {
        let mut positive = symmetric(4);
        (0..4).for_each(|k| positive[5 * k] += 5.0);
        let side = entries(8);
        let fits = |x: &[f64]| {
            for (k, b) in side.iter().enumerate() {
                close(*b, (0..4).map(|j| positive[k % 4 + 4 * j] * x[j + k / 4 * 4]).sum());
            }
        };
        for part in [Part::Upper, Part::Lower] {
            let (mut a, mut x) = (positive.clone(), side.clone());
            assert_eq!(cholesky(&mut Columns { data: &mut a, stride: 4 }, 4, part), 0);
            let l = View { data: &a, stride: 4, transposed: part == Part::Upper };
            cholesky_solve(&l, &mut Columns { data: &mut x, stride: 4 }, 4, 2);
            fits(&x);
        }
        let (mut a, mut x, mut pivots) = (positive.clone(), side.clone(), [0; 4]);
        let mut b = Columns { data: &mut x, stride: 4 };
        assert_eq!(eliminate(&mut Columns { data: &mut a, stride: 4 }, &mut b, &mut pivots, 4, 2), 0);
        fits(&x);
        positive[5] = -1.0;
        assert_eq!(cholesky(&mut Columns { data: &mut positive, stride: 4 }, 4, Part::Lower), 2);
        let mut zero = [0.0_f32; 4];
        let mut none = Columns { data: &mut [], stride: 2 };
        assert_eq!(eliminate(&mut Columns { data: &mut zero, stride: 2 }, &mut none, &mut [0; 2], 2, 0), 1);
    }
}
