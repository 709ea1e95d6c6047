//! Nominal parameters of a robot: what its file states, and typical friction where it states none.

use dynid_model::{EffortModel, RandomMotion, RegressorBlock, RobotModel};

use std::collections::BTreeMap;

use crate::Error;
use crate::elements::ElementPlan;

/// Seed of the states that typical friction is scaled by: the same robot always gets the same truth.
const TYPICAL_SEED: u64 = 1;

/// Values of all linear parameters of `model`: link inertias and element values of the robot file, `given` values by name
/// over them. Friction about which neither says anything is typical for the joint: Coulomb 10 % (static 13 %, sigmoids
/// from -10 to 10 %) and viscous 10 % (at the speed limit) of the largest rigid effort over random states. Offsets, rotors
/// and what else elements may have are zero then.
///
/// # Errors
/// [`Error::Setting`] if a given name is no parameter, linear or shape, or its value not finite.
pub fn nominal_parameters(
    model: &RobotModel,
    plan: &ElementPlan,
    given: &BTreeMap<String, f64>,
) -> Result<Vec<f64>, Error> {
    let table = model.parameters();
    let mut values = table.prior();
    let peaks = typical_efforts(model, &values);
    let mut stated: Vec<(String, f64)> = Vec::new();
    for (j, joint) in model.joints().iter().enumerate() {
        let speed = match model.elastic_link(j) {
            Some((link, ratio)) => model.limits(link).velocity.unwrap_or(2.0) * ratio.abs(),
            None => model.limits(j).velocity.unwrap_or(2.0),
        };
        let typical = [
            ("fc", 0.1 * peaks[j]),
            ("fv", 0.1 * peaks[j] / speed),
            ("fs", 0.13 * peaks[j]),
            ("ft", 0.1 * peaks[j]),
            ("fg", 0.2 * peaks[j]),
            ("fl", 0.2 * peaks[j]),
        ];
        stated.extend(typical.map(|(symbol, value)| (format!("{}.{symbol}", joint.name), value)));
    }
    stated.extend(plan.stated_values());
    for (name, value) in stated {
        if let Some(column) = table.column(&name) {
            values[column] = value;
        }
    }
    for (name, value) in given {
        if !value.is_finite() {
            return Err(Error::setting(&format!("values.{name}"), "a finite number", value));
        }
        match table.column(name) {
            Some(column) => values[column] = *value,
            None if table.shape.iter().any(|s| s.name == *name) => {}
            None => return Err(Error::setting("values", "names of parameters such as `j1.fc`", name)),
        }
    }
    Ok(values)
}

/// The model with `given` values by name of its shape parameters.
///
/// # Errors
/// [`Error::Setting`] if a value does not lie within the bounds of its parameter.
pub fn with_nominal_shape(model: RobotModel, given: &BTreeMap<String, f64>) -> Result<RobotModel, Error> {
    let mut shape = model.parameters().shape_start();
    for (parameter, value) in model.parameters().shape.iter().zip(&mut shape) {
        let Some(stated) = given.get(&parameter.name) else { continue };
        if !(*stated >= parameter.lower && *stated <= parameter.upper) {
            let expected = format!("{} to {} {}", parameter.lower, parameter.upper, parameter.unit);
            return Err(Error::setting(&format!("values.{}", parameter.name), &expected, stated));
        }
        *value = *stated;
    }
    Ok(model.with_shape(&shape))
}

/// Largest rigid effort of every joint over random states; of motors behind springs that of their joints, seen through the
/// ratio.
pub(crate) fn typical_efforts(model: &RobotModel, values: &[f64]) -> Vec<f64> {
    const STATES: usize = 100;
    let motion = match model.closed() {
        None => RandomMotion::new(model.mechanism(), model.channels(), STATES, TYPICAL_SEED)
            .with_coordinates(model, TYPICAL_SEED),
        Some(closed) => closed.random_motion(STATES, TYPICAL_SEED),
    };
    let mut block = RegressorBlock::new(model.layout().clone(), STATES);
    motion.with_block(|m| model.regressor(m, &model.parameters().shape_start(), &mut block));
    let mut peaks: Vec<f64> = (0..model.outputs().len())
        .map(|j| block.effort(j, values).iter().fold(0.0_f64, |m, x| m.max(x.abs())))
        .collect();
    for motor in 0..peaks.len() {
        if let Some((link, ratio)) = model.elastic_link(motor) {
            peaks[motor] = peaks[link] / ratio.abs();
        }
    }
    peaks
}
