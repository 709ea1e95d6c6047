//! Predicted against measured effort on a log.

use std::ops::Range;
use std::sync::Arc;

use dynid_estimate::metrics::{ChannelSums, Fit, FitSums};
use dynid_model::EffortModel;
use dynid_motion::filter::{butterworth, forward_backward, forward_backward_in_step};
use dynid_motion::shift::shift;
use dynid_motion::signal::rms_where;
use dynid_rows::conditioning::{ConditioningSettings, Moving, PreparedLog, States, predict_along};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Error;

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
    pub measured: Vec<Arc<Vec<f64>>>,
    /// Per output: predicted effort.
    pub predicted: Vec<Arc<Vec<f64>>>,
    /// Per output: where the prediction that pictures show differs; empty before [`Agreement::draw`].
    drawn: Vec<Patches>,
    /// Per output: a drive acts there, and nothing else holds the joint in this log, so that its effort counts in figures over all joints.
    pub driven: Vec<bool>,
    /// Per output: the joint moves in this log.
    pub moves: Vec<bool>,
    /// Per sample: counted (not near an end or a gap of the clock).
    pub counted: Vec<bool>,
    /// On raw effort.
    pub raw: Fit,
    /// Through the same zero-phase Butterworth filter of order 4.
    pub filtered: Fit,
    /// Agreement after filtering, without aligning by the delay.
    pub filtered_unaligned: Fit,
    /// Cut-off of that filter, Hz.
    pub filter_hz: f64,
    /// Where the joints move, over all samples.
    pub motion: Moving,
    /// Agreement as in [`Agreement::filtered`], per output on the samples in which its joint moves.
    pub moving: Fit,
    /// Agreement per output on the samples in which its joint stands: friction may then have any value up to static friction, which no model of the speed
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
    let margin = (EDGE_PERIODS * log.rate_hz / filter_hz.min(state_hz)).ceil() as usize;
    let mut bad: Vec<bool> = log.usable.iter().map(|u| !u).collect();
    bad = dynid_motion::mask::dilate(&bad, margin);
    dynid_motion::mask::merge(&mut bad, &dynid_motion::mask::edges(log.samples(), margin));
    let counted: Vec<bool> = bad.iter().map(|b| !b).collect();
    let too_short = |message: String| Error::TooShort { file: log.name.clone(), message };
    if !counted.contains(&true) {
        let lasts = format!("{:.2} s leave no sample between the filter's edges", log.duration());
        return Err(too_short(lasts));
    }
    let states = States::of_motion(log, state_hz, settings)?;
    let motion = Moving::new(log, &states, settings);
    let shape = model.parameters().shape_start();
    let lead = lead(log.rate_hz, alignment.delay_samples, alignment.delay_rate_hz);
    let predicted = predict_along(model, &shape, values, log, &states);
    drop(states);
    let filter = butterworth(4, filter_hz, log.rate_hz).map_err(conditioning)?;
    let driven: Vec<bool> =
        (0..log.effort.len()).map(|output| !model.is_undriven(output) && !log.held[output]).collect();
    let of_output = |(output, unaligned): (usize, Vec<f64>)| -> Result<(Vec<f64>, [ChannelSums; 5]), Error> {
        let measured = &log.effort[output];
        let agree = |measured: &[f64], predicted: &[f64], part: Part| {
            let is_of = |(counts, moves): (&bool, &bool)| *counts && part.holds(*moves);
            let counts: Vec<bool> = counted.iter().zip(&motion.samples[output]).map(is_of).collect();
            ChannelSums::of_counted(output, measured, predicted, &counts)
                .map_err(|e| too_short(e.to_string()))
        };
        let filtered = |predicted: &[f64]| {
            forward_backward_in_step(&filter, [measured, predicted]).map_err(conditioning)
        };
        let [measured_filtered, unaligned_filtered] = filtered(&unaligned)?;
        let unaligned_sums = agree(&measured_filtered, &unaligned_filtered, Part::All)?;
        drop(unaligned_filtered);
        let predicted = led(unaligned, lead)?;
        let raw = agree(measured, &predicted, Part::All)?;
        let predicted_filtered = forward_backward(&filter, &predicted).map_err(conditioning)?;
        let part = |part: Part| agree(&measured_filtered, &predicted_filtered, part);
        let sums = [raw, part(Part::All)?, unaligned_sums, part(Part::Moving)?, part(Part::Standing)?];
        Ok((predicted, sums))
    };
    let of_outputs = predicted.into_par_iter().enumerate().map(of_output).collect::<Vec<Result<_, Error>>>();
    let mut fits = [(); 5].map(|()| FitSums::default());
    let mut predicted = Vec::with_capacity(driven.len());
    for (outcome, driven) in of_outputs.into_iter().zip(&driven) {
        let (effort, sums) = outcome?;
        predicted.push(effort);
        fits.iter_mut().zip(&sums).for_each(|(fit, sums)| fit.add(sums, *driven));
    }
    let [raw, all, unaligned, moving, standing] = fits;
    let samples = counted.iter().filter(|c| **c).count() as f64;
    let stands = |moves: &Vec<bool>| moves.iter().zip(&counted).filter(|(m, c)| !**m && **c).count() as f64;
    Ok(Agreement {
        moving: moving.fit(),
        standing: standing.fit(),
        standing_share: motion.samples.iter().map(|moves| stands(moves) / samples).collect(),
        name: log.name.clone(),
        start: log.start,
        rate_hz: log.rate_hz,
        raw: raw.fit(),
        filtered: all.fit(),
        filtered_unaligned: unaligned.fit(),
        measured: log.effort.clone(),
        driven,
        predicted: predicted.into_iter().map(Arc::new).collect(),
        drawn: Vec::new(),
        moves: log.moves.clone(),
        motion,
        counted,
        filter_hz,
    })
}

