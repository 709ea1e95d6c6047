//! MJCF of other origin: what its elements mean. Efforts are compared with MuJoCo's own in the tests of the Python package.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;
use std::path::Path;

use dynid_model::closed::Condition;
use dynid_model::*;
use dynid_robots::mjcf::{self, MjcfRobot};
use dynid_robots::{RobotFile, SettingValue, robot};

fn model(before: &str, world: &str, behind: &str) -> String {
    format!("<mujoco model=\"m\">{before}<worldbody>{world}</worldbody>{behind}</mujoco>")
}

fn read(text: &str) -> MjcfRobot {
    mjcf::parse(text, "m.xml").unwrap_or_else(|e| panic!("{e}"))
}

fn joint<'d>(d: &'d Description, name: &str) -> &'d JointDescription {
    d.joints.iter().find(|j| j.name == name).unwrap()
}

fn inertia(d: &Description, link: &str) -> Inertia {
    d.links.iter().find(|l| l.name == link).unwrap().inertia.unwrap()
}

#[track_caller]
fn check_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0.1_f64, |m, x| m.max(x.abs()));
    for (x, y) in found.iter().zip(expected) {
        assert!((x - y).abs() < 1e-14 * scale, "{found:?} {expected:?}");
    }
}

fn rotation(placement: &Placement) -> Vec<f64> {
    placement.rotation.rows().concat()
}

/// A body of mass 1 at a place.
fn body(place: &str, inside: &str) -> String {
    format!("<body name=\"b\" {place}>{inside}<geom size=\"0.1\" mass=\"1\"/></body>")
}

#[test]
fn orientations_mean_what_they_mean_to_mujoco() {
    let half = 0.5_f64.sqrt();
    let quarter = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    for place in [
        format!("quat=\"{half} 0 0 {half}\""),
        "axisangle=\"0 0 2 90\"".to_owned(),
        "euler=\"0 0 90\"".to_owned(),
        "xyaxes=\"0 1 0 -1 0.5 0\"".to_owned(),
    ] {
        let d = read(&model("", &body(&place, "<joint name=\"j\"/>"), "")).description;
        check_close(&rotation(&joint(&d, "j").placement), &quarter);
    }
    let d = read(&model("", &body("zaxis=\"0 -3 0\"", "<joint name=\"j\"/>"), "")).description;
    check_close(&rotation(&joint(&d, "j").placement), &[1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0]);
    // Lower case turns about axes that have been turned, upper case about those that stand.
    let of = |sequence: &str, angles: &str| {
        let compiler = format!("<compiler angle=\"radian\" eulerseq=\"{sequence}\"/>");
        let text = model(&compiler, &body(&format!("euler=\"{angles}\""), "<joint name=\"j\"/>"), "");
        rotation(&joint(&read(&text).description, "j").placement)
    };
    check_close(&of("xyz", "0.3 -0.4 0.5"), &of("ZYX", "0.5 -0.4 0.3"));
    check_close(&of("XYZ", "0.3 -0.4 0.5"), &Mat3::from_rpy([0.3, -0.4, 0.5]).rows().concat());
}

