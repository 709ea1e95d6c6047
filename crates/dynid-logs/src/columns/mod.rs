//! Which column of a log is which signal, in which unit.

mod clock;
mod column_values;
mod degrees;
mod error;
mod extract;
mod guess;
mod missing;
mod spec;
mod units;
mod unnamed;

pub use crate::signal::{Signal, is_held, is_time_name, signal_of_name};
pub use clock::TimeReading;
pub use degrees::{DegreesEvidence, degrees_suspected};
pub use error::{MappingError, holds_currents};
pub use extract::{ClockStart, Signals};
pub use guess::GuessOptions;
pub use missing::Sparse;
pub use spec::{ChannelSpec, ColumnNames, FullSignal, MappingSpec, PerJoint, SignalSpec, Units};
pub use unnamed::columns_of_unnamed;

use crate::log::Missing;

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

/// Columns of the time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeColumns {
    /// Columns that are added up: one, or whole seconds and nanoseconds.
    pub parts: Vec<ColumnUse>,
    /// The unit is said by the mapping or by the columns' names; else seconds are assumed until the numbers were looked at
    /// ([`ColumnMapping::settle_time`]).
    pub unit_stated: bool,
}

/// Where the time comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeSource {
    /// Columns.
    Columns(TimeColumns),
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
    /// What becomes of rows in which one of these columns has no value.
    pub missing: Missing,
}

impl ColumnMapping {
    /// Columns of the time.
    pub fn time_columns(&self) -> &[ColumnUse] {
        match &self.time {
            TimeSource::Columns(time) => &time.parts,
            TimeSource::Rate(_) => &[],
        }
    }

    /// All columns but those of the time.
    fn signal_columns(&self) -> impl Iterator<Item = &ColumnUse> {
        let lists = [&self.velocity, &self.acceleration, &self.effort, &self.temperature];
        let signals = lists.into_iter().flatten().chain([&self.position]).flatten().flatten();
        signals.chain(self.channels.iter().map(|(_, column)| column))
    }

    /// What is to be read of a log for this mapping.
    pub fn wanted(&self) -> crate::log::Wanted {
        let time: Vec<usize> = self.time_columns().iter().map(|c| c.column).collect();
        let mut columns: Vec<usize> = self.signal_columns().map(|c| c.column).chain(time.clone()).collect();
        columns.sort_unstable();
        columns.dedup();
        crate::log::Wanted { columns: Some(columns), time, missing: self.missing }
    }

    /// Joints without a position column.
    pub fn not_logged(&self) -> Vec<&str> {
        self.joints.iter().zip(&self.position).filter(|(_, p)| p.is_none()).map(|(j, _)| j.as_str()).collect()
    }
}
