//! States at which efforts and regressors are asked for.

use std::path::Path;

use dynid_files::excerpt::{excerpt, listed};
use thiserror::Error;

use crate::csv::{self, LogFileError, ReadOptions, Table};

/// Most names repeated in a message.
const LISTED: usize = 20;
/// Largest deviation of a quaternion's norm from 1.
const QUATERNION_SLACK: f64 = 1e-3;

/// Coordinates of a moving joint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StateJoint {
    /// One coordinate and one rate.
    Scalar(String),
    /// Position `x y z qx qy qz qw`, rates `vx vy vz wx wy wz`.
    Floating(String),
}

/// A table of states: columns of `nq` positions, `nv` rates and their derivatives, in joint order.
#[derive(Clone, Debug, PartialEq)]
pub struct States {
    /// Number of states.
    pub rows: usize,
    /// Positions (rad, m, unit quaternions), `nq` columns.
    pub position: Vec<Vec<f64>>,
    /// Rates, `nv` columns.
    pub velocity: Vec<Vec<f64>>,
    /// Accelerations, `nv` columns.
    pub acceleration: Vec<Vec<f64>>,
    /// Gravity in base axes, m/s², if the table states it.
    pub gravity: Option<[Vec<f64>; 3]>,
    /// Channels that were asked for, by name: `temperature_<joint>` in °C.
    pub channels: Vec<(String, Vec<f64>)>,
    /// Time, s, where the table has a column `t` or `time` that ascends: its states follow one another.
    pub time: Option<Vec<f64>>,
}

/// Why a table of states was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StatesError {
    /// The file is not a table of numbers.
    #[error(transparent)]
    File(#[from] LogFileError),
    /// Columns are missing.
    #[error(
        "{file}: {quantity}: expected the columns {} or {}, found {}",
        listed(named, LISTED),
        listed(numbered, LISTED),
        listed(header, LISTED)
    )]
    Missing {
        /// File.
        file: String,
        /// `position`, `velocity`, `acceleration` or `gravity`.
        quantity: &'static str,
        /// Names by joint.
        named: Vec<String>,
        /// Numbered names.
        numbered: Vec<String>,
        /// Names there are.
        header: Vec<String>,
    },
    /// A channel is missing that the model reads.
    #[error(
        "{file}: expected the column `{channel}`, which the model reads, found {}",
        listed(header, LISTED)
    )]
    MissingChannel {
        /// File.
        file: String,
        /// Name of channel and column.
        channel: String,
        /// Names there are.
        header: Vec<String>,
    },
    /// More numbered columns than coordinates.
    #[error("{file}: {quantity}: expected {expected} columns, found one more: `{column}`")]
    Surplus {
        /// File.
        file: String,
        /// Quantity.
        quantity: &'static str,
        /// Coordinates.
        expected: usize,
        /// The first column too many.
        column: String,
    },
    /// A quaternion is not of unit length.
    #[error("{file}: row {row}, joint `{joint}`: expected a quaternion of length 1, found {found}")]
    Quaternion {
        /// File.
        file: String,
        /// Data row, from 1.
        row: usize,
        /// Joint.
        joint: String,
        /// Length of the quaternion.
        found: f64,
    },
}

impl StatesError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            StatesError::File(error) => error.hint(),
            StatesError::Missing { .. } => Some(
                "name all columns by joint or number them all from 1; `qd`, `qdd` may stand for `dq`, `ddq`"
                    .to_owned(),
            ),
            StatesError::MissingChannel { .. } => {
                Some("add the column: temperatures in degrees Celsius, currents in A".to_owned())
            }
            StatesError::Surplus { .. } => {
                Some("the states belong to another robot, or to this one with a floating base (--floating-base); use names by joint to pick columns".to_owned())
            }
            StatesError::Quaternion { .. } => Some("normalise it; its order is qx, qy, qz, qw".to_owned()),
        }
    }
}

/// Reads a table of states.
///
/// Columns, in any order, by joint (`q_<joint>`, `dq_<joint>`, `ddq_<joint>`; floating joints `q_<joint>.x .y .z .qx .qy
/// .qz .qw`, `dq_<joint>.vx .vy .vz .wx .wy .wz`, likewise `ddq`) or numbered (`q1..`, `dq1..`, `ddq1..` over all
/// coordinates); `qd`, `qdd` are accepted for `dq`, `ddq`. Optional `gx, gy, gz`. Other columns are passed over.
/// Quaternions within 1e-3 of unit length are normalised.
///
/// # Errors
/// [`StatesError`].
pub fn read(
    path: impl AsRef<Path>,
    joints: &[StateJoint],
    options: &ReadOptions,
) -> Result<States, StatesError> {
    from_table(&csv::read(path, options)?, joints)
}

