//! URDF to a [`Description`].

use std::collections::HashMap;
use std::path::Path;

use dynid_files::excerpt::excerpt;
use dynid_model::{
    Description, Inertia, JointDescription, JointKind, Limits, LinkDescription, Mat3, Mimic, Placement, Vec3,
};

use super::xml::{Attribute, Tag, Tags};
use crate::plain::Plain;
use crate::robot_error::{Place, RobotFileError};
use crate::robot_numbers::{LEAST_LIMIT, is_in_range};

/// Reads a URDF file of at most 64 MiB. See [`parse`].
///
/// # Errors
/// [`RobotFileError`].
pub fn read(path: impl AsRef<Path>) -> Result<Description, RobotFileError> {
    let plain = Plain::read(path.as_ref())?;
    parse(&plain.text, &plain.name)
}

/// Reads URDF text; `source_name` stands in messages.
///
/// - Links and joints keep the order of the file. Kinds: revolute, continuous, prismatic, fixed, floating.
/// - `<inertial>`: centre of mass `c` = `origin xyz`, `I_c = R(rpy) I R(rpy)ᵀ`, moved to the link frame. A link without
///   `<inertial>` has inertia `None`; one that states mass 0 has `Some`.
/// - Joint: placement = `<origin>` (default identity), axis = `<axis>` (default 1 0 0, any length).
/// - `<limit>`: `lower`/`upper` of revolute and prismatic joints (one alone: the other is 0, as URDF says; neither: no
///   limit); `velocity`, `effort` unless zero or negative, which public files use for "not stated".
/// - `<mimic>` is recorded; `<dynamics>`, `<visual>`, `<collision>`, `<transmission>`, simulator extensions and all
///   unknown elements are passed over.
///
/// # Errors
/// [`RobotFileError`] with line and column. The graph (parents, cycles, roots) is not checked here.
pub fn parse(text: &str, source_name: &str) -> Result<Description, RobotFileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let reader = Reader { text, file: source_name, wanted: is_read };
    let robot = reader.tree()?;
    let name = robot.attributes.iter().find(|a| a.name == "name").map_or("robot", |a| a.value.as_str());
    let mut description = Description::new(name);
    let mut links = HashMap::new();
    let mut joints = HashMap::new();
    for element in &robot.children {
        let kind = if element.name == "link" { "link" } else { "joint" };
        let label = element.text("name");
        let name = match label {
            Some(a) if !a.value.trim().is_empty() => a.value.clone(),
            _ => {
                let (owner, expected) = (format!("<{kind}>"), "an attribute `name`".to_owned());
                return Err(RobotFileError::Missing { at: reader.place(element.offset), owner, expected });
            }
        };
        let seen = if kind == "link" { &mut links } else { &mut joints };
        if let Some(first) = seen.insert(name.clone(), element.offset) {
            let (at, first_line) = (reader.place(element.offset), reader.place(first).line);
            return Err(RobotFileError::Duplicate { at, kind, name: excerpt(&name), first_line });
        }
        if kind == "link" {
            description.links.push(reader.link(element, name)?);
        } else {
            description.joints.push(reader.joint(element, name)?);
        }
    }
    if description.links.is_empty() {
        let (owner, expected) = ("<robot>".to_owned(), "at least one <link>".to_owned());
        return Err(RobotFileError::Missing { at: reader.place(robot.offset), owner, expected });
    }
    Ok(description)
}

/// An element of the parts of a URDF that are read.
pub(super) struct Element {
    pub(super) name: String,
    pub(super) offset: usize,
    attributes: Vec<Attribute>,
    pub(super) children: Vec<Element>,
}

impl Element {
    pub(super) fn text(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }
}

/// Whether an element inside `parent` is read.
fn is_read(depth: usize, parent: &str, name: &str) -> bool {
    match depth {
        1 => matches!(name, "link" | "joint"),
        2 if parent == "link" => name == "inertial",
        2 => matches!(name, "origin" | "parent" | "child" | "axis" | "limit" | "mimic"),
        3 if parent == "inertial" => matches!(name, "origin" | "mass" | "inertia"),
        _ => false,
    }
}

/// What reads elements and attributes of a text.
pub(super) struct Reader<'a> {
    pub(super) text: &'a str,
    pub(super) file: &'a str,
    /// Whether an element of this depth, inside this parent, with this name is read.
    pub(super) wanted: fn(usize, &str, &str) -> bool,
}

