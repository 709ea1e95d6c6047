//! Joints with clearance: the tree, motions in and out of the bearing's axes, the contact element.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::contact::{HertzStiffness, LankaraniNikravesh, SlidingFriction};
use dynid_model::element::{
    ClearanceContact, JointElement, JournalFriction, JournalMotion, impact_speed_signal,
};
use dynid_model::*;
use dynid_testing::golden;
use serde_json::Value;

const CLEARANCE: f64 = 5e-5;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Two revolute joints, the second axis along `-y` of the first frame (Sun, Han, Li & Li 2021).
fn pointing(arm: f64, gravity: f64, inertias: [Option<Inertia>; 2]) -> Description {
    let joint = |name: &str, parent: &str, child: &str, placement: Placement| JointDescription {
        name: name.into(),
        parent: parent.into(),
        child: child.into(),
        kind: JointKind::Revolute,
        placement,
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    };
    let [first, second] = inertias;
    let quarter = std::f64::consts::FRAC_PI_2;
    let turned =
        Placement { translation: Vec3([arm, 0.0, 0.0]), ..Placement::rotate([1.0, 0.0, 0.0], quarter) };
    Description {
        gravity: [-gravity, 0.0, 0.0],
        links: vec![
            LinkDescription { name: "base".into(), inertia: None },
            LinkDescription { name: "x".into(), inertia: first },
            LinkDescription { name: "y".into(), inertia: second },
        ],
        joints: vec![joint("a", "base", "x", Placement::identity()), joint("b", "x", "y", turned)],
        ..Description::new("pointing")
    }
}

/// `p = [Ixx2, Ixy2, Ixz2, Iyy2, Iyz2, Izz2, m2, Ls2, Izz1, Ls1, m1]`.
fn inertias(p: &[f64]) -> [Option<Inertia>; 2] {
    let about = Mat3::from_rows([[p[0], p[1], p[2]], [p[1], p[3], p[4]], [p[2], p[4], p[5]]]);
    let first = Mat3::from_rows([[0.0; 3], [0.0; 3], [0.0, 0.0, p[8]]]);
    [
        Some(Inertia::from_com(p[10], Vec3([p[9], 0.0, 0.0]), &first)),
        Some(Inertia::from_com(p[6], Vec3([p[7], 0.0, 0.0]), &about)),
    ]
}

#[test]
fn torques_and_reactions_are_those_of_the_golden_file() {
    let Some(golden) = golden("xy_dynamics.json") else { return };
    let number = |key: &str| golden[key].as_f64().unwrap();
    for state in golden["states"].as_array().unwrap() {
        let of = |key: &str| numbers(&state[key]);
        let description = pointing(number("L1"), number("g"), inertias(&of("p")));
        let mechanism = description.with_clearance(&["a", "b"]).unwrap().build().unwrap();
        assert_eq!(mechanism.rate_names(), ["a", "b", "a.x", "a.y", "b.x", "b.y"]);
        let (q, dq, ddq) = (of("q"), of("qd"), of("qdd"));
        let (e, ed, edd) = (of("e"), of("ed"), of("edd"));
        let mut all = [q.clone(), dq.clone(), ddq.clone()];
        for k in 0..2 {
            let at = |of: &[f64]| [of[2 * k], of[2 * k + 1]];
            let journal = JournalPath { position: at(&e), rate: at(&ed), acceleration: at(&edd) };
            let path = journal.in_bearing([q[k], dq[k], ddq[k]]);
            all[0].extend(path.position);
            all[1].extend(path.rate);
            all[2].extend(path.acceleration);
        }
        let dynamics = Dynamics::new(&mechanism);
        let mut effort = [0.0; 6];
        let motion = State { q: &all[0], dq: &all[1], ddq: &all[2], gravity: None };
        dynamics.inverse_dynamics(
            &motion,
            &mechanism.inertia_vector(),
            &mut dynamics.workspace(),
            &mut effort,
        );
        for (found, expected) in effort.iter().zip(of("tau")) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        for (k, key) in ["F1_frame1", "F2_frame2"].into_iter().enumerate() {
            let force =
                JournalPath { position: [effort[2 + 2 * k], effort[3 + 2 * k]], ..JournalPath::default() };
            let force = force.in_journal([q[k], 0.0, 0.0]).position;
            for (found, expected) in force.iter().zip(of(key)) {
                assert!((found - expected).abs() < 1e-12, "{key}: {found} {expected}");
            }
        }
    }
}

