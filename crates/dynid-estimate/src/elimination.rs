//! Backward elimination with all that is needed to choose from its path.

use crate::covariance::MIN_BLOCKS;
use crate::distribution::f_quantile;
use crate::folds::{FoldSettings, HeldOutError, contiguous_folds, held_out_error};
use crate::whitened::{Whitened, WhitenedBlock, cholesky, upper_times};
use dynid_factor::factor::Factor;
use dynid_linalg::Mat;
use dynid_linalg::triangular::inverse;
use rayon::prelude::*;
use std::ops::Range;

/// Settings of [`prune`].
#[derive(Debug, Clone, PartialEq)]
pub struct PruneSettings {
    /// Folds of the held-out error. Default [`FoldSettings::default`].
    pub folds: FoldSettings,
    /// Effective number of rows `N_eff` of the BIC. Default `None`: `N/κ` with the variance inflation of the whole model.
    pub effective_rows: Option<f64>,
    /// Level of the test that names the first model without a doubtful parameter. Default 0.95.
    pub level: f64,
}

impl Default for PruneSettings {
    fn default() -> Self {
        Self { folds: FoldSettings::default(), effective_rows: None, level: 0.95 }
    }
}

/// One model on the path of [`prune`].
#[derive(Debug, Clone, PartialEq)]
pub struct PruneStep {
    /// Columns of the model, ascending.
    pub columns: Vec<usize>,
    /// Parameters of [`Self::columns`].
    pub x: Vec<f64>,
    /// Residual sum of squares in units of the variances.
    pub rss: f64,
    /// `BIC = N_eff ln(rss/N) + k ln N_eff`; minus infinity for an exact fit.
    pub bic: f64,
    /// Column of least `F`, the next to go.
    pub weakest: usize,
    /// Statistic `F_i = x_i²/V_ii` of that column.
    pub statistic: f64,
    /// Held-out mean squared error per row, in units of the variances; `None` with too few blocks to hold any out.
    pub held_out: Option<HeldOutError>,
}

/// Outcome of [`prune`].
#[derive(Debug, Clone, PartialEq)]
pub struct Pruning {
    /// Models from all columns down to one.
    pub path: Vec<PruneStep>,
    /// Index of the smallest model within one standard error of the least held-out error; `None` without such errors.
    pub chosen: Option<usize>,
    /// Index of the model of least BIC.
    pub least_bic: usize,
    /// Index of the first model whose every `F` exceeds [`Self::threshold`].
    pub all_significant: Option<usize>,
    /// `F_level(1, B - 1)`, or with `N - p` where the blocks are too few.
    pub threshold: f64,
    /// Whether `V` is the jackknife's. With fewer than [`MIN_BLOCKS`] blocks it is `σ̂² C`, which coloured residuals make
    /// too small, so that too little is pruned.
    pub robust: bool,
    /// `N_eff` used.
    pub effective_rows: f64,
}

