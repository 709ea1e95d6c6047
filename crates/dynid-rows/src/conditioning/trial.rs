//! Fits for choices: one pass over the logs, then any number of fits with other masks, delays and columns.

use super::friction_shape::{FrictionShape, ShapeKind};
use super::gram::{Classes, Gram, GramConsumer, Group, Lags, RowClass, rss, solve};
use super::rows::{KeptColumns, Kernels, Pass, masks};
use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog};
use dynid_model::EffortModel;
use dynid_motion::cutoff::{StateLimit, kernel_scales, state_cutoff};
use rayon::prelude::*;

/// Sums of one kernel candidate.
pub(crate) struct Trial {
    pub(crate) kernel_hz: f64,
    pub(crate) state_hz: Vec<f64>,
    pub(crate) scales_hz: Vec<f64>,
    pub(crate) lags: Lags,
    pub(crate) columns: KeptColumns,
    /// Per output: number of friction shapes with columns.
    shapes: Vec<usize>,
    /// Per output.
    classes: Vec<Classes>,
    /// Per output and rung: share of samples that stay usable.
    pub(crate) coverage: Vec<Vec<f64>>,
    /// Per output: share of samples in which it moves.
    moving: Vec<f64>,
    folds: usize,
}

/// What a fit uses.
#[derive(Debug, Clone)]
pub(crate) struct Choice {
    /// Per output: rung of the mask ladder, 0 = no mask.
    pub(crate) rung: Vec<usize>,
    /// Delay, samples.
    pub(crate) delay: f64,
    /// Per output: which friction shapes take part, by their place among the trial's.
    pub(crate) shapes: Vec<Vec<usize>>,
    /// With one unknown per output for the rest of the delay.
    pub(crate) free_delay: bool,
}

/// Share of the time from which on a joint rests for long.
const RESTS: f64 = 0.25;
/// Number of probe shapes.
pub(crate) const PROBES: usize = 3;

/// Friction shapes whose columns a trial sums beside the model's.
#[derive(Debug, Clone, Copy)]
pub(crate) enum TrialShapes<'a> {
    /// `|v|`, Stribeck and tanh with a quarter and the whole of the log's rms speed: enough to tell whether a kernel or a
    /// missing friction shape spoils a fit.
    Probes,
    /// Per output; `load`: linear parameters whose effort is the load of [`ShapeKind::Load`].
    Library { shapes: &'a [Vec<FrictionShape>], load: &'a [f64] },
}

impl TrialShapes<'_> {
    /// The shapes of every output, the same in all logs: their columns are one unknown.
    fn of_logs(self, logs: &[PreparedLog], outputs: usize) -> Vec<Vec<FrictionShape>> {
        match self {
            TrialShapes::Library { shapes, .. } => shapes.to_vec(),
            TrialShapes::Probes => (0..outputs).map(|output| probes(rms_speed(logs, output))).collect(),
        }
    }
}

fn probes(rms_speed: f64) -> Vec<FrictionShape> {
    let shapes = [
        (ShapeKind::ViscousMagnitude, 1.0),
        (ShapeKind::Stribeck, 0.25 * rms_speed),
        (ShapeKind::Tanh, rms_speed),
    ];
    shapes.map(|(kind, value)| FrictionShape { kind, value }).to_vec()
}

/// Root mean square speed of an output over the logs that move it; 1 rad/s or m/s where none does.
fn rms_speed(logs: &[PreparedLog], output: usize) -> f64 {
    let (mut square, mut seconds) = (0.0, 0.0);
    for log in logs.iter().filter(|log| log.moves[output]) {
        square += log.duration() * log.position_noise[output].velocity_variance;
        seconds += log.duration();
    }
    if square > 0.0 { (square / seconds).sqrt() } else { 1.0 }
}

