//! Excitation trajectories with exact derivatives.
//!
//! Profiles move one coordinate ([`Quintic`], [`PaulBlend`], [`Trapezoid`], [`FadedTones`]); a [`Trajectory`] moves all of them at
//! once: [`FourierTrajectory`], [`QuinticSegment`], [`BSpline`], [`PaulTrack`], [`Circle`], [`Rest`], [`PerCoordinate`] profiles or
//! one [`Alone`], and [`Sequence`], which joins approach, record and return. [`sweeps()`] are constant-speed tests. [`Sampled`] holds a
//! trajectory on a grid of times, [`QuinticSpline`] makes a trajectory of such samples.

pub mod alone;
pub mod bspline;
pub mod circle;
pub mod error;
pub mod fourier;
pub mod fourier_basis;
pub mod fourier_trajectory;
pub mod limits;
pub mod paul;
mod polynomial;
pub mod profile;
pub mod quintic;
pub mod quintic_segment;
pub mod rest;
pub mod row_order;
pub mod sampled;
pub mod sequence;
pub mod spline;
pub mod sweep;
pub mod tones;
pub mod track;
pub mod trapezoid;

pub use alone::Alone;
pub use bspline::BSpline;
pub use circle::Circle;
pub use error::{Quantity, TrajectoryError};
pub use fourier::{Extreme, Extremes, Form, Fourier};
pub use fourier_basis::FourierBasis;
pub use fourier_trajectory::FourierTrajectory;
pub use limits::MotionLimits;
pub use paul::PaulBlend;
pub use profile::{PerCoordinate, Profile};
pub use quintic::Quintic;
pub use quintic_segment::QuinticSegment;
pub use rest::Rest;
pub use row_order::RowOrder;
pub use sampled::Sampled;
pub use sequence::{Phase, Sequence};
pub use spline::QuinticSpline;
pub use sweep::{SweepSettings, sweeps};
pub use tones::{FadedTones, Tone};
pub use track::PaulTrack;
pub use trapezoid::Trapezoid;

use error::check;

/// Motion of one coordinate at one time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Point {
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, per s.
    pub velocity: f64,
    /// Acceleration, per s^2.
    pub acceleration: f64,
    /// Jerk, per s^3.
    pub jerk: f64,
}

impl Point {
    /// At rest at a position.
    pub fn rest(position: f64) -> Self {
        Point { position, ..Point::default() }
    }
}

/// Motion of all coordinates of a robot, from time 0 to [`Self::duration`].
pub trait Trajectory: Send + Sync {
    /// Number of coordinates.
    fn coordinates(&self) -> usize;

    /// Duration, s.
    fn duration(&self) -> f64;

    /// Exact motion at `time`, s, one point per coordinate.
    ///
    /// Before 0 and after the duration, position, velocity and acceleration of the nearer end are held and the jerk is 0:
    /// a trajectory that ends at rest rests.
    ///
    /// # Panics
    /// If `out` does not hold [`Self::coordinates`] points.
    fn at(&self, time: f64, out: &mut [Point]);
}

impl<T: Trajectory + ?Sized> Trajectory for Box<T> {
    fn coordinates(&self) -> usize {
        (**self).coordinates()
    }

    fn duration(&self) -> f64 {
        (**self).duration()
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        (**self).at(time, out);
    }
}

impl<T: Trajectory + ?Sized> Trajectory for std::sync::Arc<T> {
    fn coordinates(&self) -> usize {
        (**self).coordinates()
    }

    fn duration(&self) -> f64 {
        (**self).duration()
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        (**self).at(time, out);
    }
}

/// The time within `[0, duration]`, and whether it was outside: what every trajectory holds there.
fn held(time: f64, duration: f64) -> (f64, bool) {
    let inside = time.clamp(0.0, duration);
    (inside, inside != time)
}