/// An effort ahead by the lead of a log, samples.
fn led(signal: Vec<f64>, lead: f64) -> Result<Vec<f64>, Error> {
    match lead {
        0.0 => Ok(signal),
        _ => shift(&signal, lead).map(|led| led.values).map_err(conditioning),
    }
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

/// Samples at which a signal differs from another one; most do not.
#[derive(Debug, Clone, Default, PartialEq)]
struct Patches {
    /// Stretches that differ, ascending.
    stretches: Vec<Range<usize>>,
    /// Values on all stretches, one after the other.
    values: Vec<f64>,
}

impl Patches {
    fn between(of: &[f64], to: &[f64]) -> Patches {
        let mut out = Patches::default();
        for (k, _) in of.iter().zip(to).enumerate().filter(|(_, (of, to))| of != to) {
            match out.stretches.last_mut().filter(|last| last.end == k) {
                Some(last) => last.end += 1,
                None => out.stretches.push(k..k + 1),
            }
            out.values.push(to[k]);
        }
        out.values.shrink_to_fit();
        out
    }

    fn apply(&self, to: &[f64]) -> Vec<f64> {
        let mut out = to.to_vec();
        let mut rest = &self.values[..];
        for stretch in &self.stretches {
            let (own, others) = rest.split_at(stretch.len());
            out[stretch.clone()].copy_from_slice(own);
            rest = others;
        }
        out
    }
}

impl Agreement {
    /// Predicts once more for pictures, with what [`compare`] was given.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn draw(
        mut self,
        model: &dyn EffortModel,
        values: &[f64],
        log: &PreparedLog,
        alignment: &Alignment,
        settings: &ConditioningSettings,
    ) -> Result<Agreement, Error> {
        let states = States::of_motion(log, alignment.state_hz, settings)?.resting(&self.motion);
        let shape = model.parameters().shape_start();
        let still = predict_along(model, &shape, values, log, &states);
        drop(states);
        let lead = lead(log.rate_hz, alignment.delay_samples, alignment.delay_rate_hz);
        let drawn = still.into_par_iter().zip(&self.predicted);
        self.drawn = drawn
            .map(|(still, predicted)| Ok(Patches::between(predicted, &led(still, lead)?)))
            .collect::<Result<_, Error>>()?;
        Ok(self)
    }

    /// Prediction of an output as pictures show it, where that is not [`Agreement::predicted`], which all figures go by: where a joint stands,
    /// friction of velocity is left out, since the sign of its velocity is that of noise. `None` without [`Agreement::draw`] too.
    pub fn drawn(&self, output: usize) -> Option<Vec<f64>> {
        self.is_drawn_otherwise(output).then(|| self.drawn[output].apply(&self.predicted[output]))
    }

    /// Whether pictures show another prediction of an output than figures go by ([`Agreement::drawn`]).
    pub fn is_drawn_otherwise(&self, output: usize) -> bool {
        self.drawn.get(output).is_some_and(|patches| !patches.stretches.is_empty())
    }

    /// Measured effort of an output and its prediction as pictures show it, through the filter of the filtered figures; not a
    /// number near the ends and gaps, which do not count.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn in_band(&self, output: usize) -> Result<[Vec<f64>; 2], Error> {
        let filter = butterworth(4, self.filter_hz, self.rate_hz).map_err(conditioning)?;
        let drawn = self.drawn(output);
        let predicted = drawn.as_ref().unwrap_or(&self.predicted[output]);
        let filtered = forward_backward_in_step(&filter, [&self.measured[output], predicted]);
        Ok(filtered.map_err(conditioning)?.map(|mut signal| {
            signal
                .iter_mut()
                .zip(&self.counted)
                .filter(|(_, counts)| !**counts)
                .for_each(|(x, _)| *x = f64::NAN);
            signal
        }))
    }

    /// Figures of a prediction that lacks `lost` of each output's effort, through the same filter.
    ///
    /// # Errors
    /// [`Error::Conditioning`], [`Error::TooShort`].
    pub fn without(&self, lost: impl IndexedParallelIterator<Item = Vec<f64>>) -> Result<FileFit, Error> {
        let filter = butterworth(4, self.filter_hz, self.rate_hz).map_err(conditioning)?;
        let rms = |signal: &[f64]| rms_where(signal, &self.counted);
        let of_output = |(output, lost): (usize, Vec<f64>)| {
            let signals = [self.measured[output].as_slice(), &lost, &self.predicted[output]];
            let [measured, lost, whole] = forward_backward_in_step(&filter, signals).map_err(conditioning)?;
            let kept: Vec<f64> = whole.iter().zip(&lost).map(|(whole, lost)| whole - lost).collect();
            let sums = ChannelSums::of_counted(output, &measured, &kept, &self.counted)
                .map_err(|e| Error::TooShort { file: self.name.clone(), message: e.to_string() })?;
            Ok((sums, rms(&lost), rms(&measured)))
        };
        let of_outputs = lost.enumerate().map(of_output).collect::<Vec<Result<_, Error>>>();
        let (mut sums, mut loss, mut loss_percent) = (FitSums::default(), Vec::new(), Vec::new());
        for (outcome, driven) in of_outputs.into_iter().zip(&self.driven) {
            let (channel, own, of) = outcome?;
            sums.add(&channel, *driven);
            loss.push(own);
            loss_percent.push((of > 0.0).then(|| 100.0 * own / of));
        }
        let found = sums.fit();
        Ok(FileFit {
            rms: found.channels.iter().map(|c| c.rms).collect(),
            relative_error_per_joint: found.channels.iter().map(|c| c.relative_error).collect(),
            relative_error: found.relative_error,
            loss_percent,
            loss,
        })
    }
}

