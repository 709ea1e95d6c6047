//! Many logs at once: patterns, folders and lists wherever a log is named.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use super::arm::arm;
use crate::support::{TWO_LINKS, dynid, run};

/// A robot with three records in `runs`, and other files beside them.
fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::create_dir(at.join("runs")).unwrap();
    fs::write(at.join("robot.urdf"), TWO_LINKS).unwrap();
    fs::write(at.join("runs/notes.md"), "no log").unwrap();
    for (k, name) in ["b", "a", "c"].into_iter().enumerate() {
        let log =
            arm().rows("t,q1,q2,dq1,dq2,tau1,tau2", |row, t| format!("{t},{}", arm().signals(row, ",")));
        let lines: Vec<&str> = log.lines().collect();
        let part = &lines[1 + 600 * k..1 + 600 * (k + 1)];
        fs::write(at.join(format!("runs/{name}.csv")), format!("{}\n{}\n", lines[0], part.join("\n")))
            .unwrap();
    }
    folder
}

fn text(at: &Path, arguments: &[&str], code: i32) -> String {
    let output = run(at, arguments, code);
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Parameters and logs of an identification by a configuration.
fn identified(at: &Path, logs: &str) -> (Value, Vec<String>) {
    fs::write(at.join("run.toml"), format!("robot = \"robot.urdf\"\npreflight = \"warn\"\n{logs}")).unwrap();
    // Six seconds of each log need not be enough for a good verdict.
    let arguments = ["identify", "run.toml", "--out", "out", "--force"];
    let output = dynid().current_dir(at).args(arguments).output().unwrap();
    assert!(
        [Some(0), Some(1)].contains(&output.status.code()),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let estimate: Value =
        serde_json::from_str(&fs::read_to_string(at.join("out/estimate.json")).unwrap()).unwrap();
    let inputs = estimate["provenance"]["inputs"].as_array().unwrap();
    let logs = inputs.iter().filter(|input| ["log", "validation"].contains(&input["kind"].as_str().unwrap()));
    let logs = logs.map(|input| input["path"].as_str().unwrap().to_owned()).collect();
    (estimate["parameters"].clone(), logs)
}

#[test]
fn a_pattern_a_folder_and_a_list_are_the_logs_one_by_one() {
    let folder = bench();
    let at = folder.path();
    fs::write(at.join("good.manifest"), "# those without a fault\nruns/[ab].csv\nruns/c.csv\n").unwrap();
    let one_by_one: String = ["a", "b", "c"].map(|n| format!("[[log]]\npath = \"runs/{n}.csv\"\n")).concat();
    let expected = identified(at, &one_by_one);
    assert_eq!(expected.1, ["runs/a.csv", "runs/b.csv", "runs/c.csv"]);
    for path in ["runs/*.csv", "runs", "**/?.csv", "good.manifest"] {
        assert!(identified(at, &format!("[[log]]\npath = \"{path}\"\n")) == expected, "{path}");
    }
    // Validation logs, and logs on the command line.
    let (_, logs) =
        identified(at, "[[log]]\npath = \"runs/a.csv\"\n[[validation]]\npath = \"runs/[bc].csv\"\n");
    assert_eq!(logs, ["runs/a.csv", "runs/b.csv", "runs/c.csv"]);
    for arguments in [
        &["check", "robot.urdf", "--log", "runs/*.csv", "--json"][..],
        &["check", "runs", "--robot", "robot.urdf", "--json"],
        &["validate", "out/estimate.json", "--log", "good.manifest", "--json"],
        &["check", "run.toml", "--log", "runs", "--json"],
    ] {
        let output = run(at, arguments, 0);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        for name in ["runs/a.csv", "runs/b.csv", "runs/c.csv"] {
            assert!(said.contains(name), "{name} in {arguments:?}: {said}");
        }
    }
}

#[test]
fn other_keys_of_an_entry_go_with_each_of_its_logs() {
    let folder = bench();
    let at = folder.path();
    let config = "robot = \"robot.urdf\"\n[[log]]\npath = \"runs/[ab].csv\"\npart = [0.0, 0.5]\n[[log]]\npath = \"runs/c.csv\"\n";
    fs::write(at.join("run.toml"), config).unwrap();
    let said = text(at, &["check", "run.toml", "--fix", "fixed.toml"], 0);
    assert!(said.contains("runs/a.csv: 300 rows") && said.contains("runs/c.csv: 600 rows"), "{said}");
    let fixed: toml::Table = fs::read_to_string(at.join("fixed.toml")).unwrap().parse().unwrap();
    let logs = fixed["log"].as_array().unwrap();
    let shown: Vec<(bool, bool)> = logs
        .iter()
        .map(|log| (log["path"].as_str().unwrap().ends_with(".csv"), log.get("part").is_some()))
        .collect();
    assert_eq!(shown, [(true, true), (true, true), (true, false)]);
    fs::write(at.join("run.toml"), config.replace("part =", "name = \"x\"\npart =")).unwrap();
    let said = text(at, &["check", "run.toml"], 2);
    assert!(said.contains("`log.name`: expected a name for one log, found x, and 2 logs of"), "{said}");
}

#[test]
fn what_finds_no_log_or_too_many_is_refused() {
    let folder = bench();
    let at = folder.path();
    let cases: [(&[&str], &str); 5] = [
        (
            &["check", "robot.urdf", "--log", "runs/*.mcap"],
            "runs/*.mcap: expected logs in `runs`, found a.csv, b.csv, c.csv, notes.md",
        ),
        (
            &["identify", "robot.urdf", "--log", "no/*.csv"],
            "no/*.csv: expected logs in `.`, found robot.urdf, runs",
        ),
        (
            &["convert", "runs", "out.csv"],
            "runs: expected one log, found 3: runs/a.csv, runs/b.csv, runs/c.csv",
        ),
        (&["inspect", "runs/*.csv"], "runs/*.csv: expected one log, found 3"),
        (&["validate", "out.json", "--log", "missing.manifest"], "out.json"),
    ];
    for (arguments, message) in cases {
        let said = text(at, arguments, 2);
        assert!(said.contains(message), "{message}: {said}");
    }
    // A pattern of one log is that log.
    assert!(text(at, &["inspect", "runs/a*"], 0).contains("runs/a.csv: 600 rows"));
    // Logs of a configuration whose place others take need not be there.
    fs::write(at.join("run.toml"), "robot = \"robot.urdf\"\n[[log]]\npath = \"gone/*.csv\"\n").unwrap();
    assert!(text(at, &["check", "run.toml"], 2).contains("gone/*.csv: expected logs in"));
    assert!(text(at, &["check", "run.toml", "--log", "runs/a.csv"], 0).contains("runs/a.csv: 600 rows"));
}