/// Drops one column after another, always that of least Wald statistic `F_i = x_i²/V_ii`, and says how every model on the
/// way does on held-out blocks.
///
/// `blocks`: weighted time blocks in independent columns (such as [`crate::linear::LinearEstimate::kept_blocks`]);
/// `columns`: what these columns are called in the outcome. `V` is the delete-a-block jackknife with weights fixed.
/// Folds are contiguous, with neighbours left out, and the weights of the groups stay those of the whole fit. Prior rows
/// are no data and take no part. A dropped base parameter is not a zero standard parameter.
///
/// The blocks are held in the coordinates in which the whole model is orthonormal and turned by Givens rotations when a
/// column leaves; no factorisation of a block is ever done again, and a step costs `B (h p² + p³/3)` operations with
/// blocks of `h` rows. `None` for no blocks, no columns or dependent ones. Panics unless every column has a name.
///
/// Source: Breiman et al. 1984 (one-standard-error rule); Schwarz 1978 (BIC).
pub fn prune(blocks: &[Factor], columns: &[usize], settings: &PruneSettings) -> Option<Pruning> {
    if columns.is_empty() {
        return None;
    }
    let mut model = Model::new(blocks, columns)?;
    let rows = model.rows as f64;
    let robust = blocks.len() >= MIN_BLOCKS;
    let freedom = if robust { blocks.len() as f64 - 1.0 } else { rows - columns.len() as f64 };
    let threshold = f_quantile(settings.level, 1.0, freedom).unwrap_or(f64::INFINITY);
    let folds = Folds::new(blocks.len(), &settings.folds);
    let mut effective_rows = settings.effective_rows;
    let mut path = Vec::with_capacity(columns.len());
    let mut all_significant = None;
    loop {
        let grams: Vec<Mat> = model.blocks.par_iter().map(WhitenedBlock::gram).collect();
        let inverse = inverse(&model.r);
        let x = upper_times(&inverse, &model.d);
        let unit: Vec<f64> =
            (0..x.len()).map(|i| (i..x.len()).map(|k| inverse[(i, k)].powi(2)).sum()).collect();
        let variances = if robust {
            model.jackknife_variances(&grams, &inverse)?
        } else {
            let residual = model.rss / (rows - x.len() as f64).max(1.0);
            unit.iter().map(|c| residual * c).collect()
        };
        let effective = *effective_rows.get_or_insert_with(|| rows / inflation(&variances, &unit));
        let statistics: Vec<f64> =
            x.iter().zip(&variances).map(|(x, v)| if *v > 0.0 { x * x / v } else { f64::INFINITY }).collect();
        let weakest = (0..x.len()).min_by(|&a, &b| statistics[a].total_cmp(&statistics[b])).unwrap_or(0);
        if all_significant.is_none() && statistics[weakest] > threshold {
            all_significant = Some(path.len());
        }
        path.push(PruneStep {
            columns: model.columns.clone(),
            rss: model.rss,
            bic: bayesian_information(model.rss / rows, x.len(), effective),
            x,
            weakest: model.columns[weakest],
            statistic: statistics[weakest],
            held_out: folds.error(&model.blocks, &grams),
        });
        if model.columns.len() == 1 {
            break;
        }
        model.remove(weakest);
    }
    let errors: Vec<Option<HeldOutError>> = path.iter().map(|s| s.held_out.clone()).collect();
    Some(Pruning {
        chosen: smallest_within_one_standard_error(&errors, |i| path[i].columns.len()),
        least_bic: (0..path.len()).min_by(|&a, &b| path[a].bic.total_cmp(&path[b].bic)).unwrap_or(0),
        all_significant,
        threshold,
        robust,
        effective_rows: effective_rows.unwrap_or(rows),
        path,
    })
}

/// `max(1, median V_ii/C_ii)`.
fn inflation(variances: &[f64], unit: &[f64]) -> f64 {
    let diagonal = |v: &[f64]| Mat::from_fn(v.len(), v.len(), |i, j| if i == j { v[i] } else { 0.0 });
    crate::covariance::variance_inflation(&diagonal(variances), &diagonal(unit)).unwrap_or(1.0)
}

/// The columns still in the model, in the coordinates `d = R x` in which it is orthonormal.
struct Model {
    columns: Vec<usize>,
    r: Mat,
    d: Vec<f64>,
    rss: f64,
    rows: usize,
    blocks: Vec<WhitenedBlock>,
}

impl Model {
    fn new(blocks: &[Factor], columns: &[usize]) -> Option<Self> {
        let Whitened { merged, blocks, .. } = Whitened::new(blocks, None)?;
        assert_eq!(merged.columns(), columns.len(), "one name per column");
        Some(Model {
            columns: columns.to_vec(),
            r: merged.r_matrix(),
            d: merged.z(),
            rss: merged.rho().powi(2),
            rows: merged.rows(),
            blocks,
        })
    }

    /// Removes a column: rotations restore the triangle, and what the last coordinate explained becomes residual.
    fn remove(&mut self, position: usize) {
        let k = self.columns.len();
        self.columns.remove(position);
        let mut r = Mat::from_fn(k, k - 1, |i, j| self.r[(i, if j < position { j } else { j + 1 })]);
        let rotations: Vec<(usize, f64, f64)> = (position..k - 1)
            .map(|t| {
                let length = r[(t, t)].hypot(r[(t + 1, t)]);
                let (c, s) =
                    if length > 0.0 { (r[(t, t)] / length, r[(t + 1, t)] / length) } else { (1.0, 0.0) };
                for j in t..k - 1 {
                    let (a, b) = (r[(t, j)], r[(t + 1, j)]);
                    (r[(t, j)], r[(t + 1, j)]) = (c * a + s * b, c * b - s * a);
                }
                (t, c, s)
            })
            .collect();
        self.r = Mat::from_fn(k - 1, k - 1, |i, j| if i <= j { r[(i, j)] } else { 0.0 });
        for &(t, c, s) in &rotations {
            let (a, b) = (self.d[t], self.d[t + 1]);
            (self.d[t], self.d[t + 1]) = (c * a + s * b, c * b - s * a);
        }
        self.rss += self.d.pop().map_or(0.0, |d| d * d);
        self.blocks.par_iter_mut().for_each(|block| {
            for &(t, c, s) in &rotations {
                for i in 0..block.q.nrows() {
                    let (a, b) = (block.q[(i, t)], block.q[(i, t + 1)]);
                    (block.q[(i, t)], block.q[(i, t + 1)]) = (c * a + s * b, c * b - s * a);
                }
            }
            block.q.truncate_columns(k - 1);
        });
    }

