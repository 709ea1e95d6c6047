//! Export of identified parameters: where they go, what the text holds, what is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid::export::{
    CheckStates, ExportError, Exported, Identified, READ_BACK_LIMIT, RobotExport, RobotJson, Source, json,
};
use dynid::io::{mjcf, urdf};
use dynid::model::element::{
    AsymmetricFriction, Coulomb, JointElement, Offset, RotorInertia, Spring, Viscous,
};
use dynid::model::{Description, EffortModel, Inertia, Mat3, RobotModel, Vec3};
use tempfile::TempDir;

/// A file with everything that an edit must not touch: comments, meshes, unknown tags, odd blanks, CR LF.
const ARM: &str = "<?xml version=\"1.0\"?>\r\n<!-- made by hand -->\r\n<robot name=\"arm\" xmlns:x=\"y\">\r\n\
  <material name=\"grey\"><color rgba='.5 .5 .5 1'/></material>\r\n\
  <link name=\"base\"/>\r\n\
  <link name=\"upper\"> <!-- left -->\r\n\
    <visual><geometry><mesh filename=\"package://arm/upper.stl\"/></geometry></visual>\r\n\
    <inertial>\r\n      <origin xyz=\"0.01 0 0.2\"/><mass value=\"3\"/>\r\n\
      <inertia ixx=\"0.05\" ixy=\"0\" ixz=\"0\" iyy=\"0.05\" iyz=\"0\" izz=\"0.01\"/>\r\n    </inertial>\r\n  </link>\r\n\
  <link   name=\"fore\">\r\n    <inertial><origin xyz=\"0 0 0.15\"/><mass value=\"1.5\"/>\
<inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.02\" iyz=\"0\" izz=\"0.005\"/></inertial>\r\n  </link>\r\n\
  <link name=\"tool\"><inertial><origin xyz=\"0 0 0.05\" rpy=\"0.1 0 0\"/><mass value=\"0.4\"/>\
<inertia ixx=\"1e-3\" ixy=\"0\" ixz=\"0\" iyy=\"1e-3\" iyz=\"0\" izz=\"1e-3\"/></inertial></link>\r\n\
  <link name=\"flange\"/>\r\n\
  <joint name=\"shoulder\" type=\"revolute\">\r\n    <origin xyz=\"0 0 0.4\" rpy=\"0.3 0 0\"/><parent link=\"base\"/><child link=\"upper\"/>\r\n\
    <axis xyz=\"0 1 0\"/><limit lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"100\"/>\r\n    <dynamics damping=\"9\" friction=\"9\"/>\r\n  </joint>\r\n\
  <joint name=\"elbow\" type=\"revolute\">\r\n    <origin xyz=\"0 0.1 0.35\"/><parent link=\"upper\"/><child link=\"fore\"/>\r\n\
    <axis xyz=\"1 1 0\"/><limit lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"100\"/>\r\n    <dynamics damping=\"9\" friction=\"9\"/>\r\n  </joint>\r\n\
  <joint name=\"weld\" type=\"fixed\"><origin xyz=\"0 0 0.3\" rpy=\"0 0 1\"/><parent link=\"fore\"/><child link=\"tool\"/></joint>\r\n\
  <joint name=\"weld2\" type=\"fixed\"><origin xyz=\"0 0 0.02\"/><parent link=\"tool\"/><child link=\"flange\"/></joint>\r\n\
  <gazebo reference=\"fore\"><inertial>not ours</inertial></gazebo>\r\n</robot>\r\n";

/// A robot file with a model of it and values.
struct Case {
    folder: TempDir,
    description: Description,
    model: RobotModel,
    values: Vec<f64>,
}

impl Case {
    /// Elements at both joints; values: the robot file's inertias, `elements` one after the other.
    fn new(text: &str, elements: Vec<Box<dyn JointElement>>, values: &[f64]) -> Self {
        Self::held(text, elements, values, &[])
    }

