//! How much an order gains on parts of the motion that it was not fitted to.

use dynid_linalg::Mat;

use super::rows::Row;

/// Columns of an order, of what a residual may hold of offset, Coulomb and viscous friction beside it, and the residual.
const COLUMNS: usize = 2 + BESIDE;
/// The latter two.
pub(super) const BESIDE: usize = 4;
/// Keeps normal equations solvable where the motion does not tell columns apart, in parts of their diagonal.
const RIDGE: f64 = 1e-9;

/// Share by which squares fall on held-out parts, and its standard error over parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    pub(super) share: f64,
    pub(super) error: f64,
}

/// An order on held-out parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Score {
    /// Of the mean square, all parts alike (mean of logarithms): an order that is there shows in most parts.
    pub(super) of_parts: Gain,
    /// Of the sum of squares of all parts: a few slow parts, where the kernel leaves more of a ripple, may tell all.
    pub(super) of_sum: Gain,
    /// `A`, `B` of all parts.
    pub(super) coefficients: [f64; 2],
}

/// Sums of products of the columns of rows, the residual last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sums<const N: usize>([[f64; N]; N]);

impl<const N: usize> Sums<N> {
    pub(super) const ZERO: Self = Sums([[0.0; N]; N]);

    pub(super) fn add(&mut self, row: &[f64; N]) {
        for (to, a) in self.0.iter_mut().zip(row) {
            to.iter_mut().zip(row).for_each(|(s, b)| *s += a * b);
        }
    }

    fn less(&self, other: &Self) -> Self {
        Sums(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] - other.0[i][j])))
    }

    fn plus(&self, other: &Self) -> Self {
        Sums(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] + other.0[i][j])))
    }

    /// Least squares with the columns from `first` on; zeros for those before, -1 for the residual.
    fn solve(&self, first: usize) -> Option<[f64; N]> {
        let scale: [f64; N] = std::array::from_fn(|k| self.0[k][k].sqrt().max(f64::MIN_POSITIVE));
        let ridge = |i: usize, j: usize| if i == j { RIDGE } else { 0.0 };
        let entry = |i: usize, j: usize| {
            let (i, j) = (first + i, first + j);
            self.0[i][j] / (scale[i] * scale[j]) + ridge(i, j)
        };
        let (last, count) = (N - 1, N - 1 - first);
        let right: Vec<f64> = (first..last).map(|k| self.0[k][last] / scale[k]).collect();
        let x = Mat::from_fn(count, count, entry).cholesky()?.solve_vector(&right);
        Some(std::array::from_fn(|k| match k {
            k if k < first => 0.0,
            k if k == last => -1.0,
            k => x[k - first] / scale[k],
        }))
    }

    fn rss(&self, x: &[f64; N]) -> f64 {
        let row = |(s, xi): (&[f64; N], &f64)| xi * s.iter().zip(x).map(|(s, xj)| s * xj).sum::<f64>();
        self.0.iter().zip(x).map(row).sum()
    }
}

/// Squares of every part with the columns from `first` on and with all columns, each fitted to the other parts; parts without rows are left out, and
/// those that have nothing to gain.
fn held_out<const N: usize>(sums: &[Sums<N>], first: usize) -> Vec<(f64, f64)> {
    let all = sums.iter().fold(Sums::ZERO, |all, part| all.plus(part));
    let squares = |part: &Sums<N>| {
        let others = all.less(part);
        let (without, with) = (part.rss(&others.solve(first)?), part.rss(&others.solve(0)?));
        (without > 0.0 && with > 0.0).then_some((without, with))
    };
    // The column of the offset tells rows.
    sums.iter().filter(|part| part.0[N - BESIDE][N - BESIDE] > 0.0).filter_map(squares).collect()
}

/// What the first columns, those before [`BESIDE`], gain on held-out parts, all parts alike; `None` where fewer than two can be judged.
pub(super) fn gain<const N: usize>(sums: &[Sums<N>]) -> Option<Gain> {
    let pairs = held_out(sums, N - BESIDE);
    (pairs.len() >= 2).then(|| of_parts(&pairs))
}

