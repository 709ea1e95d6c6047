//! Mechanisms, joint elements, inverse dynamics, regressors and base parameters.
//!
//! A [`Description`] (what a robot file says) becomes a checked [`Mechanism`]; [`Dynamics`] runs its recursions over any
//! [`Scalar`]; a [`RobotModel`] adds joint elements and is the [`EffortModel`] that estimators see; [`BaseParameters`]
//! names what of it can be identified. Numbers, spatial algebra and laws of contact are those of `dynid_algebra` and
//! `dynid_contact`, whose names stand here too.
//!
//! Units are SI, angles rad. Standard parameters are about the joint frame in the axes of the file.

pub mod base_parameters;
pub mod closed;
mod closed_model;
mod coordinate;
pub mod effort_model;
pub mod element;
mod journal_model;
pub mod parameter;
mod per_output;
mod random_motion;
mod robot_model;
pub mod ties;
mod tree_model;

pub use base_parameters::{BaseParameters, BaseSettings};
pub use closed_model::{
    ClosedModel, JointLoad, JointMotion, LoadError, LoadGroup, LoadReference, PathError, Reaction, Reactions,
};
pub use coordinate::Coordinate;
pub use description::{Description, JointDescription, JointKind, Limits, LinkDescription, Mimic};
pub use dynamics::{
    AddedInertia, BodyPoint, Dynamics, DynamicsWorkspace, Energy, ForwardDynamicsWorkspace, LoadedState,
    MotionAdjoint, MotionBlock, NotPositive, State,
};
pub use dynid_algebra::{Inertia, Mat3, Placement, Scalar, Vec3, inertia, scalar, spatial, symmetric};
pub use dynid_contact as contact;
pub use dynid_mechanism::{description, dynamics, mechanism};
pub use effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};
pub use journal_model::{JournalLook, JournalModel, LoadSums, derivative_channels, journal_channels};
pub use mechanism::{Body, Frame, Joint, JournalPath, Mechanism, MechanismError, MechanismWarning};
pub use parameter::{Owner, Parameter, ParameterTable, ShapeParameter};
pub use per_output::PerOutput;
pub use random_motion::RandomMotion;
pub use robot_model::RobotModel;
pub use ties::Ties;
pub use tree_model::{FrictionPassivity, KnownElement, Passivity, TreeModel};
