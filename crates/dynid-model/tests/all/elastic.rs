//! Elastic joints: the spring, its element, coordinates without bodies.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::tree;
use dynid_model::element::{
    Arctangent, AsymmetricFriction, Coulomb, CubicSpring, Cyclic, ElasticDoubt, ElasticTransmission,
    ExponentialViscous, ExternalLoad, JetMotion, JointElement, LuGre, Offset, PiecewiseSpring, PowerLaw,
    RotorInertia, ShapeSetting, Sigmoid, SigmoidOffset, Spring, Stribeck, StribeckViscous, TanhFriction,
    Viscous, ViscousMagnitude,
};
use dynid_model::scalar::{Jet, Scalar as _};
use dynid_model::*;
use dynid_testing::golden;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

const HIT: CubicSpring = CubicSpring { k1: 396_500.0, k2: 1.336e11 };
const RATIO: f64 = 290.0;

/// A joint without bodies: coordinates `link` (0) and `motor` (1).
fn bare_joint(elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    let coordinates = vec![Coordinate::turning("link"), Coordinate::turning("motor")];
    RobotModel::with_coordinates(Mechanism::without_bodies("joint"), coordinates, elements)
}

fn efforts(model: &RobotModel, motion: &MotionBlock<'_>, linear: &[f64], output: usize) -> Vec<f64> {
    let mut block = RegressorBlock::new(model.layout().clone(), motion.samples);
    model.regressor(motion, &model.parameters().shape_start(), &mut block);
    block.effort(output, linear)
}

#[test]
fn deformations_are_those_of_the_golden_file() {
    let Some(g) = golden("hit_spring.json") else { return };
    let spring = CubicSpring { k1: g["k1"].as_f64().unwrap(), k2: g["k2"].as_f64().unwrap() };
    for (t, expected) in numbers(&g["torque"]).into_iter().zip(numbers(&g["dtheta"])) {
        let found = spring.deformation(t).unwrap();
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{t}: {found:e} {expected:e}");
        assert!((spring.torque(found) - t).abs() <= 1e-12 * t.abs(), "{t}");
    }
    let motor = spring.motor_side(RATIO);
    for (found, name) in [(motor.k1, "k1"), (motor.k2, "k2")] {
        let expected = g["motor_side"][name].as_f64().unwrap();
        assert!((found - expected).abs() <= 1e-12 * expected, "{name}: {found} {expected}");
    }
}

#[test]
fn input_friction_and_cyclic_torque_are_those_of_the_golden_file() {
    let Some(g) = golden("hit_friction.json") else { return };
    let p = |key: &str| g[key].as_f64().unwrap();
    let held = ShapeSetting::held;
    let fading = StribeckViscous { rate: 1, vs: held(p("omega_s")), delta: held(p("delta_s")) };
    let joint = bare_joint(vec![
        Box::new(Viscous { rate: 1 }),
        Box::new(TanhFriction { rate: 1, w: held(p("omega1")) }),
        Box::new(fading),
        Box::new(Coulomb { rate: 1 }),
        Box::new(Cyclic::torque(0, ShapeSetting::held(1.0))),
    ]);
    let names: Vec<&str> = joint.parameters().linear.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["motor.fv", "motor.ft", "motor.fvs", "motor.fc", "link.ca", "link.cb"]);
    let check = |output: usize, position: &[f64], speed: &[f64], linear: &[f64], expected: &[f64]| {
        let rest = vec![0.0; expected.len()];
        let (q, dq) = ([position, &rest].concat(), [&rest, speed].concat());
        let motion = MotionBlock::plain(expected.len(), &q, &dq, &q);
        for (k, e) in expected.iter().enumerate() {
            let found = efforts(&joint, &motion, linear, output)[k];
            assert!((found - e).abs() <= 1e-12, "{k}: {found} {e}");
        }
    };
    let speeds = numbers(&g["theta_in_d"]);
    let linear = [p("b_in"), p("C1"), p("C2"), p("b_inD"), 0.0, 0.0];
    check(1, &vec![0.0; speeds.len()], &speeds, &linear, &numbers(&g["T_d_in"]));
    let c = &g["cyclic"];
    let (sine, cosine) = (c["A1"].as_f64().unwrap(), c["A2"].as_f64().unwrap());
    let angles = numbers(&c["theta_out"]);
    let rest = vec![0.0; angles.len()];
    let found = joint.friction_passivity(1, &[], &linear, (-20.0, 20.0), &[]);
    assert_eq!(found.passivity, Passivity::Passive);
    check(0, &angles, &rest, &[0.0, 0.0, 0.0, 0.0, cosine, sine], &numbers(&c["T_b"]));
}

