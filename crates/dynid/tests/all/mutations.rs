//! Every reader, and what is done with what it read, on damaged input: no panic, no hang, no number that is none.
//!
//! Cases come from a corpus by seeded mutations; a case is told by seed and number, so that it can be made again. The ordinary run takes a
//! thousand; `DYNID_MUTATIONS=1000000 DYNID_MUTATION_SEED=7 cargo test --release -p dynid --test all -- --ignored mutations` takes as many as
//! are asked for. What was once found stands in [`FOUND`].

#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests outside of test functions; the fault is the outcome"
)]

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use dynid::design::DesignConfig;
use dynid::inspect::inspect;
use dynid::io::TrajectoryFile;
use dynid::io::csv::{self, ReadOptions};
use dynid::online::Session;
use dynid::predict::{efforts, read_states};
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Config, Estimate, FrictionConfig, FrictionModel, Robot, RobotOptions};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Longest that a case may take.
const LONGEST: Duration = Duration::from_secs(30);

/// Numbers that are trouble.
const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "-1",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "1e17",
    "9007199254740993",
    "18446744073709551616",
    "0.1",
    "3.141592653589793",
    "2147483648",
    "-32769",
    "1e-9",
    "1_000",
    "0x10",
    "",
];
/// Pieces of texts that are trouble.
const PIECES: [&str; 16] = [
    "\u{1b}[31m",
    "\0",
    "\u{feff}",
    "\n",
    "\"",
    "'",
    "<",
    "&#7;",
    "]]>",
    "[[",
    "}",
    ",,",
    "\\",
    "\u{202e}",
    "é",
    "#",
];

/// What a corpus entry is read by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reader {
    Robot,
    Mjcf,
    Config,
    Design,
    Friction,
    Simulate,
    Estimate,
    FrictionModel,
    Trajectory,
    Log,
    States,
}

struct Entry {
    reader: Reader,
    text: Vec<u8>,
}

const URDF: &str = r#"<?xml version="1.0"?><robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0" rpy="0 0 0.1"/><mass value="3"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="100"/><dynamics damping="0.1" friction="0.2"/></joint>
<joint name="j2" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0" rpy="1.57 0 0"/><axis xyz="0 1 0"/><limit velocity="3" effort="50"/><mimic joint="j1" multiplier="2"/></joint>
</robot>"#;

const ARM: &str = r#"schema = 1
name = "arm"
gravity = [0, -9.81, 0]
dh = "modified"
[[joint]]
name = "j1"
limits = { position = ["-90deg", 2], velocity = 3, effort = 100 }
phi = [3, 0.6, 0.03, 0.02, 0.1, 0, 0, 0.2, 0, 0.22]
[[joint]]
name = "j2"
a = 0.4
alpha = "90deg"
limits = { position = [-2, 2], velocity = 3, effort = 100 }
phi = [1.5, 0.25, 0.02, 0.01, 0.02, 0, 0, 0.06, 0, 0.07]
[defaults]
elements = ["coulomb", "viscous", "offset"]
[element.j1]
stribeck = { coulomb = 2, static = 5, vs = 0.3 }
"#;

const CONFIG: &str = r#"robot = "arm.toml"
preflight = "warn"
known_effort_scale = true
[known_mass]
tool = 1.2
[columns]
position = "q{}"
effort = { columns = "tau{}", unit = "mNm", scale = [1.0, 2.0] }
rate_hz = 100
[conditioning]
kernel_hz = 10
block_s = 1
reversal_mask = 0.2
[estimator]
method = "wls"
[[payload]]
name = "tool"
rated_mass = 2
[[log]]
path = "a.csv"
payload = "tool"
part = [0.0, 0.7]
leave_out = [[3, 9]]
[[log]]
path = "b.csv"
[[validation]]
path = "a.csv"
[online]
learn_s = 5
"#;

