//! Constraints that hold an estimate back, in terms a user can check on the robot.

use dynid_model::symmetric::{eigen, lower_inverse, transpose};

use super::problem::Problem;
use super::program::Program;
use super::whitening::Whitening;

/// A slack below this, in whitened units, counts as used up.
const USED_UP: f64 = 1e-4;

/// A constraint at its limit.
#[derive(Debug, Clone, PartialEq)]
pub enum ActiveConstraint {
    /// The mass of a link lies in a plane: it has no thickness along `axis` (unit vector in the link frame), at distance
    /// `offset` (m) from the frame's origin.
    Flat {
        /// Link.
        link: String,
        /// Direction without thickness.
        axis: [f64; 3],
        /// Signed distance of the plane from the origin along the axis, m.
        offset: f64,
    },
    /// A link keeps no more mass than the margin demands.
    Massless {
        /// Link.
        link: String,
    },
    /// The 6 × 6 form of a link is singular: a principal moment about the centre of mass vanishes.
    Singular {
        /// Link.
        link: String,
    },
    /// A scalar sits at its lower limit.
    AtZero {
        /// Parameter.
        parameter: String,
    },
    /// A bound is met with equality.
    AtBound {
        /// Bound.
        bound: String,
    },
}

impl ActiveConstraint {
    /// Name of the link, parameter or bound.
    pub fn name(&self) -> &str {
        match self {
            Self::Flat { link: name, .. }
            | Self::Massless { link: name }
            | Self::Singular { link: name }
            | Self::AtZero { parameter: name }
            | Self::AtBound { bound: name } => name,
        }
    }
}

impl std::fmt::Display for ActiveConstraint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Flat { link, axis: [x, y, z], .. } => {
                let along = ["x", "y", "z"].into_iter().zip([x, y, z]).find(|(_, a)| a.abs() > 0.99);
                match along {
                    Some((name, _)) => write!(f, "link `{link}`: no thickness along its {name} axis"),
                    None => write!(f, "link `{link}`: no thickness along ({x:.2}, {y:.2}, {z:.2})"),
                }
            }
            Self::Massless { link } => write!(f, "link `{link}`: no mass beyond the margin"),
            Self::Singular { link } => {
                write!(f, "link `{link}`: a principal moment of inertia about the centre of mass vanishes")
            }
            Self::AtZero { parameter } => write!(f, "`{parameter}`: at its lower limit"),
            Self::AtBound { bound } => write!(f, "{bound}: met with equality"),
        }
    }
}

pub(super) fn constraints<const N: usize>(
    problem: &Problem,
    whitening: &Whitening,
    program: &Program<N>,
    xi: &[f64],
) -> Vec<ActiveConstraint> {
    let mut out = Vec::new();
    for (i, (link, cone)) in problem.links.iter().zip(&program.cones).enumerate() {
        let (values, vectors) = eigen(&cone.slack(xi));
        for k in (0..N).take_while(|k| values[*k] < USED_UP) {
            let link = link.name.clone();
            if N != 4 {
                out.push(ActiveConstraint::Singular { link });
                break;
            }
            // uᵀ X u = 0 with X = L⁻¹ P L⁻ᵀ: no mass off the plane n·p + d = 0, (n, d) = L⁻ᵀ u.
            let back = transpose(&lower_inverse(whitening.factor(i)));
            let plane: [f64; 4] = std::array::from_fn(|r| (0..N).map(|c| back[r][c] * vectors[c][k]).sum());
            let length = plane[..3].iter().map(|n| n * n).sum::<f64>().sqrt();
            out.push(if length > 1e-9 * plane[3].abs() {
                let axis = std::array::from_fn(|c| plane[c] / length);
                ActiveConstraint::Flat { link, axis, offset: -plane[3] / length }
            } else {
                ActiveConstraint::Massless { link }
            });
        }
    }
    let (limits, bounds) = program.rays.split_at(program.lower.len());
    let positive = problem.scalars.iter().filter(|s| s.nonnegative);
    for (scalar, ray) in positive.zip(limits) {
        if ray.slack(xi) < USED_UP {
            out.push(ActiveConstraint::AtZero { parameter: scalar.name.clone() });
        }
    }
    for (bound, ray) in problem.bounds.iter().zip(bounds) {
        if ray.slack(xi) < USED_UP {
            out.push(ActiveConstraint::AtBound { bound: bound.name.clone() });
        }
    }
    // Of several bounds that say one thing, one is told.
    out.dedup();
    out
}
