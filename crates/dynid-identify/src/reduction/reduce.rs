//! From a log to its factors by a recipe.

use dynid_factor::FactorError;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{BlockReducer, RowSource, RowVisitor, Rows, visit_all};
use dynid_rows::conditioning::{ConditioningSettings, LogRows};

use super::file::key;
use super::{LogFacts, Recipe, ReducedFinding, ReducedLog, ReductionError, RowSums};
use crate::Error;
use crate::caution::{self, Caution};
use crate::fitting::conditioning_fault;
use crate::log::{self, Log};
use crate::overlap::Overlaps;
use crate::pipeline::{log_cautions, preflight};
use crate::problem::Problem;
use crate::settings::{LogSettings, labels};
use crate::trained_log::TrainedLog;

/// Velocities further out of the range of the recipe than this share of the range are told.
const FASTER: f64 = 0.25;

/// Reduces logs by a recipe.
#[derive(Debug)]
pub struct Reducer {
    recipe: Recipe,
    hash: String,
    problem: Problem,
}

impl Recipe {
    /// What reduces logs by this recipe.
    ///
    /// # Errors
    /// [`ReductionError::Contradiction`].
    pub fn reducer(self) -> Result<Reducer, Error> {
        let (problem, _) = self.problem()?;
        Ok(Reducer { hash: self.hash(), problem, recipe: self })
    }
}

impl Reducer {
    /// The recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The robot, for logs to be read.
    pub fn robot(&self) -> &crate::Robot {
        &self.problem.robot
    }

    /// Examines a log as an identification does, conditions it as the recipe says, and reduces its rows.
    ///
    /// # Errors
    /// [`Error::Reduction`]: another sample rate, a joint without a column, no rows; [`Error::PreflightFault`] for a log of which nonsense
    /// would come; settings of the log that no recipe knows; what conditioning refuses.
    pub fn reduce(&self, log: Log) -> Result<ReducedLog, Error> {
        let Problem { robot, model, structure, settings, .. } = &self.problem;
        check_settings(&log.settings)?;
        let name = labels(std::iter::once((&log.settings, log.log.name()))).remove(0);
        if let Some(joint) = log.not_logged(&robot.axes).into_iter().next() {
            return Err(ReductionError::NotLogged { log: log.log.name().to_owned(), joint }.into());
        }
        log::check_stated_temperatures(std::iter::once(&log.settings), model)?;
        let logs = [log];
        let findings = preflight(settings, robot, &logs, &Overlaps::default())?;
        let [log] = logs;
        let conditioned = ConditioningSettings {
            most_blocks: Some(self.recipe.blocks.most),
            ..settings.conditioning_settings()
        };
        let prepared = log.prepare(model, &conditioned)?;
        let (expected_hz, found_hz) = (self.recipe.choices.rate_hz, prepared.rate_hz);
        if (found_hz / expected_hz - 1.0).abs() > 0.05 {
            return Err(ReductionError::Rate { log: prepared.name, expected_hz, found_hz }.into());
        }
        settings.check_cutoffs(&prepared.name, prepared.rate_hz)?;
        let choices = self.recipe.conditioning(&[prepared.rate_hz]);
        let logs = std::slice::from_ref(&prepared);
        let (shape, kept) = (&structure.shape, &structure.base.kept);
        let rows = LogRows::new(model, shape, kept, logs, &choices, &conditioned)?;
        let (groups, efforts) = reduced(&rows, self.recipe.outputs.len(), self.recipe.blocks.merged)?;
        if groups.iter().all(|g| g.rows() == 0) {
            let seconds = prepared.duration();
            return Err(ReductionError::NoRows { log: prepared.name, seconds }.into());
        }
        let trained = TrainedLog::of(&prepared);
        let of_reading = log.warnings().into_iter().map(|message| {
            let remedy = "columns and units are stated under `[columns]`, before the log is reduced";
            Caution::warn(caution::LOG, message, remedy)
        });
        let mut cautions: Vec<Caution> = of_reading.collect();
        cautions.extend(log_cautions(model, logs));
        cautions.extend(self.beyond(&name, &prepared));
        cautions.extend(self.faster(&name, &trained));
        let findings = findings.iter().map(ReducedFinding::of).collect();
        let facts = LogFacts {
            name,
            log: trained,
            efforts,
            findings,
            cautions,
            inputs: log.source.inputs,
            origin: None,
        };
        Ok(ReducedLog { key: key(&self.hash, &groups), facts, groups })
    }

