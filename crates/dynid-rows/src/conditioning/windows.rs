//! Weighted sums over windows of several signals at once, in lanes.

use dynid_model::Scalar;
use dynid_model::scalar::{LANES, LaneTask, run_on_lanes};
use dynid_motion::Kernel;

/// Signals that are summed at a time: enough for a processor to begin a sum while the ones before are not yet there.
const AT_ONCE: usize = 4;

/// Adds to weighted means what a block of signals holds of their windows, as [`Kernel::add_block`] does for one signal.
///
/// `columns`: signals from sample `first` on; `centres`: ascending. `out`: column-major, one entry per centre and signal. A sum depends on its
/// own signal and window alone, whatever stands beside it.
pub(super) fn add_windows(
    kernel: &Kernel,
    first: usize,
    centres: &[usize],
    columns: &[&[f64]],
    out: &mut [f64],
) {
    assert_eq!(out.len(), columns.len() * centres.len(), "one entry per centre and signal");
    let Some(samples) = columns.first().map(|column| column.len()) else { return };
    let (half, end) = (kernel.half_width(), first + samples);
    let touched = centres.partition_point(|c| c + half < first)..centres.partition_point(|c| *c < end + half);
    let windows = centres[touched.clone()].iter().zip(touched).map(|(centre, row)| {
        // The window's first sample is `centre - half`, which may lie before the block.
        let from = (first + half).saturating_sub(*centre);
        let length = kernel.weights().len().min(end + half - centre) - from;
        Window { row, weight: from, sample: centre + from - half - first, length }
    });
    let windows: Vec<Window> = windows.collect();
    if windows.is_empty() {
        return;
    }
    run_on_lanes(AddWindows {
        weights: kernel.weights(),
        windows: &windows,
        columns,
        rows: centres.len(),
        out,
    });
}

/// Weighted means of one signal about samples of it whose windows it holds; the bits of [`add_windows`] for whole windows.
pub(super) fn means(kernel: &Kernel, signal: &[f64], centres: impl Iterator<Item = usize>) -> Vec<f64> {
    let (half, width) = (kernel.half_width(), kernel.weights().len());
    let windows: Vec<&[f64]> = centres.map(|centre| &signal[centre - half..][..width]).collect();
    let mut out = vec![0.0; windows.len()];
    run_on_lanes(Means { weights: kernel.weights(), windows: &windows, out: &mut out });
    out
}

/// What a block holds of a row's window.
struct Window {
    row: usize,
    /// First weight and first sample.
    weight: usize,
    sample: usize,
    length: usize,
}

struct AddWindows<'a> {
    weights: &'a [f64],
    windows: &'a [Window],
    columns: &'a [&'a [f64]],
    rows: usize,
    out: &'a mut [f64],
}

impl LaneTask for AddWindows<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let AddWindows { weights, windows, columns, rows, out } = self;
        let (groups, rest) = columns.as_chunks::<AT_ONCE>();
        let (of_groups, of_rest) = out.split_at_mut(groups.len() * AT_ONCE * rows);
        // A group of signals stays in the first-level cache while all windows pass over it.
        for (columns, out) in groups.iter().zip(of_groups.chunks_exact_mut(AT_ONCE * rows)) {
            for window in windows {
                window.add(weights, columns, rows, out, &load, &store);
            }
        }
        for (column, out) in rest.iter().zip(of_rest.chunks_exact_mut(rows)) {
            for window in windows {
                window.add(weights, &[*column], rows, out, &load, &store);
            }
        }
    }
}

impl Window {
    #[inline(always)]
    fn add<S: Scalar, const N: usize>(
        &self,
        weights: &[f64],
        columns: &[&[f64]; N],
        rows: usize,
        out: &mut [f64],
        load: &impl Fn(&[f64]) -> S,
        store: &impl Fn(S, &mut [f64]),
    ) {
        let weights = &weights[self.weight..][..self.length];
        let mut parts = *columns;
        for part in &mut parts {
            *part = &part[self.sample..][..self.length];
        }
        let sums = sums(weights, parts, load, store);
        for (k, sum) in sums.iter().enumerate() {
            out[k * rows + self.row] += sum;
        }
    }
}

struct Means<'a> {
    weights: &'a [f64],
    windows: &'a [&'a [f64]],
    out: &'a mut [f64],
}

