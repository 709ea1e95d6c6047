//! A circle in a plane.

use super::error::check;
use super::{Point, Profile, Trajectory, TrajectoryError, held};

/// Two coordinates on a circle, `centre + radius (cos θ, sin θ)`, with the angle along a profile, rad.
#[derive(Debug, Clone, PartialEq)]
pub struct Circle<P> {
    centre: [f64; 2],
    radius: f64,
    angle: P,
}

impl<P: Profile> Circle<P> {
    /// A circle about `centre`, m.
    ///
    /// # Errors
    /// If the radius is not positive or a number is not finite.
    pub fn new(centre: [f64; 2], radius: f64, angle: P) -> Result<Self, TrajectoryError> {
        check("radius", radius, true)?;
        centre.iter().try_for_each(|x| check("centre", *x, false))?;
        Ok(Circle { centre, radius, angle })
    }

    /// Profile of the angle.
    pub fn angle(&self) -> &P {
        &self.angle
    }
}

impl<P: Profile> Trajectory for Circle<P> {
    fn coordinates(&self) -> usize {
        2
    }

    fn duration(&self) -> f64 {
        self.angle.duration()
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), 2, "one point per coordinate");
        let (time, outside) = held(time, self.duration());
        let at = self.angle.at(time);
        let ((sine, cosine), r) = (at.position.sin_cos(), self.radius);
        for (k, [along, across]) in [[cosine, -sine], [sine, cosine]].into_iter().enumerate() {
            let jerk = r
                * (at.jerk * across
                    - 3.0 * at.velocity * at.acceleration * along
                    - at.velocity.powi(3) * across);
            out[k] = Point {
                position: self.centre[k] + r * along,
                velocity: r * at.velocity * across,
                acceleration: r * (at.acceleration * across - at.velocity * at.velocity * along),
                jerk: if outside { 0.0 } else { jerk },
            };
        }
    }
}
