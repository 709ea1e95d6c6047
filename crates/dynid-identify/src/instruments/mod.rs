//! Instrumental variables for a robot in closed loop, and least squares against them.
//!
//! The controller feeds noise of the positions back into the efforts, so that noise of the regressor is noise of the effort too. The
//! regressor of the motion that the model itself makes along the same reference, simulated without noise, serves as instruments
//! ([`dynid_estimate::instruments`]): parameters, simulation, instruments, parameters, until they settle.
//!
//! [`ClosedLoop`] says what the simulation must know: reference and controller. They need not
//! be exact. Whatever the simulation gets wrong makes instruments weaker, not wrong, as long as they know nothing of the noise.
//!
//! What instruments do not cure is noise that goes through a kink: a sign of velocity that noise turns near reversal is an error that
//! depends on the motion itself. Such rows must be left out, and are unless the configuration says otherwise
//! ([`ConditioningConfig::reversal_mask`](crate::settings::ConditioningConfig)). Shape parameters of friction are those that all rows
//! gave; simulations hold them.

mod reference;
mod simulation;

use std::cell::RefCell;

use dynid_estimate::instruments::{
    Exogeneity, ExogeneitySettings, InstrumentSettings, Iteration, IterationEnd, Simulated, Strength,
    crossed, exogeneity, half, iterate, measured,
};
use dynid_estimate::linear::{LinearEstimate, LinearMethod, estimate};
use dynid_rows::conditioning::{Conditioning, ReducedGroup};

use crate::friction_power::FrictionPower;
use crate::problem::Problem;
use crate::settings::{ClosedLoop, Method, Settings};
use crate::shape::ShapeFit;
use crate::{Error, fitting};
pub use reference::reference_channel;
use simulation::Bench;

/// How the instruments of a fit came about.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentRun {
    /// Simulations made.
    pub rounds: usize,
    /// How they ended; a fit whose simulation diverged is that of weighted least squares.
    pub end: IterationEnd,
    /// Largest change of a parameter in the last round, in parts of it or of its prior deviation; `None` without an estimate.
    pub last_change: Option<f64>,
    /// Strength and smallest singular value of `Q_ZᵀQ_W`; `None` without an estimate.
    pub strength: Option<(Strength, f64)>,
}

impl InstrumentRun {
    fn of(found: &Iteration) -> Self {
        InstrumentRun {
            rounds: found.rounds,
            end: found.end.clone(),
            last_change: found.changes.last().copied(),
            strength: found.estimate.as_ref().map(|e| (e.strength, e.least_cosine)),
        }
    }

    /// Whether the fit comes from instruments.
    pub fn succeeded(&self) -> bool {
        self.strength.is_some() && !matches!(self.end, IterationEnd::Diverged { .. })
    }
}

/// Least squares against instruments, on the logs of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The test; `None` if a simulation diverged or no parameter is left to compare.
    pub exogeneity: Option<Exogeneity>,
    /// Simulations with parameters of the first and of the second half of the logs.
    pub halves: [InstrumentRun; 2],
}

impl Comparison {
    /// The half whose simulation left its reference, if one did.
    pub fn diverged(&self) -> Option<&InstrumentRun> {
        self.halves.iter().find(|run| matches!(run.end, IterationEnd::Diverged { .. }))
    }
}

/// A problem with what its fit has found so far.
pub(crate) struct Loop<'a> {
    pub(crate) problem: &'a Problem,
    pub(crate) shapes: Option<&'a ShapeFit>,
    /// `None` on the textbook route.
    pub(crate) conditioning: Option<&'a Conditioning>,
    pub(crate) power: &'a FrictionPower,
}

impl Loop<'_> {
    /// Prior deviations of the base parameters: sizes to measure changes and effects by.
    fn sizes(&self) -> Vec<f64> {
        self.problem.structure.space.base_std().to_vec()
    }
}

