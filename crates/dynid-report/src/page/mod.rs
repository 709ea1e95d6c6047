//! The page: checked data in, HTML out.

mod checks;
mod context;
mod environment;
mod prose;
mod pruning;
mod script_data;
mod trust;

use crate::data::ReportData;
use crate::error::ReportError;

/// Lays the report out as one HTML file that needs nothing else.
///
/// The file loads nothing from anywhere (it even forbids its own browser to, by a content security policy), keeps
/// under 4 MB for the logs of a 7-axis robot at 100 000 samples, and depends on `data` alone: same data, same bytes.
///
/// # Errors
///
/// [`ReportError::Length`] if a "per joint" list is neither empty nor as long as [`ReportData::joints`], or a series
/// is not as long as its time; [`ReportError::Time`] if the time of a log is not finite or runs backwards.
/// The other variants would be faults of this crate.
pub fn render(data: &ReportData) -> Result<String, ReportError> {
    checks::check(data)?;
    let environment = environment::environment()?;
    let context = context::context(data)?;
    Ok(environment.get_template(environment::PAGE)?.render(context)?)
}
