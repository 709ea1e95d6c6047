//! Logs and settings that make nonsense of a model: whatever the robot, none of them ends in `ok`, and the clean logs still do.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was found is said"
)]

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use dynid::simulate::{SimulateSettings, simulate};
use dynid::verdict::{Status, judge};
use dynid::{Config, Robot, RobotOptions, identify, logs};
use tempfile::TempDir;

use crate::support::data;

/// Four joints with gravity on three of them, bodies and friction of a small arm.
const ARM: &str = r#"schema = 1
name = "arm4"
dh = "modified"
[[joint]]
name = "j1"
d = 0.3
limits = { position = [-2.8, 2.8], velocity = 2.5, effort = 150 }
phi = [6, 0.1, 0.05, 0.3, 0.3, 0, 0, 0.3, 0, 0.2]
[[joint]]
name = "j2"
alpha = "-90deg"
limits = { position = [-2, 2], velocity = 2.5, effort = 150 }
phi = [5, 1.1, 0.02, 0.3, 0.1, 0, 0, 0.5, 0, 0.5]
[[joint]]
name = "j3"
a = 0.4
limits = { position = [-2.5, 2.5], velocity = 3, effort = 80 }
phi = [3, 0.5, 0.01, 0.1, 0.05, 0, 0, 0.2, 0, 0.2]
[[joint]]
name = "j4"
a = 0.3
alpha = "90deg"
limits = { position = [-2.8, 2.8], velocity = 3, effort = 40 }
phi = [1.2, 0.15, 0.05, 0.08, 0.02, 0, 0, 0.03, 0, 0.03]
[defaults]
elements = ["coulomb", "viscous", "offset"]
"#;

/// A log in SI units and what stands beside it.
#[derive(Clone)]
struct Record {
    robot: PathBuf,
    time: Vec<f64>,
    position: Vec<Vec<f64>>,
    effort: Vec<Vec<f64>>,
    settings: String,
    /// Names of further training logs, and of validation logs.
    more: Vec<&'static str>,
    validation: Vec<&'static str>,
}

impl Record {
    fn simulated(robot: &Path, seed: u64, duration_s: f64) -> Record {
        let loaded = Robot::load(robot, &RobotOptions::default()).unwrap();
        let settings = SimulateSettings {
            duration_s,
            rate_hz: 100.0,
            effort_noise: 0.02,
            seed,
            ..SimulateSettings::default()
        };
        let log = simulate(&loaded, &settings).unwrap();
        Record::of(robot, log.time, log.position, log.effort)
    }

    fn of(robot: &Path, time: Vec<f64>, position: Vec<Vec<f64>>, effort: Vec<Vec<f64>>) -> Record {
        let (settings, more, validation) = (String::new(), Vec::new(), Vec::new());
        Record { robot: robot.to_owned(), time, position, effort, settings, more, validation }
    }

    fn recorded(robot: &Path, log: &Path) -> Record {
        let loaded = Robot::load(robot, &RobotOptions::default()).unwrap();
        let text = format!("robot = {robot:?}\n[[log]]\npath = {log:?}\n");
        let config = Config::parse(&text, "test").unwrap();
        let log = logs::load(&config.log[0], &loaded.axes, &config.columns, None).unwrap().log;
        let of =
            |signal: fn(&dynid::motion::JointSignals) -> Vec<f64>| log.joints().iter().map(signal).collect();
        Record::of(robot, log.time().to_vec(), of(|j| j.position.clone()), of(|j| j.effort.clone()))
    }

    fn write(&self, folder: &Path, name: &str) {
        let joints = 1..=self.position.len();
        let names = |what: &str| joints.clone().map(|j| format!("{what}{j}")).collect::<Vec<_>>().join(",");
        let mut text = format!("t,{},{}\n", names("q"), names("tau"));
        for k in 0..self.time.len() {
            let row = self.position.iter().chain(&self.effort).map(|c| c[k].to_string());
            text += &format!("{},{}\n", self.time[k], row.collect::<Vec<_>>().join(","));
        }
        std::fs::write(folder.join(name), text).unwrap();
    }

    /// What comes of it: `ok`, `warn`, `fail`, or why it is refused.
    fn outcome(&self, folder: &Path) -> String {
        self.write(folder, "log.csv");
        let log = |table: &str, name: &str| format!("[[{table}]]\npath = {:?}\n", folder.join(name));
        let logs = self.more.iter().map(|name| log("log", name));
        let validation = self.validation.iter().map(|name| log("validation", name));
        let text = format!(
            "robot = {:?}\n{}\n[columns]\nposition = \"q{{}}\"\neffort = \"tau{{}}\"\n{}{}{}",
            self.robot,
            self.settings,
            log("log", "log.csv"),
            logs.collect::<String>(),
            validation.collect::<String>()
        );
        let config = Config::parse(&text, "test").unwrap();
        match identify(&config, &mut |_| {}) {
            Err(refused) => format!("refused: {refused}"),
            Ok(found) => {
                let verdict = judge(&found);
                let names = verdict.checks.iter().filter(|c| c.status.word() != "ok").map(|c| c.name.word());
                format!("{}: {}", verdict.status, names.collect::<Vec<_>>().join(", "))
            }
        }
    }