/// Instrumental-variable fit, begun at a fit by least squares: that fit itself if a simulation diverges.
///
/// # Errors
/// [`Error::Setting`] without a closed loop or a reference, [`Error::Unsupported`] for what is not simulated in closed loop, and errors of
/// simulations that settings cause.
pub(crate) fn fit(
    closed: &Loop<'_>,
    start: LinearEstimate,
) -> Result<(LinearEstimate, InstrumentRun), Error> {
    let settings = &closed.problem.settings;
    let table = table(settings)?;
    let bench = Bench::new(table, closed)?;
    let rounds = (table.settled, table.max_rounds);
    let found = iterate(&start.x, &closed.sizes(), rounds, &iteration(settings), |last| {
        bench.simulated(last.map_or(&start.factor, |e| &e.linear.factor))
    })?;
    let run = InstrumentRun::of(&found);
    let linear = found.estimate.map(|e| e.linear).filter(|_| run.succeeded());
    Ok((linear.unwrap_or(start), run))
}

/// Compares least squares (ordinary where the run's method is, else weighted) with instruments, on the training logs of a fitted
/// problem (test of Durbin, Wu and Hausman; [`dynid_estimate::instruments::exogeneity()`]).
///
/// No instrument knows anything of the samples that it is tested on: rows of the first half of every log are paired with simulations of
/// parameters that were estimated on the second halves alone, by least squares and then by instruments until they settled, and the other
/// way round. Time blocks are those of the fit's standard deviations (`merged_blocks` blocks of rows each); the prior size of a base parameter is its prior
/// standard deviation.
///
/// # Errors
/// [`Error::Setting`] without a closed loop or a reference, [`Error::Unsupported`] for what is not simulated in closed loop, and
/// errors of simulations that settings cause. A simulation that diverges is an outcome.
pub(crate) fn compare(closed: &Loop<'_>, merged_blocks: usize) -> Result<Comparison, Error> {
    let settings = &closed.problem.settings;
    let bench = Bench::new(table(settings)?, closed)?;
    let rows = bench.measured()?;
    let sizes = closed.sizes();
    let (front, of_front) = from_half(settings, &bench, &rows, &sizes, false)?;
    let (back, of_back) = from_half(settings, &bench, &rows, &sizes, true)?;
    let total = closed.problem.structure.base.len();
    let exogeneity = match (&front, &back) {
        (Some(front), Some(back)) => {
            let paired = crossed(back, front);
            let squares = least_squares(settings, &measured(&paired), total)?;
            let paired: Vec<ReducedGroup> = paired.iter().map(|g| g.coarsened(merged_blocks)).collect();
            exogeneity(&paired, &squares.weights(), total, &sizes, &ExogeneitySettings::default())
        }
        _ => None,
    };
    Ok(Comparison { exogeneity, halves: [of_front, of_back] })
}

/// Rows of the whole logs paired with simulations of parameters that one half of every log determines; `None` if one diverged.
fn from_half(
    settings: &Settings,
    bench: &Bench<'_>,
    rows: &[ReducedGroup],
    sizes: &[f64],
    second: bool,
) -> Result<(Option<Vec<ReducedGroup>>, InstrumentRun), Error> {
    let table = table(settings)?;
    let start = least_squares(settings, &half(rows, second), sizes.len())?;
    let whole = RefCell::new(None);
    let rounds = (table.settled, table.max_rounds);
    let found = iterate(&start.x, sizes, rounds, &iteration(settings), |last| -> Result<Simulated, Error> {
        Ok(match bench.simulated(last.map_or(&start.factor, |e| &e.linear.factor))? {
            Simulated::Rows(paired) => {
                let own = half(&paired, second);
                whole.replace(Some(paired));
                Simulated::Rows(own)
            }
            diverged => diverged,
        })
    })?;
    let run = InstrumentRun::of(&found);
    Ok((whole.into_inner().filter(|_| run.succeeded()), run))
}

fn least_squares(
    settings: &Settings,
    groups: &[ReducedGroup],
    total: usize,
) -> Result<LinearEstimate, Error> {
    let method = match settings.estimator.method {
        Method::Ols => LinearMethod::Ols,
        _ => LinearMethod::Wls,
    };
    Ok(estimate(groups, None, total, &method, &fitting::linear_settings(settings))?)
}

fn iteration(settings: &Settings) -> InstrumentSettings {
    InstrumentSettings { linear: fitting::linear_settings(settings), ..InstrumentSettings::default() }
}

fn table(settings: &Settings) -> Result<&ClosedLoop, Error> {
    let missing = || Error::setting("instruments", "a table with reference and controller", "none");
    settings.closed_loop.as_ref().ok_or_else(missing)
}
