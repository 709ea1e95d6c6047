//! From a log to its factors by a recipe.

use dynid_factor::FactorError;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{BlockReducer, RowSource, RowVisitor, Rows, visit_all};
use dynid_rows::conditioning::{Conditioning, ConditioningSettings, LogRows, PreparedLog};

use super::file::key;
use super::{LogFacts, Recipe, ReducedFinding, ReducedLog, ReductionError, RowSums};
use crate::Error;
use crate::caution::{self, Caution};
use crate::fitting::conditioning_fault;
use crate::log::{self, Log};
use crate::overlap::Overlaps;
use crate::pipeline::{bench_with, log_cautions, preflight_on};
use crate::preflight::Bench;
use crate::problem::Problem;
use crate::robot::Robot;
use crate::settings::{LogSettings, labels};
use crate::trained_log::TrainedLog;

/// Velocities further out of the range of the recipe than this share of the range are told.
const FASTER: f64 = 0.25;

/// Reduces logs by a recipe.
#[derive(Debug)]
pub struct Reducer {
    pub(super) recipe: Recipe,
    hash: String,
    pub(super) problem: Problem,
    /// The robot as logs have it, where its elastic joints are read at their motors.
    elastic: Option<Robot>,
    /// What logs are examined with, unless they are not to be.
    bench: Option<Bench>,
    pub(super) windows: WindowSettings,
}

/// How logs are reduced that are longer than memory need be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WindowSettings {
    /// Rows of the part of a log that tells what its own samples decide; logs without more are looked at as a whole. At least 64.
    /// Default 131072 (two minutes at 1 kHz).
    pub part_rows: usize,
    /// Samples of a window. Default 65536.
    pub samples: usize,
}

impl Default for WindowSettings {
    fn default() -> Self {
        WindowSettings { part_rows: 1 << 17, samples: 1 << 16 }
    }
}

impl Recipe {
    /// What reduces logs by this recipe.
    ///
    /// # Errors
    /// [`ReductionError::Contradiction`].
    pub fn reducer(self) -> Result<Reducer, Error> {
        let (problem, _) = self.problem()?;
        let bench = bench_with(&problem.plan, &problem.settings, &problem.robot)?;
        let elastic = self.springs.as_ref().map(|springs| springs.robot(&problem.robot)).transpose()?;
        Ok(Reducer {
            hash: self.hash(),
            problem,
            elastic,
            bench,
            recipe: self,
            windows: WindowSettings::default(),
        })
    }
}

/// A log that was examined and conditioned.
pub(super) struct Examined {
    pub(super) name: String,
    pub(super) log: Log,
    pub(super) findings: Vec<ReducedFinding>,
    pub(super) prepared: PreparedLog,
    pub(super) conditioned: ConditioningSettings,
    pub(super) choices: Conditioning,
}

/// What is left of the rows of a log, and what is known of its samples.
pub(super) struct Rest {
    pub(super) groups: Vec<ReducedGroup>,
    pub(super) efforts: Vec<RowSums>,
    pub(super) trained: TrainedLog,
}

impl Reducer {
    /// Returns the reducer with other windows for long logs. Factors of such logs depend on them.
    #[must_use]
    pub fn with_windows(self, windows: WindowSettings) -> Self {
        Reducer {
            windows: WindowSettings { part_rows: windows.part_rows.max(64), samples: windows.samples.max(1) },
            ..self
        }
    }

    /// The windows of long logs.
    pub fn windows(&self) -> &WindowSettings {
        &self.windows
    }

    /// The recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The robot, for logs to be read.
    pub fn robot(&self) -> &Robot {
        self.elastic.as_ref().unwrap_or(&self.problem.robot)
    }

    /// Examines a log as an identification does, conditions it as the recipe says, and reduces its rows; a log of more than
    /// [`WindowSettings::part_rows`] as [`Reducer::reduce_blocks`] does.
    ///
    /// # Errors
    /// [`Error::Reduction`]: another sample rate, a joint without a column, no rows; [`Error::PreflightFault`] for a log of which nonsense
    /// would come; settings of the log that no recipe knows; what conditioning refuses.
    pub fn reduce(&self, log: Log) -> Result<ReducedLog, Error> {
        if self.in_windows(&log.settings) && log.log.rows() > self.windows.part_rows {
            return self.reduce_blocks(log, std::iter::empty());
        }
        self.reduce_whole(log)
    }

