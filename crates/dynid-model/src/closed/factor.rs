//! Factors of small matrices.

use super::lu::Lu;

/// `A P = Q R` by Householder reflections with column exchanges, or for a square matrix `P A = L U`; reusable.
#[derive(Clone, Debug, Default)]
pub(crate) struct Factor {
    rows: usize,
    columns: usize,
    /// Column after column: reflectors on and below the diagonal, `R` above it.
    data: Vec<f64>,
    diagonal: Vec<f64>,
    /// Twice the inverse of the squared length of each reflector; 0 where none is needed.
    weights: Vec<f64>,
    pivots: Vec<usize>,
    exchanges: usize,
    square: bool,
    lu: Lu,
}

impl Factor {
    /// Factors a matrix with at least as many rows as columns.
    pub(crate) fn factor(&mut self, rows: usize, columns: usize, matrix: impl Fn(usize, usize) -> f64) {
        if rows == columns {
            (self.rows, self.columns, self.square) = (rows, columns, true);
            self.lu.factor(rows, matrix);
        } else {
            self.factor_to(columns, (rows, columns), matrix);
        }
    }

    /// Factors a matrix by reflections, also a square one: columns are taken by what is left of them.
    pub(super) fn reflect_all(&mut self, rows: usize, columns: usize, matrix: impl Fn(usize, usize) -> f64) {
        self.factor_to(columns, (rows, columns), matrix);
    }

    /// Factors a matrix of given rank and any shape by reflections: after `rank` columns the others are taken to depend on
    /// them.
    pub(super) fn factor_to(
        &mut self,
        rank: usize,
        (rows, columns): (usize, usize),
        matrix: impl Fn(usize, usize) -> f64,
    ) {
        debug_assert!(rank <= rows.min(columns), "rank {rank} of {rows} rows and {columns} columns");
        (self.rows, self.columns, self.exchanges, self.square) = (rows, columns, 0, false);
        self.data.clear();
        for j in 0..columns {
            self.data.extend((0..rows).map(|i| matrix(i, j)));
        }
        self.pivots.clear();
        self.pivots.extend(0..columns);
        self.diagonal.clear();
        self.weights.clear();
        for j in 0..rank {
            self.pivot(j);
            self.reflect(j);
        }
    }

    fn pivot(&mut self, j: usize) {
        let rows = self.rows;
        let left = |k: usize| self.data[k * rows + j..(k + 1) * rows].iter().map(|x| x * x).sum::<f64>();
        let mut best = (j, left(j));
        for k in j + 1..self.columns {
            let length = left(k);
            // Equal but for rounding: the order of the columns stays, so that signs of determinants are comparable.
            if length > best.1 * (1.0 + 1e-10) {
                best = (k, length);
            }
        }
        if best.0 != j {
            let (before, after) = self.data.split_at_mut(best.0 * rows);
            before[j * rows..(j + 1) * rows].swap_with_slice(&mut after[..rows]);
            self.pivots.swap(j, best.0);
            self.exchanges += 1;
        }
    }

    fn reflect(&mut self, j: usize) {
        let rows = self.rows;
        let (done, rest) = self.data.split_at_mut((j + 1) * rows);
        let column = &mut done[j * rows + j..];
        let norm = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        let target = if column[0] > 0.0 { -norm } else { norm };
        self.diagonal.push(target);
        column[0] -= target;
        let length = column.iter().map(|x| x * x).sum::<f64>();
        let weight = if length > 0.0 { 2.0 / length } else { 0.0 };
        self.weights.push(weight);
        for other in rest.chunks_exact_mut(rows) {
            mirror(column, weight, &mut other[j..]);
        }
    }

    /// Smallest over largest singular value, but for a small factor; 1 for a matrix without columns.
    pub(super) fn flatness(&self) -> f64 {
        if self.square && self.columns > 0 {
            return self.lu.flatness();
        }
        // By the diagonal of R.
        let size = |x: &f64| x.abs();
        let largest = self.diagonal.iter().map(size).fold(0.0, f64::max);
        let smallest = self.diagonal.iter().map(size).fold(f64::INFINITY, f64::min);
        if self.columns == 0 {
            1.0
        } else if largest > 0.0 {
            smallest / largest
        } else {
            0.0
        }
    }

