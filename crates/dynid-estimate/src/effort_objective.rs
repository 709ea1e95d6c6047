//! Misfit of an effort model as a function of all its parameters.

mod error;

use dynid_linalg::multiply_into;
use dynid_model::{EffortModel, MotionBlock, RegressorBlock};
use dynid_search::Objective;
pub use error::EffortObjectiveError;
use error::{check_efforts, check_loss};
use rayon::prelude::*;

/// How residuals `r` of an output count.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum EffortLoss {
    /// `|r|` (the default).
    #[default]
    Absolute,
    /// `r²`.
    Squared,
    /// Huber 1964: `r²/2` up to the threshold `k` of the output, `k |r| - k²/2` beyond. One threshold per output, in units
    /// of its effort, positive.
    Huber(Vec<f64>),
}

/// Misfit of efforts over all samples and outputs, as a function of linear and shape parameters together:
///
/// `F(x) = (1/N) Σ_n Σ_j δ_j ρ_j(τ_j(n) - τ̂_j(n; x))`,  `τ̂ = W(motion; shape) · linear + offset(motion)`
///
/// with weights `δ_j` (default 1) and a loss `ρ`. `x` holds the chosen linear columns in the order given (usually the kept
/// columns of base parameters; others count as 0), then all shape parameters of the model. The offset is that at the
/// start of the shape parameters.
///
/// Columns that no shape parameter changes are stored once (`8 N` bytes per entry of a row); a group of candidates costs
/// one matrix product with them, and each candidate the columns that its shape changes ([`EffortModel::shaped`]).
/// Candidates are always multiplied by eights, so a value does not depend on its group.
///
/// Source: equation 11 of the paper on the ER-16 for the absolute loss.
pub struct EffortObjective<'a> {
    model: &'a dyn EffortModel,
    chunks: Vec<Chunk<'a>>,
    samples: usize,
    linear: usize,
    shapes: usize,
    outputs: Vec<OutputColumns>,
    loss: EffortLoss,
}

/// Candidates per matrix product.
const GROUP: usize = 8;
/// Predicted efforts of all candidates above which groups are worth a thread each.
const PARALLEL: usize = 100_000;
/// Samples per matrix product: fixed columns of an output and predictions of a group stay in the cache.
const ROWS: usize = 256;

struct OutputColumns {
    weight: f64,
    /// Index into the unknowns of every fixed column.
    fixed: Vec<usize>,
    /// Index into the model's shaped columns, and into the unknowns.
    shaped: Vec<(usize, usize)>,
}

/// Some consecutive samples.
struct Chunk<'a> {
    first: usize,
    motion: MotionBlock<'a>,
    channels: Vec<(&'a str, &'a [f64])>,
    /// Per output: fixed columns, column-major.
    fixed: Vec<Vec<f64>>,
    /// Per output: measured effort without the offset.
    effort: Vec<Vec<f64>>,
}

impl<'a> Chunk<'a> {
    fn motion(&self) -> MotionBlock<'_> {
        MotionBlock { channels: &self.channels, ..self.motion }
    }
}

impl<'a> EffortObjective<'a> {
    fn room(&self) -> Room {
        Room {
            coefficients: Vec::new(),
            products: vec![0.0; self.outputs.len() * GROUP * ROWS],
            shaped: vec![0.0; self.model.shaped_columns().len() * ROWS],
        }
    }

