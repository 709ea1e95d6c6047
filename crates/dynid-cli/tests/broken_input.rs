//! Broken input gets exit code 2, one message that says where and what, at most one hint, and leaves nothing behind.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod support;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::sync::OnceLock;

use flate2::Compression;
use flate2::write::GzEncoder;
use support::{TWO_LINKS, dynid, indy7, run};

/// Sound files beside which the broken ones are put.
struct Sound {
    log: String,
    states: String,
    estimate: String,
}

const CONFIG: &str = "robot = \"robot.urdf\"\nout = \"out\"\n[[log]]\npath = \"log.csv\"\n";

fn sound() -> &'static Sound {
    static SOUND: OnceLock<Sound> = OnceLock::new();
    SOUND.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("robot.urdf"), TWO_LINKS).unwrap();
        run(
            folder.path(),
            &[
                "simulate",
                "robot.urdf",
                "--duration",
                "12",
                "--rate-hz",
                "100",
                "--out",
                "log.csv",
                "--clean",
                "states.csv",
            ],
            0,
        );
        run(folder.path(), &["identify", "robot.urdf", "--log", "log.csv", "--out", "out"], 0);
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        Sound { log: read("log.csv"), states: read("states.csv"), estimate: read("out/estimate.json") }
    })
}

/// One broken input.
struct Case {
    /// Name and bytes of the broken file.
    file: (&'static str, Vec<u8>),
    /// Arguments, separated by spaces.
    args: &'static str,
    /// What the message must hold.
    message: &'static [&'static str],
    /// What the hint must hold; empty: a hint is not required.
    hint: &'static str,
}

fn case(
    name: &'static str,
    bytes: impl Into<Vec<u8>>,
    args: &'static str,
    message: &'static [&'static str],
    hint: &'static str,
) -> Case {
    Case { file: (name, bytes.into()), args, message, hint }
}

/// Every file and folder below a folder with its bytes.
fn listing(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            if path.is_dir() {
                out.insert(name + "/", Vec::new());
                folders.push(path);
            } else {
                out.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    out
}

/// Faults of one refusal, in words; empty if it is as it should be.
fn faults(case: &Case) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    put("robot.urdf", TWO_LINKS.as_bytes());
    put("indy7.toml", indy7().as_bytes());
    put("log.csv", sound().log.as_bytes());
    put("states.csv", sound().states.as_bytes());
    put("estimate.json", sound().estimate.as_bytes());
    put("config.toml", CONFIG.as_bytes());
    put(case.file.0, &case.file.1);
    let before = listing(folder.path());
    let output = dynid().current_dir(folder.path()).args(case.args.split(' ')).output().unwrap();
    let mut faults = Vec::new();
    let mut expect = |holds: bool, fault: String| {
        if !holds {
            faults.push(fault);
        }
    };
    let stderr = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = stderr.lines().collect();
    let message = lines.first().copied().unwrap_or_default();
    let hint = lines.get(1).copied().unwrap_or_default();
    expect(output.status.code() == Some(2), format!("exit code {:?}", output.status.code()));
    expect(message.starts_with("error: "), "the first line is no message".to_owned());
    expect(lines.len() <= 2, format!("{} lines", lines.len()));
    expect(hint.is_empty() || hint.starts_with("hint: "), "the second line is no hint".to_owned());
    expect(stderr.len() < 1500, format!("{} bytes of message", stderr.len()));
    expect(!stderr.contains("panicked"), "panic".to_owned());
    for part in case.message {
        expect(message.contains(part), format!("`{part}` is not in the message"));
    }
    expect(hint.contains(case.hint), format!("`{}` is not in the hint", case.hint));
    expect(output.stdout.is_empty(), "something on stdout".to_owned());
    let after = listing(folder.path());
    expect(after == before, format!("left behind or changed: {:?}", changed(&before, &after)));
    if faults.is_empty() {
        return faults;
    }
    faults.insert(0, format!("dynid {} ({}): {}", case.args, case.file.0, stderr.trim_end()));
    faults
}

fn changed<'a>(before: &BTreeMap<String, Vec<u8>>, after: &'a BTreeMap<String, Vec<u8>>) -> Vec<&'a String> {
    after.iter().filter(|(name, bytes)| before.get(*name) != Some(bytes)).map(|(name, _)| name).collect()
}

