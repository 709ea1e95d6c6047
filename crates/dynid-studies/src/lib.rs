//! Studies: systems that others have published, identified again with this toolkit, every claim beside what was measured.
//!
//! A study is data and a thin driver in a folder of its own: robot file, settings, reference numbers and a `README.md` with
//! the table "paper / ours / verdict". All physics and numerics are those of the rooms below.
//! [`PUBLISHED`] names the studies, [`run`] runs one; the program `dynid-studies` does so for
//! `dynid study`.

pub mod er16;
mod error;
mod excitation;
pub mod hit_joint;
pub mod indy7;
mod page;
pub mod prr3;
mod record;
mod reference;
mod statistics;
pub mod xy_pointing;

pub use error::StudyError;
pub use record::{Row, StudyRecord};

use dynid::report::StudyReport;
use dynid_terminal::study::PUBLISHED;

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

/// The steps of a study, told as they begin.
struct Steps<'a> {
    progress: &'a mut dyn FnMut(Progress),
    begun: usize,
    of: usize,
}

impl<'a> Steps<'a> {
    fn new(progress: &'a mut dyn FnMut(Progress), of: usize) -> Self {
        Steps { progress, begun: 0, of }
    }

    /// Tells that the next step begins.
    fn begin(&mut self, step: &str) {
        (self.progress)(Progress { step: step.to_owned(), done: self.begun, steps: self.of });
        self.begun += 1;
    }
}

type Driver = fn(&RunSettings, &mut dyn FnMut(Progress)) -> Result<StudyRun, StudyError>;

const DRIVERS: [(&str, Driver); PUBLISHED.len()] = [
    (er16::STUDY.name, er16::run),
    (hit_joint::STUDY.name, hit_joint::run),
    (indy7::STUDY.name, indy7::run),
    (prr3::STUDY.name, prr3::run),
    (xy_pointing::STUDY.name, xy_pointing::run),
];

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

/// Runs the study of a name.
///
/// # Errors
/// [`StudyError::Unknown`]; others are faults of this crate's data or of the rooms below.
pub fn run(
    name: &str,
    settings: &RunSettings,
    progress: &mut dyn FnMut(Progress),
) -> Result<StudyRun, StudyError> {
    let (_, driver) = DRIVERS.iter().find(|(own, _)| *own == name).ok_or_else(|| StudyError::Unknown {
        found: name.to_owned(),
        known: DRIVERS.iter().map(|(own, _)| (*own).to_owned()).collect(),
    })?;
    driver(settings, progress)
}
