//! Virtual logs of a controlled robot.

use std::sync::Arc;

use dynid_identify::Error;
use dynid_model::{EffortModel, RobotModel};
use dynid_sim::streams::{Cause, generator, normal};
use dynid_sim::{
    ClosedPlant, ControlSettings, ExperimentSettings, Imperfections, Plant, Profile, Wanted, run, run_closed,
    run_with_clearance, wrong_model,
};

use super::clearance;
use super::elastic::{Follower, undamped};
use super::settings::SimulateSettings;
use super::trajectory::Reference;
use super::{ExperimentSummary, SimulatedLog, named};

/// Least control rate that is chosen where none is stated, Hz.
const LEAST_CONTROL_RATE: f64 = 1000.0;

/// `with_clearance`: bodies with translations of the journals, all elements and contacts, for robots whose joints have clearance.
pub(super) fn experiment(
    (model, with_clearance): (RobotModel, Option<RobotModel>),
    reference: &Reference,
    values: Vec<f64>,
    channels: Vec<Profile>,
    settings: &SimulateSettings,
) -> Result<SimulatedLog, Error> {
    let model = Arc::new(model);
    let table = settings.control.clone().unwrap_or_default();
    let plant_table = settings.plant.clone().unwrap_or_default();
    if !(0.0..=1.0).contains(&table.model_error) {
        return Err(Error::setting("control.model_error", "0 to 1", table.model_error));
    }
    let (shape, joints) = (model.parameters().shape_start(), names(&model));
    let believed = wrong_model(&values, table.model_error, settings.seed);
    let experiment = ExperimentSettings {
        duration_s: settings.duration_s,
        log_rate_hz: settings.rate_hz,
        tolerance: plant_table.tolerance,
        control: control(&model, &table, settings.rate_hz)?,
        imperfections: imperfections(settings, &joints)?,
        channels,
        seed: settings.seed,
    };
    let wanted = |time: f64| -> Vec<Wanted> { reference.at(time) };
    let (mut sensors, mut journals, mut parameters) = (Vec::new(), None, Vec::new());
    let result = if !model.coordinates().is_empty() {
        let springs = undamped(&model, &believed);
        let follower = Follower::new(&model, &springs, &shape, reference, &experiment.channels)?;
        let plant = |values| Plant::new(model.clone(), values, shape.clone(), plant_table.sign_width);
        let nominal = plant(believed.clone())?;
        let ran = run(&mut plant(values.clone())?, &nominal, &|time| follower.at(time), &experiment);
        match follower.fault() {
            Some(fault) => return Err(fault.into()),
            None => ran?,
        }
    } else if let Some(contacts) = with_clearance {
        let linear = clearance::linear(&contacts, &model, &values);
        parameters = clearance::contact_parameters(&contacts, &linear);
        let width = plant_table.sign_width;
        let plant = Plant::new(contacts, linear, shape.clone(), width)?;
        let nominal = Plant::new(model.clone(), believed, shape, width)?;
        sensors = dynid_sim::clearance::sensors(&plant);
        let (result, record) = run_with_clearance(plant, &nominal, &wanted, &experiment)?;
        journals = Some(record);
        result
    } else if model.with_reactions().is_some() {
        let plant = |values| ClosedPlant::new(model.clone(), values, shape.clone(), plant_table.sign_width);
        run_closed(&mut plant(values.clone())?, &plant(believed)?, &wanted, &experiment)?
    } else {
        let plant = |values| Plant::new(model.clone(), values, shape.clone(), plant_table.sign_width);
        run(&mut plant(values.clone())?, &plant(believed)?, &wanted, &experiment)?
    };
    let log = result.log;
    let names_of_channels = model.channels().iter().chain(&sensors).cloned();
    let clean_channels: Vec<(String, Vec<f64>)> = names_of_channels.zip(log.channels).collect();
    let mut noise = generator(settings.seed, Cause::Journals);
    let channels: Vec<(String, Vec<f64>)> = clean_channels
        .iter()
        .map(|(name, values)| match clearance::is_offset(name, &model) {
            true => {
                let noisy = |x: &f64| x + settings.journal_noise * normal(&mut noise);
                (name.clone(), values.iter().map(noisy).collect())
            }
            false => (name.clone(), values.clone()),
        })
        .collect();
    let journals = journals.map(|record| clearance::summary(record, 0.0, None));
    let warnings = journals.iter().flat_map(|s| s.warnings(settings.rate_hz)).collect();
    let mut truth = named(&model, values);
    truth.extend(parameters);
    Ok(SimulatedLog {
        joints,
        undriven: (0..model.outputs().len()).map(|output| model.is_undriven(output)).collect(),
        time: log.time,
        command: None,
        position: log.position,
        velocity: settings.log_velocity.then_some(log.velocity),
        effort: log.effort,
        channels,
        clean_channels,
        clean: [log.truth.q, log.truth.dq, log.truth.ddq, log.truth.effort],
        truth,
        experiment: Some(ExperimentSummary {
            imperfections: result.imperfections,
            ripple: result.ripple,
            energy: result.energy,
            integration: result.integration,
            ticks: result.ticks,
            saturated_ticks: result.saturated_ticks,
            dropped_rows: log.dropped_rows,
            sign_width: plant_table.sign_width,
        }),
        clearance: journals,
        warnings,
    })
}

fn names(model: &RobotModel) -> Vec<String> {
    model.joints().iter().map(|j| j.name.clone()).collect()
}

fn control(
    model: &RobotModel,
    table: &super::ControlTable,
    log_rate_hz: f64,
) -> Result<ControlSettings, Error> {
    let joints = names(model);
    let passive = table
        .passive
        .iter()
        .map(|name| {
            let known = || Error::UnknownJoint { name: name.clone(), known: joints.clone() };
            joints.iter().position(|j| j == name).ok_or_else(known)
        })
        .collect::<Result<_, _>>()?;
    Ok(ControlSettings {
        rate_hz: table.rate_hz.unwrap_or(log_rate_hz * (LEAST_CONTROL_RATE / log_rate_hz).ceil().max(1.0)),
        bandwidth_hz: table.bandwidth_hz,
        damping: table.damping,
        position_gain: table.position_gain.clone(),
        velocity_gain: table.velocity_gain.clone(),
        feed_forward: table.feed_forward,
        velocity_cutoff_hz: table.velocity_cutoff_hz,
        delay_ticks: table.delay_ticks,
        effort_limit: (!table.effort_limits).then(|| vec![f64::INFINITY; joints.len()]),
        passive,
    })
}

fn imperfections(settings: &SimulateSettings, joints: &[String]) -> Result<Imperfections, Error> {
    if settings.perfect {
        return Ok(Imperfections::none());
    }
    let table = settings.imperfections.clone().unwrap_or_default();
    let noise = table.effort_noise_absolute.not_negative("imperfections.effort_noise_absolute", joints)?;
    Ok(Imperfections {
        encoder_bits: settings.encoder_bits,
        encoder_noise: table.encoder_noise,
        joint_encoder_noise: Vec::new(),
        velocity_noise: table.velocity_noise,
        effort_noise_share: settings.effort_noise,
        effort_noise: noise.into_iter().map(|x| x.unwrap_or(0.0)).collect(),
        ripple_share: table.ripple_share,
        ripple_cycles: table.ripple_cycles,
        ripple: None,
        effort_delay_samples: settings.delay_samples.unwrap_or(Imperfections::default().effort_delay_samples),
        outlier_share: table.outlier_share,
        outlier_size: table.outlier_size,
        dropped_share: table.dropped_share,
        clock_jitter_s: table.clock_jitter_s,
    })
}