#[test]
fn several_joints_of_a_body_are_a_row_with_massless_links() {
    let joints = r#"<joint name="turn" axis="0 2 0" pos="0.1 0 0" ref="90" range="-10 20" armature="0.2"/>
        <joint name="slide" type="slide" pos="0 0.2 0" ref="0.5" damping="3" frictionloss="4"/>"#;
    let robot = read(&model("", &body("pos=\"1 2 3\"", joints), ""));
    let d = &robot.description;
    let (turn, slide) = (joint(d, "turn"), joint(d, "slide"));
    assert_eq!(
        (turn.child.as_str(), slide.parent.as_str(), slide.child.as_str()),
        ("b__turn", "b__turn", "b")
    );
    assert_eq!((turn.kind, slide.kind), (JointKind::Revolute, JointKind::Prismatic));
    assert_eq!(turn.axis, [0.0, 1.0, 0.0]);
    let (low, high) = turn.limits.position.unwrap();
    check_close(&[low, high], &[-10_f64.to_radians(), 20_f64.to_radians()]);
    // Where `turn` is at 90 degrees and `slide` at 0.5 m, the body is as drawn.
    let drawn = turn
        .placement
        .then(&Placement::rotate([0.0, 1.0, 0.0], 90_f64.to_radians()))
        .then(&slide.placement)
        .then(&Placement::translate(0.0, 0.0, 0.5));
    check_close(&drawn.translation.0, &[1.0, 2.2, 3.0]);
    check_close(&rotation(&drawn), &rotation(&Placement::identity()));
    // The link has its frame at the last joint.
    check_close(&inertia(d, "b").first_moment().0, &[0.0, -0.2, 0.0]);
    assert_eq!(inertia(d, "b__turn"), Inertia::default());
    assert_eq!(robot.file.elements.ties[0].massless, ["b__turn"]);
    let stated: Vec<_> = robot.file.elements.settings.iter().collect();
    let numbers: Vec<(&str, &str, &SettingValue)> =
        stated.iter().map(|s| (s.joint.as_str(), s.element.as_str(), &s.value)).collect();
    assert_eq!(
        numbers,
        [
            ("turn", "rotor", &SettingValue::Number(0.2)),
            ("slide", "viscous", &SettingValue::Number(3.0)),
            ("slide", "coulomb", &SettingValue::Number(4.0)),
        ]
    );
}

#[test]
fn classes_are_inherited_from_the_nearest_on() {
    let defaults = r#"<default><geom density="10" size="1 2 3"/><joint armature="1" damping="1"/>
        <default class="a"><geom type="box"/><joint damping="2"/>
          <default class="b"><joint frictionloss="3"/><geom mass="5"/></default></default></default>"#;
    let world = r#"<body name="x" childclass="a"><joint name="x1"/><joint name="x2" class="main" pos="1 0 0"/>
          <geom size="0.5"/>
          <frame childclass="b"><body name="y"><joint name="y1"/><geom/></body></frame></body>"#;
    let robot = read(&model(defaults, world, ""));
    let all: Vec<(f64, f64, f64)> =
        robot.joints.iter().map(|p| (p.armature, p.damping, p.friction_loss)).collect();
    assert_eq!(all, [(1.0, 2.0, 0.0), (1.0, 1.0, 0.0), (1.0, 2.0, 3.0)]);
    // A box of 0.5 x 2 x 3 half lengths: sizes that an element leaves out are those of its class.
    check_close(&[inertia(&robot.description, "x").mass()], &[10.0 * 8.0 * 0.5 * 2.0 * 3.0]);
    check_close(&[inertia(&robot.description, "y").mass()], &[5.0]);
}

#[test]
fn shapes_weigh_what_they_weigh() {
    let pi = std::f64::consts::PI;
    let cases = [
        ("type=\"sphere\" size=\"0.2\"", 4.0 / 3.0 * pi * 8.0, None),
        ("type=\"box\" size=\"0.1 0.2 0.3\" mass=\"3\"", 3.0, Some([0.13, 0.1, 0.05])),
        ("type=\"cylinder\" size=\"0.1 0.3\" mass=\"12\"", 12.0, Some([0.39, 0.39, 0.06])),
        ("type=\"ellipsoid\" size=\"0.1 0.2 0.3\" mass=\"5\"", 5.0, Some([0.13, 0.1, 0.05])),
        (
            "type=\"cylinder\" fromto=\"0 0 -0.3 0 0 0.3\" size=\"0.1\" mass=\"12\"",
            12.0,
            Some([0.39, 0.39, 0.06]),
        ),
        ("type=\"sphere\" size=\"0.3\" mass=\"1\" shellinertia=\"true\"", 1.0, Some([0.06; 3])),
        ("type=\"box\" size=\"0.1 0.1 0.1\" mass=\"1\" shellinertia=\"true\"", 1.0, Some([0.1 / 9.0; 3])),
    ];
    for (geom, mass, moments) in cases {
        let world = format!("<body name=\"b\"><joint name=\"j\"/><geom {geom}/></body>");
        let found = inertia(&read(&model("", &world, "")).description, "b");
        check_close(&[found.mass()], &[mass]);
        if let Some([x, y, z]) = moments {
            let [_, _, _, _, xx, xy, xz, yy, yz, zz] = found.0;
            check_close(&[xx, yy, zz, xy, xz, yz], &[x, y, z, 0.0, 0.0, 0.0]);
        }
    }
}

