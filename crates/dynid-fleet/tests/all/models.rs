//! What a fitted fleet says of its type and of robots that have changed, for estimators that know nothing of robots.

use dynid_factor::{Factor, FactorBuilder};
use dynid_fleet::drift::{Change, Kind};
use dynid_fleet::{ChannelFactor, Coordinate, Fleet, FleetFit, FleetLog, Noise, RobotFit, Variances, fit_at};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ROBOTS: usize = 12;
const LOGS: usize = 8;
const ROWS: usize = 40;
const COLUMNS: usize = 5;
/// Columns 1 and 3 vary, by these standard deviations between robots and between logs.
const VARYING: [(usize, f64, f64); 2] = [(1, 0.5, 0.1), (3, 0.3, 0.05)];
const TYPE: [f64; COLUMNS] = [2.0, 1.0, -1.0, 3.0, 0.5];
const SLOPE: f64 = 0.4;
const SIGMA: f64 = 0.2;

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

struct Made {
    fleet: Fleet,
    /// Per robot its parameters at the last log.
    now: Vec<Vec<f64>>,
}

/// A fleet whose first column that varies follows a covariate; in robot 0 it steps by `step` before the fifth log.
fn made(seed: u64, step: f64) -> Made {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut logs, mut now) = (Vec::new(), Vec::new());
    for robot in 0..ROBOTS {
        let mut own = TYPE.to_vec();
        VARYING.iter().for_each(|(column, sd, _)| own[*column] += sd * normal(&mut rng));
        let mut at_last = own.clone();
        at_last[1] += if robot == 0 { step } else { 0.0 };
        now.push(at_last);
        for log in 0..LOGS {
            let covariate: f64 = rng.random_range(-1.0..1.0);
            let mut x = own.clone();
            VARYING.iter().for_each(|(column, _, sd)| x[*column] += sd * normal(&mut rng));
            x[1] += SLOPE * covariate + if robot == 0 && log >= 4 { step } else { 0.0 };
            // Column 0 acts on the first channel, column 4 on the second.
            let channels = [vec![0, 1, 2, 3], vec![1, 2, 3, 4]].into_iter().enumerate();
            let channels = channels.map(|(channel, columns)| {
                let mut builder = FactorBuilder::new(columns.len());
                for _ in 0..ROWS {
                    let row: Vec<f64> = columns.iter().map(|_| normal(&mut rng)).collect();
                    let clean: f64 = row.iter().zip(&columns).map(|(a, c)| a * x[*c]).sum();
                    builder.push_row(&row, clean + SIGMA * normal(&mut rng)).expect("finite");
                }
                ChannelFactor { channel, columns, factor: builder.finish() }
            });
            logs.push(FleetLog {
                robot,
                key: (robot * LOGS + log) as u64,
                time_s: log as f64,
                covariates: vec![covariate],
                channels: channels.collect(),
            });
        }
    }
    let coordinate = |(kind, (column, ..)): (usize, &(usize, f64, f64))| Coordinate {
        column: *column,
        between_robots: true,
        between_logs: true,
        watched: true,
        kind,
    };
    let fleet = Fleet {
        columns: COLUMNS,
        channels: 2,
        robots: (0..ROBOTS as u64).collect(),
        covariates: 1,
        varying: VARYING.iter().enumerate().map(coordinate).collect(),
        logs,
    };
    Made { fleet, now }
}

fn truth_of(fleet: &Fleet) -> (Noise, Variances) {
    let noise = Noise {
        ranks: vec![4, 4],
        variances: vec![vec![SIGMA * SIGMA; 2]; fleet.logs.len()],
        colours: vec![1.0; 2],
    };
    let of = |sd: fn(&(usize, f64, f64)) -> f64| VARYING.iter().map(|v| sd(v).powi(2)).collect();
    (noise, Variances::new(of(|v| v.1), of(|v| v.2), (fleet.robots.len(), fleet.logs.len())))
}

/// Rows of robots are those of an ordinary least-squares problem whose solution is the type; their residuals have unit variance.
#[test]
fn rows_of_robots_give_the_type() {
    let Made { fleet, .. } = made(1, 0.0);
    let (noise, variances) = truth_of(&fleet);
    let fit = fit_at(&fleet, noise, variances).expect("fits");
    let said = fit.said_by_robots().expect("fits");
    assert_eq!(said.iter().map(|(r, _)| *r).collect::<Vec<_>>(), (0..ROBOTS).collect::<Vec<_>>());
    let merged = Factor::merge(&said.iter().map(|(_, factor)| factor).collect::<Vec<_>>());
    for (found, expected) in merged.solve().iter().zip(&fit.values) {
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    }
    let freedom = (merged.rows() - COLUMNS) as f64;
    let variance = merged.rss(&fit.values) / freedom;
    assert!((variance - 1.0).abs() < 4.0 * (2.0 / freedom).sqrt(), "{variance} of {freedom}");
}

