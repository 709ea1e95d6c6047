//! Stiffness of joints with encoders on both sides of their gears: what the deformation tells takes the place of what the rows of links run to.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests outside of test functions")]

use std::fmt::Write as _;
use std::path::Path;

use dynid::check::{FindingId, Severity, check};
use dynid::config::{Config, LogConfig};
use dynid::estimate::{Estimate, Split};
use dynid::identify;
use dynid::reduce::{OwnOfLogs, learn, reduce};
use dynid::robot::{Robot, RobotOptions};
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::stiffness::{JointStiffness, StiffnessVerdict};
use dynid::validate::validate;

use crate::support::data;

/// Geometry, gears and rotors of the data's README; no body is stated.
const KR300: &str = r#"
schema = 1
name = "kr300"
gravity = [0, 0, 9.81]
dh = "standard"
[[joint]]
name = "a1"
d = -0.675
a = 0.35
alpha = "90deg"
[[joint]]
name = "a2"
d = -0.189
a = 1.15
offset = "-90deg"
[[joint]]
name = "a3"
d = 0.189
a = 0.041
alpha = "-90deg"
offset = "180deg"
[[joint]]
name = "a4"
d = -1.0
alpha = "90deg"
[[joint]]
name = "a5"
alpha = "-90deg"
[[joint]]
name = "a6"
d = -0.24
alpha = "180deg"
[element.a1]
elements = ["coulomb", "viscous"]
elastic = { ratio = 256.857142857, cubic = false }
[element.a2]
elements = ["coulomb", "viscous", "spring"]
elastic = { ratio = 267.428571429, cubic = false }
[element.a3]
elements = ["coulomb", "viscous"]
elastic = { ratio = 252.333333333, cubic = false }
[element.a1_motor]
elements = ["coulomb", "viscous", "offset", "rotor"]
[element.a2_motor]
elements = ["coulomb", "viscous", "offset", "rotor"]
[element.a3_motor]
elements = ["coulomb", "viscous", "offset", "rotor"]
"#;

const KR300_RUN: &str = r#"
robot = "robot.toml"
[columns.position]
columns = { a1 = "ql1", a2 = "ql2", a3 = "ql3", a4 = "qm4", a5 = "qm5", a6 = "qm6", a1_motor = "qm1", a2_motor = "qm2", a3_motor = "qm3" }
scale = { a1_motor = 256.857142857, a2_motor = 267.428571429, a3_motor = 252.333333333 }
[columns.effort]
columns = { a1_motor = "tau_motor1", a2_motor = "tau_motor2", a3_motor = "tau_motor3", a4 = "tau_motor4", a5 = "tau_motor5", a6 = "tau_motor6" }
scale = { a4 = 221.0, a5 = 239.619047619, a6 = 154.323134328 }
"#;

fn of<'a>(all: &'a [JointStiffness], joint: &str) -> &'a JointStiffness {
    all.iter().find(|s| s.joint == joint).unwrap()
}

/// The same machine as a rigid one, from its motors: what its log has besides bodies (friction that builds up while it creeps from rest, wrists that
/// share motors) is no fault of the clock.
#[test]
fn a_kr300_of_rigid_joints_is_not_refused() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (rigid, _) = KR300.split_once("[element.a1]").unwrap();
    std::fs::write(folder.path().join("robot.toml"), rigid).unwrap();
    let log = data.join("kuka-kr300/run_a.csv.gz");
    let gears = "{ a1 = 256.857142857, a2 = 267.428571429, a3 = 252.333333333, a4 = 221.0, a5 = 239.619047619, a6 = 154.323134328 }";
    let text = format!(
        "robot = \"robot.toml\"\n[columns]\nposition = {{ columns = {{ {} }} }}\neffort = {{ columns = {{ {} }}, scale = {gears} }}\n[[log]]\npath = {log:?}\n",
        (1..=6).map(|k| format!("a{k} = \"qm{k}\"")).collect::<Vec<_>>().join(", "),
        (1..=6).map(|k| format!("a{k} = \"tau_motor{k}\"")).collect::<Vec<_>>().join(", "),
    );
    let path = folder.path().join("run.toml");
    std::fs::write(&path, text).unwrap();
    let found = check(&Config::read(&path).unwrap(), &mut |_| {}).unwrap();
    println!("{:#?}", found.findings);
    assert!(found.findings.iter().all(|f| f.severity != Severity::Error));
    assert!(found.findings.iter().all(|f| f.id != FindingId::ClockRate || f.fixes.is_empty()));
}

