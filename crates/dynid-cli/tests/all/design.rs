//! What scripts may rely on in `dynid design`: files, keys, limits that hold, exit codes, the same bytes again.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Output;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, dynid, indy7, run};
use serde_json::{Value, json};
use tempfile::TempDir;

const FILES: [&str; 6] = [
    "design.json",
    "report.html",
    "trajectory.csv",
    "trajectory.json",
    "trajectory.ros2.json",
    "trajectory.ros2.yaml",
];
const JOINTS: [&str; 6] = ["j1", "j2", "j3", "j4", "j5", "j6"];
/// Limits of robots/indy7.toml: degrees, degrees a second.
const POSITION: [f64; 6] = [175.0, 100.0, 150.0, 175.0, 175.0, 215.0];
const SPEED: [f64; 6] = [150.0, 150.0, 150.0, 150.0, 180.0, 180.0];

/// Two starts and few samples: quick.
const QUICK: [&str; 6] = ["design", "indy7.toml", "--starts", "2", "--rate-hz", "50"];

/// A folder with the Indy7 and other files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("indy7.toml"), indy7()).unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// A design of the Indy7 with an approach, made once.
fn designed() -> &'static (TempDir, Output) {
    static FOLDER: OnceLock<(TempDir, Output)> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = folder(&[]);
        let more = ["--acceleration", "3", "--park", "--out", "out"];
        let output = run(folder.path(), &[&QUICK[..], &more].concat(), 0);
        (folder, output)
    })
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn json(text: impl AsRef<[u8]>) -> Value {
    serde_json::from_slice(text.as_ref()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Names of the files in a folder, sorted.
fn listing(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Columns of a CSV by name.
fn columns(text: &str) -> BTreeMap<String, Vec<f64>> {
    let mut lines = text.lines();
    let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let mut out: BTreeMap<String, Vec<f64>> = names.iter().map(|n| (n.clone(), Vec::new())).collect();
    for line in lines {
        for (name, field) in names.iter().zip(line.split(',')) {
            out.get_mut(name).unwrap().push(field.parse().unwrap());
        }
    }
    out
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| x.abs().max(m))
}

#[test]
fn a_design_leaves_six_files_and_says_what_they_are_worth() {
    let (folder, output) = designed();
    assert_eq!(listing(&folder.path().join("out")), FILES);
    let results = String::from_utf8(output.stdout.clone()).unwrap();
    let parts = [
        "relative standard deviation",
        "condition number: ",
        "times smaller than on random motion",
        "parameters that the log will tell least about:",
        " limits act",
        "pass: all limits hold at every instant",
        "floor (20 mm), own links (",
        "not checked: the true shape of ",
        "least distance between links that are kept apart: ",
    ];
    for part in parts {
        assert!(results.contains(part), "{part}: {results}");
    }
    let said = stderr(output);
    let parts = [
        "warning: noise of the effort is not stated",
        "warning: no shapes are stated for ",
        "written: out/trajectory.json",
        "written: out/design.json",
        "written: out/report.html",
    ];
    for part in parts {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(!said.contains("pass:") && !results.contains("warning:") && !results.contains("written:"));
}

#[test]
fn design_json_has_the_keys_types_and_lengths_of_the_contract() {
    let d = json(read(designed().0.path(), "out/design.json"));
    assert_eq!(d["schema"], "dynid-design/1");
    assert_eq!(d["robot"], "indy7.toml");
    assert_eq!(d["joints"], json!(JOINTS));
    assert_eq!(d["verdict"]["status"], "pass");
    assert!(d["verdict"]["headline"].is_string() && d["verdict"]["warnings"].is_array());
    assert_eq!(d["criterion"]["name"], "relative-std");
    assert!(d["criterion"]["meaning"].is_string());
    assert!(["value", "logarithm"].iter().all(|key| d["criterion"][key].is_number()));
    let t = &d["trajectory"];
    assert_eq!([&t["period_s"], &t["sample_rate_hz"]], [&json!(20.0), &json!(50.0)]);
    assert_eq!([&t["harmonics"], &t["periods"]], [&json!(5), &json!(1)]);
    assert!(t["approach_s"].as_f64().unwrap() > 0.0 && t["return_s"].as_f64().unwrap() > 0.0);
    assert!(t["coefficients"].as_array().unwrap().iter().all(|row| row.as_array().unwrap().len() == 11));
    let raw = d["condition_number"].as_f64().unwrap();
    let singular: Vec<f64> =
        d["singular_values"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert!((raw - singular[0] / singular[1]).abs() < 1e-9 * raw);
    assert!((1.0..raw).contains(&d["condition_number_scaled"].as_f64().unwrap()));
    let parameters = d["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 58);
    for p in parameters {
        assert!(p["name"].is_string() && p["unit"].is_string() && p["nominal"].is_number(), "{p}");
        let (std, nominal) = (p["std"].as_f64().unwrap(), p["nominal"].as_f64().unwrap());
        assert!(std > 0.0 && std.is_finite(), "{p}");
        match p["rel_std"].as_f64() {
            Some(relative) => assert!((relative * nominal.abs() - std).abs() < 1e-9 * std, "{p}"),
            None => assert_eq!(nominal, 0.0, "{p}"),
        }
    }
    for key in ["confounded", "weakest", "limits", "starts", "noise"] {
        assert!(d[key].is_array(), "{key}");
    }
    let safety = &d["safety"];
    assert_eq!(safety["margin_m"], 0.02);
    let (plane, pairs) = (&safety["planes"][0], safety["pairs"].as_array().unwrap());
    assert_eq!((&plane["name"], &plane["normal"]), (&json!("floor"), &json!([0.0, 0.0, 1.0])));
    let links = plane["links"].as_array().unwrap();
    assert!(!links.is_empty() && !pairs.is_empty());
    assert!(safety["exempt"].as_array().unwrap().iter().all(|e| e["reason"].is_string()));
    assert!(safety["capsules"].as_array().unwrap().iter().all(|c| c["source"] == "chain"));
    assert!(safety["not_checked"].as_array().unwrap().iter().all(Value::is_string));
    for key in ["least_distance_m", "least_height_m"] {
        assert!(d[key].as_f64().unwrap() >= 0.02 - 1e-6, "{key}");
    }
    // Position, speed, acceleration and effort of six joints, links above the floor, pairs of links; the most used first,
    // none broken.
    let excess: Vec<f64> =
        d["limits"].as_array().unwrap().iter().map(|l| l["excess"].as_f64().unwrap()).collect();
    assert_eq!(excess.len(), 24 + links.len() + pairs.len());
    assert!(excess.windows(2).all(|w| w[0] >= w[1]) && excess[0] <= 0.0, "{excess:?}");
    let shares: f64 = d["weakest"].as_array().unwrap().iter().map(|w| w["share"].as_f64().unwrap()).sum();
    assert!((0.9..=1.0 + 1e-12).contains(&shares), "{shares}");
    let starts = d["starts"].as_array().unwrap();
    assert!(starts.iter().all(|s| s["feasible"] == true && s["evaluations"].is_u64()));
    assert!(starts.iter().any(|s| s["value"] == d["criterion"]["value"]));
    let seeds: Vec<&Value> = starts.iter().map(|s| &s["seed"]).collect();
    assert_eq!(seeds, [1, 2]);
    assert!(d["random"]["mean_ratio"].as_f64().unwrap() > 1.0);
    assert!(d["infeasible"].is_null());
    let provenance = &d["provenance"];
    assert_eq!(provenance["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(provenance["seed"], 1);
    assert_eq!(provenance["inputs"][0]["sha256"].as_str().unwrap().len(), 64);
    assert_eq!(provenance["settings"]["limits"]["acceleration"], 3.0);
}

#[test]
fn the_sampled_trajectory_reads_back_as_states_and_keeps_the_limits() {
    let folder = designed().0.path();
    let csv = columns(&read(folder, "out/trajectory.csv"));
    let time = &csv["t"];
    assert!(time.windows(2).all(|w| (w[1] - w[0] - 0.02).abs() < 1e-9));
    for (k, joint) in JOINTS.iter().enumerate() {
        let [q, dq, ddq] = ["q", "dq", "ddq"].map(|signal| &csv[&format!("{signal}_{joint}")]);
        assert!(largest(q) <= POSITION[k].to_radians(), "{joint}: {}", largest(q));
        assert!(largest(dq) <= SPEED[k].to_radians(), "{joint}: {}", largest(dq));
        assert!(largest(ddq) <= 3.0, "{joint}: {}", largest(ddq));
        // From the parking pose, at rest, and back.
        for signal in [q, dq] {
            assert!(signal[0].abs() < 1e-9 && signal.last().unwrap().abs() < 2e-3, "{joint}");
        }
        // Velocity is the derivative of position: central differences err by h² times the third derivative over six.
        let error = (1..q.len() - 1).map(|s| ((q[s + 1] - q[s - 1]) / 0.04 - dq[s]).abs());
        assert!(error.fold(0.0, f64::max) < 3e-3, "{joint}");
    }
    let phases = &csv["phase"];
    assert_eq!((phases[0], *phases.last().unwrap()), (0.0, 2.0));
    assert!(phases.windows(2).all(|w| w[0] <= w[1]));
    assert!((phases.iter().filter(|p| **p == 1.0).count() as f64 - 1000.0).abs() <= 1.0);

    let args = ["regressor", "indy7.toml", "--states", "out/trajectory.csv", "--json"];
    let effort = json(run(folder, &args, 0).stdout)["effort"].clone();
    assert_eq!(effort.as_array().unwrap().len(), time.len());
    // Friction is not in it: the rigid part alone is below the limits, too.
    for row in effort.as_array().unwrap() {
        for (x, limit) in row.as_array().unwrap().iter().zip([431.97, 431.97, 197.23, 79.79, 79.79, 79.79]) {
            assert!(x.as_f64().unwrap().abs() < limit, "{row}");
        }
    }
}

#[test]
fn the_messages_for_ros_hold_the_same_motion() {
    let folder = designed().0.path();
    let csv = columns(&read(folder, "out/trajectory.csv"));
    let ros = json(read(folder, "out/trajectory.ros2.json"));
    assert_eq!(ros["joint_names"], json!(JOINTS));
    let points = ros["points"].as_array().unwrap();
    assert_eq!(points.len(), csv["t"].len());
    let point = &points[500];
    let seconds = point["time_from_start"]["sec"].as_f64().unwrap()
        + 1e-9 * point["time_from_start"]["nanosec"].as_f64().unwrap();
    assert!((seconds - csv["t"][500]).abs() < 1e-9);
    for (k, joint) in JOINTS.iter().enumerate() {
        for (key, signal) in [("positions", "q"), ("velocities", "dq"), ("accelerations", "ddq")] {
            assert_eq!(point[key][k].as_f64().unwrap(), csv[&format!("{signal}_{joint}")][500], "{key}");
        }
    }
    assert!(read(folder, "out/trajectory.ros2.yaml").contains("joint_names: [\"j1\", \"j2\""));
}

#[test]
fn a_virtual_robot_follows_the_trajectory_file() {
    let folder = designed().0.path();
    let args = ["simulate", "indy7.toml", "--follow", "out/trajectory.json", "--rate-hz", "50"];
    let files = ["--out", "log.csv", "--clean", "clean.csv"];
    run(folder, &[&args[..], &files].concat(), 0);
    let wanted = columns(&read(folder, "out/trajectory.csv"));
    let clean = columns(&read(folder, "clean.csv"));
    assert_eq!(clean["t"].len(), wanted["t"].len());
    for joint in JOINTS {
        for signal in ["q", "dq", "ddq"] {
            let name = format!("{signal}_{joint}");
            let error = clean[&name].iter().zip(&wanted[&name]).map(|(a, b)| (a - b).abs());
            assert!(error.fold(0.0, f64::max) < 1e-9, "{name}");
        }
    }
    let args = ["simulate", "indy7.toml", "--follow", "out/trajectory.json", "--closed-loop"];
    let files = ["--out", "loop.csv", "--clean", "driven.csv"];
    run(folder, &[&args[..], &files].concat(), 0);
    // The controlled robot is near the wanted pose in the middle of the record, not on it.
    let driven = columns(&read(folder, "driven.csv"));
    let nearest = |time: &[f64], at: f64| {
        (0..time.len()).min_by(|a, b| (time[*a] - at).abs().total_cmp(&(time[*b] - at).abs())).unwrap()
    };
    let (a, b) = (nearest(&driven["t"], 10.0), nearest(&wanted["t"], 10.0));
    for joint in JOINTS {
        let difference = driven[&format!("q_{joint}")][a] - wanted[&format!("q_{joint}")][b];
        assert!(difference != 0.0 && difference.abs() < 0.1, "{joint}: {difference}");
    }
}

#[test]
fn json_goes_to_stdout_alone_and_is_what_the_file_holds() {
    let folder = folder(&[("arm.urdf", TWO_LINKS)]);
    let args = ["design", "arm.urdf", "--starts", "1", "--rate-hz", "50", "--json", "--quiet"];
    let output = run(folder.path(), &args, 0);
    assert!(output.stderr.is_empty(), "{}", stderr(&output));
    assert_eq!(output.stdout, read(folder.path(), "dynid-design/design.json").into_bytes());
}

#[test]
fn runs_give_the_same_bytes_whatever_the_number_of_threads() {
    let reference = designed().0.path();
    for threads in ["1", "2"] {
        let folder = folder(&[]);
        let args = [&QUICK[..], &["--acceleration", "3", "--park", "--out", "out"]].concat();
        let output =
            dynid().current_dir(folder.path()).env("RAYON_NUM_THREADS", threads).args(args).output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        for file in FILES.map(|f| format!("out/{f}")) {
            assert!(
                read(folder.path(), &file) == read(reference, &file),
                "{file} differs for {threads} threads"
            );
        }
    }
}

/// The configuration that comes with the program, beside a copy of its robot.
fn example() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7");
    for file in ["design.toml", "robot.toml"] {
        std::fs::copy(examples.join(file), folder.path().join(file)).unwrap();
    }
    folder
}

#[test]
fn the_example_stays_above_the_table_and_outside_the_column() {
    let folder = example();
    let args = ["design", "design.toml", "--out", "out", "--starts", "2", "--json"];
    let d = json(run(folder.path(), &args, 0).stdout);
    assert_eq!(d["verdict"]["status"], "pass", "{}", d["verdict"]);
    assert_eq!(d["noise"], json!([0.6, 0.8, 0.4, 0.2, 0.2, 0.2]));
    let limits = d["limits"].as_array().unwrap();
    let of = |kind: &str| -> Vec<&str> {
        let mut subjects: Vec<&str> =
            limits.iter().filter(|l| l["kind"] == kind).map(|l| l["subject"].as_str().unwrap()).collect();
        subjects.sort_unstable();
        subjects
    };
    assert_eq!(of("distance from a plane"), ["link4", "link5", "link6"]);
    assert_eq!(of("distance from the column"), ["link4", "link5", "link6"]);
    assert_eq!(of("effort"), JOINTS);
    assert!(limits.iter().all(|l| l["excess"].as_f64().unwrap() <= 0.0));
    // Origins of the frames by their kinematics, joints turned about z behind (a, alpha, d).
    let csv = columns(&read(folder.path(), "out/trajectory.csv"));
    let positions = JOINTS.map(|joint| &csv[&format!("q_{joint}")]);
    for sample in 0..positions[0].len() {
        let q = positions.map(|q| q[sample]);
        for [x, y, z] in &frame_origins(&q)[3..] {
            assert!(*z >= 0.14 - 1e-9, "sample {sample}: {z}");
            assert!(x.hypot(*y) >= 0.17 - 1e-9 || *z >= 0.35 - 1e-9, "sample {sample}: {x} {y} {z}");
        }
    }
}

/// Origins of the six frames of the Indy7: modified DH (Craig 1986), rows of robots/indy7.toml.
fn frame_origins(q: &[f64; 6]) -> Vec<[f64; 3]> {
    let right = std::f64::consts::FRAC_PI_2;
    let rows: [(f64, f64, f64, f64); 6] = [
        (0.0, 0.0, 0.3, 0.0),
        (0.0, right, 0.0, right),
        (0.45, 0.0, 0.0035, right),
        (0.0, right, 0.35, 2.0 * right),
        (0.0, right, 0.1835, 0.0),
        (0.0, -right, 0.228, 0.0),
    ];
    let mut rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut origin = [0.0; 3];
    let mut out = Vec::new();
    for ((a, alpha, d, offset), q) in rows.into_iter().zip(q) {
        let (sa, ca) = alpha.sin_cos();
        let (st, ct) = (q + offset).sin_cos();
        let step = [a, -sa * d, ca * d];
        let turn = [[ct, -st, 0.0], [st * ca, ct * ca, -sa], [st * sa, ct * sa, ca]];
        for (i, x) in origin.iter_mut().enumerate() {
            *x += (0..3).map(|k| rotation[i][k] * step[k]).sum::<f64>();
        }
        let before = rotation;
        for i in 0..3 {
            for j in 0..3 {
                rotation[i][j] = (0..3).map(|k| before[i][k] * turn[k][j]).sum();
            }
        }
        out.push(origin);
    }
    out
}

/// A configuration with every section.
const FULL: &str = r#"robot = "indy7.toml"
out = "out"
earlier = ["earlier.json"]
[trajectory]
period_s = 10
harmonics = 4
rest = false
sample_rate_hz = 50
[limits]
acceleration = 4
jerk = { j1 = 30 }
share = 0.9
position = { j1 = [-1.0, 2.0] }
[[keep]]
frames = ["link6"]
point = [0, 0, 0.1]
above = 0.1
inside = { lower = [-1, -1, -1], upper = [1.0, 0.9, 1.2] }
[[capsule]]
frame = "base"
from = [0, 0, 0]
to = [0, 0, 0.3]
radius = 0.1
[[capsule]]
frame = "link6"
from = [0, 0, 0]
to = [0, 0, 0.1]
radius = 0.06
[criterion]
name = "a"
columns = "inertial"
noise = 0.5
[search]
starts = 2
seed = 5
checkpoint = "starts.json"
"#;

/// A folder with [`FULL`] and what it names.
fn full(text: &str) -> TempDir {
    let folder = folder(&[("design.toml", text)]);
    let earlier = designed().0.path().join("out/trajectory.json");
    std::fs::copy(earlier, folder.path().join("earlier.json")).unwrap();
    folder
}

#[test]
fn every_section_of_a_configuration_counts() {
    let folder = full(FULL);
    let args = ["design", "design.toml", "--json", "--quiet"];
    let d = json(run(folder.path(), &args, 0).stdout);
    assert_eq!(d["criterion"]["name"], "a");
    // Forty base parameters of the bodies with rotors, 36 without.
    assert_eq!(d["parameters"].as_array().unwrap().len(), 36);
    assert_eq!(d["noise"], json!([0.5, 0.5, 0.5, 0.5, 0.5, 0.5]));
    let limits = d["limits"].as_array().unwrap();
    for kind in ["jerk", "distance from a plane", "box", "distance of bodies", "effort"] {
        assert!(limits.iter().any(|l| l["kind"] == kind), "{kind}: {limits:?}");
    }
    let csv = columns(&read(folder.path(), "out/trajectory.csv"));
    assert!(csv["q_j1"].iter().all(|q| (-1.0..=2.0).contains(q)));
    for (k, joint) in JOINTS.iter().enumerate() {
        assert!(largest(&csv[&format!("dq_{joint}")]) <= 0.9 * SPEED[k].to_radians(), "{joint}");
        assert!(largest(&csv[&format!("ddq_{joint}")]) <= 4.0, "{joint}");
    }
    let inputs = d["provenance"]["inputs"].as_array().unwrap();
    let kinds: Vec<&str> = inputs.iter().map(|i| i["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["robot", "trajectory"]);
    // What is known already makes every parameter better known.
    let alone = full(&FULL.replace("earlier = [\"earlier.json\"]", ""));
    let a = json(run(alone.path(), &args, 0).stdout);
    assert!(d["criterion"]["value"].as_f64().unwrap() < 0.8 * a["criterion"]["value"].as_f64().unwrap());
}

#[test]
fn a_checkpoint_takes_up_finished_starts_and_is_refused_for_another_problem() {
    let folder = full(FULL);
    let at = |args: &[&str], code: i32| run(folder.path(), args, code);
    at(&["design", "design.toml", "--starts", "1"], 0);
    let first = json(read(folder.path(), "starts.json"));
    assert_eq!(first["schema"], "dynid-design-checkpoint/2");
    assert_eq!(first["starts"].as_array().unwrap().len(), 1);
    at(&["design", "design.toml"], 0);
    let both = json(read(folder.path(), "starts.json"));
    assert_eq!(both["starts"][0], first["starts"][0]);
    assert_eq!(both["starts"].as_array().unwrap().len(), 2);
    let straight = full(FULL);
    run(straight.path(), &["design", "design.toml"], 0);
    for file in FILES.map(|f| format!("out/{f}")) {
        assert!(read(folder.path(), &file) == read(straight.path(), &file), "{file}");
    }
    // Starts that are there are not run again: a mark on one survives and comes out.
    let mut marked = both.clone();
    marked["starts"][1]["evaluations"] = json!(123_456);
    std::fs::write(folder.path().join("starts.json"), marked.to_string()).unwrap();
    // Its checksum tells that it is not what was written; with a new one it is taken.
    assert!(stderr(&at(&["design", "design.toml"], 2)).contains("damaged"));
    marked.as_object_mut().unwrap().remove("sha256");
    let members = marked.to_string()[1..].to_owned();
    std::fs::write(folder.path().join("members"), &members).unwrap();
    let digest = dynid::logs::sha256(&folder.path().join("members")).unwrap();
    let sealed = format!("{{\"sha256\":\"{digest}\",{members}");
    std::fs::write(folder.path().join("starts.json"), sealed).unwrap();
    at(&["design", "design.toml"], 0);
    let d = json(read(folder.path(), "out/design.json"));
    assert_eq!(d["starts"][1]["evaluations"], 123_456);

    let kept = read(folder.path(), "starts.json");
    for other in [&["--acceleration", "3"], &["--noise", "0.4"], &["--criterion", "d"]] {
        let args = [&["design", "design.toml", "--out", "other"], &other[..]].concat();
        let said = stderr(&at(&args, 2));
        assert!(
            said.contains("starts.json") && said.contains("settings") && said.contains("hint: "),
            "{said}"
        );
    }
    assert_eq!(read(folder.path(), "starts.json"), kept);
    assert!(!folder.path().join("other").exists());
}

/// The list of keys in the book's page on the design file, those in comments included, as far as it suits the Indy7.
fn keys_of_the_book() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/src/files/design.md");
    let page = std::fs::read_to_string(path).unwrap();
    let list = page.split("```toml design\n").nth(1).unwrap().split("```").next().unwrap();
    let key =
        |line: &str| line.starts_with("[[") || line.split_once(" = ").is_some_and(|(k, _)| !k.contains(' '));
    let stated = list.lines().map(|line| line.strip_prefix("# ").filter(|rest| key(rest)).unwrap_or(line));
    // A start pose names all joints, files have to be there, and one capsule alone is none.
    let unfit = ["start_pose", "earlier", "j6 = 0.0", "package_dirs"];
    let lines: Vec<&str> = stated.filter(|line| !unfit.iter().any(|key| line.starts_with(key))).collect();
    let text = lines.join("\n").replace("\"tool\"", "\"link6\"").replace("robot.urdf", "indy7.toml");
    text + "\n[[capsule]]\nframe = \"base\"\nfrom = [0, 0, 0]\nto = [0, 0, 0.2]\nradius = 0.1\n"
}

#[test]
fn every_key_of_the_book_is_known_to_the_program() {
    let text = keys_of_the_book();
    for key in ["parking", "half_space", "outside_column", "radius", "mix", "checkpoint", "jerk", "gravity"] {
        assert!(text.lines().any(|line| line.starts_with(&format!("{key} = "))), "{key}: {text}");
    }
    let folder = folder(&[("design.toml", &text)]);
    let args = ["design", "design.toml", "--starts", "1", "--rate-hz", "50"];
    let output = dynid().current_dir(folder.path()).args(args).output().unwrap();
    // Limits picked as examples may contradict each other.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", stderr(&output));
    assert!(folder.path().join("dynid-design/design.json").is_file());
}

/// A design that ends with exit code 1, and its `design.json`.
fn infeasible(config: &str) -> (String, Value) {
    let folder = folder(&[("design.toml", &format!("robot = \"indy7.toml\"\nout = \"out\"\n{config}"))]);
    let output = run(folder.path(), &["design", "design.toml", "--starts", "2", "--rate-hz", "50", "-q"], 1);
    assert_eq!(listing(&folder.path().join("out")), ["design.json", "report.html"]);
    assert!(output.stderr.is_empty(), "{}", stderr(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.lines().last().unwrap().starts_with("fail: "), "{said}");
    let d = json(read(folder.path(), "out/design.json"));
    assert_eq!(d["verdict"]["status"], "fail");
    assert!(said.contains(d["verdict"]["headline"].as_str().unwrap()));
    assert!(d["criterion"]["value"].is_null() && d["random"].is_null());
    assert_eq!(d["parameters"], json!([]));
    (said, d)
}

#[test]
fn a_start_pose_under_a_plane_is_named() {
    // Straight up the tool is 1.2 m high.
    let (said, d) = infeasible(
        "[trajectory]\nstart_pose = { j1 = 0, j2 = 0, j3 = 0, j4 = 0, j5 = 0, j6 = 0 }\n\
         [[keep]]\nframes = [\"link6\"]\nhalf_space = { normal = [0, 0, -1], offset = -0.5 }\n",
    );
    assert!(said.contains("start pose") && said.contains("plane of link6"), "{said}");
    assert_eq!(d["infeasible"]["at_start"], true);
    assert_eq!(d["infeasible"]["violations"][0]["kind"], "distance from a plane");
    assert_eq!(d["infeasible"]["violations"][0]["subject"], "link6");
    assert_eq!(d["infeasible"]["violations"][0]["time_s"], 0.0);
}

#[test]
fn an_effort_limit_that_does_not_hold_the_start_pose_is_named() {
    // Two per cent of the limit of j2, the arm stretched out to the side.
    let (said, d) = infeasible(
        "[trajectory]\nstart_pose = { j1 = 0, j2 = 1.5707963, j3 = 0, j4 = 0, j5 = 0, j6 = 0 }\n\
         [limits]\neffort = { j2 = 8.64 }\n",
    );
    assert!(said.contains("effort of j2"), "{said}");
    assert_eq!(d["infeasible"]["violations"][0]["kind"], "effort");
    assert_eq!(d["infeasible"]["violations"][0]["subject"], "j2");
}

#[test]
fn limits_that_no_motion_keeps_are_named_with_the_one_in_the_way() {
    // The tool above its own reach.
    let (said, d) = infeasible("[[keep]]\nframes = [\"link6\"]\nabove = 2.0\n");
    assert!(said.contains("no motion keeps all limits") && said.contains("plane of link6"), "{said}");
    assert_eq!(d["infeasible"]["at_start"], false);
    assert_eq!(d["infeasible"]["blamed"], "distance from a plane of link6");
}

#[test]
fn starts_that_fail_with_no_limit_in_the_way_blame_none() {
    // Noise that drowns everything.
    let (said, d) = infeasible("[criterion]\nnoise = 1e300\n");
    assert!(said.contains("no start ended") && said.contains("more starts"), "{said}");
    assert_eq!(d["infeasible"]["violations"], json!([]));
    assert!(d["infeasible"]["blamed"].is_null());
}

#[test]
fn a_robot_without_inertias_gets_a_trajectory_all_the_same() {
    let folder = folder(&[]);
    let text: Vec<String> = indy7().lines().filter(|l| !l.starts_with("phi = ")).map(str::to_owned).collect();
    std::fs::write(folder.path().join("bare.toml"), text.join("\n")).unwrap();
    let args = ["design", "bare.toml", "--starts", "1", "--rate-hz", "50", "--json"];
    let output = run(folder.path(), &args, 0);
    assert!(stderr(&output).contains("states no inertias"), "{}", stderr(&output));
    let d = json(&output.stdout);
    assert_eq!(d["criterion"]["name"], "unit-condition");
    let [value, condition] =
        [&d["criterion"]["value"], &d["condition_number_scaled"]].map(|x| x.as_f64().unwrap());
    // The one has been through a logarithm.
    assert!((value - condition).abs() < 1e-12 * condition, "{value} {condition}");
    assert!(d["parameters"].as_array().unwrap().iter().all(|p| p["rel_std"].is_null()));
    assert!(d["limits"].as_array().unwrap().iter().all(|l| l["kind"] != "effort"));
}
