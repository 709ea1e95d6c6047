//! From `<worldbody>` to links and joints.

use std::collections::HashMap;

use dynid_files::excerpt::excerpt;
use dynid_model::{Inertia, JointDescription, JointKind, Limits, LinkDescription, Placement, Vec3};

use super::JointParameters;
use super::compiler::{Compiler, Options};
use super::defaults::Defaults;
use super::document::{Document, Element};
use super::fields::Fields;
use super::inertia::{self, Matter};
use super::joint::{self, JointElement, MovingJoint};
use super::mesh::Meshes;
use super::model::{BodyFrame, BodyPart, JointPart, Model, WORLD};
use super::orientation::placement;
use super::parts::{Around, Part, Parts};
use crate::robot_error::RobotFileError;
use crate::{ElementSetting, SettingValue, TieSpec};

/// What reads the bodies of a model.
pub(super) struct Walk<'w, 'a> {
    pub(super) document: &'a Document,
    pub(super) compiler: &'w Compiler<'a>,
    pub(super) options: &'w Options,
    pub(super) defaults: &'w Defaults<'a>,
    pub(super) parts: Parts<'w, 'a>,
    pub(super) meshes: Meshes<'w>,
    pub(super) model: Model<'a>,
    pub(super) count: Count<'a>,
}

/// What has been met so far.
#[derive(Default)]
pub(super) struct Count<'a> {
    bodies: usize,
    joints: usize,
    /// Elements of named bodies and joints.
    names: HashMap<(&'static str, String), &'a Element>,
}

/// What a body hangs on.
struct Carrier {
    link: String,
    frame: BodyFrame,
}

