//! One row of the registry.

use std::fmt;
use std::sync::Arc;

use crate::element::formula::{FormulaAtJoint, FormulaLaw, kept};
use crate::element::{AtJoint, JointElement, LinearTerm, ShapeSetting, ShapeTerm, VelocityLaw};

/// A kind of element: all that is known of it before it stands at a joint.
#[derive(Debug, Clone)]
pub struct ElementKind {
    /// Name in files.
    pub name: &'static str,
    /// The effort that it adds, over `q̇` (`dq/dt`), in the symbols of its parameters.
    pub equation: &'static str,
    /// What it is, what it stands beside or in place of.
    pub help: &'static str,
    /// Author and year of the source, if it has one.
    pub reference: Option<&'static str>,
    /// Linear parameters.
    pub linear: Vec<LinearTerm>,
    /// Shape parameters with their default start and bounds.
    pub shape: Vec<ShapeTerm>,
    /// Settings that state a linear parameter.
    pub stated: Vec<StatedTerm>,
    /// Further settings.
    pub options: Vec<OptionTerm>,
    /// Friction of the joint's own velocity.
    pub friction: bool,
    /// One law of friction for all joints takes its place.
    pub gives_way: bool,
    /// Only joints that turn have it.
    pub turns: bool,
    /// Elements that say the same whatever the motion: name, and why. Those are to be left out beside it.
    pub excludes: Vec<(&'static str, &'static str)>,
    /// Elements that only a suitable motion tells from it: name, and what it takes.
    pub alike: Vec<(&'static str, &'static str)>,
    /// Where it is a candidate that held-out blocks may ask for.
    pub candidate: Option<Candidate>,
    /// The law, where it is stated by formulas.
    pub formula: Option<Arc<FormulaLaw>>,
    pub(super) build: Build,
}

/// A setting that states the value of a linear parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedTerm {
    /// Key.
    pub key: &'static str,
    /// Symbol of the parameter.
    pub symbol: &'static str,
}

/// A setting that is neither a parameter nor its value.
#[derive(Debug, Clone, Copy)]
pub enum OptionTerm {
    /// A number for which a condition holds.
    Number {
        /// Key.
        key: &'static str,
        /// Default, in words.
        default: &'static str,
        /// What is expected, in words.
        expected: &'static str,
        /// Whether it is.
        holds: fn(f64) -> bool,
    },
    /// True or false; false by default.
    Flag {
        /// Key.
        key: &'static str,
    },
}

impl OptionTerm {
    /// Key.
    pub fn key(&self) -> &'static str {
        match self {
            OptionTerm::Number { key, .. } | OptionTerm::Flag { key } => key,
        }
    }
}

/// Value of such a setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptionValue {
    /// A number.
    Number(f64),
    /// True or false.
    Flag(bool),
}

/// Where a kind is a candidate for the friction of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// One of these is at the joint already.
    pub beside: &'static [&'static str],
    /// Only where no element of the joint has shape parameters.
    pub unless_shaped: bool,
    /// The element whose place it takes; none: it joins them.
    pub instead_of: Option<&'static str>,
    /// Symbol of the shape parameter that a search finds, if it has one.
    pub value: Option<&'static str>,
}

/// Where and how an element is to stand.
#[derive(Debug, Clone, Copy)]
pub struct Placement<'a> {
    /// Rate it acts on.
    pub rate: usize,
    /// Settings of the shape parameters, in the kind's order.
    pub shape: &'a [ShapeSetting],
    /// Values of options by key, checked.
    pub options: &'a [(&'static str, OptionValue)],
}

impl Placement<'_> {
    /// A number among the options.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.options.iter().find_map(|(k, value)| match value {
            OptionValue::Number(x) if *k == key => Some(*x),
            _ => None,
        })
    }

    /// A flag among the options; false where nothing is said.
    pub fn flag(&self, key: &str) -> bool {
        self.options.iter().any(|(k, value)| *k == key && *value == OptionValue::Flag(true))
    }
}

/// How an element of a kind comes to be.
#[derive(Clone)]
pub(super) enum Build {
    /// From a law of velocity.
    Law(Arc<dyn Law>),
    /// From a function.
    Element(fn(&Placement<'_>) -> Result<Box<dyn JointElement>, String>),
    /// It takes more than a joint: whoever knows the whole robot builds it.
    Robot,
}

impl fmt::Debug for Build {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Build::Law(law) => law.fmt(f),
            Build::Element(_) => f.write_str("Element"),
            Build::Robot => f.write_str("Robot"),
        }
    }
}

/// A law that can be placed.
pub(super) trait Law: fmt::Debug + Send + Sync {
    fn at(&self, placement: &Placement<'_>) -> Box<dyn JointElement>;
}

#[derive(Debug)]
struct Placeable<L, const N: usize, const M: usize>(L);

impl<L: VelocityLaw<N, M> + Clone + 'static, const N: usize, const M: usize> Law for Placeable<L, N, M> {
    fn at(&self, placement: &Placement<'_>) -> Box<dyn JointElement> {
        let shape = std::array::from_fn(|k| placement.shape[k]);
        Box::new(AtJoint { rate: placement.rate, law: self.0.clone(), shape })
    }
}

