//! A program's own linear estimator, with everything that stands behind the others.

use std::sync::Arc;

use crate::covariance::{Jackknife, jackknife_of};
use dynid_factor::factor::Factor;
use dynid_factor::groups::ReducedGroup;

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

    /// What it makes of groups; `columns`: parameters.
    pub(super) fn fit(&self, groups: &[ReducedGroup], columns: usize) -> Option<OwnFit> {
        (self.fit)(groups, columns)
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

/// The estimator solved again without each time block; a block without which it has no fit counts as no change.
pub(super) fn jackknife(
    own: &OwnEstimator,
    groups: &[ReducedGroup],
    kept: &[usize],
    x: &[f64],
) -> Option<Jackknife> {
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
        let x = own.fit(&rest, x.len())?.x;
        let of_kept: Vec<f64> = kept.iter().map(|c| x.get(*c).copied()).collect::<Option<_>>()?;
        of_kept.iter().all(|v| v.is_finite()).then_some(of_kept)
    };
    let at: Vec<f64> = kept.iter().map(|c| x[*c]).collect();
    jackknife_of(&places, &at, without)
}
