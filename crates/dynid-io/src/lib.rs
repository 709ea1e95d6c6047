//! Robot files and logs: URDF, MJCF, SDF, robots in TOML (DH tables or body trees), logs (CSV, MCAP, Parquet, HDF5, NumPy, MATLAB),
//! states in CSV, trajectories (JSON; CSV and ROS 2 messages, written), meshes (STL, OBJ).
//!
//! Every door checks what it lets in: numbers are finite, names are unique, sizes are bounded. A fault becomes one
//! typed error whose `Display` is one line (file, line, column or row, expected, found) and whose `hint()` says what
//! to do about it. Whether links and joints form a mechanism is decided by `dynid_model`, not here.

pub mod columns;
pub mod csv;
pub mod digest;
mod excerpt;
pub mod input;
pub mod log;
pub mod mesh;
pub mod mjcf;
pub mod output;
pub mod robot;
mod robot_error;
mod robot_numbers;
pub mod sdf;
mod signal;
mod source;
pub mod states;
pub mod stream;
#[cfg_attr(
    not(all(feature = "bags", feature = "hdf5", feature = "numpy", feature = "parquet")),
    allow(unused, reason = "a build that leaves formats out has no use for some of what they share")
)]
pub mod table_file;
mod tie;
pub mod toml_robot;
pub mod trajectory;
pub mod urdf;

pub use columns::{ColumnMapping, GuessOptions, MappingError, MappingSpec, Signals};
pub use csv::{LogFileError, ReadOptions, Table};
pub use digest::SourceFile;
pub use excerpt::closest;
pub use log::{LogHeader, LogOptions, LogSource, ReadingNote};
pub use mesh::{Mesh, MeshError};
pub use output::OutputError;
pub use robot_error::{Place, RobotFileError};
pub use states::{StateJoint, States, StatesError};
pub use tie::{MirrorAxis, TieFault, TieSpec};
pub use toml_robot::{
    ClearanceSpec, ClearanceValue, CouplingForm, CouplingSpec, ElasticSpec, ElementSetting, ElementSpec,
    ReactionLoad, ReactionSpec, RobotFile, SettingValue,
};
pub use trajectory::{TrajectoryFile, TrajectoryFileError};
