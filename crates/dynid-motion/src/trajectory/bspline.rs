//! Clamped B-splines.

use super::error::{check, check_count};
use super::{Point, Trajectory, TrajectoryError, held};

/// Clamped B-spline over equally spaced knots, one curve per coordinate (de Boor 1978).
///
/// It starts and ends at its first and last control point, stays within the least and greatest of them, and has `degree - 1`
/// continuous derivatives. All derivatives are exact: those of a B-spline are B-splines of lower degree.
#[derive(Debug, Clone, PartialEq)]
pub struct BSpline {
    duration: f64,
    degree: usize,
    /// Interior knots divide the time into that many spans.
    spans: usize,
    /// Per coordinate: control points of derivatives 0 to 3.
    control: Vec<[Vec<f64>; 4]>,
}

impl BSpline {
    /// Curves of a degree of 3 or more through time 0 to `duration`, s; `control`: per coordinate the same number of control
    /// points, at least `degree + 1`, rad or m.
    ///
    /// Fails if the degree is below 3 or above 20, the numbers of control points differ or are too few, the duration is not
    /// positive or a number is not finite.
    pub fn new(degree: usize, duration: f64, control: &[Vec<f64>]) -> Result<Self, TrajectoryError> {
        check("duration", duration, true)?;
        if !(3..=20).contains(&degree) {
            let found = degree as f64;
            return Err(TrajectoryError::Value { name: "degree", expected: "3 to 20", found });
        }
        let Some(first) = control.first() else {
            return Err(TrajectoryError::Value { name: "coordinates", expected: "at least 1", found: 0.0 });
        };
        let Some(spans) = first.len().checked_sub(degree).filter(|spans| *spans > 0) else {
            let (name, expected) = ("control points", "more than the degree");
            return Err(TrajectoryError::Value { name, expected, found: first.len() as f64 });
        };
        let mut curves = Vec::with_capacity(control.len());
        for points in control {
            check_count("control points", first.len(), points.len())?;
            for x in points {
                check("control point", *x, false)?;
            }
            let derive = |points: &[f64], order: usize| derivative(points, degree - order, spans, duration);
            let velocity = derive(points, 0);
            let acceleration = derive(&velocity, 1);
            let jerk = derive(&acceleration, 2);
            curves.push([points.clone(), velocity, acceleration, jerk]);
        }
        Ok(BSpline { duration, degree, spans, control: curves })
    }

    /// A spline from rest to rest: the first and the last control point count three times, so that velocity and acceleration
    /// vanish at both ends. `control`: per coordinate at least two points.
    ///
    /// Fails as [`Self::new`].
    pub fn resting(degree: usize, duration: f64, control: &[Vec<f64>]) -> Result<Self, TrajectoryError> {
        let repeated: Vec<Vec<f64>> = control
            .iter()
            .map(|points| match (points.first(), points.last()) {
                (Some(first), Some(last)) => [&[*first, *first], points.as_slice(), &[*last, *last]].concat(),
                _ => Vec::new(),
            })
            .collect();
        Self::new(degree, duration, &repeated)
    }

    /// Degree of the position curves.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Value of a curve of this degree at `time` by de Boor's algorithm.
    fn value(&self, points: &[f64], degree: usize, time: f64) -> f64 {
        let knot = |i: usize| knot(i, degree, self.spans, self.duration);
        // Rounding may put the last instants beyond the last span or a time before its knot.
        let span = ((time / self.duration * self.spans as f64) as usize).min(self.spans - 1);
        let mut d = [0.0; 21];
        d[..=degree].copy_from_slice(&points[span..=span + degree]);
        for r in 1..=degree {
            for j in (r..=degree).rev() {
                let left = knot(span + j);
                let share = (time - left) / (knot(span + j + degree + 1 - r) - left);
                d[j] = (1.0 - share) * d[j - 1] + share * d[j];
            }
        }
        d[degree]
    }
}

/// Knot `i` of a clamped curve.
fn knot(i: usize, degree: usize, spans: usize, duration: f64) -> f64 {
    duration * (i.saturating_sub(degree).min(spans) as f64 / spans as f64)
}

/// Control points of the derivative of a curve.
fn derivative(points: &[f64], degree: usize, spans: usize, duration: f64) -> Vec<f64> {
    let knot = |i: usize| knot(i, degree, spans, duration);
    let differences = points.windows(2).enumerate();
    differences.map(|(i, w)| degree as f64 * (w[1] - w[0]) / (knot(i + degree + 1) - knot(i + 1))).collect()
}

impl Trajectory for BSpline {
    fn coordinates(&self) -> usize {
        self.control.len()
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.control.len(), "one point per coordinate");
        let (time, outside) = held(time, self.duration);
        for (point, curves) in out.iter_mut().zip(&self.control) {
            let value = |order: usize| self.value(&curves[order], self.degree - order, time);
            *point = Point {
                position: value(0),
                velocity: value(1),
                acceleration: value(2),
                jerk: if outside { 0.0 } else { value(3) },
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(curve: &BSpline, time: f64) -> Point {
        let mut out = [Point::default()];
        curve.at(time, &mut out);
        out[0]
    }

    /// With one span a clamped B-spline is a Bézier curve: `sum_k binomial(3, k) (1-s)^(3-k) s^k P_k`.
    #[test]
    fn one_span_is_a_bezier_curve() {
        let p = [0.3, -1.0, 2.0, 0.7];
        let curve = BSpline::new(3, 2.0, &[p.to_vec()]).unwrap();
        for k in 0..=20 {
            let s = f64::from(k) / 20.0;
            let r = 1.0 - s;
            let found = at(&curve, 2.0 * s);
            let position =
                r * r * r * p[0] + 3.0 * r * r * s * p[1] + 3.0 * r * s * s * p[2] + s * s * s * p[3];
            let d = [p[1] - p[0], p[2] - p[1], p[3] - p[2]];
            let velocity = 3.0 * (r * r * d[0] + 2.0 * r * s * d[1] + s * s * d[2]) / 2.0;
            let acceleration = 6.0 * (r * (d[1] - d[0]) + s * (d[2] - d[1])) / 4.0;
            let jerk = 6.0 * (d[2] - 2.0 * d[1] + d[0]) / 8.0;
            assert!((found.position - position).abs() < 1e-14);
            assert!((found.velocity - velocity).abs() < 1e-14);
            assert!((found.acceleration - acceleration).abs() < 1e-13);
            assert!((found.jerk - jerk).abs() < 1e-13);
        }
    }

    #[test]
    fn too_few_points_and_low_degrees_are_refused() {
        assert!(BSpline::new(2, 1.0, &[vec![0.0; 5]]).is_err());
        assert!(BSpline::new(3, 1.0, &[vec![0.0; 3]]).is_err());
        assert!(BSpline::new(3, 1.0, &[vec![0.0; 4], vec![0.0; 5]]).is_err());
        assert!(BSpline::new(3, 1.0, &[]).is_err());
        assert!(BSpline::new(3, 0.0, &[vec![0.0; 4]]).is_err());
        assert!(BSpline::resting(3, 1.0, &[vec![]]).is_err());
        assert!(BSpline::new(4, 1.0, &[vec![0.0, f64::NAN, 0.0, 0.0, 0.0]]).is_err());
    }
}
