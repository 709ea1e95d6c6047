//! Friction in the two terms that robot files have: least squares over the states of a log.

use dynid_estimate::linear::ols;
use dynid_factor::factor::{Factor, FactorBuilder};
pub use dynid_identify::estimate::FrictionProjection;
use dynid_model::element::sign;
use dynid_model::{EffortModel, RegressorBlock, RobotModel};

use super::read_back::{CheckStates, with_slipping_bristles};

/// Samples slower than this share of the joint's greatest speed are left out: there the sign of the velocity is noise.
const MOVING_SHARE: f64 = 0.02;

/// Parameters beside `fc`, `fv` (or those of both directions) that need no projection: files state them, or they are no friction.
const STATED: [&str; 9] = ["fc", "fv", "fcp", "fcn", "fvp", "fvn", "Ia", "fo", "K"];
/// Parameters of springs between motors and joints.
const ELASTIC: [&str; 3] = ["k1", "k2", "d"];

/// Linear parameters of elements that act on an output with a value other than zero, by column.
fn acting<'a>(model: &'a RobotModel, values: &'a [f64], output: usize) -> impl Iterator<Item = usize> + 'a {
    let bodies = 10 * model.mechanism().bodies().len();
    let columns = model.layout().columns(output).iter().copied();
    columns.filter(move |c| *c >= bodies && values[*c] != 0.0)
}

/// Whether the effort of a parameter follows positions: no friction, which a projection must not take for one.
fn follows_position(model: &RobotModel, output: usize, column: usize) -> bool {
    is_own(model, output, column, &ELASTIC)
        || model.tree().is_of_position(&model.parameters().linear[column].name)
}

fn is_own(model: &RobotModel, output: usize, column: usize, symbols: &[&str]) -> bool {
    let name = &model.parameters().linear[column].name;
    let own = name.strip_prefix(model.joints()[output].name.as_str()).and_then(|s| s.strip_prefix('.'));
    own.is_some_and(|symbol| symbols.contains(&symbol))
}

/// Name and value of the elements' parameters that act on an output.
fn parameters(model: &RobotModel, values: &[f64], output: usize) -> Vec<(String, f64)> {
    acting(model, values, output).map(|c| (model.parameters().linear[c].name.clone(), values[c])).collect()
}

/// Whether the friction of an output has a form that files have no place for. `known`: it has known friction, too.
fn needs_projection(model: &RobotModel, values: &[f64], known: bool, output: usize) -> bool {
    model.elastic_link(output).is_none()
        && (known
            || acting(model, values, output)
                .any(|c| !is_own(model, output, c, &STATED) && !follows_position(model, output, c)))
}

/// The projections of all joints whose friction needs one. `known`: whether a joint has known friction.
pub(crate) fn project(
    model: &RobotModel,
    values: &[f64],
    known: impl Fn(&str) -> bool,
    states: &CheckStates,
) -> Vec<FrictionProjection> {
    let outputs: Vec<usize> = (0..model.joints().len())
        .filter(|o| needs_projection(model, values, known(&model.joints()[*o].name), *o))
        .collect();
    if outputs.is_empty() {
        return Vec::new();
    }
    let coupled: Vec<bool> = outputs.iter().map(|o| is_coupled(model, values, *o)).collect();
    let elements: Vec<Vec<f64>> = outputs
        .iter()
        .zip(&coupled)
        .map(|(o, coupled)| elements_alone(model, values, *o, *coupled))
        .collect();
    let mut fastest = vec![0.0_f64; outputs.len()];
    states.for_each_block(|motion| {
        for (output, fastest) in outputs.iter().zip(&mut fastest) {
            *fastest = motion.rate(*output).iter().fold(*fastest, |most, v| most.max(v.abs()));
        }
    });
    let mut builders: Vec<FactorBuilder> = outputs.iter().map(|_| FactorBuilder::new(4)).collect();
    let mut block = RegressorBlock::new(model.layout().clone(), states.room());
    let shape = model.parameters().shape_start();
    states.for_each_block(|motion| {
        with_slipping_bristles(model, motion, |motion| model.regressor(motion, &shape, &mut block));
        for (k, output) in outputs.iter().enumerate() {
            let effort = block.effort(*output, &elements[k]);
            let least = MOVING_SHARE * fastest[k];
            let rotor = motion.acceleration(*output).iter().map(|a| if coupled[k] { *a } else { 0.0 });
            for ((v, a), effort) in motion.rate(*output).iter().zip(rotor).zip(effort) {
                if v.abs() > least && effort.is_finite() {
                    builders[k]
                        .push_row(&[sign(*v), *v, a, 1.0], effort)
                        .unwrap_or_else(|e| unreachable!("finite columns: {e}"));
                }
            }
        }
    });
    outputs
        .into_iter()
        .zip(coupled)
        .zip(builders)
        .map(|((output, coupled), builder)| {
            let [friction_loss, damping, rotor] = least_squares(&builder.finish(), coupled);
            FrictionProjection {
                joint: model.joints()[output].name.clone(),
                friction_loss,
                damping,
                rotor_inertia: coupled.then_some(rotor),
                parameters: parameters(model, values, output),
                states: states.describe(),
            }
        })
        .collect()
}

/// Whether coupled motors act on an output: their parameters are named after them, not after the joint.
fn is_coupled(model: &RobotModel, values: &[f64], output: usize) -> bool {
    let own = format!("{}.", model.joints()[output].name);
    acting(model, values, output).any(|c| !model.parameters().linear[c].name.starts_with(&own))
}

/// Values of the elements of an output alone: without what follows its position, and without its rotor unless motors are `coupled`.
fn elements_alone(model: &RobotModel, values: &[f64], output: usize, coupled: bool) -> Vec<f64> {
    let rubs =
        |c: &usize| !follows_position(model, output, *c) && (coupled || !is_own(model, output, *c, &["Ia"]));
    let mut out = vec![0.0; values.len()];
    for c in acting(model, values, output).filter(rubs) {
        out[c] = values[c];
    }
    out
}

/// Coefficients of `sign(q̇)`, `q̇` and (`coupled`) `q̈`, none negative, beside a free constant: the best of all choices of which are
/// zero.
fn least_squares(factor: &Factor, coupled: bool) -> [f64; 3] {
    let columns = if coupled { 3 } else { 2 };
    let solved = (0..1_usize << columns).filter_map(|choice| {
        let mut kept: Vec<usize> = (0..columns).filter(|c| choice >> c & 1 == 1).collect();
        kept.push(3);
        let mut x = [0.0; 4];
        for (column, value) in kept.iter().zip(&ols(&factor.select(&kept)).x) {
            x[*column] = *value;
        }
        let [friction_loss, damping, rotor, _] = x;
        let found = [friction_loss, damping, rotor];
        found.iter().all(|value| *value >= 0.0).then(|| (factor.rss(&x), found))
    });
    solved.min_by(|a, b| a.0.total_cmp(&b.0)).map_or([0.0; 3], |(_, found)| found)
}

/// Whether recorded projections are those of a model: same joints, same parameters.
pub(crate) fn fits(
    recorded: &[FrictionProjection],
    model: &RobotModel,
    values: &[f64],
    known: impl Fn(&str) -> bool,
) -> bool {
    (0..model.joints().len()).all(|output| {
        let name = &model.joints()[output].name;
        !needs_projection(model, values, known(name), output)
            || recorded.iter().any(|p| p.joint == *name && p.parameters == parameters(model, values, output))
    })
}
