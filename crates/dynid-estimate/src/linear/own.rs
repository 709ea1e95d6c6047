//! A program's own linear estimator, with everything that stands behind the others.

use std::sync::Arc;

use super::linear_estimate::{GroupFit, LinearEstimate};
use super::method::{LinearError, LinearMethod};
use crate::covariance::{Jackknife, jackknife_of};
use crate::least_squares::{WlsEstimate, ols};
use dynid_factor::factor::Factor;
use dynid_factor::groups::{ReducedGroup, time_blocks};

/// What an own estimator makes of rows.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnFit {
    /// All `p` parameters, finite.
    pub x: Vec<f64>,
    /// Residual variance of every group, effort², positive: what it takes the noise for.
    pub variances: Vec<f64>,
}

type Fit = dyn Fn(&[ReducedGroup], usize) -> Option<OwnFit> + Send + Sync;

/// A linear estimator of a program's own: from the factors of all groups and the number of columns to an [`OwnFit`], `None` where there is
/// none.
///
/// It is asked again without each time block, so its covariance is a jackknife of the estimator itself. What bodies can exist is decided by
/// the information of its variances about its values. On held-out folds, and where parameters are left out one by one, least squares with its
/// variances stands for it.
#[derive(Clone)]
pub struct OwnEstimator {
    name: String,
    fit: Arc<Fit>,
}

impl OwnEstimator {
    /// An estimator under a name.
    pub fn new(
        name: &str,
        fit: impl Fn(&[ReducedGroup], usize) -> Option<OwnFit> + Send + Sync + 'static,
    ) -> Self {
        OwnEstimator { name: name.to_owned(), fit: Arc::new(fit) }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl std::fmt::Debug for OwnEstimator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("OwnEstimator").field(&self.name).finish()
    }
}

/// The same function under the same name.
impl PartialEq for OwnEstimator {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && Arc::ptr_eq(&self.fit, &other.fit)
    }
}

/// The estimate of all groups; `start`: weighted least squares, for the leverages.
pub(super) fn estimate(
    own: &OwnEstimator,
    groups: &[ReducedGroup],
    total: usize,
    start: WlsEstimate,
) -> Result<LinearEstimate, LinearError> {
    let OwnFit { mut x, variances } =
        (own.fit)(groups, total).ok_or_else(|| LinearError::NoOwnFit { name: own.name.clone() })?;
    check("parameters of an own estimator", &x, total, "finite numbers", f64::is_finite)?;
    let positive = |v: f64| v.is_finite() && v > 0.0;
    check("variances of an own estimator", &variances, groups.len(), "positive numbers", positive)?;
    let weights: Vec<f64> = variances.iter().map(|v| 1.0 / v.sqrt()).collect();
    let blocks = time_blocks(groups, &weights, total);
    let weighted = match blocks.is_empty() {
        true => Factor::empty(total),
        false => Factor::merge(&blocks.iter().collect::<Vec<_>>()),
    };
    let rank = ols(&weighted);
    rank.dropped.iter().for_each(|c| x[*c] = 0.0);
    let factor = weighted.around(&x);
    let mut solution = ols(&factor);
    solution.x.clone_from(&x);
    let fits = groups.iter().zip(&start.groups).zip(variances.iter().zip(&weights));
    let fits = fits.map(|((group, of_start), (variance, weight))| GroupFit {
        log: group.log,
        output: group.output,
        scale: group.scale,
        variance: *variance,
        weight: *weight,
        leverage: of_start.leverage,
        rss: group.merged(total).rss(&x),
        rows: of_start.rows,
        at_floor: false,
        down_weighted: 0.0,
        rejected: 0.0,
        curvature: 1.0,
    });
    Ok(LinearEstimate {
        method: LinearMethod::Own(own.clone()),
        groups: fits.collect(),
        x,
        solution,
        reduced: groups.to_vec(),
        factor,
        blocks,
        passes: 1,
        converged: true,
        losses: Vec::new(),
        prior: None,
        loss: None,
        given_blocks: Vec::new(),
        paired: Vec::new(),
    })
}

fn check(
    name: &'static str,
    values: &[f64],
    count: usize,
    expected: &'static str,
    fits: impl Fn(f64) -> bool,
) -> Result<(), LinearError> {
    if values.len() != count {
        return Err(LinearError::Length { name, expected: count, found: values.len() });
    }
    match values.iter().find(|v| !fits(**v)) {
        Some(&found) => Err(LinearError::Setting { name, expected, found }),
        None => Ok(()),
    }
}

/// The estimator solved again without each time block; a block without which it has no fit counts as no change.
pub(super) fn jackknife(own: &OwnEstimator, estimate: &LinearEstimate) -> Option<Jackknife> {
    let groups = &estimate.reduced;
    let logs = groups.iter().map(|g| g.log + 1).max().unwrap_or(0);
    let has_rows = |log: usize, b: usize| {
        groups.iter().any(|g| g.log == log && g.blocks.get(b).is_some_and(|f| f.rows() > 0))
    };
    let blocks_of = |log: usize| {
        let of_log = groups.iter().filter(move |g| g.log == log);
        0..of_log.map(|g| g.blocks.len()).max().unwrap_or(0)
    };
    let places: Vec<(usize, usize)> = (0..logs)
        .flat_map(|log| blocks_of(log).map(move |b| (log, b)))
        .filter(|(log, b)| has_rows(*log, *b))
        .collect();
    let without = |(log, b): (usize, usize)| -> Option<Vec<f64>> {
        let rest: Vec<ReducedGroup> = groups
            .iter()
            .map(|group| {
                let mut group = group.clone();
                if let Some(block) = group.blocks.get_mut(b).filter(|_| group.log == log) {
                    *block = Factor::empty(block.columns());
                }
                group
            })
            .collect();
        let x = (own.fit)(&rest, estimate.x.len())?.x;
        let kept: Vec<f64> =
            estimate.solution.kept.iter().map(|c| x.get(*c).copied()).collect::<Option<_>>()?;
        kept.iter().all(|v| v.is_finite()).then_some(kept)
    };
    jackknife_of(&places, &estimate.kept_x(), without)
}
