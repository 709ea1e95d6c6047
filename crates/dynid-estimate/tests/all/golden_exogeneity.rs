//! `estimation_dwh.json`: instrumental variables and the test of Durbin, Wu and Hausman on one record.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::golden::{check_close, load, number, vector};
use dynid_estimate::instruments::{
    ExogeneitySettings, InstrumentSettings, Strength, exogeneity, instrumental, measured,
};
use dynid_estimate::linear::ols;
use dynid_factor::FactorBuilder;
use dynid_factor::groups::ReducedGroup;
use serde_json::Value;

const BLOCK_ROWS: usize = 6;

/// One group of blocks of `[Z | X | y]`.
fn paired(golden: &Value) -> ReducedGroup {
    let rows = |name: &str| golden[name].as_array().unwrap().iter().map(vector).collect::<Vec<_>>();
    let (z, x, y) = (rows("Z"), rows("X"), vector(&golden["y"]));
    let p = x[0].len();
    let blocks = (0..y.len()).step_by(BLOCK_ROWS).map(|start| {
        let mut builder = FactorBuilder::new(2 * p);
        (start..start + BLOCK_ROWS)
            .for_each(|k| builder.push_row(&[&z[k][..], &x[k]].concat(), y[k]).unwrap());
        builder.finish()
    });
    ReducedGroup { log: 0, output: 0, scale: 0, columns: (0..2 * p).collect(), blocks: blocks.collect() }
}

#[test]
fn instruments_and_test() {
    let Some(golden) = load("estimation_dwh.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let groups = [paired(&golden)];
    let iv = instrumental(&groups, 3, &InstrumentSettings::default()).unwrap();
    check_close("iv", &iv.linear.x, &vector(&golden["iv"]), tolerance);
    assert_eq!(iv.strength, Strength::Strong);
    let expected: Vec<f64> = golden["iv_covariance"].as_array().unwrap().iter().flat_map(vector).collect();
    let covariance = iv.linear.model_covariance();
    let found: Vec<f64> = (0..9).map(|k| covariance[(k / 3, k % 3)]).collect();
    check_close("covariance of iv", &found, &expected, tolerance);

    let ls = ols(&measured(&groups)[0].merged(3));
    check_close("ls", &ls.x, &vector(&golden["ls"]), tolerance);
    let test = exogeneity(&groups, &[1.0], 3, &[1.0; 3], &ExogeneitySettings::default()).unwrap();
    assert_eq!(test.tested.len() as u64, golden["kept"].as_u64().unwrap());
    let ratios: Vec<f64> = test.tested.iter().map(|c| test.unexplained[*c]).collect();
    check_close("length of V", &ratios, &vector(&golden["v_ratio"]), tolerance);
    let (naive, robust) = (test.naive.unwrap(), test.robust.unwrap());
    let found = [naive.statistic, naive.p_value, robust.statistic, robust.p_value];
    for (found, name) in found.iter().zip(["F", "p_value", "wald_F", "wald_p"]) {
        check_close(name, &[*found], &[number(&golden[name])], tolerance);
    }
    for effect in &test.effects {
        assert!((effect.least_squares - ls.x[effect.column]).abs() < 1e-12);
        assert!((effect.instruments - iv.linear.x[effect.column]).abs() < 1e-12);
    }
}
