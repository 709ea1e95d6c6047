//! Particle swarm optimisation.
//!
//! Every particle has a position `x`, a velocity `v` and a memory `p`, the best position it has seen. Per iteration and
//! coordinate, with `r₁`, `r₂` uniform on (0, 1) and `g` the best memory among those the particle hears of,
//!
//! ```text
//! v ← w v + c₁ r₁ (p - x) + c₂ r₂ (g - x),   |v| ≤ share · (upper - lower),   x ← x + v
//! ```
//!
//! and positions are clipped to the bounds. Two named presets:
//!
//! - [`ParticleSwarm::published`] (the default): `w = 0.5`, `c₁ = c₂ = 0.2`, share 0.2, everyone hears of everyone.
//!   It contracts within some 50 iterations and stalls: right for repeating the published
//!   ranking, wrong for anything else.
//! - [`ParticleSwarm::general`]: `w = 0.65`, `c₁ = c₂ = 1.5`, each particle informs six random others until an iteration
//!   brings no progress, then others are drawn; a velocity that led out of the bounds is reversed and halved. Topology and
//!   bounds are those of the standard particle swarm of 2007 (Clerc 2006), whose constants (0.72, 1.19, three informed)
//!   converge more slowly: the values here were chosen among 108 combinations on the functions of `bench/search`.
//!
//! Velocities start uniform within their limits (the sources are silent; from rest, the published settings end 2 to 3 %
//! higher).
//!
//! Evaluations: population + population per iteration.
//!
//! Source: Kennedy & Eberhart 1995; Shi & Eberhart 1998 for `w`.

use super::error::SearchError;
use super::population::Population;
use super::range::{inside, not_negative};
use super::run::{Method, Run, Step};
use dynid_words::Transfer;

/// Which memories a particle hears of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbours {
    /// All.
    All,
    /// Best points of the particle itself and of the particles that drew it, each drawing so many; drawn anew after an iteration without
    /// progress.
    Random(usize),
}

/// Parameters of a particle swarm.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticleSwarm {
    /// `w`, in [0, 1).
    pub inertia: f64,
    /// `c₁`, not negative.
    pub cognitive: f64,
    /// `c₂`, not negative.
    pub social: f64,
    /// Largest velocity as a share of the width of the bounds, in (0, 1].
    pub largest_step: f64,
    /// Factor of a velocity that led out of the bounds, in [-1, 1]; 1 leaves it as it is.
    pub rebound: f64,
    /// Which memories a particle hears of.
    pub neighbours: Neighbours,
    /// Default of [`Settings::population`](super::Settings::population).
    pub particles: usize,
}

impl ParticleSwarm {
    /// Settings published for the ER-16: 25 particles, 200 iterations.
    pub fn published() -> Self {
        ParticleSwarm {
            inertia: 0.5,
            cognitive: 0.2,
            social: 0.2,
            largest_step: 0.2,
            rebound: 1.0,
            neighbours: Neighbours::All,
            particles: 25,
        }
    }

    /// For general use: 20 particles.
    pub fn general() -> Self {
        ParticleSwarm {
            inertia: 0.65,
            cognitive: 1.5,
            social: 1.5,
            largest_step: 0.5,
            rebound: -0.5,
            neighbours: Neighbours::Random(6),
            particles: 20,
        }
    }

    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        if !(0.0..1.0).contains(&self.inertia) {
            let expected = "in [0, 1)";
            return Err(SearchError::Parameter {
                algorithm,
                parameter: "inertia",
                expected,
                found: self.inertia,
            });
        }
        not_negative(algorithm, "cognitive", self.cognitive)?;
        not_negative(algorithm, "social", self.social)?;
        inside(algorithm, "largest_step", self.largest_step, 0.0, 1.0 + f64::EPSILON, "in (0, 1]")?;
        let wide = 1.0 + f64::EPSILON;
        inside(algorithm, "rebound", self.rebound, -wide, wide, "in [-1, 1]")
    }
}

