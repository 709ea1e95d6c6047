//! Quintic motion of several coordinates between given states.

use super::error::{Quantity, TrajectoryError, check, check_count};
use super::limits::ROUNDING;
use super::polynomial::Polynomial;
use super::{MotionLimits, Point, Trajectory, held};

/// One polynomial of degree 5 per coordinate with given position, velocity and acceleration at both ends: the way from
/// a parking pose into a trajectory and back.
#[derive(Debug, Clone, PartialEq)]
pub struct QuinticSegment {
    duration: f64,
    from: Vec<Point>,
    to: Vec<Point>,
    /// Per coordinate: derivatives 0 to 3 with respect to `s = t / duration`.
    derivatives: Vec<[Polynomial; 4]>,
}

/// Durations within which [`QuinticSegment::shortest`] searches, s.
const SHORTEST: f64 = 1e-3;
const LONGEST: f64 = 1e4;
/// Ratio of the durations that are tried before the bisection.
const STEP: f64 = 1.05;

impl QuinticSegment {
    /// From the states `from` to the states `to` (their jerk does not count) in `duration` seconds.
    ///
    /// Fails if the lists differ in length, the duration is not positive or a number is not finite.
    pub fn new(from: &[Point], to: &[Point], duration: f64) -> Result<Self, TrajectoryError> {
        check_count("end states of a quintic", from.len(), to.len())?;
        check("duration", duration, true)?;
        for x in from.iter().chain(to).flat_map(|p| [p.position, p.velocity, p.acceleration]) {
            check("end state", x, false)?;
        }
        let derivatives = from.iter().zip(to).map(|(from, to)| {
            let position = polynomial(from, to, duration);
            let velocity = position.derivative();
            let acceleration = velocity.derivative();
            let jerk = acceleration.derivative();
            [position, velocity, acceleration, jerk]
        });
        Ok(QuinticSegment {
            duration,
            from: from.to_vec(),
            to: to.to_vec(),
            derivatives: derivatives.collect(),
        })
    }

    /// The shortest motion between two states that keeps all limits, one per coordinate.
    ///
    /// Durations from 1 ms to 1e4 s are tried in steps of 5 % (with moving ends the limits may be kept for some durations
    /// only, since a slow motion then swings far), the first that keeps the limits is shortened by bisection to 1e-12 of
    /// itself.
    ///
    /// # Errors
    /// [`TrajectoryError::EndBeyondLimit`] if an end breaks a limit by more than 1e-9 of it,
    /// [`TrajectoryError::NoDuration`] with the least violation found, and as [`Self::new`].
    pub fn shortest(from: &[Point], to: &[Point], limits: &[MotionLimits]) -> Result<Self, TrajectoryError> {
        check_count("limits of a quintic", from.len(), limits.len())?;
        for limit in limits {
            limit.check()?;
        }
        let mut best = Self::new(from, to, SHORTEST)?;
        for ends in [from, to] {
            for (coordinate, (point, limit)) in ends.iter().zip(limits).enumerate() {
                if let Some((quantity, found)) = limit.broken_by(point) {
                    let (low, high) = limit.of(quantity);
                    return Err(TrajectoryError::EndBeyondLimit { coordinate, quantity, low, high, found });
                }
            }
        }
        let mut least = best.excess(limits);
        let mut infeasible = 0.0;
        let mut duration = SHORTEST;
        while least > ROUNDING && duration < LONGEST {
            infeasible = duration;
            duration *= STEP;
            let next = Self::new(from, to, duration)?;
            let excess = next.excess(limits);
            if excess < least {
                (best, least) = (next, excess);
            }
        }
        if least > ROUNDING {
            return Err(best.no_duration(limits));
        }
        while infeasible > 0.0 && best.duration - infeasible > 1e-12 * best.duration {
            let middle = Self::new(from, to, 0.5 * (infeasible + best.duration))?;
            if middle.excess(limits) > ROUNDING { infeasible = middle.duration } else { best = middle }
        }
        Ok(best)
    }

    /// Least and greatest value of a quantity of a coordinate over the motion.
    ///
    /// # Panics
    /// If there is no such coordinate.
    pub fn range(&self, coordinate: usize, quantity: Quantity) -> (f64, f64) {
        let order = quantity as usize;
        let (low, high) = self.derivatives[coordinate][order].range();
        let scale = self.duration.powi(order as i32);
        (low / scale, high / scale)
    }

    /// The largest violation of any limit in parts of the limit.
    fn excess(&self, limits: &[MotionLimits]) -> f64 {
        self.worst(limits).map_or(f64::NEG_INFINITY, |(excess, _, _)| excess)
    }

    fn worst(&self, limits: &[MotionLimits]) -> Option<(f64, usize, Quantity)> {
        let all = (0..limits.len()).flat_map(|c| Quantity::ALL.map(|q| (c, q)));
        all.filter(|(c, q)| limits[*c].of(*q) != (f64::NEG_INFINITY, f64::INFINITY))
            .map(|(c, q)| (limits[c].excess(q, self.range(c, q)), c, q))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn no_duration(&self, limits: &[MotionLimits]) -> TrajectoryError {
        let (_, coordinate, quantity) = self.worst(limits).unwrap_or((0.0, 0, Quantity::Position));
        let (low, high) = limits[coordinate].of(quantity);
        let (least, most) = self.range(coordinate, quantity);
        let found = if most - high > low - least { most } else { least };
        TrajectoryError::NoDuration {
            shortest: SHORTEST,
            longest: LONGEST,
            coordinate,
            quantity,
            low,
            high,
            found,
        }
    }
}

/// Position as a polynomial in `s = t / duration`.
pub(super) fn polynomial(from: &Point, to: &Point, duration: f64) -> Polynomial {
    let (v0, v1) = (from.velocity * duration, to.velocity * duration);
    let (a0, a1) = (from.acceleration * duration.powi(2), to.acceleration * duration.powi(2));
    let distance = to.position - from.position;
    Polynomial(vec![
        from.position,
        v0,
        0.5 * a0,
        10.0 * distance - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * distance + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * distance - 3.0 * (v0 + v1) - 0.5 * a0 + 0.5 * a1,
    ])
}

impl Trajectory for QuinticSegment {
    fn coordinates(&self) -> usize {
        self.derivatives.len()
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.derivatives.len(), "one point per coordinate");
        let (time, outside) = held(time, self.duration);
        let s = time / self.duration;
        for (c, (point, [q, dq, ddq, dddq])) in out.iter_mut().zip(&self.derivatives).enumerate() {
            let jerk = if outside { 0.0 } else { dddq.at(s) / self.duration.powi(3) };
            // At the ends the given states, not their rounded polynomials: a joint at rest must be exactly there.
            *point = match s {
                0.0 => Point { jerk, ..self.from[c] },
                1.0 => Point { jerk, ..self.to[c] },
                _ => Point {
                    position: q.at(s),
                    velocity: dq.at(s) / self.duration,
                    acceleration: ddq.at(s) / self.duration.powi(2),
                    jerk,
                },
            };
        }
    }
}
