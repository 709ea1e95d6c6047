//! Instrumental variables: what must hold whatever the numbers.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::instruments::{
    ExogeneitySettings, ExogeneityVerdict, InstrumentSettings, IterationEnd, Simulated, Strength, crossed,
    exogeneity, half, instrumental, iterate, measured, paired_columns,
};
use dynid_estimate::linear::{LinearError, LinearMethod, LinearSettings, estimate};
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOTAL: usize = 4;
const BLOCKS: usize = 12;
const BLOCK_ROWS: usize = 15;
/// Base columns of the two groups: neither sees all.
const COLUMNS: [&[usize]; 2] = [&[0, 1, 2], &[1, 2, 3]];

struct Row {
    block: usize,
    z: Vec<f64>,
    w: Vec<f64>,
    y: f64,
}

/// Rows of two groups with errors in `W` of a size that enter `y` as well.
fn rows(seed: u64, error: f64) -> Vec<Vec<Row>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let truth = [2.0, -1.0, 0.5, 3.0];
    let mut draw = move || rng.random_range(-1.0..1.0);
    COLUMNS
        .iter()
        .enumerate()
        .map(|(g, columns)| {
            (0..BLOCKS * BLOCK_ROWS)
                .map(|k| {
                    let z: Vec<f64> = columns.iter().map(|_| draw()).collect();
                    let shared = error * draw();
                    let w: Vec<f64> = z.iter().map(|z| z + shared + error * draw()).collect();
                    let clean: f64 = columns.iter().zip(&z).map(|(c, z)| truth[*c] * z).sum();
                    let y = clean + 3.0 * shared + 0.1 * (1.0 + g as f64) * draw();
                    Row { block: k / BLOCK_ROWS, z, w, y }
                })
                .collect()
        })
        .collect()
}

fn reduced(rows: &[Vec<Row>]) -> Vec<ReducedGroup> {
    rows.iter()
        .zip(COLUMNS)
        .enumerate()
        .map(|(output, (rows, columns))| {
            let blocks = (0..BLOCKS).map(|b| {
                let mut builder = FactorBuilder::new(2 * columns.len());
                for row in rows.iter().filter(|r| r.block == b) {
                    builder.push_row(&[&row.z[..], &row.w].concat(), row.y).unwrap();
                }
                builder.finish()
            });
            let columns = paired_columns(columns, TOTAL);
            ReducedGroup { log: 0, output, scale: 0, columns, blocks: blocks.collect() }
        })
        .collect()
}

#[track_caller]
fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    let size = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance * size, "{found:?} against {expected:?}");
    }
}

fn entries(matrix: &Mat) -> Vec<f64> {
    (0..matrix.ncols()).flat_map(|j| (0..matrix.nrows()).map(move |i| matrix[(i, j)])).collect()
}

#[test]
fn with_the_regressor_as_its_own_instrument_least_squares_comes_back() {
    let mut rows = rows(1, 0.3);
    rows.iter_mut().flatten().for_each(|r| r.z.clone_from(&r.w));
    let paired = reduced(&rows);
    let iv = instrumental(&paired, TOTAL, &InstrumentSettings::default()).unwrap();
    let plain = measured(&paired);
    let wls = estimate(&plain, None, TOTAL, &LinearMethod::Wls, &LinearSettings::default()).unwrap();
    close(&iv.linear.x, &wls.x, 1e-12);
    assert_eq!(iv.linear.passes, wls.passes);
    for (a, b) in iv.linear.groups.iter().zip(&wls.groups) {
        close(&[a.variance, a.leverage, a.rss], &[b.variance, b.leverage, b.rss], 1e-11);
    }
    close(&entries(&iv.linear.model_covariance()), &entries(&wls.model_covariance()), 1e-11);
    let (a, b) = (iv.linear.jackknife().unwrap(), wls.jackknife().unwrap());
    close(&entries(&a.covariance), &entries(&b.covariance), 1e-10);
    assert!((iv.least_cosine - 1.0).abs() < 1e-12);
    let test = exogeneity(&paired, &wls.weights(), TOTAL, &[1.0; TOTAL], &ExogeneitySettings::default());
    let test = test.unwrap();
    assert_eq!(test.verdict, ExogeneityVerdict::Exogenous);
    assert!(test.tested.is_empty() && test.robust.is_none() && test.naive.is_none());
}

