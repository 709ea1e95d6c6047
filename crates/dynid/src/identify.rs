//! From a configuration and its files to an identified model: the main job.

use dynid_logs::TrajectoryFile;

use crate::Error;
use crate::config::Config;
use crate::estimate::{InputKind, InputRecord};
use crate::export::exported;
use crate::pipeline::{self, Step};
use crate::run::Run;

/// Reads robot and logs, conditions, fits, validates.
///
/// # Errors
/// [`Error`]: bad input. A rank-deficient log is a status of the result, not an error.
pub fn identify(config: &Config, progress: &mut dyn FnMut(Step)) -> Result<Run, Error> {
    config.demand_inputs()?;
    config.check_effect()?;
    config.check()?;
    progress(Step::Read(config.robot.display().to_string()));
    let robot = config.read_robot()?;
    let trajectory = config.instruments.as_ref().and_then(|table| table.trajectory.as_deref());
    let trajectory = trajectory.map(TrajectoryFile::read_source).transpose()?;
    let logs = config.read_all(&robot, progress)?;
    let found = pipeline::identify(&robot, logs, &config.settings()?, progress)?;
    let mut inputs = found.inputs();
    inputs.extend(trajectory.map(|(_, source)| InputRecord::of(InputKind::Trajectory, &source)));
    let exported = exported(&found)?;
    let reading = config.reading(&found);
    Ok(Run { identification: found, config: config.clone(), inputs, reading, exported })
}
