//! Instruments from simulations of the estimate itself, over and over.

use super::{InstrumentSettings, InstrumentalEstimate, instrumental};
use crate::linear::LinearError;
use dynid_factor::groups::ReducedGroup;

/// What a simulation with some parameters gave.
#[derive(Debug, Clone, PartialEq)]
pub enum Simulated {
    /// Rows paired with its regressor.
    Rows(Vec<ReducedGroup>),
    /// The simulation left the reference, or could not go on.
    Diverged {
        /// Largest distance from the reference, rad or m; infinite where it could not go on.
        distance: f64,
        /// Log.
        log: usize,
        /// Output.
        output: usize,
    },
}

/// How an iteration ended.
#[derive(Debug, Clone, PartialEq)]
pub enum IterationEnd {
    /// Parameters moved by no more than the tolerance.
    Settled,
    /// The rounds were used up.
    Limit,
    /// The simulation left the reference; there are no instruments.
    Diverged {
        /// Largest distance, rad or m.
        distance: f64,
        /// Log.
        log: usize,
        /// Output.
        output: usize,
    },
}

/// Outcome of [`iterate`].
#[derive(Debug, Clone, PartialEq)]
pub struct Iteration {
    /// The last estimate; `None` if the first simulation diverged.
    pub estimate: Option<InstrumentalEstimate>,
    /// Simulations made.
    pub rounds: usize,
    /// Per estimate, its largest change from the one before, in parts of the size of the parameter (see [`iterate`]).
    pub changes: Vec<f64>,
    /// How it ended.
    pub end: IterationEnd,
}

/// Simulates, estimates, and simulates with the estimate, until estimates settle.
///
/// `start`: base parameters to simulate with first. `sizes`: per base parameter, the size below which it counts as zero, so that
/// a vanishing parameter does not ask for endless rounds: a change is `|x_i - x_i'|/max(|x_i|, sizes_i)`. `simulate`: paired rows of a
/// simulation with the last estimate (with `None` at first: the caller's start). Stops at changes of at most `tolerance` (1e-4 is usual) or
/// after `max_rounds` (10) simulations.
///
/// # Errors
/// Passes on errors of `simulate`; [`LinearError`] as [`instrumental`] returns it.
pub fn iterate<E: From<LinearError>>(
    start: &[f64],
    sizes: &[f64],
    (tolerance, max_rounds): (f64, usize),
    settings: &InstrumentSettings,
    mut simulate: impl FnMut(Option<&InstrumentalEstimate>) -> Result<Simulated, E>,
) -> Result<Iteration, E> {
    assert_eq!(start.len(), sizes.len(), "one size per base parameter");
    let mut out = Iteration { estimate: None, rounds: 0, changes: Vec::new(), end: IterationEnd::Limit };
    while out.rounds < max_rounds {
        out.rounds += 1;
        let paired = match simulate(out.estimate.as_ref())? {
            Simulated::Rows(paired) => paired,
            Simulated::Diverged { distance, log, output } => {
                out.end = IterationEnd::Diverged { distance, log, output };
                break;
            }
        };
        let found = instrumental(&paired, start.len(), settings)?;
        let before = out.estimate.as_ref().map_or(start, |e| &e.linear.x);
        let moved = found.linear.x.iter().zip(before).zip(sizes);
        let change = moved.map(|((x, b), size)| (x - b).abs() / x.abs().max(*size)).fold(0.0, f64::max);
        out.changes.push(change);
        out.estimate = Some(found);
        if change <= tolerance {
            out.end = IterationEnd::Settled;
            break;
        }
    }
    Ok(out)
}
