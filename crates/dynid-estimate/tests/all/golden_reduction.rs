//! `estimation_reduction.json`: reduction, rank, weighted least squares, jackknife, folds, ridge.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::golden::{check_close, load, number, vector};
use dynid_estimate::covariance::jackknife;
use dynid_estimate::folds::FoldSettings;
use dynid_estimate::held_out::{FoldErrors, compare};
use dynid_estimate::linear::{WlsEstimate, WlsSettings, ols, ridge, wls};
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::rank::{base_columns, numerical_rank};
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use serde_json::Value;

const KEPT: [usize; 5] = [0, 1, 2, 3, 4];

/// `[joint][block]`
fn block_factors(golden: &Value) -> Vec<Vec<Factor>> {
    let joints = golden["W"].as_array().unwrap().iter().zip(golden["y"].as_array().unwrap());
    joints
        .map(|(w, y)| {
            w.as_array()
                .unwrap()
                .iter()
                .zip(y.as_array().unwrap())
                .map(|(w, y)| {
                    let mut builder = FactorBuilder::new(6);
                    for (row, effort) in w.as_array().unwrap().iter().zip(vector(y)) {
                        builder.push_row(&vector(row), effort).unwrap();
                    }
                    builder.finish()
                })
                .collect()
        })
        .collect()
}

fn merged(blocks: &[Factor]) -> Factor {
    Factor::merge(&blocks.iter().collect::<Vec<_>>())
}

fn settled() -> WlsSettings {
    WlsSettings { tolerance: 1e-13, max_passes: 200, ..WlsSettings::default() }
}

fn kept_wls(blocks: &[Vec<Factor>]) -> WlsEstimate {
    let joints: Vec<Factor> = blocks.iter().map(|b| merged(b).select(&KEPT)).collect();
    wls(&joints, &settled())
}

/// The kept columns of every joint and block.
fn groups(blocks: &[Vec<Factor>]) -> Vec<ReducedGroup> {
    let group = |(output, blocks): (usize, &Vec<Factor>)| ReducedGroup {
        log: 0,
        output,
        scale: 0,
        columns: KEPT.to_vec(),
        blocks: blocks.iter().map(|b| b.select(&KEPT)).collect(),
    };
    blocks.iter().enumerate().map(group).collect()
}

fn flat(matrix: &Mat) -> Vec<f64> {
    (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| matrix[(i, j)])).collect()
}

fn flat_golden(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().flat_map(vector).collect()
}

#[test]
fn joint_factors() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    for (blocks, expected) in block_factors(&golden).iter().zip(golden["joint_factor"].as_array().unwrap()) {
        let factor = merged(blocks);
        assert_eq!(factor.rows(), 42);
        let rows: Vec<Vec<f64>> = expected.as_array().unwrap().iter().map(vector).collect();
        // Column 5 depends on others: below the rank, rows are rounding and only their norm is defined.
        for (i, row) in rows.iter().take(5).enumerate() {
            let found: Vec<f64> = (0..6).map(|j| factor.r(i, j)).chain([factor.z()[i]]).collect();
            check_close("row of the factor", &found, row, tolerance);
        }
        let remainder = factor.z()[5].hypot(factor.rho());
        check_close("remainder", &[remainder], &[rows[5][6].hypot(rows[6][6])], tolerance);
    }
}

#[test]
fn rank_and_regrouping() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    // The golden singular values are those of the unweighted rows of both joints.
    let factor = merged(&block_factors(&golden).concat());
    let report = numerical_rank(&factor);
    assert_eq!(report.rank as u64, golden["rank"].as_u64().unwrap());
    check_close(
        "singular values",
        &report.singular_values,
        &vector(&golden["singular_values_scaled"]),
        tolerance,
    );
    assert!(report.gap.unwrap() > 1e10);
    let base = base_columns(&factor, &[0, 1, 2, 3, 4, 5]);
    assert_eq!((base.kept.as_slice(), base.dependent.as_slice()), (&KEPT[..], &[5][..]));
    assert!(!base.fell_back_to_pivoting);
    check_close("regrouping", &flat(&base.regrouping), &vector(&golden["regrouping_of_column_5"]), tolerance);
}

