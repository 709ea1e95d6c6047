//! Payloads and drive gains through the commands, on logs of one robot file and of another whose last link is heavier.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use serde_json::Value;

use crate::support::{indy7, run};

/// Standard parameters of the last link, without and with 2 kg at (20, 0, 100) mm of moments 0.02 kg m².
const BARE: &str =
    "[1.24909, -0.01777, -0.03764, -0.14989, 0.06164, 0.005, -0.01175, 0.05158, -0.01037, 0.066]";
const HEAVY: &str =
    "[3.24909, 0.02223, -0.03764, 0.05011, 0.10164, 0.005, -0.01575, 0.09238, -0.01037, 0.0868]";

const RUN: &str = r#"robot = "arm.toml"
[elements]
friction = "given"
[[payload]]
name = "tool"
mass = 2.0
com = [0.02, 0, 0.1]
inertia = [0.02, 0, 0, 0.02, 0, 0.02]
[[log]]
path = "bare.csv"
[[log]]
path = "heavy.csv"
payload = "tool"
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let robot = indy7();
    assert!(robot.contains(BARE), "last link of the robot file");
    std::fs::write(at.join("arm.toml"), &robot).unwrap();
    std::fs::write(at.join("heavy.toml"), robot.replace(BARE, HEAVY)).unwrap();
    std::fs::write(at.join("run.toml"), RUN).unwrap();
    for (robot, log, seed) in [("arm.toml", "bare.csv", "1"), ("heavy.toml", "heavy.csv", "2")] {
        run(at, &["simulate", robot, "--out", log, "--duration", "20", "--seed", seed], 0);
    }
    folder
}

fn stdout(at: &Path, args: &[&str], code: i32) -> String {
    String::from_utf8(run(at, args, code).stdout).unwrap()
}

#[test]
fn payload_and_gains_are_found_told_and_written() {
    let folder = folder();
    let at = folder.path();
    let told = stdout(at, &["payload", "run.toml", "--out", "out"], 0);
    for expected in
        ["tool on link6", "Jzz", "price of feasibility", "difference of two separate fits", "weighs"]
    {
        assert!(told.contains(expected), "{expected}\n{told}");
    }
    for file in ["payload.json", "payload.html", "tool.urdf.part"] {
        assert!(at.join("out").join(file).is_file(), "{file}");
    }
    let text = stdout(at, &["payload", "run.toml", "--out", "out", "--json", "--quiet"], 0);
    assert_eq!(text, std::fs::read_to_string(at.join("out/payload.json")).unwrap());
    let file: Value = serde_json::from_str(&text).unwrap();
    let found = &file["payloads"][0];
    let number = |v: &Value| v.as_f64().unwrap();
    // 20 s of effort noise of 2 %.
    assert!((number(&found["mass"]["value"]) - 2.0).abs() < 0.02, "{found}");
    assert!((number(&found["com"][2]["value"]) - 0.1).abs() < 0.005, "{found}");
    assert_eq!(found["parameters"][0]["name"], "tool.m");
    assert_eq!(file["status"], "ok");

    let told = stdout(at, &["gains", "run.toml"], 0);
    assert!(told.contains("plain LS") && told.contains("determined"), "{told}");
    let file: Value = serde_json::from_str(&stdout(at, &["gains", "run.toml", "--json"], 0)).unwrap();
    let joint = &file["joints"][1];
    assert_eq!(joint["verdict"], "determined");
    assert!((number(&joint["gain"]) - 1.0).abs() < 4.0 * number(&joint["std"]), "{joint}");
    // The axis of the first joint is upright: only the inertia of the load acts on it.
    assert!(number(&file["joints"][0]["t"]) < number(&joint["t"]), "{file}");
}

#[test]
fn bad_runs_end_with_one_message_and_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let bad = [
        (RUN.replace("payload = \"tool\"", "payload = \"tol\""), "`tool`"),
        (RUN.replace("mass = 2.0", "mass = -2.0"), "positive number"),
        (RUN.replace("payload = \"tool\"", ""), "in a `[[log]]` at least"),
        (RUN.replace("path = \"bare.csv\"", "path = \"bare.csv\"\npayload = \"tool\""), "without it beside"),
    ];
    for (text, expected) in bad {
        std::fs::write(at.join("bad.toml"), text).unwrap();
        for command in ["payload", "gains"] {
            let output = run(at, &[command, "bad.toml"], 2);
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(said.contains(expected) && said.contains("hint: "), "{command}: {said}");
            assert!(output.stdout.is_empty());
        }
    }
}
