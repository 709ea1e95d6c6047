//! Row f: what torque noise does to base parameters, over many realisations.

use dynid::estimators::distribution::t_quantile;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use serde_json::json;

use super::data::{Data, Knowledge};
use super::fault;
use super::fit::{Fitted, LEVEL};
use super::parameters::{BASE, MASS_2, Parameters};
use super::pointing::Pointing;
use crate::{Row, RunSettings, StudyError};

/// Standard deviations of the torque, N m.
pub(super) const LEVELS: [f64; 2] = [1e-4, 1e-3];
/// How well mass 2 is known beforehand: the paper's search range.
pub(super) const MASS_SHARE: f64 = 0.1;

/// A model at a level of noise.
#[derive(Debug)]
pub(super) struct Spread {
    pub(super) knowledge: Knowledge,
    pub(super) level: f64,
    pub(super) bias: [f64; BASE],
    pub(super) deviation: [f64; BASE],
    /// Mean of the standard deviations that single fits state.
    pub(super) stated: [f64; BASE],
    /// Share of intervals that hold the truth.
    pub(super) coverage: [f64; BASE],
}

impl Spread {
    fn new(
        knowledge: Knowledge,
        level: f64,
        fits: &[Fitted],
        truth: &[f64; BASE],
    ) -> Result<Self, StudyError> {
        let n = fits.len() as f64;
        let t = fits.first().map_or(1.0, |f| (f.residual.len() - f.x.len()) as f64);
        let t = t_quantile(0.5 + 0.5 * LEVEL, t).ok_or_else(|| fault("no degrees of freedom"))?;
        let mean = |of: &dyn Fn(&Fitted) -> f64| fits.iter().map(of).sum::<f64>() / n;
        let bias: [f64; BASE] = std::array::from_fn(|k| mean(&|f| f.x[k]) - truth[k]);
        let around = |k: usize| mean(&|f| (f.x[k] - truth[k] - bias[k]).powi(2));
        Ok(Spread {
            knowledge,
            level,
            deviation: std::array::from_fn(|k| (around(k) * n / (n - 1.0)).sqrt()),
            stated: std::array::from_fn(|k| mean(&|f| f.half[k] / t)),
            coverage: std::array::from_fn(|k| mean(&|f| f64::from((f.x[k] - truth[k]).abs() <= f.half[k]))),
            bias,
        })
    }

    fn mean_coverage(&self) -> f64 {
        self.coverage.iter().sum::<f64>() / BASE as f64
    }

    /// Share of the stated in the true standard deviation that is farthest from 1.
    fn honesty(&self) -> f64 {
        let ratios = self.stated.iter().zip(&self.deviation).map(|(s, d)| s / d);
        ratios.fold(1.0, |worst: f64, r: f64| if r.ln().abs() > worst.ln().abs() { r } else { worst })
    }
}

/// All models at all levels.
#[derive(Debug)]
pub(super) struct NoiseStudy {
    pub(super) truth: [f64; BASE],
    pub(super) realisations: usize,
    /// Levels in order, models in the order of [`Knowledge::ALL`].
    pub(super) spreads: Vec<Spread>,
}

impl NoiseStudy {
    pub(super) fn new(pointing: &Pointing, data: &Data, run: &RunSettings) -> Result<Self, StudyError> {
        let system = Parameters::of(pointing.mechanism())?;
        let truth = system.base(pointing.length());
        let realisations = if run.quick { 40 } else { 1000 };
        let mass = Normal::new(system.0[MASS_2], MASS_SHARE * system.0[MASS_2]).map_err(fault)?;
        let mut spreads = Vec::new();
        for level in LEVELS {
            for knowledge in Knowledge::ALL {
                let one = |k: u64| {
                    let seed = run.seed.wrapping_add((k + 1) << 32);
                    let known = mass.sample(&mut ChaCha8Rng::seed_from_u64(!seed));
                    let torque = data.noisy(level, seed)?;
                    Fitted::new(data, &torque, knowledge, Some([known, MASS_SHARE * system.0[MASS_2]]))
                };
                let fits: Vec<Fitted> =
                    (0..realisations as u64).into_par_iter().map(one).collect::<Result<_, _>>()?;
                spreads.push(Spread::new(knowledge, level, &fits, &truth)?);
            }
        }
        Ok(NoiseStudy { truth, realisations, spreads })
    }

    pub(super) fn row(&self) -> Row {
        let of = |knowledge: Knowledge| self.spreads.iter().filter(move |s| s.knowledge == knowledge);
        let clearance: Vec<&Spread> = of(Knowledge::Clearance).collect();
        let n = self.realisations as f64;
        let margin = 3.0 * (LEVEL * (1.0 - LEVEL) / n).sqrt();
        let spread = 1.0 + 3.0 / (2.0 * n).sqrt();
        let honest = clearance.iter().all(|s| {
            (s.mean_coverage() - LEVEL).abs() <= margin && (1.0 / spread..=spread).contains(&s.honesty())
        });
        let told: Vec<String> = clearance
            .iter()
            .map(|s| format!("{:.1} % at {:.0e} N m", 100.0 * s.mean_coverage(), s.level))
            .collect();
        let others: Vec<String> = [Knowledge::Coulomb, Knowledge::Ideal]
            .into_iter()
            .flat_map(of)
            .map(|s| format!("{:.0} %", 100.0 * s.mean_coverage()))
            .collect();
        let strong = clearance.last().map_or([f64::NAN; BASE], |s| s.deviation);
        let percent = |k: usize| 100.0 * strong[k] / self.truth[k].abs();
        Row::new(
            "f",
            "With torque noise the intervals of the clearance model hold the truth as often as they say; those of the ideal model do not, \
             and those with Coulomb friction only because they take the swing of the journals for noise and are ten times as wide",
            "95 % intervals of the clearance model hold 95 % on average over parameters, stated deviations are the true ones, each \
             within three standard errors of the study",
            json!({
                "realisations": self.realisations,
                "spreads": self.spreads.iter().map(|s| json!({
                    "model": s.knowledge.name(), "noise": s.level, "bias": s.bias, "deviation": s.deviation,
                    "stated": s.stated, "coverage": s.coverage,
                })).collect::<Vec<_>>(),
            }),
            format!(
                "{} realisations: {}; with Coulomb friction {} and {}, ideal {} and {}. At 1e-3 N m π1 to {:.1} %, π6 {:.0} %, π7 \
                 {:.3} %, π8 {:.3} %, π2 {:.0} %",
                self.realisations,
                told.join(", "),
                others[0],
                others[1],
                others[2],
                others[3],
                percent(0),
                percent(5),
                percent(6),
                percent(7),
                percent(1),
            ),
            honest,
        )
    }
}
