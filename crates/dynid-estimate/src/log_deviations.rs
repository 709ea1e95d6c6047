//! Whether several logs have the same parameters, from their factors alone.
//!
//! A column that counts once more in one log has as its parameter what that log has more than the others. Such columns are
//! copies of columns of the log's factors, so that no sample is touched again. They act in that log alone: each log is freed of
//! its own by itself, and what remains of all logs is solved for the common parameters, so that time and memory grow with the
//! number of logs and no faster.

use dynid_linalg::Mat;
use rayon::prelude::*;

use crate::covariance::{MIN_BLOCKS, change_without, running_merges};
use crate::distribution::{f_quantile, t_quantile};
use crate::least_squares::{LinearSolution, WlsSettings, group_floors as floors, ols};
use dynid_factor::factor::Factor;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rank::numerical_rank;
use dynid_linalg::triangular::{inverse, solve_upper};

/// A parameter that one log may have of its own in the rows of one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnColumn {
    /// Log.
    pub log: usize,
    /// Output.
    pub output: usize,
    /// Column of all logs.
    pub column: usize,
}

/// What one log has more than the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Name of the parameter.
    pub of: OwnColumn,
    /// Deviation, in the parameter's unit.
    pub value: f64,
    /// Standard deviation (jackknife over time blocks).
    pub std: f64,
}

/// Whether parameters besides the deviations are the same in all logs (Chow 1960).
#[derive(Debug, Clone, PartialEq)]
pub struct SeparateFits {
    /// `F = [(ρ² - Σ ρ_l²)/(Σ p_l - p)] / [Σ ρ_l²/(N - Σ p_l)]`, divided by the inflation of variances.
    pub f: f64,
    /// Value that 99 % of logs alike stay below.
    pub limit: f64,
    /// Per log and output: RMS of the residual of the common fit and of the log's own; `None` without rows.
    pub rms: Vec<Vec<Option<(f64, f64)>>>,
}

/// A fit with parameters of single logs.
#[derive(Debug, Clone)]
pub struct LogDeviations {
    /// Deviations that the logs show, log after log in the order asked for; the others of the columns asked for act in no row, or only together
    /// with others.
    pub deviations: Vec<Deviation>,
    /// Common parameters, and which of their columns the logs excite.
    common: LinearSolution,
    /// Per log.
    logs: Vec<OneLog>,
    blocks: usize,
}

/// Rows of a log, without those of other logs.
#[derive(Debug, Clone)]
struct OneLog {
    /// Columns of this log alone that its rows tell from each other.
    own: Vec<OwnColumn>,
    /// Values of the parameters of these columns.
    values: Vec<f64>,
    groups: Vec<OneGroup>,
}

/// Rows of an output of a log.
#[derive(Debug, Clone)]
struct OneGroup {
    output: usize,
    /// All time blocks in the columns of the log: its own ones, then all `total` common ones.
    factor: Factor,
    variance: f64,
}

/// Fits all logs with parameters of single logs beside the common ones, every group of rows weighted by its own variance.
///
/// `groups`: factors of all logs in `total` columns, in time blocks that are long enough for their residuals; `own`:
/// what single logs may have of their own, of every parameter one log less than there are. `None` with fewer than
/// [`MIN_BLOCKS`] time blocks.
pub fn log_deviations(groups: &[ReducedGroup], total: usize, own: &[OwnColumn]) -> Option<LogDeviations> {
    let count = groups.iter().map(|g| g.log + 1).max()?;
    let of_logs: Vec<Vec<&ReducedGroup>> = by_log(groups, count, |g| g.log);
    let own_of_logs: Vec<Vec<OwnColumn>> =
        by_log(own, count, |o| o.log).into_iter().map(|list| list.into_iter().copied().collect()).collect();
    let mut logs: Vec<OneLog> =
        of_logs.par_iter().zip(own_of_logs).map(|(groups, own)| OneLog::new(groups, total, own)).collect();
    let common = weighted(&mut logs, total, &WlsSettings::default())?;
    let blocks: Vec<Vec<Factor>> =
        of_logs.par_iter().zip(&logs).map(|(groups, log)| log.time_blocks(groups, total)).collect();
    let number = blocks.iter().map(Vec::len).sum();
    if number < MIN_BLOCKS {
        return None;
    }
    let std = deviations_by_jackknife(&logs, &common, &blocks);
    let is_told = |column: usize| common.kept.binary_search(&column).is_ok();
    let deviations = logs.iter().zip(std).flat_map(|(log, std)| {
        let each = log.own.iter().zip(&log.values).zip(std);
        // What the other logs do not tell is nothing to deviate from.
        let each = each.filter(|((of, _), _)| is_told(of.column));
        each.map(|((of, value), std)| Deviation { of: *of, value: *value, std }).collect::<Vec<_>>()
    });
    Some(LogDeviations { deviations: deviations.collect(), common, logs, blocks: number })
}

