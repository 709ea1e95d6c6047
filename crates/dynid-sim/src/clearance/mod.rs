//! Mechanisms whose joints have clearance: journals that hit, slide and swing in their bearings.
//!
//! [`simulate`] moves a [`Plant`](crate::Plant) whose model has [contacts](dynid_model::element::ClearanceContact), either along
//! prescribed motions of its driven joints or under efforts that a controller gives at fixed intervals. Contact is stiff
//! and begins with a jump of the force; friction has kinks. Between such instants the equations are smooth, and they are
//! found: onset and loss of contact, release where the bearing would have to pull, and every passage of a sliding speed from
//! one branch of friction to another, end a step. So a collocation method of order nine keeps its order ([`Method::Collocation`]).
//!
//! [`Method::RungeKutta4`] is the classical explicit method with fixed steps, to compare with.

mod branch;
mod energy;
mod explicit;
mod motion;
mod record;
mod run;
mod settings;
mod system;

pub use energy::ClearanceEnergy;
pub(crate) use motion::ClearanceMotion;
pub use motion::sensors;
pub use record::{ClearanceRecord, ContactEvent, ContactEventKind, JournalRecord, RunCount};
pub use run::simulate;
pub use settings::{
    ClearanceSettings, ClearanceStart, Controller, Driving, Method, Offset, PrescribedMotion,
};