#[track_caller]
fn check(cases: &[Case]) {
    let faults: Vec<String> =
        cases.iter().map(faults).filter(|f| !f.is_empty()).map(|f| f.join("\n    ")).collect();
    assert!(faults.is_empty(), "{} of {} cases:\n{}", faults.len(), cases.len(), faults.join("\n"));
}

/// A CSV with one field of a data row (from 1) replaced.
fn with_field(csv: &str, row: usize, column: &str, value: &str) -> String {
    let mut lines: Vec<String> = csv.lines().map(str::to_owned).collect();
    let at = lines[0].split(',').position(|name| name == column).unwrap();
    let mut fields: Vec<&str> = lines[row].split(',').collect();
    fields[at] = value;
    lines[row] = fields.join(",");
    lines.join("\n") + "\n"
}

/// A CSV with a column mapped from row number (from 0) and value.
fn with_column(csv: &str, column: &str, value: impl Fn(usize, f64) -> f64) -> String {
    let at = csv.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    let mut out = csv.lines().next().unwrap().to_owned() + "\n";
    for (row, line) in csv.lines().skip(1).enumerate() {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        fields[at] = value(row, fields[at].parse().unwrap()).to_string();
        out += &(fields.join(",") + "\n");
    }
    out
}

/// A CSV without a column.
fn without(csv: &str, column: &str) -> String {
    let at = csv.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    let keep = |line: &str| {
        let kept: Vec<&str> = line.split(',').enumerate().filter(|(k, _)| *k != at).map(|(_, f)| f).collect();
        kept.join(",") + "\n"
    };
    csv.lines().map(keep).collect()
}

fn first_rows(csv: &str, rows: usize) -> String {
    csv.lines().take(rows + 1).map(|line| line.to_owned() + "\n").collect()
}

/// A log of `t, q1.., tau1..` with sines, 200 rows at 100 Hz.
fn sines(joints: usize) -> String {
    let names = |prefix: &str| (1..=joints).map(|j| format!(",{prefix}{j}")).collect::<String>();
    let mut out = format!("t{}{}\n", names("q"), names("tau"));
    for row in 0..200 {
        let t = f64::from(row) * 0.01;
        out += &t.to_string();
        for k in 0..2 * joints {
            out += &format!(",{}", (t * (1.0 + k as f64)).sin());
        }
        out += "\n";
    }
    out
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// 64 MiB of zeros on one line, compressed about 1030:1.
fn gzip_bomb() -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(b"t,q1,q2,tau1,tau2\n").unwrap();
    for _ in 0..64 {
        encoder.write_all(&vec![b'0'; 1 << 20]).unwrap();
    }
    encoder.finish().unwrap()
}

const IDENTIFY: &str = "identify robot.urdf --log bad.csv --out out";
const IDENTIFY_GZ: &str = "identify robot.urdf --log bad.csv.gz --out out";

