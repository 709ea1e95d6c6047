//! A robot whose joints have clearance, through the commands.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use serde_json::Value;

use crate::support::run;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let robot = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/xy-pointing.toml");
    std::fs::copy(robot, folder.path().join("xy.toml")).unwrap();
    folder
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn stderr(folder: &Path, args: &[&str], code: i32) -> String {
    String::from_utf8(run(folder, args, code).stderr).unwrap()
}

#[test]
fn joints_with_clearance_pass_through_the_commands() {
    let folder = folder();
    let at = folder.path();
    let shown = String::from_utf8(run(at, &["inspect", "xy.toml"], 0).stdout).unwrap();
    assert!(shown.contains("joints with clearance") && shown.contains("rough"), "{shown}");
    let json: Value = serde_json::from_slice(&run(at, &["inspect", "xy.toml", "--json"], 0).stdout).unwrap();
    assert_eq!(json["clearances"][1]["joint"], "j2");
    assert!((json["clearances"][0]["at_rest"]["load"].as_f64().unwrap() - 29.407).abs() < 1e-3);

    let simulate = |out: &str, more: &[&str]| {
        let mut args = vec!["simulate", "xy.toml", "--out", out, "--duration", "30", "--seed", "3"];
        args.extend(more);
        stderr(at, &args, 0)
    };
    let said = simulate("log.csv", &["--truth", "truth.json", "--clean", "clean.csv"]);
    assert!(
        said.contains("j1: in contact") && said.contains("energy") && !said.contains("warning"),
        "{said}"
    );
    let header = text(at, "log.csv").lines().next().unwrap().to_owned();
    assert_eq!(
        header,
        "t,q_j1,q_j2,tau_j1,tau_j2,journal_j1_x,journal_j1_y,journal_j2_x,journal_j2_y,normal_force_j1,\
         friction_force_j1,penetration_j1,normal_force_j2,friction_force_j2,penetration_j2"
    );
    assert!(text(at, "clean.csv").lines().next().unwrap().ends_with(",penetration_j2"));
    let truth: Value = serde_json::from_str(&text(at, "truth.json")).unwrap();
    assert_eq!(truth["j1.mu"], 0.1);
    let found = &truth["clearance"];
    assert!(found["energy_relative_error"].as_f64().unwrap() < 1e-8, "{found}");
    assert_eq!(found["journals"][0]["onsets"], 1);
    assert!(found["journals"][1]["events"][0]["onset_speed"].as_f64().unwrap() > 0.0);
    simulate("again.csv", &[]);
    assert!(text(at, "log.csv") == text(at, "again.csv"), "the same seed gave other bits");
    assert!(simulate("slow.csv", &["--rate-hz", "100"]).contains("warning: journals swing"));
    simulate("noisy.csv", &["--journal-noise", "1e-7"]);
    assert!(text(at, "noisy.csv") != text(at, "log.csv"));

    std::fs::write(at.join("run.toml"), "robot = \"xy.toml\"\nout = \"out\"\n[[log]]\npath = \"log.csv\"\n")
        .unwrap();
    let said = run(at, &["identify", "run.toml"], 0);
    let [said, told] = [said.stdout, said.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(said.contains("[ok] clearance of the joints"), "{said}");
    assert!(!said.contains("not part of the fit") && !told.contains("not part of the fit"), "{said}{told}");
    let estimate: Value = serde_json::from_str(&text(at, "out/estimate.json")).unwrap();
    assert_eq!(estimate["joints"], serde_json::json!(["j1", "j2"]));
    let base = estimate["base_parameters"].as_array().unwrap();
    assert!(base.iter().all(|p| !p["name"].as_str().unwrap().contains("contact")));
    assert!(base.iter().any(|p| p["name"] == "j2.mu"));
    let ideal = text(at, "run.toml").replace("[[log]]", "[elements]\nclearance = \"ideal\"\n[[log]]");
    std::fs::write(at.join("ideal.toml"), ideal).unwrap();
    let said = run(at, &["identify", "ideal.toml", "--out", "ideal"], 0);
    let said = [said.stdout, said.stderr].map(|text| String::from_utf8(text).unwrap()).concat();
    assert!(said.contains("joint `j2` has clearance (gap 50 µm), which is not part of the fit"), "{said}");
    let rows = run(at, &["regressor", "xy.toml", "--states", "clean.csv", "--json"], 0).stdout;
    let rows: Value = serde_json::from_slice(&rows).unwrap();
    assert_eq!(rows["joints"], serde_json::json!(["j1", "j2"]));
}

#[test]
fn faults_of_clearance_are_told_with_file_and_field() {
    let folder = folder();
    let at = folder.path();
    let robot = text(at, "xy.toml");
    std::fs::write(at.join("bad.toml"), robot.replace("gap = 5e-5", "gap = 0")).unwrap();
    let line = robot.lines().position(|l| l == "[element.j1]").unwrap() + 1;
    let message = stderr(at, &["inspect", "bad.toml"], 2);
    assert!(message.contains(&format!("bad.toml:{line}:1: element.j1: clearance.gap")), "{message}");
    std::fs::write(at.join("settle.toml"), "mode = \"closed_loop\"\nsettle_s = 1.0\n").unwrap();
    let message = stderr(at, &["simulate", "xy.toml", "--out", "log.csv", "--config", "settle.toml"], 2);
    assert!(message.contains("settle_s") && message.contains("closed loop"), "{message}");
}

/// Every `step`-th row of a log without columns that begin with `left_out`.
fn thinned(folder: &Path, from: &str, to: &str, step: usize, left_out: &str) {
    let table = text(folder, from);
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let mut out = String::new();
    for line in table.lines().take(1).chain(table.lines().skip(1).step_by(step)) {
        let cells = line.split(',').zip(&header).filter(|(_, name)| !name.starts_with(left_out));
        out += &(cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",") + "\n");
    }
    std::fs::write(folder.join(to), out).unwrap();
}

