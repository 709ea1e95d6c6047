//! Orientations as MJCF states them.

use dynid_model::Mat3;

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