fn by_log<T>(list: &[T], count: usize, log: impl Fn(&T) -> usize) -> Vec<Vec<&T>> {
    let mut out: Vec<Vec<&T>> = (0..count).map(|_| Vec::new()).collect();
    for item in list {
        if let Some(of_log) = out.get_mut(log(item)) {
            of_log.push(item);
        }
    }
    out
}

/// A factor of a group in the columns of its log: own ones, then all common ones.
fn widened(factor: &Factor, group: &ReducedGroup, total: usize, own: &[OwnColumn]) -> Factor {
    let (mut places, mut positions) = (Vec::new(), Vec::new());
    for (k, of) in own.iter().enumerate().filter(|(_, of)| of.output == group.output) {
        if let Some(place) = group.columns.iter().position(|c| *c == of.column) {
            places.push(place);
            positions.push(k);
        }
    }
    let factor = match places.is_empty() {
        true => factor.clone(),
        false => factor.select(&places.iter().copied().chain(0..group.columns.len()).collect::<Vec<_>>()),
    };
    positions.extend(group.columns.iter().map(|c| own.len() + c));
    factor.embed(own.len() + total, &positions)
}

/// What rows of a log say of the common columns once its own are free: the rows of the triangle below the first `own`.
fn freed(factor: &Factor, own: usize) -> Factor {
    let (total, height) = (factor.columns() - own, factor.height());
    let triangle = factor.triangle();
    let entry = |i: usize, j: usize| if own + i < height { triangle[(own + i, own + j)] } else { 0.0 };
    Factor::from_triangle(total, entry, factor.rho(), factor.rows())
}

/// Values of a log's own columns beside given common ones.
fn own_values(factor: &Factor, own: usize, common: &[f64]) -> Vec<f64> {
    let entry = |i: usize, j: usize| if i < factor.height() { factor.triangle()[(i, j)] } else { 0.0 };
    let effort = factor.columns();
    let rest = |i: usize| {
        entry(i, effort) - common.iter().enumerate().map(|(j, x)| entry(i, own + j) * x).sum::<f64>()
    };
    let r = Mat::from_fn(own, own, |i, j| if i <= j { entry(i, j) } else { 0.0 });
    let x = solve_upper(&r, &Mat::from_fn(own, 1, |i, _| rest(i)));
    (0..own).map(|i| x[(i, 0)]).collect()
}

fn merged(parts: &[Factor], columns: usize) -> Factor {
    match parts.is_empty() {
        true => Factor::empty(columns),
        false => Factor::merge(&parts.iter().collect::<Vec<_>>()),
    }
}

impl OneLog {
    fn new(groups: &[&ReducedGroup], total: usize, own: Vec<OwnColumn>) -> OneLog {
        let factors = |own: &[OwnColumn]| -> Vec<OneGroup> {
            groups
                .iter()
                .map(|group| OneGroup {
                    output: group.output,
                    factor: widened(&merged(&group.blocks, group.columns.len()), group, total, own),
                    variance: 1.0,
                })
                .collect()
        };
        let mut log = OneLog { groups: factors(&own), values: vec![0.0; own.len()], own };
        let alone = log.merged(total).select(&(0..log.own.len()).collect::<Vec<_>>());
        let told = if log.own.is_empty() { Vec::new() } else { numerical_rank(&alone).independent };
        if told.len() < log.own.len() {
            log.own = told.iter().map(|k| log.own[*k]).collect();
            log.groups = factors(&log.own);
            log.values = vec![0.0; log.own.len()];
        }
        log
    }