impl Trial {
    /// Runs over all logs with one kernel.
    #[expect(clippy::too_many_arguments, reason = "one call site; the arguments are the whole problem")]
    pub(crate) fn new(
        model: &dyn EffortModel,
        shape: &[f64],
        kept: &[usize],
        logs: &[PreparedLog],
        kernel_hz: f64,
        limit: StateLimit,
        delay_limits: (f64, f64),
        shapes: TrialShapes<'_>,
        settings: &ConditioningSettings,
    ) -> Result<Trial, ConditioningError> {
        let columns = KeptColumns::new(model, kept);
        let outputs = model.outputs().len();
        let load = match shapes {
            TrialShapes::Library { load, .. } => load,
            TrialShapes::Probes => &[],
        };
        let mut classes: Vec<Classes> = vec![Classes::new(); outputs];
        let mut coverage: Vec<Vec<f64>> = vec![Vec::new(); outputs];
        let mut moving = vec![0.0; outputs];
        let mut state_hz = Vec::new();
        let slowest = logs.iter().map(|l| l.rate_hz).fold(f64::INFINITY, f64::min);
        let scales_hz = scales(kernel_hz, limit, slowest, settings);
        let lags = Lags::new(delay_limits.0, delay_limits.1, kernel_hz, slowest);
        let total: f64 = logs.iter().map(|l| l.samples() as f64).sum();
        let shapes = shapes.of_logs(logs, outputs);
        for log in logs {
            let cutoff = state_hz_of(kernel_hz, limit, log.rate_hz, settings);
            state_hz.push(cutoff);
            let states = States::new(log, cutoff, settings)?;
            let masks = masks(log, &states, model, settings);
            let kernels = Kernels::new(&scales_hz, &states, lags.reach())?;
            for (output, mask) in masks.iter().enumerate() {
                let share = log.samples() as f64 / total;
                moving[output] += mask.moving() as f64 / total;
                let own = kernels.coverage(mask, log.samples());
                coverage[output].resize(own.len(), 0.0);
                for (c, o) in coverage[output].iter_mut().zip(own) {
                    *c += share * o;
                }
            }
            let mut consumers: Vec<GramConsumer<'_>> = (0..outputs)
                .map(|j| GramConsumer::new(log, &states.effort[j], &kernels.kernels, lags, settings.folds))
                .collect();
            let wanted = vec![u8::MAX; outputs];
            Pass {
                load,
                model,
                shape,
                columns: &columns,
                log,
                states: &states,
                instruments: None,
                masks: &masks,
                kernels: &kernels,
                wanted: &wanted,
                shapes: &shapes,
            }
            .run(&mut consumers)
            .map_err(|e| ConditioningError::Rows { output: e.group, source: e.source })?;
            for (all, consumer) in classes.iter_mut().zip(consumers) {
                for (class, gram) in consumer.classes {
                    all.entry(class).or_insert_with(|| Gram::zero(gram.size)).add(&gram);
                }
            }
        }
        Ok(Trial {
            kernel_hz,
            state_hz,
            scales_hz,
            lags,
            columns,
            shapes: shapes.iter().map(Vec::len).collect(),
            classes,
            coverage,
            moving,
            folds: settings.folds,
        })
    }

    pub(crate) fn outputs(&self) -> usize {
        self.classes.len()
    }

    /// Rows without a mask, over all outputs.
    pub(crate) fn rows(&self) -> f64 {
        self.classes.iter().flat_map(|c| c.values()).map(|g| g.rows).sum()
    }

    pub(crate) fn folds(&self) -> usize {
        self.folds
    }

    /// Whether a joint rests for a quarter of the time or longer.
    pub(crate) fn rests(&self, output: usize) -> bool {
        self.moving[output] <= 1.0 - RESTS
    }

    /// The strictest rung of an output, not stricter than asked for, that keeps the wanted share of the samples in which it moves: those in
    /// which it stands are no motion that a mask could keep.
    pub(crate) fn allowed(&self, output: usize, rung: usize, least: f64) -> usize {
        let least = least * self.moving[output];
        (0..=rung).rev().find(|r| least > 0.0 && self.coverage[output][*r] >= least).unwrap_or(0)
    }

    /// Place of an output's first friction shape among the unknowns: base columns come first, then the shapes of all
    /// outputs, then per output the rest of the delay.
    fn first_shape(&self, choice: &Choice, output: usize) -> usize {
        self.columns.total + choice.shapes[..output].iter().map(Vec::len).sum::<usize>()
    }

    fn unknowns(&self, choice: &Choice) -> usize {
        let outputs = self.outputs();
        self.first_shape(choice, outputs) + if choice.free_delay { outputs } else { 0 }
    }

