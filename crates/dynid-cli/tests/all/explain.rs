//! `dynid explain`, and the page of the book that holds the same text.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use crate::support::{TWO_LINKS, run};
use serde_json::Value;

fn stdout(args: &[&str], code: i32) -> String {
    let folder = tempfile::tempdir().unwrap();
    String::from_utf8(run(folder.path(), args, code).stdout).unwrap()
}

#[test]
fn words_are_explained_as_they_are_printed() {
    for (typed, meaning) in [
        (&["column_order"][..], "by number alone"),
        (&["column", "order"], "by number alone"),
        (&["residual against sensor noise"], "noise of the effort's sensor"),
        (&["Seen in the data"], "nine tenths of the doubt"),
    ] {
        let said = stdout(&[&["explain"], typed].concat(), 0);
        assert!(said.contains(meaning) && said.contains("What to do"), "{said}");
        assert!(said.lines().all(|line| line.chars().count() <= 100), "{said}");
    }
    let listed = stdout(&["explain"], 0);
    let all: Value = serde_json::from_str(&stdout(&["explain", "--json"], 0)).unwrap();
    for entry in all.as_array().unwrap() {
        let id = entry["id"].as_str().unwrap();
        assert!(listed.contains(&format!("  {id} ")), "{id}: {listed}");
        let one: Value = serde_json::from_str(&stdout(&["explain", id, "--json"], 0)).unwrap();
        assert_eq!(one, *entry);
    }
}

#[test]
fn lines_to_write_are_lines_that_are_read() {
    for e in dynid::explain::all().iter().filter(|e| !e.line.is_empty()) {
        match e.line.strip_prefix("dynid ") {
            Some(line) => {
                let output = crate::support::dynid().args(line.split(' ')).output().unwrap();
                let said = String::from_utf8(output.stderr).unwrap();
                assert!(!said.contains("For more information, try"), "{}: {said}", e.id);
            }
            None => {
                let log = if e.line.contains("[[log]]") { "" } else { "\n[[log]]\npath = \"log.csv\"\n" };
                let text = format!("robot = \"arm.urdf\"\n{}{log}", e.line);
                let parsed = dynid::Config::parse(&text, "run.toml");
                assert!(parsed.is_ok(), "{}: {}", e.id, parsed.unwrap_err());
            }
        }
    }
}

#[test]
fn an_unknown_word_is_told_with_the_nearest_one() {
    let folder = tempfile::tempdir().unwrap();
    let said = String::from_utf8(run(folder.path(), &["explain", "colum_order"], 2).stderr).unwrap();
    assert!(said.contains("`colum_order`") && said.contains("`column_order`"), "{said}");
}

#[test]
fn the_page_of_the_book_is_up_to_date() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/src/reference/findings.md");
    let found = std::fs::read_to_string(&page).unwrap();
    assert!(
        found == stdout(&["explain", "--markdown"], 0),
        "run `dynid explain --markdown > docs/book/src/reference/findings.md`"
    );
}

#[test]
fn whatever_check_and_identify_print_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
    let args = ["simulate", "arm.urdf", "--duration", "10", "--rate-hz", "100", "--out", "log.csv"];
    run(at, &args, 0);
    // Efforts in another unit, and a joint whose effort is not there.
    let log = std::fs::read_to_string(at.join("log.csv")).unwrap();
    let spoilt: Vec<String> = log
        .lines()
        .enumerate()
        .map(|(row, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if row > 0 {
                cells[3] = (-1000.0 * cells[3].parse::<f64>().unwrap()).to_string();
            }
            cells.join(",")
        })
        .collect();
    std::fs::write(at.join("spoilt.csv"), spoilt.join("\n") + "\n").unwrap();
    let check: Value =
        serde_json::from_slice(&run(at, &["check", "spoilt.csv", "--robot", "arm.urdf", "--json"], 1).stdout)
            .unwrap();
    let estimate: Value =
        serde_json::from_slice(&run(at, &["identify", "arm.urdf", "--log", "log.csv", "--json"], 0).stdout)
            .unwrap();
    let words = |list: &Value, key: &str| -> Vec<String> {
        let entries = list.as_array().unwrap().iter();
        entries.filter_map(|entry| entry[key].as_str().map(str::to_owned)).collect()
    };
    let mut all = [words(&check["findings"], "id"), words(&check["findings"], "severity")].concat();
    assert!(!all.is_empty());
    all.extend(words(&estimate["verdict"]["checks"], "name"));
    all.extend(words(&estimate["verdict"]["checks"], "status"));
    for key in ["verdict", "reason"] {
        all.extend(words(&estimate["parameters"], key));
    }
    all.sort();
    all.dedup();
    assert!(all.len() > 15, "{all:?}");
    for word in all {
        run(at, &["explain", &word], 0);
    }
}
