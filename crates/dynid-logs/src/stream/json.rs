//! Rows of JSON objects.

use std::collections::HashMap;

use dynid_files::excerpt::excerpt_bytes;
use serde_json::{Map, Value};

use super::bad_line::{BadLine, checked};
use crate::signal::is_time_name;

/// Columns that the first object named.
pub(super) struct JsonFields {
    names: Vec<String>,
    places: HashMap<String, usize>,
    /// Columns that hold times.
    times: Vec<bool>,
    values: Vec<f64>,
    filled: Vec<bool>,
}

impl JsonFields {
    /// Columns in alphabetical order: the first object's numbers and lists of numbers; other fields are not looked at.
    pub(super) fn of_line(line: &[u8], times: &[String]) -> Result<Self, BadLine> {
        let mut names: Vec<String> = Vec::new();
        for (key, value) in &object(line)? {
            match value {
                Value::Number(_) | Value::Null => names.push(key.clone()),
                Value::Array(list) if list.iter().all(|x| x.is_number() || x.is_null()) => {
                    names.extend((1..=list.len()).map(|k| format!("{key}{k}")));
                }
                _ => {}
            }
        }
        if names.is_empty() {
            return Err(BadLine::NotJson { found: "an object without numbers".to_owned() });
        }
        let places = names.iter().enumerate().map(|(k, n)| (n.clone(), k)).collect();
        let times = names.iter().map(|n| is_time_name(n) || times.contains(n)).collect();
        Ok(JsonFields {
            places,
            times,
            values: vec![0.0; names.len()],
            filled: vec![false; names.len()],
            names,
        })
    }

    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    pub(super) fn row(&mut self, line: &[u8]) -> Result<&[f64], BadLine> {
        let object = object(line)?;
        self.filled.fill(false);
        for (key, value) in &object {
            match value {
                Value::Array(list) => {
                    for (k, x) in list.iter().enumerate() {
                        self.set(&format!("{key}{}", k + 1), x)?;
                    }
                }
                value => self.set(key, value)?,
            }
        }
        match self.filled.iter().position(|filled| !filled) {
            None => Ok(&self.values),
            Some(k) => Err(BadLine::Missing { column: self.names[k].clone() }),
        }
    }

    fn set(&mut self, column: &str, value: &Value) -> Result<(), BadLine> {
        let Some(place) = self.places.get(column) else { return Ok(()) };
        let x = match value {
            Value::Number(x) => x.as_f64(),
            Value::Null => {
                return Err(BadLine::NotFinite { column: column.to_owned(), found: "null".to_owned() });
            }
            _ => None,
        };
        let Some(x) = x else {
            let found = excerpt_bytes(value.to_string().as_bytes());
            return Err(BadLine::NotANumber { column: column.to_owned(), found });
        };
        self.values[*place] = checked(column, x, self.times[*place])?;
        self.filled[*place] = true;
        Ok(())
    }
}

fn object(line: &[u8]) -> Result<Map<String, Value>, BadLine> {
    let found = |what: &str| BadLine::NotJson { found: what.to_owned() };
    match serde_json::from_slice(line) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(Value::Array(_)) => Err(found("a list")),
        Ok(_) => Err(found("a single value")),
        Err(error) => Err(found(&error.to_string())),
    }
}
