//! What a robot file holds and what of it can be identified, and what a log holds.

mod clearance;
mod log;
mod loops;

use dynid_model::{BaseParameters, BaseSettings, EffortModel, Ties};
use serde::Serialize;

use crate::Error;
use crate::elements::ElementPlan;
use crate::estimate::JointType;
use crate::robot::Robot;
pub use clearance::{ClearanceRow, ContactLawName, RestingJournal};
pub use log::{LogColumn, LogInspection, inspect_log};
pub use loops::{ClosureRow, LoopsInspection};

/// Structure of a robot.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct Inspection {
    /// Robot name.
    pub robot: String,
    /// Root link.
    pub base_link: String,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Moving joints in file order.
    pub joints: Vec<JointRow>,
    /// Motors behind springs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motors: Vec<MotorRow>,
    /// Joints with clearance; all else takes them as ideal.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clearances: Vec<ClearanceRow>,
    /// Closed loops, if there are some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loops: Option<LoopsInspection>,
    /// Number of standard parameters, elements included.
    pub standard_parameters: usize,
    /// Number of base parameters.
    pub base_parameter_count: usize,
    /// Base parameters: name and regrouping.
    pub base_parameters: Vec<BaseRow>,
    /// Parameters that follow from others, or are known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ties: Vec<String>,
    /// Parameters that never act.
    pub never_seen: Vec<String>,
    /// Gap of the singular values at the rank decision: last counted, first not counted.
    pub rank_gap: (f64, Option<f64>),
    /// Oddities.
    pub warnings: Vec<String>,
}

/// One moving joint.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct JointRow {
    /// Number that symbols carry.
    pub number: usize,
    /// Joint.
    pub name: String,
    /// Kind.
    pub kind: JointType,
    /// Moving link.
    pub link: String,
    /// Link it hangs on.
    pub parent: String,
    /// Links welded to the moving link.
    pub fixed_links: Vec<String>,
    /// Axis in the joint frame.
    pub axis: [f64; 3],
    /// Mass of the moving body as stated, kg.
    pub mass: Option<f64>,
    /// Elements.
    pub elements: Vec<String>,
}

/// A motor that drives its joint through a spring.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct MotorRow {
    /// Number that symbols carry.
    pub number: usize,
    /// Motor.
    pub name: String,
    /// Joint of the motor.
    pub joint: String,
    /// Travel of the motor over that of the joint with a stiff spring.
    pub ratio: f64,
    /// The spring has a cubic part.
    pub cubic: bool,
    /// The spring is damped.
    pub damping: bool,
    /// A sensor measures the torque behind the spring.
    pub sensor: bool,
    /// Elements.
    pub elements: Vec<String>,
}

/// One base parameter.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct BaseRow {
    /// Kept parameter.
    pub name: String,
    /// Regrouping.
    pub expression: String,
    /// Unit.
    pub unit: String,
}

/// Analyses a robot with the given elements per joint (`None`: those of its file, else none: rigid bodies alone).
///
/// # Errors
/// [`Error::UnknownElement`], [`Error::Mechanism`].
pub fn inspect(robot: &Robot, elements: Option<&[String]>) -> Result<Inspection, Error> {
    let mechanism = &robot.mechanism;
    let none: &[String] = &[];
    let default = elements.or(if robot.elements.defaults.is_empty() { Some(none) } else { None });
    let elements = robot.elements.with_ideal_bearings();
    let plan = ElementPlan::new(mechanism, &elements, default, |rate| robot.is_driven(rate))?
        .with_loops(robot.closed.clone());
    let model = plan.tied_model(mechanism)?;
    let base = BaseParameters::of_model(&model, &model.parameters().shape_start(), &BaseSettings::default());
    let table = model.parameters();
    let expressions = base.expressions(table);
    let names = plan.names(mechanism);
    let free = |column: &&usize| model.ties().is_none_or(|ties| ties.of_column(**column).is_none());
    let joints = mechanism
        .bodies()
        .iter()
        .enumerate()
        .map(|(k, body)| JointRow {
            number: k + 1,
            name: body.joint.name.clone(),
            kind: body.joint.kind.into(),
            link: body.name.clone(),
            parent: body
                .parent
                .map_or_else(|| mechanism.base_link().to_owned(), |p| mechanism.bodies()[p].name.clone()),
            fixed_links: body.fixed_links.iter().map(|l| l.name.clone()).collect(),
            axis: body.joint.axis.0,
            mass: body.stated.then(|| body.inertia.mass()),
            elements: names
                .iter()
                .position(|n| *n == body.joint.name)
                .map_or_else(Vec::new, |rate| plan.per_rate[rate].clone()),
        })
        .collect();
    let rate_of = |name: &String| names.iter().position(|n| n == name);
    let motors = plan
        .elastic
        .iter()
        .map(|e| {
            let rate = rate_of(&e.motor);
            MotorRow {
                number: rate.map_or(0, |r| r + 1),
                name: e.motor.clone(),
                joint: e.joint.clone(),
                ratio: e.ratio,
                cubic: e.cubic,
                damping: e.damping,
                sensor: e.sensor,
                elements: rate.map_or_else(Vec::new, |r| plan.per_rate[r].clone()),
            }
        })
        .collect();
    Ok(Inspection {
        robot: mechanism.name().to_owned(),
        base_link: mechanism.base_link().to_owned(),
        gravity: mechanism.gravity().0,
        joints,
        motors,
        clearances: clearance::rows(robot)?,
        loops: model.closed().map(loops::of),
        standard_parameters: table.linear.len(),
        base_parameter_count: base.len(),
        base_parameters: base
            .kept
            .iter()
            .zip(expressions)
            .map(|(c, expression)| BaseRow {
                name: table.linear[*c].name.clone(),
                expression,
                unit: table.linear[*c].unit.to_owned(),
            })
            .collect(),
        ties: model.ties().map_or_else(Vec::new, |ties| {
            let linear = ties.linear().iter().map(|d| Ties::words(d, table));
            linear.chain(ties.shape().iter().map(|d| Ties::shape_words(d, table))).collect()
        }),
        never_seen: base.zero.iter().filter(|c| free(c)).map(|c| table.linear[*c].name.clone()).collect(),
        rank_gap: (base.gap.kept, base.gap.dropped),
        warnings: robot
            .warnings
            .iter()
            .cloned()
            .chain(plan.alike(mechanism).iter().map(ToString::to_string))
            .collect(),
    })
}
