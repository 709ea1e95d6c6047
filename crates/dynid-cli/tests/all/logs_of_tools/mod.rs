//! Logs as tools write them: the first good result takes two commands and no edit of the file.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod arm;
mod formats;
mod init;
mod many;
mod misread;

use std::path::Path;

use crate::support::{TWO_LINKS, run};
use arm::{Arm, arm};

/// Share of the effort that a model may miss. The noise of the logs is 2 % of the effort, and models from thousands of rows are
/// better than that; a swapped joint, a wrong unit or sign misses by tens of per cent.
const NEAR_THE_TRUTH: f64 = 0.02;

/// A folder with the robot and a log.
fn folder(log: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.urdf"), TWO_LINKS).unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    folder
}

/// Drafts a configuration and identifies by it; gives what the program said.
#[track_caller]
fn two_commands(log: &str, flags: &[&str]) -> String {
    let folder = folder(log);
    let at = folder.path();
    let drafted = run(at, &[&["init", "robot.urdf", "log.csv"], flags].concat(), 0);
    let said = String::from_utf8_lossy(&drafted.stderr).into_owned();
    assert!(said.contains("next: dynid check dynid.toml"), "{said}");
    run(at, &["identify", "dynid.toml", "--out", "out"], 0);
    near_the_truth(at);
    assert_eq!(std::fs::read_to_string(at.join("log.csv")).unwrap(), log, "the log was touched");
    said + &std::fs::read_to_string(at.join("dynid.toml")).unwrap()
}

/// Identifies from the log as it is; gives what the program said.
#[track_caller]
fn one_command(log: &str, flags: &[&str]) -> String {
    let folder = folder(log);
    let arguments = ["identify", "robot.urdf", "--log", "log.csv", "--out", "out"];
    let output = run(folder.path(), &[&arguments, flags].concat(), 0);
    near_the_truth(folder.path());
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The verdict is no `fail`, and the model gives the efforts of the simulated arm at its true states.
#[track_caller]
fn near_the_truth(at: &Path) {
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    let estimate: serde_json::Value = serde_json::from_str(&read("out/estimate.json")).unwrap();
    let status = estimate["verdict"]["status"].as_str().unwrap();
    assert!(["ok", "warn"].contains(&status), "{}", estimate["verdict"]);
    let Arm { clean, effort, .. } = arm();
    std::fs::write(at.join("states.csv"), clean).unwrap();
    run(at, &["predict", "out/estimate.json", "--states", "states.csv", "--out", "predicted.csv"], 0);
    let predicted = arm::columns(&read("predicted.csv"), &["effort_shoulder", "effort_elbow"]);
    for ((joint, truth), found) in ["shoulder", "elbow"].iter().zip(effort).zip(&predicted) {
        let missed: f64 = truth.iter().zip(found).map(|(a, b)| (a - b).powi(2)).sum();
        let whole: f64 = truth.iter().map(|x| x * x).sum();
        let share = (missed / whole).sqrt();
        assert!(share < NEAR_THE_TRUTH, "{joint}: the model misses {share:.4} of the effort");
    }
}

/// A refusal names what is wrong and the line to write.
#[track_caller]
fn refused(log: &str, arguments: &[&str], parts: &[&str], line: &str) {
    let folder = folder(log);
    let output = run(folder.path(), arguments, 2);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    for part in parts {
        assert!(said.lines().next().unwrap_or_default().contains(part), "`{part}`: {said}");
    }
    let hint = said.lines().nth(1).unwrap_or_default();
    assert!(hint.starts_with("hint: ") && hint.contains(line), "`{line}`: {said}");
}
