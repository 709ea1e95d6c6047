//! Keys of on-line identification.

use std::path::PathBuf;

use dynid_identify::Error;
use serde::{Deserialize, Serialize};

/// How old samples lose their weight.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum ForgettingRule {
    /// Old samples keep their weight: the estimate is that of all samples, until change detection finds that something changed.
    #[default]
    None,
    /// By age alone, with a time constant of `memory_s`.
    Constant,
    /// By age, where the motion excites: what is not excited is kept.
    Directional,
    /// By the relative error of efforts (Sun et al., Eq. 44).
    ErrorDriven,
    /// By errors that noise does not explain.
    NoiseNormalised,
    /// All at once, after `memory_s`.
    Window,
    /// Parameters wander: in `memory_s` by a tenth of what was not known of them at first.
    Drift,
}

/// On-line identification.
#[derive(Debug, Clone, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct OnlineConfig {
    /// First stretch of the stream from which filter, delay, masks, noise and a first estimate are learned, s. Default 20.
    pub learn_s: f64,
    /// Forgetting. Default `none`.
    pub forgetting: ForgettingRule,
    /// Memory of `constant`, `directional`, `window` and `drift`, s. Default 60.
    pub memory_s: f64,
    /// Detect changes, raise alarms and answer them. Default true.
    pub alarms: bool,
    /// Probability of a false alarm in `false_alarm_hours`. Default 0.01.
    pub false_alarm_rate: f64,
    /// See `false_alarm_rate`. Default 1.
    pub false_alarm_hours: f64,
    /// After an alarm, samples of so long are judged on their own before anything is changed, s. Default 2.
    pub reaction_s: f64,
    /// Time between reports of the estimate, s. Default 1.
    pub report_s: f64,
    /// Report standard parameters of bodies that can exist beside the base parameters. Default true.
    pub consistent: bool,
    /// File to which the state is written, relative to the configuration, and from which a run resumes if it exists. Default: none.
    pub checkpoint: Option<PathBuf>,
    /// Time between checkpoints, s of the stream. Default 10.
    pub checkpoint_s: f64,
}

impl Default for OnlineConfig {
    fn default() -> Self {
        OnlineConfig {
            learn_s: 20.0,
            forgetting: ForgettingRule::None,
            memory_s: 60.0,
            alarms: true,
            false_alarm_rate: 0.01,
            false_alarm_hours: 1.0,
            reaction_s: 2.0,
            report_s: 1.0,
            consistent: true,
            checkpoint: None,
            checkpoint_s: 10.0,
        }
    }
}

impl OnlineConfig {
    /// Refuses settings that would do nothing beside the others.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check_effect(&self) -> Result<(), Error> {
        use ForgettingRule::{Constant, Directional, Drift, Window};
        let usual = OnlineConfig::default();
        let forgets = matches!(self.forgetting, Constant | Directional | Drift | Window);
        let by_memory = "`forgetting` with a memory (`constant`, `directional`, `window`, `drift`) beside it";
        let keys = [
            ("online.memory_s", !forgets && self.memory_s != usual.memory_s, by_memory),
            (
                "online.false_alarm_rate",
                !self.alarms && self.false_alarm_rate != usual.false_alarm_rate,
                "`alarms` beside it",
            ),
            (
                "online.false_alarm_hours",
                !self.alarms && self.false_alarm_hours != usual.false_alarm_hours,
                "`alarms` beside it",
            ),
            ("online.reaction_s", !self.alarms && self.reaction_s != usual.reaction_s, "`alarms` beside it"),
            (
                "online.checkpoint_s",
                self.checkpoint.is_none() && self.checkpoint_s != usual.checkpoint_s,
                "`checkpoint` beside it",
            ),
        ];
        match keys.iter().find(|(_, idle, _)| *idle) {
            Some((key, _, expected)) => Err(Error::setting(key, expected, "none")),
            None => Ok(()),
        }
    }

    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub(super) fn check(&self) -> Result<(), Error> {
        for (name, value) in [
            ("online.learn_s", self.learn_s),
            ("online.memory_s", self.memory_s),
            ("online.false_alarm_hours", self.false_alarm_hours),
            ("online.reaction_s", self.reaction_s),
            ("online.report_s", self.report_s),
            ("online.checkpoint_s", self.checkpoint_s),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::setting(name, "a positive number", value));
            }
        }
        let rate = self.false_alarm_rate;
        if !(rate > 0.0 && rate < 1.0) {
            return Err(Error::setting("online.false_alarm_rate", "a number between 0 and 1", rate));
        }
        Ok(())
    }
}
