//! What each tag of xacro does.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::expand::{Content, Expansion};
use super::is_name;
use super::symbols::{Block, Default, Macro, OUTERMOST, Property};
use super::tree::{At, Element, Node};
use super::value::Value;
use crate::robot_error::RobotFileError;
use crate::xacro_fault::XacroFault;

/// Most files that a pattern of an include may mean.
const MAX_INCLUDED: usize = 1_000;

impl Expansion {
    /// Does what a tag says, and adds what it becomes.
    pub(super) fn tag(
        &mut self,
        tag: &str,
        element: &Arc<Element>,
        scope: usize,
        content: &mut Content,
    ) -> Result<(), RobotFileError> {
        match tag {
            "property" => self.set_property(element, scope),
            "macro" => self.define(element, scope),
            "arg" => self.declare(element, scope),
            "include" => self.include(element, scope, content),
            "insert_block" => self.insert(element, scope, content),
            "if" | "unless" => {
                let stated = self.needed(element, tag, "value")?;
                let value = self.text(stated, scope, element.at)?;
                let holds = value.condition().ok_or_else(|| {
                    let found = format!("`{value}` from `{stated}`");
                    self.unfit(element, tag, "true, false or a number as `value`", found)
                })?;
                if holds == (tag == "if") {
                    let own = self.content(element, scope)?;
                    content.nodes.extend(own.nodes);
                    content.attributes.extend(own.attributes);
                }
                Ok(())
            }
            "element" => {
                let name = self.stated(element, tag, "xacro:name", scope)?;
                content.nodes.push(Node::Element(self.named(element, &name, scope)?.into()));
                Ok(())
            }
            "attribute" => {
                let name = self.stated(element, tag, "name", scope)?;
                let value = self.needed(element, tag, "value")?;
                let value = self.text(value, scope, element.at)?.to_string();
                content.attributes.push((name, value));
                Ok(())
            }
            "call" => {
                let name = self.stated(element, tag, "macro", scope)?;
                self.call(&name, element, Some("macro"), scope, content)
            }
            name => self.call(name, element, None, scope, content),
        }
    }

    fn unfit(&self, element: &Element, tag: &str, expected: &'static str, found: String) -> RobotFileError {
        self.fault(element.at, XacroFault::Tag { tag: tag.to_owned(), expected, found })
    }

