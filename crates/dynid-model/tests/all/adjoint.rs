//! Adjoints of efforts and regressor against dual numbers and central differences.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::{self, check_close, generator, numbers, sample, tree};
use dynid_model::element::{
    AsymmetricFriction, Coulomb, CoupledWrist, Cyclic, DriveGain, ElementRegistry, ExternalLoad,
    JointElement, Linearised, LoadFriction, Offset, Placement, RotorInertia, ShapeSetting, Spring,
    Transmission, Viscous, current_channel, load_channel,
};
use dynid_model::scalar::Dual;
use dynid_model::*;

/// Trees of 1 to 9 joints that turn, slide and screw; every other one with joints that follow others.
fn trees() -> impl Iterator<Item = (u64, Mechanism)> {
    (0..60).map(|seed| {
        let mut d = tree(1 + seed as usize % 9, seed);
        d.couple_mimics = seed % 2 == 1;
        let mut rng = generator(seed + 500);
        for k in 0..d.joints.len() {
            let [ratio, offset, chance] = numbers(&mut rng);
            if d.joints[k].kind == JointKind::Floating {
                d.joints[k].kind = JointKind::Helical { pitch: ratio };
            }
            if k > 0 && chance > 0.3 && d.couple_mimics {
                d.joints[k].mimic = Some(Mimic { of: d.joints[k / 2].name.clone(), ratio, offset });
            }
        }
        (seed, d.build().unwrap())
    })
}

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = generator(seed);
    (0..count).map(|_| numbers::<1>(&mut rng)[0]).collect()
}

/// Directional derivatives along every coordinate of `[q, dq, ddq]` at one sample, of what `of` makes of dual numbers.
fn by_duals(
    m: &random_tree::Motion,
    of: impl Fn(&State<'_, Dual<1>>) -> Dual<1>,
    gravity: Option<Vec3<Dual<1>>>,
) -> [Vec<f64>; 3] {
    let lift = |v: &[f64]| -> Vec<Dual<1>> { v.iter().map(|x| Dual::from_f64(*x)).collect() };
    let constant = [lift(&m.q), lift(&m.dq), lift(&m.ddq)];
    [0, 1, 2].map(|kind| {
        (0..constant[kind].len())
            .map(|c| {
                let mut state = constant.clone();
                state[kind][c] = Dual::variable(constant[kind][c].value, 0);
                let [q, dq, ddq] = &state;
                of(&State { q, dq, ddq, gravity }).derivative[0]
            })
            .collect()
    })
}

#[track_caller]
fn check_sample(found: &MotionAdjoint, s: usize, expected: &[Vec<f64>; 3], start: f64, what: &str) {
    let scale = expected.iter().flatten().fold(1.0_f64, |m, x| m.max(x.abs()));
    for (values, expected) in [&found.q, &found.dq, &found.ddq].into_iter().zip(expected) {
        let found: Vec<f64> = values.chunks_exact(found.samples).map(|c| c[s] - start).collect();
        check_close(&found, expected, 1e-12 * scale, what);
    }
}

#[test]
fn adjoint_of_efforts_is_the_derivative_by_dual_numbers() {
    // 11 samples: the last group of lanes overlaps the one before; 3: no group at all.
    for samples in [3, 11] {
        for (seed, mechanism) in trees() {
            let model = RobotModel::new(mechanism.clone(), vec![]);
            let dynamics = Dynamics::new(&mechanism);
            let (positions, rates) = model.dimensions();
            let v = random(dynamics.inertial_parameters(), seed + 1);
            let stride = samples + 2;
            let u = random(rates * stride, seed + 2);
            let start = 0.25;
            let mut out = MotionAdjoint::new(positions, rates, samples);
            for values in [&mut out.q, &mut out.dq, &mut out.ddq] {
                values.fill(start);
            }
            let phi: Vec<Dual<1>> = v.iter().map(|x| Dual::from_f64(*x)).collect();
            RandomMotion::new(&mechanism, &[], samples, seed).with_block(|block| {
                // Gravity that turns from sample to sample.
                let gravity = random(3 * block.stride, seed + 3);
                let block = MotionBlock { gravity: Some(&gravity), ..*block };
                model.effort_adjoint(&block, &[], &v, stride, &u, &mut out);
                for s in 0..samples {
                    let g = Vec3([0, 1, 2].map(|c| Dual::from_f64(gravity[c * block.stride + s])));
                    let scalar = |state: &State<'_, Dual<1>>| {
                        let mut effort = vec![Dual::zero(); rates];
                        dynamics.inverse_dynamics(state, &phi, &mut dynamics.workspace(), &mut effort);
                        effort
                            .iter()
                            .enumerate()
                            .fold(Dual::zero(), |sum, (o, e)| sum + *e * Dual::from_f64(u[o * stride + s]))
                    };
                    let expected = by_duals(&sample(&block, s), scalar, Some(g));
                    check_sample(&out, s, &expected, start, &format!("tree {seed}, sample {s}"));
                }
            });
        }
    }
}

