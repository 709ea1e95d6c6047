//! Where a result comes from: files as they were read, and logs that are read as the training logs were.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write;
use std::fs;
use std::path::Path;

use dynid::config::{Config, LogConfig};
use dynid::io::digest::sha256;
use serde_json::Value as Json;
use tempfile::TempDir;

use crate::support::{TWO_LINKS, dynid, run};

/// A folder with a robot and two simulated logs.
fn logs() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("arm.urdf"), TWO_LINKS).unwrap();
    let of =
        ["simulate", "arm.urdf", "--duration", "12", "--rate-hz", "100", "--effort-noise", "0.01", "--out"];
    run(folder.path(), &[&of[..], &["train.csv", "--seed", "1"]].concat(), 0);
    run(folder.path(), &[&of[..], &["valid.csv", "--seed", "2", "--clean", "clean.csv"]].concat(), 0);
    folder
}

/// A CSV with other names, its columns multiplied by factors.
fn renamed(folder: &Path, from: &str, to: &str, columns: &[(&str, &str, f64)]) {
    let text = fs::read_to_string(folder.join(from)).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let of = |name: &str| columns.iter().find(|c| c.0 == name);
    for (name, ..) in columns {
        assert!(header.contains(name), "{name} in {header:?}");
    }
    let mut out = header.iter().map(|n| of(n).map_or(*n, |c| c.1)).collect::<Vec<_>>().join(",");
    for line in lines {
        let number = |(field, name): (&str, &&str)| match of(name) {
            Some(column) => (column.2 * field.parse::<f64>().unwrap()).to_string(),
            None => field.to_owned(),
        };
        let fields: Vec<String> = line.split(',').zip(&header).map(number).collect();
        write!(out, "\n{}", fields.join(",")).unwrap();
    }
    fs::write(folder.join(to), out + "\n").unwrap();
}

fn estimate(folder: &Path) -> Json {
    serde_json::from_slice(&fs::read(folder.join("out/estimate.json")).unwrap()).unwrap()
}

/// What a command prints.
fn stdout(folder: &Path, args: &[&str]) -> String {
    String::from_utf8(run(folder, args, 0).stdout).unwrap()
}

#[test]
fn files_that_change_after_they_were_read_keep_the_hash_of_what_was_read() {
    let folder = logs();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("arm.toml"), "schema = 1\nurdf = \"arm.urdf\"\n").unwrap();
    let log = |name: &str, rows| LogConfig { path: at(name), rows, ..LogConfig::default() };
    let config = Config {
        robot: at("arm.toml"),
        // What lies behind the last row used is hashed as well.
        log: vec![log("train.csv", Some((1, 900)))],
        validation: vec![log("valid.csv", None)],
        ..Config::default()
    };
    let files = ["arm.toml", "arm.urdf", "train.csv", "valid.csv"];
    let before = files.map(|name| sha256(&fs::read(at(name)).unwrap()));
    let found = dynid::identify(&config, &mut |_| {}).unwrap();
    for name in files {
        fs::write(at(name), "something else").unwrap();
    }
    let inputs = found.estimate().provenance.inputs;
    let kinds: Vec<&str> = inputs.iter().map(|i| i.kind.word()).collect();
    assert_eq!(kinds, ["robot", "urdf", "log", "validation"]);
    let hashes: Vec<&String> = inputs.iter().map(|i| &i.sha256).collect();
    assert_eq!(hashes, before.iter().collect::<Vec<_>>());
}

#[test]
fn logs_with_columns_of_their_own_names_are_read_as_the_estimate_records() {
    let folder = logs();
    let folder = folder.path();
    let degree = 1f64.to_radians();
    let names = [
        ("q_shoulder", "first angle", 1.0 / degree),
        ("q_elbow", "second angle", 1.0 / degree),
        ("tau_shoulder", "first amps", 0.5),
        ("tau_elbow", "second amps", -0.25),
    ];
    renamed(folder, "train.csv", "train_own.csv", &names);
    renamed(folder, "valid.csv", "valid_own.csv", &names);
    renamed(folder, "clean.csv", "clean_own.csv", &names[..2]);
    let config = "robot = \"arm.urdf\"\nout = \"out\"\n[columns]\n\
                  position = { columns = [\"first angle\", \"second angle\"], unit = \"deg\" }\n\
                  effort = { columns = [\"first amps\", \"second amps\"], scale = [2.0, -4.0] }\n\
                  [[log]]\npath = \"train_own.csv\"\n";
    fs::write(folder.join("run.toml"), config).unwrap();
    run(folder, &["identify", "run.toml"], 0);
    let provenance = &estimate(folder)["provenance"];
    assert_eq!(provenance["reading"]["columns"]["effort"]["scale"], serde_json::json!([2.0, -4.0]));
    assert_eq!(provenance["command_line"][1], "identify");
    if let Some(revision) = provenance.get("revision") {
        assert_eq!(revision.as_str().unwrap().len(), 40, "{revision}");
    }

    let validate = ["validate", "out/estimate.json", "--log", "valid_own.csv", "--json"];
    let recorded = stdout(folder, &validate);
    assert_eq!(recorded, stdout(folder, &[&validate[..], &["--config", "run.toml"]].concat()));
    let error =
        |text: &str| serde_json::from_str::<Json>(text).unwrap()[0]["relative_error"].as_f64().unwrap();
    assert!(error(&recorded) < 5.0, "{recorded}");
    let given = stdout(folder, &[&validate[..], &["--gains", "4,-8"]].concat());
    assert!(error(&given) > 40.0, "gains that are given win: {given}");

    let output = dynid()
        .current_dir(folder)
        .args(["validate", "out/estimate.json", "--log", "valid.csv"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("by which the logs of out/estimate.json were read"), "{said}");
    assert!(said.contains("--config"), "{said}");

    let predict = |states: &str| stdout(folder, &["predict", "out/estimate.json", "--states", states]);
    let numbers = |text: String| -> Vec<f64> {
        text.lines()
            .skip(1)
            .flat_map(|l| l.split(',').map(|x| x.parse().unwrap()).collect::<Vec<_>>())
            .collect()
    };
    let (own, plain) = (numbers(predict("clean_own.csv")), numbers(predict("clean.csv")));
    assert_eq!(own.len(), plain.len());
    assert!(own.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 1e-9), "degrees and back");
}

#[test]
fn gains_of_currents_are_those_of_the_estimate_unless_given() {
    let folder = logs();
    let folder = folder.path();
    let names = [("tau_shoulder", "current_shoulder", 0.5), ("tau_elbow", "current_elbow", 0.25)];
    renamed(folder, "train.csv", "train_own.csv", &names);
    renamed(folder, "valid.csv", "valid_own.csv", &names);
    run(folder, &["identify", "arm.urdf", "--log", "train_own.csv", "--gains", "2,4", "--out", "out"], 0);
    let validate = ["validate", "out/estimate.json", "--log", "valid_own.csv", "--json"];
    let recorded = stdout(folder, &validate);
    assert_eq!(recorded, stdout(folder, &[&validate[..], &["--gains", "2,4"]].concat()));
    assert_ne!(recorded, stdout(folder, &[&validate[..], &["--gains", "2,8"]].concat()));
}
