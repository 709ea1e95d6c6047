//! Edits of MJCF: what changes is what was asked for, every other byte stays.

use std::fs;

use dynid_model::{Inertia, Mat3, Vec3};
use dynid_robots::mjcf::{self, GearJoint, JointParameters};

const ARM: &str = "<!-- an arm -->\r
<mujoco   model='arm'>\r
\t<default><joint armature=\"0.1\"/></default>\r
\t<worldbody>\r
\t\t<body name=\"one\">  <!-- the first -->\r
\t\t\t<joint name=\"a\" damping = '1'   axis=\"0 1 0\" />\r
\t\t\t<inertial pos=\"0 0 0\" mass=\"2\"\r
\t\t\t\tdiaginertia=\"1 1 1\" euler=\"1 2 3\"/>\r
\t\t\t<body name=\"two\" pos=\"0 0 1\">\r
\t\t\t\t<joint name=\"b\"/>\r
\t\t\t\t<joint name=\"c\" pos=\"0.1 0 0\" frictionloss=\"3\"/>\r
\t\t\t\t<geom size=\".1\" rgba=\"1 0 0 &lt;\"/>\r
\t\t\t\t<body name=\"tool\"/>\r
\t\t\t</body>\r
\t\t</body>\r
\t</worldbody>\r
</mujoco>\r
";

fn body() -> Inertia {
    let tensor = Mat3::from_rows([[0.5, 0.01, 0.02], [0.01, 0.6, 0.03], [0.02, 0.03, 0.7]]);
    Inertia::from_com(3.0, Vec3([0.25, 0.0, -0.5]), &tensor)
}

#[track_caller]
fn check_same(found: Inertia, expected: Inertia) {
    for (x, y) in found.0.iter().zip(expected.0) {
        assert!((x - y).abs() < 1e-14, "{found:?} {expected:?}");
    }
}

fn of(text: &str, link: &str) -> Inertia {
    let robot = mjcf::parse(text, "m.xml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    let link = robot.description.links.iter().find(|l| l.name == link);
    link.and_then(|l| l.inertia).unwrap_or_else(|| panic!("{text}"))
}

#[test]
fn all_but_what_is_set_stays_byte_for_byte() {
    let links = [
        ("one".to_owned(), body()),
        ("two__b".to_owned(), Inertia::default()),
        ("two".to_owned(), body()),
        ("tool".to_owned(), Inertia::default()),
    ];
    let joints = [
        JointParameters {
            joint: "a".into(),
            damping: 0.5,
            friction_loss: 0.25,
            armature: 0.1,
            ..JointParameters::default()
        },
        JointParameters {
            joint: "b".into(),
            damping: 0.0,
            friction_loss: 0.0,
            armature: 0.75,
            ..JointParameters::default()
        },
        JointParameters {
            joint: "c".into(),
            damping: 0.0,
            friction_loss: 3.0,
            armature: 0.0,
            ..JointParameters::default()
        },
    ];
    let files = mjcf::edit(ARM, "m.xml".as_ref(), &links, &joints).unwrap();
    let text = &files[0].text;
    assert_eq!(files.len(), 1);
    let tensor = |mass: f64| format!("mass=\"{mass:?}\" diaginertia=\"");
    let expected = ARM
        .replace(
            "damping = '1'   axis=\"0 1 0\" />",
            "damping = '0.5'   axis=\"0 1 0\" frictionloss=\"0.25\" />",
        )
        .replace("<joint name=\"b\"/>", "<joint name=\"b\" armature=\"0.75\"/>")
        .replace("frictionloss=\"3\"/>", "frictionloss=\"3\" armature=\"0.0\"/>");
    // Beside new inertias, which are looked at below.
    let start = expected.find("<inertial").unwrap();
    let end = start + expected[start..].find("/>").unwrap() + 2;
    let new: Vec<&str> = text
        .match_indices("<inertial ")
        .map(|(at, _)| &text[at..at + text[at..].find("/>").unwrap() + 2])
        .collect();
    assert_eq!(new.len(), 3);
    let expected = format!("{}{}{}", &expected[..start], new[0], &expected[end..])
        .replace(
            "<body name=\"two\" pos=\"0 0 1\">",
            &format!("<body name=\"two\" pos=\"0 0 1\">\r\n\t\t\t\t{}", new[1]),
        )
        .replace(
            "<body name=\"tool\"/>",
            &format!("<body name=\"tool\">\r\n\t\t\t\t  {}\r\n\t\t\t\t</body>", new[2]),
        );
    assert_eq!(*text, expected);
    assert!(new[0].contains(&tensor(3.0)) && new[0].contains("pos=\"0.25 0.0 -0.5\""), "{}", new[0]);
    // Body `two` has its link's frame at the last joint, 0.1 m from its own.
    assert!(new[1].contains("pos=\"0.35 0.0 -0.5\""), "{}", new[1]);
    assert!(new[2].contains("mass=\"0.0\""), "{}", new[2]);
    check_same(of(text, "one"), body());
    check_same(of(text, "two"), body());
    assert_eq!(mjcf::parse(text, "m.xml").unwrap().joints, joints);
    assert_eq!(mjcf::edit(ARM, "m.xml".as_ref(), &[], &[]).unwrap()[0].text, ARM);
}

/// Moments of a flat body, of which the largest is the sum of the others: rounded apart MuJoCo would refuse them.
#[test]
fn flat_bodies_are_not_refused_for_rounding() {
    let text = "<mujoco><worldbody><body name=\"x\"><joint name=\"j\"/><geom size=\"0.1\"/></body></worldbody></mujoco>";
    for k in 1..200 {
        let (a, b) = (0.1 * f64::from(k), 0.3 + 0.7 / f64::from(k));
        let tensor = Mat3::from_rows([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, a + b]]);
        let com = Vec3([0.3, -0.2, 0.1 * f64::from(k % 7)]);
        let links = [("x".to_owned(), Inertia::from_com(2.0, com, &tensor))];
        let edited = mjcf::edit(text, "m.xml".as_ref(), &links, &[]).unwrap();
        let (_, behind) = edited[0].text.split_once("diaginertia=\"").unwrap();
        let moments: Vec<f64> =
            behind.split('"').next().unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
        let largest = moments.iter().copied().fold(0.0, f64::max);
        let others = moments.iter().enumerate().filter(|(_, x)| **x < largest).map(|(_, x)| *x);
        assert!(others.sum::<f64>() >= largest, "{moments:?}");
    }
}

