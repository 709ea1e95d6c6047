//! Circles of a point in task space, checked through forward kinematics.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::f64::consts::TAU;

use dynid_excitation::{CircleSettings, PointCircle, TaskSpaceError};
use dynid_model::dynamics::Dynamics;
use dynid_model::*;
use dynid_motion::trajectory::{Point, Quantity, Quintic, QuinticSpline, Sampled, Trajectory};

fn joint(name: &str, parent: &str, placement: Placement, axis: [f64; 3]) -> JointDescription {
    JointDescription {
        name: name.into(),
        parent: parent.into(),
        child: format!("link_{name}"),
        kind: JointKind::Revolute,
        placement,
        axis,
        limits: Limits::default(),
        mimic: None,
    }
}

/// An arm with so many of six joints: shoulder, upper arm, elbow, and a wrist of three.
fn arm(joints: usize) -> Description {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let all = [
        joint("a", "base", Placement::translate(0.0, 0.0, 0.3), z),
        joint("b", "link_a", Placement::identity(), y),
        joint("c", "link_b", Placement::translate(0.0, 0.0, 0.5), y),
        joint("d", "link_c", Placement::translate(0.0, 0.0, 0.2), z),
        joint("e", "link_d", Placement::translate(0.0, 0.0, 0.25), y),
        joint("f", "link_e", Placement::translate(0.0, 0.0, 0.1), x),
    ];
    let mut description = Description::new("arm");
    description.joints = all.into_iter().take(joints).collect();
    let names: Vec<String> = description.joints.iter().map(|j| j.child.clone()).collect();
    description.links = std::iter::once("base".to_owned())
        .chain(names)
        .map(|name| LinkDescription { name, inertia: None })
        .collect();
    description
}

const START: [f64; 6] = [0.3, 0.5, 1.1, -0.4, 0.7, 0.2];

fn names(joints: usize) -> Vec<String> {
    ["a", "b", "c", "d", "e", "f"][..joints].iter().map(|s| (*s).to_owned()).collect()
}

fn start(joints: usize) -> Vec<(String, Vec<f64>)> {
    names(joints).into_iter().zip(START.map(|q| vec![q])).collect()
}

/// Frame of the last link at a sample.
fn frame(description: &Description, motion: &Sampled, sample: usize) -> Placement {
    let mechanism = description.build().unwrap();
    let dynamics = Dynamics::new(&mechanism);
    let q: Vec<f64> = motion.q.iter().skip(sample).step_by(motion.samples()).copied().collect();
    *dynamics.forward_kinematics(&q, &mut dynamics.workspace()).last().unwrap()
}

fn settings(link: &str) -> CircleSettings {
    CircleSettings {
        link: link.into(),
        point: [0.0, 0.05, 0.3],
        normal: [0.2, -0.3, 2.0],
        radius: 0.12,
        ..CircleSettings::default()
    }
}

/// Distances from the centre are the radius, the plane is kept, velocities and accelerations are those of the positions.
#[track_caller]
fn check_circle(description: &Description, circle: &PointCircle, settings: &CircleSettings) -> Sampled {
    let turn = Quintic::new(0.0, 2.0 * TAU, 6.0).unwrap();
    let motion = circle.follow(turn, 100.0).unwrap();
    assert_eq!(motion.samples(), 601);
    let centre = Vec3(circle.centre());
    let normal = Vec3(settings.normal);
    for sample in (0..601).step_by(7).chain([600]) {
        let frame = frame(description, &motion, sample);
        let point = frame.rotation.mul_vec(Vec3(settings.point)) + frame.translation;
        let arm = point - centre;
        assert!((arm.norm() - settings.radius).abs() < 1e-9, "{sample}: {}", arm.norm());
        assert!(arm.dot(normal).abs() < 1e-9, "{sample}");
    }
    // The spline through positions, velocities and accelerations meets the circle between samples, too: it would not with
    // derivatives of other positions.
    let spline = QuinticSpline::new(motion.clone()).unwrap();
    let times = (0..600).map(|k| (f64::from(k) + 0.5) / 100.0).collect();
    let between = Sampled::at_times(&spline, times);
    for sample in 0..600 {
        let frame = frame(description, &between, sample);
        let arm = frame.rotation.mul_vec(Vec3(settings.point)) + frame.translation - centre;
        assert!(
            (arm.norm() - settings.radius).abs() < 1e-9,
            "between {sample}: {}",
            arm.norm() - settings.radius
        );
    }
    // From rest to rest, and the second turn is the first.
    let mut ends = vec![Point::default(); spline.coordinates()];
    for time in [0.0, 6.0] {
        spline.at(time, &mut ends);
        assert!(ends.iter().all(|p| p.velocity.abs() < 1e-12 && p.acceleration.abs() < 1e-12));
    }
    for c in 0..motion.coordinates() {
        assert!((motion.q[c * 601] - motion.q[c * 601 + 600]).abs() < 1e-9, "the joints come back");
        assert!(spline.range(c, Quantity::Position).0.is_finite());
    }
    motion
}

