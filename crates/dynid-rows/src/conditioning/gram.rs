//! Normal matrices for choices.
//!
//! Choices (kernel, mask, delay) compare many fits of the same rows, so their rows are summed into normal matrices per
//! scale, time block and set of rungs. The final fit never uses them: it goes through triangular factors.

use std::collections::BTreeMap;

use dynid_linalg::{Cholesky, Mat};

use super::PreparedLog;
use super::base_prior::BasePrior;
use super::rows::{RowBatch, RowConsumer};
use super::windows::means;
use dynid_factor::rows::RowsError;

/// `Xᵀ X` of rows `[W, friction shapes, efforts at lags]`.
#[derive(Debug, Clone)]
pub(crate) struct Gram {
    pub(crate) size: usize,
    pub(crate) rows: f64,
    values: Vec<f64>,
}

impl Gram {
    pub(crate) fn zero(size: usize) -> Self {
        Gram { size, rows: 0.0, values: vec![0.0; size * size] }
    }

    fn add_row(&mut self, row: &[f64]) {
        for (i, x) in row.iter().enumerate() {
            let line = &mut self.values[i * self.size + i..(i + 1) * self.size];
            for (g, y) in line.iter_mut().zip(&row[i..]) {
                *g += x * y;
            }
        }
        self.rows += 1.0;
    }

    pub(crate) fn add(&mut self, other: &Gram) {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a += b;
        }
        self.rows += other.rows;
    }

    pub(crate) fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i.min(j) * self.size + i.max(j)]
    }

    /// The normal matrix of some of its columns.
    pub(crate) fn selected(&self, columns: &[usize]) -> Gram {
        let mut out = Gram::zero(columns.len());
        out.rows = self.rows;
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate().skip(i) {
                out.values[i * out.size + j] = self.at(*a, *b);
            }
        }
        out
    }

    /// The normal matrix of new columns, each a combination `Σ factor · column` of old ones.
    pub(crate) fn combined(&self, columns: &[Vec<(usize, f64)>]) -> Gram {
        let mut out = Gram::zero(columns.len());
        out.rows = self.rows;
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate().skip(i) {
                let mut sum = 0.0;
                for (ka, fa) in a {
                    for (kb, fb) in b {
                        sum += fa * fb * self.at(*ka, *kb);
                    }
                }
                out.values[i * out.size + j] = sum;
            }
        }
        out
    }
}

/// Which rows a normal matrix sums: scale, time block, whether the whole kernel lies in the block, rungs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RowClass {
    pub(crate) scale: usize,
    pub(crate) fold: usize,
    pub(crate) scored: bool,
    pub(crate) rungs: u8,
}

/// Normal matrices of one output.
pub(crate) type Classes = BTreeMap<RowClass, Gram>;

/// Lags at which efforts are kept: `lag · step` samples for `lag` in `first..first + count`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lags {
    pub(crate) first: i64,
    pub(crate) count: usize,
    pub(crate) step: usize,
}

impl Lags {
    /// Lags that allow six-point interpolation of delays between `low` and `high` samples, at a step that resolves
    /// what the kernel passes.
    pub(crate) fn new(low: f64, high: f64, kernel_hz: f64, rate_hz: f64) -> Self {
        let step = ((0.08 * rate_hz / kernel_hz) as usize).max(1);
        let first = (low / step as f64).floor() as i64 - 2;
        let last = (high / step as f64).floor() as i64 + 3;
        Lags { first, count: (last - first + 1) as usize, step }
    }

    /// Samples beyond the kernel that the lags reach.
    pub(crate) fn reach(&self) -> usize {
        let last = self.first + self.count as i64 - 1;
        self.first.unsigned_abs().max(last.unsigned_abs()) as usize * self.step
    }