#[test]
fn weighted_least_squares() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let expected = &golden["wls"];
    let estimate = kept_wls(&block_factors(&golden));
    assert!(estimate.converged);
    check_close("x", &estimate.solution.x, &vector(&expected["x"]), tolerance);
    for (group, (s2, leverage)) in
        estimate.groups.iter().zip(vector(&expected["s2"]).into_iter().zip(vector(&expected["leverage"])))
    {
        check_close("variance", &[group.variance], &[s2], tolerance);
        check_close("leverage", &[group.leverage], &[leverage], tolerance);
    }
    let total: f64 = estimate.groups.iter().map(|g| g.leverage).sum();
    assert!((total - 5.0).abs() < 1e-12);
    check_close("rss", &[estimate.solution.rss], &[number(&expected["weighted_rss"])], tolerance);
    let covariance = flat(&estimate.solution.unit_covariance());
    check_close("covariance", &covariance, &flat_golden(&expected["covariance"]), tolerance);
    let defaults = wls(
        &block_factors(&golden).iter().map(|b| merged(b).select(&KEPT)).collect::<Vec<_>>(),
        &WlsSettings::default(),
    );
    assert!(defaults.converged && defaults.passes <= 20, "{} passes", defaults.passes);
}

#[test]
fn dependent_columns_are_dropped_with_the_same_residual() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let joints: Vec<Factor> = block_factors(&golden).iter().map(|b| merged(b)).collect();
    let estimate = wls(&joints, &settled());
    assert_eq!(estimate.solution.dropped.len(), 1);
    assert!([0, 2, 5].contains(&estimate.solution.dropped[0]));
    let s2: Vec<f64> = estimate.groups.iter().map(|g| g.variance).collect();
    check_close("variances", &s2, &vector(&golden["wls"]["s2"]), tolerance);
    check_close("rss", &[estimate.solution.rss], &[79.0], tolerance);
}

#[test]
fn jackknife_covariance() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let blocks = block_factors(&golden);
    let estimate = kept_wls(&blocks);
    let weighted = time_blocks(&groups(&blocks), &estimate.weights(), KEPT.len());
    let result = jackknife(&weighted, &estimate.solution.x).unwrap();
    assert_eq!((result.blocks(), result.indispensable.len()), (6, 0));
    check_close(
        "jackknife",
        &flat(&result.covariance),
        &flat_golden(&golden["jackknife_covariance"]),
        tolerance,
    );
}

#[test]
fn held_out_error_per_joint_and_fold() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let blocks = block_factors(&golden);
    let groups = groups(&blocks);
    let weights = kept_wls(&blocks).weights();
    let settings = FoldSettings { folds: 6, dropped_neighbours: 0 };
    let outcome = compare(&groups, &groups, &weights, KEPT.len(), &settings, &[&|training| ols(training).x]);
    for joint in 0..2 {
        let error = |f: &FoldErrors| f.squares[0][joint] / f.rows[joint] as f64;
        let found: Vec<f64> = outcome.folds.iter().map(error).collect();
        check_close("held-out error", &found, &vector(&golden["kfold"][joint]), tolerance);
    }
}

#[test]
fn ridge_towards_zero() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let estimate = kept_wls(&block_factors(&golden));
    let solution = ridge(&estimate.factor, &[0.0; 5], &[1.0; 5], 0.5);
    check_close("ridge", &solution.x, &vector(&golden["ridge"]), tolerance);
}

#[test]
fn merge_orders_agree() {
    let Some(golden) = load("estimation_reduction.json") else { return };
    let blocks: Vec<Factor> = block_factors(&golden)[0].iter().map(|b| b.select(&KEPT)).collect();
    let fold = merged(&blocks);
    let pairs: Vec<Factor> = blocks.chunks(2).map(merged).collect();
    let reversed = merged(&blocks.iter().rev().cloned().collect::<Vec<_>>());
    for other in [merged(&pairs), reversed] {
        assert_eq!(other.rows(), fold.rows());
        check_close("R", &flat(&other.r_matrix()), &flat(&fold.r_matrix()), 1e-12);
        check_close("z", &other.z(), &fold.z(), 1e-12);
        check_close("rho", &[other.rho()], &[fold.rho()], 1e-12);
    }
}
