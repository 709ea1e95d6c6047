//! How logs were read.

use dynid_logs::MappingSpec;
use serde::{Deserialize, Serialize};

/// Transmission between the motors that a log records and the joints: `q_motor = matrix · (q - offset)`,
/// `effort_joint = matrixᵀ · effort_motor`.
#[derive(Debug, Clone, Default, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorSide {
    /// Transmission matrix, one row per motor, one column per joint.
    pub matrix: Vec<Vec<f64>>,
    /// Joint position at motor position zero, rad or m. Default: zeros.
    pub offset: Vec<f64>,
}

/// How the training logs were read, for logs of the same kind to be read alike.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct ReadingRecord {
    /// Columns as the run stated them, drive gains included; what it does not state is found by name. Where all training
    /// logs state the same columns of their own, these.
    pub columns: MappingSpec,
    /// Transmission between logged motors and joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor_side: Option<MotorSide>,
    /// How the columns of every training log were understood: signal, columns.
    pub understood: Vec<Vec<(String, String)>>,
}

impl ReadingRecord {
    /// Whether the run stated columns, and did not leave all of them to their names.
    pub fn states_columns(&self) -> bool {
        self.columns != MappingSpec::default()
    }
}
