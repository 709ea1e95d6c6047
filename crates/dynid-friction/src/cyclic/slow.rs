//! What a residual holds of slow functions of the position: springs, gravity compensators, cables, gears and bearings that are not round.

use std::f64::consts::PI;

use super::rows::{CyclicRows, CyclicSettings, Row, moving, passes, range};
use super::score::{BESIDE, Gain, Sums, beside, gain};

/// Cosines of up to two and a half periods over the range: faster ones are cyclic efforts.
const COSINES: usize = 5;
const COLUMNS: usize = COSINES + BESIDE;

/// How much of a residual follows the position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlowFinding {
    /// Share by which the mean square residual falls on held-out parts, all parts alike.
    pub share: f64,
    /// Its standard error over parts.
    pub standard_error: f64,
}

/// The share of a residual that is a slow function of the position, `Σ aₖ cos(k π (q - low)/(high - low))` with `k` up to 5, beside offset, Coulomb and viscous
/// friction, fitted without each part of the motion and judged there. `None` where it is less than [`CyclicSettings::least_slow_gain`] or chance, where too
/// few parts move, or where the joint does not pass often enough to tell position from time.
///
/// # Panics
/// If the lists differ in length or a part is not below `parts`.
pub fn find_slow(rows: &CyclicRows, settings: &CyclicSettings) -> Option<SlowFinding> {
    let moving = moving(rows, settings.least_parts)?;
    let enough = passes(&moving) >= settings.least_passes;
    enough.then(|| slow_gain(&moving, rows.parts, false, settings)).flatten()
}

/// What slow functions of the position, times the sign of the velocity for friction, gain on held-out parts, if it is enough.
pub(super) fn slow_gain(
    rows: &[Row],
    parts: usize,
    is_friction: bool,
    settings: &CyclicSettings,
) -> Option<SlowFinding> {
    let (low, high) = range(rows);
    let mut sums = vec![Sums::<COLUMNS>::ZERO; parts];
    for row in rows {
        sums[row.part].add(&columns(row, (row.position - low) / (high - low), is_friction));
    }
    gain(&sums)
        .filter(|gain| is_slow(gain, settings))
        .map(|Gain { share, error }| SlowFinding { share, standard_error: error })
}

/// Whether what a slow effort gains is enough to believe it.
pub(super) fn is_slow(gain: &Gain, settings: &CyclicSettings) -> bool {
    gain.share >= settings.least_slow_gain && gain.share > settings.sigmas * gain.error
}

fn columns(row: &Row, place: f64, is_friction: bool) -> [f64; COLUMNS] {
    let beside = beside(row);
    let factor = row.weight * if is_friction { row.velocity.signum() } else { 1.0 };
    std::array::from_fn(|k| match k.checked_sub(COSINES) {
        Some(k) => beside[k],
        None => factor * ((k + 1) as f64 * PI * place).cos(),
    })
}
