//! What scripts may rely on: files, keys, shapes, exit codes, and numbers that agree between commands.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Stdio;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, dynid, indy7, run};
use dynid_testing::shared;
use serde_json::Value;
use tempfile::TempDir;

const SIMULATE: [&str; 9] =
    ["simulate", "arm.urdf", "--duration", "25", "--rate-hz", "100", "--effort-noise", "0.01", "--out"];
/// With the elements given alone: which parameters there are must not hang on what the noise of a log asks for.
const IDENTIFY: [&str; 10] = [
    "identify",
    "arm.urdf",
    "--log",
    "train.csv",
    "--validate",
    "valid.csv",
    "--out",
    "out",
    "--friction",
    "given",
];

/// A folder with a robot and two logs.
fn logs() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), TWO_LINKS).unwrap();
    let simulate = |more: &[&str]| run(folder.path(), &[&SIMULATE, more].concat(), 0);
    simulate(&["train.csv", "--seed", "1", "--clean", "clean.csv", "--truth", "truth.json"]);
    simulate(&["valid.csv", "--seed", "2", "--clean", "states.csv"]);
    folder
}

/// The folder of the example with an identification in `out`.
fn identified() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| {
            let folder = logs();
            run(folder.path(), &IDENTIFY, 0);
            folder
        })
        .path()
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn json(text: impl AsRef<[u8]>) -> Value {
    serde_json::from_slice(text.as_ref()).unwrap()
}

fn text(output: &[u8]) -> String {
    String::from_utf8(output.to_vec()).unwrap()
}

/// Numbers of a list; `null` is not a number.
#[track_caller]
fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn rms(x: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = x.fold((0.0, 0.0), |(s, n), x| (s + x * x, n + 1.0));
    (sum / n).sqrt()
}

/// Columns of a CSV by name.
struct Columns(Vec<(String, Vec<f64>)>);

impl Columns {
    /// Parses a CSV of numbers under a header.
    fn parse(text: &str) -> Self {
        let mut lines = text.lines();
        let names = lines.next().unwrap().split(',').map(str::to_owned);
        let mut columns: Vec<(String, Vec<f64>)> = names.map(|name| (name, Vec::new())).collect();
        for line in lines {
            for (column, field) in columns.iter_mut().zip(line.split(',')) {
                column.1.push(field.parse().unwrap());
            }
        }
        Columns(columns)
    }

