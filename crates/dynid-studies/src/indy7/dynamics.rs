//! Rows 1 to 3: dynamics, base parameters, friction and filter against an independent implementation.

use dynid::model::element::{Coulomb, JointElement, Offset, RotorInertia, Viscous};
use dynid::model::{
    BaseParameters, BaseSettings, EffortModel, History, MotionBlock, RegressorBlock, RobotModel,
};
use dynid::motion::filter::{butterworth, forward_backward};
use dynid::motion::trajectory::{Point, Trajectory};
use serde_json::json;

use super::experiment::trajectory;
use super::reference;
use super::robot::{Indy7, rigid};
use super::settings::Settings;
use super::{JOINTS, excitation, fault};
use crate::reference::pose_error;
use crate::{Row, StudyError};

pub(super) fn rows(arm: &Indy7, settings: &Settings) -> Result<Vec<Row>, StudyError> {
    Ok(vec![efforts(arm)?, base_parameters(arm)?, friction_and_filter(arm, settings)?])
}

fn efforts(arm: &Indy7) -> Result<Row, StudyError> {
    let reference = reference::dynamics()?;
    let standard = reference::standard(&reference.phi_standard);
    let model = rigid(&arm.mechanism);
    let without = RobotModel::new(arm.mechanism.clone(), Vec::new());
    let mut worst = [0.0_f64; 3];
    for state in &reference.states {
        let block = MotionBlock::plain(1, &state.q, &state.qd, &state.qdd);
        for (model, wanted) in [(&model, &state.tau), (&without, &state.tau_without_rotor)] {
            let mut effort = [0.0; JOINTS];
            let linear = &standard[..model.parameters().linear.len()];
            model.efforts(&block, &[], linear, 1, &mut effort);
            for (own, wanted) in effort.iter().zip(wanted) {
                worst[0] = worst[0].max((own - wanted).abs());
            }
        }
        for (row, wanted) in state.regressor_6x66.iter().flatten().enumerate() {
            let mut rows = RegressorBlock::new(model.layout().clone(), 1);
            model.regressor(&block, &[], &mut rows);
            for (k, wanted) in wanted.iter().enumerate() {
                let mut unit = vec![0.0; 11 * JOINTS];
                unit[reference::column(k)] = 1.0;
                worst[1] = worst[1].max((rows.effort(row, &unit)[0] - wanted).abs());
            }
        }
        worst[2] = worst[2].max(pose_error(&arm.mechanism, &block, &state.rotation, &state.position));
    }
    Ok(Row::new(
        "1",
        "Torque with and without rotors, regressor and pose of frame 6 at six states agree with an independent implementation",
        "1e-9",
        json!({ "torque": worst[0], "regressor": worst[1], "pose": worst[2] }),
        format!("{:.1e} N m, {:.1e}, {:.1e}", worst[0], worst[1], worst[2]),
        worst.iter().all(|w| *w <= 1e-9),
    ))
}

fn base_parameters(arm: &Indy7) -> Result<Row, StudyError> {
    let reference = reference::base()?;
    let model = rigid(&arm.mechanism);
    let base = BaseParameters::of(&model, &arm.mechanism, &[], &BaseSettings::default());
    let table = &model.parameters().linear;
    let mut grouping = 0.0_f64;
    for k in 0..11 * JOINTS {
        let mut unit = vec![0.0; 11 * JOINTS];
        unit[reference::column(k)] = 1.0;
        for (own, row) in arm.base_values(&unit).iter().zip(&reference.grouping_matrix) {
            grouping = grouping.max((own - row[k]).abs());
        }
    }
    let same = base.len() == reference.independent.len()
        && base.kept.iter().all(|c| reference.independent.contains(&table[*c].symbol));
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for rate in 0..JOINTS {
        elements.push(Box::new(RotorInertia { rate }));
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(Offset { rate }));
    }
    let whole = RobotModel::new(arm.mechanism.clone(), elements);
    let whole = BaseParameters::of(&whole, &arm.mechanism, &[], &BaseSettings::default());
    Ok(Row::new(
        "2",
        "66 standard parameters reduce to the 40 inertial rows of Table A1, 58 with three friction columns a joint, regrouped alike",
        "exactly 40 and 58, the same list, grouping matrix 1e-9",
        json!({ "rank": base.len(), "rank_with_friction": whole.len(), "same_list": same, "grouping": grouping }),
        format!(
            "{} and {}, {} list, {grouping:.1e}",
            base.len(),
            whole.len(),
            if same { "the same" } else { "another" }
        ),
        base.len() == 40 && whole.len() == 58 && same && grouping <= 1e-9,
    ))
}

