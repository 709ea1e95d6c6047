//! Settings of a run as rows of a table.

use dynid_report::{Chosen, Origin, Value};
use serde_json::Value as Json;

/// Settings as rows: name with its tables before it, value, and whether it is the one that stands where nothing is said.
///
/// `defaults`: settings of a run that says nothing, in the same shape.
pub fn settings_table(settings: &Json, defaults: &Json) -> Vec<Chosen> {
    let mut rows = Vec::new();
    walk("", settings, Some(defaults), &mut rows);
    rows
}

fn walk(name: &str, value: &Json, default: Option<&Json>, rows: &mut Vec<Chosen>) {
    match value {
        Json::Null => {}
        Json::Object(table) => {
            for (key, value) in table {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                walk(&name, value, default.and_then(|d| d.get(key)), rows);
            }
        }
        Json::Array(list) if list.iter().any(Json::is_object) => {
            for (k, value) in list.iter().enumerate() {
                let name = if list.len() == 1 { name.to_owned() } else { format!("{name} {}", k + 1) };
                walk(&name, value, None, rows);
            }
        }
        _ => rows.push(Chosen {
            name: name.to_owned(),
            value: plain(value),
            unit: String::new(),
            origin: if default == Some(value) { Origin::Default } else { Origin::Given },
            reason: String::new(),
        }),
    }
}

/// A value without a trace of the format that it was kept in.
pub fn plain(value: &Json) -> Value {
    match value {
        Json::Null => Value::Text("none".to_owned()),
        Json::Bool(b) => Value::Flag(*b),
        Json::Number(n) => match n.as_u64() {
            Some(count) => Value::Count(count),
            None => n.as_f64().map_or(Value::Undefined, Value::Number),
        },
        other => Value::Text(words(other)),
    }
}

fn words(value: &Json) -> String {
    match value {
        Json::Null => "none".to_owned(),
        Json::String(text) => text.clone(),
        Json::Bool(b) => if *b { "yes" } else { "no" }.to_owned(),
        Json::Number(n) => number(n.as_f64().unwrap_or(f64::NAN)),
        Json::Array(list) if list.is_empty() => "none".to_owned(),
        Json::Array(list) => {
            let inner = |x: &Json| if x.is_array() { format!("({})", words(x)) } else { words(x) };
            list.iter().map(inner).collect::<Vec<_>>().join(", ")
        }
        Json::Object(table) if table.is_empty() => "none".to_owned(),
        Json::Object(table) => table
            .iter()
            .map(|(key, value)| format!("{key} = {}", words(value)))
            .collect::<Vec<_>>()
            .join(", "),
    }
}

/// Six digits at most, as few as tell the number.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn settings_lie_flat_and_say_whether_they_were_given() {
        let settings = json!({
            "gravity": null, "locked": {}, "seed": 1,
            "estimator": { "method": "iv", "shape": { "starts": 20 } },
            "log": [{ "path": "a.csv", "rows": [1, 3000] }, { "path": "b.csv", "rows": null }],
            "bound": [{ "parameter": "j1.fc", "range": [0.0, 20.5] }],
        });
        let defaults = json!({ "seed": 1, "estimator": { "method": "wls", "shape": { "starts": 20 } } });
        let rows = settings_table(&settings, &defaults);
        let found: Vec<(String, String, Origin)> = rows
            .into_iter()
            .map(|r| {
                let value = match r.value {
                    Value::Text(text) => text,
                    Value::Count(n) => n.to_string(),
                    other => format!("{other:?}"),
                };
                (r.name, value, r.origin)
            })
            .collect();
        let row = |name: &str, value: &str, origin| (name.to_owned(), value.to_owned(), origin);
        assert_eq!(
            found,
            [
                row("bound.parameter", "j1.fc", Origin::Given),
                row("bound.range", "0, 20.5", Origin::Given),
                row("estimator.method", "iv", Origin::Given),
                row("estimator.shape.starts", "20", Origin::Default),
                row("log 1.path", "a.csv", Origin::Given),
                row("log 1.rows", "1, 3000", Origin::Given),
                row("log 2.path", "b.csv", Origin::Given),
                row("seed", "1", Origin::Default),
            ]
        );
    }
}