impl LaneTask for Means<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let (groups, rest) = self.windows.as_chunks::<AT_ONCE>();
        let (of_groups, of_rest) = self.out.as_chunks_mut::<AT_ONCE>();
        for (windows, out) in groups.iter().zip(of_groups) {
            *out = sums(self.weights, *windows, &load, &store);
        }
        for (window, out) in rest.iter().zip(of_rest) {
            [*out] = sums(self.weights, [*window], &load, &store);
        }
    }
}

/// Sums of products with the same weights: two interleaved sums of lanes each, whatever the number of signals.
#[inline(always)]
fn sums<S: Scalar, const N: usize>(
    weights: &[f64],
    signals: [&[f64]; N],
    load: &impl Fn(&[f64]) -> S,
    store: &impl Fn(S, &mut [f64]),
) -> [f64; N] {
    const STEP: usize = 2 * LANES;
    let mut even = [S::zero(); N];
    let mut odd = [S::zero(); N];
    let steps = weights.len() / STEP;
    for step in 0..steps {
        let at = step * STEP;
        let (first, second) = (load(&weights[at..]), load(&weights[at + LANES..]));
        let mut k = 0;
        while k < N {
            even[k] = load(&signals[k][at..]).mul_add(first, even[k]);
            odd[k] = load(&signals[k][at + LANES..]).mul_add(second, odd[k]);
            k += 1;
        }
    }
    let mut done = steps * STEP;
    if weights.len() - done >= LANES {
        let first = load(&weights[done..]);
        let mut k = 0;
        while k < N {
            even[k] = load(&signals[k][done..]).mul_add(first, even[k]);
            k += 1;
        }
        done += LANES;
    }
    let mut out = [0.0; N];
    let mut k = 0;
    while k < N {
        let mut lanes = [0.0; LANES];
        store(even[k] + odd[k], &mut lanes);
        let mut rest = 0.0;
        for n in done..weights.len() {
            rest += weights[n] * signals[k][n];
        }
        out[k] = ((lanes[0] + lanes[2]) + (lanes[1] + lanes[3])) + rest;
        k += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(count: usize) -> Vec<Vec<f64>> {
        (0..count).map(|j| (0..700).map(|n| (0.37 * (n * (j + 2)) as f64).sin() + 0.2).collect()).collect()
    }

    /// Each of at most 100 products of weights, which sum to one, and samples below 1.2 rounds once, as does its sum.
    const BOUND: f64 = 200.0 * f64::EPSILON * 1.2;

    #[test]
    fn sums_are_those_of_the_kernel() {
        for cutoff_hz in [3.0, 5.0, 8.1, 40.0, 200.0] {
            let kernel = Kernel::new(cutoff_hz, 200.0).unwrap();
            let centres = kernel.centres(700);
            for count in 0..10 {
                let signals = signals(count);
                let columns: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
                let mut out = vec![0.0; count * centres.len()];
                add_windows(&kernel, 0, &centres, &columns, &mut out);
                for (signal, out) in signals.iter().zip(out.chunks(centres.len())) {
                    assert_eq!(means(&kernel, signal, centres.iter().copied()), out);
                    for (centre, sum) in centres.iter().zip(out) {
                        assert!((kernel.apply_at(signal, *centre) - sum).abs() < BOUND);
                    }
                }
            }
        }
    }

    #[test]
    fn a_block_without_windows_adds_nothing() {
        let kernel = Kernel::new(5.0, 200.0).unwrap();
        let signals = signals(5);
        let columns: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
        add_windows(&kernel, 0, &[], &columns, &mut []);
        let mut out = [0.0; 5];
        add_windows(&kernel, 0, &[700 + kernel.half_width()], &columns, &mut out);
        assert_eq!(out, [0.0; 5]);
    }

    #[test]
    fn parts_of_windows_add_up() {
        let kernel = Kernel::new(5.0, 200.0).unwrap();
        let centres = kernel.centres(700);
        let signals = signals(5);
        let columns: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
        let mut whole = vec![0.0; 5 * centres.len()];
        add_windows(&kernel, 0, &centres, &columns, &mut whole);
        for length in [1, 17, 64, 333, 699] {
            let mut parts = vec![0.0; whole.len()];
            for first in (0..700).step_by(length) {
                let pieces: Vec<&[f64]> =
                    columns.iter().map(|c| &c[first..(first + length).min(700)]).collect();
                add_windows(&kernel, first, &centres, &pieces, &mut parts);
            }
            assert!(parts.iter().zip(&whole).all(|(a, b)| (a - b).abs() < BOUND), "{length}");
        }
    }
}
