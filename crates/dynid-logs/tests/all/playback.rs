//! Motions for what plays them: read back they are the samples, and what a robot cannot do is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid_logs::trajectory::{JointTrajectory, Playback};
use dynid_logs::{ReadOptions, csv};
use dynid_motion::trajectory::Sampled;

fn names(count: usize) -> Vec<String> {
    (1..=count).map(|k| format!("j{k}")).collect()
}

/// `q = a (1 - cos wt)³`, which rests at both ends of its period of 2 s with speed, acceleration and jerk zero.
fn motion(joints: usize, rate_hz: f64, amplitude: f64) -> Sampled {
    let w = std::f64::consts::PI;
    let samples = (2.0 * rate_hz).round() as usize + 1;
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / rate_hz).collect();
    let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..joints)
            .flat_map(|j| time.iter().map(move |t| (t, j)))
            .map(|(t, j)| amplitude * f(*t) / (1.0 + j as f64))
            .collect()
    };
    let rise = |t: f64| 1.0 - (w * t).cos();
    let (q, dq, ddq) = (
        of(&|t| rise(t).powi(3)),
        of(&|t| 3.0 * rise(t).powi(2) * w * (w * t).sin()),
        of(&|t| 6.0 * rise(t) * (w * (w * t).sin()).powi(2) + 3.0 * rise(t).powi(2) * w * w * (w * t).cos()),
    );
    Sampled { time, q, dq, ddq }
}

fn text(format: Playback, sampled: &Sampled) -> Result<String, String> {
    let joints = names(sampled.coordinates());
    format
        .text(Path::new("m"), &joints, sampled)
        .map_err(|e| format!("{e}\nhint: {}", e.hint().unwrap_or_default()))
}

fn numbers(list: &str, separator: char) -> Vec<f64> {
    list.split(separator).filter(|x| !x.trim().is_empty()).map(|x| x.trim().parse().unwrap()).collect()
}

#[test]
fn a_script_holds_every_sample_at_its_step() {
    let sampled = motion(6, 125.0, 0.1);
    let script = text(Playback::UrScript, &sampled).unwrap();
    let n = sampled.samples();
    assert!(script.starts_with("# 251 samples at 125 Hz, joints in this order: j1, j2, j3, j4, j5, j6\n"));
    assert!(script.ends_with("  stopj(2.0)\nend\n"));
    let lines: Vec<&str> = script.lines().filter_map(|l| l.strip_prefix("  servoj([")).collect();
    assert_eq!(lines.len(), n);
    for (s, line) in lines.iter().enumerate() {
        let (list, rest) = line.split_once(']').unwrap();
        assert_eq!(rest, ", 0, 0, 0.008, 0.1, 300)");
        for (c, q) in numbers(list, ',').iter().enumerate() {
            assert!((q - sampled.q[c * n + s]).abs() <= 0.5e-9);
        }
    }
    let first = script.lines().find_map(|l| l.strip_prefix("  movej([")).unwrap();
    assert_eq!(first.split_once(']').unwrap().0, lines[0].split_once(']').unwrap().0);
}

#[test]
fn positions_at_a_kilohertz_read_back_bit_for_bit() {
    let sampled = motion(7, 1000.0, 0.1);
    let folder = tempfile::tempdir().unwrap();
    for format in [Playback::Fci, Playback::Fri] {
        assert_eq!(format.rate_hz(50.0), 1000.0);
        let path = folder.path().join(format.ending());
        std::fs::write(&path, text(format, &sampled).unwrap()).unwrap();
        let table = csv::read(&path, &ReadOptions::default()).unwrap();
        assert_eq!(table.header[..2], ["t", "q_j1"]);
        assert_eq!(table.columns[1..].concat(), sampled.q);
        assert_eq!(table.columns[0], sampled.time);
    }
}