/// Solves `Zᵀ(W x - y) = 0` over rows that `keep` admits, rows of a group weighted, by the normal form.
fn direct(rows: &[Vec<Row>], weights: &[f64], keep: impl Fn(&Row) -> bool) -> Vec<f64> {
    let mut left = Mat::zeros(TOTAL, TOTAL);
    let mut right = Mat::zeros(TOTAL, 1);
    for ((rows, columns), weight) in rows.iter().zip(COLUMNS).zip(weights) {
        for row in rows.iter().filter(|r| keep(r)) {
            for (i, a) in columns.iter().enumerate() {
                right[(*a, 0)] += weight * weight * row.z[i] * row.y;
                for (j, b) in columns.iter().enumerate() {
                    left[(*a, *b)] += weight * weight * row.z[i] * row.w[j];
                }
            }
        }
    }
    let x = left.lu().solve(&right);
    (0..TOTAL).map(|i| x[(i, 0)]).collect()
}

#[test]
fn estimate_and_jackknife_equal_those_of_the_rows_solved_directly() {
    let rows = rows(2, 0.4);
    let iv = instrumental(&reduced(&rows), TOTAL, &InstrumentSettings::default()).unwrap().linear;
    let weights = iv.weights();
    close(&iv.x, &direct(&rows, &weights, |_| true), 1e-12);
    let found = iv.jackknife().unwrap();
    for (b, change) in found.changes.iter().enumerate() {
        let without = direct(&rows, &weights, |r| r.block != b);
        let expected: Vec<f64> = without.iter().zip(&iv.x).map(|(w, x)| w - x).collect();
        close(change, &expected, 1e-10);
    }
    // As every linear estimate: least squares on its factor, with the residuals of the measured rows.
    let again = dynid_estimate::linear::ols(&iv.factor);
    close(&again.x, &iv.x, 1e-12);
    let score: Vec<f64> = iv.factor.score(&iv.x);
    assert!(score.iter().all(|s| s.abs() < 1e-8), "{score:?}");
    let rss: f64 = measured(&reduced(&rows))
        .iter()
        .zip(&weights)
        .map(|(g, w)| g.merged(TOTAL).scaled(*w).rss(&iv.x))
        .sum();
    close(&[iv.solution.rss], &[rss], 1e-12);
    let leverage: f64 = iv.groups.iter().map(|g| g.leverage).sum();
    close(&[leverage], &[TOTAL as f64], 1e-9);
}

#[test]
fn an_exactly_determined_system_is_solved_exactly() {
    let (z, w) = ([[1.0, 0.2], [-0.3, 1.0]], [[2.0, 1.0], [1.0, 3.0]]);
    let x = [0.7, -1.9];
    let mut builder = FactorBuilder::new(4);
    for k in 0..2 {
        let y = w[k][0] * x[0] + w[k][1] * x[1];
        builder.push_row(&[z[k][0], z[k][1], w[k][0], w[k][1]], y).unwrap();
    }
    let blocks = vec![builder.finish()];
    let group = ReducedGroup { log: 0, output: 0, scale: 0, columns: vec![0, 1, 2, 3], blocks };
    let iv = instrumental(&[group], 2, &InstrumentSettings::default()).unwrap().linear;
    close(&iv.x, &x, 1e-13);
    assert!(iv.jackknife().is_none());
}

#[test]
fn longer_blocks_change_the_jackknife_alone() {
    let rows = rows(3, 0.4);
    let iv = instrumental(&reduced(&rows), TOTAL, &InstrumentSettings::default()).unwrap().linear;
    let weights = iv.weights();
    let x = iv.x.clone();
    let longer = iv.with_longer_blocks(3);
    close(&longer.x, &x, 0.0);
    let found = longer.jackknife().unwrap();
    assert_eq!((found.blocks(), longer.blocks.len()), (BLOCKS / 3, BLOCKS / 3));
    let without = direct(&rows, &weights, |r| r.block / 3 != 1);
    let expected: Vec<f64> = without.iter().zip(&x).map(|(w, x)| w - x).collect();
    close(&found.changes[1], &expected, 1e-10);
}

/// Sets the instruments of base column 1 in both groups.
fn set_instrument(rows: &mut [Vec<Row>], mut value: impl FnMut() -> f64) {
    for (rows, local) in rows.iter_mut().zip([1, 0]) {
        rows.iter_mut().for_each(|r| r.z[local] = value());
    }
}

#[test]
fn instruments_that_see_nothing_of_a_column_are_told() {
    let mut rows = rows(4, 0.05);
    set_instrument(&mut rows, || 0.0);
    let found = instrumental(&reduced(&rows), TOTAL, &InstrumentSettings::default()).unwrap();
    assert_eq!(found.strength, Strength::Blind);
    assert_eq!(found.linear.solution.dropped, [1]);
    assert!(found.linear.x.iter().all(|x| x.is_finite()));
    assert!(found.linear.jackknife().is_some());
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    set_instrument(&mut rows, || rng.random_range(-1.0..1.0));
    let found = instrumental(&reduced(&rows), TOTAL, &InstrumentSettings::default()).unwrap();
    assert_eq!(found.strength, Strength::Weak);
    assert!(found.least_cosine < 0.1, "{}", found.least_cosine);
    let weights = found.linear.weights();
    let test = exogeneity(&reduced(&rows), &weights, TOTAL, &[1.0; TOTAL], &ExogeneitySettings::default());
    assert_eq!(test.unwrap().verdict, ExogeneityVerdict::Weak);
    assert_eq!(instrumental(&[], TOTAL, &InstrumentSettings::default()).unwrap_err(), LinearError::NoGroups);
    let plain = estimate(&reduced(&rows), None, 2 * TOTAL, &LinearMethod::Instrumental, &Default::default());
    assert_eq!(plain.unwrap_err(), LinearError::NeedsSimulation);
}

