//! What holds for all commands: examples, standard input and output, files of others, completions, manual pages.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::process::Output;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, dynid, run};
use serde_json::Value;
use tempfile::TempDir;

/// A robot, two logs, states, an estimate in `out`, a configuration.
fn prepared() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
        let simulate = ["simulate", "arm.urdf", "--duration", "10", "--rate-hz", "100"];
        run(at, &[&simulate[..], &["--out", "log.csv", "--clean", "states.csv"]].concat(), 0);
        run(at, &[&simulate[..], &["--out", "other.csv", "--seed", "2"]].concat(), 0);
        std::fs::write(at.join("run.toml"), "robot = \"arm.urdf\"\n[[log]]\npath = \"log.csv\"\n").unwrap();
        run(at, &["identify", "run.toml", "--out", "out", "--quiet"], 0);
        folder
    };
    FOLDER.get_or_init(make).path()
}

/// A copy of the files of [`prepared`] without the folder `out`.
fn copied() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["arm.urdf", "log.csv", "other.csv", "states.csv", "run.toml"] {
        std::fs::copy(prepared().join(name), folder.path().join(name)).unwrap();
    }
    std::fs::copy(prepared().join("out/estimate.json"), folder.path().join("estimate.json")).unwrap();
    folder
}

fn piped(folder: &Path, args: &[&str], input: &str, code: i32) -> Output {
    let input = std::fs::read(folder.join(input)).unwrap();
    let output = dynid().current_dir(folder).args(args).write_stdin(input).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "dynid {}: {stderr}", args.join(" "));
    output
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn commands(folder: &Path) -> Vec<String> {
    let help = text(&run(folder, &["--help"], 0).stdout);
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|l| !l.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split(' ').next().map(str::to_owned));
    names.filter(|name| !name.is_empty() && name != "help").collect()
}

/// Words of a line as a shell splits it, up to a redirection or a pipe.
fn words(line: &str) -> Vec<String> {
    let command = line.split(['>', '|']).next().unwrap().trim_end();
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in command.chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            c => words.last_mut().unwrap().push(c),
        }
    }
    words
}

#[test]
fn every_command_has_examples_that_parse_and_says_its_exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("taken"), "no folder").unwrap();
    let commands = commands(folder.path());
    assert!(commands.len() >= 21, "{commands:?}");
    let mut sorted = commands.clone();
    sorted.sort();
    assert_eq!(commands, sorted);
    for command in &commands {
        let help = text(&run(folder.path(), &[command, "--help"], 0).stdout);
        let ending =
            help.split("\nExamples:\n").nth(1).unwrap_or_else(|| panic!("{command} has no examples"));
        let (examples, codes) = ending.split_once("\nExit codes: ").unwrap();
        assert!(codes.starts_with("0 done;") && codes.contains("2 bad input or usage"), "{codes}");
        let lines: Vec<&str> = examples.lines().filter_map(|line| line.strip_prefix("  dynid ")).collect();
        assert!(!lines.is_empty(), "{command}");
        for line in lines {
            let mut words = words(line);
            assert_eq!(words[0], *command, "{line}");
            if line.starts_with("study indy7") {
                // Refused before a minute of work.
                words.extend(["--out".to_owned(), "taken/deeper".to_owned()]);
            }
            // There are no files here: whatever parses ends with a message of its own, not with one of the parser.
            let output = dynid().current_dir(folder.path()).args(&words).output().unwrap();
            let said = text(&output.stderr);
            assert!(!said.contains("For more information, try"), "dynid {line}: {said}");
        }
    }
}

#[test]
fn a_dash_is_standard_input() {
    let folder = copied();
    let at = folder.path();
    let same = |plain: &[&str], dashed: &[&str], input: &str| {
        let (by_file, by_pipe) = (run(at, plain, 0).stdout, piped(at, dashed, input, 0).stdout);
        assert_eq!(text(&by_file).replace(input, "-"), text(&by_pipe), "{dashed:?}");
    };
    let states = ["predict", "estimate.json", "--states", "states.csv"];
    same(&states, &["predict", "estimate.json", "--states", "-"], "states.csv");
    same(&states, &["predict", "-", "--states", "states.csv"], "estimate.json");
    same(&["inspect", "arm.urdf"], &["inspect", "-"], "arm.urdf");
    same(
        &["validate", "estimate.json", "--log", "other.csv"],
        &["validate", "estimate.json", "--log", "-"],
        "other.csv",
    );
    same(&["check", "run.toml"], &["check", "-"], "run.toml");
    std::fs::copy(at.join("estimate.json"), at.join("twin.json")).unwrap();
    same(
        &["diff", "twin.json", "estimate.json", "--json"],
        &["diff", "-", "estimate.json", "--json"],
        "twin.json",
    );
    // Robot files are read twice on the way to a URDF.
    let args = ["identify", "-", "--log", "log.csv", "--out", "piped", "--quiet"];
    piped(at, &args, "arm.urdf", 0);
    assert!(at.join("piped/robot.urdf").is_file());
    let parameters = |name: &str| -> Value {
        serde_json::from_str::<Value>(&read(at, name)).unwrap()["parameters"].take()
    };
    assert_eq!(parameters("piped/estimate.json"), parameters("estimate.json"));
    let twice = piped(at, &["identify", "-", "--log", "-"], "arm.urdf", 2);
    assert!(text(&twice.stderr).contains("standard input: `-` is given more than once"));
}

