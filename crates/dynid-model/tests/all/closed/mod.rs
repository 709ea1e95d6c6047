//! Closed mechanisms.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests outside of test functions")]

mod balance;
mod base;
mod faults;
mod free;
mod golden;
mod loads;
mod model;
mod open;
mod pinocchio;
mod poses;
mod random;

use dynid_model::closed::{ClosedMechanism, ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::{Mechanism, Placement};
use serde_json::Value;

use super::golden::{described, numbers, three};

pub(crate) fn spec(name: &str) -> Option<Value> {
    super::golden::golden(&format!("../{name}"))
}

fn kind(closure: &Value) -> CutKind {
    match closure["kind"].as_str().unwrap() {
        "point" | "spherical" => CutKind::Spherical,
        "planar_revolute" => CutKind::PlanarRevolute,
        "revolute" => CutKind::Revolute,
        "universal" => CutKind::Universal,
        "cylindrical" => CutKind::Cylindrical,
        "prismatic" => CutKind::Prismatic,
        "planar_prismatic" => CutKind::PlanarPrismatic,
        "fixed" => CutKind::Fixed,
        "distance" => CutKind::Distance { length: closure["length"].as_f64().unwrap() },
        other => panic!("{other}"),
    }
}

fn frame(closure: &Value, side: &str) -> LinkFrame {
    let vector = |suffix: &str| match &closure[format!("{side}_{suffix}")] {
        Value::Null => [0.0; 3],
        stated => three(stated),
    };
    LinkFrame {
        link: closure[side].as_str().unwrap().to_owned(),
        placement: Placement::from_xyz_rpy(vector("xyz"), vector("rpy")),
    }
}

pub(crate) fn closures(list: &Value) -> Vec<ClosureDescription> {
    let closure = |c: &Value| ClosureDescription {
        name: c["name"].as_str().unwrap().to_owned(),
        condition: Condition::Joint { kind: kind(c), a: frame(c, "a"), b: frame(c, "b") },
    };
    list.as_array().unwrap().iter().map(closure).collect()
}

/// Tree, closures, driven joints and home of a robot of the reference data.
pub(crate) struct Parts {
    pub(crate) mechanism: Mechanism,
    pub(crate) closures: Vec<ClosureDescription>,
    pub(crate) driven: Vec<String>,
    pub(crate) home: Vec<(String, Vec<f64>)>,
}

impl Parts {
    pub(crate) fn new(robot: &Value, variant: Option<&str>) -> Parts {
        let all = robot["bodies"].as_array().unwrap();
        let changed = variant.map(|v| &robot["variants"][v]);
        let pick = |key: &str| changed.map(|v| &v[key]).filter(|v| !v.is_null()).unwrap_or(&robot[key]);
        let bodies: Vec<Value> = pick("bodies")
            .as_array()
            .unwrap()
            .iter()
            .map(|b| match b.as_str() {
                Some(name) => all.iter().find(|b| b["name"] == name).unwrap().clone(),
                None => b.clone(),
            })
            .collect();
        let mechanism = described(&bodies, three(&robot["gravity"])).build().unwrap();
        let q = numbers(pick("home"));
        let home = mechanism
            .bodies()
            .iter()
            .map(|b| (b.joint.name.clone(), q[b.position..b.position + b.joint.positions()].to_vec()))
            .collect();
        let driven = robot["actuated"].as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned());
        Parts { mechanism, closures: closures(pick("closures")), driven: driven.collect(), home }
    }

    pub(crate) fn close(&self) -> ClosedMechanism {
        ClosedMechanism::new(self.mechanism.clone(), self.closures.clone(), Some(&self.driven), &self.home)
            .unwrap()
    }
}

pub(crate) fn robot(name: &str) -> Option<Parts> {
    Some(Parts::new(&spec(&format!("robots/{name}.json"))?, None))
}

/// Rank of columns scaled to length one, at 1e-9 of the largest singular value.
pub(crate) fn rank(columns: &[Vec<f64>]) -> usize {
    let singular = scaled(columns).singular_values().unwrap();
    singular.iter().filter(|s| **s > 1e-9 * singular[0]).count()
}

fn scaled(columns: &[Vec<f64>]) -> dynid_linalg::Mat {
    let norms: Vec<f64> = columns.iter().map(|c| c.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    dynid_linalg::Mat::from_fn(columns[0].len(), columns.len(), |i, j| {
        if norms[j] > 0.0 { columns[j][i] / norms[j] } else { 0.0 }
    })
}
