//! The recorded motion once more, without noise.

use std::sync::Arc;

use dynid_estimate::consistent as bodies;
use dynid_estimate::instruments::{IterationEnd, Simulated};
use dynid_factor::Factor;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{RowSource, reduce_rows};
use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::{ConditioningError, LogRows, paired_textbook_rows};
use dynid_sim::{
    ControlSettings, ExperimentSettings, Imperfections, Plant, Profile, SimError, Truth, Wanted, run,
};

use super::Loop;
use super::reference::Reference;
use crate::elements::{LOAD, REACTION_FRICTION};
use crate::problem::Problem;
use crate::robot::{refuse_elastic, refuse_loops};
use crate::settings::{ClosedLoop, Method, NominalModel};
use crate::structure::Structure;
use crate::{Error, bounds, consistency, fitting, shape};

/// Largest local error of the integration ...
const TOLERANCE: f64 = 1e-6;
/// ... and, where positions are what is fitted, as a share of their noise, down to the least.
const TOLERANCE_OF_NOISE: f64 = 0.03;
const LEAST_TOLERANCE: f64 = 1e-8;
/// Least control rate that is chosen where none is stated, Hz.
const LEAST_CONTROL_RATE: f64 = 1000.0;
/// Pull of the prior on the simulated parameters: that of a Gaussian prior.
const PRIOR_WEIGHT: f64 = 1.0;

/// A simulation of all logs.
pub(super) struct Driven {
    /// Parameters of the model of the fit that were simulated.
    pub(super) values: Vec<f64>,
    pub(super) logs: Vec<Moved>,
}

/// The motion of one log, signals by output.
pub(super) struct Moved {
    pub(super) q: Vec<Vec<f64>>,
    pub(super) dq: Vec<Vec<f64>>,
    pub(super) ddq: Vec<Vec<f64>>,
    /// Position and velocity gains of the controller.
    pub(super) gains: Vec<(f64, f64)>,
}

/// Everything that a simulation of the logs takes.
pub(super) struct Bench<'a> {
    pub(super) table: &'a ClosedLoop,
    pub(super) closed: &'a Loop<'a>,
    references: Vec<Reference>,
    bounds: Vec<bodies::Bound>,
    pub(super) shape: Vec<f64>,
}

impl<'a> Bench<'a> {
    /// # Errors
    /// [`Error::Unsupported`] for robots that are not simulated in closed loop, and those of references.
    pub(super) fn new(table: &'a ClosedLoop, closed: &'a Loop<'a>) -> Result<Self, Error> {
        let what = "simulated in closed loop";
        let Problem { robot, plan, model, logs, training, settings, .. } = closed.problem;
        refuse_elastic(robot, what)?;
        if plan.has_journals() {
            return Err(Error::Unsupported(format!(
                "joints with clearance are not {what}: `clearance = \"ideal\"` under `[elements]` takes them as ideal, or leave out \
                 `[instruments]`"
            )));
        }
        refuse_loops(robot, what)?;
        if plan.has_reactions() {
            return Err(Error::Unsupported(format!(
                "`{REACTION_FRICTION}` is not {what}: state other friction (`elements.friction`) or leave out `[instruments]`"
            )));
        }
        if plan.per_rate.iter().flatten().any(|name| name == LOAD) {
            return Err(Error::Unsupported(format!(
                "`{LOAD}` friction depends on accelerations through its load, for which the equation of motion has no form: \
                 state other friction (`elements.friction`) or leave out `[instruments]`"
            )));
        }
        let held = logs.iter().find_map(|log| Some((log, log.held.iter().position(|held| *held)?)));
        if let Some((log, output)) = held {
            let (log, joint) = (log.name.clone(), model.outputs()[output].name.clone());
            return Err(ConditioningError::ConstantEffort { log, joint }.into());
        }
        let references = training
            .iter()
            .zip(logs.iter())
            .map(|(stated, log)| Reference::of(stated.reference.as_ref(), model, log))
            .collect::<Result<_, _>>()?;
        Ok(Bench {
            table,
            closed,
            references,
            bounds: [bounds::rows(&settings.bound, model)?, closed.power.bounds.clone()].concat(),
            shape: model.parameters().shape_start(),
        })
    }