#[test]
fn a_dash_is_standard_output() {
    let folder = copied();
    let at = folder.path();
    let same = |args: &[&str], file: &str| {
        run(at, &[args, &[file]].concat(), 0);
        let printed = run(at, &[args, &["-"]].concat(), 0);
        assert_eq!(text(&printed.stdout), read(at, file), "{args:?}");
    };
    same(&["simulate", "arm.urdf", "--duration", "2", "--out"], "s.csv");
    same(&["predict", "estimate.json", "--states", "states.csv", "--out"], "p.csv");
    same(&["export", "estimate.json", "--urdf"], "e.urdf");
    same(&["export", "estimate.json", "--model"], "e.json");
    same(&["check", "run.toml", "--quiet", "--fix"], "f.toml");
    assert!(!at.join("-").exists());
    let refused = |args: &[&str], words: &str| {
        let said = text(&run(at, args, 2).stderr);
        assert!(said.contains(words), "{args:?}: {said}");
    };
    refused(&["identify", "run.toml", "--out", "-"], "expected a folder for estimate.json");
    refused(&["check", "run.toml", "--report", "-", "--json"], "standard output is taken");
    refused(
        &["check", "run.toml", "--report", "-", "--fix", "-"],
        "standard output: `-` is given more than once",
    );
}

#[test]
fn files_of_others_stay_unless_forced() {
    let folder = copied();
    let at = folder.path();
    let refused = |args: &[&str], file: &str| {
        let before = read(at, file);
        let said = text(&run(at, args, 2).stderr);
        let words = format!("{file} exists and is not known to come from dynid");
        assert!(said.contains(&words) && said.contains("--force"), "{args:?}: {said}");
        assert_eq!(read(at, file), before);
    };
    refused(&["simulate", "arm.urdf", "--out", "log.csv"], "log.csv");
    refused(&["predict", "estimate.json", "--states", "states.csv", "--out", "log.csv"], "log.csv");
    std::fs::write(at.join("mine.urdf"), TWO_LINKS).unwrap();
    refused(&["export", "estimate.json", "--urdf", "mine.urdf"], "mine.urdf");
    std::fs::write(at.join("mine.json"), "{\"schema\": 1, \"mine\": true}\n").unwrap();
    refused(&["export", "estimate.json", "--model", "mine.json"], "mine.json");
    std::fs::create_dir(at.join("out")).unwrap();
    std::fs::write(at.join("out/report.html"), "<!DOCTYPE html><title>mine</title>").unwrap();
    refused(&["identify", "run.toml", "--out", "out"], "out/report.html");
    run(at, &["identify", "run.toml", "--out", "out", "--force"], 0);
    run(at, &["simulate", "arm.urdf", "--out", "log.csv", "--force"], 0);
    run(at, &["export", "estimate.json", "--urdf", "mine.urdf", "--force"], 0);
    // What dynid wrote it replaces.
    for _ in 0..2 {
        run(at, &["simulate", "arm.urdf", "--duration", "2", "--out", "again.csv.gz"], 0);
        run(at, &["predict", "estimate.json", "--states", "states.csv", "--out", "efforts.csv"], 0);
    }
    run(at, &["identify", "run.toml", "--out", "out"], 0);
    run(
        at,
        &["export", "estimate.json", "--urdf", "mine.urdf", "--mjcf", "new.xml", "--model", "new.json"],
        0,
    );
    run(
        at,
        &["export", "estimate.json", "--urdf", "mine.urdf", "--mjcf", "new.xml", "--model", "new.json"],
        0,
    );
    for _ in 0..2 {
        run(at, &["check", "run.toml", "--fix", "fixed.toml", "--report", "check.html"], 0);
    }
    // Tables go with the marked files of their folder.
    let design = "robot = \"arm.urdf\"\n[trajectory]\nperiod_s = 4\nharmonics = 3\nsample_rate_hz = 50\n[search]\nstarts = 1\n";
    std::fs::write(at.join("design.toml"), design).unwrap();
    for _ in 0..2 {
        run(at, &["design", "design.toml", "--out", "motion", "--quiet"], 0);
    }
    for file in ["design.json", "report.html", "trajectory.json"] {
        std::fs::remove_file(at.join("motion").join(file)).unwrap();
    }
    let said = text(&run(at, &["design", "design.toml", "--out", "motion", "--quiet"], 2).stderr);
    assert!(said.contains("is not known to come from dynid"), "{said}");
}

