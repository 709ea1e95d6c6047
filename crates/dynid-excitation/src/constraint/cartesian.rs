//! Where points of the robot may go.

use dynid_model::{BodyPoint, Dynamics, Mechanism, MotionBlock, Vec3};

use super::{
    ConstraintError, ConstraintKind, ConstraintRow, DISTANCE_SCALE, PathConstraint, at_poses, finite,
    fixed_base, positive,
};

/// Sharpness of the smooth maximum, 1/m: it lies at most `ln 2 / b` = 7 mm below the maximum.
const SHARPNESS: f64 = 100.0;
/// Distance from an upright axis below which its direction is held, m.
const ON_AXIS: f64 = 1e-12;

/// A point of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePoint {
    /// Name of a link.
    pub frame: String,
    /// Position in the frame of the link, m.
    pub position: Vec3<f64>,
}

/// Where a point may be, in base axes, m. Every distance is positive where the point is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Region {
    /// `n·x - d ≥ 0`, `n = normal / |normal|`.
    HalfSpace {
        /// Direction into the allowed side.
        normal: Vec3<f64>,
        /// Distance `d` of the plane from the origin along the normal.
        offset: f64,
    },
    /// Inside an upright box: six half-spaces.
    InsideBox {
        /// Smallest coordinates.
        lower: Vec3<f64>,
        /// Largest coordinates.
        upper: Vec3<f64>,
    },
    /// Outside an upright cylinder: `r - ρ ≥ 0`, `r` the distance from its axis.
    OutsideCylinder {
        /// `x`, `y` of the axis.
        center: [f64; 2],
        /// Radius `ρ`.
        radius: f64,
    },
    /// Outside an upright column or above it: the smooth maximum, from below, of `g₁ = r - ρ` and `g₂ = z - height`,
    /// `(1/b) [ln(e^{b g₁} + e^{b g₂}) - ln 2] ≤ max(g₁, g₂)`, `b = 100 /m`.
    OutsideOrAboveColumn {
        /// `x`, `y` of the axis.
        center: [f64; 2],
        /// Radius `ρ`.
        radius: f64,
        /// `z` of the top.
        height: f64,
    },
}

/// A smooth function of a point, m.
#[derive(Debug, Clone, Copy)]
enum Distance {
    Plane { normal: Vec3<f64>, offset: f64 },
    Cylinder { center: [f64; 2], radius: f64 },
    Column { center: [f64; 2], radius: f64, height: f64 },
}

impl Distance {
    /// Value and gradient.
    fn at(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        match *self {
            Distance::Plane { normal, offset } => (normal.dot(x) - offset, normal),
            Distance::Cylinder { center, radius } => outside(center, radius, x),
            Distance::Column { center, radius, height } => {
                let (g1, outward) = outside(center, radius, x);
                let g2 = x.0[2] - height;
                // Exponentials of differences: of distances themselves they would overflow some metres away.
                let share = 1.0 / (1.0 + (SHARPNESS * (g2 - g1)).exp());
                let rest = (-SHARPNESS * (g1 - g2).abs()).exp().ln_1p() - std::f64::consts::LN_2;
                let upward = Vec3([0.0, 0.0, 1.0 - share]);
                (g1.max(g2) + rest / SHARPNESS, outward.scale(share) + upward)
            }
        }
    }
}

fn outside(center: [f64; 2], radius: f64, x: Vec3<f64>) -> (f64, Vec3<f64>) {
    let (dx, dy) = (x.0[0] - center[0], x.0[1] - center[1]);
    let r = dx.hypot(dy);
    let inverse = 1.0 / r.max(ON_AXIS);
    (r - radius, Vec3([dx * inverse, dy * inverse, 0.0]))
}

/// Points kept within regions: rows `distance / 0.5 m ≥ 0`.
#[derive(Debug, Clone)]
pub struct CartesianLimits {
    dynamics: Dynamics,
    points: Vec<BodyPoint>,
    /// Point and function of every row.
    distances: Vec<(usize, Distance)>,
    rows: Vec<ConstraintRow>,
}

