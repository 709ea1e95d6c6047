//! Finite displacements: coordinates of a chart around a pose, one per rate.

use super::bend::float;
use super::mechanism::ClosedMechanism;
use dynid_algebra::spatial::Vec3;

impl ClosedMechanism {
    /// Moves positions by a displacement, one entry per rate, whether loops stay closed or not.
    ///
    /// Joints that float move by the first three entries in axes of the body before, and turn by the rotation vector of the
    /// last three; quaternions keep the length one.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn displace(&self, q: &mut [f64], displacement: &[f64]) {
        assert_eq!(q.len(), self.tree.positions, "length of q");
        assert_eq!(displacement.len(), self.tree.rates, "length of the displacement");
        for body in self.mechanism.bodies() {
            let own = &displacement[body.rate..body.rate + body.joint.rates()];
            match <&[f64; 6]>::try_from(own) {
                Ok(rates) => float(&mut q[body.position..body.position + 7], rates),
                Err(_) => q[body.position] += own[0],
            }
        }
    }

    /// Time derivative of a displacement from a fixed pose ([`ClosedMechanism::displace`]) while the coordinates have rates
    /// `dq`; rotations of less than a full turn.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn displacement_rates(&self, displacement: &[f64], dq: &[f64], out: &mut [f64]) {
        assert_eq!(displacement.len(), self.tree.rates, "length of the displacement");
        assert_eq!(dq.len(), self.tree.rates, "length of dq");
        out.copy_from_slice(dq);
        for body in self.mechanism.bodies().iter().filter(|b| b.joint.rates() == 6) {
            let of = |x: &[f64], k: usize| Vec3([x[k], x[k + 1], x[k + 2]]);
            let turn = of(displacement, body.rate + 3);
            let (velocity, omega) = (of(dq, body.rate), of(dq, body.rate + 3));
            let angle = turn.norm();
            let (first, second, third) = coefficients(angle);
            let (once, around) = (turn.cross(velocity), turn.cross(omega));
            let moved = velocity + once.scale(first) + turn.cross(once).scale(second);
            let turned = omega + around.scale(0.5) + turn.cross(around).scale(third);
            out[body.rate..body.rate + 3].copy_from_slice(&moved.0);
            out[body.rate + 3..body.rate + 6].copy_from_slice(&turned.0);
        }
    }
}

/// `sin a / a`, `(1 - cos a) / a²`, `1/a² - (1 + cos a) / (2 a sin a)`, by their series near zero.
fn coefficients(a: f64) -> (f64, f64, f64) {
    let square = a * a;
    if a < 1e-2 {
        let first = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
        let second = 0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0));
        let third = 1.0 / 12.0 + square / 720.0 * (1.0 + square / 42.0 * (1.0 + square / 40.0));
        return (first, second, third);
    }
    let (sin, cos) = a.sin_cos();
    (sin / a, (1.0 - cos) / square, 1.0 / square - (1.0 + cos) / (2.0 * a * sin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynid_algebra::spatial::Mat3;

    fn rotation(turn: Vec3<f64>) -> Mat3<f64> {
        Mat3::rotation(turn.scale(1.0 / turn.norm()), turn.norm())
    }

    #[test]
    fn series_meet_the_closed_forms() {
        let exact = coefficients(1e-2);
        let series = coefficients(1e-2 * (1.0 - 1e-12));
        for (e, s) in [(exact.0, series.0), (exact.1, series.1), (exact.2, series.2)] {
            assert!((e - s).abs() < 2e-12, "{e} {s}");
        }
    }

    /// `exp(θ + θ' dt) = exp(θ) exp(ω dt)` to first order, and velocities turn with the body.
    #[test]
    fn rates_of_rotation_vectors_are_those_of_the_rotation() {
        for scale in [1e-4, 0.3, 1.4] {
            let turn = Vec3([0.5, -0.7, 0.4]).scale(scale);
            let omega = Vec3([0.3, 1.1, -0.6]);
            let (first, second, third) = coefficients(turn.norm());
            let around = turn.cross(omega);
            let rate = omega + around.scale(0.5) + turn.cross(around).scale(third);
            let dt = 1e-5;
            for (sign, other) in [(1.0, -1.0), (-1.0, 1.0)] {
                let ahead = rotation(turn + rate.scale(sign * dt));
                let by_rates = rotation(turn).mul_mat(&rotation(omega.scale(sign * dt)));
                let back = rotation(turn + rate.scale(other * dt));
                let by_rates_back = rotation(turn).mul_mat(&rotation(omega.scale(other * dt)));
                for c in 0..3 {
                    let difference = (ahead.0[c] - back.0[c]) - (by_rates.0[c] - by_rates_back.0[c]);
                    assert!(difference.norm() < 1e-13, "{:e}", difference.norm());
                }
            }
            let once = turn.cross(omega);
            let turned = omega + once.scale(first) + turn.cross(once).scale(second);
            assert!((turned - rotation(turn).mul_vec(omega)).norm() < 1e-14);
        }
    }
}
