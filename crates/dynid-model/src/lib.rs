//! Mechanisms, joint elements, inverse dynamics, regressors and base parameters.
//!
//! A [`Description`] (what a robot file says) becomes a checked [`Mechanism`]; [`Dynamics`] runs its recursions over any
//! [`Scalar`]; a [`RobotModel`] adds joint elements and is the [`EffortModel`] that estimators see; [`BaseParameters`]
//! names what of it can be identified. [`contact`] holds the laws of joints with clearance.
//!
//! Units are SI, angles rad. Standard parameters are about the joint frame in the axes of the file.

pub mod base_parameters;
pub mod closed;
mod closed_model;
pub mod contact;
mod coordinate;
pub mod description;
pub mod dynamics;
pub mod effort_model;
pub mod element;
pub mod inertia;
pub mod mechanism;
mod motion_block;
pub mod parameter;
mod per_output;
mod random_motion;
mod robot_model;
pub mod scalar;
pub mod spatial;
pub mod symmetric;
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
pub use effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};

pub use inertia::Inertia;
pub use mechanism::{Body, Frame, Joint, JournalPath, Mechanism, MechanismError, MechanismWarning};
pub use parameter::{Owner, Parameter, ParameterTable, ShapeParameter};
pub use per_output::PerOutput;
pub use random_motion::RandomMotion;
pub use robot_model::RobotModel;
pub use scalar::Scalar;
pub use spatial::{Mat3, Placement, Vec3};
pub use tree_model::{FrictionPassivity, KnownElement, Passivity, TreeModel};
