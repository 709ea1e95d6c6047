//! Measured forces: those of the true parameters with the Stribeck law, and noise.

use dynid::estimators::load_friction::{Problem, Record, Settings as Law};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::fault;
use crate::StudyError;

/// A record with the forces of its sliders.
#[derive(Debug, Clone)]
pub(super) struct Experiment {
    pub(super) record: Record,
    pub(super) clean: Vec<Vec<f64>>,
    pub(super) efforts: Vec<Vec<f64>>,
}

impl Experiment {
    /// `noise`: standard deviation, N.
    pub(super) fn new(record: Record, truth: &[f64], noise: f64, seed: u64) -> Result<Self, StudyError> {
        let zero = vec![vec![0.0; record.samples()]; record.drives().len()];
        let machine = Problem::new(record.clone(), &zero, Law::default()).map_err(fault)?;
        let predicted = machine.predict(truth).map_err(fault)?;
        let clean: Vec<Vec<f64>> = predicted.drives.into_iter().map(|d| d.effort).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut noisy = |f: &f64| {
            let e: f64 = StandardNormal.sample(&mut rng);
            f + noise * e
        };
        let efforts = clean.iter().map(|d| d.iter().map(&mut noisy).collect()).collect();
        Ok(Experiment { record, clean, efforts })
    }

    pub(super) fn problem(&self, law: Law) -> Result<Problem, StudyError> {
        Problem::new(self.record.clone(), &self.efforts, law).map_err(fault)
    }
}
