//! Simulated measurements of the arm on a trajectory.

use dynid::model::MotionBlock;
use dynid::motion::trajectory::{Form, FourierTrajectory, RowOrder, Sampled};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::arm::{Arm, JOINTS};
use super::reference::IdentificationReference;
use super::settings::Settings;
use crate::StudyError;

/// One period of motion with torque; joint `j`, sample `s` of every signal at `[j * samples + s]`.
#[derive(Debug, Clone)]
pub(super) struct Measurement {
    pub(super) samples: usize,
    pub(super) q: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) ddq: Vec<f64>,
    /// Torque with noise.
    pub(super) torque: Vec<f64>,
    /// Torque without.
    pub(super) clean: Vec<f64>,
}

impl Measurement {
    /// The true motion at `rate_hz` over one period, torque with white noise.
    pub(super) fn new(
        arm: &Arm,
        settings: &Settings,
        rows: &[Vec<f64>],
        rate_hz: f64,
        seed: u64,
    ) -> Result<Self, StudyError> {
        let samples = (rate_hz / settings.fundamental_hz).round() as usize;
        let time: Vec<f64> = (0..samples).map(|k| k as f64 / rate_hz).collect();
        let motion = Sampled::at_times(&trajectory(settings, rows)?, time);
        let mut out = Measurement {
            samples,
            q: motion.q,
            dq: motion.dq,
            ddq: motion.ddq,
            torque: Vec::new(),
            clean: Vec::new(),
        };
        let truth: Vec<f64> = settings.unknowns.iter().map(|u| u.value).collect();
        out.clean = arm.efforts(&out.block(), &truth);
        Ok(out.with_noise(settings, seed))
    }

    /// Motion and torque of the independent implementation, which gives no torque without noise: both are the same here.
    pub(super) fn of_reference(reference: &IdentificationReference) -> Self {
        let transposed = |rows: &[[f64; JOINTS]]| -> Vec<f64> {
            (0..JOINTS).flat_map(|j| rows.iter().map(move |row| row[j])).collect()
        };
        let torque = transposed(&reference.tau);
        Measurement {
            samples: reference.q.len(),
            q: transposed(&reference.q),
            dq: transposed(&reference.qd),
            ddq: transposed(&reference.qdd),
            clean: torque.clone(),
            torque,
        }
    }

    /// Returns the motion with another realisation of the noise.
    pub(super) fn with_noise(&self, settings: &Settings, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noisy = |(k, clean): (usize, &f64)| {
            let white: f64 = StandardNormal.sample(&mut rng);
            clean + settings.torque_noise[k / self.samples] * white
        };
        Measurement { torque: self.clean.iter().enumerate().map(noisy).collect(), ..self.clone() }
    }

    pub(super) fn block(&self) -> MotionBlock<'_> {
        MotionBlock::plain(self.samples, &self.q, &self.dq, &self.ddq)
    }

    /// Mean over samples of the sum over joints of `|a - b|`, N m: the paper's objective with `δ = 1`.
    pub(super) fn mean_error(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / self.samples as f64
    }

    /// One joint of a signal.
    pub(super) fn joint<'a>(&self, signal: &'a [f64], joint: usize) -> &'a [f64] {
        &signal[joint * self.samples..][..self.samples]
    }

    /// Correlation of each joint's signals.
    pub(super) fn correlation(&self, a: &[f64], b: &[f64]) -> [f64; JOINTS] {
        std::array::from_fn(|j| correlation(self.joint(a, j), self.joint(b, j)))
    }
}

pub(super) fn trajectory(settings: &Settings, rows: &[Vec<f64>]) -> Result<FourierTrajectory, StudyError> {
    FourierTrajectory::from_rows(settings.base_frequency(), Form::Plain, &RowOrder::default(), rows, 1)
        .map_err(StudyError::from)
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let product = |x: &[f64], mx: f64, y: &[f64], my: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum()
    };
    product(a, ma, b, mb) / (product(a, ma, a, ma) * product(b, mb, b, mb)).sqrt()
}
