//! YAML files, as `xacro.load_yaml` reads them.

use std::f64::consts::PI;

use saphyr_parser::{Event, Parser, ScalarStyle, Tag};

use super::value::Value;

/// Deepest nesting.
const MAX_DEPTH: usize = 64;
/// Most values.
const MAX_VALUES: usize = 200_000;
/// Most keys of a mapping, which are looked for one after the other.
const MAX_KEYS: usize = 5_000;

/// A list or mapping that is being read.
enum Open {
    List(usize, Vec<Value>),
    /// Entries, and the key whose value comes next.
    Map(usize, Vec<(Value, Value)>, Option<Value>),
}

/// Reads the first document of a text.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn parse(text: &str) -> Result<Value, String> {
    let mut open: Vec<Open> = Vec::new();
    let mut anchors: Vec<(usize, Value)> = Vec::new();
    let mut values = 0;
    for event in Parser::new_from_str(text) {
        let (event, span) = event.map_err(|e| e.to_string())?;
        let line = span.start.line();
        let complete = match event {
            Event::Scalar(text, style, anchor, tag) => {
                let value = scalar(&text, style, tag.as_deref()).map_err(|e| format!("line {line}: {e}"))?;
                Some((anchor, value))
            }
            Event::Alias(anchor) => {
                let found = anchors.iter().rev().find(|(own, _)| *own == anchor);
                let (_, value) = found.ok_or_else(|| format!("line {line}: an alias of nothing above it"))?;
                Some((0, value.clone()))
            }
            Event::SequenceStart(anchor, _) => {
                open.push(Open::List(anchor, Vec::new()));
                None
            }
            Event::MappingStart(anchor, _) => {
                open.push(Open::Map(anchor, Vec::new(), None));
                None
            }
            Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                Some(Open::List(anchor, list)) => Some((anchor, Value::list(list))),
                Some(Open::Map(anchor, map, _)) => Some((anchor, Value::Map(map.into()))),
                None => None,
            },
            Event::DocumentEnd => return Err("expected a value, found none".to_owned()),
            Event::StreamEnd | Event::Nothing | Event::StreamStart | Event::DocumentStart(_) => None,
        };
        if open.len() > MAX_DEPTH {
            return Err(format!("line {line}: expected at most {MAX_DEPTH} levels"));
        }
        let Some((anchor, value)) = complete else { continue };
        values += 1;
        if values > MAX_VALUES {
            return Err(format!("expected at most {MAX_VALUES} values"));
        }
        if anchor != 0 {
            anchors.push((anchor, value.clone()));
        }
        match open.last_mut() {
            Some(Open::List(_, list)) => list.push(value),
            Some(Open::Map(_, map, key)) => match key.take() {
                None => *key = Some(value),
                Some(key) => put(map, key, value, line)?,
            },
            None => return Ok(value),
        }
    }
    Ok(Value::None)
}

/// `<<: *defaults` adds what is not stated; a key that is stated twice has its last value, as in Python's reader.
fn put(map: &mut Vec<(Value, Value)>, key: Value, value: Value, line: usize) -> Result<(), String> {
    let set = |map: &mut Vec<(Value, Value)>, key: Value, value: Value, again: bool| match map
        .iter_mut()
        .find(|(own, _)| own.equals(&key))
    {
        Some(entry) if again => entry.1 = value,
        Some(_) => {}
        None => map.push((key, value)),
    };
    match (&key, &value) {
        (Value::Text(name), Value::Map(defaults)) if name.as_ref() == "<<" => {
            for (key, value) in defaults.iter() {
                set(map, key.clone(), value.clone(), false);
            }
            Ok(())
        }
        (Value::Text(name), _) if name.as_ref() == "<<" => {
            Err(format!("line {line}: expected a mapping behind `<<`"))
        }
        _ => {
            set(map, key, value, true);
            match map.len() > MAX_KEYS {
                true => Err(format!("line {line}: expected at most {MAX_KEYS} keys of a mapping")),
                false => Ok(()),
            }
        }
    }
}

/// A scalar by its look, and the units that xacro knows: `!degrees 90`.
fn scalar(text: &str, style: ScalarStyle, tag: Option<&Tag>) -> Result<Value, String> {
    let unit = match tag {
        Some(tag) if tag.handle == "!" => match tag.suffix.as_str() {
            "radians" | "meters" => Some(1.0),
            "degrees" => Some(PI / 180.0),
            "millimeters" => Some(0.001),
            "foot" => Some(0.3048),
            "inches" => Some(0.0254),
            other => return Err(format!("expected a unit of xacro, found `!{other}`")),
        },
        Some(tag) if tag.is_yaml_core_schema() && tag.suffix == "str" => return Ok(Value::text(text)),
        _ => None,
    };
    if let Some(unit) = unit {
        // `!radians pi/2` is an expression, without names of the file.
        return match number(text).and_then(|n| n.number()) {
            Some(x) => Ok(Value::Float(x * unit)),
            None => super::constant(text).map(|x| Value::Float(x * unit)),
        };
    }
    if style != ScalarStyle::Plain {
        return Ok(Value::text(text));
    }
    Ok(match text {
        "" | "~" | "null" | "Null" | "NULL" => Value::None,
        "true" | "True" | "TRUE" | "yes" | "Yes" | "YES" | "on" | "On" | "ON" => Value::Bool(true),
        "false" | "False" | "FALSE" | "no" | "No" | "NO" | "off" | "Off" | "OFF" => Value::Bool(false),
        other => number(other).unwrap_or_else(|| Value::text(other)),
    })
}

/// Numbers of YAML, a word such as `nan` not among them.
fn number(text: &str) -> Option<Value> {
    let plain = text.replace('_', "");
    let unsigned = plain.trim_start_matches(['+', '-']);
    let sign = if plain.starts_with('-') { -1.0 } else { 1.0 };
    match unsigned {
        ".inf" | ".Inf" | ".INF" => return Some(Value::Float(sign * f64::INFINITY)),
        ".nan" | ".NaN" | ".NAN" => return Some(Value::Float(f64::NAN)),
        _ => {}
    }
    if let Some(digits) = unsigned.strip_prefix("0x") {
        let number = i64::from_str_radix(digits, 16).ok()?;
        return Some(Value::Int(if sign < 0.0 { -number } else { number }));
    }
    if !unsigned.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    if let Ok(number) = plain.parse() {
        return Some(Value::Int(number));
    }
    plain.parse().ok().map(Value::Float)
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn documents_become_values() {
        let text = "# sizes\nlink: &a {mass: 3.5, on: yes, name: 'x: 1'}\nangles:\n  - !degrees 90\n  - -1\n  - 1.0e-3\n\
                    copy:\n  <<: *a\n  mass: 2\nnone:\n";
        assert_eq!(
            parse(text).unwrap().to_string(),
            "{'link': {'mass': 3.5, True: True, 'name': 'x: 1'}, 'angles': [1.5707963267948966, -1, 0.001], \
             'copy': {'mass': 2, True: True, 'name': 'x: 1'}, 'none': None}"
        );
        assert_eq!(parse("").unwrap().to_string(), "None");
        for bad in ["a: [1", "a: *b", "a: !furlong 3", "- a\nb: 1", "{a: }}"] {
            parse(bad).unwrap_err();
        }
        assert!(parse(&format!("{}1{}", "[".repeat(70), "]".repeat(70))).unwrap_err().contains("64 levels"));
        parse(&"[".repeat(100_000)).unwrap_err();
    }
}
