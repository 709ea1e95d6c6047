//! Square-root information `(R, z, ρ², N)`.

use alloc::vec;
use alloc::vec::Vec;

use dynid_words::Transfer;

/// Entries of a row that are reflected at a time; they stay in registers and the first cache.
const STRIP: usize = 32;
/// Squared norms below this count as zero: their reciprocal would overflow.
const LEAST_SQUARE: f64 = 1e-280;

/// Triangular factor `(R, z, ρ², N)` of weighted rows `[Φ y]`, with storage fixed at construction.
///
/// For every `x`: `‖y - Φ x‖² = ‖z - R x‖² + ρ²`. `R` is `p × p`, upper triangular, its diagonal never
/// negative; `RᵀR` is the information and `(RᵀR)⁻¹` the covariance when rows are divided by their standard
/// deviations. `N` is the number of rows, discounted as the rows are.
///
/// Nothing here allocates but the constructors and `clone`. Slices of wrong length are slips of the caller
/// and panic.
///
/// Sources: Golub & Van Loan, *Matrix Computations*, sections 5.1, 5.2 and 6.5; Bierman 1977, chapter 6
/// (drift).
#[derive(Debug, Clone, PartialEq)]
pub struct SquareRoot {
    columns: usize,
    /// Rows of `[R z]` from the diagonal on, one after the other.
    triangle: Vec<f64>,
    rss: f64,
    weight: f64,
}

impl SquareRoot {
    /// No information on `columns` parameters.
    pub fn new(columns: usize) -> Self {
        Self { columns, triangle: vec![0.0; start(columns, columns)], rss: 0.0, weight: 0.0 }
    }

    /// Prior `x ~ N(start, diag(std²))`: `R = diag(1/std)`, `z = R start`. An infinite deviation is no prior.
    pub fn from_prior(start: &[f64], std: &[f64]) -> Self {
        let mut root = Self::new(start.len());
        root.restart(start, std);
        root
    }

    /// Forgets everything and starts again from `x ~ N(start, diag(std²))`.
    pub fn restart(&mut self, start: &[f64], std: &[f64]) {
        assert!(start.len() == self.columns && std.len() == self.columns, "one prior per parameter");
        self.triangle.fill(0.0);
        self.rss = 0.0;
        self.weight = 0.0;
        for (j, (x, s)) in start.iter().zip(std).enumerate() {
            let row = self.row_mut(j);
            let last = row.len() - 1;
            row[0] = 1.0 / s;
            row[last] = x / s;
        }
    }

    /// Number `p` of parameters.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Residual sum of squares `ρ²` of the rows at their own solution, discounted as they are.
    pub fn rss(&self) -> f64 {
        self.rss
    }

    /// Number `N` of rows, discounted as they are.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// `R[row, column]`, zero below the diagonal.
    pub fn r(&self, row: usize, column: usize) -> f64 {
        assert!(row < self.columns && column < self.columns, "R is p × p");
        if column < row { 0.0 } else { self.row(row)[column - row] }
    }

    /// `z[row]`.
    pub fn z(&self, row: usize) -> f64 {
        self.row(row)[self.columns - row]
    }

