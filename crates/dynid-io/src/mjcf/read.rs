//! The part of MJCF that [`from_description`](super::from_description) writes, read back.

use dynid_model::{
    Description, Inertia, JointDescription, JointKind, Limits, LinkDescription, Mat3, Mimic, Placement, Vec3,
};

use super::JointParameters;
use super::quaternion::rotation;
use crate::excerpt::excerpt;
use crate::robot_error::RobotFileError;
use crate::urdf::xml::{Attribute, Tag, Tags};

/// What MJCF text holds.
#[derive(Clone, Debug, PartialEq)]
pub struct MjcfRobot {
    /// Links and joints, inner bodies first; the root link is `world`, and a body without joint hangs on a fixed joint
    /// `<body>/fixed`.
    pub description: Description,
    /// What the moving joints state besides, in the order of the file.
    pub joints: Vec<JointParameters>,
}

/// Reads MJCF as [`from_description`](super::from_description) writes it; `source_name` stands in messages.
///
/// This is a reader for checks, not for MJCF of other origin: bodies with `pos` and `quat`, at most one joint each
/// (`hinge`, `slide`, `freejoint`), `<inertial>` with `fullinertia`, gravity, and `<equality><joint>`; sites, other equalities and keys are passed
/// over.
///
/// # Errors
/// [`RobotFileError`]: the text is not MJCF, a value is no number, or an element of the kinematics is none of these.
pub fn parse(text: &str, source_name: &str) -> Result<MjcfRobot, RobotFileError> {
    let mut tags = Tags::new(text, source_name);
    let mut robot = MjcfRobot { description: Description::new("robot"), joints: Vec::new() };
    robot.description.links.push(LinkDescription { name: "world".to_owned(), inertia: None });
    let mut open: Vec<Body> = Vec::new();
    let mut section = String::new();
    while let Some((range, tag)) = tags.next()? {
        let (start, empty) = match tag {
            Tag::Open { start, empty } => (start, empty),
            Tag::Close => {
                if section == "worldbody"
                    && tags.depth() >= 2
                    && let Some(body) = open.pop_if(|b| b.depth == tags.depth())
                {
                    body.finish(&mut robot.description);
                }
                continue;
            }
        };
        let depth = tags.depth() - usize::from(!empty);
        let element = start.name().0;
        let attributes = tags.attributes(&start, range.start)?;
        let fields = Fields { tags: &tags, element, offset: range.start, attributes: &attributes };
        match (depth, section.as_str(), element) {
            (0, _, "mujoco") => robot.description.name = fields.text("model").unwrap_or("robot").to_owned(),
            (1, ..) => {
                section = element.to_owned();
                if element == "option" {
                    robot.description.gravity = fields.numbers("gravity")?;
                }
            }
            (_, "worldbody", "body") => {
                let body = Body::new(&fields, depth, open.last())?;
                if empty { body.finish(&mut robot.description) } else { open.push(body) }
            }
            (_, "worldbody", "inertial") => {
                let Some(body) = open.last_mut() else { return Err(fields.unsupported()) };
                body.inertia = Some(inertia(&fields)?);
            }
            (_, "worldbody", "joint" | "freejoint") => {
                let free = element == "freejoint";
                match open.last_mut() {
                    Some(body) if body.joint.kind == JointKind::Fixed => {
                        joint(&fields, free, &mut body.joint)?;
                    }
                    _ => return Err(fields.unsupported()),
                }
                if !free {
                    robot.joints.push(JointParameters {
                        joint: fields.name("name")?,
                        damping: fields.number_or_zero("damping")?,
                        friction_loss: fields.number_or_zero("frictionloss")?,
                        armature: fields.number_or_zero("armature")?,
                    });
                }
            }
            (2, "equality", "joint") => {
                let [offset, ratio, ..] = fields.numbers::<5>("polycoef")?;
                let (follower, of) = (fields.name("joint1")?, fields.name("joint2")?);
                let joints = &mut robot.description.joints;
                let Some(joint) = joints.iter_mut().find(|j| j.name == follower) else {
                    return Err(fields.unsupported());
                };
                joint.mimic = Some(Mimic { of, ratio, offset });
            }
            // What closes loops moves no body of the tree.
            (_, "worldbody", "site") | (2, "equality", "connect" | "weld") | (2, "keyframe", "key") => {}
            (2, "actuator", "motor") => {}
            _ => return Err(fields.unsupported()),
        }
    }
    Ok(robot)
}

