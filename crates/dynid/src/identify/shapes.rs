//! From chosen friction and shape parameters to the linear model that is fitted.

use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::{Conditioning, ConditioningSettings, JointFriction, PreparedLog};

use super::structure::Structure;
use super::{Step, friction};
use crate::Error;
use crate::config::{Config, Friction};
use crate::elements::ElementPlan;
use crate::shape::{self, ShapeFit};

/// A model with what is known of it before its fit, and how it came about.
pub(super) struct Shaped {
    /// Linear in all its parameters, unless no shape parameters were searched.
    pub(super) model: RobotModel,
    pub(super) structure: Structure,
    /// `None` on the textbook route.
    pub(super) conditioning: Option<Conditioning>,
    /// Shapes of friction per output; empty where none were looked for.
    pub(super) friction: Vec<JointFriction>,
    /// Shape parameters as found; `None` where there were none to search.
    pub(super) found: Option<ShapeFit>,
}

/// Adds shapes of friction to the plan if they are to be chosen, finds the shape parameters and linearises the model about
/// them. On the textbook route the model stays as it is.
///
/// # Errors
/// Fails as choice and search do: [`Error::Conditioning`], or settings that do not fit the model.
pub(super) fn search(
    config: &Config,
    (model, structure): (RobotModel, Structure),
    plan: &mut ElementPlan,
    logs: &[PreparedLog],
    conditioning: Option<Conditioning>,
    settings: &ConditioningSettings,
    progress: &mut dyn FnMut(Step),
) -> Result<Shaped, Error> {
    let mut out = Shaped { model, structure, conditioning, friction: Vec::new(), found: None };
    let Some(choices) = &mut out.conditioning else { return Ok(out) };
    let mechanism = out.model.mechanism().clone();
    let rebuilt = |plan: &ElementPlan| -> Result<(RobotModel, Structure), Error> {
        let model = plan.model(&mechanism)?;
        let structure = Structure::of(config, &model, plan, logs)?;
        Ok((model, structure))
    };
    let all_known = plan.known.len() == plan.per_rate.len();
    if config.elements.friction == Friction::Auto && !all_known {
        let chosen =
            friction::choose(&out.model, &out.structure, plan, logs, choices, settings, &mut |stage| {
                progress(Step::Conditioning(stage));
            })?;
        (out.model, out.structure) = rebuilt(plan)?;
        out.friction = chosen.per_output;
        *choices = chosen.conditioning;
    }
    while !out.model.parameters().shape.is_empty() {
        progress(Step::Shapes);
        let (found, linear) = shape::find(config, out.model, &out.structure.base, logs, (choices, settings))?;
        if friction::drop_refuted(&found.model, (&found, &linear), &mut out.friction, plan) {
            (out.model, out.structure) = rebuilt(plan)?;
            continue;
        }
        let free: Vec<bool> = found.findings.iter().map(shape::is_free).collect();
        out.model = shape::linearised(plan, &found.model, &linear, &free)?;
        out.structure = Structure::of(config, &out.model, plan, logs)?;
        out.found = Some(found);
    }
    Ok(out)
}
