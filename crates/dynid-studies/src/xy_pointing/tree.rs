//! Clearance as two slides in front of a joint: the journal moves in the bearing's plane, then the joint turns.

use dynid::model::{Description, JointDescription, JointKind, Limits, LinkDescription, Placement};

use super::pointing::{JOINTS, Pointing, description};
use crate::StudyError;

/// Rates of the tree: per joint the slides along X and Y of the bearing, then the rotation.
pub(super) const RATES: usize = 3 * JOINTS;

/// The mechanism with slides in front of both joints.
pub(super) fn with_clearance() -> Result<Pointing, StudyError> {
    Pointing::new(&with_slides(description()?), ["j1", "j2"])
}

fn with_slides(ideal: Description) -> Description {
    let mut out = Description { joints: Vec::new(), ..ideal.clone() };
    for joint in ideal.joints {
        let mut parent = joint.parent.clone();
        let mut placement = joint.placement;
        for (axis, name) in [([1.0, 0.0, 0.0], "x"), ([0.0, 1.0, 0.0], "y")] {
            let child = format!("{}_{name}", joint.child);
            out.links.push(LinkDescription { name: child.clone(), inertia: None });
            out.joints.push(JointDescription {
                name: format!("{}_{name}", joint.name),
                parent: std::mem::replace(&mut parent, child.clone()),
                child,
                kind: JointKind::Prismatic,
                placement: std::mem::replace(&mut placement, Placement::identity()),
                axis,
                limits: Limits::default(),
                mimic: None,
            });
        }
        out.joints.push(JointDescription { parent, placement, ..joint });
    }
    out
}

/// Angles of both joints and offsets of both journals in the axes of their links, with two derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct ClearanceState {
    pub(super) q: [[f64; JOINTS]; 3],
    /// `e1x, e1y, e2x, e2y`, m.
    pub(super) e: [[f64; 2 * JOINTS]; 3],
}

impl ClearanceState {
    /// Positions, rates and accelerations of the tree: `d = R(q) e` in the axes of the bearing.
    pub(super) fn tree(&self) -> [[f64; RATES]; 3] {
        let mut out = [[0.0; RATES]; 3];
        for joint in 0..JOINTS {
            let [q, dq, ddq] = self.q.map(|q| q[joint]);
            let [e, de, dde] = self.e.map(|e| [e[2 * joint], e[2 * joint + 1]]);
            let turned = [
                e,
                [de[0] - dq * e[1], de[1] + dq * e[0]],
                [
                    dde[0] - 2.0 * dq * de[1] - ddq * e[1] - dq * dq * e[0],
                    dde[1] + 2.0 * dq * de[0] + ddq * e[0] - dq * dq * e[1],
                ],
            ];
            for (derivative, (vector, angle)) in turned.into_iter().zip([q, dq, ddq]).enumerate() {
                let [x, y] = rotated(q, vector);
                out[derivative][3 * joint..][..3].copy_from_slice(&[x, y, angle]);
            }
        }
        out
    }

    /// From the tree's efforts at one sample: torques, and forces on the journals in the axes of their links.
    pub(super) fn loads(&self, effort: &[f64]) -> [JointLoad; JOINTS] {
        std::array::from_fn(|joint| JointLoad {
            torque: effort[3 * joint + 2],
            force: rotated(-self.q[0][joint], [effort[3 * joint], effort[3 * joint + 1]]),
        })
    }
}

/// What a joint passes on.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointLoad {
    /// N m, about the journal's centre.
    pub(super) torque: f64,
    /// On the journal, N.
    pub(super) force: [f64; 2],
}

fn rotated(angle: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [c * x - s * y, s * x + c * y]
}
