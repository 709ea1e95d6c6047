//! One message per fault of a robot file: file, place, what was expected, what was found, and a hint.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;
use std::path::{Path, PathBuf};

use dynid_robots::{robot, toml_robot, urdf};

#[track_caller]
pub(super) fn check(message: &str, hint: Option<&str>, parts: &[&str], hint_part: &str) {
    assert!(!message.contains('\n'), "more than one line: {message}");
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    let hint = hint.unwrap_or_default();
    assert!(hint.contains(hint_part), "`{hint_part}` is not in the hint of: {message}: {hint}");
}

const GOOD_INERTIAL: &str = "<inertial><mass value=\"1\"/>\
     <inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial>";

/// A robot with two links; the arguments replace the parts that are broken.
fn two_links(inertial: &str, joint_type: &str, joint: &str) -> String {
    format!(
        "<robot name=\"r\">\n<link name=\"a\"/>\n<link name=\"b\">\n{inertial}\n</link>\n\
         <joint name=\"j\" type=\"{joint_type}\">\n<parent link=\"a\"/><child link=\"b\"/>\n{joint}\n</joint>\n</robot>"
    )
}

#[test]
fn broken_urdfs() {
    let inertial = |s: &str| two_links(s, "revolute", "");
    let joint = |s: &str| two_links(GOOD_INERTIAL, "revolute", s);
    let deep = "<a>".repeat(100_000);
    let cases: Vec<(String, Vec<&str>, &str)> = vec![
        (
            String::new(),
            vec!["r.urdf:1:1", "expected <robot> (URDF), <mujoco> (MJCF) or <sdf>", "an empty file"],
            "<robot name",
        ),
        (
            "hello".into(),
            vec!["r.urdf:1:1", "expected <robot> (URDF), <mujoco> (MJCF) or <sdf>", "`hello`"],
            "<robot name",
        ),
        (
            "<collada version=\"1.6\"></collada>".into(),
            vec!["expected <robot> (URDF), <mujoco> (MJCF) or <sdf>", "<collada>"],
            "SDF",
        ),
        ("<robot name=\"r\">".into(), vec!["r.urdf:1:1", "never closed"], "cut off"),
        (
            "<robot name=\"r\">\n<link name=\"a\">\n</lnk></robot>".into(),
            vec!["r.urdf:3:1", "XML"],
            "damaged",
        ),
        ("<robot name=\"r\">\n<link name=\"a\"".into(), vec!["r.urdf:2", "XML"], "cut off"),
        ("<robot name=\"r\"></robot>".into(), vec!["<robot>", "at least one <link>"], "add"),
        ("<robot/><robot/>".into(), vec!["r.urdf:1:9", "second outermost"], ""),
        (
            "<robot name=\"r\">\n<link/></robot>".into(),
            vec!["r.urdf:2:1", "<link>", "attribute `name`"],
            "add",
        ),
        (
            "<robot name=\"r\">\n<link name=\"a\"/>\n<link name=\"a\"/></robot>".into(),
            vec!["r.urdf:3:1", "link name once", "`a`", "line 2"],
            "rename",
        ),
        (
            joint("").replace("</robot>", "<joint name=\"j\" type=\"fixed\"/></robot>"),
            vec!["r.urdf:10:1", "joint name once", "`j`", "line 6"],
            "rename",
        ),
        (
            two_links("", "planar", ""),
            vec!["r.urdf:6:17", "joint `j`", "revolute", "`planar`"],
            "two prismatic",
        ),
        (two_links("", "hinge", ""), vec!["r.urdf:6:17", "joint `j`", "`hinge`"], "type"),
        (inertial("<inertial/>"), vec!["r.urdf:4:1", "link `b`", "<mass>", "found none"], "not stated"),
        (
            inertial("<inertial><mass value=\"1\"/></inertial>"),
            vec!["r.urdf:4:1", "link `b`", "<inertia>"],
            "not stated",
        ),
        (
            inertial(&GOOD_INERTIAL.replace(" iyz=\"0\"", "")),
            vec!["r.urdf:4:", "link `b`", "`iyz` of <inertia>"],
            "<inertial>",
        ),
        (
            inertial(&GOOD_INERTIAL.replace("value=\"1\"", "value=\"nan\"")),
            vec!["r.urdf:4:17", "link `b`", "<mass> value", "a finite number", "`nan`"],
            "correct",
        ),
        (
            inertial(&GOOD_INERTIAL.replace("izz=\"1\"", "izz=\"1,5\"")),
            vec!["<inertia> izz", "a finite number", "`1,5`"],
            "point as decimal",
        ),
        (
            inertial(&GOOD_INERTIAL.replace("value=\"1\"", "value=\"1e999\"")),
            vec!["a finite number", "`1e999`"],
            "correct",
        ),
        (
            inertial(&format!("{GOOD_INERTIAL}{GOOD_INERTIAL}")),
            vec!["r.urdf:4:", "link `b`", "<inertial>", "again"],
            "remove",
        ),
        (
            joint("<origin xyz=\"0 0\"/>"),
            vec!["r.urdf:8:9", "joint `j`", "<origin> xyz", "three finite numbers", "`0 0`"],
            "correct",
        ),
        (joint("<axis xyz=\"0 0 0 1\"/>"), vec!["r.urdf:8:7", "<axis> xyz", "`0 0 0 1`"], "correct"),
        (joint("<origin rpy=\"0 inf 0\"/>"), vec!["<origin> rpy", "`0 inf 0`"], "correct"),
        (
            joint("<limit lower=\"2\" upper=\"1\"/>"),
            vec!["r.urdf:8:8", "<limit> lower", "lower <= upper", "`2`"],
            "correct",
        ),
        (joint("<mimic multiplier=\"2\"/>"), vec!["r.urdf:8:1", "`joint` of <mimic>"], "add"),
        (joint("").replace("<child link=\"b\"/>", ""), vec!["r.urdf:6:1", "joint `j`", "<child>"], "add"),
        (
            joint("").replace(" type=\"revolute\"", ""),
            vec!["r.urdf:6:1", "joint `j`", "`type` of <joint>"],
            "add",
        ),
        (
            "<robot name=\"r\">\n<xacro:macro name=\"m\"/></robot>".into(),
            vec!["r.urdf:2:1", "plain XML", "<xacro:macro>"],
            "expand",
        ),
        (joint("<origin xyz=\"${x} 0 0\"/>"), vec!["r.urdf:8:9", "xacro", "${x} 0 0"], "expand"),
        (format!("<robot>{deep}"), vec!["r.urdf:1:", "at most 256 levels"], "robot"),
        (
            joint("").replace("<link name=\"a\"/>", "<link name=\"a\" name=\"c\"/>"),
            vec!["r.urdf:2", "duplicate"],
            "",
        ),
    ];
    for (text, parts, hint) in &cases {
        let error = urdf::parse(text, "r.urdf").expect_err(&text[..text.len().min(200)]);
        check(&error.to_string(), error.hint().as_deref(), parts, hint);
    }
}

