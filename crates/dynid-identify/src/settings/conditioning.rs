//! Conditioning of a run.

use dynid_rows::conditioning::{ConditioningSettings, TextbookRoute};
use serde::{Deserialize, Serialize};

use super::{Method, Settings};
use crate::Error;

/// Which way from samples to rows.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Route {
    /// States at a high cut-off, then one compact kernel over columns and effort; everything found from the data.
    #[default]
    Compact,
    /// Zero-phase Butterworth, central differences, decimation.
    Textbook,
}

/// Share of samples that a mask must leave for instruments: few rows of sure signs are better than many of doubtful ones.
const LEAST_USABLE_BY_INSTRUMENTS: f64 = 0.05;

/// Settings of the conditioning; those left out are found from the data.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ConditioningConfig {
    /// Route. Default `compact`.
    pub route: Route,
    /// Cut-off of the widest kernel, Hz; on the textbook route the cut-off of the filter (default 10).
    pub kernel_hz: Option<f64>,
    /// Cut-off of the state filter, Hz.
    pub state_hz: Option<f64>,
    /// Delay of the motion behind the logged effort, samples.
    pub delay_samples: Option<f64>,
    /// Reversal mask as a share of rms speed; negative: none. Default: found; 0 for instrumental variables, which noise in signs
    /// of velocities biases: speeds within four standard deviations of their noise are left out.
    pub reversal_mask: Option<f64>,
    /// Remove spikes. Default true.
    pub remove_spikes: Option<bool>,
    /// Length of the time blocks behind standard deviations, s. Default 1.
    pub block_s: Option<f64>,
    /// Textbook route: keep every n-th row.
    pub decimation: Option<usize>,
    /// Textbook route: filter columns and effort before rows are dropped (MATLAB's `decimate`). Default false.
    pub parallel_filter: Option<bool>,
    /// Textbook route: filter the effort like the positions. Default true.
    pub filter_effort: Option<bool>,
    /// Textbook route: cut from both ends, s. Default 0.2.
    pub trim_s: Option<f64>,
}

impl ConditioningConfig {
    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub(super) fn check(&self) -> Result<(), Error> {
        let c = self;
        for (name, value) in [("kernel_hz", c.kernel_hz), ("state_hz", c.state_hz), ("block_s", c.block_s)] {
            if let Some(x) = value
                && !(x.is_finite() && x > 0.0)
            {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        for (name, value) in [("delay_samples", c.delay_samples), ("reversal_mask", c.reversal_mask)] {
            if let Some(x) = value
                && !(x.is_finite() && x.abs() <= 1e4)
            {
                return Err(Error::setting(name, "a number of moderate size", x));
            }
        }
        if let Some(x) = c.trim_s
            && !(x.is_finite() && x >= 0.0)
        {
            return Err(Error::setting("trim_s", "a number that is not negative", x));
        }
        if c.decimation == Some(0) {
            return Err(Error::setting("decimation", "at least 1", 0));
        }
        Ok(())
    }
}

impl Settings {
    /// Checks the given cut-offs against the sample rate of a log.
    ///
    /// # Errors
    /// [`Error::Cutoff`].
    pub fn check_cutoffs(&self, file: &str, rate_hz: f64) -> Result<(), Error> {
        let c = &self.conditioning;
        for (name, value) in [("kernel_hz", c.kernel_hz), ("state_hz", c.state_hz)] {
            if let Some(found) = value
                && found >= 0.5 * rate_hz
            {
                return Err(Error::Cutoff { file: file.to_owned(), name: name.to_owned(), rate_hz, found });
            }
        }
        Ok(())
    }

    /// Settings of the compact route.
    pub fn conditioning_settings(&self) -> ConditioningSettings {
        let c = &self.conditioning;
        let defaults = ConditioningSettings::default();
        let instruments = self.estimator.method == Method::Iv;
        ConditioningSettings {
            kernel_hz: c.kernel_hz,
            state_hz: c.state_hz,
            delay_samples: c.delay_samples,
            reversal_mask: c.reversal_mask.or(instruments.then_some(0.0)),
            least_usable: if instruments { LEAST_USABLE_BY_INSTRUMENTS } else { defaults.least_usable },
            remove_spikes: c.remove_spikes.unwrap_or(defaults.remove_spikes),
            block_s: c.block_s.unwrap_or(defaults.block_s),
            ..defaults
        }
    }

    /// Settings of the textbook route.
    pub fn textbook_route(&self) -> TextbookRoute {
        let c = &self.conditioning;
        let defaults = TextbookRoute::default();
        TextbookRoute {
            cutoff_hz: c.kernel_hz.unwrap_or(defaults.cutoff_hz),
            decimation: c.decimation,
            parallel_filter: c.parallel_filter.unwrap_or(defaults.parallel_filter),
            filter_effort: c.filter_effort.unwrap_or(defaults.filter_effort),
            trim_s: c.trim_s.unwrap_or(defaults.trim_s),
            ..defaults
        }
    }
}
