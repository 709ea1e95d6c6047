//! Friction and inertias from one fit, to the excitation log and to the points of the friction experiment together.

use dynid::estimators::conditioning::{ConditioningSettings, PreparedLog, ShapedRows, condition};
use dynid::estimators::separable::{JoinedProblem, SeparableSettings, SteadyFrictionRow, SteadyRows, fit};
use dynid::model::element::{ExponentialViscous, JointElement, LuGre, Offset, RotorInertia, ShapeSetting};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, RobotModel};

use super::fault;
use super::identification::{Constraints, Identified, feasible};
use super::robot::{Cycles, Indy7, ripple};
use crate::StudyError;

/// Friction of one joint: start values and bounds of what is free in it.
#[derive(Debug, Clone)]
pub(super) struct FrictionStart {
    pub(super) bristles: LuGre,
    pub(super) viscous: ExponentialViscous,
}

impl FrictionStart {
    fn settings(&mut self) -> [&mut ShapeSetting; 8] {
        let LuGre { kappa, rho, vs, delta, .. } = &mut self.bristles;
        let ExponentialViscous { sigma3, sigma3_slope, sigma4, sigma4_slope, .. } = &mut self.viscous;
        [kappa, rho, vs, delta, sigma3, sigma3_slope, sigma4, sigma4_slope]
    }
}

/// `cycles`: of the torque ripple of every joint, where there is one to estimate.
fn model(arm: &Indy7, friction: &[FrictionStart], cycles: &Cycles) -> RobotModel {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for (rate, f) in friction.iter().enumerate() {
        elements.push(Box::new(f.bristles.clone()));
        elements.push(Box::new(f.viscous.clone()));
        elements.push(Box::new(Offset { rate }));
        elements.push(Box::new(RotorInertia { rate }));
        elements.extend(ripple(rate, &cycles[rate]));
    }
    RobotModel::new(arm.mechanism.clone(), elements)
}

/// All friction and all inertias, and ripple of known order. `points`: of the friction experiment.
pub(super) fn one_shot(
    arm: &Indy7,
    mut friction: Vec<FrictionStart>,
    points: &[SteadyFrictionRow],
    cycles: &Cycles,
    log: &PreparedLog,
    constraints: Constraints,
) -> Result<Identified, StudyError> {
    let free = model(arm, &friction, cycles);
    let shape = free.parameters().shape_start();
    let base = BaseParameters::of(&free, &arm.mechanism, &shape, &BaseSettings::default());
    let settings = ConditioningSettings { reversal_mask: Some(-1.0), ..ConditioningSettings::default() };
    let logs = std::slice::from_ref(log);
    let choices = condition(&free, &shape, &base.kept, logs, &settings, &mut |_| {}).map_err(fault)?;
    let rows = ShapedRows::new(&free, &shape, &base.kept, logs, &choices, &settings).map_err(fault)?;
    let steady = SteadyRows::new(&free, &base.kept, points, logs.len()).map_err(fault)?;
    let search = SeparableSettings { starts: 1, profile_points: 0, ..SeparableSettings::default() };
    let found = fit(&JoinedProblem::new(vec![&rows, &steady]), &search).map_err(fault)?;
    let fit = found.linearised.as_ref().ok_or_else(|| fault("no linearised rows"))?;
    let mut values = feasible(arm, &free, &base, &fit.factor, constraints)?;
    let changes = values.split_off(free.parameters().linear.len());
    let mut at = found.shape.clone();
    for (k, change) in found.active.iter().zip(changes) {
        let bounds = &free.parameters().shape[*k];
        at[*k] = (at[*k] + change).clamp(bounds.lower, bounds.upper);
    }
    let settings = friction.iter_mut().flat_map(FrictionStart::settings).filter(|s| !s.held);
    for (setting, value) in settings.zip(at) {
        *setting = ShapeSetting::held(value);
    }
    Ok(Identified { model: model(arm, &friction, cycles), values })
}
