//! Direction of gravity.

use dynid_model::{EffortModel, RegressorBlock};

use super::PreflightError;
use super::rows::{deviation, reduce, regressor, row_weight};
use super::samples::{BLOCKS, Samples};
use super::wiring::Wiring;
use crate::conditioning::KeptColumns;
use crate::factor::Factor;
use crate::linear::ols;

/// Gauss-Newton steps.
const STEPS: usize = 8;
/// A step below this ends them, rad.
const SETTLED: f64 = 1e-4;

/// Least part of what a turn of gravity does that the other parameters must not be able to do.
const LEFT: f64 = 0.05;

/// Gravity as the efforts show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    /// Gravity in base axes, m/s², as long as the one stated.
    pub gravity: [f64; 3],
    /// Angle to the gravity stated, rad.
    pub angle: f64,
    /// Standard error of the angle, jackknife over twelve parts of the record, rad.
    pub error: f64,
    /// Misfit that is left, in the unit of [`super::WiringSearch::nothing`], the prior's part included.
    pub misfit: f64,
}

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

/// Fits the direction of gravity together with all parameters; `None` without gravity, or where the log does not tell it.
///
/// Gauss-Newton on the two components across the present direction; a Gaussian prior fills what the log does not see. What
/// joints that turn about the vertical feel of gravity is due to the tilt alone, so that no inertia has to be known. `kept`:
/// base columns; `start`: where Gauss-Newton begins.
///
/// # Errors
/// [`PreflightError`] if a regressor is not finite.
pub fn tilt(
    model: &dyn EffortModel,
    shape: &[f64],
    samples: &Samples,
    wiring: &Wiring,
    [stated, start]: [[f64; 3]; 2],
    kept: &[usize],
    prior: GaussianPrior<'_>,
) -> Result<Option<Tilt>, PreflightError> {
    let size = norm(stated);
    if size == 0.0 {
        return Ok(None);
    }
    let all: Vec<usize> = (0..model.parameters().linear.len()).collect();
    let columns = KeptColumns::new(model, &all);
    let at = |gravity: [f64; 3]| regressor(model, shape, samples, &wiring.position, Some(gravity));
    let mut gravity = start;
    let mut values = None;
    for _ in 0..STEPS {
        let across = across(gravity);
        let block = at(gravity);
        let x = match values.take() {
            Some(x) => x,
            None => solve(&blocks(&block, &columns, samples, wiring, &[])?, None, &prior, 0).x,
        };
        // What a turn of gravity by one radian does to every effort.
        let turned: Vec<Vec<Vec<f64>>> = across
            .iter()
            .map(|axis| {
                let other = at(std::array::from_fn(|k| gravity[k] + size * axis[k]));
                let change = |output: usize| {
                    let (a, b) = (other.effort(output, &x), block.effort(output, &x));
                    a.iter().zip(&b).map(|(a, b)| a - b).collect()
                };
                (0..samples.joints.len()).map(change).collect()
            })
            .collect();
        let parts = blocks(&block, &columns, samples, wiring, &turned)?;
        if !is_seen(&parts, kept, all.len()) {
            return Ok(None);
        }
        let Solved { x, turn, misfit } = solve(&parts, None, &prior, 2);
        let step = turn[0].hypot(turn[1]);
        gravity = turned_by(gravity, &across, [turn[0], turn[1]]);
        values = Some(x);
        if step < SETTLED {
            let angles: Vec<[f64; 2]> = (0..BLOCKS)
                .map(|b| solve(&parts, Some(b), &prior, 2).turn)
                .map(|turn| [turn[0], turn[1]])
                .collect();
            let count = BLOCKS as f64;
            let spread: f64 = (0..2)
                .map(|k| {
                    let mean = angles.iter().map(|a| a[k]).sum::<f64>() / count;
                    angles.iter().map(|a| (a[k] - mean).powi(2)).sum::<f64>()
                })
                .sum();
            let cosine = dot(gravity, stated) / (size * norm(gravity));
            return Ok(Some(Tilt {
                gravity,
                angle: cosine.clamp(-1.0, 1.0).acos(),
                error: ((count - 1.0) / count * spread).sqrt(),
                misfit,
            }));
        }
    }
    Ok(None)
}

/// Weighted factors of the parts of the record, in all columns and one more per turn.
fn blocks(
    block: &RegressorBlock,
    columns: &KeptColumns,
    samples: &Samples,
    wiring: &Wiring,
    turned: &[Vec<Vec<f64>>],
) -> Result<Vec<Factor>, PreflightError> {
    let total = columns.total + turned.len();
    let mut out: Vec<Vec<Factor>> = vec![Vec::new(); BLOCKS];
    for output in 0..samples.joints.len() {
        let source = wiring.effort[output];
        let effort: Vec<f64> =
            samples.joints[source.joint].effort.iter().map(|e| source.factor * e).collect();
        let mut beside: Vec<&[f64]> = turned.iter().map(|t| t[output].as_slice()).collect();
        beside.push(&effort);
        let own = columns.local[output].len();
        let mut positions = columns.global[output].clone();
        positions.extend(columns.total..total);
        let parts = reduce(block, columns, samples, &wiring.position, output, &beside, BLOCKS)?;
        let rows: usize = parts.iter().map(Factor::rows).sum();
        let Some(weight) = row_weight(rows.max(1), deviation(&effort), samples.duration_s, samples.len())
        else {
            continue;
        };
        for (to, part) in out.iter_mut().zip(parts).filter(|(_, p)| p.rows() > 0) {
            // The effort came in as the last column.
            let p = own + turned.len();
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

/// Whether turns of gravity are anything but what the other parameters do: an offset takes the place of the tilt of a slide.
fn is_seen(parts: &[Factor], kept: &[usize], all: usize) -> bool {
    let whole = Factor::merge(&parts.iter().collect::<Vec<_>>());
    let independent: Vec<usize> = kept.iter().copied().chain(all..whole.columns()).collect();
    let whole = whole.select(&independent);
    (kept.len()..whole.columns()).all(|column| {
        let of = |row: usize| if row < whole.height() { whole.r(row, column) } else { 0.0 };
        let norm = |rows: std::ops::Range<usize>| rows.map(|i| of(i).powi(2)).sum::<f64>().sqrt();
        norm(kept.len()..column + 1) > LEFT * norm(0..column + 1)
    })
}

struct Solved {
    x: Vec<f64>,
    turn: Vec<f64>,
    misfit: f64,
}

/// Parameters and turns of gravity, without one of the parts if it is given.
fn solve(parts: &[Factor], without: Option<usize>, prior: &GaussianPrior<'_>, turns: usize) -> Solved {
    let kept: Vec<&Factor> =
        parts.iter().enumerate().filter(|(b, _)| without != Some(*b)).map(|(_, f)| f).collect();
    let root = prior.weight.sqrt();
    let mut weights: Vec<f64> = prior.std.iter().map(|s| root / s).collect();
    let mut centre = prior.values.to_vec();
    // Nothing is known of the direction, but where the log does not tell it either it stays.
    weights.extend(std::iter::repeat_n(1e-3, turns));
    centre.extend(std::iter::repeat_n(0.0, turns));
    let solution = ols(&Factor::merge(&kept).with_prior_rows(&weights, &centre));
    let mut x = solution.x;
    let turn = x.split_off(prior.values.len());
    Solved { x, turn, misfit: solution.rss }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(a: [f64; 3]) -> f64 {
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
