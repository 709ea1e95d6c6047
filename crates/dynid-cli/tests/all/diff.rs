//! `dynid diff`: models that are the same, models that are not, and what is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, run};
use serde_json::Value;
use tempfile::TempDir;

/// Mass of the forearm with a tool of 0.5 kg in its centre.
const HEAVIER: (&str, &str) = ("mass value=\"1.5\"", "mass value=\"2.0\"");

/// Estimates of the arm from two logs, and of one with a heavier forearm.
fn prepared() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
        std::fs::write(at.join("heavy.urdf"), TWO_LINKS.replace(HEAVIER.0, HEAVIER.1)).unwrap();
        std::fs::write(at.join("longer.urdf"), TWO_LINKS.replace("0 0 0.35", "0 0 0.36")).unwrap();
        std::fs::write(at.join("other.urdf"), TWO_LINKS.replace("\"elbow\"", "\"knee\"")).unwrap();
        for (robot, log, seed) in
            [("arm", "a", "1"), ("arm", "b", "2"), ("heavy", "c", "3"), ("longer", "d", "4")]
        {
            let (robot, log) = (format!("{robot}.urdf"), format!("{log}.csv"));
            let args = ["simulate", &robot, "--duration", "20", "--rate-hz", "100", "--effort-noise", "0.02"];
            run(
                at,
                &[&args[..], &["--seed", seed, "--out", &log, "--clean", &format!("true_{log}")]].concat(),
                0,
            );
            let out = log.replace(".csv", "");
            // Forearms are identified with the file of the light arm: what a tool adds is then a difference.
            let file = if robot == "heavy.urdf" { "arm.urdf".to_owned() } else { robot };
            let args = ["identify", &file, "--log", &log, "--out", &out, "--friction", "given", "--quiet"];
            run(at, &args, 0);
        }
        folder
    };
    FOLDER.get_or_init(make).path()
}

fn json(args: &[&str], code: i32) -> Value {
    let output = run(prepared(), &[&["diff"], args, &["--json"]].concat(), code);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Names of parameters of which a flag is set.
fn names(found: &Value, flag: &str) -> Vec<String> {
    let parameters = found["parameters"].as_array().unwrap().iter();
    parameters.filter(|p| p[flag] == true).map(|p| p["name"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_model_does_not_differ_from_itself() {
    let found = json(&["a/estimate.json", "a/estimate.json"], 0);
    assert_eq!(found["differ"], false);
    assert!(found["parameters"].as_array().unwrap().len() > 8, "{found}");
    for p in found["parameters"].as_array().unwrap() {
        assert_eq!(p["difference"], 0.0, "{p}");
    }
    for joint in found["effort"]["joints"].as_array().unwrap() {
        assert_eq!(joint["rms_difference"], 0.0);
        assert!(joint["rms_a"].as_f64().unwrap() > 1.0, "{joint}");
    }
}

#[test]
fn two_logs_of_one_robot_do_not_differ_and_a_heavier_forearm_does() {
    let found = json(&["a/estimate.json", "b/estimate.json"], 0);
    assert!(names(&found, "differs").is_empty(), "{found}");
    let found = json(&["a/estimate.json", "c/estimate.json"], 1);
    let differing = names(&found, "differs");
    // Half a kilogramme 0.15 m behind the elbow: its moment is what gravity shows best.
    let moment = found["parameters"].as_array().unwrap().iter().find(|p| p["name"] == "forearm.mz").unwrap();
    assert!(differing.contains(&"forearm.mz".to_owned()), "{differing:?}");
    let off = moment["difference"].as_f64().unwrap() - 0.5 * 0.15;
    assert!(off.abs() < moment["half_width"].as_f64().unwrap(), "{moment}");
    // Typical friction of a simulated robot grows with its load; offsets and rotors do not.
    assert!(differing.iter().all(|name| !name.ends_with(".fo") && !name.ends_with(".Ia")), "{differing:?}");
    let said = run(prepared(), &["diff", "a/estimate.json", "c/estimate.json"], 1).stdout;
    let said = String::from_utf8(said).unwrap();
    assert!(said.contains("forearm.mz") && said.contains("**") && said.contains("they differ: "), "{said}");
}

#[test]
fn efforts_differ_as_predictions_do() {
    let at = prepared();
    let predicted = |estimate: &str| -> Vec<Vec<f64>> {
        let output = run(at, &["predict", estimate, "--states", "true_a.csv"], 0);
        let text = String::from_utf8(output.stdout).unwrap();
        let row = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
        text.lines().skip(1).map(row).collect()
    };
    let (a, c) = (predicted("a/estimate.json"), predicted("c/estimate.json"));
    let found = json(&["a/estimate.json", "c/estimate.json", "--states", "true_a.csv"], 1);
    let rms =
        |values: &mut dyn Iterator<Item = f64>| (values.map(|x| x * x).sum::<f64>() / a.len() as f64).sqrt();
    for (j, joint) in found["effort"]["joints"].as_array().unwrap().iter().enumerate() {
        let expected = [
            ("rms_a", rms(&mut a.iter().map(|row| row[j]))),
            ("rms_b", rms(&mut c.iter().map(|row| row[j]))),
            ("rms_difference", rms(&mut a.iter().zip(&c).map(|(x, y)| x[j] - y[j]))),
        ];
        for (key, value) in expected {
            let given = joint[key].as_f64().unwrap();
            // Predictions are printed with all their digits.
            assert!((given - value).abs() < 1e-9 * value.max(1.0), "{key}: {given} {value}");
        }
    }
    let fewer = json(&["a/estimate.json", "c/estimate.json", "--states", "true_a.csv", "--rows", "1:50"], 1);
    assert!(fewer["effort"]["states"].as_str().unwrap().starts_with("50 states"), "{fewer}");
}

#[test]
fn a_robot_file_is_compared_by_what_it_states() {
    // The log was made by the very file: what it states of links is true.
    let found = json(&["arm.urdf", "a/estimate.json"], 0);
    let of = |name: &str| {
        found["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .find(|p| p["name"] == name)
            .cloned()
            .unwrap_or_default()
    };
    assert_eq!(of("forearm.mz")["a"], 1.5 * 0.15);
    let reason = |name: &str| {
        let all = found["not_compared"].as_array().unwrap().iter();
        all.filter(|p| p["name"] == name).map(|p| p["reason"].as_str().unwrap().to_owned()).next().unwrap()
    };
    assert_eq!(reason("elbow.fc"), "not stated");
    let found = json(&["heavy.urdf", "a/estimate.json"], 1);
    assert!(names(&found, "differs").contains(&"forearm.mz".to_owned()), "{found}");
    // Either order says the same.
    let other = json(&["a/estimate.json", "heavy.urdf"], 1);
    assert_eq!(names(&found, "differs"), names(&other, "differs"));
}

#[test]
fn other_robots_are_refused_with_the_reason() {
    for (a, b, words) in [
        ("a/estimate.json", "d/estimate.json", "joint `elbow`: origin"),
        ("longer.urdf", "a/estimate.json", "joint `elbow`: origin"),
        ("other.urdf", "a/estimate.json", "`knee`"),
        ("arm.urdf", "heavy.urdf", "both are robot files"),
        ("a/estimate.json", "none.json", "none.json"),
        ("a.csv", "a/estimate.json", "a.csv"),
    ] {
        let output = run(prepared(), &["diff", a, b], 2);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.starts_with("error: ") && said.contains(words), "{a}, {b}: {said}");
    }
}
