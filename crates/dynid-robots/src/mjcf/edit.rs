//! Edits of an existing MJCF that leave every other byte alone.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use dynid_files::excerpt::closest;
use dynid_model::{Inertia, JointKind, Mat3, Placement, Vec3, symmetric};

use super::compiler::Compiler;
use super::document::{Document, EditedFile, Element};
use super::model::{BodyPart, JointPart, Model};
use super::orientation::quaternion;
use super::read::model;
use super::{GearJoint, JointParameters, STICKING, escaped, unwritable};
use crate::robot_error::{Place, RobotFileError};
use crate::urdf::inertial::Inertial;

/// Replaces the inertia of some links, and friction and rotor of some joints, in an MJCF; gives the main file first, then included files
/// that change.
///
/// `links`: the new inertia about the link frame. It becomes an `<inertial>` with principal moments and axes in the body, in the place of one that is
/// there.
/// Where `<compiler>` would make something else of stated inertias (`inertiafromgeom="true"`, `balanceinertia`, bounds, a total
/// mass), these attributes are set to what leaves them alone, and every body that moves states its inertia. A massless link between the
/// joints of one body has no element and is left as it is. `joints`: `damping`, `frictionloss`, `armature`, `stiffness` and `springref` are set where they differ
/// from what the joint has already, other attributes are kept; a joint that sticks has `solreffriction` and `solimpfriction` added where it states none. A gear that gives way becomes a second joint behind its own, of the same type, axis and place, and
/// stands at 0 in all keyframes. Everything else is byte for byte the input.
///
/// # Errors
/// [`RobotFileError`]: the text is not MJCF, has no such link or joint, holds it as one copy of a `<replicate>` or outside of its folder,
/// or an inertia cannot be stated.
pub fn edit(
    text: &str,
    path: &Path,
    links: &[(String, Inertia)],
    joints: &[JointParameters],
) -> Result<Vec<EditedFile>, RobotFileError> {
    let document = Document::load(text, path, &[])?;
    let (model, _) = model(&document, path)?;
    let mut editor = Editor { document: &document, splices: HashMap::new() };
    let compiler = Compiler::of(&document)?;
    let known: Vec<&str> = model.description.links.iter().map(|l| l.name.as_str()).collect();
    for (link, inertia) in links {
        match model.bodies.iter().find(|b| b.link == *link) {
            Some(body) => editor.body(body, inertia)?,
            // Between two joints of one body.
            None if known.contains(&link.as_str()) && inertia.0.iter().all(|x| *x == 0.0) => {}
            None if known.contains(&link.as_str()) => {
                let reason = "it is between two joints of one body, and has no mass there".to_owned();
                return Err(unwritable("link", link, reason));
            }
            None => return Err(unknown(path, "link", link, &known)),
        }
    }
    for joint in joints {
        editor.joint(path, &model, joint)?;
    }
    editor.keyframes(&model, joints)?;
    if !links.is_empty() && !compiler.takes_inertias_as_stated() {
        let others = model.bodies.iter().filter(|b| !links.iter().any(|(name, _)| *name == b.link));
        for body in others {
            match model.inertia(&body.link) {
                Some(inertia) if model.frames[&body.link].moves => editor.body(body, &inertia)?,
                _ => {}
            }
        }
        editor.compiler(&compiler);
    }
    editor.files(text)
}

fn unknown(path: &Path, kind: &'static str, name: &str, known: &[&str]) -> RobotFileError {
    RobotFileError::UnknownName {
        at: Place::start(&path.display().to_string()),
        context: "edit".to_owned(),
        kind,
        name: name.to_owned(),
        meant: closest(name, known).map(str::to_owned),
    }
}

struct Editor<'a> {
    document: &'a Document,
    /// Ranges to replace, by file.
    splices: HashMap<usize, Vec<(Range<usize>, String)>>,
}