#[test]
fn torques_are_those_of_the_catalogue() {
    let Some(g) = golden("mech_elements.json") else { return };
    let e = &g["elastic"];
    let ratio = e["N"].as_f64().unwrap();
    let joint = bare_joint(vec![Box::new(ElasticTransmission::new(0, 1, ratio))]);
    let q = [numbers(&e["theta_out"]), numbers(&e["theta_in"])].concat();
    let expected = numbers(&e["T_k"]);
    let rest = vec![0.0; q.len()];
    let motion = MotionBlock::plain(expected.len(), &q, &rest, &rest);
    let linear = [e["k1"].as_f64().unwrap(), e["k2"].as_f64().unwrap()];
    let rows = [0, 1].map(|output| efforts(&joint, &motion, &linear, output));
    for (k, t) in expected.iter().enumerate() {
        assert!((-rows[0][k] - t).abs() <= 1e-12 * t.abs(), "link, {k}: {} {t}", rows[0][k]);
        assert!((ratio * rows[1][k] - t).abs() <= 1e-12 * t.abs(), "motor, {k}: {} {t}", rows[1][k]);
    }
}

#[test]
fn inverses_hold_for_any_spring_and_say_where_there_is_none() {
    for k2 in [0.0, 1e-300, 1e-3, 1.0, 4e3, 1e12, 1e100, -1e-300, -1e-3, -1.0, -4e3] {
        let spring = CubicSpring { k1: 7.0, k2 };
        let largest = spring.largest_deformation().min(1e3);
        for share in [0.0, 1e-12, 1e-3, 0.1, 0.5, 0.9] {
            for sign in [-1.0, 1.0] {
                let x = sign * share * largest;
                let torque = spring.torque(x);
                if torque.is_finite() {
                    let found = spring.deformation(torque).unwrap();
                    // A relative error of the torque counts that much more where the spring is soft.
                    let condition = if x == 0.0 { 1.0 } else { (torque / x / spring.stiffness(x)).max(1.0) };
                    let large = (1.0 + (k2.abs() / 7.0).sqrt() * x.abs()).ln();
                    let bound = 4e-15 * condition * (1.0 + large) * x.abs();
                    assert!((found - x).abs() <= bound, "{k2:e}: {found:e} {x:e}");
                }
            }
        }
    }
    let soft = CubicSpring { k1: 3.0, k2: -4.0 };
    assert_eq!(soft.largest_deformation(), 0.5);
    assert_eq!(soft.stiffness(0.5), 0.0);
    let peak = soft.torque(0.5);
    assert_eq!(peak, 1.0);
    assert!((soft.deformation(peak).unwrap() - 0.5).abs() < 1e-7);
    assert_eq!(soft.deformation(1.0 + 1e-9), None);
    assert!(soft.is_passive(0.499) && !soft.is_passive(0.5));
    assert_eq!(CubicSpring::least_k2(3.0, 0.5), -4.0);
    assert_eq!(CubicSpring { k1: -1.0, k2: 1.0 }.deformation(1.0), None);
    assert_eq!(HIT.deformation(f64::NAN), None);
    assert_eq!(CubicSpring { k1: 7.0, k2: 1e300 }.deformation(1e280), None, "too large for numbers");
    let back = HIT.motor_side(RATIO).joint_side(RATIO);
    assert!((back.k1 / HIT.k1 - 1.0).abs() < 1e-15 && (back.k2 / HIT.k2 - 1.0).abs() < 1e-15);
    // Power is the change of energy, and stiffness that of torque.
    let (x, h) = (1.2e-3, 1e-7);
    let slope = |f: &dyn Fn(f64) -> f64| (f(x + h) - f(x - h)) / (2.0 * h);
    assert!((slope(&|x| HIT.energy(x)) / HIT.torque(x) - 1.0).abs() < 1e-7);
    assert!((slope(&|x| HIT.torque(x)) / HIT.stiffness(x) - 1.0).abs() < 1e-7);
    assert!((slope(&|x| HIT.stiffness(x)) / HIT.stiffness_slope(x) - 1.0).abs() < 1e-7);
}

