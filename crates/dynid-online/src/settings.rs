//! Settings of an estimator.

use alloc::vec::Vec;

use crate::error::SettingsError;
use crate::forgetting::Forgetting;

/// Prior deviations in units of the scales stay between this and its reciprocal.
const WIDEST: f64 = 1e30;

/// Settings of an [`Estimator`](crate::Estimator): `p` parameters, up to `rows` rows per sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Value of each parameter before the first sample, in its unit.
    pub start: Vec<f64>,
    /// Prior standard deviation of each parameter, in its unit; finite and positive.
    pub prior_std: Vec<f64>,
    /// Scale of each parameter, in its unit: columns are multiplied by it, and openings and tolerances count
    /// in it. Default: the prior standard deviations.
    pub scale: Vec<f64>,
    /// Most rows per sample, such as the number of joints.
    pub rows: usize,
    /// How old samples lose their weight. Default: they do not.
    pub forgetting: Forgetting,
    /// Least information per parameter as a share of the prior's ([`crate::BoundedCovariance`]); 1 keeps
    /// variances from growing beyond the prior's. With constant, error-driven and noise-normalised
    /// forgetting. Default: none.
    pub bounded_covariance: Option<f64>,
    /// Freezes what is not excited ([`crate::ExcitationMonitor`]). Not with directional forgetting and
    /// windows. Default: none.
    pub monitor: Option<MonitorSettings>,
    /// Alarms on changes ([`crate::ChangeDetection`]). Default: with the defaults of [`DetectionSettings`].
    pub detection: Option<DetectionSettings>,
    /// What an alarm is answered with ([`crate::TargetedReaction`]); needs `detection`, not with windows.
    /// Default: with the defaults of [`ReactionSettings`].
    pub reaction: Option<ReactionSettings>,
}

/// Settings of the excitation monitor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorSettings {
    /// Length of a stretch, samples. Default 1000.
    pub samples: usize,
    /// A parameter is frozen if a stretch gains less than this share of its prior's information. Default 1.
    pub share: f64,
}

impl Default for MonitorSettings {
    fn default() -> Self {
        Self { samples: 1000, share: 1.0 }
    }
}

/// How often an alarm may be false.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FalseAlarms {
    /// Probability `rate` in (0, 1) of any in so many change-free `samples`.
    Rate {
        /// Probability.
        rate: f64,
        /// Samples.
        samples: f64,
    },
    /// Mean number of samples to one, above 1.
    RunLength(f64),
    /// The threshold `h` itself, positive.
    Threshold(f64),
}

/// What is known of the innovations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Whiteness {
    /// White, and their noise is as stated.
    White,
    /// So many samples count as one independent sample; their noise is as stated.
    Every(usize),
    /// Nothing: size and correlation time (up to a fifth of `samples`) are learned
    /// ([`crate::InnovationCorrelation`]); no alarm before the end of the first `samples`. Alarms are then
    /// rarer than asked for, up to ten times with coloured innovations.
    Learned {
        /// Samples to learn from at first, at least 50.
        samples: usize,
    },
}

/// Settings of change detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectionSettings {
    /// Ratio `κ > 1` of variances that is looked for. What raises the mean square of innovations by less than
    /// `κ ln κ/(κ - 1)` (1.22 at 1.5, 1.05 at 1.1) is never found; a smaller `κ` takes longer. Default 1.5.
    pub kappa: f64,
    /// Squares of single whitened innovations are clipped at this, so that one outlier is no alarm. Default
    /// 25.
    pub clip: f64,
    /// How often an alarm may be false. Default: 1 % in a million samples.
    pub false_alarms: FalseAlarms,
    /// What is known of the innovations. Default: nothing, learned from 500 samples.
    pub whiteness: Whiteness,
}

impl Default for DetectionSettings {
    fn default() -> Self {
        Self {
            kappa: 1.5,
            clip: 25.0,
            false_alarms: FalseAlarms::Rate { rate: 0.01, samples: 1e6 },
            whiteness: Whiteness::Learned { samples: 500 },
        }
    }
}