    /// Names in file order.
    fn names(&self) -> Vec<&str> {
        self.0.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// A column.
    #[track_caller]
    fn get(&self, name: &str) -> &[f64] {
        let found = self.0.iter().find(|(n, _)| n == name);
        &found.unwrap_or_else(|| panic!("no column {name} in {:?}", self.names())).1
    }
}

fn parameter(estimate: &Value, name: &str) -> f64 {
    let found = estimate["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name);
    found.unwrap()["value"].as_f64().unwrap()
}

#[test]
fn an_estimate_has_the_keys_types_and_lengths_of_the_contract() {
    let e = json(read(identified(), "out/estimate.json"));
    assert_eq!(e["schema"], 1);
    assert_eq!(e["robot"], "arm");
    assert_eq!(e["joints"], serde_json::json!(["shoulder", "elbow"]));
    assert_eq!(e["samples"], 2501);
    assert!(e["condition_number"].as_f64().unwrap() >= e["condition_number_scaled"].as_f64().unwrap() * 0.1);
    assert!(e["condition_number_scaled"].as_f64().unwrap() >= 1.0);
    assert!(e["feasible"].is_boolean());
    let parameters = e["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 2 * 10 + 2 * 4);
    for p in parameters {
        assert!(p["link"].is_string() != p["joint"].is_string(), "{p}");
        assert!(["name", "unit", "verdict"].iter().all(|key| p[key].is_string()), "{p}");
        assert!(p["value"].is_number(), "{p}");
        for key in ["std", "rel_std", "prior"] {
            assert!(p.get(key).is_some_and(|x| x.is_number() || x.is_null()), "{key}: {p}");
        }
    }
    let base = e["base_parameters"].as_array().unwrap();
    assert_eq!(base.len(), e["rank"]["structural"].as_u64().unwrap() as usize);
    for b in base {
        assert!(b["name"].is_string() && b["expression"].is_string(), "{b}");
        assert!(["value", "std"].iter().all(|key| b[key].is_number()), "{b}");
        assert!(b.get("rel_std").is_some(), "{b}");
    }
    assert_eq!(e["validation"].as_array().unwrap().len(), 1);
    assert_eq!(e["validation"][0]["log"], "valid.csv");
    for fit in [&e["fit"], &e["validation"][0]] {
        for key in ["rms", "nrmse", "r2"] {
            assert_eq!(numbers(&fit[key]).len(), 2, "{key}");
        }
        assert!(fit["relative_error"].is_number());
    }
    let provenance = &e["provenance"];
    assert_eq!(provenance["version"], env!("CARGO_PKG_VERSION"));
    assert!(provenance["seed"].is_u64() && provenance["settings"].is_object());
    let inputs = provenance["inputs"].as_array().unwrap();
    let paths: Vec<&str> = inputs.iter().map(|i| i["path"].as_str().unwrap()).collect();
    assert_eq!(paths, ["arm.urdf", "train.csv", "valid.csv"]);
    assert!(inputs.iter().all(|i| i["sha256"].as_str().unwrap().len() == 64));
    assert_ne!(e["verdict"]["status"], "fail", "{}", e["verdict"]);
}

#[test]
fn prediction_at_clean_states_gives_the_true_effort_within_a_few_per_mille() {
    let folder = identified();
    let stdout = run(folder, &["predict", "out/estimate.json", "--states", "states.csv"], 0).stdout;
    let predicted = Columns::parse(&text(&stdout));
    assert_eq!(predicted.names(), ["effort_shoulder", "effort_elbow"]);
    let clean = Columns::parse(&read(folder, "states.csv"));
    for joint in ["shoulder", "elbow"] {
        let (ours, truth) = (predicted.get(&format!("effort_{joint}")), clean.get(&format!("tau_{joint}")));
        assert_eq!(ours.len(), truth.len());
        let error = rms(ours.iter().zip(truth).map(|(a, b)| a - b)) / rms(truth.iter().copied());
        assert!(error < 5e-3, "{joint}: {error}");
    }
    run(folder, &["predict", "out/estimate.json", "--states", "states.csv", "--out", "effort.csv"], 0);
    let written = Columns::parse(&read(folder, "effort.csv"));
    assert_eq!(written.get("effort_elbow"), predicted.get("effort_elbow"));
}

#[test]
fn validate_prints_a_table_and_json() {
    let folder = identified();
    let args = ["validate", "out/estimate.json", "--log", "valid.csv", "--log", "train.csv"];
    let table = text(&run(folder, &args, 0).stdout);
    assert!(
        ["valid.csv: ", "train.csv: ", "shoulder", "elbow", "R²"].iter().all(|s| table.contains(s)),
        "{table}"
    );
    let fits = json(run(folder, &[&args[..], &["--json"]].concat(), 0).stdout);
    assert_eq!(fits.as_array().unwrap().len(), 2);
    // The log that `identify` validated on gives the same figures.
    let estimate = json(read(folder, "out/estimate.json"));
    for key in ["rms", "nrmse", "r2"] {
        for (a, b) in numbers(&fits[0][key]).iter().zip(numbers(&estimate["validation"][0][key])) {
            // Parameters read from JSON may differ in their last bit.
            assert!((a - b).abs() <= 1e-9 * b.abs(), "{key}: {a} {b}");
        }
    }
    assert!(numbers(&fits[0]["r2"]).iter().all(|r2| *r2 > 0.99), "{fits}");
}

#[test]
fn regressor_times_parameters_is_the_effort() {
    let folder = identified();
    let args = ["regressor", "arm.urdf", "--states", "clean.csv"];
    let out = json(run(folder, &[&args[..], &["--json"]].concat(), 0).stdout);
    assert_eq!(out["joints"], serde_json::json!(["shoulder", "elbow"]));
    let columns = out["columns"].as_array().unwrap();
    assert_eq!(columns.len(), 20);
    assert_eq!(out["effort"].as_array().unwrap().len(), 2501);
    assert_eq!(out["regressor"].as_array().unwrap().len(), 2501);
    let truth = json(read(folder, "truth.json"));
    let phi: Vec<f64> = columns.iter().map(|c| truth[c.as_str().unwrap()].as_f64().unwrap()).collect();
    for state in [0, 17, 2500] {
        for joint in 0..2 {
            let row = numbers(&out["regressor"][state][joint]);
            let effort = out["effort"][state][joint].as_f64().unwrap();
            let product: f64 = row.iter().zip(&phi).map(|(w, p)| w * p).sum();
            // Twenty products of moderate numbers.
            assert!((product - effort).abs() < 1e-12 * (1.0 + effort.abs()), "{product} {effort}");
        }
    }
    let csv = Columns::parse(&text(&run(folder, &args, 0).stdout));
    assert_eq!(csv.get("effort_elbow")[17], out["effort"][17][1].as_f64().unwrap());

    let base = json(run(folder, &[&args[..], &["--base", "--json"]].concat(), 0).stdout);
    let inspected = json(run(folder, &["inspect", "arm.urdf", "--json"], 0).stdout);
    let kept: Vec<&Value> =
        inspected["base_parameters"].as_array().unwrap().iter().map(|b| &b["name"]).collect();
    assert_eq!(base["columns"].as_array().unwrap().iter().collect::<Vec<_>>(), kept);
    assert_eq!(numbers(&base["regressor"][5][0]).len(), kept.len());
}

#[test]
fn states_by_number_and_by_name_agree_and_gravity_columns_count() {
    let folder = identified();
    let row = "0.3,-0.7,0.5,1.5,-2.0,3.0";
    let write = |name: &str, header: &str, values: &str| {
        std::fs::write(folder.join(name), format!("{header}\n{values}\n")).unwrap();
    };
    write("numbered.csv", "q1,q2,dq1,dq2,ddq1,ddq2", row);
    write(
        "named.csv",
        "ddq_elbow,q_shoulder,q_elbow,dq_shoulder,dq_elbow,ddq_shoulder",
        "3.0,0.3,-0.7,0.5,1.5,-2.0",
    );
    write("weightless.csv", "q1,q2,dq1,dq2,ddq1,ddq2,gx,gy,gz", &format!("{row},0,0,0"));
    write("standing.csv", "q1,q2,dq1,dq2,ddq1,ddq2,gx,gy,gz", "0.3,-0.7,0,0,0,0,0,0,0");
    let effort = |states: &str, more: &[&str]| {
        let args = [&["regressor", "arm.urdf", "--states", states, "--json"], more].concat();
        numbers(&json(run(folder, &args, 0).stdout)["effort"][0])
    };
    assert_eq!(effort("numbered.csv", &[]), effort("named.csv", &[]));
    assert_eq!(effort("weightless.csv", &[]), effort("numbered.csv", &["--gravity", "0,0,0"]));
    assert_ne!(effort("weightless.csv", &[]), effort("numbered.csv", &[]));
    assert_eq!(effort("standing.csv", &[]), [0.0, 0.0]);
}

#[test]
fn inspect_finds_the_forty_base_parameters_of_indy7() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("indy7.toml"), indy7()).unwrap();
    let args = ["inspect", "indy7.toml", "--elements", "rotor"];
    let shown = text(&run(folder.path(), &args, 0).stdout);
    assert!(shown.contains("40 base parameters out of 66"), "{shown}");
    assert!(shown.contains("mx2 + 0.45 (m3 + m4 + m5 + m6)"), "{shown}");
    let out = json(run(folder.path(), &[&args[..], &["--json"]].concat(), 0).stdout);
    assert_eq!(out["base_parameter_count"], 40);
    assert_eq!(out["base_parameters"].as_array().unwrap().len(), 40);
    let joints: Vec<&str> =
        out["joints"].as_array().unwrap().iter().map(|j| j["name"].as_str().unwrap()).collect();
    assert_eq!(joints, ["j1", "j2", "j3", "j4", "j5", "j6"]);
    let rigid =
        json(run(folder.path(), &["inspect", "indy7.toml", "--elements", "none", "--json"], 0).stdout);
    assert_eq!(rigid["standard_parameters"], 60);
    // Rotors of the first two joints turn with link inertias; those of the other four are seen by themselves.
    assert_eq!(rigid["base_parameter_count"], 36);
}

#[test]
fn a_log_of_noise_ends_with_exit_code_1_and_says_so() {
    let folder = logs();
    let log = read(folder.path(), "train.csv");
    let mut state = 7_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut noisy = log.lines().next().unwrap().to_owned() + "\n";
    for line in log.lines().skip(1) {
        let kept: Vec<&str> = line.split(',').take(3).collect();
        noisy += &format!("{},{},{}\n", kept.join(","), noise(), noise());
    }
    std::fs::write(folder.path().join("noise.csv"), noisy).unwrap();
    let output =
        run(folder.path(), &["identify", "arm.urdf", "--log", "noise.csv", "--out", "noise", "--quiet"], 1);
    let said = text(&output.stdout);
    assert!(said.lines().last().unwrap().starts_with("fail: ") && output.stderr.is_empty(), "{said}");
    assert_eq!(json(read(folder.path(), "noise/estimate.json"))["verdict"]["status"], "fail");
    assert!(folder.path().join("noise/report.html").is_file());
}

#[test]
fn a_clock_in_milliseconds_is_told_by_its_steps_unless_seconds_are_said() {
    let folder = logs();
    let log = read(folder.path(), "train.csv");
    let mut slow = log.lines().next().unwrap().to_owned() + "\n";
    for (row, line) in log.lines().skip(1).enumerate() {
        slow += &format!("{},{}\n", 10 * row, line.split_once(',').unwrap().1);
    }
    std::fs::write(folder.path().join("slow.csv"), slow).unwrap();
    let identify = |log: &str| {
        let arguments = ["identify", "arm.urdf", "--log", log, "--out", "slow"];
        let output = dynid().current_dir(folder.path()).args(arguments).output().unwrap();
        text(&output.stdout) + &text(&output.stderr)
    };
    let said = identify("slow.csv");
    assert!(said.contains("time of slow.csv = `t` in ms, 100.0000 Hz"), "{said}");
    let seconds = read(folder.path(), "slow.csv").replacen("t,", "t[s],", 1);
    std::fs::write(folder.path().join("seconds.csv"), seconds).unwrap();
    let said = identify("seconds.csv");
    assert!(said.contains("warning: seconds.csv: a sample rate of 0.1 Hz"), "{said}");
}

#[test]
fn json_goes_to_stdout_alone_and_is_what_the_file_holds() {
    let folder = logs();
    let output = run(folder.path(), &[&IDENTIFY[..], &["--json", "--quiet"]].concat(), 0);
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout), read(folder.path(), "out/estimate.json"));
    let output = run(folder.path(), &IDENTIFY, 0);
    let (result, said) = (text(&output.stdout), text(&output.stderr));
    for part in ["settings:", "training fit", "validation on valid.csv", "checks:", "parameters: "] {
        assert!(result.contains(part), "{part}: {result}");
        assert!(!said.contains(part), "{part}: {said}");
    }
    assert!(said.contains("written: out") && !result.contains("written: "), "{said}");
}