/// Share of the samples of a log that a joint must move in for the log to speak of its motion, where other logs do.
const MOTION: f64 = 0.05;

/// Share of the variance of an output's filtered effort that is explained where the joint moves, one entry per log that moves it. An
/// effort that never changes has none, and nothing to explain.
///
/// The variance is that within the log, or within all of the logs where that is greater: an effort that hardly changes in one log (another joint
/// was being tested) is explained by what is a small error elsewhere. Of a joint that moves in no log to speak of, all samples count.
pub(crate) fn explained_in_motion(agreements: &[&Agreement], output: usize) -> Vec<f64> {
    let shares = |sums: &[&ChannelSums]| -> Vec<f64> {
        let samples: usize = sums.iter().map(|s| s.samples).sum();
        let mean = sums.iter().map(|s| s.variation).sum::<f64>() / samples.max(1) as f64;
        let share = |s: &&ChannelSums| {
            let variation = s.variation.max(mean * s.samples as f64);
            (s.samples > 0 && s.range > 0.0 && variation > 0.0).then(|| 1.0 - s.error_energy / variation)
        };
        sums.iter().filter_map(share).collect()
    };
    let logs: Vec<&Agreement> = agreements.iter().copied().filter(|a| a.moves[output]).collect();
    let speaks = |a: &&&Agreement| 1.0 - a.standing_share[output] >= MOTION;
    let moving: Vec<&ChannelSums> =
        logs.iter().filter(speaks).map(|a| a.moving.sums.channel(output)).collect();
    match shares(&moving) {
        shares if !shares.is_empty() => shares,
        _ => shares(&logs.iter().map(|a| a.filtered.sums.channel(output)).collect::<Vec<_>>()),
    }
}

