//! Values of expressions, as Python has them: what xacro files compute with.

use std::cmp::Ordering;
use std::fmt;
use std::sync::Arc;

/// Longest text that an expression may make, bytes.
pub(super) const MAX_TEXT: usize = 1 << 20;
/// Most entries of a list that an expression may make.
pub(super) const MAX_LIST: usize = 100_000;
/// Deepest nesting of lists and dictionaries.
const MAX_DEPTH: usize = 64;
/// Most values in a value, those that stand there twice counted twice: lists share what they hold, so that a short expression could stand for more
/// than any memory once it is written or compared.
pub(super) const MAX_WEIGHT: usize = 1_000_000;
/// Bytes of a text that weigh as much as a value.
const BYTES: usize = 32;

/// A value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(Arc<str>),
    /// A list, a tuple or a range.
    List(Arc<Vec<Value>>),
    Map(Arc<Vec<(Value, Value)>>),
    /// A function by its name, without the namespace that it may have been called by.
    Function(&'static str),
    /// A method of a value.
    Method(Arc<Value>, Arc<str>),
    /// `math`, `python` or `xacro`.
    Library,
    /// Properties of an included file with `ns`, by the number of their scope.
    Scope(usize),
}

impl Value {
    pub(super) fn text(text: impl Into<Arc<str>>) -> Value {
        Value::Text(text.into())
    }

    pub(super) fn list(values: Vec<Value>) -> Value {
        Value::List(Arc::new(values))
    }

    /// What a text stands for in a property: a number or a truth value if it reads so, else itself without single quotes around.
    pub(super) fn literal(text: &str) -> Value {
        if text.len() >= 2 && text.starts_with('\'') && text.ends_with('\'') {
            return Value::text(&text[1..text.len() - 1]);
        }
        // Python takes underscores within numbers; properties do not.
        if text.contains('_') {
            return Value::text(text);
        }
        let trimmed = text.trim();
        if let Ok(number) = trimmed.parse() {
            return Value::Int(number);
        }
        if let Ok(number) = trimmed.parse() {
            return Value::Float(number);
        }
        match text {
            "true" | "True" => Value::Bool(true),
            "false" | "False" => Value::Bool(false),
            _ => Value::text(text),
        }
    }

    /// Texts become what they stand for ([`Value::literal`]).
    pub(super) fn literally(self) -> Value {
        match &self {
            Value::Text(text) => Value::literal(text),
            _ => self,
        }
    }

    pub(super) fn is_true(&self) -> bool {
        match self {
            Value::None => false,
            Value::Bool(b) => *b,
            Value::Int(n) => *n != 0,
            Value::Float(x) => *x != 0.0,
            Value::Text(text) => !text.is_empty(),
            Value::List(list) => !list.is_empty(),
            Value::Map(map) => !map.is_empty(),
            Value::Function(_) | Value::Method(..) | Value::Library | Value::Scope(_) => true,
        }
    }

    /// The value of a condition: words and whole numbers as texts, anything else as Python takes it; `None`: the text is neither.
    pub(super) fn condition(&self) -> Option<bool> {
        match self {
            Value::Text(text) => match text.as_ref() {
                "true" | "True" => Some(true),
                "false" | "False" => Some(false),
                other => other.trim().parse::<i64>().ok().map(|n| n != 0),
            },
            other => Some(other.is_true()),
        }
    }

