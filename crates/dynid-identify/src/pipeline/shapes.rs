//! From chosen friction and shape parameters to the linear model that is fitted.

use dynid_model::{EffortModel, Output};
use dynid_rows::conditioning::{Conditioning, DelayEstimate, JointFriction, delay_again};

use super::{Step, friction};
use crate::Error;
use crate::elements::shape_element;
use crate::problem::Problem;
use crate::settings::Friction;
use crate::shape::{self, ShapeFit, Start};

/// Delays closer than this, samples, are the same, whatever their standard deviation.
const SAME_DELAY: f64 = 0.05;

/// `χ²` per degree of freedom from which on joints disagree about the delay.
const DISAGREE: f64 = 2.0;

/// What was found on the way to a linear model.
pub(super) struct Shaped {
    /// `None` on the textbook route.
    pub(super) conditioning: Option<Conditioning>,
    /// Shapes of friction per output; empty where none were looked for.
    pub(super) friction: Vec<JointFriction>,
    /// Shape parameters as found; `None` where there were none to search.
    pub(super) found: Option<ShapeFit>,
}

/// What is known of shapes before a fit.
#[derive(Debug)]
pub(super) enum Before {
    /// Nothing: they are chosen and searched.
    Nothing,
    /// Friction stays as the plan states it; shape parameters are searched.
    AsStated,
    /// What a fit found with other loads or fewer elements: shapes of friction, and where the search of shape parameters starts.
    Found {
        /// Shapes of friction.
        friction: Vec<JointFriction>,
        /// Start of the search.
        start: Start,
    },
}

/// Adds shapes of friction to the plan if they are to be chosen, finds the shape parameters and linearises the model about
/// them. On the textbook route the model stays as it is.
///
/// # Errors
/// Fails as choice and search do: [`Error::Conditioning`], or settings that do not fit the model.
pub(super) fn search(
    problem: &mut Problem,
    conditioning: Option<Conditioning>,
    before: Before,
    progress: &mut dyn FnMut(Step),
) -> Result<Shaped, Error> {
    let mut out = Shaped { conditioning, friction: Vec::new(), found: None };
    let choose = matches!(before, Before::Nothing);
    let mut start = Start::Stated;
    if let Before::Found { friction, start: from } = before {
        out.friction = friction;
        start = from;
    }
    let Some(choices) = &mut out.conditioning else { return Ok(out) };
    let all_known = problem.plan.known.len() == problem.plan.per_rate.len();
    if problem.settings.elements.friction == Friction::Auto && !all_known && choose {
        let chosen = friction::choose(problem, choices, &mut |stage| progress(Step::Conditioning(stage)))?;
        problem.rebuild()?;
        out.friction = chosen.per_output;
        *choices = chosen.conditioning;
        start = of_chosen(problem, &out.friction);
    }
    let mut delay_is_of_chosen = choose;
    while !problem.model.parameters().shape.is_empty() {
        progress(Step::Shapes);
        let found = shape::find(problem, choices, &start)?;
        if friction::drop_refuted(problem, &found, &mut out.friction, choices) {
            problem.rebuild()?;
            start = of_chosen(problem, &out.friction);
            continue;
        }
        let free = found.free();
        problem.model = shape::linearised(&problem.plan, &found.model, &found.linear, &free)?;
        problem.restructure()?;
        if std::mem::take(&mut delay_is_of_chosen)
            && let Some(delay) = other_delay(problem, choices, &out.friction)?
        {
            choices.delay = delay;
            problem.rebuild()?;
            let values = found.model.parameters().shape_start();
            start = Start::Beside(values, found.findings.into_iter().map(Some).collect());
            continue;
        }
        out.found = Some(found);
    }
    Ok(out)
}

/// The delay by a model that is linear about its shape parameters, where it is another than that of the choices.
///
/// Friction that gives way turns over late, as by a delay; travels were those of a grid when the delay was found. Joints that disagree about it, or a
/// single one, may owe it to them.
fn other_delay(
    problem: &Problem,
    choices: &Conditioning,
    friction: &[JointFriction],
) -> Result<Option<DelayEstimate>, Error> {
    let disagree = choices.delay.chi_squared.is_none_or(|chi| chi > DISAGREE);
    if !disagree || !friction.iter().any(JointFriction::has_spring) {
        return Ok(None);
    }
    let Problem { model, structure, logs, .. } = problem;
    let (shape, settings) = (model.parameters().shape_start(), problem.conditioning_settings());
    let again = delay_again(model, &shape, &structure.base.kept, logs, choices, &settings)?;
    let moved = (again.samples - choices.delay.samples).abs();
    Ok((moved > SAME_DELAY.max(again.half_width / 1.96)).then_some(again))
}

/// Where a search starts after shapes were chosen.
fn of_chosen(problem: &Problem, chosen: &[JointFriction]) -> Start {
    let is_chosen = |name: &str| {
        let of_joint = |(output, joint): (&Output, &JointFriction)| {
            let mut symbols = joint.accepted.iter().filter_map(|t| shape_element(t.shape.kind).1);
            let symbol = name.strip_prefix(&output.name).and_then(|rest| rest.strip_prefix('.'));
            symbols.any(|s| symbol == Some(s))
        };
        problem.model.outputs().iter().zip(chosen).any(of_joint)
    };
    let all = problem.model.parameters().shape.iter().all(|s| is_chosen(&s.name));
    if all { Start::Chosen } else { Start::Stated }
}
