//! SDF to a robot.

use std::collections::HashMap;

use dynid_files::excerpt::{closest, excerpt, listed};
use dynid_model::{Description, Inertia, JointDescription, LinkDescription, Mat3, Placement, Vec3};

use super::document::{Document, Element};
use super::frames::{Frames, WORLD};
use super::joint::{self, Version};
use super::pose::Pose;
use crate::robot_error::RobotFileError;
use crate::robot_numbers::in_range;
use crate::toml_robot::RobotFile;
use crate::{ElementSetting, ElementSpec, SettingValue};

/// Gravity of a world that states none, m/s².
const GRAVITY_OF_WORLDS: [f64; 3] = [0.0, 0.0, -9.8];

/// Reads SDF with one model that moves; see [`parse_model`].
///
/// # Errors
/// As [`parse_model`].
pub fn parse(text: &str, source_name: &str) -> Result<RobotFile, RobotFileError> {
    parse_model(text, source_name, None)
}

/// Reads a model from SDF text, by its name where a world has several; `source_name` stands in messages.
///
/// - Links and joints keep the order of the file; kinds: revolute, continuous, prismatic, fixed. Poses are followed through `relative_to` and the
///   frames of the model, whatever their order; axes through `expressed_in`.
/// - The frame of a link is that of the joint that carries it, at its position zero; in most files the two are the same. The link at the root keeps
///   its own. A joint to `world` makes the world the root.
/// - `<inertial>`: `I_c = R I Rᵀ` with the rotation of its pose. What it leaves out is what SDF says: 1 kg, 1 kg m².
/// - `<limit>`: numbers from 1e12 on, infinity, and negative speeds and efforts are no limits.
/// - `<dynamics>`: `damping` and `friction` are stated values of the elements `viscous` and `coulomb`.
/// - Gravity is that of the world, turned into the axes of the root; without a world 9.81 m/s² along -z.
///
/// # Errors
/// [`RobotFileError`] with line and column; [`RobotFileError::NotCarried`] for what changes efforts and has no place here: models inside of models,
/// included files, joints of other kinds, links without weight or with added mass.
pub fn parse_model(text: &str, source_name: &str, model: Option<&str>) -> Result<RobotFile, RobotFileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let document = Document::parse(text, source_name)?;
    let version = version(&document)?;
    let (world, model) = choose(&document, model)?;
    let name = document.name(model)?;
    let owner = format!("model `{}`", excerpt(&name));
    for (kind, what) in [("model", "a model"), ("include", "a file")] {
        if let Some(inner) = model.all(kind).next() {
            let reason = format!("{what} inside of the model, <{kind}>");
            return Err(document.refuse(
                inner,
                &owner,
                reason,
                "put its links and joints into the model itself",
            ));
        }
    }
    if document.flag(model, &owner, "static")? == Some(true) {
        return Err(document.refuse(model, &owner, "it is static: nothing of it moves", "remove <static>"));
    }
    let frames = Frames::of(&document, model)?;
    let mut reader = Reader {
        document: &document,
        frames: &frames,
        version,
        description: Description::new(name),
        elements: ElementSpec::default(),
        warnings: Vec::new(),
        carried: HashMap::new(),
    };
    reader.joints_that_carry(model)?;
    reader.links(model)?;
    reader.joints(model)?;
    reader.gravity(world)?;
    let Reader { description, elements, warnings, .. } = reader;
    Ok(RobotFile { warnings, sdf: true, ..RobotFile::plain(description, elements) })
}

/// The version that a file states, which decides what it means.
fn version(document: &Document<'_>) -> Result<Version, RobotFileError> {
    let fault = |found: &str| RobotFileError::Value {
        at: document.place(&document.root),
        owner: "<sdf>".to_owned(),
        field: "version".to_owned(),
        expected: "a version such as 1.9".to_owned(),
        found: excerpt(found),
    };
    let stated = document.root.attribute("version").ok_or_else(|| fault("nothing"))?;
    let (major, minor) = stated.split_once('.').ok_or_else(|| fault(stated))?;
    match (major.parse(), minor.parse()) {
        (Ok(major), Ok(minor)) => Ok((major, minor)),
        _ => Err(fault(stated)),
    }
}

