//! From factors to an identification.

use dynid_estimate::linear::estimate;
use dynid_estimate::metrics::{ChannelSums, FitSums};
use dynid_factor::groups::ReducedGroup;

use super::recipe::{Solved, training_log};
use super::{LogFacts, Reduction, ReductionError};
use crate::Error;
use crate::consistency;
use crate::finding::Finding;
use crate::fitting::{self, Fitted, RowResiduals};
use crate::identification::Identification;
use crate::log::{Log, LogSource};
use crate::overlap::Overlaps;
use crate::pipeline::{Beside, EXPLAINED, ModelFit, Step, assemble, explained};
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
        let columns = problem.structure.base.len();
        let groups: Vec<ReducedGroup> = (self.logs.iter().enumerate())
            .flat_map(|(k, log)| log.groups.iter().map(move |g| ReducedGroup { log: k, ..g.clone() }))
            .collect();
        progress(Step::Fit);
        fitting::check_rows(&groups, columns, || self.logs[0].facts.name.clone())?;
        let settings = fitting::linear_settings(&problem.settings);
        let found = estimate(&groups, None, columns, &problem.structure.method, &settings)?;
        let logs: Vec<&TrainedLog> = self.logs.iter().map(|log| &log.facts.log).collect();
        let fitted = Fitted::with_blocks(found, self.recipe.blocks.wanted_s, &logs);
        progress(Step::Consistency);
        let consistent = consistency::consistent(&problem, &fitted, &groups)?;
        let rates: Vec<f64> = self.logs.iter().map(|log| log.facts.log.rate_hz).collect();
        let base = problem.structure.base.values(&consistent.values);
        let fit = ModelFit {
            conditioning: Some(self.recipe.conditioning(&rates)),
            friction: Vec::new(),
            cyclic: Vec::new(),
            shapes,
            simulations: None,
            residuals: RowResiduals::none(),
            fitted,
            groups,
            consistent,
            power,
            loads: None,
        };
        let row_fits: Vec<RowFit> = (self.logs.iter())
            .map(|log| row_fit(&log.facts, &log.groups, &base, self.recipe.outputs.len()))
            .collect();
        let source = |facts: &LogFacts| LogSource { inputs: facts.inputs.clone(), ..LogSource::default() };
        let named = |facts: &LogFacts| TrainedLog { name: facts.name.clone(), ..facts.log.clone() };
        let facts = || self.logs.iter().map(|log| &log.facts);
        let of_log = |(k, facts): (usize, &LogFacts)| -> Vec<Finding> {
            facts.findings.iter().map(|f| f.finding(&facts.name, k)).collect()
        };
        let findings = facts().enumerate().flat_map(of_log).collect();
        let beside = Beside {
            training: facts().map(named).collect(),
            sources: facts().map(source).collect(),
            findings,
            overlaps: Overlaps::default(),
            own_delays: Vec::new(),
            warnings: facts().flat_map(|facts| facts.cautions.iter().cloned()).collect(),
            reading: Vec::new(),
            comparison: None,
        };
        let (mut out, left) = assemble(problem, fit, beside)?;
        for log in validation {
            progress(Step::Validate(log.log.name().to_owned()));
            out.validate(log)?;
        }
        progress(Step::Trust);
        let rows = |j: usize| {
            row_fits.iter().filter_map(move |rows| rows.fit.channels[j].r2).all(|r2| r2 >= EXPLAINED)
        };
        let samples = explained(out.validation.iter(), self.recipe.outputs.len(), &out.consistent);
        out.explained = samples.into_iter().enumerate().map(|(j, held)| held && rows(j)).collect();
        out.recipe_doubts.clone_from(&self.recipe.doubts);
        out.row_fits = row_fits;
        out.judge(&left)?;
        Ok(out)
    }
}

/// How well the rows of a log are explained by values in base columns.
fn row_fit(facts: &LogFacts, groups: &[ReducedGroup], x: &[f64], outputs: usize) -> RowFit {
    let mut of_outputs = vec![ChannelSums::default(); outputs];
    for group in groups.iter().filter(|g| g.scale == 0 && g.rows() > 0) {
        let (j, n) = (group.output, group.rows() as f64);
        let efforts = &facts.efforts[j];
        let about_mean = efforts.squares - efforts.sum * efforts.sum / n;
        // Rows of a joint at rest hold friction that no model of the speed tells.
        let varies = facts.log.moves[j] && about_mean > 1e-12 * efforts.squares;
        of_outputs[j] = ChannelSums {
            samples: group.rows(),
            error_energy: group.merged(x.len()).rss(x),
            energy: efforts.squares,
            variation: if varies { about_mean } else { 0.0 },
            range: (efforts.greatest - efforts.least).max(0.0),
            ..ChannelSums::default()
        };
    }
    let mut sums = FitSums::default();
    of_outputs.iter().for_each(|of_output| sums.add(of_output, true));
    RowFit { log: facts.name.clone(), fit: sums.fit() }
}
