//! A robot with a motor behind a spring, through the commands.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use serde_json::Value;

use crate::support::{dynid, run};

const ARM: &str = r#"
schema = 1
name = "elastic-arm"
gravity = [0, -9.81, 0]
dh = "modified"
[[joint]]
name = "j1"
limits = { position = ["-150deg", "150deg"], velocity = 2.0, effort = 200.0 }
phi = [8.0, 2.0, 0.1, 0, 0.15, 0, 0, 0.85, 0, 0.9]
[element.j1]
elements = ["coulomb", "viscous"]
coulomb = { effort = 3.0 }
viscous = { coefficient = 4.0 }
elastic = { ratio = 100, k1 = 12000.0, k2 = 4.0e7 }
[element.j1_motor]
elements = ["coulomb", "viscous", "rotor"]
coulomb = { effort = 0.08 }
viscous = { coefficient = 4e-4 }
rotor = { inertia = 1.2e-4 }
"#;

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

/// Columns of a table by name.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut lines = table.lines();
    let place = lines
        .next()
        .unwrap()
        .split(',')
        .position(|n| n == name)
        .unwrap_or_else(|| panic!("no column {name}"));
    lines.map(|line| line.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

#[test]
fn motors_behind_springs_pass_through_all_commands() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.toml"), ARM).unwrap();
    std::fs::write(at.join("run.toml"), "robot = \"arm.toml\"\nout = \"out\"\n[[log]]\npath = \"log.csv\"\n")
        .unwrap();

    let shown = String::from_utf8(run(at, &["inspect", "arm.toml"], 0).stdout).unwrap();
    assert!(shown.contains("j1_motor") && shown.contains("cubic"), "{shown}");
    run(at, &["simulate", "arm.toml", "--out", "log.csv", "--clean", "clean.csv", "--duration", "30"], 0);
    assert!(text(at, "log.csv").starts_with("t,q_j1,q_j1_motor,tau_j1_motor\n"));
    run(at, &["identify", "run.toml"], 0);
    let estimate: Value = serde_json::from_str(&text(at, "out/estimate.json")).unwrap();
    assert_eq!(estimate["joints"], serde_json::json!(["j1", "j1_motor"]));
    assert_eq!(estimate["model"]["elastic"][0]["ratio"], 100.0);
    assert_eq!(estimate["fit"]["r2"][0], Value::Null);
    assert!(text(at, "out/arm.urdf").contains("link1"));

    run(at, &["predict", "out/estimate.json", "--states", "clean.csv", "--out", "effort.csv"], 0);
    let (clean, effort) = (text(at, "clean.csv"), text(at, "effort.csv"));
    let (truth, found) = (column(&clean, "tau_j1_motor"), column(&effort, "effort_j1_motor"));
    let squares = |x: &mut dyn Iterator<Item = f64>| x.map(|e| e * e).sum::<f64>().sqrt();
    let off =
        squares(&mut truth.iter().zip(&found).map(|(a, b)| a - b)) / squares(&mut truth.iter().copied());
    // Signs of velocities are smooth in the simulation, sharp in the prediction.
    assert!(off < 0.05, "predicted efforts are {off} off");
    run(at, &["validate", "out/estimate.json", "--log", "log.csv"], 0);
    run(at, &["export", "out/estimate.json", "--model", "robot.json"], 0);
    assert!(text(at, "robot.json").contains("\"motor\": \"j1_motor\""));
    let rows = run(at, &["regressor", "arm.toml", "--states", "clean.csv", "--json"], 0).stdout;
    let rows: Value = serde_json::from_slice(&rows).unwrap();
    assert_eq!(rows["joints"], serde_json::json!(["j1", "j1_motor"]));

    let stream = dynid()
        .current_dir(at)
        .args(["online", "run.toml", "--stream", "csv"])
        .write_stdin(text(at, "log.csv"))
        .output()
        .unwrap();
    assert!(matches!(stream.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&stream.stderr));
    let events = String::from_utf8(stream.stdout).unwrap();
    assert!(events.contains("j1.k1") && events.contains("is that of the rows of links"), "{events}");
}

#[test]
fn what_knows_stiff_joints_alone_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.toml"), ARM).unwrap();
    std::fs::write(at.join("bad.toml"), ARM.replace("ratio = 100", "ratio = 0")).unwrap();
    let told = |args: &[&str]| String::from_utf8(run(at, args, 2).stderr).unwrap();
    let sensed = ARM.replace("ratio = 100,", "ratio = 100, sensor = true,");
    std::fs::write(at.join("sensed.toml"), sensed).unwrap();
    assert!(
        told(&["simulate", "sensed.toml", "--out", "log.csv", "--closed-loop"]).contains("torque sensor")
    );
    let design = told(&["design", "arm.toml"]);
    assert!(design.contains("elastic") && design.contains("torque of its spring"), "{design}");
    run(at, &["simulate", "arm.toml", "--out", "log.csv", "--closed-loop", "--duration", "2"], 0);
    assert!(text(at, "log.csv").starts_with("t,q_j1,q_j1_motor,tau_j1_motor\n"));
    let message = told(&["inspect", "bad.toml"]);
    assert!(message.contains("bad.toml:10:1") && message.contains("elastic.ratio"), "{message}");
}
