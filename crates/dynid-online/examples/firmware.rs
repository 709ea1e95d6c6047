//! Friction of a joint followed sample by sample, as firmware would: no standard library in the loop, no allocation after the start.
//!
//! `cargo run --release -p dynid-online --example firmware`
#![no_std]
#![expect(clippy::print_stdout, reason = "the result of a program")]
extern crate alloc;
// A hosted program has its entry point from it, and somewhere to print.
extern crate std;

use alloc::vec;
use dynid_online::{DetectionSettings, Estimator, Forgetting, RowNoise, Settings};

/// What a control loop of 1 kHz measures: speed, rad/s, and effort, N m. After 20 s the joint loses its grease.
fn sample(k: u32) -> (f64, f64) {
    let time = f64::from(k) / 1000.0;
    // Sines of a short table, as controllers have them; the noise is that of a counter.
    let phase = (time * 0.7) % 1.0;
    let speed = 2.0 * (8.0 * (phase - 0.5) * (1.0 - 2.0 * (phase - 0.5).abs()));
    let noise = f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1u32 << 24) - 0.5;
    let viscous = if k < 20_000 { 0.8 } else { 1.3 };
    (speed, viscous * speed + 1.5 * speed.signum() + 0.1 * noise)
}

fn main() {
    let mut settings = Settings::new(vec![0.0; 2], vec![10.0; 2], 1);
    settings.forgetting = Forgetting::Constant { lambda: 0.999 };
    settings.detection = Some(DetectionSettings::default());
    let mut estimator = Estimator::new(settings).expect("settings of a program that was tried");
    for k in 0..40_000 {
        let (speed, effort) = sample(k);
        let step = estimator
            .step(&[speed, speed.signum()], &[effort], RowNoise::Std(&[0.03]))
            .expect("finite samples");
        if step.alarm {
            std::println!("{:6.3} s: something changed", f64::from(k) / 1000.0);
        }
        if k % 5_000 == 4_999 {
            let x = estimator.x();
            std::println!(
                "{:6.3} s: viscous {:.3} N m s/rad, Coulomb {:.3} N m",
                f64::from(k + 1) / 1000.0,
                x[0],
                x[1]
            );
        }
    }
}
