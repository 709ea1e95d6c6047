//! Whether a closed mechanism can be where the drives of a log say.

use dynid_model::closed::PoseWorkspace;
use dynid_model::{ClosedModel, MotionBlock, PathError};
use dynid_motion::Log;

use crate::Error;

/// Poses per log whose nearness to a singular one is measured.
const MEASURED: usize = 500;
/// Measure of singularity below which a log deserves a warning.
const NEAR: f64 = 1e-2;

fn visit(model: &ClosedModel, log: &Log, see: impl FnMut(usize, &PoseWorkspace)) -> Result<(), PathError> {
    let positions: Vec<f64> = log.joints().iter().flat_map(|j| j.position.iter().copied()).collect();
    let still = vec![0.0; positions.len()];
    model.follow(&MotionBlock::plain(log.time().len(), &positions, &still, &still), see)
}

/// Follows all poses of a log.
///
/// # Errors
/// [`Error::Pose`] at the first row whose pose is out of reach, singular, or of another assembly mode.
pub fn follow(model: &ClosedModel, log: &Log) -> Result<(), Error> {
    visit(model, log, |_, _| ()).map_err(|e| Error::Pose {
        file: log.name().to_owned(),
        row: e.sample + 1,
        fault: Box::new(e.fault),
    })
}

/// A warning if some pose of a log comes close to a singular one.
pub fn nearest_singularity(model: &ClosedModel, log: &Log) -> Option<String> {
    let step = log.time().len().div_ceil(MEASURED).max(1);
    let mut nearest: Option<(usize, f64, String)> = None;
    let result = visit(model, log, |sample, pose| {
        if sample % step != 0 {
            return;
        }
        let found = model.machine().singularity(pose);
        if nearest.as_ref().is_none_or(|(_, least, _)| found.measure < *least) {
            nearest = Some((sample, found.measure, found.motion.to_string()));
        }
    });
    let (sample, measure, motion) = nearest.filter(|(_, measure, _)| result.is_ok() && *measure < NEAR)?;
    Some(format!(
        "{}: near row {} the mechanism comes close to a singular pose (measure {measure:.1e}), where its drives hardly control {motion}: errors of efforts grow there",
        log.name(),
        sample + 1
    ))
}