    /// Diagonal of the jackknife covariance in the model's own parameters.
    fn jackknife_variances(&self, grams: &[Mat], inverse: &Mat) -> Option<Vec<f64>> {
        let k = self.d.len();
        let changes: Vec<Vec<f64>> = self
            .blocks
            .par_iter()
            .zip(grams)
            .map(|(block, gram)| {
                let score = block.transposed(&block.residual(&self.d));
                let rest = Mat::from_fn(k, k, |i, j| if i == j { 1.0 } else { 0.0 } - gram[(i, j)]);
                Some(upper_times(inverse, &cholesky(&rest)?.0.solve_vector(&score)))
            })
            .collect::<Option<_>>()?;
        let share = (changes.len() - 1) as f64 / changes.len() as f64;
        Some((0..k).map(|i| share * changes.iter().map(|c| c[i] * c[i]).sum::<f64>()).collect())
    }
}

/// Blocks held out and blocks trained on, fold by fold.
struct Folds(Vec<(Range<usize>, Vec<usize>)>);

impl Folds {
    fn new(blocks: usize, settings: &FoldSettings) -> Self {
        let training = |held: &Range<usize>| -> Vec<usize> {
            let start = held.start.saturating_sub(settings.dropped_neighbours);
            (0..start).chain(held.end + settings.dropped_neighbours..blocks).collect()
        };
        let folds = contiguous_folds(blocks, settings.folds).into_iter();
        Folds(folds.map(|held| (held.clone(), training(&held))).filter(|(_, t)| !t.is_empty()).collect())
    }

    fn error(&self, blocks: &[WhitenedBlock], grams: &[Mat]) -> Option<HeldOutError> {
        let errors: Vec<Option<f64>> = self
            .0
            .par_iter()
            .map(|(held, training)| {
                let k = grams[0].nrows();
                let (mut gram, mut right) = (Mat::zeros(k, k), vec![0.0; k]);
                for &b in training {
                    gram += &grams[b];
                    let own = blocks[b].transposed(&blocks[b].z);
                    right.iter_mut().zip(own).for_each(|(r, v)| *r += v);
                }
                let d = cholesky(&gram)?.0.solve_vector(&right);
                let held = &blocks[held.clone()];
                let rows: usize = held.iter().map(|b| b.rows).sum();
                let sum: f64 = held
                    .iter()
                    .map(|b| b.rho * b.rho + b.residual(&d).iter().map(|r| r * r).sum::<f64>())
                    .sum();
                (rows > 0).then(|| sum / rows as f64)
            })
            .collect();
        held_out_error(errors.into_iter().flatten())
    }
}

/// `N_eff ln(rss/N) + k ln N_eff`.
fn bayesian_information(mean_square: f64, parameters: usize, effective_rows: f64) -> f64 {
    effective_rows * mean_square.ln() + parameters as f64 * effective_rows.ln()
}

/// Index of the smallest model within one standard error of the least held-out error; `None` where no model has one.
///
/// Source: Breiman et al. 1984 (one-standard-error rule).
fn smallest_within_one_standard_error(
    errors: &[Option<HeldOutError>],
    size: impl Fn(usize) -> usize,
) -> Option<usize> {
    let known = || errors.iter().enumerate().filter_map(|(i, e)| e.as_ref().map(|e| (i, e)));
    let (_, best) = known().min_by(|a, b| a.1.mean.total_cmp(&b.1.mean))?;
    let limit = best.mean + best.standard_error;
    known().filter(|(_, e)| e.mean <= limit).min_by_key(|(i, _)| size(*i)).map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::{HeldOutError, smallest_within_one_standard_error};

    #[test]
    fn the_smallest_model_within_one_standard_error_is_chosen() {
        let error = |mean| Some(HeldOutError { mean, standard_error: 0.1 });
        let chosen = |errors: &[Option<HeldOutError>]| smallest_within_one_standard_error(errors, |i| 2 - i);
        assert_eq!(chosen(&[error(1.0), error(1.05)]), Some(1));
        assert_eq!(chosen(&[error(1.0), error(1.2)]), Some(0));
        assert_eq!(chosen(&[None, error(1.2)]), Some(1));
        assert_eq!(chosen(&[None, None]), None);
    }
}
