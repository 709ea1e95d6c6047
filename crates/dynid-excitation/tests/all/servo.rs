//! Designs for drives that are told positions: gradients, and limits that the robot keeps behind them.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;
use dynid_linalg::Mat;

use crate::problems::{gantry, gantry_robot};

/// The gantry behind drives: every column that readings tell.
fn behind_drives(criterion: Criterion) -> Problem {
    let robot = gantry_robot();
    let table = dynid_model::EffortModel::parameters(robot.model.as_ref());
    let effort = |name: String| ServoColumn::Effort(table.column(&name).unwrap());
    let mut columns = vec![
        ("gain", ServoColumn::PositionGain(vec![0, 1])),
        ("gain of turns", ServoColumn::PositionGain(vec![2, 3])),
        ("delay", ServoColumn::Delay(vec![0, 1, 2, 3])),
        ("zero", ServoColumn::Zero(2)),
        ("other zero", ServoColumn::Zero(3)),
        ("peak", ServoColumn::Stiction { joint: 2, velocity: 0.4 }),
        ("width", ServoColumn::Stribeck { joint: 2, velocity: 0.4, stiction: 0.7 }),
    ];
    for (name, symbol, joints) in [("fc", "fc", 0..4), ("fv", "fv", 0..4), ("fo", "fo", 2..4)] {
        columns.extend(joints.map(|j| (name, effort(format!("j{}.{symbol}", j + 1)))));
    }
    let info = |(name, column): (&str, ServoColumn)| {
        (column, ColumnInfo { name: name.to_owned(), unit: String::new(), nominal: None })
    };
    // Of the gantry itself: slides behind stiff drives, turns behind softer ones that overshoot.
    let loops = [(9e3, 900.0, 70.0), (9e3, 700.0, 30.0), (120.0, 5.0, 3.0), (60.0, 3.0, 1.0)];
    let loops = loops.map(|(position_gain, velocity_gain, inertia)| PositionLoop {
        position_gain,
        velocity_gain,
        damping: 1.1 * velocity_gain,
        inertia,
        delay: 0.02,
    });
    let mut problem = gantry();
    problem.constraints.clear();
    problem.criterion = criterion;
    problem.model = Box::new(ServoExcitation::new(
        robot.model.clone(),
        robot.nominal.clone(),
        loops.to_vec(),
        problem.period(),
        columns.into_iter().map(info).collect(),
    ));
    problem
}

fn motion() -> Vec<Vec<f64>> {
    (0..4).map(|j| (0..11).map(|k| 0.15 * ((3 * j + 2 * k) as f64).sin()).collect()).collect()
}

#[test]
fn criteria_behind_drives_agree_with_differences() {
    let columns = behind_drives(Criterion::raw(Measure::Condition)).model.columns().len();
    let spread: Vec<f64> = (0..columns).map(|k| (2.0 * (3.0 * k as f64).sin()).exp()).collect();
    let of = Mat::from_fn(3, columns, |i, j| (1.0 + i as f64 + 2.0 * j as f64).cos());
    let measures = [
        Measure::Trace(spread),
        Measure::Determinant,
        Measure::Condition,
        Measure::Largest { of, order: 3.0 },
    ];
    for measure in measures {
        let mut problem = behind_drives(Criterion::unit_norm(measure.clone()));
        problem.sign_width = 0.3;
        let at = motion();
        let samples = 60;
        let (_, gradient) = criterion_gradient(&problem, &at, samples).unwrap();
        let largest = gradient.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (joint, k) in [(0, 1), (1, 7), (2, 0), (2, 3), (3, 10)] {
            let h = 1e-4;
            let value = |shift: f64| {
                let mut x = at.clone();
                x[joint][k] += shift * h;
                criterion_gradient(&problem, &x, samples).unwrap().0
            };
            let wanted = (8.0 * (value(1.0) - value(-1.0)) - (value(2.0) - value(-2.0))) / (12.0 * h);
            let found = gradient[joint][k];
            assert!((found - wanted).abs() <= 2e-6 * largest, "{measure:?} {joint} {k}: {found} {wanted}");
        }
    }
}

#[test]
fn a_design_keeps_limits_of_the_command_and_of_what_follows_it() {
    let mut problem = behind_drives(Criterion::unit_norm(Measure::Determinant));
    problem.harmonics = 8;
    problem.samples = 160;
    // Jerk would keep the motion away from where the loops overshoot.
    problem.limits.iter_mut().for_each(|l| (l.acceleration, l.jerk) = (40.0, f64::INFINITY));
    let settings = Settings { starts: 1, ..Settings::default() };
    let outcome = design(&problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    let uses = limit_points(&problem, &found.coefficients, 20_000, f64::NEG_INFINITY);
    assert!(uses.iter().all(|u| u.excess <= 1e-6), "{uses:?}");
    let acts = |kind: LimitKind| uses.iter().any(|u| u.kind == kind && u.excess > -1e-2);
    assert!(acts(LimitKind::Velocity) && acts(LimitKind::FollowedVelocity), "{uses:?}");
    let named = uses.iter().filter(|u| u.kind == LimitKind::FollowedPosition).count();
    assert_eq!(named, 4);
}
