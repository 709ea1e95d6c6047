//! Population and pattern searches over any function, behind one call.
//!
//! ```
//! use dynid_search::{Algorithm, Bounds, PointObjective, Settings, run};
//! use std::ops::ControlFlow;
//!
//! let rosenbrock = PointObjective::new(2, |x: &[f64]| {
//!     100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
//! });
//! let bounds = Bounds::new(vec![-5.0; 2], vec![5.0; 2])?;
//! let algorithm: Algorithm = "cma-es".parse()?;
//! let settings = Settings { target: Some(1e-12), ..Settings::default() };
//! let found = run(&algorithm, &rosenbrock, &bounds, &settings, &mut |_| ControlFlow::Continue(()))?;
//! assert!((found.point[0] - 1.0).abs() < 1e-5);
//! # Ok::<(), dynid_search::SearchError>(())
//! ```
//!
//! What all algorithms have in common:
//!
//! - An [`Objective`] gets whole groups of candidates. Values that are not finite count as `+∞`, are counted, and enter no
//!   statistics.
//! - [`Bounds`] are never left, to the last bit; a coordinate may be searched by its logarithm.
//! - One ChaCha8 stream per run, drawn from in the order of candidates: the same bits for any number of threads. With
//!   another budget, a run begins with the same steps.
//! - After every iteration the observer sees the [`Progress`], may save a [`Checkpoint`] and may stop the run.
//!
//! Equations and sources are with each algorithm's parameters. [`rank_sum`] compares two sets of results.

mod algorithm;
mod bee_colony;
mod bounds;
mod checkpoint;
mod cma_es;
mod cuckoo;
mod curvature;
mod differential_evolution;
mod driver;
mod error;
mod history;
mod objective;
mod particle_swarm;
mod pattern;
mod population;
mod random;
mod range;
mod rank_sum;
mod run;
mod settings;
mod tent;

use std::ops::ControlFlow;

use rayon::prelude::*;

pub use algorithm::Algorithm;
pub use bee_colony::BeeColony;
pub use bounds::{Bounds, BoundsError};
pub use checkpoint::{Checkpoint, CheckpointError};
pub use cma_es::CmaEs;
pub use cuckoo::{CuckooSearch, ImprovedCuckooSearch};
pub use curvature::covariance_of_values;
pub use differential_evolution::DifferentialEvolution;
pub use error::SearchError;
pub use history::HistoryPoint;
pub use objective::{Objective, PointObjective};
pub use particle_swarm::{Neighbours, ParticleSwarm};
pub use pattern::PatternSearch;
pub use rank_sum::{RankSum, rank_sum};
pub use run::{Progress, SearchResult, Status};
pub use settings::Settings;
pub use tent::TentMap;

use driver::Driver;
use run::{Method, Run};

/// What watches a run: called after every whole iteration, and able to stop it.
pub type Observer<'a> = dyn FnMut(&Progress<'_>) -> ControlFlow<()> + 'a;

/// Minimises an objective within bounds.
///
/// # Errors
/// Dimensions that do not match, settings or parameters out of range, bounds that the algorithm cannot use, and an
/// objective that is finite nowhere. How the search ended is no error but a [`Status`].
pub fn run(
    algorithm: &Algorithm,
    objective: &dyn Objective,
    bounds: &Bounds,
    settings: &Settings,
    observer: &mut Observer<'_>,
) -> Result<SearchResult, SearchError> {
    start(algorithm, objective, bounds, settings, None, observer)
}

/// Goes on with a run from a checkpoint, with the same bits as if it had not been interrupted. Budget, target, stall and
/// observer may differ from those of the run that was saved; counters go on.
///
/// # Errors
/// Fails as [`run`] does, and for a checkpoint of another algorithm, population, seed or bounds, or a damaged one.
pub fn resume(
    algorithm: &Algorithm,
    objective: &dyn Objective,
    bounds: &Bounds,
    settings: &Settings,
    checkpoint: &Checkpoint,
    observer: &mut Observer<'_>,
) -> Result<SearchResult, SearchError> {
    start(algorithm, objective, bounds, settings, Some(checkpoint), observer)
}

/// Runs with several seeds in parallel, results in the order of the seeds. The seed of the settings is not used.
///
/// # Errors
/// Fails as [`run`] does; of several, that of the first seed.
pub fn many(
    algorithm: &Algorithm,
    objective: &dyn Objective,
    bounds: &Bounds,
    settings: &Settings,
    seeds: &[u64],
) -> Result<Vec<SearchResult>, SearchError> {
    let one = |seed: &u64| {
        let settings = Settings { seed: *seed, ..settings.clone() };
        run(algorithm, objective, bounds, &settings, &mut |_| ControlFlow::Continue(()))
    };
    let results: Vec<_> = seeds.par_iter().map(one).collect();
    results.into_iter().collect()
}

fn start(
    algorithm: &Algorithm,
    objective: &dyn Objective,
    bounds: &Bounds,
    settings: &Settings,
    checkpoint: Option<&Checkpoint>,
    observer: &mut Observer<'_>,
) -> Result<SearchResult, SearchError> {
    let (expected, found) = (objective.dimensions(), bounds.dimensions());
    if expected != found {
        return Err(SearchError::Dimensions { expected, found });
    }
    settings.check(bounds)?;
    algorithm.check(settings, found)?;
    if let Some(index) = bounds.unbounded().filter(|_| algorithm.needs_box(settings)) {
        return Err(SearchError::Unbounded { algorithm: algorithm.name(), index });
    }
    let n = algorithm.population(settings, found);
    let call = Call { algorithm, objective, bounds, settings, checkpoint, population: n };
    match algorithm {
        Algorithm::BeeColony(p) => call.drive(bee_colony::Colony::new(p, n, found), observer),
        Algorithm::CuckooSearch(p) => call.drive(cuckoo::Cuckoo::plain(p, n, found), observer),
        Algorithm::ImprovedCuckooSearch(p) => call.drive(cuckoo::Cuckoo::improved(p, n, found), observer),
        Algorithm::ParticleSwarm(p) => call.drive(particle_swarm::Swarm::new(p, n, found), observer),
        Algorithm::PatternSearch(p) => call.drive(pattern::Pattern::new(p, found), observer),
        Algorithm::CmaEs(p) => call.drive(cma_es::Strategy::new(p, n, found), observer),
        Algorithm::DifferentialEvolution(p) => {
            call.drive(differential_evolution::Evolution::new(p, n, found), observer)
        }
    }
}

/// A checked call.
struct Call<'a> {
    algorithm: &'a Algorithm,
    objective: &'a dyn Objective,
    bounds: &'a Bounds,
    settings: &'a Settings,
    checkpoint: Option<&'a Checkpoint>,
    population: usize,
}

impl Call<'_> {
    fn drive<M: Method>(&self, method: M, observer: &mut Observer<'_>) -> Result<SearchResult, SearchError> {
        let limits = self.algorithm.limits(self.settings, self.bounds.dimensions());
        let run = Run::new(self.objective, self.bounds, self.settings, limits.evaluations);
        let label = format!("{:?} with a population of {}", self.algorithm, self.population);
        let mut driver = Driver::new(method, run, self.settings, label);
        if let Some(checkpoint) = self.checkpoint {
            driver.load(checkpoint)?;
        }
        driver.finish(&limits, self.settings, observer)
    }
}
