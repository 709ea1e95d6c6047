//! Rows of residuals, and when what they show is believed.

/// Rows of one joint's residuals behind a Gaussian kernel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CyclicRows {
    /// Position, rad or m.
    pub position: Vec<f64>,
    /// Velocity, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Measured less predicted effort, N m or N.
    pub residual: Vec<f64>,
    /// Weight: 1 over the standard deviation of the rows of the log.
    pub weight: Vec<f64>,
    /// Part of the motion that a row lies in, below `parts`: rows of one part are held out together. Where a motion repeats, the same places
    /// of all periods are one part.
    pub part: Vec<usize>,
    /// Number of parts.
    pub parts: usize,
    /// Standard deviation of the kernel, s.
    pub kernel_s: f64,
    /// The joint slides: no order is that of its turn.
    pub slides: bool,
}

/// When a cyclic effort is believed.
#[derive(Debug, Clone, PartialEq)]
pub struct CyclicSettings {
    /// Fewest periods over the range of the joint for an order that need not be whole. Default 3.
    pub least_periods: f64,
    /// Largest whole order, of what repeats with the turn of the joint itself (gears and bearings that are not round, springs and cables that it
    /// winds), that needs no such number of periods. Default 3.
    pub slow_orders: u32,
    /// Share of the mean square residual that must be gone on held-out parts for a whole order: what repeats less than a period over the range may be a
    /// fault of the model that another motion does not share. Default 0.2.
    pub least_slow_gain: f64,
    /// Standard errors that the gain on held-out parts must be of: so many that hundreds of orders which are tried do not pass by chance. Default 3.
    pub sigmas: f64,
    /// Share of the mean square residual that must be gone on held-out parts, all parts alike. Default 0.03.
    pub least_gain: f64,
    /// Or share of the sum of squares of all parts, in which a few may tell all. Default 0.1.
    pub least_gain_of_sum: f64,
    /// Fewest parts that hold rows. Default 8.
    pub least_parts: usize,
    /// Fewest passes of the joint, from turn to turn. On a single one a vibration, which repeats in time, looks like ripple; a place that is passed
    /// again finds it in another phase. Default 4.
    pub least_passes: usize,
}

impl Default for CyclicSettings {
    fn default() -> Self {
        CyclicSettings {
            least_periods: 3.0,
            slow_orders: 3,
            least_slow_gain: 0.2,
            sigmas: 3.0,
            least_gain: 0.03,
            least_gain_of_sum: 0.1,
            least_parts: 8,
            least_passes: 4,
        }
    }
}

/// Slower rows, in parts of the rms speed, count as rest.
const REST: f64 = 0.05;

/// A row of residuals of a joint that moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub(super) position: f64,
    pub(super) velocity: f64,
    pub(super) residual: f64,
    pub(super) weight: f64,
    pub(super) part: usize,
}

impl Row {
    /// What the kernel leaves of a ripple of `n` repetitions at the speed of the row; `kernel_s`: standard deviation of the kernel.
    pub(super) fn passes(&self, n: f64, kernel_s: f64) -> f64 {
        let turn = n * self.velocity * kernel_s;
        (-0.5 * turn * turn).exp()
    }
}

/// Rows in motion; `None` where fewer parts than `least_parts` hold some.
///
/// # Panics
/// If the lists differ in length or a part is not below `parts`.
pub(super) fn moving(given: &CyclicRows, least_parts: usize) -> Option<Vec<Row>> {
    let CyclicRows { position, velocity, residual, weight, part, parts, .. } = given;
    let lengths = [position.len(), velocity.len(), residual.len(), weight.len(), part.len()];
    assert!(lengths.iter().all(|n| *n == lengths[0]), "lists of {lengths:?} rows");
    let square: f64 = velocity.iter().map(|v| v * v).sum();
    let rest = REST * (square / lengths[0].max(1) as f64).sqrt();
    let rows: Vec<Row> = (0..lengths[0])
        .filter(|k| velocity[*k].abs() > rest)
        .map(|k| Row {
            position: position[k],
            velocity: velocity[k],
            residual: residual[k],
            weight: weight[k],
            part: part[k],
        })
        .collect();
    let mut held = vec![false; *parts];
    rows.iter().for_each(|row| held[row.part] = true);
    let enough = !rows.is_empty() && held.iter().filter(|held| **held).count() >= least_parts;
    enough.then_some(rows)
}

/// Passes of the joint from turn to turn.
pub(super) fn passes(rows: &[Row]) -> usize {
    1 + rows.windows(2).filter(|w| w[0].velocity.signum() != w[1].velocity.signum()).count()
}

/// Lowest and highest position.
pub(super) fn range(rows: &[Row]) -> (f64, f64) {
    let low = rows.iter().map(|r| r.position).fold(f64::INFINITY, f64::min);
    (low, rows.iter().map(|r| r.position).fold(f64::NEG_INFINITY, f64::max))
}