#[test]
fn log_files() {
    let log = &sound().log;
    let compressed = gzip(log.as_bytes());
    let mut damaged = compressed.clone();
    // The first block after the ten bytes of the header gets a type that does not exist.
    damaged[10] = 0xff;
    let with_short_row = log.lines().enumerate().map(|(k, line)| {
        let line = if k == 7 { line.rsplit_once(',').unwrap().0 } else { line };
        line.to_owned() + "\n"
    });
    let with_long_row =
        log.lines().enumerate().map(|(k, line)| line.to_owned() + if k == 9 { ",1\n" } else { "\n" });
    check(&[
        case(
            "other",
            "",
            "identify robot.urdf --log gone.csv --out out",
            &["gone.csv", "No such file"],
            "path",
        ),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --validate gone.csv --out out",
            &["gone.csv"],
            "path",
        ),
        case("bad.csv", "", IDENTIFY, &["bad.csv", "empty file"], "first line"),
        case(
            "bad.csv",
            first_rows(log, 0),
            IDENTIFY,
            &["bad.csv", "after the header", "found none"],
            "recording",
        ),
        case(
            "bad.csv",
            log.lines().nth(1).unwrap(),
            IDENTIFY,
            &["bad.csv", "column names", "numbers"],
            "first line",
        ),
        case(
            "bad.csv.gz",
            &compressed[..compressed.len() / 2],
            IDENTIFY_GZ,
            &["bad.csv.gz", "whole gzip"],
            "cut off",
        ),
        case("bad.csv.gz", damaged, IDENTIFY_GZ, &["bad.csv.gz", "damaged"], "gzip -t"),
        case(
            "bad.csv",
            b"\x7fELF\x02\x01\x01\x00\x00\xff\xfe".repeat(50),
            IDENTIFY,
            &["bad.csv", "expected text"],
            "CSV",
        ),
        case(
            "bad.csv",
            with_short_row.collect::<String>(),
            IDENTIFY,
            &["bad.csv", "row 7 (line 8)", "expected 5", "found 4"],
            "cut off",
        ),
        case(
            "bad.csv",
            with_long_row.collect::<String>(),
            IDENTIFY,
            &["bad.csv", "row 9 (line 10)", "expected 5", "found 6"],
            "comma",
        ),
        case(
            "bad.csv",
            with_field(log, 12, "q_elbow", "fast"),
            IDENTIFY,
            &["row 12 (line 13)", "`q_elbow`", "a number", "`fast`"],
            "correct",
        ),
        case(
            "bad.csv",
            with_field(log, 12, "q_elbow", ""),
            IDENTIFY,
            &["row 12", "`q_elbow`", "a number"],
            "missing",
        ),
        case(
            "bad.csv",
            with_field(log, 3, "tau_elbow", "NaN"),
            IDENTIFY,
            &["row 3", "`tau_elbow`", "finite", "`NaN`"],
            "row",
        ),
        case(
            "bad.csv",
            with_field(log, 3, "q_shoulder", "-inf"),
            IDENTIFY,
            &["row 3", "`q_shoulder`", "finite", "`-inf`"],
            "row",
        ),
        case(
            "bad.csv",
            with_field(log, 3, "tau_elbow", "1e300"),
            IDENTIFY,
            &["row 3", "`tau_elbow`", "`1e300`"],
            "sentinel",
        ),
        case(
            "bad.csv",
            log.replacen("q_elbow", "q_shoulder", 1),
            IDENTIFY,
            &["line 1", "`q_shoulder`", "columns 2 and 3"],
            "rename",
        ),
        case("bad.csv", with_column(log, "t", |_, t| -t), IDENTIFY, &["bad.csv", "time"], "time"),
        case("bad.csv", with_column(log, "t", |_, _| 1.0), IDENTIFY, &["bad.csv", "time"], "time"),
        case("bad.csv", without(log, "t"), IDENTIFY, &["bad.csv", "time"], "rate_hz"),
        case("bad.csv", without(log, "q_elbow"), IDENTIFY, &["bad.csv", "position of", "elbow"], "allow"),
        case("bad.csv", without(log, "tau_elbow"), IDENTIFY, &["bad.csv", "effort of", "elbow"], "mapping"),
        case(
            "bad.csv",
            sines(5),
            "identify indy7.toml --log bad.csv --out out",
            &["bad.csv", "position of", "q6"],
            "allow",
        ),
        case(
            "bad.csv",
            sines(7),
            "identify indy7.toml --log bad.csv --out out",
            &["bad.csv", "expected 6", "`q7`"],
            "another robot",
        ),
        case("bad.csv", gzip_bomb(), IDENTIFY, &["bad.csv", "line 2", "at most"], "line ends"),
    ]);
}

