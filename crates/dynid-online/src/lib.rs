//! Recursive estimation in square-root information form.
//!
//! For programs that estimate while a machine runs: no standard library, no allocation after construction,
//! bounded work per sample.
//!
//! | question | type |
//! |---|---|
//! | everything, one sample after the other | [`Estimator`] |
//! | information `(R, z, ρ², N)` and what can be done with it | [`SquareRoot`] |
//! | how old samples lose their weight | [`Forgetting`] |
//! | the last samples alone | [`BlockWindow`], [`RowWindow`] |
//! | what a prediction error should look like | [`Innovation`] |
//! | whether something changed | [`ChangeDetection`], thresholds: [`cusum_threshold`] |
//! | what changed | [`TargetedReaction`] |
//! | what is excited | [`ExcitationMonitor`] |
//!
//! Notation: `Φ` regressor of a sample (`m` rows, `p` columns), `y` effort, `x` parameters, `P` covariance,
//! `λ` forgetting factor, `u` whitened innovations. Nothing here knows of robots: an effort model gives the
//! rows.

#![no_std]

extern crate alloc;

mod change_detection;
mod correlation;
mod distribution;
mod downdating;
mod drift;
mod error;
mod estimator;
mod excitation_monitor;
mod forgetting;
mod innovation;
mod memory;
mod reaction;
mod rows;
mod settings;
mod square_root;
mod state;
mod thresholds;
mod window;

pub use change_detection::ChangeDetection;
pub use correlation::InnovationCorrelation;
pub use downdating::{RowWindow, downdate};
pub use drift::Drift;
pub use error::{SampleError, SettingsError, StateError};
pub use estimator::{Estimator, Step, Watch};
pub use excitation_monitor::ExcitationMonitor;
pub use forgetting::{
    BoundedCovariance, DirectionalForgetting, Forgetting, error_driven_factor, excess_error, relative_error,
};
pub use innovation::Innovation;
pub use reaction::{Reaction, TargetedReaction};
pub use rows::RowNoise;
pub use settings::{DetectionSettings, FalseAlarms, MonitorSettings, ReactionSettings, Settings, Whiteness};
pub use square_root::SquareRoot;
pub use thresholds::{average_run_length, cusum_threshold, run_length_for_rate};
pub use window::BlockWindow;
