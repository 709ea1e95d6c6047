//! Designs of the acceptance table: reached, within all limits.

mod support;

use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;
use support::*;

const PI: f64 = std::f64::consts::PI;

fn indy7(rest: bool) -> Option<Problem> {
    let data = reference("robots/indy7.json")?;
    let mechanism = mechanism(&data);
    let excitation = excitation(model(&mechanism, 2..6, true));
    Some(Problem {
        coordinates: mechanism.rate_names(),
        limits: limits(&data),
        constraints: Vec::new(),
        base: 0.1 * PI,
        harmonics: 5,
        start: StartConditions { rest, ..Default::default() },
        criterion: Criterion::raw(Measure::Condition),
        output_weights: vec![1.0; 6],
        effective_samples: 1000.0,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples: 100,
        model: Box::new(excitation),
    })
}

#[test]
fn indy7_from_every_seed() {
    let Some(problem) = indy7(false) else { return };
    println!("{} columns", problem.model.columns().len());
    let settings = Settings { starts: 16, ..Settings::default() };
    let begun = std::time::Instant::now();
    let outcome = design(&problem, &settings, Vec::new(), &mut |s| {
        println!(
            "seed {} cond {:.2} excess {:.1e} ev {} share {} at {:.2} s",
            s.seed,
            s.criterion.unwrap_or(f64::NAN).exp(),
            s.excess,
            s.evaluations,
            s.share,
            begun.elapsed().as_secs_f64()
        );
    })
    .unwrap();
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    assert_eq!(found.starts.len(), 16);
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
    let limit = |q: f64, v: f64| CoordinateLimits {
        position: (-q, q),
        velocity: Some(v),
        acceleration: Some(1.0),
        jerk: None,
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
