//! Laws of the motion of a joint that are stated by formulas, not by code: a file may bring its own.

mod at_joint;
mod expression;

use std::collections::HashSet;
use std::sync::{Arc, Mutex, PoisonError};

pub use expression::{FormulaFault, RESERVED};

use dynid_algebra::scalar::{Cross, Scalar};

use super::{LinearTerm, ShapeTerm, Velocity};
use expression::{Formula, Instant};

/// Most coefficients, and most shape parameters, of a law.
const MOST: usize = 8;
/// Speeds at which columns are tried, rad/s or m/s, positions, rad or m, and temperatures, °C.
const TRIED: [f64; 7] = [1e-4, 1e-2, 0.1, 0.5, 1.0, 3.0, 10.0];
const PLACES: [f64; 7] = [0.0, 0.1, -0.4, 1.0, -1.5, 2.2, -3.0];
const WARM: [f64; 3] = [0.0, 25.0, 60.0];

/// What a law is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct FormulaTerms {
    /// Coefficients and what each multiplies.
    pub columns: Vec<(LinearTerm, String)>,
    /// Shape parameters.
    pub shape: Vec<ShapeTerm>,
    /// The effort is friction. Of the joint's own velocity alone, unless a column reads the position.
    pub is_friction: bool,
}

/// Why there is no such law.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormulaLawFault {
    /// A formula cannot be read.
    #[error("column `{symbol}`: {fault}")]
    Formula {
        /// The coefficient.
        symbol: &'static str,
        /// What is wrong.
        fault: FormulaFault,
    },
    /// A name that no parameter can have.
    #[error("parameter `{symbol}`: expected a name of letters, digits and _ that begins with a letter and is none of {}", RESERVED.join(", "))]
    Symbol {
        /// The name.
        symbol: &'static str,
    },
    /// The same name twice.
    #[error("parameter `{symbol}`: there are two of that name")]
    Twice {
        /// The name.
        symbol: &'static str,
    },
    /// Too few or too many of something.
    #[error("expected {expected}, found {found}")]
    Count {
        /// What is expected.
        expected: &'static str,
        /// How many there are.
        found: usize,
    },
    /// Bounds between which nothing lies, or a start beyond them.
    #[error("shape parameter `{symbol}`: {fault}")]
    Bounds {
        /// The parameter.
        symbol: &'static str,
        /// What is wrong.
        fault: super::shape::ShapeFault,
    },
    /// A parameter that changes nothing.
    #[error("shape parameter `{symbol}`: no column reads it")]
    Unused {
        /// The parameter.
        symbol: &'static str,
    },
    /// A column that is no number somewhere, or has no slope.
    #[error("column `{symbol}`: expected a finite {what} everywhere, found {found} at v = {v}, q = {q}{}", at.iter().map(|(s, x)| format!(", {s} = {x}")).collect::<String>())]
    NotFinite {
        /// The coefficient.
        symbol: &'static str,
        /// `number` or `slope`.
        what: &'static str,
        /// What it is there.
        found: f64,
        /// The velocity.
        v: f64,
        /// The position.
        q: f64,
        /// Values of the shape parameters.
        at: Vec<(&'static str, f64)>,
    },
}

/// A law whose columns are formulas of the motion of a joint; see [`ElementKind::formula`](super::ElementKind::formula).
///
/// A formula is made of the velocity `v` (rad/s or m/s), the position `q` (rad or m), the temperature `T` of the joint (°C, from the log), shape parameters,
/// numbers, `pi`, `+ - * / ^`, `sign(v)`, `abs`, `sqrt`, `exp`, `ln`, `sin`, `cos`, `tanh`, `atan` and `logistic` (`1 / (1 + exp(-x))`). Values, slopes and time derivatives follow from it exactly. `x^p`
/// with a `p` that is no whole number from -16 to 16 asks for an `x` that is not negative.
#[derive(Debug, Clone, PartialEq)]
pub struct FormulaLaw {
    terms: FormulaTerms,
    formulas: Vec<Formula>,
}

impl FormulaLaw {
    /// A law of its terms. Columns are tried over speeds, positions, temperatures and bounds.
    ///
    /// # Errors
    /// [`FormulaLawFault`].
    pub fn new(terms: FormulaTerms) -> Result<Self, FormulaLawFault> {
        let (columns, shapes) = (terms.columns.len(), terms.shape.len());
        if columns == 0 || columns > MOST {
            return Err(FormulaLawFault::Count { expected: "1 to 8 columns", found: columns });
        }
        if shapes > MOST {
            return Err(FormulaLawFault::Count { expected: "at most 8 shape parameters", found: shapes });
        }
        let symbols = terms.columns.iter().map(|c| c.0.symbol).chain(terms.shape.iter().map(|s| s.symbol));
        let mut seen = HashSet::new();
        for symbol in symbols {
            let plain = symbol.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            let begins = symbol.starts_with(|c: char| c.is_ascii_alphabetic());
            if !plain || !begins || RESERVED.contains(&symbol) {
                return Err(FormulaLawFault::Symbol { symbol });
            }
            if !seen.insert(symbol) {
                return Err(FormulaLawFault::Twice { symbol });
            }
        }
        for term in &terms.shape {
            let setting = term.setting(1.0);
            let checked = setting.check(term.positive);
            checked.map_err(|fault| FormulaLawFault::Bounds { symbol: term.symbol, fault })?;
        }
        let names: Vec<&str> = terms.shape.iter().map(|term| term.symbol).collect();
        let read = |(term, text): &(LinearTerm, String)| {
            Formula::parse(text, &names)
                .map_err(|fault| FormulaLawFault::Formula { symbol: term.symbol, fault })
        };
        let formulas = terms.columns.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        let mut law = FormulaLaw { terms, formulas };
        if let Some((_, term)) =
            law.terms.shape.iter().enumerate().find(|(k, _)| !law.formulas.iter().any(|f| f.reads(*k)))
        {
            return Err(FormulaLawFault::Unused { symbol: term.symbol });
        }
        law.tried()?;
        // A coefficient of friction takes energy out of the motion where it is positive: `-v^3` has none.
        let takes =
            |formula: &Formula| law.points().all(|(at, shape)| at.v.value * formula.tried(at, &shape) >= 0.0);
        let takes: Vec<bool> = law.formulas.iter().map(takes).collect();
        for ((term, _), takes) in law.terms.columns.iter_mut().zip(takes) {
            term.coefficient &= takes;
        }
        Ok(law)
    }

