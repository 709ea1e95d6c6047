//! Laws of friction and of other efforts that files state by formulas.

use std::collections::BTreeMap;

use dynid_model::element::{
    ElementKind, ElementRegistry, FormulaLaw, FormulaLawFault, FormulaTerms, LinearTerm, RegistryFault,
    ShapeTerm, kept, units,
};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// An effort that depends on the motion of a joint, an element like any other: `[law.NAME]`.
///
/// The effort is the sum of coefficients times columns. A formula is made of the velocity `v` (rad/s or m/s), the position `q` (rad or m), the temperature
/// `T` of the joint (°C, of the log), shape parameters, numbers, `pi`, `+ - * / ^`, `sign(v)`, `abs`, `sqrt`, `exp`, `ln`, `sin`, `cos`, `tanh`, `atan`
/// and `logistic`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LawSpec {
    /// What each coefficient multiplies, by its symbol: a formula, or a table with `formula`.
    pub columns: BTreeMap<String, LawColumn>,
    /// Shape parameters by symbol: a pair of bounds, or a table with `lower` and `upper`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shape: BTreeMap<String, LawShape>,
    /// The effort is friction: a law for all joints takes its place, and it counts in reports on passivity unless a column reads the position. Default true.
    #[serde(default = "yes")]
    pub friction: bool,
}

fn yes() -> bool {
    true
}

/// A column of a law.
#[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LawColumn {
    /// The formula.
    pub formula: String,
    /// What the coefficient is. Default `effort`.
    pub unit: LawUnit,
    /// Smallest value of the coefficient. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least: Option<f64>,
}

/// A shape parameter of a law.
#[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LawShape {
    /// Lower bound of the search.
    pub lower: f64,
    /// Upper bound of the search. Bounds above 0 are searched on a logarithmic scale.
    pub upper: f64,
    /// Start of the search, or the value where it is held. Default: the middle of the bounds, the geometric one above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
    /// What the parameter is. Default `speed`.
    pub unit: LawUnit,
    /// The value is known: `start`. Default false.
    pub held: bool,
}

/// What a parameter of a law is; units are those of the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawUnit {
    /// N m, N.
    #[default]
    Effort,
    /// N m s/rad, N s/m.
    Viscous,
    /// rad/s, m/s.
    Speed,
    /// s/rad, s/m.
    PerSpeed,
    /// rad, m.
    Position,
    /// 1/rad, 1/m.
    PerPosition,
    /// N m/rad, N/m.
    Stiffness,
    /// A number.
    Number,
}

