//! Numbered columns on robots with branches that are alike.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write as _;
use std::path::Path;

use dynid::Config;
use dynid::check::{Check, Severity, check};

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
