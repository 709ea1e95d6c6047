//! What a known period is worth: simulated logs of a known robot, identified with and without it.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use std::path::{Path, PathBuf};

use dynid::io::States;
use dynid::model::EffortModel;
use dynid::predict::efforts;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::{Config, Robot, RobotOptions, identify};

use crate::support::write_log;

fn robot_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml").canonicalize().unwrap()
}

/// Errors of an identification.
struct Errors {
    /// Of the predicted effort on another motion, mean over joints, relative to the true effort.
    effort: f64,
    /// Median relative error of the base parameters.
    parameters: f64,
}

fn errors_of(log: &SimulatedLog, held_out: &SimulatedLog, path: &Path, more: &str) -> Errors {
    write_log(log, path);
    let text = format!(
        "robot = {:?}\n{more}\n[estimator]\nconsistency = \"none\"\n[[log]]\npath = {path:?}\n",
        robot_file()
    );
    let id = identify(&Config::parse(&text, "test").unwrap(), &mut |_| {}).unwrap();
    assert!(!id.warnings.iter().any(|w| w.message.contains("repeat")), "{:?}", id.warnings);
    let table = id.model.parameters();
    let mut truth = vec![0.0; table.linear.len()];
    for (name, value) in &log.truth {
        truth[table.column(name).unwrap()] = *value;
    }
    let [position, velocity, acceleration, _] = held_out.clean.clone();
    let states = States {
        rows: held_out.time.len(),
        position,
        velocity,
        acceleration,
        gravity: None,
        channels: Vec::new(),
        time: None,
    };
    let expected = efforts(&id.model, &truth, &states).unwrap();
    let found = efforts(&id.model, id.unconstrained_values(), &states).unwrap();
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let relative = expected.iter().zip(&found).map(|(e, f)| {
        let off: Vec<f64> = e.iter().zip(f).map(|(e, f)| e - f).collect();
        square(&off) / square(e)
    });
    let base = id.base.values(&truth);
    let pairs = base.iter().zip(&id.fit().x).filter(|(b, _)| b.abs() > 1e-3);
    let off: Vec<f64> = pairs.map(|(b, f)| (f / b - 1.0).abs()).collect();
    Errors {
        effort: (relative.sum::<f64>() / expected.len() as f64).sqrt(),
        parameters: dynid::motion::median::median(&off).unwrap(),
    }
}

/// A virtual experiment.
struct Case {
    encoder_bits: u32,
    effort_noise: f64,
    /// Periods in the log, and their length, s.
    periods: (usize, f64),
    seeds: u64,
}

