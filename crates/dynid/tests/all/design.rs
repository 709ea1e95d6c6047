//! Designs from end to end: designed, run on a virtual robot, identified.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::{Path, PathBuf};

use dynid::config::PerJoint;
use dynid::design::{CriterionName, DesignConfig, design};
use dynid::robot::{Robot, RobotOptions};
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Config, Estimate, identify};

/// Noise of the efforts, N m.
const NOISE: [f64; 6] = [0.6, 0.8, 0.4, 0.2, 0.2, 0.2];

fn robot_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml")
}

fn config() -> DesignConfig {
    let mut config = DesignConfig { robot: robot_path(), ..DesignConfig::default() };
    config.limits.acceleration = PerJoint::All(3.0);
    config.trajectory.rest = false;
    let noise = NOISE.iter().enumerate().map(|(k, s)| (format!("j{}", k + 1), *s));
    config.criterion.noise = PerJoint::Each(noise.collect());
    config.search.starts = 4;
    config
}

/// Runs a trajectory file on the virtual robot, effort noise alone, and identifies the robot from the log.
fn identified(folder: &Path, trajectory: &Path, seed: u64) -> Estimate {
    let noise: Vec<String> = NOISE.iter().enumerate().map(|(k, s)| format!("j{} = {s}", k + 1)).collect();
    let noise = noise.join(", ");
    let text = format!(
        "mode = 'closed_loop'\nfollow = '{}'\nseed = {seed}\nencoder_bits = 0\neffort_noise = 0.0\ndelay_samples = 0.0\n\
         [imperfections]\neffort_noise_absolute = {{ {noise} }}\nencoder_noise = 0.0\nripple_share = 0.0\n\
         outlier_share = 0.0\ndropped_share = 0.0\nclock_jitter_s = 0.0\n",
        trajectory.display()
    );
    let settings = SimulateSettings::parse(&text, "settings").unwrap();
    let robot = Robot::load(&robot_path(), &RobotOptions::default()).unwrap();
    let log = simulate(&robot, &settings).unwrap();
    let mut header = vec!["t".to_owned()];
    let mut columns: Vec<&[f64]> = vec![&log.time];
    for (name, signal) in [("q", &log.position), ("tau", &log.effort)] {
        for (joint, values) in log.joints.iter().zip(signal) {
            header.push(format!("{name}_{joint}"));
            columns.push(values);
        }
    }
    let path = folder.join("log.csv");
    dynid::io::csv::write(&path, &header, &columns).unwrap();
    let text = format!("robot = '{}'\n[[log]]\npath = '{}'\n", robot_path().display(), path.display());
    let config = Config::parse(&text, "run").unwrap();
    identify(&config, &mut |_| {}).unwrap().estimate()
}

/// Mean over base parameters of std(random) / std(designed), and the ratio of the mean relative standard deviations.
/// Values below 5 % of the largest of the same unit count as so large, as in the criterion: offsets are zero.
fn gain(designed: &Estimate, random: &Estimate) -> (f64, f64) {
    let base = &designed.base_parameters;
    let size = |k: usize| base[k].value.unwrap().abs();
    let scale: Vec<f64> = (0..base.len())
        .map(|k| {
            let alike = (0..base.len()).filter(|j| base[*j].unit == base[k].unit).map(size);
            size(k).max(0.05 * alike.fold(0.0, f64::max))
        })
        .collect();
    let std = |e: &Estimate, k: usize| e.base_parameters[k].std.unwrap();
    let n = base.len() as f64;
    let ratio = (0..base.len()).map(|k| std(random, k) / std(designed, k)).sum::<f64>() / n;
    let relative = |e: &Estimate| (0..base.len()).map(|k| std(e, k) / scale[k]).sum::<f64>() / n;
    (ratio, relative(random) / relative(designed))
}

#[test]
#[ignore = "a dozen seconds; the forecasts of the designs are tested where they are made"]
fn a_designed_log_tells_three_times_more_than_a_random_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.json");
    let config = config();
    let run = design(&config, &mut |_| {}).unwrap();
    let designed = run.outcome.as_ref().unwrap();
    designed.motion.file.write(&path).unwrap();
    let from_design = identified(folder.path(), &path, 1);
    let mut gains = Vec::new();
    for seed in 1..=5 {
        let random = run.random_motion(&config, seed).unwrap().unwrap();
        random.file.write(&path).unwrap();
        let from_random = identified(folder.path(), &path, 1);
        gains.push(gain(&from_design, &from_random));
    }
    println!("gain per random motion (mean ratio of stds, ratio of mean relative stds): {gains:.2?}");
    for pick in [|g: &(f64, f64)| g.0, |g: &(f64, f64)| g.1] {
        let mut ratios: Vec<f64> = gains.iter().map(pick).collect();
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[2] >= 3.0, "{gains:?}");
    }
    let forecast = designed.forecast.random.as_ref().unwrap();
    println!("forecast: mean {:.2}, geometric {:.2}", forecast.mean_ratio, forecast.geometric_ratio);
    assert!(forecast.mean_ratio >= 3.0);
}

#[test]
#[ignore = "two minutes: the table of docs/results.md over six criteria; the ordinary run takes the default one"]
fn table_of_criteria() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.json");
    for name in [
        CriterionName::RelativeStd,
        CriterionName::A,
        CriterionName::D,
        CriterionName::E,
        CriterionName::UnitCondition,
        CriterionName::Condition,
    ] {
        let mut config = config();
        config.criterion.name = Some(name);
        let run = design(&config, &mut |_| {}).unwrap();
        let designed = run.outcome.as_ref().unwrap();
        designed.motion.file.write(&path).unwrap();
        let from_design = identified(folder.path(), &path, 1);
        let mut gains = Vec::new();
        for seed in 1..=10 {
            let random = run.random_motion(&config, seed).unwrap().unwrap();
            random.file.write(&path).unwrap();
            gains.push(gain(&from_design, &identified(folder.path(), &path, 1)));
        }
        let median = |pick: &dyn Fn(&(f64, f64)) -> f64| {
            let mut x: Vec<f64> = gains.iter().map(pick).collect();
            x.sort_by(f64::total_cmp);
            0.5 * (x[4] + x[5])
        };
        if matches!(name, CriterionName::RelativeStd | CriterionName::A) {
            assert!(median(&|g| g.0) >= 3.0 && median(&|g| g.1) >= 3.0, "{name:?}: {gains:?}");
        }
        let f = &designed.forecast;
        let random = f.random.as_ref().unwrap();
        println!(
            "| {name:?} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            f.condition,
            f.condition_unit_norm,
            random.mean_ratio,
            random.geometric_ratio,
            median(&|g| g.0),
            median(&|g| g.1)
        );
    }
}