    /// All rows, weighted.
    fn merged(&self, total: usize) -> Factor {
        let parts: Vec<Factor> =
            self.groups.iter().map(|g| g.factor.scaled(1.0 / g.variance.sqrt())).collect();
        merged(&parts, self.own.len() + total)
    }

    /// Time blocks, weighted.
    fn time_blocks(&self, groups: &[&ReducedGroup], total: usize) -> Vec<Factor> {
        let count = groups.iter().map(|g| g.blocks.len()).max().unwrap_or(0);
        let block = |b: usize| {
            let parts: Vec<Factor> = groups
                .iter()
                .zip(&self.groups)
                .filter_map(|(group, of)| {
                    let block = group.blocks.get(b).filter(|f| f.rows() > 0)?;
                    Some(widened(block, group, total, &self.own).scaled(1.0 / of.variance.sqrt()))
                })
                .collect();
            (!parts.is_empty()).then(|| merged(&parts, self.own.len() + total))
        };
        (0..count).filter_map(block).collect()
    }

    /// Parameters in the columns of the log.
    fn x(&self, common: &[f64]) -> Vec<f64> {
        self.values.iter().chain(common).copied().collect()
    }
}

/// Weighted least squares with a variance per group, as [`crate::linear::wls`]; leaves variances and own values in the logs. `None` without rows.
fn weighted(logs: &mut [OneLog], total: usize, settings: &WlsSettings) -> Option<LinearSolution> {
    let least = floors(
        &logs.iter().flat_map(|l| l.groups.iter().map(|g| &g.factor)).collect::<Vec<_>>(),
        settings.floor,
    );
    let solve = |logs: &mut [OneLog]| -> Option<LinearSolution> {
        let systems: Vec<Factor> = logs.par_iter().map(|log| log.merged(total)).collect();
        let rest: Vec<Factor> =
            systems.par_iter().zip(&*logs).map(|(f, log)| freed(f, log.own.len())).collect();
        let common = (!rest.is_empty()).then(|| ols(&merged(&rest, total)))?;
        for (log, system) in logs.iter_mut().zip(&systems) {
            log.values = own_values(system, log.own.len(), &common.x);
        }
        Some(common)
    };
    for _ in 0..settings.max_passes {
        let common = solve(logs)?;
        let reduced = common.factor.r_matrix();
        let found: Vec<Vec<f64>> =
            logs.par_iter().map(|log| log.variances(&common, &reduced, total)).collect();
        let mut change = 0.0_f64;
        let mut least = least.iter();
        for (log, found) in logs.iter_mut().zip(found) {
            for (group, found) in log.groups.iter_mut().zip(found) {
                let variance = found.max(least.next().copied().unwrap_or(0.0));
                change = change.max((variance - group.variance).abs() / variance);
                group.variance = variance;
            }
        }
        if change <= settings.tolerance {
            break;
        }
    }
    solve(logs)
}

impl OneLog {
    /// `rss/(N - ℓ)` per group with the exact leverage `ℓ`; a group without half a degree of freedom keeps its variance.
    fn variances(&self, common: &LinearSolution, reduced: &Mat, total: usize) -> Vec<f64> {
        let k = self.own.len();
        let columns: Vec<usize> = (0..k).chain(common.kept.iter().map(|c| k + c)).collect();
        let own = self.merged(total).select(&columns);
        // Beside all other logs the common columns are known as well as the reduced factor says.
        let joint = Mat::from_fn(columns.len(), columns.len(), |i, j| match i < k {
            true => own.r(i, j),
            false if j >= k => reduced[(i - k, j - k)],
            false => 0.0,
        });
        let inverse = inverse(&joint);
        let x = self.x(&common.x);
        self.groups
            .iter()
            .map(|group| {
                let product = group.factor.select(&columns).r_matrix() * &inverse;
                let freedom = group.factor.rows() as f64 - product.norm_l2().powi(2) / group.variance;
                if freedom >= 0.5 { group.factor.rss(&x) / freedom } else { group.variance }
            })
            .collect()
    }
}

