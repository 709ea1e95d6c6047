//! What robot files predict on the logs of an identification, beside the identified model.

use std::sync::Arc;

use dynid_identify::Error;
use dynid_identify::agreement::Agreement;
use dynid_identify::estimate::{ExportedJoint, ExportedLog, ExportedRecord, FileFit};
use dynid_identify::pipeline::Identification;
use dynid_model::{EffortModel, RobotModel};
use dynid_robots::mjcf::JointParameters;
use dynid_rows::conditioning::{PreparedLog, predict};
use rayon::prelude::*;

use super::joints::{self, Format};
use super::{CheckStates, FrictionProjection, Identified, projection, read_back};

/// What robot files of an identification state and lose, on its training and validation logs.
///
/// # Errors
/// Fails as [`dynid_identify::agreement::compare`] does.
pub fn exported(id: &Identification) -> Result<ExportedRecord, Error> {
    let (files, projections) = FileModels::of(id)?;
    let judged = |logs: &[PreparedLog], agreements: &[Agreement]| {
        let pairs = logs.iter().zip(agreements);
        let each = pairs.filter_map(|(log, agreement)| files.judge(id, log, agreement).transpose());
        each.collect::<Result<Vec<_>, Error>>()
    };
    let training = judged(&id.logs, &id.training)?;
    let validation = judged(&id.validation_logs, &id.validation)?;
    Ok(files.record(projections, training, validation))
}

/// Models of the files that an identification leaves.
#[derive(Debug)]
struct FileModels {
    joints: Vec<JointParameters>,
    /// With rotors: MJCF, or URDF with the printed rotor inertias added. `None` where files do not hold the mechanism's efforts (motors
    /// behind springs, loads that sensors measure).
    with_rotor: Option<(RobotModel, Vec<f64>)>,
    /// Without: URDF alone.
    without_rotor: Option<(RobotModel, Vec<f64>)>,
}

impl FileModels {
    /// Projects friction over the training logs and lays out what files state.
    ///
    /// # Errors
    /// [`Error::Conditioning`]: a log is too short for the state filter.
    fn of(id: &Identification) -> Result<(Self, Vec<FrictionProjection>), Error> {
        let identified = Identified::of(id);
        let (model, values) = (identified.model, identified.values);
        let bodies = model.mechanism().bodies().len();
        if bodies == 0 || !model.coordinates().is_empty() {
            let nothing = FileModels { joints: Vec::new(), with_rotor: None, without_rotor: None };
            return Ok((nothing, Vec::new()));
        }
        let states = CheckStates::logs(&id.logs, id.state_hz, &id.conditioning_settings)?;
        let known = |joint: &str| identified.known_friction.iter().any(|law| law.joint == joint);
        let projected = projection::project(model, values, known, &states);
        let joints = joints::split(&identified, Format::Mjcf, &projected).joints;
        let still: Vec<JointParameters> = joints
            .iter()
            .map(|p| JointParameters { armature: 0.0, stiffness: 0.0, spring_reference: 0.0, ..p.clone() })
            .collect();
        let file = |joints: &[JointParameters]| {
            read_back::with_joints(model.mechanism().clone(), values[..10 * bodies].to_vec(), joints, model)
                .unwrap_or_else(|fault| unreachable!("loops that closed before: {fault}"))
        };
        let (with_rotor, without_rotor) = (Some(file(&joints)), Some(file(&still)));
        Ok((FileModels { joints, with_rotor, without_rotor }, projected))
    }

    /// Figures on a log; `agreement` is that of the identified model.
    ///
    /// # Errors
    /// Fails as [`dynid_identify::agreement::compare`] does.
    fn judge(
        &self,
        id: &Identification,
        log: &PreparedLog,
        agreement: &Agreement,
    ) -> Result<Option<ExportedLog>, Error> {
        let (Some(with_rotor), Some(without_rotor)) = (&self.with_rotor, &self.without_rotor) else {
            return Ok(None);
        };
        let delay = id.delay_on(log);
        let run = |model: &RobotModel, values: &[f64]| {
            let shape = model.parameters().shape_start();
            predict(model, &shape, values, log, id.state_hz, delay, &id.conditioning_settings)
        };
        // Without terms of single logs the model was predicted already.
        let alone = match &id.alone {
            Some((model, values)) => run(model, values)?.into_iter().map(Arc::new).collect(),
            None => agreement.predicted.clone(),
        };
        let file = |(model, values): &(RobotModel, Vec<f64>)| -> Result<FileFit, Error> {
            // What the file loses of the robot; terms of single logs stay.
            let pairs = alone.par_iter().zip(run(model, values)?);
            agreement.without(pairs.map(|(a, f)| a.iter().zip(&f).map(|(a, f)| a - f).collect()))
        };
        Ok(Some(ExportedLog {
            log: log.name.clone(),
            filter_hz: agreement.filter_hz,
            mjcf: file(with_rotor)?,
            urdf: file(without_rotor)?,
        }))
    }

    /// The record, once all logs are judged.
    fn record(
        &self,
        projections: Vec<FrictionProjection>,
        training: Vec<ExportedLog>,
        validation: Vec<ExportedLog>,
    ) -> ExportedRecord {
        let joint = |p: &JointParameters| ExportedJoint {
            joint: p.joint.clone(),
            friction_loss: p.friction_loss,
            damping: p.damping,
            rotor_inertia: p.armature,
            stiffness: p.stiffness,
            spring_reference: p.spring_reference,
        };
        ExportedRecord { joints: self.joints.iter().map(joint).collect(), projections, training, validation }
    }
}
