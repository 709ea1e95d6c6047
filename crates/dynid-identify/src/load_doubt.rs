//! Friction coefficients of journals are known as well as their loads.

use dynid_estimate::identifiability::{Assessment, Posterior, Verdict, verdict};
use dynid_linalg::Mat;
use dynid_model::{EffortModel, RobotModel, Ties};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, States};

use crate::Error;

/// Samples that are looked at together.
const BLOCK: usize = 4096;

/// How coefficients of friction go with the inertial parameters that their loads are taken at.
#[derive(Debug, Clone, Default)]
pub(crate) struct LoadDoubt {
    /// Per coefficient its column, and its relative change per unit of each linear parameter; 0 for those that follow from others.
    changes: Vec<(usize, Vec<f64>)>,
}

impl LoadDoubt {
    /// Over the motion of logs; nothing where no journal moves in its bearing.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub(crate) fn of(
        model: &RobotModel,
        logs: &[PreparedLog],
        state_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<LoadDoubt, Error> {
        let Some(journals) = model.journals() else { return Ok(LoadDoubt::default()) };
        let mut sums = Vec::new();
        for log in logs {
            let states = States::of_motion(log, state_hz, settings)?;
            for first in (0..states.samples).step_by(BLOCK) {
                let range = first..(first + BLOCK).min(states.samples);
                let part = states.with_block(range, &log.channels, &[], |motion| journals.load_sums(motion));
                if sums.is_empty() {
                    sums = part;
                    continue;
                }
                for (sum, part) in sums.iter_mut().zip(part) {
                    sum.square += part.square;
                    sum.change.iter_mut().zip(part.change).for_each(|(to, x)| *to += x);
                }
            }
        }
        let parameters = model.parameters().linear.len();
        let changes = sums.into_iter().filter(|sum| sum.square > 0.0).map(|sum| {
            let mut change: Vec<f64> = sum.change.iter().map(|x| x / sum.square).collect();
            change.resize(parameters, 0.0);
            for dependent in model.ties().into_iter().flat_map(Ties::linear) {
                let own = std::mem::take(&mut change[dependent.index]);
                dependent.terms.iter().for_each(|(free, factor)| change[*free] += factor * own);
            }
            (sum.mu, change)
        });
        Ok(LoadDoubt { changes: changes.collect() })
    }

    /// Whether no coefficient goes with a load.
    pub(crate) fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// Covariances of the coefficients that come from their loads: columns, `mu_a mu_b g_aᵀ C g_b`. `values`: of all linear parameters.
    pub(crate) fn covariances(&self, after: &Posterior, values: &[f64]) -> Vec<(usize, usize, f64)> {
        let product = |a: &[f64], c: &Mat, b: &[f64]| -> f64 {
            let nonzero = |v: &[f64]| -> Vec<(usize, f64)> {
                v.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect()
            };
            let (a, b) = (nonzero(a), nonzero(b));
            a.iter().map(|(i, x)| b.iter().map(|(j, y)| x * y * c[(*i, *j)]).sum::<f64>()).sum()
        };
        let pairs = self.changes.iter().flat_map(|a| self.changes.iter().map(move |b| (a, b)));
        pairs
            .map(|((i, a), (j, b))| (*i, *j, values[*i] * values[*j] * product(a, &after.covariance, b)))
            .collect()
    }
}

/// What is known about a coefficient whose load adds a variance, which no motion takes away: only the product is seen.
pub(crate) fn doubted(of: &mut Assessment, variance: f64) {
    let lost = (variance / (of.prior_std * of.prior_std)).clamp(0.0, 1.0);
    of.posterior_std = (of.posterior_std * of.posterior_std + variance).sqrt();
    of.achieved = (of.achieved - lost).max(0.0);
    of.log_limit = (of.log_limit - lost).max(of.achieved);
    of.structural_limit = (of.structural_limit - lost).max(of.log_limit);
    of.hidden = (of.hidden + lost).min(1.0);
    if of.verdict != Verdict::Given {
        of.verdict = verdict(of.achieved, of.log_limit, of.structural_limit);
    }
}
