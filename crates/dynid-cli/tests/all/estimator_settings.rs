//! Estimators, kinds of consistency and bounds: each does what its name says, and the estimate says which it was.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::sync::OnceLock;

use crate::support::{self, TWO_LINKS, run};
use serde_json::Value;
use tempfile::TempDir;

/// Masses of the two links of the robot, kg.
const MASSES: [(&str, f64); 2] = [("upper_arm", 3.0), ("forearm", 1.5)];

/// A folder with the robot, a noisy log, the true states and parameters.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("arm.urdf"), TWO_LINKS).unwrap();
            let log = ["simulate", "arm.urdf", "--duration", "20", "--rate-hz", "100", "--out", "log.csv"];
            let more = ["--effort-noise", "0.02", "--clean", "states.csv", "--truth", "truth.json"];
            run(folder.path(), &[&log[..], &more].concat(), 0);
            folder
        })
        .path()
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

fn read(name: &str) -> Value {
    json(&std::fs::read(folder().join(name)).unwrap())
}

/// `estimate.json` of a run by a configuration of this name with more lines, whatever its verdict. With the elements given
/// alone: that earlier versions knew, and the same for every estimator.
#[track_caller]
fn by_configuration(name: &str, more: &str, flags: &[&str]) -> Value {
    let file = format!("{name}.toml");
    let text = format!("robot = \"arm.urdf\"\nout = \"{name}\"\n[[log]]\npath = \"log.csv\"\n{more}");
    std::fs::write(folder().join(&file), text).unwrap();
    let output = support::dynid()
        .current_dir(folder())
        .args(["identify", &file, "--friction", "given"])
        .args(flags)
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{name}: {stderr}");
    assert!(folder().join(name).join("report.html").is_file(), "{name}");
    assert!(folder().join(name).join("arm.urdf").is_file(), "{name}");
    read(&format!("{name}/estimate.json"))
}

/// A column of numbers of a list of objects.
fn column(list: &Value, key: &str) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|p| p[key].as_f64().unwrap()).collect()
}

