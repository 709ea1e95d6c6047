//! Virtual experiments: controlled robots in motion, with sensors and all their faults.

mod error;
mod integrator;
mod lu;
mod plant;

pub use error::SimError;
pub use integrator::{IntegrationCount, Integrator, PlantState};
pub use plant::{Plant, PlantEnergy, PlantWorkspace, Ripple};
