//! Residuals of all rollouts and what Gauss-Newton needs of them, block of time by block of time.

use dynid_linalg::Mat;
use rayon::prelude::*;

use crate::chain::Chain;
use crate::channel::Channel;
use crate::free::{Free, ServoValues};
use crate::joint::Scheme;
use crate::log::ServoLog;
use crate::rollout::{Count, Lost, Rollout, Simulated};
use crate::term::Term;

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
    /// What the sum of squares holds, as far as a log measures it: positions first. All lists by reading go channel by channel, joint by
    /// joint in each.
    pub channels: &'a [Channel],
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
    /// Squared residuals by reading, not weighted.
    pub squares: Vec<f64>,
    /// Rows by reading.
    pub rows: Vec<usize>,
    /// Squared residuals by reading, those of encoders that stand still as far as they count, and the readings that they count for.
    pub(crate) counted: Vec<(f64, f64)>,
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
    /// `sigma`: standard deviation of every reading for the weights; `slopes`: whether sums for Gauss-Newton are wanted too.
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
        let readings = n * problem.channels.len();
        assert_eq!(sigma.len(), readings, "one standard deviation per reading");
        let tasks: Vec<(usize, &Chain)> = (0..problem.logs.len())
            .flat_map(|l| problem.chains.iter().map(move |c| (l, c)))
            .filter(|(_, chain)| !chain.is_empty())
            .collect();
        let parts: Vec<Result<Part, Lost>> =
            tasks.par_iter().map(|(l, chain)| part(problem, values, sigma, slopes, (*l, chain))).collect();
        let empty = |_: &Block| BlockSums {
            hessian: Mat::zeros(p, p),
            gradient: vec![0.0; p],
            squares: vec![0.0; readings],
            rows: vec![0; readings],
            counted: vec![(0.0, 0.0); readings],
        };
        let mut blocks: Vec<BlockSums> = problem.blocks.iter().map(empty).collect();
        let mut count = Count::default();
        for ((log, chain), part) in tasks.iter().zip(parts) {
            let part = part?;
            count.steps += part.count.steps;
            count.unsettled += part.count.unsettled;
            let of_log = (0..blocks.len()).filter(|b| problem.blocks[*b].log == *log);
            for (b, sums) in of_log.zip(&part.sums) {
                let to = &mut blocks[b];
                for c in 0..problem.channels.len() {
                    for (k, j) in chain.joints.iter().enumerate() {
                        let (to_at, at) = (c * n + j, c * chain.len() + k);
                        to.squares[to_at] += sums.squares[at];
                        to.rows[to_at] += sums.rows[at];
                        to.counted[to_at].0 += sums.counted[at].0;
                        to.counted[to_at].1 += sums.counted[at].1;
                    }
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

    /// Mean square of the residuals of every reading over a choice of blocks; 0 where none of them measures it. Those of the joints'
    /// positions come first.
    pub fn mean_squares(&self, take: &dyn Fn(usize) -> bool) -> Vec<f64> {
        let n = self.sigma.len();
        let (mut squares, mut rows) = (vec![0.0; n], vec![0; n]);
        for (_, block) in self.blocks.iter().enumerate().filter(|(b, _)| take(*b)) {
            squares.iter_mut().zip(&block.squares).for_each(|(s, b)| *s += b);
            rows.iter_mut().zip(&block.rows).for_each(|(r, b)| *r += b);
        }
        squares.iter().zip(rows).map(|(s, rows)| s / (rows as f64).max(1.0)).collect()
    }

    /// Variance of every reading over a choice of blocks, encoders that stand still as far as they count; 0 where none measures it.
    pub(crate) fn variances(&self, take: &dyn Fn(usize) -> bool) -> Vec<f64> {
        let mut out = vec![(0.0, 0.0); self.sigma.len()];
        for (_, block) in self.blocks.iter().enumerate().filter(|(b, _)| take(*b)) {
            out.iter_mut().zip(&block.counted).for_each(|(o, b)| *o = (o.0 + b.0, o.1 + b.1));
        }
        out.iter().map(|(squares, count)| if *count > 0.0 { squares / count } else { 0.0 }).collect()
    }

    /// Weighted sum of squares over a choice of blocks, by given standard deviations.
    pub fn loss(&self, sigma: &[f64], take: &dyn Fn(usize) -> bool) -> f64 {
        let block = |b: &BlockSums| b.counted.iter().zip(sigma).map(|(s, sd)| s.0 / (sd * sd)).sum::<f64>();
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

/// Lists by reading go channel by channel, joint by joint of the chain.
struct PartSums {
    /// Lower triangle, row-major.
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    squares: Vec<f64>,
    rows: Vec<usize>,
    counted: Vec<(f64, f64)>,
}

impl PartSums {
    /// Adds a reading at its place; `counts`: for how many readings.
    fn add(&mut self, at: usize, sigma: f64, counts: f64, seen: &Reading<'_>) {
        let residual = seen.measured - seen.simulated;
        self.rows[at] += 1;
        self.squares[at] += residual * residual;
        self.counted[at].0 += counts * (residual * residual);
        self.counted[at].1 += counts;
        let weight = counts / (sigma * sigma);
        let more = || seen.more.iter().filter_map(|(column, by)| Some(((*column)?, by)));
        if seen.factor == 1.0 && more().next().is_none() {
            self.add_products(seen.slope, weight, residual);
            return;
        }
        let mut whole: Vec<f64> = seen.slope.iter().map(|by| seen.factor * by).collect();
        more().for_each(|(column, by)| whole[column] += by);
        self.add_products(&whole, weight, residual);
    }

    fn add_products(&mut self, slope: &[f64], weight: f64, residual: f64) {
        let p = slope.len();
        for (i, by) in slope.iter().enumerate() {
            let by = weight * by;
            if by == 0.0 {
                continue;
            }
            self.gradient[i] += by * residual;
            let line = &mut self.hessian[i * p..][..=i];
            line.iter_mut().zip(slope).for_each(|(h, other)| *h += by * other);
        }
    }
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
        squares: vec![0.0; chain.len() * problem.channels.len()],
        rows: vec![0; chain.len() * problem.channels.len()],
        counted: vec![(0.0, 0.0); chain.len() * problem.channels.len()],
    };
    let counted = log.counted();
    let mut sums: Vec<PartSums> = ends.iter().map(|_| empty()).collect();
    let block_of = |row: usize| ends.partition_point(|end| *end <= row).min(ends.len() - 1);
    let weights: Vec<Vec<f64>> = chain.joints.iter().map(|j| log.weights(*j)).collect();
    let mut add = |seen: Reading<'_>| {
        if counted[seen.row] {
            let (c, k) = seen.at;
            let sigma = sigma[c * values.joints.len() + chain.joints[k]];
            let counts = if problem.channels[c] == Channel::Position { weights[k][seen.row] } else { 1.0 };
            if counts == 0.0 || seen.measured.is_nan() {
                return;
            }
            sums[block_of(seen.row)].add(c * chain.len() + k, sigma, counts, &seen);
        }
    };
    let count = see_readings(problem.channels, values, log, (chain, &rollout), &mut add)?;
    Ok(Part { columns: rollout.columns().to_vec(), sums, count })
}

/// Simulated readings of all logs that measure them, reading by reading, log by log; `NaN` in rows between gaps of the clock, which no rollout reaches.
pub(crate) fn readings(problem: &ServoProblem<'_>, values: &ServoValues) -> Result<Vec<Vec<f64>>, Lost> {
    let n = values.joints.len();
    let mut out = vec![Vec::new(); n * problem.channels.len()];
    for log in problem.logs {
        let slots = problem.channels.iter().flat_map(|c| (0..n).map(move |j| (*c, j)));
        let mut begin = Vec::with_capacity(out.len());
        for (to, (channel, j)) in out.iter_mut().zip(slots) {
            begin.push(to.len());
            let rows = log.measured(channel, j).map_or(0, <[f64]>::len);
            to.resize(to.len() + rows, f64::NAN);
        }
        for chain in problem.chains {
            let rollout = Rollout::new(chain, problem.scheme, &[]);
            let mut keep = |seen: Reading<'_>| {
                let slot = seen.at.0 * n + chain.joints[seen.at.1];
                out[slot][begin[slot] + seen.row] = seen.simulated;
            };
            see_readings(problem.channels, values, log, (chain, &rollout), &mut keep)?;
        }
    }
    Ok(out)
}

/// What a log reads of one channel of one joint in one row, and what the simulation does.
struct Reading<'a> {
    row: usize,
    /// Channel of the problem and joint of the chain.
    at: (usize, usize),
    measured: f64,
    simulated: f64,
    /// Slopes of the simulated one: `factor` times these, and what parameters of its own add.
    slope: &'a [f64],
    factor: f64,
    more: [(Option<usize>, f64); 2],
}

