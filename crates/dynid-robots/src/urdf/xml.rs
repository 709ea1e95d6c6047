//! Tags of an XML text with their byte ranges, read without recursion and within bounds.
//!
//! Namespaces are not resolved: public URDFs use undeclared prefixes inside simulator extensions.

use std::ops::Range;

use dynid_files::excerpt::excerpt;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use crate::robot_error::{Place, RobotFileError};

/// Deepest nesting of elements.
const MAX_DEPTH: usize = 256;
/// Most elements in a file.
const MAX_ELEMENTS: usize = 5_000_000;
/// Most attributes of one element.
const MAX_ATTRIBUTES: usize = 256;

/// An opening, closing or self-closing tag.
pub(crate) enum Tag<'a> {
    /// `<a ..>` or `<a ../>`.
    Open {
        /// Name and attributes.
        start: BytesStart<'a>,
        /// `<a ../>`: no closing tag follows.
        empty: bool,
    },
    /// `</a>`.
    Close,
}

/// One attribute with its entities resolved.
#[derive(Clone, Debug)]
pub(crate) struct Attribute {
    pub(crate) name: String,
    pub(crate) value: String,
    /// Byte offset of the attribute in the text.
    pub(crate) offset: usize,
}

/// A reader of tags that checks nesting, bounds and leftovers of xacro.
pub(crate) struct Tags<'a> {
    reader: Reader<&'a [u8]>,
    text: &'a str,
    file: &'a str,
    open: Vec<usize>,
    elements: usize,
    root_seen: bool,
}

impl<'a> Tags<'a> {
    pub(crate) fn new(text: &'a str, file: &'a str) -> Self {
        let mut reader = Reader::from_str(text);
        reader.config_mut().allow_dangling_amp = true;
        Tags { reader, text, file, open: Vec::new(), elements: 0, root_seen: false }
    }

    pub(crate) fn place(&self, offset: usize) -> Place {
        Place::of(self.file, self.text, offset)
    }

    fn syntax(&self, offset: usize, message: String) -> RobotFileError {
        RobotFileError::Syntax { at: self.place(offset), message }
    }

    /// Number of elements that are open now.
    pub(crate) fn depth(&self) -> usize {
        self.open.len()
    }

    /// The next tag and its bytes, or `None` at the end of a well-formed document.
    pub(crate) fn next(&mut self) -> Result<Option<(Range<usize>, Tag<'a>)>, RobotFileError> {
        loop {
            let from = self.reader.buffer_position() as usize;
            let event = self
                .reader
                .read_event()
                .map_err(|e| self.syntax(self.reader.error_position() as usize, format!("XML: {e}")))?;
            let range = from..self.reader.buffer_position() as usize;
            match event {
                Event::Start(start) => {
                    self.opened(&start, from)?;
                    self.open.push(from);
                    return Ok(Some((range, Tag::Open { start, empty: false })));
                }
                Event::Empty(start) => {
                    self.opened(&start, from)?;
                    return Ok(Some((range, Tag::Open { start, empty: true })));
                }
                Event::End(_) => {
                    self.open.pop();
                    return Ok(Some((range, Tag::Close)));
                }
                Event::Eof => {
                    if let Some(offset) = self.open.last() {
                        let message = "XML: the element that opens here is never closed".to_owned();
                        return Err(self.syntax(*offset, message));
                    }
                    if !self.root_seen {
                        let (at, found) = (self.place(0), excerpt_of_start(self.text));
                        return Err(RobotFileError::NotARobot { at, found });
                    }
                    return Ok(None);
                }
                Event::Text(_) | Event::GeneralRef(_) | Event::CData(_) => {
                    let outside = self.open.is_empty() && !self.text[range.clone()].trim().is_empty();
                    if outside && !self.root_seen {
                        let (at, found) = (self.place(from), excerpt_of_start(&self.text[range]));
                        return Err(RobotFileError::NotARobot { at, found });
                    } else if outside {
                        return Err(self.syntax(from, "XML: text after the outermost element".to_owned()));
                    }
                }
                Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
            }
        }
    }

    fn opened(&mut self, start: &BytesStart<'a>, offset: usize) -> Result<(), RobotFileError> {
        let name = start.name();
        if self.open.is_empty() && self.root_seen {
            return Err(self.syntax(offset, "XML: a second outermost element".to_owned()));
        }
        self.root_seen = true;
        if name.0.starts_with("xacro:") {
            let found = format!("<{}>", excerpt(name.0));
            return Err(RobotFileError::Unexpanded { at: self.place(offset), found });
        }
        self.elements += 1;
        let cap = |what, limit| RobotFileError::TooMany { at: self.place(offset), what, limit };
        if self.open.len() >= MAX_DEPTH {
            return Err(cap("levels of nested elements", MAX_DEPTH));
        }
        if self.elements > MAX_ELEMENTS {
            return Err(cap("elements", MAX_ELEMENTS));
        }
        Ok(())
    }

    /// The attributes of an opening tag that begins at `offset`.
    pub(crate) fn attributes(
        &self,
        start: &BytesStart<'_>,
        offset: usize,
    ) -> Result<Vec<Attribute>, RobotFileError> {
        let mut list: Vec<Attribute> = Vec::new();
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|e| self.syntax(offset, format!("XML: {e}")))?;
            // The event borrows from the text, so the name's address tells its offset.
            let address = (attribute.key.0.as_ptr() as usize).checked_sub(self.text.as_ptr() as usize);
            let offset = address.filter(|o| *o < self.text.len()).unwrap_or(offset);
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|e| self.syntax(offset, format!("XML: {e}")))?
                .into_owned();
            if value.contains("${") || value.contains("$(") {
                return Err(RobotFileError::Unexpanded { at: self.place(offset), found: excerpt(&value) });
            }
            if list.len() == MAX_ATTRIBUTES {
                let (what, limit) = ("attributes of one element", MAX_ATTRIBUTES);
                return Err(RobotFileError::TooMany { at: self.place(offset), what, limit });
            }
            list.push(Attribute { name: attribute.key.0.to_owned(), value, offset });
        }
        Ok(list)
    }
}

fn excerpt_of_start(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() { "an empty file".to_owned() } else { format!("`{}`", excerpt(text)) }
}
