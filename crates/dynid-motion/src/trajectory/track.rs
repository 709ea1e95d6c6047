//! Through points without stopping: straight lines with blended corners.

use super::error::{check, check_count};
use super::{Point, Trajectory, TrajectoryError, held};

/// Paul's track: constant velocity `v_k = (P_k - P_{k-1}) / T_k` between neighbouring points, joined by blends of `blend`
/// seconds about every point in which the velocity goes from one value to the next,
///
/// ```text
/// dq = v_k + (v_{k+1} - v_k) h² (3 - 2 h),   h = (t - t_k) / blend + 1/2,   t_k = blend/2 + T_1 + .. + T_k
/// ```
///
/// from rest at the first point to rest at the last. Position, velocity and acceleration are continuous, the jerk jumps. The track
/// meets its first and last point and passes every other one at a distance of `3/32 blend (v_{k+1} - v_k)`. Velocities lie between
/// those of both lines, the acceleration peaks at `1.5 (v_{k+1} - v_k) / blend`. With two points it is a [`super::PaulBlend`].
///
/// Source: Paul 1981, chapter 5 (position there of degree 4 in time as well).
#[derive(Debug, Clone, PartialEq)]
pub struct PaulTrack {
    points: Vec<Vec<f64>>,
    /// Time of every line, s: that of point `k` is `blend/2` later than the sum before it.
    times: Vec<f64>,
    /// When the blend about each point begins, s.
    begins: Vec<f64>,
    blend: f64,
}

impl PaulTrack {
    /// Through `points` (a list of positions each, rad or m), with a time per line and one for all blends, s.
    ///
    /// # Errors
    /// With fewer than two points, points of different lengths, another number of times than lines, a time shorter than the
    /// blend (neighbouring blends would overlap), a blend that is not positive, a number that is not finite.
    pub fn new(points: Vec<Vec<f64>>, times: Vec<f64>, blend: f64) -> Result<Self, TrajectoryError> {
        check("blend", blend, true)?;
        if points.len() < 2 {
            let found = points.len() as f64;
            return Err(TrajectoryError::Value { name: "points", expected: "at least 2", found });
        }
        if points[0].is_empty() {
            return Err(TrajectoryError::Value { name: "coordinates", expected: "at least 1", found: 0.0 });
        }
        check_count("times of a track", points.len() - 1, times.len())?;
        for point in &points {
            check_count("coordinates of a point", points[0].len(), point.len())?;
            point.iter().try_for_each(|q| check("point", *q, false))?;
        }
        // Times of whole samples may miss the blend by rounding.
        if let Some(found) = times.iter().copied().find(|t| !(t.is_finite() && *t >= blend * (1.0 - 1e-12))) {
            let expected = "a finite number not below the blend";
            return Err(TrajectoryError::Value { name: "time of a line", expected, found });
        }
        let mut begins = vec![0.0];
        for time in &times {
            begins.push(begins[begins.len() - 1] + time);
        }
        Ok(PaulTrack { points, times, begins, blend })
    }

    /// Shortest times of the lines that keep `speeds` (one per coordinate, positive) and leave room for the blends, s.
    ///
    /// # Errors
    /// If numbers of coordinates differ or a speed is not positive.
    pub fn times(points: &[Vec<f64>], speeds: &[f64], blend: f64) -> Result<Vec<f64>, TrajectoryError> {
        let positive = |v: &f64| match *v > 0.0 {
            true => Ok(()),
            false => Err(TrajectoryError::Value { name: "speed", expected: "a positive number", found: *v }),
        };
        speeds.iter().try_for_each(positive)?;
        for point in points {
            check_count("coordinates of a point", speeds.len(), point.len())?;
        }
        let time = |from: &[f64], to: &[f64]| {
            let each = from.iter().zip(to).zip(speeds).map(|((a, b), v)| (b - a).abs() / v);
            each.fold(blend, f64::max)
        };
        Ok(points.windows(2).map(|w| time(&w[0], &w[1])).collect())
    }

    /// Velocity of the line before point `k`, zero before the first and behind the last.
    fn velocity(&self, k: usize, coordinate: usize) -> f64 {
        if k == 0 || k == self.points.len() {
            return 0.0;
        }
        (self.points[k][coordinate] - self.points[k - 1][coordinate]) / self.times[k - 1]
    }
}

impl Trajectory for PaulTrack {
    fn coordinates(&self) -> usize {
        self.points[0].len()
    }

    fn duration(&self) -> f64 {
        self.begins[self.begins.len() - 1] + self.blend
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.coordinates(), "one point per coordinate");
        let (time, outside) = held(time, self.duration());
        let k = self.begins.partition_point(|t| *t <= time) - 1;
        let h = ((time - self.begins[k]) / self.blend).max(0.0);
        for (coordinate, point) in out.iter_mut().enumerate() {
            let (before, after) = (self.velocity(k, coordinate), self.velocity(k + 1, coordinate));
            let corner = self.points[k][coordinate];
            let change = after - before;
            *point = if h >= 1.0 {
                let position = corner + after * (h - 0.5) * self.blend;
                Point { position, velocity: after, ..Point::default() }
            } else {
                Point {
                    position: corner
                        + self.blend * (before * (h - 0.5) + change * h.powi(3) * (1.0 - 0.5 * h)),
                    velocity: before + change * h * h * (3.0 - 2.0 * h),
                    acceleration: 6.0 * change * h * (1.0 - h) / self.blend,
                    jerk: 6.0 * change * (1.0 - 2.0 * h) / self.blend.powi(2),
                }
            };
            // At the last point exactly there, not a rounding beside it.
            if k + 1 == self.points.len() && h >= 1.0 {
                *point = Point::rest(corner);
            }
            if outside {
                point.jerk = 0.0;
            }
        }
    }
}