/// A log's own values are those that least squares of the log alone scatter about.
#[test]
fn values_of_logs_follow_covariates() {
    let Made { fleet, .. } = made(2, 0.0);
    let (noise, variances) = truth_of(&fleet);
    let fit = fit_at(&fleet, noise, variances).expect("fits");
    let (mut far, mut near) = (0.0, 0.0);
    for (k, log) in fleet.logs.iter().enumerate() {
        let own = fit.values_of_log(&fleet, k).expect("the robot has logs");
        let robot = fit.robots[log.robot].as_ref().expect("has logs");
        let alone = log.channels[0].factor.solve();
        near += (alone[1] - own[1]).powi(2);
        far += (alone[1] - robot.values[1]).powi(2);
    }
    assert!(near < 0.3 * far, "{near} {far}");
}

#[test]
fn silent_channels_tell_nothing() {
    let Made { fleet, .. } = made(3, 0.0);
    let (noise, variances) = truth_of(&fleet);
    let fit = fit_at(&fleet, noise, variances).expect("fits");
    let without = fit.without(&fleet, &[false, true]).expect("fits");
    let sd = |fit: &FleetFit, c: usize| fit.covariance[(c, c)].sqrt();
    assert!(sd(&without, 4) > 1e4 * sd(&fit, 4), "column 4 acts on the silent channel alone");
    assert!(sd(&without, 0) < 1.5 * sd(&fit, 0));
    let all = fit.without(&fleet, &[false, false]).expect("fits");
    assert_eq!(all.values, fit.values);
}

fn now_of(fit: &FleetFit, fleet: &Fleet, robot: usize, changes: &[Change]) -> RobotFit {
    fit.robots_now(fleet, &[(robot, changes)]).expect("fits").remove(0).expect("has logs")
}

fn step(size: f64, time_s: f64, step: bool) -> Change {
    Change {
        coordinate: 0,
        kind: if step { Kind::Step } else { Kind::Ramp },
        step,
        size,
        sd: 0.05,
        evidence: 100.0,
        p: 1e-9,
        time_s,
        from_s: time_s,
        to_s: time_s,
        together: 1,
    }
}

/// Over fleets the robot's parameters at its last log lie within their deviations; without the change they are off.
#[test]
fn a_robot_that_has_changed_is_what_it_is_now() {
    let (mut squares, mut ignored, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..60 {
        let Made { fleet, now } = made(100 + seed, 2.0);
        let (noise, variances) = truth_of(&fleet);
        let fit = fit_at(&fleet, noise, variances).expect("fits");
        let robot = now_of(&fit, &fleet, 0, &[step(2.0, 3.5, true)]);
        let before = fit.robots[0].as_ref().expect("has logs");
        for column in [1, 3] {
            let sd = robot.covariance[(column, column)].sqrt();
            squares += ((robot.values[column] - now[0][column]) / sd).powi(2);
            count += 1.0;
        }
        ignored += ((before.values[1] - now[0][1]) / before.covariance[(1, 1)].sqrt()).powi(2);
    }
    let z = squares / count;
    assert!((z - 1.0).abs() < 4.0 * (2.0_f64 / count).sqrt(), "{z}");
    assert!(ignored / 60.0 > 20.0, "{}", ignored / 60.0);
}

/// Without changes it is the robot of the fit; a change that may be there widens what is known of today.
#[test]
fn nothing_changes_without_changes() {
    let Made { fleet, .. } = made(5, 0.0);
    let (noise, variances) = truth_of(&fleet);
    let fit = fit_at(&fleet, noise, variances).expect("fits");
    for r in 0..ROBOTS {
        let now = now_of(&fit, &fleet, r, &[]);
        let known = fit.robots[r].as_ref().expect("has logs");
        for i in 0..COLUMNS {
            assert!((now.values[i] - known.values[i]).abs() < 1e-10);
            for j in 0..COLUMNS {
                let (a, b) = (now.covariance[(i, j)], known.covariance[(i, j)]);
                assert!((a - b).abs() < 1e-12, "{i} {j}: {a} {b}");
            }
        }
    }
    let (at_once, some_day) =
        (step(0.5, 3.5, true), Change { from_s: 1.5, to_s: 5.5, ..step(0.5, 3.5, true) });
    let sd = |change: Change| now_of(&fit, &fleet, 1, &[change]).covariance[(1, 1)].sqrt();
    assert!(sd(some_day) > 1.05 * sd(at_once), "a date that is not known leaves more open");
    let ramp = now_of(&fit, &fleet, 1, &[step(0.5, 0.0, false)]);
    let known = fit.robots[1].as_ref().expect("has logs");
    assert!(
        ramp.covariance[(1, 1)] > 2.0 * known.covariance[(1, 1)],
        "a ramp that may be there widens today"
    );
}