/// Settings of the targeted reaction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReactionSettings {
    /// Samples after the alarm that are judged on their own. Default 100.
    pub samples: usize,
    /// A parameter is named if its jump explains this share of the total gain. Default 0.6.
    pub share: f64,
    /// Standard deviation added to what changed, in scales. Default 0.3.
    pub opening: f64,
    /// Everything is opened if chance alone would give the total gain with less than this probability.
    /// Default 1e-6: real changes are far beyond, while opening everything by mistake costs all that is
    /// known, and stated noise is never quite right.
    pub level: f64,
    /// A named parameter is opened if chance alone would give its gain, or that of any other parameter, with
    /// less than this probability. Default 0.01: a mistake costs what is known of one parameter.
    pub named_level: f64,
}

impl Default for ReactionSettings {
    fn default() -> Self {
        Self { samples: 100, share: 0.6, opening: 0.3, level: 1e-6, named_level: 0.01 }
    }
}

impl Settings {
    /// Settings with all defaults.
    pub fn new(start: Vec<f64>, prior_std: Vec<f64>, rows: usize) -> Self {
        Self {
            scale: prior_std.clone(),
            start,
            prior_std,
            rows,
            forgetting: Forgetting::None,
            bounded_covariance: None,
            monitor: None,
            detection: Some(DetectionSettings::default()),
            reaction: Some(ReactionSettings::default()),
        }
    }

    /// Number `p` of parameters.
    pub fn columns(&self) -> usize {
        self.start.len()
    }

    /// Says what is wrong with the settings, if anything.
    ///
    /// # Errors
    /// [`SettingsError`]: lengths that differ, numbers out of range, combinations without meaning.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let p = self.columns();
        count("number of parameters", p, 1)?;
        count("rows per sample", self.rows, 1)?;
        for (what, list) in [("prior deviations", &self.prior_std), ("scales", &self.scale)] {
            length(what, p, list)?;
            each(what, "a finite positive number", list, |v| v > 0.0 && v.is_finite())?;
        }
        each("start", "a finite number", &self.start, f64::is_finite)?;
        for (j, (std, scale)) in self.prior_std.iter().zip(&self.scale).enumerate() {
            let ratio = std / scale;
            let fine = ratio < WIDEST && ratio > 1.0 / WIDEST && (self.start[j] / std).abs() < WIDEST;
            number("prior deviation in scales", j, "1e-30 to 1e30, with a start of like size", ratio, fine)?;
        }
        self.validate_forgetting()?;
        if let Some(share) = self.bounded_covariance {
            number(
                "least information",
                0,
                "a finite positive share",
                share,
                share > 0.0 && share.is_finite(),
            )?;
        }
        if let Some(monitor) = self.monitor {
            count("samples of the excitation monitor", monitor.samples, 1)?;
            let share = monitor.share;
            let fine = share > 0.0 && share.is_finite();
            number("share of the excitation monitor", 0, "a finite positive number", share, fine)?;
        }
        if let Some(detection) = &self.detection {
            detection.validate()?;
        }
        if let Some(reaction) = &self.reaction {
            reaction.validate()?;
        }
        self.validate_combinations()
    }

    fn validate_forgetting(&self) -> Result<(), SettingsError> {
        let factor = |v: f64| number("λ", 0, "a number in (0, 1]", v, v > 0.0 && v <= 1.0);
        let positive =
            |what, v: f64| number(what, 0, "a finite positive number", v, v > 0.0 && v.is_finite());
        let error_driven = |alpha: f64, beta: f64| {
            number("α", 0, "a number in [0, 1)", alpha, (0.0..1.0).contains(&alpha))?;
            number("β", 0, "a finite number that is not positive", beta, beta <= 0.0 && beta.is_finite())
        };
        match &self.forgetting {
            Forgetting::None => Ok(()),
            Forgetting::Constant { lambda } => factor(*lambda),
            Forgetting::ErrorDriven { alpha, beta, floor } => {
                error_driven(*alpha, *beta)?;
                positive("floor of efforts", *floor)
            }
            Forgetting::NoiseNormalised { alpha, beta, dead_zone } => {
                error_driven(*alpha, *beta)?;
                positive("dead zone", *dead_zone)
            }
            Forgetting::Directional { lambda, tolerance } => {
                factor(*lambda)?;
                number("tolerance", 0, "a number in [0, 1)", *tolerance, (0.0..1.0).contains(tolerance))
            }
            Forgetting::Drift { rate, interval } => {
                length("rates of drift", self.columns(), rate)?;
                each("rates of drift", "a finite number that is not negative", rate, |v| {
                    v >= 0.0 && v.is_finite()
                })?;
                positive("time between samples", *interval)
            }
            Forgetting::BlockWindow { samples, blocks } | Forgetting::RowWindow { samples, blocks } => {
                count("blocks of the window", *blocks, 1)?;
                count("samples of the window", *samples, *blocks)?;
                let whole = samples.is_multiple_of(*blocks);
                number("samples of the window", 0, "a multiple of its blocks", *samples as f64, whole)
            }
        }
    }

    fn validate_combinations(&self) -> Result<(), SettingsError> {
        let windowed =
            matches!(self.forgetting, Forgetting::BlockWindow { .. } | Forgetting::RowWindow { .. });
        let discounts = matches!(
            self.forgetting,
            Forgetting::Constant { .. } | Forgetting::ErrorDriven { .. } | Forgetting::NoiseNormalised { .. }
        );
        let no = |what| Err(SettingsError::Combination { what });
        if self.bounded_covariance.is_some() && !discounts {
            return no("a bounded covariance needs constant, error-driven or noise-normalised forgetting");
        }
        if self.monitor.is_some() && (windowed || matches!(self.forgetting, Forgetting::Directional { .. })) {
            return no("an excitation monitor has nothing to freeze with windows and directional forgetting");
        }
        if self.reaction.is_some() && windowed {
            return no("a window forgets by itself: a targeted reaction needs another kind of forgetting");
        }
        if self.reaction.is_some() && self.detection.is_none() {
            return no("a targeted reaction needs change detection");
        }
        Ok(())
    }
}