    /// Row `row` of `[R z]` from the diagonal on.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.triangle[start(self.columns, row)..start(self.columns, row + 1)]
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.triangle[start(self.columns, row)..start(self.columns, row + 1)]
    }

    /// Takes over everything of `other`, which has as many columns.
    pub fn copy_from(&mut self, other: &SquareRoot) {
        self.triangle.copy_from_slice(&other.triangle);
        self.rss = other.rss;
        self.weight = other.weight;
    }

    /// Sets row `row` of `[R z]`, from the diagonal on; the diagonal must not be negative.
    pub fn set_row(&mut self, row: usize, entries: &[f64]) {
        assert!(entries[0] >= 0.0, "the diagonal of R is not negative");
        self.row_mut(row).copy_from_slice(entries);
    }

    /// Sets `ρ²` and `N`.
    pub fn set_remainder(&mut self, rss: f64, weight: f64) {
        self.rss = rss;
        self.weight = weight;
    }

    /// Adds weighted rows `[φ y]`, `p + 1` entries each, one after the other. Their storage is used up.
    ///
    /// Householder reflections of all rows together, `2 m p²` operations; a column that is zero in all rows
    /// costs nothing until rows with it have come.
    pub fn push(&mut self, rows: &mut [f64]) {
        let width = self.columns + 1;
        assert!(rows.len().is_multiple_of(width), "rows are [φ y]");
        let count = rows.len() / width;
        if count == 1 {
            self.push_row(rows);
        } else {
            for j in 0..self.columns {
                self.eliminate(j, rows);
            }
        }
        self.rss += rows.chunks_exact(width).map(|row| row[width - 1] * row[width - 1]).sum::<f64>();
        self.weight += count as f64;
    }

    /// Adds the row `[φ y]` whose entries before column `first` are zero, without counting it as a sample.
    pub(crate) fn push_pseudo(&mut self, first: usize, row: &mut [f64]) {
        for j in first..self.columns {
            rotate_in(self.row_mut(j), &mut row[j..]);
        }
    }

    fn push_row(&mut self, row: &mut [f64]) {
        for j in 0..self.columns {
            rotate_in(self.row_mut(j), &mut row[j..]);
        }
    }

    /// Reflects column `j` of `rows` into row `j` of the triangle.
    fn eliminate(&mut self, j: usize, rows: &mut [f64]) {
        let width = self.columns + 1;
        let square: f64 = rows.chunks_exact(width).map(|row| row[j] * row[j]).sum();
        if square < LEAST_SQUARE {
            return;
        }
        let Some((pivot, tail)) = self.row_mut(j).split_first_mut() else { return };
        let norm = libm::sqrt(*pivot * *pivot + square);
        // First entry of the reflection's vector, without the cancellation of pivot - norm (Parlett).
        let first = -square / (*pivot + norm);
        let scale = 2.0 / (first * first + square);
        *pivot = norm;
        let mut from = j + 1;
        for strip in tail.chunks_mut(STRIP) {
            let to = from + strip.len();
            reflect(strip, rows, width, j, from..to, first, scale);
            from = to;
        }
    }

    /// Adds all that `other` knows. `scratch` needs `p (p + 1)` entries.
    pub fn merge(&mut self, other: &SquareRoot, scratch: &mut [f64]) {
        self.rss += self.absorb(other, scratch) + other.rss;
        self.weight += other.weight;
    }

    /// Adds `[R z]` of `other` and returns the residual sum of squares that the two fits together have beyond
    /// their own.
    pub(crate) fn absorb(&mut self, other: &SquareRoot, scratch: &mut [f64]) -> f64 {
        let (p, width) = (self.columns, self.columns + 1);
        assert!(
            other.columns == p && scratch.len() == p * width,
            "triangles of equal size, p (p + 1) of scratch"
        );
        for (i, row) in scratch.chunks_exact_mut(width).enumerate() {
            row[..i].fill(0.0);
            row[i..].copy_from_slice(other.row(i));
        }
        for j in 0..p {
            self.eliminate(j, &mut scratch[..(j + 1) * width]);
        }
        scratch.chunks_exact(width).map(|row| row[p] * row[p]).sum()
    }

    /// Multiplies all information by `lambda`: `R, z × √λ`, `ρ², N × λ`.
    pub fn discount(&mut self, lambda: f64) {
        let root = libm::sqrt(lambda);
        self.triangle.iter_mut().for_each(|v| *v *= root);
        self.discount_remainder(lambda);
    }

    pub(crate) fn discount_remainder(&mut self, lambda: f64) {
        self.rss *= lambda;
        self.weight *= lambda;
    }

    /// Whether all parameters are determined: no zero on the diagonal of `R`.
    pub fn is_regular(&self) -> bool {
        (0..self.columns).all(|j| self.row(j)[0] > 0.0)
    }

    /// `x = R⁻¹ z`; false, with `x` as it was, if `R` is singular.
    pub fn solve(&self, x: &mut [f64]) -> bool {
        if !self.is_regular() {
            return false;
        }
        for j in (0..self.columns).rev() {
            let row = self.row(j);
            let tail = dot(&row[1..self.columns - j], &x[j + 1..]);
            x[j] = (row[self.columns - j] - tail) / row[0];
        }
        true
    }

    /// `b ← R⁻ᵀ b`. The diagonal of `R` must not hold zeros.
    pub fn solve_transposed(&self, b: &mut [f64]) {
        for j in 0..self.columns {
            let Some((own, later)) = b[j..].split_first_mut() else { return };
            let row = self.row(j);
            *own /= row[0];
            subtract_scaled(later, *own, &row[1..]);
        }
    }

    /// `b ← R⁻¹ b`. The diagonal of `R` must not hold zeros.
    pub fn solve_upper(&self, b: &mut [f64]) {
        for j in (0..self.columns).rev() {
            let row = self.row(j);
            b[j] = (b[j] - dot(&row[1..self.columns - j], &b[j + 1..])) / row[0];
        }
    }

    /// `out = R v`.
    pub fn times(&self, v: &[f64], out: &mut [f64]) {
        for (j, value) in out.iter_mut().enumerate().take(self.columns) {
            *value = dot(&self.row(j)[..self.columns - j], &v[j..]);
        }
    }

    /// `out = Rᵀ v`.
    pub fn times_transposed(&self, v: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (j, value) in v.iter().enumerate().take(self.columns) {
            subtract_scaled(&mut out[j..], -*value, self.row(j));
        }
    }

    /// Variances, the diagonal of `(RᵀR)⁻¹`; false, with `variances` as they were, if `R` is singular.
    /// `scratch` needs `p` entries.
    pub fn variances(&self, variances: &mut [f64], scratch: &mut [f64]) -> bool {
        if !self.is_regular() {
            return false;
        }
        for (j, variance) in variances.iter_mut().enumerate() {
            *variance = self.variance(j, scratch);
        }
        true
    }

    /// `((RᵀR)⁻¹)_jj` of a regular `R`.
    pub fn variance(&self, j: usize, scratch: &mut [f64]) -> f64 {
        self.unit_solution(j, scratch);
        scratch[j..].iter().map(|g| g * g).sum()
    }

    /// `scratch = R⁻ᵀ e_j`.
    pub(crate) fn unit_solution(&self, j: usize, scratch: &mut [f64]) {
        scratch.fill(0.0);
        scratch[j] = 1.0;
        for i in j..self.columns {
            let Some((own, later)) = scratch[i..].split_first_mut() else { return };
            let row = self.row(i);
            *own /= row[0];
            subtract_scaled(later, *own, &row[1..]);
        }
    }

    /// Covariance `(RᵀR)⁻¹`, row by row; false, with `covariance` as it was, if `R` is singular.
    pub fn covariance(&self, covariance: &mut [f64]) -> bool {
        let p = self.columns;
        assert_eq!(covariance.len(), p * p, "a covariance is p × p");
        if !self.is_regular() {
            return false;
        }
        for (j, row) in covariance.chunks_exact_mut(p).enumerate() {
            self.unit_solution(j, row);
            self.solve_upper(row);
        }
        true
    }

    /// Removes information along given directions: `[R z] ← Q [R z]` with `QᵀQ = 1 - a aᵀ`, for the vector
    /// `a` and `rest = √(1 - ‖a‖²) > 0`.
    ///
    /// `R` remains triangular and the solution stays where it is. `a` and `discarded` (`p + 1` entries) are
    /// used up; `others` are vectors of `p` entries in the coordinates of `z`, which are carried along.
    ///
    /// These are the rotations of LINPACK's downdating, but with `a` given instead of solved for, so that
    /// nothing is lost however little remains (Golub & Van Loan, section 6.5.4).
    pub(crate) fn deflate(&mut self, a: &[f64], rest: f64, discarded: &mut [f64], others: &mut [f64]) {
        let p = self.columns;
        let mut length = rest;
        discarded.fill(0.0);
        for i in (0..p).rev() {
            if a[i] == 0.0 {
                continue;
            }
            let total = libm::sqrt(length * length + a[i] * a[i]);
            let (c, s) = (length / total, a[i] / total);
            length = total;
            rotate(self.row_mut(i), &mut discarded[i..], c, s);
        }
        for other in others.chunks_exact_mut(p) {
            let (mut length, mut left) = (rest, 0.0);
            for (value, a) in other.iter_mut().zip(a).rev() {
                let total = libm::sqrt(length * length + a * a);
                let (c, s) = (length / total, a / total);
                length = total;
                (*value, left) = (c * *value - s * left, s * *value + c * left);
            }
        }
    }

    /// Adds `variance` to parameter `j` alone: `P ← P + variance · e_j e_jᵀ`. The estimate stays. `scratch`
    /// needs `2 p + 1` entries.
    ///
    /// One column of Bierman's time update: QR of `[[1/√variance, 0, 0], [-R e_j, R, z]]`.
    pub fn open(&mut self, j: usize, variance: f64, scratch: &mut [f64]) {
        let p = self.columns;
        if variance <= 0.0 {
            return;
        }
        let (a, discarded) = scratch.split_at_mut(p);
        a.fill(0.0);
        for (i, value) in a.iter_mut().enumerate().take(j + 1) {
            *value = self.r(i, j);
        }
        let size = libm::sqrt(1.0 + variance * a.iter().map(|v| v * v).sum::<f64>());
        let factor = libm::sqrt(variance) / size;
        a.iter_mut().for_each(|v| *v *= factor);
        self.deflate(a, 1.0 / size, &mut discarded[..p + 1], &mut []);
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.finites(&mut self.triangle);
        transfer.finite(&mut self.rss);
        transfer.finite(&mut self.weight);
        if (0..self.columns).any(|j| self.row(j)[0] < 0.0) {
            transfer.fail();
        }
    }
}

