//! SDF: twins in URDF have the same efforts, what the format leaves out is what it says, and the rest is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::*;
use dynid_robots::{RobotFile, SettingValue, robot, sdf, urdf};

/// An arm on a stand: frames of joints away from those of links, poses in each other, axes in other frames.
const ARM: &str = r#"<?xml version="1.0"?>
<sdf version="1.9">
  <model name="arm" canonical_link="base">
    <!-- the stand -->
    <link name="base"><pose>0 0 0.5 0 0 0.3</pose><inertial><mass>4</mass></inertial></link>
    <joint name="stand" type="fixed"><parent>world</parent><child>base</child></joint>
    <frame name="mount" attached_to="base"><pose>0.1 0.2 0.3 1.5 -0.7 2.9</pose></frame>
    <link name="upper">
      <pose relative_to="shoulder"/>
      <inertial>
        <pose>0.1 -0.2 0.3 0.3 0.2 0.1</pose>
        <mass>2 <!-- kg --></mass>
        <inertia><ixx>0.3</ixx><ixy>0.01</ixy><ixz>0.02</ixz><iyy>0.4</iyy><iyz>0.03</iyz><izz>0.5</izz></inertia>
      </inertial>
      <visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual>
    </link>
    <joint name="shoulder" type="revolute">
      <pose relative_to="mount"/>
      <parent>mount</parent>
      <child>upper</child>
      <axis>
        <xyz>1 2 -0.5</xyz>
        <limit><lower>-1</lower><upper>2</upper><effort>30</effort><velocity>-1</velocity></limit>
        <dynamics><damping>0.7</damping><friction>0.2</friction></dynamics>
      </axis>
    </joint>
    <link name="fore">
      <pose relative_to="upper" degrees="true">0.1 0.1 0.4 0 90 0</pose>
      <inertial>
        <pose rotation_format="quat_xyzw">0 0.05 0   0 0 0 2</pose>
        <mass>0.5</mass>
        <inertia><ixx>0.01</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia>
      </inertial>
    </link>
    <joint name="slide" type="prismatic">
      <pose>0.02 0.03 -0.04 0.4 0.5 0.6</pose>
      <parent>upper</parent>
      <child>fore</child>
      <axis><xyz expressed_in="upper">0 0 -3</xyz><limit><lower>-inf</lower><upper>inf</upper></limit></axis>
    </joint>
  </model>
</sdf>"#;

/// The same arm, worked out by hand: `slide` sits in the frame of `fore`, whose axis is that of `upper`.
const TWIN: &str = r#"<robot name="arm">
  <link name="world"/>
  <link name="base"><inertial><mass value="4"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="upper"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.3 0.2 0.1"/><mass value="2"/>
    <inertia ixx="0.3" ixy="0.01" ixz="0.02" iyy="0.4" iyz="0.03" izz="0.5"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0 0.05 0"/><mass value="0.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="stand" type="fixed"><origin xyz="0 0 0.5" rpy="0 0 0.3"/><parent link="world"/><child link="base"/></joint>
  <joint name="shoulder" type="revolute"><origin xyz="0.1 0.2 0.3" rpy="1.5 -0.7 2.9"/><parent link="base"/><child link="upper"/>
    <axis xyz="1 2 -0.5"/><limit lower="-1" upper="2" effort="30" velocity="0"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0.1 0.1 0.4" rpy="0 1.5707963267948966 0"/><parent link="upper"/><child link="fore"/>
    <axis xyz="3 0 0"/></joint>
</robot>"#;

fn effort(d: &Description, motion: &RandomMotion) -> Vec<Vec<f64>> {
    let model = RobotModel::new(d.build().unwrap(), Vec::new());
    let mut block = RegressorBlock::new(model.layout().clone(), 200);
    motion.with_block(|m| model.regressor(m, &[], &mut block));
    (0..model.outputs().len()).map(|k| block.effort(k, &model.parameters().prior())).collect()
}