    /// Index of the unknown that is the rest of an output's delay.
    fn delay_unknown(&self, choice: &Choice, output: usize) -> usize {
        self.first_shape(choice, self.outputs()) + output
    }

    /// The effort `delay` samples earlier and its derivative by the delay, as combinations of an output's columns.
    fn efforts(&self, output: usize, delay: f64) -> [Vec<(usize, f64)>; 2] {
        let first = self.columns.global[output].len() + self.shapes[output];
        self.lags.weights(delay).map(|w| w.into_iter().map(|(k, f)| (first + k, f)).collect())
    }

    /// Columns and unknowns of an output under a choice.
    fn columns_of(&self, output: usize, choice: &Choice) -> (Vec<Vec<(usize, f64)>>, Vec<usize>) {
        let own = self.columns.global[output].len();
        let mut columns: Vec<Vec<(usize, f64)>> = (0..own).map(|k| vec![(k, 1.0)]).collect();
        let mut unknowns = self.columns.global[output].clone();
        let first = self.first_shape(choice, output);
        for (place, k) in choice.shapes[output].iter().enumerate() {
            columns.push(vec![(own + k, 1.0)]);
            unknowns.push(first + place);
        }
        let [value, slope] = self.efforts(output, choice.delay);
        if choice.free_delay {
            columns.push(slope.into_iter().map(|(k, f)| (k, -f)).collect());
            unknowns.push(self.delay_unknown(choice, output));
        }
        columns.push(value);
        (columns, unknowns)
    }

    /// Returns the trial with the columns of some of its friction shapes, per output.
    pub(crate) fn with_shapes(&self, shapes: &[Vec<usize>]) -> Trial {
        let classes = self
            .classes
            .par_iter()
            .zip(shapes)
            .enumerate()
            .map(|(output, (classes, kept))| {
                let own = self.columns.global[output].len();
                let first_lag = own + self.shapes[output];
                let columns: Vec<usize> = (0..own)
                    .chain(kept.iter().map(|k| own + k))
                    .chain(first_lag..first_lag + self.lags.count)
                    .collect();
                classes.iter().map(|(class, gram)| (*class, gram.selected(&columns))).collect()
            })
            .collect();
        Trial {
            kernel_hz: self.kernel_hz,
            state_hz: self.state_hz.clone(),
            scales_hz: self.scales_hz.clone(),
            lags: self.lags,
            columns: self.columns.clone(),
            shapes: shapes.iter().map(Vec::len).collect(),
            classes,
            coverage: self.coverage.clone(),
            moving: self.moving.clone(),
            folds: self.folds,
        }
    }

    /// Sums of an output at one rung and delay, per time block: `[base columns, friction shapes, effort]`.
    pub(crate) fn block_sums(&self, output: usize, rung: usize, delay: f64) -> BlockSums {
        let shaped = self.columns.global[output].len() + self.shapes[output];
        let [effort, _] = self.efforts(output, delay);
        let columns: Vec<Vec<(usize, f64)>> = (0..shaped).map(|k| vec![(k, 1.0)]).chain([effort]).collect();
        let combined = |sums: Vec<Option<Gram>>| -> Vec<Gram> {
            sums.iter()
                .map(|s| s.as_ref().map_or_else(|| Gram::zero(shaped + 1), |s| s.combined(&columns)))
                .collect()
        };
        let per_fold: Vec<Vec<Gram>> =
            (0..self.folds).map(|fold| combined(self.sum(output, rung, |c| c.fold == fold))).collect();
        let without = |left_out: Option<usize>| -> Vec<Gram> {
            let mut sums = vec![Gram::zero(shaped + 1); self.scales_hz.len()];
            for (_, grams) in per_fold.iter().enumerate().filter(|(fold, _)| Some(*fold) != left_out) {
                sums.iter_mut().zip(grams).for_each(|(s, g)| s.add(g));
            }
            sums
        };
        let scored = (0..self.folds)
            .map(|fold| {
                let mut sum = Gram::zero(shaped + 1);
                combined(self.sum(output, rung, |c| c.scored && c.fold == fold))
                    .iter()
                    .for_each(|g| sum.add(g));
                sum
            })
            .collect();
        BlockSums { without: (0..self.folds).map(|f| without(Some(f))).collect(), all: without(None), scored }
    }

