//! Faults of pages, which know nothing of identifications.

use dynid_identify::{Error, Fault};
use dynid_report::ReportError;

/// A page cannot be rendered.
#[derive(Debug, thiserror::Error)]
#[error("report: {0}")]
pub struct PageError(#[from] ReportError);

impl Fault for PageError {}

impl From<PageError> for Error {
    fn from(fault: PageError) -> Self {
        Error::Job(Box::new(fault))
    }
}

/// A page as one HTML text.
///
/// # Errors
/// [`PageError`].
pub fn page(rendered: Result<String, ReportError>) -> Result<String, Error> {
    Ok(rendered.map_err(PageError)?)
}