    /// What it is made of.
    pub fn terms(&self) -> &FormulaTerms {
        &self.terms
    }

    /// The effort in the symbols of its parameters.
    pub fn equation(&self) -> String {
        let part = |(term, text): &(LinearTerm, String)| format!("{} ({text})", term.symbol);
        self.terms.columns.iter().map(part).collect::<Vec<_>>().join(" + ")
    }

    /// Whether the effort is friction of the joint's own velocity alone.
    pub fn is_friction(&self) -> bool {
        self.terms.is_friction && !self.is_positional()
    }

    fn is_positional(&self) -> bool {
        self.formulas.iter().any(Formula::is_positional)
    }

    fn is_thermal(&self) -> bool {
        self.formulas.iter().any(Formula::is_thermal)
    }

    fn tried(&self) -> Result<(), FormulaLawFault> {
        for (instant, shape) in self.points() {
            let Instant { q, v } = instant;
            for (formula, (term, _)) in self.formulas.iter().zip(&self.terms.columns) {
                let fault = |what, found| {
                    let at = self.terms.shape.iter().map(|t| t.symbol).zip(shape.iter().copied()).collect();
                    FormulaLawFault::NotFinite { symbol: term.symbol, what, found, v: v.value, q, at }
                };
                let found = formula.tried(instant, &shape);
                if !found.is_finite() {
                    return Err(fault("number", found));
                }
                // There may be no slope where the number is finite: `1 / (1 + exp(-v / w))` once the exponential is beyond all numbers.
                for by in 0..shape.len().max(1) {
                    let of = |(k, x): (usize, &f64)| cross(*x, 0.0, f64::from(u8::from(k == by)));
                    let shape: Vec<Cross> = shape.iter().enumerate().map(of).collect();
                    for [by_q, by_v] in [[0.0, 1.0], [1.0, 0.0]] {
                        let temperature = Cross::from_f64(v.temperature);
                        let value = cross(v.value, by_v, 0.0);
                        let v = Velocity { value, sign_width: 0.0, temperature };
                        let Cross { a, b, ab, .. } =
                            formula.at(Instant { q: cross(q, by_q, 0.0), v }, &shape);
                        if let Some(slope) = [a, b, ab].into_iter().find(|slope| !slope.is_finite()) {
                            return Err(fault("slope", slope));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Where columns are tried: velocities of both signs and none, at temperatures and positions, with all shape parameters at their start, lower and
    /// upper bounds.
    fn points(&self) -> impl Iterator<Item = (Instant<f64>, Vec<f64>)> + use<> {
        let settings: Vec<_> = self.terms.shape.iter().map(|term| term.setting(1.0)).collect();
        let places = if self.is_positional() { &PLACES[..] } else { &PLACES[..1] };
        let ends: [fn(&super::ShapeSetting) -> f64; 3] = [|s| s.start, |s| s.lower, |s| s.upper];
        let velocities = || TRIED.into_iter().flat_map(|v| [v, -v]).chain([0.0]);
        let states = move || velocities().flat_map(move |v| places.iter().map(move |q| (*q, v)));
        ends.into_iter().flat_map(move |end| {
            let shape: Vec<f64> = settings.iter().map(end).collect();
            states().flat_map(|state| WARM.map(|temperature| (state, temperature))).map(
                move |((q, v), temperature)| {
                    (Instant { q, v: Velocity { value: v, sign_width: 0.0, temperature } }, shape.clone())
                },
            )
        })
    }
}

fn cross(value: f64, a: f64, b: f64) -> Cross {
    Cross { value, a, b, ab: 0.0 }
}

/// The text as one that lives as long as the program, as names of kinds do: each is kept once.
pub fn kept(text: &str) -> &'static str {
    static TEXTS: Mutex<Option<HashSet<&'static str>>> = Mutex::new(None);
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    let texts = texts.get_or_insert_with(HashSet::new);
    if let Some(text) = texts.get(text) {
        return text;
    }
    let text: &'static str = Box::leak(text.to_owned().into_boxed_str());
    texts.insert(text);
    text
}

/// A law at a rate, with start, bounds or value of each of its shape parameters.
#[derive(Debug, Clone)]
pub(super) struct FormulaAtJoint {
    pub(super) rate: usize,
    pub(super) law: Arc<FormulaLaw>,
    pub(super) shape: Vec<super::ShapeSetting>,
}
