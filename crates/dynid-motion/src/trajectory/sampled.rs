//! Trajectories on a grid of times.

use super::error::check;
use super::{Point, Trajectory, TrajectoryError};

/// Most samples of one trajectory.
const MOST_SAMPLES: f64 = 1e8;

/// A trajectory at given times. Sample `s` of coordinate `c` is entry `c * samples + s` of each array.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// Times, s.
    pub time: Vec<f64>,
    /// Positions, coordinate after coordinate.
    pub q: Vec<f64>,
    /// Velocities, likewise.
    pub dq: Vec<f64>,
    /// Accelerations, likewise.
    pub ddq: Vec<f64>,
}

impl Sampled {
    /// The trajectory at `time`, s.
    pub fn at_times(trajectory: &dyn Trajectory, time: Vec<f64>) -> Self {
        let (n, samples) = (trajectory.coordinates(), time.len());
        let [mut q, mut dq, mut ddq] =
            [vec![0.0; n * samples], vec![0.0; n * samples], vec![0.0; n * samples]];
        let mut points = vec![Point::default(); n];
        for (s, t) in time.iter().enumerate() {
            trajectory.at(*t, &mut points);
            for (c, point) in points.iter().enumerate() {
                q[c * samples + s] = point.position;
                dq[c * samples + s] = point.velocity;
                ddq[c * samples + s] = point.acceleration;
            }
        }
        Sampled { time, q, dq, ddq }
    }

    /// The trajectory at `k / rate_hz` from 0 up to its duration, the end included if it lies on the grid.
    ///
    /// # Errors
    /// If the rate is not positive or there would be more than 1e8 samples.
    pub fn at_rate(trajectory: &dyn Trajectory, rate_hz: f64) -> Result<Self, TrajectoryError> {
        check("sample rate", rate_hz, true)?;
        // The end may miss the grid by rounding.
        let last = (trajectory.duration() * rate_hz * (1.0 + 1e-12) + 1e-9).floor();
        if last >= MOST_SAMPLES {
            return Err(TrajectoryError::Value {
                name: "sample rate",
                expected: "at most 1e8 samples of the whole motion",
                found: rate_hz,
            });
        }
        Ok(Self::at_times(trajectory, (0..=last as usize).map(|k| k as f64 / rate_hz).collect()))
    }

    /// Number of samples, the distance of neighbouring coordinates in the arrays.
    pub fn samples(&self) -> usize {
        self.time.len()
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        if self.time.is_empty() { 0 } else { self.q.len() / self.time.len() }
    }
}