#[test]
fn keyframes_and_messages_hold_the_samples() {
    let sampled = motion(3, 50.0, 0.2);
    let n = sampled.samples();
    let keys = text(Playback::MuJoCo, &sampled).unwrap();
    let value = |line: &str, key: &str| {
        line.split_once(&format!(" {key}=\"")).unwrap().1.split('"').next().unwrap().to_owned()
    };
    let lines: Vec<&str> = keys.lines().filter(|l| l.contains("<key ")).collect();
    assert_eq!(lines.len(), n);
    for (s, line) in lines.iter().enumerate() {
        let by_joint = |signal: &[f64]| (0..3).map(|c| signal[c * n + s]).collect::<Vec<f64>>();
        assert_eq!(value(line, "time").parse::<f64>().unwrap(), sampled.time[s]);
        assert_eq!(numbers(&value(line, "qpos"), ' '), by_joint(&sampled.q));
        assert_eq!(numbers(&value(line, "qvel"), ' '), by_joint(&sampled.dq));
    }
    let yaml = text(Playback::MoveIt, &sampled).unwrap();
    let (joints, other) = yaml
        .strip_prefix("joint_trajectory:\n")
        .unwrap()
        .split_once("multi_dof_joint_trajectory:\n")
        .unwrap();
    let unindented: String = joints.lines().map(|l| format!("{}\n", &l[2..])).collect();
    assert_eq!(unindented, JointTrajectory::new(&names(3), &sampled, Path::new("t")).unwrap().to_yaml());
    assert!(other.ends_with("  joint_names: []\n  points: []\n"));
}

#[test]
fn what_a_robot_cannot_play_is_refused() {
    let cases = [
        (Playback::UrScript, motion(7, 125.0, 0.1), "m: joints: expected 6, as the robot has, found 7"),
        (Playback::Fci, motion(6, 1000.0, 0.1), "m: joints: expected 7"),
        (Playback::Fri, motion(6, 1000.0, 0.1), "m: joints: expected 7"),
        (
            Playback::UrScript,
            motion(6, 120.0, 0.1),
            "m: rate: expected 500 Hz or a whole part of it, such as 250 or 125, found 120.000000",
        ),
        (Playback::UrScript, motion(6, 1000.0, 0.1), "m: rate: expected 500 Hz"),
        (Playback::UrScript, motion(6, 125.0, 1.0), "m: position of `j1`: expected at most one turn"),
        (
            Playback::Fci,
            motion(7, 1000.0, 0.3),
            "m: acceleration of `j1`: expected at most 15 rad/s², which libfranka takes",
        ),
    ];
    for (format, sampled, message) in cases {
        let error = text(format, &sampled).unwrap_err();
        assert!(error.starts_with(message) && error.contains("hint: other limits"), "{message}: {error}");
    }
    let mut moving = motion(6, 125.0, 0.1);
    moving.dq[0] = 0.25;
    let error = text(Playback::UrScript, &moving).unwrap_err();
    assert!(
        error.starts_with("m: first sample: expected a robot at rest, found 0.2500 rad/s of `j1`"),
        "{error}"
    );
    let mut jerky = motion(7, 1000.0, 0.1);
    jerky.ddq[500] += 9.0;
    let error = text(Playback::Fci, &jerky).unwrap_err();
    assert!(error.starts_with("m: jerk of `j1`: expected at most 7500 rad/s³"), "{error}");
    let mut broken = motion(6, 125.0, 0.1);
    broken.q[700] = f64::NAN;
    for format in [Playback::MoveIt, Playback::UrScript, Playback::MuJoCo] {
        let error = text(format, &broken).unwrap_err();
        assert!(error.starts_with("m: row 199, column `j3`: expected a finite number"), "{error}");
    }
    let none = Sampled { time: vec![], q: vec![], dq: vec![], ddq: vec![] };
    assert!(Playback::Fri.text(Path::new("m"), &[], &none).is_err());
    let long = Sampled {
        time: vec![0.0; 1_000_001],
        q: vec![0.0; 1_000_001],
        dq: vec![0.0; 1_000_001],
        ddq: vec![0.0; 1_000_001],
    };
    assert!(text(Playback::MuJoCo, &long).unwrap_err().starts_with("m: samples: expected 1 to 1000000"));
}