    /// Measured rows, one factor per group and time block.
    pub(super) fn measured(&self) -> Result<Vec<ReducedGroup>, Error> {
        let rows = fitting::rows(self.closed.problem, self.closed.conditioning)?;
        reduce_rows(&*rows).map_err(|e| fitting::conditioning_fault(&*rows, e))
    }

    /// Rows paired with the regressor of a simulation with the parameters that a factor of base columns determines.
    pub(super) fn simulated(&self, factor: &Factor) -> Result<Simulated, Error> {
        match self.moved(factor)? {
            Ok(driven) => Ok(Simulated::Rows(self.paired(driven)?)),
            Err(diverged) => Ok(diverged.into()),
        }
    }

    fn paired(&self, driven: Driven) -> Result<Vec<ReducedGroup>, Error> {
        let motions: Vec<Vec<Vec<f64>>> = driven.logs.into_iter().map(|log| log.q).collect();
        let Problem { model, structure, logs, settings, .. } = self.closed.problem;
        let (kept, conditioned) = (&structure.base.kept, settings.conditioning_settings());
        let rows: Box<dyn RowSource> = match self.closed.conditioning {
            Some(found) => {
                let rows = LogRows::new(model, &self.shape, kept, logs, found, &conditioned)?;
                Box::new(rows.with_instruments(&motions, &conditioned)?)
            }
            None => {
                let route = settings.textbook_route();
                Box::new(paired_textbook_rows(
                    model,
                    &self.shape,
                    kept,
                    logs,
                    &route,
                    &motions,
                    &conditioned,
                )?)
            }
        };
        reduce_rows(&*rows).map_err(|e| fitting::conditioning_fault(&*rows, e))
    }

    /// Simulates all logs with the parameters that a factor of base columns determines.
    pub(super) fn moved(&self, factor: &Factor) -> Result<Result<Driven, Diverged>, Error> {
        self.moved_with(factor, None)
    }

    /// The same; `noise`: seed of encoder noise as large as that of the logs.
    pub(super) fn moved_with(
        &self,
        factor: &Factor,
        noise: Option<u64>,
    ) -> Result<Result<Driven, Diverged>, Error> {
        let of_fit = self.possible(factor)?;
        let (model, values) = self.unfolded(&of_fit)?;
        let model = Arc::new(model);
        let nominal = match self.table.nominal {
            NominalModel::Identified => values.clone(),
            NominalModel::RobotFile => self.unfolded(&self.closed.problem.structure.prior.values)?.1,
        };
        let shape = model.parameters().shape_start();
        let plant =
            |values: Vec<f64>| Plant::new(model.clone(), values, shape.clone(), self.table.sign_width);
        let (mut moved, believed) = (plant(values)?, plant(nominal)?);
        let mut logs = Vec::with_capacity(self.references.len());
        for (log, reference) in self.references.iter().enumerate() {
            let mut experiment = self.experiment(&model, log)?;
            if let Some(seed) = noise {
                let sigma = self.closed.problem.logs[log].position_noise.iter().map(|n| n.sigma);
                experiment.imperfections.joint_encoder_noise = sigma.collect();
                experiment.seed = seed;
            }
            let wanted = |time: f64| self.wanted(reference, time);
            let found = match run(&mut moved, &believed, &wanted, &experiment) {
                Ok(result) => {
                    let Truth { q, dq, ddq, .. } = result.log.truth;
                    Moved { q, dq, ddq, gains: result.gains }
                }
                Err(SimError::TooFast { .. } | SimError::Inertia { .. }) => {
                    return Ok(Err(Diverged { log, output: 0, distance: f64::INFINITY }));
                }
                Err(other) => return Err(other.into()),
            };
            match self.diverged(log, reference, &found.q) {
                Some(diverged) => return Ok(Err(diverged)),
                None => logs.push(found),
            }
        }
        Ok(Ok(Driven { values: of_fit, logs }))
    }

    /// What the controller is told to follow.
    fn wanted(&self, reference: &Reference, time: f64) -> Vec<Wanted> {
        let mut wanted = reference.at(time);
        if !self.table.reference_velocity {
            wanted.iter_mut().for_each(|w| *w = [w[0], 0.0, 0.0]);
        }
        wanted
    }

