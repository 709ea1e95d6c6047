//! Least squares against instruments, for the result file.

use dynid_estimate::instruments::{ExogeneityVerdict, IterationEnd};
use dynid_model::EffortModel;

use crate::closed_loop::{LoopRun, Mismatch};
use crate::estimate::{BiasVerdict, EffectRecord, ExogeneityRecord, InstrumentEnd, InstrumentRecord};
use crate::identification::Identification;
use crate::verdict;

impl Identification {
    pub(super) fn exogeneity_record(&self) -> Option<ExogeneityRecord> {
        let comparison = self.comparison.as_ref()?;
        let found = comparison.exogeneity.as_ref();
        let parameter = |column: usize| &self.model.parameters().linear[self.base.kept[column]];
        let verdict = match (found.map(|f| f.verdict), comparison.diverged()) {
            (_, Some(_)) => BiasVerdict::Diverged,
            (None, None) => BiasVerdict::Undetermined,
            (Some(ExogeneityVerdict::Exogenous), None) => BiasVerdict::Exogenous,
            (Some(ExogeneityVerdict::Harmless), None) => BiasVerdict::Harmless,
            (Some(ExogeneityVerdict::Material), None) => BiasVerdict::Material,
            (Some(ExogeneityVerdict::Weak), None) => BiasVerdict::Weak,
        };
        let effects = found.iter().flat_map(|f| f.effects.iter().zip(&f.unexplained));
        Some(ExogeneityRecord {
            verdict,
            summary: verdict::closed_loop_bias_in_words(self)?,
            p_value: found.and_then(|f| f.robust).map(|t| t.p_value),
            p_value_independent: found.and_then(|f| f.naive).map(|t| t.p_value),
            blocks: found.map(|f| f.blocks),
            tested: found.iter().flat_map(|f| &f.tested).map(|c| parameter(*c).name.clone()).collect(),
            instrument_strength: found.map(|f| f.least_cosine),
            rounds: [comparison.halves[0].rounds, comparison.halves[1].rounds],
            distance: comparison.diverged().and_then(distance),
            parameters: effects
                .map(|(effect, unexplained)| EffectRecord {
                    name: parameter(effect.column).name.clone(),
                    unit: parameter(effect.column).unit.to_owned(),
                    least_squares: effect.least_squares,
                    instruments: effect.instruments,
                    std_least_squares: effect.std.0,
                    std_instruments: effect.std.1,
                    difference: effect.difference(),
                    limit: effect.limit,
                    unexplained: *unexplained,
                })
                .collect(),
            fit: self.simulations.as_ref().map(|run| InstrumentRecord {
                residual_ratio: Mismatch::worst(&run.mismatch).map(|m| m.of_residual),
                effort_share: Mismatch::worst(&run.mismatch).map(|m| m.of_effort),
                rounds: run.rounds,
                end: match run.end {
                    IterationEnd::Settled => InstrumentEnd::Settled,
                    IterationEnd::Limit => InstrumentEnd::Limit,
                    IterationEnd::Diverged { .. } => InstrumentEnd::Diverged,
                },
                last_change: run.last_change,
                strength: run.strength.map(|(_, cosine)| cosine),
            }),
        })
    }
}

/// How far a simulation was off its reference when it diverged.
fn distance(run: &LoopRun) -> Option<f64> {
    match run.end {
        IterationEnd::Diverged { distance, .. } => Some(distance).filter(|d| d.is_finite()),
        _ => None,
    }
}
