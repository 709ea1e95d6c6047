//! Every linear method through `estimate`: what it shares with the textbook form, and that factors carry it whole.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::simulated::{COLUMNS, NOISE, Normal, TRUTH, rows};
use dynid_estimate::covariance::{jackknife, jackknife_with};
use dynid_estimate::linear::{
    LinearError, LinearEstimate, LinearMethod, LinearSettings, TlsNoise, VarianceSharing, WlsSettings,
    estimate, ols, ridge, tls, wls,
};
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::rows::{MemoryRows, RowSource, reduce_rows};
use dynid_factor::{Factor, FactorBuilder};

fn noisy(seed: u64) -> MemoryRows {
    let mut normal = Normal::new(seed, 0);
    rows(2, 15, 40, |joint, _| NOISE[joint] * normal.draw())
}

fn run(source: &MemoryRows, method: &LinearMethod, settings: &LinearSettings) -> LinearEstimate {
    estimate(&reduce_rows(source).unwrap(), Some(source), COLUMNS, method, settings).unwrap()
}

fn merged(groups: &[ReducedGroup]) -> Vec<Factor> {
    groups.iter().map(|g| g.merged(COLUMNS)).collect()
}

#[track_caller]
fn check_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance * e.abs().max(1.0), "{found:?} against {expected:?}");
    }
}

fn all_methods() -> [LinearMethod; 6] {
    [
        LinearMethod::Ols,
        LinearMethod::Wls,
        LinearMethod::Huber,
        LinearMethod::Tukey,
        LinearMethod::Ridge { prior: vec![1.0; COLUMNS], scale: vec![0.5; COLUMNS], kappa: 1.0 },
        LinearMethod::Tls(TlsNoise { columns: vec![0.0, 0.0, 0.02, 0.02, 0.02, 0.02], effort: 0.2 }),
    ]
}

#[test]
fn least_squares_on_the_blocks_of_any_method_gives_its_estimate() {
    let source = noisy(1);
    for method in all_methods() {
        let found = run(&source, &method, &LinearSettings::default());
        let blocks = found.kept_blocks();
        let fixed = found.kept_prior();
        let all: Vec<&Factor> = blocks.iter().chain(&fixed).collect();
        check_close(&ols(&Factor::merge(&all)).x, &found.x, 1e-9);
        assert_eq!(blocks.len(), 30, "15 blocks of each of two logs");
        assert!(found.converged && found.solution.dropped.is_empty(), "{method:?}");
        for (x, truth) in found.x.iter().zip(TRUTH) {
            assert!((x - truth).abs() < 0.06, "{method:?}: {:?}", found.x);
        }
        let spread = found.jackknife().unwrap().covariance;
        let sandwich = found.block_sandwich().unwrap();
        let model = found.model_covariance();
        // One variance for joints of unequal noise is wrong for both of them.
        let alike = matches!(method, LinearMethod::Ols | LinearMethod::Tls(_));
        for i in 0..COLUMNS {
            let ratios = [spread[(i, i)] / model[(i, i)], sandwich[(i, i)] / spread[(i, i)]];
            let known = if alike { &ratios[1..] } else { &ratios[..] };
            assert!(known.iter().all(|r| (0.3..3.0).contains(r)), "{method:?}: {ratios:?}");
        }
    }
}

#[test]
fn squared_losses_are_those_of_the_factors() {
    let source = noisy(2);
    let groups = reduce_rows(&source).unwrap();
    let factors = merged(&groups);
    let ordinary = run(&source, &LinearMethod::Ols, &LinearSettings::default());
    check_close(&ordinary.x, &ols(&Factor::merge(&factors.iter().collect::<Vec<_>>())).x, 1e-12);
    assert!(ordinary.groups.iter().all(|g| g.variance == ordinary.groups[0].variance));

    let weighted = run(&source, &LinearMethod::Wls, &LinearSettings::default());
    let reference = wls(&factors, &WlsSettings::default());
    assert_eq!((&weighted.x, &weighted.factor), (&reference.solution.x, &reference.factor));
    let blocks = time_blocks(&groups, &reference.weights(), COLUMNS);
    assert_eq!(weighted.jackknife(), jackknife(&blocks, &reference.solution.x));
    for (group, joint) in weighted.groups.iter().zip([0, 1, 0, 1]) {
        assert!((group.variance.sqrt() / NOISE[joint] - 1.0).abs() < 0.1);
    }
}