/// The model that is meant, and the world that it is in.
fn choose<'a>(
    document: &'a Document<'_>,
    name: Option<&str>,
) -> Result<(Option<&'a Element>, &'a Element), RobotFileError> {
    let root = &document.root;
    let of_worlds = root.all("world").flat_map(|world| world.all("model").map(move |m| (Some(world), m)));
    let all: Vec<(Option<&Element>, &Element)> =
        root.all("model").map(|m| (None, m)).chain(of_worlds).collect();
    let names: Vec<String> =
        all.iter().map(|(_, m)| m.attribute("name").unwrap_or_default().to_owned()).collect();
    if let Some(name) = name {
        let found = names.iter().position(|n| n == name);
        return found.map(|k| all[k]).ok_or_else(|| RobotFileError::UnknownName {
            at: document.place(root),
            context: format!("<sdf> with the models {}", listed(&names, 6)),
            kind: "model",
            name: excerpt(name),
            meant: closest(name, &names).map(str::to_owned),
        });
    }
    let is_static = |m: &Element| m.all("static").any(|s| matches!(s.text.as_str(), "true" | "1"));
    let moving: Vec<&(Option<&Element>, &Element)> = all.iter().filter(|(_, m)| !is_static(m)).collect();
    match (all.as_slice(), moving.as_slice()) {
        ([one], _) => Ok(*one),
        (_, [one]) => Ok(**one),
        ([], _) => Err(without_model(document)),
        _ => Err(RobotFileError::Value {
            at: document.place(root),
            owner: "<sdf>".to_owned(),
            field: "<model>".to_owned(),
            expected: format!("one, or its name behind that of the file, `FILE#{}`", excerpt(&names[0])),
            found: listed(&names, 6),
        }),
    }
}

fn without_model(document: &Document<'_>) -> RobotFileError {
    let root = &document.root;
    let include = root.all("include").chain(root.all("world").flat_map(|world| world.all("include"))).next();
    match include {
        Some(include) => {
            let file = include.all("uri").next().map_or("another file", |uri| uri.text.as_str());
            let reason = format!("its model is in `{}`", excerpt(file));
            document.refuse(include, "<include>", reason, "give the file with the <model>")
        }
        None => {
            let (at, owner) = (document.place(root), "<sdf>".to_owned());
            RobotFileError::Missing { at, owner, expected: "a <model>".to_owned() }
        }
    }
}

/// What is read of a model.
struct Reader<'a> {
    document: &'a Document<'a>,
    frames: &'a Frames<'a>,
    version: Version,
    description: Description,
    elements: ElementSpec,
    warnings: Vec<String>,
    /// Frame of a link that a joint carries: where in the model, and whether it is the link's own.
    carried: HashMap<String, (Placement, bool)>,
}

