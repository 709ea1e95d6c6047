//! Gauss-Newton on what a log may be read by in any amount: the direction of gravity, the zero of a joint, the clock.

use dynid_model::{EffortModel, RegressorBlock};

use super::PreflightError;
use super::rows::{deviation, reduce, regressor, row_weight};
use super::samples::{BLOCKS, Samples};
use super::stated::with_effort;
use super::wiring::Wiring;
use crate::conditioning::KeptColumns;
use dynid_estimate::covariance::jackknife_by;
use dynid_estimate::linear::ols_values;
use dynid_factor::factor::Factor;

/// Gauss-Newton steps.
const STEPS: usize = 8;
/// A step below this ends them, rad.
const SETTLED: f64 = 1e-4;
/// Longest step, rad; of the clock, in its natural logarithm.
const LONGEST: f64 = 0.7;
/// Step of the differences that the clock and zeros are varied by.
const DIFFERENCE: f64 = 1e-3;
/// Least part of what an unknown does that the other parameters must not be able to do.
const LEFT: f64 = 0.05;

/// Prior of all linear parameters of a model.
#[derive(Debug, Clone, Copy)]
pub struct GaussianPrior<'a> {
    /// Values.
    pub values: &'a [f64],
    /// Standard deviations.
    pub std: &'a [f64],
    /// Weight.
    pub weight: f64,
}

/// What is fitted together with all parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Unknown {
    /// The direction of gravity, as long as the one stated.
    Gravity,
    /// The zero of a joint.
    Zero(usize),
    /// The logarithm of the clock's unit.
    Clock,
}

/// A log, its model and what is known of the parameters.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub(crate) model: &'a dyn EffortModel,
    pub(crate) shape: &'a [f64],
    /// Base columns.
    pub(crate) kept: &'a [usize],
    pub(crate) samples: &'a Samples,
    /// Gravity as stated, m/s².
    pub(crate) gravity: [f64; 3],
    pub(crate) prior: GaussianPrior<'a>,
}

/// Outcome of [`Problem::refine`].
#[derive(Debug, Clone)]
pub(crate) struct Refined {
    pub(crate) wiring: Wiring,
    /// Misfit that is left, the prior's part included.
    pub(crate) misfit: f64,
    /// Standard error, jackknife over twelve parts of the record: the root of the sum over all components; `None` if Gauss-Newton did not
    /// settle.
    pub(crate) error: Option<f64>,
}

impl Unknown {
    fn count(self) -> usize {
        if self == Unknown::Gravity { 2 } else { 1 }
    }

    /// The wiring with the unknown moved.
    fn moved(self, wiring: &Wiring, stated: [f64; 3], by: &[f64]) -> Wiring {
        let mut out = wiring.clone();
        match self {
            Unknown::Gravity => {
                let gravity = wiring.gravity.unwrap_or(stated);
                let turned = turned_by(gravity, &across(gravity), [by[0], by[1]]);
                out.gravity = Some(turned);
            }
            Unknown::Zero(joint) => out.position[joint].offset += by[0],
            Unknown::Clock => out.clock *= by[0].exp(),
        }
        out
    }
}

