//! What to look at before a result is used, the worst first, each with what mends it.

use dynid_record::Status;
use serde::{Deserialize, Serialize};

use crate::check::{CheckName, CheckResult};
use crate::finding::{Finding, FindingId, Severity};

/// Something to look at before a result is used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Caution {
    /// `fail`: the result is not to be used before this is mended; `warn`: usable, with a reservation.
    pub status: Status,
    /// What it is about: the name of a check, of a finding, or of a part of the input. All cautions of a kind share it.
    pub name: String,
    /// What was found, with its place and number.
    pub message: String,
    /// What mends it: a command, or the line to write and its place.
    pub remedy: String,
}

/// Kinds of cautions from those that matter most, since nothing holds beside them, to those that are good to know.
const ORDER: [&str; 40] = [
    CheckName::Preflight.word(),
    FINDING,
    CheckName::OwnLogs.word(),
    CheckName::Recipe.word(),
    FLEET,
    PAYLOAD,
    CheckName::EffortScale.word(),
    CheckName::ValidationFit.word(),
    CheckName::TrainingFit.word(),
    CheckName::OwnValidation.word(),
    CheckName::Loads.word(),
    CheckName::Clearance.word(),
    CheckName::Ties.word(),
    CheckName::Excitation.word(),
    CheckName::RankGap.word(),
    CheckName::Explained.word(),
    CheckName::AgreementOfLogs.word(),
    CheckName::PriceOfConsistency.word(),
    CheckName::Stiffness.word(),
    CheckName::Instruments.word(),
    CheckName::ClosedLoopBias.word(),
    CheckName::Position.word(),
    CheckName::Residual.word(),
    CheckName::Delay.word(),
    CheckName::ReversalMask.word(),
    CheckName::TimeBlocks.word(),
    CheckName::Robots.word(),
    CheckName::Whiteness.word(),
    CheckName::Condition.word(),
    CheckName::TermsOfLogs.word(),
    FRICTION,
    KNOWN_FRICTION,
    CYCLIC,
    BODY,
    SPRING,
    ELEMENTS,
    LOG,
    SETTING,
    CLEARANCE,
    ROBOT_FILE,
];

/// A finding of the pre-flight, whatever its name.
const FINDING: &str = "finding";
/// What a fleet says of its type, or of the robot.
pub const FLEET: &str = "fleet";
/// What a link carried that is not its own.
pub const PAYLOAD: &str = "payload of logs";
/// Friction that drives the motion, or rises from rest.
pub const FRICTION: &str = "identified friction";
/// Known friction and its range.
pub const KNOWN_FRICTION: &str = "known friction";
/// Cyclic efforts that another log does not have.
pub const CYCLIC: &str = "cyclic efforts";
/// An identified body that could not exist.
pub const BODY: &str = "identified body";
/// A spring that the logs tell little of.
pub const SPRING: &str = "elastic joint";
/// Elements that are nearly the same.
pub const ELEMENTS: &str = "elements of a joint";
/// How a log was read.
pub const LOG: &str = "reading of a log";
/// A setting that did nothing.
pub const SETTING: &str = "setting without effect";
/// Clearance that the fit leaves out.
pub const CLEARANCE: &str = "clearance";
/// What the robot file states or leaves out.
pub const ROBOT_FILE: &str = "robot file";

impl Caution {
    /// A reservation.
    pub fn warn(name: &str, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Caution {
            status: Status::Warn,
            name: name.to_owned(),
            message: message.into(),
            remedy: remedy.into(),
        }
    }

    /// A check that did not come out as it should, with what mends it.
    pub fn of(check: &CheckResult, remedy: String) -> Self {
        Caution {
            status: check.status,
            name: check.name.word().to_owned(),
            message: check.meaning.clone(),
            remedy,
        }
    }

    /// The sentence in which a command line says it.
    pub fn words(&self) -> String {
        format!("[{}] {}: {}\n  mend: {}", self.status, self.name, self.message, self.remedy)
    }

    fn rank(&self) -> (bool, usize) {
        let finding = FindingId::ALL.iter().any(|id| id.plain() == self.name);
        let name = if finding { FINDING } else { self.name.as_str() };
        (self.status != Status::Fail, ORDER.iter().position(|known| *known == name).unwrap_or(ORDER.len()))
    }
}

impl Finding {
    /// The finding as a caution of an identification; `None` unless it counts.
    pub fn caution(&self) -> Option<Caution> {
        let message = self.warning()?;
        let status = if self.severity == Severity::Error { Status::Fail } else { Status::Warn };
        let caution = Caution::warn(&self.id.plain(), message, &*self.remedy);
        Some(Caution { status, ..caution })
    }
}

/// Cautions by how much they matter: failures first, then in the order of what they put in doubt; equals stay as they are.
pub fn ranked(mut cautions: Vec<Caution>) -> Vec<Caution> {
    cautions.sort_by_key(Caution::rank);
    cautions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_come_first_then_what_puts_more_in_doubt() {
        let of = |status: Status, name: &str| Caution { status, ..Caution::warn(name, "", "") };
        let sorted = ranked(vec![
            of(Status::Warn, ROBOT_FILE),
            of(Status::Warn, CheckName::Condition.word()),
            of(Status::Fail, CheckName::TrainingFit.word()),
            of(Status::Warn, "joint permutation"),
            of(Status::Warn, "never heard of"),
        ]);
        let names: Vec<&str> = sorted.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(
            names,
            [
                CheckName::TrainingFit.word(),
                "joint permutation",
                CheckName::Condition.word(),
                ROBOT_FILE,
                "never heard of"
            ]
        );
    }
}
