//! What robot files predict, beside the model that they come from.

use serde::Serialize;

/// Robot files judged on one log.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FileJudgement {
    /// Log.
    pub log: String,
    /// Share of the effort, %, above which a loss is marked.
    pub limit_percent: f64,
    /// Per joint.
    pub joints: Vec<FileJoint>,
    /// Error of the model over all joints, %.
    pub model_percent: Option<f64>,
    /// Error of the file with rotor inertias (MJCF, or URDF with them added) over all joints, %.
    pub with_rotor_percent: Option<f64>,
    /// Error of the URDF alone over all joints, %.
    pub urdf_percent: Option<f64>,
}

/// A joint in robot files.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FileJoint {
    /// Joint.
    pub joint: String,
    /// Unit of its effort.
    pub effort_unit: String,
    /// Friction that the file states, in that unit.
    pub friction_loss: Option<f64>,
    /// Damping that the file states.
    pub damping: Option<f64>,
    /// Rotor inertia, which a URDF has no place for.
    pub rotor_inertia: Option<f64>,
    /// Friction of another form was projected.
    pub projected: bool,
    /// Error of the identified model, %.
    pub model_percent: Option<f64>,
    /// Of the file with rotor inertias.
    pub with_rotor: FileLoss,
    /// Of the URDF alone.
    pub urdf: FileLoss,
}

/// What a file loses at a joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FileLoss {
    /// Error of the file, % of the effort.
    pub error_percent: Option<f64>,
    /// RMS of the model's effort minus the file's.
    pub loss: Option<f64>,
    /// RMS of the model's effort minus the file's, in % of the effort.
    pub loss_percent: Option<f64>,
}
