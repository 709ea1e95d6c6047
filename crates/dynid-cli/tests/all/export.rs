//! `dynid export`: what it writes, what it says, what it refuses, and that it leaves nothing behind then.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, dynid, indy7, run};
use serde_json::Value;
use tempfile::TempDir;

/// A folder with a robot, logs, and an estimate whose values are those of the simulation.
fn identified() -> TempDir {
    static FILES: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
    let files = FILES.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
        let simulate = ["simulate", "arm.urdf", "--duration", "20", "--rate-hz", "100", "--out", "log.csv"];
        run(at, &[&simulate[..], &["--truth", "truth.json"]].concat(), 0);
        let identify = ["identify", "arm.urdf", "--log", "log.csv", "--friction", "given", "--out", "out"];
        run(at, &[&identify[..], &["--quiet"]].concat(), 0);
        let truth = json(&at.join("truth.json"));
        let mut estimate = json(&at.join("out/estimate.json"));
        for p in estimate["parameters"].as_array_mut().unwrap() {
            p["value"] = truth[p["name"].as_str().unwrap()].clone();
        }
        std::fs::write(at.join("estimate.json"), estimate.to_string()).unwrap();
        ["arm.urdf", "log.csv", "estimate.json"]
            .map(|name| (name, std::fs::read(at.join(name)).unwrap()))
            .to_vec()
    });
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn json(path: &Path) -> Value {
    json_of(&std::fs::read(path).unwrap())
}

fn json_of(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

fn read(folder: &TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).unwrap()
}

/// Sets a parameter of the estimate.
fn set(folder: &TempDir, name: &str, value: f64) {
    let path = folder.path().join("estimate.json");
    let mut estimate = json(&path);
    let parameters = estimate["parameters"].as_array_mut().unwrap();
    let parameter = parameters.iter_mut().find(|p| p["name"] == name).unwrap();
    parameter["value"] = value.into();
    std::fs::write(path, estimate.to_string()).unwrap();
}

/// Runs an export and returns what it says.
#[track_caller]
fn export(folder: &TempDir, args: &[&str], code: i32) -> String {
    let output = run(folder.path(), &[&["export", "estimate.json"], args].concat(), code);
    assert!(output.stdout.is_empty());
    String::from_utf8(output.stderr).unwrap()
}

