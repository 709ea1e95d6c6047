//! Centre of mass and inertia about it as functions of ten standard parameters, with their covariance.

use dynid_linalg::Mat;
use dynid_model::Inertia;

/// Mass, centre of mass and inertia about it: `m, cx, cy, cz, Jxx, Jxy, Jxz, Jyy, Jyz, Jzz`, with `c = h/m` and
/// `J = I - (h·h 1 - h hᵀ)/m`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Body {
    pub(super) values: [f64; 10],
    pub(super) std: [f64; 10],
}

/// Names and units of these.
pub(super) const NAMES: [(&str, &str); 10] = [
    ("m", "kg"),
    ("cx", "m"),
    ("cy", "m"),
    ("cz", "m"),
    ("Jxx", "kg m²"),
    ("Jxy", "kg m²"),
    ("Jxz", "kg m²"),
    ("Jyy", "kg m²"),
    ("Jyz", "kg m²"),
    ("Jzz", "kg m²"),
];

/// Rows and columns of the six entries of a tensor.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Body {
    /// From parameters about the joint frame and their `10 × 10` covariance, to first order. Entries are not finite for a
    /// mass of zero.
    pub(super) fn new(inertia: &Inertia, covariance: &Mat) -> Self {
        let derivatives = jacobian(inertia);
        let std = std::array::from_fn(|k| {
            let d = &derivatives[k];
            let variance: f64 =
                (0..10).flat_map(|i| (0..10).map(move |j| d[i] * covariance[(i, j)] * d[j])).sum();
            variance.max(0.0).sqrt()
        });
        Body { values: about_com(inertia), std }
    }
}

pub(super) fn about_com(inertia: &Inertia) -> [f64; 10] {
    let phi = inertia.0;
    let (m, h) = (phi[0], [phi[1], phi[2], phi[3]]);
    let square: f64 = h.iter().map(|x| x * x).sum();
    let mut out = [m, h[0] / m, h[1] / m, h[2] / m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        let diagonal = if i == j { square } else { 0.0 };
        out[4 + k] = phi[4 + k] - (diagonal - h[i] * h[j]) / m;
    }
    out
}

/// Derivatives of [`about_com`] by the ten parameters, one row per value.
fn jacobian(inertia: &Inertia) -> [[f64; 10]; 10] {
    let phi = inertia.0;
    let (m, h) = (phi[0], [phi[1], phi[2], phi[3]]);
    let square: f64 = h.iter().map(|x| x * x).sum();
    let mut out = [[0.0; 10]; 10];
    out[0][0] = 1.0;
    for c in 0..3 {
        out[1 + c][0] = -h[c] / (m * m);
        out[1 + c][1 + c] = 1.0 / m;
    }
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        let row = &mut out[4 + k];
        let diagonal = if i == j { 1.0 } else { 0.0 };
        row[4 + k] = 1.0;
        row[0] = (diagonal * square - h[i] * h[j]) / (m * m);
        for (c, at) in h.iter().enumerate() {
            row[1 + c] -= 2.0 * diagonal * at / m;
        }
        row[1 + i] += h[j] / m;
        row[1 + j] += h[i] / m;
    }
    out
}

/// A URDF link with the inertia of a payload and the fixed joint to the link that carries it. `values`: mass, centre of mass,
/// inertia about it.
pub(super) fn urdf(name: &str, link: &str, values: &[f64; 10]) -> String {
    let [m, x, y, z, xx, xy, xz, yy, yz, zz] = values;
    let [name, link] = [name, link].map(escaped);
    format!(
        "<link name=\"{name}\">\n  <inertial>\n    <origin xyz=\"{x} {y} {z}\" rpy=\"0 0 0\"/>\n    <mass value=\"{m}\"/>\n    \
         <inertia ixx=\"{xx}\" ixy=\"{xy}\" ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\"/>\n  </inertial>\n</link>\n\
         <joint name=\"{link}_to_{name}\" type=\"fixed\">\n  <parent link=\"{link}\"/>\n  <child link=\"{name}\"/>\n  \
         <origin xyz=\"0 0 0\" rpy=\"0 0 0\"/>\n</joint>\n"
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynid_model::{Mat3, Vec3};

    fn example() -> Inertia {
        let about = Mat3::from_rows([[0.02, 0.001, -0.002], [0.001, 0.03, 0.003], [-0.002, 0.003, 0.025]]);
        Inertia::from_com(2.5, Vec3([0.03, -0.05, 0.11]), &about)
    }

    #[test]
    fn the_body_is_that_which_the_parameters_were_made_of() {
        let expected = [2.5, 0.03, -0.05, 0.11, 0.02, 0.001, -0.002, 0.03, 0.003, 0.025];
        for (found, expected) in about_com(&example()).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        let derivatives = jacobian(&example());
        let h = 1e-6;
        for j in 0..10 {
            let at = |step: f64| {
                let mut phi = example();
                phi.0[j] += step;
                about_com(&phi)
            };
            let differences = at(h).into_iter().zip(at(-h)).map(|(up, down)| (up - down) / (2.0 * h));
            for (row, difference) in derivatives.iter().zip(differences) {
                assert!((row[j] - difference).abs() < 1e-9, "{j}: {row:?}");
            }
        }
    }
}
