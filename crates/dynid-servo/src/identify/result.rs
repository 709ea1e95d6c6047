//! What an identification is made of.

use dynid_estimate::prior::PriorError;
use dynid_model::Inertia;
use dynid_motion::signal::SignalError;

use crate::chain::Chain;
use crate::channel::Channel;
use crate::deviation::DEVIATIONS;
use crate::fit::Ending;
use crate::free::{Free, ServoValues};
use crate::joint::Scheme;
use crate::rollout::Lost;
use crate::settings::Addition;

/// Why there is no identification.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ServoError {
    /// A log that cannot be filtered.
    #[error("{log}: {source}")]
    Signal {
        /// Name of the log.
        log: String,
        /// Why.
        source: SignalError,
    },
    /// Bodies of the robot file that nothing can be known of.
    #[error(transparent)]
    Bodies(#[from] PriorError),
    /// The simulation got lost.
    #[error(transparent)]
    Lost(#[from] Lost),
    /// Logs, settings and robot do not have the same joints.
    #[error("{what}: expected {expected} joints, found {found}")]
    Joints {
        /// What has the wrong number.
        what: String,
        /// Joints of the robot.
        expected: usize,
        /// Joints found.
        found: usize,
    },
    /// A measured signal that has not a value for every row.
    #[error("{log}: {channel}: expected {expected} rows, found {found}")]
    Rows {
        /// Name of the log.
        log: String,
        /// Channel.
        channel: &'static str,
        /// Rows of the log.
        expected: usize,
        /// Rows of the signal.
        found: usize,
    },
    /// Too few rows to say anything.
    #[error("{log}: expected at least {expected} rows, found {found}")]
    Short {
        /// Name of the log.
        log: String,
        /// Least number.
        expected: usize,
        /// Rows.
        found: usize,
    },
}

/// What an estimate moves by when something is changed that should not matter.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spread {
    /// Largest change under laws that are richer by one of friction or offset.
    pub law: f64,
    /// Change under half the step of the simulation; where nothing but rounding is left of the readings, under twice the step.
    pub step: f64,
    /// Standard deviation over fits that each leave a fold of the logs out.
    pub folds: f64,
    /// Largest change under stated gains that are wrong by their error.
    pub gain: f64,
    /// Change with the time over which efforts are read, a period or an instant, where the logs do not tell it. Both are right for some sensor, so that the
    /// value is not called unstable for it.
    pub reading: f64,
    /// Standard deviation by what is known beforehand, which may be off by its own.
    pub knowledge: f64,
}

/// What can be said of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ServoVerdict {
    /// The interval is narrow, and nothing that should not matter moves the value out of it.
    Seen,
    /// The interval is known and wide.
    Coarse,
    /// The value moves by more than its own interval with the law, the step, the fold or a stated gain.
    Unstable,
    /// What is known beforehand decides.
    Prior,
    /// The value stands at a bound, where it has no interval: the data would have it go on, which hints at a wrong model.
    AtBound,
    /// No reading depends on it, or so little that its interval holds 0.
    NotSeen,
}

/// A parameter that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoParameter {
    /// What it is.
    pub free: Free,
    /// Value.
    pub value: f64,
    /// Half width of the 95 % interval with all spreads; `None`: there is none.
    pub half_width: Option<f64>,
    /// The interval, within what is possible: value and half width, but where the scale of gain, rotor and friction is open. What readings tell of that is the
    /// reciprocal, the share of bodies of known mass, so that with a relative half width `ρ` the interval goes from `value/(1 + ρ)` to `value/(1 - ρ)`.
    /// `None`: there is none, or it has no upper end.
    pub interval: Option<(f64, f64)>,
    /// Standard deviation by the block jackknife.
    pub std: Option<f64>,
    /// Standard deviation by the model alone: right only if the model is.
    pub model_std: Option<f64>,
    /// What it moves by.
    pub spread: Spread,
    /// Value over the position gain of its joint and the half width of its interval, where the gain was found and both scale together.
    pub per_gain: Option<(f64, f64)>,
    /// Verdict.
    pub verdict: ServoVerdict,
}

/// What makes some parameters act together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupKind {
    /// They share one scale: only bodies of known mass, a stated gain or a measured effort pin it.
    Scale,
    /// They are lags: content above 5 Hz parts them.
    Lag,
    /// Zero and constant effort: several postures part them.
    Posture,
    /// Parts of friction: more speeds and loads part them.
    Friction,
    /// Others.
    Other,
}

/// Parameters that are known together only.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoGroup {
    /// What makes them.
    pub kind: GroupKind,
    /// Places among the parameters.
    pub members: Vec<usize>,
}

/// An addition and what held-out folds say to it.
#[derive(Debug, Clone, PartialEq)]
pub struct AdditionTrial {
    /// Laws that it was added to.
    pub beside: Vec<Addition>,
    /// The addition.
    pub addition: Addition,
    /// Held-out error over that without it, per fold; `NaN`: the simulation got lost; empty: it gains nothing on the logs that it is
    /// fitted to, or another was taken before.
    pub ratios: Vec<f64>,
    /// Whether it was taken.
    pub taken: bool,
}

/// Bodies that were left free, and what held-out folds say to it.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyTrial {
    /// Factor by which the robot file was taken for surer than it is said to be.
    pub pull: f64,
    /// Held-out error over that with the bodies of the robot file, per fold; `NaN`: the simulation got lost.
    pub ratios: Vec<f64>,
    /// Whether it was taken.
    pub taken: bool,
}