impl Problem<'_> {
    fn all(&self) -> KeptColumns {
        KeptColumns::new(self.model, &(0..self.model.parameters().linear.len()).collect::<Vec<_>>())
    }

    fn block(&self, wiring: &Wiring) -> RegressorBlock {
        regressor(self.model, self.shape, self.samples, wiring)
    }

    /// Parameters that a Gaussian prior alone holds, as they explain a wiring best, and their misfit.
    ///
    /// # Errors
    /// [`PreflightError`] if a regressor is not finite.
    pub(crate) fn fit(&self, wiring: &Wiring) -> Result<Solved, PreflightError> {
        self.fit_block(&self.block(wiring), &self.all(), wiring)
    }

    fn fit_block(
        &self,
        block: &RegressorBlock,
        columns: &KeptColumns,
        wiring: &Wiring,
    ) -> Result<Solved, PreflightError> {
        Ok(solve(&merged(&self.parts(block, columns, wiring, &[], 1)?), &self.prior, 0))
    }

    /// Fits an unknown together with all parameters, from where a wiring has it; `None` where the log does not tell it.
    /// `worth`: misfit that the first step has to promise; `values`: parameters that explain the start best, if they are known.
    ///
    /// # Errors
    /// [`PreflightError`] if a regressor is not finite.
    pub(crate) fn refine(
        &self,
        start: &Wiring,
        unknown: Unknown,
        worth: f64,
        values: Option<&[f64]>,
    ) -> Result<Option<Refined>, PreflightError> {
        let columns = self.all();
        let mut wiring = start.clone();
        let mut values = values.map(<[f64]>::to_vec);
        for step in 1..=STEPS {
            let last = step == STEPS;
            let block = self.block(&wiring);
            let x = match values.take() {
                Some(x) => x,
                None => self.fit_block(&block, &columns, &wiring)?.x,
            };
            // Rows that outweigh the prior by all digits leave a triangle that is singular.
            let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
            if !finite(&x) {
                return Ok(None);
            }
            // What the unknown does to every effort, per unit.
            let changes: Vec<Vec<Vec<f64>>> = (0..unknown.count())
                .map(|k| {
                    let mut by = [0.0; 2];
                    by[k] = DIFFERENCE;
                    let other = self.block(&unknown.moved(&wiring, self.gravity, &by));
                    let change = |output: usize| {
                        let (a, b) = (other.effort(output, &x), block.effort(output, &x));
                        a.iter().zip(&b).map(|(a, b)| (a - b) / DIFFERENCE).collect()
                    };
                    (0..self.samples.joints.len()).map(change).collect()
                })
                .collect();
            let parts = self.parts(&block, &columns, &wiring, &changes, BLOCKS)?;
            let whole = merged(&parts);
            if !is_seen(&whole, self.kept, columns.total) {
                return Ok(None);
            }
            let Solved { x, more, misfit } = solve(&whole, &self.prior, unknown.count());
            if misfit > worth || !finite(&more) {
                return Ok(None);
            }
            let step: Vec<f64> = more.iter().map(|s| s.clamp(-LONGEST, LONGEST)).collect();
            wiring = unknown.moved(&wiring, self.gravity, &step);
            values = Some(x);
            let settled = more.iter().map(|s| s * s).sum::<f64>().sqrt() < SETTLED;
            if last && !settled {
                return Ok(Some(Refined { wiring, misfit, error: None }));
            }
            if settled {
                let without = |rest: &Factor| Some(solve(rest, &self.prior, unknown.count()).more);
                let changes = jackknife_by(&parts, &more, without).map(|found| found.changes);
                return Ok(Some(Refined { wiring, misfit, error: changes.map(|c| spread(&c)) }));
            }
        }
        Ok(None)
    }

    /// Weighted factors of so many parts of the record, 1 or [`BLOCKS`], in all columns and one more per component of an unknown.
    fn parts(
        &self,
        block: &RegressorBlock,
        columns: &KeptColumns,
        wiring: &Wiring,
        changes: &[Vec<Vec<f64>>],
        blocks: usize,
    ) -> Result<Vec<Factor>, PreflightError> {
        let samples = self.samples;
        let total = columns.total + changes.len();
        let mut out: Vec<Vec<Factor>> = vec![Vec::new(); blocks];
        for output in 0..samples.joints.len() {
            let source = wiring.effort[output];
            let effort: Vec<f64> =
                samples.joints[source.joint].effort.iter().map(|e| source.factor * e).collect();
            let mut beside: Vec<&[f64]> = changes.iter().map(|t| t[output].as_slice()).collect();
            beside.push(&effort);
            let own = columns.local[output].len();
            let mut positions = columns.global[output].clone();
            positions.extend(columns.total..total);
            let parts = reduce(block, columns, samples, &wiring.position, output, &beside, blocks)?;
            let rows: usize = parts.iter().map(Factor::rows).sum();
            let Some(weight) = row_weight(rows.max(1), deviation(&effort), samples.duration_s, samples.len())
            else {
                continue;
            };
            for (to, part) in out.iter_mut().zip(parts).filter(|(_, p)| p.rows() > 0) {
                // The effort came in as the last column.
                let p = own + changes.len();
                let height = part.height();
                let entry = |i: usize, k: usize| if i < height { part.r(i, k) } else { 0.0 };
                let below = (p..height).map(|i| part.r(i, p).powi(2)).sum::<f64>().sqrt();
                let factor = Factor::from_triangle(p, entry, below, part.rows());
                to.push(factor.scaled(weight).embed(total, &positions));
            }
        }
        Ok(out
            .iter()
            .map(|parts| match parts.is_empty() {
                true => Factor::empty(total),
                false => Factor::merge(&parts.iter().collect::<Vec<_>>()),
            })
            .collect())
    }
}

