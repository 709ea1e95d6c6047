//! An estimate on other logs.

use std::path::Path;

use dynid_logs::MappingSpec;
use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::ConditioningSettings;

use crate::Error;
use crate::agreement::{Agreement, Alignment, compare};
use crate::config::{LogConfig, MotorSide};
pub use crate::estimate::log_fit;
use crate::estimate::{Estimate, Split};
use crate::log::Log;
use crate::logs;
use crate::pipeline::known::logged_beyond;
use dynid_identify::cyclic_doubt::doubts;

/// Logs as predicted and as measured.
#[derive(Debug, Clone)]
pub struct Validation {
    /// Per log.
    pub agreements: Vec<Agreement>,
    /// What to know about them, in words: temperatures beyond the range of known friction, cyclic efforts that a log does not have.
    pub warnings: Vec<String>,
}

/// Predicts logs by an estimate and compares.
///
/// `split`: by the physically consistent parameters, or by those without constraints.
/// `filter_hz`: cut-off of the filter for the filtered figures; `None`: the estimate's kernel cut-off.
///
/// # Errors
/// [`Error`]: bad input.
pub fn validate(
    estimate: &Estimate,
    split: Split,
    file: &Path,
    logs: &[LogConfig],
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
    filter_hz: Option<f64>,
) -> Result<Validation, Error> {
    let model = estimate.effort_model(file, split)?;
    let axes = crate::log::axes(&model);
    let loaded = logs.iter().map(|log| logs::load(log, &axes, columns, motor_side));
    validate_logs(estimate, (&model, &estimate.values(split)), loaded, filter_hz)
}

/// [`validate`] for logs at hand, one after the other. `model`: the estimate's by a split ([`Estimate::effort_model`]), and its parameters; logs
/// have its axes.
///
/// # Errors
/// What a log comes with; signals that cannot be filtered.
pub fn validate_logs(
    estimate: &Estimate,
    (model, values): (&RobotModel, &[f64]),
    logs: impl IntoIterator<Item = Result<Log, Error>>,
    filter_hz: Option<f64>,
) -> Result<Validation, Error> {
    let settings = ConditioningSettings::default();
    let alignment = Alignment {
        state_hz: estimate.model.state_hz,
        delay_samples: estimate.conditioning.delay_samples,
        delay_rate_hz: estimate.conditioning.delay_rate_hz,
        filter_hz: filter_hz.unwrap_or(estimate.model.kernel_hz),
    };
    debug_assert_eq!(model.outputs().len(), estimate.joints.len());
    let mut out = Validation { agreements: Vec::new(), warnings: Vec::new() };
    for log in logs {
        let prepared = log?.prepare(model, &settings)?;
        out.warnings.extend(logged_beyond(&estimate.model.known_friction, &prepared));
        let agreement = compare(model, values, &prepared, &alignment, &settings)?;
        out.warnings.extend(doubts((model, values), &prepared, &alignment, &settings, &agreement)?);
        out.agreements.push(agreement);
    }
    Ok(out)
}
