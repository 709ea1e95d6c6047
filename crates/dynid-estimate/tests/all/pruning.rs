//! Elimination with robust statistics and held-out error, against refitting every model from scratch.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::simulated::Normal;
use dynid_estimate::covariance::{jackknife, variance_inflation};
use dynid_estimate::elimination::{PruneSettings, prune};
use dynid_estimate::folds::FoldSettings;
use dynid_estimate::held_out::{FoldErrors, compare};
use dynid_estimate::linear::ols;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::{Factor, FactorBuilder};

/// `columns` columns of which the last `idle` have no effect; `blocks` blocks of coloured residuals of variance near 1.
fn problem(columns: usize, idle: usize, blocks: usize, seed: u64) -> Vec<Factor> {
    let mut normal = Normal::new(seed, 0);
    let mut builder = FactorBuilder::new(columns);
    let mut colour = 0.0;
    let mut smooth = vec![0.0; columns];
    (0..blocks)
        .map(|_| {
            for _ in 0..3 * columns {
                let mut effort = 0.0;
                for (c, s) in smooth.iter_mut().enumerate() {
                    *s = 0.8 * *s + 0.6 * normal.draw();
                    if c < columns - idle {
                        effort += *s * (1.0 + c as f64 / 10.0);
                    }
                }
                colour = 0.7 * colour + 0.714 * normal.draw();
                builder.push_row(&smooth, effort + colour).unwrap();
            }
            builder.take()
        })
        .collect()
}

fn merged(blocks: &[Factor], columns: &[usize]) -> (Factor, Vec<Factor>) {
    let own: Vec<Factor> = blocks.iter().map(|b| b.select(columns)).collect();
    (Factor::merge(&own.iter().collect::<Vec<_>>()), own)
}

#[test]
fn every_step_is_what_refitting_finds() {
    let blocks = problem(8, 3, 20, 1);
    let names: Vec<usize> = (0..8).collect();
    let found = prune(&blocks, &names, &PruneSettings::default()).unwrap();
    assert!(found.robust && found.path.len() == 8);
    let rows: usize = blocks.iter().map(Factor::rows).sum();
    for step in &found.path {
        let (all, own) = merged(&blocks, &step.columns);
        let solution = ols(&all);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs().max(1e-9);
        assert!(step.x.iter().zip(&solution.x).all(|(a, b)| close(*a, *b)));
        assert!(close(step.rss, solution.rss));
        let v = jackknife(&own, &solution.x).unwrap().covariance;
        let statistics: Vec<f64> = solution.x.iter().enumerate().map(|(i, x)| x * x / v[(i, i)]).collect();
        let least = (0..statistics.len()).min_by(|&a, &b| statistics[a].total_cmp(&statistics[b])).unwrap();
        assert_eq!(step.weakest, step.columns[least]);
        assert!(close(step.statistic, statistics[least]));
        if step.columns.len() == 8 {
            let kappa = variance_inflation(&v, &solution.unit_covariance()).unwrap();
            assert!(close(found.effective_rows, rows as f64 / kappa));
        }
        let n = found.effective_rows;
        let bic = n * (solution.rss / rows as f64).ln() + step.columns.len() as f64 * n.ln();
        assert!((step.bic - bic).abs() < 1e-6);
        let columns = step.columns.len();
        let groups =
            [ReducedGroup { log: 0, output: 0, scale: 0, columns: (0..columns).collect(), blocks: own }];
        let folds =
            compare(&groups, &groups, &[1.0], columns, &FoldSettings::default(), &[&|t| ols(t).x]).folds;
        let errors: Vec<f64> =
            folds.iter().map(|f: &FoldErrors| f.squares[0][0] / f.rows[0] as f64).collect();
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let spread: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
        let found = step.held_out.as_ref().unwrap();
        assert!(close(found.mean, mean));
        assert!(close(found.standard_error, (spread / (count - 1.0) / count).sqrt()));
    }
}

#[test]
fn idle_columns_go_and_the_others_stay() {
    let names: Vec<usize> = (100..112).collect();
    let mut exact = 0;
    for seed in 0..20 {
        let blocks = problem(12, 5, 40, 10 + seed);
        let found = prune(&blocks, &names, &PruneSettings::default()).unwrap();
        let chosen = &found.path[found.chosen.unwrap()].columns;
        assert!((100..107).all(|c| chosen.contains(&c)), "a needed column went: {chosen:?}");
        assert!(found.path[found.least_bic].columns.len() < 11);
        let tested = &found.path[found.all_significant.unwrap()].columns;
        assert!((100..107).all(|c| tested.contains(&c)));
        exact += usize::from(chosen.len() == 7);
    }
    assert!(exact >= 15, "exact in {exact} of 20");
}

#[test]
fn few_blocks_fall_back_to_the_plain_statistic() {
    let blocks = problem(4, 1, 6, 3);
    let found = prune(&blocks, &[0, 1, 2, 3], &PruneSettings::default()).unwrap();
    assert!(!found.robust);
    let (all, _) = merged(&blocks, &[0, 1, 2, 3]);
    let solution = ols(&all);
    let c = solution.unit_covariance();
    let variance = solution.residual_variance().unwrap();
    let least = (0..4).map(|i| solution.x[i].powi(2) / c[(i, i)] / variance).fold(f64::INFINITY, f64::min);
    assert!((found.path[0].statistic / least - 1.0).abs() < 1e-9);
    assert!(prune(&[], &[], &PruneSettings::default()).is_none());
    let dependent: Vec<Factor> = blocks.iter().map(|b| b.select(&[0, 0])).collect();
    assert!(prune(&dependent, &[0, 1], &PruneSettings::default()).is_none());
}

#[test]
fn threads_do_not_change_a_bit() {
    let blocks = problem(10, 4, 30, 5);
    let names: Vec<usize> = (0..10).collect();
    let reference = prune(&blocks, &names, &PruneSettings::default()).unwrap();
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| prune(&blocks, &names, &PruneSettings::default()).unwrap());
        assert_eq!(found, reference);
    }
}

/// Seven joints, 64 columns, 60 blocks: the size of a long log of a large arm. Prints, asserts no time.
#[test]
fn a_large_arm() {
    let blocks = problem(64, 20, 60, 6);
    let names: Vec<usize> = (0..64).collect();
    let start = std::time::Instant::now();
    let found = prune(&blocks, &names, &PruneSettings::default()).unwrap();
    println!("path of {} models in {:.2?}", found.path.len(), start.elapsed());
    assert!((0..44).all(|c| found.path[found.chosen.unwrap()].columns.contains(&c)));
}
