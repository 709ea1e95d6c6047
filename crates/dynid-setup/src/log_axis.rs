//! What logs have columns for.

use dynid_logs::columns::EffortColumn;
use dynid_model::{EffortModel, Limits, RobotModel};

/// A coordinate that a log has columns for: a joint, or the motor behind an elastic one.
#[derive(Debug, Clone, PartialEq)]
pub struct LogAxis {
    /// Joint or motor.
    pub name: String,
    /// Whether the axis slides instead of turning.
    pub slides: bool,
    /// Whether the axis is a motor behind a spring.
    pub motor: bool,
    /// Limits.
    pub limits: Limits,
    /// What its effort column holds: that of an elastic joint is absent, or a sensor's.
    pub effort: EffortColumn,
}

/// Columns of logs for a model, in the order of its outputs.
pub fn axes(model: &RobotModel) -> Vec<LogAxis> {
    let outputs = model.joints().iter().enumerate();
    outputs
        .map(|(rate, joint)| LogAxis {
            name: joint.name.clone(),
            slides: joint.slides,
            motor: model.elastic_link(rate).is_some(),
            limits: model.limits(rate),
            effort: match model.elastic_motor(rate) {
                _ if model.is_undriven(rate) => EffortColumn::Absent,
                Some(_) => EffortColumn::Sensor,
                None => EffortColumn::Drive,
            },
        })
        .collect()
}

/// Names of axes.
pub fn names(axes: &[LogAxis]) -> Vec<String> {
    axes.iter().map(|a| a.name.clone()).collect()
}

/// Efforts as a user counts them, from those of a model or back: the reading of a torque sensor is the negative effort of its
/// link.
pub fn as_logged(model: &RobotModel, mut efforts: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for (axis, effort) in axes(model).iter().zip(&mut efforts) {
        if axis.effort == EffortColumn::Sensor {
            effort.iter_mut().for_each(|e| *e = -*e);
        }
    }
    efforts
}
