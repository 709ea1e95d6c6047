//! Mechanisms with loops, from robot file to identified parameters and back.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use std::path::{Path, PathBuf};

use dynid::estimators::distribution::t_quantile;
use dynid::identify::{Identification, identify};
use dynid::model::EffortModel;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::{Config, Robot, RobotOptions};

fn robot_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(format!("{name}.toml"))
}

fn load(name: &str) -> Robot {
    Robot::load(&robot_file(name), &RobotOptions::default()).unwrap()
}

/// A folder of its own for a test.
fn folder(test: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("dynid-closed-{test}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn write(log: &SimulatedLog, path: &Path) {
    let mut text = String::from("t");
    for signal in ["q", "tau"] {
        for joint in &log.joints {
            text.push_str(&format!(",{signal}_{joint}"));
        }
    }
    for (s, t) in log.time.iter().enumerate() {
        text.push_str(&format!("\n{t}"));
        for column in log.position.iter().chain(&log.effort) {
            text.push_str(&format!(",{}", column[s]));
        }
    }
    std::fs::write(path, text).unwrap();
}

/// Identifies a robot from logs of fast random motions, one per seed; truth in the order of the parameters.
fn identified(name: &str, test: &str, elements: &str, seeds: &[u64]) -> (Identification, Vec<f64>) {
    let (robot, folder) = (load(name), folder(test));
    let mut text = format!("robot = {:?}\n[elements]\ndefault = {elements}\n", robot_file(name));
    let mut truth = Vec::new();
    for seed in seeds {
        let settings = SimulateSettings {
            duration_s: 30.0,
            period_s: Some(5.0),
            acceleration: 40.0,
            effort_noise: 0.01,
            encoder_bits: 20,
            seed: *seed,
            ..SimulateSettings::default()
        };
        let log = simulate(&robot, &settings).unwrap();
        let path = folder.join(format!("{seed}.csv"));
        write(&log, &path);
        text.push_str(&format!("[[log]]\npath = {path:?}\n"));
        truth = log.truth;
    }
    let config = Config::parse(&text, &folder.join("run.toml").display().to_string()).unwrap();
    let id = identify(&config, |_| ()).unwrap();
    let value = |name: &String| truth.iter().find(|(n, _)| n == name).map_or(0.0, |(_, v)| *v);
    let values = id.model.parameters().linear.iter().map(|p| value(&p.name)).collect();
    std::fs::remove_dir_all(folder).unwrap();
    (id, values)
}

/// Errors of base parameters are as large as their standard deviations say.
fn check_errors(name: &str, id: &Identification, truth: &[f64]) {
    let expected = id.base.values(truth);
    let quantile = t_quantile(0.995, id.blocks() as f64 - 1.0).unwrap();
    let deviations = id.standard_deviations();
    let errors: Vec<f64> =
        (0..id.base.len()).filter_map(|k| Some((id.fit().x[k] - expected[k]) / deviations[k].0?)).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let inside = errors.iter().filter(|e| e.abs() <= quantile).count();
    println!(
        "{name}: {} of {} base parameters, standardised errors rms {rms:.2}, {inside} within the 99 % interval of ±{quantile:.2}",
        errors.len(),
        id.base.len()
    );
    assert!(rms < 1.3 && inside as f64 >= 0.95 * errors.len() as f64);
    assert_eq!(errors.len(), id.base.len(), "base parameters seen");
}

#[test]
fn a_delta_gives_its_base_parameters_back_within_their_deviations() {
    let (id, truth) = identified("delta", "delta", r#"["coulomb", "viscous"]"#, &[1, 2, 3]);
    assert_eq!(id.base.len(), 37 + 6);
    check_errors("delta", &id, &truth);
}

#[test]
fn a_stewart_platform_gives_its_base_parameters_back_within_their_deviations() {
    let (id, truth) = identified("stewart", "stewart", r#"["coulomb", "viscous"]"#, &[1, 2, 3, 4]);
    assert_eq!(id.base.len(), 88 + 12);
    check_errors("stewart", &id, &truth);
}