impl CartesianLimits {
    /// Keeps each point within its region; a point may appear more than once.
    ///
    /// Fails if a frame does not exist, a number is not finite, a normal vanishes, a radius is not positive, a box is empty
    /// or a joint floats.
    pub fn new(mechanism: &Mechanism, limits: &[(FramePoint, Region)]) -> Result<Self, ConstraintError> {
        fixed_base(mechanism.positions(), mechanism.rates())?;
        let mut out = CartesianLimits {
            dynamics: Dynamics::new(mechanism),
            points: Vec::new(),
            distances: Vec::new(),
            rows: Vec::new(),
        };
        for (point, region) in limits {
            out.points.push(resolve(mechanism, &point.frame, point.position)?);
            out.add(&point.frame, region)?;
        }
        Ok(out)
    }

    /// Keeps points above a plane, each by a clearance of its own, m: rows `(n·x - height - clearance) / 0.5 m ≥ 0`.
    ///
    /// Fails as [`CartesianLimits::new`].
    pub fn above_plane(
        mechanism: &Mechanism,
        points: &[(FramePoint, f64)],
        plane: &Plane,
    ) -> Result<Self, ConstraintError> {
        let mut out = Self::new(mechanism, &[])?;
        finite("height of a plane", "base", &[plane.height])?;
        finite("normal of a plane", "base", &plane.normal.0)?;
        let length = plane.normal.norm();
        positive("length of the normal of a plane", "base", length)?;
        let normal = plane.normal.scale(1.0 / length);
        for (point, clearance) in points {
            finite("clearance", &point.frame, &[*clearance])?;
            out.points.push(resolve(mechanism, &point.frame, point.position)?);
            let above = Distance::Plane { normal, offset: plane.height + clearance };
            out.push(plane.kind, point.frame.clone(), above);
        }
        Ok(out)
    }

    /// Rows of a region for the point that was added last.
    fn add(&mut self, frame: &str, region: &Region) -> Result<(), ConstraintError> {
        match *region {
            Region::HalfSpace { normal, offset } => {
                finite("normal of a half-space", frame, &normal.0)?;
                finite("offset of a half-space", frame, &[offset])?;
                let length = normal.norm();
                positive("length of the normal of a half-space", frame, length)?;
                let plane = Distance::Plane { normal: normal.scale(1.0 / length), offset };
                self.push(ConstraintKind::HalfSpace, frame.into(), plane);
            }
            Region::InsideBox { lower, upper } => {
                finite("corner of a box", frame, &[lower.0, upper.0].concat())?;
                for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
                    positive("size of a box", frame, upper.0[c] - lower.0[c])?;
                    let mut normal = Vec3::zero();
                    normal.0[c] = 1.0;
                    let low = Distance::Plane { normal, offset: lower.0[c] };
                    let high = Distance::Plane { normal: -normal, offset: -upper.0[c] };
                    self.push(ConstraintKind::Box, format!("{frame}, lower {axis}"), low);
                    self.push(ConstraintKind::Box, format!("{frame}, upper {axis}"), high);
                }
            }
            Region::OutsideCylinder { center, radius } => {
                finite("center of a cylinder", frame, &center)?;
                positive("radius of a cylinder", frame, radius)?;
                self.push(ConstraintKind::Cylinder, frame.into(), Distance::Cylinder { center, radius });
            }
            Region::OutsideOrAboveColumn { center, radius, height } => {
                finite("center of a column", frame, &center)?;
                finite("height of a column", frame, &[height])?;
                positive("radius of a column", frame, radius)?;
                let column = Distance::Column { center, radius, height };
                self.push(ConstraintKind::Column, frame.into(), column);
            }
        }
        Ok(())
    }

    fn push(&mut self, kind: ConstraintKind, subject: String, distance: Distance) {
        self.distances.push((self.points.len() - 1, distance));
        self.rows.push(distance_row(kind, subject));
    }
}