#[test]
fn adjoint_of_the_regressor_is_the_derivative_by_dual_numbers() {
    for samples in [2, 9] {
        for (seed, mechanism) in trees() {
            let model = RobotModel::new(mechanism.clone(), vec![]);
            let dynamics = Dynamics::new(&mechanism);
            let (positions, rates) = model.dimensions();
            let weights = random_weights(&model, samples, seed);
            let mut out = MotionAdjoint::new(positions, rates, samples);
            RandomMotion::new(&mechanism, &[], samples, seed).with_block(|block| {
                model.regressor_adjoint(block, &[], &weights, &mut out);
                for s in 0..samples {
                    let scalar = |state: &State<'_, Dual<1>>| {
                        let width = dynamics.inertial_parameters();
                        let mut y = vec![Dual::zero(); rates * width];
                        dynamics.regressor(state, &mut dynamics.workspace(), &mut y);
                        let mut sum = Dual::zero();
                        for o in 0..rates {
                            for (k, column) in model.layout().columns(o).iter().enumerate() {
                                sum += y[o * width + column] * Dual::from_f64(weights.column(o, k)[s]);
                            }
                        }
                        sum
                    };
                    let expected = by_duals(&sample(block, s), scalar, None);
                    check_sample(&out, s, &expected, 0.0, &format!("tree {seed}, sample {s}"));
                }
            });
        }
    }
}

fn random_weights(model: &RobotModel, samples: usize, seed: u64) -> RegressorBlock {
    let mut weights = RegressorBlock::new(model.layout().clone(), samples);
    weights.set_samples(samples);
    for o in 0..model.layout().outputs() {
        for k in 0..model.layout().columns(o).len() {
            let column = random(samples, seed + 100 * o as u64 + k as u64);
            weights.column_mut(o, k).copy_from_slice(&column);
        }
    }
    weights
}

#[test]
fn lanes_give_the_adjoint_of_single_samples() {
    for (seed, mechanism) in trees().filter(|(_, m)| m.follows().is_none()) {
        let model = RobotModel::new(mechanism.clone(), vec![]);
        let (samples, (positions, rates)) = (6, model.dimensions());
        let v = random(model.parameters().linear.len(), seed);
        RandomMotion::new(&mechanism, &[], samples, seed).with_block(|block| {
            let u = random(rates * block.stride, seed + 2);
            let mut all = MotionAdjoint::new(positions, rates, samples);
            model.effort_adjoint(block, &[], &v, block.stride, &u, &mut all);
            for s in 0..samples {
                let one = MotionBlock {
                    samples: 1,
                    q: &block.q[s..],
                    dq: &block.dq[s..],
                    ddq: &block.ddq[s..],
                    ..*block
                };
                let mut single = MotionAdjoint::new(positions, rates, 1);
                model.effort_adjoint(&one, &[], &v, block.stride, &u[s..], &mut single);
                let expected = [single.q, single.dq, single.ddq];
                let scale = expected.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
                for (values, expected) in [&all.q, &all.dq, &all.ddq].into_iter().zip(&expected) {
                    let found: Vec<f64> = values.chunks_exact(samples).map(|c| c[s]).collect();
                    // The same operations, with or without fused multiply-add.
                    check_close(&found, expected, 1e-13 * scale, &format!("tree {seed}"));
                }
            }
        });
    }
}

