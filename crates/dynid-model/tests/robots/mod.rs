//! The robots with loops of this repository, read as far as tests and measurements of this crate need them.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid_model::closed::{ClosedError, ClosedMechanism, ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::*;
use serde_json::Value;

/// Tree, closures, driven joints and home position.
#[derive(Clone)]
pub(crate) struct Robot {
    pub(crate) description: Description,
    pub(crate) closures: Vec<ClosureDescription>,
    pub(crate) driven: Vec<String>,
    pub(crate) home: Vec<(String, Vec<f64>)>,
}

/// Robot `robots/<name>.toml`.
pub(crate) fn robot(name: &str) -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../robots/{name}.toml"));
    let file: Value = toml::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mut description = Description::new(name);
    description.gravity = vector(&file["gravity"]);
    description.links.push(LinkDescription { name: "ground".into(), inertia: None });
    let mut home = Vec::new();
    for body in list(&file["body"]) {
        let (name, joint) = (text(&body["name"]), &body["joint"]);
        let phi: [f64; 10] = numbers(&body["phi"]).try_into().unwrap();
        description.links.push(LinkDescription { name: name.clone(), inertia: Some(Inertia(phi)) });
        let range = &joint["limits"]["position"];
        description.joints.push(JointDescription {
            parent: text(&body["parent"]),
            child: name.clone(),
            kind: match joint["kind"].as_str().unwrap() {
                "revolute" => JointKind::Revolute,
                "prismatic" => JointKind::Prismatic,
                "floating" => JointKind::Floating,
                other => panic!("{other}"),
            },
            placement: Placement::from_xyz_rpy(vector(&joint["xyz"]), vector(&joint["rpy"])),
            axis: if joint["axis"].is_null() { [0.0, 0.0, 1.0] } else { vector(&joint["axis"]) },
            limits: Limits {
                position: range.as_array().map(|r| (number(&r[0]), number(&r[1]))),
                ..Limits::default()
            },
            mimic: None,
            name: name.clone(),
        });
        let at = &file["home"][&name];
        home.push((name, if at.is_array() { numbers(at) } else { vec![number(at)] }));
    }
    let closures = list(&file["loop"]).iter().map(closure).collect();
    let driven = list(&file["actuated"]).iter().map(text).collect();
    Robot { description, closures, driven, home }
}

impl Robot {
    pub(crate) fn try_close(&self) -> Result<ClosedMechanism, ClosedError> {
        let tree = self.description.build().unwrap();
        ClosedMechanism::new(tree, self.closures.clone(), Some(&self.driven), &self.home)
    }

    #[track_caller]
    pub(crate) fn close(&self) -> ClosedMechanism {
        self.try_close().unwrap()
    }

    /// Rigid bodies and loops without elements.
    pub(crate) fn model(&self) -> ClosedModel {
        let machine = self.close();
        ClosedModel::new(TreeModel::new(machine.mechanism().clone(), Vec::new()), machine)
    }
}

fn closure(stated: &Value) -> ClosureDescription {
    let end = |side: &str| LinkFrame {
        link: text(&stated[side]),
        placement: Placement::from_xyz_rpy(
            vector(&stated[format!("{side}_xyz")]),
            vector(&stated[format!("{side}_rpy")]),
        ),
    };
    let kind = match stated["kind"].as_str().unwrap() {
        "spherical" => CutKind::Spherical,
        "planar_revolute" => CutKind::PlanarRevolute,
        "universal" => CutKind::Universal,
        other => panic!("{other}"),
    };
    ClosureDescription {
        name: text(&stated["name"]),
        condition: Condition::Joint { kind, a: end("a"), b: end("b") },
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn text(value: &Value) -> String {
    value.as_str().unwrap().to_owned()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::String(degrees) => degrees.strip_suffix("deg").unwrap().parse::<f64>().unwrap().to_radians(),
        other => other.as_f64().unwrap(),
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(number).collect()
}

fn vector(value: &Value) -> [f64; 3] {
    if value.is_null() { [0.0; 3] } else { numbers(value).try_into().unwrap() }
}
