//! Single readings that stand out of what a simulation misses.

use dynid_motion::signal::SignalError;
use dynid_motion::spikes::{self, SpikeSettings};

/// Deviations from a running median, in robust standard deviations, from which what a simulation misses of a single reading is none of the joint's motion,
/// and the largest share of readings for which that is believed.
const STANDS_OUT: f64 = 8.0;
const MOST: f64 = 0.02;

/// Share of what is missed by which the reading itself must lie outside of its neighbours: where a motion is met late, the simulation stands out.
const OUTSIDE: f64 = 0.5;

/// Steps of an encoder that a reading must stand out by: where a joint rests, what is missed is constant but for an encoder that flickers.
const STEPS: f64 = 4.0;

/// Times that it must stand out beyond second differences of the readings, and the share of these that are smaller: what a joint is pushed to by another is no
/// faster than its own motion.
const FASTER: f64 = 3.0;
const USUAL: f64 = 0.95;

/// Rows of which a simulation misses something, of which the reading stands out alone; none where they are too many. `step`: of the encoder, 0: none.
/// `NaN` readings do not count.
///
/// # Errors
/// [`SignalError`] of a residual that is not finite.
pub(super) fn of(residual: &[f64], measured: &[f64], step: f64) -> Result<Vec<usize>, SignalError> {
    let settings =
        SpikeSettings { threshold: STANDS_OUT, longest_run: 2, cap: MOST, ..SpikeSettings::default() };
    let mut smooth = residual.to_vec();
    let found = spikes::remove(&mut smooth, &settings)?;
    if !found.removed {
        return Ok(Vec::new());
    }
    let mut bends: Vec<f64> =
        measured.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).filter(|x| !x.is_nan()).collect();
    bends.sort_by(f64::total_cmp);
    let usual = bends.get((USUAL * bends.len() as f64) as usize).copied().unwrap_or(0.0);
    let least = (STEPS * step).max(FASTER * usual);
    let stands_out = |run: &[usize]| {
        let (before, after) = (measured[run[0] - 1], measured[run[run.len() - 1] + 1]);
        let (low, high) = (before.min(after), before.max(after));
        let outside = |row: &usize| (low - measured[*row]).max(measured[*row] - high);
        let peak = run.iter().map(|row| (residual[*row] - smooth[*row]).abs()).fold(0.0, f64::max);
        run.iter().map(outside).fold(f64::NEG_INFINITY, f64::max) > least.max(OUTSIDE * peak)
    };
    // A run that touches an end is none.
    let runs = found.flagged.chunk_by(|a, b| a + 1 == *b).filter(|run| stands_out(run));
    Ok(runs.flatten().copied().collect())
}
