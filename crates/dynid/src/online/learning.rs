//! What the first stretch of a stream teaches.

use std::path::Path;
use std::sync::Arc;

use dynid_estimate::consistent::Bound;
use dynid_estimate::linear::{LinearMethod, LinearSettings, estimate};
use dynid_factor::rows::{GroupShape, MemoryRows, Rows, reduce_rows};
use dynid_linalg::Mat;
use dynid_model::{BaseParameters, BaseSettings, EffortModel, RobotModel};
use dynid_motion::live::{LiveGrid, LiveSettings};
use dynid_motion::{Channel, JointSignals, Log};
use dynid_rows::conditioning::{
    ConditioningError, LiveRow, LiveRowSettings, LiveRows, PreparedLog, States, condition, prepare,
};

use super::asked::Asked;
use super::samples::Sample;
use super::usual::{EXTENTS, Innovations};
use crate::elements::ElementPlan;
use crate::log::{self, LogAxis};
use crate::pipeline::stated_values;
use crate::prior::{self, Prior};
use crate::{Error, advice, bounds, stiffness};

/// Rows per base parameter that a stretch must give.
const ROWS_PER_PARAMETER: usize = 3;
/// Complete samples of rows per output from which their covariance is taken; else outputs count as independent.
const SAMPLES_PER_OUTPUT: usize = 20;

/// The robot of a session and what is known of it without samples.
#[derive(Debug)]
pub(super) struct Structure {
    pub(super) model: Arc<RobotModel>,
    pub(super) shape: Vec<f64>,
    pub(super) base: BaseParameters,
    pub(super) regrouping: Mat,
    pub(super) bounds: Vec<Bound>,
    pub(super) stated: Vec<Option<f64>>,
    pub(super) warnings: Vec<String>,
}

impl Structure {
    /// `still`: joints without columns.
    pub(super) fn new(asked: &Asked, still: &[String]) -> Result<Structure, Error> {
        let mut robot = asked.robot.clone();
        if !still.is_empty() {
            let still: Vec<(String, f64)> = still.iter().map(|name| (name.clone(), 0.0)).collect();
            robot = robot.locked(&still)?;
        }
        let plan = ElementPlan::of_run(&asked.settings, &robot, |rate| robot.is_driven(rate))?;
        let model = plan.tied_model(&robot.mechanism)?;
        let shape = model.parameters().shape_start();
        let settings = BaseSettings { seed: asked.settings.seed.unwrap_or(1), ..BaseSettings::default() };
        let base = BaseParameters::of_model(&model, &shape, &settings);
        if base.is_empty() {
            return Err(Error::Unsupported("no parameter of this robot acts on any effort".to_owned()));
        }
        let mut warnings = robot.warnings.clone();
        warnings.extend(robot.clearance_warnings());
        warnings.extend(plan.alike(&robot.mechanism).iter().map(ToString::to_string));
        warnings.extend(stiffness::of_rows_alone(&plan));
        Ok(Structure {
            regrouping: advice::regrouping(&base),
            bounds: bounds::rows(&asked.settings.bound, &model)?,
            stated: stated_values(&model, &plan),
            model: Arc::new(model),
            shape,
            base,
            warnings,
        })
    }

    /// What a stream has columns for.
    pub(super) fn axes(&self) -> Vec<LogAxis> {
        log::axes(&self.model)
    }

    /// Joints in the order of the outputs.
    pub(super) fn joints(&self) -> Vec<String> {
        self.model.outputs().iter().map(|o| o.name.clone()).collect()
    }
}

/// What was learned; everything that follows depends on the stream through this alone.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Learned {
    pub(super) rows: LiveRowSettings,
    /// Base parameters before any sample, and their deviations.
    pub(super) start: Vec<f64>,
    pub(super) prior_std: Vec<f64>,
    /// Per output: 99 % of `|effort|` lies below.
    pub(super) efforts: Vec<f64>,
    /// Covariance of a sample's rows, row by row.
    pub(super) noise: Vec<f64>,
    /// What innovations are usual.
    pub(super) innovations: Innovations,
}

