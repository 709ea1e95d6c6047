//! One cause at a time spoils the logs of seven robots: the pre-flight names the right one first, and what it writes puts it right.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was found is said"
)]

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::{Path, PathBuf};

use dynid::Config;
use dynid::check::{Check, Severity, check};
use dynid::logs;
use dynid::robot::{Robot, RobotOptions};

use crate::support::data;

/// A log in SI units: times, and per joint positions and efforts.
#[derive(Clone)]
struct Record {
    robot: PathBuf,
    time: Vec<f64>,
    position: Vec<Vec<f64>>,
    effort: Vec<Vec<f64>>,
    /// What is beside robot and log in the configuration.
    settings: String,
}

impl Record {
    fn of(text: &str) -> Record {
        let config = Config::parse(text, "test").unwrap();
        let robot = Robot::load(&config.robot, &RobotOptions::default()).unwrap();
        let log = logs::load(&config.log[0], &robot.axes, &config.columns, None).unwrap().log;
        let of_axis = |name: &String| log.joints().iter().find(|j| j.name == *name).unwrap().clone();
        let joints: Vec<_> = robot.axes.iter().map(|a| of_axis(&a.name)).collect();
        // Rows that repeat the row before are another fault.
        let repeats = |k: &usize| {
            let same = |x: &[f64]| *k > 0 && x[*k] == x[*k - 1];
            joints.iter().all(|j| same(&j.position) && same(&j.effort))
        };
        let kept: Vec<usize> = (0..log.rows()).filter(|k| !repeats(k)).collect();
        let pick = |x: &[f64]| kept.iter().map(|k| x[*k]).collect::<Vec<f64>>();
        Record {
            robot: config.robot.clone(),
            time: pick(log.time()),
            position: joints.iter().map(|j| pick(&j.position)).collect(),
            effort: joints.iter().map(|j| pick(&j.effort)).collect(),
            settings: String::new(),
        }
    }

    /// Writes the log and a configuration beside it.
    fn write(&self, folder: &Path, name: &str) -> Config {
        let joints = 1..=self.position.len();
        let names = |what: &str| joints.clone().map(|j| format!("{what}{j}")).collect::<Vec<_>>();
        let mut text = format!("t,{},{}\n", names("q").join(","), names("tau").join(","));
        for k in 0..self.time.len() {
            let row = self.position.iter().chain(&self.effort).map(|c| c[k].to_string());
            text += &format!("{},{}\n", self.time[k], row.collect::<Vec<_>>().join(","));
        }
        let log = folder.join(format!("{name}.csv"));
        std::fs::write(&log, text).unwrap();
        let config = format!(
            "robot = {:?}\n{}\n[columns]\nposition = \"q{{}}\"\neffort = \"tau{{}}\"\n[[log]]\npath = {log:?}\n",
            self.robot, self.settings
        );
        Config::parse(&config, "test").unwrap()
    }

    /// Rows per second of its median step.
    fn rate_hz(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        1.0 / steps[steps.len() / 2]
    }
}

type Corrupt = Box<dyn Fn(&mut Record)>;

