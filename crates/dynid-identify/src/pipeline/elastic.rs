//! Doubts about motions of elastic joints.

use dynid_model::{EffortModel, MotionBlock, RobotModel};
use dynid_rows::conditioning::PreparedLog;

use crate::caution::{self, Caution};
use crate::input_record::short_name;
use crate::joint_stiffness::REMEDY;

/// Springs whose parameters a log tells little of.
pub(super) fn warnings(model: &RobotModel, logs: &[PreparedLog]) -> Vec<Caution> {
    let nothing = vec![0.0; model.parameters().linear.len()];
    let springs: Vec<_> =
        model.elastic_transmissions(&nothing).into_iter().map(|(spring, _)| spring).collect();
    let mut out = Vec::new();
    for log in logs.iter().filter(|_| !springs.is_empty()) {
        let still = vec![0.0; log.position.len() * log.samples()];
        let positions = log.position.concat();
        let motion = MotionBlock::plain(log.samples(), &positions, &still, &still);
        for spring in springs.iter().filter(|spring| log.moves[spring.link]) {
            if let Some(doubt) = spring.doubt(model.joints(), &motion) {
                let joint = &model.joints()[spring.link].name;
                let message = format!("{}: joint `{joint}`: {doubt}", short_name(&log.name));
                out.push(Caution::warn(caution::SPRING, message, REMEDY));
            }
        }
    }
    out
}
