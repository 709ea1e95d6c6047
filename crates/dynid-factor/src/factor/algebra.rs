//! Operations that take factors to factors.

use super::{DEFAULT_CHUNK_ROWS, Factor, FactorBuilder};
use dynid_linalg::Mat;

impl Factor {
    /// Merges factors of disjoint rows with the same columns, always in the order given.
    ///
    /// Equals the factor of all rows stacked (up to rounding). Panics on an empty list or unequal columns.
    #[must_use]
    pub fn merge(factors: &[&Factor]) -> Factor {
        assert!(!factors.is_empty(), "nothing to merge");
        let stacked: usize = factors.iter().map(|f| f.height()).sum();
        let mut builder =
            FactorBuilder::with_chunk_rows(factors[0].columns(), stacked.min(DEFAULT_CHUNK_ROWS));
        for factor in factors {
            builder.push_factor(factor);
        }
        builder.finish()
    }

    /// Factor of the rows multiplied by `|weight|`. Panics unless `weight` is finite.
    #[must_use]
    pub fn scaled(&self, weight: f64) -> Factor {
        assert!(weight.is_finite(), "weights are finite");
        let weight = weight.abs();
        Factor {
            triangle: Mat::from_fn(self.height(), self.columns + 1, |i, j| weight * self.triangle[(i, j)]),
            rho: weight * self.rho,
            ..*self
        }
    }

    /// Factor of the chosen columns of `W` in the order given (same rows, same effort).
    ///
    /// Panics if an index is not below `p`.
    #[must_use]
    pub fn select(&self, columns: &[usize]) -> Factor {
        assert!(columns.iter().all(|&c| c < self.columns), "selected columns exist");
        if columns.iter().copied().eq(0..self.columns) {
            return self.clone();
        }
        let mut builder = FactorBuilder::with_chunk_rows(columns.len(), self.height());
        builder
            .stack(self.height(), |i, j| self.triangle[(i, columns.get(j).copied().unwrap_or(self.columns))]);
        self.with_remainder(builder)
    }

    /// What is left of other columns where the parameters of the chosen ones are free: `[W y]` projected off these columns, as many rows fewer (a column of zeros
    /// costs a row too).
    ///
    /// Panics if an index is not below `p`, or is there twice.
    #[must_use]
    pub fn freed_of(&self, columns: &[usize]) -> Factor {
        let n = columns.len();
        let rest: Vec<usize> = (0..self.columns).filter(|c| !columns.contains(c)).collect();
        assert_eq!(rest.len() + n, self.columns, "columns that are there, each once");
        let first: Vec<usize> = columns.iter().chain(&rest).copied().collect();
        let ordered = self.select(&first);
        let mut builder = FactorBuilder::with_chunk_rows(rest.len(), ordered.height().saturating_sub(n));
        builder.stack(ordered.height().saturating_sub(n), |i, j| ordered.triangle[(n + i, n + j)]);
        let mut out = ordered.with_remainder(builder);
        out.rows = self.rows.saturating_sub(n);
        out
    }

    /// Factor in a larger set of `total` columns: column `c` goes to `positions[c]`, all others are zero.
    ///
    /// Panics unless `positions` holds one distinct index below `total` per column.
    #[must_use]
    pub fn embed(&self, total: usize, positions: &[usize]) -> Factor {
        assert_eq!(positions.len(), self.columns, "one position per column");
        let mut source = vec![None; total];
        for (column, &position) in positions.iter().enumerate() {
            assert!(source[position].replace(column).is_none(), "positions are distinct");
        }
        let entry = |i: usize, j: usize| match source.get(j) {
            Some(None) => 0.0,
            Some(Some(column)) => self.triangle[(i, *column)],
            None => self.triangle[(i, self.columns)],
        };
        if positions.is_sorted() {
            let triangle = Mat::from_fn(self.height(), total + 1, entry);
            return Factor { triangle, columns: total, ..*self };
        }
        let mut builder = FactorBuilder::with_chunk_rows(total, self.height());
        builder.stack(self.height(), entry);
        self.with_remainder(builder)
    }

    /// Factor of `[W, y - W x]`: parameters counted from `x`. Panics unless `x` has `p` entries.
    #[must_use]
    pub fn centred(&self, x: &[f64]) -> Factor {
        let residual = self.reduced_residual(x);
        let mut factor = self.clone();
        for (i, value) in residual.into_iter().enumerate() {
            factor.triangle[(i, self.columns)] = value;
        }
        factor
    }

    /// Factor of the same regressor whose least squares are `x`, with the residual sum of squares that `x` has.
    ///
    /// Panics unless `x` has `p` entries.
    #[must_use]
    pub fn around(&self, x: &[f64]) -> Factor {
        let rho = self.rss(x).sqrt();
        let residual = self.reduced_residual(x);
        let mut factor = self.clone();
        for (i, value) in residual.into_iter().enumerate() {
            factor.triangle[(i, self.columns)] -= value;
        }
        Factor { rho, ..factor }
    }

