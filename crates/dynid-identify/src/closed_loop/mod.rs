//! Estimators that simulate the closed loop a log was recorded in, and least squares against them.
//!
//! | estimator | unknowns of | source |
//! |---|---|---|
//! | `iv` | `Zᵀ(W x - y) = 0`, `Z` the regressor of the simulated motion | Janot, Vandanjon & Gautier 2014 |
//! | `didim` | `Z x = y` | Gautier, Janot & Vandanjon 2013 |
//! | `cloe` | `S dx = q - q_s`, `S` the slopes of the simulated positions | Landau, Anderson & De Bruyne 2001 for the principle |
//!
//! All three alternate: parameters, a simulation without noise along the same reference, rows, parameters, until they settle. What they need of
//! the controller differs. Whatever the simulation gets wrong makes instruments weaker, not wrong, as long as they know nothing of the noise;
//! DIDIM and CLOE take the simulated motion for the true one, so that a wrong reference, gain or delay is an error of the estimate
//! ([`LoopRun::mismatch`] shows it).
//!
//! What no simulation cures is noise that goes through a kink: a sign of velocity that noise turns near reversal is an error that
//! depends on the motion itself. Such rows must be left out of `iv` and `didim`, and are unless the configuration says otherwise
//! ([`ConditioningConfig::reversal_mask`](crate::settings::ConditioningConfig)). Shape parameters of friction are those that all rows
//! gave; simulations hold them.

mod comparison;
mod output_error;
mod reference;
mod simulation;

use dynid_estimate::instruments::{
    InstrumentSettings, InstrumentalEstimate, Iteration, IterationEnd, Simulated, Strength, along_simulation,
    instrumental, iterate, simulated,
};
use dynid_estimate::linear::{LinearEstimate, LinearMethod};
use dynid_factor::Factor;
use dynid_rows::conditioning::{Conditioning, ReducedGroup};

use crate::fitting::RowResiduals;
use crate::friction_power::FrictionPower;
use crate::problem::Problem;
use crate::settings::{ClosedLoop, Method, Settings};
use crate::shape::ShapeFit;
use crate::{Error, fitting};
pub use comparison::Comparison;
pub(crate) use comparison::compare;
use output_error::Shake;
pub use reference::reference_channel;
use simulation::Bench;

/// How the simulations of a fit went.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopRun {
    /// Simulations made.
    pub rounds: usize,
    /// How they ended; a fit whose simulation diverged is that of weighted least squares.
    pub end: IterationEnd,
    /// Largest change of a parameter in the last round, in parts of it or of its prior deviation; `None` without an estimate.
    pub last_change: Option<f64>,
    /// Of instruments: strength and smallest singular value of `Q_ZᵀQ_W`; `None` without an estimate.
    pub strength: Option<(Strength, f64)>,
    /// Of DIDIM and CLOE, output by output: what they leave of the measured efforts; empty without an estimate.
    pub mismatch: Vec<Mismatch>,
}

/// What a fit by simulations leaves of the measured efforts of an output along the measured motion, beside what weighted least squares leaves.
///
/// A loop that is not that of the log makes a simulated motion that is not the measured one, for which the parameters make up: the residual of
/// the fit itself need not show it, efforts along the measured motion do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mismatch {
    /// Output.
    pub output: usize,
    /// `rms(y - W x)/rms(y - W x_ls)`.
    pub of_residual: f64,
    /// `√(ms(y - W x) - ms(y - W x_ls))/rms(y)`.
    pub of_effort: f64,
}

impl Mismatch {
    /// Of measured rows and two estimates; outputs without rows or effort are left out.
    fn of(measured: &[ReducedGroup], x: &[f64], least_squares: &[f64]) -> Vec<Self> {
        let outputs = measured.iter().map(|g| g.output + 1).max().unwrap_or(0);
        let left = |output: usize, x: &[f64]| -> f64 {
            let own = measured.iter().filter(|g| g.output == output && g.scale == 0);
            own.map(|g| g.merged(x.len()).rss(x)).sum()
        };
        let none = vec![0.0; x.len()];
        let of_output = |output: usize| {
            let [of_x, of_ls, all] = [x, least_squares, &none].map(|x| left(output, x));
            Mismatch {
                output,
                of_residual: (of_x / of_ls).sqrt(),
                of_effort: ((of_x - of_ls).max(0.0) / all).sqrt(),
            }
        };
        (0..outputs).map(of_output).filter(|m| m.of_effort.is_finite() && m.of_residual.is_finite()).collect()
    }

    /// The output whose residual exceeds that of least squares by the largest ratio.
    pub fn worst(all: &[Self]) -> Option<&Self> {
        all.iter().max_by(|a, b| a.of_residual.total_cmp(&b.of_residual))
    }
}

impl LoopRun {
    fn of<T: AsRef<LinearEstimate>>(found: &Iteration<T>) -> Self {
        LoopRun {
            rounds: found.rounds,
            end: found.end.clone(),
            last_change: found.changes.last().copied(),
            strength: None,
            mismatch: Vec::new(),
        }
    }