impl Learned {
    /// Learns from samples. The inner error says why the stretch does not suffice.
    pub(super) fn from_samples(
        asked: &Asked,
        structure: &Structure,
        name: &str,
        samples: &[Sample],
    ) -> Result<Result<Learned, String>, Error> {
        let model = &*structure.model;
        let settings = asked.settings.conditioning_settings();
        let prepared = match prepare(&log(name, model, samples)?, model, &settings) {
            Ok(prepared) => prepared,
            Err(reason) => return insufficient(reason),
        };
        asked.settings.check_cutoffs(name, prepared.rate_hz)?;
        let logs = [prepared];
        let found = condition(model, &structure.shape, &structure.base.kept, &logs, &settings, &mut |_| {});
        let choices = match found {
            Ok(choices) => choices,
            Err(reason) => return insufficient(reason),
        };
        let [prepared] = logs;
        let states = States::new(&prepared, choices.state_hz[0], &settings)?;
        let least_speed = (0..model.outputs().len())
            .map(|output| match choices.mask[output] {
                Some(level) => states.reversal_thresholds(model, output, level, settings.stick_sigma),
                None => Vec::new(),
            })
            .collect();
        let rows = LiveRowSettings {
            states: LiveSettings {
                rate_hz: prepared.rate_hz,
                state_hz: choices.state_hz[0],
                delay_samples: choices.delay.samples,
            },
            kernel_hz: choices.kernel_hz,
            least_speed,
        };
        let efforts = effort_sizes(&prepared);
        let prior = structure.prior(&efforts, &asked.robot.path)?;
        let (start, prior_std) = structure.base_prior(&prior);
        let live = live_rows(structure, &rows, samples)?;
        let enough = ROWS_PER_PARAMETER * structure.base.len();
        let used: usize = live.iter().map(|row| row.usable.iter().filter(|u| **u).count()).sum();
        if used < enough {
            return Ok(Err(format!("expected at least {enough} usable rows, found {used}")));
        }
        let Some(noise) = noise(structure, &live)? else {
            return Ok(Err("an output has no usable rows".to_owned()));
        };
        let innovations = Innovations::stated(model.outputs().len());
        Ok(Ok(Learned { rows, start, prior_std, efforts, noise, innovations }))
    }

    /// Whether lengths and numbers are those of a learned stretch of this robot.
    pub(super) fn fits(&self, structure: &Structure) -> bool {
        let (p, outputs) = (structure.base.len(), structure.model.outputs().len());
        let finite = |list: &[f64]| list.iter().all(|x| x.is_finite());
        let positive = |list: &[f64]| list.iter().all(|x| x.is_finite() && *x > 0.0);
        let states = &self.rows.states;
        [self.start.len(), self.prior_std.len()] == [p, p]
            && self.efforts.len() == outputs
            && self.noise.len() == outputs * outputs
            && finite(&self.start)
            && positive(&self.prior_std)
            && finite(&self.efforts)
            && finite(&self.noise)
            && self.innovations.size.len() == outputs * EXTENTS
            && positive(&self.innovations.size)
            && positive(&[self.innovations.inflation])
            && self.innovations.every > 0
            && positive(&[states.rate_hz, states.state_hz, self.rows.kernel_hz])
    }

    /// Rows in this way.
    pub(super) fn live_rows(&self, structure: &Structure) -> Result<LiveRows, Error> {
        let model: Arc<dyn EffortModel> = structure.model.clone();
        LiveRows::new(model, &structure.shape, &structure.base.kept, &self.rows).map_err(signal_fault)
    }

    /// A grid for samples of this stream.
    pub(super) fn grid(&self, structure: &Structure) -> Result<LiveGrid, Error> {
        let width = 2 * structure.model.outputs().len() + structure.model.channels().len();
        LiveGrid::new(self.rows.states.rate_hz, width).map_err(signal_fault)
    }
}

impl Structure {
    /// Prior of the standard parameters for efforts of this size.
    pub(super) fn prior(&self, efforts: &[f64], file: &Path) -> Result<Prior, Error> {
        Ok(prior::of(&self.model, &self.stated, efforts, &file.display().to_string())?)
    }

    /// Prior of the base parameters, correlations left out.
    fn base_prior(&self, prior: &Prior) -> (Vec<f64>, Vec<f64>) {
        let start = self.base.values(&prior.values);
        let std = (0..self.base.len())
            .map(|row| {
                let parts =
                    prior.std.iter().enumerate().map(|(c, s)| (self.regrouping[(row, c)] * s).powi(2));
                parts.sum::<f64>().sqrt()
            })
            .collect();
        (start, std)
    }
}

fn insufficient<T>(reason: ConditioningError) -> Result<Result<T, String>, Error> {
    match reason {
        // A longer stretch may hold what this one lacks.
        ConditioningError::NothingMoves { .. }
        | ConditioningError::ConstantEffort { .. }
        | ConditioningError::NoRows { .. }
        | ConditioningError::Signal(_) => Ok(Err(reason.to_string())),
        other => Err(other.into()),
    }
}

pub(super) fn signal_fault(source: dynid_motion::SignalError) -> Error {
    ConditioningError::Signal(source).into()
}