#[test]
fn the_compiler_decides_on_inertias() {
    let inertial = "<inertial pos=\"0 0 0\" mass=\"4\" diaginertia=\"1 1 9\"/>";
    let world = format!(
        "<body name=\"b\"><joint name=\"j\"/>{inertial}<geom size=\"1\" mass=\"7\" group=\"4\"/></body>"
    );
    let of = |compiler: &str| inertia(&read(&model(compiler, &world, "")).description, "b");
    assert_eq!(of("").mass(), 4.0);
    assert_eq!(of("<compiler inertiafromgeom=\"true\"/>").mass(), 7.0);
    // No shape is in the groups that count: the statement stands.
    assert_eq!(of("<compiler inertiafromgeom=\"true\" inertiagrouprange=\"0 3\"/>").mass(), 4.0);
    assert_eq!(of("<compiler boundmass=\"5\"/>").mass(), 5.0);
    assert_eq!(of("<compiler settotalmass=\"8\"/>").tensor().rows()[2][2], 18.0);
    check_close(&of("<compiler balanceinertia=\"true\"/>").tensor().rows()[0], &[11.0 / 3.0, 0.0, 0.0]);
    check_close(&of("<compiler boundinertia=\"3\"/>").tensor().rows()[0], &[3.0, 0.0, 0.0]);
}

#[test]
fn meshes_are_filled_as_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    fs::create_dir(folder.path().join("parts")).unwrap();
    fs::write(folder.path().join("parts/cube.obj"), cube).unwrap();
    let of = |mesh: &str| {
        let before = format!("<compiler meshdir=\"parts\"/><asset><mesh file=\"cube.obj\" {mesh}/></asset>");
        let world = "<body name=\"b\"><joint name=\"j\"/><geom type=\"mesh\" mesh=\"cube\"/></body>";
        let robot = mjcf::parse(&model(&before, world, ""), folder.path().join("m.xml")).unwrap();
        assert_eq!(robot.file.sources.len(), 1);
        inertia(&robot.description, "b")
    };
    for mesh in ["inertia=\"exact\"", "", "scale=\"1 1 -1\" refpos=\"0 0 1\""] {
        let found = of(mesh);
        check_close(&[found.mass()], &[1000.0]);
        check_close(&found.first_moment().0, &[500.0; 3]);
        check_close(&[found.about_com().unwrap().1.rows()[0][0]], &[1000.0 / 6.0]);
    }
    // The mass lies on six faces: the density is that of an area.
    let shell = of("inertia=\"shell\" scale=\"2 2 2\"");
    check_close(
        &[shell.mass(), shell.about_com().unwrap().1.rows()[1][1]],
        &[24_000.0, 24_000.0 * 10.0 / 9.0],
    );
}