    /// Whether the fit comes from simulations.
    pub fn succeeded(&self) -> bool {
        self.last_change.is_some() && !matches!(self.end, IterationEnd::Diverged { .. })
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

/// A fit by simulations.
pub(crate) struct LoopFit {
    pub(crate) estimate: LinearEstimate,
    /// `None` without simulations.
    pub(crate) run: Option<LoopRun>,
    /// Rows of the fit, where they are not those of the measured motion.
    pub(crate) groups: Option<Vec<ReducedGroup>>,
    /// Residuals of these rows, where they are not efforts.
    pub(crate) residuals: Option<RowResiduals>,
}

impl LoopFit {
    /// A fit that simulates nothing.
    pub(crate) fn without_simulation(estimate: LinearEstimate) -> Self {
        LoopFit { estimate, run: None, groups: None, residuals: None }
    }
}

/// Fit by simulations of the closed loop as the settings ask for, begun at a fit by least squares: that fit itself if a simulation diverges.
///
/// # Errors
/// [`Error::Setting`] without a closed loop or a reference, [`Error::Unsupported`] for what is not simulated in closed loop, and errors of
/// simulations that settings cause.
pub(crate) fn fit(closed: &Loop<'_>, start: LinearEstimate) -> Result<LoopFit, Error> {
    let settings = &closed.problem.settings;
    let table = table(settings)?;
    let bench = Bench::new(table, closed)?;
    match settings.estimator.method {
        Method::Didim => by_simulation(&bench, start, LinearMethod::Didim),
        Method::Cloe => by_simulation(&bench, start, LinearMethod::Cloe),
        _ => by_instruments(&bench, start),
    }
}

fn by_instruments(bench: &Bench<'_>, start: LinearEstimate) -> Result<LoopFit, Error> {
    let settings = &bench.closed.problem.settings;
    let rounds = (bench.table.settled, bench.table.max_rounds);
    let how = iteration(settings);
    let found = iterate(
        &start.x,
        &bench.closed.sizes(),
        rounds,
        |last: Option<&InstrumentalEstimate>| {
            bench.simulated(last.map_or(&start.factor, |e| &e.linear.factor))
        },
        |rows| instrumental(rows, start.x.len(), &how),
    )?;
    let strength = found.estimate.as_ref().map(|e| (e.strength, e.least_cosine));
    let run = LoopRun { strength, ..LoopRun::of(&found) };
    let estimate = found.estimate.map(|e| e.linear).filter(|_| run.succeeded()).unwrap_or(start);
    Ok(LoopFit { run: Some(run), ..LoopFit::without_simulation(estimate) })
}

/// DIDIM or CLOE.
fn by_simulation(bench: &Bench<'_>, start: LinearEstimate, method: LinearMethod) -> Result<LoopFit, Error> {
    let didim = method == LinearMethod::Didim;
    let rows = |factor: &Factor, shake: Option<&Shake>| -> Result<Simulated, Error> {
        if !didim {
            return bench.positions(factor, shake);
        }
        Ok(match bench.simulated(factor)? {
            Simulated::Rows(paired) => Simulated::Rows(simulated(&paired)),
            diverged => diverged,
        })
    };
    let mut found = settled_rows(bench, &start, &method, &|factor| rows(factor, None))?;
    let mut shake = None;
    if let (false, Some(estimate)) = (didim, &found.estimate) {
        let rounds = found.rounds;
        match bench.shake(&estimate.factor)? {
            Ok(displaced) => {
                shake = Some(displaced);
                found = settled_rows(bench, estimate, &method, &|factor| rows(factor, shake.as_ref()))?;
                found.rounds += rounds;
            }
            Err(diverged) => found.end = diverged.into(),
        }
    }
    let mut run = LoopRun::of(&found);
    let Some(estimate) = found.estimate.filter(|_| run.succeeded()) else {
        return Ok(LoopFit { run: Some(run), ..LoopFit::without_simulation(start) });
    };
    run.mismatch = Mismatch::of(&start.reduced, &estimate.x, &start.x);
    let residuals = match didim {
        true => None,
        false => bench.position_residuals(&estimate.factor, shake.as_ref(), &estimate.x)?,
    };
    let groups = Some(estimate.reduced.clone());
    Ok(LoopFit { estimate, run: Some(run), groups, residuals })
}

/// Weighted least squares on rows of simulations, over and over.
fn settled_rows(
    bench: &Bench<'_>,
    start: &LinearEstimate,
    method: &LinearMethod,
    rows: &dyn Fn(&Factor) -> Result<Simulated, Error>,
) -> Result<Iteration<LinearEstimate>, Error> {
    let linear = fitting::linear_settings(&bench.closed.problem.settings);
    iterate(
        &start.x,
        &bench.closed.sizes(),
        (bench.table.settled, bench.table.max_rounds),
        |last: Option<&LinearEstimate>| rows(last.map_or(&start.factor, |e| &e.factor)),
        |rows| along_simulation(rows, start.x.len(), method.clone(), &linear),
    )
}

fn iteration(settings: &Settings) -> InstrumentSettings {
    InstrumentSettings { linear: fitting::linear_settings(settings), ..InstrumentSettings::default() }
}

fn table(settings: &Settings) -> Result<&ClosedLoop, Error> {
    let missing = || Error::setting("instruments", "a table with reference and controller", "none");
    settings.closed_loop.as_ref().ok_or_else(missing)
}
