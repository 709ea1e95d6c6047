//! Consistency, held-out errors, precision and essential parameters of a result file.

use dynid_estimate::consistent::Status;
use dynid_estimate::whiteness::InBandWhiteness;
use dynid_model::EffortModel;
use dynid_record::{ConsistencyForm, ConsistencyStatus, PriorDistance};

use crate::consistency::UNCONSTRAINED;
use crate::estimate::{
    ConsistencyRecord, HeldOutRecord, PrecisionRecord, PriorTrialRecord, PruningRecord, PruningStep,
    WhitenessRecord,
};
use crate::identification::Identification;
use crate::settings::{self, Consistency};

impl Identification {
    pub(super) fn consistency_record(&self) -> Option<ConsistencyRecord> {
        let found = self.consistent.estimate.as_ref()?;
        let chance = self.fitted.inflation * self.fit().solution.kept.len() as f64;
        let trial = &self.consistent.prior_trials[self.consistent.chosen];
        let distance = |d: settings::PriorDistance| match d {
            settings::PriorDistance::Quadratic => PriorDistance::Quadratic,
            settings::PriorDistance::Entropic => PriorDistance::Entropic,
        };
        Some(ConsistencyRecord {
            form: match self.settings.estimator.consistency {
                Consistency::SpatialInertia => ConsistencyForm::SpatialInertia,
                _ => ConsistencyForm::PseudoInertia,
            },
            status: match found.status {
                Status::Unconstrained => ConsistencyStatus::Unconstrained,
                Status::Optimal => ConsistencyStatus::Optimal,
                Status::Stalled => ConsistencyStatus::Stalled,
            },
            price: found.price(),
            price_over_chance: (chance > 0.0).then(|| found.price() / chance),
            prior: distance(trial.distance),
            prior_weight: trial.weight,
            prior_trials: (self.consistent.prior_trials.iter())
                .map(|t| PriorTrialRecord { prior: distance(t.distance), weight: t.weight, loss: t.loss })
                .collect(),
            gap: found.gap,
            iterations: found.iterations,
            least_eigenvalue: found.least_eigenvalue,
            active: found.active.iter().map(ToString::to_string).collect(),
            training_unconstrained: self.training_unconstrained.clone(),
            validation_unconstrained: self.validation_unconstrained.clone(),
        })
    }

    pub(super) fn held_out_record(&self) -> HeldOutRecord {
        let found = &self.consistent.held_out;
        let outputs = 0..self.model.outputs().len();
        let consistent = self.consistent.consistent();
        if found.folds.is_empty() {
            return HeldOutRecord::default();
        }
        HeldOutRecord {
            folds: found.folds.len(),
            rms: outputs.clone().map(|j| found.rms(UNCONSTRAINED, j)).collect(),
            rms_standard_error: outputs.clone().map(|j| found.rms_standard_error(UNCONSTRAINED, j)).collect(),
            rms_consistent: outputs.map(|j| found.rms(consistent, j)).collect(),
            relative_error: found.relative(UNCONSTRAINED).map(|x| 100.0 * x),
            relative_error_consistent: found.relative(consistent).map(|x| 100.0 * x),
        }
    }

    pub(super) fn precision_record(&self) -> PrecisionRecord {
        let record = |w: &InBandWhiteness| WhitenessRecord {
            distance: w.distance,
            threshold: w.threshold,
            rejected: w.rejected(),
            dominant_hz: w.dominant_frequency,
        };
        PrecisionRecord {
            variance_inflation: self.fitted.inflation,
            variance_inflation_per_joint: self.fitted.inflation_per_output.clone(),
            basis: self.fitted.basis,
            blocks: if self.fitted.robots > 0 { self.fitted.robots } else { self.blocks() },
            block_s: self.fitted.block_s,
            wanted_block_s: self.fitted.block_length.seconds,
            correlation_s: self.fitted.block_length.correlation_s.clone(),
            whiteness: self
                .whiteness
                .iter()
                .map(|log| log.iter().map(|w| w.as_ref().map(record)).collect())
                .collect(),
        }
    }

    pub(super) fn pruning_record(&self) -> Option<PruningRecord> {
        let found = self.pruning.as_ref()?;
        let table = &self.model.parameters().linear;
        let name = |column: &usize| table[self.base.kept[*column]].name.clone();
        let finite = |x: f64| x.is_finite().then_some(x);
        let size = |index: usize| found.path[index].columns.len();
        Some(PruningRecord {
            path: found
                .path
                .iter()
                .map(|step| PruningStep {
                    parameters: step.columns.len(),
                    next: name(&step.weakest),
                    statistic: finite(step.statistic),
                    rss: step.rss,
                    bic: finite(step.bic),
                    held_out: step.held_out.as_ref().map(|h| h.mean),
                    held_out_standard_error: step.held_out.as_ref().map(|h| h.standard_error),
                })
                .collect(),
            essential: found.chosen.map(size),
            essential_parameters: found
                .chosen
                .map_or_else(Vec::new, |index| found.path[index].columns.iter().map(name).collect()),
            least_bic: size(found.least_bic),
            all_significant: found.all_significant.map(size),
            threshold: found.threshold,
        })
    }
}
