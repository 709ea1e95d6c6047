//! One factor on the friction of a log: found with an interval that holds it, and kept out of what is said of the robot alone.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::PathBuf;

use dynid::Run;
use dynid::estimate::{Estimate, Split};
use dynid::io::csv;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::validate::{log_fit, validate};
use dynid::{Config, Robot, RobotOptions, identify};
use tempfile::TempDir;

use crate::support::data;

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

/// Coulomb, static and viscous friction of both joints.
const FRICTION: [[f64; 3]; 2] = [[2.0, 3.5, 1.2], [1.4, 2.1, 0.9]];

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

    /// A log of the arm whose friction is `scale` times [`FRICTION`].
    fn log(&self, name: &str, scale: f64, seed: u32) {
        let joint = |k: usize| {
            let [coulomb, fixed, viscous] = FRICTION[k].map(|f| scale * f);
            format!(
                "[element.j{}]\nstribeck = {{ coulomb = {coulomb}, static = {fixed}, vs = 0.25 }}\n\
                 viscous = {{ coefficient = {viscous} }}\noffset = {{ effort = 0.4 }}\n",
                k + 1
            )
        };
        let elements = "[defaults]\nelements = [\"stribeck\", \"viscous\", \"offset\"]\n";
        let path = self.path("truth.toml");
        std::fs::write(&path, format!("{ARM}{elements}{}{}", joint(0), joint(1))).unwrap();
        let robot = Robot::load(&path, &RobotOptions::default()).unwrap();
        let settings = format!("rate_hz = 250\nseed = {seed}");
        let log = simulate(&robot, &SimulateSettings::parse(&settings, "simulation").unwrap()).unwrap();
        let mut header = vec!["t".to_owned()];
        let mut columns: Vec<&[f64]> = vec![&log.time];
        for (prefix, signals) in [("q", &log.position), ("tau", &log.effort)] {
            header.extend(log.joints.iter().map(|j| format!("{prefix}_{j}")));
            columns.extend(signals.iter().map(Vec::as_slice));
        }
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        csv::write(self.path(name), &header, &columns).unwrap();
    }

    fn config(&self, text: &str) -> Config {
        let path = self.path("run.toml");
        std::fs::write(&path, format!("robot = \"arm.toml\"\n{text}")).unwrap();
        Config::read(&path).unwrap()
    }

    fn identify(&self, text: &str) -> (Run, Estimate) {
        let config = self.config(text);
        let found = identify(&config, &mut |_| {}).unwrap();
        let estimate = found.estimate();
        std::fs::write(self.path("estimate.json"), estimate.to_json()).unwrap();
        (found, Estimate::read(&self.path("estimate.json")).unwrap())
    }
}

const COLD: &str = "[elements]\nfriction = \"stribeck\"\n[[log]]\npath = \"warm.csv\"\n\
     [[log]]\npath = \"cold.csv\"\nown = [\"friction_scale\"]\n\
     [[validation]]\npath = \"colder.csv\"\nlike = \"cold\"\n";

#[test]
fn the_factor_of_a_cold_log_is_found_and_the_robot_alone_is_that_of_the_warm_one() {
    let bench = Bench::new();
    bench.log("warm.csv", 1.0, 3);
    bench.log("cold.csv", 1.6, 4);
    bench.log("colder.csv", 1.6, 5);
    let (found, read) = bench.identify(COLD);
    let [scale] = &read.log_scales[..] else { panic!("{:?}", read.log_scales) };
    println!("{scale:?}");
    assert_eq!((scale.log.as_str(), scale.verdict.word()), ("cold", "seen in the data"));
    assert!((scale.value - 1.6).abs() < 4.0 * scale.std.unwrap(), "{scale:?}");
    assert!(scale.std.unwrap() < 0.02, "{scale:?}");
    let value = |name: &str| read.parameters.iter().find(|p| p.name == name).unwrap();
    for (joint, truth) in ["j1", "j2"].iter().zip(FRICTION) {
        for (symbol, truth) in ["fc", "fs", "fv"].iter().zip(truth) {
            let p = value(&format!("{joint}.{symbol}"));
            println!("{} = {:.3} ± {:?}, truly {truth}", p.name, p.value, p.std);
            assert!((p.value / truth - 1.0).abs() < 0.02, "{} = {}", p.name, p.value);
        }
    }
    assert!(read.shape_parameters.iter().all(|s| s.name.ends_with(".vs")), "{:?}", read.shape_parameters);
    assert!(read.log_parameters.is_empty(), "{:?}", read.log_parameters);
    let listed = read.verdict.checks.iter().find(|c| c.name.word() == "terms of single logs").unwrap();
    assert!(listed.meaning.contains("friction_scale[cold] = 1."), "{}", listed.meaning);
    // A log of the cold robot is predicted with its factor.
    let errors = &read.validation[0].filtered.nrmse;
    assert!(errors.iter().all(|e| e.unwrap() < 1.0), "{errors:?}");
    // What is written is the robot alone, in its own order, and says so to the last bit where it is read back.
    assert_eq!(found.model.log_columns().len(), 0);
    found.robot_file().unwrap();
    let file = bench.path("estimate.json");
    let own = |name: &str| dynid::config::LogConfig { path: bench.path(name), ..Default::default() };
    let again =
        validate(&read, Split::Consistent, &file, &[own("warm.csv")], &Default::default(), None, None)
            .unwrap();
    let again = log_fit(&again.agreements[0]);
    let first = log_fit(&found.agreement(found.values(), &found.logs[0]).unwrap());
    for (a, b) in first.raw.rms.iter().zip(&again.raw.rms) {
        assert!((a.unwrap() - b.unwrap()).abs() <= 1e-12 * a.unwrap(), "{a:?}, read back {b:?}");
    }
}

