//! Studies: systems that others have published, identified again with this toolkit, every claim beside what was measured.
//!
//! A study is data and a thin driver in a folder of its own: robot file, settings, reference numbers and a `README.md` with
//! the table "paper / ours / verdict". All physics and numerics are those of the rooms below. [`list`] names the studies,
//! [`run`] runs one.

pub mod er16;
mod error;
mod excitation;
pub mod hit_joint;
pub mod indy7;
pub mod prr3;
mod record;
mod reference;
mod statistics;
pub mod xy_pointing;

pub use error::StudyError;
pub use record::{Row, StudyRecord};

use dynid::report::StudyReport;

/// How a study is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunSettings {
    /// Keep every row and shrink statistics: under a minute on two cores.
    pub quick: bool,
    /// Seed of everything random. Default 1.
    pub seed: u64,
}

impl Default for RunSettings {
    fn default() -> Self {
        RunSettings { quick: false, seed: 1 }
    }
}

/// What a study leaves behind.
#[derive(Debug)]
pub struct StudyRun {
    /// Rows for programs.
    pub record: StudyRecord,
    /// The report's contents.
    pub report: StudyReport,
}

type Driver = fn(&RunSettings, &mut dyn FnMut(Progress)) -> Result<StudyRun, StudyError>;

/// A study that can be run.
#[derive(Debug, Clone, Copy)]
pub struct Study {
    /// Name on the command line.
    pub name: &'static str,
    /// What is studied.
    pub title: &'static str,
    /// Where it was published.
    pub source: &'static str,
    driver: Driver,
}

/// What is being worked on: a step of so many.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Progress {
    /// The work, in words.
    pub step: String,
    /// Steps done.
    pub done: usize,
    /// Steps altogether.
    pub steps: usize,
}

const STUDIES: [Study; 5] = [
    Study { name: er16::NAME, title: er16::TITLE, source: er16::SOURCE, driver: er16::run },
    Study {
        name: hit_joint::NAME,
        title: hit_joint::TITLE,
        source: hit_joint::SOURCE,
        driver: hit_joint::run,
    },
    Study { name: indy7::NAME, title: indy7::TITLE, source: indy7::SOURCE, driver: indy7::run },
    Study { name: prr3::NAME, title: prr3::TITLE, source: prr3::SOURCE, driver: prr3::run },
    Study {
        name: xy_pointing::NAME,
        title: xy_pointing::TITLE,
        source: xy_pointing::SOURCE,
        driver: xy_pointing::run,
    },
];

/// All studies.
pub fn list() -> &'static [Study] {
    &STUDIES
}

/// Runs the study of a name.
///
/// # Errors
/// [`StudyError::Unknown`]; others are faults of this crate's data or of the rooms below.
pub fn run(
    name: &str,
    settings: &RunSettings,
    progress: &mut dyn FnMut(Progress),
) -> Result<StudyRun, StudyError> {
    let study = STUDIES.iter().find(|s| s.name == name).ok_or_else(|| StudyError::Unknown {
        found: name.to_owned(),
        known: STUDIES.iter().map(|s| s.name.to_owned()).collect(),
    })?;
    (study.driver)(settings, progress)
}
