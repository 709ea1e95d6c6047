//! Finite numbers and angles in TOML.

use toml::Value;

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Unexpected, Visitor};

use crate::robot_numbers::is_in_range;

/// A finite number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Number(pub(super) f64);

/// A finite number, or an angle as text with its unit; rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Angle(pub(super) f64);

/// Visits numbers; with `angles` also texts such as `"90deg"`.
struct NumberVisitor {
    angles: bool,
}

impl Visitor<'_> for NumberVisitor {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.angles {
            "a finite number (rad, m) up to 1e30 or an angle like \"90deg\""
        } else {
            "a finite number up to 1e30"
        })
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<f64, E> {
        if is_in_range(x) { Ok(x) } else { Err(E::invalid_value(Unexpected::Float(x), &self)) }
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<f64, E> {
        Ok(x as f64)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<f64, E> {
        Ok(x as f64)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<f64, E> {
        let angle = if self.angles { angle(text) } else { None };
        angle.ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
    }
}

/// Position of a joint: a number or an angle, or a list of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Position(pub(super) Vec<f64>);

struct PositionVisitor;

impl<'de> Visitor<'de> for PositionVisitor {
    type Value = Position;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a finite number (rad, m) up to 1e30, an angle like \"90deg\", or a list of them")
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Position, E> {
        NumberVisitor { angles: true }.visit_f64(x).map(|x| Position(vec![x]))
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Position, E> {
        self.visit_f64(x as f64)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Position, E> {
        self.visit_f64(x as f64)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Position, E> {
        NumberVisitor { angles: true }.visit_str(text).map(|x| Position(vec![x]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Position, A::Error> {
        let mut values = Vec::new();
        while let Some(Angle(x)) = list.next_element()? {
            values.push(x);
        }
        Ok(Position(values))
    }
}

/// `"90deg"`, `"-90 deg"`, `"1.5rad"` in rad.
fn angle(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, degrees) = match (text.strip_suffix("deg"), text.strip_suffix("rad")) {
        (Some(number), _) => (number, true),
        (None, Some(number)) => (number, false),
        (None, None) => return None,
    };
    let x: f64 = number.trim().parse().ok()?;
    let x = if degrees { x.to_radians() } else { x };
    is_in_range(x).then_some(x)
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberVisitor { angles: false }).map(Number)
    }
}

impl<'de> Deserialize<'de> for Angle {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberVisitor { angles: true }).map(Angle)
    }
}

impl<'de> Deserialize<'de> for Position {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PositionVisitor)
    }
}

pub(super) fn number(value: &Value) -> Option<f64> {
    let x = value.as_float().or_else(|| value.as_integer().map(|i| i as f64))?;
    crate::robot_numbers::is_in_range(x).then_some(x)
}