/// The best of its kind, with the worst error of a fine grid, and back.
#[test]
fn catalogue_stiffnesses_are_the_nearest() {
    let t3 = 1200.0;
    let fit = HIT.piecewise([300.0, 800.0], t3).unwrap();
    let grid = 20_000;
    let torques: Vec<f64> = (0..=grid).map(|k| t3 * f64::from(k) / f64::from(grid)).collect();
    let differences = |spring: &PiecewiseSpring| -> Vec<f64> {
        torques.iter().map(|t| spring.deformation(*t) - HIT.deformation(*t).unwrap()).collect()
    };
    let loss = |spring: &PiecewiseSpring| differences(spring).iter().map(|d| d * d).sum::<f64>();
    let largest = differences(&fit.spring).iter().fold(0.0_f64, |m, d| m.max(d.abs()));
    println!(
        "{fit:?}, {:.2} % of the deformation under T3",
        100.0 * fit.worst / HIT.deformation(t3).unwrap()
    );
    assert!((largest / fit.worst - 1.0).abs() < 1e-4, "{largest:e} {:e}", fit.worst);
    for k in 0..3 {
        for change in [0.999, 1.001] {
            let mut other = fit.spring;
            other.stiffness[k] *= change;
            assert!(loss(&other) > loss(&fit.spring), "stiffness {k}");
        }
    }
    let spring = fit.spring;
    for x in [-1.6e-3, -1e-4, 0.0, 3e-4, 1.1e-3, 2.5e-3] {
        assert!((spring.deformation(spring.torque(x)) - x).abs() <= 1e-15 * x.abs().max(1e-3));
    }
    assert!(
        (spring.torque(fit.knots[0]) - 300.0).abs() < 1e-10
            && (spring.torque(fit.knots[1]) - 800.0).abs() < 1e-10
    );

    let back = spring.cubic(t3).unwrap();
    let end = spring.deformation(t3);
    let deformations: Vec<f64> = (0..=grid).map(|k| end * f64::from(k) / f64::from(grid)).collect();
    let misses = |cubic: &CubicSpring| -> Vec<f64> {
        deformations.iter().map(|x| cubic.torque(*x) - spring.torque(*x)).collect()
    };
    let loss = |cubic: &CubicSpring| misses(cubic).iter().map(|d| d * d).sum::<f64>();
    let largest = misses(&back.spring).iter().fold(0.0_f64, |m, d| m.max(d.abs()));
    println!("back: {back:?}");
    assert!((largest / back.worst - 1.0).abs() < 1e-4, "{largest} {}", back.worst);
    for (a, b) in [(0.999, 1.0), (1.001, 1.0), (1.0, 0.999), (1.0, 1.001)] {
        let other = CubicSpring { k1: back.spring.k1 * a, k2: back.spring.k2 * b };
        assert!(loss(&other) > loss(&back.spring));
    }
    assert!((back.spring.k1 / HIT.k1 - 1.0).abs() < 0.05 && (back.spring.k2 / HIT.k2 - 1.0).abs() < 0.05);

    // One stiffness throughout is both.
    let straight = CubicSpring { k1: 5e4, k2: 0.0 }.piecewise([10.0, 20.0], 50.0).unwrap();
    assert!(straight.spring.stiffness.iter().all(|k| (k / 5e4 - 1.0).abs() < 1e-12));
    let cubic = straight.spring.cubic(50.0).unwrap();
    assert!((cubic.spring.k1 / 5e4 - 1.0).abs() < 1e-12 && cubic.worst < 1e-9);
    assert_eq!(HIT.piecewise([800.0, 300.0], t3), None);
    assert_eq!(HIT.piecewise([300.0, 800.0], 700.0), None);
    assert_eq!(CubicSpring { k1: 1.0, k2: -1.0 }.piecewise([0.1, 0.2], 0.5), None);
}

