//! What the program says of itself, and what it refuses.

use crate::support::{run, text};
use dynid_terminal::study::{PUBLISHED, VERSION};

#[test]
fn version_is_what_dynid_asks_for() {
    let folder = tempfile::tempdir().unwrap();
    let said = run(folder.path(), &["--version"], 0).stdout;
    assert_eq!(text(&said), format!("dynid-studies {VERSION}\n"));
    let known = VERSION.strip_prefix(env!("CARGO_PKG_VERSION")).unwrap();
    assert!(known.starts_with(" (sources "), "a checkout has a digest of its sources: {known}");
}

#[test]
fn what_there_is_is_listed() {
    let folder = tempfile::tempdir().unwrap();
    let said = text(&run(folder.path(), &["list"], 0).stdout);
    assert!(PUBLISHED.iter().all(|p| said.contains(p.name) && said.contains(p.title)), "{said}");
}

#[test]
fn bad_usage_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("taken"), "a file").unwrap();
    for (line, words) in [
        ("er16 --quick --out taken", "taken"),
        ("er16 --quick --out taken/deeper", "taken"),
        ("nonsense", "no study `nonsense`; known: er16"),
        ("er16 --seed some", "invalid digit"),
        ("", "<NAME>"),
    ] {
        let args: Vec<&str> = line.split_whitespace().collect();
        let output = run(folder.path(), &args, 2);
        let said = text(&output.stderr);
        assert!(said.starts_with("error: ") && said.contains(words), "{line}: {said}");
        assert!(output.stdout.is_empty(), "{line}");
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("taken")).unwrap(), "a file");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