#[test]
fn a_closed_pipe_is_no_error() {
    let folder = identified();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = std::process::Command::new(assert_cmd::cargo::cargo_bin!("dynid"))
        .current_dir(folder)
        .args(["inspect", "arm.urdf"])
        .stdout(Stdio::from(writer))
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
}

#[test]
fn runs_give_the_same_bytes_whatever_the_number_of_threads() {
    let reference = identified();
    for threads in ["1", "2", "7", "7"] {
        let folder = logs();
        let output = dynid()
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", threads)
            .args(IDENTIFY)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(0));
        for file in ["train.csv", "truth.json", "out/estimate.json", "out/report.html", "out/arm.urdf"] {
            assert!(
                read(folder.path(), file) == read(reference, file),
                "{file} differs for {threads} threads"
            );
        }
    }
}

#[test]
fn the_written_urdf_moves_like_the_estimate_without_its_elements() {
    let folder = identified();
    let estimate = json(read(folder, "out/estimate.json"));
    run(folder, &["inspect", "out/arm.urdf"], 0);
    let out = run(folder, &["regressor", "out/arm.urdf", "--states", "states.csv"], 0);
    let rigid = Columns::parse(&text(&out.stdout));
    let out = run(folder, &["predict", "out/estimate.json", "--states", "states.csv"], 0);
    let predicted = Columns::parse(&text(&out.stdout));
    let states = Columns::parse(&read(folder, "states.csv"));
    for joint in ["shoulder", "elbow"] {
        let [fc, fv, fo, ia] =
            ["fc", "fv", "fo", "Ia"].map(|s| parameter(&estimate, &format!("{joint}.{s}")));
        let effort = format!("effort_{joint}");
        let (dq, ddq) = (states.get(&format!("dq_{joint}")), states.get(&format!("ddq_{joint}")));
        for row in (0..dq.len()).filter(|row| dq[*row] != 0.0) {
            let elements = fc * dq[row].signum() + fv * dq[row] + fo + ia * ddq[row];
            let difference = predicted.get(&effort)[row] - elements - rigid.get(&effort)[row];
            assert!(difference.abs() < 1e-9, "{joint}, row {row}: {difference}");
        }
    }
}

