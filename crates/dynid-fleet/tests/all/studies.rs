//! What a fleet gains, whether its intervals hold, which changes are found.

use std::time::Instant;

use dynid_fleet::drift::{DriftSettings, History, drift};
use dynid_fleet::{FitSettings, fit};

use crate::simulated::{JOINTS, Plan, SPREAD, YEAR, simulate};

const PLAIN: Plan =
    Plan { robots: 40, logs: 8, seed: 1, outliers: 0, broken: 0.0, wear: 0, faults: 0, covariates: false };

fn fleets(default: u64) -> u64 {
    std::env::var("DYNID_FLEETS").ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

#[test]
fn intervals_hold() {
    let (mut robots, mut type_, mut jack) = ((0, 0), (0, 0), (0, 0));
    for seed in 0..fleets(1) {
        let made = simulate(&Plan { seed, ..PLAIN });
        let started = Instant::now();
        let found = fit(&made.fleet, &FitSettings::default()).expect("fits");
        println!(
            "fit {:?}, {:?}, colours {:?}, ranks {:?}",
            started.elapsed(),
            found.settled,
            found.noise.colours,
            found.noise.ranks
        );
        for k in 0..3 * JOINTS {
            let sd = |v: f64| v.sqrt() / made.sizes[k];
            print!(
                "{:.3}/{:.3} {:.3}/{:.3}  ",
                sd(found.variances.robots[k]),
                SPREAD[k % 3].0,
                sd(found.variances.logs[k]),
                SPREAD[k % 3].1
            );
        }
        println!();
        for (robot, truth) in found.robots.iter().zip(&made.robots) {
            let robot = robot.as_ref().expect("has logs");
            for column in &made.arm.varying {
                let sd = robot.covariance[(*column, *column)].sqrt();
                robots.1 += 1;
                robots.0 += usize::from((robot.values[*column] - truth[*column]).abs() < 1.96 * sd);
            }
        }
        let jackknife = found.jackknife.as_ref().expect("robots");
        for column in (0..made.fleet.columns).filter(|c| !made.arm.varying.contains(c)) {
            let error = (found.values[column] - made.theta[column]).abs();
            type_.1 += 1;
            type_.0 += usize::from(error < 1.96 * found.covariance[(column, column)].sqrt());
            jack.1 += 1;
            jack.0 += usize::from(error < 2.02 * jackknife[(column, column)].sqrt());
        }
    }
    let share = |(n, all): (usize, usize)| 100.0 * n as f64 / all as f64;
    println!(
        "robots {:.1} %, shared by the model {:.1} %, by the jackknife {:.1} %",
        share(robots),
        share(type_),
        share(jack)
    );
}

#[test]
fn changes_are_found_and_dated() {
    let (mut faults, mut wear, mut false_robots, mut healthy) = (Vec::new(), Vec::new(), 0, 0);
    let plan = Plan {
        robots: 200,
        logs: 20,
        outliers: 10,
        broken: 0.01,
        wear: 12,
        faults: 5,
        covariates: true,
        seed: 0,
    };
    let small = Plan { robots: 60, wear: 4, faults: 2, outliers: 3, ..plan };
    let full = std::env::var_os("DYNID_FLEETS").is_some();
    for seed in 0..fleets(1) {
        let made = simulate(&Plan { seed: 100 + seed, ..if full { plan } else { small } });
        let started = Instant::now();
        let found = fit(&made.fleet, &FitSettings::default()).expect("fits");
        let fitted = started.elapsed();
        let told = drift(&made.fleet, &found, &DriftSettings::default()).expect("tests");
        println!(
            "fit {fitted:?}, drift {:?}, {:?}, threshold {:.1e}",
            started.elapsed() - fitted,
            found.settled,
            told.threshold
        );
        let weight = |r: usize| {
            found.robots[r].as_ref().expect("logs").weights.iter().fold(f64::INFINITY, |m, w| m.min(*w))
        };
        let caught = made.outliers.iter().filter(|r| weight(**r) < 0.3).count();
        let named =
            (0..made.fleet.robots.len()).filter(|r| weight(*r) < 0.3 && !made.outliers.contains(r)).count();
        let log_weight = |k: &usize| found.logs[*k].weights.iter().fold(f64::INFINITY, |m, w| m.min(*w));
        let broken = made.broken.iter().filter(|k| log_weight(k) < 0.2).count();
        let named_logs = (0..made.fleet.logs.len()).filter(|k| log_weight(k) < 0.2).count();
        println!(
            "outliers {caught}/{} others {named}; broken {broken}/{} of {named_logs} named",
            made.outliers.len(),
            made.broken.len()
        );
        for (r, robot) in told.robots.iter().enumerate() {
            let truth = made.changes.iter().find(|c| c.robot == r);
            match (&robot.history, truth) {
                (History::Changed { .. }, None) => false_robots += 1,
                (_, None) => healthy += 1,
                (History::Changed { changes, .. }, Some(truth)) => {
                    let first = &changes[0];
                    let date = first.time_s / YEAR - truth.at;
                    let covered = (first.from_s / YEAR - 0.03..=first.to_s / YEAR + 0.03).contains(&truth.at);
                    let lambda = (first.size / first.sd).powi(2);
                    println!(
                        "T {:.1} of coordinate {}, {} logs weights {:.2?}",
                        lambda,
                        truth.coordinate,
                        robot.logs.len(),
                        robot
                            .logs
                            .iter()
                            .map(|l| found.logs[*l].weights[truth.coordinate])
                            .collect::<Vec<_>>()
                    );
                    let row = (
                        true,
                        first.coordinate == truth.coordinate,
                        date.abs(),
                        covered,
                        lambda,
                        first.step == truth.step,
                        truth.at,
                    );
                    if truth.step { faults.push(row) } else { wear.push(row) }
                }
                (History::Unchanged { p }, Some(truth)) => {
                    println!("missed {truth:?}, p {p:.1e}, T {:.1}", robot.statistics[truth.coordinate]);
                    let row = (false, false, 1.0, false, robot.statistics[truth.coordinate], false, truth.at);
                    if truth.step { faults.push(row) } else { wear.push(row) }
                }
                _ => panic!("20 logs are a history"),
            }
        }
        println!("false so far {false_robots} of {}", healthy + false_robots);
    }
    let share = |rows: &[&(bool, bool, f64, bool, f64, bool, f64)],
                 of: &dyn Fn(&(bool, bool, f64, bool, f64, bool, f64)) -> bool| {
        100.0 * rows.iter().filter(|r| of(r)).count() as f64 / rows.len().max(1) as f64
    };
    let strong: Vec<_> = wear.iter().filter(|w| w.4 >= 36.0).collect();
    for (name, rows) in [
        ("faults", faults.iter().collect::<Vec<_>>()),
        ("wear, strong", strong),
        ("wear", wear.iter().collect()),
    ] {
        println!(
            "{name}: {} found {:.0} %, coordinate {:.0} %, within 0.1 {:.0} %, interval {:.0} %, kind {:.0} %",
            rows.len(),
            share(&rows, &|r| r.0),
            share(&rows, &|r| r.1),
            share(&rows, &|r| r.2 < 0.1),
            share(&rows, &|r| r.3),
            share(&rows, &|r| r.5)
        );
    }
    println!("false robots {false_robots} of {}", healthy + false_robots);
}

#[test]
fn large_fleet() {
    let Ok(robots) = std::env::var("DYNID_ROBOTS").map(|n| n.parse().expect("a number")) else { return };
    let covariates = std::env::var_os("DYNID_PLAIN").is_none();
    let made = simulate(&Plan { robots, logs: 20, covariates, ..PLAIN });
    let started = Instant::now();
    let found = fit(&made.fleet, &FitSettings::default()).expect("fits");
    let fitted = started.elapsed();
    let _ = drift(&made.fleet, &found, &DriftSettings::default()).expect("tests");
    println!("{robots} robots: fit {fitted:?}, drift {:?}", started.elapsed() - fitted);
}
