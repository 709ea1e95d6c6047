//! Drives from files of commands and positions, to the files that go into simulators.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write;
use std::path::Path;

use dynid::servo::{
    FoundDrives, ServoConfig, ServoEffortVerdict, ServoFile, ServoFiles, ServoVerdict, identify_servo,
};
use dynid::servo_fits::{Chain, Rollout, Scheme, ServoJoint, ServoLog, ServoValues, Simulated, Term};
use dynid::{Robot, RobotOptions};
use tempfile::TempDir;

/// Two links in a vertical plane and a finger that nobody logs.
pub(crate) const ARM: &str = r#"<robot name="servo_arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.15 0 0"/><mass value="1.2"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.12 0 0"/><mass value="0.8"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.005"/></inertial></link>
  <link name="tip"><inertial><origin xyz="0.02 0 0"/><mass value="0.05"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
  <joint name="lift" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/><dynamics damping="0.1" friction="0.05"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
  <joint name="finger" type="revolute"><parent link="fore"/><child link="tip"/><origin xyz="0.24 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="5" velocity="10"/></joint>
</robot>
"#;

/// True drives of lift and elbow.
fn truth() -> Vec<ServoJoint> {
    let joint = |kp: f64, rotor: f64, viscous: f64, coulomb: f64| {
        ServoJoint::default()
            .with(Term::PositionGain, kp)
            .with(Term::VelocityGain, 1.0)
            .with(Term::RotorInertia, rotor)
            .with(Term::Viscous, viscous)
            .with(Term::Coulomb, coulomb)
            .with(Term::Offset, 0.2)
            .with(Term::Delay, 0.008)
    };
    vec![joint(25.0, 0.02, 0.3, 0.4), joint(25.0, 0.01, 0.15, 0.2)]
}

/// A log of the arm as text: `t, cmd_*, q_*`.
fn log(seed: f64, rows: usize) -> String {
    log_of(truth(), seed, rows)
}

fn log_of(joints: Vec<ServoJoint>, seed: f64, rows: usize) -> String {
    // A link that swings takes finer steps than rows.
    let soft = joints.iter().any(|j| j.get(Term::Compliance) > 0.0);
    let step_s = if soft { 0.000_31 } else { Scheme::default().step_s };
    let locked = vec![("finger".to_owned(), 0.0)];
    let options = RobotOptions { locked, ..RobotOptions::default() };
    let robot = Robot::parse(ARM, Path::new("arm.urdf"), &options).unwrap();
    let wave = |k: usize, j: usize| {
        let t = k as f64 * 0.005;
        let f = [0.23, 0.61, 1.7, 3.9];
        let sum: f64 = f
            .iter()
            .map(|f| 0.4 / (1.0 + 1.5 * f) * (std::f64::consts::TAU * f * t + seed + j as f64).sin())
            .sum();
        sum + if j == 0 { 0.6 } else { 0.5 }
    };
    let command: Vec<Vec<f64>> = (0..2).map(|j| (0..rows).map(|k| wave(k, j)).collect()).collect();
    let time: Vec<f64> = (0..rows).map(|k| k as f64 * 0.005).collect();
    let mut log = ServoLog::new("log", time, command.clone(), command.clone());
    log.start = Some(command.iter().zip(&joints).map(|(c, joint)| joint.taken(c[0])).collect());
    let values = ServoValues { joints, inertias: robot.mechanism.inertia_vector() };
    let chains = Chain::all(&robot.mechanism);
    let step = std::f64::consts::TAU / 4096.0;
    let mut out = String::from("t,cmd_lift,cmd_elbow,q_lift,q_elbow\n");
    Rollout::new(&chains[0], Scheme { step_s, ..Scheme::default() }, &[])
        .run(&values, &log, |row| {
            let [a, b] = [0, 1].map(|j| (row.reading[j] / step).round() * step);
            let k = row.row;
            writeln!(out, "{},{},{},{a},{b}", k as f64 * 0.005, command[0][k], command[1][k]).unwrap();
        })
        .unwrap();
    out
}

/// The same log with the drives' efforts and currents: `tau_*` in N m with a noise of 0.05, `i_*` at 2 and 3 N m/A with one of 0.02.
pub(crate) fn log_with_efforts(seed: f64, rows: usize) -> String {
    let plain = log(seed, rows);
    let locked = vec![("finger".to_owned(), 0.0)];
    let options = RobotOptions { locked, ..RobotOptions::default() };
    let robot = Robot::parse(ARM, Path::new("arm.urdf"), &options).unwrap();
    let parsed: Vec<Vec<f64>> =
        plain.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().unwrap()).collect()).collect();
    let column = |c: usize| parsed.iter().map(|row| row[c]).collect::<Vec<f64>>();
    let command = vec![column(1), column(2)];
    let mut asked = ServoLog::new("log", column(0), command.clone(), command.clone());
    asked.start = Some(command.iter().map(|c| c[0]).collect());
    asked.effort = command;
    let values = ServoValues { joints: truth(), inertias: robot.mechanism.inertia_vector() };
    let mut efforts = vec![vec![0.0; rows]; 2];
    Rollout::new(&Chain::all(&robot.mechanism)[0], Scheme::default(), &[])
        .run_with_efforts(&values, &asked, |seen| {
            if let Simulated::Effort(seen) = seen {
                efforts[seen.joint][seen.row] = seen.effort;
            }
        })
        .unwrap();
    let mut state = 7_u64;
    let mut noise = || {
        let mut one = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 2f64.powi(53) - 0.5
        };
        (0..12).map(|_| one()).sum::<f64>()
    };
    let mut out = String::new();
    for (k, line) in plain.lines().enumerate() {
        if k == 0 {
            writeln!(out, "{line},tau_lift,tau_elbow,i_lift,i_elbow").unwrap();
            continue;
        }
        let [a, b] = [0, 1].map(|j| efforts[j][k - 1]);
        let mut noisy = |x: f64, size: f64| x + size * noise();
        let read = [noisy(a, 0.05), noisy(b, 0.05), noisy(a / 2.0, 0.02), noisy(b / 3.0, 0.02)];
        writeln!(out, "{line},{},{},{},{}", read[0], read[1], read[2], read[3]).unwrap();
    }
    out
}

/// A folder with the arm, two logs and a configuration.
pub(crate) fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("arm.urdf", ARM);
    write("a.csv", &log(0.3, 1600));
    write("b.csv", &log(2.1, 1200));
    write("tau.csv", &log_with_efforts(0.3, 1600));
    folder
}

fn config(folder: &TempDir, text: &str) -> ServoConfig {
    let path = folder.path().join("servo.toml");
    std::fs::write(&path, text).unwrap();
    ServoConfig::read(&path).unwrap()
}

