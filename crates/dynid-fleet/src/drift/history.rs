//! The logs of one robot in the order of time, and the weights that they have.

use dynid_linalg::Mat;

use super::series::{Background, Series};
use crate::sweep::{Sweep, whitened};

/// Logs of a robot.
pub(crate) struct Logs<'a> {
    sweep: &'a Sweep<'a>,
    /// Degrees of freedom of the scatter between logs.
    freedom: f64,
    /// Index of every log among the fleet's, in the order of time.
    pub(crate) index: Vec<usize>,
    /// Date of the first log, s.
    pub(crate) first_s: f64,
    /// Time from the first to the last, s.
    pub(crate) span_s: f64,
    times: Vec<f64>,
}

impl<'a> Logs<'a> {
    pub(crate) fn of(sweep: &'a Sweep<'a>, freedom: f64, dates: &[f64], r: usize) -> Logs<'a> {
        let mut index = sweep.splits.by_robot[r].clone();
        index.sort_by(|a, b| dates[*a].total_cmp(&dates[*b]));
        let first_s = index.first().map_or(0.0, |k| dates[*k]);
        let span_s = index.last().map_or(0.0, |k| dates[*k] - first_s);
        let times =
            index.iter().map(|k| if span_s > 0.0 { (dates[*k] - first_s) / span_s } else { 0.0 }).collect();
        Logs { sweep, freedom, index, first_s, span_s, times }
    }

    /// Number of coordinates.
    pub(crate) fn coordinates(&self) -> usize {
        self.sweep.splits.q
    }

    /// Number of coordinates whose changes are told.
    pub(crate) fn watched(&self) -> usize {
        self.sweep.splits.watched.iter().filter(|w| **w).count()
    }

    /// Whether changes of a coordinate are told.
    pub(crate) fn is_watched(&self, k: usize) -> bool {
        self.sweep.splits.watched[k]
    }

    /// Weights of the logs where nothing changes.
    pub(crate) fn weights(&self) -> Vec<Vec<f64>> {
        self.index.iter().map(|k| self.sweep.variances.log_weights[*k].clone()).collect()
    }

    /// Minus twice the logarithm of the likelihood of what a background leaves, weights of the logs included:
    /// `ln |S| + rᵀS⁻¹r + ν Σ (ω - ln ω)`, which [`Self::reweighted`] makes smaller step by step.
    pub(crate) fn misfit(&self, background: &Background<'_>, weights: &[Vec<f64>]) -> f64 {
        let q = self.sweep.splits.q;
        let of = |(l, weights): (usize, &Vec<f64>)| {
            let (rows, residual, logdet) = self.rows(l, weights);
            let fitted = crate::triangle::times(&rows.columns(0..q), &background.fitted(l));
            let left = crate::triangle::squares(fitted.iter().zip(&residual).map(|(f, r)| r - f));
            let of_weights: f64 = weights.iter().map(|w| w - w.ln()).sum();
            logdet + left + self.freedom * of_weights
        };
        weights.iter().enumerate().map(of).sum::<f64>() + background.strain()
    }

    /// Rows of log `l` whitened with a weight per coordinate, the residuals of the fleet's parameters at its covariates, and `ln |S|`.
    fn rows(&self, l: usize, weights: &[f64]) -> (Mat, Vec<f64>, f64) {
        let Sweep { splits, variances, theta, .. } = self.sweep;
        let (q, slopes) = (splits.q, splits.q * splits.covariates);
        let log = &splits.logs[self.index[l]];
        let variances: Vec<f64> = variances.logs.iter().zip(weights).map(|(d, w)| d / w).collect();
        let (rows, logdet) = whitened(&log.top, q, &variances);
        let mut x = theta.clone();
        x.drain(q..q + slopes);
        for (c, u) in log.covariates.iter().enumerate() {
            (0..q).for_each(|i| x[i] += u * theta[q + c * q + i]);
        }
        let fitted = crate::triangle::times(&rows, &x);
        let residual = fitted.iter().enumerate().map(|(i, y)| rows[(i, x.len())] - y).collect();
        (rows, residual, logdet)
    }

    /// The series with weights of the logs.
    pub(crate) fn series(&self, weights: &[Vec<f64>]) -> Series {
        let q = self.sweep.splits.q;
        let (mut information, mut moment) = (Vec::new(), Vec::new());
        for (l, weights) in weights.iter().enumerate() {
            let (rows, residual, _) = self.rows(l, weights);
            let varying = rows.columns(0..q);
            moment.push((varying.transpose() * Mat::column(&residual)).col(0).to_vec());
            information.push(varying.transpose() * varying);
        }
        let covariates = self.index.iter().map(|k| self.sweep.splits.logs[*k].covariates.clone()).collect();
        Series { times: self.times.clone(), covariates, information, moment }
    }

    /// Weights by Student's t about what a background explains.
    pub(crate) fn reweighted(&self, background: &Background<'_>, weights: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let q = self.sweep.splits.q;
        let spread = &self.sweep.variances.logs;
        let of = |(l, weights): (usize, &Vec<f64>)| {
            let (rows, residual, _) = self.rows(l, weights);
            let varying = rows.columns(0..q);
            let left: Vec<f64> =
                (crate::triangle::times(&varying, &background.fitted(l)).iter().zip(residual))
                    .map(|(f, r)| r - f)
                    .collect();
            let moment = varying.transpose() * Mat::column(&left);
            let information = varying.transpose() * varying;
            let weight = |k: usize| {
                if spread[k] == 0.0 {
                    return weights[k];
                }
                let own = spread[k] / weights[k];
                let second = (own * moment[(k, 0)]).powi(2) + own - own * own * information[(k, k)];
                (self.freedom + 1.0) / (self.freedom + second / spread[k])
            };
            (0..q).map(weight).collect()
        };
        weights.iter().enumerate().map(of).collect()
    }
}
