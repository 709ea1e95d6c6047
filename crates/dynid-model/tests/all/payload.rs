//! Payloads, terms of single logs, and models whose outputs share no parameter.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::{check_close, generator, inertia, numbers, tree};
use dynid_model::element::{
    Coulomb, Gated, JointElement, JointInfo, KnownLoad, Linearised, LoadFriction, LogScaled, Offset, Payload,
    ShapeSetting, Stribeck, TanhFriction, Viscous, is_gate, log_channel, payload_channel, scale_name,
};
use dynid_model::*;

const SAMPLES: usize = 11;

fn mechanism(seed: u64) -> Mechanism {
    let mut d = tree(5, seed);
    for joint in d.joints.iter_mut().filter(|j| j.kind == JointKind::Floating) {
        joint.kind = JointKind::Revolute;
    }
    d.build().unwrap()
}

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = generator(seed);
    (0..count).map(|_| numbers::<1>(&mut rng)[0]).collect()
}

fn efforts(model: &dyn EffortModel, motion: &MotionBlock<'_>, linear: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; model.outputs().len() * motion.samples];
    model.efforts(motion, &[], linear, motion.samples, &mut out);
    out
}

/// Every other sample carries the payload.
fn alternating() -> Vec<f64> {
    (0..SAMPLES).map(|s| (s % 2) as f64).collect()
}

#[test]
fn columns_times_parameters_are_what_the_body_adds_to_inverse_dynamics() {
    for seed in 0..20 {
        let plain = mechanism(seed);
        let body = seed as usize % plain.bodies().len();
        let load = inertia(&mut generator(seed + 90));
        let bodies = random(plain.inertial_parameters(), seed + 1);
        let mut loaded = bodies.clone();
        loaded[10 * body..10 * body + 10].iter_mut().zip(load.0).for_each(|(x, l)| *x += l);
        let unknown: Box<dyn JointElement> = Box::new(Payload::new(&plain, body, "tool"));
        let model = RobotModel::new(plain.clone(), vec![unknown]);
        let known: Box<dyn JointElement> = Box::new(KnownLoad::new(&plain, body, "tool", &load));
        let with_known = RobotModel::new(plain.clone(), vec![known]);
        let rigid = RobotModel::new(plain.clone(), vec![]);
        let (found, column) = model.payloads().next().unwrap();
        assert_eq!((found.name(), found.body(), column), ("tool", body, plain.inertial_parameters()));
        assert_eq!(model.parameters().linear[column].name, "tool.m");
        let gate = alternating();
        let name = payload_channel("tool");
        let channels: [(&str, &[f64]); 1] = [(&name, &gate)];
        RandomMotion::new(&plain, &[], SAMPLES, seed).with_block(|block| {
            let block = MotionBlock { channels: &channels, ..*block };
            let (with, without) = (efforts(&rigid, &block, &loaded), efforts(&rigid, &block, &bodies));
            let expected: Vec<f64> =
                (0..with.len()).map(|k| if k % SAMPLES % 2 == 1 { with[k] } else { without[k] }).collect();
            let scale = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            let all: Vec<f64> = bodies.iter().chain(&load.0).copied().collect();
            check_close(&efforts(&model, &block, &all), &expected, 1e-12 * scale, "ten unknown parameters");
            let ones = with_known.parameters().linear.len() - bodies.len();
            let all: Vec<f64> = bodies.iter().copied().chain(vec![1.0; ones]).collect();
            check_close(&efforts(&with_known, &block, &all), &expected, 1e-12 * scale, "a known load");
        });
    }
}

fn model_with_terms() -> RobotModel {
    let plain = mechanism(3);
    let load = inertia(&mut generator(5));
    let elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(Coulomb { rate: 1 }),
        Box::new(Gated::new(Box::new(Coulomb { rate: 1 }), "b")),
        Box::new(Gated::new(Box::new(Viscous { rate: 2 }), "b")),
        Box::new(Gated::new(Box::new(Offset { rate: 0 }), "b")),
        Box::new(Payload::with_unknown(&plain, 4, "tool", vec![1, 2, 5, 9])),
        Box::new(KnownLoad::new(&plain, 4, "tool", &load)),
    ];
    RobotModel::new(plain, elements)
}

