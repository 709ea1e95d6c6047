//! Small dense matrices, and Householder triangles of them with a rank.

use dynid_linalg::vector::{add_scaled, dot, norm};
use rayon::prelude::*;

/// Values that are worth a thread.
pub(super) const PARALLEL_VALUES: usize = 10_000;

/// A dense matrix, column after column.
#[derive(Debug, Clone)]
pub(super) struct Columns {
    rows: usize,
    data: Vec<f64>,
}

impl Columns {
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        Columns { rows, data: vec![0.0; rows * columns] }
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn count(&self) -> usize {
        self.data.len().checked_div(self.rows).unwrap_or(0)
    }

    pub(super) fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..][..self.rows]
    }

    pub(super) fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..][..self.rows]
    }

    /// Columns from one on, to be written; few enough values stay with the caller's thread.
    pub(super) fn columns_from(&mut self, first: usize) -> impl IndexedParallelIterator<Item = &mut [f64]> {
        let rows = self.rows.max(1);
        self.data[first * self.rows..].par_chunks_mut(rows).with_min_len((PARALLEL_VALUES / rows).max(1))
    }

    /// Column `j`, to be read, beside column `k`, to be written.
    fn pair(&mut self, j: usize, k: usize) -> (&[f64], &mut [f64]) {
        let rows = self.rows;
        if j < k {
            let (left, right) = self.data.split_at_mut(k * rows);
            (&left[j * rows..][..rows], &mut right[..rows])
        } else {
            let (left, right) = self.data.split_at_mut(j * rows);
            (&right[..rows], &mut left[k * rows..][..rows])
        }
    }
}

/// Householder QR with column pivoting, stopped at the numerical rank.
#[derive(Debug, Clone)]
pub(super) struct PivotedQr {
    /// Column `order[k]`: entries of `R` down to row `k`, below them the reflector, whose first entry is 1.
    a: Columns,
    tau: Vec<f64>,
    /// Columns as they were taken; those beyond the rank are dependent.
    order: Vec<usize>,
    rank: usize,
}

impl PivotedQr {
    /// `sizes`: per column, what its remainder is measured against; a column is dependent when its remainder is below
    /// `100 ε max(rows, columns) √columns` of that. `rows`: rows that the matrix stands for.
    pub(super) fn new(mut a: Columns, sizes: &[f64], rows: usize) -> Self {
        let n = sizes.len();
        let tolerance = 100.0 * f64::EPSILON * rows.max(n) as f64 * (n as f64).sqrt();
        let (mut order, mut tau): (Vec<usize>, Vec<f64>) = ((0..n).collect(), Vec::new());
        let mut rank = 0;
        while rank < n.min(a.rows()) {
            let remainder = |c: usize| match sizes[c] {
                0.0 => 0.0,
                size => norm(&a.column(c)[rank..]) / size,
            };
            let (at, largest) = (rank..n)
                .map(|k| (k, remainder(order[k])))
                .fold((rank, 0.0), |best, next| if next.1 > best.1 { next } else { best });
            if largest <= tolerance {
                break;
            }
            // Rotation, not exchange: equal columns are then taken in the order given.
            order[rank..=at].rotate_right(1);
            let pivot = order[rank];
            let t = reflector(&mut a.column_mut(pivot)[rank..]);
            for &c in &order[rank + 1..] {
                let (v, x) = a.pair(pivot, c);
                reflect(&v[rank..], t, &mut x[rank..]);
            }
            tau.push(t);
            rank += 1;
        }
        PivotedQr { a, tau, order, rank }
    }

    pub(super) fn rank(&self) -> usize {
        self.rank
    }

    /// Columns that others make up, ascending.
    pub(super) fn dependent(&self) -> Vec<usize> {
        let mut dependent = self.order[self.rank..].to_vec();
        dependent.sort_unstable();
        dependent
    }

    /// `Qᵀ x` in place: the first `rank` entries lie in the span, the others outside.
    pub(super) fn rotate(&self, x: &mut [f64]) {
        for (k, t) in self.tau.iter().enumerate() {
            reflect(&self.a.column(self.order[k])[k..], *t, &mut x[k..]);
        }
    }

