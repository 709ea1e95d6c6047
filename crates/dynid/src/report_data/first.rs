//! The first screen: cautions, counts, the log that the result is judged by, the robot in its pose.

use dynid_model::EffortModel;
use dynid_report as report;
use dynid_report::{RobotPicture, Value};

use super::Shown;
use crate::Error;
use crate::agreement::Agreement;
use crate::estimate::Estimate;
use crate::estimate::short_name;

/// What the first figure leaves out of a prediction; below the curves of all joints it is told at length.
const BRIEFLY: &str = " Where the joint stands, friction of velocity is left out of the predicted curve.";

/// Cautions of the result file with the numbers of their checks.
pub(super) fn cautions(estimate: &Estimate) -> Vec<report::Caution> {
    let of = |caution: &crate::caution::Caution| {
        let check = estimate.verdict.checks.iter().find(|c| c.name.word() == caution.name);
        report::Caution {
            status: caution.status,
            name: caution.name.clone(),
            value: check.and_then(|c| c.value).map_or(Value::Undefined, Value::Number),
            unit: check.map(|c| c.unit.clone()).unwrap_or_default(),
            limit: check.map(|c| c.limit.clone()).unwrap_or_default(),
            message: caution.message.clone(),
            remedy: caution.remedy.clone(),
        }
    };
    estimate.verdict.cautions.iter().map(of).collect()
}

/// Counts of the result file.
pub(super) fn counts(estimate: &Estimate) -> report::Counts {
    let of = &estimate.counts;
    report::Counts {
        base: of.base.all as u64,
        base_excited: of.base.excited as u64,
        base_seen: of.base.seen as u64,
        standard: of.standard.all as u64,
        standard_seen: of.standard.seen as u64,
        standard_carried: of.standard.carried as u64,
        standard_not_identifiable: of.standard.not_identifiable as u64,
        standard_given: of.standard.given as u64,
        shape: of.shape.all as u64,
        shape_seen: of.shape.seen as u64,
    }
}

impl Shown<'_> {
    /// The log that the verdict speaks of, the worst predicted one that the model has not seen, else of the training logs; and
    /// the joint that is predicted worst on it.
    pub(super) fn judged(&self) -> Result<Option<report::Judged>, Error> {
        let unseen = self.unseen();
        let candidates: Vec<&Agreement> =
            if unseen.is_empty() { self.training.iter().collect() } else { unseen.clone() };
        let error = |a: &Agreement| a.filtered.relative_error.unwrap_or(f64::INFINITY);
        let Some(worst) = candidates.iter().copied().max_by(|a, b| error(a).total_cmp(&error(b))) else {
            return Ok(None);
        };
        let mut logs = self.training.iter().chain(&self.validation);
        let Some(log) = logs.position(|a| std::ptr::eq(a, worst)) else { return Ok(None) };
        let Some((joint, why)) = self.drawn_joint(worst) else { return Ok(None) };
        let [measured, predicted] = worst.in_band(joint)?;
        let steady = if worst.is_drawn_otherwise(joint) { BRIEFLY } else { "" };
        Ok(Some(report::Judged {
            log,
            unseen: !unseen.is_empty(),
            others: candidates.len() - 1,
            joint,
            why,
            time_s: (0..measured.len()).map(|s| worst.start + s as f64 / worst.rate_hz).collect(),
            measured,
            predicted,
            description: format!(
                "Both curves passed a zero-phase filter of {:.1} Hz.{steady}",
                worst.filter_hz
            ),
        }))
    }

    /// The joint that is predicted worst among those that move and that the model explains, else the worst of all.
    fn drawn_joint(&self, log: &Agreement) -> Option<(usize, String)> {
        let outputs = self.model.outputs();
        let error = |j: &usize| log.filtered.channels[*j].relative_error.filter(|e| e.is_finite());
        let worst = |joints: Vec<usize>| {
            joints.into_iter().filter_map(|j| Some((j, error(&j)?))).max_by(|a, b| a.1.total_cmp(&b.1))
        };
        let all: Vec<usize> = (0..outputs.len()).filter(|j| log.driven[*j]).collect();
        let fit: Vec<usize> = all.iter().copied().filter(|j| log.moves[*j] && self.explained[*j]).collect();
        if let Some((joint, error)) = worst(fit) {
            return Some((joint, format!("The joint that is predicted worst, {error:.2} % of its effort")));
        }
        worst(all)
            .map(|(joint, error)| (joint, format!("Predicted with an error of {error:.0} % of its effort")))
    }

    /// The robot in poses of the first training log.
    pub(super) fn picture(&self) -> Option<RobotPicture> {
        let log = self.logs.first()?;
        let time_s: Vec<f64> = (0..log.samples()).map(|s| log.start + s as f64 / log.rate_hz).collect();
        let position: Vec<&[f64]> = log.position.iter().map(Vec::as_slice).collect();
        super::picture(
            self.model.mechanism(),
            self.model.closed(),
            &time_s,
            &position,
            format!("Poses of {}", short_name(&log.name)),
        )
    }
}