#[test]
fn terms_of_a_log_are_deviations_of_any_sign() {
    let model = model_with_terms();
    let deviation = &model.parameters().linear[model.parameters().column("j2.fc[b]").unwrap()];
    assert_eq!((deviation.lower, deviation.symbol.as_str()), (None, "fc2[b]"));
    assert_eq!(model.channels(), [log_channel("b"), payload_channel("tool")]);
    assert!(model.channels().iter().all(|c| is_gate(c)));
}

/// Adjoints of the model and of its copy per output, against central differences of their regressors.
#[test]
fn adjoints_are_the_derivatives_of_central_differences() {
    let model = model_with_terms();
    let copy = PerOutput::new(&model);
    check_adjoints(&model);
    check_adjoints(&copy);
}

fn check_adjoints(model: &dyn EffortModel) {
    let (positions, rates) = model.dimensions();
    let linear = random(model.parameters().linear.len(), 7);
    let shape = model.parameters().shape_start();
    let weights = random(rates * SAMPLES, 8);
    let mut of_entries = RegressorBlock::new(model.layout().clone(), SAMPLES);
    of_entries.set_samples(SAMPLES);
    let mut next = random(model.layout().slots() * SAMPLES, 9).into_iter();
    for output in 0..model.outputs().len() {
        for k in 0..model.layout().columns(output).len() {
            of_entries.column_mut(output, k).iter_mut().zip(&mut next).for_each(|(to, w)| *to = w);
        }
    }
    let gates = [alternating(), vec![0.7; SAMPLES]];
    let channels: Vec<(&str, &[f64])> =
        model.channels().iter().map(String::as_str).zip(gates.iter().map(Vec::as_slice)).collect();
    model.random_motion(SAMPLES, 4).with_block(|block| {
        let pack = |x: &[f64]| x.chunks(block.stride).flat_map(|c| c[..SAMPLES].to_vec()).collect::<Vec<_>>();
        let mut state = [pack(block.q), pack(block.dq), pack(block.ddq)];
        let motion = |state: &[Vec<f64>; 3], work: &mut dyn FnMut(&MotionBlock<'_>)| {
            let [q, dq, ddq] = state;
            let plain = MotionBlock::plain(SAMPLES, q, dq, ddq);
            work(&MotionBlock { channels: &channels, sign_width: 0.5, ..plain });
        };
        let scalars = |state: &[Vec<f64>; 3]| {
            let mut sums = [0.0; 2];
            motion(state, &mut |block| {
                let mut w = RegressorBlock::new(model.layout().clone(), SAMPLES);
                model.regressor(block, &shape, &mut w);
                let mut effort = vec![0.0; rates * SAMPLES];
                model.efforts(block, &shape, &linear, SAMPLES, &mut effort);
                for output in 0..model.outputs().len() {
                    let own = w.effort(output, &linear);
                    let direct = &effort[output * SAMPLES..][..SAMPLES];
                    check_close(
                        direct,
                        &own,
                        1e-10 * own.iter().fold(1.0_f64, |m, x| m.max(x.abs())),
                        "efforts",
                    );
                    sums[0] += own.iter().zip(&weights[output * SAMPLES..]).map(|(e, u)| e * u).sum::<f64>();
                    for k in 0..model.layout().columns(output).len() {
                        let pairs = w.column(output, k).iter().zip(of_entries.column(output, k));
                        sums[1] += pairs.map(|(x, u)| x * u).sum::<f64>();
                    }
                }
            });
            sums
        };
        let mut found = [0, 1].map(|_| MotionAdjoint::new(positions, rates, SAMPLES));
        motion(&state, &mut |block| {
            model.effort_adjoint(block, &shape, &linear, SAMPLES, &weights, &mut found[0]);
            model.regressor_adjoint(block, &shape, &of_entries, &mut found[1]);
        });
        let scale = scalars(&state).iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let h = 1e-5;
        for kind in 0..3 {
            for place in (0..state[kind].len()).step_by(3) {
                let at = state[kind][place];
                let mut side = |x: f64| {
                    state[kind][place] = x;
                    scalars(&state)
                };
                let (up, down) = (side(at + h), side(at - h));
                state[kind][place] = at;
                for k in 0..2 {
                    let derivative = (up[k] - down[k]) / (2.0 * h);
                    let adjoint = [&found[k].q, &found[k].dq, &found[k].ddq][kind][place];
                    // Central differences: h² times a third derivative of the size of the sum, and rounding over h.
                    assert!(
                        (adjoint - derivative).abs() <= 1e-6 * scale,
                        "{kind} {place}: {adjoint} {derivative}"
                    );
                }
            }
        }
    });
}

