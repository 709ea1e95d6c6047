//! What a session has to say.

use serde::Serialize;

/// A base parameter with its deviation.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ParameterValue {
    /// Name of the column that stands for it.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation, coloured residuals allowed for.
    pub std: f64,
}

/// A value without deviation.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PlainValue {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
}

/// What a base parameter is.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LearnedParameter {
    /// Name of the column that stands for it.
    pub name: String,
    /// The combination of standard parameters that it is.
    pub expression: String,
    /// Unit.
    pub unit: String,
}

/// A jump of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct MovedParameter {
    /// Name: a standard parameter.
    pub name: String,
    /// Jump, in the parameter's unit.
    pub jump: f64,
    /// Standard deviation of the jump.
    pub std: f64,
}

/// Something whose change would explain what the samples after an alarm show.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Moved {
    /// What: a link, a joint's friction, a single parameter.
    pub what: String,
    /// Share of the misfit that it explains, together with what stands before it, 0 to 1.
    pub share: f64,
    /// Jumps of its parameters that efforts can tell.
    pub parameters: Vec<MovedParameter>,
}

/// Rows and samples so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub struct Counts {
    /// Samples taken.
    pub samples: u64,
    /// Samples of rows that updated the estimate.
    pub rows: u64,
    /// Samples dropped because their time does not advance.
    pub backward: u64,
    /// Gaps in the clock.
    pub gaps: u64,
    /// Times that the clock was set back.
    pub set_back: u64,
    /// Samples that a checkpoint had already seen.
    pub already_seen: u64,
    /// Alarms.
    pub alarms: u64,
    /// Alarms that the samples after them bore out, or that nothing judged.
    pub changes: u64,
}

/// An event, in JSON an object whose `event` names it.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The first stretch has been learned.
    Learned {
        /// Time, s.
        time: f64,
        /// Sample rate, Hz.
        rate_hz: f64,
        /// Cut-off of the kernel, Hz.
        kernel_hz: f64,
        /// Cut-off of the state filter, Hz.
        state_hz: f64,
        /// Delay of the motion behind the effort, samples.
        delay_samples: f64,
        /// Time by which the estimate lies behind, s.
        lag_s: f64,
        /// Rows per second.
        rows_per_s: f64,
        /// Per output: standard deviation of its rows' residuals, in the effort's unit.
        noise: Vec<f64>,
        /// Base parameters in the order of all estimates.
        parameters: Vec<LearnedParameter>,
        /// Doubts, in words.
        warnings: Vec<String>,
    },
    /// The stretch does not suffice; it grows.
    Learning {
        /// Time, s.
        time: f64,
        /// Why it does not suffice.
        reason: String,
    },
    /// The estimate.
    Estimate {
        /// Time of the newest row, s.
        time: f64,
        /// Base parameters.
        parameters: Vec<ParameterValue>,
        /// Standard parameters of bodies that can exist; empty unless asked for.
        standard: Vec<PlainValue>,
        /// Per output: RMS of the one-step prediction errors since the last report, in the effort's unit; none without rows.
        residual_rms: Vec<Option<f64>>,
        /// Share of the base parameters that the data determine: deviation below a tenth of what it was before any sample.
        determined: f64,
        /// Cumulative sum of change detection.
        statistic: f64,
        /// Alarm threshold of that sum.
        threshold: Option<f64>,
        /// Whether alarms are given: not while the motion goes where nothing was learned.
        watching: bool,
        /// Samples of rows so far.
        rows: u64,
        /// Alarms so far.
        alarms: u64,
    },
    /// The motion leaves the region that was learned: alarms are withheld until it has been learned too.
    Withheld {
        /// Time of the newest row, s.
        time: f64,
        /// Variance of the prediction by what is not known of the parameters, in parts of that of the noise.
        leverage: f64,
    },
    /// The motion stays where it was learned: alarms are given again.
    Watching {
        /// Time of the newest row, s.
        time: f64,
    },
    /// Prediction errors are larger than they should be.
    Alarm {
        /// Time of the newest row, s.
        time: f64,
        /// Threshold that was reached.
        threshold: f64,
    },
    /// What the samples after an alarm showed.
    Change {
        /// Time of the newest row, s.
        time: f64,
        /// Time of the alarm, s.
        alarm: f64,
        /// Whether something changed; if not, the alarm was false.
        confirmed: bool,
        /// What moved, the most telling first; empty if the alarm was false.
        moved: Vec<Moved>,
        /// What else would explain it alone, best first: name and share.
        alternatives: Vec<(String, f64)>,
    },
    /// The stream has ended.
    End {
        /// Counts.
        #[serde(flatten)]
        counts: Counts,
    },
}