const SDF: &str = r#"<sdf version="1.9"><world name="w"><gravity>0 0 -9.8</gravity><model name="m"><pose>1 0 0.5 0 0 0.1</pose>
<link name="a"><inertial><mass>2</mass><pose>0.1 0 0 0.1 0 0</pose><inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.2</izz></inertia></inertial></link>
<frame name="f" attached_to="a"><pose degrees="true">0 0 0.3 0 90 0</pose></frame>
<link name="b"><pose relative_to="f"/><inertial><mass>1</mass></inertial></link>
<joint name="w" type="fixed"><parent>world</parent><child>a</child></joint>
<joint name="j" type="revolute"><pose relative_to="f">0 0 0.1 0 0 0</pose><parent>f</parent><child>b</child>
<axis><xyz expressed_in="__model__">0 1 0</xyz><limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit><dynamics><damping>0.1</damping></dynamics></axis></joint>
</model></world></sdf>
"#;

const DESIGN: &str = r#"robot = "arm.toml"
[trajectory]
period_s = 8
harmonics = 4
[limits]
share = 0.8
[search]
starts = 2
time_budget_s = 3
"#;

const FRICTION: &str = r#"robot = "arm.toml"
reference_temperature = 25
[columns]
position = "q{}"
effort = "tau{}"
[[log]]
path = "a.csv"
[prior]
j1 = { sigma0 = 1e4, sigma1 = 10 }
"#;

const SIMULATE: &str = r#"duration_s = 0.5
rate_hz = 100
effort_noise = 0.02
encoder_bits = 16
period_s = 0.5
harmonics = 3
seed = 3
[values]
"j1.fc" = 1.5
"#;

