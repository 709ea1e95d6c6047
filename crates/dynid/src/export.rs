//! Identified parameters back into a robot file: [`dynid_export`], and states of log files to compare efforts at.

use dynid_logs::MappingSpec;
use dynid_model::RobotModel;
use dynid_rows::conditioning::ConditioningSettings;

pub use dynid_export::*;

use crate::Error;
use crate::config::{LogConfig, MotorSide};

/// States of log files, at the state cut-off of an estimate, Hz.
///
/// # Errors
/// Fails as [`validate`](crate::validate::validate()) does.
pub fn read_states(
    model: &RobotModel,
    state_hz: f64,
    logs: &[LogConfig],
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<CheckStates, Error> {
    let settings = ConditioningSettings::default();
    let prepared = logs.iter().map(|log| {
        let loaded = crate::logs::load(log, &crate::log::axes(model), columns, motor_side)?;
        loaded.prepare(model, &settings)
    });
    CheckStates::logs(&prepared.collect::<Result<Vec<_>, Error>>()?, state_hz, &settings)
}
