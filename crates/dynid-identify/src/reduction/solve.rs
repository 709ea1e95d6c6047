//! From factors to an identification.

use dynid_estimate::linear::estimate;
use dynid_estimate::metrics::{ChannelSums, FitSums};
use dynid_factor::groups::ReducedGroup;

use super::recipe::{Solved, training_log};
use super::{LogFacts, Recipe, ReducedLog, Reduction, ReductionError};
use crate::Error;
use crate::caution::{self, Caution};
use crate::consistency::{self, Consistent};
use crate::finding::Finding;
use crate::fitting::{self, Fitted, RowResiduals};
use crate::friction_power::FrictionPower;
use crate::identification::Identification;
use crate::log::{Log, LogSource};
use crate::overlap::Overlaps;
use crate::pipeline::{Beside, EXPLAINED, Left, ModelFit, Step, assemble, explained};
use crate::problem::Problem;
use crate::shape::ShapeFit;
use crate::trained_log::{RowFit, TrainedLog};

impl Reduction {
    /// Solves for the parameters of all logs: fit, covariance, bodies that can exist, verdicts, validation logs.
    ///
    /// The result has no samples of the training logs: [`Identification::training`] is empty, and [`Identification::row_fits`] says how well
    /// rows are explained. Rows leave out reversals and rest: what a model does there, only a validation log tells.
    ///
    /// # Errors
    /// [`Error::Reduction`]; else as [`crate::identify()`].
    pub fn solve(
        &self,
        validation: impl IntoIterator<Item = Log>,
        progress: &mut dyn FnMut(Step),
    ) -> Result<Identification, Error> {
        if self.logs.is_empty() {
            return Err(ReductionError::Nothing.into());
        }
        progress(Step::Structure);
        let (mut problem, Solved { shapes, power }) = self.recipe.problem()?;
        problem.training = self.logs.iter().map(|log| training_log(&log.facts.name)).collect();
        problem.settings.files.robot.clone_from(&problem.robot.path);
        let (columns, outputs) = (problem.structure.base.len(), self.recipe.outputs.len());
        let of_log = |(k, log): (usize, &ReducedLog)| -> Vec<ReducedGroup> {
            // Deformations say nothing of the efforts.
            let of_efforts = log.groups.iter().filter(|g| g.output < outputs);
            of_efforts.map(|g| ReducedGroup { log: k, ..without_delay(g, columns) }).collect()
        };
        let of_logs: Vec<Vec<ReducedGroup>> = self.logs.iter().enumerate().map(of_log).collect();
        let groups: Vec<ReducedGroup> = of_logs.iter().flatten().cloned().collect();
        progress(Step::Fit);
        fitting::check_rows(&groups, columns, || self.logs[0].facts.name.clone())?;
        let settings = fitting::linear_settings(&problem.settings);
        let found = estimate(&groups, None, columns, &problem.structure.method, &settings)?;
        let logs: Vec<&TrainedLog> = self.logs.iter().map(|log| &log.facts.log).collect();
        let fitted = Fitted::with_blocks(found, self.recipe.blocks.wanted_s, &logs);
        progress(Step::Consistency);
        let consistent = consistency::consistent(&problem, &fitted, &groups)?;
        let base = problem.structure.base.values(&consistent.values);
        let row_fits: Vec<RowFit> = (self.logs.iter().zip(&of_logs))
            .map(|(log, groups)| row_fit(&log.facts, groups, &base, self.recipe.outputs.len()))
            .collect();
        let source = |facts: &LogFacts| LogSource { inputs: facts.inputs.clone(), ..LogSource::default() };
        let named = |facts: &LogFacts| TrainedLog { name: facts.name.clone(), ..facts.log.clone() };
        let facts = || self.logs.iter().map(|log| &log.facts);
        let of_log = |(k, facts): (usize, &LogFacts)| -> Vec<Finding> {
            facts.findings.iter().map(|f| f.finding(&facts.name, k)).collect()
        };
        let findings = facts().enumerate().flat_map(of_log).collect();
        let solution = Solution { fitted, groups, consistent, shapes, power };
        let beside = Beside {
            training: facts().map(named).collect(),
            sources: facts().map(source).collect(),
            findings,
            overlaps: Overlaps::default(),
            own_delays: Vec::new(),
            warnings: facts()
                .flat_map(|facts| facts.cautions.iter().cloned())
                .chain(self.carried())
                .collect(),
            reading: Vec::new(),
            comparison: None,
        };
        let rows_explained = |j: usize| {
            row_fits.iter().filter_map(move |rows| rows.fit.channels[j].r2).all(|r2| r2 >= EXPLAINED)
        };
        let rows_explained: Vec<bool> = (0..self.recipe.outputs.len()).map(rows_explained).collect();
        let (mut out, left) = self.recipe.assembled(problem, solution, beside, row_fits)?;
        for log in validation {
            progress(Step::Validate(log.log.name().to_owned()));
            out.validate(log)?;
        }
        progress(Step::Trust);
        let samples = explained(out.validation.iter(), self.recipe.outputs.len(), &out.consistent);
        out.explained = samples.into_iter().zip(rows_explained).map(|(held, rows)| held && rows).collect();
        out.judge(&left)?;
        Ok(out)
    }