#[test]
fn log_signals() {
    let log = &sound().log;
    let degrees =
        with_column(&with_column(log, "q_shoulder", |_, q| q.to_degrees()), "q_elbow", |_, q| q.to_degrees());
    let still = with_column(&with_column(log, "q_shoulder", |_, _| 0.5), "q_elbow", |_, _| -0.5);
    let dead = with_column(&with_column(log, "tau_shoulder", |_, _| 0.0), "tau_elbow", |_, _| 0.0);
    let constant = with_column(log, "tau_elbow", |_, _| 2.0);
    let huge = with_column(&with_column(log, "q_shoulder", |_, q| 1e11 * q), "q_elbow", |_, q| 1e11 * q);
    check(&[
        case("bad.csv", degrees, IDENTIFY, &["bad.csv", "joint `", "degrees"], "deg"),
        case("bad.csv", still, IDENTIFY, &["bad.csv", "joint"], "motion"),
        case("bad.csv", dead, IDENTIFY, &["bad.csv", "effort", "shoulder"], "effort column"),
        case("bad.csv", constant, IDENTIFY, &["bad.csv", "effort", "elbow"], "effort column"),
        case("bad.csv", huge, IDENTIFY, &["bad.csv", "joint `shoulder`", "1e6"], "scale"),
        case("bad.csv", first_rows(log, 1), IDENTIFY, &["bad.csv"], ""),
        case("bad.csv", first_rows(log, 5), IDENTIFY, &["bad.csv"], "longer"),
        case(
            "bad.csv",
            first_rows(log, 5),
            "identify robot.urdf --log bad.csv --route textbook --out out",
            &["bad.csv"],
            "longer",
        ),
        case(
            "bad.csv",
            first_rows(log, 5),
            "identify robot.urdf --log log.csv --validate bad.csv --out out",
            &["bad.csv"],
            "longer",
        ),
        case("bad.csv", first_rows(log, 5), "validate estimate.json --log bad.csv", &["bad.csv"], "longer"),
    ]);
}

/// The robot with a text replaced.
fn robot(from: &str, to: &str) -> String {
    assert!(TWO_LINKS.contains(from), "{from}");
    TWO_LINKS.replacen(from, to, 1)
}

const INSPECT: &str = "inspect bad.urdf";

#[test]
fn urdf_files() {
    let depth = 100_000;
    let deep =
        format!("<robot name=\"r\">{}{}</robot>", "<link name=\"a\">".repeat(depth), "</link>".repeat(depth));
    let mut chain = "<robot name=\"r\"><link name=\"l0\"/>\n".to_owned();
    for k in 1..100_000 {
        chain += &format!(
            "<link name=\"l{k}\"/><joint name=\"j{k}\" type=\"revolute\"><parent link=\"l{}\"/><child link=\"l{k}\"/>\
             <axis xyz=\"0 0 1\"/></joint>\n",
            k - 1
        );
    }
    chain += "</robot>\n";
    let cycle = robot("<parent link=\"base\"/>", "<parent link=\"forearm\"/>");
    let fixed = TWO_LINKS.replace("type=\"revolute\"", "type=\"fixed\"");
    check(&[
        case("bad.urdf", "", INSPECT, &["bad.urdf:1:1", "<robot>", "empty"], "<robot"),
        case("bad.urdf", b"\x00\x01\xff\xfe\x80".repeat(100), INSPECT, &["bad.urdf"], ""),
        case("bad.urdf", &TWO_LINKS[..TWO_LINKS.len() / 2], INSPECT, &["bad.urdf:"], "cut off"),
        case("bad.urdf", "<sdf version=\"1.6\"/>", INSPECT, &["bad.urdf:1:1", "<robot>", "<sdf>"], "SDF"),
        case("bad.urdf", deep, INSPECT, &["bad.urdf:1:", "at most", "levels"], "robot"),
        case("bad.urdf", chain, INSPECT, &["bad.urdf"], ""),
        case("bad.urdf", cycle, INSPECT, &["bad.urdf"], "loop"),
        case(
            "bad.urdf",
            robot("</robot>", "<link name=\"stray\"/></robot>"),
            INSPECT,
            &["bad.urdf", "stray"],
            "roots",
        ),
        case(
            "bad.urdf",
            robot("<child link=\"forearm\"/>", "<child link=\"forarm\"/>"),
            INSPECT,
            &["bad.urdf", "forarm"],
            "",
        ),
        case(
            "bad.urdf",
            robot("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>"),
            INSPECT,
            &["bad.urdf", "shoulder", "axis"],
            "0 0 1",
        ),
        case(
            "bad.urdf",
            robot("xyz=\"0 0 0.4\"", "xyz=\"0 nan 0.4\""),
            INSPECT,
            &["bad.urdf:", "shoulder", "origin", "`0 nan 0.4`"],
            "",
        ),
        case(
            "bad.urdf",
            robot("xyz=\"0 0 0.4\"", "xyz=\"0 0,4\""),
            INSPECT,
            &["bad.urdf:", "shoulder", "origin"],
            "spaces",
        ),
        case(
            "bad.urdf",
            robot("<link name=\"forearm\">", "<link name=\"upper_arm\">"),
            INSPECT,
            &["bad.urdf:", "link name once", "`upper_arm`"],
            "rename",
        ),
        case(
            "bad.urdf",
            robot("<joint name=\"elbow\"", "<joint name=\"shoulder\""),
            INSPECT,
            &["bad.urdf:", "joint name once", "`shoulder`"],
            "rename",
        ),
        case(
            "bad.urdf",
            robot("xyz=\"0 0 0.4\"", "xyz=\"0 0 ${height}\""),
            INSPECT,
            &["bad.urdf:", "xacro", "${height}"],
            "xacro",
        ),
        case(
            "bad.urdf",
            robot("<link name=\"base\"/>", "<xacro:base/><link name=\"base\"/>"),
            INSPECT,
            &["bad.urdf:", "xacro:base"],
            "xacro",
        ),
        case(
            "bad.urdf",
            robot("<mass value=\"3\"/>", "<mass value=\"heavy\"/>"),
            INSPECT,
            &["bad.urdf:", "upper_arm", "mass", "`heavy`"],
            "",
        ),
        case(
            "bad.urdf",
            robot("type=\"revolute\"", "type=\"ball\""),
            INSPECT,
            &["bad.urdf:", "shoulder", "`ball`"],
            "type",
        ),
        case("bad.urdf", fixed, INSPECT, &["bad.urdf"], "not fixed"),
        case("other", "", "inspect gone.urdf", &["gone.urdf", "No such file"], "path"),
        case("other", "", "inspect .", &[".: ", "directory"], "file"),
        case("other", "", "inspect robot.urdf --lock wrist=1", &["`wrist`", "shoulder, elbow"], ""),
        case("other", "", "inspect robot.urdf --lock shoulder=0 --lock elbow=0", &["robot.urdf"], ""),
        case(
            "other",
            "",
            "inspect robot.urdf --elements coulomb,viscuos",
            &["`viscuos`", "`shoulder`", "viscous"],
            "elements",
        ),
    ]);
}

