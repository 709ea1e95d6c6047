//! Friction shapes, chosen per joint on held-out time blocks.

mod losses;
mod search;

use dynid_model::{EffortModel, Owner};
use rayon::prelude::*;

use super::base_prior::BasePrior;
use super::friction_shape::{self, FrictionShape, ShapeKind};
use super::states::States;
use super::trial::{Trial, TrialShapes, state_hz_of};
use super::{Conditioning, ConditioningError, ConditioningSettings, JointMask, PreparedLog, Stage, choose};
use dynid_estimate::linear::{LinearMethod, LinearSettings, estimate};
use search::Search;

/// A friction shape that was tried on held-out blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeTrial {
    /// The shape.
    pub shape: FrictionShape,
    /// By how much the joint's held-out loss (mean square residual off reversal, mean over time blocks) falls with it, as a
    /// share of the loss without it.
    pub gain: f64,
    /// Standard error of the gain over time blocks.
    pub standard_error: f64,
}

/// What was chosen for one joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointFriction {
    /// Shapes to add to the joint's elements, at most two, of different kinds.
    pub accepted: Vec<ShapeTrial>,
    /// The best candidate of every kind that was tried and not taken, with its gain over the final choice.
    pub rejected: Vec<ShapeTrial>,
    /// Time blocks with rows that the choice rests on. Below [`super::FrictionSettings::least_blocks`] nothing was tried.
    pub blocks: usize,
    /// The mask before friction that gives way was taken, which needs the rows over reversals. Who drops that friction again
    /// gives the joint this mask back.
    pub mask_without_spring: Option<JointMask>,
}

impl JointFriction {
    /// Whether friction that gives way over a travel was taken.
    pub fn has_spring(&self) -> bool {
        self.accepted.iter().any(|t| t.shape.kind == ShapeKind::MaxwellSlip)
    }
}

/// Friction shapes of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionChoice {
    /// Per output.
    pub per_output: Vec<JointFriction>,
    /// The choices made before, with masks and delay brought up to date.
    pub conditioning: Conditioning,
    /// Linear parameters whose effort is the load of [`ShapeKind::Load`]: inertial ones of a fit without shapes, zeros
    /// elsewhere. Empty if no joint took that shape.
    pub load: Vec<f64>,
}

