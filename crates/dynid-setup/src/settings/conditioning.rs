//! Conditioning of a run.

use dynid_motion::savitzky_golay::SavitzkyGolay;
use dynid_rows::conditioning::{ConditioningSettings, Smoothing, TextbookRoute};
use serde::{Deserialize, Serialize};

use super::{LogSettings, Method, Settings};
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

/// How the textbook route brings positions to velocities and accelerations, or smooths efforts.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SmoothingKind {
    /// Zero-phase Butterworth at `kernel_hz`, central differences (Gautier 1997).
    Butterworth,
    /// Least-squares cubics over five samples, `passes` times, central differences.
    FivePoint,
    /// Least-squares polynomials of degree `order` over `window` samples and their derivatives (Savitzky & Golay 1964).
    SavitzkyGolay,
    /// Fourier series of whole periods up to `harmonics` or `kernel_hz` and its derivatives (Swevers et al. 1997).
    Frequency,
}

/// Passes of five-point smoothing unless stated: those of the study of the ER-16 at 100 Hz.
const PASSES: usize = 3;
/// Degree of Savitzky-Golay polynomials unless stated.
const DEGREE: usize = 3;
/// Most samples of a window and passes: beyond, nothing of a motion is left at any sample rate.
const MOST_SAMPLES: usize = 100_001;

/// Share of samples that a mask must leave for instruments: few rows of sure signs are better than many of doubtful ones.
const LEAST_USABLE_BY_INSTRUMENTS: f64 = 0.05;

