//! What could be misread is refused, with the line that decides.

use super::arm::arm;
use super::refused;

const CHECK: [&str; 4] = ["check", "log.csv", "--robot", "robot.urdf"];
const HEADER: &str = "t,q1,q2,tau1,tau2";

fn log(header: &str, mut row: impl FnMut(f64, f64) -> String) -> String {
    arm().rows(header, |k, t| row(t, arm().q[0][k]))
}

#[test]
fn commas_that_may_set_thousands_apart() {
    let text = log("t;q1;q2;tau1;tau2", |_, _| "1,000;1,234;2,345;3,456;4,567".to_owned());
    refused(&text, &CHECK, &["`1,000`", "thousands"], "decimal = \",\"");
    let text = log("t;q1;q2;tau1;tau2", |t, _| format!("{t};0,5;1,5;2,5;3,5"));
    refused(&text, &CHECK, &["one decimal mark", "`0,5`"], "ignore = [\"..\"]");
    let text = log("t;q1;q2;tau1;tau2", |_, _| "0;1.234,5;1;2;3".to_owned());
    refused(&text, &CHECK, &["thousands", "`1.234,5`"], "without marks");
}

#[test]
fn times_whose_unit_is_open_or_absurd() {
    // A slow joint, ten rows in a unit of time: 10 Hz in s or 10 kHz in ms.
    let slow = |scale: f64| log(HEADER, |t, q| format!("{},{},{},1,2", scale * 10.0 * t, 1e-3 * q, 2e-3 * q));
    refused(
        &slow(1.0),
        &CHECK,
        &["steps of 0.1", "10.0000 Hz in s"],
        "time = { columns = \"t\", unit = \"s\" }",
    );
    // Nanoseconds that are said to be seconds.
    let named = log("t[s],q1,q2,tau1,tau2", |t, q| format!("{:.0},{q},{q},1,2", 1e9 * t));
    refused(&named, &CHECK, &["expected steps of a sampled log", "10000000 s"], "unit = \"ns\"");
}

#[test]
fn columns_that_may_be_either() {
    let header = "__time,/a/shoulder/position,/b/shoulder/position,/a/elbow/position,/a/shoulder/effort,/a/elbow/effort";
    let text = log(header, |t, q| format!("{t},{q},{q},{q},1,2"));
    refused(
        &text,
        &CHECK,
        &["position of `shoulder`", "/b/shoulder/position"],
        "\"shoulder\" = \"/a/shoulder/position\"",
    );
    let text = log("t,q0,q1,q2,tau0,tau1", |t, q| format!("{t},{q},{q},{q},1,2"));
    refused(&text, &CHECK, &["expected 2", "`q2`"], "[columns]");
    let text = log("t,positions,torques", |t, q| format!("{t},\"[{q}, {q}, {q}]\",\"[1, 2, 3]\""));
    refused(&text, &CHECK, &["expected 2", "`positions[2]`"], "[columns]");
}

#[test]
fn lists_and_messages_that_change() {
    let mut row = 0;
    let text = log("t,positions,torques", |t, q| {
        row += 1;
        if row == 100 {
            format!("{t},\"[{q}]\",\"[1, 2]\"")
        } else {
            format!("{t},\"[{q}, {q}]\",\"[1, 2]\"")
        }
    });
    refused(&text, &CHECK, &["row 100", "`positions`", "2 numbers", "found 1"], "leave_out");
    let header = "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1,field.effort0,field.effort1";
    let mut row = 0;
    let text = log(header, |t, q| {
        row += 1;
        let names = if row == 100 { "shoulder,elbow" } else { "elbow,shoulder" };
        let stamp = super::arm::nanoseconds(t);
        format!("{stamp},{stamp},{names},{q},{q},1,2")
    });
    refused(&text, &CHECK, &["row 100", "`field.name0`", "`elbow`", "`shoulder`"], "one publisher");
}

#[test]
fn keys_of_columns_that_do_not_fit() {
    let text = log(HEADER, |t, q| format!("{t},{q},{q},1,2"));
    let cases: [(&str, &[&str], &str); 9] = [
        ("ignore = [\"mode\"]", &["`mode`", "ignored"], "header"),
        ("names = [\"a\", \"b\"]", &["names", "without a header"], "leave `names` out"),
        ("decimal = \";\"", &["`;`", "`,`"], ""),
        ("missing = \"guess\"", &["`guess`", "`drop`"], ""),
        ("time = \"stamp\"", &["time", "`stamp`"], "header"),
        ("time = \"q\"", &["time", "`q`"], "`q1`, `q2`"),
        ("position = \"joint{}\"", &["position", "`joint1`"], ""),
        ("time = [\"t\", \"q1\"]", &["unit", "added up"], "scale = [1.0, 1e-9]"),
        ("effort = [\"tau1\", \"tau2\"]\nignore = [\"tau2\"]", &["effort", "`tau2`"], "`tau1`"),
    ];
    for (lines, parts, hint) in cases {
        let folder = super::folder(&text);
        let config = format!("robot = \"robot.urdf\"\n[columns]\n{lines}\n[[log]]\npath = \"log.csv\"\n");
        std::fs::write(folder.path().join("run.toml"), config).unwrap();
        let output = crate::support::run(folder.path(), &["check", "run.toml"], 2);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        for part in parts.iter().chain([&hint]) {
            assert!(said.contains(part), "{lines}: `{part}`: {said}");
        }
    }
}
