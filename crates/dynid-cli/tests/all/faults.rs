//! Whatever stops a run, its files are those of one run: kills, two runs at once, a disk that is full, names that cannot be written.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was left is said"
)]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::support::{TWO_LINKS, run};
use tempfile::TempDir;

/// Files of an identification.
const FILES: [&str; 3] = ["estimate.json", "report.html", "arm.urdf"];
/// Two runs whose files differ.
const RUNS: [&str; 2] = ["first.toml", "second.toml"];

type Files = BTreeMap<&'static str, Vec<u8>>;

/// A robot, two logs and a configuration for each.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), TWO_LINKS).unwrap();
    for (seed, name) in ["1", "2"].into_iter().zip(RUNS) {
        let log = format!("{seed}.csv");
        let simulate =
            ["simulate", "arm.urdf", "--duration", "12", "--rate-hz", "100", "--effort-noise", "0.01"];
        run(folder.path(), &[&simulate[..], &["--seed", seed, "--out", &log]].concat(), 0);
        let text = format!(
            "robot = \"arm.urdf\"\nout = \"out\"\n[elements]\nfriction = \"given\"\n[[log]]\npath = \"{log}\"\n"
        );
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn files(folder: &Path) -> Files {
    FILES
        .iter()
        .filter_map(|name| Some((*name, std::fs::read(folder.join("out").join(name)).ok()?)))
        .collect()
}

/// What every run leaves if nothing happens.
fn whole(folder: &Path) -> [Files; 2] {
    RUNS.map(|name| {
        run(folder, &["identify", name, "-q"], 0);
        let found = files(folder);
        assert_eq!(found.len(), FILES.len());
        found
    })
}

fn start(folder: &Path, name: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_dynid"))
        .current_dir(folder)
        .args(["identify", name, "-q"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// The number of the run that all files are of.
#[track_caller]
fn of_one_run(found: &Files, whole: &[Files; 2]) -> Option<usize> {
    let is_of = |run: &Files| found.iter().all(|(name, bytes)| run[name] == *bytes);
    let runs: Vec<usize> = (0..2).filter(|k| is_of(&whole[*k])).collect();
    assert!(!runs.is_empty(), "a mixture of {:?}", found.keys());
    (found.len() == FILES.len()).then(|| runs[0])
}

fn killed(times: u64) {
    let folder = folder();
    let whole = whole(folder.path());
    let begun = std::time::Instant::now();
    start(folder.path(), RUNS[0]).wait().unwrap();
    let longest = u64::try_from(begun.elapsed().as_millis()).unwrap() + 50;
    let (mut random, mut complete) = (1u64, 0);
    for k in 0..times {
        let mut child = start(folder.path(), RUNS[usize::from(k % 2 == 0)]);
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        std::thread::sleep(Duration::from_millis((random >> 33) % longest));
        // It may have ended.
        let _ = child.kill();
        child.wait().unwrap();
        complete += u64::from(of_one_run(&files(folder.path()), &whole).is_some());
    }
    println!("{times} kills within {longest} ms, {complete} times all files were there");
    // Nothing that was left behind stands in the way of the next run.
    run(folder.path(), &["identify", RUNS[0], "-q"], 0);
    assert_eq!(of_one_run(&files(folder.path()), &whole), Some(0));
}

fn at_once(times: usize) {
    let folder = folder();
    let whole = whole(folder.path());
    for _ in 0..times {
        for mut child in RUNS.map(|name| start(folder.path(), name)) {
            assert!(child.wait().unwrap().success());
        }
        assert!(of_one_run(&files(folder.path()), &whole).is_some());
    }
}

#[test]
fn a_run_that_is_killed_leaves_files_of_one_run() {
    killed(25);
}

#[test]
#[ignore = "400 kills take half a minute; the ordinary run has fewer"]
fn four_hundred_kills_leave_files_of_one_run() {
    killed(400);
}

#[test]
fn two_runs_at_once_leave_files_of_one() {
    at_once(5);
}

#[test]
#[ignore = "200 pairs of runs take a minute; the ordinary run has fewer"]
fn two_hundred_times_two_runs_leave_files_of_one() {
    at_once(200);
}

/// A limit on the size of files stands for a disk that is full.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_files_that_were_there() {
    let folder = folder();
    let whole = whole(folder.path());
    // The second run was the last; with 8 to 200 blocks some files fit and others do not.
    for blocks in [0, 8, 40, 200] {
        let command = format!(
            "trap '' XFSZ; ulimit -f {blocks}; exec {} identify {} -q",
            env!("CARGO_BIN_EXE_dynid"),
            RUNS[0]
        );
        let output = Command::new("sh").arg("-c").arg(&command).current_dir(folder.path()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{blocks}: {said}");
        assert!(said.contains("cannot be written") && said.contains("hint:"), "{blocks}: {said}");
        assert_eq!(of_one_run(&files(folder.path()), &whole), Some(1), "{blocks}");
        let hidden = std::fs::read_dir(folder.path().join("out")).unwrap().count();
        assert_eq!(hidden, FILES.len(), "{blocks}: files are left");
    }
}

#[test]
fn a_name_that_cannot_be_written_is_told_before_anything_is_computed() {
    let folder = folder();
    let robot = format!("{}.urdf", "r".repeat(248));
    std::fs::write(folder.path().join(&robot), TWO_LINKS).unwrap();
    // The log does not even exist.
    let output = run(folder.path(), &["identify", &robot, "--log", "none.csv", "--out", "new"], 2);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains(".loops.toml: cannot be written"), "{said}");
    assert!(!folder.path().join("new").exists());
}

#[cfg(unix)]
#[test]
fn a_pipe_is_a_log_like_any_other() {
    let folder = folder();
    let read = |name: &str| std::fs::read(folder.path().join("out").join(name)).unwrap();
    run(folder.path(), &["identify", RUNS[0], "-q"], 0);
    let expected = read("arm.urdf");
    let command = format!(
        "cat 1.csv | {} identify arm.urdf --log /dev/stdin --friction given --out out -q",
        env!("CARGO_BIN_EXE_dynid")
    );
    let output = Command::new("sh").arg("-c").arg(&command).current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(read("arm.urdf"), expected);
}

#[test]
fn codes_that_terminals_obey_are_written_out() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["inspect", "no\u{1b}[31mred.urdf"], 2);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!said.contains('\u{1b}') && said.contains("u{1b}"), "{said}");
    let named = TWO_LINKS.replace("elbow", "el&#27;[31mbow");
    std::fs::write(folder.path().join("arm.urdf"), named).unwrap();
    let said = String::from_utf8_lossy(&run(folder.path(), &["inspect", "arm.urdf"], 2).stderr).into_owned();
    assert!(said.contains("control characters"), "{said}");
}
