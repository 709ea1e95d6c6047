//! Friction that gives way after a reversal, found in logs of a simulated arm whose robot file knows nothing of it.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid::config::LogConfig;
use dynid::estimate::Estimate;
use dynid::io::MappingSpec;
use dynid::log::Log;
use dynid::motion::Portion;
use dynid::predict::efforts;
use dynid::reduce::WindowSettings;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::{Config, Robot, RobotOptions, identify};

use crate::reduce_long::apart;
use crate::support::{ARM, write_log};

/// Most of the friction of the first joint gives way over 4 mrad, all of the second over 2.
const TRUTH: &str = r#"[element.j1]
elements = ["coulomb", "viscous", "offset", "rotor", "maxwell_slip"]
coulomb = { effort = 0.4 }
viscous = { coefficient = 0.5 }
rotor = { inertia = 0.2 }
maxwell_slip = { friction = 1.2, travel = 0.004 }
[element.j2]
elements = ["viscous", "offset", "rotor", "maxwell_slip"]
viscous = { coefficient = 0.2 }
rotor = { inertia = 0.1 }
maxwell_slip = { friction = 0.6, travel = 0.002 }
"#;

fn log(folder: &Path, name: &str, seed: u64, seconds: usize) -> SimulatedLog {
    std::fs::write(folder.join("arm.toml"), ARM).unwrap();
    std::fs::write(folder.join("truth.toml"), format!("{ARM}{TRUTH}")).unwrap();
    let robot = Robot::load(&folder.join("truth.toml"), &RobotOptions::default()).unwrap();
    let settings = format!(
        "mode = \"closed_loop\"\nduration_s = {seconds}\nrate_hz = 500\nseed = {seed}\neffort_noise = 0.005\n\
         [imperfections]\nripple_share = 0\n"
    );
    let log = simulate(&robot, &SimulateSettings::parse(&settings, "simulation").unwrap()).unwrap();
    write_log(&log, &folder.join(name));
    log
}

fn config(folder: &Path, more: &str) -> Config {
    let path = folder.join("run.toml");
    let logs = "[[log]]\npath = \"log.csv\"\n[[validation]]\npath = \"other.csv\"\n";
    std::fs::write(&path, format!("robot = \"arm.toml\"\n{more}\n{logs}")).unwrap();
    Config::read(&path).unwrap()
}

/// How late friction turns over is a travel, not a delay: joints agree about the delay once their travels are found, which grids of them do not tell.
#[test]
fn joints_with_springs_agree_about_the_delay() {
    let folder = tempfile::tempdir().unwrap();
    log(folder.path(), "log.csv", 20, 20);
    let path = folder.path().join("run.toml");
    std::fs::write(&path, "robot = \"arm.toml\"\n[[log]]\npath = \"log.csv\"\n").unwrap();
    let found = identify(&Config::read(&path).unwrap(), &mut |_| {}).unwrap();
    let delay = &found.conditioning.as_ref().unwrap().delay;
    println!("{delay:?}");
    // The log leads by 0.3 samples.
    assert!(delay.chi_squared.unwrap() < 3.0 && (delay.samples - 0.3).abs() < 0.45, "{delay:?}");
    assert!(found.friction.iter().all(|joint| joint.has_spring()));
}

#[test]
fn springs_in_friction_are_found_and_predict_another_motion() {
    let folder = tempfile::tempdir().unwrap();
    log(folder.path(), "log.csv", 5, 20);
    log(folder.path(), "other.csv", 8, 10);
    let estimate = |more: &str| identify(&config(folder.path(), more), &mut |_| {}).unwrap().estimate();
    let found = estimate("");
    for (joint, travel, friction) in [("j1", 0.004, 1.6), ("j2", 0.002, 0.6)] {
        let shape = found.shape_parameters.iter().find(|s| s.name == format!("{joint}.travel")).unwrap();
        let (low, high) = shape.interval.unwrap();
        println!("{}: {low:.5} to {high:.5}, truth {travel}", shape.name);
        assert!((shape.value / travel - 1.0).abs() < 0.05, "{}: {}", shape.name, shape.value);
        let value = |symbol: &str| {
            let name = format!("{joint}.{symbol}");
            found.parameters.iter().find(|p| p.name == name).unwrap().value
        };
        // Which part turns over at once is told by the few rows in which the joint sticks; the sum by all.
        let (fc, fm) = (value("fc"), value("fm"));
        println!("{joint}: fc {fc:.4}, fm {fm:.4}, truth of the sum {friction}");
        assert!((fc + fm - friction).abs() < 0.02 * friction && fm > 0.6 * friction, "{joint}: {fc} {fm}");
    }
    let trial = found.conditioning.friction_trials.iter().find(|t| t.element == "maxwell_slip").unwrap();
    assert!(trial.accepted && trial.gain > 3.0 * trial.standard_error, "{trial:?}");

    let given = estimate("[elements]\nfriction = \"given\"");
    assert!(given.shape_parameters.is_empty());
    let error = |e: &Estimate| e.validation[0].filtered.relative_error.unwrap();
    println!("another motion: {:.4} with springs, {:.4} without", error(&found), error(&given));
    assert!(error(&found) < 0.4 * error(&given), "{} against {}", error(&found), error(&given));

    // Neither has a form for friction that remembers.
    let searched = estimate("[estimator.search]\nalgorithms = [\"abc\"]\nevaluations = 200\n");
    let scaled = estimate("[[log]]\npath = \"other.csv\"\nown = [\"friction_scale\"]\n");
    for without in [searched, scaled] {
        let trials = &without.conditioning.friction_trials;
        assert!(trials.iter().all(|t| t.element != "maxwell_slip"), "{trials:?}");
    }
}