/// An arm of four joints, the second of which slides, elastic joints 1, 2 and 4 with motors `m1`, `m2`, `m4`, one of which
/// slides; the spring of joint 2 is linear, two are damped.
fn elastic_arm() -> RobotModel {
    let mut d = tree(4, 3);
    for (k, joint) in d.joints.iter_mut().enumerate() {
        joint.kind = if k == 1 { JointKind::Prismatic } else { JointKind::Revolute };
    }
    let motors = vec![Coordinate::turning("m1"), Coordinate::turning("m2"), Coordinate::sliding("m4")];
    let mut elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(ElasticTransmission { damping: true, ..ElasticTransmission::new(0, 4, 3.0) }),
        Box::new(ElasticTransmission { cubic: false, damping: true, ..ElasticTransmission::new(1, 5, -2.0) }),
        Box::new(ElasticTransmission::new(3, 6, 1.5)),
        Box::new(Spring { rate: 0 }),
        Box::new(TanhFriction { rate: 4, w: ShapeSetting::held(0.4) }),
    ];
    for rate in 0..7 {
        elements.push(Box::new(Viscous { rate }));
        if rate >= 4 {
            elements.push(Box::new(RotorInertia { rate }));
        }
    }
    RobotModel::with_coordinates(d.build().unwrap(), motors, elements)
}

#[test]
fn outputs_parameters_and_rows_cover_motors() {
    let model = elastic_arm();
    let names: Vec<&str> = model.outputs().iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["j1", "j2", "j3", "j4", "m1", "m2", "m4"]);
    let units: Vec<&str> = model.outputs().iter().map(|o| o.unit).collect();
    assert_eq!(units, ["N m", "N", "N m", "N m", "N m", "N m", "N"]);
    assert_eq!((model.dimensions(), model.travels()), ((7, 7), [3.0, -2.0, 1.5].as_slice()));
    assert_eq!(model.joints()[5].position, 5);
    let unit = |name: &str| model.parameters().linear[model.parameters().column(name).unwrap()].unit;
    let found = ["j1.k1", "j1.k2", "j1.d", "j2.k1", "j2.d", "j4.k2"].map(unit);
    assert_eq!(found, ["N m/rad", "N m/rad³", "N m s/rad", "N/m", "N s/m", "N m/rad³"]);
    assert_eq!(model.parameters().column("j2.k2"), None);

    let rigid = RobotModel::new(model.mechanism().clone(), vec![]);
    let random = RandomMotion::new(model.mechanism(), &[], 5, 3);
    assert_eq!(RandomMotion::of(&rigid, model.mechanism(), 5, 3), random, "nothing else without coordinates");
    let linear: Vec<f64> = (0..model.parameters().linear.len()).map(|k| 0.3 + 0.1 * (k % 7) as f64).collect();
    let at = |name: &str| linear[model.parameters().column(name).unwrap()];
    for samples in [2, 9] {
        RandomMotion::of(&model, model.mechanism(), samples, 4).with_block(|block| {
            let stride = samples + 1;
            let (mut found, mut bodies) = (vec![f64::NAN; 7 * stride], vec![0.0; 4 * stride]);
            model.efforts(block, &[], &linear, stride, &mut found);
            rigid.efforts(block, &[], &linear[..40], stride, &mut bodies);
            for s in 0..samples {
                let q = |c: usize| block.position(c)[s];
                let (v, a) = (|c: usize| block.rate(c)[s], |c: usize| block.acceleration(c)[s]);
                let x1 = q(4) / 3.0 - q(0);
                let t1 = at("j1.k1") * x1 + at("j1.k2") * x1.powi(3) + at("j1.d") * (v(4) / 3.0 - v(0));
                let t2 = at("j2.k1") * (q(5) / -2.0 - q(1)) + at("j2.d") * (v(5) / -2.0 - v(1));
                let x4 = q(6) / 1.5 - q(3);
                let t4 = at("j4.k1") * x4 + at("j4.k2") * x4.powi(3);
                let own = |c: usize, name: &str| at(&format!("{name}.fv")) * v(c);
                let rotor = |c: usize, name: &str| own(c, name) + at(&format!("{name}.Ia")) * a(c);
                let expected = [
                    bodies[s] + own(0, "j1") - t1 + at("j1.k") * q(0) - at("j1.kq0"),
                    bodies[stride + s] + own(1, "j2") - t2,
                    bodies[2 * stride + s] + own(2, "j3"),
                    bodies[3 * stride + s] + own(3, "j4") - t4,
                    rotor(4, "m1") + t1 / 3.0 + at("m1.ft") * (v(4) / 0.4).tanh(),
                    rotor(5, "m2") - t2 / 2.0,
                    rotor(6, "m4") + t4 / 1.5,
                ];
                for (o, e) in expected.iter().enumerate() {
                    let row = efforts(&model, block, &linear, o)[s];
                    let scale = e.abs().max(100.0);
                    assert!(
                        (found[o * stride + s] - e).abs() <= 1e-13 * scale,
                        "{o}: {} {e}",
                        found[o * stride + s]
                    );
                    assert!((row - e).abs() <= 1e-13 * scale, "{o}: {row} {e}");
                }
            }
        });
    }
}

