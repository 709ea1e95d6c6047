//! The paper's chain from noisy signals to parameters, at several sample rates.

use dynid::motion::frequency::differentiate;
use dynid::motion::smoothing::five_point_cubic;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::arm::{Arm, JOINTS};
use super::measurement::Measurement;
use super::separable::identify_plain;
use super::settings::Settings;
use crate::statistics::median;
use crate::{RunSettings, StudyError};

const RATES_HZ: [f64; 4] = [1.0, 10.0, 50.0, 100.0];
const DENSE_HZ: f64 = 100.0;
const HARMONICS: usize = 5;
/// Passes of the smoothing of torque.
const PASSES: usize = 3;

/// Errors at one sample rate, median over realisations, N m.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainRow {
    pub(super) rate_hz: f64,
    pub(super) equations: usize,
    /// States exact, torque with noise.
    pub(super) true_states: f64,
    /// States from positions with noise.
    pub(super) processed: f64,
    /// Torque smoothed besides.
    pub(super) smoothed: f64,
}

pub(super) fn by_rate(
    arm: &Arm,
    settings: &Settings,
    run: &RunSettings,
) -> Result<Vec<ChainRow>, StudyError> {
    let dense = Measurement::new(arm, settings, &settings.reference, DENSE_HZ, run.seed)?;
    let realisations: u64 = if run.quick { 5 } else { 21 };
    RATES_HZ
        .iter()
        .map(|&rate_hz| {
            let at = Measurement::new(arm, settings, &settings.reference, rate_hz, run.seed)?;
            let errors: Vec<Result<[f64; 3], StudyError>> = (0..realisations)
                .into_par_iter()
                .map(|k| errors(arm, settings, &dense, &at, run.seed + 5000 + k))
                .collect();
            let errors = errors.into_iter().collect::<Result<Vec<_>, _>>()?;
            let middle = |k: usize| median(errors.iter().map(|e| e[k]).collect());
            Ok(ChainRow {
                rate_hz,
                equations: JOINTS * at.samples,
                true_states: middle(0),
                processed: middle(1),
                smoothed: middle(2),
            })
        })
        .collect()
}

fn errors(
    arm: &Arm,
    settings: &Settings,
    dense: &Measurement,
    at: &Measurement,
    seed: u64,
) -> Result<[f64; 3], StudyError> {
    let error = |data: &Measurement| -> Result<f64, StudyError> {
        let found = identify_plain(arm, data)?;
        Ok(dense.mean_error(&dense.clean, &arm.efforts(&dense.block(), &found.unknowns)))
    };
    let noisy = at.with_noise(settings, seed);
    let processed = with_processed_states(&noisy, settings, seed)?;
    let mut smooth = processed.clone();
    for torque in smooth.torque.chunks_exact_mut(at.samples) {
        torque.copy_from_slice(&five_point_cubic(torque, PASSES).map_err(signal)?);
    }
    Ok([error(&noisy)?, error(&processed)?, error(&smooth)?])
}

/// Positions with noise, differentiated in the frequency domain.
fn with_processed_states(
    data: &Measurement,
    settings: &Settings,
    seed: u64,
) -> Result<Measurement, StudyError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x9e37_79b9);
    let mut out = data.clone();
    let n = data.samples;
    let period_s = 1.0 / settings.fundamental_hz;
    let rate_hz = n as f64 / period_s;
    for j in 0..JOINTS {
        let position: Vec<f64> = data
            .joint(&data.q, j)
            .iter()
            .map(|q| {
                let white: f64 = StandardNormal.sample(&mut rng);
                q + settings.position_noise * white
            })
            .collect();
        let states = differentiate(&position, rate_hz, period_s, HARMONICS).map_err(signal)?;
        out.q[j * n..][..n].copy_from_slice(&states.position);
        out.dq[j * n..][..n].copy_from_slice(&states.velocity);
        out.ddq[j * n..][..n].copy_from_slice(&states.acceleration);
    }
    Ok(out)
}

pub(super) fn signal(e: impl std::fmt::Display) -> StudyError {
    StudyError::Data { file: "er16", message: e.to_string() }
}