#[test]
fn toml_robots() {
    let sound = indy7();
    let changed = |from: &str, to: &str| {
        assert!(sound.contains(from), "{from}");
        sound.replacen(from, to, 1)
    };
    let coupling = |matrix: &str, joints: &str| {
        format!("{sound}\n[[coupling]]\nmotors = [\"m5\", \"m6\"]\njoints = {joints}\nmatrix = {matrix}\n")
    };
    let coupled = "inspect bad.toml";
    check(&[
        case("bad.toml", "", "inspect bad.toml", &["bad.toml:1:1", "joint"], ""),
        case("bad.toml", "schema = [", "inspect bad.toml", &["bad.toml:1:"], ""),
        case(
            "bad.toml",
            changed("alpha = 0.0", "alpha = \"steep\""),
            "inspect bad.toml",
            &["bad.toml:17:9", "angle", "steep"],
            "",
        ),
        case(
            "bad.toml",
            changed("d = 0.3\n", "d = nan\n"),
            "inspect bad.toml",
            &["bad.toml:18:5", "finite", "NaN"],
            "",
        ),
        case(
            "bad.toml",
            changed("d = 0.3\n", "dd = 0.3\n"),
            "inspect bad.toml",
            &["bad.toml:", "`dd`"],
            "misspelt",
        ),
        case(
            "bad.toml",
            changed("name = \"j2\"", "name = \"j1\""),
            "inspect bad.toml",
            &["bad.toml:", "`j1`"],
            "",
        ),
        case(
            "bad.toml",
            changed("\"coulomb\"", "\"colomb\""),
            "inspect bad.toml",
            &["colomb", "coulomb"],
            "",
        ),
        case(
            "bad.toml",
            changed("[element.j6]", "[element.j7]"),
            "inspect bad.toml",
            &["bad.toml", "j7"],
            "",
        ),
        case(
            "bad.toml",
            coupling("[[1, 1], [2, 2]]", "[\"j5\", \"j6\"]"),
            coupled,
            &["coupling", "j5, j6", "singular"],
            "",
        ),
        case("bad.toml", coupling("[[1, 0], [1]]", "[\"j5\", \"j6\"]"), coupled, &["coupling", "matrix"], ""),
        case("bad.toml", coupling("[[1, 0], [1, 1]]", "[\"j5\", \"j9\"]"), coupled, &["j9"], ""),
    ]);
}

