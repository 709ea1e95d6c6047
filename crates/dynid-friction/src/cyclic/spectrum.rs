//! Spectrum over position of rows at whatever places.

use std::f64::consts::{PI, TAU};

use dynid_motion::spectrum::Periodogram;

use super::rows::Row;

/// Length of the transform in ranges of the joint: orders are then a quarter of what the range tells apart from each other.
const RANGES: f64 = 4.0;
/// Largest order times the distance of grid points. Rows between points are shared by the two next to them: aliases stay below 3 %.
const FINE: f64 = 0.35 * PI;
/// Longest transform.
const LONGEST: f64 = (1 << 20) as f64;
/// Width of a band of orders, within which the kernel leaves about the same of every ripple.
const BAND: f64 = 1.5;
/// Rows of which the kernel leaves less than this do not count.
const LEAST_PASSES: f64 = 0.05;

/// Share of the weighted residual sum of squares that an order explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) order: f64,
    /// Of a torque and of a friction.
    pub(super) shares: [f64; 2],
}

/// Lines of all orders in a range, ascending, `π / (2 range)` apart.
pub(super) fn spectrum(rows: &[Row], kernel_s: f64, range: (f64, f64), orders: (f64, f64)) -> Vec<Line> {
    let length = RANGES * (range.1 - range.0);
    let most = orders.1.min(LONGEST * FINE / length);
    let points = ((length * most / FINE) as usize).max(64).next_power_of_two();
    let (step, spacing) = (TAU / length, length / points as f64);
    let mut powers = Periodogram::new(points);
    let mut grids = [vec![0.0; points], vec![0.0; points]];
    let total: f64 = rows.iter().map(|row| (row.weight * row.residual).powi(2)).sum();
    let mut out = Vec::new();
    let mut low = orders.0;
    while low < most {
        let high = (low * BAND).min(most);
        let middle = (low * high).sqrt();
        grids.iter_mut().for_each(|grid| grid.fill(0.0));
        let mut squares = 0.0;
        for row in rows {
            let passes = row.passes(middle, kernel_s);
            if passes < LEAST_PASSES {
                continue;
            }
            let weight = row.weight * passes;
            squares += weight * weight;
            let place = (row.position - range.0) / spacing;
            let (first, rest) = (place as usize, place.fract());
            let torque = weight * row.weight * row.residual;
            for (grid, value) in grids.iter_mut().zip([torque, torque * row.velocity.signum()]) {
                grid[first] += (1.0 - rest) * value;
                grid[first + 1] += rest * value;
            }
        }
        let lines = grids.each_ref().map(|grid| powers.of(grid));
        let (first, last) = ((low / step).ceil() as usize, (high / step).ceil() as usize);
        if squares > 0.0 && total > 0.0 {
            out.extend((first..last.min(points / 2)).map(|k| {
                let order = k as f64 * step;
                let half = 0.5 * order * spacing;
                // Sharing a row by two points dampens it by this.
                let shared = (half.sin() / half).powi(4);
                let share = |line: &[f64]| 2.0 * line[k] / (shared * squares * total);
                Line { order, shares: [share(&lines[0]), share(&lines[1])] }
            }));
        }
        low = high;
    }
    out
}