    /// As a number; truth values are 0 and 1.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Value::Bool(b) => Some(f64::from(u8::from(*b))),
            Value::Int(n) => Some(*n as f64),
            Value::Float(x) => Some(*x),
            _ => None,
        }
    }

    /// As a whole number; truth values are 0 and 1.
    pub(super) fn whole(&self) -> Option<i64> {
        match self {
            Value::Bool(b) => Some(i64::from(*b)),
            Value::Int(n) => Some(*n),
            _ => None,
        }
    }

    /// Name of the type, as Python has it.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Value::None => "None",
            Value::Bool(_) => "bool",
            Value::Int(_) => "int",
            Value::Float(_) => "float",
            Value::Text(_) => "str",
            Value::List(_) => "list",
            Value::Map(_) => "dict",
            Value::Function(_) | Value::Method(..) => "function",
            Value::Library | Value::Scope(_) => "namespace",
        }
    }

    pub(super) fn equals(&self, other: &Value) -> bool {
        self.equals_within(other, MAX_DEPTH)
    }

    fn equals_within(&self, other: &Value, depth: usize) -> bool {
        let Some(depth) = depth.checked_sub(1) else { return false };
        match (self, other) {
            (Value::None, Value::None) => true,
            (Value::Text(a), Value::Text(b)) => a == b,
            (Value::List(a), Value::List(b)) => {
                a.len() == b.len() && a.iter().zip(b.iter()).all(|(x, y)| x.equals_within(y, depth))
            }
            (Value::Map(a), Value::Map(b)) => {
                let same = |(key, value): &(Value, Value)| {
                    let found = b.iter().find(|(k, _)| k.equals_within(key, depth));
                    found.is_some_and(|(_, v)| v.equals_within(value, depth))
                };
                a.len() == b.len() && a.iter().all(same)
            }
            _ => match (self.whole(), other.whole()) {
                (Some(a), Some(b)) => a == b,
                _ => matches!((self.number(), other.number()), (Some(a), Some(b)) if a == b),
            },
        }
    }

    /// The order of two values; `None` if they have none.
    pub(super) fn order(&self, other: &Value) -> Option<Ordering> {
        match (self, other) {
            (Value::Text(a), Value::Text(b)) => Some(a.cmp(b)),
            (Value::List(a), Value::List(b)) => {
                let differing = a.iter().zip(b.iter()).find(|(x, y)| !x.equals(y));
                match differing {
                    Some((x, y)) if matches!(x, Value::List(_)) && matches!(y, Value::List(_)) => None,
                    Some((x, y)) => x.order(y),
                    None => Some(a.len().cmp(&b.len())),
                }
            }
            _ => match (self.whole(), other.whole()) {
                (Some(a), Some(b)) => Some(a.cmp(&b)),
                _ => self.number()?.partial_cmp(&other.number()?),
            },
        }
    }

    /// How many values it holds, itself among them; `None`: more than [`MAX_WEIGHT`], or deeper than any list of a robot file.
    pub(super) fn weight(&self) -> Option<usize> {
        let mut left = MAX_WEIGHT;
        self.weigh(MAX_DEPTH, &mut left).then(|| MAX_WEIGHT - left)
    }

    fn weigh(&self, depth: usize, left: &mut usize) -> bool {
        let own = 1 + if let Value::Text(text) = self { text.len() / BYTES } else { 0 };
        let (Some(rest), Some(depth)) = (left.checked_sub(own), depth.checked_sub(1)) else { return false };
        *left = rest;
        match self {
            Value::List(list) => list.iter().all(|value| value.weigh(depth, left)),
            Value::Map(map) => {
                map.iter().all(|(key, value)| key.weigh(depth, left) && value.weigh(depth, left))
            }
            _ => true,
        }
    }

    /// How many values a function goes through that looks at each once.
    pub(super) fn length(&self) -> usize {
        match self {
            Value::Text(text) => text.len() / BYTES,
            Value::List(list) => list.len(),
            Value::Map(map) => map.len(),
            _ => 0,
        }
    }

    /// The entry of a dictionary.
    pub(super) fn entry(&self, key: &Value) -> Option<&Value> {
        let Value::Map(map) = self else { return None };
        map.iter().find(|(k, _)| k.equals(key)).map(|(_, value)| value)
    }

    /// Writes the value as Python's `repr` does, texts in single quotes.
    fn write(&self, f: &mut fmt::Formatter<'_>, depth: usize) -> fmt::Result {
        let Some(depth) = depth.checked_sub(1) else { return f.write_str("...") };
        let separated = |f: &mut fmt::Formatter<'_>, k: usize| if k > 0 { f.write_str(", ") } else { Ok(()) };
        match self {
            Value::Text(text) => write!(f, "'{text}'"),
            Value::List(list) => {
                f.write_str("[")?;
                for (k, value) in list.iter().enumerate() {
                    separated(f, k)?;
                    value.write(f, depth)?;
                }
                f.write_str("]")
            }
            Value::Map(map) => {
                f.write_str("{")?;
                for (k, (key, value)) in map.iter().enumerate() {
                    separated(f, k)?;
                    key.write(f, depth)?;
                    f.write_str(": ")?;
                    value.write(f, depth)?;
                }
                f.write_str("}")
            }
            other => write!(f, "{other}"),
        }
    }
}

