//! `dynid friction`: files, exit codes, messages.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod support;

use std::fmt::Write;
use std::path::Path;

use support::{TWO_LINKS, indy7, run};

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
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("Coulomb friction and offset cannot be told apart"), "{said}");
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
