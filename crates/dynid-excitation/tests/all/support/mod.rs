//! Robots of the reference data, problems of its acceptance tables.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]
#![allow(dead_code, unreachable_pub, reason = "a benchmark uses a part of it")]

use std::sync::Arc;

use dynid_excitation::{MotionLimits, RobotExcitation};
use dynid_model::element::{Coulomb, JointElement, Offset, RotorInertia, Viscous};
use dynid_model::*;
pub use dynid_testing::reference;
use serde_json::Value;

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

/// `Ixx Ixy Ixz Iyy Iyz Izz mx my mz m` → `m mx my mz Ixx Ixy Ixz Iyy Iyz Izz`.
const PAPER_ORDER: [usize; 10] = [9, 6, 7, 8, 0, 1, 2, 3, 4, 5];

/// Serial robot in modified DH rows with its true inertias.
pub fn mechanism(data: &Value) -> Mechanism {
    let dh = &data["mdh"];
    let [a, alpha, d, offset] = ["a", "alpha", "d", "theta_offset"].map(|k| numbers(&dh[k]));
    let phi = numbers(&data["truth"]["phi_standard"]);
    let per_link = phi.len() / a.len();
    let mut description = Description::new("robot");
    description.links.push(LinkDescription { name: "base".into(), inertia: None });
    for k in 0..a.len() {
        let paper = &phi[k * per_link..][..10];
        description.links.push(LinkDescription {
            name: format!("link{}", k + 1),
            inertia: Some(Inertia(PAPER_ORDER.map(|c| paper[c]))),
        });
        description.joints.push(JointDescription {
            name: format!("j{}", k + 1),
            parent: if k == 0 { "base".into() } else { format!("link{k}") },
            child: format!("link{}", k + 1),
            kind: JointKind::Revolute,
            placement: Placement::rotate([1.0, 0.0, 0.0], alpha[k])
                .then(&Placement::translate(a[k], 0.0, d[k]))
                .then(&Placement::rotate([0.0, 0.0, 1.0], offset[k])),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    description.build().unwrap()
}

/// Rotor inertias of joints from `rotors` on, Coulomb, viscous, offset of all joints if asked for.
pub fn model(mechanism: &Mechanism, rotors: std::ops::Range<usize>, friction: bool) -> RobotModel {
    let n = mechanism.rates();
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    elements.extend(rotors.map(|rate| Box::new(RotorInertia { rate }) as Box<dyn JointElement>));
    if friction {
        elements.extend((0..n).map(|rate| Box::new(Coulomb { rate }) as Box<dyn JointElement>));
        elements.extend((0..n).map(|rate| Box::new(Viscous { rate }) as Box<dyn JointElement>));
        elements.extend((0..n).map(|rate| Box::new(Offset { rate }) as Box<dyn JointElement>));
    }
    RobotModel::new(mechanism.clone(), elements)
}

/// The model with its base columns, for a design.
pub fn excitation(model: RobotModel) -> RobotExcitation {
    let model = Arc::new(model);
    let base = BaseParameters::of(model.as_ref(), model.mechanism(), &[], &BaseSettings::default());
    RobotExcitation::new(model, Vec::new(), &base, None)
}

/// Limits of a robot file; angles in degrees where the keys say so.
pub fn limits(data: &Value) -> Vec<MotionLimits> {
    let limits = &data["limits"];
    let read = |key: &str| -> Vec<f64> {
        match limits.get(key) {
            Some(v) => numbers(v),
            None => numbers(&limits[format!("{key}_deg")]).into_iter().map(f64::to_radians).collect(),
        }
    };
    let (low, high, speed, acceleration) = (read("q_min"), read("q_max"), read("qd_max"), read("qdd_max"));
    (0..low.len())
        .map(|k| MotionLimits {
            position: (low[k], high[k]),
            velocity: speed[k],
            acceleration: acceleration[k],
            jerk: f64::INFINITY,
        })
        .collect()
}