impl Law for FormulaLaw {
    fn at(&self, placement: &Placement<'_>) -> Box<dyn JointElement> {
        Box::new(FormulaAtJoint {
            rate: placement.rate,
            law: Arc::new(self.clone()),
            shape: placement.shape.to_vec(),
        })
    }
}

impl ElementKind {
    /// A law of velocity. A setting with the symbol of a coefficient states its value; one law of friction for all joints takes
    /// its place, if it is friction.
    pub fn law<L: VelocityLaw<N, M> + Clone + 'static, const N: usize, const M: usize>(
        name: &'static str,
        law: L,
    ) -> Self {
        let linear = law.linear().to_vec();
        let stated = linear.iter().map(|term| StatedTerm { key: term.symbol, symbol: term.symbol }).collect();
        let (shape, friction) = (law.shape().to_vec(), law.is_friction());
        let build = Build::Law(Arc::new(Placeable(law)));
        ElementKind { linear, shape, stated, friction, gives_way: friction, ..Self::bare(name, build) }
    }

    /// A law that is stated by formulas. As [`ElementKind::law`].
    pub fn formula(name: &str, law: FormulaLaw) -> Self {
        let terms = law.terms();
        let linear: Vec<LinearTerm> = terms.columns.iter().map(|(term, _)| *term).collect();
        let stated = linear.iter().map(|term| StatedTerm { key: term.symbol, symbol: term.symbol }).collect();
        let (shape, friction, gives_way) = (terms.shape.clone(), law.is_friction(), terms.is_friction);
        let equation = kept(&law.equation());
        let law = Arc::new(law);
        let bare = Self::bare(kept(name), Build::Law(law.clone()));
        ElementKind { linear, shape, stated, friction, gives_way, equation, formula: Some(law), ..bare }
    }

    pub(super) fn bare(name: &'static str, build: Build) -> Self {
        ElementKind {
            name,
            equation: "",
            help: "",
            reference: None,
            linear: Vec::new(),
            shape: Vec::new(),
            stated: Vec::new(),
            options: Vec::new(),
            friction: false,
            gives_way: false,
            turns: false,
            excludes: Vec::new(),
            alike: Vec::new(),
            candidate: None,
            formula: None,
            build,
        }
    }

    /// Returns the kind with its equation.
    #[must_use]
    pub fn equation(self, equation: &'static str) -> Self {
        ElementKind { equation, ..self }
    }

    /// Returns the kind with words on what it is.
    #[must_use]
    pub fn help(self, help: &'static str) -> Self {
        ElementKind { help, ..self }
    }

    /// Returns the kind with author and year of its source.
    #[must_use]
    pub fn reference(self, reference: &'static str) -> Self {
        ElementKind { reference: Some(reference), ..self }
    }

    /// Returns the kind with keys of its coefficients in place of their symbols, in their order.
    ///
    /// # Panics
    /// If there are more keys than coefficients.
    #[must_use]
    pub fn keys(mut self, keys: &[&'static str]) -> Self {
        assert!(
            keys.len() <= self.linear.len(),
            "element `{}` has {} coefficients",
            self.name,
            self.linear.len()
        );
        let terms = keys.iter().zip(&self.linear);
        self.stated = terms.map(|(key, term)| StatedTerm { key, symbol: term.symbol }).collect();
        self
    }

    /// Returns the kind with an element that says the same beside it whatever the motion, and why.
    #[must_use]
    pub fn excludes(mut self, name: &'static str, why: &'static str) -> Self {
        self.excludes.push((name, why));
        self
    }

    /// Returns the kind with an element that only a suitable motion tells from it: what it takes.
    #[must_use]
    pub fn alike(mut self, name: &'static str, needs: &'static str) -> Self {
        self.alike.push((name, needs));
        self
    }

    /// Symbols of all parameters, linear ones first.
    pub fn symbols(&self) -> impl Iterator<Item = &'static str> {
        self.linear.iter().map(|term| term.symbol).chain(self.shape.iter().map(|term| term.symbol))
    }

    /// Whether bounds of its shape parameters go with the speeds in use.
    pub fn scales(&self) -> bool {
        self.shape.iter().any(ShapeTerm::scales)
    }

    /// The element at a joint; `None` for a kind that takes more than a joint.
    ///
    /// # Errors
    /// In words, if settings contradict each other.
    ///
    /// # Panics
    /// If there is not one shape setting per shape parameter.
    pub fn place(&self, placement: &Placement<'_>) -> Option<Result<Box<dyn JointElement>, String>> {
        assert_eq!(placement.shape.len(), self.shape.len(), "shape settings of `{}`", self.name);
        match &self.build {
            Build::Law(law) => Some(Ok(law.at(placement))),
            Build::Element(build) => Some(build(placement)),
            Build::Robot => None,
        }
    }
}
