//! Every fault and oddity of closed mechanisms, and what is said of it.

use dynid_model::closed::*;
use dynid_model::*;

use crate::robots::{Robot, robot};

fn with(name: &str, change: impl FnOnce(&mut Robot)) -> Robot {
    let mut robot = robot(name);
    change(&mut robot);
    robot
}

#[track_caller]
fn fault(robot: &Robot) -> ClosedError {
    robot.try_close().unwrap_err()
}

#[track_caller]
fn says(fault: &ClosedError, words: &str) {
    assert_eq!(fault.to_string(), words);
}

fn joint_of(closure: &mut ClosureDescription) -> (&mut CutKind, &mut LinkFrame, &mut LinkFrame) {
    match &mut closure.condition {
        Condition::Joint { kind, a, b } => (kind, a, b),
        Condition::Coordinates { .. } => panic!("a joint"),
    }
}

fn coupling(terms: &[(&str, f64)], constant: f64) -> ClosureDescription {
    let terms = terms.iter().map(|(n, f)| ((*n).to_owned(), *f)).collect();
    ClosureDescription { name: "coupling".into(), condition: Condition::Coordinates { terms, constant } }
}

#[test]
fn drives_must_control_all_motions() {
    let found = fault(&with("fivebar", |r| r.driven = vec!["left_crank".into()]));
    let ClosedError::UnderActuated { drives: 1, mobility: 2, motion } = &found else { panic!("{found:?}") };
    assert!(motion.0.iter().all(|(name, _)| name != "left_crank"), "{motion}");
    assert!(motion.0.iter().any(|(name, _)| name == "right_crank"), "{motion}");
    let words = "1 driven joints for a mechanism with 2 free motions: no drive controls `";
    assert!(found.to_string().starts_with(words), "{found}");

    // Two drives in one loop, none in the other.
    let two = with("fourbar", |r| {
        let names = ["crank", "coupler", "rocker"];
        for name in names {
            let mut joint = r.description.joints.iter().find(|j| j.name == name).unwrap().clone();
            let again = |s: &mut String| {
                if s != "ground" {
                    s.push('2');
                }
            };
            [&mut joint.name, &mut joint.parent, &mut joint.child].into_iter().for_each(again);
            r.description.links.push(LinkDescription { name: joint.child.clone(), inertia: None });
            r.description.joints.push(joint);
            let home = r.home.iter().find(|(n, _)| n == name).unwrap().1.clone();
            r.home.push((format!("{name}2"), home));
        }
        let mut closure = r.closures[0].clone();
        closure.name.push('2');
        let (_, a, b) = joint_of(&mut closure);
        [a, b].into_iter().for_each(|end| end.link.push('2'));
        r.closures.push(closure);
        r.driven = vec!["crank".into(), "rocker".into()];
    });
    let found = fault(&two);
    let ClosedError::Dependent { role: "driven", motion } = &found else { panic!("{found:?}") };
    assert!(motion.0.iter().all(|(name, _)| name.ends_with('2')), "{motion}");
    assert!(
        found
            .to_string()
            .starts_with("the driven joints do not determine the motion: with all of them held, `")
    );
    let good = Robot { driven: vec!["crank".into(), "rocker2".into()], ..two }.close();
    assert_eq!(good.mobility(), 2);

    let machine = robot("fivebar").close();
    let found = machine.clone().with_independent(&["left_crank".into()]).unwrap_err();
    says(&found, "expected 2 independent joints, as many as the mechanism has free motions, found 1");
    let found = machine.with_independent(&["left_crank".into(), "left_crank".into()]).unwrap_err();
    says(&found, "joint `left_crank` is named twice among the independent joints");
}

#[test]
fn more_drives_than_motions_share_their_effort() {
    let robot = with("fivebar", |r| r.driven.push("left_distal".into()));
    let machine = robot.close();
    let [warning] = machine.warnings() else { panic!("{:?}", machine.warnings()) };
    assert_eq!(*warning, ClosedWarning::OverActuated { drives: 3, mobility: 2 });
    assert_eq!(
        warning.to_string(),
        "3 drives for 2 free motions: their efforts are determined up to internal load and are shared out with the least norm"
    );
    // Least norm: nothing of the effort lies in the null space of the transposed map.
    let phi = machine.mechanism().inertia_vector();
    let mut dynamics = ClosedDynamics::new(machine);
    let (dq, ddq) = dynamics.motion(&[0.5, -0.7], &[1.0, 2.0]);
    let effort = dynamics.inverse_dynamics((&dq, &ddq), None, &phi).drives;
    let map = dynamics.pose().velocity_map();
    let driven = dynamics.machine().driven();
    let column = |k: usize| [0, 1, 2].map(|i| map[driven[i] * 2 + k]);
    let internal = Vec3(column(0)).cross(Vec3(column(1)));
    assert!(internal.dot(Vec3([effort[0], effort[1], effort[2]])).abs() < 1e-12, "{effort:?}");
}

