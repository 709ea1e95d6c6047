//! Logs reduced to factors wherever they lie, merged in any order, and solved.
//!
//! ```no_run
//! use dynid_identify::reduction::Reduction;
//! use dynid_identify::{Log, Robot, Settings, identify};
//! # fn cells(robot: Robot, logs: Vec<Log>, more: Vec<Log>) -> Result<(), dynid_identify::Error> {
//! let learned = identify(&robot, logs.clone(), &Settings::default(), &mut |_| {})?;
//! let reducer = learned.recipe()?.reducer()?;
//! let here = Reduction::of(&reducer, logs)?;
//! let there = Reduction::of(&reducer, more)?;
//! let bytes = there.to_bytes();
//! let all = Reduction::merge([here, Reduction::from_bytes(&bytes, "there")?])?;
//! println!("{}", all.solve([], &mut |_| {})?.estimate().verdict.headline);
//! # Ok(())
//! # }
//! ```
//!
//! A [`Recipe`] is what one identification chose, and decides the rows of every further log. A [`Reduction`] holds the triangular factors
//! of logs by the recipe: a log counts once however often it is reduced, since its factors are its key, and logs stand in the order of their
//! keys, so that a merge gives the same bits in any order. Factors of the logs that the recipe was learned on are solved to the parameters of
//! that identification.
//!
//! What is not known without samples is left out: figures on single samples, whiteness of the residuals, the scale of the efforts by the
//! robot file. Figures of a fit are those of its rows.

mod columns;
mod file;
mod pooled;
mod recipe;
mod reduce;
mod shapes;
mod solve;
mod springs;
mod stream;
mod windows;

use std::collections::BTreeMap;

use dynid_factor::groups::ReducedGroup;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::caution::Caution;
use crate::estimate::InputRecord;
use crate::finding::{Finding, FindingId, Severity};
use crate::log::Log;

pub use crate::reduction_error::{FactorFileFault, ReductionError};
pub use crate::trained_log::{RowFit, TrainedLog};
pub use columns::{Column, Output};
pub use file::VERSION;
pub use pooled::Pooled;
pub use recipe::{Blocks, Choices, DELAY, Recipe, check_payload_link, payload_columns};
pub use reduce::{Reducer, WindowSettings};
pub use springs::{BACKLASH, COMPLIANCE, HYSTERESIS, LAG, Spring, Springs};

/// What is left of a log: its factors, and what has to be known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedLog {
    /// SHA-256 of recipe and factors in one time block, hexadecimal: the log by what it contributes.
    pub key: String,
    /// What is known of the log.
    pub facts: LogFacts,
    /// Factors, one group per output and kernel.
    pub groups: Vec<ReducedGroup>,
}

/// What has to be known of a log beside its factors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogFacts {
    /// Name in messages.
    pub name: String,
    /// What is known of it without its samples.
    pub log: TrainedLog,
    /// Per output: what its efforts are like, in the rows of the widest kernel.
    pub efforts: Vec<RowSums>,
    /// What the pre-flight found.
    pub findings: Vec<ReducedFinding>,
    /// What the reading of the log and its motion gave cause for.
    pub cautions: Vec<Caution>,
    /// Files that were read.
    pub inputs: Vec<InputRecord>,
    /// Where the log comes from, in a fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// Which log this is, by which recipe and how read: the name of its file in a store of factors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
}

/// Which robot of its type a log is of, and what is known of the log as a whole.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Name or serial number of the robot.
    pub robot: String,
    /// When the log began, s since 1970-01-01 UTC.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_s: Option<f64>,
    /// Numbers that hold for the whole log (temperature, load, age ...), by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub covariates: BTreeMap<String, f64>,
}

/// A finding of the pre-flight of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReducedFinding {
    /// Which fault.
    pub id: FindingId,
    /// How much it matters.
    pub severity: Severity,
    /// Joint, if it is a joint's own.
    pub joint: Option<String>,
    /// What was measured.
    pub evidence: String,
    /// What to do.
    pub remedy: String,
}