const PLAIN: &str = "robot = \"arm.urdf\"\n[[log]]\npath = \"a.csv\"\n[[validation]]\npath = \"b.csv\"\n\
    [servo]\nvelocity_gain = 1.0\n";

#[test]
fn drives_are_found_and_the_files_say_so() {
    let folder = folder();
    let config = config(&folder, PLAIN);
    let found = identify_servo(&config, &mut |_| {}).unwrap();
    let files = found.files().unwrap();
    let file = found.file(&config, &files.notes);
    assert_eq!(file.joints, ["lift", "elbow"]);
    assert_eq!(file.law.additions, ["offset"], "{:?}", file.law.trials);
    assert!(file.fit.misfit.unwrap() < 1.1, "{:?}", file.fit);
    assert!(file.warnings.iter().any(|w| w.contains("finger")), "{:?}", file.warnings);
    let mut told = 0;
    for p in &file.parameters {
        let term = Term::named(&p.term).unwrap();
        let joint = usize::from(p.joints[0] == "elbow");
        let true_value = truth()[joint].get(term);
        assert!((p.value - true_value).abs() <= 0.03 * true_value.abs().max(1e-3), "{p:?} {true_value}");
        told += usize::from(p.verdict == ServoVerdict::Seen);
    }
    assert!(told >= file.parameters.len() - 1, "{:?}", file.parameters);
    for (rms, command) in file.validation[0].rms.iter().zip(&file.validation[0].command_rms) {
        assert!(rms.unwrap() < 0.02 * command, "{:?}", file.validation);
    }

    let names: Vec<&str> = files.files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["arm.urdf", "arm.mujoco.xml", "actuators.xml", "actuators.json", "actuators.h"]);
    assert_eq!(ServoFiles::names(&config.robot).unwrap(), names);
    let text = |name: &str| &files.files.iter().find(|(n, _)| n == name).unwrap().1;
    let dynamics = dynid::io::urdf::dynamics(text("arm.urdf"), "arm.urdf").unwrap();
    let lift = dynamics.iter().find(|d| d.joint == "lift").unwrap();
    assert!((lift.damping - 0.3).abs() < 0.01 && (lift.friction - 0.4).abs() < 0.01, "{lift:?}");
    // Everything but friction is the file as it was.
    assert!(text("arm.urdf").contains("<mass value=\"1.2\"/>"));
    let mjcf = dynid::io::mjcf::parse(text("arm.mujoco.xml"), "arm.mujoco.xml").unwrap();
    let elbow = mjcf.joints.iter().find(|j| j.joint == "elbow").unwrap();
    assert!((elbow.armature - 0.01).abs() < 5e-4, "{elbow:?}");
    assert_eq!(text("arm.mujoco.xml").matches("<general ").count(), 2);
    assert!(text("arm.mujoco.xml").contains("joint=\"finger\""), "the finger stays a joint");
    let table: serde_json::Value = serde_json::from_str(text("actuators.json")).unwrap();
    assert!((table["joints"][0]["delay"].as_f64().unwrap() - 0.008).abs() < 5e-4);
    let page = found.report(&file).unwrap();
    assert!(page.contains("Whole robot") && page.contains("elbow"));

    // The same bits whatever number of threads.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let again = alone.install(|| identify_servo(&config, &mut |_| {}).unwrap());
    assert_eq!(again.file(&config, &files.notes).to_json(), file.to_json());
}

#[test]
fn stated_gains_bring_the_robot_file_as_a_baseline_and_a_spread() {
    let folder = folder();
    let config = config(
        &folder,
        &format!("{PLAIN}position_gain = {{ lift = 25.0, elbow = 25.0 }}\nlaw = [\"offset\"]\n"),
    );
    let found = identify_servo(&config, &mut |_| {}).unwrap();
    let file = found.file(&config, &[]);
    let came = file.fit.robot_file_rms.as_ref().unwrap();
    assert!(came.iter().zip(&file.fit.rms).all(|(a, b)| *a > 3.0 * b), "{came:?} {:?}", file.fit.rms);
    let viscous = file.parameters.iter().find(|p| p.term == "viscous").unwrap();
    assert!(viscous.spread.gain > 0.0 && viscous.interval.unwrap().1 > 0.3, "{viscous:?}");
    assert!(!file.parameters.iter().any(|p| p.term == "position_gain"));
}

#[test]
fn bad_logs_are_refused_with_what_to_write() {
    let folder = folder();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let plain = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    write("nameless.csv", &plain.replace("cmd_", "told_"));
    let degrees: String = plain
        .lines()
        .enumerate()
        .map(|(k, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if k > 0 {
                for cell in &mut cells[1..3] {
                    *cell = (cell.parse::<f64>().unwrap() * 57.29578).to_string();
                }
            }
            cells.join(",") + "\n"
        })
        .collect();
    write("degrees.csv", &degrees);
    write("short.csv", &plain.lines().take(30).map(|l| format!("{l}\n")).collect::<String>());
    let run = |log: &str| {
        let text = format!("robot = \"arm.urdf\"\n[[log]]\npath = \"{log}\"\n");
        let error = identify_servo(&config(&folder, &text), &mut |_| {}).unwrap_err();
        format!("{error} | {}", error.hint().unwrap_or_default())
    };
    let nameless = run("nameless.csv");
    assert!(nameless.contains("no columns of commanded positions for lift, elbow"), "{nameless}");
    assert!(nameless.contains("position = \"cmd_{joint}\""), "{nameless}");
    let degrees = run("degrees.csv");
    assert!(degrees.contains("look like degrees") && degrees.contains("unit = \"deg\""), "{degrees}");
    let short = run("short.csv");
    assert!(short.contains("at least 50 rows, found 29"), "{short}");
    let gone = run("gone.csv");
    assert!(gone.contains("gone.csv"), "{gone}");
    // A command for one joint alone, and a validation log without a joint.
    let refused = |text: &str| identify_servo(&config(&folder, text), &mut |_| {}).unwrap_err().to_string();
    let one = refused(
        "robot = \"arm.urdf\"\n[command]\nposition = { lift = \"cmd_lift\" }\n[[log]]\npath = \"a.csv\"\n",
    );
    assert!(one.contains("elbow"), "{one}");
    write("half.csv", &plain.replacen("q_elbow", "other", 1));
    let half =
        refused("robot = \"arm.urdf\"\n[[log]]\npath = \"a.csv\"\n[[validation]]\npath = \"half.csv\"\n");
    assert!(half.contains("half.csv") && half.contains("elbow"), "{half}");
    let nothing = refused(
        "robot = \"arm.urdf\"\n[[log]]\npath = \"a.csv\"\n[[validation]]\npath = \"b.csv\"\npart = [0.5, 0.51]\n",
    );
    assert!(nothing.contains("at least 50 rows"), "{nothing}");
    let text = format!("{PLAIN}position_gain = {{ wrist = 3.0 }}\n");
    let unknown = identify_servo(&config(&folder, &text), &mut |_| {}).unwrap_err().to_string();
    assert!(unknown.contains("wrist"), "{unknown}");
}

