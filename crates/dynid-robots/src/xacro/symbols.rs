//! Properties, blocks and macros by their names, in scopes that lie within each other.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::tree::{Element, Node};
use super::value::Value;

/// A property.
#[derive(Clone, Debug)]
pub(super) enum Property {
    /// A text that is computed where it is first used.
    Lazy(Arc<str>),
    /// Being computed: a use of it now is a circle.
    Busy,
    Value(Value),
}

/// A part of a tree that is inserted by name.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) nodes: Vec<Node>,
}

/// How a parameter of a macro gets a value where none is stated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Default {
    /// From the property of the same name around the call.
    pub(super) forwarded: bool,
    /// From this text.
    pub(super) text: Option<String>,
}

/// A macro.
#[derive(Clone, Debug)]
pub(super) struct Macro {
    /// Names, those of blocks with `*` or `**`.
    pub(super) parameters: Vec<(String, Option<Default>)>,
    pub(super) body: Arc<Element>,
}

/// Names of a file, a macro call or a namespace.
#[derive(Debug, Default)]
pub(super) struct Scope {
    /// The scope around it.
    parent: Option<usize>,
    /// Names of an included file with `ns`.
    is_namespace: bool,
    properties: BTreeMap<String, Property>,
    blocks: BTreeMap<String, Arc<Block>>,
    macros: BTreeMap<String, Arc<Macro>>,
    namespaces: BTreeMap<String, usize>,
}

/// All scopes; the first one is that of the file.
#[derive(Debug)]
pub(super) struct Scopes {
    all: Vec<Scope>,
}

/// The outermost scope.
pub(super) const OUTERMOST: usize = 0;

impl Scopes {
    pub(super) fn new() -> Self {
        Scopes { all: vec![Scope::default()] }
    }

    /// Number of scopes, for [`Scopes::truncate`].
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Forgets the scopes of a macro call and those within it.
    pub(super) fn truncate(&mut self, len: usize) {
        self.all.truncate(len);
    }

    /// A new scope within another.
    pub(super) fn within(&mut self, parent: usize, is_namespace: bool) -> usize {
        self.all.push(Scope { parent: Some(parent), is_namespace, ..Scope::default() });
        self.all.len() - 1
    }

    /// The scope and those around it, innermost first.
    fn chain(&self, scope: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(scope), |scope| self.all[*scope].parent)
    }

    /// The scope that has a property, and the property.
    pub(super) fn property(&self, scope: usize, name: &str) -> Option<(usize, &Property)> {
        self.chain(scope).find_map(|k| Some((k, self.all[k].properties.get(name)?)))
    }

    /// A namespace that is seen from a scope.
    pub(super) fn namespace(&self, scope: usize, name: &str) -> Option<usize> {
        self.chain(scope).find_map(|k| self.all[k].namespaces.get(name).copied())
    }

    pub(super) fn block(&self, scope: usize, name: &str) -> Option<Arc<Block>> {
        self.chain(scope).find_map(|k| self.all[k].blocks.get(name).cloned())
    }

    /// A macro by its name, with the namespaces before it, and the scope around its calls.
    pub(super) fn called(&self, scope: usize, name: &str) -> Option<(usize, Arc<Macro>)> {
        let (mut scope, mut own) = (scope, name);
        while let Some((space, rest)) = own.split_once('.') {
            (scope, own) = (self.namespace(scope, space)?, rest);
        }
        let found = self.chain(scope).find_map(|k| self.all[k].macros.get(own).cloned());
        found.map(|found| (scope, found))
    }

    pub(super) fn set_property(&mut self, scope: usize, name: &str, property: Property) {
        self.all[scope].properties.insert(name.to_owned(), property);
    }

    pub(super) fn set_block(&mut self, scope: usize, name: String, block: Block) {
        self.all[scope].blocks.insert(name, Arc::new(block));
    }

    pub(super) fn set_macro(&mut self, scope: usize, name: &str, own: Macro) {
        self.all[scope].macros.insert(name.to_owned(), Arc::new(own));
    }

    pub(super) fn set_namespace(&mut self, scope: usize, name: &str, namespace: usize) {
        self.all[scope].namespaces.insert(name.to_owned(), namespace);
    }

    /// Forgets a property wherever it is seen from a scope.
    pub(super) fn remove(&mut self, scope: usize, name: &str) {
        let chain: Vec<usize> = self.chain(scope).collect();
        for k in chain {
            self.all[k].properties.remove(name);
        }
    }

    /// The scope around a macro call, past namespaces; of the outermost one itself.
    pub(super) fn around(&self, scope: usize) -> usize {
        let mut around = self.all[scope].parent.unwrap_or(OUTERMOST);
        while self.all[around].is_namespace
            && let Some(parent) = self.all[around].parent
        {
            around = parent;
        }
        around
    }
}
