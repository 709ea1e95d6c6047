//! Faults of rooms that know nothing of identifications.

use dynid_excitation::ProblemError;
use dynid_excitation::constraint::ConstraintError;
use dynid_report::ReportError;

use crate::{Error, Fault};

/// A design problem is not well posed, or a limit on its path cannot be stated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// The problem.
    #[error("design: {0}")]
    Problem(#[from] ProblemError),
    /// A limit.
    #[error("design: {0}")]
    Constraint(#[from] ConstraintError),
}

impl Fault for DesignError {
    fn hint(&self) -> Option<String> {
        matches!(self, DesignError::Problem(ProblemError::RankDeficient { .. })).then(|| {
            "widen the limits that leave so little motion, or leave out elements that it cannot show"
                .to_owned()
        })
    }
}

impl From<DesignError> for Error {
    fn from(fault: DesignError) -> Self {
        Error::Job(Box::new(fault))
    }
}

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
pub(crate) fn page(rendered: Result<String, ReportError>) -> Result<String, Error> {
    Ok(rendered.map_err(PageError)?)
}