/// A body that was found. Lists go by its ten standard parameters about the joint frame ([`Inertia`]).
#[derive(Debug, Clone, PartialEq)]
pub struct ServoBody {
    /// Body of the mechanism.
    pub body: usize,
    /// What the robot file states, repaired if no body can have that.
    pub stated: Inertia,
    /// What was found: an inertia that a body can have.
    pub inertia: Inertia,
    /// Half widths of 95 % intervals, with what the robot file may be off by.
    pub half_width: [Option<f64>; DEVIATIONS],
    /// Whether the logs tell the parameter: its interval is a third of what the robot file's error leaves it, or less, and would be so if that error were four times
    /// as large.
    pub told: [bool; DEVIATIONS],
}

/// A direction that was looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionTrial {
    /// Joint.
    pub joint: usize,
    /// Direction in use.
    pub direction: f64,
    /// RMS with the other direction, fitted anew with zeros free, over that with this one; below [`TOLD_DIRECTION`] the logs do not tell it.
    pub other: f64,
}

/// RMS with the other direction over that with the chosen one from which a direction is told.
pub const TOLD_DIRECTION: f64 = 1.02;

/// Single readings that stand out of what a fit misses, and were left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outliers {
    /// Log.
    pub log: usize,
    /// Joint.
    pub joint: usize,
    /// Channel.
    pub channel: Channel,
    /// Readings.
    pub rows: usize,
}

/// What a measured effort is beside that of a fit to positions alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffortVerdict {
    /// It is that of the drive, and the fit takes it.
    Taken,
    /// The fit takes it, but its size is too far from what positions tell: masses of the robot, stated gains or the unit are wrong.
    OtherSize,
    /// It runs against the drive, and is left out: its sign is the other one.
    Against,
    /// It has no sign, and is left out.
    Unsigned,
    /// The simulation explains less than half of its variance, scale and zero free, and it is left out.
    Unlike,
}

impl EffortVerdict {
    /// Whether the fit takes it.
    pub fn is_taken(self) -> bool {
        matches!(self, EffortVerdict::Taken | EffortVerdict::OtherSize)
    }
}

/// A measured effort or current of a joint, and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffortUse {
    /// Joint.
    pub joint: usize,
    /// Effort or current.
    pub channel: Channel,
    /// What it is.
    pub verdict: EffortVerdict,
    /// Share of its variance that the simulation explains: of the last fit if it is taken, else of the one to positions, scale and zero free.
    pub explained: f64,
    /// Measured over simulated effort of the fit to positions alone; `None`: a current whose torque constant is not known.
    pub ratio: Option<f64>,
    /// RMS residual of the last fit, N m, N or A; `NaN` where it is not taken.
    pub rms: f64,
}

/// Error of rollouts that begin from measured states again and again.
#[derive(Debug, Clone, PartialEq)]
pub struct HorizonError {
    /// Time after which a rollout begins anew, s; infinite: never.
    pub horizon_s: f64,
    /// RMS of every joint.
    pub rms: Vec<f64>,
}

/// An identification.
#[derive(Debug, Clone)]
pub struct ServoIdentification {
    /// Chains of the robot.
    pub chains: Vec<Chain>,
    /// All numbers.
    pub values: ServoValues,
    /// Parameters that were asked for.
    pub parameters: Vec<ServoParameter>,
    /// Groups of parameters that only act together.
    pub groups: Vec<ServoGroup>,
    /// What was added to the plain law.
    pub additions: Vec<Addition>,
    /// Additions that were tried.
    pub trials: Vec<AdditionTrial>,
    /// Bodies that were found; empty where they are those of the robot file.
    pub bodies: Vec<ServoBody>,
    /// Pulls towards the robot file that were tried where bodies were to be found.
    pub body_trials: Vec<BodyTrial>,
    /// What was mended in the robot file before bodies were found, in words.
    pub body_repairs: Vec<String>,
    /// Directions that were looked for.
    pub directions: Vec<DirectionTrial>,
    /// Readings that were left out.
    pub outliers: Vec<Outliers>,
    /// Measured efforts and currents.
    pub efforts: Vec<EffortUse>,
    /// Channels of the sum of squares.
    pub channels: Vec<Channel>,
    /// How the simulation was done.
    pub scheme: Scheme,
    /// RMS residual of every joint over all logs, whole rollouts.
    pub rms: Vec<f64>,
    /// The same by log.
    pub rms_by_log: Vec<Vec<f64>>,
    /// RMS of the command less the position.
    pub command_rms: Vec<f64>,
    /// Standard deviation of every encoder's rounding.
    pub floor: Vec<f64>,
    /// Residual over floor of every joint, the median over joints whose encoder's step is known: above [`MISFIT`](super::MISFIT) the model is wrong
    /// somewhere; `NaN`: no step is known, and the model counts as wrong.
    pub misfit: f64,
    /// RMS by which half the step moves the simulation, over the residual's.
    pub step_share: f64,
    /// Errors over horizons.
    pub horizons: Vec<HorizonError>,
    /// Relative residual of the linear start, by joint.
    pub start_residual: Vec<f64>,
    /// The linear start.
    pub start: ServoValues,
    /// How the last fit ended.
    pub ending: Ending,
    /// Accepted steps of it.
    pub iterations: usize,
    /// Simulations of all logs, all fits together.
    pub evaluations: usize,
    /// Steps whose friction did not settle, and all steps, of one simulation of all logs.
    pub unsettled: (usize, usize),
    /// Blocks of the jackknife.
    pub blocks: usize,
    /// Longest time behind the beginning of a rollout that no sum holds, s: position loops forget it, and links come to rest on gears that give way.
    pub settle_s: f64,
}