#[test]
fn derivatives_by_motion_are_those_of_central_differences() {
    let model = elastic_arm();
    let samples = 6;
    let mut weights = RegressorBlock::new(model.layout().clone(), samples);
    weights.set_samples(samples);
    for o in 0..7 {
        for k in 0..model.layout().columns(o).len() {
            let values = weights.column_mut(o, k);
            values.iter_mut().enumerate().for_each(|(s, w)| *w = (1.0 + (o + 3 * k + 5 * s) as f64).sin());
        }
    }
    RandomMotion::of(&model, model.mechanism(), samples, 9).with_block(|block| {
        let mut found = MotionAdjoint::new(7, 7, samples);
        model.regressor_adjoint(block, &[], &weights, &mut found);
        let mut state = [block.q.to_vec(), block.dq.to_vec(), block.ddq.to_vec()];
        let sum = |state: &[Vec<f64>; 3]| {
            let [q, dq, ddq] = state;
            let mut w = RegressorBlock::new(model.layout().clone(), samples);
            model.regressor(&MotionBlock { q, dq, ddq, ..*block }, &[], &mut w);
            let mut sum = 0.0;
            for o in 0..7 {
                for k in 0..model.layout().columns(o).len() {
                    sum += w.column(o, k).iter().zip(weights.column(o, k)).map(|(w, g)| w * g).sum::<f64>();
                }
            }
            sum
        };
        let h = 1e-5;
        for kind in 0..3 {
            for at in 0..7 * samples {
                let middle = state[kind][at];
                state[kind][at] = middle + h;
                let above = sum(&state);
                state[kind][at] = middle - h;
                let below = sum(&state);
                state[kind][at] = middle;
                let difference = (above - below) / (2.0 * h);
                let value = [&found.q, &found.dq, &found.ddq][kind][at];
                // Sums of some 1e3 leave 1e-8 by rounding, third derivatives of Δ³ and of inertias 1e-9.
                assert!(
                    (value - difference).abs() <= 1e-7 * (1.0 + difference.abs()),
                    "{kind} {at}: {value} {difference}"
                );
            }
        }
    });
}