/// An arm of four joints, the third of which slides, with every element there is.
fn model_with_elements() -> RobotModel {
    let mut d = tree(4, 3);
    for (k, joint) in d.joints.iter_mut().enumerate() {
        joint.kind = if k == 2 { JointKind::Prismatic } else { JointKind::Revolute };
    }
    let mechanism = d.build().unwrap();
    let reference: Vec<f64> = mechanism.inertia_vector();
    let mut elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(Offset { rate: 0 }),
        Box::new(AsymmetricFriction { rate: 1 }),
        Box::new(RotorInertia { rate: 1 }),
        Box::new(Spring { rate: 2 }),
        Box::new(Cyclic::torque(3, ShapeSetting::held(7.0))),
        Box::new(Cyclic::friction(0, ShapeSetting::held(3.0))),
        Box::new(Transmission {
            joints: vec![0, 1, 3],
            matrix: vec![vec![1.0, 0.0, 0.5], vec![-0.7, 2.0, 0.3]],
            motors: vec!["m1".into(), "m2".into()],
        }),
        Box::new(CoupledWrist { a: 1, b: 3, ratio: 0.8 }),
        Box::new(DriveGain { rate: 3 }),
        Box::new(ExternalLoad { rate: 0, brake: true }),
        Box::new(ExternalLoad { rate: 2, brake: false }),
        Box::new(LoadFriction::new(&mechanism, vec![0, 2], reference.into())),
    ];
    let joints = RobotModel::new(mechanism.clone(), Vec::new()).joints().to_vec();
    let free = ShapeSetting { start: 2.5, lower: 1.0, upper: 9.0, held: false };
    let spring = |phi: ShapeSetting| {
        let shape = [ShapeSetting::held(0.7), ShapeSetting::held(0.3), phi];
        let placement = Placement { rate: 1, shape: &shape, options: &[] };
        ElementRegistry::default().kind("balancer").unwrap().place(&placement).unwrap().unwrap()
    };
    elements.push(spring(ShapeSetting::held(0.4)));
    // With the columns of a change of their shapes.
    let angle = ShapeSetting { start: 0.4, lower: -1.0, upper: 1.0, held: false };
    elements.push(Box::new(Linearised::new(spring(angle), &joints, vec![0.4], vec![1.5, -0.6], vec![true])));
    for element in [Cyclic::torque(1, free), Cyclic::friction(1, free)] {
        let own = Linearised::new(Box::new(element), &joints, vec![2.5], vec![0.3, -0.8], vec![true]);
        elements.push(Box::new(own));
    }
    RobotModel::new(mechanism, elements)
}

