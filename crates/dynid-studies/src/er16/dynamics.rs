//! Rows 1 and 2: dynamics, friction and base parameters against an independent implementation.

use dynid::model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use serde_json::json;

use super::arm::{Arm, INERTIAL, JOINTS, Place};
use super::reference::{self, StateReference};
use super::settings::Settings;
use crate::reference::{PARAMETER_ORDER, pose_error};
use crate::{Row, StudyError};

pub(super) fn rows(arm: &Arm, settings: &Settings) -> Result<[Row; 2], StudyError> {
    let reference = reference::dynamics()?;
    let truth: Vec<f64> = settings.unknowns.iter().map(|u| u.value).collect();
    let rigid: Vec<f64> =
        truth.iter().enumerate().map(|(k, x)| if k < INERTIAL { *x } else { 0.0 }).collect();
    let mut worst = [0.0_f64; 4];
    for state in &reference.states {
        let block = block(state);
        let rigid_effort = arm.efforts(&block, &rigid);
        let whole = arm.efforts(&block, &truth);
        let regressor = regressor(arm, &block);
        for j in 0..JOINTS {
            worst[0] = worst[0].max((rigid_effort[j] - state.tau_rigid[j]).abs());
            worst[1] = worst[1].max((whole[j] - rigid_effort[j] - state.friction[j]).abs());
            for (own, wanted) in regressor[j].iter().zip(&state.regressor_base_3x15[j]) {
                worst[2] = worst[2].max((own - wanted).abs());
            }
        }
        worst[3] = worst[3].max(pose_error(&arm.mechanism, &block, &state.rotation, &state.position));
    }
    let first = Row::new(
        "1",
        "Rigid torque, friction, regressor and pose of frame 3 at six states agree with an independent implementation",
        "1e-9",
        json!({ "torque": worst[0], "friction": worst[1], "regressor": worst[2], "pose": worst[3] }),
        format!("{:.1e} N m, {:.1e} N m, {:.1e}, {:.1e}", worst[0], worst[1], worst[2], worst[3]),
        worst.iter().all(|w| *w <= 1e-9),
    );

    let model = RobotModel::new(arm.mechanism.clone(), Vec::new());
    let base = BaseParameters::of(&model, &arm.mechanism, &[], &BaseSettings::default());
    let symbols: Vec<&str> =
        base.kept.iter().map(|c| model.parameters().linear[*c].symbol.as_str()).collect();
    let same = {
        let (mut own, mut wanted) = (symbols.clone(), reference.independent.clone());
        own.sort_unstable();
        wanted.sort_unstable();
        own == wanted
    };
    let grouping = if same { grouping_error(&base, &symbols, &reference) } else { f64::INFINITY };
    let second = Row::new(
        "2",
        "The 30 standard parameters reduce to the 15 base parameters of Table 3, regrouped alike",
        "rank 15, the same list, grouping matrix 1e-9",
        json!({ "rank": base.len(), "same_list": same, "grouping": grouping }),
        format!("rank {}, {} list, {grouping:.1e}", base.len(), if same { "the same" } else { "another" }),
        base.len() == INERTIAL && same && grouping <= 1e-9,
    );
    Ok([first, second])
}

fn block(state: &StateReference) -> MotionBlock<'_> {
    MotionBlock::plain(1, &state.q, &state.qd, &state.qdd)
}

/// Base columns of the inertial unknowns in the paper's order, one row per joint.
fn regressor(arm: &Arm, block: &MotionBlock<'_>) -> Vec<Vec<f64>> {
    let mut rows = RegressorBlock::new(arm.model.layout().clone(), 1);
    arm.model.regressor(block, &arm.shape, &mut rows);
    (0..JOINTS)
        .map(|j| {
            let column = |place: &Place| {
                let mut unit = vec![0.0; arm.base.len()];
                if let Place::Base(k) = place {
                    unit[*k] = 1.0;
                }
                rows.effort(j, &arm.base.expanded(&unit))[0]
            };
            arm.places[..INERTIAL].iter().map(column).collect()
        })
        .collect()
}

fn grouping_error(base: &BaseParameters, symbols: &[&str], reference: &reference::DynamicsReference) -> f64 {
    let mut worst = 0.0_f64;
    for link in 0..JOINTS {
        for (k, own) in PARAMETER_ORDER.iter().enumerate() {
            let mut unit = vec![0.0; 10 * JOINTS];
            unit[10 * link + own] = 1.0;
            let values = base.values(&unit);
            for (symbol, row) in reference.independent.iter().zip(&reference.grouping_matrix_15x30) {
                let at = symbols.iter().position(|s| s == symbol).unwrap_or(0);
                worst = worst.max((values[at] - row[10 * link + k]).abs());
            }
        }
    }
    worst
}
