//! Three-dimensional vectors and matrices over a [`Scalar`].

use std::ops::{Add, Mul, Neg, Sub};

use crate::scalar::Scalar;

/// A vector with three components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<S>(pub [S; 3]);

impl<S: Scalar> Vec3<S> {
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Vec3([S::zero(); 3])
    }

    /// A constant vector.
    #[inline(always)]
    pub fn constant(v: [f64; 3]) -> Self {
        Vec3([S::from_f64(v[0]), S::from_f64(v[1]), S::from_f64(v[2])])
    }

    /// Inner product `self · other`.
    #[inline(always)]
    pub fn dot(self, other: Self) -> S {
        self.0[0].mul_add(other.0[0], self.0[1].mul_add(other.0[1], self.0[2] * other.0[2]))
    }

    /// Vector product `self × other`.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        let [a, b, c] = self.0;
        let [x, y, z] = other.0;
        Vec3([b.mul_sub(z, c * y), c.mul_sub(x, a * z), a.mul_sub(y, b * x)])
    }

    /// `self * factor`.
    #[inline(always)]
    pub fn scale(self, factor: S) -> Self {
        Vec3(self.0.map(|x| x * factor))
    }

    /// `self * factor + other`.
    #[inline(always)]
    pub fn scale_add(self, factor: S, other: Self) -> Self {
        let [a, b, c] = self.0;
        Vec3([a.mul_add(factor, other.0[0]), b.mul_add(factor, other.0[1]), c.mul_add(factor, other.0[2])])
    }
}

impl Vec3<f64> {
    /// Euclidean length.
    #[inline]
    pub fn norm(self) -> f64 {
        self.dot(self).sqrt()
    }
}

impl<S: Scalar> Add for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Vec3([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<S: Scalar> Sub for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Vec3([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<S: Scalar> Neg for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3(self.0.map(|x| -x))
    }
}

/// A 3 × 3 matrix, stored by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<S>(pub [Vec3<S>; 3]);

impl<S: Scalar> Mat3<S> {
    /// The identity matrix.
    #[inline(always)]
    pub fn identity() -> Self {
        let (o, z) = (S::one(), S::zero());
        Mat3([Vec3([o, z, z]), Vec3([z, o, z]), Vec3([z, z, o])])
    }

    /// The zero matrix.
    #[inline(always)]
    pub fn zero() -> Self {
        Mat3([Vec3::zero(); 3])
    }

    /// A constant matrix, given by columns.
    #[inline(always)]
    pub fn constant(m: &Mat3<f64>) -> Self {
        Mat3(m.0.map(|c| Vec3::constant(c.0)))
    }

    /// Product with a column vector, `M v`.
    #[inline(always)]
    pub fn mul_vec(&self, v: Vec3<S>) -> Vec3<S> {
        let [x, y, z] = v.0;
        self.0[0].scale_add(x, self.0[1].scale_add(y, self.0[2].scale(z)))
    }

    /// Product of the transpose with a column vector, `Mᵀ v`.
    #[inline(always)]
    pub fn tr_mul_vec(&self, v: Vec3<S>) -> Vec3<S> {
        Vec3([self.0[0].dot(v), self.0[1].dot(v), self.0[2].dot(v)])
    }

    /// Matrix product `self * other`.
    #[inline(always)]
    pub fn mul_mat(&self, other: &Self) -> Self {
        Mat3(other.0.map(|c| self.mul_vec(c)))
    }

    /// The transpose.
    #[inline(always)]
    pub fn transpose(&self) -> Self {
        let [a, b, c] = self.0;
        Mat3([Vec3([a.0[0], b.0[0], c.0[0]]), Vec3([a.0[1], b.0[1], c.0[1]]), Vec3([a.0[2], b.0[2], c.0[2]])])
    }
}

impl<S: Scalar> Mul<S> for Mat3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: S) -> Self {
        Mat3(self.0.map(|c| c.scale(factor)))
    }
}

