//! Fleets: logs of many robots reduced by one recipe, and what they say together.
//!
//! [`manifest()`] tells whose logs they are, [`FactorStore`] reduces them into a folder, or keeps the bytes that a [`LogReducer`] made of single logs
//! elsewhere, [`fleet`] fits the folder's logs ([`dynid_fleet`]): what robots of the type share, how each differs, which robots and logs stand out, what changed when. [`FleetFile`] is what
//! it leaves behind, beside a page.

mod build;
mod failure;
mod manifest;
mod models;
mod one_log;
mod read;
mod record;
mod report;
mod store;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use dynid_fleet::drift::{Change, Drift, DriftSettings, History, drift};
use dynid_fleet::{FitSettings, Fleet, FleetError, FleetFit, LogDifference, Outlier, RobotFit, fit};

pub use dynid_identify::reduction::Origin;

pub use failure::{Failure, FailureCode};
pub use manifest::{Entry, date, manifest};
pub use one_log::{LogReducer, Made, NUMERICS, StoreReading};
pub use read::{StoreContent, read};
pub use record::{
    CarriedByLog, CarriedParameter, ChangeKind, ChangeRecord, ChannelRecord, CovariateRecord, DatedRecord,
    EventRecord, FleetFile, FleetParameter, LogDeviation, LogRecord, OutlierRecord, PayloadRecord,
    RobotParameter, RobotRecord, RobotState, SlopeRecord,
};
pub use store::{FactorStore, Outcome};

use crate::reduce::Recipe;
use crate::{Error, Fault};
use build::Built;

/// How a fleet is fitted.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FleetSettings {
    /// Parameters in which robots differ, by symbol (`fc`) or name (`j2.fc`); absent: all of joints but the inertia of rotors.
    pub between_robots: Option<Vec<String>>,
    /// Parameters in which logs of one robot differ; absent: those of `between_robots`.
    pub between_logs: Option<Vec<String>>,
    /// Numbers of the manifest that parameters follow; absent: all that every log states and that vary.
    pub covariates: Option<Vec<String>>,
    /// Share of the robots that are named for a change that may have none; of robots and logs that are named as outliers alike.
    pub false_discoveries: f64,
}

impl Default for FleetSettings {
    fn default() -> Self {
        let false_discoveries = DriftSettings::default().false_discoveries;
        FleetSettings { between_robots: None, between_logs: None, covariates: None, false_discoveries }
    }
}

/// What is being worked on.
#[derive(Debug, Clone, PartialEq)]
pub enum FleetStep {
    /// Reading factors.
    Read,
    /// The mixed model.
    Fit,
    /// Changes with time.
    Drift,
    /// Models of the type and of robots.
    Models,
}

impl std::fmt::Display for FleetStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            FleetStep::Read => "reading factors",
            FleetStep::Fit => "fitting the fleet",
            FleetStep::Drift => "looking for changes",
            FleetStep::Models => "bodies that can exist",
        })
    }
}

