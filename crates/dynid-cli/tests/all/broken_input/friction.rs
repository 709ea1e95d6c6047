//! Friction laws, their settings, their shape parameters in estimates, and studies.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::sync::OnceLock;

use super::harness::{Case, case, check, config, sound};
use crate::support::{TWO_LINKS, dynid, run};

/// A robot of one joint with settings of its elements.
fn robot(elements: &str, settings: &str) -> String {
    format!(
        "schema = 1\nname = \"one\"\ndh = \"modified\"\n[[joint]]\nname = \"j1\"\nd = 0.3\nmass = 1.0\n\
         limits = {{ velocity = 4.0 }}\n[element.j1]\nelements = {elements}\n{settings}\n"
    )
}

#[test]
fn laws_and_settings_are_refused() {
    let inspect = |elements: &str, settings: &str, message: &'static [&'static str]| -> Case {
        case("bad.toml", robot(elements, settings), "inspect bad.toml", message, "")
    };
    let arctangent =
        |settings: &str, message| inspect("[\"arctangent\"]", &format!("arctangent = {settings}"), message);
    let stribeck =
        |settings: &str, message| inspect("[\"stribeck\"]", &format!("stribeck = {settings}"), message);
    check(&[
        case(
            "bad.toml",
            config("[elements]\nfriction = \"columb\"\n"),
            "identify bad.toml",
            &["bad.toml:", "`columb`", "`stribeck`"],
            "",
        ),
        case("bad.toml", config("[elements]\nfriction = 3\n"), "identify bad.toml", &["bad.toml:"], ""),
        case(
            "bad.toml",
            config("[elements.joint]\nelbow = [\"coulomb\", \"stribeck\"]\n"),
            "identify bad.toml",
            &["`elbow`", "`coulomb`", "`stribeck`"],
            "coulomb",
        ),
        case(
            "bad.toml",
            config("[elements]\ndefault = [\"viscous\", \"tanh\", \"tanh\"]\n"),
            "identify bad.toml",
            &["`tanh`", "twice"],
            "tanh",
        ),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --out out --elements offset,asymmetric",
            &["`offset`", "`asymmetric`"],
            "offset",
        ),
        inspect("[\"asymmetric\", \"viscous\"]", "", &["`viscous`", "`asymmetric`", "`j1`"]),
        arctangent("{ fb = { start = 7, lower = 10, upper = 20 } }", &["`fb`", "10", "20", "found 7"]),
        arctangent("{ fb = { lower = 20, upper = 10 } }", &["`arctangent`", "`j1`", "`fb`", "20", "10"]),
        arctangent("{ fb = -3 }", &["`fb`", "above 0", "-3"]),
        arctangent("{ fb = { lower = -1 } }", &["`fb`", "above 0", "-1"]),
        arctangent("{ fb = nan }", &["bad.toml:9", "arctangent.fb", "finite", "nan"]),
        arctangent("{ fb = { upper = inf } }", &["arctangent.fb.upper", "finite", "inf"]),
        arctangent("{ vs = 0.1 }", &["`arctangent`", "`fb`", "found `vs`"]),
        arctangent("{ fb = { begin = 7 } }", &["found `fb.begin`"]),
        arctangent("{ fb = \"steep\" }", &["`fb`", "a number", "\"steep\""]),
        arctangent("{ fb = { held = 3 } }", &["`fb.held`", "true or false", "3"]),
        arctangent("{ effort = \"much\" }", &["`effort`", "a number", "\"much\""]),
        arctangent("{ effort = nan }", &["arctangent.effort", "finite", "nan"]),
        stribeck("{ speed = -1 }", &["`speed`", "above 0", "-1"]),
        stribeck("{ speed = inf }", &["stribeck.speed", "finite", "inf"]),
        stribeck("{ delta = 0 }", &["`delta`", "above 0", "0"]),
        stribeck("3", &["`stribeck` of joint `j1`", "a table with", "`vs`", "found 3"]),
        case(
            "bad.toml",
            "values = { \"elbow.vs\" = 0.1 }\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["elbow.vs", "values"],
            "",
        ),
        case(
            "bad.toml",
            robot("[\"load\"]", ""),
            "simulate bad.toml --closed-loop --out a.csv",
            &["`load`", "accelerations", "inverse dynamics"],
            "",
        ),
        case("other", "", "study nonsense", &["`nonsense`", "er16"], "study list"),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --out out --friction tanh --search nonsense",
            &["search", "nonsense"],
            "",
        ),
    ]);
}

