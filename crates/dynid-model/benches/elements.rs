//! Time to refill the column of a friction element over a block, beside the standard library's functions; time of a rough
//! contact's force and of its stored energy.

use divan::{Bencher, black_box, counter::ItemsCount};
use dynid_model::contact::{
    ContactLaw, FractalLankaraniNikravesh, FractalSettings, FractalSurface, JournalBearing, SurfaceSettings,
};
use dynid_model::element::{
    Arctangent, ExponentialViscous, JointElement, LuGre, ShapeSetting, Sigmoid, Stribeck, TanhFriction,
    Viscous,
};
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

/// Columns of an exponent other than 2.
#[divan::bench(args = SAMPLES)]
fn stribeck_with_an_exponent(bencher: Bencher<'_, '_>, samples: usize) {
    refill(bencher, samples, Box::new(Stribeck { delta: free(1.4), ..Stribeck::new(0) }));
}

#[divan::bench(args = SAMPLES)]
fn exponential_viscous(bencher: Bencher<'_, '_>, samples: usize) {
    let law = ExponentialViscous { temperature: Some(31.0), ..ExponentialViscous::new(0) };
    refill(bencher, samples, Box::new(law));
}

#[divan::bench(args = SAMPLES)]
fn arctangent_by_shape(bencher: Bencher<'_, '_>, samples: usize) {
    derive(bencher, samples, Box::new(Arctangent::new(0)));
}

#[divan::bench(args = SAMPLES)]
fn stribeck_by_shape(bencher: Bencher<'_, '_>, samples: usize) {
    derive(bencher, samples, Box::new(Stribeck::new(0)));
}

/// By speed and exponent.
#[divan::bench(args = SAMPLES)]
fn stribeck_with_an_exponent_by_shape(bencher: Bencher<'_, '_>, samples: usize) {
    derive(bencher, samples, Box::new(Stribeck { delta: free(1.4), ..Stribeck::new(0) }));
}

#[divan::bench(args = SAMPLES)]
fn sigmoid_by_shape(bencher: Bencher<'_, '_>, samples: usize) {
    derive(bencher, samples, Box::new(Sigmoid::new(0)));
}

#[divan::bench(args = SAMPLES)]
fn tanh_by_shape(bencher: Bencher<'_, '_>, samples: usize) {
    derive(bencher, samples, Box::new(TanhFriction::new(0)));
}

#[divan::bench(args = SAMPLES)]
fn exponential_viscous_by_shape(bencher: Bencher<'_, '_>, samples: usize) {
    let law = ExponentialViscous { temperature: Some(31.0), ..ExponentialViscous::new(0) };
    derive(bencher, samples, Box::new(law));
}

/// Efforts and their derivatives by velocity under a smooth sign, as designs take them.
#[divan::bench(args = SAMPLES)]
fn friction_by_velocity(bencher: Bencher<'_, '_>, samples: usize) {
    let elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(Stribeck::new(0)),
        Box::new(Viscous { rate: 0 }),
        Box::new(TanhFriction::new(0)),
        Box::new(Arctangent::new(0)),
    ];
    let model = one_joint(elements);
    let (v, rest) = (speeds(samples), vec![0.0; samples]);
    let motion = MotionBlock { sign_width: 0.05, ..MotionBlock::plain(samples, &rest, &v, &rest) };
    let shape = model.parameters().shape_start();
    let linear = vec![1.0; model.parameters().linear.len()];
    let weights = vec![1.0; samples];
    bencher.counter(ItemsCount::new(samples)).bench_local(|| {
        let mut out = MotionAdjoint::new(1, 1, samples);
        model.effort_adjoint(black_box(&motion), &shape, &linear, samples, &weights, &mut out);
        black_box(&out);
    });
}

fn free(start: f64) -> ShapeSetting {
    ShapeSetting { start, lower: 0.5 * start, upper: 2.0 * start, held: false }
}

fn derive(bencher: Bencher<'_, '_>, samples: usize, element: Box<dyn JointElement>) {
    let model = one_joint(vec![element]);
    let (v, rest) = (speeds(samples), vec![0.0; samples]);
    let motion = MotionBlock::plain(samples, &rest, &v, &rest);
    let shape = model.parameters().shape_start();
    let mut derivatives = vec![0.0; model.shape_dependence().len() * samples];
    bencher.counter(ItemsCount::new(samples)).bench_local(|| {
        model.shaped(black_box(&motion), &shape, samples, &mut [], &mut derivatives);
        black_box(&derivatives);
    });
}

fn refill(bencher: Bencher<'_, '_>, samples: usize, element: Box<dyn JointElement>) {
    let model = one_joint(vec![element]);
    let (v, rest) = (speeds(samples), vec![0.0; samples]);
    let motion = MotionBlock::plain(samples, &rest, &v, &rest);
    let shape = model.parameters().shape_start();
    let mut values = vec![0.0; model.shaped_columns().len() * samples];
    bencher.counter(ItemsCount::new(samples)).bench_local(|| {
        model.shaped(black_box(&motion), &shape, samples, &mut values, &mut []);
        black_box(&values);
    });
}

