//! The reduction in double-double arithmetic: same bits however rows are portioned, identities, what it refuses.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::linear::{ols, ols_extended};
use dynid_factor::factor::{DoubleDouble, ExtendedBuilder, ExtendedFactor};
use dynid_factor::{FactorBuilder, FactorError};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::Range;

const COLUMNS: usize = 5;
const ROWS: usize = 160;

/// Column-major regressor and effort.
fn samples() -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut draw = |n: usize| (0..n).map(|_| rng.random::<f64>() - 0.5).collect::<Vec<f64>>();
    (draw(COLUMNS * ROWS), draw(ROWS))
}

fn reduce(portion: usize, regressor: &[f64], effort: &[f64], rows: Range<usize>) -> ExtendedFactor {
    let mut builder = ExtendedBuilder::new(COLUMNS);
    let mut start = rows.start;
    while start < rows.end {
        let end = (start + portion).min(rows.end);
        builder.push_block(&regressor[start..], ROWS, &effort[start..end]).unwrap();
        start = end;
    }
    builder.finish()
}

fn entries(factor: &ExtendedFactor) -> Vec<DoubleDouble> {
    let p = factor.columns();
    let triangle = (0..p).flat_map(|i| (0..p).map(move |j| (i, j))).map(|(i, j)| factor.r(i, j));
    triangle.chain((0..p).map(|i| factor.z(i))).chain([factor.rho()]).collect()
}

#[test]
fn portions_do_not_matter() {
    let (regressor, effort) = samples();
    let whole = reduce(ROWS, &regressor, &effort, 0..ROWS);
    for portion in [1, 13, 64, 100] {
        assert_eq!(reduce(portion, &regressor, &effort, 0..ROWS), whole, "portions of {portion} rows");
    }
    let mut builder = ExtendedBuilder::new(COLUMNS);
    for i in 0..ROWS {
        let row: Vec<DoubleDouble> = (0..COLUMNS).map(|c| regressor[c * ROWS + i].into()).collect();
        builder.push_extended_row(&row, effort[i].into()).unwrap();
    }
    assert_eq!(builder.rows(), ROWS);
    assert_eq!(builder.take(), whole);
    assert_eq!(builder.take(), ExtendedFactor::empty(COLUMNS));
}

#[test]
fn thread_count_does_not_matter_and_merging_keeps_the_digits() {
    let (regressor, effort) = samples();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let blocks: Vec<ExtendedFactor> = (0..ROWS / 16)
                .into_par_iter()
                .map(|b| reduce(16, &regressor, &effort, 16 * b..16 * (b + 1)))
                .collect();
            ExtendedFactor::merge(&blocks.iter().collect::<Vec<_>>())
        })
    };
    let merged = run(1);
    assert_eq!(run(2), merged);
    assert_eq!(run(5), merged);

    let whole = reduce(ROWS, &regressor, &effort, 0..ROWS);
    assert_eq!(merged.rows(), ROWS);
    for (found, expected) in entries(&merged).into_iter().zip(entries(&whole)) {
        // Entries are of the order of 1; some units of 2⁻¹⁰⁶ per row.
        assert!((found - expected).abs().to_f64() <= 20.0 * ROWS as f64 * 2_f64.powi(-106));
    }
}

#[test]
fn the_rounded_factor_is_the_one_of_double_precision() {
    let (regressor, effort) = samples();
    // Fewer rows than columns, and a column that is never excited, in the middle.
    for (rows, silent) in [(ROWS, None), (3, None), (ROWS, Some(2))] {
        let mut regressor = regressor.clone();
        if let Some(column) = silent {
            regressor[column * ROWS..(column + 1) * ROWS].fill(0.0);
        }
        let mut plain = FactorBuilder::new(COLUMNS);
        plain.push_block(&regressor, ROWS, &effort[..rows]).unwrap();
        let plain = plain.finish();
        let rounded = reduce(rows, &regressor, &effort, 0..rows).rounded();
        assert_eq!(rounded.rows(), plain.rows());
        assert!((rounded.effort_norm() - plain.effort_norm()).abs() <= 1e-14 * plain.effort_norm());
        for x in [[0.0; COLUMNS], [1.0, -2.0, 0.5, 3.0, -1.0]] {
            assert!((rounded.rss(&x) - plain.rss(&x)).abs() <= 1e-13 * plain.rss(&x));
            for (found, expected) in rounded.score(&x).into_iter().zip(plain.score(&x)) {
                assert!((found - expected).abs() <= 1e-12 * plain.rss(&x).sqrt() * 10.0);
            }
        }
    }
}

/// An integer problem whose solution and residual are known: `y = W x + r` with `Wᵀ r = 0` by construction, `r` being
/// 1e12 times the smallest parameter's share.
#[test]
fn small_shares_survive_large_residuals() {
    let x = [1.0, -3.0];
    let mut builder = ExtendedBuilder::new(2);
    let mut plain = FactorBuilder::new(2);
    for (w, sign) in [(1.0, 1.0), (2.0, -1.0), (3.0, -1.0), (4.0, 1.0)] {
        let y = x[0] + x[1] * w + 1e12 * sign;
        builder.push_row(&[1.0, w], y).unwrap();
        plain.push_row(&[1.0, w], y).unwrap();
    }
    let solution = ols_extended(&builder.finish());
    assert_eq!(solution.x, x);
    assert_eq!(solution.rss, 4e24);
    assert!(ols(&plain.finish()).x != x, "double precision loses them, or this test shows nothing");
}

#[test]
fn dependent_columns_are_left_out_as_in_double_precision() {
    let (mut regressor, effort) = samples();
    let (first, rest) = regressor.split_at_mut(ROWS);
    rest[..ROWS].copy_from_slice(first);
    let mut plain = FactorBuilder::new(COLUMNS);
    plain.push_block(&regressor, ROWS, &effort).unwrap();
    let plain = ols(&plain.finish());
    let extended = ols_extended(&reduce(ROWS, &regressor, &effort, 0..ROWS));
    assert_eq!((extended.rank.rank, extended.dropped.len()), (COLUMNS - 1, 1));
    assert!((extended.rss - plain.rss).abs() <= 1e-13 * plain.rss);
    let (found, expected) = (extended.standard_deviations(1.0), plain.standard_deviations(1.0));
    let known = |s: &[Option<f64>]| s.iter().flatten().copied().collect::<Vec<_>>();
    for (a, b) in known(&found).into_iter().zip(known(&expected)) {
        assert!((a / b - 1.0).abs() <= 1e-12);
    }
    assert_eq!(known(&found).len(), COLUMNS - 1);
}

#[test]
fn bad_rows_are_refused() {
    let mut builder = ExtendedBuilder::new(2);
    builder.push_row(&[1.0, 2.0], 3.0).unwrap();
    let refused = builder.push_row(&[1.0, f64::INFINITY], 3.0);
    assert_eq!(refused, Err(FactorError::NotFinite { row: 1, column: Some(1), found: f64::INFINITY }));
    let refused = builder.push_extended_row(&[DoubleDouble::ONE; 2], f64::NAN.into());
    assert!(matches!(refused, Err(FactorError::NotFinite { row: 1, column: None, .. })));
    let refused = builder.push_extended_row(&[DoubleDouble::ONE; 3], DoubleDouble::ONE);
    assert!(matches!(refused, Err(FactorError::BlockShape { expected: 2, found: 3, .. })));
    assert!(matches!(builder.push_row(&[1.0], 2.0), Err(FactorError::BlockShape { .. })));
    assert_eq!(builder.rows(), 1);
}
