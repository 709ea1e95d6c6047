//! Estimators and statistics on triangular factors.
//!
//! A log enters through triangular factors [`Factor`](dynid_factor::Factor), one per group of rows (a joint, or a joint of one log)
//! and time block. Everything quadratic then works on factors, never on samples:
//!
//! | question | module |
//! |---|---|
//! | every linear estimator through one call | [`linear::estimate`] |
//! | rows spoilt by noise that a control loop feeds back | [`instruments`] |
//! | shape parameters beside linear ones | [`separable`] |
//! | covariance that survives filtering | [`covariance`] |
//! | held-out error over folds of blocks; several estimators on the same folds | [`folds`], [`held_out`] |
//! | which parameters a model can do without | [`elimination`] |
//! | whether residuals are white | [`whiteness`] |
//! | standard parameters of bodies that can exist, with a proven gap | [`consistent`] |
//! | which parameters the data determine, and which the prior | [`identifiability`] |
//! | what is known of a model without logs | [`prior`] |
//! | the motions that would reveal what logs do not | [`advice`] |
//! | estimates while the machine runs, alarms on changes | [`online`] |
//! | misfit of an effort model as what a search minimises | [`effort_objective`] |
//! | how well a prediction matches a measurement | [`metrics`] |
//!
//! Notation: `W` is the regressor (rows × `p` columns), `y` the effort, `x` the parameters,
//! `(R, z, ρ, N)` a factor. Results do not depend on the number of threads.

pub mod advice;
pub mod consistent;
pub mod covariance;
pub mod distribution;
pub mod drive_gain;
pub mod effort_objective;
pub mod elimination;
pub mod folds;
pub mod held_out;
pub mod identifiability;
pub mod instruments;
mod least_squares;
pub mod linear;
pub mod log_deviations;
pub mod metrics;
mod oblique;
pub mod online;
pub mod prior;
pub mod separable;
mod whitened;
pub mod whiteness;