#[test]
fn included_files_stand_in_their_places() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    fs::write(at("m.xml"), model("<include file=\"sub/a.xml\"/>", "<include file=\"sub/b.xml\"/>", ""))
        .unwrap();
    fs::write(at("sub/a.xml"), "<mujoco><compiler angle=\"radian\"/><include file=\"c.xml\"/></mujoco>")
        .unwrap();
    fs::write(
        at("sub/b.xml"),
        format!("<mujocoinclude>{}</mujocoinclude>", body("", "<joint name=\"j\" range=\"0 1\"/>")),
    )
    .unwrap();
    fs::write(at("sub/c.xml"), "<mujoco><option gravity=\"0 0 -1\"/></mujoco>").unwrap();
    let robot = robot::read(at("m.xml")).unwrap();
    assert_eq!(robot.description.gravity, [0.0, 0.0, -1.0]);
    assert_eq!(joint(&robot.description, "j").limits.position, Some((0.0, 1.0)));
    assert_eq!(robot.mjcf.as_deref().unwrap(), ["", "sub/a.xml", "sub/c.xml", "sub/b.xml"]);
    let names = robot.sources.iter().map(|s| Path::new(&s.path).file_name().unwrap().to_str().unwrap());
    assert_eq!(names.collect::<Vec<_>>(), ["m.xml", "a.xml", "c.xml", "b.xml"]);
    // Places are those of the file itself.
    fs::write(at("sub/c.xml"), "<mujoco>\n <option gravity=\"down\"/></mujoco>").unwrap();
    let error = robot::read(at("m.xml")).unwrap_err().to_string();
    assert!(error.contains("sub/c.xml:2:10: <option>: gravity: expected 3 finite numbers"), "{error}");
    for (second, told) in [
        ("<include file=\"a.xml\"/>", "expected <include file=\"a.xml\"> once"),
        ("<include file=\"none.xml\"/>", "none.xml: cannot be read"),
        ("<include/>", "<include>: expected an attribute `file`"),
    ] {
        fs::write(at("sub/c.xml"), format!("<mujoco>{second}</mujoco>")).unwrap();
        let error = robot::read(at("m.xml")).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn copies_follow_each_other() {
    let world = "<replicate count=\"3\" offset=\"1 0 0\" euler=\"0 0 90\" sep=\"-\"><body name=\"b\" pos=\"0 1 0\"><joint name=\"j\"/><geom size=\"0.1\"/></body></replicate>";
    let d = read(&model("", world, "")).description;
    let places: Vec<[f64; 3]> = d.joints.iter().map(|j| j.placement.translation.0).collect();
    assert_eq!(d.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), ["j-0", "j-1", "j-2"]);
    check_close(&places[0], &[0.0, 1.0, 0.0]);
    check_close(&places[1], &[0.0, 0.0, 0.0]);
    check_close(&places[2], &[1.0, 0.0, 0.0]);
}

#[test]
fn efforts_are_limited_by_joints_or_by_what_drives_them() {
    let joints =
        r#"<joint name="a" actuatorfrcrange="-7 9"/><joint name="b"/><joint name="c" type="slide"/>"#;
    let actuators = r#"<default><general gear="2"/></default>"#;
    let drives = r#"<actuator><motor joint="a" ctrlrange="-1 1"/><position joint="b" forcerange="-3 3" ctrlrange="0 255"/>
        <motor joint="c" gear="50" ctrlrange="-1 1" forcerange="-4 4"/></actuator>"#;
    let d = read(&model(actuators, &body("", joints), drives)).description;
    let efforts: Vec<_> = ["a", "b", "c"].map(|n| joint(&d, n).limits.effort).into();
    assert_eq!(efforts, [Some(9.0), Some(6.0), Some(50.0)]);
}

#[test]
fn couplings_are_counted_from_the_drawn_pose() {
    let joints =
        r#"<joint name="a" type="slide" ref="0.5"/><joint name="b" type="slide" ref="0.25" axis="1 0 0"/>"#;
    let equality = r#"<equality><joint joint1="b" joint2="a" polycoef="0.1 2"/><joint active="false" joint1="a"/></equality>"#;
    let d = read(&model("", &body("", joints), equality)).description;
    let mimic = joint(&d, "b").mimic.clone().unwrap();
    // q_b - 0.25 = 0.1 + 2 (q_a - 0.5)
    assert_eq!((mimic.of.as_str(), mimic.ratio), ("a", 2.0));
    check_close(&[mimic.offset], &[0.35 - 1.0]);
    let off = "<option><flag equality=\"disable\" gravity=\"disable\"/></option>";
    let d = read(&model(off, &body("", joints), equality)).description;
    assert_eq!((joint(&d, "b").mimic.clone(), d.gravity), (None, [0.0; 3]));
}

/// Two pendulums whose ends meet at (0.5, 0, -1), 1 m apart at their feet.
const LOOP: &str = r#"<body name="left"><joint name="l" axis="0 1 0" ref="10"/><geom size=".1"/>
      <body name="rod" pos="0 0 -1"><joint name="r" axis="0 1 0" pos="0.1 0 0"/><geom size=".1"/></body></body>
    <body name="right" pos="1 0 0"><joint name="q" axis="0 1 0"/><geom size=".1"/></body>"#;

