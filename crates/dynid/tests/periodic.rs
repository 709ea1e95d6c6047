//! What a known period is worth: simulated logs of a known robot, identified with and without it.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use std::path::{Path, PathBuf};

use dynid::io::{States, csv};
use dynid::model::EffortModel;
use dynid::predict::efforts;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::{Config, Robot, RobotOptions, identify};

fn robot_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml").canonicalize().unwrap()
}

fn write(log: &SimulatedLog, path: &Path) {
    let mut header = vec!["t".to_owned()];
    let mut columns: Vec<&[f64]> = vec![&log.time];
    for (prefix, signals) in [("q", &log.position), ("tau", &log.effort)] {
        header.extend(log.joints.iter().map(|j| format!("{prefix}_{j}")));
        columns.extend(signals.iter().map(Vec::as_slice));
    }
    csv::write(path, &header, &columns).unwrap();
}

/// Error of the predicted effort on another motion, mean over joints, relative to the true effort.
fn error(log: &SimulatedLog, held_out: &SimulatedLog, path: &Path, more: &str) -> f64 {
    write(log, path);
    let text = format!(
        "robot = {:?}\n{more}\n[estimator]\nconsistency = \"none\"\n[[log]]\npath = {path:?}\n",
        robot_file()
    );
    let id = identify(&Config::parse(&text, "test").unwrap(), |_| {}).unwrap();
    assert!(!id.warnings.iter().any(|w| w.contains("repeat")), "{:?}", id.warnings);
    let table = id.model.parameters();
    let mut truth = vec![0.0; table.linear.len()];
    for (name, value) in &log.truth {
        truth[table.column(name).unwrap()] = *value;
    }
    let [position, velocity, acceleration, _] = held_out.clean.clone();
    let states = States { rows: held_out.time.len(), position, velocity, acceleration, gravity: None };
    let expected = efforts(&id.model, &truth, &states);
    let found = efforts(&id.model, id.unconstrained_values(), &states);
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let relative = expected.iter().zip(&found).map(|(e, f)| {
        let off: Vec<f64> = e.iter().zip(f).map(|(e, f)| e - f).collect();
        square(&off) / square(e)
    });
    (relative.sum::<f64>() / expected.len() as f64).sqrt()
}

/// A virtual experiment.
struct Case {
    encoder_bits: u32,
    effort_noise: f64,
    /// Periods in the log, and their length, s.
    periods: (usize, f64),
    seeds: u64,
}

/// Geometric means over seeds of the error without and with the period.
fn errors(case: &Case) -> (f64, f64) {
    let robot = Robot::load(&robot_file(), &RobotOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let held_out = SimulateSettings { seed: 99, rate_hz: 100.0, ..SimulateSettings::default() };
    let held_out = simulate(&robot, &held_out).unwrap();
    let (count, period) = case.periods;
    let mut logs = (0.0, 0.0);
    for seed in 1..=case.seeds {
        let settings = SimulateSettings {
            seed,
            encoder_bits: case.encoder_bits,
            effort_noise: case.effort_noise,
            duration_s: count as f64 * period,
            period_s: Some(period),
            ..SimulateSettings::default()
        };
        let log = simulate(&robot, &settings).unwrap();
        logs.0 += error(&log, &held_out, &path, "").ln();
        logs.1 += error(&log, &held_out, &path, &format!("period_s = {period}")).ln();
    }
    let means = ((logs.0 / case.seeds as f64).exp(), (logs.1 / case.seeds as f64).exp());
    println!(
        "{} bits, noise {}, {count} x {period} s: {:.2e} without, {:.2e} with, ratio {:.2}",
        case.encoder_bits,
        case.effort_noise,
        means.0,
        means.1,
        means.1 / means.0
    );
    means
}

#[test]
fn a_known_period_helps_where_effort_noise_is_small() {
    let case = Case { encoder_bits: 18, effort_noise: 0.005, periods: (4, 10.0), seeds: 2 };
    let (without, with) = errors(&case);
    assert!(with < 0.8 * without);
}

#[test]
fn a_known_period_does_no_harm_where_effort_noise_is_large() {
    let case = Case { encoder_bits: 16, effort_noise: 0.05, periods: (4, 10.0), seeds: 2 };
    let (without, with) = errors(&case);
    assert!(with < 1.1 * without);
}

#[test]
#[ignore = "measures what docs/guide.md says; half a minute"]
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
    let by_file = error(&log, &log, &path, &format!("trajectory = {file:?}"));
    let by_period = error(&log, &log, &path, "period_s = 10");
    assert!((by_file / by_period - 1.0).abs() < 1e-6, "{by_file} {by_period}");
}