const RUN: &str = "identify bad.toml";

fn config(more: &str) -> String {
    CONFIG.to_owned() + more
}

#[test]
fn configurations() {
    let top = |more: &str| format!("{more}\n{CONFIG}");
    check(&[
        case("other", "", "identify gone.toml", &["gone.toml", "No such file"], "path"),
        case("bad.toml", "", RUN, &["bad.toml", "robot"], ""),
        case("bad.toml", "[[log]]\npath = \"log.csv\"\n", RUN, &["bad.toml", "robot"], ""),
        case("bad.toml", "robot = \"robot.urdf\"\n", RUN, &["bad.toml", "[[log]]"], ""),
        case(
            "bad.toml",
            "robot = \"gone.urdf\"\n[[log]]\npath = \"log.csv\"\n",
            RUN,
            &["gone.urdf", "No such file"],
            "path",
        ),
        case("bad.toml", config("rows = [1, 2"), RUN, &["bad.toml:5"], ""),
        case("bad.toml", b"\xff\xfe\x00robot".to_vec(), RUN, &["bad.toml"], ""),
        case("bad.toml", config("speed = 3\n"), RUN, &["bad.toml:5", "`speed`", "`path`"], ""),
        case(
            "bad.toml",
            config("[conditioning]\nkernel = 3\n"),
            RUN,
            &["bad.toml:6", "`kernel`", "`kernel_hz`"],
            "",
        ),
        case("bad.toml", config("[conditioning]\nkernel_hz = \"wide\"\n"), RUN, &["bad.toml:6", "wide"], ""),
        case(
            "bad.toml",
            config("[conditioning]\nkernel_hz = -5\n"),
            RUN,
            &["bad.toml", "kernel_hz", "positive", "-5"],
            "",
        ),
        case(
            "bad.toml",
            config("[conditioning]\nkernel_hz = 80\n"),
            RUN,
            &["kernel_hz", "log.csv", "50", "80"],
            "sample rate",
        ),
        case(
            "bad.toml",
            config("[conditioning]\nstate_hz = 80\n"),
            RUN,
            &["state_hz", "log.csv", "50", "80"],
            "sample rate",
        ),
        case(
            "bad.toml",
            config("[conditioning]\nroute = \"textbook\"\nkernel_hz = 80\n"),
            RUN,
            &["kernel_hz", "log.csv", "50", "80"],
            "sample rate",
        ),
        case(
            "bad.toml",
            config("[conditioning]\nroute = \"scenic\"\n"),
            RUN,
            &["bad.toml:6", "scenic", "textbook"],
            "",
        ),
        case("bad.toml", config("[conditioning]\ndelay_samples = nan\n"), RUN, &["delay_samples", "NaN"], ""),
        case(
            "bad.toml",
            config("[conditioning]\ndecimation = 0\n"),
            RUN,
            &["decimation", "at least 1", "0"],
            "",
        ),
        case(
            "bad.toml",
            config("part = [0.7, 0.2]\n"),
            RUN,
            &["bad.toml", "part", "increasing", "0.7, 0.2"],
            "",
        ),
        case("bad.toml", config("part = [0.0, 0.001]\n"), RUN, &["log.csv"], ""),
        case("bad.toml", config("rows = [500, 100]\n"), RUN, &["log.csv", "rows 500 to 100"], "counted"),
        case("bad.toml", config("rows = [1, 100000]\n"), RUN, &["log.csv", "rows 1 to 100000"], "counted"),
        case(
            "bad.toml",
            config("[columns]\nposition = \"angle{}\"\n"),
            RUN,
            &["log.csv", "position", "`angle1`"],
            "header",
        ),
        case(
            "bad.toml",
            config("[columns]\nposition = { columns = \"q_{joint}\", unit = \"furlong\" }\n"),
            RUN,
            &["log.csv", "furlong"],
            "unit",
        ),
        case(
            "bad.toml",
            config("[columns]\neffort = { columns = \"tau_{joint}\", scale = [1, 2, 3] }\n"),
            RUN,
            &["log.csv", "expected 2", "found 3"],
            "one entry per joint",
        ),
        case("bad.toml", config("[columns]\nrate_hz = -100\n"), RUN, &["rate", "-100"], ""),
        case(
            "bad.toml",
            config("[columns]\nvelocity = { shoulder = \"q_shoulder\", wrist = \"q_elbow\" }\n"),
            RUN,
            &["velocity", "`wrist`"],
            "joint names",
        ),
        case("bad.toml", config("[locked]\nwrist = 0.0\n"), RUN, &["`wrist`", "shoulder, elbow"], ""),
        case(
            "bad.toml",
            config("[elements.joint]\nwrist = [\"coulomb\"]\n"),
            RUN,
            &["`wrist`", "shoulder, elbow"],
            "",
        ),
        case(
            "bad.toml",
            config("[elements]\ndefault = [\"columb\"]\n"),
            RUN,
            &["`columb`", "coulomb"],
            "elements",
        ),
        case("bad.toml", top("preferred = [\"m9\"]"), RUN, &["preferred", "m9"], ""),
        case("bad.toml", top("gravity = [0, 0]"), RUN, &["bad.toml:1", "3"], ""),
        case("bad.toml", top("gravity = [0, 0, inf]"), RUN, &["gravity", "finite", "inf"], ""),
        case(
            "bad.toml",
            config("[motor_side]\nmatrix = [[1, 2], [2, 4]]\n"),
            RUN,
            &["motor_side", "singular"],
            "",
        ),
        case("bad.toml", config("[motor_side]\nmatrix = [[1, 2]]\n"), RUN, &["motor_side", "2 rows"], ""),
        case(
            "bad.toml",
            config(
                "[[coupling]]\nmotors = [\"a\", \"b\"]\njoints = [\"shoulder\", \"elbow\"]\nmatrix = [[1, 1], [1, 1]]\n",
            ),
            RUN,
            &["coupling", "shoulder, elbow", "singular"],
            "",
        ),
        case(
            "bad.toml",
            config(
                "[[coupling]]\nmotors = [\"a\", \"b\"]\njoints = [\"shoulder\", \"elbow\"]\nmatrix = [[1, 0], [nan, 1]]\n",
            ),
            RUN,
            &["coupling", "shoulder, elbow", "finite"],
            "",
        ),
    ]);
}

