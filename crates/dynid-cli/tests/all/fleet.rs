//! `dynid simulate --fleet`, `dynid reduce --manifest`, `dynid fleet`: from virtual robots to what has changed in them, however the work was cut.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, dynid, run};
use serde_json::Value;
use tempfile::TempDir;

const SETTINGS: &str =
    "duration_s = 8\nrate_hz = 100\n[fleet]\nrobots = 12\nlogs = 12\nfaults = 1\nwear = 1\noutliers = 1\n";

/// A fleet with its recipe and factors.
pub(crate) fn prepared() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
        std::fs::write(at.join("fleet.toml"), SETTINGS).unwrap();
        run(
            at,
            &["simulate", "arm.urdf", "--config", "fleet.toml", "--seed", "5", "--out", "made", "--quiet"],
            0,
        );
        let logs = ["--log", "made/logs/r001-001.csv.gz", "--log", "made/logs/r004-001.csv.gz"];
        run(at, &[&["reduce", "arm.urdf", "--out", "type.factors", "--quiet"], &logs[..]].concat(), 0);
        run(
            at,
            &["reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors", "--quiet"],
            0,
        );
        run(at, &["fleet", "factors", "--out", "whole", "--quiet"], 0);
        folder
    };
    FOLDER.get_or_init(make).path()
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// What a fleet says, without the command line.
fn result(folder: &str) -> Value {
    let mut value = read(&prepared().join(folder).join("fleet.json"));
    value["provenance"]["command_line"] = Value::Null;
    value
}

#[test]
fn what_was_put_in_is_found() {
    let found = result("whole");
    let truth = read(&prepared().join("made/truth.json"));
    let robots = found["robots"].as_array().unwrap();
    for change in truth["changes"].as_array().unwrap() {
        let robot = robots.iter().find(|r| r["name"] == change["robot"]).unwrap();
        let told = &robot["changes"][0];
        assert_eq!(told["parameter"], change["parameter"], "{robot}");
        let (size, sd) = (told["size"].as_f64().unwrap(), told["sd"].as_f64().unwrap());
        assert!((size - change["size"].as_f64().unwrap()).abs() < 4.0 * sd, "{told} {change}");
        assert_eq!(robot["state"], "changed");
    }
    for outlier in truth["outliers"].as_array().unwrap() {
        let robot = robots.iter().find(|r| r["name"] == *outlier).unwrap();
        assert!(!robot["stands_out"].as_array().unwrap().is_empty(), "{robot}");
    }
    // Parameters that all share come out of 144 logs near the truth.
    let kept = ["forearm.Iyy", "forearm.mz"];
    for parameter in found["parameters"].as_array().unwrap() {
        let name = parameter["name"].as_str().unwrap();
        let shared = name.contains("arm.") || name.ends_with(".Ia");
        assert_eq!(parameter["between_robots"].is_null(), shared, "{name}");
        assert_eq!(parameter["seen"], true, "{name}");
    }
    assert!(
        kept.iter().all(|name| found["parameters"].as_array().unwrap().iter().any(|p| p["name"] == *name))
    );
    let page = std::fs::read_to_string(prepared().join("whole/report.html")).unwrap();
    assert!(page.contains("Changes with time") && page.contains("12 robots"));
    let changed = truth["changes"][0]["robot"].as_str().unwrap();
    assert!(prepared().join(format!("whole/robots/{changed}.html")).is_file());
}

fn parameters(estimate: &Value) -> impl Iterator<Item = (&str, &Value)> {
    estimate["parameters"].as_array().unwrap().iter().map(|p| (p["name"].as_str().unwrap(), p))
}

/// The type has the bodies that made the logs, and its files go where those of an identification go.
#[test]
fn the_model_of_the_type_is_exported() {
    let at = prepared();
    let of_type = read(&at.join("whole/type.json"));
    let (base, fleet) = (of_type["base_parameters"].as_array().unwrap(), result("whole"));
    for (own, known) in base.iter().zip(fleet["parameters"].as_array().unwrap()) {
        assert_eq!((&own["name"], &own["std"]), (&known["name"], &known["sd"]), "one number in both files");
        let (a, b) = (own["value"].as_f64().unwrap(), known["value"].as_f64().unwrap());
        assert!((a - b).abs() < 0.05 * known["sd"].as_f64().unwrap(), "{own} {known}");
    }
    assert_eq!(of_type["precision"]["basis"], "robots");
    assert_eq!(of_type["precision"]["blocks"], 12);
    assert_eq!(of_type["feasible"], true);
    run(at, &["export", "whole/type.json", "--urdf", "type.urdf", "--mjcf", "type.xml", "--quiet"], 0);
    run(at, &["validate", "whole/type.json", "--log", "made/logs/r002-003.csv.gz", "--quiet"], 0);
    let page = std::fs::read_to_string(at.join("whole/type.html")).unwrap();
    assert!(page.contains("leaving out one robot at a time") && page.contains("144 logs of 12 robots"));
}