#[test]
fn broken_toml_robots() {
    let dh = "dh = \"modified\"\n";
    let cases: Vec<(String, Vec<&str>, &str)> = vec![
        (String::new(), vec!["r.toml:1:1", "`joint`, `body`, `urdf`"], "add"),
        (format!("home = {}", "[".repeat(100_000)), vec!["r.toml:1:"], ""),
        ("name = ".into(), vec!["r.toml:1:"], ""),
        ("nmae = \"x\"".into(), vec!["r.toml:1:1", "unknown field `nmae`"], "misspelt"),
        ("schema = 2".into(), vec!["r.toml:1:10", "expected 1, found 2"], ""),
        ("joint = [{ name = \"j\" }]".into(), vec!["r.toml:1:1", "dh = \"modified\""], "add"),
        (format!("{dh}joint = []"), vec!["at least one row"], "add"),
        (
            format!("{dh}joint = [\n{{ name = \"j\", alhpa = 1 }}]"),
            vec!["r.toml:3:15", "unknown field `alhpa`"],
            "misspelt",
        ),
        (
            format!("{dh}joint = [\n{{ name = \"j\", alpha = \"90grad\" }}]"),
            vec!["r.toml:3:23", "90grad", "90deg"],
            "",
        ),
        (format!("{dh}joint = [{{ name = \"j\", a = nan }}]"), vec!["r.toml:2:28", "NaN", "finite"], ""),
        (format!("{dh}joint = [{{ name = \"j\", phi = [1, 2] }}]"), vec!["r.toml:2:30", "10"], ""),
        (
            format!("{dh}joint = [\n{{ name = \"j\" }},\n{{ name = \"j\" }}]"),
            vec!["r.toml:4:1", "joint name once", "`j`", "line 3"],
            "rename",
        ),
        (
            format!("{dh}joint = [{{ name = \"j\", kind = \"planar\" }}]"),
            vec!["r.toml:2:31", "planar", "revolute"],
            "",
        ),
        (
            format!("{dh}joint = [{{ name = \"j\", kind = \"prismatic\", d = 1 }}]"),
            vec!["r.toml:2:10", "joint `j`", "d: expected none or 0", "`1`"],
            "",
        ),
        (
            format!("{dh}joint = [{{ name = \"j\", frame = \"distal\" }}]"),
            vec!["joint `j`", "frame", "`distal`"],
            "",
        ),
        (
            format!("{dh}joint = [{{ name = \"j\", limits = {{ position = [1, -1] }} }}]"),
            vec!["limits.position", "lower <= upper", "`1, -1`"],
            "",
        ),
        (format!("{dh}joint = [{{ name = \"j\", com = [0, 0, 0] }}]"), vec!["joint `j`", "`mass`"], "add"),
        (
            format!("{dh}joint = [{{ name = \"j1\" }}]\nactuated = [\"j2\"]"),
            vec!["actuated", "name of a joint", "`j2`"],
            "did you mean `j1`",
        ),
        (
            format!("{dh}joint = [{{ name = \"j1\" }}]\n[element.wrist]\nelements = []"),
            vec!["element", "`wrist`"],
            "joint names",
        ),
        (
            format!(
                "{dh}joint = [{{ name = \"j1\" }}]\n[[coupling]]\nmotors = [\"m\"]\njoints = [\"j1\"]\nmatrix = [[1, 2]]"
            ),
            vec!["r.toml:3:", "coupling", "1 rows (motors) of 1 numbers", "[2]"],
            "",
        ),
        (
            "body = [{ name = \"b\", parent = \"ground\", joint = { kind = \"helical\", axis = [0,0,1] } }]"
                .into(),
            vec!["r.toml:1:9", "body `b`", "`pitch`"],
            "add",
        ),
        (
            "body = [{ name = \"b\", parent = \"ground\", joint = { kind = \"revolute\" } }]".into(),
            vec!["body `b`", "`axis`"],
            "add",
        ),
        (
            "body = [{ name = \"b\", parent = \"ground\", joint = { kind = \"fixed\" } }]\nloop = [1]".into(),
            vec!["r.toml:2:9", "invalid type", "a table with `name`, `kind`"],
            "",
        ),
        ("urdf = \"no/such.urdf\"".into(), vec!["such.urdf", "cannot be read"], "path"),
    ];
    for (text, parts, hint) in &cases {
        let error = toml_robot::parse(text, "r.toml").expect_err(text);
        check(&error.to_string(), error.hint().as_deref(), parts, hint);
    }
}

fn file(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn files_that_are_no_robots() {
    let folder = tempfile::tempdir().unwrap();
    let latin = file(folder.path(), "r.urdf", b"<robot name=\"\xE9\"/>");
    let error = robot::read(latin).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["r.urdf", "UTF-8", "0xE9", "offset 13"], "UTF-8");
}
