//! From logs to rows, and the faults of a log that take a model to see.
//!
//! | question | module |
//! |---|---|
//! | what is chosen for a log (kernel, mask, delay, shapes of friction), and the rows that follow | [`conditioning`] |
//! | joints mixed up, signs, units, gravity: what a log says about its own wiring | [`preflight`] |
//!
//! Choices are made by fits to held-out blocks, so this room stands on the estimators. Results do not depend on the number of
//! threads.

pub mod conditioning;
pub mod preflight;
