//! Trajectory files: what is written reads back, published tables are understood, faults are named.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid_logs::trajectory::{
    JointTrajectory, Leg, TrajectoryFile, TrajectoryJoint, write_csv, write_ros_json, write_ros_yaml,
};
use dynid_logs::{ReadOptions, StateJoint, csv, states};
use dynid_motion::trajectory::{
    Form, Fourier, FourierTrajectory, Phase, Point, RowOrder, Sampled, Trajectory,
};
use serde_json::Value;

fn joint(name: &str, slides: bool) -> TrajectoryJoint {
    TrajectoryJoint { name: Some(name.to_owned()), slides }
}

fn file(form: Form) -> TrajectoryFile {
    let base = 0.1 * std::f64::consts::PI;
    let third = 1.0 / 3.0;
    let series = [
        Fourier::plain(base, 0.1, vec![third, -0.2], vec![1e-7, 0.7]).unwrap(),
        Fourier::plain(base, -third, vec![0.3, 1e-9], vec![-0.1, 0.05]).unwrap(),
    ];
    TrajectoryFile {
        robot: Some("arm.urdf".to_owned()),
        form,
        joints: vec![joint("turns \"a\"", false), joint("slides", true)],
        motion: FourierTrajectory::new(series.to_vec(), 3).unwrap(),
        approach: Some(Leg { pose: vec![0.0, 0.25], duration_s: 2.5 }),
        back: Some(Leg { pose: vec![0.1, 0.2], duration_s: third }),
        sample_rate_hz: Some(250.0),
    }
}

#[test]
fn coefficients_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.json");
    let plain = file(Form::Plain);
    plain.write(&path).unwrap();
    assert_eq!(TrajectoryFile::read(&path).unwrap(), plain);
    // Velocity amplitudes pass through a product and a quotient.
    let velocity = file(Form::VelocityAmplitudes);
    let back = TrajectoryFile::parse(&velocity.to_json(), "t").unwrap();
    let order = RowOrder::default();
    let rows = |f: &TrajectoryFile| f.motion.to_rows(Form::Plain, &order).unwrap().concat();
    for (x, y) in rows(&velocity).iter().zip(rows(&back)) {
        assert!((x - y).abs() <= 2.0 * f64::EPSILON * x.abs());
    }
    assert_eq!(
        (&back.joints, &back.approach, &back.back),
        (&velocity.joints, &velocity.approach, &velocity.back)
    );
    let bare = TrajectoryFile { robot: None, approach: None, back: None, sample_rate_hz: None, ..plain };
    assert_eq!(TrajectoryFile::parse(&bare.to_json(), "t").unwrap(), bare);
}

#[test]
fn the_sequence_is_approach_record_return() {
    let file = file(Form::Plain);
    let sequence = file.sequence().unwrap();
    assert!((sequence.duration() - (2.5 + 60.0 + 1.0 / 3.0)).abs() < 1e-12);
    let mut out = [Point::default(); 2];
    sequence.at(0.0, &mut out);
    assert_eq!(
        out,
        [Point { jerk: out[0].jerk, ..Point::rest(0.0) }, Point { jerk: out[1].jerk, ..Point::rest(0.25) }]
    );
    assert_eq!(sequence.phase(3.0), Phase::Record);
}

