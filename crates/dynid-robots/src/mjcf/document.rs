//! The elements of an MJCF model: the text of its file with that of included files in their places.

use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use dynid_files::digest::SourceFile;
use dynid_files::excerpt::excerpt;

use crate::robot_error::{Place, RobotFileError};
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::urdf::xml::{Attribute, Tag, Tags};

/// Deepest nesting of elements, included ones counted.
const MAX_DEPTH: usize = 256;
/// Most elements of a model.
const MAX_ELEMENTS: usize = 500_000;
/// Most files of a model.
const MAX_FILES: usize = 256;

/// Elements that say nothing about dynamics, and may be many.
const PASSED_OVER: [&str; 10] =
    ["visual", "statistic", "size", "custom", "sensor", "contact", "texture", "material", "skin", "hfield"];

/// A file of a model that has been edited.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EditedFile {
    /// Path as it is included, from the folder of the main file; the main file itself is empty.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// An element with its places in the text of its file.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    /// Number of its file.
    pub(super) file: usize,
    /// Opening tag.
    pub(super) open: Range<usize>,
    /// `<a ../>`.
    pub(super) empty: bool,
    /// End of the closing tag, or of the opening one if that is all.
    pub(super) end: usize,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Element>,
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    pub(super) fn text(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|a| a.value.as_str())
    }
}

/// A file of a model.
#[derive(Debug)]
pub(super) struct ModelFile {
    /// Path from the folder of the main file; that of the main file itself is empty.
    pub(super) name: String,
    /// Where it was read, for messages.
    path: String,
    pub(super) text: String,
}

/// A model as its files state it.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) files: Vec<ModelFile>,
    pub(super) root: Element,
    /// Included files that were read.
    pub(super) sources: Vec<SourceFile>,
}

impl Document {
    /// The model of a text; `path` is where it is from. Included files are looked for beside it; where `changed` names one, its text is
    /// that.
    pub(super) fn load(text: &str, path: &Path, changed: &[EditedFile]) -> Result<Self, RobotFileError> {
        let mut loader = Loader {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            changed,
            files: Vec::new(),
            sources: Vec::new(),
            elements: 0,
            bytes: 0,
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text).to_owned();
        let root =
            loader.file(ModelFile { name: String::new(), path: path.display().to_string(), text }, 0)?;
        let Loader { files, sources, .. } = loader;
        let document = Document { files, root, sources };
        if document.root.name == "mujoco" {
            return Ok(document);
        }
        let found = format!("<{}>", excerpt(&document.root.name));
        Err(RobotFileError::NotARobot { at: document.place(&document.root, 0), found })
    }

    /// The place of an attribute of an element; offset 0 is the element itself.
    pub(super) fn place(&self, element: &Element, offset: usize) -> Place {
        let file = &self.files[element.file];
        Place::of(&file.path, &file.text, offset.max(element.open.start))
    }

    /// The sections of the model with a name, in the order of the files.
    pub(super) fn sections<'a>(&'a self, name: &'static str) -> impl Iterator<Item = &'a Element> {
        self.root.children.iter().filter(move |e| e.name == name)
    }
}

/// What reads a model with its included files.
struct Loader<'a> {
    folder: PathBuf,
    changed: &'a [EditedFile],
    files: Vec<ModelFile>,
    sources: Vec<SourceFile>,
    elements: usize,
    bytes: u64,
}

