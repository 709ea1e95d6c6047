//! One message per fault: file, place, what was expected, what was found, and a hint.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use dynid_io::columns::MappingSpec;
use dynid_io::csv::{self, ReadOptions};
use dynid_io::{ColumnMapping, GuessOptions, StateJoint, robot, states, toml_robot, urdf};
use flate2::Compression;
use flate2::write::GzEncoder;

#[track_caller]
fn check(message: &str, hint: Option<&str>, parts: &[&str], hint_part: &str) {
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
            vec!["r.urdf:2:1", "plain URDF", "<xacro:macro>"],
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

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn file(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn broken_logs() {
    let text = |s: &str| s.as_bytes().to_vec();
    let mut noise = String::from("t,q1\n");
    for k in 0..20_000u64 {
        noise.push_str(&format!("{k},{}\n", k.wrapping_mul(6_364_136_223_846_793_005) >> 40));
    }
    let whole = gzip(noise.as_bytes());
    let mut flipped = whole.clone();
    let checksum = flipped.len() - 8;
    flipped[checksum] ^= 0xFF;
    let cases: Vec<(Vec<u8>, Vec<&str>, &str)> = vec![
        (text(""), vec!["log.csv", "an empty file"], "names the columns"),
        (text("\n  \n# only a comment\n"), vec!["an empty file"], "names the columns"),
        (text("t,q1\n"), vec!["line 1", "rows of numbers", "none"], "recording"),
        (text("0,1\n1,2\n"), vec!["line 1", "column names", "numbers `0,1`"], "first line"),
        (text("t,q1\n0,1\n1\n"), vec!["row 2 (line 3)", "expected 2 fields", "found 1"], "cut off"),
        (text("t,q1\n0,1\n1,2,3\n"), vec!["row 2 (line 3)", "expected 2 fields", "found 3"], "decimal comma"),
        (
            text("t,q1\n\n0,1\n# c\n1,abc\n"),
            vec!["row 2 (line 5)", "column `q1`", "a number", "`abc`"],
            "correct",
        ),
        (text("t,q1\n0,\n"), vec!["row 1 (line 2)", "column `q1`", "a number", "``"], "missing"),
        (text("t;q1\n0;1,5\n"), vec!["row 1", "column `q1`", "`1,5`"], "point as decimal"),
        (
            text("t,q1\n0,1\n1,NaN\n"),
            vec!["row 2 (line 3)", "column `q1`", "finite", "`NaN`"],
            "remove the row",
        ),
        (text("t,q1\n0,-inf\n"), vec!["row 1", "finite", "`-inf`"], "remove the row"),
        (text("t,q1\n0,1e999\n"), vec!["row 1", "finite", "`1e999`"], "remove"),
        (text("t,q1\n0,2e12\n"), vec!["row 1", "column `q1`", "up to 1e12", "`2e12`"], "sentinel"),
        (text("t,q1,q1\n0,1,2\n"), vec!["line 1", "`q1` in columns 2 and 3"], "rename"),
        (text("t,q1\n\0\0\0"), vec!["binary data"], "CSV"),
        (vec![0xFF, 0xFE, b't', 0], vec!["UTF-16"], "UTF-8"),
        (text("PK\x03\x04...."), vec!["zip"], "CSV"),
        (whole[..whole.len() / 2].to_vec(), vec!["whole gzip file", "found its end after line"], "again"),
        (flipped, vec!["damaged stream"], "gzip -t"),
        (gzip(&vec![b'1'; 4 << 20]), vec!["line 1", "at most 1048576 bytes"], "line ends"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (bytes, parts, hint) in &cases {
        let path = file(folder.path(), "log.csv", bytes);
        let error = csv::read(&path, &ReadOptions::default()).expect_err(parts[0]);
        check(&error.to_string(), error.hint().as_deref(), parts, hint);
    }
    let error = csv::read(folder.path().join("none.csv"), &ReadOptions::default()).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["none.csv", "cannot be read"], "path");
    let error = csv::read(folder.path(), &ReadOptions::default()).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["cannot be read"], "is a file");
}

#[test]
fn logs_beyond_their_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "0,0\n".repeat(500_000);
    let bomb = file(folder.path(), "bomb.csv.gz", &gzip(format!("t,q1\n{rows}").as_bytes()));
    let small = ReadOptions { max_bytes: 1 << 20, ..ReadOptions::default() };
    let error = csv::read(&bomb, &small).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["at most 1048576 bytes"], "cap");
    let tight = ReadOptions { max_ratio: 100, ratio_grace: 1 << 20, ..ReadOptions::default() };
    let error = csv::read(&bomb, &tight).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["at most 100:1"], "decompress");
    assert_eq!(csv::read(&bomb, &ReadOptions::default()).unwrap().rows, 500_000);

    let log = file(folder.path(), "log.csv", b"t,q1\n0,1\n1,2\n");
    for (rows, part) in
        [((0, 1), "row 0"), ((2, 1), "an empty range"), ((3, 4), "2 rows"), ((1, 3), "2 rows")]
    {
        let options = ReadOptions { rows: Some(rows), ..ReadOptions::default() };
        let error = csv::read(&log, &options).unwrap_err();
        check(&error.to_string(), error.hint().as_deref(), &["rows", part], "from 1");
    }
    let options = ReadOptions { ignore: vec!["mode".into()], ..ReadOptions::default() };
    let error = csv::read(&log, &options).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["`mode`"], "header");
}