/// Picks the states out of a table, and channels by their names; see [`read`].
///
/// # Errors
/// [`StatesError`].
pub fn from_table_with_channels(
    table: &Table,
    joints: &[StateJoint],
    channels: &[String],
) -> Result<States, StatesError> {
    let mut states = from_table(table, joints)?;
    for channel in channels {
        let Some(values) = table.column(channel) else {
            let (file, channel, header) = (table.source.clone(), channel.clone(), table.header.clone());
            return Err(StatesError::MissingChannel { file, channel, header });
        };
        states.channels.push((channel.clone(), values.to_vec()));
    }
    Ok(states)
}

/// Picks the states out of a table; see [`read`].
///
/// # Errors
/// [`StatesError`].
pub fn from_table(table: &Table, joints: &[StateJoint]) -> Result<States, StatesError> {
    let mut position =
        pick(table, "position", &["q"], &suffixes(joints, &[".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"]))?;
    let rates = suffixes(joints, &[".vx", ".vy", ".vz", ".wx", ".wy", ".wz"]);
    let velocity = pick(table, "velocity", &["dq", "qd"], &rates)?;
    let acceleration = pick(table, "acceleration", &["ddq", "qdd"], &rates)?;
    let mut at = 0;
    for joint in joints {
        match joint {
            StateJoint::Scalar(_) => at += 1,
            StateJoint::Floating(name) => {
                normalise(table, name, &mut position[at + 3..at + 7])?;
                at += 7;
            }
        }
    }
    Ok(States {
        rows: table.rows,
        position,
        velocity,
        acceleration,
        gravity: gravity(table)?,
        channels: Vec::new(),
        time: time(table),
    })
}

/// The column of time, if it ascends from state to state.
fn time(table: &Table) -> Option<Vec<f64>> {
    let values = table.column("t").or_else(|| table.column("time"))?;
    let ascends = values.windows(2).all(|pair| pair[0] < pair[1]);
    ascends.then(|| values.to_vec())
}

/// Names of coordinates without the prefix: `_<joint>` or `_<joint>.x`.
fn suffixes(joints: &[StateJoint], of_floating: &[&str]) -> Vec<String> {
    let mut out = Vec::new();
    for joint in joints {
        match joint {
            StateJoint::Scalar(name) => out.push(format!("_{name}")),
            StateJoint::Floating(name) => out.extend(of_floating.iter().map(|s| format!("_{name}{s}"))),
        }
    }
    out
}

fn pick(
    table: &Table,
    quantity: &'static str,
    prefixes: &[&str],
    suffixes: &[String],
) -> Result<Vec<Vec<f64>>, StatesError> {
    let numbers: Vec<String> = (1..=suffixes.len()).map(|k| k.to_string()).collect();
    for prefix in prefixes {
        for names in [suffixes, &numbers] {
            let columns: Option<Vec<Vec<f64>>> = names
                .iter()
                .map(|suffix| table.column(&format!("{prefix}{suffix}")).map(<[f64]>::to_vec))
                .collect();
            let Some(columns) = columns else { continue };
            let column = format!("{prefix}{}", suffixes.len() + 1);
            if std::ptr::eq(names, numbers.as_slice()) && table.column(&column).is_some() {
                let (file, expected) = (table.source.clone(), suffixes.len());
                return Err(StatesError::Surplus { file, quantity, expected, column });
            }
            return Ok(columns);
        }
    }
    Err(StatesError::Missing {
        file: table.source.clone(),
        quantity,
        named: suffixes.iter().map(|s| format!("{}{s}", prefixes[0])).collect(),
        numbered: numbers.iter().map(|n| format!("{}{n}", prefixes[0])).collect(),
        header: table.header.clone(),
    })
}

fn gravity(table: &Table) -> Result<Option<[Vec<f64>; 3]>, StatesError> {
    match ["gx", "gy", "gz"].map(|name| table.column(name).map(<[f64]>::to_vec)) {
        [None, None, None] => Ok(None),
        [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
        _ => {
            let named = ["gx", "gy", "gz"].map(str::to_owned).to_vec();
            Err(StatesError::Missing {
                file: table.source.clone(),
                quantity: "gravity",
                numbered: vec!["none of them".to_owned()],
                named,
                header: table.header.clone(),
            })
        }
    }
}

fn normalise(table: &Table, joint: &str, quaternion: &mut [Vec<f64>]) -> Result<(), StatesError> {
    for row in 0..table.rows {
        let norm = quaternion.iter().map(|c| c[row] * c[row]).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > QUATERNION_SLACK {
            let (file, joint) = (table.source.clone(), excerpt(joint));
            return Err(StatesError::Quaternion { file, row: table.first_row + row, joint, found: norm });
        }
        // Dividing a quaternion that is exact to rounding would only change its last bits.
        if (norm - 1.0).abs() > 4.0 * f64::EPSILON {
            for component in &mut *quaternion {
                component[row] /= norm;
            }
        }
    }
    Ok(())
}
