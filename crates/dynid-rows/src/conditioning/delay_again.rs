//! The delay of a model whose shape parameters are known.

use dynid_model::EffortModel;

use super::prepare::PreparedLog;
use super::settings::ConditioningSettings;
use super::trial::{Trial, TrialShapes};
use super::{Conditioning, ConditioningError, DelayEstimate, choose};

/// Finds the delay once more, kernel and masks as they were chosen: friction that gives way after a reversal turns over late, as a delay does, and how late
/// is known after its travel was found.
///
/// `model`: linear about its shape parameters `shape`, whose changes are columns of its own; `kept`: its base columns, ascending.
///
/// # Errors
/// [`ConditioningError`] if a signal cannot be filtered or a row is not finite.
pub fn delay_again(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    choices: &Conditioning,
    settings: &ConditioningSettings,
) -> Result<DelayEstimate, ConditioningError> {
    if settings.delay_samples.is_some() {
        return Ok(choices.delay.clone());
    }
    let settings = &super::with_given_mask(settings);
    let limits = choose::delay_limits(logs, settings);
    let none = vec![Vec::new(); model.outputs().len()];
    let shapes = TrialShapes::Library { shapes: &none, load: &[] };
    let states = choices.limit.states();
    let trial = Trial::new(model, shape, kept, logs, choices.kernel_hz, states, limits, shapes, settings)?;
    let plain = vec![Vec::new(); model.outputs().len()];
    Ok(choose::delay(&trial, &choices.rung, &plain, limits, settings, choices.delay.samples))
}
