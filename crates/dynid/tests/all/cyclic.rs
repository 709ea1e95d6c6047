//! Ripple and friction that changes over a turn, found in logs of a simulated arm whose robot file knows nothing of them.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid::estimate::Estimate;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Config, Robot, RobotOptions, identify};

use crate::support::{ARM, write_log};

/// A motor that cogs 63 times a turn of its joint, and a gear of ratio 22.5 whose friction changes once a turn of its motor.
const TRUTH: &str = r#"[element.j1]
elements = ["coulomb", "viscous", "offset", "rotor", "cyclic"]
coulomb = { effort = 1.5 }
viscous = { coefficient = 2.0 }
cyclic = { cycles = 63 }
[element.j2]
elements = ["coulomb", "viscous", "offset", "rotor", "cyclic_friction"]
coulomb = { effort = 0.8 }
viscous = { coefficient = 0.7 }
cyclic_friction = { friction_cycles = 22.5 }
"#;

const VALUES: [(&str, f64); 4] = [("j1.ca", 0.12), ("j1.cb", -0.2), ("j2.fca", 0.1), ("j2.fcb", 0.14)];

/// Writes the arm, and a log of it as `elements` say.
fn bench(folder: &Path, elements: &str, values: &[(&str, f64)]) {
    log(folder, "log.csv", 5, elements, values);
}

fn log(folder: &Path, name: &str, seed: u64, elements: &str, values: &[(&str, f64)]) {
    std::fs::write(folder.join("arm.toml"), ARM).unwrap();
    std::fs::write(folder.join("truth.toml"), format!("{ARM}{elements}")).unwrap();
    let robot = Robot::load(&folder.join("truth.toml"), &RobotOptions::default()).unwrap();
    let values: String = values.iter().map(|(name, value)| format!("\"{name}\" = {value}\n")).collect();
    let settings = format!(
        "mode = \"closed_loop\"\nduration_s = 20.0\nrate_hz = 500\nseed = {seed}\neffort_noise = 0.01\n\
         [imperfections]\nripple_share = 0\n[values]\n{values}"
    );
    let log = simulate(&robot, &SimulateSettings::parse(&settings, "simulation").unwrap()).unwrap();
    write_log(&log, &folder.join(name));
}

fn estimate(folder: &Path, elements: &str) -> Estimate {
    let path = folder.join("run.toml");
    let text = format!("robot = \"arm.toml\"\n[elements]\n{elements}\n[[log]]\npath = \"log.csv\"\n");
    std::fs::write(&path, text).unwrap();
    identify(&Config::read(&path).unwrap(), &mut |_| {}).unwrap().estimate()
}

#[test]
fn ripple_and_friction_over_a_turn_are_found_with_intervals_that_hold() {
    let folder = tempfile::tempdir().unwrap();
    bench(folder.path(), TRUTH, &VALUES);
    let found = estimate(folder.path(), "");
    let efforts = &found.conditioning.cyclic_efforts;
    let named: Vec<(&str, &str)> = efforts.iter().map(|e| (e.joint.as_str(), e.element.as_str())).collect();
    assert_eq!(named, [("j1", "cyclic"), ("j2", "cyclic_friction")], "{efforts:?}");
    assert!((efforts[0].cycles - 63.0).abs() < 0.1 && (efforts[1].cycles - 22.5).abs() < 0.1, "{efforts:?}");
    assert!(efforts.iter().all(|e| e.gain > 3.0 * e.standard_error && e.unit == "N m"), "{efforts:?}");
    for (name, truth) in VALUES {
        let parameter = found.parameters.iter().find(|p| p.name == name).unwrap();
        let (low, high) = parameter.interval.unwrap();
        println!("{name}: {low:.4} to {high:.4}, truth {truth}");
        assert!(low <= truth && truth <= high && high - low < 0.3 * truth.abs(), "{name}: {low} to {high}");
    }
    for (name, truth) in [("j1.cycles", 63.0), ("j2.friction_cycles", 22.5)] {
        let shape = found.shape_parameters.iter().find(|s| s.name == name).unwrap();
        let (low, high) = shape.interval.unwrap();
        println!("{name}: {low:.4} to {high:.4}, truth {truth}");
        assert!(low <= truth && truth <= high && high - low < 0.2, "{name}: {low} to {high}");
        assert_eq!(shape.verdict.word(), "seen in the data");
    }
    let choice = found.conditioning.choices.iter().find(|c| c.name == "cyclic efforts of j2").unwrap();
    assert!(choice.reason.contains("held-out parts"), "{}", choice.reason);

    let given = estimate(folder.path(), "friction = \"given\"");
    assert!(given.conditioning.cyclic_efforts.is_empty() && given.shape_parameters.is_empty());
    let error = |e: &Estimate| e.fit.filtered.relative_error.unwrap();
    assert!(error(&found) < 0.7 * error(&given), "{} against {}", error(&found), error(&given));

    // What the file states already is not looked for again.
    let listed = "joint = { j1 = [\"coulomb\", \"viscous\", \"offset\", \"rotor\", \"cyclic\"] }";
    let stated = estimate(folder.path(), listed);
    let joints: Vec<&str> = stated.conditioning.cyclic_efforts.iter().map(|e| e.joint.as_str()).collect();
    assert_eq!(joints, ["j2"]);
}