impl Loader<'_> {
    /// The outermost element of a file that is included at a depth.
    fn file(&mut self, file: ModelFile, depth: usize) -> Result<Element, RobotFileError> {
        let mut root = self.tree(&file, depth)?;
        self.files.push(file);
        self.expand(&mut root, depth)?;
        Ok(root)
    }

    /// Elements of a file, includes as they stand.
    fn tree(&mut self, file: &ModelFile, outer: usize) -> Result<Element, RobotFileError> {
        let number = self.files.len();
        let mut tags = Tags::new(&file.text, &file.path);
        let mut open: Vec<Element> = Vec::new();
        let mut root = None;
        let mut skipped: Option<usize> = None;
        while let Some((range, tag)) = tags.next()? {
            match tag {
                Tag::Open { start, empty } => {
                    let depth = tags.depth() - usize::from(!empty);
                    if skipped.is_some() {
                        continue;
                    }
                    let name = start.name().0;
                    if depth > 0 && PASSED_OVER.contains(&name) {
                        skipped = (!empty).then_some(depth);
                        continue;
                    }
                    let cap = |what, limit| {
                        Err(RobotFileError::TooMany { at: tags.place(range.start), what, limit })
                    };
                    self.elements += 1;
                    if self.elements > MAX_ELEMENTS {
                        return cap("elements", MAX_ELEMENTS);
                    }
                    if outer + depth > MAX_DEPTH {
                        return cap("levels of nested elements", MAX_DEPTH);
                    }
                    let element = Element {
                        name: name.to_owned(),
                        file: number,
                        attributes: tags.attributes(&start, range.start)?,
                        end: range.end,
                        open: range,
                        empty,
                        children: Vec::new(),
                    };
                    if empty { attach(&mut open, &mut root, element) } else { open.push(element) }
                }
                Tag::Close => match skipped {
                    Some(depth) if tags.depth() == depth => skipped = None,
                    Some(_) => {}
                    None => {
                        if let Some(mut element) = open.pop() {
                            element.end = range.end;
                            attach(&mut open, &mut root, element);
                        }
                    }
                },
            }
        }
        root.ok_or_else(|| RobotFileError::NotARobot { at: tags.place(0), found: "nothing".to_owned() })
    }

    /// Puts the children of included files in the place of `<include>`.
    fn expand(&mut self, element: &mut Element, depth: usize) -> Result<(), RobotFileError> {
        for mut child in std::mem::take(&mut element.children) {
            if child.name == "include" {
                element.children.append(&mut self.included(&child, depth + 1)?.children);
            } else {
                self.expand(&mut child, depth + 1)?;
                element.children.push(child);
            }
        }
        Ok(())
    }

    fn included(&mut self, include: &Element, depth: usize) -> Result<Element, RobotFileError> {
        let from = &self.files[include.file];
        let at = |offset| Place::of(&from.path, &from.text, offset);
        let Some(stated) = include.attribute("file") else {
            return Err(RobotFileError::Missing {
                at: at(include.open.start),
                owner: "<include>".to_owned(),
                expected: "an attribute `file`".to_owned(),
            });
        };
        // From the folder of the main file, or from that of the file that includes.
        let from_main = lexical(Path::new(&stated.value));
        let beside = lexical(&Path::new(&from.name).parent().unwrap_or(Path::new("")).join(&stated.value));
        let is_known = |name: &Path| self.changed.iter().any(|c| Path::new(&c.name) == name);
        let exists = |name: &Path| is_known(name) || self.folder.join(name).is_file();
        let name = if !exists(&from_main) && exists(&beside) { beside } else { from_main };
        let name = name.to_string_lossy().into_owned();
        if self.files.iter().any(|f| f.name == name) {
            return Err(RobotFileError::Repeated {
                at: at(stated.offset),
                owner: "the model".to_owned(),
                what: format!("<include file=\"{}\">", excerpt(&stated.value)),
            });
        }
        if self.files.len() == MAX_FILES {
            return Err(RobotFileError::TooMany { at: at(stated.offset), what: "files", limit: MAX_FILES });
        }
        let path = self.folder.join(&name);
        let text = match self.changed.iter().find(|c| c.name == name) {
            Some(changed) => changed.text.clone(),
            None => {
                let (text, source) = read_text(&path, MAX_ROBOT_FILE_BYTES - self.bytes)?;
                self.sources.push(source);
                text
            }
        };
        self.bytes = (self.bytes + text.len() as u64).min(MAX_ROBOT_FILE_BYTES);
        self.file(ModelFile { name, path: path.display().to_string(), text }, depth)
    }
}

fn attach(open: &mut [Element], root: &mut Option<Element>, element: Element) {
    match open.last_mut() {
        Some(parent) => parent.children.push(element),
        None => *root = Some(element),
    }
}

/// A path without `.`, and without `..` where a folder stands before it.
fn lexical(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}