#[test]
fn outputs_of_a_copy_share_no_parameter() {
    let model = model_with_terms();
    let copy = PerOutput::new(&model);
    let linear = random(model.parameters().linear.len(), 2);
    let mut copied = vec![0.0; copy.parameters().linear.len()];
    let mut owners = vec![0; copied.len()];
    for output in 0..copy.outputs().len() {
        for column in copy.columns(output) {
            copied[column] = linear[copy.source(column)] * (output + 1) as f64;
            owners[column] += 1;
        }
    }
    assert!(owners.iter().all(|n| *n == 1));
    model.random_motion(SAMPLES, 6).with_block(|block| {
        let (one, other) = (efforts(&model, block, &linear), efforts(&copy, block, &copied));
        let expected: Vec<f64> = one.iter().enumerate().map(|(k, e)| e * (k / SAMPLES + 1) as f64).collect();
        check_close(&other, &expected, 1e-11, "efforts output by output");
    });
}

/// Friction of three joints, two of them with shape parameters, scaled in logs `b` and `c`.
fn scaled(mechanism: &Mechanism) -> LogScaled {
    let reference: Vec<f64> = mechanism.inertia_vector();
    let mut stribeck = Stribeck::new(2);
    stribeck.vs = ShapeSetting { start: 0.4, lower: 0.1, upper: 1.0, held: false };
    let friction: Vec<Box<dyn JointElement>> = vec![
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(stribeck),
        Box::new(TanhFriction::new(3)),
        Box::new(LoadFriction::new(mechanism, vec![0, 2], reference.into())),
    ];
    let joints = JointInfo::of(mechanism, &[]);
    LogScaled::new(friction, &joints, vec![("b".to_owned(), 1.0), ("c".to_owned(), 1.0)])
}

/// Values of the shape parameters: those of the elements, then factors of 1.3 and 0.8.
fn scaled_shape(model: &RobotModel) -> Vec<f64> {
    let mut shape = model.parameters().shape_start();
    let elements = shape.len() - 2;
    shape[elements..].copy_from_slice(&[1.3, 0.8]);
    shape
}

