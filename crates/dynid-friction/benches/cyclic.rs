//! Time of the search for cyclic efforts, per joint: rows without ripple, which most joints have, and with.
//!
//! `cargo bench -p dynid-friction --bench cyclic`

use divan::{Bencher, black_box};
use dynid_friction::cyclic::{CyclicRows, CyclicSettings, find_cyclic};

fn main() {
    divan::main();
}

/// Rows 5 ms apart, behind a kernel of 50 Hz, with a residual that looks like noise and perhaps ripple.
fn rows(count: usize, ripple: f64) -> CyclicRows {
    let mut out = CyclicRows { parts: 20, kernel_s: 0.0053, ..CyclicRows::default() };
    for k in 0..count {
        let t = 0.005 * k as f64;
        let q = 1.1 * (0.9 * t).sin() + 0.7 * (1.37 * t + 0.4).cos();
        let noise = (12.9898 * k as f64).sin() * (78.233 * k as f64).cos();
        out.position.push(q);
        out.velocity.push(0.99 * (0.9 * t).cos() - 0.959 * (1.37 * t + 0.4).sin());
        out.residual.push(noise + ripple * (50.0 * q).sin());
        out.weight.push(1.0);
        out.part.push(20 * k / count);
    }
    out
}

#[divan::bench(args = [2_000, 20_000])]
fn without_ripple(bencher: Bencher<'_, '_>, count: usize) {
    let (rows, settings) = (rows(count, 0.0), CyclicSettings::default());
    bencher.bench_local(|| find_cyclic(black_box(&rows), &settings));
}

#[divan::bench(args = [2_000, 20_000])]
fn with_ripple(bencher: Bencher<'_, '_>, count: usize) {
    let (rows, settings) = (rows(count, 0.5), CyclicSettings::default());
    bencher.bench_local(|| find_cyclic(black_box(&rows), &settings));
}