impl<'a> Editor<'a> {
    fn text(&self, element: &Element) -> &'a str {
        &self.document.files[element.file].text
    }

    fn splice(&mut self, file: usize, range: Range<usize>, text: String) {
        self.splices.entry(file).or_default().push((range, text));
    }

    /// The new inertia of a body, in the place of the old one or right behind its opening tag.
    fn body(&mut self, body: &BodyPart<'_>, inertia: &Inertia) -> Result<(), RobotFileError> {
        if body.copied {
            return Err(unwritable("link", &body.link, "it is one copy of a <replicate>".to_owned()));
        }
        let Inertial { mass, com, tensor } =
            Inertial::of(inertia).map_err(|reason| unwritable("link", &body.link, reason))?;
        // About the centre of mass, so that a distant frame costs no digits.
        let frame = body.inertial.map_or(Placement::identity(), |(_, frame)| frame);
        let r = frame.rotation.transpose();
        let [x, y, z] = r.mul_vec(Vec3(com) - body.shift - frame.translation).0;
        let turned = r.mul_mat(&Mat3::from_rows(tensor)).mul_mat(&frame.rotation);
        let tensor = if r == Mat3::identity() { tensor } else { turned.rows() };
        let inertial =
            format!("<inertial pos=\"{x:?} {y:?} {z:?}\" mass=\"{mass:?}\" {}/>", principal(&tensor));
        if let Some((old, _)) = body.inertial {
            self.splice(old.file, old.open.start..old.end, inertial);
            return Ok(());
        }
        let text = self.text(body.element);
        let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
        let outer = indent(text, body.element.open.start);
        let inner = body.element.children.iter().find(|c| c.file == body.element.file);
        let inner = inner.map(|c| indent(text, c.open.start)).filter(|i| !i.is_empty());
        let inner = inner.map_or_else(|| format!("{outer}  "), str::to_owned);
        let end = body.element.open.end;
        if body.element.empty {
            let name = &body.element.name;
            let filled = format!(">{newline}{inner}{inertial}{newline}{outer}</{name}>");
            self.splice(body.element.file, end - 2..end, filled);
        } else {
            self.splice(body.element.file, end..end, format!("{newline}{inner}{inertial}"));
        }
        Ok(())
    }

    /// Friction, rotor and spring of a joint.
    fn joint(
        &mut self,
        path: &Path,
        model: &Model<'a>,
        wanted: &JointParameters,
    ) -> Result<(), RobotFileError> {
        let Some(part) = model.joints.iter().find(|j| j.parameters.joint == wanted.joint) else {
            let known: Vec<&str> = model.joints.iter().map(|j| j.parameters.joint.as_str()).collect();
            return Err(unknown(path, "joint", &wanted.joint, &known));
        };
        if part.copied {
            return Err(unwritable("joint", &wanted.joint, "it is one copy of a <replicate>".to_owned()));
        }
        let found = &part.parameters;
        let values = [
            ("damping", wanted.damping, found.damping),
            ("frictionloss", wanted.friction_loss, found.friction_loss),
            ("armature", wanted.armature, found.armature),
            ("stiffness", wanted.stiffness, found.stiffness),
            ("springref", wanted.spring_reference / part.unit, found.spring_reference / part.unit),
        ];
        let mut added = String::new();
        for (key, value, before) in values {
            if !value.is_finite() {
                return Err(unwritable("joint", &wanted.joint, format!("{key} is not finite")));
            }
            if value != before {
                added += &self.set(part.element, key, &format!("{value:?}"));
            }
        }
        let sticks = wanted.sticks && wanted.friction_loss > 0.0;
        for (key, value) in STICKING.iter().filter(|(key, _)| sticks && part.element.attribute(key).is_none())
        {
            added += &self.set(part.element, key, value);
        }
        self.add(part.element, added);
        if let Some(gear) = &wanted.gear {
            self.gear(part, &wanted.joint, gear)?;
        }
        Ok(())
    }

    /// A gear that gives way, behind the joint that it is of.
    fn gear(&mut self, part: &JointPart<'a>, joint: &str, gear: &GearJoint) -> Result<(), RobotFileError> {
        if !gear.is_finite() {
            return Err(unwritable("joint", joint, "its gear has a number that is not finite".to_owned()));
        }
        let element = part.element;
        let text = self.text(element);
        let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
        let same: Vec<String> = ["class", "type", "axis", "pos", "group"]
            .into_iter()
            .filter_map(|key| Some(format!("{key}=\"{}\" ", escaped(element.text(key)?))))
            .collect();
        let name = GearJoint::name(joint);
        let (name, same, more) = (escaped(&name), same.concat(), gear.attributes(part.unit));
        let indent = indent(text, element.open.start);
        let written = format!("{newline}{indent}<joint name=\"{name}\" {same}{more}/>");
        self.splice(element.file, element.end..element.end, written);
        Ok(())
    }

    /// Zeros in keyframes for the positions and rates of new joints.
    fn keyframes(&mut self, model: &Model<'_>, joints: &[JointParameters]) -> Result<(), RobotFileError> {
        let (mut places, mut qpos, mut qvel) = (Vec::new(), 0, 0);
        for joint in model.description.joints.iter().filter(|j| j.kind != JointKind::Fixed) {
            let (positions, rates) = if joint.kind == JointKind::Floating { (7, 6) } else { (1, 1) };
            (qpos, qvel) = (qpos + positions, qvel + rates);
            if joints.iter().any(|p| p.joint == joint.name && p.gear.is_some()) {
                places.push((qpos, qvel));
            }
        }
        if places.is_empty() {
            return Ok(());
        }
        let document = self.document;
        for key in document.sections("keyframe").flat_map(|s| &s.children) {
            for (attribute, count, at) in [("qpos", qpos, 0), ("qvel", qvel, 1)] {
                let Some(value) = key.text(attribute) else { continue };
                let mut words: Vec<&str> = value.split_ascii_whitespace().collect();
                if words.len() != count {
                    let reason = format!("expected {count} numbers, one per position, found {}", words.len());
                    return Err(unwritable("keyframe", attribute, reason));
                }
                for place in places.iter().rev() {
                    words.insert(if at == 0 { place.0 } else { place.1 }, "0");
                }
                self.set(key, attribute, &words.join(" "));
            }
        }
        Ok(())
    }

    /// Leaves stated inertias alone.
    fn compiler(&mut self, compiler: &Compiler<'_>) {
        let harmless = [
            ("inertiafromgeom", "auto"),
            ("balanceinertia", "false"),
            ("boundmass", "0"),
            ("boundinertia", "0"),
            ("settotalmass", "-1"),
        ];
        for element in &compiler.elements {
            for (key, value) in harmless.iter().filter(|(key, _)| element.attribute(key).is_some()) {
                if element.text(key) != Some("false") {
                    self.set(element, key, value);
                }
            }
        }
    }

    /// Sets the value of an attribute that is there; gives the text of one that is still to be added.
    fn set(&mut self, element: &Element, key: &str, value: &str) -> String {
        match element.attribute(key).and_then(|a| value_range(self.text(element), a.offset)) {
            Some(range) => {
                self.splice(element.file, range, value.to_owned());
                String::new()
            }
            None => format!(" {key}=\"{value}\""),
        }
    }

    /// Adds attributes behind those of an element.
    fn add(&mut self, element: &Element, attributes: String) {
        if attributes.is_empty() {
            return;
        }
        let text = self.text(element);
        let last = element.attributes.iter().filter_map(|a| value_range(text, a.offset)).map(|r| r.end + 1);
        // Behind `<` and the name where there is none.
        let at = last.max().unwrap_or(element.open.start + 1 + element.name.len());
        self.splice(element.file, at..at, attributes);
    }

    /// The main file, and others that change.
    fn files(mut self, main: &str) -> Result<Vec<EditedFile>, RobotFileError> {
        let mut out = Vec::new();
        for (number, file) in self.document.files.iter().enumerate() {
            let splices = self.splices.remove(&number);
            if splices.is_none() && number > 0 {
                continue;
            }
            let below =
                Path::new(&file.name).components().all(|c| matches!(c, std::path::Component::Normal(_)));
            if !below {
                let reason = format!(
                    "what changes is in `{}`, which is not in the folder of the robot file or below",
                    file.name
                );
                return Err(unwritable("model", "file", reason));
            }
            let mark = if number == 0 { &main[..main.len() - file.text.len()] } else { "" };
            let text = format!("{mark}{}", spliced(&file.text, splices.unwrap_or_default()));
            out.push(EditedFile { name: file.name.clone(), text });
        }
        Ok(out)
    }
}