impl<S: Scalar> Add for Mat3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Mat3([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl Mat3<f64> {
    /// The matrix with the given rows.
    #[inline]
    pub fn from_rows(rows: [[f64; 3]; 3]) -> Self {
        Mat3(rows.map(Vec3)).transpose()
    }

    /// The rows.
    #[inline]
    pub fn rows(&self) -> [[f64; 3]; 3] {
        self.transpose().0.map(|v| v.0)
    }

    /// The cross-product matrix `[u]`, with `[u] v = u × v`.
    #[inline]
    pub fn skew(u: Vec3<f64>) -> Self {
        let [x, y, z] = u.0;
        Mat3::from_rows([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    }

    /// The dyad `a bᵀ`.
    #[inline]
    pub fn outer(a: Vec3<f64>, b: Vec3<f64>) -> Self {
        Mat3(b.0.map(|x| a.scale(x)))
    }

    /// Rotation by `angle` (rad) about the unit vector `axis`.
    pub fn rotation(axis: Vec3<f64>, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        Mat3::identity() * c + Mat3::outer(axis, axis) * (1.0 - c) + Mat3::skew(axis) * s
    }

    /// Rotation from roll, pitch, yaw (rad): `Rz(yaw) Ry(pitch) Rx(roll)`, the convention of URDF.
    pub fn from_rpy(rpy: [f64; 3]) -> Self {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3);
        Mat3::rotation(z, rpy[2]).mul_mat(&Mat3::rotation(y, rpy[1])).mul_mat(&Mat3::rotation(x, rpy[0]))
    }

    /// Roll, pitch, yaw (rad) of a rotation: [`Mat3::from_rpy`] of them is this matrix to rounding, also next to gimbal
    /// lock.
    ///
    /// There yaw is as good as arbitrary; taking roll from what remains after yaw and pitch makes up for whatever it is.
    pub fn to_rpy(&self) -> [f64; 3] {
        let m = self.rows();
        let yaw = m[1][0].atan2(m[0][0]);
        let pitch = (-m[2][0]).atan2(m[0][0].hypot(m[1][0]));
        let (s, c) = yaw.sin_cos();
        let roll = (s * m[0][2] - c * m[1][2]).atan2(c * m[1][1] - s * m[0][1]);
        [roll, pitch, yaw]
    }
}

/// Position and orientation of a frame in another: `x_outer = rotation · x_inner + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation matrix, outer ← inner.
    pub rotation: Mat3<f64>,
    /// Origin of the inner frame, in outer axes, m.
    pub translation: Vec3<f64>,
}

impl Placement {
    /// The identity placement.
    pub fn identity() -> Self {
        Placement { rotation: Mat3::identity(), translation: Vec3::zero() }
    }

    /// From `xyz` (m) and `rpy` (rad), as in URDF `<origin>`.
    pub fn from_xyz_rpy(xyz: [f64; 3], rpy: [f64; 3]) -> Self {
        Placement { rotation: Mat3::from_rpy(rpy), translation: Vec3(xyz) }
    }

    /// Pure translation, m.
    #[inline]
    pub fn translate(x: f64, y: f64, z: f64) -> Self {
        Placement { rotation: Mat3::identity(), translation: Vec3([x, y, z]) }
    }

    /// Pure rotation about a unit axis, rad.
    pub fn rotate(axis: [f64; 3], angle: f64) -> Self {
        Placement { rotation: Mat3::rotation(Vec3(axis), angle), translation: Vec3::zero() }
    }

    /// Composition: `self ∘ inner`.
    #[inline]
    pub fn then(&self, inner: &Placement) -> Placement {
        Placement {
            rotation: self.rotation.mul_mat(&inner.rotation),
            translation: self.rotation.mul_vec(inner.translation) + self.translation,
        }
    }

    /// The inverse placement.
    #[inline]
    pub fn inverse(&self) -> Placement {
        let rotation = self.rotation.transpose();
        Placement { rotation, translation: -rotation.mul_vec(self.translation) }
    }

    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.rotation.0.iter().all(|c| c.0.iter().all(|x| x.is_finite()))
            && self.translation.0.iter().all(|x| x.is_finite())
    }
}