    /// Logs that may carry different bodies are solved as if they carried one.
    fn carried(&self) -> Option<Caution> {
        let link = self.recipe.payload().filter(|_| self.logs.len() > 1)?;
        let message = format!("the logs may carry different bodies on `{link}`, which are taken for one");
        let remedy = "`dynid fleet` tells what every log carried; or reduce by a recipe that was learned without `--payload`";
        Some(Caution::warn(caution::PAYLOAD, message, remedy))
    }
}

/// A fit of a recipe's columns.
pub(super) struct Solution {
    pub(super) fitted: Fitted,
    /// Rows of the efforts, output by output.
    pub(super) groups: Vec<ReducedGroup>,
    pub(super) consistent: Consistent,
    pub(super) shapes: Option<ShapeFit>,
    pub(super) power: FrictionPower,
}

impl Recipe {
    /// An identification without samples, which is not judged yet.
    pub(super) fn assembled(
        &self,
        problem: Problem,
        solution: Solution,
        beside: Beside,
        row_fits: Vec<RowFit>,
    ) -> Result<(Identification, Left), Error> {
        let Solution { fitted, groups, consistent, shapes, power } = solution;
        let rates: Vec<f64> = beside.training.iter().map(|log| log.rate_hz).collect();
        let fit = ModelFit {
            conditioning: Some(self.conditioning(&rates)),
            friction: Vec::new(),
            cyclic: Vec::new(),
            slow: Vec::new(),
            shapes,
            simulations: None,
            residuals: RowResiduals::none(),
            fitted,
            groups,
            consistent,
            power,
            loads: None,
        };
        let (mut out, left) = assemble(problem, fit, beside)?;
        out.recipe_doubts.clone_from(&self.doubts);
        out.row_fits = row_fits;
        Ok((out, left))
    }
}

/// The rows of a group where the rest of the delay is free, time block by time block; `columns`: those of the model, behind which its column is.
fn without_delay(group: &ReducedGroup, columns: usize) -> ReducedGroup {
    let Some(at) = group.columns.iter().position(|c| *c >= columns) else { return group.clone() };
    let mut kept = group.columns.clone();
    kept.remove(at);
    let blocks = group.blocks.iter().map(|block| block.freed_of(&[at])).collect();
    ReducedGroup { columns: kept, blocks, ..*group }
}

/// How well the rows of a log are explained by values in base columns.
fn row_fit(facts: &LogFacts, groups: &[ReducedGroup], x: &[f64], outputs: usize) -> RowFit {
    let mut left = vec![(0, 0.0); outputs];
    for group in groups.iter().filter(|g| g.scale == 0 && g.rows() > 0) {
        left[group.output] = (group.rows(), group.merged(x.len()).rss(x));
    }
    RowFit { log: facts.name.clone(), fit: facts.row_sums(&left).fit() }
}

impl LogFacts {
    /// Sums over the rows of the widest kernel, output by output. `left`: per output the rows, and the sum of their squared residuals.
    pub fn row_sums(&self, left: &[(usize, f64)]) -> FitSums {
        let mut sums = FitSums::default();
        for (j, (rows, error_energy)) in left.iter().enumerate() {
            if *rows == 0 {
                sums.add(&ChannelSums::default(), true);
                continue;
            }
            let efforts = &self.efforts[j];
            let about_mean = efforts.squares - efforts.sum * efforts.sum / *rows as f64;
            // Rows of a joint at rest hold friction that no model of the speed tells.
            let varies = self.log.moves[j] && about_mean > 1e-12 * efforts.squares;
            let of_output = ChannelSums {
                samples: *rows,
                error_energy: *error_energy,
                energy: efforts.squares,
                variation: if varies { about_mean } else { 0.0 },
                range: (efforts.greatest - efforts.least).max(0.0),
                ..ChannelSums::default()
            };
            sums.add(&of_output, true);
        }
        sums
    }
}
