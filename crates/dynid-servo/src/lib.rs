//! Position-controlled drives, with efforts and currents where somebody measures them: closed-loop simulation of commands, its sensitivities, and fits.
//!
//! A robot on a fixed base is told positions by its drives' commands and logs where its encoders are. [`ServoJoint`] is the law of
//! one joint behind its drive: position and velocity gain, limits, dead band, delay and shaping of the command, rotor inertia, friction that
//! sticks, a gear that gives way, the encoder's zero and direction.
//!
//! | question | where |
//! |---|---|
//! | where does the robot go, and how does that change with every number | [`Rollout`] |
//! | a first guess from filtered motion | [`start`] |
//! | numbers whose simulation gives the measured positions | [`fit`] |
//! | what will a log of these commands tell | [`forecast`] |
//! | numbers with intervals, verdicts and what cannot be told; efforts and currents beside positions | [`identify`] |
//!
//! Input is a [`Mechanism`](dynid_model::Mechanism) and arrays; no file is opened. Units are SI, angles rad. Whatever number of threads
//! runs, results have the same bits.

pub mod chain;
mod channel;
mod deviation;
pub mod fit;
pub mod forecast;
mod free;
mod gear;
pub mod identify;
mod joint;
mod log;
mod measured;
mod rollout;
mod settings;
pub mod start;
mod step;
mod term;

pub use chain::Chain;
pub use channel::{Channel, EffortAt};
pub use deviation::{Body, DEVIATIONS};
pub use free::{Free, Known, ServoValues, Target};
pub use joint::{EncoderAt, Hold, Limited, LoadOf, Scheme, ServoJoint};
pub use log::ServoLog;
pub use measured::Measured;
pub use rollout::{Count, Lost, Rollout, Simulated, SimulatedEffort, SimulatedRow};
pub use settings::{Addition, Bodies, Choice, ServoSettings, Shared};
pub use term::Term;