/// Columns beside those that are looked for, and the residual, weighted.
pub(super) fn beside(row: &Row) -> [f64; BESIDE] {
    [1.0, row.velocity.signum(), row.velocity, row.residual].map(|x| row.weight * x)
}

/// Weighted columns of a row, the residual last.
fn columns(row: &Row, n: f64, is_friction: bool, kernel_s: f64) -> [f64; COLUMNS] {
    let (sine, cosine) = (n * row.position).sin_cos();
    let factor = row.weight * row.passes(n, kernel_s) * if is_friction { row.velocity.signum() } else { 1.0 };
    let [offset, sign, velocity, residual] = beside(row);
    [factor * cosine, factor * sine, offset, sign, velocity, residual]
}

fn summed(rows: &[Row], n: f64, is_friction: bool, kernel_s: f64) -> Sums<COLUMNS> {
    let mut all = Sums::ZERO;
    rows.iter().for_each(|row| all.add(&columns(row, n, is_friction, kernel_s)));
    all
}

/// Fits an order without each part and judges it there; `None` where no part can be judged.
pub(super) fn score(rows: &[Row], parts: usize, n: f64, is_friction: bool, kernel_s: f64) -> Option<Score> {
    let mut sums = vec![Sums::ZERO; parts];
    for row in rows {
        sums[row.part].add(&columns(row, n, is_friction, kernel_s));
    }
    let pairs = held_out(&sums, 2);
    if pairs.len() < 2 {
        return None;
    }
    let [a, b, ..] = sums.iter().fold(Sums::ZERO, |all, part| all.plus(part)).solve(0)?;
    Some(Score { of_parts: of_parts(&pairs), of_sum: of_sum(&pairs), coefficients: [a, b] })
}

fn of_parts(pairs: &[(f64, f64)]) -> Gain {
    let gains: Vec<f64> = pairs.iter().map(|(without, with)| (without / with).ln()).collect();
    let count = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let square: f64 = gains.iter().map(|g| (g - mean).powi(2)).sum();
    let left = (-mean).exp();
    Gain { share: 1.0 - left, error: left * (square / (count - 1.0) / count).sqrt() }
}

fn of_sum(pairs: &[(f64, f64)]) -> Gain {
    let count = pairs.len() as f64;
    let total: f64 = pairs.iter().map(|(without, _)| without).sum();
    let share = 1.0 - pairs.iter().map(|(_, with)| with).sum::<f64>() / total;
    // The error of a ratio of sums.
    let square: f64 = pairs.iter().map(|(without, with)| (without - with - share * without).powi(2)).sum();
    Gain { share, error: (count / (count - 1.0) * square).sqrt() / total }
}

/// Weighted residual sum of squares of the fit of an order to all rows.
pub(super) fn rss(rows: &[Row], n: f64, is_friction: bool, kernel_s: f64) -> f64 {
    let all = summed(rows, n, is_friction, kernel_s);
    all.solve(0).map_or(f64::INFINITY, |x| all.rss(&x))
}

/// Takes off residuals what offset, Coulomb and viscous friction may be in them.
pub(super) fn without_friction(rows: &mut [Row]) {
    let Some([.., offset, sign, velocity, _]) = summed(rows, 0.0, false, 0.0).solve(2) else { return };
    for row in rows {
        row.residual -= offset + sign * row.velocity.signum() + velocity * row.velocity;
    }
}

/// Takes an order off residuals.
pub(super) fn without_order(rows: &mut [Row], n: f64, is_friction: bool, [a, b]: [f64; 2], kernel_s: f64) {
    for row in rows {
        let (sine, cosine) = (n * row.position).sin_cos();
        let factor = row.passes(n, kernel_s) * if is_friction { row.velocity.signum() } else { 1.0 };
        row.residual -= factor * (a * cosine + b * sine);
    }
}