    /// An attribute that a tag needs, as it stands.
    fn needed<'a>(
        &self,
        element: &'a Element,
        tag: &str,
        name: &'static str,
    ) -> Result<&'a str, RobotFileError> {
        let stated = element.attribute(name);
        stated.ok_or_else(|| self.unfit(element, tag, name, "none".to_owned()))
    }

    /// The value of an attribute that names something.
    fn stated(
        &mut self,
        element: &Element,
        tag: &str,
        name: &'static str,
        scope: usize,
    ) -> Result<String, RobotFileError> {
        let value = self.text(self.needed(element, tag, name)?, scope, element.at)?.to_string();
        match value.is_empty() {
            true => Err(self.unfit(element, tag, name, "an empty one".to_owned())),
            false => Ok(value),
        }
    }

    /// Refuses attributes that a tag does not have.
    fn allow(&self, element: &Element, tag: &str, names: &[&str]) -> Result<(), RobotFileError> {
        let other = element.attributes.iter().find(|(name, _)| {
            !names.contains(&name.as_str()) && !name.starts_with("xmlns:") && !name.starts_with("xacro:")
        });
        match other {
            Some((name, _)) => Err(self.unfit(element, tag, "attributes that it has", format!("`{name}`"))),
            None => Ok(()),
        }
    }

    /// A truth value of an attribute.
    fn flag(
        &mut self,
        element: &Element,
        tag: &str,
        name: &'static str,
        scope: usize,
    ) -> Result<Option<bool>, RobotFileError> {
        let Some(stated) = element.attribute(name) else { return Ok(None) };
        let value = self.text(stated, scope, element.at)?;
        match value.condition() {
            Some(flag) => Ok(Some(flag)),
            None => Err(self.unfit(element, tag, "true or false", format!("{name}=\"{value}\""))),
        }
    }

    fn set_property(&mut self, element: &Element, scope: usize) -> Result<(), RobotFileError> {
        let tag = "property";
        self.allow(element, tag, &["name", "value", "default", "remove", "scope", "lazy_eval"])?;
        let name = self.stated(element, tag, "name", scope)?;
        if !is_name(&name) || name.starts_with("__") {
            return Err(self.unfit(element, tag, "a name of letters, digits and `_`", format!("`{name}`")));
        }
        let remove = self.flag(element, tag, "remove", scope)?.unwrap_or(false);
        let (value, default) = (element.attribute("value"), element.attribute("default"));
        if usize::from(value.is_some()) + usize::from(default.is_some()) + usize::from(remove) > 1 {
            let found = "more of them".to_owned();
            return Err(self.unfit(element, tag, "one of `value`, `default` and `remove`", found));
        }
        if remove {
            self.scopes.remove(scope, &name);
            return Ok(());
        }
        if default.is_some() && self.has(scope, &name) {
            return Ok(());
        }
        let (target, is_local) = match element.attribute("scope") {
            Some("global") => (OUTERMOST, false),
            Some("parent") => (self.scopes.around(scope), false),
            None | Some("local") => (scope, true),
            Some(other) => {
                return Err(self.unfit(
                    element,
                    tag,
                    "`local`, `parent` or `global` as `scope`",
                    format!("`{other}`"),
                ));
            }
        };
        let Some(text) = value.or(default) else {
            let block = Block { nodes: element.children.clone() };
            self.scopes.set_block(target, format!("**{name}"), block);
            return Ok(());
        };
        let is_lazy = self.flag(element, tag, "lazy_eval", scope)?.unwrap_or(true) && is_local;
        let property = match Value::literal(text) {
            // Only what refers to something needs to wait.
            Value::Text(text) if text.contains('$') => match is_lazy {
                true => Property::Lazy(text),
                false => Property::Value(self.text(&text, scope, element.at)?.literally()),
            },
            value => Property::Value(value),
        };
        self.scopes.set_property(target, &name, property);
        Ok(())
    }

    /// Arguments that stand in an element.
    pub(super) fn declare_inner(&mut self, element: &Element, scope: usize) -> Result<(), RobotFileError> {
        for node in &element.children {
            if let Node::Element(inner) = node
                && inner.tag() == Some("arg")
            {
                self.declare(inner, scope)?;
            }
        }
        Ok(())
    }

    fn declare(&mut self, element: &Element, scope: usize) -> Result<(), RobotFileError> {
        let tag = "arg";
        self.allow(element, tag, &["name", "default"])?;
        let name = self.needed(element, tag, "name")?;
        self.known.insert(name.to_owned());
        if !self.arguments.contains_key(name) {
            let Some(default) = element.attribute("default") else { return Ok(()) };
            let value = self.text(default, scope, element.at)?.to_string();
            self.arguments.insert(name.to_owned(), value);
        }
        Ok(())
    }

    fn insert(
        &mut self,
        element: &Element,
        scope: usize,
        content: &mut Content,
    ) -> Result<(), RobotFileError> {
        let tag = "insert_block";
        self.allow(element, tag, &["name"])?;
        let name = self.stated(element, tag, "name", scope)?;
        let block = self.scopes.block(scope, &format!("**{name}"));
        let block = block.or_else(|| self.scopes.block(scope, &format!("*{name}")));
        let block =
            block.ok_or_else(|| self.unfit(element, tag, "the name of a block", format!("`{name}`")))?;
        // A block is walked where it is inserted, as deep as what inserts it.
        let inserted = Element {
            name: String::new(),
            attributes: Vec::new(),
            children: block.nodes.clone(),
            at: element.at,
        };
        let own = self.content(&inserted, scope)?;
        content.nodes.extend(own.nodes);
        content.attributes.extend(own.attributes);
        Ok(())
    }

    fn include(
        &mut self,
        element: &Element,
        scope: usize,
        content: &mut Content,
    ) -> Result<(), RobotFileError> {
        let tag = "include";
        self.allow(element, tag, &["filename", "ns", "optional"])?;
        let name = self.stated(element, tag, "filename", scope)?;
        let is_optional = self.flag(element, tag, "optional", scope)?.unwrap_or(false);
        let inner = match element.attribute("ns") {
            None => scope,
            Some(stated) => {
                let namespace = self.text(stated, scope, element.at)?.to_string();
                let inner = self.scopes.within(scope, true);
                self.scopes.set_namespace(scope, &namespace, inner);
                inner
            }
        };
        let path = self.folder().join(&name);
        for path in self.meant(element, &path)? {
            let text = match self.read(&path) {
                Ok(text) => text,
                Err(_) if is_optional => continue,
                Err(reason) => {
                    let fault = XacroFault::File { file: path.display().to_string(), reason };
                    return Err(self.fault(element.at, fault));
                }
            };
            let root = self.enter_file(&path, text)?;
            let own = self.content(&root, inner)?;
            self.leave_file();
            content.nodes.extend(own.nodes);
            content.attributes.extend(own.attributes);
        }
        Ok(())
    }

    /// The files that a name or a pattern means, sorted.
    fn meant(&self, element: &Element, path: &Path) -> Result<Vec<PathBuf>, RobotFileError> {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        // A name with a bracket is a name where there is a file of it.
        if !name.contains(['*', '?', '[']) || path.exists() {
            return Ok(vec![path.to_owned()]);
        }
        let (start, end) = match name.split_once('*') {
            Some((start, end)) if name.matches(['*', '?', '[']).count() == 1 => (start, end),
            _ => {
                let found = format!("`{name}`");
                return Err(self.unfit(
                    element,
                    "include",
                    "a file, or a pattern with one `*` in its name",
                    found,
                ));
            }
        };
        let entries = std::fs::read_dir(path.parent().unwrap_or(Path::new(".")));
        let mut files: Vec<PathBuf> =
            entries.into_iter().flatten().flatten().take(MAX_INCLUDED).map(|entry| entry.path()).collect();
        files.retain(|file| {
            let own = file.file_name().map(|own| own.to_string_lossy().into_owned()).unwrap_or_default();
            own.len() >= start.len() + end.len() && own.starts_with(start) && own.ends_with(end)
        });
        files.sort();
        Ok(files)
    }

    fn define(&mut self, element: &Arc<Element>, scope: usize) -> Result<(), RobotFileError> {
        let tag = "macro";
        self.allow(element, tag, &["name", "params"])?;
        let name = self.needed(element, tag, "name")?;
        let name = name.strip_prefix("xacro:").unwrap_or(name);
        if name == "call" || name.is_empty() || name.contains('.') {
            return Err(self.unfit(element, tag, "a name without a point", format!("`{name}`")));
        }
        let parameters = parameters(element.attribute("params").unwrap_or_default());
        self.scopes.set_macro(scope, name, Macro { parameters, body: element.clone() });
        Ok(())
    }

    /// Puts what a macro becomes. `own`: an attribute that is none of its parameters.
    fn call(
        &mut self,
        name: &str,
        element: &Element,
        own: Option<&str>,
        scope: usize,
        content: &mut Content,
    ) -> Result<(), RobotFileError> {
        let Some((around, called)) = self.scopes.called(scope, name) else {
            return Err(self.fault(element.at, XacroFault::Macro { name: name.to_owned() }));
        };
        let fault = |own: &Self, reason: String| {
            own.fault(element.at, XacroFault::Call { name: name.to_owned(), reason })
        };
        let mut values: Vec<(String, Value)> = Vec::new();
        for (attribute, text) in
            element.attributes.iter().filter(|(attribute, _)| Some(attribute.as_str()) != own)
        {
            if !called.parameters.iter().any(|(parameter, _)| parameter == attribute) {
                return Err(fault(self, format!("expected one of its parameters, found `{attribute}`")));
            }
            values.push((attribute.clone(), self.text(text, scope, element.at)?.literally()));
        }
        // Blocks mean what they mean where the call stands.
        let inside = self.content(element, scope)?;
        let mut blocks = inside.nodes.into_iter().filter_map(|node| match node {
            Node::Element(block) => Some(block),
            Node::Text(_) => None,
        });
        let mut set: Vec<(String, Block)> = Vec::new();
        for (parameter, default) in &called.parameters {
            if parameter.starts_with('*') {
                let block = blocks
                    .next()
                    .ok_or_else(|| fault(self, format!("expected the block `{parameter}`, found none")))?;
                let nodes = match parameter.starts_with("**") {
                    true => block.children.clone(),
                    false => vec![Node::Element(block)],
                };
                set.push((parameter.clone(), Block { nodes }));
            } else if !values.iter().any(|(own, _)| own == parameter) {
                let value = self.default(parameter, default.as_ref(), scope, element.at)?;
                let value = value
                    .ok_or_else(|| fault(self, format!("expected a value of `{parameter}`, found none")))?;
                values.push((parameter.clone(), value.literally()));
            }
        }
        if let Some(block) = blocks.next() {
            return Err(fault(self, format!("expected no further block, found <{}>", block.name)));
        }
        let before = self.scopes.len();
        let inner = self.scopes.within(around, false);
        for (parameter, value) in values {
            self.scopes.set_property(inner, &parameter, Property::Value(value));
        }
        for (parameter, block) in set {
            self.scopes.set_block(inner, parameter, block);
        }
        let own = self.content(&called.body, inner)?;
        self.scopes.truncate(before);
        content.nodes.extend(own.nodes);
        content.attributes.extend(own.attributes);
        Ok(())
    }

    /// The value of a parameter that a call does not state.
    fn default(
        &mut self,
        name: &str,
        default: Option<&Default>,
        scope: usize,
        at: At,
    ) -> Result<Option<Value>, RobotFileError> {
        let Some(default) = default else { return Ok(None) };
        if default.forwarded
            && let Some(value) = self.value(scope, name, at)?
        {
            return Ok(Some(value));
        }
        default.text.as_ref().map(|text| self.text(text, scope, at)).transpose()
    }
}

