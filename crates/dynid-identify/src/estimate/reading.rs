//! How logs were read.

use dynid_io::{MappingSpec, SourceFile};
use serde::{Deserialize, Serialize};

use crate::input_record::{InputKind, InputRecord};
use crate::robot::Robot;

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

impl InputRecord {
    /// A file that was read.
    pub fn of(kind: InputKind, source: &SourceFile) -> Self {
        let SourceFile { path, sha256 } = source.clone();
        InputRecord { path, kind, sha256 }
    }

    /// A robot file, and the URDF that it refers to.
    pub fn of_robot(robot: &Robot) -> Vec<Self> {
        let kinds = [InputKind::Robot, InputKind::Urdf];
        robot.file.sources.iter().zip(kinds).map(|(source, kind)| InputRecord::of(kind, source)).collect()
    }
}
