//! Excitation trajectories with exact derivatives.

pub mod fourier;
pub mod fourier_basis;
pub mod quintic;

pub use fourier::Fourier;
pub use fourier_basis::FourierBasis;
pub use quintic::Quintic;

/// Why a trajectory was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// Sine and cosine amplitudes must come in pairs.
    #[error("expected as many cosine as sine amplitudes ({expected}), found {found}")]
    Harmonics {
        /// Sine amplitudes given.
        expected: usize,
        /// Cosine amplitudes given.
        found: usize,
    },
    /// A number is not finite or not positive where it must be.
    #[error("{name}: expected {expected}, found {found}")]
    Value {
        /// Which number.
        name: &'static str,
        /// The range it must lie in.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
}

/// Motion of one joint at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, per s.
    pub velocity: f64,
    /// Acceleration, per s^2.
    pub acceleration: f64,
}

fn check(name: &'static str, found: f64, positive: bool) -> Result<(), TrajectoryError> {
    if found.is_finite() && (found > 0.0 || !positive) {
        return Ok(());
    }
    let expected = if positive { "a positive finite number" } else { "a finite number" };
    Err(TrajectoryError::Value { name, expected, found })
}