/// Name, identity of the finding, what is done to the log.
fn causes() -> Vec<(&'static str, &'static str, Corrupt)> {
    let scaled = |factor: f64| -> Corrupt {
        Box::new(move |r| r.effort.iter_mut().flatten().for_each(|e| *e *= factor))
    };
    let clock = |factor: f64| -> Corrupt {
        Box::new(move |r| {
            let first = r.time[0];
            r.time.iter_mut().for_each(|t| *t = factor * (*t - first));
        })
    };
    let zero = |joint: usize, angle: f64| -> Corrupt {
        Box::new(move |r| r.position[joint].iter_mut().for_each(|q| *q += angle))
    };
    let gravity = |g: [f64; 3]| -> Corrupt { Box::new(move |r| r.settings = format!("gravity = {g:?}")) };
    let late = |seconds: f64| -> Corrupt {
        Box::new(move |r| {
            let rows = (seconds * r.rate_hz()).round() as usize;
            let kept = r.time.len() - rows;
            r.effort.iter_mut().for_each(|e| e.truncate(kept));
            r.position.iter_mut().for_each(|q| drop(q.drain(..rows)));
            r.time.truncate(kept);
        })
    };
    vec![
        ("efforts x 10", "drive_gain", scaled(10.0)),
        ("efforts x 100", "drive_gain", scaled(100.0)),
        ("efforts / 10", "drive_gain", scaled(0.1)),
        ("clock in milliseconds", "clock_rate", clock(1e3)),
        ("clock 20 times too slow", "clock_rate", clock(20.0)),
        ("zero of the second joint", "position_zero", zero(1, FRAC_PI_2)),
        ("zero of the third joint", "position_zero", zero(2, -FRAC_PI_2)),
        ("mounted on its side", "base_tilt", gravity([9.81, 0.0, 0.0])),
        ("mounted upside down", "base_tilt", gravity([0.0, 0.0, 9.81])),
        ("efforts late by 0.3 s", "delay", late(0.3)),
        (
            "sign of the third effort",
            "effort_sign",
            Box::new(|r| r.effort[2].iter_mut().for_each(|e| *e = -*e)),
        ),
        ("efforts of two joints", "joint_permutation", Box::new(|r| r.effort.swap(1, 2))),
        (
            "positions in degrees",
            "degrees",
            Box::new(|r| r.position.iter_mut().flatten().for_each(|q| *q *= 180.0 / PI)),
        ),
    ]
}

fn errors(found: &Check) -> Vec<String> {
    let errors = found.findings.iter().filter(|f| f.severity == Severity::Error);
    errors.map(|f| format!("{} {:?}: {}", f.id, f.joint, f.evidence)).collect()
}

/// Whether a corrected configuration reads the spoilt log as the clean one: times within 3 %, positions within 3 degrees up to turns,
/// efforts within 5 %, gravity within 3 degrees.
fn reads_as(clean: &Record, config: &Config, spoilt_rows: usize) -> Result<(), String> {
    let robot = Robot::load(&config.robot, &RobotOptions::default()).unwrap();
    let log = logs::load(&config.log[0], &robot.axes, &config.columns, None).map_err(|e| e.to_string())?.log;
    let span = |t: &[f64]| t[spoilt_rows - 1] - t[0];
    let ratio = span(log.time()) / span(&clean.time);
    if (ratio - 1.0).abs() > 0.03 {
        return Err(format!("times are {ratio} of the clean ones"));
    }
    // A delay leaves out rows at one end of the positions.
    let cut = clean.time.len() - spoilt_rows;
    for (k, axis) in robot.axes.iter().enumerate() {
        let joint = log.joints().iter().find(|j| j.name == axis.name).unwrap();
        for (q, clean) in joint.position.iter().zip(&clean.position[k][cut..]) {
            let off = (q - clean + PI).rem_euclid(2.0 * PI) - PI;
            if off.abs() > 0.052 {
                return Err(format!("position of {} off by {off}", axis.name));
            }
        }
        let power = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let difference: Vec<f64> = joint.effort.iter().zip(&clean.effort[k]).map(|(a, b)| a - b).collect();
        if power(&difference) > 0.0025 * power(&clean.effort[k]) {
            return Err(format!("effort of {} off", axis.name));
        }
    }
    if let Some(g) = config.gravity {
        let stated = robot.file.description.gravity;
        let dot: f64 = g.iter().zip(stated).map(|(a, b)| a * b).sum();
        let size = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if dot < 3f64.to_radians().cos() * size(g) * size(stated) {
            return Err(format!("gravity {g:?}"));
        }
    }
    Ok(())
}

