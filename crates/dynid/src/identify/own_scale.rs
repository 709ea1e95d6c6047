//! Conditioning of logs of which some have a factor of their own on friction.

use dynid_estimate::separable::SeparableSettings;
use dynid_model::element::scale_name;
use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::{Conditioning, ConditioningSettings, PreparedLog, Stage, condition, refine};

use super::structure::Structure;
use crate::Error;
use crate::elements::ElementPlan;

/// Conditions logs. Where some have a factor on friction, they are conditioned with the factors equal to 1, the factors are
/// fitted, and everything is chosen again beside these: what is left of a log's friction would otherwise count as noise, and
/// the kernel and the shapes of friction be chosen too coarse. The plan starts later searches from the factors found.
///
/// # Errors
/// [`Error::Conditioning`], [`Error::Shapes`].
pub(crate) fn conditioned(
    model: RobotModel,
    structure: &Structure,
    plan: &mut ElementPlan,
    logs: &[PreparedLog],
    settings: &ConditioningSettings,
    progress: &mut dyn FnMut(Stage),
) -> Result<(RobotModel, Conditioning), Error> {
    let kept = &structure.base.kept;
    let start = model.parameters().shape_start();
    let choices = condition(&model, &start, kept, logs, settings, progress)?;
    let scaled = plan.log_terms.scaled();
    if scaled.is_empty() {
        return Ok((model, choices));
    }
    let once = SeparableSettings { starts: 1, profile_points: 0, ..SeparableSettings::default() };
    let found = refine(&model, &start, kept, logs, &choices, settings, &once)?;
    let model = model.with_shape(&found.shape);
    for (log, _) in scaled {
        let value = model.parameters().shape_value(&scale_name(&log)).unwrap_or(1.0);
        plan.log_terms.set_scale(&log, value);
    }
    let model = plan.model(model.mechanism())?;
    let start = model.parameters().shape_start();
    let choices = condition(&model, &start, kept, logs, settings, progress)?;
    Ok((model, choices))
}