    fn held(
        text: &str,
        elements: Vec<Box<dyn JointElement>>,
        values: &[f64],
        held: &[(String, f64)],
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("arm.urdf"), text).unwrap();
        let mut description = urdf::parse(text, "arm").unwrap();
        description.lock(held).unwrap();
        let model = RobotModel::new(description.build().unwrap(), elements);
        let values = [&model.mechanism().inertia_vector()[..], values].concat();
        assert_eq!(values.len(), model.parameters().linear.len());
        Case { folder, description, model, values }
    }

    fn identified(&self) -> Identified<'_> {
        Identified {
            description: &self.description,
            model: &self.model,
            values: &self.values,
            load_reference: None,
            known_friction: &[],
        }
    }

    fn source(&self) -> Source {
        Source::read(&self.folder.path().join("arm.urdf")).unwrap()
    }

    fn export<T>(&self, work: impl FnOnce(&RobotExport<'_>, &CheckStates) -> T) -> T {
        let source = self.source();
        work(&RobotExport::new(self.identified(), &source).unwrap(), &CheckStates::random(&self.model))
    }

    fn both(&self) -> [Exported; 2] {
        self.export(|e, states| [e.urdf(states).unwrap(), e.mjcf(states).unwrap()])
    }

    /// Sets the inertia of a body.
    fn put(&mut self, link: &str, inertia: Inertia) {
        let b = self.model.mechanism().bodies().iter().position(|b| b.name == link).unwrap();
        self.values[10 * b..][..10].copy_from_slice(&inertia.0);
    }

    /// Requires that the bodies of a robot are the identified ones.
    #[track_caller]
    fn check_bodies(&self, mut read: Description, held: &[(String, f64)]) {
        read.lock(held).unwrap();
        let mechanism = read.build().unwrap();
        for (body, expected) in self.model.mechanism().bodies().iter().zip(self.values.chunks(10)) {
            let found = mechanism.joint_index(&body.joint.name).unwrap();
            let found = mechanism.bodies()[found].inertia.0;
            for (x, y) in found.iter().zip(expected) {
                assert!((x - y).abs() < 1e-12 * expected[0].abs().max(1.0), "{}: {x} {y}", body.name);
            }
        }
    }
}

fn friction() -> Vec<Box<dyn JointElement>> {
    (0..2)
        .flat_map(|rate| -> [Box<dyn JointElement>; 4] {
            [
                Box::new(Coulomb { rate }),
                Box::new(Viscous { rate }),
                Box::new(Offset { rate }),
                Box::new(RotorInertia { rate }),
            ]
        })
        .collect()
}

/// `fc, fv, fo, Ia` of both joints.
const FRICTION: [f64; 8] = [0.7, 1.25, -0.3, 0.05, 0.2, 0.4, 0.1, 0.02];

fn body(mass: f64, com: [f64; 3], moment: f64) -> Inertia {
    Inertia::from_com(mass, Vec3(com), &(Mat3::identity() * moment))
}

/// Text with what an export may change taken out: `<inertial>` of links in `edited`, and `<dynamics>`.
fn frame(text: &str, edited: &[&str]) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("<link").into_iter().chain(rest.find("<dynamics")).min() {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        if rest.starts_with("<dynamics") {
            rest = &rest[rest.find("/>").unwrap() + 2..];
        } else if edited.iter().any(|l| rest[..rest.find('>').unwrap()].contains(&format!("\"{l}\""))) {
            let from = rest.find("<inertial>").unwrap();
            out.push_str(&rest[..from]);
            rest = &rest[rest.find("</inertial>").unwrap()..];
        } else {
            out.push_str("<link");
            rest = &rest[5..];
        }
    }
    out + rest
}

#[test]
fn welded_links_keep_the_file_and_every_other_byte_stays() {
    let mut case = Case::new(ARM, friction(), &FRICTION);
    case.put("fore", body(2.2, [0.01, 0.02, 0.2], 0.06));
    let [urdf_file, mjcf_file] = case.both();
    assert_eq!(frame(&urdf_file.text, &["upper", "fore"]), frame(ARM, &["upper", "fore"]));
    assert!(urdf_file.text.contains("<dynamics damping=\"1.25\" friction=\"0.7\"/>"));
    assert!(
        urdf_file.notes.iter().any(|n| n.starts_with("link `tool` keeps the inertia")),
        "{:?}",
        urdf_file.notes
    );
    for note in [
        "constant load): shoulder -0.3000 N m, elbow 0.1000 N m",
        "armature: shoulder 0.0500 kg m², elbow 0.0200 kg m²",
    ] {
        assert!(urdf_file.notes.iter().any(|n| n.contains(note)), "{:?}", urdf_file.notes);
    }
    assert!(!mjcf_file.notes.iter().any(|n| n.contains("rotor")), "{:?}", mjcf_file.notes);
    case.check_bodies(urdf::parse(&urdf_file.text, "urdf").unwrap(), &[]);
    let read = mjcf::parse(&mjcf_file.text, "mjcf").unwrap();
    assert_eq!(read.joints[0].armature, 0.05);
    case.check_bodies(read.description, &[]);
    for file in [urdf_file, mjcf_file] {
        // Sixteen digits, centres of mass, quaternions.
        assert!(file.difference < 1e-13, "{}", file.difference);
    }
}

