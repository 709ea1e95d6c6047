//! Streams of samples shared by the tests.

use dynid_online::{
    DetectionSettings, Estimator, FalseAlarms, Forgetting, RowNoise, Settings, Step, Whiteness,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub(crate) fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(crate) fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

pub(crate) fn normals(random: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    (0..count).map(|_| normal(random)).collect()
}

/// Settings without change detection, prior deviations 10 about zero.
pub(crate) fn plain(columns: usize, rows: usize, forgetting: Forgetting) -> Settings {
    let mut settings = Settings::new(vec![0.0; columns], vec![10.0; columns], rows);
    settings.scale = vec![1.0; columns];
    settings.forgetting = forgetting;
    settings.detection = None;
    settings.reaction = None;
    settings
}

pub(crate) fn white(false_alarms: FalseAlarms) -> DetectionSettings {
    DetectionSettings { false_alarms, whiteness: Whiteness::White, ..DetectionSettings::default() }
}

/// Random rows with noise of deviation `sigma`.
pub(crate) struct Stream {
    pub(crate) random: ChaCha8Rng,
    pub(crate) truth: Vec<f64>,
    pub(crate) sigma: f64,
    pub(crate) rows: usize,
}

impl Stream {
    pub(crate) fn new(seed: u64, truth: &[f64], rows: usize, sigma: f64) -> Self {
        Self { random: random(seed), truth: truth.to_vec(), sigma, rows }
    }

    pub(crate) fn sample(&mut self) -> (Vec<f64>, Vec<f64>) {
        let p = self.truth.len();
        let phi = normals(&mut self.random, self.rows * p);
        let effort = phi.chunks_exact(p).map(|row| {
            let clean: f64 = row.iter().zip(&self.truth).map(|(f, x)| f * x).sum();
            clean + self.sigma * normal(&mut self.random)
        });
        let effort = effort.collect();
        (phi, effort)
    }

    pub(crate) fn feed_all(&mut self, estimator: &mut Estimator, samples: usize) {
        for _ in 0..samples {
            self.feed(estimator);
        }
    }

    pub(crate) fn feed(&mut self, estimator: &mut Estimator) -> Step {
        let (phi, effort) = self.sample();
        estimator.step(&phi, &effort, RowNoise::Std(&vec![self.sigma; self.rows])).unwrap()
    }
}

#[track_caller]
pub(crate) fn check_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    for (i, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance * e.abs(), "{what}[{i}]: {f} against {e}");
    }
}