/// As Python's `str` writes it.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::None => f.write_str("None"),
            Value::Bool(true) => f.write_str("True"),
            Value::Bool(false) => f.write_str("False"),
            Value::Int(n) => write!(f, "{n}"),
            Value::Float(x) => write_float(f, *x),
            Value::Text(text) => f.write_str(text),
            Value::List(_) | Value::Map(_) => self.write(f, MAX_DEPTH),
            Value::Function(name) => write!(f, "<function {name}>"),
            Value::Method(_, name) => write!(f, "<method {name}>"),
            Value::Library | Value::Scope(_) => f.write_str("<namespace>"),
        }
    }
}

/// A text of bounded length.
pub(super) fn bounded_text(text: String) -> Result<Value, String> {
    match text.len() > MAX_TEXT {
        true => Err(format!("expected a text of at most {MAX_TEXT} bytes")),
        false => Ok(Value::text(text)),
    }
}

/// A list of bounded length.
pub(super) fn bounded_list(entries: impl Iterator<Item = Value>) -> Result<Value, String> {
    let list: Vec<Value> = entries.take(MAX_LIST + 1).collect();
    match list.len() > MAX_LIST {
        true => Err(format!("expected a list of at most {MAX_LIST} entries")),
        false => Ok(Value::list(list)),
    }
}

/// What a loop goes over: entries of a list, characters of a text, keys of a dictionary.
pub(super) fn entries(of: &Value) -> Result<Vec<Value>, String> {
    match of {
        Value::List(list) => Ok(list.to_vec()),
        Value::Map(map) => Ok(map.iter().map(|(key, _)| key.clone()).collect()),
        Value::Text(text) if text.len() <= MAX_LIST => {
            Ok(text.chars().map(|c| Value::text(c.to_string())).collect())
        }
        other => Err(format!("expected a list, found a {}", other.kind())),
    }
}

/// The shortest digits that read back the same, with an exponent where Python has one.
fn write_float(f: &mut fmt::Formatter<'_>, x: f64) -> fmt::Result {
    if !x.is_finite() {
        return f.write_str(if x.is_nan() {
            "nan"
        } else if x > 0.0 {
            "inf"
        } else {
            "-inf"
        });
    }
    let digits = format!("{x:e}");
    let exponent = digits.rsplit_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
    if (-4..16).contains(&exponent) {
        let plain = format!("{x}");
        return if plain.contains('.') { f.write_str(&plain) } else { write!(f, "{plain}.0") };
    }
    let mantissa = digits.split('e').next().unwrap_or_default();
    write!(f, "{mantissa}e{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
}

#[cfg(test)]
mod tests {
    use super::Value;

    #[test]
    fn floats_are_written_as_python_writes_them() {
        for (x, expected) in [
            (1.0, "1.0"),
            (-0.0, "-0.0"),
            (0.1 + 0.2, "0.30000000000000004"),
            (1e-4, "0.0001"),
            (1.5e-5, "1.5e-05"),
            (1e16, "1e+16"),
            (123_456_789_012_345_680.0, "1.2345678901234568e+17"),
            (9_007_199_254_740_992.0, "9007199254740992.0"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(Value::Float(x).to_string(), expected);
        }
    }

    #[test]
    fn literals_become_numbers_and_truth_values() {
        for (text, kind, shown) in [
            ("12", "int", "12"),
            (" 0.5 ", "float", "0.5"),
            ("1e-3", "float", "0.001"),
            ("True", "bool", "True"),
            ("1_000", "str", "1_000"),
            ("'12'", "str", "12"),
            ("left", "str", "left"),
            ("", "str", ""),
        ] {
            let value = Value::literal(text);
            assert_eq!((value.kind(), value.to_string().as_str()), (kind, shown), "{text}");
        }
    }
}