/// Parameters of a macro: `a b:=1 c:='x y' d:=^ e:=^|2 *block **content`.
fn parameters(text: &str) -> Vec<(String, Option<Default>)> {
    let mut parameters = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let end = rest.find(|c: char| c.is_whitespace() || c == ':' || c == '=').unwrap_or(rest.len());
        let (name, behind) = rest.split_at(end);
        let spaced = behind.trim_start();
        let Some(stated) = spaced.strip_prefix(":=").or_else(|| spaced.strip_prefix('=')) else {
            // A stray sign belongs to nothing: it is stepped over with the name.
            let skipped = spaced.trim_start_matches([':', '=']);
            if !name.is_empty() {
                parameters.push((name.to_owned(), None));
            }
            rest = skipped.trim_start();
            continue;
        };
        let stated = stated.trim_start();
        let (forwarded, stated) = match stated.strip_prefix('^') {
            Some(behind) => (true, behind.strip_prefix('|').unwrap_or(behind)),
            None => (false, stated),
        };
        let end = value_end(stated);
        let text = (end > 0).then(|| stated[..end].to_owned());
        let is_none = text.is_none() && !forwarded;
        let default = Default { forwarded, text: if is_none { Some(String::new()) } else { text } };
        parameters.push((name.to_owned(), Some(default)));
        rest = stated[end..].trim_start();
    }
    parameters
}

