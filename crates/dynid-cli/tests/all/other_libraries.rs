//! Exported robots in other programs: Pinocchio and MuJoCo load them and give the effort of the estimate.
//!
//! Needs Python with the modules `pinocchio` and `mujoco`: that of the system, or the environment under `target/` that
//! the tests of the Python package use, made here from PyPI if it is not there. Where neither is to be had, the tests pass
//! with a notice.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests outside of test functions")]

use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::support::{TWO_LINKS, dynid, indy7, run};
use dynid_testing::{shared_if_there, skip};
use serde_json::Value;

/// Every kind of joint, a branch, and links on fixed joints. The boxes must not turn into mass.
const WELDED: &str = r#"<robot name="welded">
  <link name="base"><inertial><mass value="5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="turret">
    <inertial><origin xyz="0.02 0.01 0.1"/><mass value="4"/><inertia ixx="0.06" ixy="0.001" ixz="0" iyy="0.05" iyz="0.002" izz="0.04"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="cover"><inertial><origin xyz="0.1 0 0"/><mass value="0.3"/><inertia ixx="0.002" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.002"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0 0.03 0.2" rpy="0.2 0.1 0"/><mass value="2.5"/><inertia ixx="0.05" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.02"/></inertial></link>
  <link name="ram"><inertial><origin xyz="0.01 0 0.1"/><mass value="1.2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.012" iyz="0" izz="0.004"/></inertial></link>
  <link name="tool">
    <inertial><origin xyz="0 0 0.04"/><mass value="0.8"/><inertia ixx="0.003" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.002"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.2"/></geometry></collision>
  </link>
  <link name="tip"/>
  <joint name="turn" type="continuous"><origin xyz="0 0 0.2"/><parent link="base"/><child link="turret"/><axis xyz="0 0 1"/><limit effort="50" velocity="2"/></joint>
  <joint name="cover_mount" type="fixed"><origin xyz="0 0.1 0" rpy="0 0 0.5"/><parent link="turret"/><child link="cover"/></joint>
  <joint name="lift" type="revolute"><origin xyz="0.1 0 0.3" rpy="0.4 -0.2 1.1"/><parent link="turret"/><child link="arm"/><axis xyz="1 1 0"/><limit lower="-2" upper="2" effort="60" velocity="2"/><dynamics damping="3" friction="3"/></joint>
  <joint name="push" type="prismatic"><origin xyz="0 0 0.4" rpy="0 0.3 0"/><parent link="arm"/><child link="ram"/><axis xyz="0 0 1"/><limit lower="-0.2" upper="0.3" effort="90" velocity="1"/></joint>
  <joint name="mount" type="fixed"><origin xyz="0 0 0.2" rpy="1 0 0.5"/><parent link="ram"/><child link="tool"/></joint>
  <joint name="end" type="fixed"><origin xyz="0 0 0.1"/><parent link="tool"/><child link="tip"/></joint>
</robot>
"#;