    fn sum(&self, output: usize, rung: usize, keep: impl Fn(&RowClass) -> bool) -> Vec<Option<Gram>> {
        let mut sums: Vec<Option<Gram>> = vec![None; self.scales_hz.len()];
        for (class, gram) in &self.classes[output] {
            if class.rungs >> rung & 1 == 1 && keep(class) {
                match &mut sums[class.scale] {
                    Some(sum) => sum.add(gram),
                    none => *none = Some(gram.clone()),
                }
            }
        }
        sums
    }

    /// Weighted fit on all time blocks but one (or on all).
    pub(crate) fn fit(&self, choice: &Choice, without: Option<usize>) -> Vec<f64> {
        let mut groups = Vec::new();
        for output in 0..self.outputs() {
            let (columns, unknowns) = self.columns_of(output, choice);
            for gram in self.sum(output, choice.rung[output], |c| Some(c.fold) != without).iter().flatten() {
                groups.push(Group { gram: gram.combined(&columns), unknowns: unknowns.clone() });
            }
        }
        solve(&groups, self.unknowns(choice), 3).0
    }

    /// Mean square residual of every output on the scored rows of one time block at the rungs given; `None` without rows.
    pub(crate) fn score(
        &self,
        choice: &Choice,
        x: &[f64],
        rows_at: &[usize],
        fold: usize,
    ) -> Vec<Option<f64>> {
        (0..self.outputs())
            .map(|output| {
                let (columns, unknowns) = self.columns_of(output, choice);
                let (mut sum, mut rows) = (0.0, 0.0);
                for gram in self.sum(output, rows_at[output], |c| c.scored && c.fold == fold).iter().flatten()
                {
                    sum += rss(&gram.combined(&columns), &unknowns, x);
                    rows += gram.rows;
                }
                (rows > 0.0).then(|| sum / rows)
            })
            .collect()
    }

    /// Rest of the delay of every output, samples.
    pub(crate) fn delay_rests(&self, choice: &Choice, without: Option<usize>) -> Vec<f64> {
        let x = self.fit(choice, without);
        (0..self.outputs()).map(|output| x[self.delay_unknown(choice, output)]).collect()
    }
}

/// Sums of one output over time blocks, columns `[base columns, friction shapes, effort]`.
#[derive(Debug)]
pub(crate) struct BlockSums {
    /// Per time block left out and kernel scale.
    pub(crate) without: Vec<Vec<Gram>>,
    /// Per kernel scale.
    pub(crate) all: Vec<Gram>,
    /// Per time block: rows whose kernel lies in it, all scales.
    pub(crate) scored: Vec<Gram>,
}

/// State cut-off of a log for a kernel, Hz.
pub fn state_hz_of(kernel_hz: f64, limit: StateLimit, rate_hz: f64, settings: &ConditioningSettings) -> f64 {
    settings
        .state_hz
        .unwrap_or_else(|| state_cutoff(kernel_hz, limit, rate_hz, &settings.cutoff))
        .min(settings.cutoff.state_rate * rate_hz)
}

/// Cut-off of the states behind predictions, Hz: the least of what logs have where the noise of their velocity is not looked at.
///
/// A kernel takes the noise of accelerations away after the state filter; a prediction has none, and its accelerations would be noise
/// where the velocities still are not.
pub fn prediction_hz_of(
    kernel_hz: f64,
    limit: StateLimit,
    rates_hz: impl Iterator<Item = f64>,
    settings: &ConditioningSettings,
) -> f64 {
    let limit = StateLimit { velocity_hz: 0.0, ..limit };
    rates_hz.map(|rate| state_hz_of(kernel_hz, limit, rate, settings)).fold(f64::INFINITY, f64::min)
}

/// Kernel cut-offs used together.
pub(crate) fn scales(
    kernel_hz: f64,
    limit: StateLimit,
    rate_hz: f64,
    settings: &ConditioningSettings,
) -> Vec<f64> {
    let state = state_hz_of(kernel_hz, limit, rate_hz, settings);
    kernel_scales(kernel_hz, state, rate_hz, &settings.cutoff)
}