/// A recipe that was learned with a wrong robot file: the type has the bodies of the robots that made the logs.
#[test]
fn bodies_of_the_type_come_from_the_logs() {
    let at = prepared();
    let wrong = TWO_LINKS.replace("<mass value=\"1.5\"/>", "<mass value=\"2.1\"/>");
    assert_ne!(wrong, TWO_LINKS);
    std::fs::write(at.join("wrong.urdf"), wrong).unwrap();
    let logs = ["--log", "made/logs/r001-001.csv.gz", "--log", "made/logs/r004-001.csv.gz"];
    run(at, &[&["reduce", "wrong.urdf", "--out", "wrong.factors", "--quiet"], &logs[..]].concat(), 0);
    run(at, &["reduce", "wrong.factors", "--manifest", "made/manifest.csv", "--out", "bent", "--quiet"], 0);
    run(at, &["fleet", "bent", "--out", "mended", "--quiet"], 0);
    // The robot file that made the logs is what the other fleet knew beforehand.
    let (found, truth) = (read(&at.join("mended/type.json")), read(&at.join("whole/type.json")));
    let (mut seen, mut moved) = (0, 0);
    for ((name, own), (_, true_one)) in parameters(&found).zip(parameters(&truth)) {
        let Some(interval) = own["interval"].as_array().filter(|_| own["link"].is_string()) else { continue };
        let (low, high) = (interval[0].as_f64().unwrap(), interval[1].as_f64().unwrap());
        let (expected, wrong) = (true_one["prior"].as_f64().unwrap(), own["prior"].as_f64().unwrap());
        let margin = high - low;
        assert!((low - margin..high + margin).contains(&expected), "{name}: {expected} in {low} to {high}");
        seen += 1;
        moved += usize::from(!(low..high).contains(&wrong));
    }
    assert!(seen >= 3 && moved >= 1, "{seen} {moved}");
}

/// A robot has the bodies of its type and friction of its own; one that has changed is what it is now.
#[test]
fn models_of_robots_are_those_of_today() {
    let at = prepared();
    let (of_type, truth) = (read(&at.join("whole/type.json")), read(&at.join("made/truth.json")));
    let logs = truth["logs"].as_array().unwrap();
    for change in truth["changes"].as_array().unwrap() {
        let name = change["robot"].as_str().unwrap();
        let robot = read(&at.join(format!("whole/robots/{name}.json")));
        for ((parameter, own), (_, shared)) in parameters(&robot).zip(parameters(&of_type)) {
            let (a, b) = (own["value"].as_f64().unwrap(), shared["value"].as_f64().unwrap());
            if own["link"].is_string() || parameter.ends_with(".Ia") {
                assert!((a - b).abs() <= 5e-3 * b.abs() + 1e-4, "{name} {parameter}: {a} {b}");
            }
        }
        let parameter = change["parameter"].as_str().unwrap();
        let (_, now) = parameters(&robot).find(|(p, _)| *p == parameter).unwrap();
        let of_robot = || logs.iter().filter(|l| l["robot"] == name);
        let start = |l: &Value| l["start_s"].as_f64().unwrap();
        let last = of_robot().max_by(|a, b| start(a).total_cmp(&start(b))).unwrap();
        // Scatter between logs is beside it: less than a tenth of the parameter.
        let (found, of_last) =
            (now["value"].as_f64().unwrap(), last["parameters"][parameter].as_f64().unwrap());
        let first = of_robot().min_by(|a, b| start(a).total_cmp(&start(b))).unwrap();
        let before = first["parameters"][parameter].as_f64().unwrap();
        assert!((found - of_last).abs() < 0.5 * (before - of_last).abs(), "{found} {of_last} {before}");
        let told = robot["verdict"]["cautions"].to_string();
        assert!(told.contains("has changed by") && told.contains("at the last log"), "{told}");
        let known = result("whole");
        let record = known["robots"].as_array().unwrap().iter().find(|r| r["name"] == name).unwrap();
        let in_fleet = record["parameters"].as_array().unwrap().iter().find(|p| p["name"] == parameter);
        let value = in_fleet.unwrap()["value"].as_f64().unwrap();
        assert!((value - found).abs() < 0.3 * now["std"].as_f64().unwrap(), "{value} {found}");
        assert_eq!(robot["precision"]["basis"], "fleet");
        run(at, &["export", &format!("whole/robots/{name}.json"), "--model", "robot.json", "--quiet"], 0);
    }
}

