//! Classes of `<default>`: what elements have where they state nothing.

use std::collections::HashMap;

use dynid_files::excerpt::{closest, excerpt};

use super::document::{Document, Element};
use crate::robot_error::RobotFileError;

/// A class: its elements, and the class that it is inside of.
#[derive(Debug)]
struct Class<'a> {
    outer: Option<usize>,
    elements: Vec<&'a Element>,
}

/// Kinds of actuators, which have one default in common.
pub(super) const ACTUATORS: [&str; 12] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "sitepid",
    "plugin",
];

/// What an element has its defaults in common with.
fn kind(name: &str) -> &str {
    match name {
        "spatial" | "fixed" => "tendon",
        "connect" | "weld" => "equality",
        name if ACTUATORS.contains(&name) => "general",
        name => name,
    }
}

/// All classes of a model; the first one is that of elements without a class.
#[derive(Debug)]
pub(super) struct Defaults<'a> {
    document: &'a Document,
    classes: Vec<Class<'a>>,
    by_name: HashMap<&'a str, usize>,
}

impl<'a> Defaults<'a> {
    pub(super) fn of(document: &'a Document) -> Result<Self, RobotFileError> {
        let main = Class { outer: None, elements: Vec::new() };
        let mut defaults = Defaults { document, classes: vec![main], by_name: HashMap::new() };
        for section in document.sections("default") {
            defaults.by_name.insert(section.text("class").unwrap_or("main"), 0);
            defaults.fill(section, 0)?;
        }
        Ok(defaults)
    }

    fn fill(&mut self, section: &'a Element, class: usize) -> Result<(), RobotFileError> {
        for child in &section.children {
            if child.name != "default" {
                self.classes[class].elements.push(child);
                continue;
            }
            let Some(name) = child.text("class") else {
                return Err(RobotFileError::Missing {
                    at: self.document.place(child, 0),
                    owner: "<default>".to_owned(),
                    expected: "an attribute `class`".to_owned(),
                });
            };
            let inner = self.classes.len();
            self.classes.push(Class { outer: Some(class), elements: Vec::new() });
            if self.by_name.insert(name, inner).is_some() {
                return Err(RobotFileError::Repeated {
                    at: self.document.place(child, 0),
                    owner: "<default>".to_owned(),
                    what: format!("the class `{}`", excerpt(name)),
                });
            }
            self.fill(child, inner)?;
        }
        Ok(())
    }

    /// The class that an element names in an attribute, if it names one.
    pub(super) fn class(&self, element: &Element, key: &str) -> Result<Option<usize>, RobotFileError> {
        let Some(stated) = element.attribute(key) else { return Ok(None) };
        if let Some(class) = self.by_name.get(stated.value.as_str()) {
            return Ok(Some(*class));
        }
        let known: Vec<&str> = self.by_name.keys().copied().collect();
        Err(RobotFileError::UnknownName {
            at: self.document.place(element, stated.offset),
            context: format!("<{}> {key}", excerpt(&element.name)),
            kind: "class",
            name: excerpt(&stated.value),
            meant: closest(&stated.value, &known).map(str::to_owned),
        })
    }

    /// Elements of classes that say what an element has, the nearest first. `inherited` is the class of elements around it that name none.
    pub(super) fn behind(
        &self,
        element: &Element,
        inherited: Option<usize>,
    ) -> Result<Vec<&'a Element>, RobotFileError> {
        let kind = kind(&element.name);
        let alike = |e: &Element| self::kind(&e.name) == kind;
        let mut out = Vec::new();
        let mut class = self.class(element, "class")?.or(inherited).or(Some(0));
        while let Some(k) = class {
            out.extend(self.classes[k].elements.iter().copied().filter(|e| alike(e)).rev());
            class = self.classes[k].outer;
        }
        Ok(out)
    }
}