#[test]
fn shared_variances_pool_their_groups() {
    let source = noisy(3);
    let settings = LinearSettings { sharing: VarianceSharing::Joint, ..LinearSettings::default() };
    let found = run(&source, &LinearMethod::Wls, &settings);
    let groups = &found.groups;
    for joint in 0..2 {
        let (a, b) = (&groups[joint], &groups[joint + 2]);
        assert_eq!((a.log, b.log, a.output, b.output, a.variance), (0, 1, joint, joint, b.variance));
        let pooled = (a.rss + b.rss) / (a.rows as f64 + b.rows as f64 - a.leverage - b.leverage);
        assert!((a.variance / pooled - 1.0).abs() < 1e-6);
    }
    let leverage: f64 = groups.iter().map(|g| g.leverage).sum();
    assert!((leverage - COLUMNS as f64).abs() < 1e-9);
}

#[test]
fn ridge_is_that_of_the_weighted_factor() {
    let source = noisy(4);
    let (prior, scale) = (vec![0.3; COLUMNS], vec![0.02, 0.1, 0.02, 0.1, 0.02, 0.1]);
    let method = LinearMethod::Ridge { prior: prior.clone(), scale: scale.clone(), kappa: 2.0 };
    let found = run(&source, &method, &LinearSettings::default());
    let reference = ridge(&found.factor, &prior, &scale, 2.0);
    check_close(&found.x, &reference.x, 1e-12);
    assert!((found.solution.rss / reference.rss - 1.0).abs() < 1e-12);
    let refit = |b: usize| {
        let blocks = found.kept_blocks();
        let rest: Vec<&Factor> = blocks.iter().enumerate().filter(|(i, _)| *i != b).map(|(_, f)| f).collect();
        ridge(&Factor::merge(&rest), &prior, &scale, 2.0).x
    };
    let spread = jackknife_with(&found.kept_blocks(), found.kept_prior().as_ref(), &found.x).unwrap();
    for b in [0, 7] {
        let change: Vec<f64> = refit(b).iter().zip(&found.x).map(|(a, x)| a - x).collect();
        check_close(&spread.changes[b], &change, 1e-12);
    }
}

#[test]
fn longer_blocks_hold_the_same_rows() {
    let groups = reduce_rows(&noisy(8)).unwrap();
    for (factor, sizes) in [
        (1, vec![1; 15]),
        (2, vec![2, 2, 2, 2, 2, 2, 2, 1]),
        (4, vec![4, 4, 4, 3]),
        (7, vec![7, 8]),
        (40, vec![15]),
    ] {
        let coarse = groups[0].coarsened(factor);
        assert_eq!(coarse.blocks.iter().map(|b| b.rows() / 40).collect::<Vec<_>>(), sizes);
        let (a, b) = (coarse.merged(COLUMNS), groups[0].merged(COLUMNS));
        check_close(&ols(&a).x, &ols(&b).x, 1e-12);
    }
}

#[test]
fn columns_without_rows_stay_at_a_prior_and_are_dropped_without_one() {
    let mut normal = Normal::new(5, 0);
    let mut builder = FactorBuilder::new(2);
    for k in 0..50 {
        builder.push_row(&[(0.3 * f64::from(k)).sin(), 0.0], normal.draw()).unwrap();
    }
    let group =
        ReducedGroup { log: 0, output: 0, scale: 0, columns: vec![0, 2], blocks: vec![builder.finish()] };
    let find = |method| estimate(std::slice::from_ref(&group), None, 3, &method, &LinearSettings::default());
    let free = find(LinearMethod::Wls).unwrap();
    assert_eq!((free.solution.kept.as_slice(), free.solution.dropped.as_slice()), (&[0][..], &[1, 2][..]));
    let held =
        find(LinearMethod::Ridge { prior: vec![0.0, 4.0, 5.0], scale: vec![1.0; 3], kappa: 1.0 }).unwrap();
    check_close(&held.x[1..], &[4.0, 5.0], 1e-12);
}

