//! `dynid friction`, and `dynid identify --known-friction` with its file: files, exit codes, messages.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write;
use std::path::Path;

use crate::support::{TWO_LINKS, indy7, run};

/// Passes of the shoulder at some speeds under Coulomb and viscous friction, gravity and a little ripple.
fn sweep(directions: &[f64]) -> String {
    let mut text =
        String::from("t,q_shoulder,q_elbow,effort_shoulder,effort_elbow,temp_shoulder,temp_elbow\n");
    let (mut t, mut q) = (0.0_f64, -0.5_f64);
    for speed in [0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.1, 1.3] {
        for direction in directions {
            let v = direction * speed;
            for _ in 0..120 {
                let friction = direction * (4.0 + 3.0 * speed);
                let effort = 12.0 * q.sin() + friction + 0.1 * (40.0 * t).sin();
                writeln!(text, "{t:.2},{q:.6},0.3,{effort:.5},1.0,31.0,25.0").unwrap();
                t += 0.01;
                q += 0.01 * v;
            }
        }
        for _ in 0..30 {
            writeln!(text, "{t:.2},{q:.6},0.3,0.0,1.0,31.0,25.0").unwrap();
            t += 0.01;
        }
    }
    text
}

fn put(folder: &Path, config: &str, directions: &[f64]) {
    std::fs::write(folder.join("robot.urdf"), TWO_LINKS).unwrap();
    std::fs::write(folder.join("indy7.toml"), indy7()).unwrap();
    std::fs::write(folder.join("log.csv"), sweep(directions)).unwrap();
    std::fs::write(folder.join("friction.toml"), config).unwrap();
}

const CONFIG: &str = "robot = \"robot.urdf\"\n[[log]]\npath = \"log.csv\"\n";

#[test]
fn a_sweep_gives_a_law_a_report_and_json() {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), CONFIG, &[1.0, -1.0]);
    let output = run(folder.path(), &["friction", "friction.toml", "--out", "out", "--json"], 0);
    let file = std::fs::read(folder.path().join("out/friction.json")).unwrap();
    assert_eq!(output.stdout, file);
    let model: serde_json::Value = serde_json::from_slice(&file).unwrap();
    let joint = &model["joints"][0];
    assert_eq!((model["schema"].as_u64(), joint["joint"].as_str()), (Some(1), Some("shoulder")));
    assert!((joint["coulomb"].as_f64().unwrap() - 4.0).abs() < 0.1, "{joint}");
    assert!((joint["viscous"]["coefficient"].as_f64().unwrap() - 3.0).abs() < 0.2, "{joint}");
    assert!(joint["bristle"].is_null());
    let report = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(report.contains("shoulder") && report.contains("<svg"));
}

#[test]
fn one_direction_ends_with_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), CONFIG, &[1.0]);
    let output = run(folder.path(), &["friction", "friction.toml", "--quiet"], 1);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("Coulomb friction and offset cannot be told apart"), "{said}");
    assert!(output.stderr.is_empty());
}

#[test]
fn bad_configurations_end_with_exit_code_2_and_one_message() {
    for (config, words) in [
        ("robot = \"robot.urdf\"\n", "at least one `[[log]]`"),
        ("robot = \"indy7.toml\"\n[[log]]\npath = \"log.csv\"\n", "log.csv: "),
        ("robot = \"robot.urdf\"\nspeed = 1\n[[log]]\npath = \"log.csv\"\n", "unknown field `speed`"),
        ("robot = \"robot.urdf\"\nconfidence = 2\n[[log]]\npath = \"log.csv\"\n", "between 0 and 1"),
        (
            "robot = \"robot.urdf\"\ntemperature_range = [52, 15]\n[[log]]\npath = \"log.csv\"\n",
            "two increasing",
        ),
        (
            "robot = \"robot.urdf\"\n[[log]]\npath = \"log.csv\"\njoint = \"wrist\"\n",
            "no joint is named `wrist`",
        ),
        (
            "robot = \"robot.urdf\"\n[[log]]\npath = \"log.csv\"\njoint = \"elbow\"\n",
            "expected stretches of constant speed",
        ),
        (
            "robot = \"robot.urdf\"\n[[log]]\npath = \"log.csv\"\n[[presliding]]\npath = \"log.csv\"\njoint = \"elbow\"\n",
            "inertia",
        ),
        (
            "robot = \"robot.urdf\"\nthermal_lines = \"required\"\n[[log]]\npath = \"log.csv\"\n",
            "thermal lines are required: temperatures from 31.0 to 31.0 degC",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), config, &[1.0, -1.0]);
        let output = run(folder.path(), &["friction", "friction.toml"], 2);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.starts_with("error: ") && said.contains(words), "{words}: {said}");
        assert!(!folder.path().join("dynid-friction").exists());
    }
}

/// A law of `dynid friction` for both joints, viscous friction falling with the temperature.
const KNOWN_FRICTION: &str = r#"{
  "schema": 1, "robot": "arm", "verdict": { "status": "pass", "headline": "" }, "warnings": [],
  "provenance": { "version": "0", "inputs": [], "settings": {}, "seed": 1 },
  "joints": [LAWS]
}"#;