#[test]
fn link_rows_of_a_kr300_do_not_make_a_stiffness_of_five() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.toml"), KR300).unwrap();
    let log = data.join("kuka-kr300/run_a.csv.gz");
    let text = format!("{KR300_RUN}[[log]]\npath = {log:?}\n");
    let path = folder.path().join("run.toml");
    std::fs::write(&path, text).unwrap();
    let config = Config::read(&path).unwrap();
    let found = identify(&config, &mut |_| {}).unwrap();
    let estimate = found.estimate();
    for s in &estimate.stiffness {
        println!("{} (rows: {:.2e}), {s:?}", s.words(), s.of_rows);
        // The encoders are 3 ms apart, and what is left is no hysteresis.
        assert!((2.8e-3..3.2e-3).contains(&s.lag_s.0), "{s:?}");
        assert!(s.hysteresis.0.abs() < 3.0 * s.hysteresis.1, "{s:?}");
        // What rows of links run to has left the load of the efforts.
        assert!(s.slope_of_rows < 0.1 && !s.is_borne_out(), "{s:?}");
    }
    let [a1, a2, a3] = ["a1", "a2", "a3"].map(|joint| of(&estimate.stiffness, joint));
    assert_eq!((a1.stiffness, a1.interval), (None, None));
    // The intervals hold the values of the machine's owners.
    for (joint, owners, range) in [(a2, 7.5e6, 5.5e6..1.0e7), (a3, 4.1e6, 4.0e6..6.0e6)] {
        let (low, high) = joint.interval.unwrap();
        assert!(range.contains(&joint.stiffness.unwrap()), "{joint:?}");
        assert!(low < owners && owners < high && low > 2.5e6, "{joint:?}");
    }
    // The model that is left is one of stiff joints, which says so and is read without the configuration.
    assert_eq!(estimate.joints, ["a1", "a2", "a3", "a4", "a5", "a6"]);
    assert!(
        estimate.model.elastic.is_empty() && !estimate.parameters.iter().any(|p| p.name.ends_with(".k1"))
    );
    let check = estimate.verdict.checks.iter().find(|c| c.name.word().contains("stiffness")).unwrap();
    assert_eq!((check.status.word(), check.value), ("warn", Some(2.0)));
    let file = folder.path().join("estimate.json");
    std::fs::write(&file, estimate.to_json()).unwrap();
    let read = Estimate::read(&file).unwrap();
    assert_eq!(read.stiffness, estimate.stiffness);
    let reading = read.provenance.reading.clone().unwrap();
    let entry = LogConfig { path: log, ..Default::default() };
    let again = validate(&read, Split::Consistent, &file, &[entry], &reading.columns, None, None).unwrap();
    let (own, again) = (&found.training[0].filtered, &again.agreements[0].filtered);
    assert!((own.relative_error.unwrap() - again.relative_error.unwrap()).abs() < 0.5, "{again:?}");
}

const ARM: &str = r#"
schema = 1
name = "elastic-arm"
gravity = [0, -9.81, 0]
dh = "modified"
[[joint]]
name = "j1"
limits = { position = ["-150deg", "150deg"], velocity = 2.0, effort = 200.0 }
phi = [8.0, 2.0, 0.1, 0, 0.15, 0, 0, 0.85, 0, 0.9]
[[joint]]
name = "j2"
a = 0.5
limits = { position = ["-150deg", "150deg"], velocity = 2.5, effort = 80.0 }
phi = [4.0, 0.8, -0.05, 0, 0.05, 0, 0, 0.28, 0, 0.3]
[element.j1]
elements = ["coulomb", "viscous"]
coulomb = { effort = 1.0 }
viscous = { coefficient = 1.0 }
elastic = { ratio = 100, k1 = 40000.0, cubic = false }
[element.j1_motor]
elements = ["coulomb", "viscous", "rotor"]
coulomb = { effort = 0.08 }
viscous = { coefficient = 4e-4 }
rotor = { inertia = 1.2e-4 }
[element.j2]
elements = ["coulomb", "viscous", "elastic"]
coulomb = { effort = 0.5 }
viscous = { coefficient = 0.5 }
elastic = { ratio = -80, motor = "m2", k1 = 20000.0, cubic = false }
[element.m2]
elements = ["coulomb", "viscous", "rotor"]
coulomb = { effort = 0.04 }
viscous = { coefficient = 2e-4 }
rotor = { inertia = 6e-5 }
"#;