/// Errors of the columns that act on a joint, in a problem where not all of them act on both.
#[test]
fn total_least_squares_over_joints_is_unbiased_where_least_squares_is_not() {
    let mut normal = Normal::new(6, 0);
    let truth = [2.0, -3.0, 1.5];
    let acting: [&[usize]; 2] = [&[0, 1], &[1, 2]];
    let groups: Vec<ReducedGroup> = acting
        .iter()
        .enumerate()
        .map(|(output, columns)| {
            let mut builder = FactorBuilder::new(2);
            let blocks = (0..40)
                .map(|_| {
                    for _ in 0..500 {
                        let w = [normal.draw(), normal.draw()];
                        let effort =
                            w[0] * truth[columns[0]] + w[1] * truth[columns[1]] + 0.2 * normal.draw();
                        let seen = [w[0] + 0.3 * normal.draw(), w[1] + 0.3 * normal.draw()];
                        builder.push_row(&seen, effort).unwrap();
                    }
                    builder.take()
                })
                .collect();
            ReducedGroup { log: 0, output, scale: 0, columns: columns.to_vec(), blocks }
        })
        .collect();
    let noise = TlsNoise { columns: vec![0.3; 3], effort: 0.2 };
    let find =
        |groups: &[ReducedGroup], method| estimate(groups, None, 3, &method, &LinearSettings::default());
    let plain = find(&groups, LinearMethod::Ols).unwrap();
    let found = find(&groups, LinearMethod::Tls(noise.clone())).unwrap();
    assert!(found.converged);
    for (i, truth) in truth.iter().enumerate() {
        assert!((plain.x[i] / truth - 1.0 / 1.09).abs() < 0.02, "least squares: {:?}", plain.x);
        assert!((found.x[i] / truth - 1.0).abs() < 0.015, "total: {:?}", found.x);
    }
    // One joint alone goes through the singular value decomposition.
    let one = find(&groups[..1], LinearMethod::Tls(noise)).unwrap();
    let merged = groups[0].merged(3).select(&[0, 1]);
    let direct = tls(&merged, &TlsNoise { columns: vec![0.3; 2], effort: 0.2 }).unwrap();
    check_close(&one.x[..2], &direct.x, 1e-10);
    let d = 1.0 + 2.25 * (direct.x[0].powi(2) + direct.x[1].powi(2));
    assert!((one.groups[0].variance / d / 0.04 / direct.variance.unwrap() - 1.0).abs() < 1e-9);
}

#[test]
fn what_does_not_fit_is_refused_with_numbers() {
    let source = noisy(7);
    let groups = reduce_rows(&source).unwrap();
    let find = |groups: &[ReducedGroup], rows: Option<&dyn RowSource>, method| {
        estimate(groups, rows, COLUMNS, &method, &LinearSettings::default()).unwrap_err()
    };
    assert_eq!(find(&[], None, LinearMethod::Wls), LinearError::NoGroups);
    assert_eq!(find(&groups, None, LinearMethod::Huber), LinearError::NeedsRows);
    assert_eq!(
        find(&groups[..3], Some(&source), LinearMethod::Tukey),
        LinearError::OtherRows { expected: 3, found: 4 }
    );
    let short = LinearMethod::Ridge { prior: vec![0.0; 5], scale: vec![1.0; COLUMNS], kappa: 1.0 };
    assert_eq!(
        find(&groups, None, short),
        LinearError::Length { name: "prior", expected: COLUMNS, found: 5 }
    );
    let negative = LinearMethod::Tls(TlsNoise { columns: vec![-1.0; COLUMNS], effort: 1.0 });
    assert!(matches!(find(&groups, None, negative), LinearError::Setting { found: -1.0, .. }));
}