/// Another motion of the same robot, and one of a robot whose motors stand elsewhere at the same angles.
#[test]
fn ripple_of_another_phase_is_told_on_validation_logs() {
    let folder = tempfile::tempdir().unwrap();
    bench(folder.path(), TRUTH, &VALUES);
    log(folder.path(), "same.csv", 8, TRUTH, &VALUES);
    log(folder.path(), "moved.csv", 9, TRUTH, &VALUES.map(|(name, value)| (name, -value)));
    let found =
        estimate(folder.path(), "[[validation]]\npath = \"same.csv\"\n[[validation]]\npath = \"moved.csv\"");
    let told: Vec<&str> = found
        .verdict
        .cautions
        .iter()
        .filter(|c| c.name == "cyclic efforts")
        .map(|c| c.message.as_str())
        .collect();
    println!("{told:#?}");
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told.iter().zip(["`j1`", "`j2`"]).all(|(m, joint)| m.contains("moved.csv") && m.contains(joint)));
}

#[test]
fn joints_without_ripple_take_none() {
    let folder = tempfile::tempdir().unwrap();
    let plain = TRUTH.replace(", \"cyclic_friction\"", "").replace(", \"cyclic\"", "");
    let plain: String =
        plain.lines().filter(|l| !l.starts_with("cyclic")).map(|l| format!("{l}\n")).collect();
    bench(folder.path(), &plain, &[]);
    let found = estimate(folder.path(), "");
    assert!(found.conditioning.cyclic_efforts.is_empty(), "{:?}", found.conditioning.cyclic_efforts);
}

/// A spring that carries the first link, of which the robot file knows nothing: its effort is no gravity, and follows the position.
#[test]
fn an_unknown_gravity_compensator_is_taken_for_a_slow_effort_of_the_joint() {
    let folder = tempfile::tempdir().unwrap();
    let geometry = "balancer = { ba = 0.4, br = 0.25, bphi = 0.4 }\n";
    let plain: String = TRUTH
        .replace("\"cyclic_friction\"", "\"offset\"")
        .replace("\"offset\", \"rotor\", \"offset\"", "\"offset\", \"rotor\"");
    let plain: String =
        plain.lines().filter(|l| !l.starts_with("cyclic")).map(|l| format!("{l}\n")).collect();
    let truth = plain
        .replace("\"cyclic\"", "\"balancer\"")
        .replace("[element.j2]", &format!("{geometry}[element.j2]"));
    let values = [("j1.bk", 300.0), ("j1.bf", 60.0)];
    bench(folder.path(), &truth, &values);
    log(folder.path(), "other.csv", 8, &truth, &values);
    let validation = "[[validation]]\npath = \"other.csv\"";
    let found = estimate(folder.path(), validation);
    let [slow] = &found.conditioning.cyclic_efforts[..] else {
        panic!("{:?}", found.conditioning.cyclic_efforts)
    };
    assert!(slow.joint == "j1" && slow.element == "cyclic" && slow.cycles.fract() == 0.0, "{slow:?}");
    let choice = found.conditioning.choices.iter().find(|c| c.name == "cyclic efforts of j1").unwrap();
    assert!(choice.reason.contains("`beside = [\"balancer\"]`"), "{}", choice.reason);
    let given = estimate(folder.path(), &format!("friction = \"given\"\n{validation}"));
    let told =
        given.verdict.checks.iter().find(|c| c.name.word() == "residual that follows the position").unwrap();
    assert!(told.value.unwrap() > 20.0 && told.meaning.contains("`j1`"), "{told:?}");
    let remedy = given.verdict.cautions.iter().find(|c| c.name == told.name.word()).unwrap();
    assert!(remedy.remedy.contains("[element.j1]"));
    // What the spring carries makes efforts of masses that the file does not have.
    for estimate in [&found, &given] {
        let scale = estimate.verdict.checks.iter().find(|c| c.name.word() == "scale of the efforts").unwrap();
        assert!(scale.meaning.contains("or a spring acts at `j1`"), "{scale:?}");
    }
    let list = "[\"coulomb\", \"viscous\", \"offset\", \"rotor\", \"balancer\"]";
    std::fs::write(
        folder.path().join("arm.toml"),
        format!("{ARM}[element.j1]\nelements = {list}\n{geometry}"),
    )
    .unwrap();
    let stated = estimate(folder.path(), validation);
    assert!(stated.verdict.checks.iter().all(|c| c.name != told.name));
    let error = |e: &Estimate| e.validation[0].filtered.relative_error.unwrap();
    let errors = [&stated, &found, &given].map(error);
    println!("relative errors on another motion, %: stated, found, given: {errors:.3?}");
    assert!(errors[0] < 0.5 * errors[1] && errors[1] < 0.7 * errors[2], "{errors:?}");
}
