//! Faults of a design problem.

use dynid_excitation::ProblemError;
use dynid_excitation::constraint::ConstraintError;
use dynid_identify::{Error, Fault};

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