/// Whether an unknown is anything but what the other parameters do: an offset takes the place of the tilt of a slide.
fn is_seen(whole: &Factor, kept: &[usize], all: usize) -> bool {
    let independent: Vec<usize> = kept.iter().copied().chain(all..whole.columns()).collect();
    let whole = whole.select(&independent);
    // Columns that the present gravity takes away leave the triangle singular.
    (kept.len()..whole.columns()).all(|column| {
        let height = whole.height().min(column + 1);
        let power: f64 = (0..height).map(|row| whole.r(row, column).powi(2)).sum();
        ols_values(&with_effort(&whole, column, column)).1 > LEFT * LEFT * power
    })
}

fn merged(parts: &[Factor]) -> Factor {
    Factor::merge(&parts.iter().collect::<Vec<_>>())
}

/// Standard error by what leaving out one part after the other changes: the root of the sum over all components.
fn spread(changes: &[Vec<f64>]) -> f64 {
    let count = changes.len() as f64;
    let of_component = |k: usize| {
        let mean = changes.iter().map(|c| c[k]).sum::<f64>() / count;
        changes.iter().map(|c| (c[k] - mean).powi(2)).sum::<f64>()
    };
    let components = changes.first().map_or(0, Vec::len);
    ((count - 1.0) / count * (0..components).map(of_component).sum::<f64>()).sqrt()
}

/// Parameters that explain a log best, and what is left of it.
pub(crate) struct Solved {
    pub(crate) x: Vec<f64>,
    /// What was fitted beside them.
    more: Vec<f64>,
    pub(crate) misfit: f64,
}

/// Parameters, and so many more behind them.
fn solve(rows: &Factor, prior: &GaussianPrior<'_>, more: usize) -> Solved {
    let root = prior.weight.sqrt();
    let mut weights: Vec<f64> = prior.std.iter().map(|s| root / s).collect();
    let mut centre = prior.values.to_vec();
    // Nothing is known of the unknown, but where the log does not tell it either it stays.
    weights.extend(std::iter::repeat_n(1e-3, more));
    centre.extend(std::iter::repeat_n(0.0, more));
    let (mut x, misfit) = ols_values(&rows.with_prior_rows(&weights, &centre));
    let more = x.split_off(prior.values.len());
    Solved { x, more, misfit }
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

pub(crate) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Two unit vectors across a direction.
fn across(direction: [f64; 3]) -> [[f64; 3]; 2] {
    let least = (0..3).min_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs())).unwrap_or(0);
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let unit = |v: [f64; 3]| v.map(|x| x / norm(v));
    let first = unit(cross(direction, axis));
    [first, unit(cross(direction, first))]
}

/// Gravity turned by small angles towards two vectors across it.
fn turned_by(gravity: [f64; 3], across: &[[f64; 3]; 2], turn: [f64; 2]) -> [f64; 3] {
    let size = norm(gravity);
    let moved: [f64; 3] =
        std::array::from_fn(|k| gravity[k] + size * (turn[0] * across[0][k] + turn[1] * across[1][k]));
    moved.map(|x| x * size / norm(moved))
}
