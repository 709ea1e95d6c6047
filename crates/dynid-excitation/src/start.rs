//! Random start points within all limits.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::grid::Grid;

/// Standard deviation of the amplitudes' unknowns.
const SPREAD: f64 = 0.7;
const BISECTIONS: usize = 40;
/// Starts that had to be shrunk below this share are drawn again.
const LEAST_SHARE: f64 = 0.05;
const DRAWS: usize = 60;
/// Mean poses that are drawn for one set of amplitudes.
const MEANS: usize = 200;

/// Unknowns drawn at random, of any size.
pub(crate) fn draw(grid: &Grid<'_>, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut z: Vec<f64> = (0..grid.map.unknowns())
        .map(|_| {
            let x: f64 = StandardNormal.sample(rng);
            SPREAD * x
        })
        .collect();
    draw_means(grid, rng, &mut z);
    z
}

fn draw_means(grid: &Grid<'_>, rng: &mut ChaCha8Rng, z: &mut [f64]) {
    for coordinate in 0..grid.map.coordinates() {
        if let Some(offset) = grid.map.offset_unknown(coordinate) {
            z[offset] = rng.random_range(-1.0..=1.0);
        }
    }
}

/// Generator of one start.
pub(crate) fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A random start within all limits of the grid: amplitudes are drawn, then shrunk about the mean pose (or the start
/// pose) by bisection. `None` if no draw could be shrunk into the limits.
pub(crate) fn feasible_start(grid: &Grid<'_>, rng: &mut ChaCha8Rng) -> Option<Vec<f64>> {
    let rest = Grid { bound: grid.bound, ..Grid::at_times(grid.problem, grid.map, vec![0.0]) };
    for _ in 0..DRAWS {
        let mut z = draw(grid, rng);
        // Where floor and own links leave few poses, most means are not allowed, which one instant tells.
        for _ in 0..MEANS {
            if rest.values(&shrunk(&rest, &z, 0.0)).worst().0 <= 0.0 {
                break;
            }
            draw_means(grid, rng, &mut z);
        }
        if let Some(share) = feasible_share(grid, &z)
            && share >= LEAST_SHARE
        {
            return Some(shrunk(grid, &z, share));
        }
    }
    None
}

/// Largest share of the amplitudes (found by bisection) at which all limits hold; `None` if they do not even at rest.
pub(crate) fn feasible_share(grid: &Grid<'_>, z: &[f64]) -> Option<f64> {
    let holds = |share: f64| grid.values(&shrunk(grid, z, share)).worst().0 <= 0.0;
    if holds(1.0) {
        return Some(1.0);
    }
    if !holds(0.0) {
        return None;
    }
    let (mut inside, mut outside) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (inside + outside);
        if holds(middle) { inside = middle } else { outside = middle }
    }
    Some(inside)
}

/// Amplitudes times `share`, offsets as they are.
pub(crate) fn shrunk(grid: &Grid<'_>, z: &[f64], share: f64) -> Vec<f64> {
    let mut out: Vec<f64> = z.iter().map(|x| share * x).collect();
    for coordinate in 0..grid.map.coordinates() {
        if let Some(offset) = grid.map.offset_unknown(coordinate) {
            out[offset] = z[offset];
        }
    }
    out
}