/// An effort that is noise tells nothing of its joint: the fleet says so, and its models do not count it.
#[test]
fn an_effort_that_is_noise_is_said_to_be() {
    let at = prepared();
    std::fs::create_dir_all(at.join("noise")).unwrap();
    let config = "robot = \"arm.urdf\"\npreflight = \"off\"\n[[log]]\npath = \"made/logs/r001-001.csv.gz\"\n";
    std::fs::write(at.join("unexamined.toml"), config).unwrap();
    run(at, &["reduce", "unexamined.toml", "--out", "unexamined.factors", "--quiet"], 0);
    let (mut manifest, mut state) = ("log,robot\n".to_owned(), 1_u64);
    for (robot, log) in (1..=4).flat_map(|robot| (1..=3).map(move |log| (robot, log))) {
        let name = format!("noise/r{robot:03}-{log:03}.csv");
        run(at, &["convert", &format!("made/logs/r{robot:03}-{log:03}.csv.gz"), &name, "--quiet"], 0);
        let text = std::fs::read_to_string(at.join(&name)).unwrap();
        let mut lines = text.lines();
        let head = lines.next().unwrap();
        let column = head.split(',').position(|name| name == "tau_elbow").unwrap();
        let mut noisy = format!("{head}\n");
        for line in lines {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = format!("{}", (state >> 40) as f64 / (1_u64 << 24) as f64 - 0.5);
            let mut cells: Vec<&str> = line.split(',').collect();
            cells[column] = &noise;
            noisy += &format!("{}\n", cells.join(","));
        }
        std::fs::write(at.join(&name), noisy).unwrap();
        manifest += &format!("{name},r{robot:03}\n");
    }
    std::fs::write(at.join("noise.csv"), manifest).unwrap();
    run(
        at,
        &["reduce", "unexamined.factors", "--manifest", "noise.csv", "--out", "noise.folder", "--quiet"],
        0,
    );
    run(at, &["fleet", "noise.folder", "--all-robots", "--out", "of-noise", "--quiet"], 0);
    let found = result("of-noise");
    assert_eq!(found["status"], "warn");
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("the effort of elbow is mostly something else"), "{warnings}");
    assert!(!warnings.contains("the effort of shoulder"), "{warnings}");
    for file in ["type.json", "robots/r002.json"] {
        let estimate = read(&at.join("of-noise").join(file));
        assert_eq!(estimate["verdict"]["status"], "fail", "{file}");
        let (_, friction) = parameters(&estimate).find(|(name, _)| *name == "elbow.fc").unwrap();
        assert_eq!(friction["verdict"], "carried by the prior", "{file}");
    }
}