fn strings(list: &str) -> Vec<String> {
    list.split(',').map(str::to_owned).collect()
}

#[test]
fn columns_that_do_not_fit() {
    let joints = strings("shoulder,elbow");
    let cases = [
        ("q1,q2,tau1,tau2", vec!["time", "timestamp", "found q1, q2"], "rate_hz"),
        ("t,time,q1,q2,tau1,tau2", vec!["time", "one column", "t, time"], "which one"),
        ("t,q1,tau1,tau2", vec!["position of `elbow`", "q2", "q_elbow", "found t, q1"], "allow_unlogged"),
        ("t,q1,pos1,q2,tau1,tau2", vec!["position of `shoulder`", "q1, pos1"], "which one"),
        ("t,q0,q1,q2,tau1,tau2", vec!["position", "`"], ""),
        ("t,q1,q2,tau1", vec!["effort of `elbow`", "tau2"], "name the columns"),
        ("t,q1,q2,i1,i2", vec!["effort of `shoulder`, `elbow`"], "drive gains"),
        ("t,q1,q2,dq1,tau1,tau2", vec!["velocity of `elbow`", "dq2"], "name the columns"),
        ("t[h],q1,q2,tau1,tau2", vec!["time", "`t[h]`", "s, ms", "`h`"], "unit"),
        ("t,q1[grad],q2,tau1,tau2", vec!["position", "`q1[grad]`", "deg", "`grad`"], "unit"),
        ("t,q1,q2,tau1[A],tau2[A]", vec!["effort", "`tau1[A]`", "gains"], "scale"),
    ];
    for (header, parts, hint) in cases {
        match ColumnMapping::guess(&strings(header), &joints, &GuessOptions::default()) {
            Err(error) => check(&error.to_string(), error.hint().as_deref(), &parts, hint),
            // `q0` beside `q1`, `q2`: numbers from 0, so `q2` is passed over.
            Ok(mapping) => {
                assert!(header.contains("q0") && mapping.position[0].as_ref().unwrap().name == "q0")
            }
        }
    }
    let header = strings("t,q1,q2,tau1,tau2");
    let specs: [(&str, Vec<&str>, &str); 8] = [
        ("position = \"p{}\"", vec!["position", "`p1`", "found t, q1"], "did you mean"),
        ("position = [\"q1\"]", vec!["position", "columns", "expected 2", "found 1"], "one entry per joint"),
        ("position = \"q1\"", vec!["position", "`{}`"], "one entry"),
        ("position = { shoulder = \"q1\", elbw = \"q2\" }", vec!["joint of the robot", "`elbw`"], "`elbow`"),
        ("effort = { columns = \"tau{}\", unit = \"A\" }", vec!["effort", "`tau1`", "gains"], "scale"),
        ("effort = { columns = \"tau{}\", scale = 0.0 }", vec!["effort", "scale", "not zero", "found 0"], ""),
        (
            "effort = \"q{}\"",
            vec!["column `q1`", "position of `shoulder`", "effort of `shoulder`"],
            "which one",
        ),
        ("rate_hz = -1.0", vec!["time", "rate_hz", "positive", "found -1"], ""),
    ];
    for (text, parts, hint) in specs {
        let spec: MappingSpec = toml::from_str(text).unwrap();
        let error = ColumnMapping::from_spec(&header, &joints, &spec).expect_err(text);
        check(&error.to_string(), error.hint().as_deref(), &parts, hint);
    }
}

#[test]
fn broken_states_and_robot_files() {
    let folder = tempfile::tempdir().unwrap();
    let one = [StateJoint::Scalar("j".into())];
    let base = [StateJoint::Floating("base".into())];
    let floating = "q1,q2,q3,q4,q5,q6,q7,dq1,dq2,dq3,dq4,dq5,dq6,ddq1,ddq2,ddq3,ddq4,ddq5,ddq6\n\
                    0,0,0,0,0,0,2,0,0,0,0,0,0,0,0,0,0,0,0\n";
    let cases: [(&str, &[StateJoint], Vec<&str>, &str); 4] = [
        ("q1,dq1\n0,0\n", &one, vec!["acceleration", "ddq_j", "ddq1", "found q1, dq1"], "number them"),
        ("q1,q2,dq1,ddq1\n0,0,0,0\n", &one, vec!["position", "expected 1", "`q2`"], "another robot"),
        ("q1,dq1,ddq1,gx\n0,0,0,0\n", &one, vec!["gravity", "gx, gy, gz"], ""),
        (floating, &base, vec!["row 1", "joint `base`", "length 1", "found 2"], "normalise"),
    ];
    for (text, joints, parts, hint) in cases {
        let path = file(folder.path(), "s.csv", text.as_bytes());
        let error = states::read(&path, joints, &ReadOptions::default()).expect_err(text);
        check(&error.to_string(), error.hint().as_deref(), &parts, hint);
    }
    let latin = file(folder.path(), "r.urdf", b"<robot name=\"\xE9\"/>");
    let error = robot::read(latin).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["r.urdf", "UTF-8", "0xE9", "offset 13"], "UTF-8");
    let xacro = file(folder.path(), "r.urdf.xacro", b"<robot/>");
    let error = robot::read(xacro).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["xacro"], "expand");
}