    /// Columns in the order in which they were taken.
    pub(super) fn pivots(&self) -> &[usize] {
        &self.pivots
    }

    /// Sign of the determinant of a square matrix.
    pub(super) fn sign(&self) -> f64 {
        if self.square {
            return self.lu.sign();
        }
        let reflections = self.weights.iter().filter(|w| **w > 0.0).count();
        let turns = self.exchanges + reflections + self.diagonal.iter().filter(|d| **d < 0.0).count();
        if turns.is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    /// `x ← Qᵀ x`, one entry per row.
    pub(super) fn turn(&self, x: &mut [f64]) {
        for (j, weight) in self.weights.iter().enumerate() {
            mirror(&self.data[j * self.rows + j..(j + 1) * self.rows], *weight, &mut x[j..]);
        }
    }

    /// `x ← Q x`.
    pub(super) fn turn_back(&self, x: &mut [f64]) {
        for (j, weight) in self.weights.iter().enumerate().rev() {
            mirror(&self.data[j * self.rows + j..(j + 1) * self.rows], *weight, &mut x[j..]);
        }
    }

    /// Entry of `R`, columns in the order of the pivots.
    pub(super) fn upper(&self, i: usize, j: usize) -> f64 {
        match i.cmp(&j) {
            std::cmp::Ordering::Less => self.data[j * self.rows + i],
            std::cmp::Ordering::Equal => self.diagonal[j],
            std::cmp::Ordering::Greater => 0.0,
        }
    }

    /// The least-squares solution of `A x = b`: `b` has one entry per row and is overwritten, `x` one per column.
    /// Columns beyond the rank are not written.
    pub(super) fn solve(&self, b: &mut [f64], x: &mut [f64]) {
        if self.square {
            return self.lu.solve(b, x);
        }
        let rows = self.rows;
        self.turn(b);
        for j in (0..self.diagonal.len()).rev() {
            let value = b[j] / self.diagonal[j];
            x[self.pivots[j]] = value;
            for (to, r) in b[..j].iter_mut().zip(&self.data[j * rows..]) {
                *to -= r * value;
            }
        }
    }

    /// Solves for `count` right-hand sides, which lie row after row, as do the solutions.
    pub(crate) fn solve_many(&self, count: usize, b: &[f64], x: &mut [f64]) {
        if self.square {
            return self.lu.solve_many(count, b, x);
        }
        let (mut right, mut solution) = (vec![0.0; self.rows], vec![0.0; self.columns]);
        for k in 0..count {
            right.iter_mut().zip(b.iter().skip(k).step_by(count)).for_each(|(r, b)| *r = *b);
            self.solve(&mut right, &mut solution);
            x.iter_mut().skip(k).step_by(count).zip(&solution).for_each(|(x, s)| *x = *s);
        }
    }

    /// The shortest solution of `Aᵀ y = t`: `t` has one entry per column, `y` one per row. Columns beyond the rank are not
    /// looked at.
    pub(super) fn solve_transposed(&self, t: &[f64], y: &mut [f64]) {
        if self.square {
            return self.lu.solve_transposed(t, y);
        }
        let (rows, rank) = (self.rows, self.diagonal.len());
        y[rank..].fill(0.0);
        for j in 0..rank {
            let above = &self.data[j * rows..j * rows + j];
            let sum: f64 = above.iter().zip(&y[..j]).map(|(r, y)| r * y).sum();
            y[j] = (t[self.pivots[j]] - sum) / self.diagonal[j];
        }
        self.turn_back(y);
    }

    /// For every row of `A`: length of its part in the null space of `Aᵀ`.
    pub(super) fn null_rows(&self) -> Vec<f64> {
        let (rows, columns) = (self.rows, self.columns);
        let mut squares = vec![0.0; rows];
        let mut unit = Vec::with_capacity(rows);
        for k in columns..rows {
            unit.clear();
            unit.resize(rows, 0.0);
            unit[k] = 1.0;
            self.turn_back(&mut unit);
            squares.iter_mut().zip(&unit).for_each(|(s, u)| *s += u * u);
        }
        squares.into_iter().map(f64::sqrt).collect()
    }
}

/// `x ← x - weight (vᵀ x) v`.
#[inline(always)]
fn mirror(v: &[f64], weight: f64, x: &mut [f64]) {
    let along = weight * v.iter().zip(&*x).map(|(v, x)| v * x).sum::<f64>();
    for (x, v) in x.iter_mut().zip(v) {
        *x -= along * v;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TALL: [[f64; 3]; 4] = [[1.0, 2.0, -1.0], [0.5, -3.0, 2.0], [4.0, 0.0, 1.0], [1.0, 1.0, 1.0]];

    #[test]
    fn solutions_are_those_of_least_squares_and_of_least_norm() {
        let mut factor = Factor::default();
        factor.factor(4, 3, |i, j| TALL[i][j]);
        let (expected, mut x) = ([0.3, -1.2, 2.0], [0.0; 3]);
        let mut b: Vec<f64> =
            TALL.iter().map(|r| r.iter().zip(&expected).map(|(a, x)| a * x).sum()).collect();
        factor.solve(&mut b, &mut x);
        assert!(x.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14), "{x:?}");
        let (t, mut y) = ([1.0, -2.0, 0.5], [0.0; 4]);
        factor.solve_transposed(&t, &mut y);
        for (j, t) in t.iter().enumerate() {
            let back: f64 = (0..4).map(|i| TALL[i][j] * y[i]).sum();
            assert!((back - t).abs() < 1e-14, "{back} {t}");
        }
        // Shortest: in the range of A, hence at right angles to the null space of Aᵀ.
        let null = factor.null_rows();
        assert!((null.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn square_matrices_are_solved_by_either_kind_of_factors() {
        let matrix =
            [[0.0, 2.0, -1.0, 0.0], [0.5, -3.0, 2.0, 0.1], [4.0, 0.0, 1.0, -2.0], [0.0, 0.0, 1.0, 3.0]];
        let (mut lu, mut qr) = (Factor::default(), Factor::default());
        lu.factor(4, 4, |i, j| matrix[i][j]);
        qr.reflect_all(4, 4, |i, j| matrix[i][j]);
        assert_eq!(lu.sign(), qr.sign());
        assert!((0.2..5.0).contains(&(lu.flatness() / qr.flatness())), "{} {}", lu.flatness(), qr.flatness());
        let right = [1.0, -2.0, 0.5, 3.0];
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13);
        let (mut x, mut y) = ([[0.0; 4]; 2], [[0.0; 4]; 2]);
        for (k, factor) in [&lu, &qr].into_iter().enumerate() {
            factor.solve(&mut right.clone(), &mut x[k]);
            factor.solve_transposed(&right, &mut y[k]);
        }
        assert!(close(&x[0], &x[1]) && close(&y[0], &y[1]), "{x:?} {y:?}");
        let both: Vec<f64> = right.iter().flat_map(|r| [*r, -3.0 * r]).collect();
        for factor in [&lu, &qr] {
            let mut solutions = [0.0; 8];
            factor.solve_many(2, &both, &mut solutions);
            let expected: Vec<f64> = x[0].iter().flat_map(|x| [*x, -3.0 * x]).collect();
            assert!(solutions.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-13), "{solutions:?}");
        }
    }

    #[test]
    fn signs_are_those_of_determinants() {
        for (matrix, sign) in [
            ([[0.0, 1.0], [1.0, 0.0]], -1.0),
            ([[2.0, 1.0], [1.0, 3.0]], 1.0),
            ([[-1.0, 0.0], [0.0, 2.0]], -1.0),
        ] {
            let mut factor = Factor::default();
            factor.factor(2, 2, |i, j| matrix[i][j]);
            assert_eq!(factor.sign(), sign, "{matrix:?}");
        }
    }

    #[test]
    fn missing_rank_is_seen() {
        let mut factor = Factor::default();
        factor.factor(3, 2, |i, j| (i + 1) as f64 * (j + 1) as f64);
        assert!(factor.flatness() < 1e-14);
        factor.factor(3, 3, |i, j| 0.1 * (i + 1) as f64 * (j + 1) as f64 + (i * j) as f64);
        assert!(factor.flatness() < 1e-14);
    }
}
