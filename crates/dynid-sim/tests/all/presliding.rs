//! A joint within its friction against closed forms.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::{Coulomb, JointElement, Stribeck, Viscous};
use dynid_model::{
    Description, EffortModel, JointDescription, JointKind, Limits, LinkDescription, Placement, RobotModel,
};
use dynid_sim::presliding::{EffortHold, PreslidingJoint, SteadyTable, presliding};

fn model(elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    let mut description = Description::new("joint");
    let link = |name: &str| LinkDescription { name: name.to_owned(), inertia: None };
    description.links = vec![link("base"), link("link")];
    description.joints = vec![JointDescription {
        name: "j".to_owned(),
        kind: JointKind::Continuous,
        parent: "base".to_owned(),
        child: "link".to_owned(),
        placement: Placement::identity(),
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    }];
    RobotModel::new(description.build().unwrap(), elements)
}

/// Coulomb friction of 10 N m with 30 N m s/rad of viscous friction.
fn table() -> SteadyTable {
    let model = model(vec![Box::new(Coulomb { rate: 0 }), Box::new(Viscous { rate: 0 })]);
    let linear = |fc: f64, fv: f64| {
        let mut linear = vec![0.0; model.parameters().linear.len()];
        linear[model.parameters().column("j.fc").unwrap()] = fc;
        linear[model.parameters().column("j.fv").unwrap()] = fv;
        linear
    };
    SteadyTable::new(&model, &[], [&linear(10.0, 0.0), &linear(0.0, 30.0)], 25.0, 10.0).unwrap()
}

const JOINT: PreslidingJoint = PreslidingJoint { inertia: 2.0, offset: 0.0, stiffness: 2e4, damping: 200.0 };

/// Far below the friction a bristle is a damped spring: `J q̈ + (σ1 + F_v) q̇ + σ0 q = τ` after a small step of effort.
#[test]
fn small_motion_is_that_of_a_damped_spring() {
    let (rate, step) = (4000.0, 1e-4);
    let mut effort = vec![step; 2000];
    effort[0] = 0.0;
    let found = presliding(&JOINT, &table(), &effort, 1.0 / rate, EffortHold::Held).unwrap();
    let half = (JOINT.damping + 30.0) / (2.0 * JOINT.inertia);
    let omega = (JOINT.stiffness / JOINT.inertia - half * half).sqrt();
    let still = step / JOINT.stiffness;
    for (k, x) in found.iter().enumerate().skip(1) {
        let t = (k - 1) as f64 / rate;
        let exact =
            still * (1.0 - (-half * t).exp() * ((omega * t).cos() + half / omega * (omega * t).sin()));
        // The part that slips, |v| z / g, is of the order step / F_c of the motion.
        assert!((x - exact).abs() < 1e-4 * still, "{t}: {x} {exact}");
    }
}

/// A constant effort beyond static friction ends in the steady speed of `F_c + F_v v = τ`.
#[test]
fn a_large_effort_ends_in_steady_speed() {
    let rate = 1000.0;
    let mut effort = vec![25.0; 3000];
    effort[0] = 0.0;
    let found = presliding(&JOINT, &table(), &effort, 1.0 / rate, EffortHold::Held).unwrap();
    let speed = (found[2999] - found[2899]) * rate / 100.0;
    // The table is linear in the logarithm of speed, within 2e-5 of the viscous part.
    assert!((speed - 0.5).abs() < 1e-5, "{speed}");
}

/// In equilibrium nothing moves, whatever the constant efforts.
#[test]
fn equilibrium_stays() {
    let joint = PreslidingJoint { offset: -3.0, ..JOINT };
    let found = presliding(&joint, &table(), &[2.0; 200], 1e-3, EffortHold::Linear).unwrap();
    assert!(found.iter().all(|x| x.abs() < 1e-15), "{found:?}");
}

/// Stiff and strongly damped bristles with a light joint, the corner of a search, stay finite.
#[test]
fn the_corners_of_a_search_are_stable() {
    let effort: Vec<f64> = (0..500).map(|k| 6.0 * (0.02 * f64::from(k)).sin()).collect();
    for (stiffness, damping) in [(1e2, 1.0), (1e7, 1.0), (1e2, 1e4), (1e7, 1e4)] {
        let joint = PreslidingJoint { inertia: 0.05, stiffness, damping, ..JOINT };
        let found = presliding(&joint, &table(), &effort, 1e-3, EffortHold::Held).unwrap();
        assert!(found.iter().all(|x| x.abs() < 1.0), "{stiffness} {damping}");
    }
}

#[test]
fn impossible_values_are_refused() {
    let bad = PreslidingJoint { inertia: 0.0, ..JOINT };
    let error = presliding(&bad, &table(), &[0.0; 3], 1e-3, EffortHold::Held).unwrap_err();
    assert_eq!(error.to_string(), "inertia: expected a positive number, found 0");
    let model = model(vec![Box::new(Stribeck::new(0))]);
    let nothing = vec![0.0; model.parameters().linear.len()];
    assert!(SteadyTable::new(&model, &[0.05], [&nothing, &nothing], 25.0, 1.0).is_err());
}