/// Settings of the conditioning; those left out are found from the data.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ConditioningConfig {
    /// Route. Default `compact`.
    pub route: Route,
    /// Cut-off of the widest kernel, Hz; on the textbook route the cut-off of the Butterworth or of the Fourier series (default 10).
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
    /// Textbook route: how positions become velocities and accelerations; efforts are smoothed alike. Default `butterworth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smoothing: Option<SmoothingKind>,
    /// Textbook route: smoothing of the effort where it is another one. Default: that of positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effort_smoothing: Option<SmoothingKind>,
    /// Five-point smoothing: how often. Default 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub passes: Option<usize>,
    /// Savitzky-Golay: samples of the window, odd. No default: it follows from sample rate and motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<usize>,
    /// Savitzky-Golay: degree of the polynomials, 2 or more, below `window`. Default 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<usize>,
    /// Frequency: last harmonic of the period, in place of the cut-off `kernel_hz`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub harmonics: Option<usize>,
    /// Textbook route: average logs with a period over their whole periods, of which they need two or more, before everything else.
    /// Default false.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub average_periods: Option<bool>,
    /// Textbook route: keep every n-th row.
    pub decimation: Option<usize>,
    /// Textbook route: filter columns and effort before rows are dropped (MATLAB's `decimate`). Default false.
    pub parallel_filter: Option<bool>,
    /// Textbook route: smooth the effort like the positions. Default true.
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
        c.check_smoothing()
    }

    fn check_smoothing(&self) -> Result<(), Error> {
        let c = self;
        if let Some(passes) = c.passes
            && !(1..=MOST_SAMPLES).contains(&passes)
        {
            return Err(Error::setting("passes", "1 or more, not beyond 100001", passes));
        }
        if let Some(window) = c.window
            && (window.is_multiple_of(2) || !(3..=MOST_SAMPLES).contains(&window))
        {
            return Err(Error::setting("window", "an odd number of samples, 3 to 100001", window));
        }
        if let Some(order) = c.order
            && order < 2
        {
            return Err(Error::setting("order", "2 or more: accelerations of lower degrees are zero", order));
        }
        if let Some(window) = c.window
            && c.order.unwrap_or(DEGREE) >= window
        {
            let expected = format!("less than `window`, {window} samples");
            let found = match c.order {
                Some(order) => order.to_string(),
                None => format!("{DEGREE}, the default"),
            };
            return Err(Error::setting("order", &expected, found));
        }
        if c.harmonics == Some(0) {
            return Err(Error::setting("harmonics", "1 or more", 0));
        }
        Ok(())
    }

    /// Whether positions or efforts are smoothed so.
    pub(super) fn smooths(&self, kind: SmoothingKind) -> bool {
        let of_positions = self.smoothing.unwrap_or(SmoothingKind::Butterworth);
        [of_positions, self.effort_smoothing.unwrap_or(of_positions)].contains(&kind)
    }

    /// A smoothing with its settings; a window that is missing or makes no sense is refused before ([`ConditioningConfig::check`] and
    /// what follows), so that the Butterworth stands for it.
    fn smoothing_of(&self, kind: SmoothingKind) -> Smoothing {
        match kind {
            SmoothingKind::Butterworth => Smoothing::Butterworth,
            SmoothingKind::FivePoint => Smoothing::FivePoint { passes: self.passes.unwrap_or(PASSES) },
            SmoothingKind::SavitzkyGolay => {
                let order = self.order.unwrap_or(DEGREE);
                let filter = self.window.and_then(|window| SavitzkyGolay::new(window, order).ok());
                filter.map_or(Smoothing::Butterworth, Smoothing::SavitzkyGolay)
            }
            SmoothingKind::Frequency => Smoothing::Frequency { harmonics: self.harmonics },
        }
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

    /// Refuses training logs without the period that smoothing by Fourier series and averages over periods need. `files`: of the logs.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check_periods(&self, training: &[&LogSettings], files: &[&str]) -> Result<(), Error> {
        let c = &self.conditioning;
        let needed = [
            (c.average_periods == Some(true), "`average_periods = true`"),
            (c.smooths(SmoothingKind::Frequency), "`\"frequency\"`"),
        ];
        let Some((_, why)) = needed.iter().find(|(needed, _)| *needed) else { return Ok(()) };
        match training.iter().zip(files).find(|(log, _)| log.period_s.is_none()) {
            Some((_, file)) => {
                let expected = format!("it or `trajectory` in every `[[log]]` beside {why}");
                Err(Error::setting("log.period_s", &expected, format!("none in that of {file}")))
            }
            None => Ok(()),
        }
    }

    /// Settings of the compact route, and of states and predictions on either.
    pub fn conditioning_settings(&self) -> ConditioningSettings {
        let c = &self.conditioning;
        let defaults = ConditioningSettings::default();
        let instruments = matches!(self.estimator.method, Method::Iv | Method::Didim);
        ConditioningSettings {
            kernel_hz: c.kernel_hz,
            state_hz: c.state_hz,
            delay_samples: c.delay_samples,
            reversal_mask: c.reversal_mask.or(instruments.then_some(0.0)),
            least_usable: if instruments { LEAST_USABLE_BY_INSTRUMENTS } else { defaults.least_usable },
            remove_spikes: c.remove_spikes.unwrap_or(defaults.remove_spikes),
            block_s: c.block_s.unwrap_or(defaults.block_s),
            smoothing: c.smoothing.map_or(defaults.smoothing, |kind| c.smoothing_of(kind)),
            average_periods: c.average_periods.unwrap_or(defaults.average_periods),
            ..defaults
        }
    }

    /// Settings of the textbook route.
    pub fn textbook_route(&self) -> TextbookRoute {
        let c = &self.conditioning;
        let defaults = TextbookRoute::default();
        TextbookRoute {
            smoothing: c.smoothing.map_or(defaults.smoothing, |kind| c.smoothing_of(kind)),
            effort_smoothing: c.effort_smoothing.map(|kind| c.smoothing_of(kind)),
            cutoff_hz: c.kernel_hz.unwrap_or(defaults.cutoff_hz),
            decimation: c.decimation,
            parallel_filter: c.parallel_filter.unwrap_or(defaults.parallel_filter),
            filter_effort: c.filter_effort.unwrap_or(defaults.filter_effort),
            trim_s: c.trim_s.unwrap_or(defaults.trim_s),
            ..defaults
        }
    }
}