fn corpus(folder: &Path) -> Vec<Entry> {
    let robot = Robot::parse(ARM, Path::new("arm.toml"), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings {
        duration_s: 8.0,
        rate_hz: 50.0,
        effort_noise: 0.01,
        ..SimulateSettings::default()
    };
    let log = simulate(&robot, &settings).unwrap();
    let mut csv = String::from("t,q_j1,q_j2,tau_j1,tau_j2\n");
    for k in 0..log.time.len() {
        let signals = log.position.iter().chain(&log.effort).map(|s| s[k].to_string());
        csv += &format!("{},{}\n", log.time[k], signals.collect::<Vec<_>>().join(","));
    }
    let robot_file = folder.join("arm.toml");
    std::fs::write(&robot_file, ARM).unwrap();
    std::fs::write(folder.join("a.csv"), &csv).unwrap();
    let text =
        format!("robot = {robot_file:?}\npreflight = \"off\"\n[[log]]\npath = {:?}\n", folder.join("a.csv"));
    let config = Config::parse(&text, "corpus").unwrap();
    let estimate = dynid::identify(&config, &mut |_| {}).unwrap().estimate();
    std::fs::write(folder.join("estimate.json"), estimate.to_json()).unwrap();
    let states = "q_j1,q_j2,dq_j1,dq_j2,ddq_j1,ddq_j2\n0.1,0.2,0.3,0.4,0.5,0.6\n-1,2,-3,1,0,1e-3\n";
    let friction = r#"{"schema":1,"robot":"arm","verdict":{"status":"pass","headline":""},"joints":[],"warnings":[],"provenance":{"version":"","seed":1,"inputs":[],"settings":{}}}"#;
    let trajectory = r#"{"schema":"dynid-trajectory/1","form":"plain","base_frequency_rad_s":1.2,"joints":[{"name":"j1","q0":0.1,"a":[0.1,0.2],"b":[0.2,0]},{"name":"j2","unit":"deg","q0":3,"a":[1,2],"b":[2,0]}],"approach":{"from":[0,0],"duration_s":2},"sample_rate_hz":100}"#;
    let mjcf = dynid::io::mjcf::from_description(&robot.file.description, &[]).unwrap();
    [
        (Reader::Robot, URDF),
        (Reader::Robot, ARM),
        (Reader::Robot, SDF),
        (Reader::Mjcf, &mjcf),
        (Reader::Config, CONFIG),
        (Reader::Design, DESIGN),
        (Reader::Friction, FRICTION),
        (Reader::Simulate, SIMULATE),
        (Reader::Estimate, &estimate.to_json()),
        (Reader::FrictionModel, friction),
        (Reader::Trajectory, trajectory),
        (Reader::Log, &csv),
        (Reader::States, states),
    ]
    .map(|(reader, text)| Entry { reader, text: text.as_bytes().to_vec() })
    .into()
}

/// A damaged copy: one to four mutations.
fn mutated(text: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut out = text.to_vec();
    for _ in 0..random.random_range(1..=4) {
        if out.is_empty() {
            break;
        }
        let place = random.random_range(0..out.len());
        match random.random_range(0..9) {
            0 => out[place] ^= 1 << random.random_range(0..8),
            1 => out[place] = random.random(),
            2 => out.truncate(place),
            3 => {
                let end = (place + random.random_range(1..40)).min(out.len());
                out.drain(place..end);
            }
            4 => {
                let end = (place + random.random_range(1..80)).min(out.len());
                let copy = out[place..end].to_vec();
                let to = random.random_range(0..=out.len());
                out.splice(to..to, copy);
            }
            5 | 6 => {
                // A number takes the place of a number.
                let is_number = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
                let Some(start) = (place..out.len()).find(|k| out[*k].is_ascii_digit()) else { continue };
                let end = (start..out.len()).find(|k| !is_number(&out[*k])).unwrap_or(out.len());
                let number = NUMBERS.choose(random).unwrap();
                out.splice(start..end, number.bytes());
            }
            7 => {
                let piece = PIECES.choose(random).unwrap();
                out.splice(place..place, piece.bytes());
            }
            _ => {
                // Two lines change places.
                let mut lines: Vec<&[u8]> = out.split(|b| *b == b'\n').collect();
                let (a, b) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
                lines.swap(a, b);
                out = lines.join(&b'\n');
            }
        }
    }
    out
}

/// Reads, and goes on with what was read.
fn run(reader: Reader, bytes: &[u8], folder: &Path, number: usize) {
    let text = String::from_utf8_lossy(bytes);
    let file = folder.join(format!("case-{number}"));
    let robot_options = RobotOptions::default();
    match reader {
        Reader::Robot => {
            for name in ["robot.urdf", "robot.toml"] {
                let Ok(robot) = Robot::parse(&text, Path::new(name), &robot_options) else { continue };
                // A robot may have very many joints.
                if robot.axes.len() > 12 {
                    continue;
                }
                if let Ok(found) = inspect(&robot, None) {
                    let gap = [found.rank_gap.0, found.rank_gap.1.unwrap_or(0.0)];
                    assert!(gap.iter().all(|x| !x.is_nan()), "{gap:?}");
                }
                let settings =
                    SimulateSettings { duration_s: 0.1, rate_hz: 50.0, ..SimulateSettings::default() };
                if let Ok(log) = simulate(&robot, &settings) {
                    assert!(log.effort.iter().flatten().all(|x| x.is_finite()), "efforts of a virtual log");
                }
                // What is written is read again.
                if let Ok(written) = dynid::io::urdf::from_description(&robot.file.description) {
                    dynid::io::urdf::parse(&written, "written.urdf").unwrap();
                }
            }
        }
        Reader::Mjcf => drop(dynid::io::mjcf::parse(&text, "robot.xml")),
        Reader::Config => drop(Config::parse(&text, "run.toml")),
        Reader::Design => drop(DesignConfig::parse(&text, "design.toml").and_then(|c| c.check())),
        Reader::Friction => drop(FrictionConfig::parse(&text, "friction.toml")),
        Reader::Simulate => {
            let Ok(mut settings) = SimulateSettings::parse(&text, "simulate.toml") else { return };
            let robot = Robot::parse(ARM, Path::new("arm.toml"), &robot_options).unwrap();
            // Long logs are no fault.
            settings.duration_s = settings.duration_s.min(2.0);
            settings.rate_hz = settings.rate_hz.min(1e3);
            settings.follow = None;
            drop(simulate(&robot, &settings));
        }
        Reader::Estimate => {
            std::fs::write(&file, bytes).unwrap();
            if let Ok(estimate) = Estimate::read(&file) {
                drop(dynid::export::IdentifiedRobot::of(&estimate, &file));
                if let Ok(model) = estimate.effort_model(&file, dynid::estimate::Split::Consistent) {
                    drop(model);
                }
            }
        }
        Reader::FrictionModel => {
            std::fs::write(&file, bytes).unwrap();
            drop(FrictionModel::load(&file));
        }
        Reader::Trajectory => {
            drop(TrajectoryFile::parse(&text, "trajectory.json").map(|t| t.sequence().is_ok()))
        }
        Reader::Log => {
            std::fs::write(&file, bytes).unwrap();
            let Ok(table) = csv::read(&file, &ReadOptions::default()) else { return };
            // Every fiftieth case goes through one of the commands.
            if number.is_multiple_of(50) {
                commands(number / 50, &folder.join("arm.toml"), &file, table);
            }
        }
        Reader::States => {
            std::fs::write(&file, bytes).unwrap();
            let estimate_file = folder.join("estimate.json");
            let estimate = Estimate::read(&estimate_file).unwrap();
            let split = dynid::estimate::Split::Consistent;
            let model = estimate.effort_model(&estimate_file, split).unwrap();
            if let Ok(states) = read_states(&file, &ReadOptions::default(), &model, None) {
                drop(efforts(&model, &estimate.values(split), &states));
            }
        }
    }
    drop(std::fs::remove_file(&file));
}

/// What commands make of a log.
fn commands(number: usize, robot: &Path, file: &Path, table: csv::Table) {
    let text = format!("robot = {robot:?}\n[[log]]\npath = {file:?}\n[online]\nlearn_s = 3\n");
    let config = Config::parse(&text, "case").unwrap();
    match number % 4 {
        0 | 1 => {
            if let Ok(found) = dynid::identify(&config, &mut |_| {}) {
                assert!(found.values().iter().all(|x| x.is_finite()), "identified values");
                found.estimate();
            }
        }
        2 => drop(dynid::check::check(&config, &mut |_| {})),
        _ => {
            let Ok(mut session) = Session::new(&config, "case", &table.header, None) else { return };
            let rows = (0..table.rows).map(|k| table.columns.iter().map(|c| c[k]).collect::<Vec<f64>>());
            for row in rows {
                if session.row(&row, &mut |_| {}).is_err() {
                    return;
                }
            }
            drop(session.finish(&mut |_| {}));
        }
    }
}

/// Runs so many cases; faults with the seed and number that make them again.
fn walk(seed: u64, cases: usize) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let corpus = corpus(folder.path());
    let next = AtomicUsize::new(0);
    let worker = || {
        let mut faults = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= cases || faults.len() > 20 {
                return faults;
            }
            let mut random =
                ChaCha8Rng::seed_from_u64(seed ^ (number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let entry = corpus.choose(&mut random).unwrap();
            let bytes = mutated(&entry.text, &mut random);
            let begun = Instant::now();
            let outcome = std::panic::catch_unwind(|| run(entry.reader, &bytes, folder.path(), number));
            let took = begun.elapsed();
            if outcome.is_err() || took > LONGEST {
                let text = String::from_utf8_lossy(&bytes);
                let text: String = text.chars().take(3000).collect();
                let what = if outcome.is_err() { "a panic" } else { "too long" };
                faults.push(format!(
                    "seed {seed}, case {number}, {:?}, {what}, {took:?}:\n{text}\n",
                    entry.reader
                ));
            }
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..2).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().flat_map(|w| w.join().unwrap()).collect()
    })
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// What is not read as it is shows nothing once it is damaged.
#[test]
fn the_corpus_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("entry");
    let options = RobotOptions::default();
    let mut faults = Vec::new();
    for Entry { reader, text } in corpus(folder.path()) {
        std::fs::write(&file, &text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let error = match reader {
            Reader::Robot => {
                let name = if text.starts_with('<') { "robot.urdf" } else { "robot.toml" };
                Robot::parse(&text, Path::new(name), &options).err().map(|e| e.to_string())
            }
            Reader::Mjcf => dynid::io::mjcf::parse(&text, "robot.xml").err().map(|e| e.to_string()),
            Reader::Config => Config::parse(&text, "run.toml").err().map(|e| e.to_string()),
            Reader::Design => DesignConfig::parse(&text, "design.toml").err().map(|e| e.to_string()),
            Reader::Friction => FrictionConfig::parse(&text, "friction.toml").err().map(|e| e.to_string()),
            Reader::Simulate => SimulateSettings::parse(&text, "simulate.toml").err().map(|e| e.to_string()),
            Reader::Estimate => Estimate::read(&file).err().map(|e| e.to_string()),
            Reader::FrictionModel => FrictionModel::load(&file).err().map(|e| e.to_string()),
            Reader::Trajectory => TrajectoryFile::parse(&text, "t.json").err().map(|e| e.to_string()),
            Reader::Log => csv::read(&file, &ReadOptions::default()).err().map(|e| e.to_string()),
            Reader::States => {
                let estimate_file = folder.path().join("estimate.json");
                let estimate = Estimate::read(&estimate_file).unwrap();
                let model =
                    estimate.effort_model(&estimate_file, dynid::estimate::Split::Consistent).unwrap();
                read_states(&file, &ReadOptions::default(), &model, None).err().map(|e| e.to_string())
            }
        };
        faults.extend(error.map(|error| format!("{reader:?}: {error}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_thousand_damaged_inputs_are_refused_or_read() {
    let faults = walk(1, 1000);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
#[ignore = "a minute for a million damaged inputs; the ordinary run has fewer"]
fn very_many_damaged_inputs_are_refused_or_read() {
    let (seed, cases) = (number("DYNID_MUTATION_SEED", 7), number("DYNID_MUTATIONS", 100_000));
    let begun = Instant::now();
    let faults = walk(seed, usize::try_from(cases).unwrap());
    println!("{cases} cases, seed {seed}, {:?}", begun.elapsed());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Inputs that once ended in a panic or in a number that is none.
const FOUND: [(Reader, &str, &str, &str); 6] = [
    (Reader::Robot, URDF, "effort=\"100\"", "effort=\"1e-320\""),
    (Reader::Robot, URDF, "xyz=\"0 0 1\"", "xyz=\"1e-320 0 0\""),
    (Reader::Robot, URDF, "name=\"upper\"", "name=\"up&#7;per\""),
    (Reader::Robot, ARM, "coulomb = 2", "coulomb = -1e308"),
    (Reader::Config, CONFIG, "rated_mass = 2", "rated_mass = 5e-324"),
    (Reader::Friction, FRICTION, "reference_temperature = 25", "reference_temperature = 1e308"),
];

#[test]
fn what_was_found_is_refused() {
    for (reader, text, from, to) in FOUND {
        assert!(text.contains(from), "{from}");
        let text = text.replace(from, to);
        let refused = match reader {
            Reader::Robot => {
                let name = if text.starts_with('<') { "robot.urdf" } else { "robot.toml" };
                Robot::parse(&text, Path::new(name), &RobotOptions::default()).is_err()
            }
            Reader::Config => Config::parse(&text, "run.toml").is_err(),
            _ => FrictionConfig::parse(&text, "friction.toml").is_err(),
        };
        assert!(refused, "{to}");
    }
    let twice = CONFIG.replace("[online]", "[online]\nlearn_s = 4");
    let message = Config::parse(&twice, "run.toml").unwrap_err().to_string();
    assert!(message.contains("duplicate key `learn_s`"), "{message}");
}

/// Devices without an end, folders and files that are none.
#[test]
fn files_that_are_none_are_refused() {
    let zero = PathBuf::from("/dev/zero");
    if !zero.exists() {
        return;
    }
    for path in [zero.as_path(), Path::new("/"), Path::new("/no/such/file")] {
        assert!(Config::read(path).is_err());
        assert!(Estimate::read(path).is_err());
        assert!(Robot::load(path, &RobotOptions::default()).is_err());
        assert!(FrictionModel::load(path).is_err());
        assert!(csv::read(path, &ReadOptions::default()).is_err());
        assert!(TrajectoryFile::read(path).is_err());
    }
}