pub(super) fn distance_row(kind: ConstraintKind, subject: String) -> ConstraintRow {
    ConstraintRow { kind, subject, lower: 0.0, upper: f64::INFINITY, scale: DISTANCE_SCALE, unit: "m" }
}

pub(super) fn resolve(
    mechanism: &Mechanism,
    frame: &str,
    position: Vec3<f64>,
) -> Result<BodyPoint, ConstraintError> {
    finite("position of a point", frame, &position.0)?;
    let found = mechanism.frame(frame)?;
    let at = found.placement.rotation.mul_vec(position) + found.placement.translation;
    Ok(BodyPoint { body: found.body, position: at })
}

impl PathConstraint for CartesianLimits {
    fn rows(&self) -> &[ConstraintRow] {
        &self.rows
    }

    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]) {
        let n = motion.samples;
        let mut positions = vec![0.0; 3 * self.points.len() * n];
        self.dynamics.points(motion, &self.points, n, &mut positions);
        for (r, (point, distance)) in self.distances.iter().enumerate() {
            for (s, value) in values[r * stride..][..n].iter_mut().enumerate() {
                let x = Vec3([0, 1, 2].map(|c| positions[(3 * point + c) * n + s]));
                *value = distance.at(x).0 / DISTANCE_SCALE;
            }
        }
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let n = self.dynamics.rates();
        assert_eq!(out.len(), 3 * n * wanted.len(), "length of the gradients");
        out.fill(0.0);
        at_poses(&self.dynamics, &self.points, motion, wanted, |k, row, positions, jacobians| {
            let (point, distance) = &self.distances[row];
            let (_, slope) = distance.at(positions[*point]);
            let jacobian = &jacobians[3 * n * point..][..3 * n];
            add_along(jacobian, slope.scale(1.0 / DISTANCE_SCALE), &mut out[3 * n * k..][..n]);
        });
    }
}

/// Adds `Jᵀ direction`, `J` by rows.
pub(super) fn add_along(jacobian: &[f64], direction: Vec3<f64>, to: &mut [f64]) {
    for (row, factor) in jacobian.chunks_exact(to.len()).zip(direction.0) {
        for (t, j) in to.iter_mut().zip(row) {
            *t += factor * j;
        }
    }
}

/// A plane that links stay above: the floor, or what the robot is mounted on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// What rows are called: [`ConstraintKind::Floor`], [`ConstraintKind::Mounting`].
    pub kind: ConstraintKind,
    /// Unit vector into the side of the robot, in base axes.
    pub normal: Vec3<f64>,
    /// `normal · x` of its points, m.
    pub height: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points about the rim of a column, where the smooth maximum turns from one distance to the other.
    #[test]
    fn the_smooth_maximum_has_its_gradient_about_the_rim() {
        let column = Distance::Column { center: [0.1, 0.2], radius: 0.3, height: 0.5 };
        let h = 1e-5;
        for k in 0..=40 {
            let (across, up) = (1e-3 * (k - 20) as f64, 7e-4 * (20 - k) as f64);
            let x = Vec3([0.1 + 0.6 * (0.3 + across), 0.2 + 0.8 * (0.3 + across), 0.5 + up]);
            let (value, gradient) = column.at(x);
            let max = across.max(up);
            assert!(value <= max + 1e-15 && value >= max - std::f64::consts::LN_2 / SHARPNESS - 1e-15);
            for c in 0..3 {
                let moved = |step: f64| {
                    let mut y = x;
                    y.0[c] += step;
                    column.at(y).0
                };
                let difference =
                    (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
                assert!((gradient.0[c] - difference).abs() < 1e-9, "{k} {c}: {gradient:?} {difference}");
            }
        }
    }
}