#[test]
fn wrong_values_of_flags_are_usage() {
    let folder = tempfile::tempdir().unwrap();
    for (args, parts) in [
        ("identify robot.urdf --log log.csv --friction columb", ["'columb'", "--friction", "sigmoid_offset"]),
        ("study er16 --seed some", ["'some'", "--seed", "digit"]),
    ] {
        let args: Vec<&str> = args.split(' ').collect();
        let message = String::from_utf8(run(folder.path(), &args, 2).stderr).unwrap();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// `estimate.json` of the two links with tanh friction.
fn estimate() -> &'static str {
    static ESTIMATE: OnceLock<String> = OnceLock::new();
    ESTIMATE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("robot.urdf"), TWO_LINKS).unwrap();
        std::fs::write(folder.path().join("log.csv"), &sound().log).unwrap();
        let args = ["identify", "robot.urdf", "--log", "log.csv", "--friction", "tanh", "--out", "out"];
        let _ = dynid().current_dir(folder.path()).args(args).output().unwrap();
        std::fs::read_to_string(folder.path().join("out/estimate.json")).unwrap()
    })
}

#[test]
fn estimates_with_broken_shape_parameters_are_refused() {
    let changed = |change: &dyn Fn(&mut Vec<serde_json::Value>)| {
        let mut whole: serde_json::Value = serde_json::from_str(estimate()).unwrap();
        change(whole["shape_parameters"].as_array_mut().unwrap());
        whole.to_string()
    };
    let predict = "predict bad.json --states states.csv --out effort.csv";
    let validate = "validate bad.json --log log.csv";
    let export = "export bad.json --robot robot.urdf --model robot.json";
    let missing = changed(&|list| drop(list.pop()));
    let none = changed(&Vec::clear);
    let extra = changed(&|list| list.push(list[0].clone()));
    let swapped = changed(&|list| list.swap(0, 1));
    let low = changed(&|list| list[0]["value"] = (-1.0).into());
    let huge = changed(&|list| list[1]["value"] = 1e9.into());
    let null = changed(&|list| list[0]["value"] = serde_json::Value::Null);
    let free = changed(&|list| list[0]["unconstrained"] = 1e9.into());
    let not_a_number = estimate().replacen("\"range\": [", "\"value\": NaN, \"range\": [", 1);
    check(&[
        case(
            "bad.json",
            missing.clone(),
            predict,
            &["bad.json", "shape", "`elbow.w`", "found `shoulder.w`"],
            "",
        ),
        case("bad.json", missing, validate, &["bad.json", "shape", "`elbow.w`"], ""),
        case("bad.json", none, predict, &["bad.json", "shape", "`elbow.w`", "found none"], ""),
        case("bad.json", extra, predict, &["bad.json", "shape", "`elbow.w`"], ""),
        case("bad.json", swapped, predict, &["bad.json", "shape", "`elbow.w`"], ""),
        case("bad.json", low.clone(), predict, &["bad.json", "`shoulder.w`", "found -1"], ""),
        case("bad.json", low, export, &["bad.json", "`shoulder.w`", "found -1"], ""),
        case("bad.json", huge, validate, &["bad.json", "`elbow.w`", "1000000000"], ""),
        case("bad.json", null, predict, &["bad.json", "not an estimate"], ""),
        case(
            "bad.json",
            free,
            "predict bad.json --unconstrained --states states.csv --out effort.csv",
            &["bad.json", "`shoulder.w`", "1000000000"],
            "",
        ),
        case("bad.json", not_a_number, predict, &["bad.json", "not an estimate"], ""),
    ]);
}