/// Base parameters: those of the rigid arm without rotors, and everything at the motors.
#[test]
fn base_parameters_of_elastic_arms_are_those_of_the_rigid_arm_and_all_of_the_drives() {
    let mut d = tree(4, 3);
    d.joints.iter_mut().for_each(|j| j.kind = JointKind::Revolute);
    let mechanism = d.build().unwrap();
    let settings = BaseSettings::default();
    let rigid = RobotModel::new(mechanism.clone(), vec![]);
    let rigid = BaseParameters::of(&rigid, &mechanism, &[], &settings);
    for ratio in [1.0, 100.0, 290.0] {
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        for rate in 0..4 {
            elements.push(Box::new(Coulomb { rate }));
            elements.push(Box::new(Viscous { rate }));
        }
        for (link, motor) in [(0, 4), (2, 5)] {
            elements.push(Box::new(ElasticTransmission {
                damping: true,
                ..ElasticTransmission::new(link, motor, ratio)
            }));
            elements.push(Box::new(RotorInertia { rate: motor }));
            elements.push(Box::new(Coulomb { rate: motor }));
            elements.push(Box::new(Viscous { rate: motor }));
        }
        let of_elements = 8 + 2 * 6;
        let motors = vec![Coordinate::turning("m1"), Coordinate::turning("m3")];
        let model = RobotModel::with_coordinates(mechanism.clone(), motors, elements);
        let base = BaseParameters::of(&model, &mechanism, &[], &settings);
        println!("ratio {ratio}: gap {:e}", base.gap.ratio());
        assert_eq!(base.len(), rigid.len() + of_elements);
        assert!(base.gap.ratio() > 1e9, "{:?}", base.gap);
        assert_eq!(base.kept[..rigid.len()], rigid.kept, "the same regroupings");
        for (found, expected) in base.factors.iter().zip(&rigid.factors) {
            let (own, drives) = found.split_at(rigid.len());
            assert!(own.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9));
            assert!(drives.iter().all(|f| *f == 0.0), "{drives:?}");
        }
    }
    // A joint whose load is measured: all of its parameters.
    let joint = bare_joint(vec![
        Box::new(ElasticTransmission::new(0, 1, RATIO)),
        Box::new(RotorInertia { rate: 1 }),
        Box::new(Coulomb { rate: 1 }),
        Box::new(Viscous { rate: 1 }),
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(Cyclic::torque(0, ShapeSetting::held(1.0))),
    ]);
    let base = BaseParameters::of(&joint, joint.mechanism(), &[], &settings);
    assert_eq!((base.len(), base.gap.dropped), (9, None));
}

#[test]
fn motions_that_hardly_tell_are_named() {
    let element = ElasticTransmission::new(0, 1, RATIO);
    let joint = bare_joint(vec![Box::new(element.clone())]);
    let doubt = |element: &ElasticTransmission, deformation: &[f64]| {
        let n = deformation.len();
        let link: Vec<f64> = (0..n).map(|k| 0.01 * k as f64).collect();
        let motor: Vec<f64> = link.iter().zip(deformation).map(|(q, x)| RATIO * (q + x)).collect();
        let q = [link, motor].concat();
        let motion = MotionBlock::plain(n, &q, &q, &q);
        element.doubt(joint.joints(), &motion)
    };
    let constant: Vec<f64> = (0..100).map(|k| if k % 3 == 0 { 1e-3 } else { -1e-3 }).collect();
    assert!(matches!(doubt(&element, &constant), Some(ElasticDoubt::ConstantDeformation(s)) if s < 1e-6));
    assert!(doubt(&element, &constant).unwrap().to_string().contains("k1 and k2 stand in for each other"));
    let linear = ElasticTransmission { cubic: false, ..element.clone() };
    assert_eq!(doubt(&linear, &constant), None);
    assert_eq!(doubt(&element, &[0.0; 100]), Some(ElasticDoubt::NoDeformation));
    assert_eq!(doubt(&linear, &[0.0; 100]), Some(ElasticDoubt::NoDeformation));
    let varying: Vec<f64> = (0..=100).map(|k| 1e-5 * f64::from(k)).collect();
    assert_eq!(doubt(&element, &varying), None);
}

