//! Loops, floating links and home positions of robot files.

use std::f64::consts::FRAC_PI_2;
use std::fs;

use dynid_model::closed::{ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::{JointKind, Placement};
use dynid_robots::{RobotFile, RobotFileError, robot, toml_robot};

/// Two cranks and a free body; `rest` follows from line 5 on.
fn tree(rest: &str) -> String {
    format!(
        "body = [\n\
         {{ name = \"left\", parent = \"ground\", joint = {{ axis = [0, 0, 1] }} }},\n\
         {{ name = \"right\", parent = \"ground\", joint = {{ name = \"hinge\", axis = [0, 0, 1] }} }},\n\
         {{ name = \"plate\", parent = \"ground\", joint = {{ kind = \"floating\" }} }}, {{ name = \"eye\", parent = \"left\", joint = {{ kind = \"fixed\" }} }} ]\n{rest}"
    )
}

#[expect(clippy::unwrap_used, reason = "helper of tests outside of test functions")]
fn closures(rest: &str) -> Vec<ClosureDescription> {
    toml_robot::parse(&tree(rest), "r.toml").unwrap().closures
}

#[test]
fn every_kind_with_frames_that_default_to_the_links() {
    let at = |link: &str| LinkFrame { link: link.to_owned(), placement: Placement::identity() };
    for (word, kind) in [
        ("spherical", CutKind::Spherical),
        ("point", CutKind::Spherical),
        ("planar_revolute", CutKind::PlanarRevolute),
        ("revolute", CutKind::Revolute),
        ("universal", CutKind::Universal),
        ("cylindrical", CutKind::Cylindrical),
        ("prismatic", CutKind::Prismatic),
        ("planar_prismatic", CutKind::PlanarPrismatic),
        ("fixed", CutKind::Fixed),
        ("distance", CutKind::Distance { length: 0.25 }),
    ] {
        let length = if word == "distance" { ", length = 0.25" } else { "" };
        let found = closures(&format!(
            "loop = [ {{ name = \"c\", kind = \"{word}\", a = \"left\", b = \"ground\"{length} }} ]"
        ));
        let condition = Condition::Joint { kind, a: at("left"), b: at("ground") };
        assert_eq!(found, [ClosureDescription { name: "c".to_owned(), condition }], "{word}");
        if word != "point" {
            assert_eq!(kind.name(), word);
        }
    }
}

#[test]
fn frames_and_angles_in_tables_of_either_form() {
    let found = closures(
        "[[loop]]\nname = \"c\"\nkind = \"revolute\"\na = \"left\"\nb = \"plate\"\na_xyz = [0.1, 2, 0]\n\
         a_rpy = [0, \"-90deg\", 0.5]\nb_xyz = [0, 0, -0.3]\nb_rpy = [\"90deg\", 0, \"1.5rad\"]\n\
         [[loop]]\nname = \"d\"\nkind = \"fixed\"\na = \"right\"\nb = \"eye\"\n",
    );
    let a = Placement::from_xyz_rpy([0.1, 2.0, 0.0], [0.0, -FRAC_PI_2, 0.5]);
    let b = Placement::from_xyz_rpy([0.0, 0.0, -0.3], [FRAC_PI_2, 0.0, 1.5]);
    let frame = |link: &str, placement| LinkFrame { link: link.to_owned(), placement };
    let expected = Condition::Joint { kind: CutKind::Revolute, a: frame("left", a), b: frame("plate", b) };
    assert_eq!(found[0].condition, expected);
    assert_eq!((found.len(), found[1].name.as_str()), (2, "d"));
}

#[test]
fn coupled_coordinates_keep_the_order_of_the_file() {
    let found = closures(
        "loop = [ { name = \"gear\", kind = \"coordinate\", terms = { left = 3, hinge = -1.5 }, constant = \"90deg\" },\n\
         { name = \"belt\", kind = \"coordinate\", terms = { hinge = 1, left = 1 } } ]",
    );
    let terms = |list: &[(&str, f64)]| list.iter().map(|(n, x)| ((*n).to_owned(), *x)).collect();
    let gear =
        Condition::Coordinates { terms: terms(&[("left", 3.0), ("hinge", -1.5)]), constant: FRAC_PI_2 };
    let belt = Condition::Coordinates { terms: terms(&[("hinge", 1.0), ("left", 1.0)]), constant: 0.0 };
    assert_eq!(found.into_iter().map(|c| c.condition).collect::<Vec<_>>(), [gear, belt]);
}

#[test]
fn home_has_one_value_a_joint_and_seven_of_a_floating_one() {
    let text = tree("home = { plate = [1, 2, 3, 0, 0, 0.6, 0.8], left = [\"90deg\"], hinge = -0.25 }");
    let robot = toml_robot::parse(&text, "r.toml").unwrap();
    let expected = [
        ("hinge", vec![-0.25]),
        ("left", vec![FRAC_PI_2]),
        ("plate", vec![1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8]),
    ];
    assert_eq!(robot.home, expected.map(|(name, values)| (name.to_owned(), values)));
    assert!(robot.closures.is_empty());
    let root = tree("floating_base = true\nhome = { root_joint = [0, 0, 1, 0, 0, 0, 1] }");
    assert_eq!(toml_robot::parse(&root, "r.toml").unwrap().home[0].1.len(), 7);
}

const ARMS: &str = "<robot name=\"arms\">\n\
  <link name=\"base\"/><link name=\"arm1\"/><link name=\"arm2\"/><link name=\"plate\"/><link name=\"cup\"/>\n\
  <joint name=\"j1\" type=\"revolute\"><parent link=\"base\"/><child link=\"arm1\"/><axis xyz=\"0 1 0\"/></joint>\n\
  <joint name=\"j2\" type=\"revolute\"><parent link=\"base\"/><child link=\"arm2\"/><origin xyz=\"0.5 0 0\"/></joint>\n\
  <joint name=\"p\" type=\"prismatic\"><parent link=\"base\"/><child link=\"plate\"/><origin xyz=\"0 0 0.3\"/>\n\
  <limit lower=\"-1\" upper=\"1\"/><mimic joint=\"j1\"/></joint>\n\
  <joint name=\"c\" type=\"floating\"><parent link=\"base\"/><child link=\"cup\"/></joint>\n</robot>";

#[expect(clippy::unwrap_used, reason = "helper of tests outside of test functions")]
fn beside_urdf(rest: &str) -> Result<RobotFile, RobotFileError> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("arms.urdf"), ARMS).unwrap();
    let path = folder.path().join("arms.toml");
    fs::write(&path, format!("urdf = \"arms.urdf\"\n{rest}")).unwrap();
    robot::read(path)
}

