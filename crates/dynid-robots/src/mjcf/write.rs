//! A [`Description`] as MJCF.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use dynid_model::mechanism::ROOT_JOINT;
use dynid_model::{Description, Inertia, JointDescription, JointKind, Mat3, Placement, Vec3};
use quick_xml::escape::escape;

use super::loops::{Constraints, Loops};
use super::model::WORLD;
use super::orientation::quaternion;
use super::{GearJoint, JointParameters, STICKING, unwritable};
use crate::robot_error::RobotFileError;
use crate::urdf::inertial::Inertial;

/// Writes links, joints and gravity as MJCF, numbers in the shortest form that reads back to the same `f64`.
///
/// - Links are bodies under their own names, one inside the other as joints say; a link on a fixed joint is a body
///   without joint. A root link called `world` is MJCF's own world body.
/// - `<inertial>`: centre of mass and `fullinertia` about it (order xx yy zz xy xz yz) in link axes; none for massless
///   links, and none for links that do not move if no body could have the stated one (MuJoCo would refuse the file).
/// - Joints: `hinge` (revolute, continuous), `slide` (prismatic), `freejoint`; `ref` is 0, so `qpos` is the position of
///   the description. `range` from the limits of revolute and prismatic joints, `damping`, `frictionloss`, `armature`,
///   `stiffness`, `springref` from `joints` (joints that are not named there: 0). A gear that gives way is a second joint behind its own.
/// - A mimic joint follows its leader by `<equality><joint polycoef="offset ratio 0 0 0"/>`.
/// - One `<motor>` of gear 1 per joint under the joint's name, its `ctrlrange` the limit of the effort; none for mimic
///   joints if the description couples them.
/// - No geometry. `compiler angle="radian" balanceinertia="false"`, `option gravity`.
///
/// # Errors
/// [`RobotFileError::Unwritable`]: a helical joint, a floating joint that is not at the origin of the world, a second
/// link called `world`, a mimic joint without a leader of one coordinate, a body with a first moment but no mass,
/// numbers that are not finite. A graph that is no tree is the fault of [`Description::build`]; what does not hang on
/// the root is not written.
pub fn from_description(
    description: &Description,
    joints: &[JointParameters],
) -> Result<String, RobotFileError> {
    write(description, joints, None)
}

/// Writes a mechanism with loops as MJCF: the tree as [`from_description`] does, and what closes its loops as `<equality>` between sites.
///
/// - `spherical` and `planar_revolute` cuts are a `<connect>` of two sites `<loop>.a`, `<loop>.b`, `revolute` ones two of them 0.1 m apart on
///   the axis, `fixed` ones a `<weld>`, couplings of two joints a `<joint>`. MuJoCo holds them by soft constraints: parts give way by
///   some micrometres under load, and what a planar cut leaves to the plane is held as well.
/// - Driven joints alone have motors.
/// - A `<key name="home">` has a closed pose: a simulation must begin with one.
///
/// # Errors
/// Fails as [`from_description`] does; [`RobotFileError::Unwritable`] for cuts of other kinds, and couplings of more than two joints.
pub fn from_closed(
    description: &Description,
    joints: &[JointParameters],
    loops: &Loops<'_>,
) -> Result<String, RobotFileError> {
    write(description, joints, Some(loops))
}

fn write(
    description: &Description,
    joints: &[JointParameters],
    loops: Option<&Loops<'_>>,
) -> Result<String, RobotFileError> {
    let writer = Writer {
        loops,
        constraints: loops.map(Loops::constraints).transpose()?.unwrap_or_default(),
        description,
        parameters: joints.iter().map(|p| (p.joint.as_str(), p)).collect(),
        by_name: description.joints.iter().map(|j| (j.name.as_str(), j)).collect(),
    };
    let [x, y, z] = description.gravity;
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    let _ = writeln!(out, "<mujoco model=\"{}\">", escape(description.name.as_str()));
    out.push_str("  <compiler angle=\"radian\" balanceinertia=\"false\"/>\n");
    let _ = writeln!(out, "  <option gravity=\"{x:?} {y:?} {z:?}\"/>");
    out.push_str("  <worldbody>\n");
    let order = writer.bodies(&mut out)?;
    out.push_str("  </worldbody>\n");
    writer.equalities(&mut out)?;
    writer.motors(&mut out);
    writer.home(&order, &mut out)?;
    out.push_str("</mujoco>\n");
    Ok(out)
}

