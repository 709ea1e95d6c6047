//! Body trees to links and joints.

use dynid_files::excerpt::excerpt;
use dynid_model::{Description, JointDescription, JointKind, LinkDescription, Placement};
use toml::Spanned;

use super::Source;
use super::dh::limits;
use super::schema::{Body, BodyKind};
use crate::robot_error::RobotFileError;

/// Name of the root link of a body tree.
const GROUND: &str = "ground";

pub(super) fn build(source: &Source<'_>, bodies: &[Spanned<Body>]) -> Result<Description, RobotFileError> {
    if bodies.is_empty() {
        let (owner, expected) = ("robot".to_owned(), "at least one entry in `body`".to_owned());
        return Err(RobotFileError::Missing { at: source.place(0), owner, expected });
    }
    let named = bodies.iter().map(|b| (b.span().start, b.get_ref().name.as_str()));
    source.unique("body", std::iter::once((0, GROUND)).chain(named))?;
    let joint_name = |b: &'_ Body| b.joint.name.clone().unwrap_or_else(|| b.name.clone());
    let joints: Vec<String> = bodies.iter().map(|b| joint_name(b.get_ref())).collect();
    source.unique("joint", bodies.iter().zip(&joints).map(|(b, n)| (b.span().start, n.as_str())))?;

    let mut description = Description::new("robot");
    description.links.push(LinkDescription { name: GROUND.to_owned(), inertia: None });
    for (body, name) in bodies.iter().zip(joints) {
        let (offset, body) = (body.span().start, body.get_ref());
        let owner = format!("body `{}`", excerpt(&body.name));
        let joint = &body.joint;
        let inertia = source.inertia(offset, &owner, &body.stated_inertia())?;
        description.links.push(LinkDescription { name: body.name.clone(), inertia });
        description.joints.push(JointDescription {
            name,
            parent: body.parent.clone(),
            child: body.name.clone(),
            kind: kind(source, offset, &owner, body)?,
            placement: Placement::from_xyz_rpy(joint.xyz.map(|x| x.0), joint.rpy.map(|x| x.0)),
            axis: joint.axis.map_or([1.0, 0.0, 0.0], |a| a.map(|x| x.0)),
            limits: limits(source, offset, &owner, &joint.limits)?,
            mimic: None,
        });
    }
    Ok(description)
}

fn kind(source: &Source<'_>, offset: usize, owner: &str, body: &Body) -> Result<JointKind, RobotFileError> {
    let moves_along = !matches!(body.joint.kind, BodyKind::Fixed | BodyKind::Floating);
    let missing = |expected: &str| RobotFileError::Missing {
        at: source.place(offset),
        owner: owner.to_owned(),
        expected: expected.to_owned(),
    };
    if moves_along && body.joint.axis.is_none() {
        return Err(missing("`axis` of its joint"));
    }
    match (body.joint.kind, body.joint.pitch) {
        (BodyKind::Helical, Some(pitch)) => Ok(JointKind::Helical { pitch: pitch.0 }),
        (BodyKind::Helical, None) => Err(missing("`pitch` of its helical joint, m/rad")),
        (_, Some(pitch)) => {
            Err(source.value(offset, owner, "pitch", "none but in a helical joint", &pitch.0.to_string()))
        }
        (BodyKind::Revolute, None) => Ok(JointKind::Revolute),
        (BodyKind::Continuous, None) => Ok(JointKind::Continuous),
        (BodyKind::Prismatic, None) => Ok(JointKind::Prismatic),
        (BodyKind::Floating, None) => Ok(JointKind::Floating),
        (BodyKind::Fixed, None) => Ok(JointKind::Fixed),
    }
}