#[test]
fn a_configuration_says_the_same_as_flags() {
    let folder = logs();
    let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    put(
        "run.toml",
        "robot = \"arm.urdf\"\nout = \"out\"\n[elements]\nfriction = \"given\"\n[[log]]\npath = \"train.csv\"\n\
         [[validation]]\npath = \"valid.csv\"\n",
    );
    run(folder.path(), &["identify", "run.toml"], 0);
    let by_file = json(read(folder.path(), "out/estimate.json"));
    let by_flags = json(read(identified(), "out/estimate.json"));
    for key in ["parameters", "base_parameters", "fit", "validation", "conditioning"] {
        assert_eq!(by_file[key], by_flags[key], "{key}");
    }
    run(
        folder.path(),
        &["identify", "run.toml", "--out", "other", "--kernel-hz", "8", "--elements", "viscous"],
        0,
    );
    let other = json(read(folder.path(), "other/estimate.json"));
    assert_eq!(other["model"]["kernel_hz"], 8.0);
    assert_eq!(other["model"]["elements"], serde_json::json!([["viscous"], ["viscous"]]));
}

#[test]
fn row_ranges_parts_and_several_logs_count_their_samples() {
    let folder = logs();
    let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let samples = |config: &str| {
        put("run.toml", &format!("robot = \"arm.urdf\"\nout = \"out\"\n{config}"));
        run(folder.path(), &["identify", "run.toml"], 0);
        json(read(folder.path(), "out/estimate.json"))["samples"].as_u64().unwrap()
    };
    assert_eq!(samples("[[log]]\npath = \"train.csv\"\nrows = [101, 1600]\n"), 1500);
    assert_eq!(samples("[[log]]\npath = \"train.csv\"\npart = [0.0, 0.7]\n"), 1751);
    assert_eq!(samples("[[log]]\npath = \"train.csv\"\n[[log]]\npath = \"valid.csv\"\n"), 5002);
    let two = ["identify", "arm.urdf", "--log", "train.csv", "--log", "valid.csv"];
    let more = ["--validate", "train.csv", "--validate", "valid.csv", "--out", "two"];
    run(folder.path(), &[&two[..], &more].concat(), 0);
    let estimate = json(read(folder.path(), "two/estimate.json"));
    assert_eq!(estimate["samples"], 5002);
    let validated: Vec<&Value> =
        estimate["validation"].as_array().unwrap().iter().map(|v| &v["log"]).collect();
    assert_eq!(validated, ["train.csv", "valid.csv"]);
    let rows = ["validate", "two/estimate.json", "--log", "valid.csv", "--rows", "1:800", "--json"];
    assert_ne!(json(run(folder.path(), &rows, 0).stdout)[0]["rms"], estimate["validation"][1]["rms"]);
}