#[test]
fn faults_of_closures_name_them() {
    let found = fault(&with("fourbar", |r| r.closures.clear()));
    says(&found, "the mechanism has no loops");
    let found = fault(&with("fourbar", |r| r.closures.push(r.closures[0].clone())));
    says(&found, "loop name `C` is used more than once");
    let found = fault(&with("fourbar", |r| joint_of(&mut r.closures[0]).2.link = "coupler".into()));
    says(&found, "loop `C` joins a body to itself: links `coupler` and `coupler` move together");
    let found = fault(&with("fourbar", |r| joint_of(&mut r.closures[0]).2.link = "lever".into()));
    assert!(matches!(&found, ClosedError::Mechanism(MechanismError::UnknownLink { .. })), "{found:?}");
    assert!(found.to_string().contains("`lever`"), "{found}");
    let found = fault(&with("fourbar", |r| {
        *joint_of(&mut r.closures[0]).0 = CutKind::Distance { length: 0.0 };
    }));
    says(&found, "loop `C`: expected a positive length, found 0");
    let found =
        fault(&with("fourbar", |r| joint_of(&mut r.closures[0]).1.placement.translation.0[0] = f64::NAN));
    says(&found, "loop `C`: a number is not finite");
    let found = fault(&with("fourbar", |r| r.closures.push(coupling(&[("crank", f64::INFINITY)], 0.0))));
    says(&found, "loop `coupling`: a number is not finite");
    let found = fault(&with("fourbar", |r| r.closures.push(coupling(&[("crank", 0.0)], 0.0))));
    says(&found, "loop `coupling`: expected a factor other than zero, found none");
    let found = fault(&with("fourbar", |r| r.closures.push(coupling(&[("crank", 1.0)], 0.6))));
    says(&found, "the loops leave no motion: 3 independent conditions on 3 coordinates");
    let found = fault(&with("stewart", |r| r.closures.push(coupling(&[("platform", 1.0)], 0.0))));
    says(&found, "loop `coupling`: joint `platform` floats, only joints with one coordinate can be coupled");
    let found = fault(&with("fourbar", |r| r.closures.push(coupling(&[("lever", 1.0)], 0.0))));
    assert!(matches!(&found, ClosedError::Mechanism(MechanismError::UnknownJoint { .. })), "{found:?}");
    let found = fault(&with("fourbar", |r| {
        r.description.couple_mimics = true;
        r.description.joints[2].mimic = Some(Mimic { of: "crank".into(), ratio: 1.0, offset: 0.0 });
    }));
    says(
        &found,
        "joint `rocker` mimics another and the mechanism has loops: state the coupling as a loop of kind `coordinate`",
    );
}

#[test]
fn faults_of_drives_and_home_name_the_joint() {
    let found = fault(&with("fourbar", |r| r.driven = vec!["lever".into()]));
    assert!(found.to_string().contains("`lever`"), "{found}");
    let found = fault(&with("stewart", |r| r.driven[0] = "platform".into()));
    says(&found, "joint `platform` floats and cannot be driven");
    let found = fault(&with("fivebar", |r| r.driven[1] = "left_crank".into()));
    says(&found, "joint `left_crank` is named twice among the driven joints");
    let found = fault(&with("fourbar", |r| r.home[0].1.push(1.0)));
    says(&found, "home of joint `crank`: expected 1 finite numbers, found [0.6, 1.0]");
    let found = fault(&with("fourbar", |r| r.home[1].1[0] = f64::NAN));
    says(&found, "home of joint `coupler`: expected 1 finite numbers, found [NaN]");
    let zero = |r: &mut Robot| r.home.iter_mut().find(|(n, _)| n == "platform").unwrap().1[6] = 0.0;
    let found = fault(&with("stewart", zero));
    assert!(
        matches!(&found, ClosedError::Home { joint, expected: 7, .. } if joint == "platform"),
        "{found:?}"
    );
    let found = fault(&with("fourbar", |r| r.home.push(("lever".into(), vec![0.0]))));
    assert!(found.to_string().contains("`lever`"), "{found}");
}