#[test]
fn motions_in_bearing_axes_are_derivatives_of_each_other_and_come_back() {
    let journal =
        |t: f64| [[(3.0 * t).sin(), t * t], [3.0 * (3.0 * t).cos(), 2.0 * t], [-9.0 * (3.0 * t).sin(), 2.0]];
    let joint = |t: f64| [t.exp(), t.exp(), t.exp()];
    let at = |t: f64| {
        let [position, rate, acceleration] = journal(t);
        JournalPath { position, rate, acceleration }.in_bearing(joint(t))
    };
    let (t, h) = (0.4, 1e-5);
    let (before, now, after) = (at(t - h), at(t), at(t + h));
    for k in 0..2 {
        let rate = (after.position[k] - before.position[k]) / (2.0 * h);
        let acceleration = (after.rate[k] - before.rate[k]) / (2.0 * h);
        assert!((rate - now.rate[k]).abs() < 1e-8 && (acceleration - now.acceleration[k]).abs() < 1e-7);
    }
    let [position, rate, acceleration] = journal(t);
    let back = now.in_journal(joint(t));
    for (found, expected) in [(back.position, position), (back.rate, rate), (back.acceleration, acceleration)]
    {
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-13), "{found:?} {expected:?}");
    }
}

#[test]
fn bearings_of_any_axis_keep_the_robot_as_it_was() {
    let mut description =
        pointing(0.1, 9.81, inertias(&[4e-3, 1e-4, 0.0, 5e-3, 0.0, 2e-3, 0.9, 0.03, 0.02, 0.05, 2.0]));
    description.joints[1].axis = [0.3, -0.5, 0.8];
    let ideal = description.build().unwrap();
    let mechanism = description.with_clearance(&["b"]).unwrap().build().unwrap();
    assert!(mechanism.warnings().len() <= ideal.warnings().len() + 2, "{:?}", mechanism.warnings());
    let (q, dq, ddq) = ([0.3, -0.7], [0.4, 1.1], [-0.8, 0.5]);
    let efforts = |mechanism: &Mechanism, more: usize| {
        let extend = |x: &[f64]| [x, &vec![0.0; more]].concat();
        let (q, dq, ddq) = (extend(&q), extend(&dq), extend(&ddq));
        let dynamics = Dynamics::new(mechanism);
        let mut effort = vec![0.0; 2 + more];
        let motion = State { q: &q, dq: &dq, ddq: &ddq, gravity: None };
        let inertias = mechanism.inertia_vector();
        dynamics.inverse_dynamics(&motion, &inertias, &mut dynamics.workspace(), &mut effort);
        effort
    };
    let (without, with) = (efforts(&ideal, 0), efforts(&mechanism, 2));
    assert!((0..2).all(|k| (without[k] - with[k]).abs() < 1e-13), "{without:?} {with:?}");
    let axes: Vec<Vec3<f64>> = mechanism.bodies().iter().map(|b| b.joint.axis).collect();
    assert!((axes[2].cross(axes[3]) + axes[1].scale(-1.0)).norm() < 1e-14, "{axes:?}");
}

