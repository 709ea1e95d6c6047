//! Loads that friction follows, and those on journals: they are taken at the parameters that come out.

use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::Conditioning;

use super::Step;
use super::model_fit::ModelFit;
use super::shapes::Before;
use crate::Error;
use crate::elements::LoadValues;
use crate::load_rounds::LoadRounds;
use crate::problem::Problem;
use crate::shape::Start;

/// Change below which a round looks at all that logs say.
const NEAR: f64 = 1e-3;
/// Most rounds.
const ROUNDS: usize = 12;
/// Random states that loads are compared on.
const STATES: usize = 200;
const SEED: u64 = 11;

/// Fits with the loads of the plan, frozen, then, round by round, with columns that tell how friction changes with its loads
/// and its shapes (Gauss-Newton about the parameters of the round before), until the loads stay. The plan of the problem then
/// has the loads that came out.
///
/// # Errors
/// Fails as [`Problem::fit`] does.
pub(crate) fn settle(
    problem: Problem,
    conditioning: Option<Conditioning>,
    before: Before,
    progress: &mut dyn FnMut(Step),
) -> Result<(Problem, ModelFit), Error> {
    let mut last = forces(&problem.model);
    let (mut problem, mut fit) = problem.fit_at_loads(conditioning, before, progress)?;
    let mut out = LoadRounds { rounds: 0, change: f64::INFINITY };
    loop {
        let (model, linear) = fit.nonlinear(&problem)?;
        let now = forces(&model);
        let change = change(&last, &now);
        // What logs say about shape parameters is worked out once loads are nearly at rest.
        let near = change <= NEAR || out.rounds + 1 == ROUNDS;
        let ended = out.rounds > 0 && out.change <= NEAR && change <= LoadRounds::SETTLED;
        out.change = change;
        if ended || out.rounds == ROUNDS || !change.is_finite() {
            problem.plan.load_values = Some(LoadValues::of(&model, &linear, false));
            fit.loads = Some(out);
            return Ok((problem, fit));
        }
        last = now;
        problem.plan.load_values = Some(LoadValues::of(&model, &linear, true));
        problem.rebuild()?;
        let shape = model.parameters().shape_start();
        let start = if near { Start::From(shape) } else { Start::Near(shape) };
        let before = Before::Found { friction: std::mem::take(&mut fit.friction), start };
        (problem, fit) = problem.fit_at_loads(fit.conditioning.take(), before, progress)?;
        out.rounds += 1;
    }
}

/// Loads over random states, at the parameters of the model's reference.
fn forces(model: &RobotModel) -> Vec<f64> {
    model.random_motion(STATES, SEED).with_block(|motion| model.loads(motion)).concat()
}

fn change(before: &[f64], now: &[f64]) -> f64 {
    let square = |x: f64| x * x;
    let moved: f64 = before.iter().zip(now).map(|(a, b)| square(a - b)).sum();
    let size: f64 = now.iter().map(|x| square(*x)).sum();
    if size > 0.0 { (moved / size).sqrt() } else { moved.sqrt() }
}

impl Problem {
    /// Fits the model to the logs as the settings ask for.
    ///
    /// # Errors
    /// Settings that do not fit the model, too few rows, what the estimators refuse.
    pub fn fit(
        self,
        conditioning: Option<Conditioning>,
        progress: &mut dyn FnMut(Step),
    ) -> Result<(Problem, ModelFit), Error> {
        let (problem, fit) = self.fit_from(conditioning, Before::Nothing, progress)?;
        problem.fit_cyclic(fit, progress)
    }

    /// The same from what is known of shapes before, without a look for cyclic efforts.
    ///
    /// # Errors
    /// As [`Problem::fit`].
    pub(super) fn fit_from(
        self,
        conditioning: Option<Conditioning>,
        before: Before,
        progress: &mut dyn FnMut(Step),
    ) -> Result<(Problem, ModelFit), Error> {
        match self.plan.follows_loads() {
            false => self.fit_at_loads(conditioning, before, progress),
            true => settle(self, conditioning, before, progress),
        }
    }

    /// The loads that a first look finds, with friction as it is stated: conditioning that took friction with loads of the robot
    /// file would take their errors for noise.
    ///
    /// # Errors
    /// Fails as [`Problem::fit`] does.
    pub(crate) fn first_loads(&self, conditioning: &Conditioning) -> Result<Option<LoadValues>, Error> {
        let copy = self.on(self.logs.clone(), self.settings.clone())?;
        let (found, _) = settle(copy, Some(conditioning.clone()), Before::AsStated, &mut |_| {})?;
        Ok(found.plan.load_values)
    }
}
