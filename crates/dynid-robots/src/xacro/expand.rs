//! The walk over the elements of a file.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use dynid_files::SourceFile;
use dynid_files::excerpt::{excerpt, listed};

use super::evaluate::Evaluation;
use super::names::{Failure, Names};
use super::symbols::{OUTERMOST, Property, Scopes};
use super::tree::{self, At, Element, Node};
use super::value::{MAX_TEXT, MAX_WEIGHT, Value};
use super::{Expanded, expression, functions, is_name, packages, yaml};
use crate::robot_error::{Place, RobotFileError};
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::xacro_fault::XacroFault;

/// Most levels of elements, macros, properties and parts of expressions within each other.
pub(super) const MAX_DEPTH: usize = 2_000;
/// Most steps of an expansion.
const MAX_STEPS: usize = 5_000_000;
/// Most elements that it may make.
const MAX_NODES: usize = 500_000;
/// Most bytes of attributes and texts that it may make.
const MAX_BYTES: usize = 256 << 20;
/// Names that a message lists.
const NAMES: usize = 8;

/// A file that is read.
struct OpenFile {
    name: String,
    path: PathBuf,
    text: String,
}

/// An expansion under way.
pub(super) struct Expansion {
    pub(super) scopes: Scopes,
    /// Values of arguments: those that were stated, then those of `<xacro:arg>`.
    pub(super) arguments: BTreeMap<String, String>,
    /// Arguments that the file has or asks for.
    pub(super) known: BTreeSet<String>,
    /// All files so far.
    files: Vec<OpenFile>,
    /// The files that are being walked, the innermost last.
    pub(super) walked: Vec<usize>,
    included: Vec<SourceFile>,
    depth: usize,
    steps: usize,
    nodes: usize,
    bytes: usize,
}

/// What elements become.
#[derive(Default)]
pub(super) struct Content {
    pub(super) nodes: Vec<Node>,
    /// Attributes of the element around, by `<xacro:attribute>`.
    pub(super) attributes: Vec<(String, String)>,
}

/// Expands a file.
pub(super) fn file(
    text: &str,
    path: &Path,
    arguments: &[(String, String)],
) -> Result<Expanded, RobotFileError> {
    let name = path.display().to_string();
    let root = tree::parse(text, &name, 0)?;
    let mut expansion = Expansion {
        scopes: Scopes::new(),
        arguments: arguments.iter().cloned().collect(),
        known: BTreeSet::new(),
        files: vec![OpenFile { name, path: path.to_owned(), text: text.to_owned() }],
        walked: vec![0],
        included: Vec::new(),
        depth: 0,
        steps: 0,
        nodes: 0,
        bytes: 0,
    };
    let expanded = expansion.element(&root, OUTERMOST)?;
    if let Some((unknown, _)) = arguments.iter().find(|(name, _)| !expansion.known.contains(name)) {
        let known: Vec<String> = expansion.known.iter().cloned().collect();
        let has = if known.is_empty() { "none".to_owned() } else { listed(&known, NAMES) };
        return Err(expansion.fault(root.at, XacroFault::UnknownArgument { name: unknown.clone(), has }));
    }
    if expanded.children.is_empty() {
        return Err(expansion.fault(root.at, XacroFault::Empty));
    }
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    tree::write(&expanded, 0, &mut text);
    if text.len() as u64 > MAX_ROBOT_FILE_BYTES {
        let fault = XacroFault::TooMuch { what: "bytes", limit: MAX_ROBOT_FILE_BYTES as usize };
        return Err(expansion.fault(root.at, fault));
    }
    Ok(Expanded { text, included: expansion.included })
}

impl Expansion {
    pub(super) fn fault(&self, at: At, fault: XacroFault) -> RobotFileError {
        let file = &self.files[at.file];
        RobotFileError::Xacro { at: Place::of(&file.name, &file.text, at.offset).into(), fault: fault.into() }
    }

    /// Counts an element, and bytes of it, and goes a level down.
    fn enter_element(&mut self, element: &Element) -> Result<(), RobotFileError> {
        self.nodes += 1;
        let own = match () {
            () if self.nodes > MAX_NODES => Some(("elements", MAX_NODES)),
            () if self.bytes > MAX_BYTES => Some(("bytes", MAX_BYTES)),
            () => None,
        };
        let fault = match own {
            Some((what, limit)) => Err(XacroFault::TooMuch { what, limit }),
            None => self.enter(),
        };
        fault.map_err(|fault| self.fault(element.at, fault))
    }

