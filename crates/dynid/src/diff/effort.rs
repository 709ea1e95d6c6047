//! Efforts of two models against each other.

use dynid_logs::States;
use dynid_model::{EffortModel, RegressorBlock};
use serde::Serialize;

use super::Valued;
use crate::Error;
use crate::export::{CheckStates, with_slipping_bristles};
use crate::predict::{efforts, known_efforts};

/// Efforts of one joint by two models, in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct JointEffort {
    /// Joint.
    pub joint: String,
    /// Root mean square of the effort by the first model.
    pub rms_a: f64,
    /// Root mean square of the effort by the second model.
    pub rms_b: f64,
    /// Root mean square of the difference.
    pub rms_difference: f64,
    /// Largest difference.
    pub largest: f64,
    /// Root mean square of the difference over the larger of the two efforts, percent; absent where both are zero.
    pub percent: Option<f64>,
}

/// Efforts of both models, output after output.
type Efforts = [Vec<Vec<f64>>; 2];

/// Efforts over random states; bristles of friction slip there.
pub(super) fn at_random(a: &Valued, b: &Valued) -> Vec<JointEffort> {
    let states = CheckStates::random_of_both(&a.model, &b.model);
    let mut out: Efforts = Efforts::default();
    states.for_each_block(|motion| {
        for (of, all) in [a, b].into_iter().zip(&mut out) {
            let mut block = RegressorBlock::new(of.model.layout().clone(), motion.samples);
            let shape = of.model.parameters().shape_start();
            with_slipping_bristles(&of.model, motion, |motion| {
                of.model.regressor(motion, &shape, &mut block)
            });
            let effort = |output: usize| -> Vec<f64> {
                let known = block.offset(output).iter().map(|known| if of.with_known { 0.0 } else { *known });
                block.effort(output, &of.values).iter().zip(known).map(|(e, known)| e - known).collect()
            };
            *all = (0..of.model.outputs().len()).map(effort).collect();
        }
    });
    judged(a, b, &out)
}

/// Efforts at given states, as each of the models reads them.
///
/// # Errors
/// As [`efforts`].
pub(super) fn at_states(a: (&Valued, &States), b: (&Valued, &States)) -> Result<Vec<JointEffort>, Error> {
    let of = |(valued, states): (&Valued, &States)| -> Result<Vec<Vec<f64>>, Error> {
        let mut all = efforts(&valued.model, &valued.values, states)?;
        if !valued.with_known {
            for (effort, known) in all.iter_mut().zip(known_efforts(&valued.model, states)?) {
                effort.iter_mut().zip(known).for_each(|(e, known)| *e -= known);
            }
        }
        Ok(all)
    };
    Ok(judged(a.0, b.0, &[of(a)?, of(b)?]))
}

fn judged(a: &Valued, b: &Valued, [of_a, of_b]: &Efforts) -> Vec<JointEffort> {
    let joint = |(output, effort): (usize, &Vec<f64>)| {
        let name = &a.model.outputs()[output].name;
        let other = b.model.outputs().iter().position(|o| o.name == *name)?;
        let difference: Vec<f64> = effort.iter().zip(&of_b[other]).map(|(x, y)| y - x).collect();
        let [rms_a, rms_b, rms_difference] =
            [effort, &of_b[other], &difference].map(|x| dynid_motion::signal::rms(x));
        let larger = rms_a.max(rms_b);
        Some(JointEffort {
            joint: name.clone(),
            rms_a,
            rms_b,
            rms_difference,
            largest: difference.iter().fold(0.0, |most, x| most.max(x.abs())),
            percent: (larger > 0.0).then(|| 100.0 * rms_difference / larger),
        })
    };
    of_a.iter().enumerate().filter_map(joint).collect()
}
