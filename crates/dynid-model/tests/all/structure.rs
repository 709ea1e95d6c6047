//! From description to mechanism: faults, warnings, merging, locking.

use crate::random_tree::{
    self, check_close, effort, generator, inertia, largest_term, motion, placement, regressor, tree,
};
use dynid_model::mechanism::MAX_MOVING_JOINTS;
use dynid_model::*;

/// A chain of three revolute joints `j1..j3` between links `l0..l3`.
fn chain() -> Description {
    let mut d = tree(3, 1);
    for (k, joint) in d.joints.iter_mut().enumerate() {
        joint.kind = JointKind::Revolute;
        joint.axis = [0.0, 0.0, 1.0];
        joint.parent = format!("l{k}");
    }
    d
}

fn fault(change: impl FnOnce(&mut Description)) -> MechanismError {
    let mut d = chain();
    assert!(d.build().is_ok());
    change(&mut d);
    d.build().expect_err("a faulty description")
}

#[test]
fn faults_of_the_graph_are_named() {
    let e = fault(|d| d.links.clear());
    assert!(matches!(e, MechanismError::Empty { .. }), "{e}");
    let e = fault(|d| d.joints.iter_mut().for_each(|j| j.kind = JointKind::Fixed));
    assert!(matches!(e, MechanismError::NothingMoves { .. }), "{e}");
    let e = fault(|d| d.links[2].name = "l1".into());
    assert!(matches!(&e, MechanismError::Duplicate { what: "link", name } if name == "l1"), "{e}");
    let e = fault(|d| d.joints[2].name = "j1".into());
    assert!(matches!(&e, MechanismError::Duplicate { what: "joint", name } if name == "j1"), "{e}");
    let e = fault(|d| d.joints[1].parent = "nowhere".into());
    assert!(matches!(&e, MechanismError::MissingLink { role: "parent", joint, .. } if joint == "j2"), "{e}");
    let e = fault(|d| d.joints[1].child = "nowhere".into());
    assert!(
        matches!(&e, MechanismError::MissingLink { role: "child", link, .. } if link == "nowhere"),
        "{e}"
    );
    let e = fault(|d| d.joints[2].child = "l2".into());
    assert!(matches!(&e, MechanismError::TwoParents { link, .. } if link == "l2"), "{e}");
    let e = fault(|d| d.links.push(LinkDescription { name: "alone".into(), inertia: None }));
    assert!(matches!(&e, MechanismError::ManyRoots { count: 2, second, .. } if second == "alone"), "{e}");
    // A circle without a root, and one beside a sound chain.
    let e = fault(|d| {
        let back = JointDescription {
            name: "back".into(),
            parent: "l3".into(),
            child: "l0".into(),
            ..d.joints[0].clone()
        };
        d.joints.push(back);
    });
    assert!(matches!(e, MechanismError::Cycle { .. }), "{e}");
    let e = fault(|d| {
        for name in ["a", "b"] {
            d.links.push(LinkDescription { name: name.into(), inertia: None });
        }
        for (name, parent, child) in [("x", "a", "b"), ("y", "b", "a")] {
            let (name, parent, child) = (name.into(), parent.into(), child.into());
            d.joints.push(JointDescription { name, parent, child, ..d.joints[0].clone() });
        }
    });
    assert!(matches!(&e, MechanismError::Cycle { link } if link == "a" || link == "b"), "{e}");
    let e = fault(|d| d.joints[1].child = "l1".into());
    assert!(matches!(e, MechanismError::TwoParents { .. }), "a joint from a link to itself: {e}");
}

#[test]
fn faults_of_numbers_are_named() {
    let e = fault(|d| d.joints[1].axis = [0.0; 3]);
    assert!(matches!(&e, MechanismError::ZeroAxis { joint } if joint == "j2"), "{e}");
    for bad in [f64::NAN, f64::INFINITY] {
        let what = |e: MechanismError| match e {
            MechanismError::NotFinite { what, name } => (what, name),
            other => panic!("{other}"),
        };
        assert_eq!(what(fault(|d| d.joints[1].axis[0] = bad)), ("axis", "j2".into()));
        assert_eq!(what(fault(|d| d.joints[1].placement.translation.0[2] = bad)), ("origin", "j2".into()));
        assert_eq!(what(fault(|d| d.joints[1].placement.rotation.0[2].0[0] = bad)), ("origin", "j2".into()));
        assert_eq!(what(fault(|d| d.gravity[1] = bad)), ("gravity", "tree 1".into()));
        let inertia = |d: &mut Description| d.links[3].inertia.as_mut().unwrap().0[5] = bad;
        assert_eq!(what(fault(inertia)), ("inertia", "l3".into()));
        let ratio = |d: &mut Description| {
            d.couple_mimics = true;
            d.joints[2].mimic = Some(Mimic { of: "j1".into(), ratio: bad, offset: 0.0 });
        };
        assert_eq!(what(fault(ratio)), ("mimic ratio or offset", "j3".into()));
    }
}

