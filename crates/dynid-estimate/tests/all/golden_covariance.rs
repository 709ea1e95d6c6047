//! `estimation_covariance.json`: covariance estimators on one correlated record.

use crate::golden::{check_close, load, number, vector};
use dynid_estimate::covariance::{block_sandwich, hac_bartlett, jackknife};
use dynid_estimate::linear::ols;
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use serde_json::Value;

const BLOCK_ROWS: usize = 9;

#[test]
fn covariance_estimators() {
    let Some(golden) = load("estimation_covariance.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let rows: Vec<Vec<f64>> = golden["W"].as_array().unwrap().iter().map(vector).collect();
    let efforts = vector(&golden["y"]);
    let blocks: Vec<Factor> = rows
        .chunks(BLOCK_ROWS)
        .zip(efforts.chunks(BLOCK_ROWS))
        .map(|(rows, efforts)| {
            let mut builder = FactorBuilder::new(3);
            rows.iter().zip(efforts).for_each(|(row, y)| builder.push_row(row, *y).unwrap());
            builder.finish()
        })
        .collect();
    let solution = ols(&Factor::merge(&blocks.iter().collect::<Vec<_>>()));
    let check = |what: &str, found: &Mat, expected: &Value| {
        let expected: Vec<f64> = expected.as_array().unwrap().iter().flat_map(vector).collect();
        let found: Vec<f64> = (0..9).map(|k| found[(k / 3, k % 3)]).collect();
        check_close(what, &found, &expected, tolerance);
    };
    check_close("x", &solution.x, &vector(&golden["x"]), tolerance);
    let unit = solution.unit_covariance();
    let variance = solution.residual_variance().unwrap();
    check("naive", &Mat::from_fn(3, 3, |i, j| variance * unit[(i, j)]), &golden["naive"]);
    check("block", &block_sandwich(&blocks, &solution.x).unwrap(), &golden["block"]);
    check("jackknife", &jackknife(&blocks, &solution.x).unwrap().covariance, &golden["jackknife"]);

    let residuals: Vec<f64> = rows
        .iter()
        .zip(&efforts)
        .map(|(row, y)| y - row.iter().zip(&solution.x).map(|(w, x)| w * x).sum::<f64>())
        .collect();
    let scores = Mat::from_fn(rows.len(), 3, |k, j| rows[k][j] * residuals[k]);
    let lag = golden["S"].as_u64().unwrap() as usize;
    check("hac", &hac_bartlett(&scores, &unit, lag).unwrap(), &golden["hac"]);
}
