//! Designs of the acceptance table: reached, within all limits.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::problems;
use crate::support::*;
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;

const PI: f64 = std::f64::consts::PI;

/// Condition numbers of the first starts; every start ends within all limits, looked at in 10 000 instants, the best in
/// 100 000.
fn conditions(problem: &Problem, starts: usize) -> Vec<f64> {
    let settings = Settings { starts, ..Settings::default() };
    let outcome = design(problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    assert_eq!(found.starts.len(), starts);
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    for start in &found.starts {
        assert!(start.is_feasible(), "{start:?}");
        let broken = limit_points(problem, &map.coefficients(&start.unknowns), 10_000, 1e-6);
        assert!(broken.is_empty(), "seed {}: {broken:?}", start.seed);
    }
    let broken = limit_points(problem, &found.coefficients, 100_000, 1e-6);
    assert!(broken.is_empty(), "{broken:?}");
    found.starts.iter().map(|s| s.criterion.unwrap().exp()).collect()
}

// Bounds are those of the acceptance table for all starts; a run over more starts is in statistics.rs.

#[test]
fn indy7_keeps_clear_of_floor_and_column() {
    let Some(problem) = problems::indy7(false) else { return };
    assert_eq!(problem.model.columns().len(), 58);
    let found = conditions(&problem, 4);
    assert!(found.iter().all(|c| *c <= 31.5), "{found:?}");
}

#[test]
fn indy7_from_rest_to_rest() {
    let Some(problem) = problems::indy7(true) else { return };
    let found = conditions(&problem, 2);
    assert!(found.iter().all(|c| *c <= 33.0), "{found:?}");
}

#[test]
fn er16_with_its_torques_and_wrist() {
    let Some(problem) = problems::er16(false) else { return };
    assert_eq!(problem.model.columns().len(), 15);
    let found = conditions(&problem, 10);
    assert!(found.iter().all(|c| *c <= 34.0), "{found:?}");
    assert!(found.iter().any(|c| *c <= 30.5), "{found:?}");
    let Some(problem) = problems::er16(true) else { return };
    assert_eq!(problem.model.columns().len(), 24);
    let found = conditions(&problem, 8);
    assert!(found.iter().any(|c| *c <= 65.0), "{found:?}");
}

#[test]
fn ur10_from_its_file() {
    for (apart, starts) in [(false, 6), (true, 2)] {
        let Some(problem) = problems::ur10(apart) else { return };
        assert_eq!(problem.model.columns().len(), 36);
        let found = conditions(&problem, starts);
        assert!(found.iter().all(|c| *c <= 16.0), "{found:?}");
    }
}

#[test]
fn slides_jerk_limits_and_start_poses() {
    let mut problem = problems::gantry();
    conditions(&problem, 2);
    let pose = vec![0.1, 0.1, 0.2, -0.3];
    problem.start = StartConditions { rest: true, zero_jerk: true, pose: Some(pose.clone()) };
    let settings = Settings { starts: 2, ..Settings::default() };
    let outcome = design(&problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    assert!(limit_points(&problem, &found.coefficients, 100_000, 1e-6).is_empty());
    // Jerk acts; without its limit the design is better.
    assert!(found.starts.iter().all(StartOutcome::is_feasible));
    let acting = limit_points(&problem, &found.coefficients, 10_000, -1e-3);
    assert!(acting.iter().any(|p| p.kind == LimitKind::Jerk), "{acting:?}");
    let basis = dynid_motion::trajectory::FourierBasis::new(problem.base, 5, vec![0.0]);
    for (x, pose) in found.coefficients.iter().zip(pose) {
        for (derivative, wanted) in [(0, pose), (1, 0.0), (2, 0.0), (3, 0.0)] {
            let mut value = [0.0];
            basis.evaluate(derivative, x, &mut value);
            assert!((value[0] - wanted).abs() < 1e-12, "{derivative}: {value:?}");
        }
    }
}

/// The first start alone sets out from the trajectory given, whatever it breaks.
#[test]
fn sets_out_from_a_given_trajectory() {
    let mut problem = problems::gantry();
    let pose = vec![0.1, 0.1, 0.2, -0.3];
    problem.start = StartConditions { rest: true, zero_jerk: false, pose: Some(pose) };
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    let found = |settings: &Settings| match design(&problem, settings, Vec::new(), &mut |_| {}).unwrap() {
        Outcome::Found(found) => found,
        other => panic!("{other:?}"),
    };
    let plain = found(&Settings { starts: 2, ..Settings::default() });
    let large: Vec<Vec<f64>> =
        plain.coefficients.iter().map(|row| row.iter().map(|x| 5.0 * x + 0.01).collect()).collect();
    let settings = Settings { starts: 2, from: Some(large), ..Settings::default() };
    let given = found(&settings);
    assert_eq!(given.starts[1], plain.starts[1]);
    assert!(given.starts[0] != plain.starts[0]);
    assert!(given.starts[0].is_feasible(), "{given:?}");
    let broken = limit_points(&problem, &map.coefficients(&given.starts[0].unknowns), 10_000, 1e-6);
    assert!(broken.is_empty(), "{broken:?}");
    // Another seed draws nothing else.
    let one = |seed| found(&Settings { starts: 1, seed, ..settings.clone() }).coefficients;
    assert_eq!(one(1), one(9));
}

#[test]
fn results_depend_neither_on_threads_nor_on_interruptions() {
    let Some(problem) = problems::er16(false) else { return };
    let settings = Settings { starts: 5, ..Settings::default() };
    let run = |threads: usize, done: Vec<StartOutcome>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut heard = Vec::new();
        let outcome =
            pool.install(|| design(&problem, &settings, done, &mut |s| heard.push(s.seed)).unwrap());
        let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
        // Starts are heard of as they end.
        heard.sort_unstable();
        (found, heard)
    };
    let (one, heard) = run(1, Vec::new());
    assert_eq!(heard, [1, 2, 3, 4, 5]);
    for threads in [2, 7] {
        assert_eq!(run(threads, Vec::new()), (one.clone(), heard.clone()), "{threads} threads");
    }
    // Two starts are there already, one of another run is not taken.
    let mut done = vec![one.starts[3].clone(), one.starts[1].clone(), one.starts[0].clone()];
    done[2].seed = 77;
    assert_eq!(run(2, done), (one.clone(), vec![1, 3, 5]));
    // Time that is up cuts the first start short, which gives a trajectory within the limits all the same, and lets no other begin.
    let hurried = Settings { time_budget_s: Some(0.0), ..settings.clone() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let outcome = pool.install(|| design(&problem, &hurried, Vec::new(), &mut |_| {}).unwrap());
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    assert_eq!(found.starts.iter().map(|s| s.seed).collect::<Vec<_>>(), [1]);
    let first = found.best();
    assert!(first.cut && first.is_feasible(), "{first:?}");
    assert!(first.evaluations < one.starts[0].evaluations, "{first:?}");
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    let broken = limit_points(&problem, &map.coefficients(&first.unknowns), 10_000, 1e-6);
    assert!(broken.is_empty(), "{broken:?}");
}

/// The two-axis pointing mechanism as a tree, with the eight columns of its ideal model.
fn pointing(criterion: Criterion) -> Problem {
    use dynid_model::*;
    let mut d = Description::new("pointing");
    d.gravity = [-9.80665, 0.0, 0.0];
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    for (k, (parent, placement)) in [
        ("base", Placement::identity()),
        ("link1", Placement::translate(0.1, 0.0, 0.0).then(&Placement::rotate([1.0, 0.0, 0.0], PI / 2.0))),
    ]
    .into_iter()
    .enumerate()
    {
        d.links.push(LinkDescription { name: format!("link{}", k + 1), inertia: None });
        d.joints.push(JointDescription {
            name: format!("j{}", k + 1),
            parent: parent.into(),
            child: format!("link{}", k + 1),
            kind: JointKind::Revolute,
            placement,
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    let mechanism = d.build().unwrap();
    // mx1, Izz1; mx2, Ixx2, Ixy2, Ixz2, Iyz2, Izz2.
    let kept = vec![1, 9, 11, 14, 15, 16, 18, 19];
    let robot = RobotExcitation::of_columns(model(&mechanism, 0..0, false).into(), Vec::new(), kept);
    let limit = |q: f64, v: f64| MotionLimits {
        position: (-q, q),
        velocity: v,
        acceleration: 1.0,
        jerk: f64::INFINITY,
    };
    Problem {
        coordinates: mechanism.rate_names(),
        limits: vec![limit(1.2, 0.25), limit(1.0, 0.2)],
        constraints: Vec::new(),
        base: 0.4,
        harmonics: 5,
        start: StartConditions { rest: true, zero_jerk: false, pose: Some(vec![0.0, 0.0]) },
        criterion,
        output_weights: vec![1.0; 2],
        effective_samples: 200.0,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples: 100,
        model: Box::new(robot),
    }
}

const POINTING_TABLE_1: [[f64; 11]; 2] = [
    [0.111, 0.243, -6.5e-10, -0.028, -0.033, -0.005, -0.113, -0.01, 0.001, 0.013, -0.003],
    [-0.306, 0.251, -0.029, -0.016, -0.015, -0.017, 0.372, -0.037, -0.033, 0.003, 0.001],
];

#[test]
fn pointing_mechanism() {
    let published: Vec<Vec<f64>> = POINTING_TABLE_1.iter().map(|r| r.to_vec()).collect();
    for (criterion, published_value, required) in [
        (Criterion::unit_norm(Measure::Condition), 3.5015570106725002, 2.0),
        (Criterion::raw(Measure::Condition), 554.3202984447128, 150.0),
    ] {
        let problem = pointing(criterion.clone());
        let value = criterion.value(&information(&problem, &published, 200)).unwrap().exp();
        assert!((value / published_value - 1.0).abs() < 1e-6, "{value}");
        assert!(limit_points(&problem, &published, 1000, 0.0).is_empty());
        let settings = Settings { starts: 4, ..Settings::default() };
        let Outcome::Found(found) = design(&problem, &settings, Vec::new(), &mut |_| {}).unwrap() else {
            panic!("no feasible design")
        };
        let best = found.best().criterion.unwrap().exp();
        println!("pointing: {published_value:.2} published, {best:.3} designed");
        assert!(best <= required, "{best}");
        assert!(limit_points(&problem, &found.coefficients, 10_000, 1e-6).is_empty());
    }
    let mut faster = pointing(Criterion::raw(Measure::Condition));
    faster.base = 0.41;
    let broken = limit_points(&faster, &published, 1000, 0.0);
    assert_eq!(broken.len(), 1, "{broken:?}");
    assert_eq!((broken[0].kind, broken[0].subject.as_str()), (LimitKind::Velocity, "j2"));
}
