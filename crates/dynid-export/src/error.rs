//! Why a robot is not exported.

use thiserror::Error as ThisError;

use super::READ_BACK_LIMIT;
use dynid_identify::{Error, Fault};

/// A link that no body could be, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFault {
    /// Link.
    pub link: String,
    /// What is wrong with it.
    pub fault: String,
}

/// Why a robot is not exported; nothing is written then.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum ExportError {
    /// The robot file does not have the joints that were identified.
    #[error("{file}: not the robot of the estimate: {fault}")]
    OtherRobot {
        /// Robot file.
        file: String,
        /// The difference.
        fault: String,
    },
    /// Links that no body could be.
    #[error("no simulator would take it: {}", links.iter().map(|l| format!("link `{}` {}", l.link, l.fault)).collect::<Vec<_>>().join("; "))]
    Unphysical {
        /// Links and reasons.
        links: Vec<LinkFault>,
    },
    /// The text that was about to be written does not give the identified effort.
    #[error(
        "{format}: read back, its effort is off by {difference:.1e} of the largest, expected at most {READ_BACK_LIMIT:e}"
    )]
    ReadBack {
        /// Format.
        format: &'static str,
        /// Largest difference found, relative to the joint's largest effort.
        difference: f64,
    },
}

impl From<ExportError> for Error {
    fn from(fault: ExportError) -> Self {
        Error::Job(Box::new(fault))
    }
}

impl Fault for ExportError {
    fn hint(&self) -> Option<String> {
        Some(match self {
            ExportError::OtherRobot { .. } => {
                "give the file that was identified: `dynid export ESTIMATE --robot FILE`".to_owned()
            }
            ExportError::Unphysical { .. } => {
                "identify again with richer motion or a better robot file; --allow-unphysical writes it as it is"
                    .to_owned()
            }
            ExportError::ReadBack { .. } => {
                "the robot file has changed since the identification, or a body has almost no mass but large moments"
                    .to_owned()
            }
        })
    }
}