/// Faults of fleets.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FleetFault {
    /// A manifest that cannot be read.
    #[error("{file}: row {row}, column `{column}`: expected {expected}, found {found}")]
    Manifest {
        /// Manifest.
        file: String,
        /// Line, from 1.
        row: u64,
        /// Column.
        column: String,
        /// What is expected there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A folder with factors of another recipe.
    #[error("{folder}: expected factors of the recipe {}, found {}", &expected[..12.min(expected.len())], &found[..12.min(found.len())])]
    OtherRecipe {
        /// Folder.
        folder: String,
        /// Hash of the recipe that is expected.
        expected: String,
        /// Hash of the other.
        found: String,
    },
    /// Bytes that are neither the factors of a log nor a failure.
    #[error("bytes to be kept: expected {expected}, found {found}")]
    Kept {
        /// What is expected.
        expected: &'static str,
        /// What they are.
        found: String,
    },
    /// No folder of factors.
    #[error("no folder of factors: expected one at least")]
    NoFolder,
    /// A setting that nothing fits.
    #[error("`{setting}`: expected {expected}, found `{found}`")]
    Setting {
        /// Setting.
        setting: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// The fit.
    #[error("{0}")]
    Fit(String, #[source] FleetError),
}

impl Fault for FleetFault {
    fn hint(&self) -> Option<String> {
        Some(match self {
            FleetFault::Manifest { .. } => {
                "a manifest is a table: `log,robot,start,temperature` and a line such as `day1/a.csv,r17,2026-03-01T12:00:00Z,31.5`".to_owned()
            }
            FleetFault::OtherRecipe { .. } => "reduce logs of another recipe into a folder of their own".to_owned(),
            FleetFault::Kept { .. } => "put what was made of one log: `LogReducer`, in Python `reduce_log`".to_owned(),
            FleetFault::NoFolder => {
                "`dynid reduce TYPE.factors --manifest logs.csv --store FOLDER` fills a folder".to_owned()
            }
            FleetFault::Setting { .. } => return None,
            FleetFault::Fit(_, FleetError::Robots { .. }) => {
                "state the robot of every log in the manifest; for one robot `dynid solve` is enough".to_owned()
            }
            FleetFault::Fit(_, FleetError::Constant { .. } | FleetError::Confounded { .. }) => {
                "leave it out of `--covariates`".to_owned()
            }
            FleetFault::Fit(_, FleetError::NotExcited { .. }) => {
                "learn the recipe on logs that move these parameters, or without their elements".to_owned()
            }
            FleetFault::Fit(..) => return None,
        })
    }
}

impl From<FleetFault> for Error {
    fn from(fault: FleetFault) -> Self {
        Error::Job(Box::new(fault))
    }
}

/// A fleet with everything that was found.
#[derive(Debug)]
pub struct FleetResult {
    /// The recipe behind the factors.
    pub recipe: Recipe,
    /// The fleet.
    pub fleet: Fleet,
    /// The mixed model.
    pub fit: FleetFit,
    /// Changes with time; `None` where logs state no dates.
    pub drift: Option<Drift>,
    /// Logs that could not be reduced or read.
    pub failures: Vec<Failure>,
    /// Robots that have changed, at their last log.
    now: Vec<Option<RobotFit>>,
    /// The fit without efforts that are not explained, by which are: as models ask for it.
    without: Mutex<BTreeMap<Vec<bool>, Arc<FleetFit>>>,
    /// Coordinates in which logs differ by what they carry, and by how much every log does.
    carried: Vec<usize>,
    differences: Vec<LogDifference>,
    robot_outliers: Vec<Outlier>,
    log_outliers: Vec<Outlier>,
    built: Built,
    repeated: usize,
    settings: FleetSettings,
}

/// Reads folders of factors, and fits the fleet.
///
/// # Errors
/// [`Error`]: folders that cannot be read; [`FleetFault`].
pub fn fleet(
    folders: &[PathBuf],
    settings: &FleetSettings,
    progress: &mut dyn FnMut(FleetStep),
) -> Result<FleetResult, Error> {
    progress(FleetStep::Read);
    let content = read(folders)?;
    let StoreContent { recipe, logs, failures, repeated, contradicting } = content;
    let (fleet, mut built) = build::fleet(&recipe, logs, settings)?;
    if contradicting > 0 {
        let logs = if contradicting == 1 { "log is" } else { "logs are" };
        built.warnings.push(format!(
            "{contradicting} {logs} stated with different dates or numbers: the first by name was taken"
        ));
    }
    progress(FleetStep::Fit);
    let told = |error: FleetError| FleetFault::Fit(build::said(&error, &built), error);
    let found = fit(&fleet, &FitSettings { prior: Some(build::prior(&recipe)), ..FitSettings::default() })
        .map_err(told)?;
    let mut changes = None;
    if built.undated == 0 {
        progress(FleetStep::Drift);
        let how = DriftSettings { false_discoveries: settings.false_discoveries, ..DriftSettings::default() };
        changes = Some(drift(&fleet, &found, &how).map_err(told)?);
    }
    let changed: Vec<(usize, &[Change])> = (0..fleet.robots.len())
        .map(|r| (r, changes_of(changes.as_ref(), r)))
        .filter(|(_, of_robot)| !of_robot.is_empty())
        .collect();
    let mut now = vec![None; fleet.robots.len()];
    for ((r, _), fit) in changed.iter().zip(found.robots_now(&fleet, &changed).map_err(told)?) {
        now[*r] = fit;
    }
    let carried = build::carried(&fleet);
    let differences = match &carried[..] {
        [] => Vec::new(),
        carried => found.differences(&fleet, carried, &built.halves).map_err(told)?,
    };
    Ok(FleetResult {
        carried,
        differences,
        now,
        without: Mutex::default(),
        robot_outliers: found.robot_outliers(settings.false_discoveries),
        log_outliers: found.log_outliers(settings.false_discoveries),
        fit: found,
        drift: changes,
        recipe,
        fleet,
        failures,
        built,
        repeated,
        settings: settings.clone(),
    })
}

/// Changes of a robot, if it has any.
fn changes_of(drift: Option<&Drift>, robot: usize) -> &[Change] {
    match drift.map(|drift| &drift.robots[robot].history) {
        Some(History::Changed { changes, .. }) => changes,
        _ => &[],
    }
}

impl FleetResult {
    /// What is known of a robot with logs: as the fit has it, of one that has changed at its last log.
    fn robot_fit(&self, robot: usize) -> Option<&RobotFit> {
        self.now[robot].as_ref().or(self.fit.robots[robot].as_ref())
    }
}
