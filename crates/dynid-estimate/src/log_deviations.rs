//! Whether several logs have the same parameters, from their factors alone.
//!
//! A column that counts once more in one log has as its parameter what that log has more than the others. Such columns are
//! copies of columns of the log's factors, so that no sample is touched again.

use crate::covariance::MIN_BLOCKS;
use crate::distribution::{f_quantile, t_quantile};
use crate::factor::Factor;
use crate::groups::ReducedGroup;
use crate::linear::{LinearEstimate, LinearMethod, LinearSettings, estimate, ols};

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
    /// Which parameter.
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
    /// The fit: all columns, then those of single logs.
    pub estimate: LinearEstimate,
    /// Deviations that the logs show; the others of the columns asked for act in no row, or only together with others.
    pub deviations: Vec<Deviation>,
    own: Vec<OwnColumn>,
    total: usize,
}

/// Fits all logs with parameters of single logs beside the common ones.
///
/// `groups`: factors of all logs in `total` columns, in time blocks that are long enough for their residuals; `own`:
/// what single logs may have of their own, of every parameter one log less than there are. `None` with fewer than
/// [`MIN_BLOCKS`] time blocks.
pub fn log_deviations(groups: &[ReducedGroup], total: usize, own: &[OwnColumn]) -> Option<LogDeviations> {
    let wider: Vec<ReducedGroup> = groups.iter().map(|group| widened(group, total, own)).collect();
    let settings = LinearSettings::default();
    let found = estimate(&wider, None, total + own.len(), &LinearMethod::Wls, &settings).ok()?;
    if found.blocks.len() < MIN_BLOCKS {
        return None;
    }
    let covariance = found.jackknife()?.covariance;
    let place = |column: usize| found.solution.kept.iter().position(|c| *c == column);
    let deviations = own
        .iter()
        .enumerate()
        .filter_map(|(k, of)| {
            let at = place(total + k)?;
            Some(Deviation { of: *of, value: found.x[total + k], std: covariance[(at, at)].max(0.0).sqrt() })
        })
        .collect();
    Some(LogDeviations { estimate: found, deviations, own: own.to_vec(), total })
}

/// A group with copies of the columns that its log has of its own.
fn widened(group: &ReducedGroup, total: usize, own: &[OwnColumn]) -> ReducedGroup {
    let mut columns = group.columns.clone();
    let mut places: Vec<usize> = (0..columns.len()).collect();
    for (k, of) in own.iter().enumerate().filter(|(_, of)| (of.log, of.output) == (group.log, group.output)) {
        if let Some(place) = group.columns.iter().position(|c| *c == of.column) {
            columns.push(total + k);
            places.push(place);
        }
    }
    let blocks = match columns.len() == group.columns.len() {
        true => group.blocks.clone(),
        false => group.blocks.iter().map(|b| b.select(&places)).collect(),
    };
    ReducedGroup { columns, blocks, ..*group }
}

impl LogDeviations {
    /// Size in standard deviations that chance exceeds in one of a hundred sets of logs for any of `count` deviations.
    pub fn limit(&self, count: usize) -> f64 {
        let freedom = self.estimate.blocks.len() as f64 - 1.0;
        t_quantile(1.0 - 0.005 / count.max(1) as f64, freedom).unwrap_or(f64::INFINITY)
    }

    /// RMS over the rows of a log and output of what deviations in some columns add to the effort.
    pub fn effect(&self, log: usize, output: usize, columns: &[usize]) -> f64 {
        let (mut sum, mut rows) = (0.0, 0);
        for group in self.estimate.reduced.iter().filter(|g| (g.log, g.output) == (log, output)) {
            let counts = |c: &usize| *c >= self.total && columns.contains(&self.own[*c - self.total].column);
            let places: Vec<usize> =
                (0..group.columns.len()).filter(|k| counts(&group.columns[*k])).collect();
            let x: Vec<f64> = places.iter().map(|k| self.estimate.x[group.columns[*k]]).collect();
            for block in &group.blocks {
                let r = block.select(&places).r_matrix();
                for i in 0..r.nrows() {
                    sum += x.iter().enumerate().map(|(j, x)| r[(i, j)] * x).sum::<f64>().powi(2);
                }
            }
            rows += group.rows();
        }
        if rows > 0 { (sum / rows as f64).sqrt() } else { 0.0 }
    }

    /// RMS of the residual of a log and output; `None` without rows.
    pub fn residual(&self, log: usize, output: usize) -> Option<f64> {
        self.rms(log, output, &self.estimate.x)
    }

    fn rms(&self, log: usize, output: usize, x: &[f64]) -> Option<f64> {
        let (mut sum, mut rows) = (0.0, 0);
        for group in self.estimate.reduced.iter().filter(|g| (g.log, g.output) == (log, output)) {
            sum += group.merged(x.len()).rss(x);
            rows += group.rows();
        }
        (rows > 0).then(|| (sum / rows as f64).sqrt())
    }

    /// Compares with fits of every log alone, at the same weights. `inflation`: of variances by coloured residuals, at
    /// least 1. `None` if nothing is left to be told apart.
    pub fn separate(&self, inflation: f64) -> Option<SeparateFits> {
        let all = &self.estimate;
        let logs = all.reduced.iter().map(|g| g.log + 1).max()?;
        let outputs = all.reduced.iter().map(|g| g.output + 1).max()?;
        let weights = all.weights();
        let (mut rss, mut kept) = (0.0, 0);
        let mut rms = Vec::with_capacity(logs);
        for log in 0..logs {
            let own = all.reduced.iter().zip(&weights).filter(|(g, _)| g.log == log);
            let parts: Vec<Factor> = own.map(|(g, w)| g.merged(all.x.len()).scaled(*w)).collect();
            if parts.is_empty() {
                rms.push(vec![None; outputs]);
                continue;
            }
            let alone = ols(&Factor::merge(&parts.iter().collect::<Vec<_>>()));
            rss += alone.rss;
            kept += alone.kept.len();
            let pair = |output| Some((self.residual(log, output)?, self.rms(log, output, &alone.x)?));
            rms.push((0..outputs).map(pair).collect());
        }
        let more = kept.checked_sub(all.solution.kept.len()).filter(|n| *n > 0)? as f64;
        let freedom = all.factor.rows().checked_sub(kept).filter(|n| *n > 0)? as f64;
        let f = (all.factor.rss(&all.x) - rss) / more / (rss / freedom) / inflation.max(1.0);
        let limit = f_quantile(0.99, more, (freedom / inflation.max(1.0)).max(1.0))?;
        f.is_finite().then_some(SeparateFits { f, limit, rms })
    }
}