/// Sums over the efforts of rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RowSums {
    /// Rows.
    pub rows: usize,
    /// Sum of the efforts, N m or N.
    pub sum: f64,
    /// Sum of their squares.
    pub squares: f64,
    /// Least effort; 0 without rows.
    pub least: f64,
    /// Greatest effort; 0 without rows.
    pub greatest: f64,
}

impl ReducedFinding {
    fn of(finding: &Finding) -> Self {
        let Finding { id, severity, joint, evidence, remedy, .. } = finding.clone();
        ReducedFinding { id, severity, joint, evidence, remedy }
    }

    /// The finding of log `number`.
    pub fn finding(&self, log: &str, number: usize) -> Finding {
        let ReducedFinding { id, severity, joint, evidence, remedy } = self.clone();
        Finding { id, severity, joint, log: log.to_owned(), evidence, remedy, number, fixes: Vec::new() }
    }
}

/// Logs by one recipe, in the order of their keys.
#[derive(Debug, Clone)]
pub struct Reduction {
    recipe: Recipe,
    logs: Vec<ReducedLog>,
}

impl Reduction {
    /// Reduces logs.
    ///
    /// # Errors
    /// Fails as [`Reducer::reduce`] does.
    pub fn of(reducer: &Reducer, logs: impl IntoIterator<Item = Log>) -> Result<Reduction, Error> {
        let logs = logs.into_iter().map(|log| reducer.reduce(log)).collect::<Result<Vec<_>, Error>>()?;
        Ok(Reduction::new(reducer.recipe().clone(), logs))
    }

    /// A recipe alone, for a place where its logs lie beside it.
    pub fn without_logs(recipe: Recipe) -> Reduction {
        Reduction { recipe, logs: Vec::new() }
    }

    /// Logs that were reduced by the recipe of a reducer.
    pub fn of_reduced(reducer: &Reducer, logs: Vec<ReducedLog>) -> Reduction {
        Reduction::new(reducer.recipe().clone(), logs)
    }

    fn new(recipe: Recipe, mut logs: Vec<ReducedLog>) -> Reduction {
        // Of a log that was reduced twice, from other places or in other time blocks, the same one in any order: the one with most blocks.
        let blocks = |log: &ReducedLog| log.groups.iter().map(|g| g.blocks.len()).sum::<usize>();
        logs.sort_by_cached_key(|log| (log.key.clone(), std::cmp::Reverse(blocks(log)), plain(&log.facts)));
        logs.dedup_by(|a, b| a.key == b.key);
        Reduction { recipe, logs }
    }

    /// The recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// Logs in the order of their keys, each once.
    pub fn logs(&self) -> &[ReducedLog] {
        &self.logs
    }

    /// All logs of reductions by one recipe, in any order of the reductions with the same bits.
    ///
    /// # Errors
    /// [`ReductionError::OtherRecipe`], [`ReductionError::Nothing`].
    pub fn merge(parts: impl IntoIterator<Item = Reduction>) -> Result<Reduction, ReductionError> {
        let mut parts = parts.into_iter();
        let Reduction { mut recipe, mut logs } = parts.next().ok_or(ReductionError::Nothing)?;
        let expected = recipe.hash();
        for part in parts {
            let found = part.recipe.hash();
            if found != expected {
                let log = part.logs.first().map_or_else(String::new, |log| log.facts.name.clone());
                return Err(ReductionError::OtherRecipe { log, expected, found });
            }
            logs.extend(part.logs);
            // They may differ in where files lay.
            if plain(&part.recipe) < plain(&recipe) {
                recipe = part.recipe;
            }
        }
        Ok(Reduction::new(recipe, logs))
    }
}

/// Plain data as text.
fn plain(data: &impl Serialize) -> String {
    serde_json::to_string(data).unwrap_or_else(|e| unreachable!("plain data: {e}"))
}