/// States that have a time are followed, whatever their steps; others show friction as it is away from reversals.
#[test]
fn states_with_a_time_are_followed() {
    let folder = tempfile::tempdir().unwrap();
    log(folder.path(), "log.csv", 5, 20);
    let other = log(folder.path(), "other.csv", 8, 10);
    let run = identify(&config(folder.path(), ""), &mut |_| {}).unwrap();
    let (model, values) = run.identified_model();
    let error = |kept: &dyn Fn(usize) -> bool, has_time: bool| {
        let pick = |signal: &Vec<f64>| -> Vec<f64> {
            signal.iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, x)| *x).collect()
        };
        let [position, velocity, acceleration, effort] =
            [0, 1, 2, 3].map(|k| other.clean[k].iter().map(pick).collect::<Vec<_>>());
        let time = pick(&other.time);
        let states = dynid::io::States {
            rows: time.len(),
            position,
            velocity,
            acceleration,
            gravity: None,
            channels: Vec::new(),
            time: has_time.then_some(time),
        };
        let predicted = efforts(model, values, &states).unwrap();
        let square = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>();
        let pairs = || predicted.iter().flatten().zip(effort.iter().flatten());
        (square(&mut pairs().map(|(p, e)| p - e)) / square(&mut pairs().map(|(_, e)| *e))).sqrt()
    };
    let (followed, uneven, steady) =
        (error(&|_| true, true), error(&|k| k % 3 != 1, true), error(&|_| true, false));
    println!("followed {followed:.4}, uneven steps {uneven:.4}, steady {steady:.4}");
    assert!(followed < 0.01 && uneven < 0.01 && steady > 0.03, "{followed} {uneven} {steady}");
}

/// A window goes on with the springs as the one before left them.
#[test]
fn windows_of_a_log_leave_what_the_whole_log_leaves() {
    let folder = tempfile::tempdir().unwrap();
    log(folder.path(), "log.csv", 5, 20);
    log(folder.path(), "other.csv", 8, 10);
    let run = identify(&config(folder.path(), ""), &mut |_| {}).unwrap();
    let recipe = run.recipe().unwrap();
    let reducer = |part_rows, samples| {
        let reducer = recipe.clone().reducer().unwrap();
        reducer.with_windows(WindowSettings { part_rows, samples })
    };
    let file = LogConfig { path: folder.path().join("log.csv"), ..LogConfig::default() };
    let robot = reducer(1, 1).robot().clone();
    let signals = dynid::logs::load(&file, &robot.axes, &MappingSpec::default(), None).unwrap().log;
    // Its last row repeats the stamp before: all rows that count are in the part that is looked at, though it has more rows than that.
    let rows = signals.rows();
    let mut more = Portion::of(signals.clone());
    more.append(&Portion::of(signals).part(rows - 1..rows));
    let log = || Log::new(&robot, more.clone().into_log("more").unwrap()).unwrap();
    let whole = reducer(rows + 1, 1).reduce(log()).unwrap();
    for samples in [700, 2999] {
        let windows = reducer(rows, samples).reduce(log()).unwrap();
        let found = apart(&whole, &windows);
        println!("windows of {samples} samples: {found:e}");
        assert!(found < 1e-12, "{samples}: {found:e}");
    }
}