#[test]
fn bias_that_noise_puts_in_columns_and_effort_is_found_and_removed() {
    let paired = reduced(&rows(6, 0.4));
    let plain = measured(&paired);
    let wls = estimate(&plain, None, TOTAL, &LinearMethod::Wls, &LinearSettings::default()).unwrap();
    let iv = instrumental(&paired, TOTAL, &InstrumentSettings::default()).unwrap().linear;
    let off = |x: &[f64]| x.iter().zip([2.0, -1.0, 0.5, 3.0]).map(|(x, t)| (x - t).abs()).fold(0.0, f64::max);
    assert!(off(&wls.x) > 0.3 && off(&iv.x) < 0.15, "{} {}", off(&wls.x), off(&iv.x));
    let test =
        exogeneity(&paired, &wls.weights(), TOTAL, &[1.0; TOTAL], &ExogeneitySettings::default()).unwrap();
    assert_eq!(test.verdict, ExogeneityVerdict::Material);
    assert!(test.robust.unwrap().p_value < 0.01);
    assert!(test.worst().unwrap().ratio() > 1.0);
}

#[test]
fn halves_and_crossed_groups_hold_every_block_once() {
    let (a, b) = (reduced(&rows(7, 0.1)), reduced(&rows(8, 0.1)));
    let mixed = crossed(&a, &b);
    let (front, back) = (half(&a, false), half(&b, true));
    let count = |groups: &[ReducedGroup]| time_blocks(groups, &[1.0, 1.0], 2 * TOTAL).len();
    assert_eq!((count(&front), count(&back), count(&mixed)), (BLOCKS / 2, BLOCKS / 2, BLOCKS));
    for (g, group) in mixed.iter().enumerate() {
        let halves = [front[g].merged(2 * TOTAL), back[g].merged(2 * TOTAL)];
        let merged = Factor::merge(&halves.iter().collect::<Vec<_>>());
        close(&group.merged(2 * TOTAL).z(), &merged.z(), 1e-12);
    }
}

#[test]
fn rounds_end_when_estimates_settle_and_tell_a_diverged_simulation() {
    let paired = reduced(&rows(9, 0.2));
    let settings = InstrumentSettings::default();
    let outcome = iterate(
        &[0.0; TOTAL],
        &[1e-3; TOTAL],
        (1e-4, 10),
        |_| Ok::<_, LinearError>(Simulated::Rows(paired.clone())),
        |rows| instrumental(rows, TOTAL, &settings),
    );
    let found = outcome.unwrap();
    assert_eq!((found.rounds, &found.end), (2, &IterationEnd::Settled));
    assert!(found.changes[0] > 0.5 && found.changes[1] == 0.0, "{:?}", found.changes);
    let mut calls = 0;
    let found = iterate(
        &[0.0; TOTAL],
        &[1e-3; TOTAL],
        (1e-4, 10),
        |before| {
            calls += 1;
            assert_eq!(before.is_some(), calls > 1);
            Ok::<_, LinearError>(match calls {
                1 => Simulated::Rows(paired.clone()),
                _ => Simulated::Diverged { distance: 0.7, log: 0, output: 1 },
            })
        },
        |rows| instrumental(rows, TOTAL, &settings),
    );
    let found = found.unwrap();
    assert!(found.estimate.is_some());
    assert_eq!(found.end, IterationEnd::Diverged { distance: 0.7, log: 0, output: 1 });
}

#[test]
fn without_rows_nothing_is_estimated_and_nothing_breaks() {
    let paired = reduced(&rows(10, 0.2));
    let second: Vec<ReducedGroup> = half(&half(&paired, true), false);
    assert_eq!(second.iter().map(ReducedGroup::rows).sum::<usize>(), 0);
    let found = instrumental(&second, TOTAL, &InstrumentSettings::default()).unwrap();
    assert_eq!((found.linear.x, found.linear.solution.kept), (vec![0.0; TOTAL], vec![]));
    let none: Option<_> =
        exogeneity(&second, &[1.0, 1.0], TOTAL, &[1.0; TOTAL], &ExogeneitySettings::default());
    assert!(none.is_none());
}