#[test]
fn elements_have_the_derivatives_of_central_differences() {
    let model = model_with_elements();
    let (samples, seed) = (9, 11);
    let (positions, rates) = model.dimensions();
    let weights = random_weights(&model, samples, seed);
    let v = random(model.parameters().linear.len(), 1);
    let current = (current_channel("j4"), random(samples, 2));
    let u = random(rates * samples, 3);
    let loads = [1, 3].map(|j| (load_channel(&format!("j{j}")), random(samples, 5 + j)));
    let channels = [&current, &loads[0], &loads[1]].map(|c| (c.0.as_str(), c.1.as_slice()));
    RandomMotion::new(model.mechanism(), &[], samples, seed).with_block(|block| {
        let packed = |values: &[f64]| -> Vec<f64> {
            values.chunks_exact(block.stride).flat_map(|c| c[..samples].to_vec()).collect()
        };
        let mut state = [packed(block.q), packed(block.dq), packed(block.ddq)];
        let with = |state: &[Vec<f64>; 3], work: &mut dyn FnMut(&MotionBlock<'_>)| {
            let [q, dq, ddq] = state;
            let stride = samples;
            let sign_width = 0.4;
            work(&MotionBlock {
                samples,
                stride,
                q,
                dq,
                ddq,
                gravity: None,
                channels: &channels,
                sign_width,
            });
        };
        let mut of_weights = MotionAdjoint::new(positions, rates, samples);
        let mut of_efforts = MotionAdjoint::new(positions, rates, samples);
        with(&state, &mut |block| {
            model.regressor_adjoint(block, &[], &weights, &mut of_weights);
            model.effort_adjoint(block, &[], &v, samples, &u, &mut of_efforts);
        });
        // Both scalars of a motion, from the regressor.
        let scalars = |state: &[Vec<f64>; 3]| {
            let mut w = RegressorBlock::new(model.layout().clone(), samples);
            let mut sums = [0.0; 2];
            with(state, &mut |block| model.regressor(block, &[], &mut w));
            for o in 0..rates {
                for k in 0..model.layout().columns(o).len() {
                    let pairs = w.column(o, k).iter().zip(weights.column(o, k));
                    sums[0] += pairs.map(|(w, g)| w * g).sum::<f64>();
                }
                sums[1] += w.effort(o, &v).iter().zip(&u[o * samples..]).map(|(e, u)| e * u).sum::<f64>();
            }
            sums
        };
        let h = 1e-6;
        for kind in 0..3 {
            for at in 0..state[kind].len() {
                let middle = state[kind][at];
                state[kind][at] = middle + h;
                let above = scalars(&state);
                state[kind][at] = middle - h;
                let below = scalars(&state);
                state[kind][at] = middle;
                for (k, out) in [&of_weights, &of_efforts].into_iter().enumerate() {
                    let found = [&out.q, &out.dq, &out.ddq][kind][at];
                    let difference = (above[k] - below[k]) / (2.0 * h);
                    // Sums of some 1e3: rounding leaves 1e-13 / h of them.
                    let error = (found - difference).abs();
                    assert!(
                        error <= 3e-7 * (1.0 + difference.abs()),
                        "{k} {kind} {at}: {found} {difference}"
                    );
                }
            }
        }
    });
}

#[test]
fn an_exact_sign_has_no_slope() {
    let model = RobotModel::new(tree(1, 4).build().unwrap(), vec![Box::new(Coulomb { rate: 0 })]);
    let linear: Vec<f64> = (0..11).map(|k| if k == 10 { 1.0 } else { 0.0 }).collect();
    let (positions, rates) = model.dimensions();
    let mut out = MotionAdjoint::new(positions, rates, 1);
    let block = MotionBlock::plain(1, &[0.1], &[0.001], &[0.2]);
    model.effort_adjoint(&block, &[], &linear, 1, &[1.0], &mut out);
    assert_eq!(out, MotionAdjoint::new(positions, rates, 1));
    let smooth = MotionBlock { sign_width: 0.02, ..block };
    model.effort_adjoint(&smooth, &[], &linear, 1, &[1.0], &mut out);
    assert!((out.dq[0] - (1.0 - 0.05_f64.tanh().powi(2)) / 0.02).abs() < 1e-12);
}

#[test]
fn efforts_are_those_of_the_regressor() {
    let model = model_with_elements();
    for samples in [2, 9] {
        let v = random(model.parameters().linear.len(), 1);
        let names = [current_channel("j4"), load_channel("j1"), load_channel("j3")];
        let values = [2, 6, 8].map(|seed| random(samples, seed));
        let channels = [0, 1, 2].map(|c| (names[c].as_str(), values[c].as_slice()));
        RandomMotion::new(model.mechanism(), &[], samples, 5).with_block(|block| {
            let block = MotionBlock { channels: &channels, sign_width: 0.1, ..*block };
            let mut w = RegressorBlock::new(model.layout().clone(), samples);
            model.regressor(&block, &[], &mut w);
            let stride = samples + 1;
            let mut effort = vec![f64::NAN; 4 * stride];
            model.efforts(&block, &[], &v, stride, &mut effort);
            for o in 0..4 {
                let expected = w.effort(o, &v);
                let scale = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                check_close(&effort[o * stride..][..samples], &expected, 1e-13 * scale, "effort");
            }
        });
    }
}