#[test]
fn welded_links_state_no_mass_where_the_rest_would_be_impossible() {
    let mut case = Case::new(ARM, friction(), &FRICTION);
    // Lighter than the file's tool.
    case.put("fore", body(0.3, [0.0, 0.0, 0.1], 0.004));
    let [urdf_file, mjcf_file] = case.both();
    assert_eq!(frame(&urdf_file.text, &["upper", "fore", "tool"]), frame(ARM, &["upper", "fore", "tool"]));
    let read = urdf::parse(&urdf_file.text, "urdf").unwrap();
    assert_eq!(
        read.links[3].inertia,
        Some(Inertia::default()),
        "an <inertial> stays, so that loaders make none up"
    );
    assert!(urdf_file.notes.iter().any(|n| n.contains("`fore` carries the whole")), "{:?}", urdf_file.notes);
    case.check_bodies(read, &[]);
    case.check_bodies(mjcf::parse(&mjcf_file.text, "mjcf").unwrap().description, &[]);
    case.export(|e, _| e.require_physical().unwrap());
}

#[test]
fn held_joints_stay_joints_and_their_links_keep_the_file() {
    let held = [("elbow".to_owned(), 0.6)];
    let mut case = Case::held(
        ARM,
        vec![Box::new(Coulomb { rate: 0 }), Box::new(Viscous { rate: 0 })],
        &[0.5, 0.6],
        &held,
    );
    case.put("upper", body(5.2, [0.05, 0.02, 0.25], 0.3));
    let [urdf_file, mjcf_file] = case.both();
    assert_eq!(frame(&urdf_file.text, &["upper"]), frame(ARM, &["upper"]));
    assert!(
        urdf_file.notes.iter().any(|n| n == "friction not identified, left as in the file: elbow"),
        "{:?}",
        urdf_file.notes
    );
    let read = urdf::parse(&urdf_file.text, "urdf").unwrap();
    assert_eq!(read.build().unwrap().rates(), 2);
    case.check_bodies(read, &held);
    case.check_bodies(mjcf::parse(&mjcf_file.text, "mjcf").unwrap().description, &held);
    // Lighter than what hangs on the held joint: nowhere to go, and said.
    case.put("upper", body(1.0, [0.0, 0.0, 0.2], 0.02));
    let error = case.export(|e, _| e.require_physical().unwrap_err().to_string());
    assert!(error.contains("link `upper`") && error.contains("behind joints that were held"), "{error}");
}

#[test]
fn negative_friction_and_rotors_are_written_as_zero_and_said() {
    let case = Case::new(ARM, friction(), &[-0.7, -1.25, 0.0, -0.05, 0.2, 0.4, 0.0, 0.0]);
    let [urdf_file, mjcf_file] = case.both();
    assert!(urdf_file.text.contains("<dynamics damping=\"0.0\" friction=\"0.0\"/>"), "{}", urdf_file.text);
    assert!(!urdf_file.text.contains("friction=\"-") && !urdf_file.text.contains("damping=\"-"));
    assert!(["damping=\"-", "frictionloss=\"-", "armature=\"-"].iter().all(|x| !mjcf_file.text.contains(x)));
    for what in
        ["Coulomb friction of `shoulder`", "viscous friction of `shoulder`", "rotor inertia of `shoulder`"]
    {
        assert!(mjcf_file.notes.iter().any(|n| n.starts_with(what) && n.contains("written as 0")), "{what}");
    }
    // The JSON holds what was identified.
    let text = json(&case.identified(), &CheckStates::random(&case.model)).unwrap().text;
    let robot: RobotJson = serde_json::from_str(&text).unwrap();
    assert_eq!(robot.joints[0].viscous, Some(-1.25));
}

