//! How far the positions of a controlled robot move with its parameters.

use dynid_model::{EffortModel, MotionBlock, RegressorBlock};

use rayon::prelude::*;

use crate::error::{SimError, demand_length};
use crate::lu::Lu;

/// Steps whose derivatives are formed at once.
const PIECE: usize = 256;
/// Half width of the differences by positions, rad or m.
const POSITION_STEP: f64 = 1e-5;
/// Least half width of the differences by velocities, rad/s or m/s.
const VELOCITY_STEP: f64 = 1e-5;

/// A motion as [`run`](crate::run) gave it, one signal per joint and one number per row, and the controller that made it.
#[derive(Debug, Clone, Copy)]
pub struct DrivenMotion<'a> {
    /// Time between rows, s.
    pub step_s: f64,
    /// Positions.
    pub q: &'a [Vec<f64>],
    /// Velocities.
    pub dq: &'a [Vec<f64>],
    /// Accelerations.
    pub ddq: &'a [Vec<f64>],
    /// Extra channels of the model by name.
    pub channels: &'a [(&'a str, &'a [f64])],
    /// Position gains, N m/rad or N/m.
    pub position_gain: &'a [f64],
    /// Velocity gains, N m s/rad or N s/m.
    pub velocity_gain: &'a [f64],
    /// Speed over which the simulation smoothed signs of velocities.
    pub sign_width: f64,
}

/// Slopes `S = ∂q/∂x` of the positions along a driven motion by linear parameters `x` of a model, from the variational equation of the loop
///
/// ```text
/// M S'' + (∂τ/∂v + K_v) S' + (∂τ/∂q + K_p) S = -W,   S = S' = 0 in the first row
/// ```
///
/// with the inverse dynamics `τ(q, v, a; x)`, its regressor `W` in the columns asked for, and gains `K`. The implicit midpoint rule takes one
/// step per row, so rows must be dense beside the bandwidth of the loop. The derivative by a velocity is the difference over the change of that
/// velocity within the step: exact for terms up to the square, and of a jump of friction the mean slope, so that a reversal
/// between two rows counts in full. Delay, limits and low pass of the controller are left out; feed-forward is taken as fixed.
///
/// `visit` gets every row with `S`, column by column: joint `j` by column `c` at `[c * joints + j]`.
///
/// # Errors
/// [`SimError::Length`] for gains or signals of another number of joints; [`SimError::NoSlopes`].
///
/// # Panics
/// If `linear` or `shape` has the wrong length, or a channel is missing.
pub fn position_slopes(
    model: &dyn EffortModel,
    (linear, shape): (&[f64], &[f64]),
    columns: &[usize],
    motion: &DrivenMotion<'_>,
    visit: &mut dyn FnMut(usize, &[f64]),
) -> Result<(), SimError> {
    let n = model.outputs().len();
    for (name, found) in [
        ("position gains", motion.position_gain.len()),
        ("velocity gains", motion.velocity_gain.len()),
        ("joints of the motion", motion.q.len().min(motion.dq.len()).min(motion.ddq.len())),
    ] {
        demand_length(name, n, found)?;
    }
    let rows = motion.q.first().map_or(0, Vec::len);
    let mut state = Slopes::new(n, columns.len());
    if rows > 0 {
        visit(0, &state.slope);
    }
    let mut regressor = RegressorBlock::new(model.layout().clone(), PIECE + 1);
    let mut piece = Piece::default();
    for start in (0..rows.saturating_sub(1)).step_by(PIECE) {
        let steps = PIECE.min(rows - 1 - start);
        piece.fill(model, (linear, shape), motion, start, steps);
        let at_rows = gathered([motion.q, motion.dq, motion.ddq], start, steps + 1);
        let named = named(motion, start, steps + 1);
        let block = MotionBlock {
            channels: &named,
            sign_width: motion.sign_width,
            ..MotionBlock::plain(steps + 1, &at_rows[0], &at_rows[1], &at_rows[2])
        };
        model.regressor(&block, shape, &mut regressor);
        for step in 0..steps {
            state.load(&regressor, columns, step);
            state.advance(&piece, step, motion).ok_or(SimError::NoSlopes { row: start + step })?;
            visit(start + step + 1, &state.slope);
        }
    }
    Ok(())
}

/// Signals of some rows, one behind the other.
fn gathered(signals: [&[Vec<f64>]; 3], start: usize, rows: usize) -> [Vec<f64>; 3] {
    signals.map(|signal| signal.iter().flat_map(|joint| &joint[start..start + rows]).copied().collect())
}

fn named<'a>(motion: &DrivenMotion<'a>, start: usize, rows: usize) -> Vec<(&'a str, &'a [f64])> {
    motion.channels.iter().map(|(name, values)| (*name, &values[start..start + rows])).collect()
}

/// Derivatives of the inverse dynamics in the middle of some steps, `[(row * joints + column) * steps + step]`.
#[derive(Default)]
struct Piece {
    steps: usize,
    mass: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
}

