//! URDF and TOML robots: numbers, order, edits, bounds, and every public robot at hand.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::{Path, PathBuf};

use dynid_model::{Description, Inertia, JointKind, Mat3, Placement, Vec3};
use dynid_robots::urdf::{self, JointDynamics};
use dynid_robots::{SettingValue, robot, toml_robot};
use dynid_testing::shared;

fn urdfs(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            urdfs(&path, out);
        } else if path.extension().is_some_and(|e| e == "urdf") {
            out.push(path);
        }
    }
}

/// Ten parameters agree to `tolerance` of their scale: of the mass, the first moments, the tensor.
#[track_caller]
fn check_inertia(found: &Inertia, expected: &Inertia, tolerance: f64, label: &str) {
    for range in [0..1, 1..4, 4..10] {
        let scale = expected.0[range.clone()].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for k in range {
            let error = (found.0[k] - expected.0[k]).abs();
            assert!(error <= tolerance * scale, "{label}: {:?} against {:?}", found.0, expected.0);
        }
    }
}

#[track_caller]
fn check_placement(found: &Placement, expected: &Placement, tolerance: f64) {
    let difference = found.rotation + expected.rotation * -1.0;
    let largest = difference.0.iter().map(|c| c.norm()).fold(0.0, f64::max);
    let shift = (found.translation - expected.translation).norm();
    assert!(largest.max(shift) <= tolerance, "{found:?} against {expected:?}");
}

#[track_caller]
fn check_same_robot(found: &Description, expected: &Description) {
    assert_eq!(found.links.len(), expected.links.len());
    for (f, e) in found.links.iter().zip(&expected.links) {
        assert_eq!(f.name, e.name);
        match (&f.inertia, &e.inertia) {
            (Some(f), Some(e)) => check_inertia(f, e, 1e-12, &expected.name),
            (f, e) => assert_eq!(f, e),
        }
    }
    for (f, e) in found.joints.iter().zip(&expected.joints) {
        assert_eq!((&f.name, &f.parent, &f.child), (&e.name, &e.parent, &e.child));
        check_placement(&f.placement, &e.placement, 1e-14);
        if e.kind != JointKind::Fixed {
            assert_eq!((f.axis, &f.limits, &f.mimic), (e.axis, &e.limits, &e.mimic));
        }
    }
}

#[test]
fn every_public_urdf_reads_and_survives_writing() {
    let Some(data) = shared("data") else { return };
    let mut paths = Vec::new();
    urdfs(&data, &mut paths);
    assert!(paths.len() >= 19);
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap();
        let read = robot::read(&path).unwrap_or_else(|e| panic!("{e}")).description;
        assert_eq!(read.links.len(), read.joints.len() + 1, "{}", path.display());
        let written = urdf::from_description(&read).unwrap();
        check_same_robot(&urdf::parse(&written, "written").unwrap(), &read);
        // Writing the same inertias back changes the text of <inertial> only.
        let same: Vec<_> = read.links.iter().map(|l| (l.name.clone(), l.inertia)).collect();
        let edited = urdf::edit(&text, "edited", &same, &[]).unwrap();
        check_same_robot(&urdf::parse(&edited, "edited").unwrap(), &read);
    }
}

const ODD: &str = "<?xml version=\"1.0\"?>\n<!-- c -->\n<robot name=\"odd\" xmlns:xacro=\"http://x\">\r\n\
  <material name=\"m\"><color rgba=\"0 0 0 1\"/></material>\n\
  <sensor:camera name=\"undeclared prefix\"/>\n\
  <link name=\"a &amp; b\"/>\n\
  <link name=\"l2\"><visual/><inertial>\n    <origin xyz=\"0.1 -0.2 0.3\" rpy=\"0.3 0.2 0.1\"/><mass value=\"2\"/>\n\
    <inertia ixx=\"1\" ixy=\"0.1\" ixz=\"0.2\" iyy=\"2\" iyz=\"0.3\" izz=\"2.5\"/></inertial></link>\n\
  <link name=\"l3\"><inertial><mass value=\"0\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>\n\
  <joint type=\"prismatic\" name=\"z\">\n    <child link=\"l3\"/><parent link=\"l2\"/>\n\
    <dynamics friction=\"1\" damping=\"2\" spring=\"3\"/>\n    <limit effort=\"0\" velocity=\"-1\" upper=\"0.5\"/></joint>\n\
  <joint name=\"c\" type=\"continuous\"><parent link=\"a &amp; b\"/><child link=\"l2\"/><axis xyz=\"0 2 0\"/>\
    <limit lower=\"-1\" upper=\"1\" effort=\"3\" velocity=\"4\"/><mimic joint=\"z\" multiplier=\"2\" offset=\"0.5\"/>\n  </joint>\n\
  <transmission name=\"t\"><joint name=\"c\"><x/></joint></transmission>\n\
  <gazebo><link name=\"l2\"/></gazebo>\n</robot>\n";

