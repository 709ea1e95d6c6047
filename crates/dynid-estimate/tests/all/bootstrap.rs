//! Block bootstrap: its definition on one replicate, its spread against the jackknife, its coverage, its determinism.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::simulated::{COLUMNS, NOISE, Normal, TRUTH, rows};
use dynid_estimate::covariance::{Bootstrap, BootstrapSettings, bootstrap};
use dynid_estimate::linear::{LinearMethod, LinearSettings, estimate, ols};
use dynid_factor::rows::reduce_rows;
use dynid_factor::{Factor, FactorBuilder};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Noise whose correlation falls below a tenth within five samples, an eighth of a block.
fn blocks(seed: u64) -> (Vec<Factor>, Vec<f64>, dynid_linalg::Mat) {
    let mut normal = Normal::new(seed, 0);
    let mut state = 0.0;
    let source = rows(1, 24, 40, |joint, _| {
        state = 0.6 * state + 0.8 * normal.draw();
        NOISE[joint] * state
    });
    let groups = reduce_rows(&source).unwrap();
    let found = estimate(&groups, None, COLUMNS, &LinearMethod::Wls, &LinearSettings::default()).unwrap();
    (found.kept_blocks(), found.x.clone(), found.jackknife().unwrap().covariance)
}

fn run(blocks: &[Factor], replicates: usize) -> Bootstrap {
    bootstrap(blocks, None, &BootstrapSettings { replicates, seed: 3 }).unwrap()
}

#[test]
fn a_replicate_is_least_squares_on_the_blocks_drawn() {
    let (blocks, x, _) = blocks(1);
    let found = run(&blocks, 8);
    for (k, replicate) in found.replicates.iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        rng.set_stream(k as u64);
        let drawn: Vec<&Factor> =
            (0..blocks.len()).map(|_| &blocks[rng.random_range(0..blocks.len())]).collect();
        for (a, b) in replicate.iter().zip(ols(&Factor::merge(&drawn)).x) {
            assert!((a - b).abs() < 1e-10, "{a} against {b}");
        }
    }
    assert!(found.x.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10));
}

#[test]
fn its_spread_is_that_of_the_jackknife() {
    let (blocks, _, jackknife) = blocks(2);
    let covariance = run(&blocks, 2000).covariance().unwrap();
    for i in 0..COLUMNS {
        let ratio = covariance[(i, i)] / jackknife[(i, i)];
        assert!((0.6..1.4).contains(&ratio), "{ratio}");
    }
}

#[test]
fn intervals_hold_the_truth() {
    const LOGS: u64 = 150;
    let hits: Vec<(usize, usize)> = (0..LOGS)
        .into_par_iter()
        .map(|log| {
            let found = run(&blocks(100 + log).0, 300);
            let count = |intervals: Vec<(f64, f64)>| {
                intervals.iter().zip(TRUTH).filter(|((a, b), t)| (a..=b).contains(&t)).count()
            };
            (
                count(found.percentile_intervals(0.95).unwrap()),
                count(found.studentised_intervals(0.95).unwrap()),
            )
        })
        .collect();
    let share = |sum: usize| sum as f64 / (LOGS * COLUMNS as u64) as f64;
    let percentile = share(hits.iter().map(|h| h.0).sum());
    let studentised = share(hits.iter().map(|h| h.1).sum());
    println!("bootstrap coverage: percentile {percentile:.3}, studentised {studentised:.3}");
    // 900 intervals: standard error 0.8 %. Percentile intervals of 24 blocks are known to be short.
    assert!((0.88..=0.97).contains(&percentile) && (0.93..=0.985).contains(&studentised));
}

#[test]
fn threads_do_not_change_a_bit() {
    let (blocks, ..) = blocks(4);
    let reference = run(&blocks, 60);
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| run(&blocks, 60)), reference);
    }
    let other = bootstrap(&blocks, None, &BootstrapSettings { replicates: 60, seed: 4 }).unwrap();
    assert_ne!(other.replicates, reference.replicates);
}

#[test]
fn draws_without_the_only_block_that_sees_a_column_are_counted() {
    let mut builder = FactorBuilder::new(2);
    let blocks: Vec<Factor> = (0..12)
        .map(|b| {
            for k in 0..10 {
                let t = f64::from(10 * b + k);
                let once = if b == 4 { (2.1 * t).cos() } else { 0.0 };
                builder.push_row(&[t.sin(), once], 2.0 * t.sin() - once + 0.1 * (7.7 * t).sin()).unwrap();
            }
            builder.take()
        })
        .collect();
    let found = run(&blocks, 400);
    // (11/12)¹² = 35 % of the draws miss the block.
    assert!((100..180).contains(&found.deficient), "{}", found.deficient);
    assert!(found.replicates.iter().flatten().all(|x| x.is_finite() && x.abs() < 10.0));
    assert!(bootstrap(&blocks[..1], None, &BootstrapSettings::default()).is_none());
    assert!(bootstrap(&blocks[5..], None, &BootstrapSettings::default()).is_none(), "a column nobody sees");
}
