//! Row 5: which of the 11 parameters ideal joints show.

use dynid::estimators::rank::{RankReport, numerical_rank};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RandomMotion};
use serde_json::json;

use super::parameters::{BASE, KEPT, NAMES, PARAMETERS, Parameters};
use super::pointing::{Pointing, acting};
use super::reference;
use super::settings::Settings;
use super::trajectory::Motion;
use crate::{Row, RunSettings, StudyError};

/// States of the random motion.
const STATES: usize = 500;

/// What of the 11 parameters can be told apart.
#[derive(Debug)]
pub(super) struct Identifiability {
    /// On the paper's trajectory.
    pub(super) trajectory: RankReport,
    /// On random motion.
    pub(super) random: RankReport,
    /// Base parameters of general bodies: text, value of the system, and whether the paper's links can have one that is not
    /// zero.
    pub(super) base: Vec<BaseEntry>,
}

#[derive(Debug)]
pub(super) struct BaseEntry {
    pub(super) symbol: String,
    pub(super) expression: String,
    pub(super) value: f64,
    pub(super) acts: bool,
}

pub(super) fn identifiability(
    pointing: &Pointing,
    settings: &Settings,
    run: &RunSettings,
) -> Result<(Identifiability, Row), StudyError> {
    let mechanism = pointing.mechanism();
    let system = Parameters::of(mechanism)?;
    let model = pointing.model.as_ref();
    let motion = Motion::of(settings, &settings.trajectory, settings.samples)?;
    let random = RandomMotion::of(model, mechanism, STATES, run.seed);
    let base = BaseParameters::of(model, mechanism, &[], &BaseSettings::default());

    let mut candidates: Vec<Parameters> =
        reference::dynamics()?.states.iter().map(|s| Parameters(s.p)).collect();
    candidates.push(system);
    let mut torque = 0.0_f64;
    for parameters in &candidates {
        torque = torque.max(base_error(pointing, &base, &motion.block(), parameters));
        torque = torque.max(random.with_block(|block| base_error(pointing, &base, block, parameters)));
    }
    let entries = entries(pointing, &base, &system);
    let kept: Vec<&BaseEntry> = entries.iter().filter(|e| e.acts).collect();
    let same_list = KEPT.iter().all(|name| kept.iter().any(|e| e.symbol == *name)) && kept.len() == BASE;
    let values = candidates.iter().map(|p| value_error(pointing, &base, &entries, p)).fold(0.0, f64::max);

    let found = Identifiability {
        trajectory: numerical_rank(&pointing.jacobian(&motion.block(), &system)?),
        random: numerical_rank(&random.with_block(|block| pointing.jacobian(block, &system))?),
        base: entries,
    };
    let beyond = |report: &RankReport| report.singular_values[BASE] / report.singular_values[0];
    let (on_trajectory, on_random) = (beyond(&found.trajectory), beyond(&found.random));
    let ranks = [found.trajectory.rank, found.random.rank];
    let (general, of_paper) = (base.len(), found.base.iter().filter(|e| e.acts).count());
    let row = Row::new(
        "5",
        "Ideal joints show 8 combinations of the 11 parameters, whatever the motion; the tool's own base parameters are those 8 \
         and, for links that may have centres of mass off their axes X, the two first moments along Y",
        "scaled singular values beyond the 8th below 1e-9 of the first; the 8 combinations and their values 1e-12; torque of the base \
         model 1e-12 N m",
        json!({
            "parameters": PARAMETERS,
            "rank_on_trajectory": ranks[0],
            "rank_on_random_motion": ranks[1],
            "ninth_on_trajectory": on_trajectory,
            "ninth_on_random_motion": on_random,
            "base_parameters": of_paper,
            "base_parameters_of_general_links": general,
            "same_list": same_list,
            "values": values,
            "torque": torque,
        }),
        format!(
            "rank {} on Table 1 and {} on random motion, ninth {on_trajectory:.1e} and {on_random:.1e}; {of_paper} base parameters \
             ({general} of general links), {} list, values {values:.1e}, torque {torque:.1e} N m",
            ranks[0],
            ranks[1],
            if same_list { "the same" } else { "another" },
        ),
        ranks == [BASE; 2]
            && on_trajectory.max(on_random) < 1e-9
            && same_list
            && values <= 1e-12
            && torque <= 1e-12,
    );
    Ok((found, row))
}

/// Largest difference between the torque of all parameters and that of their base values, N m.
fn base_error(pointing: &Pointing, base: &BaseParameters, motion: &MotionBlock<'_>, at: &Parameters) -> f64 {
    let linear = pointing.linear_of(at);
    let whole = pointing.efforts(motion, &linear);
    let reduced = pointing.efforts(motion, &base.expanded(&base.values(&linear)));
    whole.iter().zip(reduced).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Largest difference between base values and the paper's combinations; those that the paper lacks are to be zero.
fn value_error(pointing: &Pointing, base: &BaseParameters, entries: &[BaseEntry], at: &Parameters) -> f64 {
    let wanted = at.base(pointing.length());
    let values = base.values(&pointing.linear_of(at));
    let errors = values.iter().zip(entries).map(|(value, entry)| {
        let place = KEPT.iter().position(|name| *name == entry.symbol);
        (value - place.map_or(0.0, |k| wanted[k])).abs()
    });
    errors.fold(0.0, f64::max)
}

fn entries(pointing: &Pointing, base: &BaseParameters, system: &Parameters) -> Vec<BaseEntry> {
    let table = pointing.model.parameters();
    let values = base.values(&pointing.linear_of(system));
    let acting = acting(pointing, base);
    let expressions = base.expressions(table);
    (0..base.len())
        .map(|k| BaseEntry {
            symbol: table.linear[base.kept[k]].symbol.clone(),
            expression: expressions[k].clone(),
            value: values[k],
            acts: acting[k],
        })
        .collect()
}

/// Parameters that add nothing to the rank: removed one at a time, the rank stays.
pub(super) fn unidentifiable(
    pointing: &Pointing,
    settings: &Settings,
) -> Result<Vec<&'static str>, StudyError> {
    let motion = Motion::of(settings, &settings.trajectory, settings.samples)?;
    let system = Parameters::of(pointing.mechanism())?;
    let factor = pointing.jacobian(&motion.block(), &system)?;
    let names = (0..PARAMETERS).filter(|k| {
        let others: Vec<usize> = (0..PARAMETERS).filter(|c| c != k).collect();
        numerical_rank(&factor.select(&others)).rank == BASE
    });
    Ok(names.map(|k| NAMES[k]).collect())
}
