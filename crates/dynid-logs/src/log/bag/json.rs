//! Messages in JSON: which values they hold, in the order of their keys.

use serde_json::Value;

use super::walk::{LONGEST, MOST_MESSAGES, Sink};

/// Reads a message.
///
/// # Errors
/// It is no object of JSON.
pub(super) fn parse(data: &[u8]) -> Result<Value, String> {
    let message: Value =
        serde_json::from_slice(data).map_err(|e| format!("expected a message in JSON: {e}"))?;
    match message.is_object() {
        true => Ok(message),
        false => Err("expected an object of JSON, found another value".to_owned()),
    }
}

/// Hands the values of a message to a sink. Lists of mixed values, and those that are too long for signals, are passed over; what is `null` is not
/// there.
pub(super) fn walk(message: &Value, sink: &mut impl Sink, outermost: bool) {
    let Some(fields) = message.as_object() else { return };
    sink.open();
    for (name, value) in fields {
        // Messages of a topic may have other keys, or values of other kinds, and then have other columns.
        sink.key(name, kind(value));
        match value {
            Value::Null => {
                sink.field(name);
                sink.number(f64::NAN);
            }
            Value::Bool(_) | Value::Number(_) => {
                sink.field(name);
                sink.number(number(value));
            }
            Value::String(text) => {
                sink.field(name);
                sink.text(text.as_bytes());
            }
            Value::Array(list) => entries(name, list, sink),
            Value::Object(inner) => match (stamp(value), inner.get("stamp").and_then(stamp)) {
                (Some(ns), _) => {
                    sink.field(name);
                    sink.time(ns);
                }
                (None, Some(ns)) if name == "header" => {
                    if outermost {
                        sink.stamp(ns);
                    }
                }
                _ => {
                    sink.field(name);
                    walk(value, sink, false);
                }
            },
        }
    }
    sink.close();
}

/// What becomes of a value, by a number.
fn kind(value: &Value) -> u8 {
    match value {
        Value::Null | Value::Bool(_) | Value::Number(_) => 0,
        Value::String(_) => 1,
        Value::Array(list) => match list.as_slice() {
            list if list.iter().all(is_number) => 2,
            list if list.iter().all(Value::is_string) => 3,
            list if list.iter().all(Value::is_object) => 4,
            _ => 5,
        },
        Value::Object(_) => {
            if stamp(value).is_some() {
                6
            } else {
                7
            }
        }
    }
}

fn is_number(value: &Value) -> bool {
    value.is_number() || value.is_boolean() || value.is_null()
}

fn entries(name: &str, list: &[Value], sink: &mut impl Sink) {
    if list.iter().all(is_number) && list.len() <= LONGEST {
        sink.field(name);
        sink.numbers(list.len());
        list.iter().for_each(|value| sink.number(number(value)));
    } else if list.iter().all(Value::is_string) && list.len() <= LONGEST {
        sink.field(name);
        sink.texts(list.len());
        list.iter().filter_map(Value::as_str).for_each(|text| sink.text(text.as_bytes()));
    } else if list.iter().all(Value::is_object) && list.len() <= MOST_MESSAGES {
        sink.field(name);
        sink.messages(list.len());
        list.iter().for_each(|message| walk(message, sink, false));
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_bool().map(|flag| f64::from(u8::from(flag)))).unwrap_or(f64::NAN)
}

/// A time as `{"sec": .., "nsec": ..}`, ns.
fn stamp(value: &Value) -> Option<i64> {
    let fields = value.as_object().filter(|fields| fields.len() == 2)?;
    let part = |names: [&str; 3]| names.iter().find_map(|name| fields.get(*name)).and_then(Value::as_i64);
    let (seconds, rest) = (part(["sec", "secs", "seconds"])?, part(["nsec", "nanosec", "nsecs"])?);
    seconds.checked_mul(1_000_000_000)?.checked_add(rest)
}
