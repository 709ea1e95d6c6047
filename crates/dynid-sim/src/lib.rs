//! Virtual experiments: controlled robots in motion, with sensors and all their faults.
//!
//! A [`Plant`] is a robot model with its true parameters. [`run`] lets a sampled controller move it along a reference and
//! gives a log as a real robot would, with the truth beside it. Every fault of sensors, drives and logger is a setting of
//! its own ([`Imperfections`]).
//!
//! A [`ClosedPlant`] is the same for mechanisms with loops, parallel robots; [`run_closed`] moves it by its drives.
//!
//! [`presliding`] moves a single joint within its friction, where bristles bend and hardly slip.
//!
//! [`ElasticInverse`] gives motors behind elastic transmissions the motion that goes with that of their links.
//!
//! [`clearance`] lets journals move, hit and slide in their bearings.
//!
//! Units are SI, angles rad.

mod bodiless;
pub mod clearance;
mod closed;
mod collocation;
mod controller;
mod elastic;
mod elements;
mod encoder;
mod error;
mod experiment;
mod imperfections;
mod integrator;
mod lu;
mod machine;
mod plant;
pub mod presliding;
mod profile;
mod rosenbrock;
mod slopes;
pub mod streams;

pub use closed::{ClosedIntegrator, ClosedPlant, ClosedWorkspace, Stepping};
pub use controller::{ControlSettings, Wanted};
pub use elastic::{ElasticInverse, ElasticMotion, LinkMotion, fourier_link};
pub use error::{ForwardError, SimError};
pub use experiment::{
    EnergyBalance, ExperimentResult, ExperimentSettings, Truth, VirtualLog, run, run_closed,
    run_with_clearance, wrong_model,
};
pub use imperfections::Imperfections;
pub use integrator::{Integrator, PlantState};
pub use plant::{Plant, PlantEnergy, PlantWorkspace, Ripple};
pub use profile::Profile;
pub use rosenbrock::IntegrationCount;
pub use slopes::{DrivenMotion, position_slopes};