#[test]
fn loops_beside_a_urdf() {
    let robot = beside_urdf(
        "actuated = [\"j1\", \"j2\"]\nfloating = [\"plate\"]\nhome = { j1 = 0.2, p = [0, 0, 0, 0, 0, 0, 1] }\n\
         loop = [ { name = \"w1\", kind = \"point\", a = \"arm1\", b = \"plate\", a_xyz = [0.3, 0, 0] },\n\
         { name = \"w2\", kind = \"distance\", a = \"arm2\", b = \"cup\", length = 0.2 } ]",
    )
    .unwrap();
    let names: Vec<&str> = robot.closures.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["w1", "w2"]);
    assert_eq!(robot.actuated, Some(vec!["j1".to_owned(), "j2".to_owned()]));
    let [_, _, p, c] = &robot.description.joints[..] else { panic!("four joints") };
    assert_eq!((p.kind, c.kind), (JointKind::Floating, JointKind::Floating));
    assert_eq!((p.limits.position, &p.mimic), (None, &None));
    assert_eq!(p.placement, Placement::translate(0.0, 0.0, 0.3));
    assert_eq!(robot.home[1].1.len(), 7);
    // The joint's own name serves as well.
    let by_joint = beside_urdf("floating = [\"p\"]").unwrap();
    assert_eq!(by_joint.description, beside_urdf("floating = [\"plate\"]").unwrap().description);
    assert_eq!(by_joint.description.joints[2], robot.description.joints[2]);
}

