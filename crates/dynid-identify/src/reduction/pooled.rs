//! From what many logs say together, pooled elsewhere, to an identification: a type of robots, or one of them.

use dynid_estimate::linear::of_unit_variance;
use dynid_estimate::metrics::FitSums;
use dynid_factor::Factor;
use dynid_factor::groups::ReducedGroup;
use dynid_linalg::Mat;
use dynid_record::Basis;

use super::recipe::{Solved, training_log};
use super::solve::Solution;
use super::{Recipe, ReductionError};
use crate::Error;
use crate::caution::Caution;
use crate::consistency;
use crate::finding::Finding;
use crate::fitting::Fitted;
use crate::identification::Identification;
use crate::log::LogSource;
use crate::overlap::Overlaps;
use crate::pipeline::{Beside, EXPLAINED};
use crate::settings::PriorDistance;
use crate::trained_log::{RowFit, TrainedLog};

/// What logs say of the columns of a recipe, pooled by whoever has their factors.
#[derive(Debug, Clone)]
pub struct Pooled {
    /// Rows `[W y]` of unit variance in all columns, block by block (robot by robot), in a fixed order; of one block nothing is held out.
    pub blocks: Vec<Factor>,
    /// Covariance of the values of the columns, `p × p`.
    pub covariance: Mat,
    /// What that rests on.
    pub basis: Basis,
    /// Robots behind it.
    pub robots: usize,
    /// Distance from the prior and its weight; absent: found on blocks that are held out.
    pub prior: Option<(PriorDistance, f64)>,
    /// Per output and kernel the rows of the efforts, log 0, unweighted and without what single robots and logs have of their own.
    pub rows: Vec<ReducedGroup>,
    /// Sums over the rows of the widest kernel, output by output.
    pub sums: FitSums,
    /// All logs as if they were one; its name stands for them in messages.
    pub log: TrainedLog,
    /// What the pre-flight of the logs found, of log 0.
    pub findings: Vec<Finding>,
    /// What is to be known beside the checks.
    pub cautions: Vec<Caution>,
}

impl Pooled {
    /// Per output: whether at least half of what its effort varies by is explained; true where it does not vary.
    pub fn explained(&self) -> Vec<bool> {
        let channels = self.sums.clone().fit().channels;
        channels.iter().map(|channel| channel.r2.is_none_or(|r2| r2 >= EXPLAINED)).collect()
    }
}

impl Recipe {
    /// Solves for the parameters that pooled rows tell: bodies that can exist, intervals, verdicts.
    ///
    /// Held-out figures are those of blocks, over all joints together. An output that is not explained ([`Pooled::explained`]) should have lost
    /// its weight in [`Pooled::blocks`], since a block holds all outputs.
    ///
    /// # Errors
    /// [`Error::Reduction`] for pooled rows of another recipe; [`Error::Consistency`].
    pub fn solve_pooled(&self, pooled: Pooled) -> Result<Identification, Error> {
        let (mut problem, Solved { shapes, power }) = self.problem()?;
        let (columns, outputs) = (problem.structure.base.len(), self.outputs.len());
        let fits = pooled.blocks.iter().all(|block| block.columns() == columns)
            && pooled.covariance.nrows() == columns
            && pooled.sums.clone().fit().channels.len() == outputs;
        if !fits {
            let what = "pooled rows of another recipe".to_owned();
            return Err(ReductionError::Contradiction { what }.into());
        }
        problem.training = vec![training_log(&pooled.log.name)];
        problem.settings.files.robot.clone_from(&problem.robot.path);
        if let Some((distance, weight)) = pooled.prior {
            problem.settings.estimator.prior = Some(distance);
            problem.settings.estimator.prior_weight = Some(weight);
        }
        let explained = pooled.explained();
        // All efforts together are an output of their own, behind the others.
        let group = ReducedGroup {
            log: 0,
            output: outputs,
            scale: 0,
            columns: (0..columns).collect(),
            blocks: pooled.blocks,
        };
        let found = of_unit_variance(group.clone(), columns);
        let basis = (pooled.basis, pooled.robots);
        let fitted = Fitted::pooled(found, &pooled.covariance, basis, outputs, pooled.log.duration_s);
        let consistent = consistency::consistent(&problem, &fitted, &[group])?;
        let row_fits = vec![RowFit { log: pooled.log.name.clone(), fit: pooled.sums.fit() }];
        let solution = Solution { fitted, groups: pooled.rows, consistent, shapes, power };
        let beside = Beside {
            training: vec![pooled.log],
            sources: vec![LogSource::default()],
            findings: pooled.findings,
            overlaps: Overlaps::default(),
            own_delays: Vec::new(),
            warnings: pooled.cautions,
            reading: Vec::new(),
            comparison: None,
        };
        let (mut out, left) = self.assembled(problem, solution, beside, row_fits)?;
        out.explained = explained;
        out.judge(&left)?;
        Ok(out)
    }
}
