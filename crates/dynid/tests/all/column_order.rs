//! Columns and joints: numbered ones on robots with branches that are alike, those of public logs.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write as _;
use std::path::Path;

use dynid::Config;
use dynid::check::{Check, Severity, check};
use dynid::io::{ColumnMapping, MappingSpec, ReadOptions, csv, robot as robot_file};
use dynid_testing::shared;

/// A torso that turns with two arms of two joints; `right` first in the file, `left` first by name.
fn robot(arms: &[&str]) -> String {
    let mut out = String::from("schema = 1\nname = \"arms\"\n");
    let mut body = |name: &str, parent: &str, joint: &str, origin: [f64; 3], mass: f64| {
        let [x, y, z] = origin;
        writeln!(
            out,
            "[[body]]\nname = \"{name}\"\nparent = \"{parent}\"\njoint = {{ name = \"{joint}\", kind = \"revolute\", axis = [0, 1, 0], xyz = [{x:?}, {y:?}, {z:?}] }}\n\
             mass = {mass:?}\ncom = [0.1, 0.0, 0.05]\ninertia_com = [0.02, 0.0, 0.0, 0.02, 0.0, 0.02]"
        )
        .unwrap();
    };
    for (k, arm) in arms.iter().enumerate() {
        let side = if k == 0 { 0.2 } else { -0.2 };
        body(&format!("{arm}_upper"), "ground", &format!("{arm}_shoulder"), [0.0, side, 0.5], 2.0);
        body(&format!("{arm}_fore"), &format!("{arm}_upper"), &format!("{arm}_elbow"), [0.3, 0.0, 0.0], 1.0);
    }
    out
}

fn write_log(folder: &Path, joints: &[String]) {
    let header = |signal: &str| joints.iter().map(|j| format!(",{signal}{j}")).collect::<String>();
    let mut text = format!("t{}{}\n", header("q"), header("tau"));
    for k in 0..2000 {
        let t = 0.005 * f64::from(k);
        write!(text, "{t}").unwrap();
        for j in 0..joints.len() {
            let w = 1.3 + 0.37 * j as f64;
            write!(text, ",{}", 0.6 * (w * t).sin() + 0.2 * (2.3 * w * t).cos()).unwrap();
        }
        for j in 0..joints.len() {
            let w = 1.3 + 0.37 * j as f64;
            write!(text, ",{}", 3.0 * (w * t).cos() + (w * t).sin()).unwrap();
        }
        text.push('\n');
    }
    std::fs::write(folder.join("log.csv"), text).unwrap();
}

fn checked(arms: &[&str], joints: &[&str], columns: &str) -> Check {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.toml"), robot(arms)).unwrap();
    write_log(folder.path(), &joints.iter().map(|j| (*j).to_owned()).collect::<Vec<_>>());
    let at = folder.path().display();
    let text = format!("robot = \"{at}/robot.toml\"\n[[log]]\npath = \"{at}/log.csv\"\n{columns}");
    check(&Config::parse(&text, "test").unwrap(), &mut |_| {}).unwrap()
}

const NUMBERS: [&str; 4] = ["1", "2", "3", "4"];

#[test]
fn numbered_columns_of_two_arms_that_are_alike_are_not_taken_in_silence() {
    let found = checked(&["right", "left"], &NUMBERS, "");
    let finding = found.findings.iter().find(|f| f.id.word() == "column_order").unwrap();
    assert_eq!(finding.severity, Severity::Warning);
    // The assignment is listed, and the line to write with it.
    for part in ["`right_shoulder` and `left_shoulder` are alike", "q1 = right_shoulder", "q4 = left_elbow"] {
        assert!(finding.evidence.contains(part), "{part}: {}", finding.evidence);
    }
    assert!(finding.remedy.contains("\"left_elbow\" = \"q4\""), "{}", finding.remedy);
}

#[test]
fn columns_with_names_or_an_order_that_was_stated_raise_no_doubt() {
    let none = |found: &Check| assert!(found.findings.iter().all(|f| f.id.word() != "column_order"));
    none(&checked(&["right"], &NUMBERS[..2], ""));
    let names = ["_right_shoulder", "_right_elbow", "_left_shoulder", "_left_elbow"];
    none(&checked(&["right", "left"], &names, ""));
    // What the remedy says.
    let stated = "[columns]\nposition = { right_shoulder = \"q3\", right_elbow = \"q4\", left_shoulder = \"q1\", left_elbow = \"q2\" }\n\
         effort = { right_shoulder = \"tau3\", right_elbow = \"tau4\", left_shoulder = \"tau1\", left_elbow = \"tau2\" }\n";
    none(&checked(&["right", "left"], &NUMBERS, stated));
}

#[test]
fn public_logs_map_to_their_robots() {
    let Some(data) = shared("data") else { return };
    let cases = [
        ("oracles/ur5.urdf", "oracles/logs/ur5_dev/train.csv.gz", ""),
        ("oracles/ur5.urdf", "oracles/logs/ur5_dev/valid_fourier_clean.csv.gz", ""),
        ("oracles/iiwa14.urdf", "oracles/logs/iiwa_250/train.csv.gz", ""),
        ("kinova-gen3/gen3.urdf", "kinova-gen3/Trajectory1.csv.gz", ""),
        ("panda-gaz2019/panda_kinematics.urdf", "panda-gaz2019/exciting_trajectory.csv.gz", ""),
        ("ur10-unisa/ur10_kinematics.urdf", "ur10-unisa/exciting_trajectory.csv.gz", ""),
        ("rokae-xmate/xmate_kinematics.urdf", "rokae-xmate/run_a.csv.gz", "rate_hz = 1000"),
        (
            "ur10e-innopolis/ur10e.urdf",
            "ur10e-innopolis/20_02_05-20sec_8harm.csv.gz",
            "current_gains = [15, 15, 11, 11, 11, 11]",
        ),
        (
            "staubli-tx40/tx40.urdf",
            "staubli-tx40/motor_log.csv.gz",
            "rate_hz = 5000\ncurrent_gains = [1, 1, 1, 1, 1, 1]",
        ),
    ];
    for (urdf, log, spec) in cases {
        let robot = robot_file::read(data.join(urdf)).unwrap().description;
        let moving: Vec<String> = robot
            .joints
            .iter()
            .filter(|j| j.kind != dynid_model::JointKind::Fixed)
            .map(|j| j.name.clone())
            .collect();
        let table = csv::read(data.join(log), &ReadOptions::default()).unwrap();
        let spec: MappingSpec = toml::from_str(spec).unwrap();
        let mapping =
            ColumnMapping::from_spec(&table.header, &moving, &spec).unwrap_or_else(|e| panic!("{log}: {e}"));
        let signals = mapping.extract(&table).unwrap();
        assert_eq!((signals.position.len(), signals.time.len()), (moving.len(), table.rows), "{log}");
        assert!(signals.effort.is_some() && table.rows > 100, "{log}");
    }
}
