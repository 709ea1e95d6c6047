//! Golden numbers shared by the tests.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests outside of test functions")]

use serde_json::Value;
use std::path::Path;

/// Reads a golden file, or says that it is absent and returns `None`.
pub(crate) fn load(name: &str) -> Option<Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/spec/golden").join(name);
    if !path.exists() {
        println!("skipped: ../shared not present");
        return None;
    }
    Some(serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap())
}

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

pub(crate) fn vector(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

/// Compares vectors relative to the largest expected entry.
#[track_caller]
pub(crate) fn check_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let size = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance * size, "{what}[{i}]: {f} against {e}");
    }
}