/// Standard deviations of the own values of every log: jackknife over all time blocks, with fixed weights.
///
/// Leaving out a block of one log changes its own values and the common ones, and by these those of all other logs: `d = -R_oo⁻¹ R_oc d_common`,
/// whose sum of squares over the blocks of the others needs their covariance alone.
fn deviations_by_jackknife(
    logs: &[OneLog],
    common: &LinearSolution,
    blocks: &[Vec<Factor>],
) -> Vec<Vec<f64>> {
    let total = common.x.len();
    let kept = &common.kept;
    // Centred at the solution, the solution without a block is the change itself, free of cancellation.
    let centred: Vec<Vec<Factor>> = logs
        .par_iter()
        .zip(blocks)
        .map(|(log, blocks)| blocks.iter().map(|b| b.centred(&log.x(&common.x))).collect())
        .collect();
    let systems: Vec<Factor> =
        logs.iter().zip(&centred).map(|(log, blocks)| merged(blocks, log.own.len() + total)).collect();
    let rest: Vec<Factor> =
        systems.iter().zip(logs).map(|(f, log)| freed(f, log.own.len()).select(kept)).collect();
    let norms = merged(&rest, kept.len()).column_norms();
    let before = running_merges(None, rest.iter());
    let mut after = running_merges(None, rest.iter().rev());
    after.reverse();
    let all = |of_kept: &[f64]| {
        let mut out = vec![0.0; total];
        kept.iter().zip(of_kept).for_each(|(c, x)| out[*c] = *x);
        out
    };
    // Per log: changes of the common parameters, and sums of squares of those of its own, over its own blocks.
    let of_logs: Vec<(Vec<Vec<f64>>, Vec<f64>)> = (0..logs.len())
        .into_par_iter()
        .map(|l| {
            let (k, blocks) = (logs[l].own.len(), &centred[l]);
            let first = running_merges(None, blocks.iter());
            let mut last = running_merges(None, blocks.iter().rev());
            last.reverse();
            let (mut changes, mut squares) = (Vec::new(), vec![0.0; k]);
            for (first, last) in first.iter().zip(&last) {
                let without = held(&Factor::merge(&[first, last]), &systems[l], k);
                let own_rest = freed(&without, k).select(kept);
                let (change, _) = change_without(&Factor::merge(&[&before[l], &own_rest, &after[l]]), &norms);
                let own = own_values(&without, k, &all(&change));
                squares.iter_mut().zip(own).for_each(|(sum, d)| *sum += d * d);
                changes.push(change);
            }
            (changes, squares)
        })
        .collect();
    let n = kept.len();
    let spread = |changes: &[Vec<f64>]| {
        let d = Mat::from_fn(n, changes.len(), |i, b| changes[b][i]);
        &d * d.transpose()
    };
    let spreads: Vec<Mat> = of_logs.par_iter().map(|(changes, _)| spread(changes)).collect();
    let mut sum: Mat = Mat::zeros(n, n);
    spreads.iter().for_each(|s| sum += s);
    let number = blocks.iter().map(Vec::len).sum::<usize>() as f64;
    let correction = (number - 1.0) / number;
    (0..logs.len())
        .into_par_iter()
        .map(|l| {
            let k = logs[l].own.len();
            let entry = |i: usize, j: usize| {
                if i < systems[l].height() { systems[l].triangle()[(i, j)] } else { 0.0 }
            };
            let r = Mat::from_fn(k, k, |i, j| if i <= j { entry(i, j) } else { 0.0 });
            let g = solve_upper(&r, &Mat::from_fn(k, n, |i, j| entry(i, k + kept[j])));
            let others = &sum - &spreads[l];
            let by_others = &g * &others * g.transpose();
            let squares = of_logs[l].1.iter().enumerate();
            squares.map(|(i, own)| (correction * (own + by_others[(i, i)].max(0.0))).sqrt()).collect()
        })
        .collect()
}

/// Share of a column's norm by which own columns are held where rows without a block do not tell them, as the jackknife of one system does.
const HELD: f64 = 1e-4;

/// Rows of a log without a block; own columns that only this block tells are held near where they are.
fn held(without: &Factor, whole: &Factor, own: usize) -> Factor {
    let leading: Vec<usize> = (0..own).collect();
    if own == 0 || numerical_rank(&without.select(&leading)).independent.len() == own {
        return without.clone();
    }
    let norms = whole.column_norms();
    let weight = |c: usize| if c < own { HELD * norms[c] } else { 0.0 };
    let weights: Vec<f64> = (0..without.columns()).map(weight).collect();
    without.with_prior_rows(&weights, &vec![0.0; weights.len()])
}