impl Default for ParticleSwarm {
    fn default() -> Self {
        Self::published()
    }
}

#[derive(Clone)]
pub(super) struct Swarm {
    parameters: ParticleSwarm,
    positions: Population,
    velocities: Vec<f64>,
    memories: Population,
    /// `informs[k * n + i]`: particle `k` informs particle `i`; empty if all inform all.
    informs: Vec<bool>,
}

impl Swarm {
    pub(super) fn new(parameters: &ParticleSwarm, particles: usize, dimensions: usize) -> Swarm {
        let links = match parameters.neighbours {
            Neighbours::All => 0,
            Neighbours::Random(_) => particles * particles,
        };
        Swarm {
            parameters: parameters.clone(),
            positions: Population::new(particles, dimensions),
            velocities: vec![0.0; particles * dimensions],
            memories: Population::new(particles, dimensions),
            informs: vec![false; links],
        }
    }

    fn draw_links(&mut self, run: &mut Run<'_>) {
        let Neighbours::Random(count) = self.parameters.neighbours else { return };
        let n = self.positions.len();
        self.informs.fill(false);
        for particle in 0..n {
            self.informs[particle * n + particle] = true;
            for _ in 0..count {
                self.informs[particle * n + run.random.below(n)] = true;
            }
        }
    }

    fn informant(&self, particle: usize, best: usize) -> usize {
        if self.informs.is_empty() {
            return best;
        }
        let n = self.positions.len();
        let values = &self.memories.values;
        let better = |best: usize, k: usize| if values[k] < values[best] { k } else { best };
        (0..n).filter(|k| self.informs[k * n + particle]).fold(particle, better)
    }

    fn fly(&mut self, run: &mut Run<'_>) {
        let d = run.bounds.dimensions();
        let best = self.memories.best();
        let ParticleSwarm { inertia, cognitive, social, largest_step, rebound, .. } = self.parameters;
        for particle in 0..self.positions.len() {
            let leader = self.informant(particle, best);
            let (own, led) = (self.memories.point(particle), self.memories.point(leader));
            let position = self.positions.point_mut(particle);
            let velocity = &mut self.velocities[particle * d..][..d];
            for i in 0..d {
                let x = position[i];
                let pull = cognitive * run.random.uniform() * (own[i] - x);
                let draw = social * run.random.uniform() * (led[i] - x);
                let most = largest_step * run.bounds.width(i);
                velocity[i] = (inertia * velocity[i] + pull + draw).max(-most).min(most);
                position[i] = run.bounds.clip(i, x + velocity[i]);
                if position[i] != x + velocity[i] {
                    velocity[i] *= rebound;
                }
            }
        }
        self.positions.evaluate(run);
    }

    fn remember(&mut self) {
        for particle in 0..self.positions.len() {
            if self.positions.values[particle] < self.memories.values[particle] {
                self.memories.take(particle, &self.positions, particle);
            }
        }
    }
}

impl Method for Swarm {
    fn start(&mut self, run: &mut Run<'_>) {
        self.positions.draw(run);
        self.memories = self.positions.clone();
        let d = run.bounds.dimensions();
        for (k, v) in self.velocities.iter_mut().enumerate() {
            let most = self.parameters.largest_step * run.bounds.width(k % d);
            *v = run.random.between(-most, most);
        }
        self.draw_links(run);
    }

    fn iterate(&mut self, run: &mut Run<'_>) -> Step {
        let before = self.memories.values[self.memories.best()];
        self.fly(run);
        self.remember();
        if self.memories.values[self.memories.best()] >= before {
            self.draw_links(run);
        }
        Step::GoOn
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        self.positions.fields(transfer);
        transfer.reals(&mut self.velocities);
        self.memories.fields(transfer);
        self.informs.iter_mut().for_each(|link| transfer.flag(link));
    }
}
