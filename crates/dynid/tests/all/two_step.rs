//! Two-step identification: friction known from its own experiment, inertias and errors of friction from a log.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::PathBuf;

use dynid::Run;
use dynid::config::LogConfig;
use dynid::estimate::{Estimate, Split};
use dynid::estimators::conditioning::ConditioningError;
use dynid::export::{CheckStates, RobotExport, RobotJson, Source, json};
use dynid::io::{States, csv};
use dynid::model::EffortModel;
use dynid::predict::efforts;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::validate::{log_fit, validate};
use dynid::{Config, Error, Robot, RobotOptions, identify};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::ARM;

/// Friction of both joints: it falls from rest, saturates with speed and falls by 1.2 % of its amplitude per kelvin.
const FRICTION: &str = r#"stribeck = { coulomb = 2.0, static = 2.8, vs = 0.1 }
exponential_viscous = { sigma2 = 9.0, sigma2_slope = -0.108, sigma3 = 0.9, sigma4 = 0.8, reference_temperature = 30.0 }
offset = { effort = 0.4 }
"#;

/// Friction of one joint as its experiment left it.
fn law(joint: &str, coulomb: f64) -> Value {
    json!({
        "joint": joint, "status": "identified", "coulomb": coulomb, "static": coulomb + 0.8,
        "stribeck_speed": 0.1, "stribeck_exponent": 2.0,
        "viscous": {
            "reference_temperature": 30.0, "sigma2": 9.0, "sigma2_slope": -0.108, "sigma3": 0.9,
            "sigma3_slope": 0.0, "sigma4": 0.8, "sigma4_slope": 0.0,
        },
        "offset": 7.0, "temperature_range": [20.0, 50.0], "std": {}, "points": [], "samples": 0, "levels": [],
        "lines": {}, "laws": [], "unpaired": [], "presliding": [], "notes": [],
    })
}

fn friction_file(joints: &[Value]) -> String {
    json!({
        "schema": 1, "robot": "arm", "verdict": { "status": "pass", "headline": "" }, "joints": joints,
        "provenance": { "version": "0", "inputs": [], "settings": {}, "seed": 1 }, "warnings": [],
    })
    .to_string()
}

/// A folder with the robot as the user knows it, its friction file and its logs.
struct Bench(TempDir);