#[test]
fn scaled_friction_is_the_elements_times_the_factor_of_the_log() {
    let plain = mechanism(3);
    let alone = scaled(&plain).parts().len();
    assert_eq!(alone, 5);
    let model = RobotModel::new(plain.clone(), vec![Box::new(scaled(&plain))]);
    let names: Vec<&str> = model.parameters().shape.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names[names.len() - 2..], [scale_name("b"), scale_name("c")]);
    assert_eq!(model.channels(), [log_channel("b"), log_channel("c")]);
    assert!(model.log_columns().is_empty(), "its parameters are those of the robot");
    let shape = scaled_shape(&model);
    let mut linear = random(model.parameters().linear.len(), 7);
    linear[..plain.inertial_parameters()].fill(0.0);
    let (zero, one) = (vec![0.0; SAMPLES], vec![1.0; SAMPLES]);
    let (b, c) = (log_channel("b"), log_channel("c"));
    model.random_motion(SAMPLES, 4).with_block(|block| {
        let of = |gates: [&[f64]; 2]| {
            let channels = [(b.as_str(), gates[0]), (c.as_str(), gates[1])];
            let motion = MotionBlock { channels: &channels, ..*block };
            let mut out = vec![0.0; model.outputs().len() * SAMPLES];
            model.efforts(&motion, &shape, &linear, SAMPLES, &mut out);
            out
        };
        let elements = of([&zero, &zero]);
        assert!(elements.iter().any(|e| *e != 0.0));
        for (gates, factor) in [([&one[..], &zero[..]], 1.3), ([&zero, &one], 0.8)] {
            let expected: Vec<f64> = elements.iter().map(|e| factor * e).collect();
            check_close(&of(gates), &expected, 1e-12, "scaled");
        }
    });
    // Friction of the robot alone, whatever the logs.
    let law = |elements: Vec<Box<dyn JointElement>>| RobotModel::new(plain.clone(), elements);
    let without = law(vec![Box::new(Coulomb { rate: 0 }), Box::new(Viscous { rate: 0 })]);
    let mut own = vec![0.0; without.parameters().linear.len()];
    let first = plain.inertial_parameters();
    own[first..].copy_from_slice(&linear[first..first + 2]);
    let speeds = [-0.7, 0.2, 1.1];
    assert_eq!(
        model.friction_effort(0, &shape, &linear, &speeds, &[]),
        without.friction_effort(0, &[], &own, &speeds, &[])
    );
    assert_eq!(
        model.friction_passivity(0, &shape, &linear, (-1.0, 1.0), &[]).passivity,
        without.friction_passivity(0, &[], &own, (-1.0, 1.0), &[]).passivity
    );
}

#[test]
fn shape_derivatives_of_scaled_friction_are_those_of_central_differences() {
    let plain = mechanism(3);
    let model = RobotModel::new(plain.clone(), vec![Box::new(scaled(&plain))]);
    let shape = scaled_shape(&model);
    let (columns, pairs) = (model.shaped_columns(), model.shape_dependence());
    let gates = [alternating(), vec![0.3; SAMPLES]];
    let (b, c) = (log_channel("b"), log_channel("c"));
    let channels = [(b.as_str(), gates[0].as_slice()), (c.as_str(), gates[1].as_slice())];
    model.random_motion(SAMPLES, 4).with_block(|block| {
        let motion = MotionBlock { channels: &channels, ..*block };
        let values = |shape: &[f64]| {
            let mut values = vec![0.0; columns.len() * SAMPLES];
            model.shaped(&motion, shape, SAMPLES, &mut values, &mut []);
            values
        };
        let mut derivatives = vec![0.0; pairs.len() * SAMPLES];
        model.shaped(&motion, &shape, SAMPLES, &mut [], &mut derivatives);
        let h = 1e-6;
        for parameter in 0..shape.len() {
            let side = |step: f64| {
                let mut moved = shape.clone();
                moved[parameter] += step;
                values(&moved)
            };
            let (up, down) = (side(h), side(-h));
            for (column, (up, down)) in up.chunks(SAMPLES).zip(down.chunks(SAMPLES)).enumerate() {
                let difference: Vec<f64> = up.iter().zip(down).map(|(u, d)| (u - d) / (2.0 * h)).collect();
                let place = pairs.iter().position(|pair| *pair == (column, parameter));
                let own =
                    place.map_or(vec![0.0; SAMPLES], |k| derivatives[k * SAMPLES..][..SAMPLES].to_vec());
                check_close(&own, &difference, 1e-6, "derivative");
            }
        }
    });
}

#[test]
fn adjoints_of_scaled_friction_are_the_derivatives_of_central_differences() {
    let plain = mechanism(3);
    let model = RobotModel::new(plain.clone(), vec![Box::new(scaled(&plain))]);
    let shape = scaled_shape(&model);
    let linear = random(model.parameters().linear.len(), 7)[plain.inertial_parameters()..].to_vec();
    let free = vec![true; shape.len()];
    let linearised = Linearised::new(Box::new(scaled(&plain)), model.joints(), shape.clone(), linear, free);
    check_adjoints(&RobotModel::new(plain.clone(), vec![Box::new(linearised)]));
    check_adjoints(&model.with_shape(&shape));
}
