//! Friction laws from steady points: friction at given speed and temperature, as constant-speed tests give it.
//!
//! [`analyse`] fits, with the elements of `dynid-model` as the physics and [`dynid_estimate::separable`] as the solver,
//!
//! - the law that the points can carry, the simplest first (a [`LawForm`] each, see [`Rung`]): Coulomb or Stribeck
//!   friction with viscous friction that is linear or exponential in speed. The one with the least AICc is kept; a more
//!   complicated one has to gain two units;
//! - with several temperatures, the *global* law, in which `σ2, σ3, σ4` are straight lines of the temperature; the law of
//!   each temperature on its own; and the *common* fit, `F_c, F_s, v_s` shared by all temperatures and `σ2, σ3, σ4` per
//!   temperature, through which lines with confidence intervals are put.
//!
//! Rows are weighted by `1/max(std, floor)`. `σ3` and `σ4` stand in for each other within some 10 %: judge a law by its
//! curve ([`CurveError`]), not by its coefficients.
//!
//! Source: Tadese, Pico, Seo & Moon 2022; Hurvich & Tsai
//! 1989 for AICc.

mod analyse;
mod form;
mod law;
mod levels;
mod lines;
mod shared;
mod solve;

pub use analyse::{LevelFit, Rung, SteadyFriction, analyse};
pub use form::{LawForm, ViscousForm};
pub use law::{Coefficient, CurveError, FrictionLaw, LawParts};
pub use levels::temperature_levels;
pub use lines::ThermalLine;

use dynid_estimate::separable::SeparableError;

/// Friction at one speed and temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyPoint {
    /// Speed, signed, rad/s or m/s. Points of both directions in one are given with positive speed.
    pub speed: f64,
    /// Temperature, °C.
    pub temperature: Option<f64>,
    /// Friction, with the sign of the speed (and an offset, if the law is to have one), N m or N.
    pub friction: f64,
    /// Standard error, N m or N; 0: unknown, the floor counts.
    pub std: f64,
}

/// How laws are fitted and chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadySettings {
    /// `T_ref` of the lines, °C. Default 25.
    pub reference_temperature: f64,
    /// Temperatures within this of their level's mean form a level, K. Default 2.5.
    pub level_tolerance: f64,
    /// Least span of temperatures from which slopes are estimated, K. Default 5.
    pub least_span: f64,
    /// Least standard error as a share of the median friction. Default 0.003.
    pub floor: f64,
    /// The law to fit; `None`: chosen.
    pub form: Option<LawForm>,
    /// The law has a constant offset, as friction signals that are not half-differences need. Default false.
    pub offset: bool,
    /// Whether slopes over temperature may be estimated. Default true.
    pub thermal: bool,
    /// Points are successive samples of a signal, whose residuals are correlated: AICc counts one sample per correlation
    /// time, and standard deviations of the law come from leaving out one block of time after the other, blocks of five correlation
    /// times ([`block_length`](dynid_estimate::covariance::block_length())). Default false.
    pub series: bool,
    /// Confidence of intervals. Default 0.95.
    pub confidence: f64,
    /// Starts of the searches. Default 12.
    pub starts: usize,
}

impl Default for SteadySettings {
    fn default() -> Self {
        SteadySettings {
            reference_temperature: 25.0,
            level_tolerance: 2.5,
            least_span: 5.0,
            floor: 0.003,
            form: None,
            offset: false,
            thermal: true,
            series: false,
            confidence: 0.95,
            starts: 12,
        }
    }
}

/// Why no law can be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SteadyError {
    /// Too few points for the simplest law.
    #[error("friction law: expected points at {expected} or more speeds, found {found}")]
    TooFew {
        /// Speeds that the simplest law needs.
        expected: usize,
        /// Distinct speeds found.
        found: usize,
    },
    /// A value is not finite, or an error negative.
    #[error("point {index}: {what}: expected a finite number, found {found}")]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
        /// What.
        what: &'static str,
        /// Value.
        found: f64,
    },
    /// The law that was asked for cannot be carried by the points.
    #[error("friction law: {0}")]
    Unsupported(String),
    /// The solver has no solution.
    #[error("friction law: {0}")]
    Solver(#[from] SeparableError),
}