impl LogDeviations {
    /// Size in standard deviations that chance exceeds in one of a hundred sets of logs for any of `count` deviations.
    pub fn limit(&self, count: usize) -> f64 {
        let freedom = self.blocks as f64 - 1.0;
        t_quantile(1.0 - 0.005 / count.max(1) as f64, freedom).unwrap_or(f64::INFINITY)
    }

    fn of(&self, log: usize, output: usize) -> impl Iterator<Item = (&OneLog, &OneGroup)> {
        let log = self.logs.get(log);
        log.into_iter()
            .flat_map(|log| log.groups.iter().map(move |g| (log, g)))
            .filter(move |(_, g)| g.output == output)
    }

    /// RMS over the rows of a log and output of what deviations in some columns add to the effort.
    pub fn effect(&self, log: usize, output: usize, columns: &[usize]) -> f64 {
        let (mut sum, mut rows) = (0.0, 0);
        for (log, group) in self.of(log, output) {
            let added =
                log.own.iter().zip(&log.values).map(|(own, x)| {
                    if own.output == output && columns.contains(&own.column) { *x } else { 0.0 }
                });
            let x: Vec<f64> = added.collect();
            let factor = &group.factor;
            for i in 0..factor.height().min(x.len()) {
                sum += x.iter().enumerate().map(|(j, x)| factor.r(i, j) * x).sum::<f64>().powi(2);
            }
            rows += factor.rows();
        }
        if rows > 0 { (sum / rows as f64).sqrt() } else { 0.0 }
    }

    /// RMS of the residual of a log and output; `None` without rows.
    pub fn residual(&self, log: usize, output: usize) -> Option<f64> {
        let x = self.logs.get(log)?.x(&self.common.x);
        self.rms(log, output, &x)
    }

    fn rms(&self, log: usize, output: usize, x: &[f64]) -> Option<f64> {
        let (mut sum, mut rows) = (0.0, 0);
        for (_, group) in self.of(log, output) {
            sum += group.factor.rss(x);
            rows += group.factor.rows();
        }
        (rows > 0).then(|| (sum / rows as f64).sqrt())
    }

    /// Compares with fits of every log alone, at the same weights. `inflation`: of variances by coloured residuals, at
    /// least 1. `None` if nothing is left to be told apart.
    pub fn separate(&self, inflation: f64) -> Option<SeparateFits> {
        let total = self.common.x.len();
        let outputs = self.logs.iter().flat_map(|l| &l.groups).map(|g| g.output + 1).max()?;
        let alone: Vec<Option<LinearSolution>> = self
            .logs
            .par_iter()
            .map(|log| (!log.groups.is_empty()).then(|| ols(&log.merged(total))))
            .collect();
        let (mut together, mut rss, mut kept, mut rows) = (0.0, 0.0, 0, 0);
        let mut rms = Vec::with_capacity(self.logs.len());
        for (number, (log, alone)) in self.logs.iter().zip(&alone).enumerate() {
            let Some(alone) = alone else {
                rms.push(vec![None; outputs]);
                continue;
            };
            let x = log.x(&self.common.x);
            together += log.groups.iter().map(|g| g.factor.rss(&x) / g.variance).sum::<f64>();
            rows += log.groups.iter().map(|g| g.factor.rows()).sum::<usize>();
            rss += alone.rss;
            kept += alone.kept.len();
            let pair = |output| Some((self.rms(number, output, &x)?, self.rms(number, output, &alone.x)?));
            rms.push((0..outputs).map(pair).collect());
        }
        let in_common = self.common.kept.len() + self.logs.iter().map(|l| l.own.len()).sum::<usize>();
        let more = kept.checked_sub(in_common).filter(|n| *n > 0)? as f64;
        let freedom = rows.checked_sub(kept).filter(|n| *n > 0)? as f64;
        let f = (together - rss) / more / (rss / freedom) / inflation.max(1.0);
        let limit = f_quantile(0.99, more, (freedom / inflation.max(1.0)).max(1.0))?;
        f.is_finite().then_some(SeparateFits { f, limit, rms })
    }
}
