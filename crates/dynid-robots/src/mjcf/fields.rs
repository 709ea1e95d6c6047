//! Attributes of an element as numbers and words, with what its classes state.

use dynid_files::excerpt::excerpt;
use dynid_model::Vec3;

use super::document::{Document, Element};
use crate::robot_error::RobotFileError;
use crate::robot_numbers::is_in_range;
use crate::urdf::xml::Attribute;

/// An element and the elements of `<default>` that stand behind it.
#[derive(Clone, Debug)]
pub(super) struct Fields<'a> {
    document: &'a Document,
    pub(super) element: &'a Element,
    /// The nearest first.
    behind: Vec<&'a Element>,
}

impl<'a> Fields<'a> {
    pub(super) fn new(document: &'a Document, element: &'a Element, behind: Vec<&'a Element>) -> Self {
        Fields { document, element, behind }
    }

    /// An element that classes say nothing about.
    pub(super) fn alone(document: &'a Document, element: &'a Element) -> Self {
        Fields::new(document, element, Vec::new())
    }

    /// The element in words.
    pub(super) fn owner(&self) -> String {
        match self.element.text("name") {
            Some(name) => format!("{} `{}`", self.element.name, excerpt(name)),
            None => format!("<{}>", excerpt(&self.element.name)),
        }
    }

    /// The element itself, then what stands behind it.
    fn all(&self) -> impl DoubleEndedIterator<Item = &'a Element> {
        std::iter::once(self.element).chain(self.behind.iter().copied())
    }

    fn find(&self, key: &str) -> Option<(&'a Element, &'a Attribute)> {
        self.all().find_map(|e| Some((e, e.attribute(key)?)))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.find(key).is_some()
    }

    pub(super) fn text(&self, key: &str) -> Option<&'a str> {
        self.find(key).map(|(_, a)| a.value.as_str())
    }

    /// The first of some attributes that the element, or else a class, states.
    pub(super) fn first<'k>(&self, keys: &[&'k str]) -> Option<&'k str> {
        self.all().find_map(|e| keys.iter().copied().find(|key| e.attribute(key).is_some()))
    }

    pub(super) fn missing(&self, expected: String) -> RobotFileError {
        RobotFileError::Missing { at: self.document.place(self.element, 0), owner: self.owner(), expected }
    }

    pub(super) fn value(&self, key: &str, expected: impl Into<String>) -> RobotFileError {
        let (element, offset, found) = match self.find(key) {
            Some((element, a)) => (element, a.offset, excerpt(&a.value)),
            None => (self.element, 0, "nothing".to_owned()),
        };
        RobotFileError::Value {
            at: self.document.place(element, offset),
            owner: self.owner(),
            field: key.to_owned(),
            expected: expected.into(),
            found,
        }
    }

    /// That something cannot be carried; `key` is the attribute that says it, or nothing.
    pub(super) fn refuse(&self, key: &str, reason: impl Into<String>, hint: &'static str) -> RobotFileError {
        let (element, offset) = self.find(key).map_or((self.element, 0), |(e, a)| (e, a.offset));
        RobotFileError::NotCarried {
            at: self.document.place(element, offset),
            owner: self.owner(),
            reason: reason.into(),
            hint,
        }
    }

    pub(super) fn unknown(&self, key: &str, kind: &'static str, meant: Option<&str>) -> RobotFileError {
        let (element, offset, name) = match self.find(key) {
            Some((element, a)) => (element, a.offset, excerpt(&a.value)),
            None => (self.element, 0, String::new()),
        };
        RobotFileError::UnknownName {
            at: self.document.place(element, offset),
            context: format!("{} {key}", self.owner()),
            kind,
            name,
            meant: meant.map(str::to_owned),
        }
    }

    fn list(&self, key: &str, a: &Attribute, most: usize) -> Result<Vec<f64>, RobotFileError> {
        let words = a.value.split_ascii_whitespace();
        let numbers: Option<Vec<f64>> = words.map(|x| x.parse().ok().filter(|x| is_in_range(*x))).collect();
        match numbers {
            Some(list) if list.len() <= most => Ok(list),
            _ => Err(self.value(key, format!("up to {most} finite numbers up to 1e30"))),
        }
    }

    /// Exactly `N` numbers, if they are stated.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, RobotFileError> {
        let Some((_, a)) = self.find(key) else { return Ok(None) };
        let list = self.list(key, a, N).ok().and_then(|list| list.try_into().ok());
        let wanted = if N == 1 { "a finite number".to_owned() } else { format!("{N} finite numbers") };
        list.map(Some).ok_or_else(|| self.value(key, format!("{wanted} up to 1e30")))
    }

    /// Up to `N` numbers; those that the element leaves out are those of its classes, then those of `start`.
    pub(super) fn filled<const N: usize>(
        &self,
        key: &str,
        start: [f64; N],
    ) -> Result<[f64; N], RobotFileError> {
        let mut out = start;
        for a in self.all().rev().filter_map(|e| e.attribute(key)) {
            out.iter_mut().zip(self.list(key, a, N)?).for_each(|(x, stated)| *x = stated);
        }
        Ok(out)
    }

    pub(super) fn number(&self, key: &str, otherwise: f64) -> Result<f64, RobotFileError> {
        Ok(self.numbers(key)?.map_or(otherwise, |[x]| x))
    }

    pub(super) fn vector(&self, key: &str) -> Result<Vec3<f64>, RobotFileError> {
        Ok(Vec3(self.numbers(key)?.unwrap_or_default()))
    }

    /// A number of which MuJoCo takes a polynomial: its first coefficient, the others must be 0.
    pub(super) fn linear(&self, key: &str) -> Result<f64, RobotFileError> {
        let Some((_, a)) = self.find(key) else { return Ok(0.0) };
        let list = self.list(key, a, 3)?;
        if list.iter().skip(1).any(|x| *x != 0.0) {
            let reason = format!("`{key}` is a polynomial, and joints have a linear one here");
            return Err(self.refuse(key, reason, "state its first coefficient alone"));
        }
        list.first().copied().ok_or_else(|| self.value(key, "a finite number"))
    }

    /// A number that may not be negative.
    pub(super) fn not_negative(&self, key: &str, x: f64) -> Result<f64, RobotFileError> {
        if x < 0.0 { Err(self.value(key, "a number that is not negative")) } else { Ok(x) }
    }

    /// `true`, `false`, or `auto` as nothing.
    pub(super) fn flag(&self, key: &str) -> Result<Option<bool>, RobotFileError> {
        match self.text(key) {
            None | Some("auto") => Ok(None),
            Some("true") => Ok(Some(true)),
            Some("false") => Ok(Some(false)),
            Some(_) => Err(self.value(key, "true or false")),
        }
    }
}
