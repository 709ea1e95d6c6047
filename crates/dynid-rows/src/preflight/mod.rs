//! What is wrong with a log, as far as it takes a model to tell.
//!
//! [`Trial::search`]: which column is whose, with which sign, unit and zero, by which clock, at which time, under which gravity
//! ([`Wiring`]). Every hypothesis is judged by how well bodies that can exist, with friction that takes energy, explain the
//! efforts ([`dynid_estimate::consistent`]): a flipped sign asks for negative friction and mass, exchanged columns for motions that the
//! effort does not follow. [`tilt()`] and [`excitation()`] examine what the columns then say.

mod excitation;
mod hypotheses;
mod refine;
mod rows;
mod samples;
mod search;
mod stated;
mod tilt;
mod trial;
mod wiring;

pub use excitation::{Excitation, excitation};
pub use refine::GaussianPrior;
pub use samples::Samples;
pub use search::{Found, WiringSearch};
pub use stated::{AgainstStated, against_stated};
pub use tilt::{Tilt, tilt};
pub use trial::{Trial, efforts_at_rest};
pub use wiring::{Rewiring, Source, Wiring};

use dynid_factor::factor::FactorError;

/// Why a log cannot be examined.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PreflightError {
    /// A signal cannot be filtered.
    #[error("signal: {0}")]
    Signal(#[from] dynid_motion::SignalError),
    /// A row of a trial cannot be used.
    #[error("trial: {0}")]
    Rows(#[from] FactorError),
}
