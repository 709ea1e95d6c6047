//! Streaming QR of `[W y]` against one dense QR of the same matrix, and work on the small factors.
//!
//! Prints the ratio of best times first; shapes are rows × columns of `[W y]`.
#![expect(clippy::print_stdout, reason = "a benchmark reports to the terminal")]

use divan::{Bencher, black_box};
use dynid_estimate::covariance::jackknife;
use dynid_estimate::linear::ols;
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use std::time::{Duration, Instant};

const SHAPES: [(usize, usize); 2] = [(100_000, 64), (200_000, 80)];
const SMALL_SHAPES: [(usize, usize); 3] = [(2_000, 8), (2_000, 16), (2_000, 64)];

fn main() {
    for (rows, width) in SHAPES {
        let samples = samples(rows, width);
        let streamed = best_of(5, || {
            black_box(stream(&samples, width));
        });
        let whole = (0..5).map(|_| dense(&samples, width)).min().unwrap_or_default();
        println!(
            "{rows} x {width}: streamed {streamed:.1?}, dense {whole:.1?}, streamed/dense {:.2}",
            streamed.as_secs_f64() / whole.as_secs_f64()
        );
    }
    divan::main();
}

#[divan::bench(args = SHAPES, sample_count = 5)]
fn streamed(bencher: Bencher<'_, '_>, (rows, width): (usize, usize)) {
    let samples = samples(rows, width);
    bencher.bench_local(|| stream(&samples, width));
}

#[divan::bench(args = [512, 1024, 2048, 4096], sample_count = 5)]
fn streamed_by_chunk_rows(bencher: Bencher<'_, '_>, chunk_rows: usize) {
    let (rows, width) = SHAPES[0];
    let samples = samples(rows, width);
    let mut builder = FactorBuilder::with_chunk_rows(width - 1, chunk_rows);
    bencher.bench_local(|| stream_with(&mut builder, &samples));
}

#[divan::bench(args = SMALL_SHAPES, sample_count = 5)]
fn small_streamed(bencher: Bencher<'_, '_>, (rows, width): (usize, usize)) {
    let samples = samples(rows, width);
    let mut builder = FactorBuilder::new(width - 1);
    bencher.bench_local(|| stream_with(&mut builder, &samples));
}

#[divan::bench(sample_count = 5)]
fn least_squares_with_rank(bencher: Bencher<'_, '_>) {
    let factor = stream(&samples(2_000, 80), 80);
    bencher.bench_local(|| ols(&factor));
}

#[divan::bench(sample_count = 5)]
fn jackknife_of_60_blocks(bencher: Bencher<'_, '_>) {
    let samples = samples(6_000, 80);
    let (regressor, effort) = samples.split_at(79 * 6_000);
    let mut builder = FactorBuilder::new(79);
    let blocks: Vec<Factor> = (0..60)
        .map(|b| {
            let rows = 100 * b..100 * (b + 1);
            builder.push_block(&regressor[rows.start..], 6_000, &effort[rows]).expect("finite samples");
            builder.take()
        })
        .collect();
    let x = ols(&Factor::merge(&blocks.iter().collect::<Vec<_>>())).x;
    bencher.bench_local(|| jackknife(&blocks, &x));
}

/// `[W y]`, column-major, from a multiplicative congruential generator.
fn samples(rows: usize, width: usize) -> Vec<f64> {
    let mut state = 1_u64;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..rows * width).map(|_| draw()).collect()
}

fn stream(samples: &[f64], width: usize) -> Factor {
    stream_with(&mut FactorBuilder::new(width - 1), samples)
}

fn stream_with(builder: &mut FactorBuilder, samples: &[f64]) -> Factor {
    let rows = samples.len() / (builder.columns() + 1);
    let (regressor, effort) = samples.split_at(builder.columns() * rows);
    builder.push_block(regressor, rows, effort).expect("finite samples");
    builder.take()
}

/// Time of one QR of the whole matrix, its copy included.
fn dense(samples: &[f64], width: usize) -> Duration {
    let rows = samples.len() / width;
    let matrix = Mat::from_fn(rows, width, |i, j| samples[j * rows + i]);
    let start = Instant::now();
    black_box(matrix.qr());
    start.elapsed()
}

fn best_of(times: usize, mut work: impl FnMut()) -> Duration {
    let timed = |_| {
        let start = Instant::now();
        work();
        start.elapsed()
    };
    (0..times).map(timed).min().unwrap_or_default()
}
