//! A [`Description`] as plain URDF.

use std::fmt::Write;

use dynid_model::{Description, JointDescription, JointKind, LinkDescription};
use quick_xml::escape::escape;

use super::inertial::Inertial;
use crate::robot_error::RobotFileError;

/// Writes links and joints as URDF, numbers in the shortest form that reads back to the same `f64`.
///
/// Inertias are stated about the centre of mass in link axes. A revolute joint without position limits is written as
/// `continuous`, since URDF demands limits of a revolute joint. Gravity, a floating base and the coupling of mimic
/// joints are settings of a run, which URDF has no place for.
///
/// # Errors
/// [`RobotFileError::Unwritable`]: a helical joint, a body with a first moment but no mass, numbers that are not finite.
pub fn from_description(description: &Description) -> Result<String, RobotFileError> {
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    let _ = writeln!(out, "<robot name=\"{}\">", escape(description.name.as_str()));
    for link in &description.links {
        write_link(&mut out, link)?;
    }
    for joint in &description.joints {
        write_joint(&mut out, joint)?;
    }
    out.push_str("</robot>\n");
    Ok(out)
}

fn write_link(out: &mut String, link: &LinkDescription) -> Result<(), RobotFileError> {
    let name = escape(link.name.as_str());
    let Some(inertia) = &link.inertia else {
        let _ = writeln!(out, "  <link name=\"{name}\"/>");
        return Ok(());
    };
    let inertial = Inertial::of(inertia).map_err(|reason| RobotFileError::Unwritable {
        format: "URDF",
        what: "link",
        name: link.name.clone(),
        reason,
    })?;
    let element = inertial.element("    ", "\n");
    let _ = writeln!(out, "  <link name=\"{name}\">\n    {element}\n  </link>");
    Ok(())
}

fn write_joint(out: &mut String, joint: &JointDescription) -> Result<(), RobotFileError> {
    let unwritable = |reason: &str| RobotFileError::Unwritable {
        format: "URDF",
        what: "joint",
        name: joint.name.clone(),
        reason: reason.to_owned(),
    };
    let kind = match joint.kind {
        JointKind::Revolute if joint.limits.position.is_none() => "continuous",
        JointKind::Revolute => "revolute",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
        JointKind::Floating => "floating",
        JointKind::Fixed => "fixed",
        JointKind::Helical { .. } => return Err(unwritable("URDF has no helical joints")),
    };
    if !joint.placement.is_finite() || !joint.axis.iter().all(|x| x.is_finite()) {
        return Err(unwritable("its placement or axis is not finite"));
    }
    let [x, y, z] = joint.placement.translation.0;
    let [roll, pitch, yaw] = joint.placement.rotation.to_rpy();
    let _ = writeln!(out, "  <joint name=\"{}\" type=\"{kind}\">", escape(joint.name.as_str()));
    let _ = writeln!(out, "    <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>");
    let _ = writeln!(out, "    <parent link=\"{}\"/>", escape(joint.parent.as_str()));
    let _ = writeln!(out, "    <child link=\"{}\"/>", escape(joint.child.as_str()));
    if !matches!(joint.kind, JointKind::Fixed | JointKind::Floating) {
        let [x, y, z] = joint.axis;
        let _ = writeln!(out, "    <axis xyz=\"{x:?} {y:?} {z:?}\"/>");
        write_limit(out, joint);
    }
    if let Some(mimic) = &joint.mimic {
        let _ = writeln!(
            out,
            "    <mimic joint=\"{}\" multiplier=\"{:?}\" offset=\"{:?}\"/>",
            escape(mimic.of.as_str()),
            mimic.ratio,
            mimic.offset
        );
    }
    out.push_str("  </joint>\n");
    Ok(())
}

fn write_limit(out: &mut String, joint: &JointDescription) {
    let limits = &joint.limits;
    let stated = limits.position.is_some() || limits.velocity.is_some() || limits.effort.is_some();
    // Other readers refuse a prismatic joint without the element; without positions it reads back as "no limit".
    if !stated && joint.kind != JointKind::Prismatic {
        return;
    }
    out.push_str("    <limit");
    if let Some((lower, upper)) = limits.position {
        let _ = write!(out, " lower=\"{lower:?}\" upper=\"{upper:?}\"");
    }
    // URDF demands both; zero reads back as "not stated".
    let _ = write!(out, " effort=\"{:?}\"", limits.effort.unwrap_or(0.0));
    let _ = writeln!(out, " velocity=\"{:?}\"/>", limits.velocity.unwrap_or(0.0));
}