#[test]
fn what_is_no_answer_fails() {
    let folder = folder();
    let plain = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let changed = |change: &dyn Fn(f64) -> f64| -> String {
        let line = |(k, line): (usize, &str)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            for cell in cells[3..].iter_mut().filter(|_| k > 0) {
                *cell = change(cell.parse().unwrap()).to_string();
            }
            cells.join(",") + "\n"
        };
        plain.lines().enumerate().map(line).collect()
    };
    let cases = [("mirrored", changed(&|x| -x), "check signs"), ("still", changed(&|_| 0.1), "hardly move")];
    for (name, text, words) in cases {
        std::fs::write(folder.path().join("odd.csv"), text).unwrap();
        let config =
            config(&folder, "robot = \"arm.urdf\"\n[[log]]\npath = \"odd.csv\"\n[servo]\nlaw = []\n");
        let found = identify_servo(&config, &mut |_| {}).unwrap();
        let file = found.file(&config, &[]);
        assert_eq!(file.status, dynid::record::Outcome::Fail, "{name}: {}", file.headline);
        assert!(file.headline.contains(words), "{name}: {}", file.headline);
        // A page is made all the same.
        assert!(found.report(&file).unwrap().contains("</html>"));
    }
}

#[test]
fn efforts_that_are_fed_forward_are_efforts() {
    // 40 N m beside limits of 3 rad: no position that looks like degrees.
    let folder = folder();
    let plain = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let more: String = plain
        .lines()
        .enumerate()
        .map(|(k, l)| format!("{l},{}\n", if k == 0 { "f1,f2" } else { "40,0" }))
        .collect();
    std::fs::write(folder.path().join("fed.csv"), more).unwrap();
    let text = "robot = \"arm.urdf\"\n[command]\neffort = { lift = \"f1\", elbow = \"f2\" }\n[[log]]\npath = \"fed.csv\"\n\
        [servo]\nvelocity_gain = 1.0\nlaw = [\"offset\"]\n";
    let found = identify_servo(&config(&folder, text), &mut |_| {}).unwrap();
    // A constant effort is an offset that the log takes back.
    let offset = found.found.values.joints[0].get(Term::Offset);
    assert!((offset - 40.2).abs() < 0.1, "{offset}");
}

#[test]
fn measured_efforts_and_currents_are_met_beside_positions() {
    let folder = folder();
    let head = "robot = \"arm.urdf\"\nlock = { finger = 0.0 }\n";
    let run = |text: &str| {
        let config = config(&folder, text);
        identify_servo(&config, &mut |_| {}).map(|found| (found.file(&config, &[]), found, config))
    };
    // Found by their names; nothing is known of the drives, and velocity gain and friction are told apart.
    let (file, found, _) =
        run(&format!("{head}[[log]]\npath = \"tau.csv\"\n[servo]\nlaw = [\"offset\"]\n")).unwrap();
    assert_eq!(file.fit.efforts.len(), 2, "{:?}", file.fit.efforts);
    for effort in &file.fit.efforts {
        assert_eq!((effort.channel.as_str(), effort.unit.as_str()), ("effort", "N m"));
        assert_eq!(effort.verdict, ServoEffortVerdict::Taken);
        assert!((effort.rms.unwrap() / 0.05 - 1.0).abs() < 0.1, "{effort:?}");
    }
    let value = |file: &ServoFile, term: &str, joint: &str| {
        let is =
            |p: &&dynid::servo::ServoParameterRecord| p.term == term && p.joints.iter().any(|j| j == joint);
        file.parameters.iter().find(is).unwrap_or_else(|| panic!("{term} of {joint}")).value
    };
    for joint in ["lift", "elbow"] {
        assert!((value(&file, "velocity_gain", joint) - 1.0).abs() < 0.03);
    }
    let report = found.report(&file).unwrap();
    assert!(report.contains("Effort in tau.csv"));
    assert!(report.contains("Measured efforts beside simulated ones"));
    // Currents on request, with constants that are found.
    let (file, found, _) = run(&format!(
        "{head}current = \"i_{{joint}}\"\n[[log]]\npath = \"tau.csv\"\n\
         [servo]\nlaw = [\"offset\"]\nfit = [\"current\"]\ngains = \"own\"\n"
    ))
    .unwrap();
    assert!(file.fit.efforts.iter().all(|e| e.channel == "current" && e.unit == "A"));
    for (joint, constant) in [("lift", 2.0), ("elbow", 3.0)] {
        assert!((value(&file, "torque_constant", joint) / constant - 1.0).abs() < 0.02);
    }
    let actuators = found.files().unwrap().files.into_iter().find(|(name, _)| name == "actuators.json");
    assert!(actuators.unwrap().1.contains("torque_constant"));
    // Logs need not measure the same, but one must have what is stated.
    let stated = "[columns]\neffort = \"tau_{joint}\"\n[[log]]\npath = \"a.csv\"\n";
    let more = "[[log]]\npath = \"tau.csv\"\n[servo]\nlaw = [\"offset\"]\n";
    let (file, ..) = run(&format!("{head}{stated}{more}")).unwrap();
    assert_eq!(file.fit.efforts.len(), 2);
    assert!(
        file.warnings.iter().any(|w| w.contains("no columns of efforts in a.csv")),
        "{:?}",
        file.warnings
    );
    let error = run(&format!("{head}{stated}")).unwrap_err();
    assert!(error.to_string().contains("tau_lift"), "{error}");
    // What is said of efforts without any is refused.
    for (key, line) in [("effort_at", "effort_at = \"link\""), ("torque_constant", "torque_constant = 2.0")] {
        let error = run(&format!("{head}[[log]]\npath = \"a.csv\"\n[servo]\n{line}\n")).unwrap_err();
        assert!(error.to_string().contains(key), "{error}");
    }
    let error =
        run(&format!("{head}[[log]]\npath = \"a.csv\"\n[servo]\nfit = [\"velocity\"]\n")).unwrap_err();
    assert!(error.to_string().contains("velocities"), "{error}");
    // Efforts of another size are told.
    let text = format!(
        "{head}[columns]\neffort = {{ columns = \"tau_{{joint}}\", scale = 3.0 }}\n\
         [[log]]\npath = \"tau.csv\"\n[servo]\nlaw = [\"offset\"]\n"
    );
    let (file, ..) = run(&text).unwrap();
    assert!(file.fit.efforts.iter().all(|e| e.verdict == ServoEffortVerdict::OtherSize));
    assert!(file.warnings.iter().any(|w| w.contains("not the size")), "{:?}", file.warnings);
    assert_eq!(file.status.word(), "warn");
}

