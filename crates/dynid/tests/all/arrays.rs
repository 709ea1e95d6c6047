//! An identification of arrays is that of the files that hold them.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig};
use dynid::io::MappingSpec;
use dynid::log::Log;
use dynid::motion::{JointSignals, Log as Recording};
use dynid::settings::{LogSettings, Own, PayloadConfig, Settings};
use dynid::{Robot, RobotOptions, pipeline};

fn json(x: &impl serde::Serialize) -> String {
    serde_json::to_string(x).unwrap()
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7").join(name)
}

/// The arrays of a log of the example.
fn arrays(robot: &Robot, name: &str) -> Recording {
    let file = LogConfig { path: example(name), ..LogConfig::default() };
    dynid::logs::load(&file, &robot.axes, &MappingSpec::default(), None).unwrap().log
}

#[test]
fn arrays_give_the_bits_of_their_files() {
    let config = Config::read(&example("identify.toml")).unwrap();
    let by_files = dynid::identify(&config, &mut |_| {}).unwrap();

    let robot = Robot::load(&config.robot, &RobotOptions::default()).unwrap();
    let training = Log::new(&robot, arrays(&robot, "train.csv.gz")).unwrap();
    let unseen = LogSettings { validation: true, ..LogSettings::default() };
    let validation = Log::new(&robot, arrays(&robot, "valid.csv.gz")).unwrap().with_settings(unseen);
    let settings = config.settings().unwrap();
    let by_arrays = pipeline::identify(&robot, [training, validation], &settings, &mut |_| {}).unwrap();

    assert_eq!(by_arrays.values(), by_files.values());
    assert_eq!(by_arrays.unconstrained_values(), by_files.unconstrained_values());
    let (a, b) = (by_arrays.estimate(), by_files.estimate());
    assert_eq!(json(&a.parameters), json(&b.parameters));
    assert_eq!(json(&a.base_parameters), json(&b.base_parameters));
    assert_eq!(json(&a.verdict), json(&b.verdict));
    assert_eq!(json(&a.validation), json(&b.validation));
    // It says what it was made with.
    assert_eq!(a.provenance.settings["estimator"]["method"], "wls");
    assert_eq!(a.provenance.inputs.len(), 1, "the robot file alone was read");
}

const ARM: &str = "schema = 1\nname = \"arm\"\ndh = \"modified\"\n[[joint]]\nname = \"a\"\nalpha = \"-90deg\"\n\
    phi = [2, 0.3, 0, 0, 0.05, 0, 0, 0.1, 0, 0.1]\n";

fn recording(name: &str, samples: usize, change: impl Fn(usize) -> (f64, f64)) -> Recording {
    let time = (0..samples).map(|k| 0.01 * k as f64).collect();
    let (position, effort) = (0..samples).map(change).unzip();
    let joint = JointSignals { name: name.to_owned(), position, velocity: None, effort };
    Recording::new("here", time, vec![joint], Vec::new()).unwrap()
}

#[test]
fn what_no_joint_does_and_what_does_nothing_is_refused_in_arrays_too() {
    let robot = Robot::parse(ARM, "arm.toml".as_ref(), &RobotOptions::default()).unwrap();
    let swing = |k: usize| ((0.02 * k as f64).sin(), (0.02 * k as f64).cos());
    let refused = |recording: Recording| Log::new(&robot, recording).unwrap_err().to_string();
    let degrees = refused(recording("a", 500, |k| (90.0 * swing(k).0, swing(k).1)));
    assert!(degrees.contains("look like degrees"), "{degrees}");
    assert!(refused(recording("b", 500, swing)).contains("`b`"));

    let log = || Log::new(&robot, recording("a", 2000, swing)).unwrap();
    let identify = |logs: Vec<Log>, settings: &Settings| {
        pipeline::identify(&robot, logs, settings, &mut |_| {}).unwrap_err().to_string()
    };
    assert!(identify(Vec::new(), &Settings::default()).contains("at least one log"));
    let own = LogSettings { own: vec![Own::Offset], ..LogSettings::default() };
    let alone = identify(vec![log().with_settings(own)], &Settings::default());
    assert!(alone.contains("a second `[[log]]`"), "{alone}");
    let tool = PayloadConfig { name: "tool".to_owned(), ..PayloadConfig::default() };
    let idle = identify(vec![log()], &Settings::default().with(|s| s.payload = vec![tool]));
    assert!(idle.contains("payload.tool"), "{idle}");
}
