//! Nonlinear friction from a simulated log to the files that leave the program: every law is found, recorded, read back and
//! exported, and what a log does not show is not made up.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::PathBuf;

use dynid::Run;
use dynid::estimate::{Estimate, ShapeValue, Split};
use dynid::export::{CheckStates, RobotExport, RobotJson, Source, json};
use dynid::io::csv;
use dynid::predict::efforts;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::validate::{log_fit, validate};
use dynid::{Config, Robot, RobotOptions, identify};
use tempfile::TempDir;

const ARM: &str = r#"schema = 1
name = "arm"
dh = "modified"
[[joint]]
name = "j1"
alpha = "-90deg"
d = 0.3
limits = { position = [-2.0, 2.0], velocity = 3.0, effort = 100.0 }
phi = [3.0, 0.6, 0.03, 0.0, 0.06, -0.006, 0.0, 0.17, 0.0, 0.18]
[[joint]]
name = "j2"
a = 0.35
limits = { position = [-2.0, 2.0], velocity = 3.0, effort = 100.0 }
phi = [1.5, 0.225, 0.01, 0.0, 0.03, -0.0015, 0.0, 0.06, 0.0, 0.06]
"#;

/// A law: its name in configurations, elements of the true robot, their settings.
struct Law {
    name: &'static str,
    elements: &'static str,
    settings: &'static [&'static str],
}

const VISCOUS: &str = "viscous = { coefficient = 1.2 }\noffset = { effort = 0.4 }";

const LAWS: [Law; 6] = [
    Law {
        name: "arctangent",
        elements: r#"["coulomb", "viscous", "offset", "arctangent"]"#,
        settings: &["coulomb = { effort = 2.0 }", VISCOUS, "arctangent = { effort = 3.0, fb = 6.0 }"],
    },
    Law {
        name: "stribeck",
        elements: r#"["stribeck", "viscous", "offset"]"#,
        settings: &["stribeck = { coulomb = 2.0, static = 3.5, vs = 0.25 }", VISCOUS],
    },
    Law {
        name: "tanh",
        elements: r#"["tanh", "viscous", "offset"]"#,
        settings: &["tanh = { effort = 3.0, w = 0.15 }", VISCOUS],
    },
    Law {
        name: "sigmoid",
        elements: r#"["sigmoid", "viscous", "offset"]"#,
        settings: &["sigmoid = { effort = 6.0, phi2 = 12.0, phi3 = 0.05 }", VISCOUS],
    },
    Law {
        name: "sigmoid_offset",
        elements: r#"["sigmoid_offset", "viscous", "offset"]"#,
        settings: &["sigmoid_offset = { effort = 6.0, alpha = 12.0, nu = 0.05 }", VISCOUS],
    },
    Law {
        name: "power",
        elements: r#"["coulomb", "power", "offset"]"#,
        settings: &[
            "coulomb = { effort = 2.0 }",
            "power = { coefficient = 2.0, p = 0.6 }",
            "offset = { effort = 0.4 }",
        ],
    },
];

/// A folder with the robot as the user knows it, its logs and results.
struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Bench(tempfile::tempdir().unwrap());
        std::fs::write(bench.path("arm.toml"), ARM).unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Simulates a log of the arm with given elements at both joints.
    fn log(&self, name: &str, elements: &str, settings: &str, simulation: &str) -> SimulatedLog {
        let both = ["j1", "j2"].map(|joint| format!("[element.{joint}]\n{settings}\n")).concat();
        let path = self.path("truth.toml");
        std::fs::write(&path, format!("{ARM}[defaults]\nelements = {elements}\n{both}")).unwrap();
        let robot = Robot::load(&path, &RobotOptions::default()).unwrap();
        let settings = SimulateSettings::parse(simulation, "simulation").unwrap();
        let log = simulate(&robot, &settings).unwrap();
        let mut header = vec!["t".to_owned()];
        let mut columns: Vec<&[f64]> = vec![&log.time];
        for (prefix, signals) in [("q", &log.position), ("tau", &log.effort)] {
            header.extend(log.joints.iter().map(|j| format!("{prefix}_{j}")));
            columns.extend(signals.iter().map(Vec::as_slice));
        }
        csv::write(self.path(name), &header, &columns).unwrap();
        log
    }

    /// Identifies from `log.csv`; `more`: further lines of the configuration.
    fn identify(&self, more: &str) -> (Run, Estimate) {
        let text = format!("robot = \"arm.toml\"\n{more}\n[[log]]\npath = \"log.csv\"\n");
        let path = self.path("run.toml");
        std::fs::write(&path, text).unwrap();
        let config = Config::read(&path).unwrap();
        let found = identify(&config, &mut |_| {}).unwrap();
        let estimate = found.estimate();
        std::fs::write(self.path("estimate.json"), estimate.to_json()).unwrap();
        let read = Estimate::read(&self.path("estimate.json")).unwrap();
        assert_eq!(read.to_json(), estimate.to_json(), "an estimate survives its file");
        (found, read)
    }
}

