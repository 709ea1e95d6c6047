//! How far values can be trusted, as the report shows it.

use dynid_estimate::consistent::ActiveConstraint;
use dynid_model::{EffortModel, Owner};
use dynid_report as report;

use super::Shown;
use crate::estimate::short_name;
use crate::estimate::{ConsistencyRecord, Estimate, ParameterValue};

impl Shown<'_> {
    pub(super) fn consistency_report(&self, estimate: &Estimate) -> Option<report::Consistency> {
        let record = estimate.consistency.as_ref()?;
        let active = self.consistent.estimate.as_ref().map_or(&[][..], |e| &e.active);
        Some(report::Consistency {
            form: Some(record.form),
            status: Some(record.status),
            price: Some(record.price),
            price_over_chance: record.price_over_chance,
            prior_weight: Some(record.prior_weight),
            gap: Some(record.gap),
            least_eigenvalue: record.least_eigenvalue,
            limits: active.iter().map(|a| self.limit(a)).collect(),
            validation: validation_prices(estimate, record),
        })
    }

    /// A constraint under the name of the link or joint it acts on.
    fn limit(&self, active: &ActiveConstraint) -> report::Limit {
        let text = active.to_string();
        let name = active.name();
        let (owner, owner_kind) = match active {
            ActiveConstraint::AtBound { .. } => (String::new(), report::OwnerKind::Link),
            ActiveConstraint::AtZero { .. } => {
                let table = self.model.parameters();
                match table.linear.iter().find(|p| p.name == name).map(|p| &p.owner) {
                    Some(Owner::Joint(joint)) => (joint.clone(), report::OwnerKind::Joint),
                    Some(Owner::Link(link)) => (link.clone(), report::OwnerKind::Link),
                    None => (String::new(), report::OwnerKind::Link),
                }
            }
            ActiveConstraint::Flat { .. }
            | ActiveConstraint::Massless { .. }
            | ActiveConstraint::Singular { .. } => (name.to_owned(), report::OwnerKind::Link),
        };
        let text = match active {
            ActiveConstraint::AtZero { .. } => {
                format!("{} at its lower limit", name.rsplit('.').next().unwrap_or(name))
            }
            _ => text.strip_prefix(&format!("link `{owner}`: ")).unwrap_or(&text).to_owned(),
        };
        report::Limit { owner, owner_kind, text }
    }

    /// Whether the value of a parameter itself is held by a limit, and not just its link's inertia as a whole.
    fn held(&self, p: &ParameterValue) -> bool {
        let active = self.consistent.estimate.as_ref().map_or(&[][..], |e| &e.active);
        let at_zero = active
            .iter()
            .any(|a| matches!(a, ActiveConstraint::AtZero { parameter } if *parameter == p.name));
        // A limit on the link is told at its head; of its parameters only those with a deviation can be compared with it.
        at_zero || (p.at_boundary && p.std.is_some())
    }

    pub(super) fn standard_parameters(&self, estimate: &Estimate) -> Vec<report::StandardParameter> {
        let row = |p: &ParameterValue| report::StandardParameter {
            owner: p.link.clone().or_else(|| p.joint.clone()).unwrap_or_default(),
            owner_kind: match p.link {
                Some(_) => report::OwnerKind::Link,
                None => report::OwnerKind::Joint,
            },
            name: p.name.rsplit('.').next().unwrap_or(&p.name).to_owned(),
            unit: p.unit.clone(),
            value: Some(p.value),
            unconstrained: p.unconstrained,
            interval: p.interval.map(|(low, high)| [low, high]),
            prior: p.prior,
            verdict: Some(p.verdict),
            reason: p.reason,
            share: p.share,
            possible_share: p.possible_share,
            wide: p.wide,
            at_boundary: self.held(p),
            combination: p.combination.clone().unwrap_or_default(),
            advice: p.advice.clone().unwrap_or_default(),
            tie: p.tie.clone().unwrap_or_default(),
        };
        estimate.parameters.iter().map(row).collect()
    }

    pub(super) fn precision_report(&self, estimate: &Estimate) -> report::Precision {
        let record = &estimate.precision;
        report::Precision {
            variance_inflation: Some(record.variance_inflation),
            variance_inflation_per_joint: record.variance_inflation_per_joint.clone(),
            basis: record.basis,
            blocks: Some(record.blocks as u64),
            block_s: Some(record.block_s),
            wanted_block_s: Some(record.wanted_block_s),
            robust: self.fitted.is_robust(),
            whiteness: record
                .whiteness
                .iter()
                .zip(&self.training)
                .map(|(joints, log)| report::LogWhiteness {
                    log: short_name(&log.name),
                    joints: joints
                        .iter()
                        .map(|w| {
                            w.as_ref().map(|w| report::Whiteness {
                                distance: w.distance,
                                threshold: w.threshold,
                                rejected: w.rejected,
                                dominant_hz: w.dominant_hz,
                            })
                        })
                        .collect(),
                })
                .collect(),
        }
    }
}

/// Errors of the validation logs with and without constraints.
fn validation_prices(estimate: &Estimate, record: &ConsistencyRecord) -> Vec<report::ValidationPrice> {
    let logs = estimate.validation.iter().zip(&record.validation_unconstrained);
    logs.map(|(consistent, free)| report::ValidationPrice {
        log: short_name(&consistent.log),
        free_percent: free.filtered.relative_error,
        consistent_percent: consistent.filtered.relative_error,
    })
    .collect()
}

pub(super) fn base_parameters(estimate: &Estimate) -> Vec<report::BaseParameter> {
    estimate
        .base_parameters
        .iter()
        .map(|b| report::BaseParameter {
            name: b.name.clone(),
            expression: b.expression.clone(),
            unit: b.unit.clone(),
            value: b.value,
            std: b.std,
            half_width: b.half_width,
            relative_std_percent: b.rel_std,
            consistent_value: b.consistent_value,
            verdict: b.verdict,
            share: b.share,
        })
        .collect()
}

pub(super) fn held_out(estimate: &Estimate) -> report::HeldOut {
    let record = &estimate.held_out;
    report::HeldOut {
        folds: record.folds as u64,
        // Robots that are held out tell of all joints together.
        joints: (record.rms.iter().filter(|_| record.rms.iter().any(Option::is_some)))
            .zip(&record.rms_standard_error)
            .zip(&record.rms_consistent)
            .map(|((free, standard_error), consistent)| report::HeldOutJoint {
                free: *free,
                standard_error: *standard_error,
                consistent: *consistent,
            })
            .collect(),
        free_percent: record.relative_error,
        consistent_percent: record.relative_error_consistent,
    }
}

pub(super) fn pruning(estimate: &Estimate) -> Option<report::Pruning> {
    let record = estimate.pruning.as_ref()?;
    Some(report::Pruning {
        path: record
            .path
            .iter()
            .map(|s| report::PruningStep {
                parameters: s.parameters as u64,
                next: s.next.clone(),
                statistic: s.statistic,
                bic: s.bic,
                held_out: s.held_out,
                held_out_standard_error: s.held_out_standard_error,
            })
            .collect(),
        essential: record.essential.map(|n| n as u64),
        essential_parameters: record.essential_parameters.clone(),
        least_bic: Some(record.least_bic as u64),
        all_significant: record.all_significant.map(|n| n as u64),
        threshold: Some(record.threshold),
    })
}