/// A delay that grows in one robot is found where factors have columns for it, and friction is not blamed for it.
#[test]
fn delays_that_change_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
    let settings = "duration_s = 8\nrate_hz = 100\n[fleet]\nrobots = 12\nlogs = 12\nwear = 1\ndelays = 4\n";
    std::fs::write(at.join("fleet.toml"), settings).unwrap();
    run(
        at,
        &["simulate", "arm.urdf", "--config", "fleet.toml", "--seed", "9", "--out", "made", "--quiet"],
        0,
    );
    let logs = ["--log", "made/logs/r001-001.csv.gz", "--log", "made/logs/r004-001.csv.gz"];
    let learn = ["reduce", "arm.urdf", "--delays", "--out", "type.factors", "--quiet"];
    run(at, &[&learn[..], &logs[..]].concat(), 0);
    run(at, &["reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors", "--quiet"], 0);
    run(at, &["fleet", "factors", "--out", "whole", "--quiet"], 0);
    let (found, truth) = (read(&at.join("whole/fleet.json")), read(&at.join("made/truth.json")));
    let robots = found["robots"].as_array().unwrap();
    let mut told = 0;
    for change in truth["changes"].as_array().unwrap() {
        let robot = robots.iter().find(|r| r["name"] == change["robot"]).unwrap();
        let put_in = change["size"].as_f64().unwrap();
        let own = robot["parameters"].as_array().unwrap().iter().find(|p| p["name"] == change["parameter"]);
        // What is too small for the logs is said to be.
        if own.unwrap()["detectable"].as_f64().unwrap() > put_in.abs() {
            continue;
        }
        let found = &robot["changes"][0];
        assert_eq!(found["parameter"], change["parameter"], "{robot}");
        let (size, sd) = (found["size"].as_f64().unwrap(), found["sd"].as_f64().unwrap());
        assert!((size - put_in).abs() < 4.0 * sd, "{found} {change}");
        told += usize::from(change["parameter"].as_str().unwrap().ends_with(".delay"));
    }
    assert!(told > 0, "{}", truth["changes"]);
    for robot in robots.iter().filter(|r| r["changes"] != Value::Array(Vec::new())) {
        let put_in = truth["changes"].as_array().unwrap().iter().any(|c| c["robot"] == robot["name"]);
        assert!(put_in, "{robot}");
    }
    // A delay is no parameter of a robot file.
    let of_type = read(&at.join("whole/type.json"));
    assert!(parameters(&of_type).all(|(name, _)| !name.ends_with(".delay")));
    assert!(found["parameters"].to_string().contains("shoulder.delay"));
    run(at, &["export", "whole/type.json", "--urdf", "type.urdf", "--quiet"], 0);
    run(at, &["solve", "type.factors", "--out", "solved", "--quiet"], 0);
    let refused =
        ["reduce", "type.factors", "--delays", "--log", "made/logs/r001-001.csv.gz", "--out", "x.factors"];
    let output = run(at, &refused, 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("learn it with `--delays`"));
}

