//! What long logs take of the memory.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::run;

/// Most memory of a run, bytes.
const MOST: u64 = 400_000_000;

/// The largest memory that a process has had so far, bytes; `None` once it has ended.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}

#[test]
#[ignore = "half a minute and 240 MB of disk: a log of a million rows"]
fn a_million_rows_are_identified_in_400_megabytes() {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().unwrap();
    let robot = repository.join("robots/indy7.toml");
    let simulate = ["--duration", "1000", "--rate-hz", "1000", "--seed", "5", "--effort-noise", "0.02"];
    let (command, out) = (["simulate", robot.to_str().unwrap()], ["--out", "log.csv"]);
    run(folder.path(), &[&command[..], &simulate, &out].concat(), 0);
    let mut child = Command::new(env!("CARGO_BIN_EXE_dynid"))
        .arg("identify")
        .arg(repository.join("examples/indy7/robot.toml"))
        .args(["--log", "log.csv", "--out", "out"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut most = 0;
    let status = loop {
        most = peak(child.id()).unwrap_or(most);
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    println!("{} MB", most / 1_000_000);
    assert!(status.success() && folder.path().join("out/report.html").is_file(), "{status}");
    assert!(most > 100_000_000 && most <= MOST, "{most} bytes");
}
