//! From chosen friction and shape parameters to the linear model that is fitted.

use dynid_model::{EffortModel, Output};
use dynid_rows::conditioning::{Conditioning, JointFriction};

use super::{Step, friction};
use crate::Error;
use crate::elements::shape_element;
use crate::problem::Problem;
use crate::settings::Friction;
use crate::shape::{self, ShapeFit, Start};

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
        out.found = Some(found);
    }
    Ok(out)
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