    /// Factor of `[W, W x + share (y - W x)]`: every residual at `x` multiplied by `share`, scores likewise.
    ///
    /// Panics unless `x` has `p` entries and `share` is finite.
    #[must_use]
    pub fn with_residual_scaled(&self, x: &[f64], share: f64) -> Factor {
        assert!(share.is_finite(), "shares are finite");
        let mut factor = self.centred(x);
        for i in 0..factor.height() {
            factor.triangle[(i, self.columns)] *= share;
        }
        factor.rho *= share.abs();
        factor.centred(&x.iter().map(|v| -v).collect::<Vec<_>>())
    }

    /// Factor of `[W + r gᵀ, y + r gᵀx]` with the residuals `r = y - W x`, which stay the residuals at `x`.
    ///
    /// Panics unless `x` and `g` have `p` entries.
    #[must_use]
    pub fn with_residual_in_columns(&self, x: &[f64], g: &[f64]) -> Factor {
        assert_eq!(g.len(), self.columns, "one share of the residual per column");
        let mut residual = self.reduced_residual(x);
        residual.push(self.rho);
        let in_effort: f64 = g.iter().zip(x).map(|(g, x)| g * x).sum();
        let height = self.height();
        let mut builder = FactorBuilder::with_chunk_rows(self.columns, height + 1);
        builder.stack(height + 1, |i, j| {
            let own = match (i < height, j == self.columns) {
                (true, _) => self.triangle[(i, j)],
                (false, true) => self.rho,
                (false, false) => 0.0,
            };
            own + residual[i] * g.get(j).copied().unwrap_or(in_effort)
        });
        Factor { rows: self.rows, ..builder.finish() }
    }

    /// Factor of `[W A, y + W b]`: other combinations of the same rows.
    ///
    /// `a`: `p × q`, `b`: `p` entries. Panics unless the shapes agree.
    #[must_use]
    pub fn combined(&self, a: &Mat, b: &[f64]) -> Factor {
        assert!(
            a.nrows() == self.columns && b.len() == self.columns,
            "one row of the combination per column"
        );
        let height = self.height();
        let regressor = self.triangle.columns(0..self.columns);
        let columns = regressor * a;
        let effort = regressor * Mat::from_fn(b.len(), 1, |i, _| b[i]);
        let mut builder = FactorBuilder::with_chunk_rows(a.ncols(), height);
        builder.stack(height, |i, j| {
            if j < a.ncols() { columns[(i, j)] } else { self.triangle[(i, self.columns)] + effort[(i, 0)] }
        });
        self.with_remainder(builder)
    }

    /// Factor of the same rows in which the effort and a column have changed places: what was column `column` is to be
    /// explained by the others and by the effort, which stands in its place.
    ///
    /// Panics if there is no such column.
    #[must_use]
    pub fn with_effort_exchanged(&self, column: usize) -> Factor {
        assert!(column < self.columns, "column {column} of {}", self.columns);
        let height = self.height();
        let mut builder = FactorBuilder::with_chunk_rows(self.columns, height + 1);
        builder.stack(height + 1, |i, j| {
            let from = match j {
                _ if j == column => self.columns,
                _ if j == self.columns => column,
                _ => j,
            };
            match (i < height, from == self.columns) {
                (true, _) => self.triangle[(i, from)],
                (false, true) => self.rho,
                (false, false) => 0.0,
            }
        });
        Factor { rows: self.rows, ..builder.finish() }
    }

    /// Factor of `W` and `y` with the rows `D x ≈ D x0` added below, `D = diag(weights)`.
    ///
    /// The added rows do not count as samples. Panics unless both slices have `p` finite entries.
    #[must_use]
    pub fn with_prior_rows(&self, weights: &[f64], x0: &[f64]) -> Factor {
        assert!(weights.len() == self.columns && x0.len() == self.columns, "one prior row per column");
        assert!(weights.iter().chain(x0).all(|v| v.is_finite()), "prior rows are finite");
        let mut builder = FactorBuilder::with_chunk_rows(self.columns, self.height() + self.columns);
        builder.push_factor(self);
        builder.stack(self.columns, |i, j| match j {
            _ if j == i => weights[i],
            _ if j == self.columns => weights[i] * x0[i],
            _ => 0.0,
        });
        builder.finish()
    }

    /// Factor of `rows` samples from the `p × (p + 1)` entries of `[R z]` and `ρ`, with the signs of rows set right.
    pub fn from_triangle(
        columns: usize,
        entry: impl Fn(usize, usize) -> f64,
        rho: f64,
        rows: usize,
    ) -> Factor {
        let mut builder = FactorBuilder::with_chunk_rows(columns, columns);
        builder.stack(columns, entry);
        let mut factor = builder.finish();
        factor.rho = factor.rho.hypot(rho);
        Factor { rows, ..factor }
    }

    fn with_remainder(&self, builder: FactorBuilder) -> Factor {
        let mut factor = builder.finish();
        factor.rho = factor.rho.hypot(self.rho);
        factor.rows = self.rows;
        factor
    }
}
