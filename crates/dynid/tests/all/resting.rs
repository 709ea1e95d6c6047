//! Logs in which joints stand: tests of single joints, moves from pose to pose, brakes.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig};
use dynid::model::{EffortModel, MotionBlock, RegressorBlock};
use dynid::robot::{Robot, RobotOptions};
use dynid::simulate::{SimulateMode, SimulateSettings, SimulatedLog, simulate};
use dynid::{Identification, identify};

use crate::support::{inside, write_log};

const RATE_HZ: f64 = 250.0;
const JOINTS: usize = 6;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn recorded(settings: SimulateSettings) -> SimulatedLog {
    let robot = Robot::load(&root().join("robots/indy7.toml"), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings { mode: SimulateMode::ClosedLoop, rate_hz: RATE_HZ, ..settings };
    simulate(&robot, &settings).unwrap()
}

/// All joints move.
fn excitation(duration_s: f64, seed: u64) -> SimulatedLog {
    recorded(SimulateSettings { duration_s, acceleration: 4.0, seed, ..SimulateSettings::default() })
}

/// A log along a table of positions, one row per sample.
fn along(folder: &Path, name: &str, q: &[[f64; JOINTS]]) -> SimulatedLog {
    let mut text = "t".to_owned();
    for of in ["q", "dq", "ddq"] {
        (1..=JOINTS).for_each(|joint| write!(text, ",{of}_j{joint}").unwrap());
    }
    text.push('\n');
    let at = |k: isize, joint: usize| q[k.clamp(0, q.len() as isize - 1) as usize][joint];
    for k in 0..q.len() as isize {
        write!(text, "{}", k as f64 / RATE_HZ).unwrap();
        let velocity = |joint: usize| 0.5 * RATE_HZ * (at(k + 1, joint) - at(k - 1, joint));
        let bend =
            |joint: usize| RATE_HZ * RATE_HZ * (at(k + 1, joint) - 2.0 * at(k, joint) + at(k - 1, joint));
        (0..JOINTS).for_each(|joint| write!(text, ",{}", at(k, joint)).unwrap());
        (0..JOINTS).for_each(|joint| write!(text, ",{}", velocity(joint)).unwrap());
        (0..JOINTS).for_each(|joint| write!(text, ",{}", bend(joint)).unwrap());
        text.push('\n');
    }
    let follow = folder.join(format!("{name}.csv"));
    std::fs::write(&follow, text).unwrap();
    recorded(SimulateSettings { follow: Some(follow), seed: 7, ..SimulateSettings::default() })
}

/// Appends a move of fifth order and a pause.
fn go(q: &mut Vec<[f64; JOINTS]>, to: [f64; JOINTS], move_s: f64, pause_s: f64) {
    let from = q.last().copied().unwrap_or(to);
    let steps = (move_s * RATE_HZ) as usize;
    for k in 1..=steps {
        let x = k as f64 / steps as f64;
        let way = x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
        q.push(std::array::from_fn(|j| from[j] + way * (to[j] - from[j])));
    }
    q.extend(std::iter::repeat_n(to, (pause_s * RATE_HZ) as usize));
}

const POSE: [f64; JOINTS] = [0.3, -0.4, 0.8, 0.2, 0.6, -0.3];

/// One joint goes forth and back at two speeds while the others hold still.
fn single(folder: &Path, joint: usize) -> SimulatedLog {
    let mut q = Vec::new();
    go(&mut q, POSE, 0.0, 0.5);
    for move_s in [2.0, 0.7] {
        for by in [0.7, 0.0, -0.7, 0.0] {
            let mut to = POSE;
            to[joint] += by;
            go(&mut q, to, move_s, 0.3);
        }
    }
    along(folder, &format!("single{joint}"), &q)
}

/// From pose to pose, two joints at a time, with pauses.
fn poses(folder: &Path) -> SimulatedLog {
    let (mut q, mut pose) = (Vec::new(), POSE);
    go(&mut q, pose, 0.0, 0.5);
    for step in 0..36 {
        for joint in [step % JOINTS, (5 * step + 2) % JOINTS] {
            pose[joint] = 1.1 * (1.7 * step as f64 + 2.1 * joint as f64).sin();
        }
        go(&mut q, pose, 0.9, 0.4);
    }
    along(folder, "poses", &q)
}

/// Identified by a robot file whose inertias are off.
fn identified(folder: &Path, logs: &[&SimulatedLog]) -> Identification {
    let path = |k: usize| folder.join(format!("log{k}.csv"));
    logs.iter().enumerate().for_each(|(k, log)| write_log(log, &path(k)));
    let log = (0..logs.len()).map(|k| LogConfig { path: path(k), ..LogConfig::default() }).collect();
    let config = Config { robot: root().join("examples/indy7/robot.toml"), log, ..Config::default() };
    identify(&config, &mut |_| {}).unwrap().identification
}

/// Error of the effort on a motion that was not fitted, at its true states where the joint moves: root mean square over joints of the error over the
/// effort.
fn error(id: &Identification, unseen: &SimulatedLog) -> f64 {
    let [q, dq, ddq, effort] = &unseen.clean;
    let samples = unseen.time.len();
    let (model, values) = id.identified_model();
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    let (q, flat_dq, ddq) = (q.concat(), dq.concat(), ddq.concat());
    let motion = MotionBlock::plain(samples, &q, &flat_dq, &ddq);
    model.regressor(&motion, &model.parameters().shape_start(), &mut block);
    let of_joint = |joint: usize| {
        let found = block.effort(joint, values);
        let moving = (0..samples).filter(|k| dq[joint][*k].abs() > 0.02);
        let (mut square, mut count) = (0.0, 0.0);
        for k in moving {
            square += (found[k] - effort[joint][k]).powi(2);
            count += 1.0;
        }
        square / count / (effort[joint].iter().map(|e| e * e).sum::<f64>() / samples as f64)
    };
    ((0..JOINTS).map(of_joint).sum::<f64>() / JOINTS as f64).sqrt()
}

/// Share of 95 % intervals that hold.
fn coverage(id: &Identification, log: &SimulatedLog) -> f64 {
    let (held, all) = inside(id, log);
    held as f64 / all as f64
}

#[test]
#[ignore = "half a minute; the ordinary run takes the recorded UR10e with such logs"]
fn logs_of_single_joints_add_to_a_log_of_all() {
    let folder = tempfile::tempdir().unwrap();
    let (all, unseen) = (excitation(15.0, 1), excitation(15.0, 2));
    let singles: Vec<SimulatedLog> = (0..JOINTS).map(|joint| single(folder.path(), joint)).collect();
    let alone = identified(folder.path(), &[&all]);
    let logs: Vec<&SimulatedLog> = std::iter::once(&all).chain(&singles).collect();
    let id = identified(folder.path(), &logs);
    let errors = [&alone, &id].map(|id| error(id, &unseen));
    let covered = coverage(&id, &all);
    println!(
        "error {:.4} alone, {:.4} with logs of single joints; kernels {:.1} and {:.1} Hz; {covered:.3} of the intervals hold",
        errors[0], errors[1], alone.kernel_hz, id.kernel_hz
    );
    assert!(errors[1] < errors[0], "more logs, less known");
    assert!(id.kernel_hz > 0.6 * alone.kernel_hz, "joints that stand are no reason to look away");
    assert!(covered >= 0.85, "{covered}");
    assert!(id.explained.iter().all(|explained| *explained));
    assert_ne!(id.estimate().verdict.status.word(), "fail");
    assert!(id.warnings.iter().all(|w| !w.message.contains("does not move")), "{:?}", id.warnings);
    // Nothing is said of columns by joints that hold still.
    assert!(id.findings.iter().all(|f| f.severity.word() != "error"), "{:?}", id.findings);
}

#[test]
#[ignore = "ten seconds; the ordinary run takes a log with brakes"]
fn moves_from_pose_to_pose_are_enough_for_the_joints_that_move() {
    let folder = tempfile::tempdir().unwrap();
    let (log, unseen) = (poses(folder.path()), excitation(15.0, 2));
    let id = identified(folder.path(), &[&log]);
    let (error, covered) = (error(&id, &unseen), coverage(&id, &log));
    let masks = &id.conditioning.as_ref().unwrap().mask;
    println!("error {error:.4}, {covered:.3} of the intervals hold, masks {masks:?}");
    assert!(error < 0.03 && covered >= 0.85, "{error} {covered}");
}

#[test]
fn a_joint_that_its_brake_holds_does_not_count() {
    let folder = tempfile::tempdir().unwrap();
    let all = excitation(15.0, 1);
    let mut braked = single(folder.path(), 5);
    for joint in 0..3 {
        let q = braked.position[joint][0];
        braked.position[joint].fill(q);
        braked.effort[joint].fill(0.0);
    }
    let alone = identified(folder.path(), &[&all]);
    let both = identified(folder.path(), &[&all, &braked]);
    let at = |id: &Identification, name: &str| {
        let table = &id.model.parameters().linear;
        id.consistent.values[table.iter().position(|p| p.name == name).unwrap()]
    };
    // Drives at rest with the arm held against gravity would be an arm without weight.
    for name in ["j2.fo", "j3.fo", "j2.fc"] {
        let (found, without) = (at(&both, name), at(&alone, name));
        assert!((found - without).abs() < 0.3, "{name}: {found} and {without} without that log");
    }
    assert_eq!(both.findings.iter().filter(|f| f.evidence.contains("brake")).count(), 3);
    assert_eq!(both.warnings.iter().filter(|w| w.message.contains("do not count")).count(), 3);

    // A joint that no log moves is not known by its brake.
    let path = folder.path().join("only.csv");
    write_log(&braked, &path);
    let config = Config {
        robot: root().join("examples/indy7/robot.toml"),
        log: vec![LogConfig { path, ..LogConfig::default() }],
        ..Config::default()
    };
    let refused = identify(&config, &mut |_| {}).unwrap_err().to_string();
    assert!(refused.contains("`j1` never changes"), "{refused}");
}

/// A column that hangs is still told: only what stands may be held.
#[test]
fn an_effort_that_never_changes_while_the_joint_moves_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = excitation(5.0, 1);
    log.effort[2].fill(1.5);
    let path = folder.path().join("log.csv");
    write_log(&log, &path);
    let config = Config {
        robot: root().join("examples/indy7/robot.toml"),
        log: vec![LogConfig { path, ..LogConfig::default() }],
        preflight: dynid::settings::Preflight::Warn,
        ..Config::default()
    };
    let refused = identify(&config, &mut |_| {}).unwrap_err().to_string();
    assert!(refused.contains("`j3` never changes"), "{refused}");
}
