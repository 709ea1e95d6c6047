//! From logs to regression rows: every setting found from the logs themselves.
//!
//! Nonlinear columns are computed from states at a high cut-off; then columns and effort pass through one compact kernel,
//! and a row counts only if nothing unusable lies under it. Kernel, reversal mask and delay are chosen on held-out
//! time blocks.

mod base_prior;
mod choose;
mod delay_again;
mod friction;
mod friction_shape;
mod gram;
mod live_rows;
mod log_rows;
mod masks;
mod moving;
mod periodic;
mod predict;
mod prepare;
mod record_windows;
mod reduce;
mod repeated;
mod rows;
mod settings;
mod shaped_rows;
mod smoothing;
mod states;
mod textbook;
mod trial;
mod windows;

pub use base_prior::BasePrior;
pub use choose::{DelayEstimate, KernelTrial, MaskTrial};
pub use delay_again::delay_again;
pub use dynid_factor::groups::ReducedGroup;
pub use friction::{FrictionChoice, JointFriction, ShapeTrial, choose_friction};
pub use friction_shape::{FrictionShape, ShapeKind};
pub use live_rows::{LiveRow, LiveRowSettings, LiveRows};
pub use log_rows::{LogRows, least_block_samples, most_blocks, time_blocks};
pub use moving::{Moving, rms_speeds, tell_speeds};
pub use predict::{predict, predict_along};
pub use prepare::{PeriodicMotion, PeriodsAveraged, PreparedLog, SharedMotion, prepare};
pub use record_windows::{RecordFigures, Window, WindowReach};
pub use reduce::reduce;
pub use repeated::{LogMotion, motions, parts_of_motions, tell_shared_motions};
pub(crate) use rows::KeptColumns;
pub use settings::{ConditioningSettings, FrictionSettings, Smoothing};
pub use shaped_rows::{RefineError, ShapedRows, refine};
pub use states::{Recall, StateBlock, States};
pub use textbook::{TextbookRoute, paired_textbook_rows, reduce_textbook, textbook_rows};
pub use trial::{prediction_hz_of, state_hz_of};

use dynid_model::EffortModel;
use dynid_motion::cutoff::KernelLimit;

use dynid_factor::factor::FactorError;
use trial::{Trial, TrialShapes};

/// Why a log cannot be conditioned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConditioningError {
    /// The clock is beyond repair.
    #[error(transparent)]
    Clock(#[from] dynid_motion::ClockError),
    /// A signal cannot be filtered.
    #[error("signal: {0}")]
    Signal(#[from] dynid_motion::SignalError),
    /// A joint of the model has no columns in the log.
    #[error("{log}: no signals of joint `{joint}`")]
    MissingJoint {
        /// Log.
        log: String,
        /// Joint.
        joint: String,
    },
    /// A channel that an element needs is missing.
    #[error("{log}: no channel `{channel}`")]
    MissingChannel {
        /// Log.
        log: String,
        /// Channel.
        channel: String,
    },
    /// An effort is constant.
    #[error("{log}: the effort of joint `{joint}` never changes")]
    ConstantEffort {
        /// Log.
        log: String,
        /// Joint.
        joint: String,
    },
    /// No joint moves.
    #[error("{log}: no joint moves")]
    NothingMoves {
        /// Log.
        log: String,
    },
    /// A log without a whole period of its motion.
    #[error(
        "{log}: expected at least one whole period of {expected} s, of 8 samples or more, found {found:.3} s"
    )]
    ShorterThanPeriod {
        /// Log.
        log: String,
        /// Period, s.
        expected: f64,
        /// Duration of the log, s.
        found: f64,
    },
    /// The positions repeat after another time than stated.
    #[error(
        "{log}: expected a motion that repeats every {expected} s, found {found:.6} s and no end of the search"
    )]
    OtherPeriod {
        /// Log.
        log: String,
        /// Period stated, s.
        expected: f64,
        /// Where the search left the stated period by more than 1 %, s.
        found: f64,
    },
    /// A log to be averaged over its periods with fewer than two.
    #[error("{log}: expected two whole periods of {period_s} s or more to average, found {found:.3}")]
    FewPeriods {
        /// Log.
        log: String,
        /// Period, s.
        period_s: f64,
        /// Periods that the log lasts.
        found: f64,
    },
    /// A log to be averaged over a period that is no whole number of samples.
    #[error(
        "{log}: expected a period of a whole number of samples to average, found {found:.4} samples ({period_s} s at {rate_hz} Hz)"
    )]
    PeriodOffGrid {
        /// Log.
        log: String,
        /// Period, s.
        period_s: f64,
        /// Sample rate, Hz.
        rate_hz: f64,
        /// Samples of the period.
        found: f64,
    },
    /// A log without a period whose Fourier series is asked for.
    #[error("{log}: expected a period, of which Fourier series are formed, found none")]
    NoPeriod {
        /// Log.
        log: String,
    },
    /// No row is left.
    #[error(
        "no usable row is left: the logs are too short for a kernel of {kernel_hz:.3} Hz, expected at least {expected:.2} s of uninterrupted motion, found {found:.2} s"
    )]
    NoRows {
        /// Kernel cut-off, Hz.
        kernel_hz: f64,
        /// Seconds that one row needs.
        expected: f64,
        /// Seconds of the longest log.
        found: f64,
    },
    /// A row holds a number that is not finite.
    #[error("output {output}: {source}")]
    Rows {
        /// Index of the output.
        output: usize,
        /// What was found.
        source: FactorError,
    },
}

