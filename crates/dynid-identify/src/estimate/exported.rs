//! What robot files hold of an identified model, and what that costs.

use serde::{Deserialize, Serialize};

use crate::agreement::FileFit;

/// Loss of effort, in per cent of the joint's effort, above which an exported file is not the model that was judged.
pub const EXPORT_LOSS_LIMIT: f64 = 5.0;

/// Robot files beside the identified model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ExportedRecord {
    /// What files state of the joints.
    pub joints: Vec<ExportedJoint>,
    /// Friction of other forms, and what stands for it.
    pub projections: Vec<FrictionProjection>,
    /// Figures on the training logs.
    pub training: Vec<ExportedLog>,
    /// Figures on the validation logs.
    pub validation: Vec<ExportedLog>,
}

/// What files state of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ExportedJoint {
    /// Joint.
    pub joint: String,
    /// URDF `friction`, MJCF `frictionloss`, N m or N.
    pub friction_loss: f64,
    /// `damping`, N m s/rad or N s/m.
    pub damping: f64,
    /// MJCF `armature`, kg m² or kg; URDF has no place for it.
    pub rotor_inertia: f64,
    /// MJCF `stiffness`, N m/rad or N/m; URDF has no place for it.
    #[serde(default)]
    pub stiffness: f64,
    /// MJCF `springref`, rad or m; 0 without a spring.
    #[serde(default)]
    pub spring_reference: f64,
}

/// What files predict on a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ExportedLog {
    /// Log file.
    pub log: String,
    /// Cut-off of the filter that prediction and measurement pass, Hz.
    pub filter_hz: f64,
    /// The MJCF; also the URDF with the rotor inertias of [`ExportedJoint`] added.
    pub mjcf: FileFit,
    /// The URDF alone.
    pub urdf: FileFit,
}

impl ExportedRecord {
    /// The log that files are judged on: the first validation log, else the first training log.
    pub fn judged(&self) -> Option<&ExportedLog> {
        self.validation.first().or(self.training.first())
    }
}

/// Friction loss and damping that stand in a robot file for friction of other forms.
///
/// `effort of the joint's elements ≈ friction_loss · sign(q̇) + damping · q̇ + constant`, least squares over the states
/// of the training logs in which the joint moves; neither coefficient is negative, since simulators refuse that. The constant keeps
/// sensor offsets and loads out of both and has no place in a file. Rotor inertia is not part of it, but where motors are coupled: their
/// rotors and that of the joint only make sense together, and `+ rotor_inertia · q̈` stands for all of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrictionProjection {
    /// Joint.
    pub joint: String,
    /// Coefficient of `sign(q̇)`, N m or N.
    pub friction_loss: f64,
    /// Coefficient of `q̇`, N m s/rad or N s/m.
    pub damping: f64,
    /// Coefficient of `q̈` where coupled motors act on the joint, kg m² or kg; absent: the joint's own rotor inertia.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotor_inertia: Option<f64>,
    /// Linear parameters of the elements that it stands for, name and value.
    pub parameters: Vec<(String, f64)>,
    /// States that it was formed over, in words.
    pub states: String,
}