    /// An element that is none of xacro's, its attributes computed and what is in it expanded.
    pub(super) fn element(&mut self, element: &Element, scope: usize) -> Result<Element, RobotFileError> {
        self.named(element, &element.name, scope)
    }

    /// The same under another name.
    pub(super) fn named(
        &mut self,
        element: &Element,
        name: &str,
        scope: usize,
    ) -> Result<Element, RobotFileError> {
        self.enter_element(element)?;
        // `<robot name="$(arg name)">` stands before the argument that it names.
        if element.attributes.iter().any(|(_, value)| value.contains("$(arg")) {
            self.declare_inner(element, scope)?;
        }
        let mut attributes = Vec::with_capacity(element.attributes.len());
        for (attribute, value) in &element.attributes {
            if attribute != "xmlns:xacro" && !attribute.starts_with("xacro:") {
                attributes.push((attribute.clone(), self.text(value, scope, element.at)?.to_string()));
            }
        }
        let content = self.content(element, scope)?;
        for (attribute, value) in content.attributes {
            match attributes.iter_mut().find(|(own, _)| *own == attribute) {
                Some(own) => own.1 = value,
                None => attributes.push((attribute, value)),
            }
        }
        self.bytes += attributes.iter().map(|(name, value)| name.len() + value.len()).sum::<usize>();
        self.leave();
        Ok(Element { name: name.to_owned(), attributes, children: content.nodes, at: element.at })
    }

    /// What stands in an element, expanded.
    pub(super) fn content(&mut self, element: &Element, scope: usize) -> Result<Content, RobotFileError> {
        self.enter_element(element)?;
        let mut content = Content::default();
        for node in &element.children {
            self.node(node, scope, element.at, &mut content)?;
        }
        self.leave();
        Ok(content)
    }

    /// Expands a node and adds what it becomes.
    pub(super) fn node(
        &mut self,
        node: &Node,
        scope: usize,
        at: At,
        content: &mut Content,
    ) -> Result<(), RobotFileError> {
        match node {
            Node::Text(text) if text.trim().is_empty() => {}
            Node::Text(text) => {
                let text = self.text(text, scope, at)?.to_string();
                self.bytes += text.len();
                content.nodes.push(Node::Text(text));
            }
            Node::Element(element) => match element.tag() {
                Some(tag) => self.tag(tag, element, scope, content)?,
                None => content.nodes.push(Node::Element(self.element(element, scope)?.into())),
            },
        }
        Ok(())
    }

    /// The value of a text with `${..}` and `$(..)`.
    pub(super) fn text(&mut self, text: &str, scope: usize, at: At) -> Result<Value, RobotFileError> {
        self.value_of_text(text, scope).map_err(|fault| self.fault(at, fault))
    }

