//! True parameters of a virtual robot.

use dynid_model::{EffortModel, RandomMotion, RegressorBlock, RobotModel};

use super::settings::{SimulateSettings, setting};
use crate::Error;
use crate::elements::ElementPlan;

/// Seed of the states that typical friction is scaled by: the same robot always gets the same truth.
const TYPICAL_SEED: u64 = 1;

pub(super) fn truth(
    model: &RobotModel,
    plan: &ElementPlan,
    settings: &SimulateSettings,
) -> Result<Vec<f64>, Error> {
    let table = model.parameters();
    let mut values = table.prior();
    let peaks = typical_efforts(model, &values);
    let owners = model.mechanism().rate_bodies();
    let mut given: Vec<(String, f64)> = Vec::new();
    for (j, joint) in model.joints().iter().enumerate() {
        let speed = model.mechanism().bodies()[owners[j]].joint.limits.velocity.unwrap_or(2.0);
        for (symbol, value) in [("fc", 0.1 * peaks[j]), ("fv", 0.1 * peaks[j] / speed)] {
            given.push((format!("{}.{symbol}", joint.name), value));
        }
    }
    given.extend(plan.stated_values());
    for (name, value) in given {
        if let Some(column) = table.column(&name) {
            values[column] = value;
        }
    }
    for (name, value) in &settings.values {
        let Some(column) = table.column(name) else {
            return Err(setting("values", "names of parameters such as `j1.fc`", name));
        };
        if !value.is_finite() {
            return Err(setting(&format!("values.{name}"), "a finite number", value));
        }
        values[column] = *value;
    }
    Ok(values)
}

/// Largest rigid effort of every joint over random states.
fn typical_efforts(model: &RobotModel, values: &[f64]) -> Vec<f64> {
    const STATES: usize = 100;
    let motion = RandomMotion::new(model.mechanism(), model.channels(), STATES, TYPICAL_SEED);
    let mut block = RegressorBlock::new(model.layout().clone(), STATES);
    motion.with_block(|m| model.regressor(m, &[], &mut block));
    (0..model.outputs().len())
        .map(|j| block.effort(j, values).iter().fold(0.0_f64, |m, x| m.max(x.abs())))
        .collect()
}
