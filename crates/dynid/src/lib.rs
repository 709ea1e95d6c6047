//! Dynamic identification of robots and mechanisms: the pipeline from a robot file and a log to a model.
//!
//! [`identify()`] runs it; [`Estimate`] is what it leaves behind. The rooms below are re-exported as [`model`], [`motion`],
//! [`estimators`], [`io`] and [`report`].

pub mod advice;
pub mod agreement;
pub mod backlash;
pub mod bounds;
pub mod caution;
pub mod check;
pub mod clearance;
pub mod commands;
pub mod compare;
pub mod config;
pub mod consistency;
pub mod design;
pub mod diff;
pub mod effort_scale;
pub mod elements;
mod error;
pub mod estimate;
pub mod explain;
pub mod export;
pub mod fitting;
pub mod friction;
mod friction_power;
pub mod gains;
pub mod identify;
pub mod init;
pub mod inspect;
pub mod instruments;
pub mod log_agreement;
pub mod log_terms;
pub mod logs;
pub mod nominal;
pub mod online;
pub mod overlap;
mod passivity;
pub mod payload;
pub mod predict;
pub mod prior;
mod provenance;
mod report_data;
mod result;
pub mod robot;
mod sealed;
pub mod shape;
pub mod simulate;
pub mod stiffness;
pub mod trust;
pub mod validate;
pub mod verdict;

pub use config::Config;
pub use error::Error;
pub use estimate::Estimate;
pub use friction::{FrictionConfig, FrictionModel, identify_friction};
pub use identify::{Identification, Step, identify};
pub use robot::{Robot, RobotOptions};

pub use dynid_excitation as excitation;
pub use dynid_io as io;
pub use dynid_model as model;
pub use dynid_motion as motion;
pub use dynid_report as report;
pub use dynid_sim as sim;

/// Everything between rows and estimates, whichever room it is in.
pub mod estimators {
    pub use dynid_clearance as clearance;
    pub use dynid_clearance::deformation;
    pub use dynid_estimate::{
        consistent, covariance, distribution, drive_gain, elimination, folds, held_out, identifiability,
        instruments, linear, log_deviations, metrics, online, separable, whiteness,
    };
    pub use dynid_factor::{Factor, FactorBuilder, FactorError, factor, groups, rank, rows};
    pub use dynid_friction::{cyclic, load_friction, steady_friction};
    pub use dynid_linalg::Mat;
    pub use dynid_rows::{conditioning, preflight};

    /// Searches that need values only, and the misfit of an effort model as what they minimise.
    pub mod search {
        pub use dynid_estimate::effort_objective::{EffortLoss, EffortObjective, EffortObjectiveError};
        pub use dynid_search::*;
    }
}

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