/// Bytes of a default: an expression to its closing bracket, else up to a space that is not within quotes.
fn value_end(text: &str) -> usize {
    for (opening, closing) in [("${", '}'), ("$(", ')')] {
        if text.starts_with(opening)
            && let Some(end) = text.find(closing)
        {
            return end + 1;
        }
    }
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match quote {
            Some(open) if open == c => quote = None,
            Some(_) => {}
            None if c == '\'' || c == '"' => quote = Some(c),
            None if c.is_whitespace() => return at,
            None => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::{Default, parameters};

    #[test]
    fn parameters_have_defaults_and_blocks() {
        let own = parameters("a b:=1 c:='x y' d:=^ e:=^|2 f:=${x * 2}\n  *origin **content g = 3 h:=");
        let with = |name: &str, forwarded: bool, text: Option<&str>| {
            (name.to_owned(), Some(Default { forwarded, text: text.map(str::to_owned) }))
        };
        let without = |name: &str| (name.to_owned(), None);
        assert_eq!(
            own,
            [
                without("a"),
                with("b", false, Some("1")),
                with("c", false, Some("'x y'")),
                with("d", true, None),
                with("e", true, Some("2")),
                with("f", false, Some("${x * 2}")),
                without("*origin"),
                without("**content"),
                with("g", false, Some("3")),
                with("h", false, Some("")),
            ]
        );
    }
}