fn truth(log: &SimulatedLog, name: &str) -> f64 {
    log.truth.iter().find(|(n, _)| n == name).unwrap().1
}

/// What is read from `estimate.json` predicts what was identified, for both splits.
fn same_predictions(bench: &Bench, found: &Run, read: &Estimate) {
    let file = bench.path("estimate.json");
    let config = dynid::config::LogConfig { path: bench.path("log.csv"), ..Default::default() };
    for (split, values) in
        [(Split::Consistent, found.values()), (Split::Unconstrained, found.unconstrained_values())]
    {
        let logs = std::slice::from_ref(&config);
        let again = validate(read, split, &file, logs, &Default::default(), None, None).unwrap();
        let own = log_fit(&found.agreement(values, &found.logs[0]).unwrap());
        let again = log_fit(&again.agreements[0]);
        for (a, b) in own.raw.rms.iter().zip(&again.raw.rms) {
            assert!(
                (a.unwrap() - b.unwrap()).abs() <= 1e-12 * a.unwrap(),
                "{split:?}: {a:?}, read back {b:?}"
            );
        }
    }
}

/// Every value of the JSON export is that of the estimate, and URDF and MJCF say what stands for the friction.
fn exports(bench: &Bench, read: &Estimate) {
    let file = bench.path("estimate.json");
    let robot = dynid::export::IdentifiedRobot::of(read, &file).unwrap();
    let states = CheckStates::random(robot.identified().model);
    let text = json(&robot.identified(), &states).unwrap().text;
    let stated: RobotJson = serde_json::from_str(&text).unwrap();
    let shape: Vec<(&str, f64)> = stated.shape.iter().map(|s| (s.name.as_str(), s.value)).collect();
    let expected: Vec<(&str, f64)> =
        read.shape_parameters.iter().map(|s| (s.name.as_str(), s.value)).collect();
    assert_eq!(shape, expected);
    let source = Source::read(&bench.path("arm.toml")).unwrap();
    let export = RobotExport::new(robot.identified(), &source).unwrap();
    for exported in [export.urdf(&states).unwrap(), export.mjcf(&states).unwrap()] {
        let notes = exported.notes.join("\n");
        for joint in ["j1", "j2"] {
            let said = format!("friction of `{joint}` has a form that");
            assert!(notes.contains(&said), "{notes}");
        }
    }
}

#[test]
fn every_law_is_found_recorded_and_exported() {
    for Law { name, elements, settings } in LAWS {
        let bench = Bench::new();
        let log = bench.log("log.csv", elements, &settings.join("\n"), "rate_hz = 250\nseed = 3");
        let (found, read) = bench.identify(&format!("[elements]\nfriction = \"{name}\""));
        assert!(!read.shape_parameters.is_empty());
        for ShapeValue { name, value, interval, std, verdict, .. } in &read.shape_parameters {
            let (low, high) = interval.unwrap();
            let truth = truth(&log, name);
            assert_eq!(verdict.word(), "seen in the data", "{name}");
            assert!(low <= *value && *value <= high, "{name} = {value} in {low} to {high}");
            // Four standard deviations: a dozen parameters are looked at.
            assert!((value - truth).abs() <= 4.0 * std.unwrap(), "{name} = {value}, truly {truth} ({std:?})");
            assert!(high - low < 0.8 * truth.max(0.05), "{name}: {low} to {high} says little");
        }
        same_predictions(&bench, &found, &read);
        exports(&bench, &read);
        // On states that are known exactly.
        let states = dynid::io::States {
            rows: log.time.len(),
            position: log.clean[0].clone(),
            velocity: log.clean[1].clone(),
            acceleration: log.clean[2].clone(),
            gravity: None,
            channels: Vec::new(),
            time: None,
        };
        let model = read.effort_model(&bench.path("estimate.json"), Split::Consistent).unwrap();
        let predicted = efforts(&model, &read.values(Split::Consistent), &states).unwrap();
        for (p, clean) in predicted.iter().zip(&log.clean[3]) {
            let square = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>();
            let error = square(&mut p.iter().zip(clean).map(|(p, c)| p - c));
            let share = (error / square(&mut clean.iter().copied())).sqrt();
            assert!(share < 0.02, "{name}: {:.2} % off the true effort", 100.0 * share);
        }
    }
}