    /// Weights of the kept efforts that give the effort `delay` samples earlier, and their derivative per sample.
    pub(crate) fn weights(&self, delay: f64) -> [Vec<(usize, f64)>; 2] {
        let position = delay / self.step as f64 - self.first as f64;
        let base = (position.floor() as i64).clamp(2, self.count as i64 - 4);
        let fraction = position - base as f64;
        let value = dynid_motion::shift::lagrange(fraction);
        let slope = dynid_motion::shift::lagrange_derivative(fraction);
        let at = |k: usize| (base as usize + k) - 2;
        [
            (0..6).map(|k| (at(k), value[k])).collect(),
            (0..6).map(|k| (at(k), slope[k] / self.step as f64)).collect(),
        ]
    }
}

/// Sums the rows of one output.
pub(crate) struct GramConsumer<'a> {
    pub(crate) effort: &'a [f64],
    pub(crate) kernels: &'a [dynid_motion::Kernel],
    pub(crate) lags: Lags,
    pub(crate) folds: usize,
    pub(crate) samples: usize,
    pub(crate) classes: Classes,
}

impl<'a> GramConsumer<'a> {
    pub(crate) fn new(
        log: &PreparedLog,
        effort: &'a [f64],
        kernels: &'a [dynid_motion::Kernel],
        lags: Lags,
        folds: usize,
    ) -> Self {
        GramConsumer { effort, kernels, lags, folds, samples: log.samples(), classes: Classes::new() }
    }
}

impl RowConsumer for GramConsumer<'_> {
    fn take(&mut self, _output: usize, batch: &RowBatch<'_>) -> Result<(), RowsError> {
        let width = batch.columns.len() / batch.stride;
        let size = width - 1 + self.lags.count;
        let lagged = batch.centres.iter().flat_map(|centre| {
            (0..self.lags.count as i64)
                .map(|k| (*centre as i64 - (self.lags.first + k) * self.lags.step as i64) as usize)
        });
        let efforts = means(&self.kernels[batch.scale], self.effort, lagged);
        let mut row = vec![0.0; size];
        let fold_length = self.samples.div_ceil(self.folds);
        for (r, (centre, efforts)) in
            batch.centres.iter().zip(efforts.chunks_exact(self.lags.count)).enumerate()
        {
            let at = |column: usize| batch.columns[column * batch.stride + r];
            let (columns, lags) = row.split_at_mut(width - 1);
            for (c, x) in columns.iter_mut().enumerate() {
                *x = at(c);
            }
            for (x, effort) in lags.iter_mut().zip(efforts) {
                *x = effort - at(width - 1);
            }
            let fold = centre / fold_length;
            let inside = (centre.saturating_sub(batch.half_width)) / fold_length == fold
                && (centre + batch.half_width) / fold_length == fold;
            let class = RowClass { scale: batch.scale, fold, scored: inside, rungs: batch.rungs[r] };
            self.classes.entry(class).or_insert_with(|| Gram::zero(size)).add_row(&row);
        }
        Ok(())
    }
}

/// A group of rows with a variance of its own: normal matrix of `[local columns, effort]` and where the local columns sit
/// among all unknowns.
pub(crate) struct Group {
    pub(crate) gram: Gram,
    pub(crate) unknowns: Vec<usize>,
}

/// Weighted least squares on normal matrices: unknowns, variances per group. Columns that the rows do not excite come out
/// as zero.
pub(crate) fn solve(groups: &[Group], unknowns: usize, passes: usize) -> (Vec<f64>, Vec<f64>) {
    let mut variances = vec![1.0; groups.len()];
    for (v, g) in variances.iter_mut().zip(groups) {
        let y = g.gram.size - 1;
        let square = g.gram.at(y, y) / g.gram.rows.max(1.0);
        // Rows without effort, where nothing drives: what they leave over is known after the first fit to the others.
        *v = if square > 0.0 { square } else { f64::INFINITY };
    }
    let mut x = vec![0.0; unknowns];
    for pass in 0..passes {
        let Some(solution) = Normal::new(groups, unknowns, &variances).solve() else { return (x, variances) };
        x = solution;
        if pass + 1 == passes {
            break;
        }
        let share = unknowns as f64 / groups.iter().map(|g| g.gram.rows).sum::<f64>().max(1.0);
        for (variance, group) in variances.iter_mut().zip(groups) {
            let freedom = group.gram.rows * (1.0 - share.min(0.9));
            let y = group.gram.size - 1;
            let least = 1e-18 * group.gram.at(y, y) / group.gram.rows.max(1.0);
            let found = (rss(&group.gram, &group.unknowns, &x) / freedom.max(1.0)).max(least);
            *variance = if found > 0.0 { found } else { f64::INFINITY };
        }
    }
    (x, variances)
}

