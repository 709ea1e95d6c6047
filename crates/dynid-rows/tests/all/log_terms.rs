//! Deviations of single logs, differences of estimates, and load columns, on rows with known parameters.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_estimate::drive_gain::load_column;
use dynid_estimate::linear::{LinearMethod, LinearSettings, estimate, explain_difference, ols};
use dynid_estimate::log_deviations::{OwnColumn, log_deviations};
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use dynid_rows::conditioning::ReducedGroup;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const COLUMNS: usize = 4;
const BLOCKS: usize = 15;
const ROWS: usize = 40;

struct Noise(ChaCha8Rng);

impl Noise {
    fn new(seed: u64) -> Self {
        Noise(ChaCha8Rng::seed_from_u64(seed))
    }
    fn next(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

/// Rows of one log: a constant column and three random ones, parameters `x`, noise `sigma`.
fn group(log: usize, x: &[f64; COLUMNS], sigma: f64) -> ReducedGroup {
    let mut noise = Noise::new(7 + log as u64);
    let blocks = (0..BLOCKS)
        .map(|_| {
            let mut builder = FactorBuilder::new(COLUMNS);
            for _ in 0..ROWS {
                let row = [1.0, noise.next(), noise.next(), noise.next()];
                let clean: f64 = row.iter().zip(x).map(|(w, x)| w * x).sum();
                builder.push_row(&row, clean + sigma * noise.next()).unwrap();
            }
            builder.finish()
        })
        .collect();
    ReducedGroup { log, output: 0, scale: 0, columns: (0..COLUMNS).collect(), blocks }
}

const X: [f64; COLUMNS] = [0.5, 2.0, -1.0, 3.0];

#[test]
fn deviations_are_what_a_log_has_more_than_the_others() {
    let other = [X[0] + 0.4, X[1], X[2] - 0.3, X[3]];
    let groups = [group(0, &X, 0.1), group(1, &other, 0.1)];
    let own = [0, 2, 3].map(|column| OwnColumn { log: 1, output: 0, column });
    let found = log_deviations(&groups, COLUMNS, &own).unwrap();
    let limit = found.limit(own.len());
    for (deviation, truth) in found.deviations.iter().zip([0.4, -0.3, 0.0]) {
        assert!((deviation.value - truth).abs() < 4.0 * deviation.std, "{deviation:?}");
        assert_eq!(deviation.value.abs() > limit * deviation.std, truth != 0.0, "{deviation:?}");
        // 600 rows each, noise 0.1, columns of unit size: the root of 0.01/600 · 2, within what 30 blocks tell.
        assert!((deviation.std / 0.0058 - 1.0).abs() < 0.5, "{deviation:?}");
    }
    assert!((found.effect(1, 0, &[0]) - found.deviations[0].value.abs()).abs() < 1e-12);
    assert_eq!(found.effect(0, 0, &[0]), 0.0);
    assert!((found.residual(1, 0).unwrap() - 0.1).abs() < 0.01);
    let alike = found.separate(1.0).unwrap();
    assert!(alike.f < alike.limit, "{alike:?}");
    let held = log_deviations(&groups, COLUMNS, &own[..1]).unwrap().separate(1.0).unwrap();
    assert!(held.f > 10.0 * held.limit, "{held:?}");
    let (common, alone) = held.rms[1][0].unwrap();
    assert!(alone < 0.11 && common > 0.15, "{common} {alone}");
}

#[test]
fn too_few_blocks_say_nothing() {
    let mut short = [group(0, &X, 0.1), group(1, &X, 0.1)];
    short.iter_mut().for_each(|g| g.blocks.truncate(4));
    assert!(log_deviations(&short, COLUMNS, &[]).is_none());
}

#[test]
fn the_difference_of_two_estimates_is_explained_by_what_was_added() {
    let map = Mat::from_fn(COLUMNS, 2, |i, j| [[0.0, 0.0], [1.0, 0.5], [0.2, -1.0], [0.0, 2.0]][i][j]);
    let added = [0.7, -0.4];
    let more = std::array::from_fn(|i| X[i] + (0..2).map(|j| map[(i, j)] * added[j]).sum::<f64>());
    let fit = |group: ReducedGroup| {
        estimate(&[group], None, COLUMNS, &LinearMethod::Wls, &LinearSettings::default()).unwrap()
    };
    let exact = [fit(group(0, &more, 0.0)), fit(group(1, &X, 0.0))];
    let found = explain_difference([&exact[0], &exact[1]], [1.0, 1.0], &map).unwrap();
    let noisy = [fit(group(0, &more, 0.1)), fit(group(1, &X, 0.1))];
    let estimated = explain_difference([&noisy[0], &noisy[1]], [1.0, 1.0], &map).unwrap();
    for (j, added) in added.into_iter().enumerate() {
        assert!((found.x[j] - added).abs() < 1e-7, "{found:?}");
        let std = estimated.covariance[(j, j)].sqrt();
        assert!(std > 1e-3 && (estimated.x[j] - added).abs() < 4.0 * std, "{estimated:?}");
    }
    // Two unknowns of one column are not told apart.
    let twice = Mat::from_fn(COLUMNS, 2, |i, _| map[(i, 0)]);
    assert!(explain_difference([&noisy[0], &noisy[1]], [1.0, 1.0], &twice).is_none());
}

#[test]
fn effort_and_column_change_places() {
    let mut noise = Noise::new(3);
    let (mut plain, mut exchanged) = (FactorBuilder::new(3), FactorBuilder::new(3));
    for _ in 0..50 {
        let [a, b, c, y] = std::array::from_fn(|_| noise.next());
        plain.push_row(&[a, b, c], y).unwrap();
        exchanged.push_row(&[a, y, c], b).unwrap();
    }
    let (found, expected) = (plain.finish().with_effort_exchanged(1), exchanged.finish());
    assert_eq!(found.rows(), expected.rows());
    let (found, expected) = (ols(&found), ols(&expected));
    for (f, e) in found.x.iter().zip(&expected.x) {
        assert!((f - e).abs() < 1e-13, "{f} {e}");
    }
    assert!((found.rss - expected.rss).abs() < 1e-12);
}

/// Currents `i = (W x + w_L)/g` with noise: what the least singular value is about.
fn currents(sigma: f64, overlap: f64) -> Factor {
    let mut noise = Noise::new(11);
    let mut builder = FactorBuilder::new(3);
    for k in 0..4000 {
        let loaded = if k % 2 == 1 { 1.0 } else { 0.0 };
        let (a, b) = (noise.next(), noise.next());
        let load = loaded * (0.8 * noise.next() + overlap * a);
        let current = (2.0 * a - 3.0 * b + load) / 8.0 + sigma * noise.next();
        builder.push_row(&[a, b, load], current).unwrap();
    }
    builder.finish()
}

#[test]
fn a_gain_by_plain_least_squares_is_pulled_towards_zero() {
    let clean = load_column(&currents(0.0, 0.0), 2);
    assert!(
        (clean.plain.unwrap() - 8.0).abs() < 1e-9 && (clean.total.unwrap() - 8.0).abs() < 1e-9,
        "{clean:?}"
    );
    assert!((clean.share - 1.0).abs() < 0.01, "{clean:?}");
    let factor = currents(0.05, 0.0);
    let inverse = 1.0 / ols(&factor).x[2];
    let beside = load_column(&factor, 2);
    assert!((inverse / 8.0 - 1.0).abs() < 0.03, "{inverse}");
    assert!(beside.plain.unwrap() < 0.85 * 8.0, "{beside:?}");
    // Of `loaded (0.8 n + 5 a)` half is there, and the projection on `a` over all rows takes `2.5 a` off.
    let left = load_column(&currents(0.05, 5.0), 2);
    let expected = (1.0 - 2.5_f64.powi(2) / (0.5 * (0.64 + 25.0))).sqrt();
    // Moments of 4000 random rows are known to a few per cent.
    assert!((left.share - expected).abs() < 0.04, "{left:?} {expected}");
}

#[test]
fn a_load_that_does_not_act_has_no_share() {
    let mut builder = FactorBuilder::new(2);
    let mut noise = Noise::new(5);
    for _ in 0..30 {
        let a = noise.next();
        builder.push_row(&[a, 0.0], a + 0.1 * noise.next()).unwrap();
    }
    let found = load_column(&builder.finish(), 1);
    assert_eq!((found.share, found.plain, found.total), (0.0, None, None));
}