/// Encoders on both sides of gears tell which spring has softened and which gear has play, when, and by how much.
#[test]
fn springs_that_soften_and_gears_that_wear_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let arm = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bench/fleets/elastic-arm.toml");
    std::fs::copy(arm, at.join("arm.toml")).unwrap();
    let settings = "duration_s = 8\nrate_hz = 100\n[fleet]\nrobots = 12\nlogs = 12\nstiffness = 2\nbacklash = 2\n\
                    between_robots = { fc = 0.2, fv = 0.25, k1 = 0.05 }\nbetween_logs = { fc = 0.04, fv = 0.06, k1 = 0.005 }\n";
    std::fs::write(at.join("fleet.toml"), settings).unwrap();
    run(
        at,
        &["simulate", "arm.toml", "--config", "fleet.toml", "--seed", "5", "--out", "made", "--quiet"],
        0,
    );
    let logs = ["--log", "made/logs/r001-001.csv.gz", "--log", "made/logs/r002-001.csv.gz"];
    run(at, &[&["reduce", "arm.toml", "--out", "type.factors", "--quiet"], &logs[..]].concat(), 0);
    run(at, &["reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors", "--quiet"], 0);
    run(at, &["fleet", "factors", "--out", "whole", "--quiet"], 0);
    let (found, truth) = (read(&at.join("whole/fleet.json")), read(&at.join("made/truth.json")));
    let robots = found["robots"].as_array().unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let mut told = [0, 0];
    for change in truth["changes"].as_array().unwrap() {
        let (name, put_in) = (change["parameter"].as_str().unwrap(), number(&change["size"]));
        let (joint, symbol) = name.rsplit_once('.').unwrap();
        let robot = robots.iter().find(|r| r["name"] == change["robot"]).unwrap();
        let is_stiffness = symbol == "k1";
        let parameter = if is_stiffness { format!("{joint}.compliance") } else { name.to_owned() };
        let of_robot = |log: &&Value| log["robot"] == change["robot"];
        let own = truth["logs"].as_array().unwrap().iter().filter(of_robot);
        let last = own.max_by(|a, b| number(&a["start_s"]).total_cmp(&number(&b["start_s"]))).unwrap();
        let expected = match is_stiffness {
            true => {
                let after = number(&last["parameters"][name]);
                1.0 / after - 1.0 / (after - put_in)
            }
            false => number(&last["parameters"][name]),
        };
        let own = robot["parameters"].as_array().unwrap().iter().find(|p| p["name"] == parameter).unwrap();
        // A load that keeps its sign shows no play.
        if own["detectable"].as_f64().is_none_or(|least| least > expected.abs()) {
            continue;
        }
        let found =
            robot["changes"].as_array().unwrap().iter().find(|c| c["parameter"] == parameter).unwrap();
        // Friction behind the spring that no recipe knows makes play come out too small.
        let least = if is_stiffness { 0.95 } else { 0.8 };
        assert!((least..1.05).contains(&(number(&found["size"]) / expected)), "{found} {expected:e}");
        told[usize::from(is_stiffness)] += 1;
    }
    assert!(told[0] > 0 && told[1] == 2, "{told:?} {}", truth["changes"]);
    for robot in robots.iter().filter(|r| r["changes"] != Value::Array(Vec::new())) {
        let put_in = truth["changes"].as_array().unwrap().iter().any(|c| c["robot"] == robot["name"]);
        assert!(put_in, "{robot}");
    }
    // Models are those of stiff joints; robot files have no place for a compliance.
    let of_type = read(&at.join("whole/type.json"));
    assert!(parameters(&of_type).all(|(name, _)| !name.ends_with(".compliance") && !name.ends_with(".k1")));
    run(at, &["export", "whole/type.json", "--urdf", "type.urdf", "--quiet"], 0);
    // Delays and payloads go together with deformations.
    let own = ["reduce", "arm.toml", "--delays", "--payload", "link2", "--out", "own.factors", "--quiet"];
    run(at, &[&own[..], &logs[..]].concat(), 0);
    run(at, &["reduce", "own.factors", "--manifest", "made/manifest.csv", "--out", "own", "--quiet"], 0);
    run(at, &["fleet", "own", "--out", "own-fleet", "--quiet"], 0);
    assert_eq!(read(&at.join("own-fleet/fleet.json"))["payload"]["link"], "link2");
    // An encoder that stands is told; a log without its links is a failure by itself.
    let log = std::fs::read(at.join("made/logs/r003-001.csv.gz")).unwrap();
    let mut text = String::new();
    std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(&log[..]), &mut text).unwrap();
    let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let (head, first) = (rows.next().unwrap(), rows.next().unwrap());
    let dead = head.iter().position(|name| *name == "q_j2").unwrap();
    let mut stands = format!("{}\n{}\n", head.join(","), first.join(","));
    for mut row in rows {
        row[dead] = first[dead];
        stands += &(row.join(",") + "\n");
    }
    std::fs::write(at.join("stands.csv"), stands).unwrap();
    let output = run(at, &["reduce", "type.factors", "--log", "stands.csv", "--out", "x.factors"], 0);
    assert!(String::from_utf8_lossy(&output.stderr).contains("link of `j2` stands"), "{output:?}");
    std::fs::write(at.join("motors.csv"), text.replacen("q_j2", "unknown", 1)).unwrap();
    let output = run(at, &["reduce", "type.factors", "--log", "motors.csv", "--out", "y.factors"], 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("j2"), "{output:?}");
}

