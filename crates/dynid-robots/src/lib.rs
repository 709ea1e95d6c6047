//! Robot files: URDF, MJCF, SDF, each as xacro too, robots in TOML (DH tables or body trees), meshes (STL, OBJ).
//!
//! Every door checks what it lets in: numbers are finite, names are unique, sizes are bounded. A fault becomes one
//! typed error whose `Display` is one line (file, line, column, expected, found) and whose `hint()` says what
//! to do about it. Whether links and joints form a mechanism is decided by `dynid_model`, not here.

mod law;
pub mod mesh;
pub mod mjcf;
mod plain;
pub mod robot;
mod robot_error;
mod robot_numbers;
pub mod sdf;
mod source;
mod tie;
pub mod toml_robot;
pub mod urdf;
mod xacro;
mod xacro_fault;

pub use law::{LawColumn, LawFault, LawShape, LawSpec, LawUnit, with_laws};
pub use mesh::{Mesh, MeshError};
pub use robot_error::{Place, RobotFileError};
pub use tie::{MirrorAxis, TieFault, TieSpec};
pub use toml_robot::{
    ClearanceSpec, ClearanceValue, CouplingForm, CouplingSpec, ElasticSpec, ElementSetting, ElementSpec,
    ReactionLoad, ReactionSpec, RobotFile, SettingValue,
};
pub use xacro_fault::XacroFault;
