//! Shape parameters of an identified model.

use dynid_model::element::{JointElement, Linearised, change_name};
use dynid_model::{EffortModel, RobotModel};

use crate::Error;
use crate::elements::ElementPlan;

/// The model of a plan, linearised about its shape parameters and the given linear parameters: every shape parameter
/// becomes a linear one, the change from its value.
///
/// # Errors
/// As [`ElementPlan::build`].
///
/// # Panics
/// If `linear` is not one value per linear parameter of `model`, or `model` is not of this plan.
pub fn linearised(plan: &ElementPlan, model: &RobotModel, linear: &[f64]) -> Result<RobotModel, Error> {
    assert_eq!(linear.len(), model.parameters().linear.len(), "length of linear");
    let mechanism = model.mechanism();
    let shape = model.parameters().shape_start();
    let (mut shape, mut linear) = (shape.as_slice(), &linear[mechanism.inertial_parameters()..]);
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for element in plan.build(mechanism)? {
        let own_shape = take(&mut shape, element.shape(model.joints()).len());
        let own_linear = take(&mut linear, element.parameters(model.joints()).len());
        elements.push(match own_shape {
            [] => element,
            _ => Box::new(Linearised::new(element, model.joints(), own_shape.to_vec(), own_linear.to_vec())),
        });
    }
    Ok(RobotModel::new(mechanism.clone(), elements))
}

fn take<'a>(rest: &mut &'a [f64], count: usize) -> &'a [f64] {
    let (own, others) = rest.split_at(count);
    *rest = others;
    own
}

/// Parameters of a linearised model taken apart again.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfolded {
    /// Linear parameters of the nonlinear model.
    pub linear: Vec<f64>,
    /// Its shape parameters: where the model was linearised, plus the changes, within their bounds.
    pub shape: Vec<f64>,
}

/// Values of the nonlinear model from those of the linearised one.
///
/// # Panics
/// If `values` is not one value per linear parameter of `linearised`.
pub fn unfold(model: &RobotModel, linearised: &RobotModel, values: &[f64]) -> Unfolded {
    let table = linearised.parameters();
    assert_eq!(values.len(), table.linear.len(), "length of values");
    let shape = &model.parameters().shape;
    let change = |name: &str| table.column(&change_name(name)).map_or(0.0, |c| values[c]);
    Unfolded {
        shape: shape.iter().map(|s| (s.start + change(&s.name)).clamp(s.lower, s.upper)).collect(),
        linear: kept_columns(model, linearised).map(|c| values[c]).collect(),
    }
}

/// Columns of the linearised model that the nonlinear one has too, in its order.
pub(crate) fn kept_columns<'a>(
    model: &'a RobotModel,
    linearised: &'a RobotModel,
) -> impl Iterator<Item = usize> + 'a {
    let names: Vec<String> = model.parameters().shape.iter().map(|s| change_name(&s.name)).collect();
    let table = &linearised.parameters().linear;
    (0..table.len()).filter(move |c| !names.contains(&table[*c].name))
}