/// With the motor's position formed from the link's, `k1` and `k2` never act.
#[test]
fn without_a_motor_position_only_the_sum_of_both_rows_is_seen() {
    let joint = bare_joint(vec![
        Box::new(ElasticTransmission::new(0, 1, RATIO)),
        Box::new(Viscous { rate: 1 }),
        Box::new(Viscous { rate: 0 }),
    ]);
    let link: Vec<f64> = (0..50).map(|k| (0.3 * f64::from(k)).sin()).collect();
    let both = [link.clone(), link.iter().map(|x| RATIO * x).collect()].concat();
    let motion = MotionBlock::plain(50, &both, &both, &both);
    let base = BaseParameters::on_motion(&joint, &motion, &[], &BaseSettings::default());
    assert_eq!((base.kept, base.zero), (vec![2, 3], vec![0, 1]));
}

#[test]
#[should_panic(expected = "elastic transmission")]
fn transmissions_join_two_coordinates() {
    bare_joint(vec![Box::new(ElasticTransmission::new(1, 1, 10.0))]);
}

#[test]
#[should_panic(expected = "two coordinates named `j1`")]
fn names_are_taken_once() {
    let mechanism = tree(1, 4).build().unwrap();
    RobotModel::with_coordinates(mechanism, vec![Coordinate::turning("j1")], vec![]);
}

/// Positions, rates and so on to the fourth derivative at a time, of coordinate `c`.
fn smooth(c: usize, t: f64) -> [f64; 5] {
    let (w, phase, size) = (1.3 + 0.4 * c as f64, 0.7 * c as f64, 0.8 - 0.1 * c as f64);
    std::array::from_fn(|k| {
        size * w.powi(k as i32) * (w * t + phase + 0.5 * std::f64::consts::PI * k as f64).sin()
    })
}

