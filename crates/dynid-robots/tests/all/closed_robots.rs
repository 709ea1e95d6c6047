//! The committed robots with loops against the data they come from.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid_model::closed::{Condition, CutKind, LinkFrame};
use dynid_model::{JointKind, Placement};
use dynid_robots::{RobotFile, robot};
use dynid_testing::shared;
use serde_json::Value;

fn committed(path: &str) -> RobotFile {
    robot::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap_or_else(|e| panic!("{e}"))
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let Some(list) = value.as_array() else { return [0.0; N] };
    assert_eq!(list.len(), N);
    std::array::from_fn(|k| list[k].as_f64().unwrap())
}

/// serde_json reads a number to the last bit or next to it.
#[track_caller]
fn check(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (x, y) in found.iter().zip(expected) {
        assert!((x - y).abs() <= 2.0 * f64::EPSILON * y.abs(), "{what}: {x} is not {y}");
    }
}

/// Rotations have entries up to 1, whose angles are that close.
#[track_caller]
fn check_placement(found: &Placement, xyz: [f64; 3], rpy: [f64; 3], what: &str) {
    check(&found.translation.0, &xyz, what);
    let expected = Placement::from_xyz_rpy(xyz, rpy);
    for (x, y) in found.rotation.0.iter().flat_map(|c| c.0).zip(expected.rotation.0.iter().flat_map(|c| c.0))
    {
        assert!((x - y).abs() < 1e-14, "{what}: {x} is not {y}");
    }
}

#[track_caller]
fn check_frame(found: &LinkFrame, end: &str, stated: &Value) {
    assert_eq!(found.link, stated[end].as_str().unwrap());
    let xyz = numbers(&stated[format!("{end}_xyz")]);
    check_placement(&found.placement, xyz, numbers(&stated[format!("{end}_rpy")]), &found.link);
}

#[test]
fn robots_with_loops_hold_the_numbers_of_the_spec() {
    let Some(folder) = shared("spec/robots") else { return };
    for name in ["fourbar", "fivebar", "stewart", "delta"] {
        let robot = committed(&format!("../../robots/{name}.toml"));
        let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        let d = &robot.description;
        assert_eq!(d.name, json["name"].as_str().unwrap());
        check(&d.gravity, &numbers::<3>(&json["gravity"]), "gravity");
        let bodies = json["bodies"].as_array().unwrap();
        assert_eq!((d.joints.len(), d.links.len()), (bodies.len(), bodies.len() + 1));
        let mut home = json["home"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap());
        for ((joint, link), body) in d.joints.iter().zip(&d.links[1..]).zip(bodies) {
            let (what, stated) = (body["name"].as_str().unwrap(), &body["joint"]);
            assert_eq!([&joint.name, &joint.child, &link.name], [what; 3]);
            assert_eq!(joint.parent, body["parent"].as_str().unwrap());
            let kind = match stated["kind"].as_str().unwrap() {
                "revolute" => JointKind::Revolute,
                "prismatic" => JointKind::Prismatic,
                "floating" => JointKind::Floating,
                other => panic!("{other}"),
            };
            assert_eq!(joint.kind, kind);
            check_placement(&joint.placement, numbers(&stated["xyz"]), numbers(&stated["rpy"]), what);
            if kind != JointKind::Floating {
                check(&joint.axis, &numbers::<3>(&stated["axis"]), what);
            }
            check(&link.inertia.unwrap().0, &numbers::<10>(&body["phi"]), what);
            let (_, values) = robot.home.iter().find(|(name, _)| name == what).unwrap();
            check(values, &home.by_ref().take(values.len()).collect::<Vec<_>>(), what);
        }
        assert_eq!((home.next(), robot.home.len()), (None, bodies.len()));
        let actuated: Vec<_> =
            json["actuated"].as_array().unwrap().iter().map(|x| x.as_str().unwrap()).collect();
        assert_eq!(robot.actuated.unwrap(), actuated);
        let closures = json["closures"].as_array().unwrap();
        assert_eq!(robot.closures.len(), closures.len());
        for (found, stated) in robot.closures.iter().zip(closures) {
            assert_eq!(found.name, stated["name"].as_str().unwrap());
            let Condition::Joint { kind, a, b } = &found.condition else { panic!("{}", found.name) };
            assert_eq!(kind.name(), stated["kind"].as_str().unwrap().replace("point", "spherical"));
            check_frame(a, "a", stated);
            check_frame(b, "b", stated);
        }
    }
}