#[test]
fn clearances_are_found_by_probes_and_by_the_swing_in_the_effort() {
    let folder = folder();
    let at = folder.path();
    let simulate = [
        "simulate",
        "xy.toml",
        "--out",
        "log.csv",
        "--duration",
        "15.708",
        "--rate-hz",
        "1000",
        "--effort-noise",
        "0.01",
        "--journal-noise",
        "1e-6",
        "--seed",
        "1",
    ];
    run(at, &simulate, 0);
    thinned(at, "log.csv", "bare.csv", 1, "journal_");
    thinned(at, "log.csv", "slow.csv", 10, "none");
    run(at, &["identify", "xy.toml", "--log", "log.csv", "--out", "out"], 0);
    let found = |log: &str| -> Value {
        let args = ["clearance", "xy.toml", "out/estimate.json", "--log", log, "--json"];
        serde_json::from_slice(&run(at, &args, 0).stdout).unwrap()
    };
    let within = |value: &Value, truth: f64, share: f64| {
        let (found, std) = (value["value"].as_f64().unwrap(), value["std"].as_f64().unwrap());
        assert!((found / truth - 1.0).abs() < share && (found - truth).abs() < 4.0 * std, "{value} {truth}");
    };
    let fast = found("log.csv");
    for joint in fast.as_array().unwrap() {
        within(&joint["probed"]["gap"], 5e-5, 0.05);
        within(&joint["probed"]["friction"], 0.1, 0.05);
        assert_eq!(joint["swing"]["found"], true);
        within(&joint["swing"]["gap"], 5e-5, 0.05);
        assert_eq!(joint["remarks"].as_array().unwrap().len(), 0, "{joint}");
    }
    let bare = found("bare.csv");
    assert!(bare[0]["probed"].is_null() && bare[0]["swing"] == fast[0]["swing"], "{bare}");
    assert!(
        bare[1]["remarks"][0].as_str().unwrap().contains("columns `journal_j2_x`, `journal_j2_y`"),
        "{bare}"
    );
    // The line at 100 Hz would be an alias.
    let slow = found("slow.csv");
    within(&slow[1]["probed"]["gap"], 5e-5, 0.05);
    assert!(slow[0]["swing"].is_null(), "{slow}");
    assert!(slow[0]["remarks"][0].as_str().unwrap().contains("too slow for the stated gap"), "{slow}");

    let shown = run(at, &["clearance", "xy.toml", "out/estimate.json", "--log", "log.csv"], 0).stdout;
    let shown = String::from_utf8(shown).unwrap();
    assert!(shown.contains("probes   gap") && shown.contains("effort   gap"), "{shown}");

    // Journals that bounce in their bearings are no gap of the drive.
    let backlash = |args: &[&str], code: i32| {
        let output = run(at, &[&["backlash", "out/estimate.json"], args].concat(), code);
        String::from_utf8(if code == 0 { output.stdout } else { output.stderr }).unwrap()
    };
    let file: Value = serde_json::from_str(&backlash(&["--log", "log.csv", "--json"], 0)).unwrap();
    let joints = file[0]["joints"].as_array().unwrap();
    assert_eq!(joints.len(), 2);
    for joint in joints {
        assert!(joint["verdict"] != "found" && joint["gap"].is_null() && joint["unit"] == "rad", "{joint}");
    }
    let shown = backlash(&["--log", "log.csv", "--rows", "1:12000"], 0);
    assert!(shown.starts_with("log.csv (1000 Hz)\n  j1  ") && shown.contains("\n  j2  "), "{shown}");
    assert!(backlash(&[], 2).contains("--log"));

    let indy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml");
    std::fs::copy(indy, at.join("indy7.toml")).unwrap();
    let refused = stderr(at, &["clearance", "indy7.toml", "out/estimate.json", "--log", "log.csv"], 2);
    assert!(refused.contains("no joint has clearance"), "{refused}");
}