/// What follows the position is no friction: the springs go where they have a place, friction stays what was identified.
#[test]
fn springs_have_a_place_in_mjcf_and_none_in_friction() {
    let of_joint = |rate: usize| -> Vec<Box<dyn JointElement>> {
        vec![Box::new(Coulomb { rate }), Box::new(Viscous { rate }), Box::new(Spring { rate })]
    };
    let values = [0.4, 0.2, 8.0, 3.2, 0.5, 0.1, 30.0, -1.5];
    let case = Case::new(ARM, [of_joint(0), of_joint(1)].into_iter().flatten().collect(), &values);
    let [urdf, mjcf] = case.both();
    let read = mjcf::parse(&mjcf.text, "m.xml").unwrap().joints;
    for (p, expected) in read.iter().zip([(0.4, 0.2, 8.0, 0.4), (0.5, 0.1, 30.0, -0.05)]) {
        assert_eq!((p.friction_loss, p.damping, p.stiffness, p.spring_reference), expected, "{p:?}");
    }
    assert!(
        mjcf.notes.iter().all(|note| !note.contains("spring") && !note.contains("friction")),
        "{:?}",
        mjcf.notes
    );
    assert!(urdf.text.contains("<dynamics damping=\"0.2\" friction=\"0.4\"/>"), "{}", urdf.text);
    assert!(urdf.notes.iter().any(|note| note.contains("spring of shoulder, elbow")), "{:?}", urdf.notes);
}

#[test]
fn asymmetric_friction_is_written_as_the_mean_of_both_directions() {
    let elements: Vec<Box<dyn JointElement>> = vec![Box::new(AsymmetricFriction { rate: 1 })];
    let case = Case::new(ARM, elements, &[1.0, 0.5, 0.3, 0.1]);
    let [urdf_file, _] = case.both();
    assert!(urdf_file.text.contains("<dynamics damping=\"0.2\" friction=\"0.75\"/>"), "{}", urdf_file.text);
    assert!(
        urdf_file.notes.iter().any(|n| n.ends_with("difference of friction between the directions of elbow"))
    );
}

#[test]
fn impossible_links_are_refused_one_by_one() {
    let mut case = Case::new(ARM, Vec::new(), &[]);
    case.put("upper", body(-1.0, [0.0; 3], 0.1));
    case.put(
        "fore",
        Inertia::from_com(
            2.0,
            Vec3([0.0, 0.0, 0.2]),
            &Mat3::from_rows([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.9]]),
        ),
    );
    let faults = case.export(|e, _| match e.require_physical() {
        Err(ExportError::Unphysical { links }) => links,
        other => panic!("{other:?}"),
    });
    let told: Vec<(&str, &str)> = faults.iter().map(|f| (f.link.as_str(), f.fault.as_str())).collect();
    assert_eq!(
        told,
        [
            ("upper", "has a negative mass"),
            ("fore", "has principal moments that violate the triangle inequality")
        ]
    );
    // Asked for, they are written as they are.
    let [urdf_file, _] = case.both();
    case.check_bodies(urdf::parse(&urdf_file.text, "urdf").unwrap(), &[]);
}

#[test]
fn another_robot_and_another_geometry_are_refused() {
    let case = Case::new(ARM, Vec::new(), &[]);
    let with = |text: String| -> dynid::Error {
        let path = case.folder.path().join("other.urdf");
        std::fs::write(&path, text).unwrap();
        let source = Source::read(&path).unwrap();
        let states = CheckStates::random(&case.model);
        match RobotExport::new(case.identified(), &source) {
            Ok(export) => export.urdf(&states).unwrap_err(),
            Err(error) => error,
        }
    };
    let renamed = with(ARM.replace("\"elbow\"", "\"knee\""));
    assert!(matches!(renamed.job(), Some(ExportError::OtherRobot { .. })), "{renamed}");
    assert!(renamed.to_string().contains("`knee`") && renamed.hint().unwrap().contains("--robot"));
    let fixed = with(ARM.replace("name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"fixed\""));
    assert!(fixed.to_string().contains("no moving joint `elbow`"), "{fixed}");
    let moved = with(ARM.replace("0 0.1 0.35", "0 0.1 0.3500001"));
    let Some(ExportError::ReadBack { difference, .. }) = moved.job() else { panic!("{moved}") };
    // A tenth of a micrometre in a third of a metre.
    assert!(*difference > READ_BACK_LIMIT && *difference < 1e-5, "{difference}");
}