#[test]
fn loops_beside_a_dh_table() {
    let text = "dh = \"modified\"\njoint = [ { name = \"j1\" }, { name = \"j2\", a = 0.3 }, { name = \"j3\", a = 0.4 } ]\n\
        tool = { xyz = [0.2, 0, 0] }\n\
        loop = [ { name = \"pin\", kind = \"planar_revolute\", a = \"tool\", b = \"base\", b_xyz = [0.5, 0, 0] } ]";
    let robot = toml_robot::parse(text, "r.toml").unwrap();
    let Condition::Joint { a, b, .. } = &robot.closures[0].condition else { panic!("a joint") };
    assert_eq!((a.link.as_str(), b.link.as_str()), ("tool", "base"));
}

#[track_caller]
fn check(error: &RobotFileError, parts: &[&str], hint: &str) {
    let message = error.to_string();
    assert!(!message.contains('\n'), "more than one line: {message}");
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    let said = error.hint().unwrap_or_default();
    assert!(said.contains(hint), "`{hint}` is not in the hint of: {message}: {said}");
}

#[test]
fn broken_loops() {
    let pin = "name = \"c\", kind = \"revolute\", a = \"left\", b = \"right\"";
    let gear = "name = \"g\", kind = \"coordinate\"";
    let cases: Vec<(String, Vec<&str>, &str)> = vec![
        (
            format!("{pin}, a_yxz = [0, 0, 0]"),
            vec!["r.toml:6:59", "unknown field `a_yxz`", "a_xyz"],
            "misspelt",
        ),
        (
            pin.replace("revolute", "hinge"),
            vec!["r.toml:6:22", "unknown variant `hinge`", "planar_revolute"],
            "",
        ),
        (pin.replace("name = \"c\", ", ""), vec!["r.toml:6:1", "missing field `name`"], ""),
        (pin.replace("kind = \"revolute\", ", ""), vec!["r.toml:6:1", "missing field `kind`"], ""),
        (pin.replace("a = \"left\", ", ""), vec!["r.toml:6:1", "loop `c`", "`a`, the name of a link"], "add"),
        (
            pin.replace(", b = \"right\"", ""),
            vec!["r.toml:6:1", "loop `c`", "`b`, the name of a link"],
            "add",
        ),
        (
            pin.replace("\"right\"", "\"rigt\""),
            vec!["r.toml:6:50", "loop `c`: b", "name of a link", "`rigt`"],
            "did you mean `right`",
        ),
        (
            pin.replace("\"left\"", "\"world\""),
            vec!["r.toml:6:38", "loop `c`: a", "name of a link", "`world`"],
            "link names",
        ),
        (
            pin.replace("right", "left"),
            vec!["r.toml:6:50", "loop `c`: b", "another link", "`left`"],
            "correct",
        ),
        (
            format!("{pin}, length = 0.1"),
            vec!["r.toml:6:68", "loop `c`: length", "only with the kind `distance`"],
            "remove the key",
        ),
        (
            format!("{pin}, terms = {{ left = 1 }}"),
            vec!["r.toml:6:67", "loop `c`: terms", "only with the kind `coordinate`"],
            "remove the key",
        ),
        (
            format!("{pin}, constant = 1"),
            vec!["r.toml:6:70", "loop `c`: constant", "only with the kind `coordinate`"],
            "remove the key",
        ),
        (pin.replace("revolute", "distance"), vec!["r.toml:6:1", "loop `c`", "`length` in m"], "add"),
        (
            format!("{}, length = -0.1", pin.replace("revolute", "distance")),
            vec!["r.toml:6:68", "length", "a positive number", "`-0.1`"],
            "correct",
        ),
        (format!("{pin}, a_xyz = [0, 0]"), vec!["r.toml:6:67", "array of length 3"], ""),
        (format!("{pin}, a_xyz = [0, 0, \"90deg\"]"), vec!["r.toml:6:74", "a finite number", "90deg"], ""),
        (format!("{pin}, b_rpy = [0, \"90grad\", 0]"), vec!["r.toml:6:71", "90grad", "90deg"], ""),
        (format!("{pin}, b_rpy = [0, nan, 0]"), vec!["r.toml:6:71", "a finite number"], ""),
        (gear.to_owned(), vec!["r.toml:6:1", "loop `g`", "`terms`, factors of joints"], "add"),
        (format!("{gear}, terms = {{ }}"), vec!["r.toml:6:44", "terms", "at least one joint"], "correct"),
        (
            format!("{gear}, terms = {{ hing = 1 }}"),
            vec!["r.toml:6:46", "loop `g`: terms", "name of a joint", "`hing`"],
            "did you mean `hinge`",
        ),
        (
            format!("{gear}, terms = {{ hinge = 0 }}"),
            vec!["r.toml:6:46", "terms.hinge", "other than 0"],
            "correct",
        ),
        (
            format!("{gear}, terms = {{ plate = 1 }}"),
            vec!["r.toml:6:46", "terms.plate", "one coordinate", "a floating joint"],
            "",
        ),
        (format!("{gear}, terms = {{ eye = 1 }}"), vec!["terms.eye", "one coordinate", "a fixed joint"], ""),
        (
            format!("{gear}, terms = {{ left = 1 }}, b_xyz = [0, 0, 0]"),
            vec!["r.toml:6:66", "loop `g`: b_xyz", "only with a kind that joins two links"],
            "remove the key",
        ),
        (
            format!("{gear}, terms = {{ left = 1 }}, length = 1"),
            vec!["r.toml:6:67", "loop `g`: length", "only with the kind `distance`"],
            "remove the key",
        ),
        (
            format!("{pin} }},\n{{ {pin}"),
            vec!["r.toml:7:1", "every loop name once", "`c`", "line 6"],
            "rename",
        ),
    ];
    for (entry, parts, hint) in &cases {
        let text = tree(&format!("loop = [\n{{ {entry} }} ]"));
        check(&toml_robot::parse(&text, "r.toml").expect_err(entry), parts, hint);
    }
}

