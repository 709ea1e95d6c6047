//! Nominal parameters of a robot: what its file states, and typical friction where it states none.

use std::collections::BTreeMap;

use dynid_identify::Error;
use dynid_identify::elements::ElementPlan;
use dynid_model::{EffortModel, RandomMotion, RegressorBlock, RobotModel};

/// Seed of the states that typical friction is scaled by: the same robot always gets the same truth.
const TYPICAL_SEED: u64 = 1;

/// Share of the largest rigid effort over random states that typical friction has.
const RIGID_SHARE: f64 = 0.1;
/// Share of the effort limit that it has at most: drives have effort to spare for their load.
const LIMIT_SHARE: f64 = 0.03;

/// Values of all linear parameters of `model`: link inertias and element values of the robot file, `given` values by name
/// over them. Friction about which neither says anything is typical for the joint: Coulomb `e` (static `1.3 e`, sigmoids
/// from `-e` to `e`) and viscous `e` at the speed limit, with `e` 10 % of the largest rigid effort over random states, but
/// at most 3 % of the effort limit. Offsets, rotors and what else elements may have are zero then. Parameters that ties let follow from
/// others do, unless they are given.
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
    let rigid = typical_efforts(model, &values);
    let mut stated: Vec<(String, f64)> = Vec::new();
    for (j, joint) in model.joints().iter().enumerate() {
        let (at, ratio) = model.elastic_link(j).map_or((j, 1.0), |(link, ratio)| (link, ratio.abs()));
        let speed = model.limits(at).velocity.unwrap_or(2.0) * ratio;
        let limit = model.limits(at).effort.filter(|e| e.is_finite() && *e > 0.0);
        let friction = (RIGID_SHARE * rigid[j]).min(limit.map_or(f64::INFINITY, |e| LIMIT_SHARE * e / ratio));
        let typical = [
            ("fc", friction),
            ("fv", friction / speed),
            ("fs", 1.3 * friction),
            ("ft", friction),
            ("fg", 2.0 * friction),
            ("fl", 2.0 * friction),
        ];
        stated.extend(typical.map(|(symbol, value)| (format!("{}.{symbol}", joint.name), value)));
    }
    stated.extend(plan.stated_values());
    for (name, value) in stated {
        if let Some(column) = table.column(&name) {
            values[column] = value;
        }
    }
    let tied = plan.tied_model(model.mechanism())?;
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
    // A value that is given stands, whatever the ties say.
    for dependent in tied.ties().into_iter().flat_map(|ties| ties.linear()) {
        if !given.contains_key(&table.linear[dependent.index].name) {
            values[dependent.index] = dependent.value(&values);
        }
    }
    Ok(values)
}

/// The model with `given` values by name of its shape parameters. Those that ties let follow from others do, unless they are given.
///
/// # Errors
/// [`Error::Setting`] if a value does not lie within the bounds of its parameter; [`Error::Tie`].
pub fn with_nominal_shape(
    model: RobotModel,
    plan: &ElementPlan,
    given: &BTreeMap<String, f64>,
) -> Result<RobotModel, Error> {
    let tied = plan.tied_model(model.mechanism())?;
    let mut shape = model.parameters().shape_start();
    for (parameter, value) in model.parameters().shape.iter().zip(&mut shape) {
        let Some(stated) = given.get(&parameter.name) else { continue };
        if !(*stated >= parameter.lower && *stated <= parameter.upper) {
            let expected = format!("{} to {} {}", parameter.lower, parameter.upper, parameter.unit);
            return Err(Error::setting(&format!("values.{}", parameter.name), &expected, stated));
        }
        *value = *stated;
    }
    for dependent in tied.ties().into_iter().flat_map(|ties| ties.shape()) {
        if !given.contains_key(&model.parameters().shape[dependent.index].name) {
            shape[dependent.index] = dependent.value(&shape);
        }
    }
    Ok(model.with_shape(&shape))
}

/// Largest rigid effort of every joint over random states; of motors behind springs that of their joints, seen through the
/// ratio. Of mechanisms with loops three times the median, since the largest one says how near a state came to a singular
/// pose.
pub fn typical_efforts(model: &RobotModel, values: &[f64]) -> Vec<f64> {
    const STATES: usize = 100;
    let motion = match model.closed() {
        None => RandomMotion::new(model.mechanism(), model.channels(), STATES, TYPICAL_SEED)
            .with_coordinates(model, TYPICAL_SEED),
        Some(closed) => closed.random_motion(STATES, TYPICAL_SEED),
    };
    let mut block = RegressorBlock::new(model.layout().clone(), STATES);
    motion.with_block(|m| model.regressor(m, &model.parameters().shape_start(), &mut block));
    let largest = |mut sizes: Vec<f64>| match model.closed() {
        None => sizes.into_iter().fold(0.0, f64::max),
        Some(_) => 3.0 * *sizes.select_nth_unstable_by(STATES / 2, f64::total_cmp).1,
    };
    let sizes = |j: usize| block.effort(j, values).iter().map(|x| x.abs()).collect();
    let mut peaks: Vec<f64> = (0..model.outputs().len()).map(|j| largest(sizes(j))).collect();
    for motor in 0..peaks.len() {
        if let Some((link, ratio)) = model.elastic_link(motor) {
            peaks[motor] = peaks[link] / ratio.abs();
        }
    }
    peaks
}
