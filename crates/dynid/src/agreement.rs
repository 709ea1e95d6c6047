//! Predicted against measured effort on a log.

use dynid_estimate::conditioning::{ConditioningSettings, Moving, PreparedLog, predict};
use dynid_estimate::metrics::{Fit, MetricsError, fit};
use dynid_model::EffortModel;
use dynid_motion::filter::{butterworth, forward_backward};

use crate::Error;
use crate::estimate::FitValues;

/// How prediction and measurement are brought together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// Cut-off of the states, Hz.
    pub state_hz: f64,
    /// Lead of the logged effort before the motion, samples.
    pub delay_samples: f64,
    /// Sample rate that the lead was found at, Hz. A lead of samples (a held command) and one of time (transport) part
    /// ways at another rate, so logs whose rate differs by more than 5 % are not aligned.
    pub delay_rate_hz: f64,
    /// Cut-off of the filter that both pass for the filtered figures, Hz.
    pub filter_hz: f64,
}

/// Predicted and measured effort of a log with their agreement.
#[derive(Debug, Clone)]
pub struct Agreement {
    /// Log.
    pub name: String,
    /// Time of the first sample, s.
    pub start: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Per output: measured effort.
    pub measured: Vec<Vec<f64>>,
    /// Per output: predicted effort.
    pub predicted: Vec<Vec<f64>>,
    /// Per output: the joint moves in this log.
    pub moves: Vec<bool>,
    /// Per sample: counted (not near an end or a gap of the clock).
    pub counted: Vec<bool>,
    /// On raw effort.
    pub raw: Fit,
    /// Through the same zero-phase Butterworth filter of order 4.
    pub filtered: Fit,
    /// The same without aligning by the delay.
    pub filtered_unaligned: Fit,
    /// Cut-off of that filter, Hz.
    pub filter_hz: f64,
    /// Where the joints move, over all samples.
    pub motion: Moving,
    /// As [`Agreement::filtered`], per output on the samples in which its joint moves.
    pub moving: Fit,
    /// The same on those in which it stands: friction may then have any value up to static friction, which no model of the speed
    /// tells.
    pub standing: Fit,
    /// Per output: share of the counted samples in which its joint stands.
    pub standing_share: Vec<f64>,
}

/// Cut from both ends before figures are formed, in periods of the lower of the two cut-offs.
const EDGE_PERIODS: f64 = 1.0;

/// Predicts a log with given parameters and compares with the measured effort.
///
/// Samples within one period of the filter's cut-off from an end or a gap do not count.
///
/// # Errors
/// [`Error::Conditioning`], [`Error::TooShort`].
pub fn compare(
    model: &dyn EffortModel,
    values: &[f64],
    log: &PreparedLog,
    alignment: &Alignment,
    settings: &ConditioningSettings,
) -> Result<Agreement, Error> {
    let state_hz = alignment.state_hz;
    let filter_hz = alignment.filter_hz.min(0.4 * log.rate_hz);
    let shape = model.parameters().shape_start();
    let run = |delay: f64| predict(model, &shape, values, log, state_hz, delay, settings);
    let same_rate = (log.rate_hz / alignment.delay_rate_hz - 1.0).abs() <= 0.05;
    let predicted = run(if same_rate { alignment.delay_samples } else { 0.0 })?;
    let unaligned = run(0.0)?;
    let margin = (EDGE_PERIODS * log.rate_hz / filter_hz.min(state_hz)).ceil() as usize;
    let mut bad: Vec<bool> = log.usable.iter().map(|u| !u).collect();
    bad = dynid_motion::mask::dilate(&bad, margin);
    dynid_motion::mask::merge(&mut bad, &dynid_motion::mask::edges(log.samples(), margin));
    let counted: Vec<bool> = bad.iter().map(|b| !b).collect();
    if !counted.contains(&true) {
        return Err(Error::TooShort {
            file: log.name.clone(),
            message: format!("{:.2} s leave no sample between the filter's edges", log.duration()),
        });
    }
    let filter = butterworth(4, filter_hz, log.rate_hz).map_err(conditioning)?;
    let filtered = |signals: &[Vec<f64>]| {
        signals
            .iter()
            .map(|s| forward_backward(&filter, s).map_err(conditioning))
            .collect::<Result<Vec<_>, _>>()
    };
    let motion = Moving::of(log, state_hz, settings)?;
    let agree_on = |measured: &[Vec<f64>], predicted: &[Vec<f64>], part: Part| {
        let too_short = |e: MetricsError| Error::TooShort { file: log.name.clone(), message: e.to_string() };
        let is_of = |output: usize, k: usize| counted[k] && part.holds(motion.samples[output][k]);
        let pick = |signals: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let own = |(output, s): (usize, &Vec<f64>)| {
                s.iter().enumerate().filter(|(k, _)| is_of(output, *k)).map(|(_, x)| *x).collect()
            };
            signals.iter().enumerate().map(own).collect()
        };
        let (measured, predicted) = (pick(measured), pick(predicted));
        let whole = fit(&measured, &predicted).map_err(too_short)?;
        // What is left over where nothing drives is no share of any effort.
        let driven: Vec<usize> = (0..measured.len()).filter(|output| !model.is_undriven(*output)).collect();
        let of = |signals: &[Vec<f64>]| driven.iter().map(|o| signals[*o].clone()).collect::<Vec<_>>();
        let relative_error = match driven.len() == measured.len() {
            true => whole.relative_error,
            false => fit(&of(&measured), &of(&predicted)).map_err(too_short)?.relative_error,
        };
        Ok::<Fit, Error>(Fit { relative_error, ..whole })
    };
    let agree = |measured: &[Vec<f64>], predicted: &[Vec<f64>]| agree_on(measured, predicted, Part::All);
    let (measured_filtered, predicted_filtered) = (filtered(&log.effort)?, filtered(&predicted)?);
    let samples = counted.iter().filter(|c| **c).count() as f64;
    let stands = |moves: &Vec<bool>| moves.iter().zip(&counted).filter(|(m, c)| !**m && **c).count() as f64;
    Ok(Agreement {
        moving: agree_on(&measured_filtered, &predicted_filtered, Part::Moving)?,
        standing: agree_on(&measured_filtered, &predicted_filtered, Part::Standing)?,
        standing_share: motion.samples.iter().map(|moves| stands(moves) / samples).collect(),
        name: log.name.clone(),
        start: log.start,
        rate_hz: log.rate_hz,
        raw: agree(&log.effort, &predicted)?,
        filtered: agree(&measured_filtered, &predicted_filtered)?,
        filtered_unaligned: agree(&measured_filtered, &filtered(&unaligned)?)?,
        measured: log.effort.clone(),
        predicted,
        moves: log.moves.clone(),
        motion,
        counted,
        filter_hz,
    })
}

/// Which samples figures are formed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    All,
    Moving,
    Standing,
}

impl Part {
    fn holds(self, moves: bool) -> bool {
        match self {
            Part::All => true,
            Part::Moving => moves,
            Part::Standing => !moves,
        }
    }
}

fn conditioning(e: dynid_motion::SignalError) -> Error {
    Error::Conditioning(e.into())
}

impl From<&Fit> for FitValues {
    fn from(fit: &Fit) -> Self {
        FitValues {
            rms: fit.channels.iter().map(|c| c.rms).collect(),
            nrmse: fit.channels.iter().map(|c| c.nrmse).collect(),
            r2: fit.channels.iter().map(|c| c.r2).collect(),
            relative_error_per_joint: fit.channels.iter().map(|c| c.relative_error).collect(),
            relative_error: fit.relative_error,
        }
    }
}
