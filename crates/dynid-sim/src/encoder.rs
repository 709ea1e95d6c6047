//! Encoders.

use rand_chacha::ChaCha8Rng;

use crate::imperfections::Imperfections;
use crate::streams::{Cause, generator, normal};

/// Encoders of all joints with one.
#[derive(Debug)]
pub(crate) struct Encoders {
    /// Distance between readings, rad or m; 0: exact.
    steps: Vec<f64>,
    /// Standard deviation per joint.
    noise: Vec<f64>,
    at_ticks: ChaCha8Rng,
    between: ChaCha8Rng,
}

impl Encoders {
    /// `slides`: for every joint, whether it does.
    pub(crate) fn new(slides: &[bool], imperfections: &Imperfections, seed: u64) -> Self {
        let own = |j: usize| imperfections.joint_encoder_noise.get(j).copied();
        let noise = (0..slides.len()).map(|j| own(j).unwrap_or(imperfections.encoder_noise)).collect();
        let steps = slides
            .iter()
            .map(|slides| match imperfections.encoder_bits {
                0 => 0.0,
                bits => {
                    let turn = if *slides { 1.0 } else { std::f64::consts::TAU };
                    turn / 2f64.powi(bits as i32)
                }
            })
            .collect();
        Encoders {
            steps,
            noise,
            at_ticks: generator(seed, Cause::Encoder),
            between: generator(seed, Cause::EncoderBetween),
        }
    }

    /// Reading of the controller.
    pub(crate) fn at_tick(&mut self, q: &[f64]) -> Vec<f64> {
        read(&self.steps, &self.noise, &mut self.at_ticks, q)
    }

    /// Reading of a logger that samples between ticks.
    pub(crate) fn between_ticks(&mut self, q: &[f64]) -> Vec<f64> {
        read(&self.steps, &self.noise, &mut self.between, q)
    }
}

fn read(steps: &[f64], noise: &[f64], rng: &mut ChaCha8Rng, q: &[f64]) -> Vec<f64> {
    q.iter()
        .zip(steps.iter().zip(noise))
        .map(|(q, (step, noise))| {
            let read = q + noise * normal(rng);
            if *step > 0.0 { (read / step).round() * step } else { read }
        })
        .collect()
}
