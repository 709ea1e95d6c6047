//! Motions that repeat, within a log and from log to log: intervals that know it.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was found is said"
)]

use std::path::Path;

use dynid::config::{Config, LogConfig};
use dynid::robot::{Robot, RobotOptions};
use dynid::simulate::{SimulateMode, SimulateSettings, SimulatedLog, simulate};
use dynid::{Identification, identify};

use crate::support::{inside, write_log};

/// A controlled robot with all imperfections on a random motion of some period for 60 s.
fn recorded(seed: u64, period_s: f64) -> SimulatedLog {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let robot = Robot::load(&root.join("robots/indy7.toml"), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings {
        mode: SimulateMode::ClosedLoop,
        rate_hz: 250.0,
        duration_s: 60.0,
        period_s: Some(period_s),
        acceleration: 3.0,
        seed,
        ..SimulateSettings::default()
    };
    simulate(&robot, &settings).unwrap()
}

/// Identified by a robot file whose inertias are off, from parts of the log.
fn identified(log: &SimulatedLog, parts: &[(f64, f64)]) -> Identification {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    write_log(log, &path);
    let part =
        |part: &(f64, f64)| LogConfig { path: path.clone(), part: Some(*part), ..LogConfig::default() };
    let config = Config {
        robot: root.join("examples/indy7/robot.toml"),
        log: parts.iter().map(part).collect(),
        ..Config::default()
    };
    identify(&config, &mut |_| {}).unwrap().identification
}

/// Shares of intervals that hold over some seeds, with twelve periods and with one.
fn coverage(seeds: u64) -> [f64; 2] {
    [5.0, 60.0].map(|period_s| {
        let (mut held, mut all) = (0, 0);
        for seed in 1..=seeds {
            let log = recorded(seed, period_s);
            let id = identified(&log, &[(0.0, 1.0)]);
            let found = id.trained[0].repeats_after_s;
            let (inside, of) = inside(&id, &log);
            println!(
                "period {period_s}, seed {seed}: repeats {found:?}, {} blocks, inflation {:.2} ({:.2} in time), {inside} of {of} inside",
                id.blocks(),
                id.fitted.inflation,
                id.fitted.inflation_in_time
            );
            match period_s < 60.0 {
                true => assert!((found.unwrap() / period_s - 1.0).abs() < 1e-3),
                false => assert_eq!(found, None),
            }
            held += inside;
            all += of;
        }
        held as f64 / all as f64
    })
}

#[test]
fn intervals_know_that_a_motion_repeats() {
    let [repeated, once] = coverage(1);
    assert!(repeated >= 0.85 && once >= 0.85, "{repeated} {once}");
}

#[test]
#[ignore = "a minute; the ordinary run takes one seed"]
fn intervals_of_repeated_motions_hold() {
    let [repeated, once] = coverage(8);
    println!("inside: {repeated:.3} of twelve periods, {once:.3} of one");
    assert!(repeated >= 0.92 && once >= 0.92, "{repeated} {once}");
}

/// Two logs of one motion are known to be that, and tell no more than their motion.
#[test]
fn a_log_that_repeats_another_one_is_told() {
    let log = recorded(2, 30.0);
    let both = identified(&log, &[(0.0, 0.5), (0.5, 1.0)]);
    assert_eq!(both.trained[1].same_motion_as.as_ref(), Some(&both.trained[0].name));
    assert!(both.blocks() <= 31, "{} blocks", both.blocks());
    let check = both.estimate().verdict.checks.into_iter().find(|c| c.meaning.contains("repeat"));
    assert!(check.is_some(), "no check says so");
    let one = identified(&log, &[(0.0, 0.5)]);
    assert!(one.trained[0].same_motion_as.is_none() && one.blocks() >= 25);
}
