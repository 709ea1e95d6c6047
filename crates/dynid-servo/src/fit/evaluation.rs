//! Residuals of all rollouts and what Gauss-Newton needs of them, block of time by block of time.

use dynid_linalg::Mat;
use rayon::prelude::*;

use crate::chain::Chain;
use crate::free::{Free, ServoValues};
use crate::joint::Scheme;
use crate::log::ServoLog;
use crate::rollout::{Count, Lost, Rollout};

/// Commands and positions of a robot, and how they are simulated.
#[derive(Debug, Clone, Copy)]
pub struct ServoProblem<'a> {
    /// Chains of the robot.
    pub chains: &'a [Chain],
    /// Logs.
    pub logs: &'a [ServoLog],
    /// How motion is simulated.
    pub scheme: Scheme,
    /// What the fit is free to choose.
    pub free: &'a [Free],
    /// Blocks of time that the statistics leave out one by one.
    pub blocks: &'a [Block],
}

/// Consecutive rows of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// The log.
    pub log: usize,
    /// Its rows.
    pub rows: std::ops::Range<usize>,
}

/// Least length of a block, s: longer than a position loop remembers.
const BLOCK_S: f64 = 0.5;

/// Cuts logs into about so many blocks of equal length in time, none across two logs.
pub fn blocks(logs: &[ServoLog], about: usize) -> Vec<Block> {
    let span = |log: &ServoLog| log.time.last().zip(log.time.first()).map_or(0.0, |(b, a)| b - a);
    let whole: f64 = logs.iter().map(span).sum();
    let mut out = Vec::new();
    for (l, log) in logs.iter().enumerate() {
        let share = (about as f64 * span(log) / whole).round();
        let count = share.min((span(log) / BLOCK_S).floor()).max(1.0) as usize;
        let cut = |k: usize| k * log.rows() / count;
        out.extend((0..count).map(|k| Block { log: l, rows: cut(k)..cut(k + 1) }));
    }
    out
}

/// What one block says.
#[derive(Debug, Clone)]
pub struct BlockSums {
    /// `Jᵀ W J`.
    pub(crate) hessian: Mat,
    /// `Jᵀ W r` with `r` measured less simulated.
    pub(crate) gradient: Vec<f64>,
    /// Squared residuals per joint, not weighted.
    pub squares: Vec<f64>,
    /// Rows.
    pub rows: usize,
}

/// All blocks at one choice of parameters.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// One entry per block of the problem.
    pub blocks: Vec<BlockSums>,
    /// Standard deviations that weighted the sums.
    pub(crate) sigma: Vec<f64>,
    /// Steps of the simulations.
    pub count: Count,
}

impl Evaluation {
    /// Simulates everything at these values.
    ///
    /// `sigma`: standard deviation of every joint's readings for the weights; `slopes`: whether sums for Gauss-Newton are wanted too.
    ///
    /// # Errors
    /// [`Lost`].
    pub fn new(
        problem: &ServoProblem<'_>,
        values: &ServoValues,
        sigma: &[f64],
        slopes: bool,
    ) -> Result<Evaluation, Lost> {
        let (p, n) = (if slopes { problem.free.len() } else { 0 }, values.joints.len());
        let tasks: Vec<(usize, &Chain)> = (0..problem.logs.len())
            .flat_map(|l| problem.chains.iter().map(move |c| (l, c)))
            .filter(|(_, chain)| !chain.is_empty())
            .collect();
        let parts: Vec<Result<Part, Lost>> =
            tasks.par_iter().map(|(l, chain)| part(problem, values, sigma, slopes, (*l, chain))).collect();
        let empty = |_: &Block| BlockSums {
            hessian: Mat::zeros(p, p),
            gradient: vec![0.0; p],
            squares: vec![0.0; n],
            rows: 0,
        };
        let mut blocks: Vec<BlockSums> = problem.blocks.iter().map(empty).collect();
        let mut count = Count::default();
        let Some((_, first)) = tasks.first() else {
            return Ok(Evaluation { blocks, sigma: sigma.to_vec(), count });
        };
        for ((log, chain), part) in tasks.iter().zip(parts) {
            let part = part?;
            count.steps += part.count.steps;
            count.unsettled += part.count.unsettled;
            let of_log = (0..blocks.len()).filter(|b| problem.blocks[*b].log == *log);
            for (b, sums) in of_log.zip(&part.sums) {
                let to = &mut blocks[b];
                if chain.joints == first.joints {
                    to.rows += sums.rows;
                }
                for (j, squares) in chain.joints.iter().zip(&sums.squares) {
                    to.squares[*j] += squares;
                }
                let q = part.columns.len();
                for (i, row) in part.columns.iter().enumerate() {
                    to.gradient[*row] += sums.gradient[i];
                    for (k, column) in part.columns[..=i].iter().enumerate() {
                        let entry = sums.hessian[i * q + k];
                        to.hessian[(*row, *column)] += entry;
                        if i != k {
                            to.hessian[(*column, *row)] += entry;
                        }
                    }
                }
            }
        }
        Ok(Evaluation { blocks, sigma: sigma.to_vec(), count })
    }

