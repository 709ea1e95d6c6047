//! Equal rows give the same bits, however they are portioned and whatever the thread count.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::covariance::jackknife;
use dynid_estimate::folds::FoldSettings;
use dynid_estimate::held_out::compare;
use dynid_estimate::linear::ols;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::{Factor, FactorBuilder};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const COLUMNS: usize = 7;
const ROWS: usize = 640;

/// Column-major regressor and effort.
fn samples() -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut draw = |n: usize| (0..n).map(|_| rng.random::<f64>() - 0.5).collect::<Vec<f64>>();
    (draw(COLUMNS * ROWS), draw(ROWS))
}

fn reduce(portion: usize, regressor: &[f64], effort: &[f64], rows: std::ops::Range<usize>) -> Factor {
    let mut builder = FactorBuilder::with_chunk_rows(COLUMNS, 50);
    let mut start = rows.start;
    while start < rows.end {
        let end = (start + portion).min(rows.end);
        builder.push_block(&regressor[start..], ROWS, &effort[start..end]).unwrap();
        start = end;
    }
    builder.finish()
}

#[test]
fn portions_do_not_matter() {
    let (regressor, effort) = samples();
    let whole = reduce(ROWS, &regressor, &effort, 0..ROWS);
    for portion in [1, 13, 50, 64, 320] {
        assert_eq!(reduce(portion, &regressor, &effort, 0..ROWS), whole, "portions of {portion} rows");
    }
}

#[test]
fn chunk_lengths_agree_to_rounding() {
    let (regressor, effort) = samples();
    let reference = reduce(ROWS, &regressor, &effort, 0..ROWS);
    for chunk in [1, 8, 100, 10_000] {
        let mut builder = FactorBuilder::with_chunk_rows(COLUMNS, chunk);
        builder.push_block(&regressor, ROWS, &effort).unwrap();
        let factor = builder.finish();
        for j in 0..COLUMNS {
            for i in 0..=j {
                let size = reference.column_norms()[j];
                assert!((factor.r(i, j) - reference.r(i, j)).abs() <= 1e-13 * size);
            }
            assert!((factor.z()[j] - reference.z()[j]).abs() <= 1e-13 * reference.effort_norm());
        }
    }
}

#[test]
fn a_reused_builder_forgets() {
    let (regressor, effort) = samples();
    let mut builder = FactorBuilder::with_chunk_rows(COLUMNS, 50);
    builder.push_block(&regressor, ROWS, &effort).unwrap();
    let first = builder.take();
    builder.push_block(&regressor, ROWS, &effort).unwrap();
    assert_eq!(builder.finish(), first);
}

#[test]
fn thread_count_does_not_matter() {
    let (regressor, effort) = samples();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let blocks: Vec<Factor> = (0..ROWS / 32)
                .into_par_iter()
                .map(|b| reduce(32, &regressor, &effort, 32 * b..32 * (b + 1)))
                .collect();
            let merged = Factor::merge(&blocks.iter().collect::<Vec<_>>());
            let x = ols(&merged).x;
            let spread = jackknife(&blocks, &x).unwrap();
            let groups =
                [ReducedGroup { log: 0, output: 0, scale: 0, columns: (0..COLUMNS).collect(), blocks }];
            let settings = FoldSettings::default();
            let folds = compare(&groups, &groups, &[1.0], COLUMNS, &settings, &[&|t| ols(t).x]);
            (merged, x, spread, folds)
        })
    };
    let single = run(1);
    assert_eq!(run(2), single);
    assert_eq!(run(7), single);
}