#[test]
fn friction_of_the_load_survives_its_files() {
    let bench = Bench::new();
    let settings =
        "coulomb = { effort = 1.0 }\nviscous = { coefficient = 1.2 }\nload = { coefficient = 0.15 }";
    let log = bench.log(
        "log.csv",
        r#"["coulomb", "viscous", "offset", "load"]"#,
        settings,
        "rate_hz = 250\nseed = 3",
    );
    let (found, read) = bench.identify("[elements]\nfriction = \"auto\"");
    let mu: Vec<_> = read.parameters.iter().filter(|p| p.name.ends_with(".mu")).collect();
    assert_eq!(mu.len(), 2, "both joints get friction of the load");
    for p in mu {
        assert!((p.value / truth(&log, &p.name) - 1.0).abs() < 0.1, "{} = {}", p.name, p.value);
    }
    same_predictions(&bench, &found, &read);
    exports(&bench, &read);
    // The JSON says what the load is of.
    let robot = dynid::export::IdentifiedRobot::of(&read, &bench.path("estimate.json")).unwrap();
    let identified = robot.identified();
    let text = json(&identified, &CheckStates::random(identified.model)).unwrap().text;
    let stated: RobotJson = serde_json::from_str(&text).unwrap();
    let reference: Vec<f64> = stated.links.iter().flat_map(|l| l.load_reference.unwrap()).collect();
    assert_eq!(Some(reference), read.model.load_reference);
}

#[test]
fn what_the_log_does_not_show_is_held_and_named() {
    let bench = Bench::new();
    // Without any Stribeck effect, its speed means nothing.
    bench.log(
        "log.csv",
        r#"["coulomb", "viscous", "offset"]"#,
        "coulomb = { effort = 3.0 }\nviscous = { coefficient = 1.2 }",
        "rate_hz = 250\nseed = 3",
    );
    let (found, read) = bench.identify("[elements]\nfriction = \"stribeck\"");
    let unseen: Vec<&ShapeValue> =
        read.shape_parameters.iter().filter(|s| s.verdict.word() == "not seen").collect();
    assert!(!unseen.is_empty(), "{:?}", read.shape_parameters);
    for s in unseen {
        let (lower, upper) = s.range;
        let start = (lower * upper).sqrt();
        assert!((s.value / start - 1.0).abs() < 1e-12, "{} = {} is not its start {start}", s.name, s.value);
        assert_eq!((s.unconstrained, s.std, s.interval), (Some(s.value), None, None));
        assert!(s.reason.as_ref().unwrap().contains("held at its start"));
    }
    same_predictions(&bench, &found, &read);
}

#[test]
fn shape_at_a_bound_names_the_neighbouring_law() {
    let bench = Bench::new();
    // Friction that rises within 0.5 mrad/s is Coulomb friction to a tanh.
    bench.log(
        "log.csv",
        r#"["coulomb", "viscous", "offset"]"#,
        "coulomb = { effort = 3.0 }\nviscous = { coefficient = 1.2 }",
        "rate_hz = 250\nseed = 3",
    );
    let (found, read) = bench.identify("[elements]\nfriction = \"tanh\"");
    for s in &read.shape_parameters {
        assert_eq!(s.verdict.word(), "bounded on one side", "{s:?}");
        assert_eq!(s.std, None);
        let (low, high) = s.interval.unwrap();
        assert!(low <= s.value && s.value <= high && low == s.range.0 && high < s.range.1, "{s:?}");
    }
    let at_bound: Vec<&ShapeValue> = read.shape_parameters.iter().filter(|s| s.value == s.range.0).collect();
    for s in at_bound {
        assert!(s.reason.as_ref().unwrap().contains("Coulomb"), "{s:?}");
    }
    same_predictions(&bench, &found, &read);
}

