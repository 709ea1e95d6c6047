//! Keyword arguments as the settings that files have.

use std::path::PathBuf;

use dynid::Config;
use dynid::settings::Settings;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Map, Value};

use crate::error::{raise, setting};

/// Keys of a configuration that arrays have no use for, and what stands in their place.
const ELSEWHERE: [(&str, &str); 12] = [
    ("robot", "the robot is the first argument"),
    ("log", "logs are the second argument"),
    ("validation", "logs to validate on are the argument `validation` of `identify`"),
    ("columns", "columns are named where a file is read: `Log.read(path, columns={...})`"),
    ("motor_side", "transform arrays before, or read the file: `identify_file(\"dynid.toml\")`"),
    ("trajectory", "read the file with its trajectory: `Log.read(path, trajectory=...)`"),
    ("period_s", "the period of a motion belongs to its log: `Log(t, q, tau, period_s=...)`"),
    ("online", "settings of a robot that runs: `Online(robot, online={...})`"),
    ("out", "results are values here: `Estimate.save(path)`"),
    ("gravity", "gravity belongs to the robot: `Robot.load(path, gravity=[...])`"),
    ("locked", "locked joints belong to the robot: `Robot.load(path, locked={...})`"),
    ("couple_mimics", "it belongs to the robot: `Robot.load(path, couple_mimics=True)`"),
];

/// Settings of an identification from a JSON object with the keys of a configuration.
pub(crate) fn settings(py: Python<'_>, text: &str) -> PyResult<Settings> {
    let keys: Map<String, Value> = parsed(py, text, "settings")?;
    for (key, hint) in ELSEWHERE {
        if keys.contains_key(key) {
            return Err(setting(
                py,
                format!("setting `{key}`: no setting of an identification of arrays"),
                hint,
            ));
        }
    }
    let config: Config = parsed(py, text, "settings")?;
    let settings = config.check().and_then(|()| config.settings());
    settings.map_err(|e| raise(py, &e))
}

/// A value as JSON.
pub(crate) fn as_json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// A value from JSON, with the library's error for what does not fit.
pub(crate) fn parsed<T: serde::de::DeserializeOwned>(py: Python<'_>, text: &str, what: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|e| {
        // Places in the JSON are no places in anything that the user wrote.
        let text = e.to_string();
        let text = text.split(" at line ").next().unwrap_or_default().to_owned();
        let error = dynid::Error::Config {
            file: PathBuf::from(what).display().to_string(),
            line: None,
            message: text,
        };
        raise(py, &error)
    })
}