#[test]
fn the_textbook_route_and_ordinary_least_squares_run() {
    let folder = logs();
    let more = ["--route", "textbook", "--estimator", "ols", "--kernel-hz", "10", "--decimation", "3"];
    run(folder.path(), &[&IDENTIFY[..], &more].concat(), 0);
    let estimate = json(read(folder.path(), "out/estimate.json"));
    assert_eq!(estimate["conditioning"]["route"], "textbook");
    assert!(numbers(&estimate["validation"][0]["filtered"]["r2"]).iter().all(|r2| *r2 > 0.99));
}

#[test]
fn a_locked_joint_leaves_the_model() {
    let folder = logs();
    run(folder.path(), &[&SIMULATE[..], &["held.csv", "--lock", "elbow=0.5"]].concat(), 0);
    let header = read(folder.path(), "held.csv");
    assert_eq!(header.lines().next(), Some("t,q_shoulder,tau_shoulder"));
    let args = ["identify", "arm.urdf", "--log", "held.csv", "--lock", "elbow=0.5", "--out", "held"];
    run(folder.path(), &args, 0);
    let estimate = json(read(folder.path(), "held/estimate.json"));
    assert_eq!(estimate["joints"], serde_json::json!(["shoulder"]));
    // In the file that is given back it is a joint as before.
    let inspected = json(run(folder.path(), &["inspect", "held/arm.urdf", "--json"], 0).stdout);
    assert_eq!(inspected["joints"].as_array().unwrap().len(), 2);
}