#[test]
fn broken_home_floating_and_actuated() {
    let cases: Vec<(&str, Vec<&str>, &str)> = vec![
        (
            "home = { lef = 1 }",
            vec!["r.toml:5:10", "home", "name of a joint", "`lef`"],
            "did you mean `left`",
        ),
        ("home = { left = [1, 2] }", vec!["r.toml:5:10", "home: left", "one number", "`1 2`"], ""),
        ("home = { left = [] }", vec!["r.toml:5:10", "home: left", "one number"], ""),
        ("home = { left = true }", vec!["r.toml:5:17", "90deg", "a list of them"], ""),
        ("home = { left = [1, nan] }", vec!["r.toml:5:21", "finite"], ""),
        ("home = { eye = 0 }", vec!["r.toml:5:10", "home: eye", "does not move"], ""),
        ("home = { plate = 1 }", vec!["r.toml:5:10", "home: plate", "seven numbers x y z qx qy qz qw"], ""),
        ("home = { plate = [0, 0, 0, 0, 0, 1] }", vec!["seven numbers"], ""),
        ("home = { plate = [0, 0, 0, 0, 0, 0, 0.9] }", vec!["quaternion of length 1"], ""),
        ("home = { root_joint = [0, 0, 0, 0, 0, 0, 1] }", vec!["`root_joint`"], ""),
        ("floating = [\"left\",\n\"rigt\"]", vec!["r.toml:6:1", "link or joint", "`rigt`"], "mean `right`"),
        ("floating = [\"left\",\n\"left\"]", vec!["r.toml:6:1", "floating name once", "line 5"], "rename"),
        ("floating = [\"ground\"]", vec!["r.toml:5:13", "a link that a joint carries"], ""),
        ("floating = \"left\"", vec!["r.toml:5:12", "a sequence"], ""),
        ("actuated = [\"left\",\n\"hing\"]", vec!["r.toml:6:1", "actuated", "`hing`"], "mean `hinge`"),
    ];
    for (rest, parts, hint) in &cases {
        check(&toml_robot::parse(&tree(rest), "r.toml").expect_err(rest), parts, hint);
    }
    // The link `a` hangs on `b` and a joint called `a` carries another.
    let text = "body = [ { name = \"a\", parent = \"ground\", joint = { name = \"b\", axis = [0, 0, 1] } },\n\
        { name = \"c\", parent = \"a\", joint = { name = \"a\", axis = [0, 0, 1] } } ]\nfloating = [\"a\"]";
    let error = toml_robot::parse(text, "r.toml").unwrap_err();
    check(&error, &["r.toml:3:13", "a name that means one joint", "`a`"], "correct");
}
