//! Closed mechanisms in motion: parallel robots, linkages.
//!
//! A [`ClosedPlant`] gives accelerations in the coordinates of its whole tree, by a basis of the motions that the loops leave
//! free. Neither drives nor inverses of mass matrices are needed for that, so that it runs through poses where the drives lose
//! control, with conditions that repeat each other, and with carriers without mass. A [`ClosedIntegrator`] moves it and takes
//! every step back to the closed poses. [`run_closed`](crate::run_closed) lets a controller move it by its drives.

mod balance;
mod dynamics;
mod integrator;
mod loads;
mod machine;
mod plant;
mod settle;
mod step;

pub use integrator::{ClosedIntegrator, Stepping};
pub use plant::{ClosedPlant, ClosedWorkspace};

pub(crate) use machine::{ClosedMotion, ClosedNominal};