#[test]
fn jets_of_bodies_and_elements_are_their_derivatives_by_time() {
    let mut d = tree(3, 8);
    d.joints.iter_mut().for_each(|j| j.kind = JointKind::Revolute);
    let held = ShapeSetting::held;
    let elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(ViscousMagnitude { rate: 1 }),
        Box::new(Offset { rate: 0 }),
        Box::new(RotorInertia { rate: 1 }),
        Box::new(Spring { rate: 2 }),
        Box::new(Cyclic::torque(1, ShapeSetting::held(3.0))),
        Box::new(TanhFriction { rate: 2, w: held(0.7) }),
        Box::new(Arctangent { rate: 0, fb: held(1.7) }),
        Box::new(Stribeck { rate: 1, vs: held(0.9), delta: held(1.4) }),
        Box::new(Stribeck { rate: 2, vs: held(0.6), delta: held(2.0) }),
        Box::new(StribeckViscous { rate: 0, vs: held(0.8), delta: held(1.0) }),
        Box::new(PowerLaw { rate: 1, p: held(1.3) }),
        Box::new(Sigmoid { rate: 2, phi2: held(2.1), phi3: held(0.1) }),
        Box::new(SigmoidOffset { rate: 0, alpha: held(1.6), nu: held(-0.2) }),
        Box::new(AsymmetricFriction { rate: 1 }),
        Box::new(ExponentialViscous {
            sigma3: held(1.2),
            sigma4: held(1.1),
            temperature: Some(31.0),
            ..ExponentialViscous::new(2)
        }),
        Box::new(ExternalLoad { rate: 0, brake: true }),
        Box::new(ExternalLoad { rate: 1, brake: false }),
    ];
    let model = RobotModel::new(d.build().unwrap(), elements);
    let linear: Vec<f64> = (0..model.parameters().linear.len()).map(|k| 0.4 + 0.2 * (k % 5) as f64).collect();
    let dynamics = Dynamics::new(model.mechanism());
    let inertias: Vec<Jet> = linear[..30].iter().map(|x| Jet::from_f64(*x)).collect();
    let names: Vec<&str> = model.channels().iter().map(String::as_str).collect();
    assert_eq!(names, ["load_j1", "load_j2"]);
    for sign_width in [0.0, 0.5] {
        let effort = |t: f64| {
            let of = |k: usize| (0..3).map(|c| smooth(c, t)[k]).collect::<Vec<f64>>();
            let load = [0, 1].map(|c| [smooth(c + 5, t)[0]]);
            let channels = [(names[0], load[0].as_slice()), (names[1], load[1].as_slice())];
            let (q, dq, ddq) = (of(0), of(1), of(2));
            let motion =
                MotionBlock { channels: &channels, sign_width, ..MotionBlock::plain(1, &q, &dq, &ddq) };
            let mut effort = vec![0.0; 3];
            model.efforts(&motion, &[], &linear, 1, &mut effort);
            effort
        };
        for t in [0.1, 0.9, 2.2] {
            let of = |k: usize| {
                (0..3).map(|c| Jet::new([0, 1, 2].map(|d| smooth(c, t)[k + d]))).collect::<Vec<_>>()
            };
            let (q, dq, ddq) = (of(0), of(1), of(2));
            let load = [0, 1].map(|c| Jet::new([0, 1, 2].map(|d| smooth(c + 5, t)[d])));
            let channels = [(names[0], load[0]), (names[1], load[1])];
            let mut found = vec![Jet::default(); 3];
            let state = State { q: &q, dq: &dq, ddq: &ddq, gravity: None };
            dynamics.inverse_dynamics(&state, &inertias, &mut dynamics.workspace(), &mut found);
            let motion = JetMotion { q: &q, dq: &dq, ddq: &ddq, channels: &channels, sign_width };
            model.element_jets(&motion, &[], &linear, |_| true, &mut found).unwrap();
            // Differences over h and 2 h, so that errors by h² cancel: near a reversal the fourth derivative of a power is 6e5. What
            // is left are errors by h⁴ and of rounding over h².
            let here = effort(t);
            let differences = |h: f64| {
                let (below, above) = (effort(t - h), effort(t + h));
                let of = |o: usize| {
                    [(above[o] - below[o]) / (2.0 * h), (above[o] - 2.0 * here[o] + below[o]) / (h * h)]
                };
                [of(0), of(1), of(2)]
            };
            let (near, far) = (differences(1e-4), differences(2e-4));
            for (o, jet) in found.iter().enumerate() {
                let [first, second] = [0, 1].map(|d| (4.0 * near[o][d] - far[o][d]) / 3.0);
                assert!(
                    (jet.value - here[o]).abs() <= 1e-13 * here[o].abs().max(10.0),
                    "{o}: {jet:?} {}",
                    here[o]
                );
                assert!((jet.first - first).abs() <= 2e-5, "{o}, first: {jet:?} {first}");
                assert!((jet.second - second).abs() <= 1e-4, "{o}, second: {jet:?} {second}");
            }
        }
    }
    let silent = RobotModel::new(model.mechanism().clone(), vec![Box::new(LuGre::new(1))]);
    let rest = [Jet::default(); 3];
    let motion = JetMotion { q: &rest, dq: &rest, ddq: &rest, channels: &[], sign_width: 0.0 };
    let shape = silent.parameters().shape_start();
    let ask =
        |rate: usize| silent.element_jets(&motion, &shape, &[0.0; 32], |r| r == rate, &mut rest.clone());
    assert_eq!((ask(0), ask(1)), (Ok(()), Err("j2.fc".into())));
}

#[test]
fn motors_and_links_know_each_other() {
    let model = elastic_arm();
    assert_eq!((model.elastic_motor(1), model.elastic_motor(2)), (Some((5, -2.0)), None));
    assert_eq!((model.elastic_link(6), model.elastic_link(3)), (Some((3, 1.5)), None));
    let linear: Vec<f64> = (0..model.parameters().linear.len()).map(|k| k as f64).collect();
    let found: Vec<_> = model.elastic_transmissions(&linear).into_iter().map(|(e, v)| (e.link, v)).collect();
    assert_eq!(found, [(0, vec![40.0, 41.0, 42.0]), (1, vec![43.0, 44.0]), (3, vec![45.0, 46.0])]);
}
