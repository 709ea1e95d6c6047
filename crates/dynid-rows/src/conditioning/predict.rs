//! Effort that a fitted model predicts on a log.

use dynid_model::EffortModel;
use dynid_motion::shift;
use rayon::prelude::*;

use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// Samples that one thread predicts at a time.
const BLOCK: usize = 2048;

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
        let led = predicted.par_iter().map(|p| Ok(shift::shift(p, delay_samples)?.values));
        predicted = led.collect::<Result<_, ConditioningError>>()?;
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
    let (outputs, samples) = (model.outputs().len(), log.samples());
    let mut predicted: Vec<Vec<f64>> = (0..outputs).map(|_| vec![0.0; samples]).collect();
    let remembered = states.remembered(model, shape, &log.channels);
    // Block after block: where the efforts of every output go.
    let mut blocks: Vec<Vec<&mut [f64]>> =
        (0..samples.div_ceil(BLOCK)).map(|_| Vec::with_capacity(outputs)).collect();
    for effort in &mut predicted {
        blocks.iter_mut().zip(effort.chunks_mut(BLOCK)).for_each(|(block, effort)| block.push(effort));
    }
    blocks.par_iter_mut().enumerate().for_each(|(number, block)| {
        let range = number * BLOCK..((number + 1) * BLOCK).min(samples);
        let length = range.len();
        let mut efforts = vec![0.0; outputs * length];
        states.with_block(range, &log.channels, &remembered, |motion| {
            model.efforts(motion, shape, linear, length, &mut efforts);
        });
        block.iter_mut().zip(efforts.chunks_exact(length)).for_each(|(to, from)| to.copy_from_slice(from));
    });
    predicted
}