    fn scaled(mut self, factor: f64) -> Record {
        self.effort.iter_mut().flatten().for_each(|e| *e *= factor);
        self
    }

    fn with(mut self, settings: &str) -> Record {
        self.settings = settings.to_owned();
        self
    }

    /// The efforts so many seconds later than the motion.
    fn late(mut self, seconds: f64) -> Record {
        let rate = (self.time.len() - 1) as f64 / (self.time[self.time.len() - 1] - self.time[0]);
        let rows = (seconds * rate).round() as usize;
        let kept = self.time.len() - rows;
        self.effort.iter_mut().for_each(|e| e.truncate(kept));
        self.position.iter_mut().for_each(|q| drop(q.drain(..rows)));
        self.time.truncate(kept);
        self
    }
}

/// Turns a direction by an angle about the second axis.
fn tilted(degrees: f64) -> String {
    let angle = degrees.to_radians();
    format!("gravity = [{:?}, 0.0, {:?}]", 9.81 * angle.sin(), -9.81 * angle.cos())
}

type Abuse = (&'static str, Box<dyn Fn(&Record, &Path) -> Record>);

fn abuses() -> Vec<Abuse> {
    const WARN: &str = "preflight = \"warn\"";
    fn of(name: &'static str, spoil: impl Fn(&Record, &Path) -> Record + 'static) -> Abuse {
        (name, Box::new(spoil))
    }
    fn beside(name: &'static str, make: fn(&mut Record)) -> Abuse {
        of(name, move |r, folder| {
            let mut other = r.clone();
            make(&mut other);
            other.write(folder, "other.csv");
            Record { validation: vec!["other.csv"], ..r.clone() }
        })
    }
    fn scaled(name: &'static str, factor: f64) -> Abuse {
        of(name, move |r, _| r.clone().scaled(factor))
    }
    fn set(name: &'static str, settings: &'static str) -> Abuse {
        of(name, move |r, _| r.clone().with(settings))
    }
    let sign = |r: &Record| {
        let mut out = r.clone();
        out.effort[1].iter_mut().for_each(|e| *e = -*e);
        out
    };
    vec![
        of("validated on the training log itself", |r, _| Record {
            validation: vec!["log.csv"],
            ..r.clone()
        }),
        beside("validated on a copy at another time", |o| o.time.iter_mut().for_each(|t| *t += 1e3)),
        beside("validated on a copy with fewer decimals", |o| {
            let round = |x: &mut f64| *x = (*x * 1e5).round() / 1e5;
            o.position.iter_mut().flatten().for_each(round);
            o.effort.iter_mut().flatten().for_each(round);
        }),
        beside("validated on the second half", |o| {
            let half = o.time.len() / 2;
            drop(o.time.drain(..half));
            o.position.iter_mut().chain(&mut o.effort).for_each(|s| drop(s.drain(..half)));
        }),
        of("one log four times", |r, _| Record { more: vec!["log.csv"; 3], ..r.clone() }),
        of("one log four times, warned", |r, _| Record { more: vec!["log.csv"; 3], ..r.clone() }.with(WARN)),
        of("a copy beside the log", |r, folder| {
            let mut copy = r.clone();
            copy.time.iter_mut().for_each(|t| *t += 50.0);
            copy.write(folder, "other.csv");
            Record { more: vec!["other.csv"], ..r.clone() }
        }),
        scaled("efforts x 0.5", 0.5),
        scaled("efforts x 0.7", 0.7),
        scaled("efforts x 1.5", 1.5),
        scaled("efforts x 2", 2.0),
        scaled("efforts x 4.8", 4.8),
        of("efforts x 100, warned", |r, _| r.clone().scaled(100.0).with(WARN)),
        of("an effort reversed, warned", move |r, _| sign(r).with(WARN)),
        of("an effort reversed, not examined", move |r, _| sign(r).with("preflight = \"off\"")),
        set("gravity upside down", "gravity = [0.0, 0.0, 9.81]"),
        set("gravity upside down, warned", "gravity = [0.0, 0.0, 9.81]\npreflight = \"warn\""),
        set("gravity / 6", "gravity = [0.0, 0.0, -1.635]"),
        of("base tilted by 10 degrees", |r, _| r.clone().with(&tilted(10.0))),
        scaled("no efforts", 0.0),
        of("efforts late by 1 s", |r, _| r.clone().late(1.0)),
        of("efforts late by 1 s, warned", |r, _| r.clone().late(1.0).with(WARN)),
        of("positions of two joints exchanged, warned", |r, _| {
            let mut out = r.clone();
            out.position.swap(0, 1);
            out.with(WARN)
        }),
        of("efforts in another order, warned", |r, _| {
            let mut out = r.clone();
            out.effort.rotate_left(1);
            out.with(WARN)
        }),
        of("positions in degrees, warned", |r, _| {
            let mut out = r.clone();
            out.position.iter_mut().flatten().for_each(|q| *q *= 180.0 / PI);
            out.with(WARN)
        }),
        of("noise for efforts, warned", |r, _| {
            let mut out = r.clone();
            let mut state = 1_u64;
            for effort in &mut out.effort {
                let size = effort.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
                for e in effort.iter_mut() {
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    *e = size * ((state >> 33) as f64 / f64::from(1u32 << 31) - 0.5);
                }
            }
            out.with(WARN)
        }),
    ]
}

/// Clean logs of a robot: one to identify from, one to validate on.
fn walk(name: &str, clean: &Record, other: &Record) -> Vec<String> {
    let folder = TempDir::new().unwrap();
    let mut faults = Vec::new();
    other.write(folder.path(), "valid.csv");
    let outcome = Record { validation: vec!["valid.csv"], ..clean.clone() }.outcome(folder.path());
    println!("{name}: clean: {outcome}");
    // A record may be too short for honest intervals: that is said, and no abuse.
    let is_short = outcome == "warn: time blocks behind the standard deviations";
    if !outcome.starts_with(Status::Ok.word()) && !is_short {
        faults.push(format!("{name}: clean: {outcome}"));
    }
    for (abuse, spoil) in abuses() {
        let outcome = spoil(clean, folder.path()).outcome(folder.path());
        println!("{name}: {abuse}: {outcome}");
        if outcome.starts_with(Status::Ok.word()) {
            faults.push(format!("{name}: {abuse}: {outcome}"));
        }
    }
    faults
}

fn simulated(name: &str, robot: &Path, duration_s: f64) -> Vec<String> {
    walk(name, &Record::simulated(robot, 3, duration_s), &Record::simulated(robot, 4, 10.0))
}

#[test]
fn no_abuse_of_an_arm_ends_in_ok() {
    let folder = TempDir::new().unwrap();
    let robot = folder.path().join("arm4.toml");
    std::fs::write(&robot, ARM).unwrap();
    let faults = simulated("arm4", &robot, 40.0);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
#[ignore = "26 abuses of each of five robots take four minutes; the ordinary run has one robot"]
fn no_abuse_of_more_robots_ends_in_ok() {
    let robots = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots");
    let mut faults = simulated("indy7", &robots.join("indy7.toml"), 150.0);
    if let Some(data) = data() {
        for urdf in ["oracles/ur5.urdf", "ur10e-innopolis/ur10e.urdf"] {
            faults.extend(simulated(urdf, &data.join(urdf), 150.0));
        }
        for name in ["iiwa_250", "ur5_1k"] {
            let folder = data.join("oracles/logs").join(name);
            let [robot, log, valid] =
                ["nominal.urdf", "train.csv.gz", "valid_fourier.csv.gz"].map(|f| folder.join(f));
            faults.extend(walk(name, &Record::recorded(&robot, &log), &Record::recorded(&robot, &valid)));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_weighed_mass_tells_the_scale_of_the_efforts() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let bare = write("bare.toml", ARM);
    // The last link with 2 kg more, 0.1 m out.
    let loaded = write(
        "loaded.toml",
        &ARM.replace(
            "phi = [1.2, 0.15, 0.05, 0.08, 0.02, 0, 0, 0.03, 0, 0.03]",
            "phi = [3.2, 0.35, 0.05, 0.08, 0.02, 0, 0, 0.05, 0, 0.05]",
        ),
    );
    for (factor, right) in [(1.0, true), (2.0, false)] {
        Record::simulated(&bare, 5, 40.0).scaled(factor).write(folder.path(), "bare.csv");
        Record::simulated(&loaded, 6, 40.0).scaled(factor).write(folder.path(), "loaded.csv");
        let text = format!(
            "robot = {bare:?}\n[columns]\nposition = \"q{{}}\"\neffort = \"tau{{}}\"\n[known_mass]\ntool = 2.0\n[[payload]]\nname = \"tool\"\n\
             [[log]]\npath = {:?}\n[[log]]\npath = {:?}\npayload = \"tool\"\n",
            folder.path().join("bare.csv"),
            folder.path().join("loaded.csv")
        );
        let found = identify(&Config::parse(&text, "test").unwrap(), &mut |_| {}).unwrap();
        let (low, high) = found.effort_scale.interval.unwrap();
        println!("factor {factor}: {:?}", found.effort_scale);
        assert!(low < factor && factor < high, "{low} to {high}");
        assert!(high - low < 0.2 * factor, "{low} to {high}");
        assert_eq!(found.effort_scale.assumption(), None);
        let verdict = judge(&found);
        let check = verdict.checks.iter().find(|c| c.name.word() == "scale of the efforts").unwrap();
        assert_eq!(check.status.word() == "ok", right, "{}", check.meaning);
    }
}
