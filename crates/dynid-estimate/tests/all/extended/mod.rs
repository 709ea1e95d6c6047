//! An oracle for reductions: `[W y]` to a triangle, and least squares from it, with 32 digits.
//!
//! Rows are rotated in one by one (Givens), so that there is no block, order or thread that the result could depend on.

mod double_double;

pub(crate) use double_double::DoubleDouble;

/// Triangular factor `(R, z, ρ, N)` in double-double arithmetic; row `i` is zero or starts with a positive entry in column `i`.
pub(crate) struct ExtendedFactor {
    /// `[[R, z], [0, ρ]]` by rows, `(columns + 1)²` entries, zeros below the diagonal.
    triangle: Vec<DoubleDouble>,
    columns: usize,
    rows: usize,
}

/// Least squares, rounded once in the end.
pub(crate) struct Solution {
    pub(crate) x: Vec<f64>,
    /// `√(rss/(N - p))`.
    pub(crate) residual_std: f64,
    /// Standard deviations of `x`.
    pub(crate) std: Vec<f64>,
}

impl ExtendedFactor {
    /// Factor of no rows, with `columns` parameters.
    pub(crate) fn new(columns: usize) -> Self {
        let width = columns + 1;
        Self { triangle: vec![DoubleDouble::ZERO; width * width], columns, rows: 0 }
    }

    /// Rotates one row of `[W y]` into the triangle.
    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = DoubleDouble>) {
        let width = self.columns + 1;
        let mut row: Vec<DoubleDouble> = row.into_iter().collect();
        assert_eq!(row.len(), width, "entries of a row");
        self.rows += 1;
        for (j, held) in self.triangle.chunks_exact_mut(width).enumerate() {
            if row[j] != DoubleDouble::ZERO {
                let (cosine, sine) = givens(held[j], row[j]);
                for (above, below) in held[j..].iter_mut().zip(&mut row[j..]) {
                    (*above, *below) = (cosine * *above + sine * *below, cosine * *below - sine * *above);
                }
                row[j] = DoubleDouble::ZERO;
            }
        }
    }

    /// Entry of `[[R, z], [0, ρ]]`.
    pub(crate) fn at(&self, row: usize, column: usize) -> DoubleDouble {
        self.triangle[row * (self.columns + 1) + column]
    }

    /// Least squares of columns that are independent.
    pub(crate) fn solve(&self) -> Solution {
        let n = self.columns;
        let x = self.substitute((0..n).map(|i| self.at(i, n)).collect());
        let rho = self.at(n, n);
        let variance = (rho * rho).to_f64() / (self.rows - n) as f64;
        let inverse: Vec<Vec<DoubleDouble>> = (0..n)
            .map(|k| self.substitute((0..n).map(|i| f64::from(u8::from(i == k)).into()).collect()))
            .collect();
        let of = |i: usize| {
            let squares = inverse.iter().map(|column| column[i] * column[i]);
            squares.fold(DoubleDouble::ZERO, |sum, square| sum + square).to_f64()
        };
        Solution {
            x: x.into_iter().map(DoubleDouble::to_f64).collect(),
            residual_std: variance.sqrt(),
            std: (0..n).map(|i| (variance * of(i)).sqrt()).collect(),
        }
    }

    /// `R⁻¹ b`.
    fn substitute(&self, mut b: Vec<DoubleDouble>) -> Vec<DoubleDouble> {
        for j in (0..b.len()).rev() {
            b[j] = b[j] / self.at(j, j);
            let (above, solved) = b.split_at_mut(j);
            for (i, value) in above.iter_mut().enumerate() {
                *value = *value - self.at(i, j) * solved[0];
            }
        }
        b
    }
}

/// `(c, s)` with `c a + s b = √(a² + b²) > 0` and `c b - s a = 0`, without overflow of the squares; `b ≠ 0`.
///
/// Source: Golub & Van Loan, *Matrix Computations*, 5.1.8.
fn givens(a: DoubleDouble, b: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let of_larger = |ratio: DoubleDouble, larger: DoubleDouble| {
        let cosine = DoubleDouble::ONE / (DoubleDouble::ONE + ratio * ratio).sqrt();
        if larger < DoubleDouble::ZERO { -cosine } else { cosine }
    };
    if a.abs() >= b.abs() {
        let ratio = b / a;
        let cosine = of_larger(ratio, a);
        (cosine, ratio * cosine)
    } else {
        let ratio = a / b;
        let sine = of_larger(ratio, b);
        (ratio * sine, sine)
    }
}
