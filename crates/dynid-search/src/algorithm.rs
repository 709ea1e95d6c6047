//! The choice of an algorithm.

use std::fmt;
use std::str::FromStr;

use super::bee_colony::BeeColony;
use super::cma_es::CmaEs;
use super::cuckoo::{CuckooSearch, ImprovedCuckooSearch};
use super::differential_evolution::DifferentialEvolution;
use super::driver::Limits;
use super::error::SearchError;
use super::particle_swarm::ParticleSwarm;
use super::pattern::PatternSearch;
use super::settings::Settings;

/// A search algorithm with its parameters.
///
/// | name | algorithm | population | default budget |
/// |---|---|---|---|
/// | `abc` | [`BeeColony::published`] | 100 | 200 iterations |
/// | `abc-general` | [`BeeColony::general`] | 25 | 10 000 d evaluations |
/// | `cs` | [`CuckooSearch`] | 25 | 200 iterations |
/// | `ics` | [`ImprovedCuckooSearch`] | 25 | 200 iterations |
/// | `pso` | [`ParticleSwarm::published`] | 25 | 200 iterations |
/// | `pso-general` | [`ParticleSwarm::general`] | 20 | 10 000 d evaluations |
/// | `gps` | [`PatternSearch`] | none | 100 d iterations, 2000 d evaluations |
/// | `cma-es` | [`CmaEs`] | 4 + ⌊3 ln d⌋ | 10 000 d evaluations |
/// | `de` | [`DifferentialEvolution`] | 60 | 10 000 d evaluations |
///
/// The published algorithms keep the settings of their sources, to be compared with; for a search of one's own, `cma-es`
/// and `de` are the ones to try first (docs/results.md).
#[derive(Debug, Clone, PartialEq)]
pub enum Algorithm {
    /// Artificial bee colony.
    BeeColony(BeeColony),
    /// Cuckoo search.
    CuckooSearch(CuckooSearch),
    /// Improved cuckoo search.
    ImprovedCuckooSearch(ImprovedCuckooSearch),
    /// Particle swarm.
    ParticleSwarm(ParticleSwarm),
    /// Generalised pattern search.
    PatternSearch(PatternSearch),
    /// Evolution strategy with covariance matrix adaptation.
    CmaEs(CmaEs),
    /// Differential evolution.
    DifferentialEvolution(DifferentialEvolution),
}

impl Algorithm {
    /// Names that [`Algorithm::from_str`] knows.
    pub const NAMES: [&'static str; 9] =
        ["abc", "abc-general", "cs", "ics", "pso", "pso-general", "gps", "cma-es", "de"];

    /// Short name of the algorithm, whatever its parameters.
    pub fn name(&self) -> &'static str {
        match self {
            Algorithm::BeeColony(_) => "abc",
            Algorithm::CuckooSearch(_) => "cs",
            Algorithm::ImprovedCuckooSearch(_) => "ics",
            Algorithm::ParticleSwarm(_) => "pso",
            Algorithm::PatternSearch(_) => "gps",
            Algorithm::CmaEs(_) => "cma-es",
            Algorithm::DifferentialEvolution(_) => "de",
        }
    }

    /// Size of the population in `dimensions` coordinates: of the settings, else the algorithm's own.
    pub fn population(&self, settings: &Settings, dimensions: usize) -> usize {
        settings.population.unwrap_or(match self {
            Algorithm::BeeColony(p) => p.sources,
            Algorithm::CuckooSearch(_) | Algorithm::ImprovedCuckooSearch(_) => 25,
            Algorithm::ParticleSwarm(p) => p.particles,
            Algorithm::PatternSearch(_) => 1,
            Algorithm::CmaEs(_) => 4 + (3.0 * (dimensions as f64).ln()) as usize,
            Algorithm::DifferentialEvolution(_) => 60,
        })
    }

    /// Whether points are drawn from the whole box.
    pub(super) fn needs_box(&self, settings: &Settings) -> bool {
        !(matches!(self, Algorithm::PatternSearch(_)) && settings.start.is_some())
    }

    pub(super) fn limits(&self, settings: &Settings, dimensions: usize) -> Limits {
        let d = dimensions as u64;
        let many = (None, Some(10_000 * d));
        let few = (Some(200), None);
        let own = match self {
            Algorithm::BeeColony(p) if *p == BeeColony::general() => many,
            Algorithm::ParticleSwarm(p) if *p == ParticleSwarm::general() => many,
            Algorithm::CmaEs(_) | Algorithm::DifferentialEvolution(_) => many,
            Algorithm::PatternSearch(_) => (Some(100 * d), Some(2000 * d)),
            _ => few,
        };
        let (iterations, evaluations) = match (settings.iterations, settings.evaluations) {
            (None, None) => own,
            given => given,
        };
        Limits { iterations: iterations.unwrap_or(u64::MAX), evaluations: evaluations.unwrap_or(u64::MAX) }
    }

    pub(super) fn check(&self, settings: &Settings, dimensions: usize) -> Result<(), SearchError> {
        let algorithm = self.name();
        let least = match self {
            Algorithm::BeeColony(p) => p.check(algorithm).map(|()| 2),
            Algorithm::CuckooSearch(p) => p.check(algorithm).map(|()| 2),
            Algorithm::ImprovedCuckooSearch(p) => p.check(algorithm).map(|()| 2),
            Algorithm::ParticleSwarm(p) => p.check(algorithm).map(|()| 1),
            Algorithm::PatternSearch(p) => p.check(algorithm).map(|()| 1),
            Algorithm::CmaEs(p) => p.check(algorithm).map(|()| 4),
            Algorithm::DifferentialEvolution(p) => p.check(algorithm).map(|()| 4),
        }?;
        let found = self.population(settings, dimensions);
        if found < least {
            return Err(SearchError::Population { algorithm, expected: least, found });
        }
        Ok(())
    }
}

impl FromStr for Algorithm {
    type Err = SearchError;

    fn from_str(name: &str) -> Result<Self, SearchError> {
        Ok(match name {
            "abc" => Algorithm::BeeColony(BeeColony::published()),
            "abc-general" => Algorithm::BeeColony(BeeColony::general()),
            "cs" => Algorithm::CuckooSearch(CuckooSearch::default()),
            "ics" => Algorithm::ImprovedCuckooSearch(ImprovedCuckooSearch::default()),
            "pso" => Algorithm::ParticleSwarm(ParticleSwarm::published()),
            "pso-general" => Algorithm::ParticleSwarm(ParticleSwarm::general()),
            "gps" => Algorithm::PatternSearch(PatternSearch::default()),
            "cma-es" => Algorithm::CmaEs(CmaEs::default()),
            "de" => Algorithm::DifferentialEvolution(DifferentialEvolution::default()),
            _ => return Err(SearchError::UnknownAlgorithm { name: name.to_owned(), known: &Self::NAMES }),
        })
    }
}

impl fmt::Display for Algorithm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
