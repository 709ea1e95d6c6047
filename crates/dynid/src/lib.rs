//! Dynamic identification of robots and mechanisms: the pipeline from a robot file and a log to a model.
//!
//! [`identify()`] runs it; [`Estimate`] is what it leaves behind. The rooms below are re-exported as [`model`], [`motion`],
//! [`estimators`], [`io`] and [`report`], the words of results as [`record`].

pub mod backlash;
pub mod check;
pub mod clearance;
pub mod compare;
pub mod convert;
pub mod diff;
pub mod explain;
pub mod export;
pub mod fleet;
pub mod friction;
pub mod gains;
mod identify;
pub mod init;
pub mod inspect;
pub mod online;
pub mod payload;
pub mod predict;
pub mod reduce;
mod report_data;
mod run;
pub mod schema;
pub mod validate;

pub use dynid_identify::{Error, Estimate, Fault, Identification, Robot, RobotOptions, Step, VERSION};
pub use dynid_identify::{
    advice, agreement, bounds, caution, closed_loop, commands, consistency, effort_scale, elements, estimate,
    fitting, known_friction, log, log_agreement, log_terms, overlap, passivity, pipeline, preflight, prior,
    robot, searches, settings, shape, stiffness, trust, verdict,
};

pub use dynid_config::{Config, FrictionModel, config, fault, friction_model, logs, nominal};
pub use dynid_drives as servo;
pub use dynid_experiments::{design, motions, simulate};

pub use friction::{FrictionConfig, friction_of_logs, identify_friction};
pub use identify::identify;
pub use report_data::report as report_page;
pub use run::Run;

pub use dynid_excitation as excitation;
pub use dynid_model as model;
pub use dynid_motion as motion;
pub use dynid_record as record;
pub use dynid_report as report;
pub use dynid_servo as servo_fits;
pub use dynid_sim as sim;

/// Files in and out: robots, logs, trajectories.
pub mod io {
    pub use dynid_files::*;
    pub use dynid_logs::*;
    pub use dynid_robots::*;
}

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

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