fn friction_and_filter(arm: &Indy7, settings: &Settings) -> Result<Row, StudyError> {
    let reference = reference::friction()?;
    let mut friction = arm.linear.clone();
    friction[..10 * JOINTS].fill(0.0);
    let (mut steady, mut sequence) = (0.0_f64, 0.0_f64);
    for case in &reference.steady {
        let dq = [case.qd; JOINTS];
        let effort = friction_efforts(arm, &friction, &dq, case.temperature, None);
        for (own, wanted) in effort.iter().zip(&case.tau_f) {
            steady = steady.max((own - wanted).abs());
        }
    }
    let lugre = &reference.lugre;
    let dq = reference::transposed(&lugre.qd);
    let effort = friction_efforts(arm, &friction, &dq, lugre.temperature, Some(lugre.dt));
    for (own, wanted) in effort.iter().zip(reference::transposed(&lugre.tau_f)) {
        sequence = sequence.max((own - wanted).abs());
    }

    let filter = reference::filter()?;
    let low_pass = butterworth(4, settings.simulation.cutoff_hz, 1000.0).map_err(fault)?;
    let output = forward_backward(&low_pass, &filter.input).map_err(fault)?;
    let inside = filter.compare_from..filter.compare_to;
    let filtered = inside.map(|n| (output[n] - filter.output[n]).abs()).fold(0.0, f64::max);

    let motion = reference::trajectory()?;
    let series = trajectory(&settings.trajectories.excitation)?;
    let mut states = 0.0_f64;
    let mut points = vec![Point::default(); JOINTS];
    for sample in &motion.samples {
        series.at(sample.t, &mut points);
        for (j, p) in points.iter().enumerate() {
            for (own, wanted) in
                [(p.position, sample.q[j]), (p.velocity, sample.qd[j]), (p.acceleration, sample.qdd[j])]
            {
                states = states.max((own - wanted).abs());
            }
        }
    }
    let conditions = excitation::conditions(arm, settings, &excitation::plain_rows(settings)?)?;
    let relative = (conditions[0] / motion.condition_58 - 1.0)
        .abs()
        .max((conditions[1] / motion.condition_40 - 1.0).abs());
    Ok(Row::new(
        "3",
        "Steady friction, LuGre sequence, zero-phase filter, reference trajectory and its condition numbers agree",
        "1e-9 N m, 1e-9 N m, 1e-6, 1e-9, 1e-6 relative",
        json!({
            "steady": steady, "sequence": sequence, "filter": filtered,
            "trajectory": states, "condition_relative": relative,
        }),
        format!("{steady:.1e}, {sequence:.1e} N m, {filtered:.1e}, {states:.1e}, {relative:.1e}"),
        steady <= 1e-9 && sequence <= 1e-9 && filtered <= 1e-6 && states <= 1e-9 && relative <= 1e-6,
    ))
}

/// Friction torque for velocities, joint after joint; of the record before too where a step is given.
fn friction_efforts(
    arm: &Indy7,
    linear: &[f64],
    dq: &[f64],
    temperature: f64,
    step: Option<f64>,
) -> Vec<f64> {
    let samples = dq.len() / JOINTS;
    let model = arm.model.as_ref();
    let zero = vec![0.0; dq.len()];
    let warm = vec![temperature; samples];
    let mut channels: Vec<(&str, &[f64])> =
        model.channels().iter().map(|name| (name.as_str(), warm.as_slice())).collect();
    let plain = MotionBlock::plain(samples, &zero, dq, &zero);
    let mut signals = vec![0.0; model.signals().len() * samples];
    if let Some(step) = step {
        let history = &mut History::default();
        model.remember(&plain, step, &[], history, samples, &mut signals);
        let named = model.signals().iter().zip(signals.chunks_exact(samples));
        channels.extend(named.map(|(name, values)| (name.as_str(), values)));
    }
    let mut effort = vec![0.0; dq.len()];
    model.efforts(&MotionBlock { channels: &channels, ..plain }, &[], linear, samples, &mut effort);
    effort
}
