//! Drives as `dynid servo` found them, for what comes after.

use std::collections::BTreeMap;
use std::path::Path;

use dynid_files::SourceFile;
use dynid_identify::robot::Robot;
use dynid_servo::{ServoJoint, ServoSettings, Term};

use super::record::{ServoFile, Told};
use super::{Error, ServoFault, clamped};

/// A robot, and what was found of its drives.
pub struct FoundDrives {
    /// The robot, its base clamped, joints without drives held.
    pub robot: Robot,
    /// What was found.
    pub file: ServoFile,
    /// What was known.
    pub told: Told,
    /// The file.
    pub source: SourceFile,
    /// Doubts about the robot file, in words.
    pub warnings: Vec<String>,
}

impl FoundDrives {
    /// Reads a `servo.json` and the robot that it is of; `lock` and `gravity` stand before what the file says.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::RobotFile`]; [`super::ServoFault::File`]; [`Error::Setting`] if the robot has other joints.
    pub fn read(
        path: &Path,
        robot: &Path,
        lock: &BTreeMap<String, f64>,
        gravity: Option<[f64; 3]>,
    ) -> Result<Self, Error> {
        let (file, source) = ServoFile::read(path)?;
        let told = file.told(&source.path)?;
        let mut lock = lock.clone();
        for (joint, x) in &told.lock {
            lock.entry(joint.clone()).or_insert(*x);
        }
        let gravity = gravity.or(told.gravity);
        let (whole, _) = clamped(robot, gravity, &lock)?;
        // What had no columns stood at zero.
        lock.extend(whole.rate_names().into_iter().filter(|j| !file.joints.contains(j)).map(|j| (j, 0.0)));
        let (robot, warnings) = clamped(robot, gravity, &lock)?;
        if file.joints != robot.rate_names() {
            let expected = format!("a robot with the joints of {}: {}", source.path, file.joints.join(", "));
            return Err(Error::setting("drives", &expected, robot.rate_names().join(", ")));
        }
        let robot = with_bodies(robot, &file, &source.path)?;
        Ok(FoundDrives { robot, file, told, source, warnings })
    }

    /// What was known and found of the joints, commands and readings `period` s apart.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::UnknownJoint`].
    pub fn settings(&self, period: f64) -> Result<ServoSettings, Error> {
        let mut settings = self.told.servo.settings(&self.robot, period)?;
        for (name, joint) in self.file.joints.iter().zip(&mut settings.joints) {
            let own = self.file.parameters.iter().filter(|p| p.joints.contains(name));
            own.filter_map(|p| Some((Term::named(&p.term)?, p.value))).for_each(|(t, x)| joint.set(t, x));
            if let Some(found) = self.file.law.directions.iter().find(|d| d.joint == *name) {
                joint.direction = found.direction;
            }
        }
        Ok(settings)
    }
}

/// The robot with the bodies that were found.
fn with_bodies(mut robot: Robot, file: &ServoFile, path: &str) -> Result<Robot, Error> {
    if file.bodies.is_empty() {
        return Ok(robot);
    }
    let inertia = |body: &dynid_model::Body| {
        let found = file.bodies.iter().find(|b| b.link == body.name).ok_or_else(|| {
            let expected = format!("a robot with the bodies of {path}");
            Error::setting("drives", &expected, format!("`{}` is none of them", body.name))
        })?;
        found.inertia().filter(|i| i.physical_fault().is_none()).ok_or_else(|| {
            let message = format!("bodies: expected the ten parameters of a body for `{}`", body.name);
            ServoFault::File { file: path.to_owned(), message }.into()
        })
    };
    let inertias = robot.mechanism.bodies().iter().map(inertia).collect::<Result<Vec<_>, Error>>()?;
    robot.mechanism = robot.mechanism.with_inertias(&inertias);
    Ok(robot)
}

/// Sets terms by name, `JOINT.TERM`.
///
/// # Errors
/// [`Error::Setting`] for names that are none, and values that no joint can have.
pub fn set_terms(
    names: &[String],
    values: &BTreeMap<String, f64>,
    joints: &mut [ServoJoint],
) -> Result<(), Error> {
    for (name, value) in values {
        let split = name
            .rsplit_once('.')
            .and_then(|(joint, term)| Some((names.iter().position(|n| n == joint)?, Term::named(term)?)));
        let Some((joint, term)) = split else {
            let expected = "joints and terms, such as `j1.coulomb`, `j1.rotor_inertia`, `j1.position_gain`";
            return Err(Error::setting("values", expected, name));
        };
        let (lower, upper) = term.range();
        if !(*value >= lower && *value <= upper && value.is_finite()) {
            let expected = format!("a finite number of at least {lower}, at most {upper}");
            return Err(Error::setting(&format!("values.{name}"), &expected, value));
        }
        joints[joint].set(term, *value);
    }
    Ok(())
}
