//! Friction that follows reactions: loads are taken at the parameters that come out.

use dynid_model::{ClosedModel, EffortModel, RobotModel};
use dynid_rows::conditioning::{Conditioning, JointFriction};

use super::Step;
use super::model_fit::ModelFit;
use crate::Error;
use crate::elements::LoadValues;
use crate::problem::Problem;

/// Change of the loads, relative to their size, at which rounds end.
pub(crate) const SETTLED: f64 = 1e-6;
/// Most rounds.
const ROUNDS: usize = 12;
/// Random states that loads are compared on.
const STATES: usize = 200;
const SEED: u64 = 11;

/// How the loads of friction came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadRounds {
    /// Rounds after the first fit.
    pub rounds: usize,
    /// Root mean square change of the loads in the last round over random states, relative to that of the loads.
    pub change: f64,
}

/// Fits with loads frozen at the robot file's parameters, then, round by round, with columns that tell how friction changes
/// with its loads (Gauss-Newton about the parameters of the round before), until the loads stay.
///
/// # Errors
/// Fails as [`Problem::fit`] does.
pub(super) fn settle(
    problem: Problem,
    conditioning: Option<Conditioning>,
    progress: &mut dyn FnMut(Step),
) -> Result<(Problem, ModelFit), Error> {
    let (mut problem, mut fit) = problem.fit_at_loads(conditioning, None, progress)?;
    let mut before = forces(&problem.model);
    let mut out = LoadRounds { rounds: 0, change: f64::INFINITY };
    loop {
        let (model, linear) = fit.nonlinear(&problem)?;
        let now = forces(&model);
        out.change = change(&before, &now);
        if out.rounds == ROUNDS || !out.change.is_finite() || (out.rounds > 0 && out.change <= SETTLED) {
            problem.plan.load_values = Some(LoadValues::of(&model, &linear, false));
            fit.loads = Some(out);
            return Ok((problem, fit));
        }
        before = now;
        problem.plan.load_values = Some(LoadValues::of(&model, &linear, true));
        problem.rebuild()?;
        let friction: Vec<JointFriction> = std::mem::take(&mut fit.friction);
        (problem, fit) = problem.fit_at_loads(fit.conditioning.take(), Some(friction), progress)?;
        out.rounds += 1;
    }
}

/// Loads over random states, at the parameters of the model's reference.
fn forces(model: &RobotModel) -> Vec<f64> {
    let of = |closed: &ClosedModel| {
        closed
            .random_motion(STATES, SEED)
            .with_block(|motion| closed.load_forces(motion).0.into_iter().flatten())
    };
    model.with_reactions().into_iter().flat_map(of).flatten().collect()
}

fn change(before: &[f64], now: &[f64]) -> f64 {
    let square = |x: f64| x * x;
    let moved: f64 = before.iter().zip(now).map(|(a, b)| square(a - b)).sum();
    let size: f64 = now.iter().map(|x| square(*x)).sum();
    if size > 0.0 { (moved / size).sqrt() } else { moved.sqrt() }
}
