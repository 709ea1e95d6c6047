//! Robot files beside the model on the page.

use dynid_model::EffortModel;
use dynid_report::{FileJoint, FileJudgement, FileLoss};

use super::Shown;
use crate::estimate::short_name;
use crate::estimate::{EXPORT_LOSS_LIMIT, Estimate, FileFit};

impl Shown<'_> {
    /// Robot files on the log that they are judged on; `None` where files do not hold the efforts.
    pub(super) fn file_judgement(&self, estimate: &Estimate) -> Option<FileJudgement> {
        let record = &estimate.exported;
        let log = record.judged()?;
        let model = estimate.validation.iter().find(|f| f.log == log.log).map(|f| &f.filtered);
        let trained = self.training.iter().find(|a| a.name == log.log);
        let model_error = |j: usize| match (model, trained) {
            (Some(fit), _) => fit.relative_error_per_joint[j],
            (None, Some(agreement)) => agreement.filtered.channels[j].relative_error,
            (None, None) => None,
        };
        let loss = |fit: &FileFit, j: usize| FileLoss {
            error_percent: fit.relative_error_per_joint[j],
            loss: Some(fit.loss[j]),
            loss_percent: fit.loss_percent[j],
        };
        let joint = |(j, output): (usize, &dynid_model::Output)| {
            let stated = record.joints.iter().find(|s| s.joint == output.name);
            FileJoint {
                joint: output.name.clone(),
                effort_unit: output.unit.to_owned(),
                friction_loss: stated.map(|s| s.friction_loss),
                damping: stated.map(|s| s.damping),
                rotor_inertia: stated.map(|s| s.rotor_inertia),
                projected: record.projections.iter().any(|p| p.joint == output.name),
                model_percent: model_error(j),
                with_rotor: loss(&log.mjcf, j),
                urdf: loss(&log.urdf, j),
            }
        };
        Some(FileJudgement {
            log: short_name(&log.log),
            limit_percent: EXPORT_LOSS_LIMIT,
            joints: self.model.outputs().iter().enumerate().map(joint).collect(),
            model_percent: model
                .and_then(|fit| fit.relative_error)
                .or(trained.and_then(|a| a.filtered.relative_error)),
            with_rotor_percent: log.mjcf.relative_error,
            urdf_percent: log.urdf.relative_error,
        })
    }
}
