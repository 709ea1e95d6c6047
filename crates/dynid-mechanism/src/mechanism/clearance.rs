//! Revolute joints with clearance: two translations of the journal in its bearing before the rotation.

use super::MechanismError;
use super::build::unit_axis;
use crate::description::{Description, JointDescription, JointKind, Limits, LinkDescription};
use dynid_algebra::spatial::{Placement, Vec3};

/// Names of the translations that a joint with clearance has besides its rotation.
pub fn translation_names(joint: &str) -> [String; 2] {
    [format!("{joint}.x"), format!("{joint}.y")]
}

impl Description {
    /// Returns the robot with clearance in some revolute joints.
    ///
    /// Each of them becomes three: translations `<joint>.x` and `<joint>.y` of the journal's centre along two axes of the
    /// bearing at right angles to the joint's axis (m), then the rotation under its old name. For an axis along z, `x` and
    /// `y` are those of the joint frame at position zero; others follow in cyclic order. Effort along the translations is
    /// the force on the journal in bearing axes (N); that of the rotation is the moment about the journal's centre (N m).
    ///
    /// Old coordinates keep their places, the translations come last, joint after joint in the order given. The links in
    /// between have no mass, of which the mechanism warns.
    ///
    /// # Errors
    /// [`MechanismError::UnknownJoint`], [`MechanismError::NoJournal`] for a joint that does not turn, follows another or
    /// is named twice, [`MechanismError::ZeroAxis`].
    pub fn with_clearance(&self, joints: &[impl AsRef<str>]) -> Result<Description, MechanismError> {
        let mut out = self.clone();
        for (k, name) in joints.iter().map(AsRef::as_ref).enumerate() {
            let Some(index) = self.joints.iter().position(|j| j.name == name) else {
                return Err(MechanismError::UnknownJoint {
                    name: name.to_owned(),
                    known: self.joints.iter().map(|j| j.name.clone()).collect(),
                });
            };
            let refuse = |found| Err(MechanismError::NoJournal { joint: name.to_owned(), found });
            let joint = &self.joints[index];
            match joint.kind {
                JointKind::Revolute | JointKind::Continuous => {}
                JointKind::Prismatic => return refuse("a joint that slides"),
                JointKind::Helical { .. } => return refuse("a screw"),
                JointKind::Floating => return refuse("a floating joint"),
                JointKind::Fixed => return refuse("a fixed joint"),
            }
            let leads = self.joints.iter().any(|j| j.mimic.as_ref().is_some_and(|m| m.of == name));
            if joint.mimic.is_some() || leads {
                return refuse("a joint that is coupled to others");
            }
            if joints[..k].iter().any(|other| other.as_ref() == name) {
                return refuse("the same joint before");
            }
            let names = translation_names(name);
            let axes = bearing_axes(unit_axis(joint)?);
            let mut parent = joint.parent.clone();
            let mut placement = joint.placement;
            for (translation, axis) in names.into_iter().zip(axes) {
                let child = format!("{translation} carrier");
                out.links.push(LinkDescription { name: child.clone(), inertia: None });
                out.joints.push(JointDescription {
                    name: translation,
                    parent,
                    child: child.clone(),
                    kind: JointKind::Prismatic,
                    placement,
                    axis: axis.0,
                    limits: Limits::default(),
                    mimic: None,
                });
                (parent, placement) = (child, Placement::identity());
            }
            out.joints[index].parent = parent;
            out.joints[index].placement = placement;
        }
        Ok(out)
    }
}

/// Two directions that make a right-handed system with an axis: the next axes in cyclic order where it is one of the
/// frame's.
fn bearing_axes(axis: Vec3<f64>) -> [Vec3<f64>; 2] {
    let largest = (0..3).fold(0, |m, k| if axis.0[k].abs() > axis.0[m].abs() { k } else { m });
    let mut next = [0.0; 3];
    next[(largest + 1) % 3] = 1.0;
    let next = Vec3(next);
    let across = next + axis.scale(-next.dot(axis));
    let x = across.scale(1.0 / across.norm());
    [x, axis.cross(x)]
}

/// Position, rate and acceleration of a journal's centre in a plane at right angles to the axis of its joint.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JournalPath {
    /// m.
    pub position: [f64; 2],
    /// m/s.
    pub rate: [f64; 2],
    /// m/s².
    pub acceleration: [f64; 2],
}

impl JournalPath {
    /// From axes that turn with the journal's link to those of the bearing, for position, rate and acceleration of the joint:
    /// `p = R(q) e` with its time derivatives.
    pub fn in_bearing(&self, [q, dq, ddq]: [f64; 3]) -> JournalPath {
        let (sine, cosine) = q.sin_cos();
        let turned = |[x, y]: [f64; 2]| [cosine * x - sine * y, sine * x + cosine * y];
        let ([x, y], [vx, vy], [ax, ay]) = (self.position, self.rate, self.acceleration);
        JournalPath {
            position: turned([x, y]),
            rate: turned([vx - dq * y, vy + dq * x]),
            acceleration: turned([
                ax - 2.0 * dq * vy - ddq * y - dq * dq * x,
                ay + 2.0 * dq * vx + ddq * x - dq * dq * y,
            ]),
        }
    }

    /// The path of a journal in axes that turn with the link, from the path in bearing axes.
    pub fn in_journal(&self, joint: [f64; 3]) -> JournalPath {
        self.in_bearing(joint.map(|x| -x))
    }
}