    /// The objective of a motion and its measured efforts, `effort[j]` being the samples of output `j`.
    ///
    /// `linear`: columns of the regressor that are searched. `weights`: `δ_j` per output, not negative; empty for 1 each.
    ///
    /// # Errors
    /// Lengths that do not match, no samples, unknown columns, values that are not finite or out of range.
    ///
    /// # Panics
    /// If the motion lacks a channel of the model.
    pub fn new(
        model: &'a dyn EffortModel,
        motion: MotionBlock<'a>,
        effort: &[&[f64]],
        linear: &[usize],
        weights: &[f64],
        loss: EffortLoss,
    ) -> Result<Self, EffortObjectiveError> {
        let outputs = output_columns(model, linear, weights)?;
        check_loss(&loss, outputs.len())?;
        check_efforts(effort, outputs.len(), motion.samples)?;
        let start = model.parameters().shape_start();
        let mut block = RegressorBlock::new(model.layout().clone(), ROWS);
        let firsts = (0..motion.samples).step_by(ROWS);
        let chunks: Vec<Chunk<'a>> = firsts
            .map(|first| {
                let channels =
                    motion.channels.iter().map(|(name, values)| (*name, &values[first..])).collect();
                let part = MotionBlock {
                    samples: ROWS.min(motion.samples - first),
                    q: &motion.q[first..],
                    dq: &motion.dq[first..],
                    ddq: &motion.ddq[first..],
                    gravity: motion.gravity.map(|g| &g[first..]),
                    channels: &[],
                    ..motion
                };
                let mut chunk =
                    Chunk { first, motion: part, channels, fixed: Vec::new(), effort: Vec::new() };
                model.regressor(&chunk.motion(), &start, &mut block);
                chunk.take(model, &block, &outputs, linear, effort);
                chunk
            })
            .collect();
        for chunk in &chunks {
            chunk.check()?;
        }
        Ok(EffortObjective {
            model,
            chunks,
            samples: motion.samples,
            linear: linear.len(),
            shapes: start.len(),
            outputs,
            loss,
        })
    }

    fn misfit(&self, output: usize, residuals: &[f64]) -> f64 {
        match &self.loss {
            EffortLoss::Absolute => lane_sum(residuals, f64::abs),
            EffortLoss::Squared => lane_sum(residuals, |r| r * r),
            EffortLoss::Huber(thresholds) => {
                let k = thresholds[output];
                // Both branches at once: r²/2 for |r| ≤ k as the clipped part is r itself.
                lane_sum(residuals, |r| {
                    let clipped = r.abs().min(k);
                    clipped * (r.abs() - 0.5 * clipped)
                })
            }
        }
    }

    /// Adds a chunk's weighted misfits of up to [`GROUP`] candidates.
    fn add(&self, chunk: &Chunk<'_>, candidates: &[f64], values: &mut [f64], room: &mut Room) {
        let (rows, d) = (chunk.motion.samples, self.linear + self.shapes);
        for (j, output) in self.outputs.iter().enumerate() {
            let p = output.fixed.len();
            room.coefficients.clear();
            room.coefficients.resize(p * GROUP, 0.0);
            for (to, x) in room.coefficients.chunks_exact_mut(p.max(1)).zip(candidates.chunks_exact(d)) {
                to.iter_mut().zip(&output.fixed).for_each(|(c, unknown)| *c = x[*unknown]);
            }
            let product = &mut room.products[j * GROUP * ROWS..][..GROUP * rows];
            multiply_into(product, &chunk.fixed[j], &room.coefficients, (rows, p, GROUP));
        }
        for (k, (x, value)) in candidates.chunks_exact(d).zip(values).enumerate() {
            let shape = &x[self.linear..];
            if !room.shaped.is_empty() {
                self.model.shaped(&chunk.motion(), shape, ROWS, &mut room.shaped, &mut []);
            }
            for (j, output) in self.outputs.iter().enumerate() {
                let predicted = &mut room.products[j * GROUP * ROWS + k * rows..][..rows];
                predicted.iter_mut().zip(&chunk.effort[j]).for_each(|(p, e)| *p = e - *p);
                for &(column, unknown) in &output.shaped {
                    let factor = x[unknown];
                    let column = &room.shaped[column * ROWS..][..rows];
                    predicted.iter_mut().zip(column).for_each(|(r, w)| *r -= factor * w);
                }
                *value += output.weight * self.misfit(j, predicted);
            }
        }
    }
}

/// Working memory of an evaluation.
struct Room {
    coefficients: Vec<f64>,
    products: Vec<f64>,
    shaped: Vec<f64>,
}