#[test]
fn columns_of_other_names_and_units_are_read() {
    let folder = folder();
    let plain = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let head = "t,u1,u2,x1,x2\n";
    let other = plain.replacen("t,cmd_lift,cmd_elbow,q_lift,q_elbow\n", head, 1);
    std::fs::write(folder.path().join("other.csv"), other).unwrap();
    let text = "robot = \"arm.urdf\"\n[columns]\nposition = { lift = \"x1\", elbow = \"x2\" }\n\
        [command]\nposition = { lift = \"u1\", elbow = \"u2\" }\n[[log]]\npath = \"other.csv\"\n\
        [servo]\nvelocity_gain = 1.0\nlaw = [\"offset\"]\n";
    let found = identify_servo(&config(&folder, text), &mut |_| {}).unwrap();
    let named = format!("{PLAIN}law = [\"offset\"]\n");
    let same = identify_servo(&config(&folder, &named), &mut |_| {}).unwrap();
    assert_eq!(found.found.values, same.found.values);
}

#[test]
fn bodies_that_the_robot_file_has_wrong_are_found_and_go_where_they_are_used() {
    let folder = folder();
    // The file is off by a quarter in mass and by a fifth in the centre, links otherwise alike.
    let wrong = ARM
        .replace("xyz=\"0.15 0 0\"/><mass value=\"1.2\"", "xyz=\"0.18 0 0\"/><mass value=\"0.9\"")
        .replace("xyz=\"0.12 0 0\"/><mass value=\"0.8\"", "xyz=\"0.10 0 0\"/><mass value=\"1.0\"");
    assert_ne!(wrong, ARM);
    std::fs::write(folder.path().join("arm.urdf"), &wrong).unwrap();
    let known = "robot = \"arm.urdf\"\nlock = { finger = 0.0 }\n[[log]]\npath = \"a.csv\"\n[[validation]]\npath = \"b.csv\"\n\
        [servo]\nposition_gain = 25\ngain_error = 0.0\nvelocity_gain = 1.0\nlaw = [\"offset\"]\n";
    let of_file = identify_servo(&config(&folder, known), &mut |_| {}).unwrap();
    let asked = config(&folder, &format!("{known}bodies = \"found\"\n"));
    let result = identify_servo(&asked, &mut |_| {}).unwrap();
    assert!(of_file.found.misfit > 3.0 && result.found.misfit < 1.1, "{}", result.found.misfit);
    // On another motion, both joints together.
    let whole = |rms: &[f64]| rms.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (wrong, right) = (whole(&of_file.validation_rms[0]), whole(&result.validation_rms[0]));
    assert!(right < 0.5 * wrong, "{right} {wrong}");
    // What the logs tell is right: gravity tells the first moments of the arm along its links, the file's were off by 10 and 15 %.
    let options = RobotOptions { locked: vec![("finger".to_owned(), 0.0)], ..RobotOptions::default() };
    let robot = |text: &str| Robot::parse(text, Path::new("arm.urdf"), &options).unwrap();
    let truth = robot(ARM).mechanism.inertia_vector();
    let told: Vec<(usize, usize)> = result
        .found
        .bodies
        .iter()
        .flat_map(|b| (0..10).filter(|k| b.told[*k]).map(move |k| (b.body, k)))
        .collect();
    assert!(told.contains(&(1, 1)), "{told:?}");
    for (body, k) in told {
        let found = &result.found.bodies[body];
        let (value, half) = (found.inertia.0[k], found.half_width[k].unwrap());
        let true_value = truth[10 * body + k];
        assert!((value - true_value).abs() <= half, "{body} {k}: {value} ± {half}, truth {true_value}");
    }
    // The files, the result that is read again, and drives that are simulated have these bodies.
    let names = ServoFiles::names(&folder.path().join("arm.urdf")).unwrap();
    let files = result.files().unwrap();
    assert_eq!(
        files.files.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        names.iter().collect::<Vec<_>>()
    );
    let urdf = robot(&files.files[0].1).mechanism.inertia_vector();
    let found: Vec<f64> = (0..2).flat_map(|b| result.found.values.body(b).0).collect();
    for (a, b) in urdf.iter().zip(&found) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    let mjcf = Robot::parse(&files.files[1].1, Path::new("arm.xml"), &options).unwrap();
    for (a, b) in mjcf.mechanism.inertia_vector().iter().zip(&found) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    let path = folder.path().join("servo.json");
    let file = result.file(&asked, &files.notes);
    std::fs::write(&path, file.to_json()).unwrap();
    let again = FoundDrives::read(&path, &asked.robot, &Default::default(), None).unwrap();
    assert_eq!(again.robot.mechanism.inertia_vector(), found);
    // A file whose bodies are none of the robot's, or no bodies at all, is refused.
    let broken = |edit: &dyn Fn(&mut ServoFile)| {
        let mut file = file.clone();
        edit(&mut file);
        std::fs::write(&path, file.to_json()).unwrap();
        let read = FoundDrives::read(&path, &asked.robot, &Default::default(), None);
        read.err().map(|e| e.to_string()).unwrap()
    };
    assert!(broken(&|f| f.bodies[0].link = "other".to_owned()).contains("upper"));
    assert!(broken(&|f| f.bodies[0].parameters[0].value = -1.0).contains("upper"));
    assert!(broken(&|f| f.bodies[1].parameters.truncate(9)).contains("fore"));
}