    /// Velocities beyond those of the logs that taught the recipe, by which shapes of friction and its bounds were chosen.
    fn faster(&self, name: &str, log: &TrainedLog) -> Option<Caution> {
        let beyond = |found: &Option<(f64, f64)>, known: &Option<(f64, f64)>| {
            let (low, high) = found.as_ref()?;
            let (least, most) = known.unwrap_or((0.0, 0.0));
            let room = FASTER * (most - least);
            (*low < least - room || *high > most + room).then_some((*low, *high, least, most))
        };
        let all = log.velocities.iter().zip(&self.recipe.velocities).zip(&self.recipe.outputs);
        let (joint, (low, high, least, most)) = all
            .into_iter()
            .find_map(|((found, known), output)| Some((&output.name, beyond(found, known)?)))?;
        let message = format!(
            "{name}: `{joint}` moves at {low:.3} to {high:.3}, in the logs of the recipe at {least:.3} to {most:.3} (rad/s or m/s): shapes of \
             friction were not chosen for that"
        );
        let remedy =
            "learn the recipe on logs that hold these speeds: `dynid reduce CONFIG --out NEW.factors`";
        Some(Caution::warn(caution::LOG, message, remedy))
    }

    /// Temperatures beyond the range of known friction.
    fn beyond(&self, name: &str, log: &dynid_rows::conditioning::PreparedLog) -> Vec<Caution> {
        let doubts = crate::pipeline::known::logged_beyond(&self.problem.plan.known, log);
        let remedy = "leave the log out, or learn the friction at its temperatures";
        let caution =
            |message: String| Caution::warn(caution::KNOWN_FRICTION, format!("{name}: {message}"), remedy);
        doubts.into_iter().map(caution).collect()
    }
}

/// Refuses what belongs to single logs, which no recipe knows.
fn check_settings(settings: &LogSettings) -> Result<(), Error> {
    let LogSettings { name: _, payload, own, like, temperature: _, validation, period_s: _ } = settings;
    let none = "none for a log that is reduced";
    let refused = |what: &str, found: String| Err(Error::setting(what, none, found));
    match (payload, own.first(), like) {
        (Some(found), ..) => return refused("log.payload", found.clone()),
        (_, Some(own), _) => return refused("log.own", own.word().to_owned()),
        (.., Some(found)) => return refused("log.like", found.clone()),
        _ => {}
    }
    if *validation { refused("log.validation", "true".to_owned()) } else { Ok(()) }
}

/// Factors of a log's rows in blocks of the recipe's length, and what its efforts are like.
fn reduced(
    rows: &LogRows<'_>,
    outputs: usize,
    merged: usize,
) -> Result<(Vec<ReducedGroup>, Vec<RowSums>), Error> {
    let shapes = rows.groups();
    let mut visitors: Vec<Tallied> = shapes.iter().map(|s| Tallied::new(s.columns.len())).collect();
    visit_all(rows, &mut visitors).map_err(|e| conditioning_fault(rows, e))?;
    let mut sums = vec![RowSums::NONE; outputs];
    let mut groups = Vec::new();
    for (visitor, shape) in visitors.into_iter().zip(shapes) {
        if shape.scale == 0 {
            sums[shape.output] = visitor.sums;
        }
        groups.push(visitor.reducer.finish(shape).coarsened(merged));
    }
    Ok((groups, sums))
}

/// Reduces rows and sums their efforts.
struct Tallied {
    reducer: BlockReducer,
    sums: RowSums,
}

impl Tallied {
    fn new(columns: usize) -> Self {
        Tallied { reducer: BlockReducer::new(columns), sums: RowSums::NONE }
    }
}

impl RowVisitor for Tallied {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        self.reducer.push(rows, None)?;
        rows.effort.iter().for_each(|e| self.sums.add(*e));
        Ok(())
    }
}

impl RowSums {
    /// Of no rows.
    pub const NONE: RowSums = RowSums { rows: 0, sum: 0.0, squares: 0.0, least: 0.0, greatest: 0.0 };

    fn add(&mut self, effort: f64) {
        let (least, greatest) = if self.rows == 0 { (effort, effort) } else { (self.least, self.greatest) };
        *self = RowSums {
            rows: self.rows + 1,
            sum: self.sum + effort,
            squares: self.squares + effort * effort,
            least: least.min(effort),
            greatest: greatest.max(effort),
        };
    }
}
