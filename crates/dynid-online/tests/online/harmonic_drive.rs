//! A harmonic-drive joint whose stiffness falls in service (Sun et al.; parameters of their Table III).

use crate::stream::{normal, random, white};
use dynid_online::{
    DetectionSettings, Estimator, FalseAlarms, Forgetting, ReactionSettings, RowNoise, Settings,
};
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// `k1, k2, b_in, b_inD, b_out, b_outC`.
const TRUTH: [f64; 6] = [3.965e5, 1.336e11, 0.035, 0.135, 635.663, 30.96];
const UNITS: [f64; 6] = [4e5, 1e11, 0.05, 0.1, 500.0, 50.0];
const RATIO: f64 = 290.0;
/// Standard deviations of deformation (rad), motor torque and joint torque (N m), motor and joint speed
/// (rad/s).
const NOISE: [f64; 5] = [6e-6, 0.02, 3.0, 0.05, 2e-4];

/// Deformation under the torque `k1 d + k2 d³`.
fn deformation(torque: f64, k1: f64, k2: f64) -> f64 {
    let s = (4.0 * k1 / (3.0 * k2)).sqrt();
    s * ((4.0 * torque / (k2 * s.powi(3))).asinh() / 3.0).sinh()
}

/// Both rows of a sample in a cruise at `speed` (rad/s at the joint), `time` seconds after its start.
fn sample(x: &[f64; 6], speed: f64, time: f64, random: &mut ChaCha8Rng) -> ([f64; 12], [f64; 2]) {
    let [k1, k2, b_in, c_in, b_out, c_out] = *x;
    let (sign, w) = (speed.signum(), std::f64::consts::TAU / 14.0);
    let load = sign * (650.0 - 550.0 * (w * time).cos());
    let rate = sign * 550.0 * w * (w * time).sin();
    let torque = load + b_out * speed + c_out * sign;
    let d = deformation(torque, k1, k2);
    let motor = RATIO * (speed + rate / (k1 + 3.0 * k2 * d * d));
    let effort = [
        torque + RATIO * (b_in * motor + c_in * sign + NOISE[1] * normal(random)),
        load + NOISE[2] * normal(random),
    ];
    let (d, motor) = (d + NOISE[0] * normal(random), motor + NOISE[3] * normal(random));
    let joint = speed + NOISE[4] * normal(random);
    let phi = [d, d.powi(3), RATIO * motor, RATIO * sign, 0.0, 0.0, d, d.powi(3), 0.0, 0.0, -joint, -sign];
    (phi, effort)
}

/// Noise of the efforts and, common to both rows, of the deformation in them.
fn row_covariance(x: &[f64], d: f64) -> [f64; 4] {
    let common = ((x[0] + 3.0 * x[1] * d * d) * NOISE[0]).powi(2);
    let input = (RATIO * NOISE[1]).powi(2) + (RATIO * x[2] * NOISE[3]).powi(2);
    let output = NOISE[2].powi(2) + (x[4] * NOISE[4]).powi(2);
    [input + common, common, common, output + common]
}

/// Three shuffled cycles of five speeds in both directions before and after the stiffness falls by 15 %, at 50 Hz:
/// 18 030 samples each, with the number of the sample.
fn stream(seed: u64, mut take: impl FnMut(usize, &[f64; 12], &[f64; 2], &[f64; 6])) {
    let mut random = random(seed);
    let (mut truth, mut number) = (TRUTH, 0);
    for cycle in 0..6 {
        if cycle == 3 {
            truth[0] *= 0.85;
        }
        let speeds = [0.25, 0.5, 1.0, 2.0, 3.0_f64].map(f64::to_radians);
        let mut cruises: Vec<f64> = speeds.iter().flat_map(|v| [*v, -v]).collect();
        cruises.shuffle(&mut random);
        for speed in cruises {
            for k in 0..601 {
                let (phi, effort) = sample(&truth, speed, 1.0 + 0.02 * f64::from(k), &mut random);
                take(number, &phi, &effort, &truth);
                number += 1;
            }
        }
    }
}

const BEFORE: usize = 18_030;

#[derive(Default)]
struct Run {
    false_alarms: usize,
    /// Samples from the change to the alarms after it.
    alarms: Vec<usize>,
    named: Vec<Option<usize>>,
    /// Samples after the change from which on the stiffness is within 2 %.
    settled: usize,
}

fn run(detection: DetectionSettings, seed: u64) -> Run {
    let mut settings = Settings::new(vec![0.0; 6], UNITS.map(|u| 1e3 * u).to_vec(), 2);
    settings.scale = UNITS.to_vec();
    settings.detection = Some(detection);
    settings.reaction = Some(ReactionSettings::default());
    let mut estimator = Estimator::new(settings).unwrap();
    let mut run = Run::default();
    stream(seed, |k, phi, effort, truth| {
        let covariance = row_covariance(estimator.x(), phi[0]);
        let step = estimator.step(phi, effort, RowNoise::Covariance(&covariance)).unwrap();
        match (k.checked_sub(BEFORE), step.alarm) {
            (None, true) => run.false_alarms += 1,
            (Some(after), true) => run.alarms.push(after),
            _ => {}
        }
        if let (Some(reaction), true) = (step.reaction, k >= BEFORE) {
            run.named.push(reaction.parameter);
        }
        if k >= BEFORE && (estimator.x()[0] / truth[0] - 1.0).abs() > 0.02 {
            run.settled = k - BEFORE + 1;
        }
    });
    run
}

/// What the paper's rule does on the same stream: it follows in the end, where no forgetting does not.
#[test]
fn published_forgetting_follows_a_softened_spring_in_the_end() {
    for seed in 0..2 {
        let error = |forgetting: Forgetting| {
            let mut settings = Settings::new(vec![0.0; 6], UNITS.map(|u| 1e3 * u).to_vec(), 2);
            settings.scale = UNITS.to_vec();
            (settings.detection, settings.reaction) = (None, None);
            settings.forgetting = forgetting;
            let mut estimator = Estimator::new(settings).unwrap();
            let (mut before, mut end) = (0.0, 0.0);
            stream(seed, |k, phi, effort, truth| {
                estimator.step(phi, effort, RowNoise::Std(&[1.0, 1.0])).unwrap();
                end = (estimator.x()[0] / truth[0] - 1.0).abs();
                if k + 1 == BEFORE {
                    before = end;
                }
            });
            (before, end)
        };
        let published = error(Forgetting::ErrorDriven { alpha: 0.05, beta: -4.68, floor: 50.0 });
        let none = error(Forgetting::None);
        println!("seed {seed}: published {published:?}, none {none:?}");
        assert!(published.0 < 0.02 && published.1 < 0.03, "{published:?}");
        assert!(none.0 < 0.02 && none.1 > 0.1, "{none:?}");
    }
}

#[test]
fn a_softened_spring_is_named_and_followed() {
    let wanted = FalseAlarms::Rate { rate: 0.05, samples: 18_030.0 };
    for (name, detection) in [("stated noise", white(wanted)), ("defaults", DetectionSettings::default())] {
        for seed in 0..10 {
            let run = run(detection, seed);
            println!(
                "{name}, seed {seed}: {} false alarms, alarms after {:?}, named {:?}, within 2 % for good after {}",
                run.false_alarms, run.alarms, run.named, run.settled
            );
            assert!(run.false_alarms <= 1, "{}", run.false_alarms);
            assert_eq!(run.named.first(), Some(&Some(0)), "{:?}", run.named);
            assert!(run.settled <= 300, "{}", run.settled);
        }
    }
}