#[test]
fn conventions_of_urdf() {
    let d = urdf::parse(ODD, "odd").unwrap();
    assert_eq!(d.name, "odd");
    assert_eq!(d.links.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["a & b", "l2", "l3"]);
    assert_eq!(d.links[0].inertia, None);
    assert_eq!(d.links[2].inertia, Some(Inertia::default()));
    // numpy: R = Rz(0.1) Ry(0.2) Rx(0.3); I = R Ic R' + 2 ((c.c) 1 - c c').
    let expected = Inertia([
        2.0,
        0.2,
        -0.4,
        0.6,
        1.4060033444025353,
        0.023779084911861155,
        0.4474592442173437,
        2.0783498418587674,
        0.26848409776288196,
        2.5756468137386976,
    ]);
    check_inertia(&d.links[1].inertia.unwrap(), &expected, 1e-14, "l2");
    let [z, c] = [&d.joints[0], &d.joints[1]];
    assert_eq!((z.name.as_str(), z.kind, z.axis), ("z", JointKind::Prismatic, [1.0, 0.0, 0.0]));
    assert_eq!((z.limits.position, z.limits.velocity, z.limits.effort), (Some((0.0, 0.5)), None, None));
    assert_eq!((c.kind, c.axis, c.limits.position), (JointKind::Continuous, [0.0, 2.0, 0.0], None));
    assert_eq!((c.limits.effort, c.limits.velocity), (Some(3.0), Some(4.0)));
    let mimic = c.mimic.as_ref().unwrap();
    assert_eq!((mimic.of.as_str(), mimic.ratio, mimic.offset), ("z", 2.0, 0.5));
}