impl Objective for EffortObjective<'_> {
    fn dimensions(&self) -> usize {
        self.linear + self.shapes
    }

    fn evaluate(&self, candidates: &[f64], values: &mut [f64]) {
        let d = self.dimensions();
        let work = |values: &mut [f64], candidates: &[f64]| {
            let mut room = self.room();
            for (values, group) in values.chunks_mut(GROUP).zip(candidates.chunks(GROUP * d)) {
                values.fill(0.0);
                for chunk in &self.chunks {
                    self.add(chunk, group, values, &mut room);
                }
                values.iter_mut().for_each(|value| *value /= self.samples as f64);
            }
        };
        let entries = values.len() * self.samples * self.outputs.len();
        let threads = if entries < PARALLEL { 1 } else { rayon::current_num_threads() };
        // Whole groups for every thread: a value does not depend on how many there are.
        let share = values.len().div_ceil(GROUP).div_ceil(threads) * GROUP;
        if share >= values.len() {
            work(values, candidates);
        } else {
            let shares = candidates.par_chunks(share * d);
            values
                .par_chunks_mut(share)
                .zip(shares)
                .for_each(|(values, candidates)| work(values, candidates));
        }
    }
}

impl Chunk<'_> {
    fn take(
        &mut self,
        model: &dyn EffortModel,
        block: &RegressorBlock,
        outputs: &[OutputColumns],
        linear: &[usize],
        effort: &[&[f64]],
    ) {
        let layout = model.layout();
        for (j, output) in outputs.iter().enumerate() {
            let columns = output.fixed.iter().flat_map(|unknown| {
                let place = layout.columns(j).iter().position(|c| *c == linear[*unknown]);
                place.map(|k| block.column(j, k)).unwrap_or_default()
            });
            self.fixed.push(columns.copied().collect());
            let measured = effort[j][self.first..].iter();
            self.effort.push(measured.zip(block.offset(j)).map(|(e, o)| e - o).collect());
        }
    }

    fn check(&self) -> Result<(), EffortObjectiveError> {
        let rows = self.motion.samples;
        let not_finite = |what, output, values: &[f64]| {
            let place = values.iter().position(|v| !v.is_finite());
            place.map_or(Ok(()), |at| {
                Err(EffortObjectiveError::NotFinite { what, output, sample: self.first + at % rows })
            })
        };
        for (j, (columns, effort)) in self.fixed.iter().zip(&self.effort).enumerate() {
            not_finite("the regressor", j, columns)?;
            not_finite("the effort", j, effort)?;
        }
        Ok(())
    }
}

fn output_columns(
    model: &dyn EffortModel,
    linear: &[usize],
    weights: &[f64],
) -> Result<Vec<OutputColumns>, EffortObjectiveError> {
    let layout = model.layout();
    let columns = layout.parameters();
    for (k, &column) in linear.iter().enumerate() {
        if column >= columns || linear[..k].contains(&column) {
            return Err(EffortObjectiveError::Column { column, columns });
        }
    }
    let outputs = layout.outputs();
    if !weights.is_empty() && weights.len() != outputs {
        let (what, found) = ("weights", weights.len());
        return Err(EffortObjectiveError::Length { what, expected: outputs, found });
    }
    let of = |output: usize| {
        let weight = weights.get(output).copied().unwrap_or(1.0);
        if !(weight >= 0.0 && weight.is_finite()) {
            let (what, expected) = ("weight", "not negative and finite");
            return Err(EffortObjectiveError::Value { what, output, expected, found: weight });
        }
        let unknown = |column: usize| linear.iter().position(|c| *c == column);
        let mut shaped = Vec::new();
        for (k, &(at, column)) in model.shaped_columns().iter().enumerate() {
            if let Some(unknown) = unknown(column).filter(|_| at == output) {
                shaped.push((k, unknown));
            }
        }
        let is_shaped = |column: usize| model.shaped_columns().contains(&(output, column));
        let fixed = layout.columns(output).iter().filter(|c| !is_shaped(**c));
        Ok(OutputColumns { weight, fixed: fixed.filter_map(|c| unknown(*c)).collect(), shaped })
    };
    (0..outputs).map(of).collect()
}

/// `Σ f(r)` in eight partial sums, which the compiler can keep in vector registers.
fn lane_sum(residuals: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; 8];
    let whole = residuals.chunks_exact(8);
    let rest: f64 = whole.remainder().iter().map(|r| f(*r)).sum();
    for part in whole {
        sums.iter_mut().zip(part).for_each(|(s, r)| *s += f(*r));
    }
    sums.iter().sum::<f64>() + rest
}
