//! Mechanisms for the tests.
#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::JointElement;
use dynid_model::*;
use dynid_sim::Plant;

/// A chain of links: kind, axis, and inertia of each.
pub(crate) fn chain(joints: &[(JointKind, [f64; 3], Inertia)], gravity: [f64; 3]) -> Mechanism {
    let mut d = Description::new("chain");
    d.gravity = gravity;
    d.links.push(LinkDescription { name: "l0".into(), inertia: None });
    for (k, (kind, axis, inertia)) in joints.iter().enumerate() {
        d.links.push(LinkDescription { name: format!("l{}", k + 1), inertia: Some(*inertia) });
        d.joints.push(JointDescription {
            name: format!("j{}", k + 1),
            parent: format!("l{k}"),
            child: format!("l{}", k + 1),
            kind: *kind,
            placement: Placement::from_xyz_rpy(if k == 0 { [0.0; 3] } else { [0.0, 0.0, 0.4] }, [0.0; 3]),
            axis: *axis,
            limits: Limits::default(),
            mimic: None,
        });
    }
    d.build().unwrap()
}

/// A mass that slides along x.
pub(crate) fn slider(mass: f64, elements: Vec<Box<dyn JointElement>>, values: &[f64], width: f64) -> Plant {
    let body = Inertia([mass, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mechanism = chain(&[(JointKind::Prismatic, [1.0, 0.0, 0.0], body)], [0.0; 3]);
    plant(mechanism, elements, values, width)
}

/// A plant from a mechanism and the values of its elements' parameters.
pub(crate) fn plant(
    mechanism: Mechanism,
    elements: Vec<Box<dyn JointElement>>,
    values: &[f64],
    width: f64,
) -> Plant {
    let mut linear = mechanism.inertia_vector();
    linear.extend(values);
    Plant::new(RobotModel::new(mechanism, elements), linear, vec![], width).unwrap()
}

/// Three joints about z, y, y under gravity.
pub(crate) fn arm() -> Mechanism {
    let link = |m: f64| {
        let com = Vec3([0.02 * m, 0.01, 0.2]);
        Inertia::from_com(
            m,
            com,
            &Mat3::from_rows([[0.05 * m, 0.001, 0.0], [0.001, 0.06 * m, 0.002], [0.0, 0.002, 0.02 * m]]),
        )
    };
    let (y, z) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let joints = [
        (JointKind::Revolute, z, link(4.0)),
        (JointKind::Revolute, y, link(3.0)),
        (JointKind::Revolute, y, link(1.0)),
    ];
    chain(&joints, [0.0, 0.0, -9.81])
}
