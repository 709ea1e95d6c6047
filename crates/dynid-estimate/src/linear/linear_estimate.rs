//! The result that every linear estimator shares.

use std::collections::BTreeMap;

use super::irls::Loss;
use super::method::LinearMethod;
use crate::covariance::{Jackknife, block_sandwich_with, jackknife_by, jackknife_with};
use crate::least_squares::LinearSolution;
use crate::least_squares::{TlsNoise, tls};
use crate::oblique::{jackknife as instrumental_jackknife, paired_columns};
use dynid_factor::factor::Factor;
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_linalg::Mat;

/// What an estimator found about one group of rows.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupFit {
    /// Index of the log.
    pub log: usize,
    /// Index of the output.
    pub output: usize,
    /// Index of the kernel scale.
    pub scale: usize,
    /// Residual variance `σ_j²` (for robust losses the square of the scale), effort².
    pub variance: f64,
    /// Factor by which the group's reduced rows enter the weighted blocks, `√curvature/σ_j`.
    pub weight: f64,
    /// Leverage `‖W_j R⁻¹‖_F²/σ_j²` of the group, of the least-squares start for robust losses.
    pub leverage: f64,
    /// Residual sum of squares of all rows at the estimate, unweighted, effort².
    pub rss: f64,
    /// Rows.
    pub rows: usize,
    /// Whether the variance could not be told from the residuals.
    pub at_floor: bool,
    /// Share of rows weighed down: `ω < 1` for Huber, `ω < 1/2` for Tukey, 0 otherwise.
    pub down_weighted: f64,
    /// Share of rows without any weight.
    pub rejected: f64,
    /// `mean ψ'/mean ω` of a robust loss: what the curvature of the loss is, of that of the weighted squares. 1 otherwise.
    pub curvature: f64,
}

/// Estimate of any [`LinearMethod`].
///
/// Ordinary least squares on [`Self::factor`] (with the prior rows of a ridge) gives `x` back, and the scores of
/// [`Self::blocks`] are those of the estimator, but for an own one. Covariance, bootstrap, elimination, folds and constrained estimators
/// therefore need not know the method.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearEstimate {
    /// The method.
    pub method: LinearMethod,
    /// All `p` parameters. Dropped ones are zero, or at the prior for a ridge.
    pub x: Vec<f64>,
    /// Solution of the merged weighted factor: kept and dropped columns, rank, conditioning, `C`.
    pub solution: LinearSolution,
    /// One entry per group, in the order given.
    pub groups: Vec<GroupFit>,
    /// Rows as the estimator weighs them within each group, in the unit of effort: multiplied by `√ω` for robust losses,
    /// freed of the columns' errors for total least squares, with the regressor that instruments explain and the residual of the
    /// measured one for instrumental variables, unchanged otherwise.
    pub reduced: Vec<ReducedGroup>,
    /// Merged weighted factor of all columns, without prior rows.
    pub factor: Factor,
    /// Weighted time blocks, log after log, all groups of a block merged, in all columns; none without rows.
    pub blocks: Vec<Factor>,
    /// Passes made, of the last loss for robust ones.
    pub passes: usize,
    /// Whether they settled within the tolerance.
    pub converged: bool,
    /// Loss `Σ ρ(r/ŝ)` at the start of every pass with frozen scales; empty without a robust loss.
    pub losses: Vec<f64>,
    /// Per log and time block the part of a motion that it holds; empty: each block is one by itself.
    pub(super) parts: Vec<Vec<usize>>,
    pub(super) prior: Option<Factor>,
    pub(super) loss: Option<Loss>,
    /// Time blocks as given, for total least squares solved again without a block; else none.
    pub(super) given_blocks: Vec<Factor>,
    /// Paired groups of instrumental variables, solved again without a block; else none.
    pub(crate) paired: Vec<ReducedGroup>,
}

impl LinearEstimate {
    /// Returns the estimate with time blocks `factor` times as long, for residuals that stay correlated beyond a block.
    ///
    /// Panics if `factor` is zero.
    #[must_use]
    pub fn with_longer_blocks(mut self, factor: usize) -> LinearEstimate {
        if factor == 1 {
            return self;
        }
        let total = self.x.len();
        let weights = self.weights();
        self.reduced = self.reduced.iter().map(|g| g.coarsened(factor)).collect();
        self.blocks = self.time_blocks(&self.reduced, &weights, total);
        self.paired = self.paired.iter().map(|g| g.coarsened(factor)).collect();
        if !self.given_blocks.is_empty() {
            // Unweighted, as they were given.
            let merged =
                self.given_blocks.chunks(factor).map(|c| Factor::merge(&c.iter().collect::<Vec<_>>()));
            self.given_blocks = merged.collect();
        }
        self
    }

    /// Returns the estimate with time blocks put together that hold the same part of a motion, within a log and from log to log: what a model
    /// leaves over at a place and speed comes back with the motion.
    ///
    /// `parts`: per log and block of [`Self::reduced`] the number of its part. Panics unless there is one for every block.
    #[must_use]
    pub fn with_repeated_motions(mut self, parts: Vec<Vec<usize>>) -> LinearEstimate {
        self.parts = parts;
        let weights = self.weights();
        self.blocks = self.time_blocks(&self.reduced, &weights, self.x.len());
        self
    }

