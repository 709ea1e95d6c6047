//! Patterns, folders and lists: the logs that a path stands for.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;
use std::path::{Path, PathBuf};

use dynid_logs::log::{LogOptions, files, open};
use dynid_logs::table_file::{self, Column};
use tempfile::TempDir;

/// A folder with files, those called `.csv` with a table in them.
fn folder(paths: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for path in paths {
        let file = folder.path().join(path);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, "t,q1,tau1\n0,0,0\n1,1,1\n").unwrap();
    }
    folder
}

/// The logs of a path, relative to the folder; or what is wrong, without the name of the folder.
fn found(folder: &TempDir, path: &str) -> Result<Vec<String>, String> {
    let root = folder.path();
    let relative = |log: &PathBuf| log.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
    let logs = files(&root.join(path)).map(|logs| logs.iter().map(relative).collect());
    logs.map_err(|e| {
        e.to_string().replace(&format!("{}/", root.display()), "").replace(root.to_str().unwrap(), ".")
    })
}

fn named(folder: &TempDir, path: &str) -> Vec<String> {
    found(folder, path).unwrap()
}

#[test]
fn a_pattern_is_what_is_called_so_in_the_order_of_names() {
    let runs =
        folder(&["b.csv", "a.csv", "a.csv.gz", ".hidden.csv", "x/c.csv", "x/y/d.csv", "z/c.csv", "[a].csv"]);
    assert_eq!(named(&runs, "*.csv"), ["[a].csv", "a.csv", "b.csv"]);
    assert_eq!(named(&runs, "?.csv"), ["a.csv", "b.csv"]);
    assert_eq!(named(&runs, "[!a].csv"), ["b.csv"]);
    assert_eq!(named(&runs, "*/c.csv"), ["x/c.csv", "z/c.csv"]);
    assert_eq!(named(&runs, "**/?.csv"), ["a.csv", "b.csv", "x/c.csv", "x/y/d.csv", "z/c.csv"]);
    assert_eq!(named(&runs, ".*.csv"), [".hidden.csv"]);
    // A file of the whole name is that file.
    assert_eq!(named(&runs, "[a].csv"), ["[a].csv"]);
    // What is no pattern is left to whoever opens it.
    assert_eq!(named(&runs, "missing.csv"), ["missing.csv"]);
    // The member of a file stays with every file.
    assert_eq!(named(&runs, "?.csv#/arm"), ["a.csv#/arm", "b.csv#/arm"]);
}

#[test]
fn brackets_in_the_folder_of_a_configuration_are_no_pattern() {
    let runs = folder(&["[1]/a.csv", "1/b.csv"]);
    assert_eq!(named(&runs, "[1]/*.csv"), ["[1]/a.csv"]);
}

#[test]
fn a_pattern_without_a_log_names_the_folder_and_what_is_in_it() {
    let runs = folder(&["a.txt", "x/c.csv"]);
    assert_eq!(found(&runs, "*.csv").unwrap_err(), "*.csv: expected logs in `.`, found a.txt, x");
    assert_eq!(found(&runs, "x/*.mcap").unwrap_err(), "x/*.mcap: expected logs in `x`, found c.csv");
    assert_eq!(found(&runs, "*/z/*.csv").unwrap_err(), "*/z/*.csv: expected logs in `x`, found c.csv");
    assert_eq!(found(&runs, "y/*.csv").unwrap_err(), "y/*.csv: expected logs in `.`, found a.txt, x");
    let hint = files(&runs.path().join("*.csv")).unwrap_err().hint().unwrap();
    assert!(hint.contains("any text within a name"), "{hint}");
}

#[test]
fn a_folder_is_the_logs_in_it() {
    let runs = folder(&[
        "b.csv",
        "a.csv",
        "robot.urdf",
        "run.toml",
        ".b.csv",
        "bag/0.mcap",
        "other/c.csv",
        "none/x.urdf",
    ]);
    assert_eq!(named(&runs, ""), ["a.csv", "b.csv", "bag"]);
    // A bag is one log.
    assert_eq!(named(&runs, "bag"), ["bag"]);
    assert_eq!(named(&runs, "o*"), ["other/c.csv"]);
    assert_eq!(found(&runs, "none").unwrap_err(), "none: expected logs in `none`, found x.urdf");
}

