//! Time per sample of closed mechanisms, beside that of their trees.

#![expect(clippy::expect_used, clippy::unwrap_used, reason = "benches outside of production code")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use dynid_model::*;

#[path = "../tests/robots/mod.rs"]
mod robots;

fn main() {
    divan::main();
}

/// Robots with loops.
const ROBOTS: [&str; 5] = ["fourbar", "fivebar", "prr3", "delta", "stewart"];
const SAMPLES: usize = 1000;

/// Ten seconds of a smooth motion around home.
struct Path {
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
}

impl Path {
    fn new(model: &ClosedModel, swing: f64) -> Path {
        let mut path = Path { q: Vec::new(), dq: Vec::new(), ddq: Vec::new() };
        for (k, home) in model.machine().home_independent().into_iter().enumerate() {
            let omega = 2.0 + 0.4 * k as f64;
            for s in 0..SAMPLES {
                let (sin, cos) = (omega * 0.01 * s as f64).sin_cos();
                path.q.push(home + swing * sin);
                path.dq.push(swing * omega * cos);
                path.ddq.push(-swing * omega * omega * sin);
            }
        }
        path
    }

    fn block(&self) -> MotionBlock<'_> {
        MotionBlock::plain(SAMPLES, &self.q, &self.dq, &self.ddq)
    }
}

fn case(name: &str) -> (ClosedModel, Path) {
    let model = robots::robot(name).model();
    let swing = match name {
        "prr3" => 0.015,
        "stewart" => 0.04,
        "fivebar" => 0.15,
        _ => 0.3,
    };
    let path = Path::new(&model, swing);
    model.follow(&path.block(), |_, _| ()).expect("the path lies in the workspace");
    (model, path)
}

/// Regressors of efforts and of all multipliers.
#[divan::bench(args = ROBOTS)]
fn efforts_and_multipliers(bencher: Bencher<'_, '_>, name: &str) {
    let (model, path) = case(name);
    let conditions = 0..model.machine().conditions();
    let list: Vec<Reaction> = conditions.map(|condition| Reaction::Multiplier { condition }).collect();
    let reactions = model.reactions(&list);
    let mut effort = RegressorBlock::new(model.layout().clone(), SAMPLES);
    let mut out = RegressorBlock::new(reactions.layout().clone(), SAMPLES);
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        model.reaction_regressor(black_box(&path.block()), &[], &reactions, &mut effort, &mut out);
        black_box((effort.column(0, 0)[0], out.column(0, 0)[0]))
    });
}

#[divan::bench(args = ROBOTS)]
fn efforts(bencher: Bencher<'_, '_>, name: &str) {
    let (model, path) = case(name);
    let mut out = RegressorBlock::new(model.layout().clone(), SAMPLES);
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        model.regressor(black_box(&path.block()), &[], &mut out);
        black_box(out.column(0, 0)[0])
    });
}

/// Poses alone.
#[divan::bench(args = ROBOTS)]
fn poses(bencher: Bencher<'_, '_>, name: &str) {
    let (model, path) = case(name);
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        let mut last = 0.0;
        let done = model.follow(black_box(&path.block()), |_, pose| last = pose.positions()[0]);
        black_box((done.is_ok(), last))
    });
}

/// The tree's regressor along the same motion: what there is to pay without loops.
#[divan::bench(args = ROBOTS)]
fn tree(bencher: Bencher<'_, '_>, name: &str) {
    let (model, path) = case(name);
    let machine = model.machine();
    let (rates, positions) = (machine.mechanism().rates(), machine.mechanism().positions());
    let mut q = vec![0.0; positions * SAMPLES];
    model
        .follow(&path.block(), |s, pose| {
            pose.positions().iter().enumerate().for_each(|(k, x)| q[k * SAMPLES + s] = *x);
        })
        .unwrap();
    let rate = vec![0.3; rates * SAMPLES];
    let mut out = RegressorBlock::new(model.tree().layout().clone(), SAMPLES);
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        let block = MotionBlock::plain(SAMPLES, &q, &rate, &rate);
        model.tree().regressor(black_box(&block), &[], &mut out);
        black_box(out.column(0, 0)[0])
    });
}