/// Spoils a robot's log in every way; the causes that were not named first. No remedy written is wrong, no clean log is refused.
fn spoil(name: &str, clean: &Record) -> Vec<&'static str> {
    let folder = tempfile::tempdir().unwrap();
    let found = check(&clean.write(folder.path(), "clean"), &mut |_| {}).unwrap();
    assert!(errors(&found).is_empty(), "{name}, clean: {:#?}", errors(&found));
    let mut missed = Vec::new();
    for (cause, id, corrupt) in causes() {
        let mut record = clean.clone();
        corrupt(&mut record);
        let config = record.write(folder.path(), "spoilt");
        let found = check(&config, &mut |_| {}).unwrap();
        let of_record = ["clock_gap", "weak_excitation"];
        let worse =
            |f: &&dynid::check::Finding| f.severity != Severity::Info && !of_record.contains(&f.id.word());
        let first = found.findings.iter().find(worse);
        // A clock in another unit is read as what it is.
        let at_the_door =
            first.is_none() && id == "clock_rate" && reads_as(clean, &config, record.time.len()).is_ok();
        let right = at_the_door || first.is_some_and(|f| f.id.word() == id);
        if !right {
            missed.push(cause);
            println!("{name}, {cause}: {:?}", first.map(|f| (f.id, &f.joint, &f.evidence)));
        }
        let faults: Vec<_> = found.mended().filter(|f| f.severity == Severity::Error).collect();
        if faults.is_empty() {
            if let Some(first) = first.filter(|_| right) {
                println!("{name}, {cause}: no remedy, {}", first.evidence);
            }
            continue;
        }
        let corrected = folder.path().join("corrected.toml");
        std::fs::write(&corrected, found.corrected(&config, None).unwrap()).unwrap();
        let corrected = Config::read(&corrected).unwrap();
        let wrong = reads_as(clean, &corrected, record.time.len());
        assert_eq!(wrong, Ok(()), "{name}, {cause}: {:#?}", errors(&found));
        let again = check(&corrected, &mut |_| {}).unwrap();
        assert!(errors(&again).is_empty(), "{name}, {cause}, put right: {:#?}", errors(&again));
    }
    missed
}

fn example() -> Record {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7");
    Record::of(&format!(
        "robot = {:?}\n[[log]]\npath = {:?}\n",
        folder.join("robot.toml"),
        folder.join("train.csv.gz")
    ))
}

#[test]
fn the_right_cause_is_named_first_on_the_example() {
    assert_eq!(spoil("indy7", &example()), [""; 0]);
}

#[test]
#[ignore = "minutes; the ordinary run takes the example alone"]
fn the_right_cause_is_named_first_on_seven_robots() {
    let Some(data) = data() else { return };
    let file = |path: &str| data.join(path).display().to_string();
    let log = |robot: &str, log: &str, more: &str| {
        Record::of(&format!("robot = {:?}\n{more}\n[[log]]\npath = {:?}\n", file(robot), file(log)))
    };
    let currents = "[columns]\neffort = { columns = \"i{}\", unit = \"A\", scale = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47] }";
    let robots = [
        ("indy7", example()),
        (
            "ur10e",
            log("ur10e-innopolis/ur10e.urdf", "ur10e-innopolis/20_02_10-30sec_12harm.csv.gz", currents),
        ),
        ("panda", log("panda-gaz2019/panda_kinematics.urdf", "panda-gaz2019/exciting_trajectory.csv.gz", "")),
        ("ur10", log("ur10-unisa/ur10_kinematics.urdf", "ur10-unisa/exciting_trajectory.csv.gz", "")),
        (
            "rokae",
            log("rokae-xmate/xmate_kinematics.urdf", "rokae-xmate/run_b.csv.gz", "[columns]\nrate_hz = 1000"),
        ),
        ("ur5", log("oracles/logs/ur5_1k/nominal.urdf", "oracles/logs/ur5_1k/train.csv.gz", "")),
        ("iiwa", log("oracles/logs/iiwa_250/nominal.urdf", "oracles/logs/iiwa_250/train.csv.gz", "")),
    ];
    // Arms that exist have 3.5 to 19 kg per cubic metre of reach cubed, and a file without bodies or limits of effort says no more:
    // between them, efforts ten times too large or too small do not stand out clearly on both sides.
    let known = [
        ("panda", "efforts x 10"),
        ("panda", "efforts / 10"),
        // The pre-flight says that the log is not explained, which is so: this delay leaves a fifth of the efforts of this log.
        ("panda", "efforts late by 0.3 s"),
        ("ur10", "efforts x 10"),
        ("ur10", "zero of the third joint"),
        ("rokae", "efforts x 10"),
    ];
    let missed = robots
        .iter()
        .flat_map(|(name, clean)| spoil(name, clean).into_iter().map(move |cause| (*name, cause)));
    let new: Vec<_> = missed.filter(|m| !known.contains(m)).collect();
    assert!(new.is_empty(), "{new:?}");
}
