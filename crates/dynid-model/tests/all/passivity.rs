//! Where friction takes energy out of the motion.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::{
    Arctangent, AsymmetricFriction, Coulomb, JointElement, Offset, SigmoidOffset, Stribeck, Viscous,
};
use dynid_model::*;

/// A joint with given elements, and the parameters of a massless link with given values of theirs.
fn joint(elements: Vec<Box<dyn JointElement>>, values: &[f64]) -> (RobotModel, Vec<f64>) {
    let mut d = Description::new("joint");
    d.links.extend(["l0", "l1"].map(|l| LinkDescription { name: l.into(), inertia: None }));
    d.joints.push(JointDescription {
        name: "j1".into(),
        parent: "l0".into(),
        child: "l1".into(),
        kind: JointKind::Revolute,
        placement: Placement::translate(0.0, 0.0, 0.0),
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    });
    let linear = [0.0; 10].into_iter().chain(values.iter().copied()).collect();
    (RobotModel::new(d.build().unwrap(), elements), linear)
}

fn passivity(
    elements: Vec<Box<dyn JointElement>>,
    values: &[f64],
    shape: &[f64],
    range: (f64, f64),
) -> FrictionPassivity {
    let (model, linear) = joint(elements, values);
    model.friction_passivity(0, shape, &linear, range, &[])
}

fn four() -> Vec<Box<dyn JointElement>> {
    vec![
        Box::new(Offset { rate: 0 }),
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(Arctangent::new(0)),
    ]
}

/// Joints of Table 3 of the ER-16: `f0, fc, fv, fa, fb`.
const ER16: [[f64; 5]; 3] = [
    [0.7044, 3.9877, 8.0, 32.3929, 6.9975],
    [53.2922, -2.8909, -70.0174, 70.0243, 19.7363],
    [-3.4499, 30.6465, 4.3297, -2.7533, 5.0],
];

fn er16(joint: usize, range: (f64, f64)) -> FrictionPassivity {
    let [f0, fc, fv, fa, fb] = ER16[joint];
    passivity(four(), &[f0, fc, fv, fa], &[fb], range)
}

#[test]
fn second_joint_of_the_er16_is_passive_on_an_interval() {
    let found = er16(1, (-2.0, 2.0));
    let Passivity::PassiveOn(intervals) = &found.passivity else { panic!("{found:?}") };
    let [(a, b), (c, d)] = intervals[..] else { panic!("{found:?}") };
    assert_eq!((a, b), (-d, -c));
    assert!((c / 0.0022 - 1.0).abs() < 0.01 && (d / 1.496 - 1.0).abs() < 0.01, "{c} {d}");
    // Both are roots of the law itself.
    let [_, fc, fv, fa, fb] = ER16[1];
    for v in [c, d] {
        assert!((fc + fv * v + fa * (fb * v).atan()).abs() < 1e-9, "{v}");
    }
    let (v, fed) = found.worst.unwrap();
    let power = 2.0 * (fc + 2.0 * fv + fa * (2.0 * fb).atan());
    assert!(v.abs() == 2.0 && (fed + power).abs() < 1e-9, "{v} {fed}");
    // Within the excited range only the neighbourhood of rest is left.
    let found = er16(1, (0.1, 0.83));
    assert_eq!((found.passivity, found.worst), (Passivity::Passive, None));
    assert_eq!(er16(1, (1.6, 1.8)).passivity, Passivity::NotPassive);
    assert_eq!(er16(1, (0.0, 0.002)).passivity, Passivity::NotPassive);
}

#[test]
fn other_joints_of_the_er16_are_passive() {
    for joint in [0, 2] {
        assert_eq!(er16(joint, (-2.5, 2.5)).passivity, Passivity::Passive);
    }
}

#[test]
fn directions_are_told_apart() {
    let of = |values: [f64; 4]| {
        passivity(vec![Box::new(AsymmetricFriction { rate: 0 })], &values, &[], (-1.0, 2.0))
    };
    assert_eq!(of([1.0, 1.0, 0.5, 0.5]).passivity, Passivity::Passive);
    assert_eq!(of([1.0, -1.0, 0.5, 0.0]).passivity, Passivity::PassiveOn(vec![(0.0, 2.0)]));
    // Backwards 1 - 2 |v|: passive down to -1/2.
    let found = of([1.0, 1.0, 0.0, -2.0]);
    let Passivity::PassiveOn(intervals) = found.passivity else { panic!("{found:?}") };
    assert!(intervals.len() == 1 && (intervals[0].0 + 0.5).abs() < 1e-11 && intervals[0].1 == 2.0);
}

#[test]
fn effort_at_rest_is_offset() {
    let of = |values: &[f64]| {
        let elements: Vec<Box<dyn JointElement>> =
            vec![Box::new(Offset { rate: 0 }), Box::new(SigmoidOffset::new(0))];
        passivity(elements, values, &[459.0, 0.01], (-2.0, 2.0)).passivity
    };
    assert_eq!(of(&[-7.0, 12.0]), Passivity::Passive);
    assert_eq!(of(&[7.0, -12.0]), Passivity::NotPassive);
    assert_eq!(of(&[7.0, 0.0]), Passivity::Passive);
}

#[test]
fn static_friction_below_coulomb_friction_is_told() {
    let of = |values: &[f64]| passivity(vec![Box::new(Stribeck::new(0))], values, &[0.04], (-1.0, 1.0));
    let (usual, odd) = (of(&[9.1, 11.83]), of(&[11.83, 9.1]));
    assert_eq!((usual.passivity, usual.static_below_coulomb), (Passivity::Passive, false));
    assert_eq!((odd.passivity, odd.static_below_coulomb), (Passivity::Passive, true));
}

#[test]
fn effort_of_friction_leaves_out_what_acts_at_rest() {
    let [f0, fc, fv, fa, fb] = ER16[1];
    let (model, linear) = joint(four(), &[f0, fc, fv, fa]);
    let velocities = [-0.4, 0.0, 0.003, 1.7];
    let efforts = model.friction_effort(0, &[fb], &linear, &velocities, &[]);
    for (v, e) in velocities.into_iter().zip(efforts) {
        let sign = if v == 0.0 { 0.0 } else { f64::signum(v) };
        let expected = fc * sign + fv * v + fa * (fb * v).atan();
        assert!(
            (e - expected).abs() <= 4.0 * f64::EPSILON * (f0.abs() + fc.abs() + fv.abs() + fa),
            "{v}: {e}"
        );
    }
}
