//! Fourier trajectories as coefficients in JSON.

use std::path::Path;

use dynid_files::digest::SourceFile;
use dynid_files::excerpt::excerpt;
use dynid_files::output::{OutputError, write_atomically};
use dynid_files::text;
use dynid_motion::trajectory::{Form, Fourier, FourierTrajectory, RowOrder, Sequence, TrajectoryError};

use super::TrajectoryFileError;
use super::schema::{ApproachKeys, FileKeys, FormKey, JointKeys, ReturnKeys, SCHEMA, TableKeys, UnitKey};

/// Largest file that is read, bytes (16 MiB).
const LIMIT: u64 = 16 << 20;

/// A joint of a trajectory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrajectoryJoint {
    /// Name; without one the joint is the robot's moving joint of the same number.
    pub name: Option<String>,
    /// Positions are in m, not rad.
    pub slides: bool,
}

/// A quintic between a parking pose and the record.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Parking pose, rad or m.
    pub pose: Vec<f64>,
    /// Duration, s.
    pub duration_s: f64,
}

/// A periodic trajectory with its approach and return, as in a file of schema `dynid-trajectory/1`.
///
/// Keys: `robot` (optional), `form` (`plain` or `velocity_amplitudes`, see [`Form`]), `base_frequency_rad_s`, `periods`
/// (default 1), `joints` (list of `name`, `unit`, `q0`, `a`, `b`; unit `rad`, `m` or `deg`, default `rad`) or, in its place,
/// `table` (`order` as [`RowOrder`] reads it, `rows`, `names` and `unit`, the last two optional), `approach` (`from`,
/// `duration_s`), `return` (`to`, `duration_s`), `sample_rate_hz`; the last three may be null or missing. Poses are in rad or
/// m. Unknown keys are errors.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryFile {
    /// Robot file that the trajectory was made for.
    pub robot: Option<String>,
    /// Form in which coefficients are written.
    pub form: Form,
    /// Joints, in the order of the trajectory's coordinates and as many.
    pub joints: Vec<TrajectoryJoint>,
    /// The record, rad or m.
    pub motion: FourierTrajectory,
    /// From the parking pose to the record.
    pub approach: Option<Leg>,
    /// Back to a parking pose.
    pub back: Option<Leg>,
    /// Rate at which the motion is meant to be commanded, Hz.
    pub sample_rate_hz: Option<f64>,
}

