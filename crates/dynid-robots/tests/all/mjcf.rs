//! MJCF that is written: it reads back to the same robot, and what MJCF cannot say is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::closed::{ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::*;
use dynid_robots::mjcf::{self, JointParameters};
use dynid_robots::{robot, urdf};
use dynid_testing::shared;

/// A tree with every kind of joint that MJCF knows, welded links, a mimic joint and awkward names.
const TREE: &str = r#"<robot name="a &amp; b">
  <link name="world"/>
  <link name="base"><inertial><mass value="4"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="l&lt;1&gt;"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.3 0.2 0.1"/><mass value="2"/>
    <inertia ixx="0.3" ixy="0.01" ixz="0.02" iyy="0.4" iyz="0.03" izz="0.5"/></inertial></link>
  <link name="tool"><inertial><origin xyz="0 0.05 0"/><mass value="0.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <link name="frame"/>
  <link name="slider"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="finger"><inertial><origin xyz="0.02 0 0"/><mass value="0.1"/>
    <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>
  <joint name="stand" type="fixed"><origin xyz="0 0 0.5" rpy="0 0 1"/><parent link="world"/><child link="base"/></joint>
  <joint name="j &quot;1&quot;" type="continuous"><origin xyz="0.1 0.2 0.3" rpy="1.5 -0.7 2.9"/>
    <parent link="base"/><child link="l&lt;1&gt;"/><axis xyz="1 2 -0.5"/></joint>
  <joint name="weld" type="fixed"><origin xyz="0 0 0.2" rpy="3.14159 0 0.4"/><parent link="l&lt;1&gt;"/><child link="tool"/></joint>
  <joint name="tip" type="fixed"><origin xyz="0 0 0.1"/><parent link="tool"/><child link="frame"/></joint>
  <joint name="slide" type="prismatic"><origin rpy="0 1 0"/><parent link="tool"/><child link="slider"/><axis xyz="0 0 -3"/>
    <limit lower="-0.1" upper="0.4" effort="25" velocity="1"/></joint>
  <joint name="follow" type="revolute"><origin xyz="0.2 0 0"/><parent link="slider"/><child link="finger"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="3" velocity="1"/><mimic joint="slide" multiplier="-2.5" offset="0.25"/></joint>
</robot>"#;

fn rows(condition: &Condition) -> usize {
    match condition {
        Condition::Joint { kind, .. } => kind.rows(),
        Condition::Coordinates { .. } => 1,
    }
}

fn effort(d: &Description, motion: &RandomMotion) -> Vec<Vec<f64>> {
    let model = RobotModel::new(d.build().unwrap(), Vec::new());
    let mut block = RegressorBlock::new(model.layout().clone(), 200);
    motion.with_block(|m| model.regressor(m, &[], &mut block));
    (0..model.outputs().len()).map(|k| block.effort(k, &model.parameters().prior())).collect()
}

/// Writes, reads back, and requires the same effort at random states, joint by joint.
fn check(written: &Description, parameters: &[JointParameters]) -> mjcf::MjcfRobot {
    let text = mjcf::from_description(written, parameters).unwrap();
    let read = mjcf::parse(&text, "written").unwrap();
    let mut back = read.description.clone();
    back.couple_mimics = written.couple_mimics;
    assert_eq!((&back.name, back.gravity), (&written.name, written.gravity));
    let mechanism = written.build().unwrap();
    back.joints.sort_by_key(|j| mechanism.joint_index(&j.name).unwrap_or(usize::MAX));
    assert_eq!(back.build().unwrap().rate_names(), mechanism.rate_names());
    let motion = RandomMotion::new(&mechanism, &[], 200, 3);
    let (ours, theirs) = (effort(written, &motion), effort(&back, &motion));
    let scale = ours.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (x, y) in ours.iter().flatten().zip(theirs.iter().flatten()) {
        // Quaternions and centres of mass cost some units in the last place of a few hundred products.
        assert!((x - y).abs() < 1e-12 * scale, "{}: {x} {y}", written.name);
    }
    read
}

