//! The data set measured again and again: what noise does to batch estimates, filtered and not.

use dynid::estimators::linear::{LinearEstimate, LinearMethod};
use rayon::prelude::*;

use super::joint::{Damping, Extras};
use super::measurement::Signals;
use super::offline::{Equations, fit, stated_noise};
use super::online::{nth_seed, random};
use super::settings::Settings;
use super::{PARAMETERS, Values};
use crate::StudyError;

/// Cut-off of the low-pass before cubing, Hz.
pub(super) const CUTOFF_HZ: f64 = 2.0;
/// Noise of the deformation at which errors in variables are looked at, rad.
pub(super) const STRONG: [f64; 2] = [2e-5, 6e-5];
/// Level of the intervals.
const LEVEL: f64 = 0.95;

/// Cruises at the rate of sampling, without noise.
pub(super) fn clean(settings: &Settings, extras: Extras) -> Result<Vec<Signals>, StudyError> {
    Signals::programme(settings, &settings.truth.values(), extras, settings.programme.rate_hz)
}

/// The signals with noise, that of the deformation as given.
pub(super) fn noisy(settings: &Settings, clean: &[Signals], deformation: f64, seed: u64) -> Vec<Signals> {
    let mut random = random(seed);
    let noise = super::settings::Noise { deformation, ..settings.noise };
    clean.iter().map(|cruise| cruise.noisy(&noise, &mut random)).collect()
}

pub(super) fn decimated(settings: &Settings, cruises: &[Signals]) -> Vec<Signals> {
    cruises.iter().map(|cruise| cruise.decimated(settings.programme.decimation)).collect()
}

pub(super) fn filtered(settings: &Settings, cruises: &[Signals]) -> Result<Vec<Signals>, StudyError> {
    let programme = &settings.programme;
    let one =
        |cruise: &Signals| Ok(cruise.filtered(CUTOFF_HZ, programme.rate_hz)?.decimated(programme.decimation));
    cruises.iter().map(one).collect()
}

/// The full model from both rows.
pub(super) fn full(
    settings: &Settings,
    cruises: &[Signals],
    method: &LinearMethod,
) -> Result<LinearEstimate, StudyError> {
    fit(settings, cruises, Damping::Full, Equations::Both, method)
}

/// Values with half widths of their intervals by the jackknife.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    pub(super) x: Values,
    pub(super) half: Values,
}

impl Interval {
    pub(super) fn of(estimate: &LinearEstimate) -> Self {
        let half = estimate.jackknife().and_then(|j| j.half_widths(LEVEL)).unwrap_or_default();
        Interval { x: values(&estimate.x), half: values(&half) }
    }
}

/// Six values; NaN where there are none.
pub(super) fn values(list: &[f64]) -> Values {
    std::array::from_fn(|k| list.get(k).copied().unwrap_or(f64::NAN))
}

/// Relative errors.
pub(super) fn errors(x: &Values, truth: &Values) -> Values {
    std::array::from_fn(|k| x[k] / truth[k] - 1.0)
}

/// Estimates from one realisation of the noise.
#[derive(Debug, Clone)]
pub(super) struct Realisation {
    /// The programme's noise: ordinary least squares, unfiltered and filtered.
    pub(super) plain: Interval,
    pub(super) filtered: Interval,
    /// At each of [`STRONG`]: unfiltered, filtered, and total least squares unfiltered where it has a solution.
    pub(super) strong: [[Values; 2]; 2],
    pub(super) total: [Option<Values>; 2],
}

impl Realisation {
    fn new(settings: &Settings, clean: &[Signals], seed: u64) -> Result<Self, StudyError> {
        let ols = |data: &[Signals]| full(settings, data, &LinearMethod::Ols);
        let measured = noisy(settings, clean, settings.noise.deformation, seed);
        let plain = Interval::of(&ols(&decimated(settings, &measured))?);
        let smooth = Interval::of(&ols(&filtered(settings, &measured)?)?);
        let mut out =
            Realisation { plain, filtered: smooth, strong: [[[0.0; PARAMETERS]; 2]; 2], total: [None; 2] };
        for (k, deformation) in STRONG.into_iter().enumerate() {
            let measured = noisy(settings, clean, deformation, seed);
            let raw = decimated(settings, &measured);
            let smooth = filtered(settings, &measured)?;
            out.strong[k] = [values(&ols(&raw)?.x), values(&ols(&smooth)?.x)];
            let noise = stated_noise(settings, &raw, deformation);
            // Without a unique solution there is nothing to report.
            out.total[k] =
                full(settings, &raw, &LinearMethod::Tls(noise)).ok().map(|estimate| values(&estimate.x));
        }
        Ok(out)
    }

    /// Realisations, the first with the seed itself.
    pub(super) fn many(
        settings: &Settings,
        clean: &[Signals],
        seed: u64,
        count: u64,
    ) -> Result<Vec<Self>, StudyError> {
        (0..count).into_par_iter().map(|k| Self::new(settings, clean, nth_seed(seed, k))).collect()
    }
}

/// Mean and standard deviation of relative errors.
pub(super) fn spread(list: &[Values], truth: &Values) -> (Values, Values) {
    let n = list.len() as f64;
    let mean = std::array::from_fn(|k| list.iter().map(|x| x[k] / truth[k] - 1.0).sum::<f64>() / n);
    let deviation = std::array::from_fn(|k| {
        let sum: f64 = list.iter().map(|x| (x[k] / truth[k] - 1.0 - mean[k]).powi(2)).sum();
        (sum / (n - 1.0).max(1.0)).sqrt()
    });
    (mean, deviation)
}