fn conditioning(e: dynid_motion::SignalError) -> Error {
    Error::Conditioning(e.into())
}

impl FitValues {
    /// Figures of so many joints of which nothing is known.
    pub fn unknown(joints: usize) -> Self {
        let none = || vec![None; joints];
        FitValues {
            rms: none(),
            nrmse: none(),
            r2: none(),
            correlation: none(),
            relative_error_per_joint: none(),
            relative_error: None,
        }
    }
}

impl From<&Fit> for FitValues {
    fn from(fit: &Fit) -> Self {
        FitValues {
            rms: fit.channels.iter().map(|c| c.rms).collect(),
            nrmse: fit.channels.iter().map(|c| c.nrmse).collect(),
            r2: fit.channels.iter().map(|c| c.r2).collect(),
            correlation: fit.channels.iter().map(|c| c.correlation).collect(),
            relative_error_per_joint: fit.channels.iter().map(|c| c.relative_error).collect(),
            relative_error: fit.relative_error,
        }
    }
}

/// Per-joint agreement, in the effort's unit.
#[derive(Debug, Clone, Default, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FitValues {
    /// Root mean square error per joint.
    pub rms: Vec<Option<f64>>,
    /// RMS over the range of the measured effort, per joint.
    pub nrmse: Vec<Option<f64>>,
    /// Coefficient of determination per joint.
    pub r2: Vec<Option<f64>>,
    /// Correlation coefficient between measured and predicted effort per joint, -1 to 1, blind to scale and offset of the
    /// prediction. Unknown for rows of factor files, which do not hold it; empty in files of earlier programs.
    #[serde(default)]
    pub correlation: Vec<Option<f64>>,
    /// `100 ‖residual‖ / ‖effort‖` per joint, percent.
    pub relative_error_per_joint: Vec<Option<f64>>,
    /// `100 ‖residual‖ / ‖effort‖` over all joints, percent.
    pub relative_error: Option<f64>,
}

/// Figures of a file on a log, per joint in joint order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FileFit {
    /// RMS of measured minus predicted effort.
    pub rms: Vec<Option<f64>>,
    /// `100 ‖measured - predicted‖/‖measured‖` per joint, percent.
    pub relative_error_per_joint: Vec<Option<f64>>,
    /// `100 ‖measured - predicted‖/‖measured‖` over all joints, percent.
    pub relative_error: Option<f64>,
    /// RMS of the identified model's effort minus the file's, in the effort's unit.
    pub loss: Vec<f64>,
    /// Loss in per cent of the RMS of the measured effort.
    pub loss_percent: Vec<Option<f64>>,
}