#[test]
fn a_list_keeps_its_order_and_names_its_lines() {
    let runs = folder(&["b.csv", "a.csv", "x/c.csv", "x/d.csv"]);
    let write = |text: &str| fs::write(runs.path().join("runs.manifest"), text).unwrap();
    write("\u{feff}# the good ones\n\nb.csv\r\n  x/*.csv  \na.csv\n");
    assert_eq!(named(&runs, "runs.manifest"), ["b.csv", "x/c.csv", "x/d.csv", "a.csv"]);
    for (text, message) in [
        (
            "b.csv\nc.csv\n",
            "runs.manifest: line 2: expected a file that is there, found `c.csv`, which is not",
        ),
        ("a.csv\n\n?.csv\n", "runs.manifest: line 3: expected every log once, found `a.csv` of line 1 again"),
        (
            "x/*.mcap\n",
            "runs.manifest: line 1: expected logs, found none called `x/*.mcap` in `x`: c.csv, d.csv",
        ),
        (
            "runs.manifest\n",
            "runs.manifest: line 1: expected a log, a pattern or a folder, found another list, `runs.manifest`",
        ),
        ("# none\n", "runs.manifest: line 1: expected at least one log above, found none"),
        ("", "runs.manifest: line 1: expected at least one log above, found none"),
    ] {
        write(text);
        assert_eq!(found(&runs, "runs.manifest").unwrap_err(), message);
    }
    fs::write(runs.path().join("runs.manifest"), [0xff, 0xfe, 0x00]).unwrap();
    assert!(found(&runs, "runs.manifest").is_err());
    // A list that is not there is a file that is not there.
    assert_eq!(named(&runs, "other.manifest"), ["other.manifest"]);
}

fn episodes(path: &Path, numbers: &[i64]) {
    let index: Vec<i64> = numbers.iter().flat_map(|n| [*n; 3]).collect();
    let time: Vec<f64> = numbers.iter().flat_map(|_| [0.0, 0.1, 0.2]).collect();
    let names = ["episode_index".to_owned(), "timestamp".to_owned()];
    table_file::write(path, &names, &[Column::Whole(index), Column::Float(time)]).unwrap();
}

#[cfg(feature = "parquet")]
#[test]
fn episodes_are_chosen_by_a_pattern_and_read() {
    let runs = folder(&[]);
    episodes(&runs.path().join("all.parquet"), &[2, 10, 11]);
    assert_eq!(named(&runs, "all.parquet#*"), ["all.parquet#2", "all.parquet#10", "all.parquet#11"]);
    assert_eq!(named(&runs, "*.parquet#1?"), ["all.parquet#10", "all.parquet#11"]);
    assert_eq!(
        found(&runs, "all.parquet#3*").unwrap_err(),
        "all.parquet#3*: expected logs in `all.parquet`, found 2, 10, 11"
    );
    for log in files(&runs.path().join("all.parquet#*")).unwrap() {
        assert_eq!(
            open(&log, &LogOptions::default()).unwrap().header().names,
            ["episode_index", "timestamp"]
        );
    }
    // Both layouts of datasets: a file per episode, and many in one.
    for path in ["a/meta", "a/data/chunk-000", "b/meta", "b/data/chunk-000"] {
        fs::create_dir_all(runs.path().join(path)).unwrap();
    }
    for set in ["a", "b"] {
        fs::write(runs.path().join(set).join("meta/info.json"), "{}").unwrap();
    }
    for n in [0, 1, 12] {
        episodes(&runs.path().join(format!("a/data/chunk-000/episode_{n:06}.parquet")), &[n]);
    }
    episodes(&runs.path().join("b/data/chunk-000/file-000.parquet"), &[0, 1]);
    episodes(&runs.path().join("b/data/chunk-000/file-001.parquet"), &[2]);
    assert_eq!(named(&runs, "a#*"), ["a#0", "a#1", "a#12"]);
    assert_eq!(named(&runs, "b#[1-9]"), ["b#1", "b#2"]);
    for log in files(&runs.path().join("?#*")).unwrap() {
        assert!(open(&log, &LogOptions::default()).is_ok(), "{}", log.display());
    }
    // A broken file says so.
    fs::write(runs.path().join("broken.parquet"), b"PAR1 and no more").unwrap();
    assert!(found(&runs, "broken.parquet#*").unwrap_err().starts_with("broken.parquet: Parquet: "));
}