/// The simulated log with the links' encoders read late by whole rows.
fn table(log: &SimulatedLog, late: usize) -> String {
    let mut text = "t,q_j1,q_j2,q_j1_motor,q_m2,tau_j1_motor,tau_m2\n".to_owned();
    for row in late..log.time.len() {
        let q = |k: usize| if k < 2 { log.position[k][row - late] } else { log.position[k][row] };
        let cells = [log.time[row], q(0), q(1), q(2), q(3), log.effort[2][row], log.effort[3][row]];
        writeln!(text, "{}", cells.map(|x| x.to_string()).join(",")).unwrap();
    }
    text
}

fn told(late: usize, seed: u64, folder: &Path) -> (Vec<JointStiffness>, Vec<String>) {
    std::fs::write(folder.join("robot.toml"), ARM).unwrap();
    let robot = Robot::parse(ARM, Path::new("robot.toml"), &RobotOptions::default()).unwrap();
    let settings =
        SimulateSettings { duration_s: 20.0, rate_hz: 1000.0, seed, ..SimulateSettings::default() };
    let log = simulate(&robot, &settings).unwrap();
    std::fs::write(folder.join("log.csv"), table(&log, late)).unwrap();
    let config = folder.join("run.toml");
    std::fs::write(&config, "robot = \"robot.toml\"\npreflight = \"warn\"\n[[log]]\npath = \"log.csv\"\n")
        .unwrap();
    let config = Config::read(&config).unwrap();
    let found = identify(&config, &mut |_| {}).unwrap();
    let estimate = found.estimate();
    for s in &estimate.stiffness {
        println!("late {late}: {} (rows: {:.4e}, slope {:.3})", s.words(), s.of_rows, s.slope_of_rows);
    }
    (estimate.stiffness, estimate.joints)
}

#[test]
fn encoders_read_at_different_times_do_not_make_a_stiffness() {
    let folder = tempfile::tempdir().unwrap();
    let truth = [("j1", 40000.0), ("j2", 20000.0)];
    let (stiffness, joints) = told(0, 1, folder.path());
    assert_eq!(joints, ["j1", "j2", "j1_motor", "m2"], "what the deformation bears out stays");
    for (joint, k) in truth {
        let s = of(&stiffness, joint);
        assert!((s.compliance - 1.0 / k).abs() < 3.0 * s.compliance_std, "{s:?}");
        assert!(s.is_borne_out() && (s.of_rows / k - 1.0).abs() < 0.05, "{s:?}");
    }
    let (stiffness, joints) = told(3, 1, folder.path());
    assert_eq!(joints, ["j1", "j2"], "what it does not is gone");
    for (joint, k) in truth {
        let s = of(&stiffness, joint);
        assert!((s.compliance - 1.0 / k).abs() < 3.0 * s.compliance_std, "{s:?}");
        assert!(matches!(s.verdict, StiffnessVerdict::Told | StiffnessVerdict::Coarse), "{s:?}");
        assert!((s.lag_s.0 - 3e-3).abs() < 2e-4, "{s:?}");
    }
}

