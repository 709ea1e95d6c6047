//! What users may rely on in `dynid motion`: files, limits, exact speeds and radii, refusals, and that `simulate` and `friction` read it.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::process::Output;

use crate::support::{TWO_LINKS, indy7, run};
use dynid::io::csv::{ReadOptions, Table, read as table};
use dynid::model::{Vec3, dynamics::Dynamics};
use dynid::{Robot, RobotOptions};
use serde_json::Value;
use tempfile::TempDir;

const FILES: [&str; 5] =
    ["motion.json", "report.html", "trajectory.csv", "trajectory.ros2.json", "trajectory.ros2.yaml"];

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("indy7.toml"), indy7()).unwrap();
    std::fs::write(folder.path().join("arm.urdf"), TWO_LINKS).unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn prr3() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    std::fs::read_to_string(root.join("robots/prr3.toml")).unwrap()
}

fn samples(folder: &Path, name: &str) -> Table {
    table(folder.join(name), &ReadOptions::default()).unwrap()
}

fn record(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("out/motion.json")).unwrap()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Every limit of the record holds, and at every sample of the table.
#[track_caller]
fn check_limits(folder: &Path) {
    let (record, table) = (record(folder), samples(folder, "out/trajectory.csv"));
    let limits = record["limits"].as_array().unwrap();
    assert!(!limits.is_empty());
    for limit in limits {
        let number = |key: &str| limit[key].as_f64().unwrap();
        let (lower, upper) = (number("lower"), number("upper"));
        let slack = 1e-9 * (upper - lower);
        assert!(number("least") >= lower - slack && number("most") <= upper + slack, "{limit}");
        let prefix = match limit["quantity"].as_str().unwrap() {
            "position" => "q",
            "velocity" => "dq",
            "acceleration" => "ddq",
            _ => continue,
        };
        let column = table.column(&format!("{prefix}_{}", limit["joint"].as_str().unwrap())).unwrap();
        for x in column {
            assert!(*x >= number("least") - slack && *x <= number("most") + slack, "{limit}: {x}");
        }
    }
}

