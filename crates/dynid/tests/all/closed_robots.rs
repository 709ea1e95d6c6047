//! Mechanisms with loops, from robot file to identified parameters and back.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use std::path::{Path, PathBuf};

use dynid::estimators::distribution::t_quantile;
use dynid::model::closed::ClosedDynamics;
use dynid::model::{EffortModel, MotionBlock};
use dynid::simulate::{SimulateMode, SimulateSettings, simulate};
use dynid::{Config, Robot, RobotOptions};
use dynid::{Run, identify};

use crate::support::write_log;

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

/// Identifies a robot from logs of fast random motions, one per seed; truth in the order of the parameters.
fn identified(name: &str, test: &str, elements: &str, seeds: &[u64]) -> (Run, Vec<f64>) {
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
        write_log(&log, &path);
        text.push_str(&format!("[[log]]\npath = {path:?}\n"));
        truth = log.truth;
    }
    let config = Config::parse(&text, &folder.join("run.toml").display().to_string()).unwrap();
    let id = identify(&config, &mut |_| ()).unwrap();
    let value = |name: &String| truth.iter().find(|(n, _)| n == name).map_or(0.0, |(_, v)| *v);
    let values = id.model.parameters().linear.iter().map(|p| value(&p.name)).collect();
    std::fs::remove_dir_all(folder).unwrap();
    (id, values)
}