fn parameter(estimate: &Value, name: &str) -> f64 {
    let found = estimate["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name);
    found.unwrap()["value"].as_f64().unwrap()
}

fn active(estimate: &Value) -> Vec<&str> {
    let list = estimate["consistency"]["active"].as_array().unwrap();
    list.iter().map(|a| a.as_str().unwrap()).collect()
}

/// Efforts that an estimate predicts at the true states, joint by joint.
#[track_caller]
fn predicted(estimate: &str, flags: &[&str]) -> [Vec<f64>; 2] {
    let args = ["predict", estimate, "--states", "states.csv"];
    let stdout = run(folder(), &[&args[..], flags].concat(), 0).stdout;
    csv(&String::from_utf8(stdout).unwrap(), ["effort_shoulder", "effort_elbow"])
}

fn csv(text: &str, names: [&str; 2]) -> [Vec<f64>; 2] {
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    names.map(|name| {
        let at = header.iter().position(|n| *n == name).unwrap();
        text.lines().skip(1).map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
    })
}

/// Norm of the difference of two predictions over that of the second, joint by joint.
fn distance(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> [f64; 2] {
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
    std::array::from_fn(|j| {
        norm(&mut a[j].iter().zip(&b[j]).map(|(x, y)| x - y)) / norm(&mut b[j].iter().copied())
    })
}

/// Efforts of the simulated robot at the true states.
fn true_effort() -> [Vec<f64>; 2] {
    let text = std::fs::read_to_string(folder().join("states.csv")).unwrap();
    csv(&text, ["tau_shoulder", "tau_elbow"])
}

/// The run without any setting, in `free`.
fn free() -> &'static Value {
    static FREE: OnceLock<Value> = OnceLock::new();
    FREE.get_or_init(|| by_configuration("free", "", &[]))
}

#[test]
fn every_estimator_comes_near_the_truth_on_a_way_of_its_own() {
    const TLS: &str =
        "[estimator]\nmethod = \"tls\"\neffort_noise = 0.1\ncolumn_noise = { \"forearm.mz\" = 0.05 }\n";
    let truth = true_effort();
    let mut others: Vec<(&str, Vec<f64>)> = Vec::new();
    for method in ["ols", "wls", "huber", "tukey", "ridge", "tls"] {
        // Total least squares needs noise that only a configuration can state.
        let (more, flags) = match method {
            "tls" => (TLS, Vec::new()),
            _ => ("", vec!["--estimator", method]),
        };
        let estimate = by_configuration(&format!("by_{method}"), more, &flags);
        assert_eq!(estimate["provenance"]["settings"]["estimator"]["method"], method);
        let error = distance(&predicted(&format!("by_{method}/estimate.json"), &[]), &truth);
        assert!(error.iter().all(|e| *e < 0.02), "{method}: {error:?}");
        let values = column(&estimate["base_parameters"], "value");
        for (other, seen) in &others {
            assert_ne!(&values, seen, "{method} and {other}");
        }
        others.push((method, values));
    }
}

#[test]
fn every_kind_of_consistency_is_recorded_and_keeps_its_promise() {
    let none = by_configuration("none", "", &["--consistency", "none"]);
    assert!(none["consistency"].is_null());
    assert_eq!(none["provenance"]["settings"]["estimator"]["consistency"], "none");
    let parameters = &none["parameters"];
    assert_eq!(column(parameters, "value"), column(parameters, "unconstrained"));

    for form in ["pseudo-inertia", "spatial-inertia"] {
        let estimate = by_configuration(form, "", &["--consistency", form]);
        assert_eq!(estimate["consistency"]["form"], form);
        assert_eq!(estimate["provenance"]["settings"]["estimator"]["consistency"], form);
        assert!(MASSES.iter().all(|(link, _)| parameter(&estimate, &format!("{link}.m")) > 0.0));
        // What data see is the same whatever the kind.
        let (ours, free) = (&estimate["base_parameters"], &none["base_parameters"]);
        assert_eq!(column(ours, "value"), column(free, "value"), "{form}");
    }
    let [entropic, quadratic] = ["entropic", "quadratic"].map(|prior| {
        let estimate = by_configuration(prior, &format!("[estimator]\nprior = \"{prior}\"\n"), &[]);
        assert_eq!(estimate["provenance"]["settings"]["estimator"]["prior"], prior);
        assert_eq!(estimate["consistency"]["prior"], prior);
        assert_eq!(estimate["feasible"], true);
        estimate
    });
    let [one, other] = [&entropic, &quadratic].map(|estimate| column(&estimate["parameters"], "value"));
    assert_ne!(one, other);
    // Nothing stated: that of the two with the least error on held-out folds, to the bit.
    let least = |estimate: &Value| {
        let trials = estimate["consistency"]["prior_trials"].as_array().unwrap();
        trials.iter().map(|t| t["loss"].as_f64().unwrap()).fold(f64::INFINITY, f64::min)
    };
    let better = if least(&entropic) < least(&quadratic) { &entropic } else { &quadratic };
    let chosen = read("pseudo-inertia/estimate.json");
    assert_eq!(chosen["consistency"]["prior"], better["consistency"]["prior"]);
    assert_eq!(column(&chosen["parameters"], "value"), column(&better["parameters"], "value"));
    // One body for all links is a placeholder, which no distance of bodies is from.
    let inertials: Vec<&str> =
        TWO_LINKS.split("<inertial>").skip(1).filter_map(|s| s.split("</inertial>").next()).collect();
    std::fs::write(folder().join("alike.urdf"), TWO_LINKS.replace(inertials[1], inertials[0])).unwrap();
    let text = "robot = \"alike.urdf\"\n[[log]]\npath = \"log.csv\"\n";
    std::fs::write(folder().join("alike.toml"), text).unwrap();
    let output =
        support::dynid().current_dir(folder()).args(["identify", "alike.toml", "--out", "alike"]).output();
    assert!(matches!(output.unwrap().status.code(), Some(0 | 1)));
    let placeholders = read("alike/estimate.json");
    let trials = placeholders["consistency"]["prior_trials"].as_array().unwrap();
    assert!(!trials.is_empty() && trials.iter().all(|t| t["prior"] == "quadratic"), "{trials:?}");
}

#[test]
fn bounds_hold_and_are_named_where_they_act() {
    let estimate = by_configuration(
        "bounded",
        "[[bound]]\nlinks = [\"forearm\"]\nmass = [2.0, 2.2]\n\
         [[bound]]\nlinks = [\"upper_arm\", \"forearm\"]\nmass = [-inf, 4.0]\n\
         [[bound]]\nlinks = [\"forearm\"]\ncom_z = [0.0, 0.12]\n",
        &[],
    );
    let [upper_arm, forearm] = MASSES.map(|(link, _)| parameter(&estimate, &format!("{link}.m")));
    // Active bounds hold up to rounding.
    let slack = 1e-6;
    assert!((2.0 - slack..=2.2 + slack).contains(&forearm), "{forearm}");
    assert!(upper_arm + forearm <= 4.0 + slack, "{upper_arm} {forearm}");
    let com = parameter(&estimate, "forearm.mz") / forearm;
    assert!((-slack..=0.12 + slack).contains(&com), "{com}");
    assert_eq!(estimate["provenance"]["settings"]["bound"].as_array().unwrap().len(), 3);
    assert!(
        MASSES.iter().all(|(link, mass)| (parameter(free(), &format!("{link}.m")) / mass - 1.0).abs() < 0.1)
    );
    assert!(
        active(&estimate).iter().any(|a| a.contains("total mass of `upper_arm`, `forearm` ≤ 4 kg")),
        "{:?}",
        active(&estimate)
    );
}

#[test]
fn parameters_without_constraints_predict_otherwise_only_where_a_constraint_acts() {
    let estimate = free();
    // What holds the estimate back here is no more than a split that the data hardly see.
    assert!(estimate["consistency"]["price"].as_f64().unwrap() < 1e-3);
    let apart = distance(
        &predicted("free/estimate.json", &["--unconstrained"]),
        &predicted("free/estimate.json", &[]),
    );
    assert!(apart.iter().all(|d| *d < 1e-4), "{apart:?}");

    let truth = read("truth.json");
    let friction = truth["elbow.fc"].as_f64().unwrap();
    let bound = format!("[[bound]]\nparameter = \"elbow.fc\"\nrange = [{}, inf]\n", 3.0 * friction);
    let estimate = by_configuration("rough", &bound, &[]);
    assert!((parameter(&estimate, "elbow.fc") / (3.0 * friction) - 1.0).abs() < 1e-4);
    assert!(active(&estimate).iter().any(|a| a.contains("`elbow.fc` ≥")), "{:?}", active(&estimate));
    let without = predicted("rough/estimate.json", &["--unconstrained"]);
    assert_eq!(without, predicted("free/estimate.json", &["--unconstrained"]));
    let held = distance(&predicted("rough/estimate.json", &[]), &without);
    assert!(held[1] > 0.05, "{held:?}");
    assert!(held[0] < 0.1 * held[1], "{held:?}");
    // The same with `--consistency none`: nothing acts, nothing differs.
    by_configuration("loose", "", &["--consistency", "none"]);
    assert_eq!(predicted("loose/estimate.json", &["--unconstrained"]), predicted("loose/estimate.json", &[]));
}

/// An estimate as the first version of the program wrote it: without keys that came later.
fn earlier(estimate: &Value) -> Value {
    const OF_ESTIMATE: [&str; 5] =
        ["consistency", "held_out", "precision", "pruning", "motions_that_would_help"];
    const OF_PARAMETER: [&str; 9] = [
        "unconstrained",
        "interval",
        "wide",
        "at_boundary",
        "reason",
        "share",
        "possible_share",
        "combination",
        "advice",
    ];
    const OF_BASE: [&str; 4] = ["consistent_value", "half_width", "verdict", "share"];
    let mut out = estimate.clone();
    let drop = |object: &mut Value, keys: &[&str]| {
        for key in keys {
            object.as_object_mut().unwrap().remove(*key).unwrap();
        }
    };
    drop(&mut out, &OF_ESTIMATE);
    for (list, keys) in [("parameters", &OF_PARAMETER[..]), ("base_parameters", &OF_BASE)] {
        for object in out[list].as_array_mut().unwrap() {
            drop(object, keys);
        }
    }
    out
}

#[test]
fn an_estimate_of_an_earlier_version_predicts_validates_and_exports() {
    let estimate = free();
    std::fs::write(folder().join("earlier.json"), earlier(estimate).to_string()).unwrap();
    let now = predicted("free/estimate.json", &[]);
    assert_eq!(predicted("earlier.json", &[]), now);
    // It knows one set of parameters only.
    assert_eq!(predicted("earlier.json", &["--unconstrained"]), now);
    let validate =
        |file: &str| json(&run(folder(), &["validate", file, "--log", "log.csv", "--json"], 0).stdout);
    assert_eq!(validate("earlier.json"), validate("free/estimate.json"));
    for (file, to) in [("earlier.json", "earlier.urdf"), ("free/estimate.json", "now.urdf")] {
        run(folder(), &["export", file, "--robot", "arm.urdf", "--urdf", to], 0);
    }
    let text = |name: &str| std::fs::read_to_string(folder().join(name)).unwrap();
    assert_eq!(text("earlier.urdf"), text("now.urdf"));
}

#[test]
fn an_estimator_that_does_not_exist_is_refused_with_those_that_do() {
    for (flag, value, known) in [
        ("--estimator", "lasso", ["ols", "wls", "huber", "tukey", "ridge"].as_slice()),
        ("--consistency", "spatial", &["pseudo-inertia", "spatial-inertia", "none"]),
    ] {
        let args = ["identify", "arm.urdf", "--log", "log.csv", "--out", "never", flag, value];
        let output = run(folder(), &args, 2);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.starts_with("error: ") && stderr.contains(value) && stderr.contains(flag), "{stderr}");
        assert!(known.iter().all(|k| stderr.contains(k)), "{stderr}");
        assert!(output.stdout.is_empty() && !folder().join("never").exists());
    }
}