#[test]
fn sweeps_become_friction_laws_of_the_simulated_robot() {
    let folder = folder(&[("friction.toml", "robot = \"indy7.toml\"\n[[log]]\npath = \"log.csv\"\n")]);
    let at = folder.path();
    let speeds = [0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
    let list = speeds.map(|v| v.to_string()).join(",");
    let args = ["motion", "indy7.toml", "--sweep", "j1", "--sweep", "j2", "--speeds", &list];
    let output = run(at, &[&args[..], &["--range", "-1,1", "--out", "out", "--json"]].concat(), 0);
    let mut files: Vec<String> = std::fs::read_dir(at.join("out"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(files, FILES);
    assert_eq!(output.stdout, std::fs::read(at.join("out/motion.json")).unwrap());
    check_limits(at);
    let (record, table) = (record(at), samples(at, "out/trajectory.csv"));
    for (part, joint) in record["parts"].as_array().unwrap().iter().zip(["j1", "j2"]) {
        assert_eq!(part["joint"], joint);
        let passes = part["passes"].as_array().unwrap();
        assert_eq!(passes.len(), 2 * speeds.len());
        for (pass, expected) in passes.iter().zip(speeds.iter().flat_map(|v| [*v, -v])) {
            assert_eq!(pass["speed"].as_f64().unwrap(), expected);
            let [from, to] = ["from_s", "to_s"].map(|key| pass[key].as_f64().unwrap());
            assert!(to - from >= 0.6 - 1e-9);
            let (time, speed) = (table.column("t").unwrap(), table.column(&format!("dq_{joint}")).unwrap());
            let inside = |t: &f64| *t >= from - 1e-9 && *t <= to + 1e-9;
            for (_, v) in time.iter().zip(speed).filter(|(t, _)| inside(t)) {
                assert!((v - expected).abs() < 1e-12, "constant between {from} and {to} s: {v}");
            }
        }
    }
    // Both ends of the table rest at the start pose.
    for joint in 1..=6 {
        for prefix in ["q", "dq", "ddq"] {
            let column = table.column(&format!("{prefix}_j{joint}")).unwrap();
            assert_eq!((column[0], column[column.len() - 1]), (0.0, 0.0), "{prefix}_j{joint}");
        }
    }
    let simulate = ["simulate", "indy7.toml", "--follow", "out/trajectory.csv", "--out", "log.csv"];
    run(at, &[&simulate[..], &["--truth", "truth.json", "--quiet"]].concat(), 0);
    run(at, &["friction", "friction.toml", "--out", "friction", "--quiet"], 0);
    let json =
        |name: &str| -> Value { serde_json::from_slice(&std::fs::read(at.join(name)).unwrap()).unwrap() };
    let (found, truth) = (json("friction/friction.json"), json("truth.json"));
    let joints = found["joints"].as_array().unwrap();
    assert_eq!(joints.len(), 2, "no stretch of another joint counts");
    for (joint, name) in joints.iter().zip(["j1", "j2"]) {
        assert_eq!(joint["joint"], name);
        let points = joint["points"].as_array().unwrap();
        for (point, expected) in points.iter().zip(speeds) {
            let found = point["speed"].as_f64().unwrap();
            // A slope through samples of an encoder of 18 bits over half a second and more.
            assert!((found - expected).abs() < 1e-4 * expected + 1e-5, "{found} {expected}");
        }
        assert_eq!(points.len(), speeds.len());
        let coulomb = joint["coulomb"].as_f64().unwrap();
        let truth_of = |symbol: &str| truth[format!("{name}.{symbol}")].as_f64().unwrap();
        // Noise of 2 % of the rms effort, averaged over thousands of samples per pass.
        assert!((coulomb / truth_of("fc") - 1.0).abs() < 0.01, "{name}: {coulomb}");
        let viscous = joint["viscous"]["coefficient"].as_f64().unwrap();
        assert!((viscous / truth_of("fv") - 1.0).abs() < 0.01, "{name}: {viscous}");
    }
}

/// The Indy7 with bristles at its first joint: `σ0 = kappa fc = 16380`, `σ1 = 50`.
fn bristled() -> String {
    let text = indy7();
    let (before, rest) = text.split_once("[element.j1]\n").unwrap();
    let (_, after) = rest.split_once("[element.j2]").unwrap();
    let own = "[element.j1]\nelements = [\"lugre\", \"viscous\", \"offset\", \"rotor\"]\n\
               lugre = { coulomb = 9.1, sigma1 = 50, kappa = 1800, rho = 1.3, vs = 0.04 }\n\
               viscous = { coefficient = 24.6 }\nrotor = { inertia = 0.4 }\n";
    format!("{before}{own}[element.j2]{after}")
}

#[test]
fn small_sinusoids_become_bristles_of_the_simulated_robot() {
    let part = |part: &str| format!("robot = \"robot.toml\"\nsample_rate_hz = 1000\n[[part]]\n{part}\n");
    let sweep = part(
        "sweep = { joint = \"j1\", speeds = [0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.4, 0.8], range = [-1, 1], longest_s = 2 }",
    );
    let small =
        part("presliding = { joint = \"j1\", tones = [[3, 8e-4], [6.9, 3e-4]], duration_s = 5, fade_s = 1 }");
    let control = "mode = \"closed_loop\"\nperfect = true\n[control]\nbandwidth_hz = 20\n";
    // Inertia about the first joint with the arm stretched, by inverse dynamics.
    let friction = "robot = \"robot.toml\"\n[[log]]\npath = \"sweep.csv\"\njoint = \"j1\"\n[[presliding]]\npath = \"small.csv\"\njoint = \"j1\"\ninertia = 6.799\n";
    let folder = folder(&[
        ("robot.toml", &bristled()),
        ("sweep.toml", &sweep),
        ("small.toml", &small),
        ("control.toml", control),
        ("friction.toml", friction),
    ]);
    let at = folder.path();
    for name in ["sweep", "small"] {
        let (file, table, log) =
            (format!("{name}.toml"), format!("{name}/trajectory.csv"), format!("{name}.csv"));
        run(at, &["motion", &file, "--out", name, "--quiet"], 0);
        let follow = ["simulate", "robot.toml", "--follow", &table, "--out", &log, "--rate-hz", "1000"];
        run(at, &[&follow[..], &["--config", "control.toml", "--quiet"]].concat(), 0);
    }
    run(at, &["friction", "friction.toml", "--out", "out", "--quiet"], 0);
    let text = std::fs::read(at.join("out/friction.json")).unwrap();
    let found: Value = serde_json::from_slice(&text).unwrap();
    let bristle = &found["joints"][0]["bristle"];
    let [stiffness, damping] = ["sigma0", "sigma1"].map(|key| bristle[key].as_f64().unwrap());
    // The law of the steady speeds, which both are found beside, is off by some 0.5 %.
    assert!((stiffness / (1800.0 * 9.1) - 1.0).abs() < 0.02, "{stiffness}");
    assert!((damping / 50.0 - 1.0).abs() < 0.1, "{damping}");
}

const ALL: &str = r#"
robot = "braked.toml"
sample_rate_hz = 250
[start]
j2 = -0.4
j3 = -1.2
j5 = -1.0
[limits]
acceleration = 3.0
[[part]]
name = "warm-up"
repeat = 3
track = { points = [{ j1 = 0 }, { j1 = 0.8, j2 = -0.2 }, { j1 = -0.8, j3 = -1.5 }, { j1 = 0, j2 = -0.4, j3 = -1.2 }] }
[[part]]
pause_s = 2
[[part]]
sweep = { joint = "j1", speeds = [0.4], range = [-1, 1] }
[[part]]
presliding = { joint = "j2", tones = [[3, 1e-3], [6.9, 5e-4]], duration_s = 4 }
[[part]]
circle = { link = "link6", point = [0, 0, 0.1], radius = 0.1, normal = [0, 0.3, 1], turns = 2, turn_s = 6 }
[[load]]
joint = "j1"
brake = true
by_part = [0, 0, 5, 0, 0]
"#;

/// The Indy7 with a brake at its first joint.
fn braked() -> String {
    let text = indy7();
    let own = "[element.j1]\nelements = [\"coulomb\", \"viscous\", \"offset\", \"rotor\", \"external_load\"]\nexternal_load = { factor = 1, brake = true }\n";
    assert!(text.contains("[element.j1]\n"));
    text.replace("[element.j1]\n", own)
}

#[test]
fn parts_follow_each_other_within_limits_and_brakes_act() {
    let folder = folder(&[("motion.toml", ALL), ("braked.toml", &braked())]);
    let at = folder.path();
    let output = run(at, &["motion", "motion.toml", "--out", "out"], 0);
    assert!(stderr(&output).matches("warning").count() == 0, "{}", stderr(&output));
    check_limits(at);
    let (record, table) = (record(at), samples(at, "out/trajectory.csv"));
    let kinds: Vec<&str> =
        record["parts"].as_array().unwrap().iter().map(|p| p["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["track", "pause", "sweep", "presliding", "circle"]);
    let column = |name: &str| table.column(name).unwrap();
    let (part, load) = (column("part"), column("load_j1"));
    for k in 0..table.rows {
        // Constant within a part; on the ways between linear.
        let inside = part[k] > 0.0 && k + 1 < table.rows && part[k + 1] == part[k];
        if inside {
            assert_eq!(load[k], if part[k] == 3.0 { 5.0 } else { 0.0 }, "row {k}");
        }
        if part[k] == 4.0 {
            assert!((column("q_j2")[k] + 0.4).abs() <= 1.5e-3);
        }
    }
    // The point stays on its circle, by forward kinematics.
    let robot = Robot::load(&at.join("braked.toml"), &RobotOptions::default()).unwrap();
    let (mechanism, dynamics) = (&robot.mechanism, Dynamics::new(&robot.mechanism));
    let frame = mechanism.frame("link6").unwrap();
    let mut work = dynamics.workspace();
    let mut place = |q: &[f64]| {
        let body = dynamics.forward_kinematics(q, &mut work)[frame.body.unwrap()].then(&frame.placement);
        body.rotation.mul_vec(Vec3([0.0, 0.0, 0.1])) + body.translation
    };
    let centre = place(&[0.0, -0.4, -1.2, 0.0, -1.0, 0.0]);
    let mut on_circle = 0;
    for k in (0..table.rows).filter(|k| part[*k] == 5.0) {
        let q: Vec<f64> = (1..=6).map(|j| column(&format!("q_j{j}"))[k]).collect();
        let radius = (place(&q) - centre).norm();
        // The last row of the part is the first of the way back.
        assert!((radius - 0.1).abs() < 1e-9, "row {k}: {radius}");
        on_circle += 1;
    }
    // Two turns of 6 s and a blend of 1.5 s at 250 Hz.
    assert_eq!(on_circle, 3375);

    let simulate = ["simulate", "braked.toml", "--follow", "out/trajectory.csv", "--out", "log.csv"];
    let exact = ["--clean", "clean.csv", "--truth", "truth.json", "--rate-hz", "250", "--effort-noise", "0"];
    run(at, &[&simulate[..], &exact].concat(), 0);
    let clean = samples(at, "clean.csv");
    assert_eq!(clean.rows, table.rows);
    assert_eq!(clean.column("load_j1").unwrap(), load);
    let truth: Value = serde_json::from_slice(&std::fs::read(at.join("truth.json")).unwrap()).unwrap();
    let [fc, fv] = ["j1.fc", "j1.fv"].map(|name| truth[name].as_f64().unwrap());
    let mut braked = 0;
    for k in 0..table.rows {
        let (v, a) = (column("dq_j1")[k], column("ddq_j1")[k]);
        if part[k] == 3.0 && a == 0.0 && v != 0.0 && load[k] == 5.0 {
            // The axis of the first joint is upright: friction and brake are all there is.
            let effort = clean.column("tau_j1").unwrap()[k];
            assert!((effort - v.signum() * (fc + fv * v.abs() + 5.0)).abs() < 1e-9, "row {k}: {effort}");
            braked += 1;
        }
    }
    assert!(braked > 1000);
}

#[test]
fn a_controlled_robot_follows_a_motion() {
    let warm_up = ALL.split("[[part]]\npause_s").next().unwrap().replace("repeat = 3", "repeat = 1");
    let load = "[[load]]\njoint = \"j1\"\nbrake = true\nby_part = [5]\n";
    let folder = folder(&[("motion.toml", &(warm_up + load)), ("braked.toml", &braked())]);
    let at = folder.path();
    run(at, &["motion", "motion.toml", "--out", "out"], 0);
    let simulate = ["simulate", "braked.toml", "--follow", "out/trajectory.csv", "--closed-loop"];
    run(at, &[&simulate[..], &["--out", "driven.csv", "--rate-hz", "250"]].concat(), 0);
    let (wanted, driven) = (samples(at, "out/trajectory.csv"), samples(at, "driven.csv"));
    let time = driven.column("t").unwrap();
    assert!((time[time.len() - 1] - (wanted.rows - 1) as f64 / 250.0).abs() < 0.1);
    for joint in ["q_j1", "q_j2", "q_j3"] {
        let [wanted, driven] = [&wanted, &driven].map(|table| table.column(joint).unwrap());
        // Rows of the log jitter, and some are lost.
        let row = |t: f64| ((t * 250.0).round().max(0.0) as usize).min(wanted.len() - 1);
        let off = time.iter().zip(driven).map(|(t, q)| (wanted[row(*t)] - q).abs()).fold(0.0, f64::max);
        assert!(off < 0.1, "{joint} is {off} rad off its path");
    }
}

#[test]
fn the_platform_of_a_parallel_machine_moves_on_a_circle() {
    let text = "robot = \"prr3.toml\"\n[[part]]\ncircle = { link = \"platform\", centre = [-0.1, 0.32, 0], radius = 0.04, turns = 2, turn_s = 4 }\n";
    let folder = folder(&[("motion.toml", text), ("prr3.toml", &prr3())]);
    let at = folder.path();
    run(at, &["motion", "motion.toml", "--out", "out", "--rate-hz", "200"], 0);
    check_limits(at);
    let table = samples(at, "out/trajectory.csv");
    let robot = Robot::load(&at.join("prr3.toml"), &RobotOptions::default()).unwrap();
    let closed = robot.closed.as_ref().unwrap();
    let names = robot.mechanism.rate_names();
    let place = |name: &str| closed.position_of(names.iter().position(|n| n == name).unwrap());
    let [x, y, angle] = ["platform_x", "platform_y", "platform"].map(place);
    let mut pose = closed.workspace();
    let mut on_circle = 0;
    for k in 0..table.rows {
        let q: Vec<f64> = (1..=3).map(|j| table.column(&format!("q_slider{j}")).unwrap()[k]).collect();
        closed.reach(&mut pose, &q).unwrap();
        let at = pose.positions();
        if table.column("part").unwrap()[k] == 1.0 {
            let radius = (at[x] + 0.1).hypot(at[y] - 0.32);
            assert!((radius - 0.04).abs() < 1e-9, "row {k}: {radius}");
            assert!(at[angle].abs() < 1e-9, "the orientation is kept");
            on_circle += 1;
        }
    }
    assert_eq!(on_circle, 1800);
    run(at, &["simulate", "prr3.toml", "--follow", "out/trajectory.csv", "--out", "log.csv"], 0);
    assert!(samples(at, "log.csv").column("tau_slider1").unwrap().iter().all(|x| x.is_finite()));
    run(
        at,
        &["simulate", "prr3.toml", "--follow", "out/trajectory.csv", "--out", "c.csv", "--closed-loop"],
        0,
    );
}

#[test]
fn the_same_bytes_come_again() {
    let folder = folder(&[("motion.toml", &ALL.replace("braked", "indy7"))]);
    let at = folder.path();
    for out in ["out", "again"] {
        run(at, &["motion", "motion.toml", "--out", out, "--quiet"], 0);
    }
    for name in ["trajectory.csv", "trajectory.ros2.json", "trajectory.ros2.yaml"] {
        let of = |out: &str| std::fs::read(at.join(out).join(name)).unwrap();
        assert!(of("out") == of("again"), "{name}");
    }
}

#[test]
fn what_breaks_a_limit_is_refused_or_slower_on_demand() {
    let parts = [
        ("sweep = { joint = \"shoulder\", speeds = [3.5] }", "velocity of joint `shoulder`"),
        ("presliding = { joint = \"shoulder\", tones = [[5, 0.05]] }", "acceleration of joint `shoulder`"),
        (
            "track = { points = [{ elbow = 0 }, { elbow = 1 }, { elbow = -1 }], times_s = [0.2, 0.5] }",
            "acceleration of joint `elbow`",
        ),
    ];
    for (part, said) in parts {
        let folder = folder(&[(
            "motion.toml",
            &format!("robot = \"arm.urdf\"\nlimits.acceleration = 20\n[[part]]\n{part}\n"),
        )]);
        let at = folder.path();
        let refused = run(at, &["motion", "motion.toml", "--out", "out"], 2);
        let message = stderr(&refused);
        assert!(message.contains(said) && message.contains("slower = true"), "{message}");
        assert!(!at.join("out").exists());
        let output = run(at, &["motion", "motion.toml", "--out", "out", "--slower"], 0);
        assert!(stderr(&output).contains("times slower than asked for"));
        let slowed = record(at)["parts"][0]["slowed"].as_f64().unwrap();
        assert!(slowed > 1.0 && slowed < 20.0, "{slowed}");
        check_limits(at);
        // No slower than needed: some limit is used to the last per cent.
        let used = record(at)["limits"]
            .as_array()
            .unwrap()
            .iter()
            .map(|l| l["used"].as_f64().unwrap())
            .fold(0.0, f64::max);
        assert!(used > 0.97, "{used}");
    }
    // Positions are no matter of speed.
    let text = "robot = \"arm.urdf\"\nslower = true\n[[part]]\ntrack = { points = [{ elbow = 0 }, { elbow = 2.5 }] }\n";
    let folder = folder(&[("motion.toml", text)]);
    let message = stderr(&run(folder.path(), &["motion", "motion.toml"], 2));
    assert!(
        message.contains("position of joint `elbow`: expected -2.000000 to 2.000000, found 2.500000"),
        "{message}"
    );
}

#[test]
fn bad_motions_are_named() {
    let cases: [(&str, &str); 24] = [
        ("[[part]]\nsweep = { joint = \"wrist\", speeds = [0.1] }", "no joint is named `wrist`"),
        ("[[part]]\nsweep = { joint = \"elbow\", speeds = [0.1, nan] }", "part 1: sweep.speeds"),
        ("[[part]]\nsweep = { joint = \"elbow\", speeds = [-0.1] }", "part 1: sweep.speeds"),
        ("[[part]]\nsweep = { joint = \"elbow\", speeds = [] }", "part 1: sweep.speeds"),
        (
            "[[part]]\nsweep = { joint = \"elbow\", speeds = [2], range = [0, 0.5] }",
            "at least 0.6 s at constant speed",
        ),
        ("[[part]]\nsweep = { joint = \"elbow\", speeds = [2], range = [1, 0.5] }", "part 1: sweep.range"),
        (
            "[[part]]\nsweep = { joint = \"elbow\", speeds = [0.1], range = [0, 3] }",
            "position of joint `elbow`",
        ),
        (
            "[[part]]\nsweep = { joint = \"elbow\", speeds = [0.1], acceleration = 99 }",
            "the limit of `elbow`",
        ),
        ("[[part]]\npause_s = 1\n[[part]]\npause_s = -1", "part 2: pause_s"),
        ("[[part]]\npause_s = 1\ncircle = { radius = 1 }", "just one of `sweep`"),
        ("[[part]]\nrepeat = 0\npause_s = 1", "part 1: repeat"),
        ("[[part]]\nrepeat = 100000\npause_s = 1000", "samples of the whole motion"),
        ("", "at least one `[[part]]`"),
        ("[[part]]\npresliding = { joint = \"elbow\", tones = [[80, 1e-4]] }", "at least 800 Hz"),
        ("[[part]]\npresliding = { joint = \"elbow\", tones = [[3, 1e-4, 5]] }", "a list of 2 numbers"),
        ("[[part]]\ntrack = { points = [{ elbow = 0 }] }", "at least two points"),
        (
            "[[part]]\ntrack = { points = [{ elbow = 0 }, { elbow = 1 }], times_s = [1], blend_s = 2 }",
            "not below the blend",
        ),
        ("[[part]]\ncircle = { link = \"hand\", radius = 0.1 }", "hand"),
        ("[[part]]\ncircle = { link = \"forearm\", radius = -0.1 }", "part 1: circle.radius"),
        ("[[part]]\ncircle = { link = \"forearm\", radius = 0.1 }", "part 1 (circle)"),
        ("[start]\nelbow = 3\n[[part]]\npause_s = 1", "start.elbow"),
        (
            "[[part]]\npause_s = 1\n[[load]]\njoint = \"elbow\"\nbrake = true\npoints = [[0, -1]]",
            "load 1: points",
        ),
        (
            "[[part]]\npause_s = 1\n[[load]]\njoint = \"elbow\"\npoints = [[1, 1], [1, 2]]",
            "times that ascend",
        ),
        ("[[part]]\npause_s = 1\n[[load]]\njoint = \"elbow\"\nby_part = [1, 2]", "1 loads, one per part"),
    ];
    for (text, said) in cases {
        let folder = folder(&[("motion.toml", &format!("robot = \"arm.urdf\"\n{text}\n"))]);
        let output = run(folder.path(), &["motion", "motion.toml"], 2);
        let message = stderr(&output);
        assert!(message.contains(said), "{text}\n`{said}` in {message}");
        assert!(output.stdout.is_empty() && !folder.path().join("dynid-motion").exists());
    }
    let folder = folder(&[]);
    let at = folder.path();
    let message = stderr(&run(at, &["motion", "arm.urdf"], 2));
    assert!(message.contains("found a robot file") && message.contains("--sweep"), "{message}");
    run(at, &["motion", "arm.urdf", "--sweep", "elbow"], 2);
    let message =
        stderr(&run(at, &["motion", "arm.urdf", "--sweep", "elbow", "--speeds", "0.1", "--range", "1"], 2));
    assert!(message.contains("--range"), "{message}");
}

#[test]
fn tables_that_simulate_cannot_follow_are_named() {
    let folder = folder(&[
        (
            "loaded.csv",
            "t,q_shoulder,q_elbow,dq_shoulder,dq_elbow,ddq_shoulder,ddq_elbow,load_elbow\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1\n",
        ),
        ("short.csv", "t,q_shoulder,q_elbow,dq_shoulder,dq_elbow,ddq_shoulder\n0,0,0,0,0,0\n1,0,0,0,0,0\n"),
        ("other.csv", "t,q_shoulder,dq_shoulder,ddq_shoulder\n0,0,0,0\n1,0,0,0\n"),
        ("one.csv", "t,q_shoulder,q_elbow,dq_shoulder,dq_elbow,ddq_shoulder,ddq_elbow\n0,0,0,0,0,0,0\n"),
    ]);
    for (file, said) in [
        ("loaded.csv", "follow: load_elbow"),
        ("short.csv", "ddq_elbow: expected a column of this name"),
        ("other.csv", "a trajectory of joint `elbow`"),
        ("one.csv", "at least 2"),
        ("none.csv", "cannot be read"),
    ] {
        let output = run(folder.path(), &["simulate", "arm.urdf", "--follow", file, "--out", "log.csv"], 2);
        assert!(stderr(&output).contains(said), "{file}: {}", stderr(&output));
    }
}