/// Geometric means over seeds of the errors without and with the period.
fn errors(case: &Case) -> [Errors; 2] {
    let robot = Robot::load(&robot_file(), &RobotOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let held_out = SimulateSettings { seed: 99, rate_hz: 100.0, ..SimulateSettings::default() };
    let held_out = simulate(&robot, &held_out).unwrap();
    let (count, period) = case.periods;
    let runs: Vec<[Errors; 2]> = (1..=case.seeds)
        .map(|seed| {
            let settings = SimulateSettings {
                seed,
                encoder_bits: case.encoder_bits,
                effort_noise: case.effort_noise,
                duration_s: count as f64 * period,
                period_s: Some(period),
                ..SimulateSettings::default()
            };
            let log = simulate(&robot, &settings).unwrap();
            let known = format!("period_s = {period}");
            ["", known.as_str()].map(|more| errors_of(&log, &held_out, &path, more))
        })
        .collect();
    let mean = |pick: &dyn Fn(&[Errors; 2]) -> f64| {
        (runs.iter().map(|r| pick(r).ln()).sum::<f64>() / runs.len() as f64).exp()
    };
    let found =
        [0, 1].map(|k| Errors { effort: mean(&|r| r[k].effort), parameters: mean(&|r| r[k].parameters) });
    let ratio = |pick: fn(&Errors) -> f64| pick(&found[1]) / pick(&found[0]);
    println!(
        "{} bits, noise {}, {count} x {period} s: effort {:.2e} {:.2e} ({:.2}), parameters {:.2e} {:.2e} ({:.2})",
        case.encoder_bits,
        case.effort_noise,
        found[0].effort,
        found[1].effort,
        ratio(|e| e.effort),
        found[0].parameters,
        found[1].parameters,
        ratio(|e| e.parameters)
    );
    found
}

#[test]
fn a_known_period_helps_where_effort_noise_is_small() {
    let case = Case { encoder_bits: 18, effort_noise: 0.0, periods: (4, 10.0), seeds: 1 };
    let [without, with] = errors(&case);
    assert!(with.effort < 0.3 * without.effort);
}

#[test]
#[ignore = "six seconds; the ordinary run takes small noise"]
fn a_known_period_does_no_harm_where_effort_noise_is_large() {
    let case = Case { encoder_bits: 16, effort_noise: 0.05, periods: (4, 10.0), seeds: 2 };
    let [without, with] = errors(&case);
    assert!(with.effort < 1.1 * without.effort);
}

#[test]
#[ignore = "measures what the book says (theory/rows.md); two minutes"]
fn table_of_gains() {
    for (encoder_bits, effort_noise) in
        [(18, 0.0), (18, 0.005), (16, 0.005), (18, 0.02), (16, 0.02), (16, 0.05)]
    {
        for periods in [(1, 20.0), (4, 10.0)] {
            errors(&Case { encoder_bits, effort_noise, periods, seeds: 5 });
        }
    }
}

/// Of a trajectory file an identification takes the period and what to leave out, no coefficient.
#[test]
fn a_trajectory_file_does_what_its_period_does() {
    let robot = Robot::load(&robot_file(), &RobotOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let settings = SimulateSettings { rate_hz: 100.0, period_s: Some(10.0), ..SimulateSettings::default() };
    let log = simulate(&robot, &settings).unwrap();
    let joints: Vec<String> = log
        .joints
        .iter()
        .map(|name| format!(r#"{{"name": {name:?}, "q0": 0, "a": [1], "b": [0]}}"#))
        .collect();
    let text = format!(
        r#"{{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": {:?}, "periods": 2,
        "joints": [{}], "approach": null, "return": null, "sample_rate_hz": 100}}"#,
        std::f64::consts::TAU / 10.0,
        joints.join(", ")
    );
    let file = folder.path().join("trajectory.json");
    std::fs::write(&file, text).unwrap();
    let by_file = errors_of(&log, &log, &path, &format!("trajectory = {file:?}")).effort;
    let by_period = errors_of(&log, &log, &path, "period_s = 10").effort;
    assert!((by_file / by_period - 1.0).abs() < 1e-6, "{by_file} {by_period}");
}

/// The mean over periods that differ is no motion of the robot: a wrong period, or an approach among the periods, is told.
#[test]
fn averages_of_what_does_not_repeat_are_told() {
    let robot = Robot::load(&robot_file(), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings {
        duration_s: 21.0,
        rate_hz: 200.0,
        period_s: Some(10.0),
        seed: 4,
        ..SimulateSettings::default()
    };
    let path = std::env::temp_dir().join(format!("dynid-averages-{}.csv", std::process::id()));
    write_log(&simulate(&robot, &settings).unwrap(), &path);
    for (period, told) in [(10.0, false), (9.0, true)] {
        let text = format!(
            "robot = {:?}\n[elements]\nfriction = \"given\"\n[conditioning]\nroute = \"textbook\"\naverage_periods = true\n\
             [[log]]\npath = {path:?}\nperiod_s = {period}\n",
            robot_file()
        );
        let id = identify(&Config::parse(&text, "test").unwrap(), &mut |_| {}).unwrap();
        let warned: Vec<&str> =
            id.warnings.iter().map(|w| w.message.as_str()).filter(|m| m.contains("averaged")).collect();
        println!("{period} s: {warned:?}");
        assert_eq!(!warned.is_empty(), told, "{period} s: {warned:?}");
    }
    std::fs::remove_file(path).unwrap();
}