#[test]
fn a_tree_with_welded_links_and_awkward_names_reads_back() {
    let mut d = urdf::parse(TREE, "tree").unwrap();
    d.gravity = [0.1, -2.0, 9.0];
    let parameters = [
        JointParameters {
            joint: "j \"1\"".into(),
            damping: 0.3,
            friction_loss: 1e-9,
            armature: 1.0 / 3.0,
            stiffness: 2.5,
            spring_reference: -0.1,
            ..JointParameters::default()
        },
        JointParameters { joint: "slide".into(), damping: 7.0, ..JointParameters::default() },
    ];
    for coupled in [false, true] {
        d.couple_mimics = coupled;
        let read = check(&d, &parameters);
        for p in &parameters {
            assert_eq!(read.joints.iter().find(|j| j.joint == p.joint), Some(p));
        }
        let follow = read.description.joints.iter().find(|j| j.name == "follow").unwrap();
        assert_eq!(follow.mimic, Some(Mimic { of: "slide".into(), ratio: -2.5, offset: 0.25 }));
        assert_eq!(follow.limits.position, Some((-1.0, 1.0)));
        let text = mjcf::from_description(&d, &parameters).unwrap();
        assert_eq!(text.matches("<motor ").count(), if coupled { 2 } else { 3 });
        assert!(text.contains("<motor name=\"slide\" joint=\"slide\" ctrlrange=\"-25.0 25.0\"/>"), "{text}");
        assert!(text.contains("<compiler angle=\"radian\" balanceinertia=\"false\"/>"));
        assert!(!text.contains("name=\"world\""), "the world body is not written again");
    }
}

#[test]
fn the_entries_of_fullinertia_are_in_the_order_of_mujoco() {
    let tensor = Mat3::from_rows([[5.0, 0.1, 0.2], [0.1, 6.0, 0.3], [0.2, 0.3, 7.0]]);
    let mut d = urdf::parse(TREE, "tree").unwrap();
    d.links[2].inertia = Some(Inertia::from_com(2.0, Vec3::zero(), &tensor));
    let text = mjcf::from_description(&d, &[]).unwrap();
    assert!(text.contains("mass=\"2.0\" fullinertia=\"5.0 6.0 7.0 0.1 0.2 0.3\""), "{text}");
}

#[test]
fn a_floating_base_is_a_free_joint() {
    let mut d = urdf::parse(&TREE.replace("\"world\"", "\"root\""), "tree").unwrap();
    d.floating_base = true;
    d.links[0].inertia = Some(Inertia::from_com(3.0, Vec3([0.1, 0.0, 0.0]), &Mat3::identity()));
    check(&d, &[]);
    assert!(mjcf::from_description(&d, &[]).unwrap().contains("<freejoint name=\"root_joint\"/>"));
}

