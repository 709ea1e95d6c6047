//! Time to refill the column of a friction element over a block, beside the standard library's functions.

use divan::{Bencher, black_box, counter::ItemsCount};
use dynid_model::element::{Arctangent, JointElement, Sigmoid, Stribeck, TanhFriction};
use dynid_model::*;

fn main() {
    divan::main();
}

const SAMPLES: [usize; 2] = [600, 6000];

fn speeds(samples: usize) -> Vec<f64> {
    (0..samples).map(|k| 0.9 * (0.37 * k as f64).sin()).collect()
}

#[divan::bench(args = SAMPLES)]
fn arctangent_of_the_standard_library(bencher: Bencher<'_, '_>, samples: usize) {
    let v = speeds(samples);
    let mut out = vec![0.0; samples];
    bencher.counter(ItemsCount::new(samples)).bench_local(|| {
        for (to, v) in out.iter_mut().zip(black_box(&v)) {
            *to = (7.0 * v).atan();
        }
        black_box(&out);
    });
}

#[divan::bench(args = SAMPLES)]
fn exponential_of_the_standard_library(bencher: Bencher<'_, '_>, samples: usize) {
    let v = speeds(samples);
    let mut out = vec![0.0; samples];
    bencher.counter(ItemsCount::new(samples)).bench_local(|| {
        for (to, v) in out.iter_mut().zip(black_box(&v)) {
            let x = 10.0 * v;
            *to = (-x * x).exp();
        }
        black_box(&out);
    });
}

#[divan::bench(args = SAMPLES)]
fn arctangent(bencher: Bencher<'_, '_>, samples: usize) {
    refill(bencher, samples, Box::new(Arctangent::new(0)));
}

#[divan::bench(args = SAMPLES)]
fn stribeck(bencher: Bencher<'_, '_>, samples: usize) {
    refill(bencher, samples, Box::new(Stribeck::new(0)));
}

#[divan::bench(args = SAMPLES)]
fn sigmoid(bencher: Bencher<'_, '_>, samples: usize) {
    refill(bencher, samples, Box::new(Sigmoid::new(0)));
}

#[divan::bench(args = SAMPLES)]
fn tanh(bencher: Bencher<'_, '_>, samples: usize) {
    refill(bencher, samples, Box::new(TanhFriction::new(0)));
}

fn refill(bencher: Bencher<'_, '_>, samples: usize, element: Box<dyn JointElement>) {
    let mut d = Description::new("bench");
    d.links.extend(["l0", "l1"].map(|l| LinkDescription { name: l.into(), inertia: None }));
    d.joints.push(JointDescription {
        name: "j1".into(),
        parent: "l0".into(),
        child: "l1".into(),
        kind: JointKind::Revolute,
        placement: Placement::translate(0.0, 0.0, 0.0),
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    });
    let model = RobotModel::new(d.build().expect("the bench robot is sound"), vec![element]);
    let (v, rest) = (speeds(samples), vec![0.0; samples]);
    let motion = MotionBlock::plain(samples, &rest, &v, &rest);
    let shape = model.parameters().shape_start();
    let mut values = vec![0.0; model.shaped_columns().len() * samples];
    bencher.counter(ItemsCount::new(samples)).bench_local(|| {
        model.shaped(black_box(&motion), &shape, samples, &mut values, &mut []);
        black_box(&values);
    });
}