#[test]
fn textbook_route_locked_joints_and_several_logs() {
    let bench = Bench::new();
    let Law { elements, settings, .. } = &LAWS[1];
    let log = bench.log("log.csv", elements, &settings.join("\n"), "rate_hz = 250\nseed = 3");
    let (found, read) =
        bench.identify("[elements]\nfriction = \"stribeck\"\n[conditioning]\nroute = \"textbook\"");
    for s in &read.shape_parameters {
        assert_eq!((s.verdict.word(), s.std, s.interval), ("given", None, None));
        assert!(s.reason.as_ref().unwrap().contains("textbook route does not search it"), "{s:?}");
    }
    same_predictions(&bench, &found, &read);

    // Both joints under the same law on two logs: more evidence, narrower intervals.
    let (_, one) = bench.identify("[elements]\nfriction = \"stribeck\"");
    bench.log("second.csv", elements, &settings.join("\n"), "rate_hz = 250\nseed = 4");
    let (found, two) = bench.identify("[elements]\nfriction = \"stribeck\"\n[[log]]\npath = \"second.csv\"");
    for (one, two) in one.shape_parameters.iter().zip(&two.shape_parameters) {
        let truth = truth(&log, &two.name);
        assert!((two.value - truth).abs() <= 4.0 * two.std.unwrap(), "{two:?}");
        let width = |s: &ShapeValue| s.interval.unwrap().1 - s.interval.unwrap().0;
        assert!(width(two) < width(one), "{two:?} with two logs, {one:?} with one");
    }
    assert_eq!(found.logs.len(), 2);

    // A held joint has no friction to find.
    let still = "rate_hz = 250\nseed = 3\nperiod_s = 5\n[trajectory.j2]\noffset = 0.5\n\
                 [trajectory.j1]\nsine = [0.5, 0.3]\ncosine = [0.2, -0.4]";
    let log = bench.log("log.csv", elements, &settings.join("\n"), still);
    let (found, held) = bench.identify("[elements]\nfriction = \"stribeck\"\n[locked]\nj2 = 0.5");
    assert_eq!(held.shape_parameters.len(), 1);
    let vs = &held.shape_parameters[0];
    assert_eq!(vs.name, "j1.vs");
    assert!((vs.value - truth(&log, "j1.vs")).abs() <= 4.0 * vs.std.unwrap(), "{vs:?}");
    same_predictions(&bench, &found, &held);
}

#[test]
fn slow_motion_makes_no_absurd_friction() {
    let bench = Bench::new();
    // Speeds up to 0.06 rad/s of 3 rad/s: a Stribeck speed is searched down to where its column underflows at most speeds.
    let slow = "rate_hz = 100\nseed = 3\nduration_s = 60\nperiod_s = 60\n\
                [trajectory.j1]\nsine = [0.6]\ncosine = [0.0]\n[trajectory.j2]\nsine = [0.0, 0.0]\ncosine = [0.6, 0.02]";
    let plain = "coulomb = { effort = 3.0 }\nviscous = { coefficient = 1.2 }";
    bench.log("log.csv", r#"["coulomb", "viscous", "offset"]"#, plain, slow);
    for law in ["arctangent", "stribeck", "tanh", "sigmoid", "sigmoid_offset", "power"] {
        let (found, read) = bench.identify(&format!("[elements]\nfriction = \"{law}\""));
        for p in &read.parameters {
            assert!(p.value.abs() < 1e3, "{law}: {} = {}", p.name, p.value);
        }
        let error = read.fit.filtered.relative_error.unwrap();
        assert!(error < 20.0, "{law}: {error} % off on the training log");
        same_predictions(&bench, &found, &read);
    }
}