fn log(name: &str, model: &RobotModel, samples: &[Sample]) -> Result<Log, Error> {
    let outputs = model.outputs().len();
    let list = |k: usize| samples.iter().map(|s| s.values[k]).collect::<Vec<f64>>();
    let joints = (0..outputs).map(|k| JointSignals {
        name: model.outputs()[k].name.clone(),
        position: list(k),
        velocity: None,
        effort: list(outputs + k),
    });
    let channels = model.channels().iter().enumerate();
    let channels = channels.map(|(k, name)| Channel { name: name.clone(), values: list(2 * outputs + k) });
    let time = samples.iter().map(|s| s.time).collect();
    Ok(Log::new(name, time, joints.collect(), channels.collect())?)
}

fn effort_sizes(log: &PreparedLog) -> Vec<f64> {
    crate::pipeline::effort_sizes(std::slice::from_ref(log))
}

/// All rows of the stretch.
fn live_rows(
    structure: &Structure,
    settings: &LiveRowSettings,
    samples: &[Sample],
) -> Result<Vec<LiveRow>, Error> {
    let model: Arc<dyn EffortModel> = structure.model.clone();
    let mut rows =
        LiveRows::new(model, &structure.shape, &structure.base.kept, settings).map_err(signal_fault)?;
    let width = samples.first().map_or(0, |s| s.values.len());
    let mut grid = LiveGrid::new(settings.states.rate_hz, width).map_err(signal_fault)?;
    let mut out = Vec::new();
    for sample in samples {
        grid.push(sample.time, &sample.values, |s| {
            rows.push(s.time, s.values, s.first, |row| out.push(row.clone()));
        });
    }
    rows.drain(|row| out.push(row.clone()));
    Ok(out)
}

/// Covariance of the rows of a sample, from the residuals of weighted least squares; `None` if an output has no rows.
fn noise(structure: &Structure, live: &[LiveRow]) -> Result<Option<Vec<f64>>, Error> {
    let outputs = structure.model.outputs().len();
    let columns: Vec<usize> = (0..structure.base.len()).collect();
    let mut rows = MemoryRows::new();
    for output in 0..outputs {
        let group =
            rows.add_group(GroupShape { log: 0, output, scale: 0, columns: columns.clone(), blocks: 1 });
        let used: Vec<(usize, &LiveRow)> =
            live.iter().enumerate().filter(|(_, row)| row.usable[output]).collect();
        if used.is_empty() {
            return Ok(None);
        }
        rows.push(
            group,
            &Rows {
                block: 0,
                samples: &used.iter().map(|(k, _)| *k).collect::<Vec<_>>(),
                regressor: &columns
                    .iter()
                    .flat_map(|c| used.iter().map(|(_, row)| row.columns[output][*c]))
                    .collect::<Vec<_>>(),
                stride: used.len(),
                effort: &used.iter().map(|(_, row)| row.effort[output]).collect::<Vec<_>>(),
            },
        );
    }
    let groups =
        reduce_rows(&rows).map_err(|e| ConditioningError::Rows { output: e.group, source: e.source })?;
    let fit = estimate(&groups, Some(&rows), columns.len(), &LinearMethod::Wls, &LinearSettings::default())?;
    let residual = |row: &LiveRow, output: usize| -> f64 {
        row.effort[output] - row.columns[output].iter().zip(&fit.x).map(|(w, x)| w * x).sum::<f64>()
    };
    let complete: Vec<&LiveRow> = live.iter().filter(|row| row.usable.iter().all(|u| *u)).collect();
    let mut noise = vec![0.0; outputs * outputs];
    let variance: Vec<f64> = fit.groups.iter().map(|g| g.variance).collect();
    if complete.len() >= SAMPLES_PER_OUTPUT * outputs {
        for row in &complete {
            let e: Vec<f64> = (0..outputs).map(|o| residual(row, o)).collect();
            for i in 0..outputs {
                for j in 0..outputs {
                    noise[i * outputs + j] += e[i] * e[j] / complete.len() as f64;
                }
            }
        }
        // Correlations of the complete samples, variances of all rows.
        let own: Vec<f64> = (0..outputs).map(|o| noise[o * outputs + o]).collect();
        for i in 0..outputs {
            for j in 0..outputs {
                let size = (own[i] * own[j]).sqrt();
                let correlation = if size > 0.0 { noise[i * outputs + j] / size } else { 0.0 };
                noise[i * outputs + j] = match i == j {
                    true => variance[i],
                    false => LARGEST_CORRELATION * correlation * (variance[i] * variance[j]).sqrt(),
                };
            }
        }
    } else {
        (0..outputs).for_each(|o| noise[o * outputs + o] = variance[o]);
    }
    Ok(Some(noise))
}

/// Correlations of residuals are taken at this share, so that their covariance stays far from singular.
const LARGEST_CORRELATION: f64 = 0.9;