    /// Solution of `R x = top`, zero for dependent columns.
    pub(super) fn solve(&self, top: &[f64]) -> Vec<f64> {
        let mut rest = top[..self.rank].to_vec();
        let mut x = vec![0.0; self.order.len()];
        for k in (0..self.rank).rev() {
            let column = self.a.column(self.order[k]);
            let value = rest[k] / column[k];
            x[self.order[k]] = value;
            add_scaled(&mut rest[..k], -value, &column[..k]);
        }
        x
    }
}

/// Replaces `x` by `[β, v_1, ..]` with `(1 - τ v vᵀ) x = β e_0`, `v_0 = 1`; returns `τ`.
fn reflector(x: &mut [f64]) -> f64 {
    let tail = norm(&x[1..]);
    if tail == 0.0 {
        return 0.0;
    }
    let alpha = x[0];
    let beta = -alpha.hypot(tail).copysign(alpha);
    let scale = 1.0 / (alpha - beta);
    x[1..].iter_mut().for_each(|v| *v *= scale);
    x[0] = beta;
    (beta - alpha) / beta
}

/// `x - τ v vᵀ x`, where the first entry of `v` counts as 1.
fn reflect(v: &[f64], tau: f64, x: &mut [f64]) {
    if tau == 0.0 {
        return;
    }
    let share = tau * (x[0] + dot(&v[1..], &x[1..]));
    x[0] -= share;
    add_scaled(&mut x[1..], -share, &v[1..]);
}

/// Triangle of a tall matrix, `min(rows, columns)` rows, columns in their order.
pub(super) fn triangle(mut a: Columns) -> Columns {
    let n = a.count();
    let height = a.rows().min(n);
    for k in 0..height {
        let t = reflector(&mut a.column_mut(k)[k..]);
        for c in k + 1..n {
            let (v, x) = a.pair(k, c);
            reflect(&v[k..], t, &mut x[k..]);
        }
    }
    let mut out = Columns::zeros(height, n);
    for c in 0..n {
        let filled = height.min(c + 1);
        out.column_mut(c)[..filled].copy_from_slice(&a.column(c)[..filled]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(rows: usize, columns: usize) -> Columns {
        let mut a = Columns::zeros(rows, columns);
        for (i, v) in a.data.iter_mut().enumerate() {
            *v = ((i * i + 3 * i) as f64 * 0.7).sin();
        }
        a
    }

    #[test]
    fn solution_leaves_an_orthogonal_residual() {
        let a = sample(20, 5);
        let y: Vec<f64> = (0..20).map(|i| (f64::from(i) * 1.3).cos()).collect();
        let sizes: Vec<f64> = (0..5).map(|j| norm(a.column(j))).collect();
        let qr = PivotedQr::new(a.clone(), &sizes, 20);
        assert_eq!(qr.rank(), 5);
        let mut rotated = y.clone();
        qr.rotate(&mut rotated);
        let x = qr.solve(&rotated);
        let mut residual = y;
        (0..5).for_each(|j| add_scaled(&mut residual, -x[j], a.column(j)));
        assert!((0..5).all(|j| dot(a.column(j), &residual).abs() < 1e-13));
        assert!((norm(&residual) - norm(&rotated[5..])).abs() < 1e-13);
    }

    #[test]
    fn a_repeated_column_is_found_and_left_out() {
        let mut a = sample(20, 4);
        let copy: Vec<f64> = a.column(1).iter().map(|v| -2.0 * v).collect();
        a.column_mut(3).copy_from_slice(&copy);
        let sizes: Vec<f64> = (0..4).map(|j| norm(a.column(j))).collect();
        let qr = PivotedQr::new(a, &sizes, 20);
        assert_eq!((qr.rank(), qr.dependent().len()), (3, 1));
        assert!([1, 3].contains(&qr.dependent()[0]));
    }

    #[test]
    fn a_triangle_keeps_inner_products() {
        let a = sample(30, 4);
        let r = triangle(a.clone());
        for i in 0..4 {
            for j in 0..4 {
                assert!((dot(a.column(i), a.column(j)) - dot(r.column(i), r.column(j))).abs() < 1e-12);
            }
        }
    }
}
