//! From chosen friction and shape parameters to the linear model that is fitted.

use dynid_model::EffortModel;
use dynid_rows::conditioning::{Conditioning, JointFriction};

use super::{Step, friction};
use crate::Error;
use crate::problem::Problem;
use crate::settings::Friction;
use crate::shape::{self, ShapeFit};

/// What was found on the way to a linear model.
pub(super) struct Shaped {
    /// `None` on the textbook route.
    pub(super) conditioning: Option<Conditioning>,
    /// Shapes of friction per output; empty where none were looked for.
    pub(super) friction: Vec<JointFriction>,
    /// Shape parameters as found; `None` where there were none to search.
    pub(super) found: Option<ShapeFit>,
}

/// Adds shapes of friction to the plan if they are to be chosen, finds the shape parameters and linearises the model about
/// them. On the textbook route the model stays as it is. `friction`: the shapes, where they were chosen before.
///
/// # Errors
/// Fails as choice and search do: [`Error::Conditioning`], or settings that do not fit the model.
pub(super) fn search(
    problem: &mut Problem,
    conditioning: Option<Conditioning>,
    friction: Option<Vec<JointFriction>>,
    progress: &mut dyn FnMut(Step),
) -> Result<Shaped, Error> {
    let chosen = friction.is_some();
    let mut out = Shaped { conditioning, friction: friction.unwrap_or_default(), found: None };
    let Some(choices) = &mut out.conditioning else { return Ok(out) };
    let all_known = problem.plan.known.len() == problem.plan.per_rate.len();
    if problem.settings.elements.friction == Friction::Auto && !all_known && !chosen {
        let chosen = friction::choose(problem, choices, &mut |stage| progress(Step::Conditioning(stage)))?;
        problem.rebuild()?;
        out.friction = chosen.per_output;
        *choices = chosen.conditioning;
    }
    while !problem.model.parameters().shape.is_empty() {
        progress(Step::Shapes);
        let found = shape::find(problem, choices)?;
        if friction::drop_refuted(problem, &found, &mut out.friction) {
            problem.rebuild()?;
            continue;
        }
        let free: Vec<bool> = found.findings.iter().map(shape::is_free).collect();
        problem.model = shape::linearised(&problem.plan, &found.model, &found.linear, &free)?;
        problem.restructure()?;
        out.found = Some(found);
    }
    Ok(out)
}
