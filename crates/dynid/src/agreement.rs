//! Predicted against measured effort on a log.

use dynid_estimate::conditioning::{ConditioningSettings, Moving, PreparedLog, predict, predict_at_rest};
use dynid_estimate::metrics::{Fit, MetricsError, fit};
use dynid_model::EffortModel;
use dynid_motion::filter::{butterworth, forward_backward};

use crate::Error;
use crate::estimate::{FileFit, FitValues};

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
    /// Per output: prediction as pictures show it. Where a joint stands, friction of velocity is left out of it, since the sign of
    /// its velocity is that of noise; elsewhere it is [`Agreement::predicted`], which all figures go by.
    pub drawn: Vec<Vec<f64>>,
    /// Per output: a drive acts there, so that its effort counts in figures over all joints.
    pub driven: Vec<bool>,
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

/// Lead of the effort to align a log by, samples: the one found, at the rate that it was found at.
pub(crate) fn lead(rate_hz: f64, delay_samples: f64, delay_rate_hz: f64) -> f64 {
    let same_rate = (rate_hz / delay_rate_hz - 1.0).abs() <= 0.05;
    if same_rate { delay_samples } else { 0.0 }
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
    let aligned = lead(log.rate_hz, alignment.delay_samples, alignment.delay_rate_hz);
    let predicted = run(aligned)?;
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
    let drawn = match motion.samples.iter().flatten().all(|moves| *moves) {
        true => predicted.clone(),
        false => predict_at_rest(model, &shape, values, log, &motion, (state_hz, aligned), settings)?,
    };
    let driven: Vec<bool> = (0..log.effort.len()).map(|output| !model.is_undriven(output)).collect();
    let agree_on = |measured: &[Vec<f64>], predicted: &[Vec<f64>], part: Part| {
        let is_of = |output: usize, k: usize| counted[k] && part.holds(motion.samples[output][k]);
        fit_driven(&pick(measured, is_of), &pick(predicted, is_of), &driven)
            .map_err(|e| Error::TooShort { file: log.name.clone(), message: e.to_string() })
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
        driven: driven.clone(),
        predicted,
        drawn,
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

/// The samples of each signal that are asked for, by output and sample.
fn pick(signals: &[Vec<f64>], is_kept: impl Fn(usize, usize) -> bool) -> Vec<Vec<f64>> {
    let kept = |(output, s): (usize, &Vec<f64>)| {
        s.iter().enumerate().filter(|(k, _)| is_kept(output, *k)).map(|(_, x)| *x).collect()
    };
    signals.iter().enumerate().map(kept).collect()
}

/// Figures per joint; those over all joints leave out where nothing drives: what is left over there is no share of any effort.
fn fit_driven(measured: &[Vec<f64>], predicted: &[Vec<f64>], driven: &[bool]) -> Result<Fit, MetricsError> {
    let whole = fit(measured, predicted)?;
    if driven.iter().all(|d| *d) {
        return Ok(whole);
    }
    let of = |signals: &[Vec<f64>]| -> Vec<Vec<f64>> {
        signals.iter().zip(driven).filter(|(_, d)| **d).map(|(s, _)| s.clone()).collect()
    };
    let relative_error = fit(&of(measured), &of(predicted))?.relative_error;
    Ok(Fit { relative_error, ..whole })
}

impl Agreement {
    /// Measured effort of an output and its prediction as pictures show it, through the filter of the filtered figures; not a
    /// number near the ends and gaps, which do not count.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub(crate) fn in_band(&self, output: usize) -> Result<[Vec<f64>; 2], Error> {
        let filter = butterworth(4, self.filter_hz, self.rate_hz).map_err(conditioning)?;
        let through = |signal: &[f64]| -> Result<Vec<f64>, Error> {
            let filtered = forward_backward(&filter, signal).map_err(conditioning)?;
            let counted = filtered.into_iter().zip(&self.counted);
            Ok(counted.map(|(x, counts)| if *counts { x } else { f64::NAN }).collect())
        };
        Ok([through(&self.measured[output])?, through(&self.drawn[output])?])
    }

    /// Figures of a prediction that lacks `lost` of each output's effort, through the same filter.
    ///
    /// # Errors
    /// [`Error::Conditioning`], [`Error::TooShort`].
    pub(crate) fn without(&self, lost: &[Vec<f64>]) -> Result<FileFit, Error> {
        let filter = butterworth(4, self.filter_hz, self.rate_hz).map_err(conditioning)?;
        let through = |signals: &[Vec<f64>]| {
            let filtered = signals.iter().map(|s| forward_backward(&filter, s).map_err(conditioning));
            Ok::<_, Error>(pick(&filtered.collect::<Result<Vec<_>, _>>()?, |_, k| self.counted[k]))
        };
        let (measured, whole, lost) = (through(&self.measured)?, through(&self.predicted)?, through(lost)?);
        let pairs = whole.iter().zip(&lost);
        let predicted: Vec<Vec<f64>> =
            pairs.map(|(w, l)| w.iter().zip(l).map(|(w, l)| w - l).collect()).collect();
        let found = fit_driven(&measured, &predicted, &self.driven)
            .map_err(|e| Error::TooShort { file: self.name.clone(), message: e.to_string() })?;
        let rms = |s: &[f64]| (s.iter().map(|x| x * x).sum::<f64>() / s.len() as f64).sqrt();
        let loss: Vec<f64> = lost.iter().map(|l| rms(l)).collect();
        let percent = |(loss, measured): (&f64, &Vec<f64>)| {
            let whole = rms(measured);
            (whole > 0.0).then(|| 100.0 * loss / whole)
        };
        Ok(FileFit {
            rms: found.channels.iter().map(|c| c.rms).collect(),
            relative_error_per_joint: found.channels.iter().map(|c| c.relative_error).collect(),
            relative_error: found.relative_error,
            loss_percent: loss.iter().zip(&measured).map(percent).collect(),
            loss,
        })
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