#[test]
fn followers_need_a_leader() {
    let follow = |of: &str| Some(Mimic { of: of.into(), ratio: 1.0, offset: 0.0 });
    let check = |e: MechanismError, expected: &str| {
        assert!(matches!(&e, MechanismError::Mimic { fault, .. } if fault.contains(expected)), "{e}");
    };
    let coupled = |change: &dyn Fn(&mut Description)| {
        fault(|d| {
            d.couple_mimics = true;
            change(d);
        })
    };
    check(coupled(&|d| d.joints[0].mimic = follow("j1")), "in turn");
    check(
        coupled(&|d| {
            d.joints[0].mimic = follow("j2");
            d.joints[1].mimic = follow("j3");
            d.joints[2].mimic = follow("j1");
        }),
        "in turn",
    );
    check(coupled(&|d| d.joints[0].mimic = follow("nobody")), "no moving joint");
    check(
        coupled(&|d| {
            d.joints[2].kind = JointKind::Floating;
            d.joints[0].mimic = follow("j3");
        }),
        "one coordinate",
    );
}

#[test]
fn thousand_joints_are_enough() {
    let long = |joints: usize| {
        let mut d = chain();
        for k in 4..=joints {
            d.links.push(LinkDescription { name: format!("l{k}"), ..d.links[1].clone() });
            let (parent, child) = (format!("l{}", k - 1), format!("l{k}"));
            d.joints.push(JointDescription { name: format!("j{k}"), parent, child, ..d.joints[0].clone() });
        }
        d.build()
    };
    assert_eq!(long(MAX_MOVING_JOINTS).unwrap().rates(), 1000);
    assert_eq!(long(1001).unwrap_err(), MechanismError::TooManyJoints { found: 1001 });
}