#[test]
fn logs_of_the_command_line_take_the_place_of_those_of_a_configuration() {
    let folder = copied();
    let at = folder.path();
    let estimate = |args: &[&str]| -> Value {
        run(at, &[&["identify"], args, &["--out", "o", "--quiet"]].concat(), 0);
        serde_json::from_str(&read(at, "o/estimate.json")).unwrap()
    };
    let by_config = estimate(&["run.toml", "--log", "other.csv"]);
    let by_robot = estimate(&["arm.urdf", "--log", "other.csv"]);
    assert_eq!(by_config["parameters"], by_robot["parameters"]);
    assert_ne!(by_config["parameters"], estimate(&["run.toml"])["parameters"]);
    assert_eq!(estimate(&["run.toml", "--rows", "11:700"])["samples"], 690);
    let of = |args: &[&str]| text(&run(at, args, 0).stdout);
    let expected = of(&["check", "other.csv", "--robot", "arm.urdf"]);
    assert_eq!(of(&["check", "run.toml", "--log", "other.csv"]), expected);
    assert_eq!(of(&["check", "arm.urdf", "--log", "other.csv"]), expected);
    std::fs::write(
        at.join("own.toml"),
        "robot = \"arm.urdf\"\n[[log]]\npath = \"log.csv\"\nrows = [1, 500]\nown = [\"offset\"]\n",
    )
    .unwrap();
    let said = text(&run(at, &["check", "own.toml", "--log", "other.csv"], 0).stderr);
    assert!(said.contains("what it states of log.csv alone does not count"), "{said}");
    let refused = |args: &[&str], words: &[&str]| {
        let said = text(&run(at, args, 2).stderr);
        assert!(words.iter().all(|w| said.contains(w)), "{args:?}: {said}");
    };
    refused(
        &["check", "run.toml", "other.csv"],
        &["expected one configuration", "dynid check CONFIG --log LOG"],
    );
    refused(
        &["check", "log.csv", "--robot", "run.toml"],
        &["expected a robot file", "dynid check CONFIG --log"],
    );
    refused(
        &["payload", "run.toml", "--log", "log.csv"],
        &["stated in the configuration", "path = \"log.csv\""],
    );
    refused(&["gains", "run.toml", "--log", "log.csv"], &["[[log]]", "payload = \"NAME\""]);
}

#[test]
fn validate_fails_beyond_the_largest_error() {
    let at = prepared();
    let validate = ["validate", "out/estimate.json", "--log", "other.csv"];
    let fits: Value =
        serde_json::from_slice(&run(at, &[&validate[..], &["--json"]].concat(), 0).stdout).unwrap();
    let error = fits[0]["filtered"]["relative_error"].as_f64().unwrap();
    assert!(error > 0.0);
    let limit = |factor: f64| format!("{}", factor * error);
    let said = text(&run(at, &[&validate[..], &["--max-error", &limit(1.01)]].concat(), 0).stdout);
    assert!(said.lines().last().unwrap().starts_with("ok: "), "{said}");
    let said = text(&run(at, &[&validate[..], &["--max-error", &limit(0.99)]].concat(), 1).stdout);
    assert!(said.lines().last().unwrap().starts_with("fail: ") && said.ends_with("other.csv\n"), "{said}");
    let json = run(at, &[&validate[..], &["--json", "--max-error", &limit(0.99)]].concat(), 1).stdout;
    assert_eq!(serde_json::from_slice::<Value>(&json).unwrap(), fits);
    for bad in ["0", "-3", "nan", "much"] {
        let said = text(&run(at, &[&validate[..], &["--max-error", bad]].concat(), 2).stderr);
        assert!(said.contains("expected a positive number, percent"), "{said}");
    }
}

#[test]
fn a_reader_that_goes_does_not_change_the_exit_code() {
    let at = prepared();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = std::process::Command::new(assert_cmd::cargo::cargo_bin!("dynid"))
        .current_dir(at)
        .args(["validate", "out/estimate.json", "--log", "other.csv", "--max-error", "1e-9"])
        .stdout(std::process::Stdio::from(writer))
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(1));
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let commands = commands(at);
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&run(at, &["completions", shell], 0).stdout);
        assert!(commands.iter().all(|command| script.contains(command.as_str())), "{shell}");
        assert!(script.contains("max-error"), "{shell}");
    }
    let script = run(at, &["completions", "bash"], 0).stdout;
    std::fs::write(at.join("dynid.bash"), script).unwrap();
    // A shell that is here reads its own.
    if let Ok(output) = std::process::Command::new("bash").current_dir(at).args(["-n", "dynid.bash"]).output()
    {
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    run(at, &["man", "--out", "man1"], 0);
    let mut pages: Vec<String> = std::fs::read_dir(at.join("man1"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    pages.sort();
    let mut expected: Vec<String> = commands.iter().map(|command| format!("dynid-{command}.1")).collect();
    expected.push("dynid.1".to_owned());
    expected.sort();
    assert_eq!(pages, expected);
    let page = read(at, "man1/dynid-validate.1");
    assert!(page.contains(".TH") && page.contains("max\\-error") && page.contains("Exit codes"), "{page}");
    assert_eq!(text(&run(at, &["man"], 0).stdout), read(at, "man1/dynid.1"));
    // Pages are replaced as what they are.
    run(at, &["man", "--out", "man1", "--quiet"], 0);
}