impl LawUnit {
    const ALL: [(LawUnit, [&'static str; 2]); 8] = [
        (LawUnit::Effort, units::EFFORT),
        (LawUnit::Viscous, units::VISCOUS),
        (LawUnit::Speed, units::SPEED),
        (LawUnit::PerSpeed, units::PER_SPEED),
        (LawUnit::Position, units::POSITION),
        (LawUnit::PerPosition, units::PER_ANGLE),
        (LawUnit::Stiffness, units::STIFFNESS),
        (LawUnit::Number, units::NUMBER),
    ];

    fn units(self) -> [&'static str; 2] {
        Self::ALL.into_iter().find(|(unit, _)| *unit == self).map_or(units::NUMBER, |(_, units)| units)
    }

    fn of(units: [&'static str; 2]) -> LawUnit {
        Self::ALL.into_iter().find(|(_, known)| *known == units).map_or(LawUnit::Number, |(unit, _)| unit)
    }
}

/// Why a file's law cannot be one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawFault {
    /// The name is no name.
    #[error("expected a name of letters, digits and _ that begins with a letter")]
    Name,
    /// Its formulas and parameters make no law.
    #[error(transparent)]
    Law(#[from] FormulaLawFault),
    /// Its name or the symbol of a parameter is taken.
    #[error(transparent)]
    Taken(#[from] RegistryFault),
    /// A parameter that is held without a value.
    #[error("shape parameter `{symbol}`: expected the value that it is held at under `start`, found none")]
    NoValue {
        /// The parameter.
        symbol: String,
    },
}

impl LawFault {
    /// What to do about it: how a law is stated.
    pub const HINT: &str = "`[law.mine]` has `columns = { hc = \"sign(v)\", hv = \"v / (1 + abs(v)/v0)\" }` and `shape = { v0 = [0.01, 3] }`, bounds in rad/s or m/s";
}

impl LawSpec {
    /// The law of a kind of element, if formulas state it.
    pub fn of(kind: &ElementKind) -> Option<LawSpec> {
        let terms = kind.formula.as_ref()?.terms();
        let column = |(term, formula): &(LinearTerm, String)| {
            let column =
                LawColumn { formula: formula.clone(), unit: LawUnit::of(term.units), least: term.lower };
            (term.symbol.to_owned(), column)
        };
        let shape = |term: &ShapeTerm| {
            let shape = LawShape {
                lower: term.lower,
                upper: term.upper,
                start: term.start,
                unit: LawUnit::of(term.units),
                held: term.held,
            };
            (term.symbol.to_owned(), shape)
        };
        Some(LawSpec {
            columns: terms.columns.iter().map(column).collect(),
            shape: terms.shape.iter().map(shape).collect(),
            friction: terms.is_friction,
        })
    }

    /// The kind of element that it is, under a name.
    ///
    /// # Errors
    /// [`LawFault`].
    pub fn kind(&self, name: &str) -> Result<ElementKind, LawFault> {
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !plain || !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
            return Err(LawFault::Name);
        }
        let column = |(symbol, column): (&String, &LawColumn)| {
            let term = LinearTerm::new(kept(symbol), column.unit.units());
            let term = LinearTerm { lower: column.least, coefficient: self.friction, ..term };
            (term, column.formula.clone())
        };
        let shape = |(symbol, shape): (&String, &LawShape)| {
            let LawShape { lower, upper, start, unit, held } = *shape;
            let positive = lower > 0.0;
            let value = match start {
                None if held => return Err(LawFault::NoValue { symbol: symbol.clone() }),
                None if !positive => Some(0.5 * (lower + upper)),
                start => start,
            };
            let term = ShapeTerm::positive(kept(symbol), unit.units(), lower, upper);
            Ok(ShapeTerm { start: value, positive, held, ..term })
        };
        let law = FormulaLaw::new(FormulaTerms {
            columns: self.columns.iter().map(column).collect(),
            shape: self.shape.iter().map(shape).collect::<Result<_, _>>()?,
            is_friction: self.friction,
        })?;
        Ok(ElementKind::formula(name, law))
    }
}

/// A registry with laws of files among its kinds. A law that it has already, stated alike, is no fault.
///
/// # Errors
/// The name of the law that cannot be, and why.
pub fn with_laws(
    registry: ElementRegistry,
    laws: &BTreeMap<String, LawSpec>,
) -> Result<ElementRegistry, (String, Box<LawFault>)> {
    laws.iter().try_fold(registry, |registry, (name, law)| {
        let kind = law.kind(name).map_err(|fault| (name.clone(), Box::new(fault)))?;
        if registry.kind(name).is_some_and(|known| known.formula.is_some() && known.formula == kind.formula) {
            return Ok(registry);
        }
        registry.with(kind).map_err(|fault| (name.clone(), Box::new(fault.into())))
    })
}

/// The keys, for serde.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ColumnTable {
    formula: String,
    #[serde(default)]
    unit: LawUnit,
    least: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ShapeTable {
    lower: f64,
    upper: f64,
    start: Option<f64>,
    unit: Option<LawUnit>,
    #[serde(default)]
    held: bool,
}

impl<'de> Deserialize<'de> for LawColumn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = LawColumn;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a formula, or a table with `formula`")
            }
            fn visit_str<E>(self, formula: &str) -> Result<LawColumn, E> {
                Ok(LawColumn { formula: formula.to_owned(), unit: LawUnit::Effort, least: None })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<LawColumn, A::Error> {
                let table = ColumnTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(LawColumn { formula: table.formula, unit: table.unit, least: table.least })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl<'de> Deserialize<'de> for LawShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = LawShape;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a pair of bounds, or a table with `lower` and `upper`")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<LawShape, A::Error> {
                let [lower, upper] = <[f64; 2]>::deserialize(SeqAccessDeserializer::new(list))?;
                Ok(LawShape { lower, upper, start: None, unit: LawUnit::Speed, held: false })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<LawShape, A::Error> {
                let ShapeTable { lower, upper, start, unit, held } =
                    ShapeTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(LawShape { lower, upper, start, unit: unit.unwrap_or(LawUnit::Speed), held })
            }
        }
        deserializer.deserialize_any(Either)
    }
}
