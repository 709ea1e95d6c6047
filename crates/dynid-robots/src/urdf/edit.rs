//! Edits of an existing URDF that leave every other byte alone.

use std::collections::HashMap;
use std::fmt::Write;
use std::ops::Range;

use dynid_files::excerpt::closest;
use dynid_model::Inertia;
use quick_xml::escape::escape;

use super::inertial::Inertial;
use super::xml::{Attribute, Tag, Tags};
use crate::robot_error::{Place, RobotFileError};

/// Dissipation of a joint as `<dynamics>` states it.
#[derive(Clone, Debug, PartialEq)]
pub struct JointDynamics {
    /// Joint.
    pub joint: String,
    /// Viscous friction, N m s/rad or N s/m.
    pub damping: f64,
    /// Coulomb friction, N m or N.
    pub friction: f64,
}

/// Replaces the `<inertial>` of some links and the `<dynamics>` of some joints in URDF text.
///
/// `links`: the new inertia about the link frame, written as centre of mass and tensor about it in link axes; inserted
/// where the link had none; `None` removes the element. `joints`: `damping` and `friction` are set, other attributes of
/// an existing `<dynamics>` are kept. Everything else of the result is byte for byte the input.
///
/// # Errors
/// [`RobotFileError`]: the text is not a URDF, has no such link or joint, or an inertia cannot be stated in URDF.
pub fn edit(
    text: &str,
    source_name: &str,
    links: &[(String, Option<Inertia>)],
    joints: &[JointDynamics],
) -> Result<String, RobotFileError> {
    let body = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut editor = Editor {
        text: body,
        newline: if text.contains("\r\n") { "\r\n" } else { "\n" },
        links: links.iter().map(|(name, inertia)| (name.as_str(), inertia)).collect(),
        joints: joints.iter().map(|d| (d.joint.as_str(), d)).collect(),
        splices: Vec::new(),
    };
    let (seen_links, seen_joints) = editor.scan(source_name)?;
    for (kind, wanted, seen) in [
        ("link", links.iter().map(|(n, _)| n).collect::<Vec<_>>(), &seen_links),
        ("joint", joints.iter().map(|d| &d.joint).collect::<Vec<_>>(), &seen_joints),
    ] {
        if let Some(name) = wanted.into_iter().find(|n| !seen.contains(n)) {
            return Err(RobotFileError::UnknownName {
                at: Place::start(source_name),
                context: "edit".to_owned(),
                kind,
                name: name.clone(),
                meant: closest(name, seen).map(str::to_owned),
            });
        }
    }
    let mark = &text[..text.len() - body.len()];
    Ok(format!("{mark}{}", editor.spliced()))
}

/// A link or joint that is being passed through.
struct Open<'a> {
    edit: Edit<'a>,
    /// Name as the file writes it.
    name: String,
    /// Opening tag of the element.
    tag: Range<usize>,
    /// Start and attributes of the child element that is being replaced.
    child: Option<(usize, Vec<Attribute>)>,
    done: bool,
}

#[derive(Clone, Copy)]
enum Edit<'a> {
    Link(&'a Option<Inertia>),
    Joint(&'a JointDynamics),
}

impl Edit<'_> {
    fn child(self) -> &'static str {
        match self {
            Edit::Link(_) => "inertial",
            Edit::Joint(_) => "dynamics",
        }
    }
}

struct Editor<'a> {
    text: &'a str,
    newline: &'static str,
    links: HashMap<&'a str, &'a Option<Inertia>>,
    joints: HashMap<&'a str, &'a JointDynamics>,
    /// Ranges to replace, in order.
    splices: Vec<(Range<usize>, String)>,
}

impl<'a> Editor<'a> {
    /// Collects the splices; returns the names of the links and joints met.
    fn scan(&mut self, source_name: &str) -> Result<(Vec<String>, Vec<String>), RobotFileError> {
        let mut tags = Tags::new(self.text, source_name);
        let (mut links, mut joints) = (Vec::new(), Vec::new());
        let mut open: Option<Open<'a>> = None;
        while let Some((range, tag)) = tags.next()? {
            match tag {
                Tag::Open { start, empty } => {
                    let depth = tags.depth() - usize::from(!empty);
                    let element = start.name().0;
                    if depth == 1 && matches!(element, "link" | "joint") {
                        let attributes = tags.attributes(&start, range.start)?;
                        let name = attributes.into_iter().find(|a| a.name == "name").map(|a| a.value);
                        let name = name.unwrap_or_default();
                        let edit = if element == "link" {
                            links.push(name.clone());
                            self.links.get(name.as_str()).map(|i| Edit::Link(i))
                        } else {
                            joints.push(name.clone());
                            self.joints.get(name.as_str()).map(|d| Edit::Joint(d))
                        };
                        let Some(edit) = edit else { continue };
                        let this = Open { edit, name, tag: range, child: None, done: false };
                        if empty { self.fill_empty(&this, element)? } else { open = Some(this) }
                    } else if depth == 2
                        && let Some(this) = &mut open
                        && element == this.edit.child()
                    {
                        let attributes = tags.attributes(&start, range.start)?;
                        this.child = Some((range.start, attributes));
                        if empty {
                            self.replace_child(this, range.end)?;
                        }
                    }
                }
                Tag::Close if tags.depth() == 2 => {
                    if let Some(this) = &mut open {
                        self.replace_child(this, range.end)?;
                    }
                }
                Tag::Close if tags.depth() == 1 => {
                    if let Some(this) = open.take().filter(|o| !o.done) {
                        self.insert_child(&this)?;
                    }
                }
                Tag::Close => {}
            }
        }
        Ok((links, joints))
    }

