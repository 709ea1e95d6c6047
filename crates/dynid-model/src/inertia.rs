//! Standard inertial parameters of a rigid body.

use crate::spatial::{Mat3, Placement, Vec3};

/// Number of standard inertial parameters of one body.
pub const PARAMETERS_PER_BODY: usize = 10;

/// Names of the standard parameters in the order used everywhere:
/// mass, first moments, entries of the inertia tensor about the frame origin.
pub const PARAMETER_NAMES: [&str; PARAMETERS_PER_BODY] =
    ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];

/// Units of the standard parameters.
pub const PARAMETER_UNITS: [&str; PARAMETERS_PER_BODY] =
    ["kg", "kg m", "kg m", "kg m", "kg m²", "kg m²", "kg m²", "kg m²", "kg m²", "kg m²"];

/// The ten standard parameters `φ` of a body about the origin of a frame, in the axes of that frame.
///
/// Order: `m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz` (kg, kg m, kg m²). `(mx, my, mz) = m c` with the centre of
/// mass `c`. Off-diagonals are entries of the tensor: `Ixy = -∫ x y dm`. Values need not be physical: public robot
/// files and estimates contain impossible bodies, so this type promises nothing but finite numbers.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Inertia(pub [f64; PARAMETERS_PER_BODY]);

impl Inertia {
    /// From mass (kg), centre of mass (m) and the inertia tensor about the centre of mass (kg m²), all in frame axes.
    ///
    /// `I = I_c + m ((c·c) 1 - c cᵀ)`, `h = m c` (spec/mechanisms.md section 3).
    pub fn from_com(mass: f64, com: Vec3<f64>, about_com: &Mat3<f64>) -> Self {
        let tensor = *about_com + (Mat3::identity() * com.dot(com) + Mat3::outer(com, com) * -1.0) * mass;
        Inertia::from_parts(mass, com.scale(mass), &tensor)
    }

    /// From mass (kg), first moment (kg m) and the tensor about the frame origin (kg m²).
    pub fn from_parts(mass: f64, moment: Vec3<f64>, tensor: &Mat3<f64>) -> Self {
        let h = moment.0;
        let i = tensor.rows();
        Inertia([mass, h[0], h[1], h[2], i[0][0], i[0][1], i[0][2], i[1][1], i[1][2], i[2][2]])
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.0[0]
    }

    /// First moment `m c`, kg m.
    pub fn first_moment(&self) -> Vec3<f64> {
        Vec3([self.0[1], self.0[2], self.0[3]])
    }

    /// Inertia tensor about the frame origin, kg m².
    pub fn tensor(&self) -> Mat3<f64> {
        let p = &self.0;
        Mat3::from_rows([[p[4], p[5], p[6]], [p[5], p[7], p[8]], [p[6], p[8], p[9]]])
    }

    /// Centre of mass, m, and tensor about it, kg m². `None` if the mass is zero.
    pub fn about_com(&self) -> Option<(Vec3<f64>, Mat3<f64>)> {
        let m = self.mass();
        if m == 0.0 {
            return None;
        }
        let c = self.first_moment().scale(1.0 / m);
        let shift = (Mat3::identity() * c.dot(c) + Mat3::outer(c, c) * -1.0) * m;
        Some((c, self.tensor() + shift * -1.0))
    }

    /// The same body described in an outer frame in which this one sits at `placement`.
    ///
    /// `m' = m`, `h' = R h + m p`, `I' = R I Rᵀ + 2 (h_R·p) 1 - h_R pᵀ - p h_Rᵀ + m ((p·p) 1 - p pᵀ)`, `h_R = R h`.
    pub fn in_frame(&self, placement: &Placement) -> Self {
        let (r, p, m) = (&placement.rotation, placement.translation, self.mass());
        let h = r.mul_vec(self.first_moment());
        let tensor = r.mul_mat(&self.tensor()).mul_mat(&r.transpose())
            + Mat3::identity() * (2.0 * h.dot(p) + m * p.dot(p))
            + Mat3::outer(h, p) * -1.0
            + Mat3::outer(p, h) * -1.0
            + Mat3::outer(p, p) * -m;
        Inertia::from_parts(m, h + p.scale(m), &tensor)
    }

    /// Two bodies welded together, both described in the same frame.
    pub fn plus(&self, other: &Inertia) -> Self {
        let mut sum = self.0;
        for (s, o) in sum.iter_mut().zip(other.0) {
            *s += o;
        }
        Inertia(sum)
    }

    /// Why no mass distribution could have these parameters, or `None` if one could.
    ///
    /// Checks mass > 0 and that the 4 × 4 pseudo-inertia `[[½ tr(I) 1 - I, h], [hᵀ, m]]` is positive semidefinite up to
    /// `1e-9` of its scale (Wensing, Kim & Slotine 2018): equivalently, that the principal moments about the centre of
    /// mass are non-negative and satisfy the triangle inequality.
    pub fn physical_fault(&self) -> Option<&'static str> {
        if self.0.iter().all(|x| *x == 0.0) {
            return Some("has no mass");
        }
        let Some((_, about_com)) = self.about_com() else { return Some("has inertia but no mass") };
        if self.mass() < 0.0 {
            return Some("has a negative mass");
        }
        let scale = self.tensor().0.iter().map(|c| c.norm()).fold(0.0, f64::max);
        let moments = symmetric_eigenvalues(&about_com);
        let [a, b, c] = moments;
        let margin = -1e-9 * scale.max(f64::MIN_POSITIVE);
        if a.min(b).min(c) < margin {
            Some("has a negative principal moment of inertia")
        } else if (a + b - c).min(b + c - a).min(c + a - b) < margin {
            Some("has principal moments that violate the triangle inequality")
        } else {
            None
        }
    }
}

/// Eigenvalues of a symmetric 3 × 3 matrix by Jacobi rotations.
fn symmetric_eigenvalues(matrix: &Mat3<f64>) -> [f64; 3] {
    let mut a = matrix.rows();
    for _ in 0..32 {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off <= f64::MIN_POSITIVE {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let t = if theta == 0.0 { 1.0 } else { t };
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for row in &mut a {
                let (x, y) = (row[p], row[q]);
                row[p] = c * x - s * y;
                row[q] = s * x + c * y;
            }
            let (x, y) = (a[p], a[q]);
            a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
            a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
        }
    }
    [a[0][0], a[1][1], a[2][2]]
}
