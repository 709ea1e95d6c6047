//! Logs (text, bags, tables, arrays), their columns with units, states in CSV, streams, and trajectories (JSON; CSV and ROS 2
//! messages, written).
//!
//! Every door checks what it lets in: numbers are finite, names are unique, sizes are bounded. A fault becomes one
//! typed error whose `Display` is one line (file, row, column, expected, found) and whose `hint()` says what
//! to do about it.

pub mod columns;
pub mod csv;
pub mod log;
mod signal;
pub mod states;
pub mod stream;
#[cfg_attr(
    not(all(feature = "arrow", feature = "bags", feature = "hdf5", feature = "numpy", feature = "parquet")),
    allow(unused, reason = "a build that leaves formats out has no use for some of what they share")
)]
pub mod table_file;
pub mod trajectory;

pub use columns::{ColumnMapping, GuessOptions, MappingError, MappingSpec, Signals};
pub use csv::{LogFileError, ReadOptions, Table};
pub use log::{LogHeader, LogOptions, LogSource, ReadingNote};
pub use states::{StateJoint, States, StatesError};
pub use trajectory::{TrajectoryFile, TrajectoryFileError};
