//! Bodies that deviate from those of the robot file.

use std::collections::BTreeSet;

use dynid_estimate::prior;
use dynid_model::{EffortModel, Mechanism, RobotModel};

use super::result::{BodyTrial, ServoError};
use super::{Folds, LEAST_GAIN, LEAST_SURE_GAIN, Work};
use crate::deviation::{Body, DEVIATIONS};
use crate::fit::{Fitted, GaussNewton};
use crate::free::Free;
use crate::settings::{Addition, QUANTILE};

/// Factors by which the robot file is taken for surer than it is said to be, strongest first. Residuals of a wrong model have one sign over many rows, which
/// together outweigh what is known; how far that goes is for the folds to say.
const PULLS: [f64; 5] = [100.0, 30.0, 10.0, 3.0, 1.0];

/// What was tried.
#[derive(Debug, Default)]
pub(super) struct FoundBodies {
    pub(super) trials: Vec<BodyTrial>,
    pub(super) repairs: Vec<String>,
}

impl Work<'_> {
    /// Leaves bodies free with one pull after the other towards the robot file, each fit beginning at the last: the first that beats the bodies of the file on folds that
    /// are left out, as additions have to, and weaker ones as long as each predicts them better by [`LEAST_GAIN`] than the one before.
    pub(super) fn find_bodies(
        &mut self,
        mechanism: &Mechanism,
        laws: &BTreeSet<Addition>,
        fitted: &mut Fitted,
        folds: &mut Folds,
        sigma: &[f64],
    ) -> Result<FoundBodies, ServoError> {
        let model = RobotModel::new(mechanism.clone(), Vec::new());
        let stated: Vec<Option<f64>> = model.parameters().linear.iter().map(|p| p.prior).collect();
        let nothing = vec![0.0; model.outputs().len()];
        let known = prior::of(&model, &stated, &nothing, "the robot file")?;
        let mut out = FoundBodies { trials: Vec::new(), repairs: known.warnings };
        let bodies: Vec<Body> =
            known.bodies.iter().enumerate().filter_map(|(b, body)| Body::new(b, &body.inertia)).collect();
        let relative = self.settings.body_error / QUANTILE;
        let before: f64 = folds.errors.iter().sum();
        let mut start = fitted.values.clone();
        for body in &bodies {
            let first = DEVIATIONS * body.body;
            start.inertias[first..first + DEVIATIONS].copy_from_slice(&body.inertia(&[0.0; DEVIATIONS]).0);
        }
        let mut best: Option<(f64, usize, Fitted, Folds, Vec<Free>)> = None;
        for (trial, pull) in PULLS.into_iter().enumerate() {
            self.bodies = bodies.iter().flat_map(|body| Free::body(*body, relative, pull)).collect();
            let free = self.free(laws);
            let Ok(tried) = self.refit(&free, &start, self.scheme, &GaussNewton::default()) else { break };
            let held = self.held_out(&free, &tried, sigma);
            let ratios: Vec<f64> = held.errors.iter().zip(&folds.errors).map(|(a, b)| a / b).collect();
            let mean = held.errors.iter().sum::<f64>() / before;
            out.trials.push(BodyTrial { pull, ratios: ratios.clone(), taken: false });
            start = tried.values.clone();
            let wins = ratios.iter().all(|r| *r < 1.0) && mean < 1.0 - LEAST_SURE_GAIN;
            let enough = match &best {
                // More freedom has to pay for itself: bodies that are free make up for any friction that the law lacks.
                Some(best) => mean < (1.0 - LEAST_GAIN) * best.0,
                None => wins || mean < 1.0 - LEAST_GAIN,
            };
            if best.is_some() && !enough {
                break;
            }
            if enough {
                best = Some((mean, trial, tried, held, std::mem::take(&mut self.bodies)));
            }
        }
        self.bodies = Vec::new();
        if let Some((_, trial, tried, held, bodies)) = best {
            out.trials[trial].taken = true;
            (*fitted, *folds, self.bodies) = (tried, held, bodies);
        }
        Ok(out)
    }
}