#[test]
fn published_tables_are_understood() {
    let table = |order: &str, unit: &str| {
        format!(
            r#"{{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": 0.5,
            "table": {{"order": "{order}", "rows": [[1, 2, 3, 4, 5], [6, 7, 8, 9, 10]]{unit}}}}}"#
        )
    };
    let read = |text: String| TrajectoryFile::parse(&text, "t").unwrap();
    let row = |f: &TrajectoryFile| f.motion.to_rows(Form::Plain, &RowOrder::default()).unwrap()[1].clone();
    let file = read(table("a,b,q0", ""));
    assert_eq!(row(&file), [10.0, 6.0, 7.0, 8.0, 9.0]);
    assert_eq!((file.joint_names(), file.motion.periods()), (vec!["q1".to_owned(), "q2".to_owned()], 1));
    assert_eq!(row(&read(table("q0,a1,b1,a2,b2", ""))), [6.0, 7.0, 9.0, 8.0, 10.0]);
    let degrees = read(table("q0,a,b", r#", "unit": "deg", "names": ["x", "y"]"#));
    assert_eq!(row(&degrees)[0], 6f64.to_radians());
    assert_eq!(degrees.joint_names(), ["x", "y"]);
}

#[test]
fn faults_are_named_with_field_expected_and_found() {
    let sound = file(Form::Plain).to_json();
    assert!(TrajectoryFile::parse(&sound, "t").is_ok());
    let with = |from: &str, to: &str| {
        assert!(sound.contains(from), "{from} in {sound}");
        sound.replacen(from, to, 1)
    };
    let table = |table: &str| {
        format!(
            r#"{{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": 1, "table": {table}}}"#
        )
    };
    let cases: Vec<(String, &[&str])> = vec![
        (String::new(), &["t.json:1"]),
        (sound[..sound.len() / 2].to_owned(), &["t.json:", "EOF"]),
        ("[1, 2]".to_owned(), &["schema", "dynid-trajectory/1", "none"]),
        (
            with("dynid-trajectory/1", "dynid-estimate/1"),
            &["schema", "dynid-trajectory/1", "dynid-estimate/1"],
        ),
        (with("\"periods\"", "\"period\""), &["unknown field `period`", "`periods`"]),
        (with("\"form\": \"plain\"", "\"form\": \"fourier\""), &["`fourier`", "`velocity_amplitudes`"]),
        (with("\"unit\": \"m\"", "\"unit\": \"mm\""), &["`mm`", "`deg`"]),
        (with("\"periods\": 3", "\"periods\": 0"), &["periods", "at least 1", "0"]),
        (with("\"periods\": 3", "\"periods\": -3"), &["t.json:6", "-3"]),
        (with("\"periods\": 3", "\"periods\": 30000000"), &["periods", "3.2e7"]),
        (with("0.3141592653589793", "-1"), &["base_frequency_rad_s", "positive", "-1"]),
        (with("0.3141592653589793", "1e999"), &["t.json:", "out of range"]),
        (with("\"name\": \"slides\"", "\"name\": \"turns \\\"a\\\"\""), &["joints[1].name", "once"]),
        (with("      \"name\": \"slides\",\n", ""), &["joints[1].name", "none"]),
        (with("        0.05\n", "        0.05, 1\n"), &["joints[1].b", "2 amplitudes", "3"]),
        (with("    \"from\": [\n      0.0,", "    \"from\": ["), &["approach.from", "2 positions", "1"]),
        (with("\"duration_s\": 2.5", "\"duration_s\": 0"), &["approach.duration_s", "positive", "0"]),
        (with("250.0", "-1"), &["sample_rate_hz", "positive", "-1"]),
        (
            with("  \"joints\"", "  \"table\": {\"order\": \"q0,a,b\", \"rows\": []},\n  \"joints\""),
            &["table", "both"],
        ),
        (
            r#"{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": 1}"#.to_owned(),
            &["joints", "neither"],
        ),
        (table(r#"{"order": "q0,a", "rows": [[1, 2, 3]]}"#), &["order", "`q0,a`"]),
        (table(r#"{"order": "q0,a,b", "rows": [[1, 2]]}"#), &["odd number", "2"]),
        (table(r#"{"order": "q0,a,b", "rows": []}"#), &["coordinates", "at least 1"]),
        (table(r#"{"order": "q0,a,b", "rows": [[1, 2, 3], [1]]}"#), &["table.rows[1]", "3 numbers", "1"]),
        (table(r#"{"order": "q0,a1..a5,b1..b5", "rows": [[1, 2, 3]]}"#), &["harmonics", "5", "1"]),
        (table(r#"{"order": "q0,a,b", "rows": [[1, 2, 3]], "names": []}"#), &["table.names", "1 names", "0"]),
        (table(r#"{"order": "q0,a,b", "rows": [[1, 2, null]]}"#), &["t.json:1", "null"]),
    ];
    for (text, parts) in cases {
        let error = TrajectoryFile::parse(&text, "t.json").unwrap_err();
        let message = error.to_string();
        assert!(message.starts_with("t.json"), "{message}");
        assert!(!message.contains('\n') && message.len() < 400 && error.hint().is_some(), "{message}");
        for part in parts {
            assert!(message.contains(part), "`{part}` in `{message}`");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let binary = folder.path().join("t.json");
    std::fs::write(&binary, b"\xff\xfe").unwrap();
    assert!(TrajectoryFile::read(&binary).unwrap_err().to_string().contains("byte 0"));
    let gone = TrajectoryFile::read(folder.path().join("gone.json")).unwrap_err();
    assert_eq!(gone.hint().unwrap(), "check the path");
    assert!(TrajectoryFile::read(folder.path()).is_err());
}

fn sampled() -> (Vec<String>, Sampled, Vec<Phase>) {
    let file = file(Form::Plain);
    let sequence = file.sequence().unwrap();
    let sampled = Sampled::at_rate(&sequence, 3.0).unwrap();
    let phases = sampled.time.iter().map(|t| sequence.phase(*t)).collect();
    (vec!["elbow".to_owned(), "lift: \"x\" #1".to_owned()], sampled, phases)
}

#[test]
fn tables_read_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("samples.csv");
    let (_, sampled, phases) = sampled();
    let joints = ["elbow".to_owned(), "lift".to_owned()];
    write_csv(&path, &joints, &sampled, Some(&phases)).unwrap();
    let table = csv::read(&path, &ReadOptions::default()).unwrap();
    assert_eq!(
        table.header,
        ["t", "q_elbow", "q_lift", "dq_elbow", "dq_lift", "ddq_elbow", "ddq_lift", "phase"]
    );
    let numbers: Vec<f64> = phases.iter().map(|p| f64::from(p.number())).collect();
    assert_eq!(table.column("phase").unwrap(), numbers);
    assert!([0.0, 1.0, 2.0].iter().all(|p| numbers.contains(p)));
    let joints = joints.map(StateJoint::Scalar);
    let states = states::read(&path, &joints, &ReadOptions::default()).unwrap();
    assert_eq!(states.position.concat(), sampled.q);
    assert_eq!(states.velocity.concat(), sampled.dq);
    assert_eq!(states.acceleration.concat(), sampled.ddq);
    let one = ["elbow".to_owned()];
    assert!(write_csv(folder.path().join("no.csv"), &one, &sampled, None).is_err());
    assert!(!folder.path().join("no.csv").exists());
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn ros_messages_hold_the_samples_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.json");
    let (joints, sampled, _) = sampled();
    write_ros_json(&path, &joints, &sampled).unwrap();
    let message: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    assert_eq!(message["header"]["stamp"]["sec"], 0);
    assert_eq!(message["joint_names"][1], joints[1].as_str());
    let points = message["points"].as_array().unwrap();
    assert_eq!(points.len(), sampled.samples());
    for (s, point) in points.iter().enumerate() {
        for (key, signal) in
            [("positions", &sampled.q), ("velocities", &sampled.dq), ("accelerations", &sampled.ddq)]
        {
            let expected: Vec<f64> = (0..2).map(|c| signal[c * sampled.samples() + s]).collect();
            assert_eq!(numbers(&point[key]), expected);
        }
        assert_eq!(point["effort"].as_array().unwrap().len(), 0);
        let time = point["time_from_start"]["sec"].as_f64().unwrap()
            + 1e-9 * point["time_from_start"]["nanosec"].as_f64().unwrap();
        assert!((time - sampled.time[s]).abs() <= 0.5001e-9);
    }
}

/// The YAML is flow sequences of numbers, so its lines are nearly JSON and can be read back as such.
#[test]
fn ros_yaml_holds_the_samples_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.yaml");
    let (joints, sampled, _) = sampled();
    write_ros_yaml(&path, &joints, &sampled).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text, JointTrajectory::new(&joints, &sampled, Path::new("t")).unwrap().to_yaml());
    let lists = |key: &str| -> Vec<f64> {
        let lines = text.lines().filter_map(|l| l[2..].strip_prefix(key));
        lines.flat_map(|l| numbers(&serde_json::from_str(l).unwrap())).collect()
    };
    let n = sampled.samples();
    let by_sample =
        |signal: &[f64]| -> Vec<f64> { (0..n).flat_map(|s| [signal[s], signal[n + s]]).collect() };
    assert_eq!(lists("positions: "), by_sample(&sampled.q));
    assert_eq!(lists("velocities: "), by_sample(&sampled.dq));
    assert_eq!(lists("accelerations: "), by_sample(&sampled.ddq));
    assert!(
        text.starts_with("header:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: ''\njoint_names: [\"elbow\", ")
    );
    assert_eq!(text.lines().filter(|l| *l == "  effort: []").count(), n);
}
