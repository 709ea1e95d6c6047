//! One message per fault of a log: file, place, what was expected, what was found, and a hint.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use dynid_logs::columns::MappingSpec;
use dynid_logs::csv::{self, ReadOptions};
use dynid_logs::{ColumnMapping, GuessOptions, StateJoint, states};
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
fn broken_states() {
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
}
