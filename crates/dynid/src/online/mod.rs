//! On-line identification: an estimate that follows a stream of samples, alarms when something changes.
//!
//! A [`Session`] takes rows of numbers as they come. The first stretch is *learned* off line: filter, delay, reversal masks and
//! noise are found as for a log ([`dynid_rows::conditioning::condition`]). From then on samples become rows one by one
//! ([`dynid_rows::conditioning::LiveRows`]), and rows update a square-root information filter
//! ([`dynid_estimate::online::Estimator`]). What there is to say comes as [`Event`]s. The state goes to a checkpoint and back without a
//! change of bits.

mod asked;
mod checkpoint;
mod event;
mod ground;
mod learning;
mod moved;
mod rules;
mod running;
mod samples;
mod session;
mod usual;

pub use checkpoint::Checkpoint;
pub use event::{Counts, Event, LearnedParameter, Moved, MovedParameter, ParameterValue, PlainValue};
pub use session::Session;