impl<'a: 'w, 'w> Walk<'w, 'a> {
    /// Reads all bodies.
    pub(super) fn world(&mut self) -> Result<(), RobotFileError> {
        let world = self.model.frames[WORLD].clone();
        let carrier = Carrier { link: WORLD.to_owned(), frame: world };
        let around = Around::nothing();
        for section in self.document.sections("worldbody") {
            let parts = self.parts.inside(section, &around)?;
            for part in parts {
                match part.element.name.as_str() {
                    "body" => self.body(&part, &carrier)?,
                    "site" => self.site(&part, WORLD)?,
                    "joint" | "freejoint" | "inertial" => {
                        let fields = Fields::alone(self.document, part.element);
                        let reason = "it stands in the world, which does not move";
                        return Err(fields.refuse("", reason, "put it into a <body>"));
                    }
                    _ => {}
                }
            }
        }
        if let Some(total) = self.compiler.total_mass {
            let links = &mut self.model.description.links;
            let sum: f64 = links.iter().filter_map(|l| l.inertia).map(|i| i.mass()).sum();
            if sum > 0.0 {
                for inertia in links.iter_mut().filter_map(|l| l.inertia.as_mut()) {
                    *inertia = Inertia(inertia.0.map(|x| x * total / sum));
                }
            }
        }
        Ok(())
    }

    fn fields(&self, part: &Part<'a>) -> Result<Fields<'a>, RobotFileError> {
        let behind = self.defaults.behind(part.element, part.around.class)?;
        Ok(Fields::new(self.document, part.element, behind))
    }

    /// The name of a body or joint: its own, or one by its number.
    fn name(&mut self, part: &Part<'a>, kind: &'static str, number: usize) -> Result<String, RobotFileError> {
        let name = match part.element.text("name") {
            Some(name) if !name.is_empty() => format!("{name}{}", part.around.suffix),
            _ => format!("{kind}{number}"),
        };
        match self.count.names.insert((kind, name.clone()), part.element) {
            None if kind != "body" || name != WORLD => Ok(name),
            first => {
                let at = self.document.place(part.element, 0);
                let first_line = first.map_or(1, |first| self.document.place(first, 0).line);
                Err(RobotFileError::Duplicate { at, kind, name: excerpt(&name), first_line })
            }
        }
    }

    fn site(&mut self, part: &Part<'a>, body: &str) -> Result<(), RobotFileError> {
        let Some(name) = part.element.text("name") else { return Ok(()) };
        let fields = self.fields(part)?;
        let mut place = placement(&fields, self.compiler)?;
        if let Some([a, b, c, d, e, f]) = fields.numbers("fromto")? {
            place.translation = (Vec3([a, b, c]) + Vec3([d, e, f])).scale(0.5);
        }
        let name = format!("{name}{}", part.around.suffix);
        self.model.sites.insert(name, (body.to_owned(), part.around.frame.then(&place)));
        Ok(())
    }

    fn body(&mut self, part: &Part<'a>, carrier: &Carrier) -> Result<(), RobotFileError> {
        let element = part.element;
        let fields = Fields::alone(self.document, element);
        self.count.bodies += 1;
        let name = self.name(part, "body", self.count.bodies)?;
        if fields.number("gravcomp", 0.0)? != 0.0 {
            let reason = "`gravcomp` takes weight off the body, and all bodies have their weight here";
            let hint = "remove the attribute: it belongs to a controller, not to the robot";
            return Err(fields.refuse("gravcomp", reason, hint));
        }
        let around = Around {
            class: self.defaults.class(element, "childclass")?.or(part.around.class),
            frame: Placement::identity(),
            ..part.around.clone()
        };
        let own = part.around.frame.then(&placement(&fields, self.compiler)?);
        let parts = self.parts.inside(element, &around)?;
        let joints = self.joints(&parts)?;
        let on_parent = carrier.frame.in_link.then(&own);
        let anchor = self.chain(&name, &joints, carrier, on_parent)?;
        let in_link = translation(-anchor);
        let frame = BodyFrame {
            link: name.clone(),
            in_link,
            drawn: carrier.frame.drawn.then(&own),
            moves: carrier.frame.moves || !joints.is_empty(),
            mocap: fields.flag("mocap")?.unwrap_or(false),
        };
        self.matter(&name, part, &parts, &frame, own)?;
        self.model.frames.insert(name.clone(), frame.clone());
        let next = Carrier { link: name.clone(), frame };
        for inner in &parts {
            match inner.element.name.as_str() {
                "site" => self.site(inner, &name)?,
                "body" => self.body(inner, &next)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Joints of a body with their names.
    fn joints(&mut self, parts: &[Part<'a>]) -> Result<Vec<(String, NamedJoint<'a>)>, RobotFileError> {
        let mut out = Vec::new();
        let bodies = parts.iter().filter(|p| p.element.name == "body").count();
        for part in parts.iter().filter(|p| matches!(p.element.name.as_str(), "joint" | "freejoint")) {
            let fields = self.fields(part)?;
            let name = self.name(part, "joint", self.count.joints)?;
            self.count.joints += 1;
            let joint = joint::read(&fields, &part.around.frame, self.compiler, self.options)?;
            if matches!(joint, JointElement::Free) && bodies == 0 {
                let aligned = fields.flag("align")?.unwrap_or(self.compiler.aligns_free);
                if aligned {
                    let reason = "the frame of its body would be turned into the principal axes";
                    return Err(fields.refuse("align", reason, "write align=\"false\""));
                }
            }
            out.push((name, NamedJoint { fields, joint, copied: part.around.copied }));
        }
        Ok(out)
    }

    /// Links and joints of one body: its joints in a row, or a fixed one. Gives the point of the body's frame at which its link has its
    /// own.
    fn chain(
        &mut self,
        name: &str,
        joints: &[(String, NamedJoint<'a>)],
        carrier: &Carrier,
        on_parent: Placement,
    ) -> Result<Vec3<f64>, RobotFileError> {
        let description = |name: &str, parent: &str, child: &str, kind, placement| JointDescription {
            name: name.to_owned(),
            parent: parent.to_owned(),
            child: child.to_owned(),
            kind,
            placement,
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        };
        if joints.is_empty() {
            let joint = format!("{name}/fixed");
            let fixed = description(&joint, &carrier.link, name, JointKind::Fixed, on_parent);
            self.model.description.joints.push(fixed);
            return Ok(Vec3::zero());
        }
        let (mut parent, mut last) = (carrier.link.clone(), Vec3::zero());
        for (k, (joint, stated)) in joints.iter().enumerate() {
            let moving = match &stated.joint {
                JointElement::Free if joints.len() > 1 || carrier.link != WORLD => {
                    let reason = "a free joint stands alone, in a body of the world";
                    return Err(stated.fields.refuse("type", reason, "correct the place of the body"));
                }
                JointElement::Free => {
                    // The position of a free body is that in the world, wherever it is drawn.
                    let free = description(joint, &parent, name, JointKind::Floating, Placement::identity());
                    self.model.description.joints.push(free);
                    return Ok(Vec3::zero());
                }
                JointElement::Moving(moving) => moving,
            };
            let before = if k == 0 { on_parent } else { Placement::identity() };
            let placement = before.then(&translation(moving.anchor - last)).then(&back(moving));
            let end = k + 1 == joints.len();
            let child = if end { name.to_owned() } else { format!("{name}__{joint}") };
            if !end {
                self.massless(&child);
            }
            let mut one = description(joint, &parent, &child, moving.kind, placement);
            one.axis = moving.axis.0;
            one.limits = moving.limits;
            self.model.description.joints.push(one);
            self.state(joint, moving, stated);
            (parent, last) = (child, moving.anchor);
        }
        Ok(last)
    }

    /// A link between two joints of one body.
    fn massless(&mut self, link: &str) {
        let inertia = Some(Inertia::default());
        self.model.description.links.push(LinkDescription { name: link.to_owned(), inertia });
        let ties = &mut self.model.elements.ties;
        match ties.first_mut() {
            Some(tie) => tie.massless.push(link.to_owned()),
            None => ties.push(TieSpec { massless: vec![link.to_owned()], ..TieSpec::default() }),
        }
    }

    /// What a joint states of friction, rotor and spring.
    fn state(&mut self, name: &str, moving: &MovingJoint, stated: &NamedJoint<'a>) {
        let parameters = JointParameters { joint: name.to_owned(), ..moving.parameters.clone() };
        let rest = parameters.stiffness * parameters.spring_reference;
        let values = [
            ("rotor", "inertia", parameters.armature),
            ("viscous", "coefficient", parameters.damping),
            ("coulomb", "effort", parameters.friction_loss),
            ("spring", "stiffness", parameters.stiffness),
            ("spring", "kq0", rest),
        ];
        if parameters.stiffness > 0.0 {
            self.model.elements.beside.push((name.to_owned(), "spring".to_owned()));
            self.model.warnings.push(format!(
                "joint `{name}`: its spring ({} around {}) is its element `spring`, which is identified",
                parameters.stiffness, parameters.spring_reference
            ));
        }
        for (element, key, value) in values.into_iter().filter(|(.., value)| *value != 0.0) {
            self.model.elements.settings.push(ElementSetting {
                joint: name.to_owned(),
                element: element.to_owned(),
                key: key.to_owned(),
                value: SettingValue::Number(value),
            });
        }
        self.model.joints.push(JointPart {
            element: stated.fields.element,
            parameters,
            zero: moving.zero,
            unit: moving.unit,
            copied: stated.copied,
        });
    }

    /// The link of a body with its inertia.
    fn matter(
        &mut self,
        name: &str,
        part: &Part<'a>,
        parts: &[Part<'a>],
        frame: &BodyFrame,
        place: Placement,
    ) -> Result<(), RobotFileError> {
        let inertials: Vec<&Part<'a>> = parts.iter().filter(|p| p.element.name == "inertial").collect();
        if let [_, second, ..] = inertials[..] {
            let at = self.document.place(second.element, 0);
            let owner = format!("body `{}`", excerpt(name));
            return Err(RobotFileError::Repeated { at, owner, what: "<inertial>".to_owned() });
        }
        let inertial = inertials.first().map(|p| (Fields::alone(self.document, p.element), p.around.frame));
        let geoms = parts
            .iter()
            .filter(|p| p.element.name == "geom")
            .map(|p| Ok((self.fields(p)?, p.around.frame)))
            .collect::<Result<Vec<_>, RobotFileError>>()?;
        let matter = Matter {
            inertial: inertial.as_ref().map(|(fields, frame)| (fields, *frame)),
            geoms: &geoms,
            place,
            weigh: frame.moves || self.compiler.total_mass.is_some(),
        };
        let inertia = inertia::of_body(&matter, self.compiler, &mut self.meshes)?;
        let inertia = inertia.map(|i| i.in_frame(&frame.in_link));
        if inertia.is_some_and(|i| !i.0.iter().all(|x| x.is_finite())) {
            let fields = Fields::alone(self.document, part.element);
            return Err(fields.refuse(
                "",
                "its inertia overflows about the frame of its link",
                "correct its numbers",
            ));
        }
        self.model.description.links.push(LinkDescription { name: name.to_owned(), inertia });
        self.model.bodies.push(BodyPart {
            link: name.to_owned(),
            element: part.element,
            inertial: inertials.first().map(|p| (p.element, p.around.frame)),
            shift: frame.in_link.translation,
            copied: part.around.copied,
        });
        Ok(())
    }
}

/// A joint that has a name.
struct NamedJoint<'a> {
    fields: Fields<'a>,
    joint: JointElement,
    copied: bool,
}

fn translation(by: Vec3<f64>) -> Placement {
    Placement { translation: by, ..Placement::identity() }
}

/// From where a joint is drawn to where its position is zero.
fn back(joint: &MovingJoint) -> Placement {
    match joint.kind {
        _ if joint.zero == 0.0 => Placement::identity(),
        JointKind::Prismatic => translation(joint.axis.scale(-joint.zero)),
        _ => Placement::rotate(joint.axis.0, -joint.zero),
    }
}