#[test]
fn recorded_legs_and_a_hobby_arm_are_predicted() {
    let (Some(go2), Some(so101)) =
        (dynid_testing::shared("data/go2-inair"), dynid_testing::shared("data/so101-sage"))
    else {
        return;
    };
    // The first 70 % of one record of chirps; the rest is predicted from its own first row.
    let text = format!(
        "robot = \"{0}/go2_nomesh.xml\"\n[[log]]\npath = \"{0}/log.csv.gz\"\npart = [0.0, 0.7]\n\
         [servo]\nposition_gain = 20\nvelocity_gain = 1.5\nlaw = [\"offset\", \"load_friction\"]\n",
        go2.display()
    );
    let folder = tempfile::tempdir().unwrap();
    let found = identify_servo(&config(&folder, &text), &mut |_| {}).unwrap();
    let whole = format!("{text}[[validation]]\npath = \"{}/log.csv.gz\"\n", go2.display());
    let whole = identify_servo(&config(&folder, &whole), &mut |_| {}).unwrap();
    let (train, all) = (&found.found.rms, &whole.validation_rms[0]);
    // From errors of the first 70 % and of the whole that of the rest, one rollout from the first row.
    let rest = train.iter().zip(all).map(|(t, a)| (a * a - 0.7 * t * t) / 0.3).sum::<f64>() / 12.0;
    assert!(rest.sqrt() < 7.0e-3, "{}", rest.sqrt());
    let unstable = found.found.parameters.iter().filter(|p| p.half_width.is_none()).count();
    assert!(unstable > 0, "armatures and delays stand at bounds");

    let log = |name: &str| format!("path = \"{}/{name}.csv.gz\"\n", so101.display());
    let logs = ["multisine", "friction_gravity", "pick_place", "static_holding"]
        .map(|n| format!("[[log]]\n{}part = [0.0, 0.3]\n", log(n)));
    let held = ["step_response", "trapezoidal_profile"].map(|n| format!("[[validation]]\n{}", log(n)));
    let text = format!(
        "robot = \"{}/so_arm101.urdf\"\nlock = {{ gripper = 0.3 }}\n{}{}[servo]\nlaw = []\n",
        so101.display(),
        logs.concat(),
        held.concat()
    );
    let found = identify_servo(&config(&folder, &text), &mut |_| {}).unwrap();
    for (log, rms) in found.validation.iter().zip(&found.validation_rms) {
        let degrees = rms.iter().sum::<f64>() / 5.0 * 180.0 / std::f64::consts::PI;
        assert!(degrees < 0.6, "{}: {degrees}", log.name);
    }
}

/// What `dynid servo` leaves behind of a log of the arm, in its folder.
fn first_log(folder: &TempDir) -> std::path::PathBuf {
    let config =
        config(folder, "robot = \"arm.urdf\"\n[[log]]\npath = \"a.csv\"\n[servo]\nvelocity_gain = 1.0\n");
    let found = identify_servo(&config, &mut |_| {}).unwrap();
    let path = folder.path().join("first.json");
    std::fs::write(&path, found.file(&config, &[]).to_json()).unwrap();
    path
}

/// True drives as settings of a virtual log take them.
fn true_values() -> std::collections::BTreeMap<String, f64> {
    let of = |(name, joint): (&str, ServoJoint)| -> Vec<(String, f64)> {
        let known = |t: &Term| joint.get(*t).is_finite() && joint.get(*t) > 0.0;
        Term::ALL.into_iter().filter(known).map(|t| (format!("{name}.{t}"), joint.get(t))).collect()
    };
    ["lift", "elbow"].into_iter().zip(truth()).flat_map(of).collect()
}

#[test]
fn a_motion_designed_from_a_first_log_tells_more_and_what_it_promised() {
    use dynid::design::{DesignConfig, design};
    use dynid::simulate::{SimulateSettings, simulate_drives};

    let folder = folder();
    let drives = first_log(&folder);
    let text = "robot = \"arm.urdf\"\ndrives = \"first.json\"\n[limits]\nacceleration = 30\n\
        velocity = 5\n[safety]\nfloor = false\nself_collision = false\n[search]\nstarts = 2\n";
    let path = folder.path().join("design.toml");
    std::fs::write(&path, text).unwrap();
    let config = DesignConfig::read(&path).unwrap();
    let run = design(&config, &mut |_| {}).unwrap();
    let record = run.record(&config).unwrap();
    assert_eq!(record.joints, ["lift", "elbow"], "{:?}", record.verdict);
    assert!(record.random.as_ref().unwrap().geometric_ratio > 1.2, "{:?}", record.random);
    // The robot keeps what the command keeps.
    for joint in &record.followed.as_ref().unwrap().joints {
        assert!(
            joint.position[0] >= -3.0 && joint.position[1] <= 3.0 && joint.speed < 1.05 * 5.0,
            "{joint:?}"
        );
        assert!(joint.behind_rms > 0.05, "{joint:?}");
    }
    assert!(!record.verdict.warnings.iter().any(|w| w.contains("beyond")), "{:?}", record.verdict);

    // Played by the true drives, read back by the same columns.
    let motion = &run.outcome.as_ref().unwrap().motion;
    let file = |name: &str| folder.path().join(name);
    motion.file.write(file("trajectory.json")).unwrap();
    run.write_commands(&file("commands.csv")).unwrap();
    let settings = SimulateSettings {
        drives: Some(drives.clone()),
        follow: Some(file("trajectory.json")),
        rate_hz: 100.0,
        encoder_bits: 12,
        values: true_values(),
        ..SimulateSettings::default()
    };
    let made = simulate_drives(&file("arm.urdf"), &Default::default(), None, &settings).unwrap();
    let told = made.command.as_ref().unwrap();
    let commands = std::fs::read_to_string(file("commands.csv")).unwrap();
    assert_eq!(commands.lines().next(), Some("t,cmd_lift,cmd_elbow"));
    for (k, line) in commands.lines().skip(1).enumerate() {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        assert!((row[1] - told[0][k]).abs() < 1e-12 && (row[2] - told[1][k]).abs() < 1e-12, "{k}");
    }
    let mut log = String::from("t,cmd_lift,cmd_elbow,q_lift,q_elbow\n");
    for (k, t) in made.time.iter().enumerate() {
        let [a, b] = [0, 1].map(|j| made.position[j][k]);
        writeln!(log, "{t},{},{},{a},{b}", told[0][k], told[1][k]).unwrap();
    }
    std::fs::write(file("played.csv"), log).unwrap();
    let text = "robot = \"arm.urdf\"\n[[log]]\npath = \"played.csv\"\n[servo]\nvelocity_gain = 1.0\n";
    let servo = self::config(&folder, text);
    let found = identify_servo(&servo, &mut |_| {}).unwrap();
    let (first, _) = dynid::servo::ServoFile::read(&drives).unwrap();
    let played = found.file(&servo, &[]);
    let (mut gained, mut kept, mut scaled) = (0.0, 0, Vec::new());
    for p in &played.parameters {
        let term = Term::named(&p.term).unwrap();
        let joint = usize::from(p.joints[0] == "elbow");
        let (low, high) = p.interval.unwrap();
        kept += usize::from(low <= truth()[joint].get(term) && truth()[joint].get(term) <= high);
        let name = format!("{} {}", p.term, p.joints.join(", "));
        let forecast = record.parameters.iter().find(|f| f.name == name).unwrap();
        // The forecast's noise is the residual of the first log, which is the rounding.
        scaled.push(((p.value - truth()[joint].get(term)) / forecast.std).powi(2));
        let before = first.parameters.iter().find(|f| f.term == p.term && f.joints == p.joints).unwrap();
        gained += (before.model_std.unwrap() / p.model_std.unwrap()).ln();
        assert!((forecast.std / p.model_std.unwrap()).ln().abs() < 0.5_f64, "{name} {forecast:?} {p:?}");
    }
    let n = played.parameters.len();
    assert_eq!(n, 10);
    assert!(kept >= n - 1, "{:?}", played.parameters);
    let scaled = (scaled.iter().sum::<f64>() / n as f64).sqrt();
    assert!(scaled < 2.5, "errors are {scaled} times the forecast");
    // A first log of eight seconds with 1600 rows, beside 1001 rows.
    assert!((gained / n as f64).exp() > 1.2, "{}", (gained / n as f64).exp());
}