/// A body that is open.
struct Body {
    depth: usize,
    inertia: Option<Inertia>,
    joint: JointDescription,
}

impl Body {
    fn new(fields: &Fields<'_>, depth: usize, outer: Option<&Body>) -> Result<Self, RobotFileError> {
        let name = fields.name("name")?;
        let rotation = match fields.text("quat") {
            Some(_) => rotation(fields.numbers("quat")?),
            None => Mat3::identity(),
        };
        let translation = match fields.text("pos") {
            Some(_) => fields.numbers("pos")?,
            None => [0.0; 3],
        };
        let joint = JointDescription {
            name: format!("{name}/fixed"),
            parent: outer.map_or_else(|| "world".to_owned(), |b| b.joint.child.clone()),
            child: name,
            kind: JointKind::Fixed,
            placement: Placement { rotation, translation: Vec3(translation) },
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        };
        Ok(Body { depth, inertia: None, joint })
    }

    fn finish(self, description: &mut Description) {
        description.links.push(LinkDescription { name: self.joint.child.clone(), inertia: self.inertia });
        description.joints.push(self.joint);
    }
}

fn inertia(fields: &Fields<'_>) -> Result<Inertia, RobotFileError> {
    let [xx, yy, zz, xy, xz, yz] = fields.numbers("fullinertia")?;
    let [mass] = fields.numbers("mass")?;
    let tensor = Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
    Ok(Inertia::from_com(mass, Vec3(fields.numbers("pos")?), &tensor))
}

fn joint(fields: &Fields<'_>, free: bool, joint: &mut JointDescription) -> Result<(), RobotFileError> {
    joint.name = fields.name("name")?;
    let range = match fields.text("range") {
        Some(_) => Some(fields.numbers("range")?).map(|[low, high]: [f64; 2]| (low, high)),
        None => None,
    };
    joint.limits.position = range;
    joint.kind = match fields.text("type") {
        _ if free => JointKind::Floating,
        Some("hinge") if range.is_some() => JointKind::Revolute,
        Some("hinge") => JointKind::Continuous,
        Some("slide") => JointKind::Prismatic,
        _ => return Err(fields.unsupported()),
    };
    if free {
        // The position of a free body is that in the world, whatever its pose in the file.
        joint.placement = Placement::identity();
    } else {
        joint.axis = fields.numbers("axis")?;
    }
    Ok(())
}

/// Attributes of one element with what messages need.
struct Fields<'a> {
    tags: &'a Tags<'a>,
    element: &'a str,
    offset: usize,
    attributes: &'a [Attribute],
}

impl Fields<'_> {
    fn attribute(&self, key: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == key)
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.attribute(key).map(|a| a.value.as_str())
    }

    fn required(&self, key: &str) -> Result<&Attribute, RobotFileError> {
        self.attribute(key).ok_or_else(|| RobotFileError::Missing {
            at: self.tags.place(self.offset),
            owner: format!("<{}>", excerpt(self.element)),
            expected: format!("an attribute `{key}`"),
        })
    }

    fn name(&self, key: &str) -> Result<String, RobotFileError> {
        Ok(self.required(key)?.value.clone())
    }

    fn numbers<const N: usize>(&self, key: &str) -> Result<[f64; N], RobotFileError> {
        let a = self.required(key)?;
        let found: Option<Vec<f64>> = a
            .value
            .split_ascii_whitespace()
            .map(|x| x.parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        found.and_then(|list| list.try_into().ok()).ok_or_else(|| RobotFileError::Value {
            at: self.tags.place(a.offset),
            owner: format!("<{}>", excerpt(self.element)),
            field: key.to_owned(),
            expected: format!("{N} finite numbers"),
            found: excerpt(&a.value),
        })
    }

    fn number_or_zero(&self, key: &str) -> Result<f64, RobotFileError> {
        if self.attribute(key).is_none() {
            return Ok(0.0);
        }
        let [x] = self.numbers(key)?;
        Ok(x)
    }

    fn unsupported(&self) -> RobotFileError {
        RobotFileError::Unsupported {
            at: self.tags.place(self.offset),
            key: format!("<{}>", excerpt(self.element)),
            feature: "MJCF elements other than those of an exported robot",
        }
    }
}
