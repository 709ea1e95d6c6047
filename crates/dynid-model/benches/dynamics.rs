//! Time per sample of inverse and forward dynamics, regressor and adjoints, alone and over blocks of lanes.

use divan::{Bencher, black_box, counter::ItemsCount};
use dynid_model::scalar::Dual;
use dynid_model::*;

fn main() {
    divan::main();
}

/// Serial arms of 6 and 7 revolute joints, and a tree of 32 (a trunk of 2 with five limbs of 6).
fn robot(joints: usize) -> Mechanism {
    let mut d = Description::new("bench");
    d.links.push(LinkDescription { name: "l0".into(), inertia: None });
    for k in 1..=joints {
        let parent = if joints > 7 && k > 2 && (k - 3) % 6 == 0 { 2 } else { k - 1 };
        let angle = [0.0, 1.57, -1.57][k % 3];
        d.links.push(LinkDescription {
            name: format!("l{k}"),
            inertia: Some(Inertia([3.0, 0.1, 0.2, 0.3, 0.5, 0.01, 0.02, 0.6, 0.03, 0.7])),
        });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: format!("l{parent}"),
            child: format!("l{k}"),
            kind: JointKind::Revolute,
            placement: Placement::from_xyz_rpy([0.1, 0.02 * k as f64, 0.3], [angle, 0.3, 0.1]),
            axis: if k % 2 == 0 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] },
            limits: Limits::default(),
            mimic: None,
        });
    }
    d.build().expect("the bench robot is sound")
}

const ROBOTS: [usize; 3] = [6, 7, 32];
const BLOCK: usize = 64;

#[divan::bench(args = ROBOTS)]
fn inverse_dynamics(bencher: Bencher<'_, '_>, joints: usize) {
    let mechanism = robot(joints);
    let dynamics = Dynamics::new(&mechanism);
    let phi = mechanism.inertia_vector();
    let mut work = dynamics.workspace();
    let (q, dq, ddq) = (vec![0.3; joints], vec![0.7; joints], vec![-0.4; joints]);
    let mut effort = vec![0.0; joints];
    bencher.bench_local(|| {
        let state = State { q: black_box(&q), dq: &dq, ddq: &ddq, gravity: None };
        dynamics.inverse_dynamics(&state, &phi, &mut work, &mut effort);
        black_box(effort[0])
    });
}

#[divan::bench(args = ROBOTS)]
fn forward_dynamics(bencher: Bencher<'_, '_>, joints: usize) {
    bench_forward(bencher, joints, |x, _| x);
}

/// With exact derivatives in all directions of position and rate of a six-joint arm.
#[divan::bench(args = [6])]
fn forward_dynamics_dual12(bencher: Bencher<'_, '_>, joints: usize) {
    bench_forward(bencher, joints, Dual::<12>::variable);
}

fn bench_forward<S: Scalar>(bencher: Bencher<'_, '_>, joints: usize, number: impl Fn(f64, usize) -> S) {
    let mechanism = robot(joints);
    let dynamics = Dynamics::new(&mechanism);
    let phi: Vec<S> = mechanism.inertia_vector().into_iter().map(S::from_f64).collect();
    let mut work = dynamics.forward_workspace();
    let q: Vec<S> = (0..joints).map(|k| number(0.3, k)).collect();
    let dq: Vec<S> = (0..joints).map(|k| number(0.7, joints + k)).collect();
    let effort = vec![S::from_f64(-0.4); joints];
    let mut ddq = effort.clone();
    bencher.bench_local(|| {
        let state = LoadedState { q: black_box(&q), dq: &dq, effort: &effort, gravity: None };
        let done = dynamics.forward_dynamics(&state, &phi, AddedInertia::None, &mut work, &mut ddq);
        black_box((done, ddq[0]))
    });
}

#[divan::bench(args = ROBOTS)]
fn regressor(bencher: Bencher<'_, '_>, joints: usize) {
    let mechanism = robot(joints);
    let dynamics = Dynamics::new(&mechanism);
    let mut work = dynamics.workspace();
    let (q, dq, ddq) = (vec![0.3; joints], vec![0.7; joints], vec![-0.4; joints]);
    let mut y = vec![0.0; joints * 10 * joints];
    bencher.bench_local(|| {
        let state = State { q: black_box(&q), dq: &dq, ddq: &ddq, gravity: None };
        dynamics.regressor(&state, &mut work, &mut y);
        black_box(y[0])
    });
}

#[divan::bench(args = ROBOTS)]
fn inverse_dynamics_lanes(bencher: Bencher<'_, '_>, joints: usize) {
    let mechanism = robot(joints);
    let dynamics = Dynamics::new(&mechanism);
    let phi = mechanism.inertia_vector();
    let motion = RandomMotion::new(&mechanism, &[], BLOCK, 1);
    let mut effort = vec![0.0; joints * BLOCK];
    motion.with_block(|block| {
        bencher.counter(ItemsCount::new(BLOCK)).bench_local(|| {
            dynamics.inverse_dynamics_block(black_box(block), &phi, BLOCK, &mut effort);
            black_box(effort[0])
        });
    });
}

#[divan::bench(args = ROBOTS)]
fn regressor_lanes(bencher: Bencher<'_, '_>, joints: usize) {
    let model = RobotModel::new(robot(joints), vec![]);
    let motion = RandomMotion::new(model.mechanism(), &[], BLOCK, 1);
    let mut out = RegressorBlock::new(model.layout().clone(), BLOCK);
    motion.with_block(|block| {
        bencher.counter(ItemsCount::new(BLOCK)).bench_local(|| {
            model.regressor(black_box(block), &[], &mut out);
            black_box(out.column(0, 0)[0])
        });
    });
}

/// Blocks too short for lanes: sample after sample.
const SHORT: usize = 3;

#[divan::bench(args = ROBOTS, consts = [SHORT, BLOCK])]
fn effort_adjoint<const SAMPLES: usize>(bencher: Bencher<'_, '_>, joints: usize) {
    let model = RobotModel::new(robot(joints), vec![]);
    let phi = model.mechanism().inertia_vector();
    let weights = vec![0.5; joints * SAMPLES];
    let mut out = MotionAdjoint::new(joints, joints, SAMPLES);
    RandomMotion::new(model.mechanism(), &[], SAMPLES, 1).with_block(|block| {
        bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
            model.effort_adjoint(black_box(block), &[], &phi, SAMPLES, &weights, &mut out);
            black_box(out.q[0])
        });
    });
}

#[divan::bench(args = ROBOTS, consts = [SHORT, BLOCK])]
fn regressor_adjoint<const SAMPLES: usize>(bencher: Bencher<'_, '_>, joints: usize) {
    let model = RobotModel::new(robot(joints), vec![]);
    let mut weights = RegressorBlock::new(model.layout().clone(), SAMPLES);
    weights.set_samples(SAMPLES);
    let mut out = MotionAdjoint::new(joints, joints, SAMPLES);
    RandomMotion::new(model.mechanism(), &[], SAMPLES, 1).with_block(|block| {
        model.regressor(block, &[], &mut weights);
        bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
            model.regressor_adjoint(black_box(block), &[], &weights, &mut out);
            black_box(out.q[0])
        });
    });
}