#[test]
fn joints_that_have_no_journal_are_refused() {
    let with = |change: &dyn Fn(&mut Description), joints: &[&str]| {
        let mut description = pointing(0.1, 9.81, [None, None]);
        change(&mut description);
        description.with_clearance(joints).unwrap_err()
    };
    let kind = |kind: JointKind| move |d: &mut Description| d.joints[0].kind = kind;
    for (k, found) in [
        (JointKind::Prismatic, "a joint that slides"),
        (JointKind::Fixed, "a fixed joint"),
        (JointKind::Floating, "a floating joint"),
        (JointKind::Helical { pitch: 0.1 }, "a screw"),
    ] {
        let expected = MechanismError::NoJournal { joint: "a".into(), found };
        assert_eq!(with(&kind(k), &["a"]), expected);
    }
    assert!(matches!(with(&|_| {}, &["c"]), MechanismError::UnknownJoint { .. }));
    assert!(matches!(with(&|_| {}, &["a", "a"]), MechanismError::NoJournal { .. }));
    let mimic =
        |d: &mut Description| d.joints[1].mimic = Some(Mimic { of: "a".into(), ratio: 1.0, offset: 0.0 });
    assert!(matches!(with(&mimic, &["a"]), MechanismError::NoJournal { .. }));
    assert!(matches!(with(&mimic, &["b"]), MechanismError::NoJournal { .. }));
}

fn contact() -> ClearanceContact {
    ClearanceContact {
        rotation: 1,
        translations: [2, 3],
        law: LankaraniNikravesh::new(HertzStiffness::given(1e9, CLEARANCE).unwrap(), 0.6).unwrap().into(),
        friction: SlidingFriction::new(0.2, 1e-5, 1e-4).unwrap(),
        journal_radius: 0.01,
    }
}

fn model() -> RobotModel {
    let description = pointing(0.1, 9.81, [None, None]);
    let mechanism = description.with_clearance(&["b"]).unwrap().build().unwrap();
    RobotModel::new(mechanism, vec![Box::new(contact()) as Box<dyn JointElement>])
}

/// Some motions of the journal, in contact and not, sliding and nearly sticking.
fn motions() -> Vec<JournalMotion> {
    (0..24)
        .map(|k| {
            let k = f64::from(k);
            let length = CLEARANCE * (0.97 + 0.01 * (k % 12.0));
            let spin = if k < 12.0 { 3.0 * (1.7 * k).sin() } else { 6e-3 * (1.7 * k).sin() };
            JournalMotion {
                position: [length * k.cos(), length * k.sin()],
                rate: [2e-3 * (2.0 * k).sin(), 1e-3 * (3.0 * k).cos()],
                spin,
                impact_speed: 0.0,
            }
        })
        .collect()
}

#[test]
fn contact_forces_are_the_laws_and_take_energy() {
    let contact = contact();
    let mut closed = 0;
    for motion in motions() {
        let parameters = [1.3, 0.7, 0.2];
        let found = contact.contact(&motion, parameters);
        let efforts = contact.efforts(&motion, parameters, None);
        let (n, t) = (found.normal, [-found.normal[1], found.normal[0]]);
        for k in 0..2 {
            let expected = found.normal_force * n[k] - found.friction_force * t[k];
            assert!((efforts[k] - expected).abs() <= 1e-12 * found.normal_force, "{efforts:?}");
        }
        assert!((efforts[2] + 0.01 * found.friction_force).abs() <= 1e-14 * found.normal_force);
        assert!(found.friction_force * found.sliding <= 0.0 && found.normal_force >= 0.0);
        let (slopes, ..) = contact.efforts_with_slopes(&motion, parameters, None);
        assert!((0..3).all(|k| (slopes[k] - efforts[k]).abs() <= 1e-12 * (1.0 + efforts[k].abs())));
        if found.penetration > 0.0 {
            closed += 1;
            let force = contact.law.at(found.penetration, 0.0);
            let expected = 1.3 * force.elastic + 0.7 * force.damping * found.penetration_rate;
            assert!((found.normal_force - expected).abs() <= 1e-12 * expected.abs());
        } else {
            assert_eq!(efforts, [0.0; 3]);
        }
    }
    assert!((10..20).contains(&closed), "{closed}");
}