#[track_caller]
fn same_efforts(read: &Description, twin: &Description) {
    let mechanism = twin.build().unwrap();
    assert_eq!(read.build().unwrap().rate_names(), mechanism.rate_names());
    let motion = RandomMotion::new(&mechanism, &[], 200, 3);
    let (ours, theirs) = (effort(read, &motion), effort(twin, &motion));
    let scale = theirs.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (x, y) in ours.iter().flatten().zip(theirs.iter().flatten()) {
        // Frames through each other cost some units in the last place of a few hundred products.
        assert!((x - y).abs() < 1e-12 * scale, "{x} {y}");
    }
}

fn read(text: &str) -> RobotFile {
    robot::parse(text, "arm.sdf").unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_twin_in_urdf_has_the_same_efforts() {
    let (file, twin) = (read(ARM), urdf::parse(TWIN, "twin").unwrap());
    same_efforts(&file.description, &twin);
    for (joint, other) in file.description.joints.iter().zip(&twin.joints) {
        assert_eq!((&joint.name, &joint.parent, &joint.child), (&other.name, &other.parent, &other.child));
        assert_eq!((joint.kind, joint.limits), (other.kind, other.limits), "{}", joint.name);
    }
    assert!(file.warnings.is_empty() && file.urdf.is_none(), "{:?}", file.warnings);
    let stated: Vec<(&str, &str)> =
        file.elements.settings.iter().map(|s| (s.joint.as_str(), s.element.as_str())).collect();
    assert_eq!(stated, [("shoulder", "viscous"), ("shoulder", "coulomb")]);
}

#[test]
fn frames_may_be_named_in_any_order_and_axes_in_any_frame() {
    let twin = urdf::parse(TWIN, "twin").unwrap();
    // The pose of the fore-arm in the world, by way of the model; its axis in the frame of the model, and in that of the joint.
    let shoulder = Placement::from_xyz_rpy([0.1, 0.2, 0.3], [1.5, -0.7, 2.9]);
    let base = Placement::from_xyz_rpy([0.0, 0.0, 0.5], [0.0, 0.0, 0.3]);
    let upper = base.then(&shoulder);
    let fore = upper.then(&Placement::from_xyz_rpy([0.1, 0.1, 0.4], [0.0, std::f64::consts::FRAC_PI_2, 0.0]));
    let ([x, y, z], [r, p, w]) = (fore.translation.0, fore.rotation.to_rpy());
    let pose = "<pose relative_to=\"upper\" degrees=\"true\">0.1 0.1 0.4 0 90 0</pose>";
    let in_model = ARM.replace(pose, &format!("<pose>{x:?} {y:?} {z:?} {r:?} {p:?} {w:?}</pose>"));
    assert_ne!(in_model, ARM);
    same_efforts(&read(&in_model).description, &twin);
    let [a, b, c] = upper.rotation.mul_vec(Vec3([0.0, 0.0, -1.0])).0;
    let axis = "<xyz expressed_in=\"upper\">0 0 -3</xyz>";
    for (version, text) in [
        ("1.9", format!("<xyz expressed_in=\"__model__\">{a:?} {b:?} {c:?}</xyz>")),
        ("1.6", format!("<xyz>{a:?} {b:?} {c:?}</xyz><use_parent_model_frame>1</use_parent_model_frame>")),
        ("1.4", format!("<xyz>{a:?} {b:?} {c:?}</xyz>")),
    ] {
        // The other axis is about the same line, whatever the frame.
        let [d, e, f] = upper.rotation.mul_vec(Vec3([1.0, 2.0, -0.5])).0;
        let other = if version == "1.4" {
            format!("<xyz>{d:?} {e:?} {f:?}</xyz>")
        } else {
            "<xyz>1 2 -0.5</xyz>".into()
        };
        let changed = ARM.replace(axis, &text).replace("<xyz>1 2 -0.5</xyz>", &other);
        same_efforts(
            &read(&changed.replace("version=\"1.9\"", &format!("version=\"{version}\""))).description,
            &twin,
        );
    }
}

#[test]
fn gravity_is_that_of_the_world_in_the_axes_of_the_root() {
    let free = "<link name=\"a\"><pose>0 0 0 0 1.5707963267948966 0</pose></link>";
    let model = |before: &str, inside: &str| {
        format!("<sdf version=\"1.7\">{before}<model name=\"m\">{inside}</model>")
    };
    let gravity = |text: String| read(&text).description.gravity.map(|x| (1e12 * x).round() / 1e12);
    assert_eq!(gravity(model("", "<link name=\"a\"/>") + "</sdf>"), [0.0, 0.0, -9.81]);
    assert_eq!(gravity(model("", free) + "</sdf>"), [9.81, 0.0, 0.0]);
    let world = |stated: &str| {
        model(&format!("<world name=\"w\">{stated}"), "<pose>1 2 3 0 0 0</pose><link name=\"a\"/>")
            + "</world></sdf>"
    };
    assert_eq!(gravity(world("")), [0.0, 0.0, -9.8]);
    assert_eq!(gravity(world("<gravity>1 2 3</gravity>")), [1.0, 2.0, 3.0]);
    // A frame of the model is put where the model is.
    let placed = "<sdf version=\"1.8\"><model name=\"m\" placement_frame=\"a\"><pose>0 0 0 0 0 0</pose>"
        .to_owned()
        + free
        + "</model></sdf>";
    assert_eq!(gravity(placed), [0.0, 0.0, -9.81]);
}

#[test]
fn a_world_with_one_model_that_moves_needs_no_name() {
    let ground = "<model name=\"ground\"><static>true</static><link name=\"l\"/></model><include><uri>model://sun</uri></include>";
    let world =
        |inside: &str| format!("<sdf version=\"1.7\"><world name=\"w\">{ground}{inside}</world></sdf>");
    let arm = |name: &str| format!("<model name=\"{name}\"><link name=\"of_{name}\"/></model>");
    assert_eq!(read(&world(&arm("a"))).description.name, "a");
    let two = world(&(arm("a") + &arm("b")));
    let error = robot::parse(&two, "w.sdf").unwrap_err().to_string();
    assert!(error.contains("`FILE#ground`") && error.contains("ground, a, b"), "{error}");
    assert_eq!(sdf::parse_model(&two, "w.sdf", Some("b")).unwrap().description.links[0].name, "of_b");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w.sdf");
    std::fs::write(&path, &two).unwrap();
    let named = |name: &str| robot::read(format!("{}#{name}", path.display()));
    let file = named("b").unwrap();
    assert_eq!((file.description.name.as_str(), file.sources.len()), ("b", 1));
    assert!(file.sources[0].path.ends_with("w.sdf#b"));
    let error = named("c").unwrap_err();
    assert!(error.to_string().contains("ground, a, b"), "{error}");
    std::fs::write(&path, "<robot name=\"r\"><link name=\"l\"/></robot>").unwrap();
    assert!(named("b").unwrap_err().to_string().contains("expected SDF, which may hold several models"));
}

#[test]
fn what_links_leave_out_is_one_kilogram_and_is_told() {
    let file = read("<sdf version=\"1.7\"><model name=\"m\"><link name=\"a\"/></model></sdf>");
    let inertia = file.description.links[0].inertia.unwrap();
    assert_eq!((inertia.mass(), inertia.tensor()), (1.0, Mat3::identity()));
    assert!(file.warnings[0].contains("link `a`: no <inertial>"), "{:?}", file.warnings);
}

#[test]
fn mimic_joints_and_springs() {
    let text = ARM.replace("<axis><xyz expressed_in", "<axis><mimic joint=\"shoulder\"><multiplier>2</multiplier><offset>0.5</offset><reference>0.1</reference></mimic><dynamics><spring_reference>0.2</spring_reference><spring_stiffness>3</spring_stiffness></dynamics><xyz expressed_in");
    let file = read(&text);
    let mimic = file.description.joints[2].mimic.clone().unwrap();
    assert_eq!((mimic.of.as_str(), mimic.ratio), ("shoulder", 2.0));
    assert!((mimic.offset - 0.3).abs() < 1e-15);
    assert!(file.warnings[0].contains("joint `slide`: its spring (3 around 0.2)"), "{:?}", file.warnings);
    let elements = file.elements;
    assert_eq!(elements.beside, [("slide".to_owned(), "spring".to_owned())]);
    let stated = |key: &str| {
        let own = elements.settings.iter().find(|s| (s.element.as_str(), s.key.as_str()) == ("spring", key));
        own.map(|s| (s.joint.as_str(), s.value.clone()))
    };
    // 3 N/m · 0.2 m
    assert_eq!(stated("stiffness"), Some(("slide", SettingValue::Number(3.0))), "{:?}", elements.settings);
    assert_eq!(stated("kq0"), Some(("slide", SettingValue::Number(3.0 * 0.2))));
}

#[track_caller]
fn refused(text: &str, parts: &[&str]) {
    let error = robot::parse(text, "m.sdf").expect_err(text);
    let whole = format!("{error}\nhint: {}", error.hint().unwrap_or_default());
    assert!(whole.starts_with("m.sdf:") && error.hint().is_some(), "{whole}");
    parts.iter().for_each(|part| assert!(whole.contains(part), "expected {part:?} in: {whole}"));
}

#[test]
fn what_a_model_cannot_have() {
    let model = |inside: &str| {
        format!(
            "<sdf version=\"1.9\">\n<model name=\"m\"><link name=\"a\"/><link name=\"b\"/>\n{inside}\n</model></sdf>"
        )
    };
    let joint = |kind: &str, inside: &str| {
        model(&format!(
            "<joint name=\"j\" type=\"{kind}\"><parent>a</parent><child>b</child>{inside}</joint>"
        ))
    };
    let axis = |inside: &str| joint("revolute", &format!("<axis>{inside}</axis>"));
    let cases: Vec<(String, &[&str])> = vec![
        (model("<model name=\"in\"/>"), &["m.sdf:3:1", "model `m`: cannot be carried: a model inside", "into the model itself"]),
        (model("<include><uri>x</uri></include>"), &["a file inside of the model, <include>"]),
        (model("<static>1</static>"), &["it is static"]),
        (model("<static>maybe</static>"), &["<static>: expected true or false, found `maybe`"]),
        (model("<link name=\"a\"/>"), &["every link name once", "`a`", "line 2"]),
        (model("<link name=\"a::b\"/>"), &["a meaning of its own"]),
        (model("<link/>"), &["<link>: expected an attribute `name`"]),
        (model("<link name=\"c\"><gravity>false</gravity></link>"), &["link `c`", "no weight"]),
        (model("<link name=\"c\"><inertial auto=\"true\"/></link>"), &["`auto`", "state <mass>"]),
        (model("<link name=\"c\"><inertial><fluid_added_mass/></inertial></link>"), &["<fluid_added_mass>"]),
        (model("<link name=\"c\"><inertial><mass>-1</mass></inertial></link>"), &["<mass>: expected a mass that is not negative, found `-1`"]),
        (model("<link name=\"c\"><inertial><mass>heavy</mass></inertial></link>"), &["<mass>: expected a finite number, found `heavy`"]),
        (model("<link name=\"c\"><inertial><mass>1</mass><mass>1</mass></inertial></link>"), &["expected <mass> once"]),
        (model("<link name=\"c\"><inertial><pose relative_to=\"a\"/></inertial></link>"), &["remove `relative_to`"]),
        (model("<link name=\"c\"><pose>1 2 3</pose></link>"), &["link `c`: <pose>: expected 6 finite numbers, found `1 2 3`"]),
        (model("<link name=\"c\"><pose rotation_format=\"quat_xyzw\">1 2 3 0 0 0 0</pose></link>"), &["a quaternion other than zero"]),
        (model("<link name=\"c\"><pose rotation_format=\"axis\">1</pose></link>"), &["euler_rpy or quat_xyzw"]),
        (model("<link name=\"c\"><pose frame=\"a\">1 2 3 0 0 0</pose></link>"), &["write `relative_to`"]),
        (model("<frame name=\"f\"><pose relative_to=\"g\"/></frame><frame name=\"g\"><pose relative_to=\"f\"/></frame><link name=\"c\"><pose relative_to=\"f\"/></link><joint name=\"j\" type=\"fixed\"><parent>a</parent><child>c</child></joint>"), &["in a circle"]),
        (model("<frame name=\"f\" attached_to=\"g\"/><frame name=\"g\" attached_to=\"f\"/><joint name=\"j\" type=\"fixed\"><parent>f</parent><child>b</child></joint>"), &["attached to itself"]),
        (joint("ball", ""), &["joint `j`", "of the type ball", "massless links"]),
        (joint("revolute2", ""), &["of the type revolute2"]),
        (joint("hinge", ""), &["type: expected revolute, continuous, prismatic or fixed, found `hinge`"]),
        (model("<joint name=\"j\" type=\"fixed\"><parent>a</parent></joint>"), &["joint `j`: expected <child>"]),
        (model("<joint name=\"j\" type=\"fixed\"><parent>aa</parent><child>b</child></joint>"), &["expected the name of a frame, found `aa`", "did you mean `a`"]),
        (model("<joint name=\"j\" type=\"fixed\"><parent>x::y</parent><child>b</child></joint>"), &["belongs to a model inside"]),
        (model("<joint name=\"j\" type=\"fixed\"><parent>a</parent><child>world</child></joint>"), &["the world hangs on it", "swap"]),
        (model("<joint name=\"j\" type=\"fixed\"><parent>a</parent><child>b</child></joint><joint name=\"j\" type=\"fixed\"><parent>a</parent><child>b</child></joint>"), &["name once", "`j`"]),
        (axis("<xyz>0 0 0</xyz>"), &["<xyz>: expected a direction, not zero"]),
        (axis("<xyz>0 0</xyz>"), &["<xyz>: expected 3 finite numbers, found `0 0`"]),
        (axis("<xyz expressed_in=\"q\">0 0 1</xyz>"), &["name of a frame, found `q`"]),
        (axis("<use_parent_model_frame>1</use_parent_model_frame>"), &["no meaning since SDF 1.7", "expressed_in=\"__model__\""]),
        (axis("<limit><lower>1</lower><upper>-1</upper></limit>"), &["<lower>: expected lower <= upper, found `1`"]),
        (axis("<limit><lower>nan</lower></limit>"), &["<lower>: expected a number"]),
        (axis("<limit><effort>1e-12</effort></limit>"), &["<effort>: expected -1 (no limit)"]),
        (axis("<dynamics><damping>-1</damping></dynamics>"), &["<damping>: expected a number that is not negative"]),
        (axis("<mimic/>"), &["an attribute `joint` of <mimic>"]),
        ("<sdf version=\"1.9\"/>".into(), &["<sdf>: expected a <model>"]),
        ("<sdf><model name=\"m\"><link name=\"a\"/></model></sdf>".into(), &["version: expected a version such as 1.9"]),
        ("<sdf version=\"1.9\"><model name=\"m\"/></sdf>".into(), &["expected a <link>"]),
        ("<sdf version=\"1.9\"><model><link name=\"a\"/></model></sdf>".into(), &["<model>: expected an attribute `name`"]),
        ("<sdf version=\"1.9\"><include><uri>model://arm</uri></include></sdf>".into(), &["its model is in `model://arm`"]),
        ("<sdf version=\"1.9\"><model name=\"m\"><pose relative_to=\"x\"/><link name=\"a\"/></model></sdf>".into(), &["its pose in the world"]),
        ("<sdf version=\"1.9\"><model name=\"m\">".into(), &["never closed"]),
    ];
    for (text, parts) in cases {
        refused(&text, parts);
    }
}

#[test]
fn very_many_frames_are_refused() {
    let frames: String = (0..10_001).map(|k| format!("<frame name=\"f{k}\"/>")).collect();
    refused(
        &format!("<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/>{frames}</model></sdf>"),
        &["expected at most 10000 links, joints and frames, found more"],
    );
}

#[test]
fn a_file_that_is_cut_off_or_changed_is_read_or_refused() {
    for cut in (0..ARM.len()).filter(|cut| ARM.is_char_boundary(*cut)) {
        let _ = robot::parse(&ARM[..cut], "m.sdf");
    }
    // Every number and name in turn by one that fits nowhere.
    let places: Vec<usize> = ARM.match_indices('>').map(|(k, _)| k + 1).collect();
    for place in places {
        for junk in ["nan", "1e999", "&lt;", "<x/>", "-", "__model__", "<pose>1</pose>"] {
            let _ = robot::parse(&format!("{}{junk}{}", &ARM[..place], &ARM[place..]), "m.sdf");
        }
    }
}
