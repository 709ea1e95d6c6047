//! Rows of the final fit into triangular factors, one per log, output, scale and time block.

use dynid_model::EffortModel;

use super::log_rows::LogRows;
use super::{Conditioning, ConditioningError, ConditioningSettings, PreparedLog};
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{RowSource, RowsError, reduce_rows};

/// Reduces all logs with the choices made, holding the states of one log at a time.
pub fn reduce(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    choices: &Conditioning,
    settings: &ConditioningSettings,
) -> Result<Vec<ReducedGroup>, ConditioningError> {
    let mut groups = Vec::new();
    for one in logs.iter().enumerate() {
        let rows = LogRows::of(model, shape, kept, std::iter::once(one), choices, settings)?;
        groups.extend(reduce_rows(&rows).map_err(|e| unusable_row(&rows, e))?);
    }
    Ok(groups)
}

/// Names the output instead of the group.
pub(super) fn unusable_row(rows: &dyn RowSource, error: RowsError) -> ConditioningError {
    ConditioningError::Rows { output: rows.groups()[error.group].output, source: error.source }
}
