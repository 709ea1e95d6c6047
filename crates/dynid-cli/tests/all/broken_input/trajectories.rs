//! Trajectory files and periods beside logs.

use super::harness::{CONFIG, RUN, case, check, config};

/// A trajectory of the two-joint robot with a text replaced.
pub(crate) fn trajectory(from: &str, to: &str) -> String {
    let sound = r#"{
  "schema": "dynid-trajectory/1",
  "form": "plain",
  "base_frequency_rad_s": 0.5235987755982988,
  "periods": 1,
  "joints": [
    {"name": "shoulder", "q0": 0, "a": [0.5], "b": [0.1]},
    {"name": "elbow", "q0": 0, "a": [0.2], "b": [0.3]}
  ],
  "approach": null,
  "return": null
}"#;
    assert!(sound.contains(from), "{from}");
    sound.replacen(from, to, 1)
}

#[test]
fn are_refused() {
    let with_file = || config("trajectory = \"t.json\"\n");
    let beside = |from: &str, to: &str, message: &'static [&'static str], hint: &'static str| {
        case("bad.toml", with_file(), RUN, message, hint).beside("t.json", trajectory(from, to))
    };
    let top = |more: &str| format!("{more}\n{CONFIG}");
    check(&[
        case("bad.toml", with_file(), RUN, &["t.json", "No such file"], "path"),
        case("bad.toml", top("trajectory = \"gone.json\""), RUN, &["gone.json", "No such file"], "path"),
        case("bad.toml", config("trajectory = 3\n"), RUN, &["bad.toml:5", "3"], ""),
        case("bad.toml", with_file(), RUN, &["t.json:1"], "").beside("t.json", ""),
        case("bad.toml", with_file(), RUN, &["t.json", "UTF-8"], "JSON")
            .beside("t.json", b"\xff\xfe".to_vec()),
        beside(
            "dynid-trajectory/1",
            "dynid-estimate/1",
            &["t.json", "schema", "dynid-trajectory/1"],
            "version",
        ),
        beside("\"periods\"", "\"period\"", &["t.json:5", "`period`", "`periods`"], "misspelt"),
        beside("[0.3]", "[0.3, 0.1]", &["t.json", "joints[1].b", "1 amplitudes", "found 2"], "field"),
        beside("\"elbow\"", "\"wrist\"", &["t.json", "shoulder, elbow", "`wrist`"], "robot"),
        beside("0.5235987755982988", "0", &["t.json", "base_frequency_rad_s", "positive", "found 0"], ""),
        beside("0.5235987755982988", "0.05", &["log.csv", "whole period", "125.66"], "period"),
        case("bad.toml", config("period_s = -3\n"), RUN, &["bad.toml", "period_s", "positive", "-3"], ""),
        case("bad.toml", top("period_s = nan"), RUN, &["bad.toml", "period_s", "positive", "NaN"], ""),
        case(
            "bad.toml",
            config("trajectory = \"t.json\"\nperiod_s = 3\n"),
            RUN,
            &["bad.toml", "period_s", "either"],
            "",
        ),
        case(
            "bad.toml",
            config("period_s = 13\n"),
            RUN,
            &["log.csv", "whole period of 13 s", "12.01"],
            "period",
        ),
        case("bad.toml", config("period_s = 0.05\n"), RUN, &["log.csv", "8 samples", "0.05"], "period"),
    ]);
}
