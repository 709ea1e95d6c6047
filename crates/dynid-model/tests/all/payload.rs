//! Payloads, terms of single logs, and models whose outputs share no parameter.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::{check_close, generator, inertia, numbers, tree};
use dynid_model::element::{
    Coulomb, Gated, JointElement, KnownLoad, Offset, Payload, Viscous, is_gate, log_channel, payload_channel,
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
                model.regressor(block, &[], &mut w);
                let mut effort = vec![0.0; rates * SAMPLES];
                model.efforts(block, &[], &linear, SAMPLES, &mut effort);
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
            model.effort_adjoint(block, &[], &linear, SAMPLES, &weights, &mut found[0]);
            model.regressor_adjoint(block, &[], &of_entries, &mut found[1]);
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
