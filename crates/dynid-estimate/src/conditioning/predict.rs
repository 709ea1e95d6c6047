//! Effort that a fitted model predicts on a log.

use dynid_model::{EffortModel, RegressorBlock};
use dynid_motion::shift;

use super::states::States;
use super::{ConditioningError, ConditioningSettings, Moving, PreparedLog};

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
    let states = States::of(log, state_hz, settings)?;
    of_states(model, shape, linear, log, &states, delay_samples)
}

/// Predicted effort as [`predict`] has it, but for joints that stand: their velocity counts as zero, so that friction of velocity
/// is zero there. Where a joint stands, the sign of its velocity is that of noise, and friction may have any value up to static
/// friction; this prediction is the middle of what it may be, and does not jump.
///
/// `moving`: where the joints of the log move.
///
/// # Errors
/// As [`predict`].
pub fn predict_at_rest(
    model: &dyn EffortModel,
    shape: &[f64],
    linear: &[f64],
    log: &PreparedLog,
    moving: &Moving,
    (state_hz, delay_samples): (f64, f64),
    settings: &ConditioningSettings,
) -> Result<Vec<Vec<f64>>, ConditioningError> {
    let mut states = States::of(log, state_hz, settings)?;
    let samples = states.samples;
    for (output, moves) in moving.samples.iter().enumerate() {
        let velocity = &mut states.dq[output * samples..][..samples];
        for (v, _) in velocity.iter_mut().zip(moves).filter(|(_, moves)| !**moves) {
            *v = 0.0;
        }
    }
    of_states(model, shape, linear, log, &states, delay_samples)
}

fn of_states(
    model: &dyn EffortModel,
    shape: &[f64],
    linear: &[f64],
    log: &PreparedLog,
    states: &States,
    delay_samples: f64,
) -> Result<Vec<Vec<f64>>, ConditioningError> {
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
    if delay_samples != 0.0 {
        for p in &mut predicted {
            *p = shift::shift(p, delay_samples)?.values;
        }
    }
    Ok(predicted)
}