#[test]
fn estimates_and_states() {
    let Sound { states, estimate, .. } = sound();
    let predict = "predict bad.json --states states.csv --out effort.csv";
    let at = "predict estimate.json --states bad.csv --out effort.csv";
    let changed = |from: &str, to: &str| {
        assert!(estimate.contains(from), "{from}");
        estimate.replacen(from, to, 1)
    };
    check(&[
        case("other", "", "predict gone.json --states states.csv", &["gone.json", "No such file"], "path"),
        case("bad.json", "", predict, &["bad.json", "not an estimate"], "identify"),
        case("bad.json", "t,q1\n0,1\n", predict, &["bad.json", "not an estimate"], "identify"),
        case("bad.json", b"\xff\xfe\x00".to_vec(), predict, &["bad.json"], "identify"),
        case(
            "bad.json",
            &estimate[..estimate.len() / 2],
            predict,
            &["bad.json", "not an estimate", "line"],
            "identify",
        ),
        case(
            "bad.json",
            changed("\"schema\": 1", "\"schema\": 2"),
            predict,
            &["bad.json", "schema 1", "found 2"],
            "",
        ),
        case(
            "bad.json",
            changed("\"parameters\": [", "\"parameters\": [], \"others\": ["),
            predict,
            &["bad.json", "parameters"],
            "",
        ),
        case(
            "bad.json",
            changed("\"parent\": \"base\"", "\"parent\": \"forearm\""),
            predict,
            &["bad.json"],
            "",
        ),
        case(
            "bad.json",
            changed("\"kind\": \"revolute\"", "\"kind\": \"spiral\""),
            predict,
            &["bad.json", "`shoulder`", "`spiral`"],
            "",
        ),
        case(
            "bad.json",
            changed("\"parent\": \"base\"", "\"parent\": \"nowhere\""),
            "validate bad.json --log log.csv",
            &["bad.json", "nowhere"],
            "",
        ),
        case("bad.csv", without(states, "dq_elbow"), at, &["bad.csv", "velocity", "dq_elbow"], "columns"),
        case(
            "bad.csv",
            without(states, "ddq_shoulder"),
            "regressor robot.urdf --states bad.csv --json",
            &["bad.csv", "acceleration", "ddq_shoulder"],
            "columns",
        ),
        case(
            "bad.csv",
            with_field(states, 4, "ddq_elbow", "x"),
            at,
            &["bad.csv", "row 4", "`ddq_elbow`", "`x`"],
            "",
        ),
        case("bad.csv", states.replacen("q_shoulder", "gx", 1), at, &["bad.csv"], ""),
        case("bad.csv", states.replacen("tau_shoulder", "gx", 1), at, &["bad.csv", "gravity", "gy"], ""),
        case(
            "bad.csv",
            "q1,q2,q3,dq1,dq2,dq3,ddq1,ddq2,ddq3\n0,0,0,0,0,0,0,0,0\n",
            at,
            &["bad.csv", "`q3`", "expected 2"],
            "another robot",
        ),
        case("other", "", "predict estimate.json --states gone.csv", &["gone.csv", "No such file"], "path"),
        case(
            "other",
            "",
            "predict estimate.json --states states.csv --out gone/effort.csv",
            &["gone", "effort.csv"],
            "folder",
        ),
    ]);
}

