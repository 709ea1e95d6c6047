//! Mechanisms with loops: the general engine's columns and limits against the closed form of the planar 3-PRR platform.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::sync::Arc;

use crate::task_space::{JOINT, LENGTH, problem as closed_form, workspace};
use dynid_excitation::constraint::{
    CartesianLimits, ConstraintError, ConstraintKind, ConstraintRow, FramePoint, JointLimits, JointQuantity,
    JointRange, OfAllJoints, PathConstraint, Region, SingularityLimit,
};
use dynid_excitation::*;
use dynid_model::closed::{ClosedMechanism, ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::*;

/// `q0, a1..a5, b1..b5` of the platform's pose, plain amplitudes.
const TRAJECTORY: [[f64; 11]; 3] = [
    [-0.08, -0.03, -0.008, -0.007, 0.0005, 0.013, 0.014, 0.026, 0.0005, -0.0015, -0.004],
    [0.33, 0.05, -0.006, -0.015, -0.007, 0.007, 0.014, -0.014, 0.007, 0.010, -0.007],
    [-0.17, 0.15, -0.03, -0.05, -0.007, 0.006, -0.007, -0.14, 0.015, 0.024, 0.003],
];

fn joint(name: &str, parent: &str, kind: JointKind, axis: [f64; 3]) -> JointDescription {
    JointDescription {
        name: name.into(),
        parent: parent.into(),
        child: name.into(),
        kind,
        placement: Placement::identity(),
        axis,
        limits: Limits::default(),
        mimic: None,
    }
}

/// Three sliders along x with a leg each, a platform on two carriages, three cut pins; told by the platform's pose.
fn machine() -> ClosedMechanism {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let mut joints = Vec::new();
    for k in 1..=3 {
        joints.push(joint(&format!("slider{k}"), "ground", JointKind::Prismatic, x));
    }
    for k in 1..=3 {
        joints.push(joint(&format!("leg{k}"), &format!("slider{k}"), JointKind::Revolute, z));
    }
    joints.push(joint("platform_x", "ground", JointKind::Prismatic, x));
    joints.push(joint("platform_y", "platform_x", JointKind::Prismatic, y));
    joints.push(joint("platform", "platform_y", JointKind::Revolute, z));
    let mut description = Description::new("prr3");
    let names = std::iter::once("ground").chain(joints.iter().map(|j| j.child.as_str()));
    description.links = names.map(|n| LinkDescription { name: n.into(), inertia: None }).collect();
    description.joints = joints;
    let at =
        |link: &str, x: f64| LinkFrame { link: link.into(), placement: Placement::translate(x, 0.0, 0.0) };
    let pins = (0..3).map(|k| ClosureDescription {
        name: format!("pin{}", k + 1),
        condition: Condition::Joint {
            kind: CutKind::PlanarRevolute,
            a: at(&format!("leg{}", k + 1), LENGTH[k]),
            b: at("platform", JOINT[k]),
        },
    });
    let driven: Vec<String> = (1..=3).map(|k| format!("slider{k}")).collect();
    let home = [
        ("slider1", -0.23),
        ("slider2", -0.35),
        ("slider3", 0.79),
        ("leg1", 0.56),
        ("leg2", 0.74),
        ("leg3", 2.58),
        ("platform_y", 0.32),
    ];
    let home: Vec<(String, Vec<f64>)> = home.iter().map(|(n, q)| ((*n).to_owned(), vec![*q])).collect();
    let pose = ["platform_x", "platform_y", "platform"].map(String::from);
    let closed = ClosedMechanism::new(description.build().unwrap(), pins.collect(), Some(&driven), &home);
    closed.unwrap().with_independent(&pose).unwrap()
}

fn model() -> Arc<ClosedModel> {
    let machine = machine();
    Arc::new(ClosedModel::new(TreeModel::new(machine.mechanism().clone(), Vec::new()), machine))
}

/// m_p μ1 μ2 μ3 σ I1 I2 I3 I_p, the closed form's columns.
fn columns(model: &ClosedModel) -> Vec<TiedColumn> {
    let body = |name: &str| model.machine().mechanism().joint_index(name).unwrap();
    let legs = |k: usize| body(&format!("leg{k}"));
    let own = [
        (body("platform"), 0),
        (legs(1), 1),
        (legs(2), 1),
        (legs(3), 1),
        (body("platform"), 1),
        (legs(1), 9),
        (legs(2), 9),
        (legs(3), 9),
        (body("platform"), 9),
    ];
    let tied = own.map(|(body, place)| {
        let mut factors = vec![0.0; model.layout().parameters()];
        factors[10 * body + place] = 1.0;
        TiedColumn { info: ColumnInfo { name: String::new(), unit: String::new(), nominal: None }, factors }
    });
    tied.to_vec()
}

fn range(
    subject: &str,
    quantity: JointQuantity,
    terms: &[(usize, f64)],
    lower: f64,
    scale: f64,
) -> JointRange {
    let (terms, unit) = (terms.to_vec(), "m");
    JointRange { subject: subject.into(), quantity, terms, lower, upper: scale, scale, unit }
}

/// Rows of the closed form's workspace; heights of the legs' ends as ranges of their angles, after all others.
fn limits(model: &Arc<ClosedModel>) -> JointLimits {
    let mut ranges = Vec::new();
    for k in 0..3 {
        let own = [(k, 1.0)];
        ranges.push(range("position", JointQuantity::Position, &own, -0.80, 0.80));
        ranges.push(range("speed", JointQuantity::Rate, &own, -0.65, 0.65));
        ranges.push(range("acceleration", JointQuantity::Acceleration, &own, -6.0, 6.0));
    }
    for (subject, terms, least) in
        [("1 and 2", [(0, 1.0), (1, -1.0)], 0.06), ("1 and 3", [(2, 1.0), (0, -1.0)], 0.20)]
    {
        let own = range(subject, JointQuantity::Position, &terms, least, 0.5);
        ranges.push(JointRange { upper: f64::INFINITY, ..own });
    }
    for (k, length) in LENGTH.into_iter().enumerate() {
        let (low, high) = ((0.18 / length).asin(), 0.91_f64.asin());
        let turned = |a: f64| if k == 2 { std::f64::consts::PI - a } else { a };
        let (lower, upper) = (turned(low).min(turned(high)), turned(low).max(turned(high)));
        let own = range("leg", JointQuantity::Position, &[(3 + k, 1.0)], lower, 1.0);
        ranges.push(JointRange { upper, ..own });
    }
    JointLimits::new(model.clone(), ranges).unwrap()
}

/// Places of these rows in the closed form, and the constant that it takes off.
const PLACES: [(usize, f64); 11] = [
    (0, 0.0),
    (1, 0.0),
    (2, 0.0),
    (5, 0.0),
    (6, 0.0),
    (7, 0.0),
    (10, 0.0),
    (11, 0.0),
    (12, 0.0),
    (15, 0.12),
    (16, 0.40),
];

fn coefficients() -> Vec<Vec<f64>> {
    TRAJECTORY.iter().map(|r| r.to_vec()).collect()
}

#[test]
fn columns_and_gradients_are_those_of_the_closed_form() {
    let model = model();
    let mut general = closed_form();
    general.model = Box::new(ClosedExcitation::new(model.clone(), Vec::new(), columns(&model)));
    let mut worst = 0.0_f64;
    for measure in [
        criterion::Measure::ConditionAndSmallest { condition: 1.0, smallest: 10.0 },
        criterion::Measure::Determinant,
        criterion::Measure::Condition,
    ] {
        let mut form = closed_form();
        form.criterion = criterion::Criterion::raw(measure.clone());
        general.criterion = criterion::Criterion::raw(measure);
        let (wanted, slope) = criterion_gradient(&form, &coefficients(), 60).unwrap();
        let (found, own) = criterion_gradient(&general, &coefficients(), 60).unwrap();
        assert!((found - wanted).abs() <= 1e-9 * wanted.abs(), "{found} against {wanted}");
        let largest = slope.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (f, w) in own.iter().flatten().zip(slope.iter().flatten()) {
            worst = worst.max((f - w).abs() / largest);
        }
    }
    println!("largest difference of gradients {worst:.1e}");
    assert!(worst <= 1e-7, "{worst}");
}

#[test]
fn joints_that_follow_have_the_limits_of_the_closed_form() {
    let (model, form) = (model(), workspace());
    let own = limits(&model);
    let samples = 9;
    let [q, dq, ddq] = states(samples);
    let motion = MotionBlock::plain(samples, &q, &dq, &ddq);
    let mut wanted = vec![0.0; form.rows().len() * samples];
    form.values(&motion, samples, &mut wanted);
    let mut found = vec![0.0; own.rows().len() * samples];
    own.values(&motion, samples, &mut found);
    for (row, (place, constant)) in PLACES.into_iter().enumerate() {
        for s in 0..samples {
            let (f, w) = (found[row * samples + s], wanted[place * samples + s] + constant);
            assert!((f - w).abs() <= 1e-9 * w.abs().max(1.0), "row {row}, sample {s}: {f} against {w}");
        }
    }
    // Gradients in any order, samples repeated.
    let asked: Vec<(usize, usize)> =
        (0..PLACES.len()).rev().flat_map(|row| [7, 2, 5, 0].map(|s| (row, s))).collect();
    let elsewhere: Vec<(usize, usize)> = asked.iter().map(|(row, s)| (PLACES[*row].0, *s)).collect();
    let [mut f, mut w] = [(); 2].map(|()| vec![0.0; 9 * asked.len()]);
    own.gradients(&motion, &asked, &mut f);
    form.gradients(&motion, &elsewhere, &mut w);
    for (k, (f, w)) in f.iter().zip(&w).enumerate() {
        assert!(
            (f - w).abs() <= 1e-8 * w.abs().max(1.0),
            "{:?}, entry {}: {f} against {w}",
            asked[k / 9],
            k % 9
        );
    }
}

/// Samples of the trajectory.
fn states(samples: usize) -> [Vec<f64>; 3] {
    let series = |derivative: i32| -> Vec<f64> {
        let at = |row: &[f64; 11], t: f64| {
            (1..=5).fold(if derivative == 0 { row[0] } else { 0.0 }, |sum, k| {
                let w = std::f64::consts::TAU * 0.25 * f64::from(k);
                let turned = w * t + f64::from(derivative) * 0.5 * std::f64::consts::PI;
                let (a, b) = (row[k as usize], row[5 + k as usize]);
                sum + w.powi(derivative) * (a * turned.sin() + b * turned.cos())
            })
        };
        TRAJECTORY.iter().flat_map(|r| (0..samples).map(move |s| at(r, 0.43 * s as f64))).collect()
    };
    [series(0), series(1), series(2)]
}

#[test]
fn places_of_links_and_singular_poses_have_gradients_by_the_independent_coordinates() {
    let model = model();
    let tree = model.machine().mechanism();
    let points = [
        (
            FramePoint { frame: "leg1".into(), position: Vec3([0.6, 0.0, 0.0]) },
            Region::HalfSpace { normal: Vec3([0.0, 1.0, 0.0]), offset: -0.3 },
        ),
        (
            FramePoint { frame: "leg3".into(), position: Vec3([0.3, 0.1, 0.0]) },
            Region::OutsideCylinder { center: [0.2, 0.1], radius: 0.05 },
        ),
    ];
    let places = Box::new(CartesianLimits::new(tree, &points).unwrap());
    let least = 0.3 * model.machine().singularity(&model.machine().workspace()).measure;
    let samples = 6;
    let at = states(samples);
    let constraints: [Box<dyn PathConstraint>; 2] = [
        Box::new(OfAllJoints::new(model.clone(), places).unwrap()),
        Box::new(SingularityLimit::new(model.clone(), least).unwrap()),
    ];
    for constraint in constraints {
        let rows = constraint.rows().len();
        let value = |states: &[Vec<f64>; 3], row: usize, sample: usize| {
            let [q, dq, ddq] = states;
            let mut values = vec![0.0; rows * samples];
            constraint.values(&MotionBlock::plain(samples, q, dq, ddq), samples, &mut values);
            values[row * samples + sample]
        };
        let wanted: Vec<(usize, usize)> =
            (0..rows).rev().flat_map(|row| [3, 0, 5].map(|s| (row, s))).collect();
        let mut found = vec![0.0; 9 * wanted.len()];
        let [q, dq, ddq] = &at;
        constraint.gradients(&MotionBlock::plain(samples, q, dq, ddq), &wanted, &mut found);
        for ((row, sample), found) in wanted.iter().zip(found.chunks_exact(9)) {
            for (k, found) in found.iter().enumerate() {
                let moved = |by: f64| {
                    let mut states = at.clone();
                    states[k / 3][(k % 3) * samples + sample] += by;
                    value(&states, *row, *sample)
                };
                let h = 1e-4;
                let expected = (moved(h) - moved(-h)) / (2.0 * h);
                assert!(
                    (found - expected).abs() < 1e-5 * expected.abs().max(1.0),
                    "{row} {k}: {found} {expected}"
                );
            }
        }
        // Where there is no pose, nothing is a number.
        let mut far = at.clone();
        far[0][samples] = 2.0;
        assert!(value(&far, 0, 0).is_nan() && value(&far, 0, 1).is_finite());
    }
    let refused = SingularityLimit::new(model.clone(), 0.0).unwrap_err().to_string();
    assert!(refused.contains("least measure"), "{refused}");
}

#[test]
fn designs_keep_out_of_poses_that_do_not_exist() {
    let model = model();
    let mut problem = closed_form();
    problem.model = Box::new(ClosedExcitation::new(model.clone(), Vec::new(), columns(&model)));
    // Random motion starts far outside of the legs' reach.
    problem.constraints = vec![Box::new(limits(&model))];
    let settings = Settings { starts: 1, report_samples: 80, ..Settings::default() };
    let outcome = design(&problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let Outcome::Found(found) = outcome else { panic!("no design: {outcome:?}") };
    assert!(found.best().excess <= 0.0);
    assert!(limit_points(&problem, &found.coefficients, 5000, 1e-6).is_empty());
    // What is out of reach is outside, not unlimited.
    let mut far = found.coefficients;
    far[1][0] = 2.0;
    assert!(limit_points(&problem, &far, 20, 0.0).iter().any(|p| p.excess == f64::INFINITY));
}

#[test]
fn joint_limits_are_checked() {
    let model = model();
    let good = range("position", JointQuantity::Position, &[(0, 1.0)], -1.0, 1.0);
    let refused = |range: JointRange| JointLimits::new(model.clone(), vec![range]).unwrap_err().to_string();
    assert!(refused(JointRange { scale: 0.0, ..good.clone() }).contains("expected a positive number"));
    assert!(refused(JointRange { terms: vec![(9, 1.0)], ..good.clone() }).contains("expected 9"));
    assert!(refused(JointRange { lower: 2.0, ..good.clone() }).contains("at most the upper bound"));
    assert!(matches!(
        JointLimits::new(model.clone(), vec![JointRange { terms: vec![(0, f64::NAN)], ..good.clone() }]),
        Err(ConstraintError::Number { .. })
    ));
    let rows: Vec<ConstraintRow> = JointLimits::new(model, vec![good]).unwrap().rows().to_vec();
    assert_eq!((rows[0].kind, rows[0].lower, rows[0].upper), (ConstraintKind::JointPosition, -1.0, 1.0));
}