impl Piece {
    fn fill(
        &mut self,
        model: &dyn EffortModel,
        (linear, shape): (&[f64], &[f64]),
        motion: &DrivenMotion<'_>,
        start: usize,
        steps: usize,
    ) {
        let n = motion.q.len();
        self.steps = steps;
        let middle = [motion.q, motion.dq, motion.ddq].map(|signal| {
            let of = |joint: &Vec<f64>| -> Vec<f64> {
                joint[start..=start + steps].windows(2).map(|w| 0.5 * (w[0] + w[1])).collect()
            };
            signal.iter().flat_map(of).collect::<Vec<f64>>()
        });
        let named = named(motion, start, steps);
        let efforts = |states: &[Vec<f64>; 3]| {
            let [q, dq, ddq] = states;
            let block = MotionBlock {
                channels: &named,
                sign_width: motion.sign_width,
                ..MotionBlock::plain(steps, q, dq, ddq)
            };
            let mut out = vec![0.0; n * steps];
            model.efforts(&block, shape, linear, steps, &mut out);
            out
        };
        // Derivative by one entry of one joint, over given half widths.
        let derivative = |signal: usize, joint: usize| {
            let velocity = &motion.dq[joint][start..=start + steps];
            let half = |step: usize| match signal {
                0 => POSITION_STEP,
                1 => (0.5 * (velocity[step + 1] - velocity[step]).abs()).max(VELOCITY_STEP),
                _ => 1.0,
            };
            let moved = |sign: f64| {
                let mut states = middle.clone();
                for (step, x) in states[signal][joint * steps..][..steps].iter_mut().enumerate() {
                    *x += sign * half(step);
                }
                efforts(&states)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            (0..n * steps).map(|k| (up[k] - down[k]) / (2.0 * half(k % steps))).collect::<Vec<f64>>()
        };
        let jobs: Vec<(usize, usize)> =
            (0..3).flat_map(|signal| (0..n).map(move |joint| (signal, joint))).collect();
        let columns: Vec<Vec<f64>> =
            jobs.par_iter().map(|(signal, joint)| derivative(*signal, *joint)).collect();
        let matrices = [&mut self.stiffness, &mut self.damping, &mut self.mass];
        for (matrix, columns) in matrices.into_iter().zip(columns.chunks(n)) {
            matrix.resize(n * n * steps, 0.0);
            for (joint, column) in columns.iter().enumerate() {
                for (row, values) in column.chunks(steps).enumerate() {
                    matrix[(row * n + joint) * steps..][..steps].copy_from_slice(values);
                }
            }
        }
    }

    fn at(&self, matrix: &[f64], entry: usize, step: usize) -> f64 {
        matrix[entry * self.steps + step]
    }
}

/// Slopes and their rates at a row.
struct Slopes {
    n: usize,
    columns: usize,
    slope: Vec<f64>,
    rate: Vec<f64>,
    /// Mean regressor over the step.
    regressor: Vec<f64>,
    matrix: Vec<f64>,
    lu: Lu,
}

impl Slopes {
    fn new(n: usize, columns: usize) -> Self {
        let zeros = vec![0.0; n * columns];
        Slopes {
            n,
            columns,
            slope: zeros.clone(),
            rate: zeros.clone(),
            regressor: zeros,
            matrix: vec![0.0; n * n],
            lu: Lu::default(),
        }
    }

    fn load(&mut self, block: &RegressorBlock, columns: &[usize], step: usize) {
        self.regressor.fill(0.0);
        for output in 0..self.n {
            for (k, column) in block.layout().columns(output).iter().enumerate() {
                if let Ok(c) = columns.binary_search(column) {
                    let values = block.column(output, k);
                    self.regressor[c * self.n + output] = 0.5 * (values[step] + values[step + 1]);
                }
            }
        }
    }

    /// One step of the implicit midpoint rule; `None` if its matrix is singular.
    fn advance(&mut self, piece: &Piece, step: usize, motion: &DrivenMotion<'_>) -> Option<()> {
        let (n, h) = (self.n, motion.step_s);
        let (mut mass, mut damping, mut stiffness) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
        for entry in 0..n * n {
            mass[entry] = piece.at(&piece.mass, entry, step);
            damping[entry] = piece.at(&piece.damping, entry, step);
            stiffness[entry] = piece.at(&piece.stiffness, entry, step);
        }
        for j in 0..n {
            damping[j * n + j] += motion.velocity_gain[j];
            stiffness[j * n + j] += motion.position_gain[j];
        }
        for entry in 0..n * n {
            self.matrix[entry] = mass[entry] / h + 0.5 * damping[entry] + 0.25 * h * stiffness[entry];
        }
        self.lu.factor(n, &self.matrix).then_some(())?;
        let mut rate = vec![0.0; n];
        for c in 0..self.columns {
            let at = c * n..(c + 1) * n;
            let (slope, old) = (&mut self.slope[at.clone()], &mut self.rate[at.clone()]);
            for (i, to) in rate.iter_mut().enumerate() {
                *to = -self.regressor[c * n + i];
                for j in 0..n {
                    let k = i * n + j;
                    *to += (mass[k] / h - 0.5 * damping[k]) * old[j]
                        - stiffness[k] * (slope[j] + 0.25 * h * old[j]);
                }
            }
            self.lu.solve(&mut rate);
            for ((slope, old), new) in slope.iter_mut().zip(old).zip(&rate) {
                *slope += 0.5 * h * (*old + new);
                *old = *new;
            }
        }
        Some(())
    }
}
