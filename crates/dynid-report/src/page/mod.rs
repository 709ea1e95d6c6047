//! The page: checked data in, HTML out.

mod chart;
mod checks;
mod context;
mod design;
mod environment;
mod first;
mod joints;
mod lengths;
mod log_page;
mod picture;
mod prose;
mod pruning;
mod script_data;
mod study;
mod trust;
mod words;

use crate::data::{DesignReport, JointsReport, LogPage, ReportData, StudyReport, StudyTable};
use crate::error::ReportError;

/// Lays the report out as one HTML file that needs nothing else.
///
/// The file loads nothing from anywhere (it even forbids its own browser to, by a content security policy), keeps
/// under 4 MB for the logs of a 7-axis robot at 100 000 samples, and depends on `data` alone: same data, same bytes.
///
/// # Errors
///
/// [`ReportError::Length`] if a "per joint" list is neither empty nor as long as [`ReportData::joints`], or a series
/// is not as long as its time; [`ReportError::Count`] if a count contradicts the list that it counts; [`ReportError::Time`] if the time of a log is not finite or runs backwards.
/// The other variants would be faults of this crate.
pub fn render(data: &ReportData) -> Result<String, ReportError> {
    checks::check(data)?;
    let environment = environment::environment()?;
    let context = context::context(data)?;
    Ok(environment.get_template(environment::PAGE)?.render(context)?)
}

/// Lays the report of a designed trajectory out as one HTML file, with the properties of [`render`]'s.
///
/// # Errors
///
/// [`ReportError::Length`] if the motion has not one entry per entry of [`DesignReport::joints`], or an array of it or the
/// path of a frame is not as long as the time; [`ReportError::Time`] if the time is not finite or runs backwards;
/// [`ReportError::Recorded`] if the recorded part does not run from a finite start to an end behind it. The other variants
/// would be faults of this crate.
pub fn render_design(data: &DesignReport) -> Result<String, ReportError> {
    design::check(data)?;
    let environment = environment::environment()?;
    let context = design::context(data)?;
    Ok(environment.get_template(environment::DESIGN_PAGE)?.render(context)?)
}

/// Lays a report by joints out as one HTML file, with the properties of [`render`]'s; it is complete without
/// a script.
///
/// # Errors
///
/// [`ReportError::Length`] if a row of a table has more cells than the table has headings. The other variants would be
/// faults of this crate.
pub fn render_joints(data: &JointsReport) -> Result<String, ReportError> {
    check_tables(data.overview.iter().chain(&data.joints).flat_map(|j| &j.tables))?;
    let environment = environment::environment()?;
    Ok(environment.get_template(environment::JOINTS_PAGE)?.render(joints::context(data))?)
}

fn check_tables<'a>(tables: impl Iterator<Item = &'a StudyTable>) -> Result<(), ReportError> {
    for table in tables {
        if let Some(row) = table.rows.iter().find(|row| row.len() > table.head.len()) {
            let place = format!("table {:?}", table.caption);
            return Err(ReportError::Length { place, expected: table.head.len(), found: row.len() });
        }
    }
    Ok(())
}

/// Lays the report of a study out as one HTML file, with the properties of [`render`]'s; it is complete without a script.
///
/// # Errors
///
/// [`ReportError::Length`] if a row of a table has more cells than the table has headings. The other variants would be
/// faults of this crate.
pub fn render_study(data: &StudyReport) -> Result<String, ReportError> {
    render_kind("Study", data)
}

/// The page for a result that is no study, under the name of its kind; without claims it has no part for them.
///
/// # Errors
///
/// Fails as [`render_study`] does.
pub fn render_kind(kind: &str, data: &StudyReport) -> Result<String, ReportError> {
    check_tables(data.sections.iter().flat_map(|s| &s.tables))?;
    let environment = environment::environment()?;
    Ok(environment.get_template(environment::STUDY_PAGE)?.render(study::context(kind, data))?)
}

/// Lays a page about logs out as one HTML file, with the properties of [`render`]'s; it is complete without a script.
///
/// # Errors
///
/// [`ReportError::Length`] if a row of a table has more cells than the table has headings. The other variants would be
/// faults of this crate.
pub fn render_log_page(data: &LogPage) -> Result<String, ReportError> {
    check_tables(data.sections.iter().flat_map(|s| &s.tables))?;
    let environment = environment::environment()?;
    Ok(environment.get_template(environment::LOG_PAGE)?.render(log_page::context(data))?)
}