#[test]
fn a_urdf_with_loops_beside_it_is_the_robot_that_states_both() {
    let (urdf, toml) = (committed("tests/data/delta_loops.toml"), committed("../../robots/delta.toml"));
    assert_eq!((&urdf.closures, &urdf.home, &urdf.actuated), (&toml.closures, &toml.home, &toml.actuated));
    let pairs = urdf.description.joints.iter().zip(&toml.description.joints);
    for (found, expected) in pairs {
        assert_eq!(
            [&found.name, &found.parent, &found.child],
            [&expected.name, &expected.parent, &expected.child]
        );
        assert_eq!(found.placement, expected.placement);
        assert_eq!(found.kind == JointKind::Floating, expected.kind == JointKind::Floating);
    }
    for (found, expected) in urdf.description.links.iter().zip(&toml.description.links) {
        let largest = |i: &[f64; 10]| i.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        match (found.inertia, expected.inertia) {
            // A URDF states centres of mass: a few roundings of the largest entry.
            (Some(x), Some(y)) => {
                let difference: [f64; 10] = std::array::from_fn(|k| x.0[k] - y.0[k]);
                assert!(largest(&difference) <= 4.0 * f64::EPSILON * largest(&y.0), "{}", found.name);
            }
            (x, y) => assert_eq!(x, y),
        }
    }
    assert_eq!(urdf.description.joints.len(), toml.description.joints.len());
}

#[test]
fn every_robot_with_loops_is_a_tree_beside_them() {
    for (name, rates, rows) in
        [("fourbar", 3, 2), ("fivebar", 4, 2), ("stewart", 24, 18), ("delta", 15, 12), ("prr3", 9, 6)]
    {
        let robot = committed(&format!("../../robots/{name}.toml"));
        let mechanism = robot.description.build().unwrap();
        let found: usize = robot
            .closures
            .iter()
            .map(|c| match &c.condition {
                Condition::Joint { kind, .. } => kind.rows(),
                Condition::Coordinates { .. } => 1,
            })
            .sum();
        assert_eq!((mechanism.rates(), found), (rates, rows), "{name}");
        assert_eq!(robot.actuated.unwrap().len(), rates - rows, "{name}");
    }
}

/// Inverse kinematics of the planar machine of Rosyid & El-Khasawneh 2020 at the home pose (0, 0.32 m, 0).
#[test]
fn home_of_the_planar_mechanism_lies_in_its_assembly_mode() {
    let robot = committed("../../robots/prr3.toml");
    let home = |name: String| robot.home.iter().find(|(n, _)| *n == name).unwrap().1[0];
    let (y, lengths, points) = (0.32_f64, [0.6, 0.475, 0.604], [0.28, 0.0, 0.28]);
    for (i, (length, point)) in lengths.into_iter().zip(points).enumerate() {
        let leg = (y / length).asin();
        let leg = if i == 2 { std::f64::consts::PI - leg } else { leg };
        assert!((home(format!("leg{}", i + 1)) - leg).abs() < 1e-15);
        assert!((home(format!("slider{}", i + 1)) - (point - length * leg.cos())).abs() < 1e-15);
        let Condition::Joint { kind, a, b } = &robot.closures[i].condition else { panic!("a joint") };
        assert_eq!(*kind, CutKind::PlanarRevolute);
        assert_eq!((a.placement.translation.0[0], b.placement.translation.0[0]), (length, point));
    }
    let pose = ["platform_x", "platform_y", "platform"].map(|n| home(n.to_owned()));
    assert_eq!(pose, [0.0, y, 0.0]);
    for k in 1..=3 {
        let slider = robot.description.joints.iter().find(|j| j.name == format!("slider{k}")).unwrap();
        let limits = slider.limits;
        assert_eq!(
            (limits.position, limits.velocity, limits.effort),
            (Some((-0.8, 0.8)), Some(0.65), Some(400.0))
        );
    }
}
