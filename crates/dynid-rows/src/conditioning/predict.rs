//! Effort that a fitted model predicts on a log.

use dynid_model::{EffortModel, RegressorBlock};
use dynid_motion::shift;

use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// Predicted effort of every output at every sample of a log: states at `state_hz`, effort model, then the logged effort's
/// lead of `delay_samples`.
///
/// `linear`: all linear parameters of the model.
pub fn predict(
    model: &dyn EffortModel,
    shape: &[f64],
    linear: &[f64],
    log: &PreparedLog,
    state_hz: f64,
    delay_samples: f64,
    settings: &ConditioningSettings,
) -> Result<Vec<Vec<f64>>, ConditioningError> {
    let states = States::of_motion(log, state_hz, settings)?;
    let mut predicted = predict_along(model, shape, linear, log, &states);
    drop(states);
    if delay_samples != 0.0 {
        for p in &mut predicted {
            *p = shift::shift(p, delay_samples)?.values;
        }
    }
    Ok(predicted)
}

/// Effort of every output at every sample of a log, along states of it ([`States::of_motion`]).
///
/// `linear`: all linear parameters of the model.
pub fn predict_along(
    model: &dyn EffortModel,
    shape: &[f64],
    linear: &[f64],
    log: &PreparedLog,
    states: &States,
) -> Vec<Vec<f64>> {
    const BLOCK: usize = 2048;
    let outputs = model.outputs().len();
    let mut predicted = vec![Vec::with_capacity(log.samples()); outputs];
    let mut block = RegressorBlock::new(model.layout().clone(), BLOCK);
    let remembered = states.remembered(model, shape, &log.channels);
    for start in (0..log.samples()).step_by(BLOCK) {
        let range = start..(start + BLOCK).min(log.samples());
        states.with_block(range, &log.channels, &remembered, |motion| {
            model.regressor(motion, shape, &mut block);
        });
        for (output, out) in predicted.iter_mut().enumerate() {
            out.extend(block.effort(output, linear));
        }
    }
    predicted
}