/// The choices made.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditioning {
    /// Highest kernel that noise and band allow.
    pub limit: KernelLimit,
    /// Cut-off of the widest kernel, Hz.
    pub kernel_hz: f64,
    /// Cut-offs of all kernels, widest kernel first, Hz.
    pub scales_hz: Vec<f64>,
    /// Per log: cut-off of the state filter, Hz.
    pub state_hz: Vec<f64>,
    /// Cut-off of the states behind predictions, Hz: not above what the accelerations of all logs bear, since no kernel follows there.
    pub prediction_hz: f64,
    /// Delay.
    pub delay: DelayEstimate,
    /// Per output: rung of the mask ladder, 0 = no mask.
    pub rung: Vec<usize>,
    /// Per output: mask as a share of the rms speed; `None` = no mask.
    pub mask: Vec<Option<f64>>,
    /// Per output: share of samples that stay usable.
    pub usable: Vec<f64>,
    /// Per output: rms speed in the log in which it is greatest ([`rms_speeds`]).
    pub rms_speed: Vec<f64>,
    /// Kernels tried.
    pub kernel_trials: Vec<KernelTrial>,
    /// Ladder of masks.
    pub mask_trials: Vec<MaskTrial>,
}

/// Rows about reversals that one joint leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMask {
    /// Rung of the mask ladder, 0 = no mask.
    pub rung: usize,
    /// Mask as a share of the rms speed; `None` = no mask.
    pub level: Option<f64>,
    /// Share of samples that stay usable.
    pub usable: f64,
}

impl Conditioning {
    /// The mask of an output.
    pub fn mask_of(&self, output: usize) -> JointMask {
        JointMask { rung: self.rung[output], level: self.mask[output], usable: self.usable[output] }
    }

    /// Gives an output another mask.
    pub fn set_mask(&mut self, output: usize, mask: JointMask) {
        self.rung[output] = mask.rung;
        self.mask[output] = mask.level;
        self.usable[output] = mask.usable;
    }
}

/// A step of the work, for progress displays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stage {
    /// Sums of one kernel candidate: index, number of candidates.
    Kernel(usize, usize),
    /// Choosing the kernel.
    Veto,
    /// Choosing the mask.
    Mask,
    /// Estimating the delay.
    Delay,
    /// Choosing friction shapes.
    Friction,
}

/// Finds kernel, delay and masks for prepared logs.
///
/// `kept`: base columns of the model, ascending. `progress` is told what is being worked on.
///
/// # Panics
/// If the ladder has more than 7 rungs or there are fewer than 2 folds.
pub fn condition(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    settings: &ConditioningSettings,
    progress: &mut dyn FnMut(Stage),
) -> Result<Conditioning, ConditioningError> {
    let settings = &with_given_mask(settings);
    assert!(settings.ladder.len() <= 7, "rungs are bits of a byte, and one stands for no mask");
    assert!(settings.folds >= 2, "held-out error needs two time blocks");
    let limit = choose::limit(logs, settings)?;
    let candidates = choose::candidates(&limit, settings);
    let delay_limits = choose::delay_limits(logs, settings);
    let mut trials = Vec::with_capacity(candidates.len());
    for (k, kernel_hz) in candidates.iter().enumerate() {
        progress(Stage::Kernel(k, candidates.len()));
        let trial = Trial::new(
            model,
            shape,
            kept,
            logs,
            *kernel_hz,
            limit.states(),
            delay_limits,
            TrialShapes::Probes,
            settings,
        )?;
        if trial.rows() > 0.0 {
            trials.push(trial);
        }
    }
    if trials.is_empty() {
        let kernel_hz = candidates.first().copied().unwrap_or(limit.limit_hz);
        return Err(ConditioningError::NoRows {
            kernel_hz,
            expected: 2.0 * 0.93 / kernel_hz + 2.0 / (2.0 * kernel_hz),
            found: logs.iter().map(PreparedLog::duration).fold(0.0, f64::max),
        });
    }
    progress(Stage::Veto);
    let (chosen, kernel_trials) = choose::kernel(&trials, delay_limits, settings);
    let trial = trials.swap_remove(chosen);
    drop(trials);
    progress(Stage::Delay);
    let (prior, _) = settings.delay_prior;
    let middle: Vec<usize> = (0..trial.outputs())
        .map(|j| trial.allowed(j, settings.ladder.len().div_ceil(2), settings.least_usable))
        .collect();
    let plain = vec![Vec::new(); trial.outputs()];
    let first = choose::delay(&trial, &middle, &plain, delay_limits, settings, prior);
    progress(Stage::Mask);
    let (rung, mask_trials) = choose::masks(&trial, first.samples, settings);
    progress(Stage::Delay);
    let delay = choose::delay(&trial, &rung, &plain, delay_limits, settings, first.samples);
    let usable = (0..trial.outputs()).map(|j| trial.coverage[j][rung[j]]).collect();
    let mask = rung.iter().map(|r| (*r > 0).then(|| settings.ladder[*r - 1])).collect();
    Ok(Conditioning {
        kernel_hz: trial.kernel_hz,
        scales_hz: trial.scales_hz.clone(),
        prediction_hz: prediction_hz_of(
            trial.kernel_hz,
            limit.states(),
            logs.iter().map(|log| log.rate_hz),
            settings,
        ),
        state_hz: trial.state_hz.clone(),
        delay,
        rung,
        mask,
        usable,
        rms_speed: rms_speeds(logs),
        kernel_trials,
        mask_trials,
        limit,
    })
}

/// With a mask given, the ladder has that one rung.
pub(crate) fn with_given_mask(settings: &ConditioningSettings) -> ConditioningSettings {
    let mut settings = settings.clone();
    if let Some(level) = settings.reversal_mask {
        settings.ladder = vec![level.max(0.0)];
    }
    settings
}
