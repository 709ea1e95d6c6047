//! How much an order gains on parts of the motion that it was not fitted to.

use dynid_linalg::Mat;

use super::Row;

/// Columns beside the two of the order: what a residual may hold of offset, Coulomb and viscous friction.
const BESIDE: usize = 3;
const COLUMNS: usize = 2 + BESIDE;
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
#[derive(Debug, Clone, Copy, Default)]
struct Sums([[f64; COLUMNS + 1]; COLUMNS + 1]);

impl Sums {
    fn add(&mut self, row: &[f64; COLUMNS + 1]) {
        for (to, a) in self.0.iter_mut().zip(row) {
            to.iter_mut().zip(row).for_each(|(s, b)| *s += a * b);
        }
    }

    fn less(&self, other: &Sums) -> Sums {
        Sums(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] - other.0[i][j])))
    }

    fn plus(&self, other: &Sums) -> Sums {
        Sums(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] + other.0[i][j])))
    }

    /// Least squares with the columns from `first` on; zeros for those before.
    fn solve(&self, first: usize) -> Option<[f64; COLUMNS]> {
        let scale: [f64; COLUMNS] = std::array::from_fn(|k| self.0[k][k].sqrt().max(f64::MIN_POSITIVE));
        let ridge = |i: usize, j: usize| if i == j { RIDGE } else { 0.0 };
        let entry = |i: usize, j: usize| {
            let (i, j) = (first + i, first + j);
            self.0[i][j] / (scale[i] * scale[j]) + ridge(i, j)
        };
        let count = COLUMNS - first;
        let right: Vec<f64> = (first..COLUMNS).map(|k| self.0[k][COLUMNS] / scale[k]).collect();
        let x = Mat::from_fn(count, count, entry).cholesky()?.solve_vector(&right);
        Some(std::array::from_fn(|k| if k < first { 0.0 } else { x[k - first] / scale[k] }))
    }

    fn rss(&self, x: &[f64; COLUMNS]) -> f64 {
        let factor = |k: usize| if k < COLUMNS { -x[k] } else { 1.0 };
        (0..=COLUMNS).map(|i| (0..=COLUMNS).map(|j| factor(i) * factor(j) * self.0[i][j]).sum::<f64>()).sum()
    }
}

/// Weighted columns of a row, the residual last.
fn columns(row: &Row, n: f64, is_friction: bool, kernel_s: f64) -> [f64; COLUMNS + 1] {
    let sign = row.velocity.signum();
    let (sine, cosine) = (n * row.position).sin_cos();
    let of_order = row.passes(n, kernel_s) * if is_friction { sign } else { 1.0 };
    [of_order * cosine, of_order * sine, 1.0, sign, row.velocity, row.residual].map(|x| row.weight * x)
}

fn per_part(rows: &[Row], parts: usize, n: f64, is_friction: bool, kernel_s: f64) -> (Vec<Sums>, Sums) {
    let mut sums = vec![Sums::default(); parts];
    for row in rows {
        sums[row.part].add(&columns(row, n, is_friction, kernel_s));
    }
    let all = sums.iter().fold(Sums::default(), |all, part| all.plus(part));
    (sums, all)
}

/// Fits an order without each part and judges it there; `None` where no part can be judged.
pub(super) fn score(rows: &[Row], parts: usize, n: f64, is_friction: bool, kernel_s: f64) -> Option<Score> {
    let (sums, all) = per_part(rows, parts, n, is_friction, kernel_s);
    let squares = |part: &Sums| {
        let others = all.less(part);
        let (without, with) = (part.rss(&others.solve(2)?), part.rss(&others.solve(0)?));
        (without > 0.0 && with > 0.0).then_some((without, with))
    };
    // Parts without rows say nothing.
    let pairs: Vec<(f64, f64)> = sums.iter().filter(|part| part.0[2][2] > 0.0).filter_map(squares).collect();
    if pairs.len() < 2 {
        return None;
    }
    let [a, b, ..] = all.solve(0)?;
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
    let mut all = Sums::default();
    rows.iter().for_each(|row| all.add(&columns(row, n, is_friction, kernel_s)));
    all.solve(0).map_or(f64::INFINITY, |x| all.rss(&x))
}

/// Takes off residuals what offset, Coulomb and viscous friction may be in them.
pub(super) fn without_friction(rows: &mut [Row]) {
    let mut all = Sums::default();
    rows.iter().for_each(|row| all.add(&columns(row, 0.0, false, 0.0)));
    let Some(x) = all.solve(2) else { return };
    for row in rows {
        row.residual -= x[2] + x[3] * row.velocity.signum() + x[4] * row.velocity;
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
