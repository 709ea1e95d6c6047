//! The elements of an SDF text, with the places that messages name.

use dynid_files::excerpt::excerpt;
use quick_xml::escape::unescape;

use crate::robot_error::{Place, RobotFileError};
use crate::robot_numbers::is_in_range;
use crate::urdf::xml::{Attribute, Tag, Tags};

/// Elements that say nothing of motion, passed over with all that they hold.
const PASSED_OVER: [&str; 12] = [
    "actor",
    "audio_source",
    "collision",
    "gui",
    "light",
    "particle_emitter",
    "plugin",
    "projector",
    "scene",
    "sensor",
    "state",
    "visual",
];

/// An element with what is in it.
#[derive(Debug, Default)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Element>,
    /// Its text, if it has no elements; without comments and blanks around.
    pub(super) text: String,
    /// Byte of its opening tag.
    offset: usize,
    /// Byte behind its opening tag.
    inside: usize,
}

impl Element {
    /// Value of an attribute; one that is empty says nothing.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|a| a.name == name)?.value.trim();
        (!found.is_empty()).then_some(found)
    }

    /// The children of a name.
    pub(super) fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Element> {
        self.children.iter().filter(move |child| child.name == name)
    }
}

/// A text that has been taken apart.
pub(super) struct Document<'a> {
    pub(super) root: Element,
    text: &'a str,
    file: &'a str,
}

impl<'a> Document<'a> {
    /// Takes a text apart; `file` stands in messages.
    pub(super) fn parse(text: &'a str, file: &'a str) -> Result<Self, RobotFileError> {
        let mut tags = Tags::new(text, file);
        let mut open: Vec<Element> = Vec::new();
        let mut root = None;
        // Depth of the element that is passed over.
        let mut passed: Option<usize> = None;
        while let Some((range, tag)) = tags.next()? {
            match tag {
                Tag::Open { start, empty } => {
                    let depth = tags.depth() - usize::from(!empty);
                    if passed.is_some() {
                        continue;
                    }
                    if PASSED_OVER.contains(&start.name().0) {
                        passed = (!empty).then_some(depth);
                        continue;
                    }
                    let element = Element {
                        name: start.name().0.to_owned(),
                        attributes: tags.attributes(&start, range.start)?,
                        offset: range.start,
                        inside: range.end,
                        ..Element::default()
                    };
                    match empty {
                        true => put(&mut open, &mut root, element),
                        false => open.push(element),
                    }
                }
                Tag::Close if passed.is_some() => {
                    if passed == Some(tags.depth()) {
                        passed = None;
                    }
                }
                Tag::Close => {
                    if let Some(mut element) = open.pop() {
                        if element.children.is_empty() {
                            element.text = plain(&text[element.inside..range.start]);
                        }
                        put(&mut open, &mut root, element);
                    }
                }
            }
        }
        let root = root.unwrap_or_default();
        match root.name.as_str() {
            "sdf" => Ok(Document { root, text, file }),
            other => {
                let found = format!("<{}>", excerpt(other));
                Err(RobotFileError::NotARobot { at: Place::of(file, text, root.offset), found })
            }
        }
    }

    pub(super) fn place(&self, of: &Element) -> Place {
        Place::of(self.file, self.text, of.offset)
    }

    /// The name that an element must have.
    pub(super) fn name(&self, of: &Element) -> Result<String, RobotFileError> {
        of.attribute("name").map(str::to_owned).ok_or_else(|| RobotFileError::Missing {
            at: self.place(of),
            owner: format!("<{}>", excerpt(&of.name)),
            expected: "an attribute `name`".to_owned(),
        })
    }

    /// The one child of a name, if there is any.
    pub(super) fn child<'e>(
        &self,
        of: &'e Element,
        owner: &str,
        name: &str,
    ) -> Result<Option<&'e Element>, RobotFileError> {
        let mut found = of.children.iter().filter(|child| child.name == name);
        let first = found.next();
        match found.next() {
            None => Ok(first),
            Some(second) => Err(RobotFileError::Repeated {
                at: self.place(second),
                owner: owner.to_owned(),
                what: format!("<{name}>"),
            }),
        }
    }

    /// The text of a child that must be there.
    pub(super) fn required<'e>(
        &self,
        of: &'e Element,
        owner: &str,
        name: &str,
    ) -> Result<(&'e Element, &'e str), RobotFileError> {
        let found = self.child(of, owner, name)?;
        found.filter(|child| !child.text.is_empty()).map(|child| (child, child.text.as_str())).ok_or_else(
            || RobotFileError::Missing {
                at: self.place(found.unwrap_or(of)),
                owner: owner.to_owned(),
                expected: format!("<{name}>"),
            },
        )
    }

    /// The number in a child, if there is one.
    pub(super) fn number(
        &self,
        of: &Element,
        owner: &str,
        name: &str,
    ) -> Result<Option<f64>, RobotFileError> {
        let Some(child) = self.child(of, owner, name)? else { return Ok(None) };
        match child.text.parse::<f64>().ok().filter(|x| is_in_range(*x)) {
            Some(number) => Ok(Some(number)),
            None => Err(self.value(child, owner, "a finite number")),
        }
    }

    /// As many numbers as an element must hold.
    pub(super) fn numbers(
        &self,
        of: &Element,
        owner: &str,
        count: usize,
    ) -> Result<Vec<f64>, RobotFileError> {
        let parsed: Option<Vec<f64>> = of
            .text
            .split_ascii_whitespace()
            .map(|x| x.parse::<f64>().ok().filter(|x| is_in_range(*x)))
            .collect();
        parsed
            .filter(|numbers| numbers.len() == count)
            .ok_or_else(|| self.value(of, owner, &format!("{count} finite numbers")))
    }

    /// `true` or `1`, `false` or `0`.
    pub(super) fn flag(&self, of: &Element, owner: &str, name: &str) -> Result<Option<bool>, RobotFileError> {
        match self.child(of, owner, name)? {
            None => Ok(None),
            Some(child) => match child.text.to_lowercase().as_str() {
                "true" | "1" => Ok(Some(true)),
                "false" | "0" => Ok(Some(false)),
                _ => Err(self.value(child, owner, "true or false")),
            },
        }
    }

    /// The error for an element whose text is not what it must be.
    pub(super) fn value(&self, of: &Element, owner: &str, expected: &str) -> RobotFileError {
        RobotFileError::Value {
            at: self.place(of),
            owner: owner.to_owned(),
            field: format!("<{}>", excerpt(&of.name)),
            expected: expected.to_owned(),
            found: excerpt(&of.text),
        }
    }

    /// The error for what has no place here.
    pub(super) fn refuse(
        &self,
        of: &Element,
        owner: &str,
        reason: impl Into<String>,
        hint: &'static str,
    ) -> RobotFileError {
        let (at, owner) = (self.place(of), owner.to_owned());
        RobotFileError::NotCarried { at, owner, reason: reason.into(), hint }
    }
}

fn put(open: &mut [Element], root: &mut Option<Element>, element: Element) {
    match open.last_mut() {
        Some(outer) => outer.children.push(element),
        None => *root = Some(element),
    }
}

/// The text of an element without elements.
fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, comment)) = rest.split_once("<!--") {
        out.push_str(before);
        rest = comment.split_once("-->").map_or("", |(_, behind)| behind);
    }
    out.push_str(rest);
    let text = out.trim();
    unescape(text).map_or_else(|_| text.to_owned(), |text| text.trim().to_owned())
}