#[test]
fn coupled_mimic_joints_follow_in_mjcf() {
    let text = ARM.replace(
        "<axis xyz=\"1 1 0\"/>",
        "<axis xyz=\"1 1 0\"/><mimic joint=\"shoulder\" multiplier=\"-0.5\" offset=\"0.2\"/>",
    );
    let mut case = Case::new(&text, Vec::new(), &[]);
    case.description.couple_mimics = true;
    let elements: Vec<Box<dyn JointElement>> =
        vec![Box::new(Viscous { rate: 0 }), Box::new(RotorInertia { rate: 0 })];
    case.model = RobotModel::new(case.description.build().unwrap(), elements);
    case.values.extend([1.5, 0.25]);
    let [urdf_file, mjcf_file] = case.both();
    assert!(
        mjcf_file.text.contains("<joint joint1=\"elbow\" joint2=\"shoulder\" polycoef=\"0.2 -0.5 0 0 0\"/>")
    );
    assert_eq!(mjcf_file.text.matches("<motor ").count(), 1);
    assert!(urdf_file.difference < 1e-13 && mjcf_file.difference < 1e-13);
}

#[test]
fn json_states_bodies_about_both_points_and_what_acts_at_joints() {
    let elements: Vec<Box<dyn JointElement>> =
        vec![Box::new(Coulomb { rate: 0 }), Box::new(AsymmetricFriction { rate: 1 })];
    let case = Case::new(ARM, elements, &[0.75, 1.0, 0.5, 0.3, 0.1]);
    let exported = json(&case.identified(), &CheckStates::random(&case.model)).unwrap();
    assert!(exported.difference < 1e-14);
    let robot: RobotJson = serde_json::from_str(&exported.text).unwrap();
    assert_eq!((robot.format.as_str(), robot.schema, robot.robot.as_str()), ("dynid-robot", 1, "arm"));
    let upper = &robot.links[0];
    assert_eq!((upper.name.as_str(), upper.joint.as_str(), upper.mass), ("upper", "shoulder", 3.0));
    // Steiner, by hand: m (y² + z²) = 3 · 0.04 about x.
    assert!((upper.inertia_frame[0] - (0.05 + 3.0 * 0.04)).abs() < 1e-15);
    assert!((upper.inertia_com.unwrap()[0] - 0.05).abs() < 1e-15);
    assert!((upper.com.unwrap()[2] - 0.2).abs() < 1e-15 && upper.fault.is_none());
    assert_eq!(robot.links[1].welded, ["tool", "flange"]);
    let [shoulder, elbow] = &robot.joints[..] else { panic!() };
    assert_eq!((shoulder.coulomb, shoulder.viscous, elbow.coulomb), (Some(0.75), None, None));
    let other: Vec<(&str, f64)> = robot.other.iter().map(|o| (o.name.as_str(), o.value)).collect();
    assert_eq!(other, [("elbow.fcp", 1.0), ("elbow.fcn", 0.5), ("elbow.fvp", 0.3), ("elbow.fvn", 0.1)]);
}

#[test]
fn a_helical_joint_is_refused_by_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("screw.toml");
    let text = "schema = 1\nname = \"screw\"\n[[body]]\nname = \"nut\"\nparent = \"ground\"\n\
         joint = { name = \"j\", kind = \"helical\", pitch = 0.01, axis = [0, 0, 1] }\n\
         mass = 1.0\ncom = [0.1, 0, 0]\ninertia_com = [0.1, 0, 0, 0.1, 0, 0.1]\n";
    std::fs::write(&path, text).unwrap();
    let source = Source::read(Path::new(&path)).unwrap();
    let description = dynid::io::robot::read(&path).unwrap().description;
    let model = RobotModel::new(description.build().unwrap(), Vec::new());
    let values = model.mechanism().inertia_vector();
    let identified = Identified {
        description: &description,
        model: &model,
        values: &values,
        load_reference: None,
        known_friction: &[],
    };
    let export = RobotExport::new(identified, &source).unwrap();
    let states = CheckStates::random(&model);
    for (refused, format) in [(export.urdf(&states), "URDF"), (export.mjcf(&states), "MJCF")] {
        let error = refused.unwrap_err().to_string();
        assert!(error.contains(&format!("joint `j`: cannot be written as {format}")), "{error}");
    }
    assert!(json(&identified, &states).is_ok());
}
