//! `dynid study`: what it knows itself, and how it hands over to the program `dynid-studies`.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use serde_json::Value as Json;

use crate::support::run;

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn list_names_every_study() {
    let folder = tempfile::tempdir().unwrap();
    let plain = text(&run(folder.path(), &["study", "list"], 0).stdout);
    let listed: Json =
        serde_json::from_slice(&run(folder.path(), &["study", "list", "--json"], 0).stdout).unwrap();
    let listed = listed.as_array().unwrap();
    assert!(
        ["er16", "hit-joint", "indy7", "prr3", "xy-pointing"]
            .iter()
            .all(|name| listed.iter().any(|s| s["study"] == **name))
    );
    for study in listed {
        for key in ["study", "title", "source"] {
            let value = study[key].as_str().unwrap();
            assert!(!value.is_empty() && plain.contains(value), "{key}: {value}");
        }
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a list leaves nothing behind");
}

/// Scripts stand in for the program.
#[cfg(unix)]
mod hand_over {
    use std::os::unix::fs::PermissionsExt;
    use std::path::{Path, PathBuf};
    use std::process::Output;

    use assert_cmd::Command;
    use dynid_terminal::study::VERSION;
    use tempfile::TempDir;

    use super::text;

    /// A copy of `dynid` in a folder of its own, with no program beside it.
    ///
    /// Another process copies: a file that this one has open for writing, a test that starts a program at the same time would keep open,
    /// and such a file cannot be run.
    fn dynid_alone() -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let dynid = folder.path().join("dynid");
        copy(Path::new(env!("CARGO_BIN_EXE_dynid")), &dynid);
        (folder, dynid)
    }

    fn copy(from: &Path, to: &Path) {
        let status = std::process::Command::new("cp").arg("-p").args([from, to]).status().unwrap();
        assert!(status.success(), "{}", to.display());
    }

    /// Puts a script in the place of the program: it tells a version, or does what a study would.
    fn stand_in(folder: &Path, version: &str) {
        let script = format!(
            "#!/bin/sh\nif [ \"$1\" = --version ]; then echo 'dynid-studies {version}'; exit; fi\n\
             echo \"given: $*\"; cat; echo noted >&2; exit 7\n"
        );
        let file = folder.join("script");
        std::fs::write(&file, script).unwrap();
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o755)).unwrap();
        copy(&file, &folder.join("dynid-studies"));
    }

    fn study(dynid: &Path, path: &str, args: &[&str]) -> Output {
        let path = format!("{path}:/usr/bin:/bin");
        let mut command = Command::new(dynid);
        command.env("PATH", path).arg("study").args(args).write_stdin("asked").output().unwrap()
    }

    #[track_caller]
    fn demand_handed_over(output: &Output, args: &str) {
        assert_eq!(text(&output.stdout), format!("given: {args}\nasked"));
        assert_eq!((text(&output.stderr).as_str(), output.status.code()), ("noted\n", Some(7)));
    }

    #[test]
    fn arguments_streams_and_exit_code_pass_through() {
        let (folder, dynid) = dynid_alone();
        stand_in(folder.path(), VERSION);
        let args = ["er16", "--quick", "--seed", "7", "--out", "a folder", "-q"];
        demand_handed_over(&study(&dynid, "", &args), &args.join(" "));
    }

    #[test]
    fn the_program_beside_dynid_comes_before_that_on_the_path() {
        let (folder, dynid) = dynid_alone();
        let elsewhere = tempfile::tempdir().unwrap();
        let path = elsewhere.path().to_str().unwrap();
        stand_in(elsewhere.path(), VERSION);
        demand_handed_over(&study(&dynid, path, &["prr3", "--json"]), "prr3 --json");
        stand_in(folder.path(), "of another time");
        assert_eq!(study(&dynid, path, &["prr3", "--json"]).status.code(), Some(2));
    }

    #[track_caller]
    fn demand_refused(output: &Output, words: &[&str]) {
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.starts_with("error: ") && said.lines().count() == 2, "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
        assert!(output.stdout.is_empty());
    }

    #[test]
    fn a_missing_program_is_told_with_the_command_that_builds_it() {
        let (folder, dynid) = dynid_alone();
        let beside = folder.path().canonicalize().unwrap();
        let words = [
            "dynid-studies, which is neither in",
            beside.to_str().unwrap(),
            "hint: in a checkout `cargo build --release -p dynid-studies`",
        ];
        demand_refused(&study(&dynid, "", &["er16", "--quick"]), &words);
    }

    #[test]
    fn a_program_of_another_version_is_not_run() {
        let (folder, dynid) = dynid_alone();
        for (other, found) in [("0.0.9", "0.0.9"), ("0.1.0 (sources 00)", "0.1.0 (sources 00)"), ("", "none")]
        {
            stand_in(folder.path(), other);
            let expected = format!("expected version {VERSION}, as dynid is, found {found}\n");
            demand_refused(&study(&dynid, "", &["er16"]), &[&expected, "-p dynid-studies"]);
        }
    }

    #[test]
    fn what_dynid_knows_itself_needs_no_program() {
        let (_folder, dynid) = dynid_alone();
        assert_eq!(study(&dynid, "", &["list"]).status.code(), Some(0));
        demand_refused(&study(&dynid, "", &["nonsense"]), &["no study `nonsense`", "`dynid study list`"]);
        assert_eq!(study(&dynid, "", &["er16", "--seed", "some"]).status.code(), Some(2));
    }
}
