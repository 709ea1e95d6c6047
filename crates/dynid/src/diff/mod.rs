//! Two models of one robot compared: parameters that differ beyond their intervals, and the difference of the effort.
//!
//! A parameter can be compared where both sides tell it: an estimate tells what is seen in its data, with an interval; a robot file tells
//! what it states, exactly. With half widths `h` of the 95 % intervals two values lie beyond their intervals if
//! `|a - b| > √(h_a² + h_b²)`, which happens by chance to one of twenty parameters that are the same. Parameters *differ* where chance
//! would make any of all `n` compared ones do so in one of twenty comparisons (each at `1 - 0.05/n`, after Bonferroni). Values are those
//! fitted without constraints, to which the intervals belong. Estimates from the same logs are alike by more than that.

mod effort;
mod file;
mod parameters;
mod record;
mod structure;

use std::path::Path;

use dynid_files::FileMember;
use dynid_logs::{ReadOptions, States};
use dynid_model::{EffortModel, Parameter, RobotModel};

use crate::Error;
use crate::estimate::{Estimate, Split};
use crate::predict::read_states;
pub use effort::JointEffort;
pub use file::StatedRobot;
pub use parameters::ParameterDiff;
pub use record::{EffortDiff, ModelDiff, NotCompared};

/// One of the two models, as a file holds it.
#[derive(Debug)]
pub enum Side {
    /// An identified model.
    Estimate(Box<Estimate>),
    /// A robot file.
    Robot(Box<StatedRobot>),
}

impl Side {
    /// Reads an estimate, or a robot file: what is no JSON.
    ///
    /// # Errors
    /// As [`Estimate::read`] and [`dynid_robots::robot::read`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = dynid_files::input::read(&FileMember::of(path).path)
            .map_err(|source| Error::Read { file: path.to_owned(), source })?;
        match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'{') => Ok(Side::Estimate(Box::new(Estimate::read(path)?))),
            _ => Ok(Side::Robot(Box::new(StatedRobot::read(path)?))),
        }
    }

    fn estimate(&self) -> Option<&Estimate> {
        match self {
            Side::Estimate(estimate) => Some(estimate),
            Side::Robot(_) => None,
        }
    }
}

/// Where efforts are compared.
#[derive(Debug, Clone, Copy)]
pub enum At<'a> {
    /// A thousand random states within the limits, always the same ones.
    Random,
    /// States of a table.
    Table(&'a Path, &'a ReadOptions),
}

/// A model with its values, ready for efforts.
struct Valued {
    model: RobotModel,
    values: Vec<f64>,
    /// The effort of known friction is part of the model.
    with_known: bool,
}

/// Compares two models of one robot. `split`: which values of estimates give the effort.
///
/// # Errors
/// [`Error::NotComparable`] for two robot files and for models of different robots; [`Error`] for bad input.
pub fn diff(a: (&Path, &Side), b: (&Path, &Side), split: Split, at: At<'_>) -> Result<ModelDiff, Error> {
    let name = |path: &Path| path.display().to_string();
    let refuse = |fault: String| Error::NotComparable { a: name(a.0), b: name(b.0), fault };
    let Some((identified, reference)) =
        [a, b].into_iter().find_map(|(path, side)| Some((path, side.estimate()?)))
    else {
        return Err(refuse("both are robot files: one of the two has to be an estimate".to_owned()));
    };
    let model = reference.effort_model(identified, split)?;
    let stated = |robot: &StatedRobot| robot.values(reference, identified)?.map_err(&refuse);
    let valued = |(path, side): (&Path, &Side)| -> Result<Valued, Error> {
        match side {
            Side::Estimate(estimate) => {
                structure::same(reference, estimate).map_err(&refuse)?;
                let model = estimate.effort_model(path, split)?;
                Ok(Valued { model, values: estimate.values(split), with_known: true })
            }
            Side::Robot(robot) => {
                let stated = stated(robot)?;
                let value = |p: &Parameter| stated.get(&p.name).copied().unwrap_or(0.0);
                let values = model.parameters().linear.iter().map(value).collect();
                let model = reference.effort_model(identified, split)?;
                Ok(Valued { model, values, with_known: false })
            }
        }
    };
    let models = (valued(a)?, valued(b)?);
    let told = |side: &Side| -> Result<parameters::Told, Error> {
        Ok(match side {
            Side::Estimate(estimate) => parameters::Told::of_estimate(estimate),
            Side::Robot(robot) => parameters::Told::of_file(&stated(robot)?, reference, &model),
        })
    };
    let found = parameters::compare(&told(a.1)?, &told(b.1)?);
    let (states, joints) = match at {
        At::Random => ("1000 random states".to_owned(), effort::at_random(&models.0, &models.1)),
        At::Table(file, options) => {
            let read = |(side, valued): (&Side, &Valued)| -> Result<States, Error> {
                let reading = side.estimate().and_then(|e| e.provenance.reading.as_ref());
                read_states(file, options, &valued.model, reading)
            };
            let (of_a, of_b) = (read((a.1, &models.0))?, read((b.1, &models.1))?);
            let words = format!("{} states of {}", of_a.rows, name(file));
            (words, effort::at_states((&models.0, &of_a), (&models.1, &of_b))?)
        }
    };
    Ok(ModelDiff::new(
        [name(a.0), name(b.0)],
        &reference.robot,
        found,
        EffortDiff { states, joints },
        structure::gravity([a.1, b.1]),
    ))
}