    /// The new child element, or `None` if there shall be none.
    fn element(
        &self,
        this: &Open<'_>,
        kept: &[Attribute],
        indent: &str,
    ) -> Result<Option<String>, RobotFileError> {
        let unwritable = |what, reason| RobotFileError::Unwritable {
            format: "URDF",
            what,
            name: this.name.clone(),
            reason,
        };
        match this.edit {
            Edit::Link(None) => Ok(None),
            Edit::Link(Some(inertia)) => {
                let inertial = Inertial::of(inertia).map_err(|reason| unwritable("link", reason))?;
                Ok(Some(inertial.element(indent, self.newline)))
            }
            Edit::Joint(JointDynamics { damping, friction, .. }) => {
                if !(damping.is_finite() && friction.is_finite()) {
                    return Err(unwritable("joint", "damping or friction is not finite".to_owned()));
                }
                let mut element = format!("<dynamics damping=\"{damping:?}\" friction=\"{friction:?}\"");
                for a in kept.iter().filter(|a| a.name != "damping" && a.name != "friction") {
                    let _ = write!(element, " {}=\"{}\"", a.name, escape(a.value.as_str()));
                }
                element.push_str("/>");
                Ok(Some(element))
            }
        }
    }

    /// Splices the new child over the old one that ends at `end`, or away with its line.
    fn replace_child(&mut self, this: &mut Open<'_>, end: usize) -> Result<(), RobotFileError> {
        let Some((start, attributes)) = this.child.take() else { return Ok(()) };
        let first = !std::mem::replace(&mut this.done, true);
        let element = if first { self.element(this, &attributes, self.indent(start))? } else { None };
        match element {
            Some(element) => self.splices.push((start..end, element)),
            None => {
                let blank = self.text[..start].trim_end_matches([' ', '\t']).len();
                let from = match self.text[..blank].strip_suffix('\n') {
                    Some(rest) => rest.strip_suffix('\r').unwrap_or(rest).len(),
                    None => start,
                };
                self.splices.push((from..end, String::new()));
            }
        }
        Ok(())
    }

    /// Adds the new child right behind the opening tag.
    fn insert_child(&mut self, this: &Open<'_>) -> Result<(), RobotFileError> {
        let indent = format!("{}  ", self.indent(this.tag.start));
        if let Some(element) = self.element(this, &[], &indent)? {
            let end = this.tag.end;
            self.splices.push((end..end, format!("{}{indent}{element}", self.newline)));
        }
        Ok(())
    }

    /// Opens `<link ../>` up to take the new child.
    fn fill_empty(&mut self, this: &Open<'_>, name: &str) -> Result<(), RobotFileError> {
        let outer = self.indent(this.tag.start).to_owned();
        let indent = format!("{outer}  ");
        if let Some(element) = self.element(this, &[], &indent)? {
            let end = this.tag.end;
            let newline = self.newline;
            self.splices
                .push((end - 2..end, format!(">{newline}{indent}{element}{newline}{outer}</{name}>")));
        }
        Ok(())
    }

    /// The blanks before `offset` on its line, or nothing if something else stands there.
    fn indent(&self, offset: usize) -> &'a str {
        let line = self.text[..offset].rfind('\n').map_or(0, |k| k + 1);
        let before = &self.text[line..offset];
        if before.trim().is_empty() { before } else { "" }
    }

    fn spliced(&self) -> String {
        let mut out = String::with_capacity(self.text.len() + 256 * self.splices.len());
        let mut from = 0;
        for (range, replacement) in &self.splices {
            out.push_str(&self.text[from..range.start]);
            out.push_str(replacement);
            from = range.end;
        }
        out.push_str(&self.text[from..]);
        out
    }
}