#[test]
fn outputs_and_usage() {
    check(&[
        case(
            "taken",
            "a file",
            "identify robot.urdf --log log.csv --out taken",
            &["taken", "not a directory"],
            "",
        ),
        case("taken", "a file", "identify robot.urdf --log log.csv --out taken/deeper", &["taken"], ""),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --out .",
            &["--out", "robot.urdf", "overwritten"],
            "another",
        ),
        case("other", "", "identify robot.urdf", &["robot.urdf", "robot file", "--log"], ""),
        case("other", "", "identify indy7.toml", &["indy7.toml", "robot file", "--log"], ""),
        case("other", "", "simulate robot.urdf --out gone/log.csv", &["gone", "log.csv"], "folder"),
        case("other", "", "simulate robot.urdf --out a.csv --clean gone/b.csv", &["gone", "b.csv"], "folder"),
        case(
            "other",
            "",
            "simulate robot.urdf --out a.csv --truth gone/b.json",
            &["gone", "b.json"],
            "folder",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --out a.csv --clean a.csv",
            &["--clean", "a.csv", "--out"],
            "own",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --out robot.urdf",
            &["--out", "robot.urdf", "overwritten"],
            "another",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --duration 0 --out a.csv",
            &["duration_s", "positive", "0"],
            "",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --rate-hz nan --out a.csv",
            &["rate_hz", "positive", "NaN"],
            "",
        ),
        case("other", "", "simulate robot.urdf --duration 1e9 --out a.csv", &["duration_s", "1e8"], ""),
        case("other", "", "simulate robot.urdf --floating-base --out a.csv", &["floating base"], ""),
        case(
            "bad.toml",
            "seeed = 1\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["bad.toml:1", "`seeed`", "`seed`"],
            "",
        ),
        case(
            "bad.toml",
            "values = { \"wrist.fc\" = 1 }\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["wrist.fc", "values"],
            "",
        ),
        case(
            "bad.toml",
            "values = { \"elbow.fc\" = nan }\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["elbow.fc", "finite", "NaN"],
            "",
        ),
        case(
            "other",
            "",
            "validate estimate.json --log log.csv --filter-hz -3",
            &["filter-hz", "positive", "-3"],
            "",
        ),
        case(
            "other",
            "",
            "validate estimate.json --log log.csv --rows 500:2000",
            &["log.csv", "rows 500 to 2000"],
            "",
        ),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --kernel-hz 0 --out out",
            &["kernel_hz", "positive", "0"],
            "",
        ),
        case("other", "", "identify robot.urdf --log log.csv --gains 1,2,3 --out out", &["gains"], ""),
    ]);
}
