//! Triangular factors of small square matrices, most of whose entries are zero.

/// `P A = L U` by elimination with exchanges of rows, reusable. Entries that are zero cost little: coordinates of one leg
/// appear in few rows.
#[derive(Clone, Debug, Default)]
pub(super) struct Lu {
    size: usize,
    /// Row after row: `L` below the diagonal, `U` on and above it.
    data: Vec<f64>,
    /// Row of `A` at every row of the factors.
    order: Vec<usize>,
    exchanges: usize,
    /// Frobenius norm of the matrix.
    norm: f64,
}

impl Lu {
    pub(super) fn factor(&mut self, size: usize, matrix: impl Fn(usize, usize) -> f64) {
        (self.size, self.exchanges) = (size, 0);
        self.data.clear();
        for i in 0..size {
            self.data.extend((0..size).map(|j| matrix(i, j)));
        }
        self.norm = self.data.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.order.clear();
        self.order.extend(0..size);
        for j in 0..size {
            let mut pivot = (j, self.data[j * size + j].abs());
            for i in j + 1..size {
                let entry = self.data[i * size + j].abs();
                // Equal but for rounding: the order of the rows stays.
                if entry > pivot.1 * (1.0 + 1e-10) {
                    pivot = (i, entry);
                }
            }
            let (above, below) = self.data.split_at_mut((j + 1) * size);
            let row = &mut above[j * size..];
            if pivot.0 != j {
                row.swap_with_slice(&mut below[(pivot.0 - j - 1) * size..][..size]);
                self.order.swap(j, pivot.0);
                self.exchanges += 1;
            }
            for other in below.chunks_exact_mut(size) {
                if other[j] != 0.0 {
                    other[j] /= row[j];
                    let factor = other[j];
                    for (x, r) in other[j + 1..].iter_mut().zip(&row[j + 1..]) {
                        *x -= factor * r;
                    }
                }
            }
        }
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.size..(i + 1) * self.size]
    }

    fn pivot(&self, i: usize) -> f64 {
        self.data[i * self.size + i]
    }

    pub(super) fn sign(&self) -> f64 {
        let turns = self.exchanges + (0..self.size).filter(|i| self.pivot(*i) < 0.0).count();
        if turns.is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    /// About the smallest over the largest singular value.
    pub(super) fn flatness(&self) -> f64 {
        let n = self.size;
        if (0..n).any(|i| self.pivot(i) == 0.0 || !self.pivot(i).is_finite()) {
            return 0.0;
        }
        // A right-hand side that is made to grow shows the size of the inverse.
        let (mut grown, mut by, mut back) = (vec![0.0_f64; n], vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            let sum = grown[i];
            let value = (if sum > 0.0 { -1.0 } else { 1.0 } - sum) / self.pivot(i);
            grown[i] = value;
            for (to, u) in grown[i + 1..].iter_mut().zip(&self.row(i)[i + 1..]) {
                *to += u * value;
            }
        }
        self.unwind(&mut grown, &mut by);
        self.solve(&by, &mut back);
        let length = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        length(&by) / (length(&back) * self.norm)
    }

    /// `A x = b`.
    pub(super) fn solve(&self, b: &[f64], x: &mut [f64]) {
        let n = self.size;
        for i in 0..n {
            let sum: f64 = self.row(i)[..i].iter().zip(&*x).map(|(l, x)| l * x).sum();
            x[i] = b[self.order[i]] - sum;
        }
        for i in (0..n).rev() {
            let sum: f64 = self.row(i)[i + 1..].iter().zip(&x[i + 1..]).map(|(u, x)| u * x).sum();
            x[i] = (x[i] - sum) / self.pivot(i);
        }
    }

    /// `A X = B` for `count` right-hand sides, row after row.
    pub(super) fn solve_many(&self, count: usize, b: &[f64], x: &mut [f64]) {
        let n = self.size;
        let take = |to: &mut [f64], factor: f64, from: &[f64]| {
            if factor != 0.0 {
                to.iter_mut().zip(from).for_each(|(t, f)| *t -= factor * f);
            }
        };
        for i in 0..n {
            let (done, rest) = x.split_at_mut(i * count);
            let own = &mut rest[..count];
            own.copy_from_slice(&b[self.order[i] * count..][..count]);
            for (l, from) in self.row(i).iter().zip(done.chunks_exact(count)) {
                take(own, *l, from);
            }
        }
        for i in (0..n).rev() {
            let (rest, done) = x.split_at_mut((i + 1) * count);
            let own = &mut rest[i * count..];
            for (u, from) in self.row(i)[i + 1..].iter().zip(done.chunks_exact(count)) {
                take(own, *u, from);
            }
            let inverse = 1.0 / self.pivot(i);
            own.iter_mut().for_each(|x| *x *= inverse);
        }
    }

    /// `Aᵀ y = t`.
    pub(super) fn solve_transposed(&self, t: &[f64], y: &mut [f64]) {
        let n = self.size;
        let mut z = t.to_vec();
        for i in 0..n {
            z[i] /= self.pivot(i);
            let value = z[i];
            for (to, u) in z[i + 1..].iter_mut().zip(&self.row(i)[i + 1..]) {
                *to -= u * value;
            }
        }
        self.unwind(&mut z, y);
    }

    /// `Pᵀ L⁻ᵀ z`.
    fn unwind(&self, z: &mut [f64], y: &mut [f64]) {
        for i in (0..self.size).rev() {
            let value = z[i];
            for (to, l) in z[..i].iter_mut().zip(self.row(i)) {
                *to -= l * value;
            }
            y[self.order[i]] = value;
        }
    }
}