/// Place of row `row` in the triangle.
fn start(columns: usize, row: usize) -> usize {
    row * (2 * columns + 3 - row) / 2
}

/// Rotates the first entry of `incoming` into the first of `row`, which stays positive.
fn rotate_in(row: &mut [f64], incoming: &mut [f64]) {
    let (pivot, entry) = (row[0], incoming[0]);
    if entry == 0.0 {
        return;
    }
    let norm = libm::sqrt(pivot * pivot + entry * entry);
    if norm == 0.0 {
        return;
    }
    let (c, s) = (pivot / norm, entry / norm);
    row[0] = norm;
    for (r, f) in row[1..].iter_mut().zip(&mut incoming[1..]) {
        (*r, *f) = (c * *r + s * *f, c * *f - s * *r);
    }
}

/// `(row, left) ← (c row - s left, s row + c left)`.
fn rotate(row: &mut [f64], left: &mut [f64], c: f64, s: f64) {
    for (r, l) in row.iter_mut().zip(left) {
        (*r, *l) = (c * *r - s * *l, s * *r + c * *l);
    }
}

/// Applies the reflection `1 - scale v vᵀ`, `v = (first, column j of rows)`, to columns `range` of the
/// triangle's row `strip` and of `rows`.
fn reflect(
    strip: &mut [f64],
    rows: &mut [f64],
    width: usize,
    j: usize,
    range: core::ops::Range<usize>,
    first: f64,
    scale: f64,
) {
    let mut along = [0.0; STRIP];
    let along = &mut along[..strip.len()];
    for (w, r) in along.iter_mut().zip(strip.iter()) {
        *w = first * *r;
    }
    for row in rows.chunks_exact(width) {
        let v = row[j];
        for (w, x) in along.iter_mut().zip(&row[range.clone()]) {
            *w += v * *x;
        }
    }
    for (w, r) in along.iter_mut().zip(strip) {
        *w *= scale;
        *r -= first * *w;
    }
    for row in rows.chunks_exact_mut(width) {
        let v = row[j];
        for (x, w) in row[range.clone()].iter_mut().zip(along.iter()) {
            *x -= v * *w;
        }
    }
}

/// `target -= factor · v` over the shorter of the two.
fn subtract_scaled(target: &mut [f64], factor: f64, v: &[f64]) {
    for (t, v) in target.iter_mut().zip(v) {
        *t -= factor * *v;
    }
}

/// Inner product over the shorter of the two, in four partial sums.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sums = [0.0; 4];
    let (mut fours, mut of_b) = (a.chunks_exact(4), b.chunks_exact(4));
    for (x, y) in fours.by_ref().zip(of_b.by_ref()) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = fours.remainder().iter().zip(of_b.remainder()).map(|(x, y)| x * y).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}
