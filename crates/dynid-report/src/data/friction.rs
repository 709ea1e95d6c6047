//! Friction laws that are not linear in their parameters, and how they were chosen.

pub use dynid_record::ShapeVerdict;
use serde::Serialize;

/// A parameter that enters the effort nonlinearly, such as a Stribeck velocity.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ShapeParameter {
    /// Name with its joint, e.g. `joint_1.vs`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value in use.
    pub value: Option<f64>,
    /// Standard deviation, same unit.
    pub std: Option<f64>,
    /// 95 % interval, lower then upper end, same unit; one-sided ones end at a bound of the range.
    pub interval: Option<[f64; 2]>,
    /// Range that was searched, same unit.
    pub range: Option<[f64; 2]>,
    /// What the logs say about it.
    pub verdict: ShapeVerdict,
    /// Why, in words; may be empty.
    pub reason: String,
}

/// A friction shape that was tried.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FrictionTrial {
    /// Joint.
    pub joint: String,
    /// Element that stands for the shape.
    pub element: String,
    /// Speed, exponent or travel that the shape has.
    pub value: Option<f64>,
    /// Unit of `value`.
    pub unit: String,
    /// By how much the mean square of the held-out error falls, %.
    pub gain_percent: Option<f64>,
    /// Standard error of the gain, %.
    pub standard_error_percent: Option<f64>,
    /// Whether it was taken.
    pub accepted: bool,
}