fn spliced(text: &str, mut splices: Vec<(Range<usize>, String)>) -> String {
    splices.sort_by_key(|(range, _)| (range.start, range.end));
    let mut out = String::with_capacity(text.len() + 256 * splices.len());
    let mut from = 0;
    for (range, replacement) in splices {
        out.push_str(&text[from..range.start]);
        out.push_str(&replacement);
        from = range.end;
    }
    out.push_str(&text[from..]);
    out
}

/// A tensor by its principal moments and axes: MuJoCo finds those of `fullinertia` to 1e-12 kg m² alone.
fn principal(tensor: &[[f64; 3]; 3]) -> String {
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = *tensor;
    if [xy, xz, yz] == [0.0; 3] {
        let [xx, yy, zz] = possible([xx, yy, zz]);
        return format!("diaginertia=\"{xx:?} {yy:?} {zz:?}\"");
    }
    let (moments, axes) = symmetric::eigen(tensor);
    let [a, b, c] = possible(moments);
    let [x, y, _] = Mat3::from_rows(axes).0;
    let [w, i, j, k] = quaternion(&Mat3([x, y, x.cross(y)]));
    format!("diaginertia=\"{a:?} {b:?} {c:?}\" quat=\"{w:?} {i:?} {j:?} {k:?}\"")
}

/// Principal moments that MuJoCo takes: of a flat body the largest one is the sum of the others, and rounding must not make it larger.
fn possible(mut moments: [f64; 3]) -> [f64; 3] {
    for k in 0..3 {
        let others = moments[(k + 1) % 3] + moments[(k + 2) % 3];
        if moments[k] > others && moments[k] <= others * (1.0 + 1e-9) {
            moments[k] = others;
        }
    }
    moments
}

/// The bytes between the quotes of an attribute whose name begins at an offset.
fn value_range(text: &str, offset: usize) -> Option<Range<usize>> {
    let quote = offset + text.get(offset..)?.find(['"', '\''])?;
    let mark = text[quote..].chars().next()?;
    let length = text[quote + 1..].find(mark)?;
    Some(quote + 1..quote + 1 + length)
}

/// The blanks before `offset` on its line, or nothing if something else stands there.
fn indent(text: &str, offset: usize) -> &str {
    let line = text[..offset].rfind('\n').map_or(0, |k| k + 1);
    let before = &text[line..offset];
    if before.trim().is_empty() { before } else { "" }
}