impl Reader<'_> {
    /// Finds the frames of links, which are those of their joints.
    fn joints_that_carry(&mut self, model: &Element) -> Result<(), RobotFileError> {
        for joint in model.all("joint") {
            let (name, owner) = self.named(joint)?;
            let (child, link) = self.link_of(joint, &owner, "child")?;
            if link == WORLD {
                let reason = "the world hangs on it";
                return Err(self.document.refuse(child, &owner, reason, "swap <parent> and <child>"));
            }
            let place = self.place_of(joint, &name, &owner)?;
            let own = self.frames.is_at(&name, &link);
            self.carried.entry(link).or_insert((place, own));
        }
        Ok(())
    }

    fn named(&self, element: &Element) -> Result<(String, String), RobotFileError> {
        let name = self.document.name(element)?;
        let owner = format!("{} `{}`", element.name, excerpt(&name));
        Ok((name, owner))
    }

    /// The link that a joint names as its parent or child, itself or by a frame of it.
    fn link_of<'e>(
        &self,
        joint: &'e Element,
        owner: &str,
        end: &str,
    ) -> Result<(&'e Element, String), RobotFileError> {
        let (element, name) = self.document.required(joint, owner, end)?;
        Ok((element, self.frames.link(name, element, owner)?.to_owned()))
    }

    /// Frame of a joint in the model.
    fn place_of(&self, joint: &Element, name: &str, owner: &str) -> Result<Placement, RobotFileError> {
        let pose = Pose::of(self.document, joint, owner)?;
        // A joint may be called as a link, so its name does not always find it.
        let within = match pose.relative_to {
            Some(frame) if frame == name => {
                let reason = "its <pose> is relative to itself";
                return Err(self.document.refuse(joint, owner, reason, "name another frame"));
            }
            Some(frame) => frame,
            None => self.document.required(joint, owner, "child")?.1.to_owned(),
        };
        Ok(self.frames.place(&within, joint, owner)?.then(&pose.placement))
    }

    fn links(&mut self, model: &Element) -> Result<(), RobotFileError> {
        for joint in model.all("joint") {
            let (_, owner) = self.named(joint)?;
            if self.link_of(joint, &owner, "parent")?.1 == WORLD {
                self.description.links.push(LinkDescription { name: WORLD.to_owned(), inertia: None });
                break;
            }
        }
        for link in model.all("link") {
            let (name, owner) = self.named(link)?;
            if self.document.flag(link, &owner, "gravity")? == Some(false) {
                let reason = "it has no weight, <gravity>, and all links have theirs here";
                let hint = "remove the element: real links have weight";
                return Err(self.document.refuse(link, &owner, reason, hint));
            }
            let inertia = self.inertia(link, &owner)?;
            let inertia = match self.carried.get(&name) {
                Some((place, false)) => {
                    let own = self.frames.place(&name, link, &owner)?;
                    inertia.in_frame(&place.inverse().then(&own))
                }
                _ => inertia,
            };
            if !inertia.0.iter().all(|x| x.is_finite()) {
                let reason = "its inertia overflows about the frame of its joint";
                return Err(self.document.refuse(link, &owner, reason, "correct its numbers"));
            }
            self.description.links.push(LinkDescription { name, inertia: Some(inertia) });
        }
        Ok(())
    }

    /// Inertia of a link about its own frame.
    fn inertia(&mut self, link: &Element, owner: &str) -> Result<Inertia, RobotFileError> {
        let document = self.document;
        let Some(inertial) = document.child(link, owner, "inertial")? else {
            self.warnings
                .push(format!("{owner}: no <inertial>: SDF takes it for 1 kg with moments of 1 kg m²"));
            return Ok(Inertia::from_com(1.0, Vec3::zero(), &Mat3::identity()));
        };
        if matches!(inertial.attribute("auto"), Some("true" | "1")) {
            let reason = "`auto` leaves its <inertial> to be worked out from shapes";
            return Err(document.refuse(inertial, owner, reason, "state <mass>, <pose> and <inertia>"));
        }
        if let Some(added) = document.child(inertial, owner, "fluid_added_mass")? {
            let reason = "<fluid_added_mass> moves fluid with it";
            return Err(document.refuse(added, owner, reason, "remove the element: fluids are not modelled"));
        }
        let pose = Pose::of(document, inertial, owner)?;
        if pose.relative_to.is_some() {
            let reason = "the <pose> of its <inertial> names a frame, and is in that of the link";
            return Err(document.refuse(inertial, owner, reason, "remove `relative_to`"));
        }
        let mass = document.number(inertial, owner, "mass")?.unwrap_or(1.0);
        if mass < 0.0 {
            let place = inertial.all("mass").next().unwrap_or(inertial);
            return Err(document.value(place, owner, "a mass that is not negative"));
        }
        let tensor = document.child(inertial, owner, "inertia")?;
        let entry = |name: &str, without: f64| match tensor {
            Some(tensor) => Ok(document.number(tensor, owner, name)?.unwrap_or(without)),
            None => Ok(without),
        };
        let (xx, yy, zz) = (entry("ixx", 1.0)?, entry("iyy", 1.0)?, entry("izz", 1.0)?);
        let (xy, xz, yz) = (entry("ixy", 0.0)?, entry("ixz", 0.0)?, entry("iyz", 0.0)?);
        let stated = Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
        let Placement { rotation, translation } = pose.placement;
        let turned = match rotation == Mat3::identity() {
            true => stated,
            false => rotation.mul_mat(&stated).mul_mat(&rotation.transpose()),
        };
        Ok(Inertia::from_com(mass, translation, &turned))
    }

    /// Frame of a link as it is here, in the model.
    fn frame_of(&self, link: &str, from: &Element, owner: &str) -> Result<Placement, RobotFileError> {
        match self.carried.get(link) {
            Some((place, _)) => Ok(*place),
            None => self.frames.place(link, from, owner),
        }
    }

    fn joints(&mut self, model: &Element) -> Result<(), RobotFileError> {
        let mut seen: HashMap<String, &Element> = HashMap::new();
        for joint in model.all("joint") {
            let (name, owner) = self.named(joint)?;
            if let Some(first) = seen.insert(name.clone(), joint) {
                let (at, first_line) = (self.document.place(joint), self.document.place(first).line);
                return Err(RobotFileError::Duplicate {
                    at,
                    kind: "joint",
                    name: excerpt(&name),
                    first_line,
                });
            }
            let (_, parent) = self.link_of(joint, &owner, "parent")?;
            let (_, child) = self.link_of(joint, &owner, "child")?;
            let place = self.place_of(joint, &name, &owner)?;
            let mut on_parent = self.frame_of(&parent, joint, &owner)?.inverse().then(&place);
            for x in &mut on_parent.translation.0 {
                *x = in_range(*x).ok_or_else(|| {
                    let reason = "its place in its parent link overflows";
                    self.document.refuse(joint, &owner, reason, "correct the numbers of its <pose>")
                })?;
            }
            let stated = joint::read(self.document, self.frames, joint, (&name, place), self.version)?;
            let (stiffness, rest) = stated.spring.unwrap_or_default();
            for (element, key, value) in [
                ("viscous", "coefficient", stated.damping),
                ("coulomb", "effort", stated.friction),
                ("spring", "stiffness", stiffness),
                ("spring", "kq0", stiffness * rest),
            ] {
                if value != 0.0 {
                    self.elements.settings.push(ElementSetting {
                        joint: name.clone(),
                        element: element.to_owned(),
                        key: key.to_owned(),
                        value: SettingValue::Number(value),
                    });
                }
            }
            if let Some((stiffness, rest)) = stated.spring {
                self.elements.beside.push((name.clone(), "spring".to_owned()));
                self.warnings.push(format!(
                    "{owner}: its spring ({stiffness} around {rest}) is its element `spring`, which is identified"
                ));
            }
            if stated.one_end {
                self.warnings
                    .push(format!("{owner}: one end of its range alone is limited: taken for no limit"));
            }
            self.description.joints.push(JointDescription {
                name,
                parent,
                child,
                kind: stated.kind,
                placement: on_parent,
                axis: stated.axis,
                limits: stated.limits,
                mimic: stated.mimic,
            });
        }
        Ok(())
    }

    /// Gravity in the axes of the root.
    fn gravity(&mut self, world: Option<&Element>) -> Result<(), RobotFileError> {
        let in_world = match world {
            None => Vec3(self.description.gravity),
            Some(world) => match self.document.child(world, "<world>", "gravity")? {
                Some(gravity) => {
                    let numbers = self.document.numbers(gravity, "<world>", 3)?;
                    Vec3([numbers[0], numbers[1], numbers[2]])
                }
                None => Vec3(GRAVITY_OF_WORLDS),
            },
        };
        let children: Vec<&String> = self.description.joints.iter().map(|j| &j.child).collect();
        let root = self.description.links.iter().map(|l| &l.name).find(|name| !children.contains(name));
        let root_in_world = match root {
            Some(root) if root != WORLD => {
                let place = self.frames.place(root, &self.document.root, "<model>")?;
                self.frames.model().then(&place)
            }
            _ => Placement::identity(),
        };
        self.description.gravity = root_in_world.rotation.tr_mul_vec(in_world).0;
        Ok(())
    }
}