#[test]
fn names_with_spaces_and_letters_of_any_alphabet_survive() {
    let folder = tempfile::tempdir().unwrap();
    let robot = TWO_LINKS
        .replace("\"shoulder\"", "\"Schulter α\"")
        .replace("\"elbow\"", "\"肘 2\"")
        .replace("\"forearm\"", "\"avant bras\"");
    std::fs::write(folder.path().join("mein Röboter.urdf"), robot).unwrap();
    let at = |args: &[&str]| run(folder.path(), args, 0);
    at(&[
        "simulate",
        "mein Röboter.urdf",
        "--rate-hz",
        "100",
        "--out",
        "log ü.csv.gz",
        "--clean",
        "rein.csv",
    ]);
    at(&["identify", "mein Röboter.urdf", "--log", "log ü.csv.gz", "--out", "aus gabe/tief", "-q"]);
    let estimate = json(read(folder.path(), "aus gabe/tief/estimate.json"));
    assert_eq!(estimate["joints"], serde_json::json!(["Schulter α", "肘 2"]));
    let out = at(&["predict", "aus gabe/tief/estimate.json", "--states", "rein.csv"]);
    assert_eq!(Columns::parse(&text(&out.stdout)).names(), ["effort_Schulter α", "effort_肘 2"]);
    at(&["inspect", "aus gabe/tief/mein Röboter.urdf"]);
}

#[test]
fn every_command_has_a_help_text_and_the_program_a_version() {
    let folder = tempfile::tempdir().unwrap();
    let overview = text(&run(folder.path(), &["--help"], 0).stdout);
    for command in ["inspect", "regressor", "identify", "predict", "simulate", "validate", "export"] {
        assert!(overview.contains(command), "{command}");
        let help = run(folder.path(), &[command, "--help"], 0);
        let shown = text(&help.stdout);
        assert!(shown.contains("Usage: ") && help.stderr.is_empty(), "{shown}");
        // Every option is explained, on its line or on the next.
        let lines: Vec<&str> = shown.lines().map(str::trim).collect();
        for pair in lines.windows(2).filter(|pair| pair[0].starts_with("--")) {
            let explained = pair[0].contains("  ") || !(pair[1].is_empty() || pair[1].starts_with('-'));
            assert!(explained, "{command}: no text for {}", pair[0]);
        }
    }
    let version = text(&run(folder.path(), &["--version"], 0).stdout);
    let revision = version.trim_end().strip_prefix(&format!("dynid {}", env!("CARGO_PKG_VERSION"))).unwrap();
    let digits = revision.trim().trim_matches(['(', ')']);
    assert!(digits.is_empty() || digits.len() == 12 && u64::from_str_radix(digits, 16).is_ok(), "{version}");
    let misuse = run(folder.path(), &["identify"], 2);
    assert!(text(&misuse.stderr).starts_with("error: ") && misuse.stdout.is_empty());
}