/// Chooses friction shapes beside the model's own columns.
///
/// Columns `|v|`, `s(v) exp(-(v/v_s)²)` and `tanh(v/v_c)` of every output's speed pass the kernels like the model's. Per
/// joint the candidates are ranked by the loss on all rows; the best are fitted without one time block and scored
/// on it, in rows off reversal, where low speeds count. After the choice masks and delay are found again.
///
/// `kept`: base columns of the model, ascending; `kinds`: per output the kinds to try (a kind whose columns the
/// model spans is passed over); `choices`: found by [`super::condition`] for these logs. Joints that move in one direction
/// only get no shape: what depends on speed cannot be told from what depends on its sign there.
///
/// # Errors
/// [`ConditioningError`] if a signal cannot be filtered or a row is not finite.
///
/// # Panics
/// If `kinds` has another length than the model has outputs.
#[expect(clippy::too_many_arguments, reason = "those of `condition` and what it found")]
pub fn choose_friction(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    kinds: &[Vec<ShapeKind>],
    prior: Option<&BasePrior>,
    choices: &Conditioning,
    settings: &ConditioningSettings,
    progress: &mut dyn FnMut(Stage),
) -> Result<FrictionChoice, ConditioningError> {
    assert_eq!(kinds.len(), model.outputs().len(), "kinds of shapes per output");
    let settings = &super::with_given_mask(settings);
    progress(Stage::Friction);
    let state_limit = choices.limit.states();
    let states = logs
        .iter()
        .map(|log| {
            let cutoff_hz = state_hz_of(choices.kernel_hz, state_limit, log.rate_hz, settings);
            States::of_motion_at(log, cutoff_hz, settings)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let library: Vec<Vec<FrictionShape>> = kinds
        .par_iter()
        .enumerate()
        .map(|(output, kinds)| friction_shape::of_output(output, kinds, &states))
        .collect();
    drop(states);
    let has_load = library.iter().flatten().any(|s| s.kind == ShapeKind::Load);
    let load = match has_load {
        true => rigid_parameters(model, shape, kept, logs, choices, settings)?,
        false => Vec::new(),
    };
    let limits = choose::delay_limits(logs, settings);
    let trial = Trial::new(
        model,
        shape,
        kept,
        logs,
        choices.kernel_hz,
        state_limit,
        limits,
        TrialShapes::Library { shapes: &library, load: &load },
        settings,
    )?;
    let viscous = viscous_columns(model, kept, &trial);
    let mut search = Search::new(&trial, &library, &viscous, prior, choices, settings);
    let mut per_output = search.run();
    for (output, joint) in per_output.iter_mut().enumerate().filter(|(_, joint)| joint.has_spring()) {
        joint.mask_without_spring = Some(choices.mask_of(output));
    }
    let (mut rung, chosen) = search.into_parts();
    let mut conditioning = choices.clone();
    if chosen.iter().any(|c| !c.is_empty()) {
        let trial = trial.with_shapes(&chosen);
        let all: Vec<Vec<usize>> = chosen.iter().map(|c| (0..c.len()).collect()).collect();
        progress(Stage::Delay);
        let first = choose::delay(&trial, &rung, &all, limits, settings, choices.delay.samples);
        progress(Stage::Mask);
        if settings.reversal_mask.is_none() {
            // What a spring says it says over reversals.
            let held: Vec<bool> = per_output.iter().map(JointFriction::has_spring).collect();
            rung = choose::masks_again(&trial, &rung, &all, &held, first.samples, settings);
        }
        progress(Stage::Delay);
        conditioning.delay = choose::delay(&trial, &rung, &all, limits, settings, first.samples);
        conditioning.usable = rung.iter().enumerate().map(|(j, r)| trial.coverage[j][*r]).collect();
        conditioning.mask = rung.iter().map(|r| (*r > 0).then(|| settings.ladder[*r - 1])).collect();
        conditioning.rung = rung;
    }
    let loaded = |joint: &JointFriction| joint.accepted.iter().any(|t| t.shape.kind == ShapeKind::Load);
    let load = if per_output.iter().any(loaded) { load } else { Vec::new() };
    Ok(FrictionChoice { per_output, conditioning, load })
}

/// Per output: place of the joint's viscous friction among the columns of its rows, if it is one of them.
fn viscous_columns(model: &dyn EffortModel, kept: &[usize], trial: &Trial) -> Vec<Option<usize>> {
    let table = &model.parameters().linear;
    let place = |(output, own): (&dynid_model::Output, &Vec<usize>)| {
        let name = format!("{}.fv", output.name);
        own.iter().position(|k| table[kept[*k]].name == name)
    };
    model.outputs().iter().zip(&trial.columns.global).map(place).collect()
}

/// Inertial parameters of a fit without shapes, zeros elsewhere.
fn rigid_parameters(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    choices: &Conditioning,
    settings: &ConditioningSettings,
) -> Result<Vec<f64>, ConditioningError> {
    let groups = super::reduce(model, shape, kept, logs, choices, settings)?;
    let table = &model.parameters().linear;
    let mut out = vec![0.0; table.len()];
    // Without a fit there is no load, and its column is passed over as empty.
    if let Ok(fit) = estimate(&groups, None, kept.len(), &LinearMethod::Wls, &LinearSettings::default()) {
        for (column, value) in kept.iter().zip(&fit.x) {
            if matches!(table[*column].owner, Owner::Link(_)) {
                out[*column] = *value;
            }
        }
    }
    Ok(out)
}