impl Reader<'_> {
    pub(super) fn place(&self, offset: usize) -> Place {
        Place::of(self.file, self.text, offset)
    }

    /// The elements that are read, as a tree.
    pub(super) fn tree(&self) -> Result<Element, RobotFileError> {
        let mut tags = Tags::new(self.text, self.file);
        let mut kept: Vec<Element> = Vec::new();
        let mut root = None;
        // Depth of the outermost element that is being passed over.
        let mut skipped: Option<usize> = None;
        while let Some((range, tag)) = tags.next()? {
            match tag {
                Tag::Open { start, empty } => {
                    let depth = tags.depth() - usize::from(!empty);
                    if skipped.is_some() {
                        continue;
                    }
                    let name = start.name().0.to_owned();
                    if depth == 0 && name != "robot" {
                        let (at, found) = (self.place(range.start), format!("<{}>", excerpt(&name)));
                        return Err(RobotFileError::NotARobot { at, found });
                    }
                    let parent = kept.last().map_or("", |e| e.name.as_str());
                    if depth > 0 && !(self.wanted)(depth, parent, &name) {
                        skipped = (!empty).then_some(depth);
                        continue;
                    }
                    let attributes = tags.attributes(&start, range.start)?;
                    let element = Element { name, offset: range.start, attributes, children: Vec::new() };
                    if empty { attach(&mut kept, &mut root, element) } else { kept.push(element) }
                }
                Tag::Close => match skipped {
                    Some(depth) if tags.depth() == depth => skipped = None,
                    Some(_) => {}
                    None => {
                        if let Some(element) = kept.pop() {
                            attach(&mut kept, &mut root, element);
                        }
                    }
                },
            }
        }
        root.ok_or_else(|| RobotFileError::NotARobot { at: self.place(0), found: "nothing".to_owned() })
    }

    /// The only child with a name, if there is one.
    pub(super) fn child<'e>(
        &self,
        element: &'e Element,
        owner: &str,
        name: &str,
    ) -> Result<Option<&'e Element>, RobotFileError> {
        let mut all = element.children.iter().filter(|c| c.name == name);
        let first = all.next();
        if let Some(second) = all.next() {
            let (owner, what) = (owner.to_owned(), format!("<{name}>"));
            return Err(RobotFileError::Repeated { at: self.place(second.offset), owner, what });
        }
        Ok(first)
    }

    fn required_child<'e>(
        &self,
        element: &'e Element,
        owner: &str,
        name: &str,
    ) -> Result<&'e Element, RobotFileError> {
        self.child(element, owner, name)?.ok_or_else(|| RobotFileError::Missing {
            at: self.place(element.offset),
            owner: owner.to_owned(),
            expected: format!("an element <{name}>"),
        })
    }

    pub(super) fn required<'e>(
        &self,
        element: &'e Element,
        owner: &str,
        name: &str,
    ) -> Result<&'e Attribute, RobotFileError> {
        element.text(name).ok_or_else(|| RobotFileError::Missing {
            at: self.place(element.offset),
            owner: owner.to_owned(),
            expected: format!("an attribute `{name}` of <{}>", element.name),
        })
    }

    pub(super) fn value(
        &self,
        element: &Element,
        owner: &str,
        a: &Attribute,
        expected: &str,
    ) -> RobotFileError {
        RobotFileError::Value {
            at: self.place(a.offset),
            owner: owner.to_owned(),
            field: format!("<{}> {}", element.name, a.name),
            expected: expected.to_owned(),
            found: excerpt(&a.value),
        }
    }

    pub(super) fn number(
        &self,
        element: &Element,
        owner: &str,
        a: &Attribute,
    ) -> Result<f64, RobotFileError> {
        finite(&a.value).ok_or_else(|| self.value(element, owner, a, "a finite number up to 1e30"))
    }

    fn optional_number(
        &self,
        element: &Element,
        owner: &str,
        name: &str,
    ) -> Result<Option<f64>, RobotFileError> {
        element.text(name).map(|a| self.number(element, owner, a)).transpose()
    }

    pub(super) fn vector(
        &self,
        element: &Element,
        owner: &str,
        name: &str,
    ) -> Result<Option<[f64; 3]>, RobotFileError> {
        let Some(a) = element.text(name) else { return Ok(None) };
        let mut out = [0.0; 3];
        let mut words = a.value.split_ascii_whitespace();
        for x in &mut out {
            *x = words
                .next()
                .and_then(finite)
                .ok_or_else(|| self.value(element, owner, a, "three finite numbers up to 1e30"))?;
        }
        if words.next().is_some() {
            return Err(self.value(element, owner, a, "three finite numbers up to 1e30"));
        }
        Ok(Some(out))
    }

    pub(super) fn origin(
        &self,
        element: &Element,
        owner: &str,
    ) -> Result<([f64; 3], [f64; 3]), RobotFileError> {
        let Some(origin) = self.child(element, owner, "origin")? else { return Ok(([0.0; 3], [0.0; 3])) };
        let xyz = self.vector(origin, owner, "xyz")?.unwrap_or_default();
        let rpy = self.vector(origin, owner, "rpy")?.unwrap_or_default();
        Ok((xyz, rpy))
    }

    fn link(&self, element: &Element, name: String) -> Result<LinkDescription, RobotFileError> {
        let owner = format!("link `{}`", excerpt(&name));
        let inertia = match self.child(element, &owner, "inertial")? {
            Some(inertial) => Some(self.inertial(inertial, &owner)?),
            None => None,
        };
        Ok(LinkDescription { name, inertia })
    }

    fn inertial(&self, inertial: &Element, owner: &str) -> Result<Inertia, RobotFileError> {
        let (com, rpy) = self.origin(inertial, owner)?;
        let mass_element = self.required_child(inertial, owner, "mass")?;
        let mass = self.number(mass_element, owner, self.required(mass_element, owner, "value")?)?;
        let tensor = self.required_child(inertial, owner, "inertia")?;
        let entry = |name| self.number(tensor, owner, self.required(tensor, owner, name)?);
        let (xx, xy, xz) = (entry("ixx")?, entry("ixy")?, entry("ixz")?);
        let (yy, yz, zz) = (entry("iyy")?, entry("iyz")?, entry("izz")?);
        let stated = Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
        let r = Mat3::from_rpy(rpy);
        // Skipping the rotation where it is the identity keeps the file's numbers to the last bit.
        let about_com = if rpy == [0.0; 3] { stated } else { r.mul_mat(&stated).mul_mat(&r.transpose()) };
        let inertia = Inertia::from_com(mass, Vec3(com), &about_com);
        if inertia.0.iter().all(|x| x.is_finite()) {
            return Ok(inertia);
        }
        let a = self.required(mass_element, owner, "value")?;
        Err(self.value(mass_element, owner, a, "an inertia about the link frame that does not overflow"))
    }

    fn joint(&self, element: &Element, name: String) -> Result<JointDescription, RobotFileError> {
        let owner = format!("joint `{}`", excerpt(&name));
        let stated = self.required(element, &owner, "type")?;
        let kind = match stated.value.trim() {
            "revolute" => JointKind::Revolute,
            "continuous" => JointKind::Continuous,
            "prismatic" => JointKind::Prismatic,
            "fixed" => JointKind::Fixed,
            "floating" => JointKind::Floating,
            other => {
                let (at, found) = (self.place(stated.offset), excerpt(other));
                return Err(RobotFileError::JointKind { at, joint: excerpt(&name), found });
            }
        };
        let link = |end| {
            let element = self.required_child(element, &owner, end)?;
            Ok(self.required(element, &owner, "link")?.value.clone())
        };
        let (parent, child) = (link("parent")?, link("child")?);
        let (xyz, rpy) = self.origin(element, &owner)?;
        let axis = match self.child(element, &owner, "axis")? {
            Some(axis) => self.vector(axis, &owner, "xyz")?,
            None => None,
        };
        Ok(JointDescription {
            parent,
            child,
            kind,
            placement: Placement::from_xyz_rpy(xyz, rpy),
            axis: axis.unwrap_or([1.0, 0.0, 0.0]),
            limits: self.limits(element, &owner, kind)?,
            mimic: self.mimic(element, &owner)?,
            name,
        })
    }

    fn limits(&self, joint: &Element, owner: &str, kind: JointKind) -> Result<Limits, RobotFileError> {
        let Some(limit) = self.child(joint, owner, "limit")? else { return Ok(Limits::default()) };
        let lower = self.optional_number(limit, owner, "lower")?;
        let upper = self.optional_number(limit, owner, "upper")?;
        let bounded = matches!(kind, JointKind::Revolute | JointKind::Prismatic);
        let position = match (lower, upper) {
            (None, None) => None,
            _ if !bounded => None,
            (lower, upper) => Some((lower.unwrap_or(0.0), upper.unwrap_or(0.0))),
        };
        if let (Some((low, high)), Some(a)) = (position, limit.text("lower").or(limit.text("upper")))
            && low > high
        {
            return Err(self.value(limit, owner, a, &format!("lower <= upper, with upper {high}")));
        }
        let positive = |name: &str| -> Result<Option<f64>, RobotFileError> {
            let found = self.optional_number(limit, owner, name)?.filter(|x| *x > 0.0);
            match (found.filter(|x| *x < LEAST_LIMIT), limit.text(name)) {
                (Some(_), Some(a)) => {
                    Err(self.value(limit, owner, a, &format!("0 (no limit) or at least {LEAST_LIMIT:e}")))
                }
                _ => Ok(found),
            }
        };
        Ok(Limits { position, velocity: positive("velocity")?, effort: positive("effort")? })
    }

    fn mimic(&self, joint: &Element, owner: &str) -> Result<Option<Mimic>, RobotFileError> {
        let Some(mimic) = self.child(joint, owner, "mimic")? else { return Ok(None) };
        Ok(Some(Mimic {
            of: self.required(mimic, owner, "joint")?.value.clone(),
            ratio: self.optional_number(mimic, owner, "multiplier")?.unwrap_or(1.0),
            offset: self.optional_number(mimic, owner, "offset")?.unwrap_or(0.0),
        }))
    }
}

fn attach(kept: &mut [Element], root: &mut Option<Element>, element: Element) {
    match kept.last_mut() {
        Some(parent) => parent.children.push(element),
        None => *root = Some(element),
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|x| is_in_range(*x))
}