#[test]
fn edits_leave_every_other_byte_alone() {
    let body = Inertia::from_com(3.0, Vec3([0.1, 0.0, -0.1]), &(Mat3::identity() * 0.25));
    let edits = [
        ("a & b".to_owned(), Some(body)),
        ("l2".to_owned(), None),
        ("l3".to_owned(), Some(Inertia::default())),
    ];
    let dynamics = |joint: &str| JointDynamics { joint: joint.to_owned(), damping: 1.5, friction: 1e-9 };
    let edited = urdf::edit(ODD, "odd", &edits, &[dynamics("z"), dynamics("c")]).unwrap();
    let d = urdf::parse(&edited, "edited").unwrap();
    check_inertia(&d.links[0].inertia.unwrap(), &body, 1e-14, "a & b");
    assert_eq!((d.links[1].inertia, d.links[2].inertia), (None, Some(Inertia::default())));
    assert!(edited.contains("<dynamics damping=\"1.5\" friction=\"1e-9\" spring=\"3\"/>"));
    assert_eq!(edited.matches("<dynamics").count(), 2);
    // Every line of the original that holds none of the edited elements is still there, in order.
    let mut rest = edited.as_str();
    for line in ODD.split_inclusive('\n') {
        let touched =
            ["<inerti", "<origin", "</inertial", "<dynamics", "a &amp; b\"/>\n", "<joint name=\"c\" type"]
                .iter()
                .any(|t| line.contains(t));
        if !touched {
            let at = rest.find(line).unwrap_or_else(|| panic!("lost: {line}"));
            rest = &rest[at + line.len()..];
        }
    }
    assert_eq!(urdf::edit(ODD, "odd", &[], &[]).unwrap(), ODD);
    let error = urdf::edit(ODD, "odd", &[("l4".to_owned(), None)], &[]).unwrap_err();
    assert!(error.to_string().contains("found `l4`") && error.hint().unwrap().contains("did you mean `l2`"));
    let no_com = Inertia([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let error = urdf::edit(ODD, "odd", &[("l2".to_owned(), Some(no_com))], &[]).unwrap_err();
    assert!(error.to_string().contains("link `l2`") && error.to_string().contains("no mass"));
}

#[test]
fn a_hundred_thousand_links_in_a_chain_read_without_recursion() {
    let mut text = String::from("<robot name=\"chain\"><link name=\"l0\"/>");
    for k in 1..=100_000 {
        text.push_str(&format!(
            "<link name=\"l{k}\"/><joint name=\"j{k}\" type=\"revolute\"><parent link=\"l{}\"/><child link=\"l{k}\"/></joint>",
            k - 1
        ));
    }
    text.push_str("</robot>");
    let d = urdf::parse(&text, "chain").unwrap();
    assert_eq!((d.links.len(), d.joints.len()), (100_001, 100_000));
}

/// `Rz(theta) Tz(d) Tx(a) Rx(alpha)`.
fn standard(theta: f64, d: f64, a: f64, alpha: f64) -> Placement {
    Placement::rotate([0.0, 0.0, 1.0], theta)
        .then(&Placement::translate(a, 0.0, d))
        .then(&Placement::rotate([1.0, 0.0, 0.0], alpha))
}

#[test]
fn standard_dh_is_the_product_of_its_table() {
    let text = "dh = \"standard\"\njoint = [\n\
        { name = \"j1\", d = 0.3, a = 0.1, alpha = \"90deg\", offset = 0.2, frame = \"distal\", mass = 2, com = [0.1, 0.2, 0.3], inertia_com = [1, 0, 0, 1, 0, 1] },\n\
        { name = \"j2\", kind = \"prismatic\", theta = 0.7, a = 0.2, alpha = -0.4, offset = 0.05, link = \"slider\" },\n\
        { name = \"j3\", d = -0.1, a = 0.4, alpha = 1.1, limits = { position = [\"-90deg\", 2], velocity = 3 } } ]\n";
    let robot = toml_robot::parse(text, "r.toml").unwrap();
    let d = &robot.description;
    let names: Vec<_> = d.links.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["base", "link1", "slider", "link3", "tool"]);
    let q = [0.3, 0.15, -0.8];
    let z = [0.0, 0.0, 1.0];
    let motions =
        [Placement::rotate(z, q[0]), Placement::translate(0.0, 0.0, q[1]), Placement::rotate(z, q[2])];
    let mut pose = Placement::identity();
    for (joint, motion) in d.joints.iter().zip(&motions) {
        pose = pose.then(&joint.placement).then(motion);
    }
    let tool = pose.then(&d.joints[3].placement);
    let table = standard(0.2 + q[0], 0.3, 0.1, std::f64::consts::FRAC_PI_2)
        .then(&standard(0.7, 0.05 + q[1], 0.2, -0.4))
        .then(&standard(q[2], -0.1, 0.4, 1.1));
    check_placement(&tool, &table, 1e-15);
    // A body given at the far end of the link has its centre of mass at tail · com in the joint frame.
    let tail = standard(0.0, 0.3, 0.1, std::f64::consts::FRAC_PI_2);
    let com = tail.rotation.mul_vec(Vec3([0.1, 0.2, 0.3])) + tail.translation;
    let found = d.links[1].inertia.unwrap().about_com().unwrap().0;
    assert!((found - com).norm() < 1e-15);
    assert_eq!(d.joints[2].limits.position, Some((-std::f64::consts::FRAC_PI_2, 2.0)));
}

#[test]
fn elements_couplings_and_bodies() {
    let text = "schema = 1\nname = \"two\"\ngravity = [0, -9.81, 0]\nactuated = [\"crank\"]\nhome = { crank = \"90deg\" }\n\
        body = [ { name = \"crank\", parent = \"ground\", joint = { kind = \"revolute\", xyz = [0, 0, 1], axis = [0, 0, 1] } },\n\
        { name = \"screw\", parent = \"crank\", phi = [1,0,0,0,1,0,0,1,0,1], joint = { kind = \"helical\", axis = [1, 0, 0], pitch = 0.01, name = \"s\" } } ]\n\
        [defaults]\nelements = [\"coulomb\"]\n[element.crank]\nelements = [\"stribeck\"]\n\
        stribeck = { exponent = 2, vs = { start = 0.04, bounds = [0.001, 0.5] } }\n\
        [[coupling]]\nmotors = [\"m1\", \"m2\"]\njoints = [\"crank\", \"s\"]\nmatrix = [[45, 0], [32, 32]]\nform = \"columns\"\n";
    let robot = toml_robot::parse(text, "two.toml").unwrap();
    let d = &robot.description;
    assert_eq!((d.name.as_str(), d.gravity), ("two", [0.0, -9.81, 0.0]));
    assert_eq!(d.joints[1].kind, JointKind::Helical { pitch: 0.01 });
    assert_eq!((d.joints[1].name.as_str(), d.joints[1].parent.as_str()), ("s", "crank"));
    assert_eq!(robot.home, [("crank".to_owned(), vec![std::f64::consts::FRAC_PI_2])]);
    assert_eq!(robot.elements.defaults, ["coulomb"]);
    assert_eq!(robot.elements.per_joint, [("crank".to_owned(), vec!["stribeck".to_owned()])]);
    let setting = |key: &str| {
        let found = robot.elements.settings.iter().find(|s| s.element == "stribeck" && s.key == key);
        found.map(|s| s.value.clone())
    };
    assert_eq!(setting("exponent"), Some(SettingValue::Number(2.0)));
    assert_eq!(setting("vs.bounds"), Some(SettingValue::Numbers(vec![0.001, 0.5])));
    assert_eq!(robot.elements.couplings[0].matrix, [[45.0, 0.0], [32.0, 32.0]]);
}

/// The committed robots against the data of their studies.
#[test]
fn robots_of_the_studies_hold_the_numbers_of_the_spec() {
    let Some(folder) = shared("spec/robots") else { return };
    for (name, per_link) in [("indy7", 11), ("er16", 10)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../robots/{name}.toml"));
        let robot = robot::read(path).unwrap();
        let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let number = |v: &serde_json::Value, k: usize| v[k].as_f64().unwrap();
        let (mdh, phi) = (&json["mdh"], &json["truth"]["phi_standard"]);
        let mut previous = Placement::identity();
        for (i, joint) in robot.description.joints.iter().filter(|j| j.kind != JointKind::Fixed).enumerate() {
            let (a, alpha) = (number(&mdh["a"], i), number(&mdh["alpha"], i));
            let (d, theta) = (number(&mdh["d"], i), number(&mdh["theta_offset"], i));
            // Craig's closed form of Rx(alpha) Tx(a) Rz(theta) Tz(d).
            let ((st, ct), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
            let expected = Placement {
                rotation: Mat3::from_rows([[ct, -st, 0.0], [st * ca, ct * ca, -sa], [st * sa, ct * sa, ca]]),
                translation: Vec3([a, -sa * d, ca * d]),
            };
            check_placement(&joint.placement, &expected, 1e-15);
            previous = previous.then(&joint.placement);
            let stated = |k: usize| number(phi, per_link * i + k);
            let order = [9, 6, 7, 8, 0, 1, 2, 3, 4, 5];
            let link = robot.description.links.iter().find(|l| l.name == joint.child).unwrap();
            // serde_json reads the reference to the last bit or next to it.
            check_inertia(&link.inertia.unwrap(), &Inertia(order.map(stated)), 2.0 * f64::EPSILON, name);
        }
        let written = urdf::from_description(&robot.description).unwrap();
        let read = urdf::parse(&written, name).unwrap();
        check_same_robot(&read, &robot.description);
    }
}
