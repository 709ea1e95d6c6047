//! Closed mechanisms: trees with cut joints that close their loops.
//!
//! A [`ClosedMechanism`] is a [`Mechanism`](crate::Mechanism) whose coordinates obey closures `Γ(q) = 0`. Some of them are
//! *independent*; the others depend on them, which coordinates the poses of a motion solve for. Some are *driven*: efforts act
//! there. With `J = ∂Γ/∂q̇`, `Γ̈ = J q̈ + b` and efforts `t` of the tree,
//!
//! ```text
//! q̇ = G q̇_i,  q̈ = G q̈_i + c;   t = S τ + Jᵀ λ;   Gᵀ S τ = Gᵀ t
//! ```
//!
//! where `S` selects driven coordinates and `λ` are the multipliers: forces (N) and couples (N m) in the cuts. Positive `λ` of a
//! translation row pushes the body of frame `b` along that axis of frame `a`.

mod bend;
mod build;
mod closure;
mod displacement;
mod dynamics;
mod error;
pub(crate) mod factor;
mod free;
mod lu;
mod mechanism;
mod naming;
mod path;
mod pose;
mod reaction;
mod rows;
mod sensitivity;
mod singularity;
mod sweep;

pub use closure::{ClosureDescription, Condition, CutKind, LinkFrame};
pub(crate) use dynamics::Drives;
pub use dynamics::{ClosedDynamics, ClosedEffort, ClosedRegressor};
pub use error::{ClosedError, ClosedWarning, NamedMotion, PoseError};
pub use free::FreeMotions;
pub use mechanism::ClosedMechanism;
pub use pose::PoseWorkspace;
pub use reaction::ReactionRows;
pub(crate) use sensitivity::{CarryWorkspace, Seeds};
pub use singularity::Singularity;