/// Logs in which a robot carries what nobody stated: what it was is told to its deviation, and friction that changes is found beside it; by a recipe
/// that knows of no payload it is not.
#[test]
fn what_logs_carry_is_told_and_hides_no_change() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.urdf"), TWO_LINKS).unwrap();
    let settings =
        "duration_s = 6\nrate_hz = 100\n[fleet]\nrobots = 10\nlogs = 12\nwear = 1\nfaults = 1\npayload = 1\n";
    std::fs::write(at.join("fleet.toml"), settings).unwrap();
    run(
        at,
        &["simulate", "arm.urdf", "--config", "fleet.toml", "--seed", "4", "--out", "made", "--quiet"],
        0,
    );
    let truth = read(&at.join("made/truth.json"));
    let carried = |log: &str| {
        let logs = truth["logs"].as_array().unwrap();
        let log = log.rsplit('/').next().unwrap();
        let found = logs.iter().find(|l| l["file"].as_str().unwrap().starts_with(log)).unwrap();
        found["payload"].as_f64().unwrap_or(0.0)
    };
    let logs = ["--log", "made/logs/r001-001.csv.gz", "--log", "made/logs/r001-002.csv.gz"];
    let fitted = |flags: &[&str], name: &str| {
        let recipe = format!("{name}.factors");
        run(at, &[&["reduce", "arm.urdf", "--out", &recipe, "--quiet"], flags, &logs[..]].concat(), 0);
        run(at, &["reduce", &recipe, "--manifest", "made/manifest.csv", "--out", name, "--quiet"], 0);
        let out = format!("{name}-fleet");
        run(at, &["fleet", name, "--out", &out, "--quiet"], 0);
        read(&at.join(out).join("fleet.json"))
    };
    let told = |fleet: &Value| {
        let robots = fleet["robots"].as_array().unwrap();
        let is_told = |change: &&Value| {
            let robot = robots.iter().find(|r| r["name"] == change["robot"]).unwrap();
            robot["changes"][0]["parameter"] == change["parameter"]
        };
        truth["changes"].as_array().unwrap().iter().filter(is_told).count()
    };
    let found = fitted(&["--payload", "forearm"], "with");
    assert_eq!(told(&found), 2, "{}", found["headline"]);
    assert_eq!(found["logs_to_look_at"], Value::Array(Vec::new()));
    let payload = &found["payload"];
    assert_eq!(
        (&payload["link"], &payload["parameters"][0]["name"]),
        (&"forearm".into(), &"forearm.m".into())
    );
    let of_logs = payload["logs"].as_array().unwrap();
    assert_eq!(of_logs.len(), 120);
    let mean = of_logs.iter().map(|l| carried(l["log"].as_str().unwrap())).sum::<f64>() / 120.0;
    let (mut held, mut squares) = (0, 0.0);
    for log in of_logs {
        let off = log["difference"][0].as_f64().unwrap() - (carried(log["log"].as_str().unwrap()) - mean);
        let sd = log["sd"][0].as_f64().unwrap();
        assert!(sd < 0.03, "{log}");
        held += usize::from(off.abs() < 1.96 * sd);
        squares += off * off / 120.0;
    }
    // Slow logs of six seconds smear the sign of the shoulder's friction beyond what their halves say.
    assert!(held >= 102 && squares < 0.02 * 0.02, "{held} of 120 intervals hold, {} kg", squares.sqrt());
    let of_type = read(&at.join("with-fleet/type.json"));
    let cautions = of_type["verdict"]["cautions"].as_array().unwrap();
    assert!(cautions.iter().any(|c| c["name"] == "payload of logs"), "{cautions:?}");
    assert!(
        std::fs::read_to_string(at.join("with-fleet/report.html")).unwrap().contains("Carried on forearm")
    );
    run(at, &["export", "with-fleet/type.json", "--mjcf", "type.xml", "--quiet"], 0);
    run(at, &["solve", "with.factors", "--out", "solved", "--quiet"], 0);
    let solved = read(&at.join("solved/estimate.json"));
    assert!(solved["verdict"]["cautions"].to_string().contains("taken for one"), "{}", solved["verdict"]);

    let without = fitted(&[], "without");
    assert_eq!(told(&without), 0, "{}", without["headline"]);
    assert!(without["warnings"].to_string().contains("--payload LINK"), "{}", without["warnings"]);

    let refused = |args: &[&str], part: &str| {
        let output = run(at, &[args, &logs[..], &["--out", "x.factors"]].concat(), 2);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(part), "{text}");
    };
    refused(&["reduce", "with.factors", "--payload", "forearm"], "learn it with `--payload`");
    refused(&["reduce", "arm.urdf", "--payload", "gripper"], "a moving link: `upper_arm`, `forearm`");
}

/// Who bears more false alarms is told of more robots.
#[test]
fn the_rate_of_false_discoveries_decides_who_is_named() {
    run(prepared(), &["fleet", "factors", "--false-discoveries", "0.9", "--out", "loose", "--quiet"], 0);
    let changed = |folder: &str| {
        let found = result(folder);
        found["robots"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|r| r["changes"] != Value::Array(Vec::new()))
            .count()
    };
    assert!(changed("loose") > changed("whole"));
}

