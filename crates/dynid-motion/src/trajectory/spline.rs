//! What a table of samples says between its rows.

use super::error::{Quantity, check};
use super::polynomial::Polynomial;
use super::quintic_segment::polynomial;
use super::{Point, Sampled, Trajectory, TrajectoryError, held};

/// Polynomials of degree 5 through given positions, velocities and accelerations, one per coordinate and interval: position,
/// velocity and acceleration are continuous.
///
/// Motions whose polynomials of degree 5 at most meet at the samples come back as they were ([`super::PaulBlend`],
/// [`super::QuinticSegment`] with durations of whole samples); of others with `n` derivatives the error falls with the sixth
/// power of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct QuinticSpline {
    knots: Sampled,
}

impl QuinticSpline {
    /// Through samples. Their times are shifted so that the first is 0.
    ///
    /// # Errors
    /// With fewer than two samples, without coordinates, with times that do not ascend, numbers that are not finite.
    pub fn new(mut knots: Sampled) -> Result<Self, TrajectoryError> {
        let n = knots.samples();
        if n < 2 {
            let found = n as f64;
            return Err(TrajectoryError::Value { name: "samples", expected: "at least 2", found });
        }
        if knots.coordinates() == 0 {
            return Err(TrajectoryError::Value { name: "coordinates", expected: "at least 1", found: 0.0 });
        }
        for (name, signal) in [
            ("time", &knots.time),
            ("position", &knots.q),
            ("velocity", &knots.dq),
            ("acceleration", &knots.ddq),
        ] {
            signal.iter().try_for_each(|x| check(name, *x, false))?;
        }
        if let Some(k) = (1..n).find(|k| knots.time[*k] <= knots.time[k - 1]) {
            let found = knots.time[k];
            return Err(TrajectoryError::Value { name: "time", expected: "more than that before", found });
        }
        let start = knots.time[0];
        knots.time.iter_mut().for_each(|t| *t -= start);
        Ok(QuinticSpline { knots })
    }

    /// The samples.
    pub fn knots(&self) -> &Sampled {
        &self.knots
    }

    fn knot(&self, coordinate: usize, sample: usize) -> Point {
        let at = coordinate * self.knots.samples() + sample;
        let Sampled { q, dq, ddq, .. } = &self.knots;
        Point { position: q[at], velocity: dq[at], acceleration: ddq[at], jerk: 0.0 }
    }

    /// Derivatives 0 to 3 of a coordinate by `s`, the part of the interval that begins with a sample, and its duration.
    fn piece(&self, coordinate: usize, sample: usize) -> ([Polynomial; 4], f64) {
        let step = self.knots.time[sample + 1] - self.knots.time[sample];
        let (from, to) = (self.knot(coordinate, sample), self.knot(coordinate, sample + 1));
        let position = polynomial(&from, &to, step);
        let velocity = position.derivative();
        let acceleration = velocity.derivative();
        let jerk = acceleration.derivative();
        ([position, velocity, acceleration, jerk], step)
    }

    /// Least and greatest value of a quantity of a coordinate over the whole motion, between samples too.
    ///
    /// # Panics
    /// If there is no such coordinate.
    pub fn range(&self, coordinate: usize, quantity: Quantity) -> (f64, f64) {
        let order = quantity as usize;
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for sample in 0..self.knots.samples() - 1 {
            let (derivatives, step) = self.piece(coordinate, sample);
            let scale = step.powi(order as i32);
            let (low, high) = derivatives[order].hull();
            // Roots are sought only where the polynomial may reach farther than those before.
            if low / scale < least || high / scale > most {
                let (low, high) = derivatives[order].range();
                (least, most) = (least.min(low / scale), most.max(high / scale));
            }
        }
        (least, most)
    }
}

impl Trajectory for QuinticSpline {
    fn coordinates(&self) -> usize {
        self.knots.coordinates()
    }

    fn duration(&self) -> f64 {
        self.knots.time[self.knots.samples() - 1]
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.coordinates(), "one point per coordinate");
        let (time, outside) = held(time, self.duration());
        let after = self.knots.time.partition_point(|t| *t <= time);
        let sample = (after - 1).min(self.knots.samples() - 2);
        for (coordinate, point) in out.iter_mut().enumerate() {
            let ([q, dq, ddq, dddq], step) = self.piece(coordinate, sample);
            let s = (time - self.knots.time[sample]) / step;
            let jerk = if outside { 0.0 } else { dddq.at(s) / step.powi(3) };
            // At samples these, not their rounded polynomials: a joint at rest must be exactly there.
            *point = match s {
                0.0 => Point { jerk, ..self.knot(coordinate, sample) },
                1.0 => Point { jerk, ..self.knot(coordinate, sample + 1) },
                _ => Point {
                    position: q.at(s),
                    velocity: dq.at(s) / step,
                    acceleration: ddq.at(s) / step.powi(2),
                    jerk,
                },
            };
        }
    }
}