impl TrajectoryFile {
    /// Reads a file of at most 16 MiB.
    ///
    /// # Errors
    /// [`TrajectoryFileError`] with the file, and the line or field.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, TrajectoryFileError> {
        Ok(Self::read_source(path)?.0)
    }

    /// Reads a trajectory file, and returns what was read beside it.
    ///
    /// # Errors
    /// Fails as [`Self::read`] does.
    pub fn read_source(path: impl AsRef<Path>) -> Result<(Self, SourceFile), TrajectoryFileError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        match text::read(path, LIMIT) {
            Ok((text, source)) => Ok((Self::parse(&text, &file)?, source)),
            Err(fault) => Err(TrajectoryFileError::of_text(file, fault)),
        }
    }

    /// Reads a text; `file` names it in errors.
    ///
    /// # Errors
    /// Fails as [`Self::read`] does.
    pub fn parse(text: &str, file: &str) -> Result<Self, TrajectoryFileError> {
        // The schema first, so that a foreign file is told as such and not by its first unknown key.
        let value: serde_json::Value = serde_json::from_str(text).map_err(|e| syntax(file, &e))?;
        let schema = value.get("schema").map_or_else(|| "none".to_owned(), ToString::to_string);
        if value.get("schema").and_then(serde_json::Value::as_str) != Some(SCHEMA) {
            return Err(field(file, "schema", format!("\"{SCHEMA}\""), excerpt(&schema)));
        }
        let keys: FileKeys = serde_json::from_str(text).map_err(|e| syntax(file, &e))?;
        let form = match keys.form {
            FormKey::Plain => Form::Plain,
            FormKey::VelocityAmplitudes => Form::VelocityAmplitudes,
        };
        let base = keys.base_frequency_rad_s;
        if !(base.is_finite() && base > 0.0) {
            return Err(field(file, "base_frequency_rad_s", "a positive number", base));
        }
        let (joints, series) = match (&keys.joints, &keys.table) {
            (Some(joints), None) => from_joints(file, base, form, joints)?,
            (None, Some(table)) => from_table(file, base, form, table)?,
            (Some(_), Some(_)) => return Err(field(file, "table", "either `joints` or `table`", "both")),
            (None, None) => return Err(field(file, "joints", "either `joints` or `table`", "neither")),
        };
        check_names(file, &joints)?;
        let motion = FourierTrajectory::new(series, keys.periods).map_err(|e| trajectory(file, e))?;
        if !motion.period().is_finite() || motion.periods() as f64 * motion.period() > LONGEST_S {
            let expected = format!("a motion of at most {LONGEST_S:e} s");
            return Err(field(file, "periods", expected, keys.periods));
        }
        let approach = keys.approach.map(|k| Leg { pose: k.from, duration_s: k.duration_s });
        let back = keys.back.map(|k| Leg { pose: k.to, duration_s: k.duration_s });
        for (name, pose, leg) in [("approach", "from", &approach), ("return", "to", &back)] {
            if let Some(leg) = leg {
                check_leg(file, name, pose, leg, joints.len())?;
            }
        }
        if let Some(rate) = keys.sample_rate_hz
            && !(rate.is_finite() && rate > 0.0)
        {
            return Err(field(file, "sample_rate_hz", "a positive number", rate));
        }
        let (robot, sample_rate_hz) = (keys.robot, keys.sample_rate_hz);
        Ok(TrajectoryFile { robot, form, joints, motion, approach, back, sample_rate_hz })
    }

    /// The file's text; numbers read back to the same `f64`.
    pub fn to_json(&self) -> String {
        let joints = self.joints.iter().zip(self.motion.series()).map(|(joint, series)| {
            let (a, b) = series.coefficients(self.form);
            let unit = if joint.slides { UnitKey::M } else { UnitKey::Rad };
            JointKeys { name: joint.name.clone(), unit, q0: series.offset(), a, b }
        });
        let keys = FileKeys {
            schema: SCHEMA.to_owned(),
            robot: self.robot.clone(),
            form: match self.form {
                Form::Plain => FormKey::Plain,
                Form::VelocityAmplitudes => FormKey::VelocityAmplitudes,
            },
            base_frequency_rad_s: self.motion.base(),
            periods: self.motion.periods(),
            joints: Some(joints.collect()),
            table: None,
            approach: self
                .approach
                .as_ref()
                .map(|leg| ApproachKeys { from: leg.pose.clone(), duration_s: leg.duration_s }),
            back: self
                .back
                .as_ref()
                .map(|leg| ReturnKeys { to: leg.pose.clone(), duration_s: leg.duration_s }),
            sample_rate_hz: self.sample_rate_hz,
        };
        let mut text = serde_json::to_string_pretty(&keys)
            .unwrap_or_else(|e| unreachable!("a trajectory holds only plain data: {e}"));
        text.push('\n');
        text
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_atomically(path, self.to_json().as_bytes())
    }

    /// Approach, record and return as one motion.
    ///
    /// # Errors
    /// [`TrajectoryError`] if a pose has another number of joints or a duration is not positive.
    pub fn sequence(&self) -> Result<Sequence, TrajectoryError> {
        fn leg(leg: Option<&Leg>) -> Option<(&[f64], f64)> {
            leg.map(|l| (l.pose.as_slice(), l.duration_s))
        }
        Sequence::timed(leg(self.approach.as_ref()), Box::new(self.motion.clone()), leg(self.back.as_ref()))
    }

    /// Coordinate of each of `joints`: by name, or by number where the file names none.
    ///
    /// # Errors
    /// The first joint that the file does not move.
    pub fn order_of(&self, joints: &[String]) -> Result<Vec<usize>, String> {
        let unnamed = self.joints.iter().all(|j| j.name.is_none());
        joints
            .iter()
            .enumerate()
            .map(|(k, joint)| match unnamed {
                true if k < self.joints.len() => Ok(k),
                true => Err(joint.clone()),
                false => {
                    let named = self.joints.iter().position(|j| j.name.as_ref() == Some(joint));
                    named.ok_or_else(|| joint.clone())
                }
            })
            .collect()
    }

    /// Names of the joints; those without one are called `q1`, `q2`, .. by their number.
    pub fn joint_names(&self) -> Vec<String> {
        let number = |k: usize| format!("q{}", k + 1);
        self.joints.iter().enumerate().map(|(k, j)| j.name.clone().unwrap_or_else(|| number(k))).collect()
    }
}

/// Longest motion of a file, s: a year.
const LONGEST_S: f64 = 3.2e7;