    fn time_blocks(&self, groups: &[ReducedGroup], weights: &[f64], total: usize) -> Vec<Factor> {
        if self.parts.is_empty() {
            return time_blocks(groups, weights, total);
        }
        let mut of_part: BTreeMap<usize, Vec<Factor>> = BTreeMap::new();
        for (group, weight) in groups.iter().zip(weights) {
            for (block, part) in group.blocks.iter().zip(&self.parts[group.log]) {
                if block.rows() > 0 {
                    let weighted = block.scaled(*weight).embed(total, &group.columns);
                    of_part.entry(*part).or_default().push(weighted);
                }
            }
        }
        of_part.values().map(|parts| Factor::merge(&parts.iter().collect::<Vec<_>>())).collect()
    }

    /// Parameters of the kept columns.
    pub fn kept_x(&self) -> Vec<f64> {
        self.solution.kept.iter().map(|&c| self.x[c]).collect()
    }

    /// [`Self::blocks`] in the kept columns.
    pub fn kept_blocks(&self) -> Vec<Factor> {
        self.kept(&self.blocks)
    }

    /// Rows of the prior of a ridge in the kept columns, which belong to no block; `None` for the other methods.
    pub fn kept_prior(&self) -> Option<Factor> {
        self.prior.as_ref().map(|p| self.without_dropped(p))
    }

    fn kept(&self, blocks: &[Factor]) -> Vec<Factor> {
        blocks.iter().map(|b| self.without_dropped(b)).collect()
    }

    /// In the kept columns, the others being fixed at their value in `x`.
    fn without_dropped(&self, factor: &Factor) -> Factor {
        if self.solution.dropped.is_empty() {
            return factor.clone();
        }
        let mut fixed = self.x.clone();
        self.solution.kept.iter().for_each(|&c| fixed[c] = 0.0);
        factor.centred(&fixed).select(&self.solution.kept)
    }

    /// Weights of the groups in the blocks.
    pub fn weights(&self) -> Vec<f64> {
        self.groups.iter().map(|g| g.weight).collect()
    }

    /// `ψ(r/ŝ)/ŝ` of a residual of a group: what its row of the regressor is multiplied by in the score.
    pub(crate) fn row_score(&self, group: usize, residual: f64) -> f64 {
        let variance = self.groups[group].variance;
        self.loss.map_or(1.0, |loss| loss.weight(residual / variance.sqrt())) * residual / variance
    }

    /// Covariance of the kept columns if all residuals were independent.
    ///
    /// `C = (RᵀR)⁻¹` for the squared losses; `C (Σ_j τ_j J_j) C` for robust ones, with the information `J_j` of each group
    /// and the mean square `τ_j` of its weighted residuals, `E ψ²/E ψ'`.
    pub fn model_covariance(&self) -> Mat {
        let unit = self.solution.unit_covariance();
        if !self.method.needs_rows() {
            return unit;
        }
        let p = self.solution.kept.len();
        let mut filling = Mat::zeros(p, p);
        for (fit, group) in self.groups.iter().zip(&self.reduced) {
            let weighted = self.without_dropped(&group.merged(self.x.len()).scaled(fit.weight));
            let freedom = (fit.rows as f64 - fit.leverage).max(1.0);
            let tau = weighted.rss(&self.kept_x()) / freedom;
            let r = weighted.r_matrix();
            filling += (r.transpose() * &r) * tau;
        }
        crate::covariance::sandwich(&unit, &filling)
    }

    /// Delete-a-block jackknife with weights fixed; `None` with fewer than two blocks. Total least squares is solved
    /// again without each block where the noisy columns act on all groups; elsewhere, and in the block sandwich and the
    /// bootstrap, the linear step is taken, which understates the spread by the share of noise in the columns. Instrumental
    /// variables and own estimators are solved again without each block.
    pub fn jackknife(&self) -> Option<Jackknife> {
        if let LinearMethod::Own(own) = &self.method {
            return super::own::jackknife(own, &self.reduced, &self.solution.kept, &self.x);
        }
        if !self.paired.is_empty() {
            let total = self.x.len();
            let columns = paired_columns(&self.solution.kept, total);
            let blocks = self.time_blocks(&self.paired, &self.weights(), 2 * total);
            let kept: Vec<Factor> = blocks.iter().map(|b| b.select(&columns)).collect();
            return instrumental_jackknife(&kept, &self.kept_x());
        }
        if let (LinearMethod::Tls(noise), false) = (&self.method, self.given_blocks.is_empty()) {
            let kept_noise = TlsNoise {
                columns: self.solution.kept.iter().map(|&c| noise.columns[c]).collect(),
                effort: noise.effort,
            };
            return jackknife_by(&self.kept(&self.given_blocks), &self.kept_x(), |rest| {
                tls(rest, &kept_noise).ok().filter(|s| s.dropped.is_empty()).map(|s| s.x)
            });
        }
        jackknife_with(&self.kept_blocks(), self.kept_prior().as_ref(), &self.kept_x())
    }

    /// Sandwich covariance from block scores, as a second opinion; `None` with fewer than two blocks, and for own estimators, whose scores
    /// are not known.
    pub fn block_sandwich(&self) -> Option<Mat> {
        if matches!(self.method, LinearMethod::Own(_)) {
            return None;
        }
        block_sandwich_with(&self.kept_blocks(), self.kept_prior().as_ref(), &self.kept_x())
    }
}
