//! Golden numbers of the source papers.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use dynid_motion::filter::{butterworth, forward_backward};
use dynid_testing::golden;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn indy7_filter() {
    let Some(golden) = golden("indy7_filter.json") else { return };
    let filter = butterworth(4, 10.0, 1000.0).unwrap();
    for (section, expected) in filter.as_slice().iter().zip(golden["sos"].as_array().unwrap()) {
        let found = [section.b.as_slice(), &[1.0], &section.a].concat();
        for (found, expected) in found.iter().zip(numbers(expected)) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} {expected}");
        }
    }
    let output = forward_backward(&filter, &numbers(&golden["input"])).unwrap();
    let expected = numbers(&golden["output"]);
    let tolerance = golden["tolerance_abs"].as_f64().unwrap();
    let inside =
        golden["compare_from"].as_u64().unwrap() as usize..golden["compare_to"].as_u64().unwrap() as usize;
    for n in inside {
        assert!((output[n] - expected[n]).abs() < tolerance, "sample {n}");
    }
}