#[test]
fn a_robot_that_sags_below_what_its_command_keeps_is_told() {
    use dynid::design::{DesignConfig, design};
    use dynid::simulate::{SimulateSettings, simulate_drives};
    let folder = folder();
    first_log(&folder);
    let text = "robot = \"arm.urdf\"\ndrives = \"first.json\"\n[limits]\nacceleration = 20\nvelocity = 3\n\
        position = { lift = [-1.2, 1.2], elbow = [-1.2, 1.2] }\n[[keep]]\nframes = [\"fore\"]\npoint = [0.24, 0, 0]\nabove = -0.1\n\
        [safety]\nfloor = false\nself_collision = false\n[search]\nstarts = 1\n";
    let path = folder.path().join("design.toml");
    std::fs::write(&path, text).unwrap();
    let config = DesignConfig::read(&path).unwrap();
    let run = design(&config, &mut |_| {}).unwrap();
    assert!(run.outcome.as_ref().unwrap().broken.is_empty(), "the command keeps its limits");
    let record = run.record(&config).unwrap();
    // Played by the same drives, the end of the arm by two sines: joints turn about y, which takes x below.
    let motion = &run.outcome.as_ref().unwrap().motion;
    motion.file.write(folder.path().join("trajectory.json")).unwrap();
    let settings = SimulateSettings {
        drives: Some(folder.path().join("first.json")),
        follow: Some(folder.path().join("trajectory.json")),
        rate_hz: 100.0,
        ..SimulateSettings::default()
    };
    let made =
        simulate_drives(&folder.path().join("arm.urdf"), &Default::default(), None, &settings).unwrap();
    let [lift, elbow] = [0, 1].map(|j| &made.clean[0][j]);
    let heights = lift.iter().zip(elbow).map(|(a, b)| -(0.3 * a.sin() + 0.24 * (a + b).sin()));
    let below = -0.1 - heights.fold(f64::INFINITY, f64::min);
    let breaks = &record.followed.as_ref().unwrap().breaks;
    let [broken] = &breaks[..] else { panic!("{breaks:?}") };
    assert!(broken.subject == "fore" && below > 0.005, "{broken:?} {below}");
    // The steps of the forecast are four times as long: over twelve seeds that is up to 0.16 % of how far the arm sags.
    assert!((broken.by_m / below - 1.0).abs() < 4e-3, "{broken:?} {below}");
    assert_eq!(record.verdict.status, dynid::record::Outcome::Warn);
    assert!(record.verdict.headline.contains("for the command alone"), "{}", record.verdict.headline);
    assert!(record.verdict.warnings.iter().any(|w| w.contains("distance from a plane of fore")));
}

#[test]
fn designs_for_drives_say_what_they_need() {
    use dynid::design::{DesignConfig, design};
    let folder = folder();
    first_log(&folder);
    let fault = |text: &str| {
        let path = folder.path().join("design.toml");
        std::fs::write(&path, format!("robot = \"arm.urdf\"\nlocked = {{ finger = 0.0 }}\n{text}")).unwrap();
        let run = DesignConfig::read(&path).and_then(|config| design(&config, &mut |_| {}).map(drop));
        run.err().map_or_else(String::new, |e| e.to_string())
    };
    let cases = [
        ("[servo]\nvelocity_gain = 1.0\n", "servo.position_gain"),
        ("values = { \"lift.position_gain\" = 20.0 }\n[servo]\n", "none for `elbow`"),
        ("values = { \"lift.gain\" = 20.0 }\n[servo]\nposition_gain = 25\n", "values"),
        ("values = { \"lift.coulomb\" = -1.0 }\n[servo]\nposition_gain = 25\n", "at least 0"),
        ("values = { \"lift.position_gain\" = 9.0 }\n[servo]\nposition_gain = 25\n", "no guess beside"),
        ("drives = \"first.json\"\n[servo]\nposition_gain = 25\n", "both"),
        ("drives = \"arm.urdf\"\n", "expected a result of `dynid servo`"),
        ("drives = \"none.json\"\n", "none.json"),
        ("[servo]\nposition_gain = 25\n[criterion]\ncolumns = \"inertial\"\n", "criterion.columns"),
        ("[servo]\nposition_gain = 25\nfind_directions = true\n", "servo.find_directions"),
        ("[servo]\nposition_gain = 25\n[elements]\ndefault = [\"viscous\"]\n", "elements"),
        ("earlier = [\"a.json\"]\n[servo]\nposition_gain = 25\n", "earlier"),
    ];
    for (text, expected) in cases {
        let found = fault(text);
        assert!(found.contains(expected), "{text}: {found}");
    }
}

