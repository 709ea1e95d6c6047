//! Every kind of element in one table: name, parameters, settings, and what it can stand beside.
//!
//! Whoever reads names of elements (robot files, configurations, result files), explains them or chooses among them asks the
//! registry. A program adds kinds of its own with [`ElementRegistry::with`].

mod kind;
mod known;

pub use kind::{Candidate, ElementKind, OptionTerm, OptionValue, Placement, StatedTerm};

use std::sync::{Arc, LazyLock};

/// The kinds of elements that a robot may have, in the order in which they are listed.
///
/// A value that travels with what a robot file says of elements; the default holds what comes with the crate. Cheap to clone.
/// Two are equal if they hold kinds of the same names, with the same formulas where they are laws of formulas.
#[derive(Clone)]
pub struct ElementRegistry {
    kinds: Arc<Vec<ElementKind>>,
}

/// Names alone: kinds hold functions, whose addresses differ from run to run.
impl std::fmt::Debug for ElementRegistry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

/// Why a kind of element cannot join a registry.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistryFault {
    /// There is a kind of that name.
    #[error("there is an element `{name}` already")]
    Name {
        /// The name.
        name: &'static str,
    },
    /// A parameter has the symbol of another kind's. Results tell parameters apart by their symbols alone, and some symbols
    /// have a meaning to exported files.
    #[error("parameter `{symbol}` of element `{name}` has the symbol of a parameter of `{other}`")]
    Symbol {
        /// The kind to be added.
        name: &'static str,
        /// The symbol.
        symbol: &'static str,
        /// The kind that has it.
        other: &'static str,
    },
}

impl Default for ElementRegistry {
    fn default() -> Self {
        static KNOWN: LazyLock<Arc<Vec<ElementKind>>> = LazyLock::new(|| Arc::new(known::kinds()));
        ElementRegistry { kinds: KNOWN.clone() }
    }
}

impl PartialEq for ElementRegistry {
    fn eq(&self, other: &Self) -> bool {
        let alike = |registry: &Self| {
            registry.kinds().map(|kind| (kind.name, kind.formula.clone())).collect::<Vec<_>>()
        };
        Arc::ptr_eq(&self.kinds, &other.kinds) || alike(self) == alike(other)
    }
}

impl ElementRegistry {
    /// Returns the registry with one more kind.
    ///
    /// # Errors
    /// [`RegistryFault`] if its name or the symbol of a parameter is taken.
    pub fn with(self, kind: ElementKind) -> Result<Self, RegistryFault> {
        let name = kind.name;
        if self.kind(name).is_some() {
            return Err(RegistryFault::Name { name });
        }
        for symbol in kind.symbols() {
            if let Some(other) = self.kinds().find(|other| other.symbols().any(|s| s == symbol)) {
                return Err(RegistryFault::Symbol { name, symbol, other: other.name });
            }
        }
        let mut kinds = self.kinds.as_ref().clone();
        kinds.push(kind);
        Ok(ElementRegistry { kinds: Arc::new(kinds) })
    }

    /// Returns the registry with those kinds of another one whose names it has not.
    #[must_use]
    pub fn and(self, other: &ElementRegistry) -> Self {
        let new: Vec<ElementKind> =
            other.kinds().filter(|kind| self.kind(kind.name).is_none()).cloned().collect();
        if new.is_empty() {
            return self;
        }
        let kinds = self.kinds.iter().cloned().chain(new).collect();
        ElementRegistry { kinds: Arc::new(kinds) }
    }

    /// All kinds.
    pub fn kinds(&self) -> impl Iterator<Item = &ElementKind> {
        self.kinds.iter()
    }

    /// Their names.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.kinds.iter().map(|kind| kind.name)
    }

    /// The kind of a name.
    pub fn kind(&self, name: &str) -> Option<&ElementKind> {
        self.kinds.iter().find(|kind| kind.name == name)
    }

    /// Whether an element is friction of the joint's own velocity.
    pub fn is_friction(&self, name: &str) -> bool {
        self.kind(name).is_some_and(|kind| kind.friction)
    }

    /// Whether an element has shape parameters, known or not.
    pub fn is_shaped(&self, name: &str) -> bool {
        self.kind(name).is_some_and(|kind| !kind.shape.is_empty())
    }

    /// Whether a symbol is that of a coefficient of friction, which a law that takes energy out of the motion has positive.
    pub fn is_coefficient(&self, symbol: &str) -> bool {
        self.kinds().flat_map(|kind| &kind.linear).any(|term| term.coefficient && term.symbol == symbol)
    }
}