#[test]
fn an_arm_of_three_joints_takes_its_point_around() {
    let description = arm(3);
    let settings = CircleSettings { hold_orientation: false, ..settings("link_c") };
    let circle = PointCircle::new(&description, &[], &names(3), &start(3), &settings).unwrap();
    check_circle(&description, &circle, &settings);
}

#[test]
fn an_arm_of_six_joints_keeps_the_orientation() {
    let description = arm(6);
    let settings = settings("link_f");
    let circle = PointCircle::new(&description, &[], &names(6), &start(6), &settings).unwrap();
    let motion = check_circle(&description, &circle, &settings);
    let first = frame(&description, &motion, 0).rotation;
    for sample in (0..601).step_by(50) {
        let now = frame(&description, &motion, sample).rotation;
        for (a, b) in first.0.iter().zip(&now.0) {
            assert!((*a - *b).norm() < 1e-9);
        }
    }
}

#[test]
fn held_joints_stay_and_a_stated_centre_is_met() {
    let description = arm(6);
    let hold = vec!["d".to_owned(), "e".to_owned(), "f".to_owned()];
    let centre = Some([0.45, 0.3, 0.5]);
    let settings = CircleSettings { hold_orientation: false, hold, centre, ..settings("link_f") };
    let circle = PointCircle::new(&description, &[], &names(6), &start(6), &settings).unwrap();
    assert_eq!(circle.centre(), [0.45, 0.3, 0.5]);
    let motion = check_circle(&description, &circle, &settings);
    for (coordinate, q) in START.iter().enumerate().skip(3) {
        assert!(motion.q[coordinate * 601..][..601].iter().all(|x| x == q));
        assert!(motion.dq[coordinate * 601..][..601].iter().all(|x| *x == 0.0));
    }
}

#[test]
fn circles_that_cannot_be_are_refused_with_the_reason() {
    let make = |joints: usize, settings: &CircleSettings| {
        PointCircle::new(&arm(joints), &[], &names(joints), &start(joints), settings)
    };
    let free = CircleSettings { hold_orientation: false, ..settings("link_f") };
    let error = make(6, &free).unwrap_err();
    assert!(matches!(error, TaskSpaceError::Start(_) | TaskSpaceError::Mobility { .. }), "{error}");
    let error = make(3, &settings("link_c")).unwrap_err();
    assert!(matches!(error, TaskSpaceError::Start(_) | TaskSpaceError::Mobility { .. }), "{error}");
    let far = CircleSettings { radius: 3.0, ..settings("link_f") };
    let error = make(6, &far).unwrap().follow(Quintic::new(0.0, TAU, 2.0).unwrap(), 50.0).unwrap_err();
    let TaskSpaceError::Unreachable { angle, .. } = error else { panic!("{error}") };
    assert_eq!(angle, 0.0);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            make(6, &CircleSettings { radius: bad, ..settings("link_f") }),
            Err(TaskSpaceError::Value { name: "radius", .. })
        ));
    }
    let nan = CircleSettings { normal: [f64::NAN, 0.0, 1.0], ..settings("link_f") };
    assert!(matches!(make(6, &nan), Err(TaskSpaceError::Value { name: "normal", .. })));
    let none = CircleSettings { normal: [0.0; 3], ..settings("link_f") };
    assert!(matches!(make(6, &none), Err(TaskSpaceError::Value { name: "normal", .. })));
    assert!(matches!(make(6, &settings("hand")), Err(TaskSpaceError::Mechanism(_))));
    let hold = CircleSettings { hold: vec!["g".to_owned()], ..settings("link_f") };
    assert!(matches!(make(6, &hold), Err(TaskSpaceError::Mechanism(_))));
}
