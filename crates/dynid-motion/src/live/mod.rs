//! Streams: states of motion formed sample by sample, some samples behind.
//!
//! [`LiveGrid`] puts samples of a clock that jitters, stops and steps back on a uniform grid; [`LocalPolynomial`] smooths
//! and differentiates; [`LiveStates`] forms positions, velocities, accelerations and efforts with it. Results depend on
//! the samples alone, never on how they were handed over.

mod grid;
mod polynomial;
mod states;

pub use grid::{ClockCounts, GridSample, LiveGrid};
pub use polynomial::LocalPolynomial;
pub use states::{LiveBlock, LiveSettings, LiveStates};
