//! Which column of a log is which signal, in which unit.

mod degrees;
mod error;
mod extract;
mod guess;
mod names;
mod spec;
mod units;

pub use degrees::{DegreesEvidence, degrees_suspected};
pub use error::MappingError;
pub use extract::Signals;
pub use guess::GuessOptions;
pub use names::{Signal, is_time_name};
pub use spec::{ChannelSpec, ColumnNames, FullSignal, MappingSpec, PerJoint, SignalSpec, Units};

/// A column and its conversion to SI: `value = factor · raw + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnUse {
    /// Index of the column, from 0.
    pub column: usize,
    /// Name of the column.
    pub name: String,
    /// Factor, SI unit per raw unit; includes drive gains.
    pub factor: f64,
    /// Offset, SI unit.
    pub offset: f64,
}

/// What a log says of the effort of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffortColumn {
    /// The effort of its drive.
    #[default]
    Drive,
    /// The reading of a torque sensor behind its drive, which counts the other way: the effort is the negative of it.
    Sensor,
    /// Nothing: no drive acts on it, so its effort is zero.
    Absent,
}

/// Where the time comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeSource {
    /// A column.
    Column(ColumnUse),
    /// Equal steps at a rate, Hz.
    Rate(f64),
}

/// Columns of every signal. Lists have one entry per joint of the robot; `None`: the joint is not logged.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMapping {
    /// Joints of the robot in their order.
    pub joints: Vec<String>,
    /// Time, s.
    pub time: TimeSource,
    /// Positions, rad or m.
    pub position: Vec<Option<ColumnUse>>,
    /// Velocities, rad/s or m/s, of every logged joint.
    pub velocity: Option<Vec<Option<ColumnUse>>>,
    /// Accelerations, rad/s² or m/s², of every logged joint.
    pub acceleration: Option<Vec<Option<ColumnUse>>>,
    /// Efforts, N m or N, of every logged joint.
    pub effort: Option<Vec<Option<ColumnUse>>>,
    /// Temperatures, °C, of every logged joint.
    pub temperature: Option<Vec<Option<ColumnUse>>>,
    /// Per joint, whether its effort is known to be zero: it has no column then.
    pub undriven: Vec<bool>,
    /// Other columns by the names the mapping gives them.
    pub channels: Vec<(String, ColumnUse)>,
}

impl ColumnMapping {
    /// Joints without a position column.
    pub fn not_logged(&self) -> Vec<&str> {
        self.joints.iter().zip(&self.position).filter(|(_, p)| p.is_none()).map(|(j, _)| j.as_str()).collect()
    }
}
