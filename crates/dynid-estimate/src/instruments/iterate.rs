//! Rows from simulations of the estimate itself, over and over.

use super::InstrumentalEstimate;
use crate::linear::{LinearError, LinearEstimate, LinearMethod, LinearSettings, estimate};
use dynid_factor::groups::ReducedGroup;

impl AsRef<LinearEstimate> for InstrumentalEstimate {
    fn as_ref(&self) -> &LinearEstimate {
        &self.linear
    }
}

impl AsRef<LinearEstimate> for LinearEstimate {
    fn as_ref(&self) -> &LinearEstimate {
        self
    }
}

/// Weighted least squares on rows of a simulated motion: one step of [`LinearMethod::Didim`] (rows `[Z | y]`,
/// [`super::simulated`]) or [`LinearMethod::Cloe`] (rows `[∂q_s/∂x | q - q_s + ∂q_s/∂x x]`, as [`dynid_factor::groups::ReducedGroup`] in base
/// columns). The estimate bears the name of the method.
///
/// # Errors
/// As [`estimate`](crate::linear::estimate()) returns them.
pub fn along_simulation(
    groups: &[ReducedGroup],
    total: usize,
    method: LinearMethod,
    settings: &LinearSettings,
) -> Result<LinearEstimate, LinearError> {
    let mut found = estimate(groups, None, total, &LinearMethod::Wls, settings)?;
    found.method = method;
    Ok(found)
}

/// What a simulation with some parameters gave.
#[derive(Debug, Clone, PartialEq)]
pub enum Simulated {
    /// Rows: for instruments and DIDIM measured ones paired with the simulated regressor, for CLOE those of the positions.
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
    /// The simulation left the reference; there are no rows.
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
pub struct Iteration<T> {
    /// The last estimate; `None` if the first simulation diverged.
    pub estimate: Option<T>,
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
/// a vanishing parameter does not ask for endless rounds: a change is `|x_i - x_i'|/max(|x_i|, sizes_i)`. `simulate`: rows of a
/// simulation with the last estimate (with `None` at first: the caller's start). `solve`: the estimate of these rows
/// ([`super::instrumental`], [`along_simulation`]). Stops at changes of at most `tolerance` (1e-4 is usual) or
/// after `max_rounds` (10) simulations.
///
/// # Errors
/// Passes on errors of `simulate` and `solve`.
pub fn iterate<T: AsRef<LinearEstimate>, E: From<LinearError>>(
    start: &[f64],
    sizes: &[f64],
    (tolerance, max_rounds): (f64, usize),
    mut simulate: impl FnMut(Option<&T>) -> Result<Simulated, E>,
    solve: impl Fn(&[ReducedGroup]) -> Result<T, LinearError>,
) -> Result<Iteration<T>, E> {
    assert_eq!(start.len(), sizes.len(), "one size per base parameter");
    let mut out = Iteration { estimate: None, rounds: 0, changes: Vec::new(), end: IterationEnd::Limit };
    while out.rounds < max_rounds {
        out.rounds += 1;
        let rows = match simulate(out.estimate.as_ref())? {
            Simulated::Rows(rows) => rows,
            Simulated::Diverged { distance, log, output } => {
                out.end = IterationEnd::Diverged { distance, log, output };
                break;
            }
        };
        let found = solve(&rows)?;
        let before = out.estimate.as_ref().map_or(start, |e| &e.as_ref().x);
        let moved = found.as_ref().x.iter().zip(before).zip(sizes);
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