const LAW: &str = r#"{
  "joint": "NAME", "status": "identified", "coulomb": 1.0, "temperature_range": [20.0, 40.0], "offset": 0.0,
  "viscous": { "reference_temperature": 30.0, "sigma2": 2.0, "sigma2_slope": -0.02, "sigma3": 0.8, "sigma3_slope": 0.0,
    "sigma4": 0.8, "sigma4_slope": 0.0 },
  "std": {}, "points": [], "samples": 0, "levels": [], "lines": {}, "laws": [], "unpaired": [], "presliding": [],
  "notes": []
}"#;

/// A simulated log of the arm, with a column of temperatures or without.
fn put_simulated(folder: &Path) {
    std::fs::write(folder.join("robot.urdf"), TWO_LINKS).unwrap();
    let joints = ["shoulder", "elbow"].map(|name| LAW.replace("NAME", name)).join(",");
    std::fs::write(folder.join("friction.json"), KNOWN_FRICTION.replace("LAWS", &joints)).unwrap();
    run(folder, &["simulate", "robot.urdf", "--out", "bare.csv"], 0);
    let bare = std::fs::read_to_string(folder.join("bare.csv")).unwrap();
    let warm: Vec<String> = bare
        .lines()
        .enumerate()
        .map(|(k, line)| line.to_owned() + if k == 0 { ",temp_shoulder,temp_elbow" } else { ",31.0,29.0" })
        .collect();
    std::fs::write(folder.join("log.csv"), warm.join("\n") + "\n").unwrap();
}

#[test]
fn a_flag_names_the_friction_file_and_predictions_ask_for_temperatures() {
    let folder = tempfile::tempdir().unwrap();
    put_simulated(folder.path());
    let args =
        ["identify", "robot.urdf", "--log", "log.csv", "--known-friction", "friction.json", "--out", "out"];
    let output = run(folder.path(), &args, 0);
    let result = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        result.contains("known friction of shoulder = Coulomb and exponential viscous friction"),
        "{result}"
    );
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("friction of `shoulder` has a form that URDF has no place for"), "{said}");
    let text = std::fs::read_to_string(folder.path().join("out/estimate.json")).unwrap();
    let estimate: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(estimate["model"]["known_friction"][1]["joint"], "elbow");

    let states = "q1,q2,dq1,dq2,ddq1,ddq2\n0.1,0.2,0.5,-0.5,0,0\n";
    std::fs::write(folder.path().join("states.csv"), states).unwrap();
    let predict = ["predict", "out/estimate.json", "--states", "states.csv"];
    let refused = run(folder.path(), &predict, 2);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("states.csv: expected the column `temperature_shoulder`"), "{said}");
    let effort = |temperature: f64| -> f64 {
        let header = "q1,q2,dq1,dq2,ddq1,ddq2,temperature_shoulder,temperature_elbow";
        let states = format!("{header}\n0.1,0.2,0.5,-0.5,0,0,{temperature},30\n");
        std::fs::write(folder.path().join("states.csv"), states).unwrap();
        let output = run(folder.path(), &predict, 0);
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().nth(1).unwrap().split(',').next().unwrap().parse().unwrap()
    };
    // σ2 falls by 0.02 N m per kelvin, 1 - exp(-(0.8 · 0.5)^0.8) of it at 0.5 rad/s; clamped at 40 degrees.
    let risen = 1.0 - (-(0.4_f64).powf(0.8)).exp();
    assert!((effort(25.0) - effort(35.0) - 0.2 * risen).abs() < 1e-9);
    assert!((effort(40.0) - effort(60.0)).abs() < 1e-12);
    let validate = ["validate", "out/estimate.json", "--log", "log.csv"];
    let said = |output: std::process::Output| String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!said(run(folder.path(), &validate, 0)).contains("warning"));
    let log = std::fs::read_to_string(folder.path().join("log.csv")).unwrap();
    std::fs::write(folder.path().join("log.csv"), log.replace(",31.0,29.0", ",45.0,29.0")).unwrap();
    let said = said(run(folder.path(), &validate, 0));
    assert!(said.contains("warning: log.csv: 100 % of the temperatures of `shoulder` lie outside"), "{said}");
    run(folder.path(), &["validate", "out/estimate.json", "--log", "bare.csv"], 2);
}

#[test]
fn a_log_without_temperatures_is_refused_with_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    put_simulated(folder.path());
    let args =
        ["identify", "robot.urdf", "--log", "bare.csv", "--known-friction", "friction.json", "--out", "out"];
    let output = run(folder.path(), &args, 2);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("temperature_shoulder") && said.contains("temperature = 30"), "{said}");
    assert!(!folder.path().join("out/estimate.json").exists());
    let config = "robot = \"robot.urdf\"\n[elements]\nknown_friction = \"friction.json\"\ntemperature = 30.0\n\
                  [[log]]\npath = \"bare.csv\"\n";
    std::fs::write(folder.path().join("run.toml"), config).unwrap();
    run(folder.path(), &["identify", "run.toml", "--out", "out", "--quiet"], 0);
    for (text, words) in [
        (config.replace("friction.json", "robot.urdf"), "not a friction model"),
        (config.replace("friction.json", "none.json"), "none.json"),
        (config.replace("30.0", "{ wrist = 30.0 }"), "no joint is named `wrist`"),
        (config.replace("30.0", "303.0"), "elements.temperature"),
        (config.replace("known_friction = \"friction.json\"\n", ""), "`known_friction` beside it"),
    ] {
        std::fs::write(folder.path().join("run.toml"), text).unwrap();
        let output = run(folder.path(), &["identify", "run.toml", "--out", "other"], 2);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.starts_with("error: ") && said.contains(words), "{words}: {said}");
    }
}
