//! Least squares against instruments.

use std::cell::RefCell;

use dynid_estimate::instruments::{
    Exogeneity, ExogeneitySettings, InstrumentalEstimate, IterationEnd, Simulated, crossed, exogeneity, half,
    instrumental, iterate, measured,
};
use dynid_estimate::linear::{LinearEstimate, LinearMethod, estimate};
use dynid_rows::conditioning::ReducedGroup;

use super::simulation::Bench;
use super::{Loop, LoopRun, iteration, table};
use crate::settings::{Method, Settings};
use crate::{Error, fitting};

/// Least squares against instruments, on the logs of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The test; `None` if a simulation diverged or no parameter is left to compare.
    pub exogeneity: Option<Exogeneity>,
    /// Simulations with parameters of the first and of the second half of the logs.
    pub halves: [LoopRun; 2],
}

impl Comparison {
    /// The half whose simulation left its reference, if one did.
    pub fn diverged(&self) -> Option<&LoopRun> {
        self.halves.iter().find(|run| matches!(run.end, IterationEnd::Diverged { .. }))
    }
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
    let of_half = |second| from_half(settings, &bench, &rows, &sizes, second);
    let (front, back) = rayon::join(|| of_half(false), || of_half(true));
    let ((front, of_front), (back, of_back)) = (front?, back?);
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
) -> Result<(Option<Vec<ReducedGroup>>, LoopRun), Error> {
    let table = table(settings)?;
    let start = least_squares(settings, &half(rows, second), sizes.len())?;
    let whole = RefCell::new(None);
    let rounds = (table.settled, table.max_rounds);
    let how = iteration(settings);
    let found = iterate(
        &start.x,
        sizes,
        rounds,
        |last: Option<&InstrumentalEstimate>| -> Result<Simulated, Error> {
            Ok(match bench.simulated(last.map_or(&start.factor, |e| &e.linear.factor))? {
                Simulated::Rows(paired) => {
                    let own = half(&paired, second);
                    whole.replace(Some(paired));
                    Simulated::Rows(own)
                }
                diverged => diverged,
            })
        },
        |rows| instrumental(rows, sizes.len(), &how),
    )?;
    let strength = found.estimate.as_ref().map(|e| (e.strength, e.least_cosine));
    let run = LoopRun { strength, ..LoopRun::of(&found) };
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
