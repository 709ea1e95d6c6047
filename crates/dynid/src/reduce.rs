//! Logs to factors, factors to an estimate: the files around [`dynid_identify::reduction`].

use std::path::Path;

use dynid_logs::MappingSpec;

pub use dynid_identify::reduction::{
    Column, FactorFileFault, LogFacts, Recipe, ReducedLog, Reducer, Reduction, ReductionError, VERSION,
    WindowSettings, check_payload_link, payload_columns,
};

use crate::Error;
use crate::config::{Config, LogConfig, MotorSide};
use crate::estimate::{Estimate, ReadingRecord};
use crate::identify::identify;
use crate::logs;
use crate::pipeline::{Identification, Step};

/// A recipe that was learned, the factors of the logs behind it, and what came out of these.
#[derive(Debug)]
pub struct Learned {
    /// Factors of the training logs.
    pub reduction: Reduction,
    /// The estimate of the same logs, with samples and validation logs.
    pub estimate: Estimate,
}

/// What logs of a recipe may differ in, each by itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnOfLogs {
    /// Whether factors get columns for the rest of delays ([`Recipe::with_delays`]).
    pub delays: bool,
    /// Link on which every log may carry something else ([`Recipe::with_payload`]).
    pub payload: Option<String>,
}

/// Identifies the logs of a configuration, makes a recipe of what was chosen, and reduces the training logs by it.
///
/// Elastic joints without torque sensors are taken as stiff ones, read at their motors; their deformations become rows of their own.
///
/// # Errors
/// As [`crate::identify()`], [`Identification::recipe`], [`Recipe::with_payload`] and [`Reducer::reduce`].
pub fn learn(config: &Config, own: &OwnOfLogs, progress: &mut dyn FnMut(Step)) -> Result<Learned, Error> {
    let mut config = config.clone();
    let robot = config.read_robot()?;
    config.stiff_joints |= robot.elements.elastic.iter().any(|spec| !spec.sensor);
    if let Some(link) = &own.payload {
        check_payload_link(&robot, link)?;
        // The columns of the link come first, so that they are kept.
        let of_link = payload_columns(link);
        config.preferred.retain(|name| !of_link.contains(name));
        config.preferred.splice(0..0, of_link);
    }
    let config = &config;
    let run = identify(config, progress)?;
    let reading = ReadingRecord { understood: Vec::new(), ..run.reading.clone() };
    let recipe = run.recipe()?.with_reading(reading);
    let recipe = if own.delays { recipe.with_delays() } else { recipe };
    let recipe = match &own.payload {
        Some(link) => recipe.with_payload(link)?,
        None => recipe,
    };
    let estimate = run.estimate();
    // Samples go before they are read once more.
    drop(run);
    let reducer = recipe.reducer()?;
    let logs = config.read_training(reducer.robot(), progress)?;
    Ok(Learned { reduction: Reduction::of(&reducer, logs)?, estimate })
}

/// Reduces logs by a recipe, long ones in one pass and in memory that does not grow with them ([`Reducer::reduce_blocks`]).
///
/// # Errors
/// As [`logs::load`] and [`Reducer::reduce`].
pub fn reduce(
    recipe: Recipe,
    logs: &[LogConfig],
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
    progress: &mut dyn FnMut(Step),
) -> Result<Reduction, Error> {
    let reducer = recipe.reducer()?;
    let mut reduced = Vec::new();
    for log in logs {
        progress(Step::Read(log.path.display().to_string()));
        reduced.push(reduce_log(&reducer, log, columns, motor_side)?);
    }
    match reduced.is_empty() {
        true => Err(ReductionError::Nothing.into()),
        false => Ok(Reduction::of_reduced(&reducer, reduced)),
    }
}

/// Reduces a log of any length.
///
/// # Errors
/// As [`reduce`].
pub fn reduce_log(
    reducer: &Reducer,
    log: &LogConfig,
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<ReducedLog, Error> {
    let axes = &reducer.robot().axes;
    if !reducer.in_windows(&log.settings()) {
        return reducer.reduce(logs::load(log, axes, columns, motor_side)?);
    }
    match logs::open(log, axes, columns, motor_side, reducer.windows().part_rows)? {
        logs::Opened::Whole(log) => reducer.reduce(*log),
        logs::Opened::Long(mut first, mut rest) => {
            // What jumps is told of the whole log.
            first.unwrapped.clear();
            let mut reduced = reducer.reduce_blocks(*first, &mut *rest)?;
            reduced.facts.inputs = rest.inputs();
            reduced.facts.tell_unwrapped(&rest.unwrapped());
            Ok(reduced)
        }
    }
}

/// Reads a factor file.
///
/// # Errors
/// [`Error::Read`], [`Error::Reduction`].
pub fn read(path: &Path) -> Result<Reduction, Error> {
    let bytes = dynid_files::input::read(path).map_err(|source| Error::Read { file: path.into(), source })?;
    Ok(Reduction::from_bytes(&bytes, &path.display().to_string())?)
}

/// Reads factor files and merges them.
///
/// # Errors
/// [`Error::Read`], [`Error::Reduction`].
pub fn read_all<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Result<Reduction, Error> {
    let parts = paths.into_iter().map(read).collect::<Result<Vec<_>, Error>>()?;
    Ok(Reduction::merge(parts)?)
}

/// Whether a file begins as factor files do.
pub fn is_factor_file(path: &Path) -> bool {
    let mut head = [0; 14];
    let opened = dynid_files::input::open(path);
    opened.is_ok_and(|mut file| std::io::Read::read_exact(&mut file, &mut head).is_ok())
        && head == *b"dynid factors "
}

/// Solves factors, and compares the result with logs that are read.
///
/// # Errors
/// As [`logs::load`] and [`Reduction::solve`].
pub fn solve(
    reduction: &Reduction,
    validation: &[LogConfig],
    columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
    progress: &mut dyn FnMut(Step),
) -> Result<Identification, Error> {
    let mut logs = Vec::new();
    if !validation.is_empty() {
        let reducer = reduction.recipe().clone().reducer()?;
        for log in validation {
            progress(Step::Read(log.path.display().to_string()));
            let mut log = logs::load(log, &reducer.robot().axes, columns, motor_side)?;
            log.settings.validation = true;
            logs.push(log);
        }
    }
    reduction.solve(logs, progress)
}

/// The result file of solved factors: as an identification gives it, and how logs are read.
pub fn estimate(solved: &Identification, recipe: &Recipe) -> Estimate {
    let mut estimate = solved.estimate();
    estimate.provenance.inputs = recipe.inputs.iter().cloned().chain(estimate.provenance.inputs).collect();
    estimate.provenance.reading = Some(recipe.reading.clone());
    estimate
}