/// Compares efforts and regressor of the program with those of another library, matched by name.
fn check_oracle(robot: &str, oracle: &str, flags: &[&str]) {
    const FLOATING: [&str; 6] = [".vx", ".vy", ".vz", ".wx", ".wy", ".wz"];
    let Some(data) = shared("data/oracles") else { return };
    let oracle = json(std::fs::read(data.join(oracle)).unwrap());
    let floating = |j: &Value| j["type"].as_str().unwrap().contains("FreeFlyer");
    let mut header: Vec<String> = Vec::new();
    let mut rates: Vec<String> = Vec::new();
    for joint in oracle["joints"].as_array().unwrap() {
        let name = joint["name"].as_str().unwrap();
        if floating(joint) {
            header.extend([".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"].map(|s| format!("q_{name}{s}")));
            rates.extend(FLOATING.map(|s| format!("{name}{s}")));
        } else {
            header.push(format!("q_{name}"));
            rates.push(name.to_owned());
        }
    }
    for prefix in ["dq", "ddq"] {
        header.extend(rates.iter().map(|r| format!("{prefix}_{r}")));
    }
    let mut states = header.join(",") + ",gx,gy,gz\n";
    let rows = oracle["states"].as_array().unwrap();
    for s in rows {
        let row = ["q", "qd", "qdd", "gravity"].map(|key| numbers(&s[key])).concat();
        states += &(row.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n");
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("states.csv"), states).unwrap();
    let path = data.join(robot);
    let args = [&["regressor", path.to_str().unwrap(), "--states", "states.csv", "--json"], flags].concat();
    let ours = json(run(folder.path(), &args, 0).stdout);
    let place: Vec<usize> = ours["joints"]
        .as_array()
        .unwrap()
        .iter()
        .map(|j| rates.iter().position(|r| r == j.as_str().unwrap()).unwrap())
        .collect();
    assert_eq!(place.iter().collect::<BTreeSet<_>>().len(), rates.len());
    for (k, state) in rows.iter().enumerate() {
        let tau = numbers(&state["tau"]);
        let scale = tau.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let effort = numbers(&ours["effort"][k]);
        for (x, p) in effort.iter().zip(&place) {
            // Both libraries sum a few hundred products of this size.
            assert!((x - tau[*p]).abs() < 1e-12 * scale, "{robot}, state {k}: {x} {}", tau[*p]);
        }
        // Columns come in other orders; the sum of squares of an output's row does not depend on them.
        for (row, p) in ours["regressor"][k].as_array().unwrap().iter().zip(&place) {
            let (a, b) = (rms(numbers(row).into_iter()), rms(numbers(&state["Y"][*p]).into_iter()));
            assert!((a - b).abs() < 1e-12 * (1.0 + b), "{robot}, state {k}: {a} {b}");
        }
    }
}

#[test]
fn regressor_agrees_with_another_library_on_ur5() {
    check_oracle("ur5.urdf", "ur5_oracle.json", &[]);
}

#[test]
fn regressor_agrees_with_another_library_on_a_quadruped_with_a_floating_base() {
    check_oracle("solo12.urdf", "solo12_ff_oracle.json", &["--floating-base"]);
}

#[test]
fn elements_that_need_a_channel_are_refused_by_simulate() {
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("robot.toml");
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/indy7.toml")).unwrap();
    std::fs::write(&robot, text.replace("\"rotor\"]", "\"rotor\", \"drive_gain\"]")).unwrap();
    let out = folder.path().join("log.csv");
    let run = assert_cmd::Command::cargo_bin("dynid")
        .unwrap()
        .args(["simulate", &robot.display().to_string(), "--out", &out.display().to_string()])
        .assert()
        .code(2);
    let message = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(message.starts_with("error: ") && message.contains("current_j1"), "{message}");
    assert!(!out.exists());
}

#[test]
fn simulate_in_closed_loop_writes_log_states_and_truth_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), TWO_LINKS).unwrap();
    let make = |log: &str, truth: &str| {
        let args = ["simulate", "arm.urdf", "--closed-loop", "--duration", "2", "--rate-hz", "250"];
        let files = ["--out", log, "--clean", "clean.csv", "--truth", truth, "--force"];
        run(folder.path(), &[&args[..], &files].concat(), 0);
    };
    make("a.csv", "a.json");
    make("b.csv", "b.json");
    assert_eq!(read(folder.path(), "a.csv"), read(folder.path(), "b.csv"));
    assert_eq!(read(folder.path(), "a.json"), read(folder.path(), "b.json"));
    let truth = json(read(folder.path(), "a.json"));
    assert!(truth["experiment"]["imperfections"].as_array().unwrap().len() > 5);
    // A thousand a second from both ends on, and one for the delay.
    assert_eq!(truth["experiment"]["ticks"], 2002);
    assert!(truth["shoulder.fc"].is_number(), "{truth}");
}
