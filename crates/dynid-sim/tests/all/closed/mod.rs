//! Closed mechanisms in motion.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod experiment;
mod forward;
mod friction;
mod motion;

use dynid_model::closed::{
    ClosedDynamics, ClosedMechanism, ClosedWarning, ClosureDescription, Condition, CutKind, LinkFrame,
};
use dynid_model::element::{Coulomb, JointElement, RotorInertia, Viscous};
use dynid_model::*;
use dynid_sim::ClosedPlant;
use dynid_testing::reference;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn three(value: &Value) -> [f64; 3] {
    match value {
        Value::Null => [0.0; 3],
        stated => numbers(stated).try_into().unwrap(),
    }
}

fn cut(closure: &Value) -> CutKind {
    match closure["kind"].as_str().unwrap() {
        "point" | "spherical" => CutKind::Spherical,
        "planar_revolute" => CutKind::PlanarRevolute,
        "revolute" => CutKind::Revolute,
        "universal" => CutKind::Universal,
        "distance" => CutKind::Distance { length: closure["length"].as_f64().unwrap() },
        other => panic!("{other}"),
    }
}

fn described(bodies: &[Value], gravity: [f64; 3]) -> Mechanism {
    let mut d = Description::new("closed");
    d.gravity = gravity;
    d.links.push(LinkDescription { name: "ground".into(), inertia: None });
    for body in bodies {
        let name = body["name"].as_str().unwrap();
        let joint = &body["joint"];
        let inertia = Some(Inertia(numbers(&body["phi"]).try_into().unwrap()));
        d.links.push(LinkDescription { name: name.into(), inertia });
        d.joints.push(JointDescription {
            name: name.into(),
            parent: body["parent"].as_str().unwrap().into(),
            child: name.into(),
            kind: match joint["kind"].as_str().unwrap() {
                "revolute" => JointKind::Revolute,
                "continuous" => JointKind::Continuous,
                "prismatic" => JointKind::Prismatic,
                "floating" => JointKind::Floating,
                other => panic!("{other}"),
            },
            placement: Placement::from_xyz_rpy(three(&joint["xyz"]), three(&joint["rpy"])),
            axis: if joint["axis"].is_null() { [0.0, 0.0, 1.0] } else { three(&joint["axis"]) },
            limits: Limits::default(),
            mimic: None,
        });
    }
    d.build().unwrap()
}

/// A robot of the reference data; `driven` in place of its own.
pub(crate) fn robot(name: &str, variant: Option<&str>, driven: Option<&[&str]>) -> Option<ClosedMechanism> {
    let robot = reference(&format!("robots/{name}.json"))?;
    let all = robot["bodies"].as_array().unwrap();
    let changed = variant.map(|v| &robot["variants"][v]);
    let pick = |key: &str| changed.map(|v| &v[key]).filter(|v| !v.is_null()).unwrap_or(&robot[key]);
    let named = |b: &Value| match b.as_str() {
        Some(name) => all.iter().find(|b| b["name"] == name).unwrap().clone(),
        None => b.clone(),
    };
    let bodies: Vec<Value> = pick("bodies").as_array().unwrap().iter().map(named).collect();
    let mechanism = described(&bodies, three(&robot["gravity"]));
    let q = numbers(pick("home"));
    let home: Vec<(String, Vec<f64>)> = mechanism
        .bodies()
        .iter()
        .map(|b| (b.joint.name.clone(), q[b.position..b.position + b.joint.positions()].to_vec()))
        .collect();
    let own = robot["actuated"].as_array().unwrap();
    let driven: Vec<String> = match driven {
        Some(names) => names.iter().map(|n| (*n).to_owned()).collect(),
        None => own.iter().map(|n| n.as_str().unwrap().to_owned()).collect(),
    };
    let frame = |c: &Value, side: &str| LinkFrame {
        link: c[side].as_str().unwrap().to_owned(),
        placement: Placement::from_xyz_rpy(
            three(&c[format!("{side}_xyz")]),
            three(&c[format!("{side}_rpy")]),
        ),
    };
    let closures = pick("closures").as_array().unwrap().iter().map(|c| ClosureDescription {
        name: c["name"].as_str().unwrap().to_owned(),
        condition: Condition::Joint { kind: cut(c), a: frame(c, "a"), b: frame(c, "b") },
    });
    Some(ClosedMechanism::new(mechanism, closures.collect(), Some(&driven), &home).unwrap())
}

/// Rigid bodies alone.
pub(crate) fn bare(machine: ClosedMechanism) -> ClosedPlant {
    let linear = machine.mechanism().inertia_vector();
    let tree = TreeModel::new(machine.mechanism().clone(), Vec::new());
    ClosedPlant::new(RobotModel::from(ClosedModel::new(tree, machine)), linear, vec![], 1e-3).unwrap()
}

/// Rotors at the drives, friction at every joint with one coordinate.
pub(crate) fn rough(machine: ClosedMechanism, scale: f64, width: f64) -> ClosedPlant {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = machine.mechanism().inertia_vector();
    for rate in 0..machine.mechanism().rates() {
        if !machine.floats(rate) {
            elements.push(Box::new(Coulomb { rate }));
            elements.push(Box::new(Viscous { rate }));
            linear.extend([0.3 * scale, 0.1 * scale]);
        }
        if machine.driven().contains(&rate) {
            elements.push(Box::new(RotorInertia { rate }));
            linear.push(0.02);
        }
    }
    let tree = TreeModel::new(machine.mechanism().clone(), elements);
    ClosedPlant::new(RobotModel::from(ClosedModel::new(tree, machine)), linear, vec![], width).unwrap()
}

/// Positions of the drives near home (rad; a third of it in m), rates and accelerations of order one, different from each
/// other.
pub(crate) fn at(machine: &ClosedMechanism, spread: f64, seed: f64) -> [Vec<f64>; 3] {
    let home = machine.home_independent();
    let slides = |k: usize| machine.rate_scales()[machine.independent()[k]] == 1.0;
    let reach = |k: usize| if slides(k) { 1.0 / 3.0 } else { 1.0 };
    let wave = |k: usize, phase: f64| (1.7 * k as f64 + seed + phase).sin();
    [
        home.iter().enumerate().map(|(k, q)| q + spread * reach(k) * wave(k, 0.0)).collect(),
        (0..home.len()).map(|k| wave(k, 2.0)).collect(),
        (0..home.len()).map(|k| 2.0 * wave(k, 4.0)).collect(),
    ]
}

pub(crate) fn dynamics_at(plant: &ClosedPlant, positions: &[f64]) -> ClosedDynamics {
    let mut dynamics = ClosedDynamics::new(plant.machine().clone());
    dynamics.reach(positions).unwrap();
    dynamics
}

pub(crate) fn worst(found: &[f64], expected: &[f64]) -> f64 {
    let scale = expected.iter().fold(1e-300_f64, |m, x| m.max(x.abs()));
    found.iter().zip(expected).map(|(f, e)| (f - e).abs()).fold(0.0, f64::max) / scale
}

pub(crate) fn is_over_actuated(machine: &ClosedMechanism) -> bool {
    machine.warnings().iter().any(|w| matches!(w, ClosedWarning::OverActuated { .. }))
}