/// Factors of a log hold its deformations: compliance, the rest of the lag, and friction behind the spring as hysteresis.
#[test]
fn factors_of_a_log_tell_the_compliance_of_its_joints() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.toml"), ARM).unwrap();
    let robot = Robot::parse(ARM, Path::new("robot.toml"), &RobotOptions::default()).unwrap();
    for (name, late, seed) in [("taught.csv", 3, 1), ("other.csv", 5, 2)] {
        let settings =
            SimulateSettings { duration_s: 20.0, rate_hz: 1000.0, seed, ..SimulateSettings::default() };
        std::fs::write(folder.path().join(name), table(&simulate(&robot, &settings).unwrap(), late)).unwrap();
    }
    let entry = |name: &str| LogConfig { path: folder.path().join(name), ..LogConfig::default() };
    let config = Config {
        robot: folder.path().join("robot.toml"),
        log: vec![entry("taught.csv")],
        ..Config::default()
    };
    let learned = learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap();
    let recipe = learned.reduction.recipe().clone();
    // Motors and links are still what logs have columns for.
    assert_eq!(
        dynid::log::names(&recipe.clone().reducer().unwrap().robot().axes),
        ["j1", "j2", "j1_motor", "m2"]
    );
    let made = reduce(recipe.clone(), &[entry("other.csv")], &Default::default(), None, &mut |_| {}).unwrap();
    let (outputs, columns) = (recipe.outputs.len(), recipe.all_columns());
    let deformations: Vec<_> = made.logs()[0].groups.iter().filter(|g| g.output >= outputs).collect();
    assert_eq!(deformations.len(), 2);
    for (group, (joint, k, friction)) in deformations.iter().zip([("j1", 4e4, 1.0), ("j2", 2e4, 0.5)]) {
        let found = group.blocks[0].solve();
        let of = |symbol: &str| {
            let name = format!("{joint}.{symbol}");
            group.columns.iter().position(|c| columns[*c].name == name).map(|at| found[at])
        };
        println!("{joint}: {found:?}");
        let compliance = of("compliance").unwrap();
        assert!((compliance * k - 1.0).abs() < 0.01, "{joint}: {compliance:e}");
        // Two samples more than the log that taught.
        assert!((of("lag").unwrap() - 2e-3).abs() < 5e-5, "{joint}: {found:?}");
        assert!((of("hysteresis").unwrap() * k / friction - 1.0).abs() < 0.15, "{joint}: {found:?}");
        assert!(of("backlash").is_none_or(|b| b.abs() < 5e-6), "{joint}: {found:?}");
    }
    // The efforts are solved without them.
    let solved = made.solve([], &mut |_| {}).unwrap().estimate();
    assert_eq!(solved.joints, ["j1", "j2"]);
    let asked = Config { stiff_joints: true, ..config };
    let direct = identify(&asked, &mut |_| {}).unwrap();
    assert_eq!(direct.estimate().joints, ["j1", "j2"]);
}

/// Torque sensors behind springs: stiffness is a parameter of the factors, which give the parameters of the identification.
#[test]
fn factors_hold_the_stiffness_that_torque_sensors_tell() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hit-joint.toml");
    let robot = Robot::load(&path, &RobotOptions::default()).unwrap();
    let settings = SimulateSettings { duration_s: 60.0, rate_hz: 100.0, ..SimulateSettings::default() };
    let log = simulate(&robot, &settings).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut text = "t,q_joint,q_joint_motor,tau_joint,tau_joint_motor\n".to_owned();
    for k in 0..log.time.len() {
        let cells = [log.time[k], log.position[0][k], log.position[1][k], log.effort[0][k], log.effort[1][k]];
        writeln!(text, "{}", cells.map(|x| x.to_string()).join(",")).unwrap();
    }
    let file = folder.path().join("log.csv");
    std::fs::write(&file, text).unwrap();
    let entry = LogConfig { path: file, ..LogConfig::default() };
    let config = Config { robot: path, log: vec![entry], ..Config::default() };
    let learned = learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap();
    assert!(learned.reduction.recipe().springs.is_none());
    let solved = learned.reduction.solve([], &mut |_| {}).unwrap().estimate();
    for (a, b) in solved.base_parameters.iter().zip(&learned.estimate.base_parameters) {
        let (x, y, std) = (a.value.unwrap(), b.value.unwrap(), b.std.unwrap());
        assert!(a.name == b.name && (x - y).abs() < 1e-8 * std, "{} {x:e} {y:e}", a.name);
    }
    assert!(solved.base_parameters.iter().any(|p| p.name == "joint.k1"));
}