fn one_joint(elements: Vec<Box<dyn JointElement>>) -> RobotModel {
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
    RobotModel::new(d.build().expect("the bench robot is sound"), elements)
}

/// 20 s at 4 kHz.
const RECORD: usize = 80_000;
const JOINTS: usize = 6;

/// Friction of six joints over a record, bristles and viscous friction of temperature: signals of the motion before, then
/// efforts.
#[divan::bench]
fn bristles_of_six_joints_over_20_s_at_4_khz(bencher: Bencher<'_, '_>) {
    let mut d = Description::new("row");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut friction = Vec::new();
    for rate in 0..JOINTS {
        d.links.push(LinkDescription { name: format!("l{rate}"), inertia: None });
        d.joints.push(JointDescription {
            name: format!("j{rate}"),
            parent: if rate == 0 { "base".into() } else { format!("l{}", rate - 1) },
            child: format!("l{rate}"),
            kind: JointKind::Revolute,
            placement: Placement::identity(),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
        let held = ShapeSetting::held;
        elements.push(Box::new(LuGre {
            kappa: held(1850.0),
            rho: held(1.3),
            vs: held(0.04),
            ..LuGre::new(rate)
        }));
        elements.push(Box::new(ExponentialViscous {
            sigma3: held(1.3),
            sigma4: held(0.8),
            ..ExponentialViscous::new(rate)
        }));
        friction.extend([9.1, 270.0, 30.0, -1.0]);
    }
    let model = RobotModel::new(d.build().unwrap_or_else(|e| panic!("{e}")), elements);
    let linear: Vec<f64> = [0.0; 10 * JOINTS].into_iter().chain(friction).collect();
    let dq: Vec<f64> = (0..JOINTS).flat_map(|_| speeds_of_record()).collect();
    let (rest, warm) = (vec![0.0; dq.len()], vec![31.0; RECORD]);
    let mut signals = vec![0.0; model.signals().len() * RECORD];
    let (mut effort, mut memory) = (vec![0.0; dq.len()], Vec::new());
    bencher.counter(ItemsCount::new(JOINTS * RECORD)).bench_local(|| {
        let plain = MotionBlock::plain(RECORD, &rest, black_box(&dq), &rest);
        model.remember(&plain, 2.5e-4, &[], &mut History::default(), RECORD, &mut signals);
        let warmth = model.channels().iter().map(|name| (name.as_str(), warm.as_slice()));
        let bristles = model.signals().iter().map(String::as_str).zip(signals.chunks_exact(RECORD));
        let channels: Vec<(&str, &[f64])> = warmth.chain(bristles).collect();
        let motion = MotionBlock { channels: &channels, ..plain };
        effort.fill(0.0);
        model.tree().element_efforts(&motion, &[], &linear, RECORD, &mut effort, &mut memory);
        black_box(&effort);
    });
}

/// Bristles sample by sample with the standard library's functions.
#[divan::bench]
fn bristles_sample_by_sample_with_the_standard_library(bencher: Bencher<'_, '_>) {
    let dq: Vec<f64> = (0..JOINTS).flat_map(|_| speeds_of_record()).collect();
    let mut effort = vec![0.0; dq.len()];
    bencher.counter(ItemsCount::new(JOINTS * RECORD)).bench_local(|| {
        for (speeds, effort) in black_box(&dq).chunks_exact(RECORD).zip(effort.chunks_exact_mut(RECORD)) {
            let mut z = 0.0;
            for (v, e) in speeds.iter().zip(effort) {
                let g = 9.1 + 2.73 * (-(v / 0.04) * (v / 0.04)).exp();
                let bend = v - 16_835.0 * v.abs() * z / g;
                let viscous = 24.0 * (1.0 - (-(1.3 * v.abs()).powf(0.8)).exp());
                *e = 16_835.0 * z + 270.0 * bend + viscous.copysign(*v);
                let steady = g.copysign(*v) / 16_835.0;
                z = steady + (z - steady) * (-16_835.0 * v.abs() * 2.5e-4 / g).exp();
            }
        }
        black_box(&effort);
    });
}

fn speeds_of_record() -> Vec<f64> {
    (0..RECORD).map(|k| 1.2 * (0.001 * k as f64).sin() + 0.3 * (0.0037 * k as f64).cos()).collect()
}

fn rough_contact() -> ContactLaw {
    let surface = FractalSurface::new(SurfaceSettings::default()).expect("the default surface is sound");
    let bearing = JournalBearing::with_gap(0.01, 5e-5, 0.02).expect("the bearing is sound");
    let law = FractalLankaraniNikravesh::new(surface, bearing, FractalSettings::new(2.0));
    law.expect("the contact is sound").into()
}

/// In the second stage, the first, and with elastic spots.
#[divan::bench(args = [1e-10, 1e-8, 4e-6])]
fn contact_force(bencher: Bencher<'_, '_>, penetration: f64) {
    let law = rough_contact();
    bencher.bench_local(|| black_box(law.at(black_box(penetration), 0.05)));
}

#[divan::bench]
fn contact_energy(bencher: Bencher<'_, '_>) {
    let law = rough_contact();
    bencher.bench_local(|| black_box(law.stored_energy(black_box(4e-6))));
}