    /// The joint that is furthest beyond what is allowed.
    fn diverged(&self, log: usize, reference: &Reference, found: &[Vec<f64>]) -> Option<Diverged> {
        let rate_hz = self.closed.problem.logs[log].rate_hz;
        let rows = found.first().map_or(0, Vec::len);
        let wanted: Vec<Vec<Wanted>> = (0..rows).map(|row| reference.at(row as f64 / rate_hz)).collect();
        let mut worst = Diverged { log, output: 0, distance: 0.0 };
        for (output, moved) in found.iter().enumerate() {
            for (q, wanted) in moved.iter().zip(&wanted) {
                let distance = (q - wanted[output][0]).abs();
                let distance = if distance.is_finite() { distance } else { f64::INFINITY };
                if distance > worst.distance {
                    worst = Diverged { log, output, distance };
                }
            }
        }
        (worst.distance > self.table.divergence).then_some(worst)
    }

    fn experiment(&self, model: &RobotModel, log: usize) -> Result<ExperimentSettings, Error> {
        let log = &self.closed.problem.logs[log];
        let table = self.table;
        let wanted =
            table.rate_hz.unwrap_or(log.rate_hz * (LEAST_CONTROL_RATE / log.rate_hz).ceil().max(1.0));
        let tolerance = match self.closed.problem.settings.estimator.method {
            Method::Cloe => {
                let finest = log.position_noise.iter().map(|n| n.sigma).fold(f64::INFINITY, f64::min);
                (TOLERANCE_OF_NOISE * finest).clamp(LEAST_TOLERANCE, TOLERANCE)
            }
            _ => TOLERANCE,
        };
        let channels = model.channels().iter().map(|name| {
            let values = log.channels.iter().find(|c| c.name == *name).map_or(&[][..], |c| &c.values);
            let points = values.iter().enumerate().map(|(k, x)| (k as f64 / log.rate_hz, *x));
            Profile::new(points.collect())
        });
        Ok(ExperimentSettings {
            duration_s: (log.samples() - 1) as f64 / log.rate_hz,
            log_rate_hz: log.rate_hz,
            tolerance,
            control: ControlSettings {
                // Ticks fall on samples.
                rate_hz: log.rate_hz * (wanted / log.rate_hz).round().max(1.0),
                bandwidth_hz: table.bandwidth_hz,
                damping: table.damping,
                position_gain: table.position_gain.clone(),
                velocity_gain: table.velocity_gain.clone(),
                feed_forward: table.feed_forward,
                velocity_cutoff_hz: table.velocity_cutoff_hz,
                delay_ticks: table.delay_ticks,
                effort_limit: table.effort_limit.clone(),
                passive: Vec::new(),
            },
            imperfections: Imperfections::none(),
            channels: channels.collect::<Result<_, _>>()?,
            seed: 1,
        })
    }

    /// Parameters of bodies that can exist, as near as may be to those that a factor determines.
    fn possible(&self, factor: &Factor) -> Result<Vec<f64>, Error> {
        let Problem { model, structure, settings, .. } = self.closed.problem;
        let Structure { prior, regrouping, .. } = structure;
        let problem = consistency::problem(model, regrouping, factor, prior, &self.bounds);
        let form = consistency::form(settings.estimator.consistency).unwrap_or(bodies::Form::PseudoInertia);
        let settings =
            bodies::Settings { form, gaussian_weight: PRIOR_WEIGHT, ..bodies::Settings::default() };
        let mut found = bodies::estimate(&problem, &settings)?.x;
        model.complete(&mut found);
        Ok(found)
    }

    /// The nonlinear model and its parameters that those of the fit stand for.
    fn unfolded(&self, values: &[f64]) -> Result<(RobotModel, Vec<f64>), Error> {
        let Problem { plan, model: fitted, .. } = self.closed.problem;
        let model = plan.model(fitted.mechanism())?;
        Ok(match self.closed.shapes {
            Some(found) => {
                let unfolded = shape::unfold(&found.model, fitted, values);
                (model.with_shape(&unfolded.shape), unfolded.linear)
            }
            None => (model, values.to_vec()),
        })
    }
}

/// A simulation that left its reference.
pub(super) struct Diverged {
    log: usize,
    output: usize,
    distance: f64,
}

impl From<Diverged> for IterationEnd {
    fn from(Diverged { log, output, distance }: Diverged) -> Self {
        IterationEnd::Diverged { distance, log, output }
    }
}

impl From<Diverged> for Simulated {
    fn from(Diverged { log, output, distance }: Diverged) -> Self {
        Simulated::Diverged { distance, log, output }
    }
}