/// Simulates a chain along a log and shows everything that the log measures of it.
fn see_readings(
    channels: &[Channel],
    values: &ServoValues,
    log: &ServoLog,
    (chain, rollout): (&Chain, &Rollout<'_>),
    see: &mut impl FnMut(Reading<'_>),
) -> Result<Count, Lost> {
    let p = rollout.columns().len();
    let measured: Vec<(usize, Channel, usize, &[f64])> = channels
        .iter()
        .enumerate()
        .flat_map(|(c, channel)| chain.joints.iter().enumerate().map(move |(k, j)| (c, *channel, k, *j)))
        .filter_map(|(c, channel, k, j)| Some((c, channel, k, log.measured(channel, j)?)))
        .collect();
    let meters: Vec<Meter> =
        (0..chain.len()).map(|k| Meter::of(values, rollout, chain.joints[k], k)).collect();
    rollout.run_with_efforts(values, log, |seen| match seen {
        Simulated::Row(row) => {
            for (c, channel, k, measured) in measured.iter().filter(|m| !m.1.tells_effort()) {
                let own = *k * p..(*k + 1) * p;
                let (simulated, slope, factor) = match channel {
                    Channel::Velocity => {
                        let direction = meters[*k].direction;
                        (direction * row.velocity[*k], &row.velocity_by_parameter[own], direction)
                    }
                    _ => (row.reading[*k], &row.by_parameter[own], 1.0),
                };
                let more = [(None, 0.0); 2];
                let (row, measured) = (row.row, measured[row.row]);
                see(Reading { row, at: (*c, *k), measured, simulated, slope, factor, more });
            }
        }
        Simulated::Effort(seen) => {
            let own = measured.iter().filter(|m| m.1.tells_effort() && m.2 == seen.joint);
            for (c, channel, k, measured) in own {
                let read = meters[*k].read(*channel, seen.effort);
                see(Reading {
                    row: seen.row,
                    at: (*c, *k),
                    measured: measured[seen.row],
                    simulated: read.value,
                    slope: seen.by_parameter,
                    factor: read.factor,
                    more: read.more,
                });
            }
        }
    })
}

/// How the effort of a joint is read, `s τ + z_τ` and `s τ/k_t + z_i`.
struct Meter {
    direction: f64,
    constant: f64,
    effort_zero: f64,
    current_zero: f64,
    /// Columns of the three.
    columns: [Option<usize>; 3],
}

/// A reading and its slopes.
struct Read {
    value: f64,
    /// By the effort.
    factor: f64,
    /// By the parameters of the meter.
    more: [(Option<usize>, f64); 2],
}

impl Meter {
    fn of(values: &ServoValues, rollout: &Rollout<'_>, robot: usize, chain: usize) -> Self {
        let joint = &values.joints[robot];
        let terms = [Term::TorqueConstant, Term::EffortZero, Term::CurrentZero];
        Meter {
            direction: joint.direction,
            constant: joint.get(Term::TorqueConstant),
            effort_zero: joint.get(Term::EffortZero),
            current_zero: joint.get(Term::CurrentZero),
            columns: terms.map(|term| rollout.column_of(term, chain)),
        }
    }

    fn read(&self, channel: Channel, effort: f64) -> Read {
        let own = self.direction * effort;
        let [constant, effort_zero, current_zero] = self.columns;
        if channel == Channel::Current {
            let value = own / self.constant;
            let more = [(constant, -value / self.constant), (current_zero, 1.0)];
            return Read { value: value + self.current_zero, factor: self.direction / self.constant, more };
        }
        let more = [(effort_zero, 1.0), (None, 0.0)];
        Read { value: own + self.effort_zero, factor: self.direction, more }
    }
}