impl DetectionSettings {
    fn validate(&self) -> Result<(), SettingsError> {
        let k = self.kappa;
        number("κ", 0, "a finite number above 1", k, k > 1.0 && k.is_finite())?;
        number("clip", 0, "a positive number", self.clip, self.clip > 0.0)?;
        match self.false_alarms {
            FalseAlarms::Rate { rate, samples } => {
                number("rate of false alarms", 0, "a number in (0, 1)", rate, rate > 0.0 && rate < 1.0)?;
                let fine = samples >= 1.0 && samples.is_finite();
                number("samples of false alarms", 0, "a finite number from 1 on", samples, fine)?;
            }
            FalseAlarms::RunLength(n) => {
                number("run length", 0, "a finite number above 1", n, n > 1.0 && n.is_finite())?;
            }
            FalseAlarms::Threshold(h) => {
                number("threshold", 0, "a finite positive number", h, h > 0.0 && h.is_finite())?;
            }
        }
        match self.whiteness {
            Whiteness::White => Ok(()),
            Whiteness::Every(samples) => count("samples per sample used", samples, 1),
            Whiteness::Learned { samples } => count("samples to learn from", samples, 50),
        }
    }
}

impl ReactionSettings {
    fn validate(&self) -> Result<(), SettingsError> {
        count("samples of the reaction", self.samples, 1)?;
        let (share, opening) = (self.share, self.opening);
        number("share of the reaction", 0, "a number in (0, 1]", share, share > 0.0 && share <= 1.0)?;
        let fine = opening > 0.0 && opening < 1e15;
        number("opening of the reaction", 0, "a positive number below 1e15", opening, fine)?;
        for (what, level) in [("level of the reaction", self.level), ("named level", self.named_level)] {
            number(what, 0, "a number in (0, 1)", level, level > 0.0 && level < 1.0)?;
        }
        Ok(())
    }
}

fn number(
    what: &'static str,
    index: usize,
    expected: &'static str,
    found: f64,
    fine: bool,
) -> Result<(), SettingsError> {
    if fine { Ok(()) } else { Err(SettingsError::Number { what, index, expected, found }) }
}

fn each(
    what: &'static str,
    expected: &'static str,
    list: &[f64],
    fine: impl Fn(f64) -> bool,
) -> Result<(), SettingsError> {
    list.iter().enumerate().try_for_each(|(index, v)| number(what, index, expected, *v, fine(*v)))
}

fn length(what: &'static str, expected: usize, list: &[f64]) -> Result<(), SettingsError> {
    if list.len() == expected {
        Ok(())
    } else {
        Err(SettingsError::Length { what, expected, found: list.len() })
    }
}

fn count(what: &'static str, found: usize, least: usize) -> Result<(), SettingsError> {
    let expected = match least {
        1 => "at least 1",
        50 => "at least 50",
        _ => "at least one per block",
    };
    number(what, 0, expected, found as f64, found >= least && found <= 1 << 40)
}
