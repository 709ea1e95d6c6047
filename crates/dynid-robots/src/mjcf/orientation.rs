//! Orientations as MJCF states them.

use dynid_model::{Mat3, Placement, Vec3};

use super::compiler::Compiler;
use super::fields::Fields;
use crate::robot_error::RobotFileError;

/// Least length of a direction.
const LEAST: f64 = 1e-14;

/// Unit quaternion w, x, y, z of a rotation, built around its largest entry (Shepperd 1978).
pub(super) fn quaternion(rotation: &Mat3<f64>) -> [f64; 4] {
    let m = rotation.rows();
    let trace = m[0][0] + m[1][1] + m[2][2];
    // Four times the squares of w, x, y, z.
    let [xx, yy, zz] = [0, 1, 2].map(|k| 1.0 + 2.0 * m[k][k] - trace);
    let squares = [1.0 + trace, xx, yy, zz];
    let largest = (0..4).max_by(|i, j| squares[*i].total_cmp(&squares[*j])).unwrap_or(0);
    let [x, y, z] = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
    let [xy, xz, yz] = [m[1][0] + m[0][1], m[0][2] + m[2][0], m[2][1] + m[1][2]];
    let s = squares[largest];
    let q = match largest {
        0 => [s, x, y, z],
        1 => [x, s, xy, xz],
        2 => [y, xy, s, yz],
        _ => [z, xz, yz, s],
    };
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / norm)
}

/// Rotation of a quaternion w, x, y, z of any length but zero.
pub(super) fn rotation(quat: [f64; 4]) -> Mat3<f64> {
    let norm = quat.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [w, x, y, z] = quat.map(|a| a / norm);
    Mat3::from_rows([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ])
}

/// Where an element stands in what holds it: `pos`, and an orientation in any of the ways of MJCF.
pub(super) fn placement(fields: &Fields<'_>, compiler: &Compiler<'_>) -> Result<Placement, RobotFileError> {
    Ok(Placement { rotation: orientation(fields, compiler)?, translation: fields.vector("pos")? })
}

/// The orientation of an element. A `quat` beside another way is passed over, as MuJoCo does.
pub(super) fn orientation(fields: &Fields<'_>, compiler: &Compiler<'_>) -> Result<Mat3<f64>, RobotFileError> {
    let direction = |key: &str, v: Vec3<f64>| match v.norm() {
        norm if norm > LEAST => Ok(v.scale(1.0 / norm)),
        _ => Err(fields.value(key, "a direction, not zero")),
    };
    match fields.first(&["axisangle", "xyaxes", "zaxis", "euler"]) {
        Some("axisangle") => {
            let [x, y, z, angle] = fields.numbers("axisangle")?.unwrap_or_default();
            Ok(Mat3::rotation(direction("axisangle", Vec3([x, y, z]))?, compiler.angle(angle)))
        }
        Some("xyaxes") => {
            let [a, b, c, d, e, f] = fields.numbers("xyaxes")?.unwrap_or_default();
            let x = direction("xyaxes", Vec3([a, b, c]))?;
            let y = Vec3([d, e, f]);
            let y = direction("xyaxes", y + x.scale(-x.dot(y)))?;
            let z = x.cross(y);
            Ok(Mat3([x, y, z]))
        }
        Some("zaxis") => Ok(from_z(direction("zaxis", fields.vector("zaxis")?)?)),
        Some("euler") => Ok(euler(fields.numbers("euler")?.unwrap_or_default(), compiler)),
        _ => match fields.numbers("quat")? {
            Some(quat) if quat.iter().all(|x| x.abs() < LEAST) => {
                Err(fields.value("quat", "a quaternion other than zero"))
            }
            Some(quat) => Ok(rotation(quat)),
            None => Ok(Mat3::identity()),
        },
    }
}

/// The rotation of three turns by the sequence of the model.
pub(super) fn euler(angles: [f64; 3], compiler: &Compiler<'_>) -> Mat3<f64> {
    let mut out = Mat3::identity();
    for (angle, letter) in angles.into_iter().zip(compiler.euler) {
        let axis = Vec3(match letter.to_ascii_lowercase() {
            b'x' => [1.0, 0.0, 0.0],
            b'y' => [0.0, 1.0, 0.0],
            _ => [0.0, 0.0, 1.0],
        });
        let turn = Mat3::rotation(axis, compiler.angle(angle));
        out = if letter.is_ascii_lowercase() { out.mul_mat(&turn) } else { turn.mul_mat(&out) };
    }
    out
}

/// The least rotation that takes z to a unit direction.
pub(super) fn from_z(direction: Vec3<f64>) -> Mat3<f64> {
    let axis = Vec3([0.0, 0.0, 1.0]).cross(direction);
    let sine = axis.norm();
    let axis = if sine < 1e-10 { Vec3([1.0, 0.0, 0.0]) } else { axis.scale(1.0 / sine) };
    Mat3::rotation(axis, sine.atan2(direction.0[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_and_rotations_are_inverse_also_at_half_a_turn() {
        let mut angles = vec![[0.0; 3]];
        for k in 0..200 {
            let x = f64::from(k);
            angles.push([(1.7 * x).sin() * 3.2, (2.3 * x).cos() * 1.6, (0.9 * x).sin() * 3.2]);
        }
        let half = std::f64::consts::PI;
        angles.extend([[half, 0.0, 0.0], [0.0, half, 0.0], [0.0, 0.0, half], [half, 0.5 * half, 1e-9]]);
        for rpy in angles {
            let expected = Mat3::from_rpy(rpy);
            let found = rotation(quaternion(&expected));
            let error = (found + expected * -1.0).0.iter().map(|c| c.norm()).fold(0.0, f64::max);
            assert!(error < 1e-15, "{rpy:?}: {error:e}");
        }
    }
}