#[test]
fn inertias_count_whatever_the_compiler_makes_of_them() {
    let world = "<worldbody><body name=\"x\"><joint name=\"j\"/><geom size=\"0.1\"/><body name=\"y\" pos=\"1 0 0\"><joint name=\"k\"/><geom size=\"0.2\"/></body></body><body name=\"still\"><geom size=\"3\"/></body></worldbody>";
    for compiler in [
        "inertiafromgeom=\"true\"",
        "settotalmass=\"11\"",
        "boundmass=\"4\" boundinertia=\"2\"",
        "balanceinertia=\"true\" inertiafromgeom=\"true\"",
    ] {
        let text = format!("<mujoco><compiler {compiler}/>{world}</mujoco>");
        let before = of(&text, "y");
        let edited = mjcf::edit(&text, "m.xml".as_ref(), &[("x".to_owned(), body())], &[]).unwrap();
        let edited = &edited[0].text;
        check_same(of(edited, "x"), body());
        check_same(of(edited, "y"), before);
        assert_eq!(edited.matches("<inertial").count(), 2, "{edited}");
    }
}

#[test]
fn an_inertia_inside_a_frame_stays_there() {
    let text = "<mujoco><worldbody><body name=\"x\"><joint name=\"j\"/><frame pos=\"1 2 3\" euler=\"10 20 30\"><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/></frame></body></worldbody></mujoco>";
    let edited = mjcf::edit(text, "m.xml".as_ref(), &[("x".to_owned(), body())], &[]).unwrap();
    check_same(of(&edited[0].text, "x"), body());
}

#[test]
fn the_file_that_holds_an_element_changes() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let main = "<mujoco><worldbody><include file=\"arm.xml\"/></worldbody></mujoco>";
    fs::write(
        at("arm.xml"),
        "<mujocoinclude><body name=\"x\"><joint name=\"j\"/><geom size=\"1\"/></body></mujocoinclude>",
    )
    .unwrap();
    let links = [("x".to_owned(), body())];
    let files = mjcf::edit(main, &at("m.xml"), &links, &[]).unwrap();
    assert_eq!(files.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(), ["", "arm.xml"]);
    assert_eq!(files[0].text, main);
    let read = mjcf::parse_edited(main, &at("m.xml"), &files[1..]).unwrap();
    check_same(read.description.links[1].inertia.unwrap(), body());
    // Nothing is written outside of the folder of the robot.
    fs::create_dir(at("in")).unwrap();
    let main = main.replace("arm.xml", "../arm.xml");
    let error = mjcf::edit(&main, &at("in/m.xml"), &links, &[]).unwrap_err().to_string();
    assert!(error.contains("`../arm.xml`, which is not in the folder"), "{error}");
}