#[test]
fn odd_inertias_only_warn() {
    let warnings = |inertia: Option<Inertia>| {
        let mut d = chain();
        d.links[2].inertia = inertia;
        d.build().unwrap().warnings().to_vec()
    };
    let one = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0];
    assert_eq!(warnings(Some(Inertia(one))), []);
    assert_eq!(warnings(None), [MechanismWarning::NotStated { body: "l2".into() }]);
    let with = |changes: &[(usize, f64)]| {
        let mut phi = one;
        changes.iter().for_each(|(c, value)| phi[*c] = *value);
        Some(Inertia(phi))
    };
    let odd = [
        (with(&[(0, -1.0)]), "negative mass"),
        (with(&[(0, 0.0)]), "no mass"),
        (Some(Inertia::default()), "no mass"),
        (with(&[(4, -1.0)]), "negative principal moment"),
        (with(&[(9, 2.5)]), "triangle"),
        (with(&[(1, 5.0)]), "negative principal moment"),
    ];
    for (inertia, expected) in odd {
        match warnings(inertia).as_slice() {
            [MechanismWarning::NotPhysical { body, fault }] => {
                assert!(body == "l2" && fault.contains(expected), "{fault}, expected {expected}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn fixed_links_add_their_shifted_inertia() {
    for seed in 0..20 {
        let d = tree(5, seed);
        let mut rng = generator(seed + 900);
        let mut with_links = d.clone();
        let mut sum = d.clone();
        // A link on a link, both welded to body l3, and a weight on the ground.
        let (first, second) = (placement(&mut rng), placement(&mut rng));
        let weights = [inertia(&mut rng), inertia(&mut rng), inertia(&mut rng)];
        let weld = |name: &str, parent: &str, placement: Placement| JointDescription {
            name: format!("to {name}"),
            parent: parent.into(),
            child: name.into(),
            kind: JointKind::Fixed,
            placement,
            ..d.joints[0].clone()
        };
        for (name, weight) in ["tool", "tip", "ballast"].into_iter().zip(weights) {
            with_links.links.push(LinkDescription { name: name.into(), inertia: Some(weight) });
        }
        with_links.joints.insert(1, weld("tip", "tool", second));
        with_links.joints.push(weld("tool", "l3", first));
        with_links.joints.push(weld("ballast", "l0", first));
        let body = sum.links[3].inertia.as_mut().unwrap();
        *body = body.plus(&weights[0].in_frame(&first)).plus(&weights[1].in_frame(&first.then(&second)));
        let (mechanism, expected) = (with_links.build().unwrap(), sum.build().unwrap());
        assert_eq!(mechanism.bodies().len(), 5);
        for (found, expected) in mechanism.bodies().iter().zip(expected.bodies()) {
            check_close(&found.inertia.0, &expected.inertia.0, 1e-13 * 50.0, "inertia");
        }
        assert_eq!(mechanism.bodies()[2].fixed_links.len(), 2);
        let m = motion(&expected, seed);
        let tolerance = 1e-13 * largest_term(&expected, &regressor(&expected, &m));
        check_close(&effort(&mechanism, &m), &effort(&expected, &m), tolerance, &format!("tree {seed}"));
    }
}

#[test]
fn locked_joints_leave_the_other_efforts_as_they_were() {
    for seed in 0..20 {
        let d = tree(6, seed);
        let free = d.build().unwrap();
        let locked: Vec<usize> =
            [1, 4].into_iter().filter(|k| d.joints[*k].kind != JointKind::Floating).collect();
        let mut m = motion(&free, seed);
        let held: Vec<(String, f64)> = locked
            .iter()
            .map(|k| {
                let body = &free.bodies()[*k];
                m.dq[body.rate] = 0.0;
                m.ddq[body.rate] = 0.0;
                (body.joint.name.clone(), m.q[body.position])
            })
            .collect();
        let mut shorter = d.clone();
        shorter.lock(&held).unwrap();
        let shorter = shorter.build().unwrap();
        assert_eq!(shorter.rates(), free.rates() - locked.len());
        let keep = |values: &[f64], first: &dyn Fn(&Body) -> (usize, usize)| -> Vec<f64> {
            let kept = free.bodies().iter().enumerate().filter(|(k, _)| !locked.contains(k));
            kept.flat_map(|(_, b)| values[first(b).0..][..first(b).1].to_vec()).collect()
        };
        let position = |b: &Body| (b.position, b.joint.positions());
        let rate = |b: &Body| (b.rate, b.joint.rates());
        let short = random_tree::Motion {
            q: keep(&m.q, &position),
            dq: keep(&m.dq, &rate),
            ddq: keep(&m.ddq, &rate),
        };
        let expected = keep(&effort(&free, &m), &rate);
        let tolerance = 1e-13 * largest_term(&free, &regressor(&free, &m));
        check_close(&effort(&shorter, &short), &expected, tolerance, &format!("tree {seed}"));
    }
    let mut d = chain();
    let e = d.lock(&[("nobody".into(), 0.0)]).unwrap_err();
    assert!(
        matches!(&e, MechanismError::UnknownJoint { name, known } if name == "nobody" && known.len() == 3),
        "{e}"
    );
}

#[test]
fn roll_pitch_yaw_give_the_rotation_back_next_to_gimbal_lock() {
    use std::f64::consts::FRAC_PI_2;
    for distance in [0.0, 1e-16, 1e-12, 1e-9, 4.9e-9, 1e-6, 1e-3, 0.4, 1.5] {
        for pitch in [FRAC_PI_2 - distance, -FRAC_PI_2 + distance] {
            for (roll, yaw) in [(0.3, -2.0), (-3.0, 0.0), (1.57, 3.1), (0.0, 1.0)] {
                let rotation = Mat3::from_rpy([roll, pitch, yaw]);
                let back = Mat3::from_rpy(rotation.to_rpy());
                let error = (rotation + back * -1.0).0.iter().map(|c| c.norm()).fold(0.0, f64::max);
                assert!(error <= 1e-15, "{roll} {pitch} {yaw}: {error:e}");
            }
        }
    }
}