/// Errors of base parameters are as large as their standard deviations say.
fn check_errors(name: &str, id: &Run, truth: &[f64]) {
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
#[ignore = "half a minute; the ordinary run takes the delta"]
fn a_stewart_platform_gives_its_base_parameters_back_within_their_deviations() {
    let (id, truth) = identified("stewart", "stewart", r#"["coulomb", "viscous"]"#, &[1, 2, 3, 4]);
    assert_eq!(id.base.len(), 88 + 12);
    check_errors("stewart", &id, &truth);
}

/// A robot file of this repository with a line replaced.
fn changed(name: &str, from: &str, to: &str) -> Result<Robot, String> {
    let text = std::fs::read_to_string(robot_file(name)).unwrap();
    assert!(text.contains(from), "{from}");
    let text = text.replace(from, to);
    Robot::parse(&text, Path::new("robot.toml"), &RobotOptions::default()).map_err(|e| e.to_string())
}

#[test]
fn too_few_drives_open_loops_and_internal_loads_are_named() {
    let few = changed("fivebar", "\"left_crank\", \"right_crank\"", "\"left_crank\"").unwrap_err();
    assert!(few.contains("1 driven joints") && few.contains("`right_crank`"), "{few}");
    let open = changed("fourbar", "a_xyz = [0.35", "a_xyz = [3.35").unwrap_err();
    assert!(open.contains("loop `C` does not close") && open.contains("3000.0000 mm"), "{open}");
    let over = changed("fourbar", "actuated = [\"crank\"]", "actuated = [\"crank\", \"rocker\"]").unwrap();
    assert!(over.warnings.iter().any(|w| w.contains("2 drives for 1 free motions")), "{:?}", over.warnings);
    let refused = simulate(&over, &SimulateSettings::default()).unwrap_err().to_string();
    assert!(refused.contains("internal load") && refused.contains("crank, rocker"), "{refused}");
    let spatial = changed("fourbar", "planar_revolute", "revolute").unwrap();
    assert!(spatial.warnings.iter().any(|w| w.contains("5 conditions of which 2")), "{:?}", spatial.warnings);
}

#[test]
fn rows_that_the_mechanism_cannot_follow_are_named() {
    let folder = folder("poses");
    let (robot, log) = (load("fivebar"), folder.join("log.csv"));
    let mut made = simulate(&robot, &SimulateSettings::default()).unwrap();
    made.position[0][700] += 3.0;
    write_log(&made, &log);
    let text = format!("robot = {:?}\n[[log]]\npath = {log:?}\n", robot_file("fivebar"));
    let config = Config::parse(&text, "run.toml").unwrap();
    let error = identify(&config, &mut |_| ()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("row 701") && message.contains("`tool_pin`"), "{message}");
    assert!(error.hint().is_some());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_controlled_delta_is_identified_and_comes_back_as_urdf_and_loops() {
    let (robot, folder) = (load("delta"), folder("round"));
    let settings = SimulateSettings {
        mode: SimulateMode::ClosedLoop,
        duration_s: 10.0,
        period_s: Some(5.0),
        acceleration: 30.0,
        ..SimulateSettings::default()
    };
    let path = folder.join("log.csv");
    write_log(&simulate(&robot, &settings).unwrap(), &path);
    let text = format!("robot = {:?}\n[[log]]\npath = {path:?}\n", robot_file("delta"));
    let id = identify(&Config::parse(&text, "run.toml").unwrap(), &mut |_| ()).unwrap();
    let urdf = id.robot_file().unwrap();
    assert!(urdf.difference < 1e-6, "{}", urdf.difference);
    std::fs::write(folder.join("delta.urdf"), &urdf.text).unwrap();
    let loops = id.loops("delta.urdf").unwrap().unwrap();
    std::fs::write(folder.join("delta.loops.toml"), loops).unwrap();
    let back = Robot::load(&folder.join("delta.loops.toml"), &RobotOptions::default()).unwrap();
    let (found, expected) = (back.closed.unwrap(), robot.closed.unwrap());
    assert_eq!(found.driven_names(), expected.driven_names());
    assert_eq!(found.closures().len(), 3);
    for (a, b) in found.home().iter().zip(expected.home()) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// States name the drives, whose efforts are those of the mechanism whatever the order of its joints; a pose out of reach is an
/// error, not a number.
#[test]
fn states_of_a_stewart_platform_are_those_of_its_drives() {
    let robot = load("stewart");
    let names: Vec<String> = (1..=6).map(|k| format!("rod{k}")).collect();
    let table = |first: f64| {
        let header =
            |signal: &str| names.iter().map(|n| format!("{signal}_{n}")).collect::<Vec<_>>().join(",");
        let row = |scale: f64| {
            let values = (0..18).map(|k| (scale * (0.3 + f64::from(k).sin())).to_string());
            values.collect::<Vec<_>>().join(",")
        };
        format!("{},{},{}\n{}\n{}\n", header("q"), header("dq"), header("ddq"), row(first), row(-0.03))
    };
    let folder = folder("states");
    let path = folder.join("states.csv");
    let read = |text: String| {
        std::fs::write(&path, text).unwrap();
        dynid::io::states::read(&path, &robot.state_joints(), &dynid::io::ReadOptions::default()).unwrap()
    };
    let model = robot.skeleton().unwrap();
    let values = robot.skeleton_values(&model);
    let states = read(table(0.02));
    let efforts = dynid::predict::efforts(&model, &values, &states).unwrap();
    let mut dynamics = ClosedDynamics::new(robot.closed.clone().unwrap());
    for row in 0..2 {
        let at = |signal: &[Vec<f64>]| signal.iter().map(|s| s[row]).collect::<Vec<f64>>();
        dynamics.reach(&at(&states.position)).unwrap();
        let (dq, ddq) = dynamics.motion(&at(&states.velocity), &at(&states.acceleration));
        let expected = dynamics.inverse_dynamics((&dq, &ddq), None, &robot.mechanism.inertia_vector());
        for (effort, expected) in efforts.iter().zip(expected.drives) {
            assert!(
                (effort[row] - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                "{} {expected}",
                effort[row]
            );
        }
    }
    let error = dynid::predict::efforts(&model, &values, &read(table(30.0))).unwrap_err().to_string();
    assert!(error.contains("states: row 1") && error.contains("ball"), "{error}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_block_may_begin_at_a_pose_that_is_not_straight_from_home() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/prr3.toml");
    let robot = Robot::load(&file, &RobotOptions::default()).unwrap();
    let machine = robot.closed.clone().unwrap();
    let skeleton = robot.skeleton().unwrap();
    let closed = skeleton.closed().unwrap();
    let (pose, still) = ([-0.5565, 0.2240, 0.6206], [0.0; 3]);
    let mut work = machine.workspace();
    // The straight way passes a singular pose.
    assert!(machine.reach(&mut work, &pose).is_err());
    let motion = MotionBlock::plain(1, &pose, &still, &still);
    closed.reachable(&motion).unwrap();
    let q = closed.joint_motion(&motion).q;
    machine.take(&mut work, &q).unwrap();
    assert!(q.iter().zip(work.positions()).all(|(a, b)| (a - b).abs() < 1e-10));
    // A pose that does not exist stays none.
    let far = [0.8, -0.8, 0.8];
    assert!(closed.reachable(&MotionBlock::plain(1, &far, &still, &still)).is_err());
}
