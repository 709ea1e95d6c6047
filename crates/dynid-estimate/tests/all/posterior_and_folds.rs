//! Posterior of single parameters, variance inflation per output, and estimators compared on held-out folds.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::covariance::{block_inflation, output_inflation};
use dynid_estimate::folds::{FoldSettings, contiguous_folds};
use dynid_estimate::held_out::compare;
use dynid_estimate::identifiability::{excited_regrouping, posterior};
use dynid_estimate::linear::ols;
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::rows::{GroupShape, MemoryRows, Rows, row_residuals};
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn normals(seed: u64, count: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| StandardNormal.sample(&mut rng)).collect()
}

/// `(Kᵀ Σ⁻¹ K + C0⁻¹)⁻¹` by plain inverses, the textbook's form.
#[test]
fn posterior_is_that_of_bayes() {
    let k = Mat::from_fn(2, 4, |i, j| [[1.0, 0.5, 0.0, 2.0], [0.0, -1.0, 3.0, 0.25]][i][j]);
    let sigma = Mat::from_fn(2, 2, |i, j| [[0.3, 0.1], [0.1, 0.2]][i][j]);
    let (prior, std) = ([1.0, -2.0, 0.5, 3.0], [0.7, 1.3, 0.4, 2.0]);
    let beta = [5.0, 1.0];
    let found = posterior(&k, &beta, &sigma, 2.0, &(&sigma * 2.0), &prior, &std).unwrap();
    let sigma_inverse = (&sigma * 2.0).lu().inverse();
    let c0_inverse = Mat::from_fn(4, 4, |i, j| if i == j { std[i].powi(-2) } else { 0.0 });
    let covariance = (k.transpose() * &sigma_inverse * &k + &c0_inverse).lu().inverse();
    let right = k.transpose() * &sigma_inverse * Mat::from_fn(2, 1, |i, _| beta[i])
        + &c0_inverse * Mat::from_fn(4, 1, |i, _| prior[i]);
    let mean = &covariance * right;
    for j in 0..4 {
        assert!((found.mean[j] - mean[(j, 0)]).abs() < 1e-12, "{j}");
        assert!((found.std[j] - covariance[(j, j)].sqrt()).abs() < 1e-12, "{j}");
    }
    // Without inflation the data are met exactly.
    let exact = posterior(&k, &beta, &sigma, 0.0, &sigma, &prior, &std).unwrap();
    for i in 0..2 {
        let value: f64 = (0..4).map(|j| k[(i, j)] * exact.mean[j]).sum();
        assert!((value - beta[i]).abs() < 1e-12);
    }
}

#[test]
fn dropped_columns_are_folded_into_the_kept_ones() {
    // The third column is the sum of the first two.
    let mut builder = FactorBuilder::new(3);
    for pair in normals(1, 40).chunks(2) {
        builder.push_row(&[pair[0], pair[1], pair[0] + pair[1]], 0.0).unwrap();
    }
    let found = excited_regrouping(&builder.finish(), &[0, 1], &Mat::identity(3, 3));
    for (i, row) in [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]].iter().enumerate() {
        (0..3).for_each(|j| assert!((found[(i, j)] - row[j]).abs() < 1e-12, "{found:?}"));
    }
}

const BLOCKS: usize = 40;

/// One log of two outputs with two own columns each; effort noise of output 0 is white, of output 1 as given.
fn groups(seed: u64, pole: f64) -> Vec<ReducedGroup> {
    (0..2)
        .map(|output| {
            let noise = normals(seed + output as u64, BLOCKS * 25);
            let mut state = 0.0;
            let blocks = noise
                .chunks(25)
                .enumerate()
                .map(|(b, chunk)| {
                    let mut builder = FactorBuilder::new(2);
                    for (i, e) in chunk.iter().enumerate() {
                        let pole = if output == 1 { pole } else { 0.0 };
                        state = pole * state + (1.0 - pole * pole).sqrt() * e;
                        let t = (25 * b + i) as f64 * 0.04;
                        builder
                            .push_row(&[(0.7 * t).sin(), 1.0], 3.0 * (0.7 * t).sin() - 1.0 + state)
                            .unwrap();
                    }
                    builder.finish()
                })
                .collect();
            ReducedGroup { log: 0, output, scale: 0, columns: vec![2 * output, 2 * output + 1], blocks }
        })
        .collect()
}

fn fit(groups: &[ReducedGroup]) -> Vec<f64> {
    let blocks = time_blocks(groups, &[1.0, 1.0], 4);
    ols(&Factor::merge(&blocks.iter().collect::<Vec<_>>())).x
}

#[test]
fn inflation_tells_the_coloured_output_from_the_white_one() {
    let (mut white, mut coloured) = (0.0, 0.0);
    for seed in 0..40 {
        let groups = groups(100 * seed, 0.9);
        let found = output_inflation(&groups, &[1.0, 1.0], &fit(&groups));
        white += found[0].unwrap() / 40.0;
        coloured += found[1].unwrap() / 40.0;
    }
    // An autoregression with pole 0.9 has (1 + 0.9)/(1 - 0.9) = 19 times the variance at frequency zero; blocks of 25
    // samples see most of it.
    assert!((1.0..1.4).contains(&white), "{white}");
    assert!((8.0..19.0).contains(&coloured), "{coloured}");
    let few = groups(1, 0.0).iter().map(|g| g.coarsened(20)).collect::<Vec<_>>();
    assert_eq!(output_inflation(&few, &[1.0, 1.0], &fit(&few)), [None, None]);
}