/// Intervals hold the true factor as often as they say, and coefficients lie off by what their standard deviations say.
#[test]
#[ignore = "32 identifications"]
fn intervals_of_the_factor_hold_it() {
    const RUNS: u32 = 16;
    let bench = Bench::new();
    let mut inside = 0;
    let mut squares = Vec::new();
    for run in 0..RUNS {
        bench.log("warm.csv", 1.0, 100 + 2 * run);
        bench.log("cold.csv", 0.8, 101 + 2 * run);
        let text = COLD.split("[[validation]]").next().unwrap();
        let (_, read) = bench.identify(text);
        let scale = &read.log_scales[0];
        let (low, high) = scale.interval.unwrap();
        println!("{:.4} ({low:.4} to {high:.4})", scale.value);
        inside += u32::from((low..=high).contains(&0.8));
        squares.push(((scale.value - 0.8) / scale.std.unwrap()).powi(2));
        for (joint, truth) in ["j1", "j2"].iter().zip(FRICTION) {
            for (symbol, truth) in ["fc", "fs", "fv"].iter().zip(truth) {
                let name = format!("{joint}.{symbol}");
                let p = read.parameters.iter().find(|p| p.name == name).unwrap();
                squares.push(((p.unconstrained.unwrap() - truth) / p.std.unwrap()).powi(2));
            }
        }
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    println!("{inside} of {RUNS} intervals hold the factor; rms of errors over standard deviations {rms:.2}");
    // Of 16 intervals of 95 %, fewer than 13 hold it once in 700.
    assert!(inside >= 13, "{inside} of {RUNS}");
    assert!((0.6..1.4).contains(&rms), "{rms}");
}

/// Where all logs have a factor, the first is the measure; and a log that is like the others has the factor 1.
#[test]
fn the_first_log_is_the_measure_where_all_have_a_factor() {
    let bench = Bench::new();
    for (name, scale, seed) in [("a.csv", 1.0, 7), ("b.csv", 1.0, 8), ("c.csv", 0.7, 9)] {
        bench.log(name, scale, seed);
    }
    let own =
        |name: &str| format!("[[log]]\npath = \"{name}.csv\"\nown = [\"friction_scale\", \"offset\"]\n");
    let text = format!("[elements]\nfriction = \"auto\"\n{}{}{}", own("a"), own("b"), own("c"));
    let (_, read) = bench.identify(&text);
    let names: Vec<&str> = read.log_scales.iter().map(|s| s.log.as_str()).collect();
    assert_eq!(names, ["b", "c"]);
    for (scale, truth) in read.log_scales.iter().zip([1.0, 0.7]) {
        println!("{scale:?}");
        assert!((scale.value / truth - 1.0).abs() < 0.005, "{scale:?}, truly {truth}");
    }
    let offsets: Vec<&str> = read.log_parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(offsets, ["j1.fo[b]", "j2.fo[b]", "j1.fo[c]", "j2.fo[c]"]);
}

#[test]
fn a_factor_without_a_meaning_is_refused() {
    let bench = Bench::new();
    bench.log("warm.csv", 1.0, 3);
    bench.log("cold.csv", 1.6, 4);
    let logs = "[[log]]\npath = \"warm.csv\"\n[[log]]\npath = \"cold.csv\"\nown = [\"friction_scale\"]\n";
    for (more, expected) in [
        ("[conditioning]\nroute = \"textbook\"\n", "textbook route"),
        ("[elements]\ndefault = [\"rotor\", \"offset\"]\nfriction = \"given\"\n", "no joint has friction"),
        ("[elements]\ndefault = [\"lugre\"]\nfriction = \"given\"\n", "`lugre`"),
    ] {
        let fault = identify(&bench.config(&format!("{more}{logs}")), &mut |_| {}).unwrap_err().to_string();
        assert!(fault.contains("friction_scale") && fault.contains(expected), "{fault}");
    }
    let text = format!("robot = \"arm.toml\"\n{}", logs.replace("[\"fr", "[\"friction\", \"fr"));
    let fault = Config::parse(&text, "test").unwrap_err().to_string();
    assert!(fault.contains("`friction` or `friction_scale`"), "{fault}");
}

/// What tells both runs apart is the zero of their sensors: beside it, friction is the same within 10 %.
#[test]
fn friction_of_the_rokae_runs_has_one_scale() {
    let Some(data) = data() else { return };
    let text = r#"
robot = "{data}/rokae-xmate/xmate_kinematics.urdf"
[columns]
rate_hz = 1000
[elements]
friction = "given"
[[log]]
path = "{data}/rokae-xmate/run_a.csv.gz"
[[log]]
path = "{data}/rokae-xmate/run_b.csv.gz"
own = ["offset", "friction_scale"]
"#;
    let config = Config::parse(&text.replace("{data}", &data.display().to_string()), "test").unwrap();
    let found = identify(&config, &mut |_| {}).unwrap().estimate();
    println!("{:?}", found.log_scales);
    assert!((found.log_scales[0].value - 1.0).abs() < 0.1, "{:?}", found.log_scales);
}
