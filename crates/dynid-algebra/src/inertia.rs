//! Standard inertial parameters of a rigid body.

use crate::spatial::{Mat3, Placement, Vec3};
use crate::symmetric::{self, Square};

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
    /// `I = I_c + m ((c·c) 1 - c cᵀ)`, `h = m c`.
    pub fn from_com(mass: f64, com: Vec3<f64>, about_com: &Mat3<f64>) -> Self {
        let tensor = *about_com + (Mat3::identity() * com.dot(com) + Mat3::outer(com, com) * -1.0) * mass;
        Inertia::from_parts(mass, com.scale(mass), &tensor)
    }

    /// From mass (kg), first moment (kg m) and the tensor about the frame origin (kg m²).
    #[inline]
    pub fn from_parts(mass: f64, moment: Vec3<f64>, tensor: &Mat3<f64>) -> Self {
        let h = moment.0;
        let i = tensor.rows();
        Inertia([mass, h[0], h[1], h[2], i[0][0], i[0][1], i[0][2], i[1][1], i[1][2], i[2][2]])
    }

    /// Mass, kg.
    #[inline]
    pub fn mass(&self) -> f64 {
        self.0[0]
    }

    /// First moment `m c`, kg m.
    #[inline]
    pub fn first_moment(&self) -> Vec3<f64> {
        Vec3([self.0[1], self.0[2], self.0[3]])
    }

    /// Inertia tensor about the frame origin, kg m².
    #[inline]
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

    /// Returns the inertia of the body described in an outer frame in which this one sits at `placement`.
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
    #[inline]
    pub fn plus(&self, other: &Inertia) -> Self {
        let mut sum = self.0;
        for (s, o) in sum.iter_mut().zip(other.0) {
            *s += o;
        }
        Inertia(sum)
    }

    /// Pseudo-inertia `P = [[Σ, h], [hᵀ, m]]` with `Σ = ½ tr(I) 1 - I` (the second moments of mass), kg m², kg m, kg.
    ///
    /// Positive semidefinite exactly if some mass distribution has these parameters; a bijection between ten parameters
    /// and symmetric 4 × 4 matrices (Wensing, Kim & Slotine 2018, eq. 19).
    pub fn pseudo_inertia(&self) -> Square<4> {
        let [m, x, y, z, xx, xy, xz, yy, yz, zz] = self.0;
        [
            [0.5 * (yy + zz - xx), -xy, -xz, x],
            [-xy, 0.5 * (xx + zz - yy), -yz, y],
            [-xz, -yz, 0.5 * (xx + yy - zz), z],
            [x, y, z, m],
        ]
    }

    /// The parameters with this pseudo-inertia: `Ixx = Σ22 + Σ33, …, Ixy = -Σ12`.
    pub fn from_pseudo_inertia(p: &Square<4>) -> Self {
        let s = p;
        Inertia([
            s[3][3],
            s[0][3],
            s[1][3],
            s[2][3],
            s[1][1] + s[2][2],
            -s[0][1],
            -s[0][2],
            s[0][0] + s[2][2],
            -s[1][2],
            s[0][0] + s[1][1],
        ])
    }

    /// Spatial inertia `B = [[I, S(h)ᵀ], [S(h), m 1]]` about the frame origin, `S` the cross-product matrix.
    ///
    /// Positive definite exactly if the mass and the tensor about the centre of mass are; weaker than the pseudo-inertia,
    /// which demands the triangle inequality as well (Sousa & Cortesão 2014).
    pub fn spatial_inertia(&self) -> Square<6> {
        let [m, x, y, z, xx, xy, xz, yy, yz, zz] = self.0;
        [
            [xx, xy, xz, 0.0, z, -y],
            [xy, yy, yz, -z, 0.0, x],
            [xz, yz, zz, y, -x, 0.0],
            [0.0, -z, y, m, 0.0, 0.0],
            [z, 0.0, -x, 0.0, m, 0.0],
            [-y, x, 0.0, 0.0, 0.0, m],
        ]
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
        let ([a, b, c], _) = symmetric::eigen(&about_com.rows());
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