#[test]
fn loops_meet_where_bodies_are_drawn() {
    let equality = r#"<equality><connect name="pin" body1="rod" body2="right" anchor="0.5 0 0"/></equality>
        <actuator><motor joint="l"/></actuator>"#;
    let RobotFile { closures, actuated, home, .. } = read(&model("", LOOP, equality)).file;
    let Condition::Joint { a, b, .. } = &closures[0].condition else { panic!("{closures:?}") };
    assert_eq!((closures[0].name.as_str(), a.link.as_str(), b.link.as_str()), ("pin", "rod", "right"));
    // The frame of the rod's link is at its joint.
    check_close(&a.placement.translation.0, &[0.4, 0.0, 0.0]);
    check_close(&b.placement.translation.0, &[-0.5, 0.0, -1.0]);
    assert_eq!(actuated.unwrap(), ["l"]);
    check_close(&home.iter().map(|(_, q)| q[0]).collect::<Vec<_>>(), &[10_f64.to_radians(), 0.0, 0.0]);
    let weld = "<equality><weld body1=\"rod\" body2=\"right\"/></equality>";
    let closures = read(&model("", LOOP, weld)).file.closures;
    let Condition::Joint { a, .. } = &closures[0].condition else { panic!("{closures:?}") };
    check_close(&a.placement.translation.0, &[0.9, 0.0, 1.0]);
}

#[test]
fn a_floating_body_has_its_pose_in_the_world() {
    let world = "<body name=\"base\" pos=\"1 2 3\" euler=\"0 90 0\"><freejoint/><geom size=\"1\" pos=\"1 0 0\"/><body name=\"arm\" pos=\"0 1 0\"><joint name=\"j\"/><geom size=\"1\"/></body></body>";
    let d = read(&model("", world, "")).description;
    let free = joint(&d, "joint0");
    assert_eq!(
        (free.kind, free.placement, free.parent.as_str()),
        (JointKind::Floating, Placement::identity(), "world")
    );
    check_close(&joint(&d, "j").placement.translation.0, &[0.0, 1.0, 0.0]);
}

#[test]
fn the_outermost_element_tells_the_kind_of_file() {
    let mjcf = model("", &body("", "<joint name=\"j\"/>"), "");
    assert!(robot::parse(&mjcf, "a.xml").unwrap().mjcf.is_some());
    assert!(robot::parse(&mjcf, "a.urdf").unwrap().mjcf.is_some());
    let urdf = "<?xml version=\"1.0\"?><!-- <mujoco> --><robot name=\"r\"><link name=\"a\"/></robot>";
    assert!(robot::parse(urdf, "a.xml").unwrap().urdf.is_some());
    let error = robot::parse("<kml/>", "a.xml").unwrap_err();
    assert!(error.to_string().contains("expected <robot> (URDF), <mujoco> (MJCF) or <sdf>"), "{error}");
}

#[test]
fn position_loops_of_actuators_are_kept() {
    let text = "<mujoco><default><position kp='40' kv='1.5'/><default class='weak'><position kp='10'/></default></default>
      <worldbody><body><joint name='a'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>
      <body><joint name='b' ref='90'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>
      <body><joint name='c'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>
      <body><joint name='d'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></body></body></body></worldbody>
      <actuator><position joint='a' class='weak' ctrlrange='-1 1.5' forcerange='-6 6'/>
      <general joint='b' biastype='affine' gainprm='20' biasprm='0.5 -20 -2'/>
      <motor joint='c' ctrlrange='-3 3'/><position joint='d' gear='2'/></actuator></mujoco>";
    let read = mjcf::parse(text, "m.xml").unwrap();
    // Degrees, as the file has them.
    assert_eq!(read.drawn, [0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
    let found = read.position_actuators;
    let [a, b] = &found[..] else { panic!("{found:?}") };
    assert_eq!((a.joint.as_str(), a.position_gain, a.velocity_gain, a.offset), ("a", 10.0, 1.5, 0.0));
    assert_eq!((a.command_limits, a.effort_limit), (Some((-1.0, 1.5)), Some(6.0)));
    assert_eq!((b.joint.as_str(), b.position_gain, b.velocity_gain, b.offset), ("b", 20.0, 2.0, 0.5));
    assert_eq!((b.command_limits, b.effort_limit), (None, None));
}