#[test]
fn slopes_of_the_contact_are_differences_of_its_efforts() {
    let contact = contact();
    let parameters = [1.3, 0.7, 0.2];
    for motion in motions() {
        let depth = contact.contact(&motion, parameters).penetration;
        let (_, by_position, by_rate) = contact.efforts_with_slopes(&motion, parameters, None);
        let at = |change: &dyn Fn(&mut JournalMotion)| {
            let mut motion = motion;
            change(&mut motion);
            contact.efforts(&motion, parameters, None)
        };
        let check = |found: f64, expected: f64, scale: f64| {
            assert!((found - expected).abs() <= 1e-5 * scale, "{found} {expected} at depth {depth}");
        };
        if depth.abs() < 1e-8 {
            continue;
        }
        for k in 0..2 {
            let h = 1e-11;
            let (up, down) = (at(&|m| m.position[k] += h), at(&|m| m.position[k] -= h));
            let (faster, slower) = (at(&|m| m.rate[k] += 1e-7), at(&|m| m.rate[k] -= 1e-7));
            for row in 0..3 {
                let scale = if row == 2 { 1e5 } else { 1e7 };
                check((up[row] - down[row]) / (2.0 * h), by_position[row][k], scale);
                check((faster[row] - slower[row]) / 2e-7, by_rate[row][k], scale * 1e-2);
            }
        }
        let (faster, slower) = (at(&|m| m.spin += 1e-6), at(&|m| m.spin -= 1e-6));
        for row in 0..3 {
            check((faster[row] - slower[row]) / 2e-6, by_rate[row][2], 1e3);
        }
    }
}

/// Position, rate, acceleration of `a, b, b.x, b.y` for the motions.
fn block() -> [Vec<f64>; 3] {
    let all = motions();
    let column = |f: &dyn Fn(&JournalMotion) -> f64| all.iter().map(f).collect::<Vec<f64>>();
    let zero = column(&|_| 0.0);
    let q = [zero.clone(), column(&|m| m.spin), column(&|m| m.position[0]), column(&|m| m.position[1])];
    let dq = [zero.clone(), column(&|m| m.spin), column(&|m| m.rate[0]), column(&|m| m.rate[1])];
    [q.concat(), dq.concat(), zero.repeat(4)]
}