/// The elbow's drive takes commands from 0.2 to 0.7 rad; the log has what it was told.
#[test]
fn a_drive_that_clamps_its_commands_is_told_and_stated() {
    use dynid::simulate::{SimulateSettings, simulate_drives};
    let folder = folder();
    let mut joints = truth();
    joints[1].command_limits = (0.2, 0.7);
    std::fs::write(folder.path().join("clamped.csv"), log_of(joints, 0.3, 1600)).unwrap();
    let arm = ARM.replacen("lower=\"-3\" upper=\"3\"", "LIFT", 1).replacen(
        "lower=\"-3\" upper=\"3\"",
        "lower=\"0.15\" upper=\"0.75\"",
        1,
    );
    let arm = arm.replacen("LIFT", "lower=\"-3\" upper=\"3\"", 1);
    std::fs::write(folder.path().join("narrow.urdf"), arm).unwrap();
    let text = "robot = \"narrow.urdf\"\n[[log]]\npath = \"clamped.csv\"\n[servo]\nvelocity_gain = 1.0\nlaw = [\"offset\"]\n";
    let stated = format!("{text}command_limits = {{ elbow = [0.2, 0.7] }}\n");
    let [silent, stated] = [text, &stated].map(|text| {
        let config = config(&folder, text);
        let found = identify_servo(&config, &mut |_| {}).unwrap();
        let file = found.file(&config, &[]);
        (found, file)
    });
    let told = silent.0.warnings.join("\n");
    assert!(
        told.contains("`command_limits = { elbow = [0.1500, 0.7500] }`") && !told.contains("lift lie"),
        "{told}"
    );
    assert!(!stated.0.warnings.join("\n").contains("command_limits"));
    for (joint, name) in truth().iter().zip(["lift", "elbow"]) {
        for term in ["rotor_inertia", "viscous", "coulomb", "offset"] {
            let p = stated.1.parameters.iter().find(|p| p.term == term && p.joints == [name]).unwrap();
            let (low, high) = p.interval.unwrap();
            let true_value = joint.get(Term::named(term).unwrap());
            assert!(low <= true_value && true_value <= high, "{name} {term}: {low} to {high}, {true_value}");
        }
    }
    let rms = |file: &ServoFile| file.fit.rms[1];
    let floor = std::f64::consts::TAU / 4096.0 / 12.0_f64.sqrt();
    assert!(
        rms(&stated.1) < 1.3 * floor && rms(&silent.1) > 5.0 * floor,
        "{} {}",
        rms(&stated.1),
        rms(&silent.1)
    );

    // What was stated goes on: into simulations of these drives, and to simulators.
    let drives = folder.path().join("stated.json");
    std::fs::write(&drives, stated.1.to_json()).unwrap();
    let settings = SimulateSettings {
        drives: Some(drives),
        rate_hz: 100.0,
        duration_s: 20.0,
        ..SimulateSettings::default()
    };
    let made =
        simulate_drives(&folder.path().join("arm.urdf"), &Default::default(), None, &settings).unwrap();
    let most = |x: &[f64]| x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (told, done) = (most(&made.command.as_ref().unwrap()[1]), most(&made.position[1]));
    assert!(told > 0.9 && done < 0.75, "{told} {done}");
    let files = stated.0.files().unwrap();
    let of = |name: &str| files.files.iter().find(|(n, _)| n == name).map(|(_, text)| text.clone()).unwrap();
    assert!(
        of("actuators.xml").contains("joint=\"elbow\"")
            && of("actuators.xml").matches("ctrlrange=\"0.2 0.7\"").count() == 1
    );
    let table: serde_json::Value = serde_json::from_str(&of("actuators.json")).unwrap();
    assert_eq!(table["joints"][1]["command_limits"], serde_json::json!([0.2, 0.7]));
    assert!(table["joints"][0]["command_limits"].is_null());
    for (limits, part) in
        [("{ wrist = [0, 1] }", "wrist"), ("{ elbow = [1, 0] }", "two finite numbers that grow")]
    {
        let config = config(&folder, &format!("{text}command_limits = {limits}\n"));
        let error = identify_servo(&config, &mut |_| {}).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// The lift's gear gives way: its links swing at 7 Hz on a motor that stands.
fn soft() -> Vec<ServoJoint> {
    let mut joints = truth();
    joints[0] = joints[0].clone().with(Term::Compliance, 3e-3).with(Term::GearDamping, 0.6);
    joints
}

#[test]
fn a_gear_that_gives_way_goes_from_the_log_to_the_files_and_back() {
    use dynid::simulate::{SimulateSettings, simulate_drives};
    let folder = folder();
    std::fs::write(folder.path().join("soft.csv"), log_of(soft(), 0.4, 2400)).unwrap();
    let text = "robot = \"arm.urdf\"\n[[log]]\npath = \"soft.csv\"\n[servo]\nvelocity_gain = 1.0\nlaw = [\"offset\"]\n";
    let asked = config(&folder, &format!("{text}find = [\"compliance\", \"gear_damping\"]\n"));
    let found = identify_servo(&asked, &mut |_| {}).unwrap();
    let files = found.files().unwrap();
    let file = found.file(&asked, &files.notes);
    assert!(file.fit.misfit.unwrap() < 1.1, "{:?}", file.fit);
    let compliance = |joint: &str| {
        let is = |p: &&dynid::servo::ServoParameterRecord| p.term == "compliance" && p.joints[0] == joint;
        file.parameters.iter().find(is).unwrap()
    };
    let lift = compliance("lift");
    assert_eq!(lift.verdict, ServoVerdict::Seen, "{lift:?}");
    assert!((lift.value / 3e-3 - 1.0).abs() < 0.03, "{lift:?}");
    // The elbow's is stiff, and is not told from one that is nearly so.
    assert_ne!(compliance("elbow").verdict, ServoVerdict::Seen, "{:?}", compliance("elbow"));
    assert!(compliance("elbow").value < 5e-4, "{:?}", compliance("elbow"));
    let of = |name: &str| files.files.iter().find(|(n, _)| n == name).map(|(_, text)| text.clone()).unwrap();
    let mjcf = of("arm.mujoco.xml");
    assert!(mjcf.contains("<joint name=\"lift_gear\" type=\"hinge\""), "{mjcf}");
    assert!(files.notes.iter().any(|n| n.contains("`<joint>_gear`")), "{:?}", files.notes);
    let table: serde_json::Value = serde_json::from_str(&of("actuators.json")).unwrap();
    let stiffness = table["joints"][0]["gear_stiffness"].as_f64().unwrap();
    assert!((stiffness * lift.value - 1.0).abs() < 1e-12, "{stiffness}");
    assert!(of("actuators.h").contains("dynid_compliance[DYNID_JOINTS]"));
    let other = "encoder = \"link\"";
    assert!(!file.warnings.iter().any(|w| w.contains(other)), "{:?}", file.warnings);
    let wrong = config(&folder, &format!("{text}find = [\"compliance\", \"gear_damping\"]\n{other}\n"));
    let wrong = identify_servo(&wrong, &mut |_| {}).unwrap().file(&wrong, &[]);
    assert!(wrong.fit.misfit.unwrap() > 1.3, "{:?}", wrong.fit);
    assert!(wrong.warnings.iter().any(|w| w.contains("encoder = \"motor\"")), "{:?}", wrong.warnings);
    let page = found.report(&file).unwrap();
    assert!(page.contains("gears that give way: lift") && page.contains("stiffness of the gear"));

    // The drives that were found move as the true ones do, behind a motion that was not recorded.
    let json = folder.path().join("soft.json");
    std::fs::write(&json, file.to_json()).unwrap();
    let settings = SimulateSettings {
        drives: Some(json),
        duration_s: 4.0,
        rate_hz: 200.0,
        seed: 5,
        encoder_bits: 0,
        ..SimulateSettings::default()
    };
    let robot = folder.path().join("arm.urdf");
    let made = simulate_drives(&robot, &Default::default(), None, &settings).unwrap();
    let stiff = SimulateSettings { values: [("lift.compliance".to_owned(), 0.0)].into(), ..settings.clone() };
    let stiff = simulate_drives(&robot, &Default::default(), None, &stiff).unwrap();
    let mut exact =
        ServoLog::new("exact", made.time.clone(), made.command.clone().unwrap(), made.position.clone());
    exact.start = Some(made.command.as_ref().unwrap().iter().map(|c| c[0]).collect());
    let options = RobotOptions { locked: vec![("finger".to_owned(), 0.0)], ..RobotOptions::default() };
    let mechanism = Robot::parse(ARM, Path::new("arm.urdf"), &options).unwrap().mechanism;
    let values = ServoValues { joints: soft(), inertias: mechanism.inertia_vector() };
    let scheme = Scheme { step_s: 5e-4, ..Scheme::default() };
    let (mut error, mut effect) = (0.0, 0.0);
    Rollout::new(&Chain::all(&mechanism)[0], scheme, &[])
        .run(&values, &exact, |row| {
            error += (row.reading[0] - made.position[0][row.row]).powi(2);
            effect += (row.reading[0] - stiff.position[0][row.row]).powi(2);
        })
        .unwrap();
    assert!(error < 1e-3 * effect, "{error} of {effect}");
}

#[test]
fn what_is_said_of_gears_takes_effect_or_is_refused() {
    let folder = folder();
    std::fs::write(folder.path().join("soft.csv"), log_of(soft(), 0.4, 1200)).unwrap();
    let text = "robot = \"arm.urdf\"\n[[log]]\npath = \"soft.csv\"\n[servo]\nvelocity_gain = 1.0\nlaw = [\"offset\"]\n";
    let misfit = |more: &str| {
        let config = config(&folder, &format!("{text}{more}"));
        identify_servo(&config, &mut |_| {}).map(|found| found.found.misfit)
    };
    let stiff = misfit("").unwrap();
    let stated = misfit("gear_stiffness = { lift = 333.333 }\ngear_damping = { lift = 0.6 }\n").unwrap();
    assert!(stated < 1.1 && stiff > 2.0 * stated, "{stiff} {stated}");
    // The robot file may say the same.
    let elastic = |numbers: &str| {
        let robot = format!("urdf = \"arm.urdf\"\n[element.lift]\nelastic = {{ ratio = 100{numbers} }}\n");
        std::fs::write(folder.path().join("soft.toml"), robot).unwrap();
        let config = config(&folder, &text.replace("arm.urdf", "soft.toml"));
        identify_servo(&config, &mut |_| {}).map(|found| (found.found.misfit, found.warnings))
    };
    let (of_robot, warnings) = elastic(", k1 = 333.333, k2 = 5.0, d = 0.6").unwrap();
    assert!((of_robot - stated).abs() < 1e-9, "{of_robot} {stated}");
    assert!(warnings.iter().any(|w| w.contains("cubic stiffness of `lift`")), "{warnings:?}");
    let fault = elastic("").unwrap_err().to_string();
    assert!(fault.contains("servo.gear_stiffness.lift"), "{fault}");
    for (more, part) in [
        ("gear_damping = { lift = 0.6 }\n", "servo.gear_damping.lift"),
        ("backlash = { elbow = 0.01 }\ngear_stiffness = { lift = 300 }\n", "servo.backlash.elbow"),
        ("encoder = \"link\"\n", "servo.encoder"),
        ("find = [\"backlash\"]\n", "servo.find"),
        ("gear_stiffness = { lift = 0 }\n", "servo.gear_stiffness"),
        ("gear_stiffness = { wrist = 3 }\n", "wrist"),
    ] {
        let fault = misfit(more).unwrap_err().to_string();
        assert!(fault.contains(part), "{more}: {fault}");
    }
}

#[test]
fn actuators_of_a_robot_file_are_its_baseline_and_their_range_is_that_of_commands() {
    let folder = folder();
    let config_of = |robot: &str, more: &str| {
        let text = format!(
            "robot = \"{robot}\"\nlock = {{ finger = 0.0 }}\n[[log]]\npath = \"a.csv\"\n[servo]\ndelay = 0.008\nlaw = [\"offset\"]\n{more}"
        );
        identify_servo(&config(&folder, &text), &mut |_| {}).unwrap()
    };
    let first = config_of("arm.urdf", "velocity_gain = 1.0\n");
    assert!(first.as_it_came.is_none(), "a URDF states no gains");
    let files = first.files().unwrap();
    let written = &files.files.iter().find(|(name, _)| name == "arm.mujoco.xml").unwrap().1;
    std::fs::write(folder.path().join("arm.xml"), written).unwrap();
    let again = config_of("arm.xml", "");
    // The file holds what was found, so that it predicts the log as it came.
    for (file, (rms, command)) in
        again.as_it_came.as_ref().unwrap().iter().zip(first.found.rms.iter().zip(&first.found.command_rms))
    {
        assert!(*file < 1.5 * rms && *file < 0.02 * command, "{file} {rms} {command}");
    }
    assert!(!again.warnings.iter().any(|w| w.contains("command_limits")), "{:?}", again.warnings);
    // What is told goes farther than the elbow ever does.
    let log = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let cells: Vec<Vec<&str>> = log.lines().map(|line| line.split(',').collect()).collect();
    let most = cells[1..].iter().map(|row| row[4].parse::<f64>().unwrap().abs()).fold(0.05, f64::max) + 0.05;
    let told = format!("{}", most + 0.3);
    let told: Vec<String> = cells
        .iter()
        .enumerate()
        .map(|(k, row)| {
            let command = if k > 0 && k % 40 == 0 { told.as_str() } else { row[2] };
            [row[0], row[1], command, row[3], row[4]].join(",")
        })
        .collect();
    std::fs::write(folder.path().join("a.csv"), told.join("\n")).unwrap();
    let ranged = format!("<general name=\"servo_elbow\" ctrlrange=\"-{most} {most}\"");
    let narrow = written.replacen("<general name=\"servo_elbow\"", &ranged, 1);
    std::fs::write(folder.path().join("narrow.xml"), narrow).unwrap();
    let warnings = config_of("narrow.xml", "").warnings;
    assert!(warnings.iter().any(|w| w.contains("command_limits = { elbow = [-")), "{warnings:?}");
}
