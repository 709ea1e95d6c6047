//! Elements of an XML text as a tree, read and written.

use std::fmt::Write;
use std::sync::Arc;

use dynid_files::excerpt::excerpt;
use quick_xml::XmlVersion;
use quick_xml::escape::{escape, unescape};
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use crate::robot_error::{Place, RobotFileError};

/// Deepest nesting of elements in a file.
const MAX_DEPTH: usize = 256;
/// Most elements in a file.
const MAX_ELEMENTS: usize = 500_000;

/// A place in one of the files.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    /// Number of the file.
    pub(super) file: usize,
    /// Bytes before it.
    pub(super) offset: usize,
}

/// An element.
#[derive(Clone, Debug)]
pub(super) struct Element {
    /// Its name with the prefix, as it is written.
    pub(super) name: String,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Node>,
    pub(super) at: At,
}

/// What stands in an element; comments are left out.
#[derive(Clone, Debug)]
pub(super) enum Node {
    Element(Arc<Element>),
    Text(String),
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(own, _)| own == name).map(|(_, value)| value.as_str())
    }

    /// The part of the name behind `xacro:`.
    pub(super) fn tag(&self) -> Option<&str> {
        self.name.strip_prefix("xacro:")
    }
}

/// Whether a text has an element of xacro, as far as it is XML.
pub(super) fn has_tags(text: &str) -> bool {
    let mut reader = Reader::from_str(text);
    reader.config_mut().allow_dangling_amp = true;
    loop {
        match reader.read_event() {
            Ok(Event::Start(start) | Event::Empty(start)) if start.name().0.starts_with("xacro:") => {
                return true;
            }
            Ok(Event::Eof) | Err(_) => return false,
            Ok(_) => {}
        }
    }
}

/// Reads the outermost element of a text; `file` numbers it in [`At`].
pub(super) fn parse(text: &str, name: &str, file: usize) -> Result<Arc<Element>, RobotFileError> {
    let mut reader = Reader::from_str(text);
    reader.config_mut().allow_dangling_amp = true;
    let place = |offset: usize| Place::of(name, text, offset);
    let syntax = |offset: usize, message: String| RobotFileError::Syntax { at: place(offset), message };
    let mut open: Vec<Element> = Vec::new();
    let mut elements = 0;
    loop {
        let from = reader.buffer_position() as usize;
        let event =
            reader.read_event().map_err(|e| syntax(reader.error_position() as usize, format!("XML: {e}")))?;
        let closed = match event {
            Event::Start(start) => {
                let element = element_of(&start, At { file, offset: from }).map_err(|e| syntax(from, e))?;
                elements += 1;
                let cap = |what, limit| RobotFileError::TooMany { at: place(from), what, limit };
                if open.len() >= MAX_DEPTH {
                    return Err(cap("levels of nested elements", MAX_DEPTH));
                }
                if elements > MAX_ELEMENTS {
                    return Err(cap("elements", MAX_ELEMENTS));
                }
                open.push(element);
                None
            }
            Event::Empty(start) => {
                elements += 1;
                if elements > MAX_ELEMENTS {
                    return Err(RobotFileError::TooMany {
                        at: place(from),
                        what: "elements",
                        limit: MAX_ELEMENTS,
                    });
                }
                Some(element_of(&start, At { file, offset: from }).map_err(|e| syntax(from, e))?)
            }
            Event::End(_) => open.pop(),
            Event::Text(text) => {
                push_text(&mut open, text.as_ref());
                None
            }
            Event::CData(text) => {
                push_text(&mut open, text.as_ref());
                None
            }
            Event::GeneralRef(reference) => {
                let written = format!("&{};", &*reference);
                let plain = unescape(&written).map_or_else(|_| written.clone(), |plain| plain.into_owned());
                push_text(&mut open, &plain);
                None
            }
            Event::Eof => {
                return Err(match open.last() {
                    Some(element) => syntax(
                        element.at.offset,
                        "XML: the element that opens here is never closed".to_owned(),
                    ),
                    None => RobotFileError::NotARobot {
                        at: place(0),
                        found: format!("`{}`", excerpt(text.trim())),
                    },
                });
            }
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => None,
        };
        if let Some(element) = closed {
            let element = Arc::new(element);
            match open.last_mut() {
                Some(parent) => parent.children.push(Node::Element(element)),
                None => return Ok(element),
            }
        }
    }
}

fn push_text(open: &mut [Element], text: &str) {
    let Some(parent) = open.last_mut() else { return };
    match parent.children.last_mut() {
        Some(Node::Text(before)) => before.push_str(text),
        _ => parent.children.push(Node::Text(text.to_owned())),
    }
}

fn element_of(start: &BytesStart<'_>, at: At) -> Result<Element, String> {
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|e| format!("XML: {e}"))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| format!("XML: {e}"))?;
        attributes.push((attribute.key.0.to_owned(), value.into_owned()));
    }
    Ok(Element { name: start.name().0.to_owned(), attributes, children: Vec::new(), at })
}

/// Writes an element and what is in it, two spaces a level. Texts of spaces alone are left out.
pub(super) fn write(element: &Element, level: usize, out: &mut String) {
    let indent = "  ".repeat(level);
    let _ = write!(out, "{indent}<{}", element.name);
    for (name, value) in &element.attributes {
        let _ = write!(out, " {name}=\"{}\"", escape(value.as_str()));
    }
    let is_blank = |node: &Node| matches!(node, Node::Text(text) if text.trim().is_empty());
    let content: Vec<&Node> = element.children.iter().filter(|node| !is_blank(node)).collect();
    match content.as_slice() {
        [] => out.push_str("/>\n"),
        [Node::Text(text)] => {
            let _ = writeln!(out, ">{}</{}>", escape(text.as_str()), element.name);
        }
        _ => {
            out.push_str(">\n");
            for node in content {
                match node {
                    Node::Element(inner) => write(inner, level + 1, out),
                    Node::Text(text) => {
                        let _ = writeln!(out, "{indent}  {}", escape(text.trim()));
                    }
                }
            }
            let _ = writeln!(out, "{indent}</{}>", element.name);
        }
    }
}