#[test]
fn a_home_that_cannot_close_is_refused_with_its_gap() {
    // Longest position of the rest: 0.12 + 0.35 + 0.3 m; the ground link is 0.9 m.
    let far = |r: &mut Robot| r.description.joints[2].placement.translation.0[0] = 0.9;
    let found = fault(&with("fourbar", far));
    let ClosedError::NotClosed { closure, gap } = &found else { panic!("{found:?}") };
    assert_eq!(closure, "C");
    let millimetres: f64 = gap.strip_suffix(" mm").unwrap().parse().unwrap();
    // The gap is 130 mm long; its larger component counts.
    assert!((91.9..130.1).contains(&millimetres.abs()), "{gap}");
    assert!(
        found.to_string().starts_with("loop `C` does not close near the home position: a gap of "),
        "{found}"
    );
    // The plane's own geometry contradicts itself: the rows out of the plane are redundant and cannot be met.
    let found = fault(&with("fourbar", |r| {
        let (kind, _, b) = joint_of(&mut r.closures[0]);
        *kind = CutKind::Revolute;
        b.placement.translation.0[2] = 0.002;
    }));
    let ClosedError::NotClosed { closure, gap } = &found else { panic!("{found:?}") };
    assert_eq!(closure, "C");
    assert!(gap.starts_with("2.0000 mm"), "{gap}");
}

#[test]
fn a_loop_that_closes_with_an_axis_turned_round_is_refused() {
    let found = fault(&with("fourbar", |r| {
        let (kind, _, b) = joint_of(&mut r.closures[0]);
        *kind = CutKind::Revolute;
        b.placement = b.placement.then(&Placement::rotate([1.0, 0.0, 0.0], std::f64::consts::PI));
    }));
    says(
        &found,
        "loop `C` closes with an axis turned round at the home position: turn frame `a` or `b` by 180 degrees, or move the home position",
    );
}

#[test]
fn a_singular_home_is_refused_with_the_motion() {
    // Crank and coupler in line: held at the rocker, both may swing.
    let rocker = ((0.47_f64.powi(2) - 0.25) / 0.24).acos();
    let crank = (0.3 * rocker.sin()).atan2(0.4 + 0.3 * rocker.cos());
    let found = fault(&with("fourbar", |r| {
        r.driven = vec!["rocker".into()];
        r.home = vec![
            ("crank".into(), vec![crank]),
            ("coupler".into(), vec![0.0]),
            ("rocker".into(), vec![rocker]),
        ];
    }));
    let ClosedError::SingularHome { role: "driven", measure, least, motion } = &found else {
        panic!("{found:?}")
    };
    assert!(*measure < 1e-4 && *least == 1e-4);
    assert!(motion.0.iter().any(|(name, _)| name == "crank"), "{motion}");
    assert!(
        found.to_string().starts_with("the home position is singular for the driven joints (measure "),
        "{found}"
    );
}

#[test]
fn oddities_are_told_and_nothing_else() {
    for name in ["fourbar", "fivebar", "prr3", "delta", "stewart"] {
        assert_eq!(robot(name).close().warnings(), [], "{name}");
    }
    let spatial = with("fourbar", |r| *joint_of(&mut r.closures[0]).0 = CutKind::Revolute).close();
    let [warning] = spatial.warnings() else { panic!("{:?}", spatial.warnings()) };
    assert_eq!(*warning, ClosedWarning::Redundant { rows: 5, rank: 2, closures: vec!["C".into()] });
    assert_eq!(
        warning.to_string(),
        "loops state 5 conditions of which 2 are independent: forces of `C` are not determined and are shared out with the least norm"
    );
    assert_eq!(spatial.is_determined(), [true, true, false, false, false]);

    let stated = robot("fivebar");
    let tree = stated.description.build().unwrap();
    let machine = ClosedMechanism::new(tree, stated.closures, None, &stated.home).unwrap();
    let [warning] = machine.warnings() else { panic!("{:?}", machine.warnings()) };
    let ClosedWarning::DrivesChosen { joints } = warning else { panic!("{warning:?}") };
    assert_eq!(joints.len(), 2);
    assert!(warning.to_string().starts_with("no joint is stated to be driven: `"), "{warning}");

    let moved = with("fourbar", |r| r.home[1].1[0] += 0.05).close();
    let [warning] = moved.warnings() else { panic!("{:?}", moved.warnings()) };
    let ClosedWarning::HomeMoved { largest } = warning else { panic!("{warning:?}") };
    assert!((largest - 0.05).abs() < 1e-9);
    assert_eq!(
        warning.to_string(),
        "the home position was moved by up to 5.00e-2 (rad or m) to close the loops"
    );
}