/// What is still to be written, last first.
enum Pending<'a> {
    Body { link: &'a str, joint: Option<&'a JointDescription>, depth: usize, moves: bool },
    Close { depth: usize },
}

struct Writer<'a> {
    loops: Option<&'a Loops<'a>>,
    constraints: Constraints<'a>,
    description: &'a Description,
    parameters: HashMap<&'a str, &'a JointParameters>,
    by_name: HashMap<&'a str, &'a JointDescription>,
}

impl<'a> Writer<'a> {
    /// Bodies, and the joints in the order in which they are written.
    fn bodies(&self, out: &mut String) -> Result<Vec<&'a JointDescription>, RobotFileError> {
        let d = self.description;
        let mut children: HashMap<&str, Vec<&JointDescription>> = HashMap::new();
        for joint in &d.joints {
            children.entry(joint.parent.as_str()).or_default().push(joint);
        }
        let inertia: HashMap<&str, Option<Inertia>> =
            d.links.iter().map(|l| (l.name.as_str(), l.inertia)).collect();
        let owned: HashSet<&str> = d.joints.iter().map(|j| j.child.as_str()).collect();
        let Some(root) = d.links.iter().map(|l| l.name.as_str()).find(|l| !owned.contains(l)) else {
            return Ok(Vec::new());
        };
        let mut order = Vec::new();
        let root_is_world = root == WORLD && !d.floating_base;
        let on = |link: &str| children.get(link).into_iter().flatten().rev().copied();
        let body = |joint: &'a JointDescription, depth, moves| Pending::Body {
            link: &joint.child,
            joint: Some(joint),
            depth,
            moves: moves || joint.kind != JointKind::Fixed,
        };
        // A free joint must hang on the world itself.
        let at_world = |j: &JointDescription| root_is_world || j.kind == JointKind::Floating;
        let mut pending: Vec<Pending<'a>> =
            on(root).filter(|j| at_world(j)).map(|j| body(j, 2, false)).collect();
        if root_is_world {
            self.sites(out, root, 2);
        } else {
            pending.push(Pending::Body { link: root, joint: None, depth: 2, moves: d.floating_base });
        }
        while let Some(next) = pending.pop() {
            match next {
                Pending::Close { depth } => {
                    let _ = writeln!(out, "{:1$}</body>", "", 2 * depth);
                }
                Pending::Body { link, joint, depth, moves } => {
                    self.open_body(out, link, joint, depth)?;
                    self.inertial(out, link, inertia.get(link).copied().flatten(), moves, depth + 1)?;
                    self.joint(out, joint, depth + 1)?;
                    self.sites(out, link, depth + 1);
                    order.extend(joint.filter(|j| j.kind != JointKind::Fixed));
                    pending.push(Pending::Close { depth });
                    let inside = on(link).filter(|j| link != root || !at_world(j));
                    pending.extend(inside.map(|j| body(j, depth + 1, moves)));
                }
            }
        }
        Ok(order)
    }

    /// Points of a link that loops hold.
    fn sites(&self, out: &mut String, link: &str, depth: usize) {
        for (name, place) in self.constraints.sites.get(link).into_iter().flatten() {
            let [x, y, z] = place.translation.0;
            let indent = 2 * depth;
            let _ = write!(out, "{:indent$}<site name=\"{}\" pos=\"{x:?} {y:?} {z:?}\"", "", escape(name));
            if place.rotation != Mat3::identity() {
                let [w, x, y, z] = quaternion(&place.rotation);
                let _ = write!(out, " quat=\"{w:?} {x:?} {y:?} {z:?}\"");
            }
            out.push_str("/>\n");
        }
    }

    /// A closed pose.
    fn home(&self, order: &[&JointDescription], out: &mut String) -> Result<(), RobotFileError> {
        let Some(loops) = self.loops else { return Ok(()) };
        let mut qpos: Vec<String> = Vec::new();
        for joint in order {
            let known = loops.home.iter().find(|(name, _)| *name == joint.name);
            let numbers: Vec<f64> = match (known.map(|(_, q)| &q[..]), joint.kind) {
                // MJCF has the real part first.
                (Some([x, y, z, i, j, k, w]), JointKind::Floating) => vec![*x, *y, *z, *w, *i, *j, *k],
                (Some(q), _) => q.to_vec(),
                (None, JointKind::Floating) => vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
                (None, _) => vec![0.0],
            };
            if numbers.iter().any(|x| !x.is_finite()) {
                return Err(unwritable("joint", &joint.name, "its home position is not finite".to_owned()));
            }
            qpos.extend(numbers.iter().map(|x| format!("{x:?}")));
        }
        out.push_str("  <keyframe>\n");
        let _ = writeln!(out, "    <key name=\"home\" qpos=\"{}\"/>", qpos.join(" "));
        out.push_str("  </keyframe>\n");
        Ok(())
    }

    fn open_body(
        &self,
        out: &mut String,
        link: &str,
        joint: Option<&JointDescription>,
        depth: usize,
    ) -> Result<(), RobotFileError> {
        if link == WORLD {
            let reason = "MJCF keeps this name for the world; rename the link".to_owned();
            return Err(unwritable("link", link, reason));
        }
        let _ = write!(out, "{:1$}<body name=\"{2}\"", "", 2 * depth, escape(link));
        if let Some(joint) = joint {
            if !joint.placement.is_finite() {
                return Err(unwritable("joint", &joint.name, "its placement is not finite".to_owned()));
            }
            let [x, y, z] = joint.placement.translation.0;
            if [x, y, z] != [0.0; 3] {
                let _ = write!(out, " pos=\"{x:?} {y:?} {z:?}\"");
            }
            if joint.placement.rotation != Mat3::identity() {
                let [w, x, y, z] = quaternion(&joint.placement.rotation);
                let _ = write!(out, " quat=\"{w:?} {x:?} {y:?} {z:?}\"");
            }
        }
        out.push_str(">\n");
        Ok(())
    }

    fn inertial(
        &self,
        out: &mut String,
        link: &str,
        inertia: Option<Inertia>,
        moves: bool,
        depth: usize,
    ) -> Result<(), RobotFileError> {
        let Some(inertia) = inertia else { return Ok(()) };
        if inertia == Inertia::default() || (!moves && inertia.physical_fault().is_some()) {
            return Ok(());
        }
        let Inertial { mass, com: [x, y, z], tensor: [[xx, xy, xz], [_, yy, yz], [_, _, zz]] } =
            Inertial::of(&inertia).map_err(|reason| unwritable("link", link, reason))?;
        let _ = writeln!(
            out,
            "{:1$}<inertial pos=\"{x:?} {y:?} {z:?}\" mass=\"{mass:?}\" \
             fullinertia=\"{xx:?} {yy:?} {zz:?} {xy:?} {xz:?} {yz:?}\"/>",
            "",
            2 * depth
        );
        Ok(())
    }

    fn joint(
        &self,
        out: &mut String,
        joint: Option<&JointDescription>,
        depth: usize,
    ) -> Result<(), RobotFileError> {
        let indent = 2 * depth;
        let Some(joint) = joint else {
            if self.description.floating_base {
                let _ = writeln!(out, "{:indent$}<freejoint name=\"{ROOT_JOINT}\"/>", "");
            }
            return Ok(());
        };
        let refuse = |reason: &str| Err(unwritable("joint", &joint.name, reason.to_owned()));
        let kind = match joint.kind {
            JointKind::Fixed => return Ok(()),
            JointKind::Helical { .. } => return refuse("MJCF has no helical joints"),
            JointKind::Floating => {
                let at_world = depth == 3 && joint.placement == Placement::identity();
                if !at_world || self.description.floating_base {
                    return refuse(
                        "a free joint of MJCF moves a body in the world: hang it on the root link",
                    );
                }
                let _ = writeln!(out, "{:indent$}<freejoint name=\"{}\"/>", "", escape(joint.name.as_str()));
                return Ok(());
            }
            JointKind::Revolute | JointKind::Continuous => "hinge",
            JointKind::Prismatic => "slide",
        };
        let norm = Vec3(joint.axis).norm();
        if !(norm.is_finite() && norm > 0.0) {
            return refuse("its axis has no direction");
        }
        let [x, y, z] = if norm == 1.0 { joint.axis } else { joint.axis.map(|a| a / norm) };
        let name = escape(joint.name.as_str());
        let _ =
            write!(out, "{:indent$}<joint name=\"{name}\" type=\"{kind}\" axis=\"{x:?} {y:?} {z:?}\"", "");
        if let Some((low, high)) = joint.limits.position
            && joint.kind != JointKind::Continuous
            && low < high
        {
            let _ = write!(out, " range=\"{low:?} {high:?}\"");
        }
        if let Some(p) = self.parameters.get(joint.name.as_str()) {
            let entries = [
                ("damping", p.damping),
                ("frictionloss", p.friction_loss),
                ("armature", p.armature),
                ("stiffness", p.stiffness),
                ("springref", p.spring_reference),
            ];
            for (key, value) in entries {
                if !value.is_finite() {
                    return refuse(&format!("{key} is not finite"));
                }
                if value != 0.0 {
                    let _ = write!(out, " {key}=\"{value:?}\"");
                }
            }
            for (key, value) in STICKING.iter().filter(|_| p.sticks && p.friction_loss > 0.0) {
                let _ = write!(out, " {key}=\"{value}\"");
            }
        }
        out.push_str("/>\n");
        let gear = self.parameters.get(joint.name.as_str()).and_then(|p| p.gear);
        if let Some(gear) = gear {
            if !gear.is_finite() {
                return refuse("its gear has a number that is not finite");
            }
            let name = GearJoint::name(&joint.name);
            let (name, more) = (escape(name.as_str()), gear.attributes(1.0));
            let _ = writeln!(
                out,
                "{:indent$}<joint name=\"{name}\" type=\"{kind}\" axis=\"{x:?} {y:?} {z:?}\" {more}/>",
                ""
            );
        }
        Ok(())
    }

    fn equalities(&self, out: &mut String) -> Result<(), RobotFileError> {
        let followers = || {
            self.description
                .joints
                .iter()
                .filter(|j| scalar(j.kind))
                .filter_map(|j| Some((j, j.mimic.as_ref()?)))
        };
        if followers().next().is_none() && self.constraints.lines.is_empty() {
            return Ok(());
        }
        out.push_str("  <equality>\n");
        for line in &self.constraints.lines {
            let _ = writeln!(out, "    {line}");
        }
        for (joint, mimic) in followers() {
            let leader = self.by_name.get(mimic.of.as_str()).filter(|l| scalar(l.kind));
            if leader.is_none() || !mimic.ratio.is_finite() || !mimic.offset.is_finite() {
                let reason = format!("it follows `{}`, which is no joint with one coordinate", mimic.of);
                return Err(unwritable("joint", &joint.name, reason));
            }
            let _ = writeln!(
                out,
                "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:?} {:?} 0 0 0\"/>",
                escape(joint.name.as_str()),
                escape(mimic.of.as_str()),
                mimic.offset,
                mimic.ratio
            );
        }
        out.push_str("  </equality>\n");
        Ok(())
    }

    fn motors(&self, out: &mut String) {
        let d = self.description;
        let is_driven = |j: &JointDescription| self.loops.is_none_or(|loops| loops.driven.contains(&j.name));
        let has_motor =
            |j: &&JointDescription| scalar(j.kind) && !(d.couple_mimics && j.mimic.is_some()) && is_driven(j);
        let driven: Vec<_> = d.joints.iter().filter(has_motor).collect();
        if driven.is_empty() {
            return;
        }
        out.push_str("  <actuator>\n");
        for joint in driven {
            let name = escape(joint.name.as_str());
            let _ = write!(out, "    <motor name=\"{name}\" joint=\"{name}\"");
            if let Some(effort) = joint.limits.effort.filter(|e| e.is_finite() && *e > 0.0) {
                let _ = write!(out, " ctrlrange=\"{:?} {effort:?}\"", -effort);
            }
            out.push_str("/>\n");
        }
        out.push_str("  </actuator>\n");
    }
}

fn scalar(kind: JointKind) -> bool {
    !matches!(kind, JointKind::Fixed | JointKind::Floating)
}
