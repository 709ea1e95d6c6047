//! Which linear estimator, and its settings.

use std::collections::HashMap;

use crate::least_squares::WlsSettings;
use crate::least_squares::{TlsNoise, TlsRefusal};
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::RowsError;

/// A linear estimator.
#[derive(Debug, Clone, PartialEq)]
pub enum LinearMethod {
    /// Ordinary least squares: all rows alike.
    Ols,
    /// Weighted least squares, one residual variance per group.
    Wls,
    /// Huber's loss, `ρ(u) = u²/2` for `|u| ≤ 1.345`, linear beyond: for some per cent of gross errors.
    Huber,
    /// Tukey's biweight with 4.685, begun at Huber's solution: gross errors lose all influence.
    Tukey,
    /// Weighted least squares with a Gaussian prior, `+ κ Σ ((x_i - x0_i)/scale_i)²`.
    Ridge {
        /// `x0`, one per column.
        prior: Vec<f64>,
        /// Prior standard deviation, one per column, positive.
        scale: Vec<f64>,
        /// `κ`, positive; 1 for a Gaussian prior.
        kappa: f64,
    },
    /// Total least squares; errors alike in all rows, none where a column does not act on a group.
    Tls(TlsNoise),
    /// Instrumental variables, weighted as [`LinearMethod::Wls`]: [`crate::instruments::instrumental`] makes such estimates from
    /// paired rows, [`super::estimate`] does not.
    Instrumental,
    /// Direct and inverse dynamic identification model, weighted as [`LinearMethod::Wls`]: measured efforts on the regressor of a simulated
    /// motion; [`crate::instruments::along_simulation`] makes such estimates, [`super::estimate`] does not.
    Didim,
    /// Closed-loop output error, weighted as [`LinearMethod::Wls`]: measured less simulated positions on their slopes;
    /// [`crate::instruments::along_simulation`] makes such estimates, [`super::estimate`] does not.
    Cloe,
    /// A program's own.
    Own(super::own::OwnEstimator),
}

impl LinearMethod {
    /// Whether single rows must be seen again: [`super::estimate`] then needs a [`dynid_factor::rows::RowSource`].
    pub fn needs_rows(&self) -> bool {
        matches!(self, LinearMethod::Huber | LinearMethod::Tukey)
    }
}

/// Which groups share one residual variance (one scale, for robust losses).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VarianceSharing {
    /// Each group has its own: joint, log and kernel scale.
    #[default]
    Group,
    /// One per joint and log.
    JointAndLog,
    /// One per joint over all logs.
    Joint,
}

impl VarianceSharing {
    /// Per group, the index of the first group it shares its variance with.
    pub(crate) fn classes(self, groups: &[ReducedGroup]) -> Vec<usize> {
        let key = |g: &ReducedGroup| match self {
            VarianceSharing::Group => (g.log, g.output, g.scale),
            VarianceSharing::JointAndLog => (g.log, g.output, 0),
            VarianceSharing::Joint => (0, g.output, 0),
        };
        let mut first = HashMap::new();
        groups.iter().enumerate().map(|(k, group)| *first.entry(key(group)).or_insert(k)).collect()
    }
}

/// Settings of [`super::estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSettings {
    /// Iteration of the variances. Default [`WlsSettings::default`].
    pub wls: WlsSettings,
    /// Which groups share a variance; ordinary and total least squares have one for all. Default: none.
    pub sharing: VarianceSharing,
    /// Robust losses.
    pub irls: IrlsSettings,
}

impl Default for LinearSettings {
    fn default() -> Self {
        Self { wls: WlsSettings::default(), sharing: VarianceSharing::Group, irls: IrlsSettings::default() }
    }
}

/// Settings of iteratively re-weighted least squares.
#[derive(Debug, Clone, PartialEq)]
pub struct IrlsSettings {
    /// Huber's threshold in units of the scale. Default 1.345: 95 % efficient on normal residuals.
    pub huber: f64,
    /// Tukey's threshold in units of the scale. Default 4.685: 95 % efficient on normal residuals.
    pub tukey: f64,
    /// Passes that renew the scales; frozen afterwards, because Tukey's weights may cycle otherwise. Default 5.
    pub scale_passes: usize,
    /// Stop when no parameter moves by more than this share of its standard deviation. Default 1e-3.
    pub tolerance: f64,
    /// Most passes of each loss. Default 50.
    pub max_passes: usize,
    /// Rows are kept in memory if they take at most this many bytes, else formed again on every pass. Default 256 MiB.
    pub memory: usize,
}

impl Default for IrlsSettings {
    fn default() -> Self {
        Self {
            huber: 1.345,
            tukey: 4.685,
            scale_passes: 5,
            tolerance: 1e-3,
            max_passes: 50,
            memory: 256 << 20,
        }
    }
}

/// Why [`super::estimate`] has no estimate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearError {
    /// No group was given.
    #[error("no rows to estimate from")]
    NoGroups,
    /// A robust loss looks at single rows, and there is no source of them.
    #[error("a robust loss needs the rows themselves, found factors only")]
    NeedsRows,
    /// Instrumental variables, DIDIM and CLOE need rows of a simulated motion.
    #[error("this estimator needs rows of a simulated motion, found measured rows only")]
    NeedsSimulation,
    /// The source of rows does not hold the groups given.
    #[error(
        "rows of other groups: expected the {expected} groups of the factors in their order, found {found}"
    )]
    OtherRows {
        /// Groups of factors.
        expected: usize,
        /// Groups of the source.
        found: usize,
    },
    /// A setting of the method has another number of entries than there are columns.
    #[error("{name}: expected {expected} entries, one per column, found {found}")]
    Length {
        /// Name of the setting.
        name: &'static str,
        /// Number of columns.
        expected: usize,
        /// Number of entries.
        found: usize,
    },
    /// A setting of the method is out of range.
    #[error("{name}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was given.
        found: f64,
    },
    /// An own estimator has no fit.
    #[error("the estimator `{name}` found no fit")]
    NoOwnFit {
        /// Its name.
        name: String,
    },
    /// Rows could not be used.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// Total least squares has no unique solution.
    #[error(transparent)]
    Tls(#[from] TlsRefusal),
}

impl LinearMethod {
    /// Checks the entries of a method for `columns` parameters.
    pub(super) fn check(&self, columns: usize) -> Result<(), LinearError> {
        let each = |name, values: &[f64], expected, fits: &dyn Fn(f64) -> bool| {
            if values.len() != columns {
                return Err(LinearError::Length { name, expected: columns, found: values.len() });
            }
            match values.iter().find(|v| !fits(**v)) {
                Some(&found) => Err(LinearError::Setting { name, expected, found }),
                None => Ok(()),
            }
        };
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let one = |name, value| {
            if positive(value) {
                Ok(())
            } else {
                Err(LinearError::Setting { name, expected: "a positive number", found: value })
            }
        };
        match self {
            LinearMethod::Ridge { prior, scale, kappa } => {
                each("prior", prior, "finite numbers", &f64::is_finite)?;
                each("scale", scale, "positive numbers", &positive)?;
                one("kappa", *kappa)
            }
            LinearMethod::Tls(noise) => {
                let usable = |v: f64| v >= 0.0 && v.is_finite();
                each("column noise", &noise.columns, "numbers not below zero", &usable)?;
                one("effort noise", noise.effort)
            }
            _ => Ok(()),
        }
    }
}