    /// Mean square of every joint's residuals over a choice of blocks.
    pub fn mean_squares(&self, take: &dyn Fn(usize) -> bool) -> Vec<f64> {
        let n = self.sigma.len();
        let (mut squares, mut rows) = (vec![0.0; n], 0);
        for (_, block) in self.blocks.iter().enumerate().filter(|(b, _)| take(*b)) {
            squares.iter_mut().zip(&block.squares).for_each(|(s, b)| *s += b);
            rows += block.rows;
        }
        squares.iter().map(|s| s / (rows as f64).max(1.0)).collect()
    }

    /// Weighted sum of squares over a choice of blocks, by given standard deviations.
    pub fn loss(&self, sigma: &[f64], take: &dyn Fn(usize) -> bool) -> f64 {
        let block = |b: &BlockSums| b.squares.iter().zip(sigma).map(|(s, sd)| s / (sd * sd)).sum::<f64>();
        self.blocks.iter().enumerate().filter(|(b, _)| take(*b)).map(|(_, b)| block(b)).sum()
    }

    /// Sums for Gauss-Newton over a choice of blocks.
    pub(crate) fn normal(&self, take: &dyn Fn(usize) -> bool) -> (Mat, Vec<f64>) {
        let p = self.blocks.first().map_or(0, |b| b.gradient.len());
        let (mut hessian, mut gradient) = (Mat::zeros(p, p), vec![0.0; p]);
        for (_, block) in self.blocks.iter().enumerate().filter(|(b, _)| take(*b)) {
            for (c, (to, from)) in gradient.iter_mut().zip(&block.gradient).enumerate() {
                *to += from;
                let (to, from) = (hessian.col_mut(c), block.hessian.col(c));
                to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
            }
        }
        (hessian, gradient)
    }
}

/// Sums of one chain along one log.
struct Part {
    columns: Vec<usize>,
    sums: Vec<PartSums>,
    count: Count,
}

struct PartSums {
    /// Lower triangle, row-major.
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    squares: Vec<f64>,
    rows: usize,
}

fn part(
    problem: &ServoProblem<'_>,
    values: &ServoValues,
    sigma: &[f64],
    slopes: bool,
    (l, chain): (usize, &Chain),
) -> Result<Part, Lost> {
    let log = &problem.logs[l];
    let rollout = Rollout::new(chain, problem.scheme, if slopes { problem.free } else { &[] });
    let p = rollout.columns().len();
    let ends: Vec<usize> = problem.blocks.iter().filter(|b| b.log == l).map(|b| b.rows.end).collect();
    let empty = || PartSums {
        hessian: vec![0.0; p * p],
        gradient: vec![0.0; p],
        squares: vec![0.0; chain.len()],
        rows: 0,
    };
    let counted = log.counted();
    let mut sums: Vec<PartSums> = ends.iter().map(|_| empty()).collect();
    let mut at = 0;
    let count = rollout.run(values, log, |row| {
        while at + 1 < ends.len() && row.row >= ends[at] {
            at += 1;
        }
        if !counted[row.row] {
            return;
        }
        let to = &mut sums[at];
        to.rows += 1;
        for (j, robot) in chain.joints.iter().enumerate() {
            let residual = log.position[*robot][row.row] - row.reading[j];
            to.squares[j] += residual * residual;
            let weight = 1.0 / (sigma[*robot] * sigma[*robot]);
            let slope = &row.by_parameter[j * p..][..p];
            for (i, by) in slope.iter().enumerate() {
                let by = weight * by;
                if by == 0.0 {
                    continue;
                }
                to.gradient[i] += by * residual;
                let line = &mut to.hessian[i * p..][..=i];
                line.iter_mut().zip(slope).for_each(|(h, other)| *h += by * other);
            }
        }
    })?;
    Ok(Part { columns: rollout.columns().to_vec(), sums, count })
}
