//! Closes the gap between the grid of the search and every instant.

use crate::grid::{Grid, LimitId, LimitValues};
use crate::optimiser::{Elastic, QuadraticProgram, Row};
use crate::parametrisation::Parametrisation;
use crate::problem::Problem;
use crate::start::{feasible_share, shrunk};

/// Samples of the first pass.
const COARSE: usize = 1000;
/// Samples of the second pass, which looks at peaks alone.
const FINE: usize = 10_000;
const REPEATS: usize = 12;
const ELASTIC: Elastic = Elastic { linear: 1e3, quadratic: 1e-4 };

/// Grids on which limits are met exactly.
pub(crate) struct Restoration<'a> {
    problem: &'a Problem,
    map: &'a Parametrisation,
    coarse: Grid<'a>,
    fine: Grid<'a>,
}

/// Limits met, or as nearly as could be.
pub(crate) struct Restored {
    pub(crate) z: Vec<f64>,
    /// Largest excess over all limits and instants, normalised; at most 0 if all limits hold.
    pub(crate) excess: f64,
    /// Share of the amplitudes that is left, below 1 if nothing else helped.
    pub(crate) share: f64,
}

impl<'a> Restoration<'a> {
    pub(crate) fn new(problem: &'a Problem, map: &'a Parametrisation) -> Self {
        let finer = |samples: usize| samples.max(40 * problem.harmonics);
        Restoration {
            problem,
            map,
            coarse: Grid::exact(problem, map, finer(COARSE)),
            fine: Grid::exact(problem, map, finer(FINE)),
        }
    }

    /// Moves `z` by as little as possible until all limits hold at all instants.
    pub(crate) fn restore(&self, mut z: Vec<f64>) -> Restored {
        for _ in 0..REPEATS {
            let values = self.coarse.values(&z);
            if values.worst().0 <= -1e-5 {
                break;
            }
            let rows = self.coarse.linearised(&values, 3e-5, |l, s| l.excess(s) > -0.02);
            if !step(&mut z, rows.into_iter().map(|r| r.row).collect()) {
                break;
            }
        }
        for _ in 0..REPEATS {
            let values = self.fine.values(&z);
            let peaks = self.peaks(&values, 2e-3);
            if peaks.is_empty() {
                break;
            }
            let grid = Grid::at_times(self.problem, self.map, peaks.iter().map(|p| p.1).collect());
            let at_peaks = grid.values(&z);
            if values.worst().0 <= 0.0 && excess_at(&at_peaks, &peaks) <= 0.0 {
                break;
            }
            let rows = grid.linearised(&at_peaks, 2e-6, |l, s| l.id == peaks[s].0);
            if !step(&mut z, rows.into_iter().map(|r| r.row).collect()) {
                break;
            }
        }
        let excess = self.excess(&z);
        if excess <= 0.0 {
            return Restored { z, excess, share: 1.0 };
        }
        let Some(share) = feasible_share(&self.fine, &z) else {
            return Restored { z, excess, share: 1.0 };
        };
        // Peaks between the samples of the fine grid are below this.
        let share = share * (1.0 - 1e-5);
        let z = shrunk(&self.fine, &z, share);
        let excess = self.excess(&z);
        Restored { z, excess, share }
    }

    /// Largest excess over all limits on the fine grid and at the peaks between its samples.
    pub(crate) fn excess(&self, z: &[f64]) -> f64 {
        let values = self.fine.values(z);
        let peaks = self.peaks(&values, 2e-3);
        if peaks.is_empty() {
            return values.worst().0;
        }
        let grid = Grid::at_times(self.problem, self.map, peaks.iter().map(|p| p.1).collect());
        values.worst().0.max(excess_at(&grid.values(z), &peaks))
    }

    /// Local maxima of the excess that come within `distance` of a bound, by a parabola through three samples.
    fn peaks(&self, values: &LimitValues, distance: f64) -> Vec<(LimitId, f64)> {
        let samples = values.motion.samples;
        let spacing = self.problem.period() / samples as f64;
        let mut peaks = Vec::new();
        for limit in &values.limits {
            for sample in 0..samples {
                let here = limit.excess(sample);
                if here < -distance {
                    continue;
                }
                let before = limit.excess((sample + samples - 1) % samples);
                let after = limit.excess((sample + 1) % samples);
                if here < before || here < after {
                    continue;
                }
                let bend = before - 2.0 * here + after;
                let shift = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-1.0, 1.0) } else { 0.0 };
                peaks.push((limit.id, (sample as f64 + shift) * spacing));
            }
        }
        peaks
    }
}

/// Largest excess of every peak's own limit.
fn excess_at(values: &LimitValues, peaks: &[(LimitId, f64)]) -> f64 {
    values
        .limits
        .iter()
        .flat_map(|limit| {
            let own = peaks.iter().enumerate().filter(|(_, p)| p.0 == limit.id);
            own.map(|(s, _)| limit.excess(s))
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// The least step that meets all rows; false if there is none, or a row is not known.
fn step(z: &mut [f64], rows: Vec<Row>) -> bool {
    if rows.iter().any(|r| !r.bound.is_finite() || r.values.iter().any(|x| !x.is_finite())) {
        return false;
    }
    let n = z.len();
    let mut hessian = vec![0.0; n * n];
    for i in 0..n {
        hessian[i * n + i] = 1.0;
    }
    let program = QuadraticProgram {
        hessian: &hessian,
        gradient: &vec![0.0; n],
        rows: &rows,
        radius: 0.5,
        elastic: Some(ELASTIC),
    };
    match program.solve() {
        Ok(minimum) => {
            z.iter_mut().zip(minimum.step).for_each(|(x, p)| *x += p);
            true
        }
        Err(_) => false,
    }
}
