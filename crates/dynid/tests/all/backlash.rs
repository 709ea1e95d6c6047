//! Backlash of a drive from a log, through the whole pipeline.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write;

use dynid::backlash::{BacklashVerdict, LogBacklash, backlash};
use dynid::config::{Config, LogConfig};
use dynid::identify;

use crate::support::{PANDA, UR10, run};

/// Writes the log of a horizontal joint: motor and link with a gap between stiff flanks, in a position loop.
fn write_log(path: &std::path::Path, gap: f64) {
    let (link, motor, stiffness, damping) = (1.0, 0.5, 3e5, 200.0);
    let sizes = [0.5, 0.25, 0.17, 0.12, 0.1];
    let reference = |t: f64| {
        sizes.iter().enumerate().fold([0.0; 3], |[q, v, a], (k, size)| {
            let w = std::f64::consts::TAU * 0.1 * (k + 1) as f64;
            let (sine, cosine) = (w * t + 0.9 * k as f64).sin_cos();
            [q + size * sine, v + size * w * cosine, a - size * w * w * sine]
        })
    };
    let mut noise = 1u64;
    let mut white = || {
        let mut sum = -6.0;
        for _ in 0..12 {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (noise >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    };
    let w = std::f64::consts::TAU * 20.0;
    let [q0, v0, _] = reference(0.0);
    let (mut theta, mut dtheta, mut q, mut dq) = (q0, v0, q0, v0);
    let mut text = String::from("time,q_j1,tau_j1\n");
    let h = 1e-5;
    for k in 0..30_000 {
        let [rq, rv, ra] = reference(f64::from(k) * 1e-3);
        let effort = 1.5 * (w * w * (rq - theta) + 1.4 * w * (rv - dtheta) + ra) + 3.0 * (rv / 1e-3).tanh();
        let position = ((theta + 1e-6 * white()) / 5e-6).round() * 5e-6;
        writeln!(text, "{:.3},{position:.7},{:.6}", f64::from(k) * 1e-3, effort + 0.3 * white()).unwrap();
        for _ in 0..100 {
            let twist = theta - q;
            let beyond = twist - twist.clamp(-0.5 * gap, 0.5 * gap);
            let pressed = stiffness * beyond + damping * (dtheta - dq);
            let torque = if beyond * pressed > 0.0 { pressed } else { 0.0 };
            dtheta += h * (effort - torque - 3.0 * (dtheta / 1e-3).tanh()) / motor;
            dq += h * torque / link;
            theta += h * dtheta;
            q += h * dq;
        }
    }
    std::fs::write(path, text).unwrap();
}

fn look(config: &Config) -> Vec<LogBacklash> {
    let estimate = identify(config, &mut |_| {}).unwrap().estimate();
    let logs: Vec<LogConfig> = config.training_logs();
    let found =
        backlash((&estimate, "estimate.json".as_ref()), &logs, &config.columns, config.motor_side.as_ref());
    found.unwrap()
}

/// The inertia of a single horizontal joint cannot be told from its rotor's: both are stated, as data sheets have them.
const ROBOT: &str = r#"
schema = 1
name = "one"
gravity = [0, 0, -9.80665]

[[body]]
name = "arm"
parent = "ground"
joint = { name = "j1", kind = "revolute", axis = [0, 0, 1] }
mass = 5.0
com = [0, 0, 0]
inertia_com = [0.6, 0, 0, 0.6, 0, 1.0]

[element.j1]
rotor = { inertia = 0.5 }
"#;

#[test]
fn a_gap_between_motor_and_link_is_found_and_none_where_there_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("one.toml");
    std::fs::write(&robot, ROBOT).unwrap();
    for gap in [0.0, 1e-3] {
        let log = folder.path().join("log.csv");
        write_log(&log, gap);
        let config = Config {
            robot: robot.clone(),
            log: vec![LogConfig { path: log, ..LogConfig::default() }],
            ..Config::default()
        };
        let found = &look(&config)[0].joints[0];
        println!("{found:?}");
        assert_eq!((found.joint.as_str(), found.unit), ("j1", "rad"));
        if gap == 0.0 {
            assert_eq!((found.verdict, found.gap), (BacklashVerdict::NotFound, None));
            assert!(found.would_show.unwrap() < 5e-3);
            continue;
        }
        assert_eq!(found.verdict, BacklashVerdict::Found);
        // The prior shares the inertia between link and rotor.
        assert!((found.gap.unwrap() / gap).ln().abs() < 0.15, "{:?}", found.gap);
        let (level, most) = found.profile.iter().fold((0.0, 0.0), |m, p| if p.1 > m.1 { *p } else { m });
        assert!(level.abs() < 0.3 && most > 2.0 * found.elsewhere.unwrap(), "{level} {most}");
    }
}

/// Robots with harmonic drives and without backlash show none.
#[test]
fn recorded_robots_show_no_gap() {
    for text in [PANDA, UR10] {
        let Some((config, id)) = run(text) else { return };
        let estimate = id.estimate();
        let logs = config.training_logs();
        let found = backlash((&estimate, "estimate.json".as_ref()), &logs, &config.columns, None).unwrap();
        for joint in &found[0].joints {
            println!(
                "{}: {:?} {:.1} {:?} {:?}",
                joint.joint, joint.verdict, joint.evidence, joint.elsewhere, joint.would_show
            );
            assert_ne!(joint.verdict, BacklashVerdict::Found, "{}", joint.joint);
        }
    }
}