    /// A text that is one expression has the value of it; any other is joined.
    fn value_of_text(&mut self, text: &str, scope: usize) -> Result<Value, XacroFault> {
        self.enter()?;
        let mut parts: Vec<Value> = Vec::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            let (before, own) = rest.split_at(at);
            if !before.is_empty() {
                parts.push(Value::text(before));
            }
            let dollars = own.len() - own.trim_start_matches('$').len();
            let opens = own[dollars..].starts_with(['{', '(']);
            if dollars > 1 && opens {
                // One more than needed: none is an expression.
                parts.push(Value::text(&own[1..=dollars]));
                rest = &own[dollars + 1..];
            } else if !opens {
                parts.push(Value::text(&own[..dollars]));
                rest = &own[dollars..];
            } else {
                let (closing, is_expression) = if own.starts_with("${") { ('}', true) } else { (')', false) };
                let Some(end) = own.find(closing) else {
                    let reason = format!("expected a closing `{closing}`");
                    return Err(XacroFault::Expression { text: excerpt(own), reason });
                };
                let inner = &own[2..end];
                parts.push(match is_expression {
                    true => self.expression(inner, scope)?,
                    false => self.substitution(inner, scope)?,
                });
                rest = &own[end + 1..];
            }
        }
        if !rest.is_empty() {
            parts.push(Value::text(rest));
        }
        self.leave();
        if parts.len() == 1
            && let Some(value) = parts.pop()
        {
            return Ok(value);
        }
        let mut joined = String::new();
        for part in &parts {
            joined.push_str(&part.to_string());
            if joined.len() > MAX_TEXT {
                return Err(XacroFault::TooMuch { what: "bytes of a text", limit: MAX_TEXT });
            }
        }
        self.bytes += joined.len();
        match self.bytes > MAX_BYTES {
            true => Err(XacroFault::TooMuch { what: "bytes", limit: MAX_BYTES }),
            false => Ok(Value::text(joined)),
        }
    }

    /// The value of what stands in `${..}`, in which `$(..)` may stand.
    fn expression(&mut self, text: &str, scope: usize) -> Result<Value, XacroFault> {
        let inner = self.value_of_text(text, scope)?.to_string();
        let outcome = match expression::parse(&inner) {
            Ok(expression) => {
                Evaluation::new(&mut Seen { expansion: self, scope, arguments: false }).value(&expression)
            }
            Err(reason) => Err(Failure::Reason(reason)),
        };
        outcome.map_err(|failure| faulty(failure, &inner))
    }

    /// The value of what stands in `$(..)`.
    fn substitution(&mut self, text: &str, scope: usize) -> Result<Value, XacroFault> {
        let text = self.value_of_text(text, scope)?.to_string();
        let reason = |reason: &str| XacroFault::Expression {
            text: format!("$({})", excerpt(&text)),
            reason: reason.to_owned(),
        };
        if let Some(inner) = text.strip_prefix("eval ") {
            let outcome = match expression::parse(inner) {
                Ok(expression) => {
                    Evaluation::new(&mut Seen { expansion: self, scope, arguments: true }).value(&expression)
                }
                Err(reason) => Err(Failure::Reason(reason)),
            };
            return outcome
                .map(|value| Value::text(value.to_string()))
                .map_err(|failure| faulty(failure, inner));
        }
        let words: Vec<&str> = text.split(' ').filter(|word| !word.is_empty()).collect();
        let value = match words.as_slice() {
            ["arg", name] => {
                self.known.insert((*name).to_owned());
                let value = self.arguments.get(*name);
                value.cloned().ok_or_else(|| XacroFault::Argument { name: (*name).to_owned() })?
            }
            ["find", name] => self.package(name)?,
            ["env", name] => {
                env::var(name).map_err(|_| reason("this variable of the environment is not set"))?
            }
            ["optenv", name, otherwise @ ..] => env::var(name).unwrap_or_else(|_| otherwise.join(" ")),
            ["cwd"] => env::current_dir().map_err(|e| reason(&e.to_string()))?.display().to_string(),
            ["dirname"] => self.folder().display().to_string(),
            _ => {
                return Err(reason(
                    "expected `arg`, `find`, `env`, `optenv`, `eval`, `cwd` or `dirname` with its words",
                ));
            }
        };
        Ok(Value::text(value))
    }

    fn package(&mut self, name: &str) -> Result<String, XacroFault> {
        let file = &self.files[self.file()].path;
        let folder = packages::find(name, file);
        let folder = folder.ok_or_else(|| XacroFault::Package { name: name.to_owned() })?;
        Ok(folder.display().to_string())
    }

    /// The file that is being walked.
    pub(super) fn file(&self) -> usize {
        self.walked.last().copied().unwrap_or(0)
    }

    /// The folder of the file that is being walked.
    pub(super) fn folder(&self) -> PathBuf {
        self.files[self.file()].path.parent().unwrap_or(Path::new("")).to_owned()
    }

    /// Reads a file that the current one names.
    ///
    /// # Errors
    /// As words: it cannot be read.
    pub(super) fn read(&mut self, path: &Path) -> Result<String, String> {
        self.steps += 1_000;
        let (text, source) = read_text(path, MAX_ROBOT_FILE_BYTES).map_err(|e| match e {
            RobotFileError::Unreadable { error, .. } => error.to_string(),
            other => other.to_string(),
        })?;
        self.bytes += text.len();
        if !self.included.contains(&source) {
            self.included.push(source);
        }
        Ok(text)
    }

    /// The outermost element of an included file, which is walked until [`Expansion::leave_file`].
    pub(super) fn enter_file(&mut self, path: &Path, text: String) -> Result<Arc<Element>, RobotFileError> {
        let (number, name) = (self.files.len(), path.display().to_string());
        let root = tree::parse(&text, &name, number)?;
        self.files.push(OpenFile { name, path: path.to_owned(), text });
        self.walked.push(number);
        Ok(root)
    }

    pub(super) fn leave_file(&mut self) {
        self.walked.pop();
    }

    /// The value of a property, computed now if it was not used before.
    fn property(&mut self, scope: usize, name: &str) -> Result<Option<Value>, XacroFault> {
        let text = match self.scopes.property(scope, name) {
            None => return Ok(self.scopes.namespace(scope, name).map(Value::Scope)),
            Some((_, Property::Value(value))) => return Ok(Some(value.clone())),
            Some((_, Property::Busy)) => {
                let reason = "the property is stated by way of itself".to_owned();
                return Err(XacroFault::Expression { text: name.to_owned(), reason });
            }
            Some((at, Property::Lazy(text))) => (at, text.clone()),
        };
        let (at, text) = text;
        self.scopes.set_property(at, name, Property::Busy);
        let value = self.value_of_text(&text, at)?.literally();
        self.scopes.set_property(at, name, Property::Value(value.clone()));
        Ok(Some(value))
    }

    /// Whether a name has a value in a scope.
    pub(super) fn has(&self, scope: usize, name: &str) -> bool {
        self.scopes.property(scope, name).is_some()
    }

    /// The value of a property by its name.
    pub(super) fn value(
        &mut self,
        scope: usize,
        name: &str,
        at: At,
    ) -> Result<Option<Value>, RobotFileError> {
        self.property(scope, name).map_err(|fault| self.fault(at, fault))
    }

    fn enter(&mut self) -> Result<(), XacroFault> {
        self.depth += 1;
        match self.depth > MAX_DEPTH {
            true => Err(XacroFault::TooMuch { what: "levels", limit: MAX_DEPTH }),
            false => self.spend(1),
        }
    }

    fn leave(&mut self) {
        self.depth -= 1;
    }

    fn spend(&mut self, steps: usize) -> Result<(), XacroFault> {
        self.steps = self.steps.saturating_add(steps);
        match self.steps > MAX_STEPS {
            true => Err(XacroFault::TooMuch { what: "steps", limit: MAX_STEPS }),
            false => Ok(()),
        }
    }
}