#[test]
fn shards_orders_and_kills_change_nothing() {
    let at = prepared();
    let manifest = std::fs::read_to_string(at.join("made/manifest.csv")).unwrap();
    let (head, lines) = manifest.split_once('\n').unwrap();
    let backwards: Vec<&str> = lines.lines().rev().collect();
    std::fs::write(at.join("made/backwards.csv"), format!("{head}\n{}\n", backwards.join("\n"))).unwrap();
    // A process that is killed at any time leaves what it had finished, and nothing else that counts.
    for delay_ms in [30, 120, 300] {
        let mut child = std::process::Command::new(dynid().get_program())
            .current_dir(at)
            .args([
                "reduce",
                "type.factors",
                "--manifest",
                "made/backwards.csv",
                "--out",
                "shards",
                "--quiet",
            ])
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(delay_ms));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    for shard in ["3/3", "1/3", "2/3"] {
        let args = [
            "reduce",
            "type.factors",
            "--manifest",
            "made/backwards.csv",
            "--shard",
            shard,
            "--out",
            "shards",
            "--quiet",
        ];
        run(at, &args, 0);
    }
    let again = run(
        at,
        &[
            "reduce",
            "type.factors",
            "--manifest",
            "made/manifest.csv",
            "--out",
            "shards",
            "--json",
            "--quiet",
        ],
        0,
    );
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!((&again["known"], &again["reduced"]), (&144.into(), &0.into()));
    run(at, &["fleet", "shards", "--all-robots", "--out", "again", "--quiet"], 0);
    assert_eq!(result("again"), result("whole"));
    let files = std::fs::read_dir(at.join("again/robots")).unwrap().count();
    assert_eq!(files, 2 * 12, "a page and a model of every robot");
    let threads = dynid()
        .current_dir(at)
        .env("RAYON_NUM_THREADS", "1")
        .args(["fleet", "factors", "--out", "one", "--quiet"])
        .output()
        .unwrap();
    assert!(threads.status.success());
    assert_eq!(result("one"), result("whole"));
}

#[test]
fn broken_logs_are_named_and_change_nothing() {
    let at = prepared();
    std::fs::write(at.join("made/logs/empty.csv"), "").unwrap();
    let log = std::fs::read(at.join("made/logs/r001-001.csv.gz")).unwrap();
    std::fs::write(at.join("made/logs/cut.csv.gz"), &log[..log.len() / 2]).unwrap();
    std::fs::write(
        at.join("made/logs/short.csv"),
        "t,q_shoulder,q_elbow,tau_shoulder,tau_elbow\n0,0,0,0,0\n0.01,0,0,0,0\n",
    )
    .unwrap();
    let mut manifest = std::fs::read_to_string(at.join("made/manifest.csv")).unwrap();
    for file in ["empty.csv", "cut.csv.gz", "short.csv", "none.csv"] {
        manifest += &format!("logs/{file},r002,1780000000,20\n");
    }
    // The same log under another name counts once.
    std::fs::copy(at.join("made/logs/r003-002.csv.gz"), at.join("made/logs/copy.csv.gz")).unwrap();
    let line = manifest.lines().find(|line| line.contains("r003-002")).unwrap().replace("r003-002", "copy");
    manifest += &(line.clone() + "\n");
    std::fs::write(at.join("made/more.csv"), manifest).unwrap();
    let out = run(
        at,
        &["reduce", "type.factors", "--manifest", "made/more.csv", "--out", "broken", "--json", "--quiet"],
        0,
    );
    let out: Value = serde_json::from_slice(&out.stdout).unwrap();
    let failed: Vec<&str> =
        out["failures"].as_array().unwrap().iter().map(|f| f["log"].as_str().unwrap()).collect();
    assert_eq!(failed, ["logs/empty.csv", "logs/cut.csv.gz", "logs/short.csv", "logs/none.csv"]);
    run(at, &["fleet", "broken", "factors", "--out", "named", "--quiet"], 0);
    let (named, whole) = (result("named"), result("whole"));
    assert_eq!(named["failures"].as_array().unwrap().len(), 3, "what was never read is told by `reduce`");
    assert_eq!(named["repeated"], 144);
    for key in ["parameters", "robots", "noise", "covariates", "logs_to_look_at"] {
        assert_eq!(named[key], whole[key], "{key}");
    }
    // Two dates of one log are one too many.
    std::fs::write(
        at.join("made/when.csv"),
        format!("log,robot,start,temperature\n{}\n", line.replace(",r003,", ",r003,1")),
    )
    .unwrap();
    run(at, &["reduce", "type.factors", "--manifest", "made/when.csv", "--out", "when", "--quiet"], 0);
    run(at, &["fleet", "when", "factors", "--out", "named", "--quiet"], 0);
    let warnings = result("named")["warnings"].to_string();
    assert!(warnings.contains("1 log is stated with different dates or numbers"), "{warnings}");
    // A log that is said to be of two robots is of none.
    let manifest = std::fs::read_to_string(at.join("made/more.csv")).unwrap();
    let line = manifest.lines().find(|line| line.contains("r003-002")).unwrap().replace("r003,", "r004,");
    std::fs::write(at.join("made/two.csv"), format!("log,robot,start,temperature\n{line}\n")).unwrap();
    run(at, &["reduce", "type.factors", "--manifest", "made/two.csv", "--out", "broken", "--quiet"], 0);
    run(at, &["fleet", "broken", "--out", "named", "--quiet"], 0);
    let twice = result("named");
    let two: Vec<&Value> =
        twice["failures"].as_array().unwrap().iter().filter(|f| f["code"] == "two_robots").collect();
    assert_eq!(two.len(), 2, "{two:?}");
    // A file that was damaged in the folder is named too.
    let part = std::fs::read_dir(at.join("broken"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .find(|p| p.is_dir())
        .unwrap();
    let file = std::fs::read_dir(part)
        .unwrap()
        .map(|e| e.unwrap().path())
        .find(|p| p.to_string_lossy().ends_with(".factors"))
        .unwrap();
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 9]).unwrap();
    run(at, &["fleet", "broken", "--out", "named", "--quiet"], 0);
    let damaged =
        result("named")["failures"].as_array().unwrap().iter().filter(|f| f["code"] == "damaged").count();
    assert_eq!(damaged, 1);
}