#[test]
fn what_cannot_be_edited_is_refused_by_name() {
    let edit = |links: &[(String, Inertia)], joints: &[JointParameters]| {
        let copies = "<replicate count=\"2\"><body name=\"r\"><joint name=\"q\"/><geom size=\"1\"/></body></replicate></worldbody>";
        mjcf::edit(&ARM.replace("</worldbody>", copies), "m.xml".as_ref(), links, joints).unwrap_err()
    };
    let link = |name: &str| [(name.to_owned(), body())];
    assert!(
        edit(&link("r0"), &[]).to_string().contains("link `r0`: cannot be written as MJCF: it is one copy")
    );
    assert!(edit(&link("two__b"), &[]).to_string().contains("between two joints"));
    let error = edit(&link("tw"), &[]);
    assert!(error.to_string().contains("found `tw`") && error.hint().unwrap().contains("`two`"), "{error}");
    let joint = |name: &str, damping| [JointParameters { joint: name.into(), damping, ..Default::default() }];
    assert!(edit(&[], &joint("a", f64::NAN)).to_string().contains("damping is not finite"));
    assert!(edit(&[], &joint("q1", 1.0)).to_string().contains("joint `q1`"));
}

#[test]
fn a_gear_that_gives_way_is_a_joint_behind_its_own() {
    let keyed = ARM.replace(
        "</mujoco>",
        "<keyframe><key name='k' qpos='0.1 0.2  0.3' qvel=\"1 2 3\" ctrl='4'/></keyframe>\n</mujoco>",
    );
    let gear = |backlash| GearJoint { stiffness: 200.0, damping: 0.5, backlash, mobility: 30.0 };
    let joint = |name: &str, backlash| JointParameters {
        joint: name.into(),
        armature: 0.1,
        friction_loss: 3.0,
        sticks: true,
        gear: Some(gear(backlash)),
        ..JointParameters::default()
    };
    let joints = [joint("b", 0.0), joint("c", std::f64::consts::PI / 180.0)];
    let text = mjcf::edit(&keyed, "m.xml".as_ref(), &[], &joints).unwrap().remove(0).text;
    let soft = "\r\n\t\t\t\t<joint name=\"b_gear\" armature=\"0\" frictionloss=\"0\" ref=\"0\" springref=\"0\" limited=\"false\" \
                stiffness=\"200.0\" damping=\"0.5\"/>";
    assert!(text.contains(soft), "{text}");
    // Degrees, as the file has them, and a flank of the stiffness by its mobility.
    let flanks = "<joint name=\"c_gear\" pos=\"0.1 0 0\" armature=\"0\" frictionloss=\"0\" ref=\"0\" springref=\"0\" stiffness=\"0\" damping=\"0\" \
                  limited=\"true\" range=\"-0.5 0.5\" margin=\"0\" solreflimit=\"-6000.0 -15.0\" solimplimit=\"0.0001 0.0001 0.001\"/>";
    assert!(text.contains(flanks), "{text}");
    assert_eq!(text.matches("solreffriction").count(), 2, "joints that stick say so once");
    assert!(text.contains("qpos='0.1 0.2 0 0.3 0' qvel=\"1 2 0 3 0\" ctrl='4'"), "{text}");
    // What is there already is kept, and nothing that is not finite is written.
    let own = ARM.replace("frictionloss=\"3\"", "frictionloss=\"3\" solreffriction=\"0.01 1\"");
    let text = mjcf::edit(&own, "m.xml".as_ref(), &[], &joints[1..]).unwrap().remove(0).text;
    assert_eq!(text.matches("solreffriction").count(), 1, "{text}");
    let mut wrong = joints[0].clone();
    wrong.gear = Some(GearJoint { mobility: f64::NAN, ..gear(0.0) });
    let fault = mjcf::edit(ARM, "m.xml".as_ref(), &[], &[wrong]).unwrap_err().to_string();
    assert!(fault.contains("gear"), "{fault}");
    let short = keyed.replace("0.1 0.2  0.3", "0.1");
    let fault = mjcf::edit(&short, "m.xml".as_ref(), &[], &joints).unwrap_err().to_string();
    assert!(fault.contains("expected 3 numbers"), "{fault}");
}