#[test]
fn regressor_and_adjoint_of_the_model_hold_the_contact() {
    let model = model();
    let [q, dq, ddq] = block();
    let n = motions().len();
    let motion = MotionBlock::plain(n, &q, &dq, &ddq);
    let table = model.parameters();
    let names: Vec<&str> = table.linear.iter().rev().take(3).map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["b.mu", "b.contact_damping", "b.contact_stiffness"]);
    assert_eq!(table.prior()[table.linear.len() - 3..], [1.0, 1.0, 0.2]);
    assert_eq!((0..4).map(|r| model.is_undriven(r)).collect::<Vec<_>>(), [false, false, true, true]);
    assert_eq!(model.signals(), [impact_speed_signal("b")]);

    let mut linear = vec![0.0; table.linear.len()];
    let first = linear.len() - 3;
    linear[first..].copy_from_slice(&[1.3, 0.7, 0.2]);
    let mut block = RegressorBlock::new(model.layout().clone(), n);
    model.regressor(&motion, &[], &mut block);
    let contact = contact();
    for (rate, place) in [(2, 0), (3, 1), (1, 2)] {
        let effort = block.effort(rate, &linear);
        for (s, journal) in motions().iter().enumerate() {
            let expected = contact.efforts(journal, [1.3, 0.7, 0.2], None)[place];
            assert!((effort[s] - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "{rate} {s}");
        }
    }
    let weights: Vec<f64> = (0..4 * n).map(|k| (1.3 * k as f64).sin()).collect();
    let mut adjoint = MotionAdjoint::new(4, 4, n);
    model.effort_adjoint(&motion, &[], &linear, n, &weights, &mut adjoint);
    for (s, journal) in motions().iter().enumerate() {
        let (_, by_position, by_rate) = contact.efforts_with_slopes(journal, [1.3, 0.7, 0.2], None);
        let weight = |place: usize| weights[[2, 3, 1][place] * n + s];
        let slope = |of: &dyn Fn(usize) -> f64| (0..3).map(|row| weight(row) * of(row)).sum::<f64>();
        for k in [0, 1] {
            let expected = slope(&|row| by_position[row][k]);
            let found = adjoint.q[(2 + k) * n + s];
            assert!((found - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{found} {expected}");
        }
        let expected = slope(&|row| by_rate[row][2]);
        let found = adjoint.dq[n + s];
        assert!((found - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{found} {expected}");
    }
}

#[test]
fn the_speed_of_an_impact_is_remembered_until_contact_ends() {
    let model = model();
    let depths = [-1e-6, 1e-7, 3e-7, 2e-7, -1e-7, 1e-7];
    let speeds = [0.05, 0.05, 0.02, -0.03, -0.03, 0.004];
    let n = depths.len();
    let zero = vec![0.0; n];
    let q = [zero.clone(), zero.clone(), depths.map(|d| CLEARANCE + d).to_vec(), zero.clone()].concat();
    let dq = [zero.clone(), zero.clone(), speeds.to_vec(), zero.clone()].concat();
    let ddq = zero.repeat(4);
    let mut out = vec![0.0; n];
    let motion = MotionBlock::plain(n, &q, &dq, &ddq);
    model.remember(&motion, 1e-3, &[], &mut History::default(), n, &mut out);
    // A slow one has the floor of the law.
    assert_eq!(out, [0.0, 0.05, 0.05, 0.05, 0.0, 0.01]);
}

/// The pointing mechanism with journals and a reference near its inertias.
fn with_journals(mu: f64) -> JournalModel {
    let description =
        pointing(0.1, 9.81, inertias(&[4e-3, 1e-4, 2e-4, 5e-3, -1e-4, 2e-3, 0.9, 0.03, 0.02, 0.05, 2.0]));
    let ideal = description.build().unwrap();
    let reference = [ideal.inertia_vector(), vec![mu, 2.0 * mu]].concat();
    let moving = description.with_clearance(&["a", "b"]).unwrap().build().unwrap();
    let law = LankaraniNikravesh::new(HertzStiffness::given(1e9, CLEARANCE).unwrap(), 0.9).unwrap();
    let contact = |rotation: usize| ClearanceContact {
        rotation,
        translations: [2 + 2 * rotation, 3 + 2 * rotation],
        law: law.into(),
        friction: SlidingFriction::new(mu, 1e-5, 1e-4).unwrap(),
        journal_radius: 0.01,
    };
    let elements: Vec<Box<dyn JointElement>> =
        (0..2).map(|rate| Box::new(JournalFriction { rate }) as Box<dyn JointElement>).collect();
    let reference = LoadReference { linear: reference, shape: Vec::new(), linearised: false };
    let ideal = TreeModel::new(ideal, elements);
    JournalModel::new(ideal, moving, (0..2).map(contact).collect(), reference).unwrap()
}

/// Channels of offsets of some micrometres for a number of samples.
fn offsets(model: &JournalModel, samples: usize) -> Vec<(String, Vec<f64>)> {
    let sizes = [5e-5, 1e-2, 2.0];
    let named = model.offset_channels().flat_map(|own| own.iter().zip(sizes));
    let named = named.flat_map(|(pair, size)| pair.iter().map(move |name| (name.clone(), size)));
    let values = |(k, (name, size)): (usize, (String, f64))| {
        (name, (0..samples).map(|s| size * ((7 * k + 3 * s) as f64).sin()).collect())
    };
    named.enumerate().map(values).collect()
}

fn with_channels<T>(
    motion: &MotionBlock<'_>,
    channels: &[(String, Vec<f64>)],
    work: impl FnOnce(&MotionBlock<'_>) -> T,
) -> T {
    let channels: Vec<(&str, &[f64])> = channels.iter().map(|(n, v)| (n.as_str(), v.as_slice())).collect();
    work(&MotionBlock { channels: &channels, ..*motion })
}

#[test]
fn adjoint_with_journals_is_the_derivative_but_for_the_friction_moment() {
    // Without friction nothing is held.
    let model = with_journals(0.0);
    let samples = 5;
    let channels = offsets(&model, samples);
    let mut linear = model.ideal().mechanism().inertia_vector();
    linear.iter_mut().enumerate().for_each(|(k, x)| *x += 0.01 * (k as f64).cos());
    linear.extend([0.0; 2]);
    let weights: Vec<f64> = (0..2 * samples).map(|k| (k as f64 + 0.5).sin()).collect();
    model.random_motion(samples, 3).with_block(|block| {
        let value = |states: &[Vec<f64>; 3]| {
            let [q, dq, ddq] = states;
            let motion = MotionBlock { q, dq, ddq, ..*block };
            let mut effort = vec![0.0; 2 * samples];
            with_channels(&motion, &channels, |m| model.efforts(m, &[], &linear, samples, &mut effort));
            effort.iter().zip(&weights).map(|(e, w)| e * w).sum::<f64>()
        };
        let mut out = MotionAdjoint::new(2, 2, samples);
        with_channels(block, &channels, |m| {
            model.effort_adjoint(m, &[], &linear, samples, &weights, &mut out);
        });
        let at = [block.q.to_vec(), block.dq.to_vec(), block.ddq.to_vec()];
        for (k, found) in [&out.q, &out.dq, &out.ddq].into_iter().enumerate() {
            for (place, found) in found.iter().enumerate() {
                let moved = |by: f64| {
                    let mut states = at.clone();
                    states[k][place] += by;
                    value(&states)
                };
                let h = 1e-5;
                let expected = (moved(h) - moved(-h)) / (2.0 * h);
                assert!((found - expected).abs() < 1e-7, "{k} {place}: {found} {expected}");
            }
        }
    });
}

#[test]
fn journals_rest_where_contact_and_friction_balance_their_load() {
    let model = with_journals(0.1);
    let samples = 40;
    model.random_motion(samples, 5).with_block(|block| {
        let (forces, looks) = (model.forces(block), model.look(block));
        for (joint, look) in looks.iter().enumerate() {
            assert!(!look.probed && look.offset.iter().all(|e| (e - CLEARANCE).abs() < 1e-18));
            let force = forces[2 * joint].iter().zip(&forces[2 * joint + 1]).map(|(x, y)| x.hypot(*y));
            assert!(look.load.iter().zip(force).all(|(load, force)| (load - force).abs() < 1e-12 * force));
        }
        // M mu = F_t R2 with F_t = mu c_d F_n and F = F_n √(1 + (mu c_d)²).
        let mut rows = RegressorBlock::new(model.layout().clone(), samples);
        model.regressor(block, &[], &mut rows);
        for (joint, (mu, column)) in [(0.1_f64, 20), (0.2, 21)].into_iter().enumerate() {
            let place = model.layout().columns(joint).iter().position(|c| *c == column).unwrap();
            for s in 0..samples {
                let moment = mu * rows.column(joint, place)[s];
                let normal = looks[joint].load[s] / mu.hypot(1.0);
                let expected = mu * normal * 0.01 * block.rate(joint)[s].signum();
                assert!((moment - expected).abs() < 1e-12 * expected.abs(), "{moment} {expected}");
            }
        }
    });
}

#[test]
fn sums_of_loads_are_derivatives_of_the_moments() {
    let model = with_journals(0.1);
    let samples = 30;
    let reference = [model.ideal().mechanism().inertia_vector(), vec![0.1, 0.2]].concat();
    // Probes hold the journals where they are.
    let channels = offsets(&model, samples);
    model.random_motion(samples, 6).with_block(|block| {
        let sums_at = |at: &[f64]| with_channels(block, &channels, |motion| model.load_sums(motion, at));
        let sums = sums_at(&reference);
        for (joint, sum) in sums.iter().enumerate() {
            assert_eq!(sum.mu, 20 + joint);
            assert!((sum.product - sum.square).abs() < 1e-12 * sum.square);
            for (k, found) in sum.change.iter().enumerate() {
                // The sum of squares changes by twice that of the products.
                let moved = |by: f64| {
                    let mut other = reference.clone();
                    other[k] += by;
                    sums_at(&other)[joint].square
                };
                let h = 1e-6;
                let expected = (moved(h) - moved(-h)) / (4.0 * h);
                assert!((found - expected).abs() < 1e-6 * sum.square.max(1e-3), "{k}: {found} {expected}");
            }
        }
    });
}
