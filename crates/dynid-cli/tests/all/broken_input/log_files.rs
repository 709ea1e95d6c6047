//! Logs that are no tables of numbers under names, or not of this robot.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::csv::{first_rows, sines, with_column, with_field, without};
use super::harness::{IDENTIFY, case, check, sound};

const IDENTIFY_GZ: &str = "identify robot.urdf --log bad.csv.gz --out out";

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

#[test]
fn are_refused() {
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
        case(
            "bad.csv",
            without(log, "tau_elbow"),
            IDENTIFY,
            &["bad.csv", "effort of", "elbow"],
            "effort = { \"elbow\" = \"..\" }",
        ),
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