#[test]
fn folds_are_predicted_from_the_others() {
    let groups = groups(7, 0.5);
    let weights = [2.0, 0.5];
    let settings = FoldSettings::default();
    let plain = |factor: &Factor| ols(factor).x;
    let nothing = |_: &Factor| vec![0.0; 4];
    let found = compare(&groups, &groups, &weights, 4, &settings, &[&plain, &nothing]);
    assert_eq!(found.folds.len(), 5);
    let blocks = time_blocks(&groups, &weights, 4);
    for (fold, range) in found.folds.iter().zip(contiguous_folds(BLOCKS, 5)) {
        assert_eq!(fold.held_out, range);
        let kept = (0..BLOCKS).filter(|b| b + 1 < range.start || *b > range.end);
        let x = ols(&Factor::merge(&kept.map(|b| &blocks[b]).collect::<Vec<_>>())).x;
        for (j, group) in groups.iter().enumerate() {
            let own: Vec<f64> = group.columns.iter().map(|c| x[*c]).collect();
            let squares: f64 = group.blocks[range.clone()].iter().map(|f| f.rss(&own)).sum();
            assert!((fold.squares[0][j] / squares - 1.0).abs() < 1e-9, "{j}");
            assert!((fold.squares[1][j] / fold.effort[j] - 1.0).abs() < 1e-12);
            assert_eq!(fold.rows[j], 25 * range.len());
        }
    }
    assert!((found.relative(1).unwrap() - 1.0).abs() < 1e-12 && found.explained(1, 0).unwrap().abs() < 1e-12);
    assert!(found.explained(0, 0).unwrap() > 0.7 && found.loss(0, 0).unwrap() == 1.0);
    assert!(found.rms(0, 0).unwrap() < 1.2 && found.rms_standard_error(0, 0).unwrap() < 0.2);
    // With a single block there is nothing to learn from.
    let one: Vec<ReducedGroup> = groups.iter().map(|g| g.coarsened(BLOCKS)).collect();
    assert_eq!(compare(&one, &one, &weights, 4, &settings, &[&plain]).folds, []);
}

#[test]
fn residuals_of_rows_know_where_they_are() {
    let mut memory = MemoryRows::new();
    let group = memory.add_group(GroupShape { log: 0, output: 0, scale: 0, columns: vec![1], blocks: 1 });
    let samples = [10, 14, 18, 30, 34];
    let (regressor, effort) = ([1.0, 2.0, 3.0, 4.0, 5.0], [1.5, 4.0, 6.0, 8.25, 10.0]);
    memory.push(
        group,
        &Rows { block: 0, samples: &samples, regressor: &regressor, stride: 5, effort: &effort },
    );
    let found = row_residuals(&memory, &[99.0, 2.0]).unwrap();
    assert_eq!(found[0].residuals, [-0.5, 0.0, 0.0, 0.25, 0.0]);
    assert_eq!(found[0].on_grid(), Some((4, vec![-0.5, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0])));
    let covered = found[0].coverage(40);
    let expected: Vec<usize> = (8..=20).chain(28..=36).collect();
    assert_eq!((0..40).filter(|s| covered[*s]).collect::<Vec<_>>(), expected);
}

/// One inflation from few blocks: 1 for white residuals, the size of the colour for residuals that a block shares, whatever the number of
/// parameters beside that of blocks.
#[test]
fn few_blocks_tell_one_inflation() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (columns, rows) = (30, 240);
    for (blocks, shared) in [(2, 0.0), (5, 0.0), (9, 0.0), (5, 0.3), (9, 0.3)] {
        let mut sum = 0.0;
        const RUNS: usize = 60;
        for _ in 0..RUNS {
            let factors: Vec<Factor> = (0..blocks)
                .map(|_| {
                    // What a block's residuals have in common follows its rows by way of the columns.
                    let common: Vec<f64> = (0..columns).map(|_| shared * normal()).collect();
                    let mut builder = FactorBuilder::new(columns);
                    for _ in 0..rows {
                        let row: Vec<f64> = (0..columns).map(|_| normal()).collect();
                        let model: f64 = row.iter().zip(&common).map(|(w, c)| w * c).sum();
                        builder.push_row(&row, model + normal()).unwrap();
                    }
                    builder.finish()
                })
                .collect();
            let merged = Factor::merge(&factors.iter().collect::<Vec<_>>());
            sum += block_inflation(&factors, &merged.solve()).unwrap();
        }
        // Scores of variance J_b + s² J_b² with J_b = rows: inflation 1 + rows s².
        let expected = 1.0 + rows as f64 * shared * shared;
        let mean = sum / RUNS as f64;
        // Rows are few beside columns, so that the largest of 1 and a scatter of some per cent counts.
        assert!((mean / expected - 1.0).abs() < 0.15, "{blocks} {shared}: {mean} against {expected}");
    }
    let one = [FactorBuilder::new(2).finish()];
    assert_eq!(block_inflation(&one, &[0.0; 2]), None);
}