fn from_joints(
    file: &str,
    base: f64,
    form: Form,
    keys: &[JointKeys],
) -> Result<(Vec<TrajectoryJoint>, Vec<Fourier>), TrajectoryFileError> {
    let mut series = Vec::with_capacity(keys.len());
    for (k, joint) in keys.iter().enumerate() {
        if joint.a.len() != joint.b.len() {
            let expected = format!("{} amplitudes, as in `a`", joint.a.len());
            return Err(field(file, format!("joints[{k}].b"), expected, joint.b.len()));
        }
        let scale = |v: &[f64]| v.iter().map(|x| x * unit(joint.unit).0).collect::<Vec<f64>>();
        let (a, b, q0) = (scale(&joint.a), scale(&joint.b), joint.q0 * unit(joint.unit).0);
        let one = match form {
            Form::Plain => Fourier::plain(base, q0, a, b),
            Form::VelocityAmplitudes => Fourier::velocity_amplitudes(base, q0, &a, &b),
        };
        series.push(one.map_err(|e| trajectory(file, e))?);
    }
    let joints = keys.iter().map(|j| TrajectoryJoint { name: j.name.clone(), slides: unit(j.unit).1 });
    Ok((joints.collect(), series))
}

fn from_table(
    file: &str,
    base: f64,
    form: Form,
    table: &TableKeys,
) -> Result<(Vec<TrajectoryJoint>, Vec<Fourier>), TrajectoryFileError> {
    let order: RowOrder = table.order.parse().map_err(|e| trajectory(file, e))?;
    let count = table.rows.len();
    if let Some(names) = &table.names
        && names.len() != count
    {
        return Err(field(file, "table.names", format!("{count} names, one per row"), names.len()));
    }
    let (scale, slides) = unit(table.unit);
    let mut series = Vec::with_capacity(count);
    for (k, row) in table.rows.iter().enumerate() {
        if row.len() != table.rows[0].len() {
            let expected = format!("{} numbers, as in the first row", table.rows[0].len());
            return Err(field(file, format!("table.rows[{k}]"), expected, row.len()));
        }
        let row: Vec<f64> = row.iter().map(|x| x * scale).collect();
        series.push(Fourier::from_row(base, form, &order, &row).map_err(|e| trajectory(file, e))?);
    }
    let name = |k: usize| table.names.as_ref().map(|n| n[k].clone());
    Ok(((0..count).map(|k| TrajectoryJoint { name: name(k), slides }).collect(), series))
}

/// Factor to rad or m, and whether it is m.
fn unit(key: UnitKey) -> (f64, bool) {
    match key {
        UnitKey::Rad => (1.0, false),
        UnitKey::M => (1.0, true),
        UnitKey::Deg => (1f64.to_radians(), false),
    }
}

/// All joints have names or none has, and no two the same.
fn check_names(file: &str, joints: &[TrajectoryJoint]) -> Result<(), TrajectoryFileError> {
    for (k, joint) in joints.iter().enumerate() {
        let place = format!("joints[{k}].name");
        match (&joint.name, &joints[0].name) {
            (None, Some(_)) => return Err(field(file, place, "a name, as the first joint has", "none")),
            (Some(name), None) => {
                return Err(field(file, place, "no name, as the first joint has none", excerpt(name)));
            }
            (Some(name), Some(_)) if joints[..k].iter().any(|j| j.name == joint.name) => {
                return Err(field(file, place, "every name once", excerpt(name)));
            }
            _ => {}
        }
    }
    Ok(())
}

fn check_leg(
    file: &str,
    name: &str,
    pose: &str,
    leg: &Leg,
    joints: usize,
) -> Result<(), TrajectoryFileError> {
    if leg.pose.len() != joints {
        let expected = format!("{joints} positions, one per joint");
        return Err(field(file, format!("{name}.{pose}"), expected, leg.pose.len()));
    }
    if !(leg.duration_s > 0.0 && leg.duration_s <= LONGEST_S) {
        let expected = format!("a positive number of at most {LONGEST_S:e}");
        return Err(field(file, format!("{name}.duration_s"), expected, leg.duration_s));
    }
    Ok(())
}

fn field(
    file: &str,
    field: impl Into<String>,
    expected: impl Into<String>,
    found: impl ToString,
) -> TrajectoryFileError {
    TrajectoryFileError::Field {
        file: file.to_owned(),
        field: field.into(),
        expected: expected.into(),
        found: found.to_string(),
    }
}

fn trajectory(file: &str, source: TrajectoryError) -> TrajectoryFileError {
    TrajectoryFileError::Trajectory { file: file.to_owned(), source }
}

fn syntax(file: &str, error: &serde_json::Error) -> TrajectoryFileError {
    let message = error.to_string();
    // The place is printed in front.
    let end = message.rfind(" at line ").unwrap_or(message.len());
    TrajectoryFileError::Syntax {
        file: file.to_owned(),
        line: error.line(),
        column: error.column(),
        message: excerpt_long(&message[..end]),
    }
}

/// On one line; serde lists known keys behind an unknown one, which is worth more than 60 characters.
fn excerpt_long(message: &str) -> String {
    message.chars().take(300).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