    /// [`Reducer::reduce`] of a log as a whole.
    pub(super) fn reduce_whole(&self, log: Log) -> Result<ReducedLog, Error> {
        let Examined { name, log, findings, mut prepared, conditioned, choices } = self.examine(log)?;
        let Problem { model, structure, .. } = &self.problem;
        let (mut deformations, mut dead) = (Vec::new(), Vec::new());
        if let Some(springs) = &self.recipe.springs {
            let behind = (self.recipe.outputs.len(), self.recipe.columns_of_efforts());
            // Of logs that may differ in what they carry halves are compared.
            let blocks = if self.recipe.payload().is_some() { 2 } else { 1 };
            deformations = springs.groups(model, &prepared, behind, blocks)?;
            dead = springs.dead(model, &prepared);
            springs.forget_links(&mut prepared.channels);
        }
        let logs = std::slice::from_ref(&prepared);
        let rows = LogRows::new(model, &structure.shape, &structure.base.kept, logs, &choices, &conditioned)?;
        let rows = if self.recipe.has_delays() { rows.with_delay_columns()? } else { rows };
        let (mut groups, efforts) = reduced(&rows, &self.recipe)?;
        drop(rows);
        groups.extend(deformations);
        let rest = Rest { groups, efforts, trained: TrainedLog::of(&prepared) };
        let mut reduced = self.finish(name, log, findings, &prepared, rest)?;
        reduced.facts.cautions.extend(dead.into_iter().map(|joint| {
            let message = format!(
                "{}: the record of the link of `{joint}` stands while its motor moves: it tells no deformation",
                reduced.facts.name
            );
            Caution::warn(caution::LOG, message, "look at the encoder behind the gear, or at the column that it is read from")
        }));
        Ok(reduced)
    }

    /// Checks a log, looks at it before anything is made of it, and prepares it.
    pub(super) fn examine(&self, log: Log) -> Result<Examined, Error> {
        let Problem { model, settings, .. } = &self.problem;
        check_settings(&log.settings)?;
        let name = labels(std::iter::once((&log.settings, log.log.name()))).remove(0);
        if let Some(joint) = log.not_logged(&self.robot().axes).into_iter().next() {
            return Err(ReductionError::NotLogged { log: log.log.name().to_owned(), joint }.into());
        }
        let log = match &self.recipe.springs {
            Some(springs) => springs.read_at_motors(log)?,
            None => log,
        };
        log::check_stated_temperatures(std::iter::once(&log.settings), model)?;
        let logs = [log];
        let findings = match &self.bench {
            Some(bench) => preflight_on(bench, settings, &logs, &Overlaps::default())?,
            None => Vec::new(),
        };
        let [log] = logs;
        let conditioned = ConditioningSettings {
            most_blocks: Some(self.recipe.blocks.most),
            ..settings.conditioning_settings()
        };
        let mut prepared = log.prepare(model, &conditioned)?;
        if !self.recipe.choices.rms_speed.is_empty() {
            prepared.tell_speeds(&self.recipe.choices.rms_speed);
        }
        let (expected_hz, found_hz) = (self.recipe.choices.rate_hz, prepared.rate_hz);
        if (found_hz / expected_hz - 1.0).abs() > 0.05 {
            return Err(ReductionError::Rate { log: prepared.name, expected_hz, found_hz }.into());
        }
        settings.check_cutoffs(&prepared.name, prepared.rate_hz)?;
        let choices = self.recipe.conditioning(&[prepared.rate_hz]);
        let findings = findings.iter().map(ReducedFinding::of).collect();
        Ok(Examined { name, log, findings, prepared, conditioned, choices })
    }

    /// The log as what is left of it. `prepared`: its clock, its motion and its channels count.
    pub(super) fn finish(
        &self,
        name: String,
        log: Log,
        findings: Vec<ReducedFinding>,
        prepared: &PreparedLog,
        rest: Rest,
    ) -> Result<ReducedLog, Error> {
        let Rest { groups, efforts, trained } = rest;
        if groups.iter().all(|g| g.rows() == 0 || g.output >= self.recipe.outputs.len()) {
            let (log, seconds) = (prepared.name.clone(), trained.duration_s);
            return Err(ReductionError::NoRows { log, seconds }.into());
        }
        let of_reading = log.warnings().into_iter().map(|message| {
            let remedy = "columns and units are stated under `[columns]`, before the log is reduced";
            Caution::warn(caution::LOG, message, remedy)
        });
        let mut cautions: Vec<Caution> = of_reading.collect();
        cautions.extend(log_cautions(&self.problem.model, std::slice::from_ref(prepared)));
        cautions.extend(self.beyond(&name, prepared));
        cautions.extend(self.faster(&name, &trained));
        let facts = LogFacts {
            name,
            log: trained,
            efforts,
            findings,
            cautions,
            inputs: log.source.inputs,
            origin: None,
            id: None,
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
    fn beyond(&self, name: &str, log: &PreparedLog) -> Vec<Caution> {
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
fn reduced(rows: &LogRows<'_>, recipe: &Recipe) -> Result<(Vec<ReducedGroup>, Vec<RowSums>), Error> {
    let shapes = rows.groups();
    let mut visitors: Vec<Tallied> = shapes.iter().map(|s| Tallied::new(s.columns.len())).collect();
    visit_all(rows, &mut visitors).map_err(|e| conditioning_fault(rows, e))?;
    let mut sums = vec![RowSums::NONE; recipe.outputs.len()];
    let mut groups = Vec::new();
    for (visitor, shape) in visitors.into_iter().zip(shapes) {
        if shape.scale == 0 {
            sums[shape.output] = visitor.sums;
        }
        groups.push(recipe.coarsened(&visitor.reducer.finish(shape)));
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

    pub(super) fn add(&mut self, effort: f64) {
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