/// What a command prints within some seconds, or why it does not end well.
fn output(command: &mut Command, seconds: u64) -> Result<String, String> {
    let (told, errors) = (tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap());
    let text = |mut file: File| {
        let mut text = String::new();
        file.rewind().and_then(|()| file.read_to_string(&mut text)).unwrap();
        text
    };
    let mut child = command
        .stdin(Stdio::null())
        .stdout(told.try_clone().unwrap())
        .stderr(errors.try_clone().unwrap())
        .spawn()
        .map_err(|e| e.to_string())?;
    let end = Instant::now() + Duration::from_secs(seconds);
    loop {
        match child.try_wait().unwrap() {
            Some(status) if status.success() => return Ok(text(told)),
            Some(status) => return Err(format!("{status}: {}", text(errors))),
            None if Instant::now() > end => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("not done after {seconds} s: {}", text(errors)));
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

/// A Python with both modules: found, or made, by the first test that asks; two tests that install into one environment
/// at the same time would take files from under each other.
fn python() -> Option<&'static Path> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    PYTHON.get_or_init(find_python).as_deref()
}

fn find_python() -> Option<PathBuf> {
    let has_modules =
        |python: &Path| output(Command::new(python).args(["-c", "import pinocchio, mujoco"]), 60).is_ok();
    let system = PathBuf::from("python3");
    if has_modules(&system) {
        return Some(system);
    }
    // The environment of the tests of the Python package, which need both modules too.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("python");
    let own = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if has_modules(&own) {
        return Some(own);
    }
    if !own.is_file() {
        output(Command::new(system).args(["-m", "venv"]).arg(&folder), 60).ok()?;
    }
    let install = ["-m", "pip", "install", "--quiet", "--retries", "0", "--timeout", "10", "pin", "mujoco"];
    output(Command::new(&own).args(install), 300).ok()?;
    has_modules(&own).then_some(own)
}

/// Identifies a robot from a simulated log, puts other values into the estimate, exports, and compares.
///
/// `change`: a new value for a parameter by name, identified value and simulated truth.
fn check(python: &Path, name: &str, robot: &Path, change: impl Fn(&str, f64, f64) -> f64) {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let robot = robot.to_str().unwrap();
    let simulate = |seconds: &str, more: &[&str]| {
        run(at, &[&["simulate", robot, "--rate-hz", "100", "--duration", seconds], more].concat(), 0);
    };
    simulate("12", &["--out", "log.csv", "--truth", "truth.json"]);
    simulate("3", &["--out", "other.csv", "--seed", "5", "--clean", "states.csv"]);
    let args = ["identify", robot, "--log", "log.csv", "--friction", "given", "--out", "out", "--quiet"];
    let code = dynid().current_dir(at).args(args).output().unwrap().status.code();
    assert!(matches!(code, Some(0 | 1)), "{name}: {code:?}");
    let read =
        |file: &str| -> Value { serde_json::from_slice(&std::fs::read(at.join(file)).unwrap()).unwrap() };
    let (mut estimate, truth) = (read("out/estimate.json"), read("truth.json"));
    for p in estimate["parameters"].as_array_mut().unwrap() {
        let name = p["name"].as_str().unwrap().to_owned();
        let identified = p["value"].as_f64().unwrap();
        p["value"] = change(&name, identified, truth[&name].as_f64().unwrap()).into();
    }
    std::fs::write(at.join("estimate.json"), estimate.to_string()).unwrap();
    run(at, &["predict", "estimate.json", "--states", "states.csv", "--out", "effort.csv"], 0);
    run(at, &["export", "estimate.json", "--urdf", "robot.urdf", "--mjcf", "robot.xml"], 0);

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/other_libraries/check.py");
    let said =
        output(Command::new(python).arg(script).arg(at), 120).unwrap_or_else(|e| panic!("{name}: {e}"));
    println!("{name}: {}", said.trim());
    let result: Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    for file in ["pinocchio urdf", "mujoco urdf", "mujoco mjcf"] {
        assert!(result[file].as_f64().is_some_and(|d| d <= 1e-9), "{name}: {file}: {result}");
    }
}

/// Rotors and offsets besides what the robot file's truth holds, and one joint whose friction came out negative.
fn lively(name: &str, _: f64, truth: f64) -> f64 {
    match name.rsplit('.').next() {
        Some("Ia") => 0.15,
        Some("fo") => -0.4,
        Some("fv") if name.starts_with("lift.") => -0.2,
        _ => truth,
    }
}

#[test]
fn pinocchio_and_mujoco_give_the_effort_of_the_estimate() {
    let Some(python) = python() else {
        return skip("no Python with pinocchio and mujoco, and none could be installed");
    };
    let folder = tempfile::tempdir().unwrap();
    let robot = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    check(python, "two links", &robot("arm.urdf", TWO_LINKS), lively);
    check(python, "indy7", &robot("indy7.toml", &indy7()), |_, _, truth| truth);
    check(python, "indy7 as identified", &robot("indy7.toml", &indy7()), |_, identified, _| identified);
    let welded = robot("welded.urdf", WELDED);
    check(python, "welded links that keep the file", &welded, lively);
    // A ram lighter than the file's tool: the tool has no share left.
    check(python, "welded links without mass", &welded, |name, identified, truth| {
        if name.starts_with("ram.") { 0.3 * truth } else { lively(name, identified, truth) }
    });
    of_public_files(python, &["ur5"]);
}

fn of_public_files(python: &Path, robots: &[&str]) {
    let Some(oracles) = shared_if_there("data/oracles") else { return };
    for robot in robots {
        let file = oracles.join(format!("{robot}.urdf"));
        check(python, robot, &file, lively);
        check(python, &format!("{robot} as identified"), &file, |_, identified, _| identified);
    }
}

#[test]
#[ignore = "ten seconds; the ordinary run takes the UR5"]
fn more_public_robots_give_the_effort_of_the_estimate() {
    let Some(python) = python() else { return skip("a Python with the modules pinocchio and mujoco") };
    of_public_files(python, &["iiwa14", "panda"]);
}

#[test]
fn loops_are_closed_in_mujoco_and_its_drives_need_the_same_efforts() {
    let Some(python) = python() else { return skip("a Python with the modules pinocchio and mujoco") };
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots");
    for robot in ["prr3", "fourbar", "fivebar"] {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        // Friction that MJCF has a place for.
        let text = std::fs::read_to_string(robots.join(format!("{robot}.toml"))).unwrap();
        let text = match text.contains("[defaults]") {
            true => text,
            false => format!("{text}\n[defaults]\nelements = [\"coulomb\", \"viscous\"]\n"),
        };
        std::fs::write(path("robot.toml"), text).unwrap();
        let at = folder.path();
        let simulate = "simulate robot.toml --out log.csv --clean clean.csv --duration 12 --rate-hz 100 --encoder-bits 0 --effort-noise 0.001";
        run(at, &simulate.split(' ').collect::<Vec<_>>(), 0);
        // A short log may fail a verdict: what counts here is the file.
        dynid().current_dir(at).args(["identify", "robot.toml", "--log", "log.csv"]).output().unwrap();
        let estimate = "dynid-out/estimate.json";
        run(at, &["export", estimate, "--mjcf", "robot.xml", "--allow-unphysical"], 0);
        run(at, &["predict", estimate, "--states", "clean.csv", "--out", "effort.csv"], 0);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/other_libraries/loops.py");
        let mut command = Command::new(python);
        command.arg(script).args([path("robot.xml"), path("clean.csv"), path("effort.csv")]);
        let said = output(&mut command, 120).unwrap_or_else(|e| panic!("{robot}: {e}"));
        let said: Value = serde_json::from_str(said.trim()).unwrap();
        println!("{robot}: {said}");
        assert!(
            said["gap"].as_f64().unwrap() < 1e-9 && said["difference"].as_f64().unwrap() < 0.02,
            "{robot}: {said}"
        );
    }
}
