//! A log, a model and what is known of it beforehand: how well any wiring explains the log.

use std::borrow::Cow;

use dynid_model::EffortModel;
use dynid_motion::filter::forward_backward;
use dynid_motion::shift::shift;
use dynid_motion::{SignalError, UniformLog};
use rayon::prelude::*;

use super::refine::{self, GaussianPrior};
use super::rows::{TrialRows, regressor};
use super::samples::{Samples, low_pass};
use super::wiring::Wiring;
use dynid_estimate::consistent::{Problem, Settings, estimate};
use dynid_factor::factor::{Factor, FactorError};

/// What a trial is made with.
pub struct Trial<'a> {
    /// The model, with friction at its joints.
    pub model: &'a dyn EffortModel,
    /// Shape parameters of the model.
    pub shape: &'a [f64],
    /// Base columns of the model, ascending.
    pub kept: &'a [usize],
    /// The log, joints in the order of the outputs.
    pub log: &'a UniformLog,
    /// Per joint, whether it moves.
    pub moves: &'a [bool],
    /// Samples of the log.
    pub samples: &'a Samples,
    /// Per joint, whether it slides.
    pub slides: &'a [bool],
    /// From the weighted factor of the base columns to the problem in standard columns, with its prior.
    pub problem: &'a (dyn Fn(&Factor) -> Problem + Sync),
    /// Prior of all linear parameters, for what is fitted beside them.
    pub prior: GaussianPrior<'a>,
    /// Gravity as stated, m/s².
    pub gravity: [f64; 3],
    /// Delay as stated: what the motion is later than the effort of the same row, s.
    pub delay_s: f64,
    /// Seconds per second of the log's clock, as measured velocities show them; `None` without such.
    pub clock: Option<f64>,
}

impl Trial<'_> {
    /// What Gauss-Newton needs of the trial.
    pub(super) fn refinement<'b>(&'b self, samples: &'b Samples) -> refine::Problem<'b> {
        refine::Problem {
            model: self.model,
            shape: self.shape,
            kept: self.kept,
            samples,
            gravity: self.gravity,
            prior: self.prior,
        }
    }

    pub(super) fn rows(&self, samples: &Samples, wiring: &Wiring) -> Result<TrialRows, FactorError> {
        TrialRows::new(self.model, self.shape, self.kept, samples, wiring)
    }

    /// Samples of the log with its efforts moved to the motion that they belong to; `None` if they cannot be formed.
    pub(super) fn samples_at(&self, delay_s: f64) -> Option<Cow<'_, Samples>> {
        if delay_s == 0.0 {
            return Some(Cow::Borrowed(self.samples));
        }
        let samples = -delay_s * self.log.rate_hz;
        let shifted = self.log.joints.par_iter().map(|joint| shift(&joint.effort, samples).ok());
        let shifted = shifted.collect::<Option<Vec<_>>>()?;
        // Beyond the ends of the record nothing is known of the efforts.
        let known = |k: usize| shifted.iter().all(|effort| effort.valid.contains(&k));
        let usable: Vec<bool> =
            self.log.usable.iter().enumerate().map(|(k, usable)| *usable && known(k)).collect();
        let efforts: Vec<&[f64]> = shifted.iter().map(|effort| effort.values.as_slice()).collect();
        let moved = Samples::filtered(self.log, &efforts, &usable, self.moves, self.samples.cutoff_hz);
        moved.ok().flatten().map(Cow::Owned)
    }

    /// The effort of a joint as [`Trial::samples_at`] has it, at every sample of the log.
    pub(super) fn whole_effort(&self, joint: usize, delay_s: f64) -> Result<Vec<f64>, SignalError> {
        let effort = &self.log.joints[joint].effort;
        let filter = low_pass(self.samples.cutoff_hz, self.log.rate_hz)?;
        match delay_s {
            0.0 => forward_backward(&filter, effort),
            _ => forward_backward(&filter, &shift(effort, -delay_s * self.log.rate_hz)?.values),
        }
    }

    /// How badly bodies that can exist, with friction that takes energy, explain efforts: `min ‖R x - z‖² + ρ²` plus the
    /// distance from the prior. Infinite where there is no such estimate.
    pub(super) fn misfit(&self, factor: &Factor) -> f64 {
        match estimate(&(self.problem)(factor), &self.settings()) {
            Ok(found) => found.objective + factor.rho().powi(2),
            Err(_) => f64::INFINITY,
        }
    }

    /// Standard parameters of bodies that can exist, as they explain a wiring best, with their misfit; `None` where there are none.
    pub fn parameters(&self, wiring: &Wiring) -> Option<(Vec<f64>, f64)> {
        self.parameters_by_size(wiring)?(1.0)
    }

    /// [`Trial::parameters`] for a factor that all efforts are multiplied by; `None` where the rows cannot be formed.
    pub fn parameters_by_size<'b>(
        &'b self,
        wiring: &'b Wiring,
    ) -> Option<impl Fn(f64) -> Option<(Vec<f64>, f64)> + 'b> {
        let samples = self.samples_at(wiring.delay_s)?;
        let rows = self.rows(&samples, wiring).ok()?;
        Some(move |size: f64| {
            let mut sized = wiring.clone();
            sized.effort.iter_mut().for_each(|effort| effort.factor *= size);
            let factor = rows.weighted(&sized);
            let found = estimate(&(self.problem)(&factor), &self.settings()).ok()?;
            Some((found.x, found.objective + factor.rho().powi(2)))
        })
    }

    fn settings(&self) -> Settings {
        Settings { gaussian_weight: self.prior.weight, ..Settings::default() }
    }

    /// Misfit of a wiring; infinite where there is none.
    pub(super) fn misfit_of(&self, samples: &Samples, wiring: &Wiring) -> f64 {
        self.rows(samples, wiring).map_or(f64::INFINITY, |rows| self.misfit(&rows.weighted(wiring)))
    }
}

/// Efforts that parameters ask for at rest, in every sample, output by output.
pub fn efforts_at_rest(trial: &Trial<'_>, wiring: &Wiring, values: &[f64]) -> Vec<Vec<f64>> {
    let samples = trial.samples;
    let mut still = samples.clone();
    for joint in &mut still.joints {
        joint.velocity.fill(0.0);
        joint.acceleration.fill(0.0);
    }
    let block = regressor(trial.model, trial.shape, &still, wiring);
    (0..samples.joints.len()).map(|output| block.effort(output, values)).collect()
}