#[test]
fn what_mjcf_cannot_say_is_refused_by_name() {
    let tree = || urdf::parse(TREE, "tree").unwrap();
    let refused = |d: &Description, parts: [&str; 2]| {
        let error = mjcf::from_description(d, &[]).unwrap_err().to_string();
        assert!(error.contains("cannot be written as MJCF"), "{error}");
        assert!(parts.iter().all(|p| error.contains(p)), "{error}");
    };
    let mut d = tree();
    d.joints[1].kind = JointKind::Helical { pitch: 0.1 };
    refused(&d, ["j \"1\"", "helical"]);
    let mut d = tree();
    d.joints[4].kind = JointKind::Floating;
    refused(&d, ["slide", "free joint"]);
    let mut d = tree();
    d.joints[5].mimic = Some(Mimic { of: "weld".into(), ratio: 1.0, offset: 0.0 });
    refused(&d, ["follow", "weld"]);
    let mut d = tree();
    d.links[2].inertia = Some(Inertia([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    refused(&d, ["l<1>", "no mass"]);
    let mut d = tree();
    d.floating_base = true;
    refused(&d, ["link `world`", "rename"]);
}

#[test]
fn public_robots_survive() {
    let Some(folder) = shared("data/oracles") else { return };
    for (name, floating) in
        [("ur5", false), ("panda", false), ("iiwa14", false), ("tiago", false), ("solo12", true)]
    {
        let mut d = robot::read(folder.join(format!("{name}.urdf"))).unwrap().description;
        d.floating_base = floating;
        check(&d, &[]);
    }
}

#[test]
fn loops_are_equalities_between_sites_and_begin_closed() {
    let tree = urdf::parse(TREE, "tree").unwrap();
    let names: Vec<String> =
        tree.joints.iter().filter(|j| j.kind != JointKind::Fixed).map(|j| j.name.clone()).collect();
    let (one, two) = (tree.links[1].name.clone(), tree.links[2].name.clone());
    let frame = |link: &str, x: f64| LinkFrame {
        link: link.to_owned(),
        placement: Placement::translate(x, 0.0, 0.0),
    };
    let cut = |kind| ClosureDescription {
        name: "pin".to_owned(),
        condition: Condition::Joint { kind, a: frame(&one, 0.1), b: frame(&two, 0.2) },
    };
    let driven = vec![names[0].clone()];
    let home = vec![(names[0].clone(), vec![0.25])];
    let written = |closure: ClosureDescription| {
        let closures = [closure];
        let loops = mjcf::Loops { closures: &closures, driven: &driven, home: &home };
        mjcf::from_closed(&tree, &[], &loops)
    };
    let count = |text: &str, what: &str| text.matches(what).count();
    let text = written(cut(CutKind::Revolute)).unwrap();
    assert_eq!((count(&text, "<connect"), count(&text, "<site")), (2, 4));
    assert!(text.contains("name=\"pin.axis.b\" pos=\"0.2 0.0 0.1\""), "{text}");
    assert_eq!(count(&text, "<motor"), 1);
    let key = text.lines().find(|line| line.contains("<key ")).unwrap();
    assert_eq!(key.matches("0.25").count(), 1);
    assert_eq!(key.split('"').nth(3).unwrap().split(' ').count(), names.len());
    // The tree is read back as without loops, but for efforts of joints that have no motor.
    let plain = mjcf::parse(&mjcf::from_description(&tree, &[]).unwrap(), "x").unwrap();
    let read = mjcf::parse(&text, "x").unwrap();
    let places = |d: &Description| -> Vec<_> {
        d.joints
            .iter()
            .map(|j| (j.name.clone(), j.parent.clone(), j.kind, j.placement, j.mimic.clone()))
            .collect()
    };
    assert_eq!(places(&read.description), places(&plain.description));
    assert_eq!(read.file.actuated, Some(driven.clone()));
    let found: Vec<(&str, usize)> =
        read.file.closures.iter().map(|c| (c.name.as_str(), rows(&c.condition))).collect();
    assert_eq!(found, [("pin", 3), ("pin.axis", 3)]);
    assert!(read.file.home.contains(&home[0]), "{:?}", read.file.home);
    assert_eq!(count(&written(cut(CutKind::Spherical)).unwrap(), "<connect"), 1);
    assert_eq!(count(&written(cut(CutKind::Fixed)).unwrap(), "<weld"), 1);
    let refused = written(cut(CutKind::Universal)).unwrap_err().to_string();
    assert!(refused.contains("`pin`") && refused.contains("universal"), "{refused}");
    let coupled = |terms: Vec<(String, f64)>| ClosureDescription {
        name: "gear".to_owned(),
        condition: Condition::Coordinates { terms, constant: 0.5 },
    };
    let [a, b, c] = [0, 1, 2].map(|k| names[k].clone());
    let text = written(coupled(vec![(a.clone(), 2.0), (b.clone(), -4.0)])).unwrap();
    assert!(text.contains("polycoef=\"0.25 2.0 0 0 0\""), "{text}");
    assert!(written(coupled(vec![(a, 1.0), (b, 1.0), (c, 1.0)])).is_err());
}