fn faulty(failure: Failure, text: &str) -> XacroFault {
    match failure {
        Failure::Reason(reason) => XacroFault::Expression { text: excerpt(text), reason },
        Failure::Fault(fault) => fault,
    }
}

/// What an expression sees.
struct Seen<'a> {
    expansion: &'a mut Expansion,
    scope: usize,
    /// Arguments by their names in place of properties, for `$(eval ..)`.
    arguments: bool,
}

impl Names for Seen<'_> {
    fn value(&mut self, name: &str) -> Result<Option<Value>, XacroFault> {
        match self.arguments {
            false => self.expansion.property(self.scope, name),
            true if functions::global(name).is_some() => Ok(None),
            true if is_name(name) && self.expansion.arguments.contains_key(name) => {
                self.argument(name).map(Some)
            }
            true => Ok(None),
        }
    }

    fn value_in(&mut self, scope: usize, name: &str) -> Result<Option<Value>, XacroFault> {
        self.expansion.property(scope, name)
    }

    fn argument(&mut self, name: &str) -> Result<Value, XacroFault> {
        self.expansion.known.insert(name.to_owned());
        let value = self.expansion.arguments.get(name);
        let value = value.ok_or_else(|| XacroFault::Argument { name: name.to_owned() })?;
        Ok(if self.arguments { Value::literal(value) } else { Value::text(value.as_str()) })
    }

    fn yaml(&mut self, file: &str) -> Result<Value, XacroFault> {
        let path = self.expansion.folder().join(file);
        let value = self.expansion.read(&path).and_then(|text| yaml::parse(&text));
        let value = value.map_err(|reason| XacroFault::File { file: path.display().to_string(), reason })?;
        // Aliases share what they stand for.
        let weight = value.weight();
        self.spend(weight.ok_or(XacroFault::TooMuch { what: "values in one another", limit: MAX_WEIGHT })?)?;
        Ok(value)
    }

    fn path(&self, file: &str) -> String {
        self.expansion.folder().join(file).display().to_string()
    }

    fn enter(&mut self) -> Result<(), XacroFault> {
        self.expansion.enter()
    }

    fn leave(&mut self) {
        self.expansion.leave();
    }

    fn spend(&mut self, values: usize) -> Result<(), XacroFault> {
        self.expansion.spend(values)
    }
}