impl Bench {
    fn new(coulomb: f64) -> Self {
        let bench = Bench(tempfile::tempdir().unwrap());
        std::fs::write(bench.path("arm.toml"), ARM).unwrap();
        std::fs::write(bench.path("friction.json"), friction_file(&[law("j1", coulomb), law("j2", coulomb)]))
            .unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A log in which both joints warm up from one temperature to another.
    fn log(&self, name: &str, [from, to]: [f64; 2], seed: u64) -> SimulatedLog {
        let both = ["j1", "j2"].map(|joint| format!("[element.{joint}]\n{FRICTION}")).concat();
        let elements = r#"[defaults]
elements = ["stribeck", "exponential_viscous", "offset"]
"#;
        std::fs::write(self.path("truth.toml"), format!("{ARM}{elements}{both}")).unwrap();
        let robot = Robot::load(&self.path("truth.toml"), &RobotOptions::default()).unwrap();
        let channel = format!("[[0.0, {from}], [16.0, {to}]]");
        let settings = format!(
            "mode = \"closed_loop\"\nduration_s = 16.0\nrate_hz = 250\nseed = {seed}\neffort_noise = 0.01\n\
             [channels]\ntemperature_j1 = {channel}\ntemperature_j2 = {channel}\n"
        );
        let log = simulate(&robot, &SimulateSettings::parse(&settings, "simulation").unwrap()).unwrap();
        let mut header = vec!["t".to_owned()];
        let mut columns: Vec<&[f64]> = vec![&log.time];
        for (prefix, signals) in [("q", &log.position), ("tau", &log.effort)] {
            header.extend(log.joints.iter().map(|j| format!("{prefix}_{j}")));
            columns.extend(signals.iter().map(Vec::as_slice));
        }
        csv::write(self.path(&format!("bare_{name}")), &header, &columns).unwrap();
        header.extend(log.joints.iter().map(|j| format!("temp_{j}")));
        columns.extend(log.channels.iter().map(|(_, values)| values.as_slice()));
        csv::write(self.path(name), &header, &columns).unwrap();
        log
    }

    fn config(&self, elements: &str, logs: &str) -> Config {
        let path = self.path("run.toml");
        std::fs::write(&path, format!("robot = \"arm.toml\"\n[elements]\n{elements}\n{logs}")).unwrap();
        Config::read(&path).unwrap()
    }

    fn identify(&self, elements: &str, logs: &str) -> (Run, Estimate) {
        let config = self.config(elements, logs);
        let found = identify(&config, &mut |_| {}).unwrap();
        let estimate = found.estimate();
        std::fs::write(self.path("estimate.json"), estimate.to_json()).unwrap();
        let read = Estimate::read(&self.path("estimate.json")).unwrap();
        assert_eq!(read.to_json(), estimate.to_json(), "an estimate survives its file");
        (found, read)
    }
}

const KNOWN: &str = "known_friction = \"friction.json\"";
const LOG: &str = "[[log]]\npath = \"log.csv\"\n";

fn value(estimate: &Estimate, name: &str) -> f64 {
    estimate.parameters.iter().find(|p| p.name == name).unwrap().value
}

/// Whether no friction was found beside the known one. The logs have ripple, whose repetitions are shape parameters too.
fn has_no_shapes(estimate: &Estimate) -> bool {
    estimate.shape_parameters.iter().all(|s| s.name.ends_with(".cycles"))
}

/// Distance of the inertial base parameters from the truth, in deviations of the prior.
fn inertial_error(found: &Run, log: &SimulatedLog) -> f64 {
    let table = &found.model.parameters().linear;
    let truth: Vec<f64> = table
        .iter()
        .map(|p| log.truth.iter().find(|(name, _)| *name == p.name).map_or(0.0, |(_, value)| *value))
        .collect();
    let (truth, values) = (found.base.values(&truth), found.base.values(found.unconstrained_values()));
    let inertial = found.base.kept.iter().zip(truth.iter().zip(&values)).filter(|(c, _)| **c < 20);
    inertial.map(|(c, (t, x))| ((x - t) / found.prior.std[*c]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn known_friction_carries_over_to_another_temperature() {
    let bench = Bench::new(2.0);
    let log = bench.log("log.csv", [22.0, 34.0], 1);
    bench.log("hot.csv", [46.0, 48.0], 2);
    let logs = format!("{LOG}[[validation]]\npath = \"hot.csv\"\n");
    let (two_step, estimate) = bench.identify(KNOWN, &logs);
    let (conventional, plain) = bench.identify("friction = \"given\"", &logs);
    let hot = |e: &Estimate| e.validation[0].filtered.relative_error.unwrap();
    let errors = [inertial_error(&two_step, &log), inertial_error(&conventional, &log)];
    println!(
        "hot log: {} % against {} %; inertias off by {errors:?} prior deviations",
        hot(&estimate),
        hot(&plain)
    );
    assert!(hot(&estimate) < 0.4 * hot(&plain), "{} against {}", hot(&estimate), hot(&plain));
    assert!(errors[0] < errors[1], "{errors:?}");
    // What is left of friction is small beside it.
    for name in ["j1.fc", "j2.fc", "j1.fv", "j2.fv"] {
        assert!(value(&estimate, name).abs() < 0.3, "{name} = {}", value(&estimate, name));
    }
    // The offset of the experiment is not taken over.
    assert!((value(&estimate, "j1.fo") - 0.4).abs() < 0.2, "{}", value(&estimate, "j1.fo"));
    assert!(has_no_shapes(&estimate) && two_step.friction.is_empty());
    let told = estimate.conditioning.choices.iter().find(|c| c.name == "known friction of j1").unwrap();
    assert!(told.reason.contains("j1.fc, j1.fv, j1.fo are errors of it, of any sign"), "{}", told.reason);
    let input = estimate.provenance.inputs.iter().find(|i| i.kind.word() == "friction").unwrap();
    assert_eq!(input.sha256, dynid::logs::sha256(&bench.path("friction.json")).unwrap());
    assert!(two_step.report(&estimate).unwrap().contains("known Stribeck"));
}

#[test]
fn errors_of_friction_have_any_sign_unless_told_otherwise() {
    // 0.5 N m too much.
    let bench = Bench::new(2.5);
    bench.log("log.csv", [22.0, 34.0], 1);
    let (_, free) = bench.identify(KNOWN, LOG);
    for name in ["j1.fc", "j2.fc"] {
        assert!((value(&free, name) + 0.5).abs() < 0.2, "{name} = {}", value(&free, name));
    }
    // The law with its errors takes energy out of the motion: both are looked at together.
    assert!(
        free.friction_passivity.iter().all(|p| p.passivity.word() == "passive"),
        "{:?}",
        free.friction_passivity
    );
    let (_, nonnegative) = bench.identify(&format!("{KNOWN}\nfriction_errors = \"nonnegative\""), LOG);
    for name in ["j1.fc", "j2.fc"] {
        assert!((0.0..0.05).contains(&value(&nonnegative, name)), "{name} = {}", value(&nonnegative, name));
    }
}

#[test]
fn the_textbook_route_takes_known_friction_off() {
    let bench = Bench::new(2.0);
    let log = bench.log("log.csv", [22.0, 34.0], 1);
    bench.log("hot.csv", [46.0, 48.0], 2);
    let logs = format!("[conditioning]\nroute = \"textbook\"\n{LOG}[[validation]]\npath = \"hot.csv\"\n");
    let (two_step, estimate) = bench.identify(KNOWN, &logs);
    let (conventional, plain) = bench.identify("friction = \"given\"", &logs);
    assert!(two_step.conditioning.is_none() && estimate.model.known_friction.len() == 2);
    let hot = |e: &Estimate| e.validation[0].filtered.relative_error.unwrap();
    let errors = [inertial_error(&two_step, &log), inertial_error(&conventional, &log)];
    println!(
        "hot log: {} % against {} %; inertias off by {errors:?} prior deviations",
        hot(&estimate),
        hot(&plain)
    );
    assert!(hot(&estimate) < 0.4 * hot(&plain), "{} against {}", hot(&estimate), hot(&plain));
    assert!(errors[0] < errors[1], "{errors:?}");
    for name in ["j1.fc", "j2.fc", "j1.fv", "j2.fv"] {
        assert!(value(&estimate, name).abs() < 0.3, "{name} = {}", value(&estimate, name));
    }
}

#[test]
fn a_law_asked_for_by_name_stands_beside_the_known_one() {
    let bench = Bench::new(2.0);
    bench.log("log.csv", [22.0, 34.0], 1);
    // The experiment missed that friction falls from rest.
    let laws = ["j1", "j2"].map(|joint| {
        let mut law = law(joint, 2.0);
        law["static"] = Value::Null;
        law
    });
    std::fs::write(bench.path("friction.json"), friction_file(&laws)).unwrap();
    let (_, without) = bench.identify(KNOWN, LOG);
    let (_, estimate) = bench.identify(&format!("{KNOWN}\nfriction = \"stribeck\""), LOG);
    let error = |e: &Estimate| e.fit.filtered.relative_error.unwrap();
    println!("{} % beside {} %", error(&estimate), error(&without));
    assert!(error(&estimate) < 0.7 * error(&without), "{} against {}", error(&estimate), error(&without));
    assert!(has_no_shapes(&without) && estimate.model.known_friction.len() == 2);
    for joint in ["j1", "j2"] {
        let shape = estimate.shape_parameters.iter().find(|s| s.name == format!("{joint}.vs")).unwrap();
        let [fc, fs] = ["fc", "fs"].map(|name| value(&estimate, &format!("{joint}.{name}")));
        println!("{joint}: {fc} N m, {fs} N m, {} rad/s ({})", shape.value, shape.verdict);
        assert_eq!(shape.verdict.word(), "seen in the data");
        // Coulomb friction was known. What is missing is 0.8 N m at rest, but rows next to rest do not count: the curve is
        // held to where it is seen.
        assert!(fc.abs() < 0.05, "{joint}: {fc}");
        for v in [0.1_f64, 0.15, 0.2] {
            let rise = |height: f64, speed: f64| height * (-(v / speed).powi(2)).exp();
            let off = fc + rise(fs - fc, shape.value) - rise(0.8, 0.1);
            assert!(off.abs() < 0.1, "{joint}: {off} N m off at {v} rad/s");
        }
    }
}

#[test]
fn a_log_without_temperature_is_named_and_a_constant_one_helps() {
    let bench = Bench::new(2.0);
    bench.log("log.csv", [31.0, 31.0], 1);
    let bare = "[[log]]\npath = \"bare_log.csv\"\n";
    let error = identify(&bench.config(KNOWN, bare), &mut |_| {}).unwrap_err();
    let hint = error.hint().unwrap();
    match error {
        Error::Conditioning(ConditioningError::MissingChannel { log, channel }) => {
            assert!(log.contains("bare_log.csv") && channel == "temperature_j1", "{log}: {channel}");
        }
        other => panic!("{other}"),
    }
    assert!(hint.contains("under [elements]"), "{hint}");
    let (_, held) = bench.identify(&format!("{KNOWN}\ntemperature = 31.0"), bare);
    let (_, logged) = bench.identify(KNOWN, LOG);
    for (a, b) in held.parameters.iter().zip(&logged.parameters) {
        assert!(
            (a.value - b.value).abs() <= 1e-9 * (1.0 + b.value.abs()),
            "{}: {} {}",
            a.name,
            a.value,
            b.value
        );
    }
    assert_eq!(held.model.known_friction[1].temperature, Some(31.0));
    // It predicts without temperatures.
    let model = held.effort_model(&bench.path("estimate.json"), Split::Consistent).unwrap();
    assert!(model.channels().is_empty());
    let senseless = bench.config(&format!("{KNOWN}\ntemperature = {{ j2 = 304.0 }}"), bare);
    assert!(identify(&senseless, &mut |_| {}).unwrap_err().to_string().contains("elements.temperature"));
}

#[test]
fn every_log_may_state_its_temperature() {
    let bench = Bench::new(2.0);
    bench.log("cold.csv", [21.0, 21.0], 1);
    bench.log("warm.csv", [43.0, 43.0], 2);
    let logs = |names: [&str; 2], stated: [&str; 2]| {
        let log = |k: usize| format!("[[log]]\npath = \"{}.csv\"\n{}\n", names[k], stated[k]);
        format!("{}{}", log(0), log(1))
    };
    let (_, logged) = bench.identify(KNOWN, &logs(["cold", "warm"], [""; 2]));
    let stated = ["temperature = 21.0", "temperature = { j1 = 43.0, j2 = 43.0 }"];
    let (_, told) = bench.identify(KNOWN, &logs(["bare_cold", "bare_warm"], stated));
    for (a, b) in told.parameters.iter().zip(&logged.parameters) {
        let off = (a.value - b.value).abs();
        assert!(off <= 1e-9 * (1.0 + b.value.abs()), "{}: {} {}", a.name, a.value, b.value);
    }
    // What is stated stands in place of what is logged.
    let (_, hot) = bench.identify(KNOWN, &logs(["cold", "warm"], ["temperature = 60.0", ""]));
    let error = |e: &Estimate| e.fit.filtered.relative_error.unwrap();
    assert!(error(&hot) > 2.0 * error(&logged), "{} {}", error(&hot), error(&logged));
    let refused = |known: &str, stated: &str| {
        let config = bench.config(known, &logs(["bare_cold", "bare_warm"], [stated, "temperature = 43.0"]));
        identify(&config, &mut |_| {}).unwrap_err().to_string()
    };
    for (known, stated, found) in [
        (KNOWN.to_owned(), "temperature = 294.0", "found 294"),
        (KNOWN.to_owned(), "temperature = { wrist = 21.0 }", "wrist"),
        (format!("{KNOWN}\ntemperature = 30.0"), "temperature = 21.0", "reads them from the log"),
    ] {
        let said = refused(&known, stated);
        assert!(said.contains(found), "{said}");
    }
}

#[test]
fn a_temperature_that_no_law_reads_is_refused() {
    let bench = Bench::new(2.0);
    bench.log("log.csv", [31.0, 31.0], 1);
    let bare = "[[log]]\npath = \"bare_log.csv\"\n";
    let mut constant = law("j2", 2.0);
    constant["viscous"]["sigma2_slope"] = json!(0.0);
    let refused = |laws: &[Value], stated: &str| {
        std::fs::write(bench.path("friction.json"), friction_file(laws)).unwrap();
        let config = bench.config(&format!("{KNOWN}\ntemperature = {stated}"), bare);
        identify(&config, &mut |_| {}).err().map(|e| e.to_string())
    };
    let both = [law("j1", 2.0), constant.clone()];
    // One number for all joints serves those that read it.
    for stated in ["31.0", "{ j1 = 31.0 }"] {
        assert_eq!(refused(&both, stated), None, "{stated}");
    }
    let stated = "{ j1 = 31.0, j2 = 31.0 }";
    for (laws, stated, found) in
        [(&both[..], stated, "j2 = 31"), (&both[..1], stated, "j2 = 31"), (&[constant], "31.0", "31")]
    {
        let said = refused(laws, stated).unwrap();
        assert!(said.contains("elements.temperature") && said.contains("changes with them"), "{said}");
        assert!(said.ends_with(&format!("found {found}")), "{said}");
    }
}

#[test]
fn an_estimate_predicts_with_the_known_friction() {
    let bench = Bench::new(2.0);
    let log = bench.log("log.csv", [22.0, 34.0], 1);
    let (found, read) = bench.identify(KNOWN, LOG);
    let file = bench.path("estimate.json");
    let config = LogConfig { path: bench.path("log.csv"), ..LogConfig::default() };
    let again =
        validate(&read, Split::Consistent, &file, &[config], &Default::default(), None, None).unwrap();
    let own = log_fit(&found.agreement(found.values(), &found.logs[0]).unwrap());
    assert_eq!(own.raw.rms, log_fit(&again.agreements[0]).raw.rms);

    let model = read.effort_model(&file, Split::Consistent).unwrap();
    let mut states = States {
        rows: log.time.len(),
        position: log.clean[0].clone(),
        velocity: log.clean[1].clone(),
        acceleration: log.clean[2].clone(),
        gravity: None,
        channels: Vec::new(),
        time: None,
    };
    let values = read.values(Split::Consistent);
    let missing = efforts(&model, &values, &states).unwrap_err();
    assert!(matches!(&missing, Error::StatesChannel { channel } if channel == "temperature_j1"), "{missing}");
    states.channels.clone_from(&log.channels);
    for (predicted, clean) in efforts(&model, &values, &states).unwrap().iter().zip(&log.clean[3]) {
        let square = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>();
        let error = square(&mut predicted.iter().zip(clean).map(|(p, c)| p - c));
        let share = (error / square(&mut clean.iter().copied())).sqrt();
        assert!(share < 0.03, "{:.2} % off the true effort", 100.0 * share);
    }

    let robot = dynid::export::IdentifiedRobot::of(&read, &file).unwrap();
    let states = CheckStates::random(robot.identified().model);
    let stated: RobotJson = serde_json::from_str(&json(&robot.identified(), &states).unwrap().text).unwrap();
    assert_eq!(stated.known_friction, read.model.known_friction);
    let source = Source::read(&bench.path("arm.toml")).unwrap();
    let export = RobotExport::new(robot.identified(), &source).unwrap();
    for exported in [export.urdf(&states).unwrap(), export.mjcf(&states).unwrap()] {
        let notes = exported.notes.join("\n");
        assert!(notes.contains("friction of `j1` has a form that"), "{notes}");
    }
    let urdf = export.urdf(&states).unwrap().text;
    let dynamics = dynid::io::urdf::dynamics(&urdf, "urdf").unwrap();
    let j1 = dynamics.iter().find(|d| d.joint == "j1").unwrap();
    // Coulomb friction is held as it is; what saturates adds to it and to damping.
    let coulomb = 2.0 + value(&read, "j1.fc");
    assert!(j1.friction > coulomb && j1.damping > 0.0, "{j1:?} {coulomb}");
}

#[test]
fn what_the_law_does_not_know_is_said() {
    let bench = Bench::new(2.0);
    bench.log("log.csv", [40.0, 60.0], 1);
    std::fs::write(bench.path("friction.json"), friction_file(&[law("j1", 2.0)])).unwrap();
    let (_, estimate) = bench.identify(KNOWN, LOG);
    let warnings = estimate.verdict.warnings.join("\n");
    // Half of the record is warmer than 50 degrees.
    assert!(warnings.contains("log.csv: 50 % of the temperatures of `j1`"), "{warnings}");
    assert!(warnings.contains("20.0 to 50.0 °C"), "{warnings}");
    assert!(warnings.contains("no friction is known of `j2`"), "{warnings}");
    bench.log("warm.csv", [30.0, 40.0], 2);
    let logs = ["log.csv", "warm.csv"].map(|name| LogConfig { path: bench.path(name), ..Default::default() });
    let file = bench.path("estimate.json");
    let again =
        validate(&estimate, Split::Consistent, &file, &logs, &Default::default(), None, None).unwrap();
    let told: Vec<&String> =
        estimate.verdict.warnings.iter().filter(|w| w.contains("temperatures")).collect();
    assert_eq!(
        again.warnings.iter().collect::<Vec<_>>(),
        told,
        "as when it was identified; the warm log is within the range"
    );

    std::fs::write(bench.path("friction.json"), friction_file(&[law("wrist", 2.0)])).unwrap();
    let error = identify(&bench.config(KNOWN, LOG), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("wrist") && error.hint().is_some(), "{error}");
    std::fs::write(bench.path("friction.json"), friction_file(&[law("j1", -2.0)])).unwrap();
    let error = identify(&bench.config(KNOWN, LOG), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("joint `j1`: `coulomb`: expected at least 0"), "{error}");
    let lugre = format!("{KNOWN}\njoint = {{ j1 = [\"lugre\"] }}");
    let mut bristled = law("j1", 2.0);
    bristled["bristle"] = json!({ "sigma0": 2000.0, "sigma1": 1.0 });
    std::fs::write(bench.path("friction.json"), friction_file(&[bristled])).unwrap();
    let error = identify(&bench.config(&lugre, LOG), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("has bristles already"), "{error}");
    let alone = Config::parse("robot = \"a\"\n[elements]\ntemperature = 30\n[[log]]\npath = \"b\"\n", "c");
    assert!(alone.unwrap_err().to_string().contains("known_friction"));
}

#[test]
fn bristles_are_remembered_through_a_record() {
    let bench = Bench::new(2.0);
    bench.log("log.csv", [22.0, 34.0], 1);
    let with = |bristle: Value| {
        let joints = ["j1", "j2"].map(|name| {
            let mut joint = law(name, 2.0);
            joint["bristle"] = bristle.clone();
            joint
        });
        std::fs::write(bench.path("friction.json"), friction_file(&joints)).unwrap();
        // Ripple, which the logs have, would join one fit and not the other.
        bench.identify(&format!("{KNOWN}\nfriction = \"given\""), LOG).1
    };
    let stiff = with(json!({ "sigma0": 1e6, "sigma1": 1.0 }));
    let (steady, soft) = (with(Value::Null), with(json!({ "sigma0": 20.0, "sigma1": 1.0 })));
    let error = |e: &Estimate| e.fit.filtered.relative_error.unwrap();
    println!("{} % stiff, {} % steady, {} % soft", error(&stiff), error(&steady), error(&soft));
    // The true friction has no bristles. Stiff ones differ by the sample that they turn late (the velocity is held over a
    // step); soft ones, which bend by a tenth of a radian, spoil the fit.
    assert!(error(&stiff) < 1.5 * error(&steady));
    assert!(error(&soft) > 3.0 * error(&steady));
}