/// A recipe without friction: the fleet shares all there is, and the result says that nothing can change.
#[test]
fn a_fleet_in_which_nothing_varies_is_fitted() {
    let at = prepared();
    let config = "robot = \"arm.urdf\"\npreflight = \"off\"\n[elements]\ndefault = []\n[[log]]\npath = \"made/logs/r001-001.csv.gz\"\n";
    std::fs::write(at.join("bare.toml"), config).unwrap();
    dynid()
        .current_dir(at)
        .args(["reduce", "bare.toml", "--out", "bare.factors", "--quiet"])
        .output()
        .unwrap();
    run(at, &["reduce", "bare.factors", "--manifest", "made/manifest.csv", "--out", "bare", "--quiet"], 0);
    run(at, &["fleet", "bare", "--out", "shared", "--quiet"], 0);
    let found = result("shared");
    assert!(
        found["warnings"].to_string().contains("nothing can stand out or change"),
        "{}",
        found["warnings"]
    );
    assert!(found["robots"].as_array().unwrap().iter().all(|r| r["state"] == "usual"));
}

#[test]
fn what_does_not_fit_is_refused() {
    let at = prepared();
    let refused = |args: &[&str], part: &str| {
        let output = run(at, args, 2);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(part), "{text}");
    };
    refused(&["fleet", "made"], "recipe.factors");
    refused(&["fleet", "factors", "--covariates", "load", "--out", "x"], "covariates");
    refused(&["fleet", "factors", "--between-robots", "fq", "--out", "x"], "fq");
    refused(&["fleet", "factors", "--robot", "r999", "--out", "x"], "r999");
    refused(&["reduce", "arm.urdf", "--manifest", "made/manifest.csv", "--out", "x"], "factor file");
    refused(&["reduce", "type.factors", "--manifest", "arm.urdf", "--out", "x"], "column `log`");
    let logs = ["--log", "made/logs/r002-001.csv.gz"];
    run(at, &[&["reduce", "arm.urdf", "--out", "other.factors", "--quiet"], &logs[..]].concat(), 0);
    refused(&["reduce", "other.factors", "--manifest", "made/manifest.csv", "--out", "factors"], "recipe");
    let one = "log,robot\nmade/logs/r001-001.csv.gz,r001\nmade/logs/r001-002.csv.gz,r001\n";
    std::fs::write(at.join("one.csv"), one).unwrap();
    run(at, &["reduce", "type.factors", "--manifest", "one.csv", "--out", "alone", "--quiet"], 0);
    refused(&["fleet", "alone", "--out", "x"], "robots with logs");
}