/// Normal equations with one weight per group.
pub(crate) struct Normal {
    pub(crate) matrix: Mat,
    pub(crate) rhs: Mat,
}

impl Normal {
    pub(crate) fn new(groups: &[Group], unknowns: usize, variances: &[f64]) -> Self {
        let mut matrix = Mat::zeros(unknowns, unknowns);
        let mut rhs = Mat::zeros(unknowns, 1);
        for (group, variance) in groups.iter().zip(variances) {
            let y = group.gram.size - 1;
            for (i, gi) in group.unknowns.iter().enumerate() {
                for (j, gj) in group.unknowns.iter().enumerate() {
                    matrix[(*gi, *gj)] += group.gram.at(i, j) / variance;
                }
                rhs[(*gi, 0)] += group.gram.at(i, y) / variance;
            }
        }
        Normal { matrix, rhs }
    }

    /// Adds what is known of the first unknowns beforehand.
    pub(crate) fn add_prior(&mut self, prior: &BasePrior) {
        for i in 0..prior.precision.nrows() {
            for (j, p) in prior.precision.row(i).enumerate() {
                self.matrix[(i, j)] += p;
                self.rhs[(i, 0)] += p * prior.values[j];
            }
        }
    }

    /// Unknowns; those that the rows do not excite are zero. `None` where the matrix is not definite to rounding.
    pub(crate) fn solve(&self) -> Option<Vec<f64>> {
        let unknowns = self.rhs.nrows();
        let scale = self.scale();
        let solution = self
            .unit(unknowns, &scale)?
            .solve(&Mat::from_fn(unknowns, 1, |i, _| scale[i] * self.rhs[(i, 0)]));
        Some((0..unknowns).map(|k| solution[(k, 0)] * scale[k]).collect())
    }

    /// Factors that give every column the length 1; zero for columns without excitation.
    pub(crate) fn scale(&self) -> Vec<f64> {
        let length = |k: usize| self.matrix[(k, k)];
        (0..self.rhs.nrows()).map(|k| if length(k) > 0.0 { 1.0 / length(k).sqrt() } else { 0.0 }).collect()
    }

    /// Factor of the first `unknowns` columns in the unit lengths of `scale`.
    pub(crate) fn unit(&self, unknowns: usize, scale: &[f64]) -> Option<Cholesky> {
        // A trace of ridge in unit columns: choices must not fail where a log leaves a direction unexcited.
        let unit = Mat::from_fn(unknowns, unknowns, |i, j| {
            scale[i] * scale[j] * self.matrix[(i, j)]
                + if i != j {
                    0.0
                } else if scale[i] > 0.0 {
                    1e-10
                } else {
                    1.0
                }
        });
        unit.cholesky()
    }
}

/// Residual sum of squares of the rows of a normal matrix `[columns, effort]`.
pub(crate) fn rss(gram: &Gram, unknowns: &[usize], x: &[f64]) -> f64 {
    let y = gram.size - 1;
    let mut sum = gram.at(y, y);
    for (i, gi) in unknowns.iter().enumerate() {
        sum -= 2.0 * x[*gi] * gram.at(i, y);
        for (j, gj) in unknowns.iter().enumerate() {
            sum += x[*gi] * x[*gj] * gram.at(i, j);
        }
    }
    sum.max(0.0)
}