/// Runs an export that must fail with one message and a hint, and write nothing.
#[track_caller]
fn refused(folder: &TempDir, args: &[&str], parts: &[&str]) {
    let names = || -> Vec<String> {
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    let before = names();
    let said = export(folder, args, 2);
    let starts = |with: &str| said.lines().filter(|l| l.starts_with(with)).count();
    assert_eq!((starts("error: "), starts("hint: ")), (1, 1), "{said}");
    assert!(parts.iter().all(|p| said.contains(p)), "{parts:?}: {said}");
    assert_eq!(names(), before, "{said}");
}

#[test]
fn three_files_are_written_and_every_difference_is_told() {
    let folder = identified();
    let all = ["--urdf", "new.urdf", "--mjcf", "new.xml", "--model", "new.json"];
    let said = export(&folder, &all, 0);
    for file in ["new.urdf", "new.xml", "new.json"] {
        let line = said.lines().find(|l| l.starts_with(&format!("written: {file} "))).unwrap();
        let difference = line.split("within ").nth(1).unwrap().split(' ').next().unwrap();
        assert!(difference.parse::<f64>().unwrap() <= 1e-9, "{line}");
        assert!(line.ends_with("over 1000 random states)"), "{line}");
    }
    let robot = json(&folder.path().join("new.json"));
    assert_eq!(robot["links"][1]["mass"], 1.5);
    assert!(read(&folder, "new.xml").contains("<mujoco model=\"arm\">"));
    // The file is the robot that was simulated, so only the text of <inertial> and <dynamics> is new.
    let kept = |text: &str| -> Vec<String> {
        let edited = ["<origin xyz=\"0", "<mass", "<inertia", "<dynamics", "<!-- written by dynid -->"];
        text.lines().filter(|l| !edited.iter().any(|e| l.contains(e))).map(str::to_owned).collect()
    };
    assert_eq!(kept(&read(&folder, "new.urdf")), kept(TWO_LINKS));
    // The same again gives the same bytes.
    let first = all.map(|a| std::fs::read(folder.path().join(a)).ok());
    export(&folder, &all, 0);
    assert_eq!(all.map(|a| std::fs::read(folder.path().join(a)).ok()), first);
}

#[test]
fn efforts_are_compared_on_a_log_if_one_is_given() {
    let folder = identified();
    let said = export(&folder, &["--mjcf", "new.xml", "--log", "log.csv"], 0);
    assert!(said.contains("over 2001 states of the log)"), "{said}");
    refused(&folder, &["--mjcf", "b.xml", "--log", "none.csv"], &["none.csv"]);
}

#[test]
fn bad_usage_and_missing_files_are_refused() {
    let folder = identified();
    refused(&folder, &[], &["--urdf, --mjcf, --model"]);
    refused(&folder, &["--urdf", "no/such/new.urdf"], &["no/such/new.urdf", "folder exists"]);
    refused(&folder, &["--urdf", "arm.urdf"], &["arm.urdf would be overwritten"]);
    refused(&folder, &["--mjcf", "estimate.json"], &["would be overwritten"]);
    refused(&folder, &["--urdf", "a", "--model", "a"], &["is written by --urdf already"]);
    refused(&folder, &["--urdf", "new.urdf", "--robot", "none.urdf"], &["none.urdf", "check the path"]);
    refused(&folder, &["--urdf", "new.urdf", "--robot", "log.csv"], &["log.csv"]);
    std::fs::rename(folder.path().join("arm.urdf"), folder.path().join("moved.urdf")).unwrap();
    refused(&folder, &["--urdf", "new.urdf"], &["robot file `arm.urdf` is not there", "--robot FILE"]);
    let said = export(&folder, &["--urdf", "new.urdf", "--robot", "moved.urdf"], 0);
    assert!(!said.contains("has changed"), "{said}");
    let output = run(folder.path(), &["export", "log.csv", "--model", "x.json"], 2);
    assert!(String::from_utf8(output.stderr).unwrap().contains("log.csv: not an estimate"));
    run(folder.path(), &["export", "estimate.json", "--sdf", "x.sdf"], 2);
}

#[test]
fn a_changed_robot_file_is_told_and_another_geometry_refused() {
    let folder = identified();
    let path = folder.path().join("arm.urdf");
    std::fs::write(&path, TWO_LINKS.replace("<link name=\"base\"/>", "<link name=\"base\"/> <!-- new -->"))
        .unwrap();
    let said = export(&folder, &["--urdf", "new.urdf"], 0);
    assert!(said.contains("warning: arm.urdf has changed since it was identified"), "{said}");
    assert!(read(&folder, "new.urdf").contains("<!-- new -->"));
    std::fs::write(&path, TWO_LINKS.replace("0 0 0.35", "0 0 0.36")).unwrap();
    refused(&folder, &["--urdf", "b.urdf"], &["URDF: read back", "expected at most 1e-9"]);
    std::fs::write(&path, TWO_LINKS.replace("\"elbow\"", "\"knee\"")).unwrap();
    refused(&folder, &["--mjcf", "b.xml"], &["not the robot of the estimate", "`knee`"]);
}

#[test]
fn impossible_links_need_a_flag_and_negative_friction_is_told() {
    let folder = identified();
    set(&folder, "elbow.fv", -0.5);
    let said = export(&folder, &["--urdf", "new.urdf"], 0);
    assert!(said.contains("viscous friction of `elbow` is negative (-5.0000e-1 N m s/rad)"), "{said}");
    assert!(!read(&folder, "new.urdf").contains("damping=\"-"));
    set(&folder, "forearm.m", -1.0);
    for output in ["--urdf", "--mjcf", "--model"] {
        refused(&folder, &[output, "refused"], &["link `forearm` has a negative mass", "--allow-unphysical"]);
    }
    let said = export(&folder, &["--urdf", "new.urdf", "--allow-unphysical"], 0);
    assert!(said.contains("warning: link `forearm` has a negative mass"), "{said}");
    assert!(read(&folder, "new.urdf").contains("<mass value=\"-1.0\"/>"));
}

#[test]
fn identify_writes_its_robot_the_same_way() {
    let folder = identified();
    let output = run(folder.path(), &["identify", "arm.urdf", "--log", "log.csv", "--out", "again"], 0);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("left out, URDF has no place for it: rotor inertia"), "{said}");
    let args = ["export", "again/estimate.json", "--urdf", "by_export.urdf", "--allow-unphysical"];
    run(folder.path(), &args, 0);
    assert_eq!(read(&folder, "again/arm.urdf"), read(&folder, "by_export.urdf"));
}

#[test]
fn a_robot_from_toml_becomes_a_urdf_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("indy7.toml"), indy7()).unwrap();
    run(at, &["simulate", "indy7.toml", "--duration", "12", "--rate-hz", "100", "--out", "log.csv"], 0);
    let args = ["identify", "indy7.toml", "--log", "log.csv", "--out", "out", "--quiet"];
    assert!(matches!(dynid().current_dir(at).args(args).output().unwrap().status.code(), Some(0 | 1)));
    run(at, &["export", "out/estimate.json", "--urdf", "new.urdf", "--allow-unphysical"], 0);
    let inspected = json_of(&run(at, &["inspect", "new.urdf", "--json"], 0).stdout);
    assert_eq!(inspected["joints"].as_array().unwrap().len(), 6);
    assert_eq!(read(&folder, "new.urdf"), read(&folder, "out/indy7.urdf"));
}

#[test]
fn an_identification_is_not_lost_to_a_joint_that_urdf_cannot_state() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let screw = "schema = 1\nname = \"screw\"\n[[body]]\nname = \"nut\"\nparent = \"ground\"\n\
         joint = { name = \"j\", kind = \"helical\", pitch = 0.01, axis = [1, 0, 0] }\n\
         mass = 1.0\ncom = [0, 0.1, 0]\ninertia_com = [0.1, 0, 0, 0.1, 0, 0.1]\n";
    std::fs::write(at.join("screw.toml"), screw).unwrap();
    run(at, &["simulate", "screw.toml", "--duration", "20", "--rate-hz", "100", "--out", "log.csv"], 0);
    let args = ["identify", "screw.toml", "--log", "log.csv", "--out", "out", "--quiet"];
    let said = String::from_utf8(run(at, &args, 0).stderr).unwrap();
    assert!(said.contains("not written: out/screw.urdf: joint `j`: cannot be written as URDF"), "{said}");
    assert!(at.join("out/estimate.json").is_file() && !at.join("out/screw.urdf").exists());
    let output = run(at, &["export", "out/estimate.json", "--mjcf", "x.xml", "--allow-unphysical"], 2);
    assert!(String::from_utf8(output.stderr).unwrap().contains("MJCF has no helical joints"));
}
