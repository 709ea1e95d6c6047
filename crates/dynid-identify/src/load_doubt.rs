//! Friction coefficients of journals are known as well as their loads.

use dynid_estimate::identifiability::{Assessment, Posterior, Verdict, verdict};
use dynid_linalg::Mat;
use dynid_model::{EffortModel, RobotModel, Ties};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, States};

use crate::Error;

/// Samples that are looked at together.
const BLOCK: usize = 4096;

/// A coefficient of friction, and how it goes with the inertial parameters that its load is taken at.
#[derive(Debug, Clone)]
struct Coefficient {
    column: usize,
    /// Relative change per unit of each linear parameter; 0 for those that follow from others.
    change: Vec<f64>,
    /// Factor that makes up for loads at unconstrained parameters in place of the model's.
    factor: f64,
}

/// How coefficients of friction go with the inertial parameters that their loads are taken at.
#[derive(Debug, Clone, Default)]
pub(crate) struct LoadDoubt {
    coefficients: Vec<Coefficient>,
}

/// What the loads say of a coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Doubted {
    /// Linear parameter.
    pub(crate) column: usize,
    /// The unconstrained value, which goes with loads at unconstrained parameters.
    pub(crate) value: f64,
    /// Variance that comes from the loads.
    pub(crate) variance: f64,
}

impl LoadDoubt {
    /// Over the motion of logs; nothing where no journal moves in its bearing. `values`: unconstrained linear parameters.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub(crate) fn of(
        model: &RobotModel,
        values: &[f64],
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
                let part =
                    states.with_block(range, &log.channels, &[], |motion| journals.load_sums(motion, values));
                if sums.is_empty() {
                    sums = part;
                    continue;
                }
                for (sum, part) in sums.iter_mut().zip(part) {
                    sum.square += part.square;
                    sum.product += part.product;
                    sum.change.iter_mut().zip(part.change).for_each(|(to, x)| *to += x);
                }
            }
        }
        let parameters = model.parameters().linear.len();
        let coefficients = sums.into_iter().filter(|sum| sum.square > 0.0).map(|sum| {
            let mut change: Vec<f64> = sum.change.iter().map(|x| x / sum.square).collect();
            change.resize(parameters, 0.0);
            for dependent in model.ties().into_iter().flat_map(Ties::linear) {
                let own = std::mem::take(&mut change[dependent.index]);
                dependent.terms.iter().for_each(|(free, factor)| change[*free] += factor * own);
            }
            Coefficient { column: sum.mu, change, factor: sum.product / sum.square }
        });
        Ok(LoadDoubt { coefficients: coefficients.collect() })
    }

    /// Whether no coefficient goes with a load.
    pub(crate) fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// Covariances of the coefficients that come from their loads: columns, `mu_a mu_b g_aᵀ C g_b`. `values`: unconstrained linear
    /// parameters.
    pub(crate) fn covariances(&self, after: &Posterior, values: &[f64]) -> Vec<(usize, usize, f64)> {
        let product = |a: &[f64], c: &Mat, b: &[f64]| -> f64 {
            let nonzero = |v: &[f64]| -> Vec<(usize, f64)> {
                v.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect()
            };
            let (a, b) = (nonzero(a), nonzero(b));
            a.iter().map(|(i, x)| b.iter().map(|(j, y)| x * y * c[(*i, *j)]).sum::<f64>()).sum()
        };
        let size = |of: &Coefficient| of.factor * values[of.column];
        let pairs = self.coefficients.iter().flat_map(|a| self.coefficients.iter().map(move |b| (a, b)));
        let of = |(a, b): (&Coefficient, &Coefficient)| {
            let covariance = size(a) * size(b) * product(&a.change, &after.covariance, &b.change);
            (a.column, b.column, covariance)
        };
        pairs.map(of).collect()
    }

    /// What the loads say of every coefficient.
    pub(crate) fn doubted(&self, covariances: &[(usize, usize, f64)], values: &[f64]) -> Vec<Doubted> {
        let of = |c: &Coefficient| {
            let own = covariances.iter().find(|(a, b, _)| *a == c.column && *b == c.column);
            Doubted {
                column: c.column,
                value: c.factor * values[c.column],
                variance: own.map_or(0.0, |(_, _, variance)| *variance),
            }
        };
        self.coefficients.iter().map(of).collect()
    }
}

/// What is known about a coefficient whose load adds a variance, which no motion takes away: only the product is seen.
pub(crate) fn lessen(of: &mut Assessment, variance: f64) {
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
