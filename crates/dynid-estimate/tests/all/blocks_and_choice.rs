//! Jackknife on awkward blocks, and the choice of a model along an elimination path.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::covariance::{hac_lag, jackknife, variance_inflation};
use dynid_estimate::folds::contiguous_folds;
use dynid_estimate::linear::ols;
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;

/// Twelve blocks of ten rows; column 1 is excited in block 4 only.
fn blocks() -> Vec<Factor> {
    let mut builder = FactorBuilder::new(2);
    (0..12)
        .map(|b| {
            for k in 0..10 {
                let t = f64::from(10 * b + k);
                let once = if b == 4 { (2.1 * t).cos() } else { 0.0 };
                builder.push_row(&[t.sin(), once], 2.0 * t.sin() - once + 0.1 * (7.7 * t).sin()).unwrap();
            }
            builder.take()
        })
        .collect()
}

#[test]
fn a_block_that_alone_sees_a_parameter_is_named() {
    let blocks = blocks();
    let x = ols(&Factor::merge(&blocks.iter().collect::<Vec<_>>())).x;
    let result = jackknife(&blocks, &x).unwrap();
    assert_eq!(result.indispensable, [4]);
    assert!(result.changes.iter().flatten().all(|d| d.is_finite() && d.abs() < 0.1));
    let widths = result.half_widths(0.95).unwrap();
    // SciPy 1.17: stats.t.ppf(0.975, 11).
    assert!((widths[0] / result.covariance[(0, 0)].sqrt() / 2.200_985_160 - 1.0).abs() < 1e-9);
    assert_eq!(jackknife(&blocks[..1], &x), None);
}

#[test]
fn changes_equal_those_of_refitting() {
    let blocks: Vec<Factor> = blocks().iter().map(|b| b.select(&[0])).collect();
    let fit = |factors: Vec<&Factor>| ols(&Factor::merge(&factors)).x[0];
    let x = fit(blocks.iter().collect());
    let result = jackknife(&blocks, &[x]).unwrap();
    for (b, change) in result.changes.iter().enumerate() {
        let others = blocks.iter().enumerate().filter(|(i, _)| *i != b).map(|(_, f)| f).collect();
        assert!((change[0] - (fit(others) - x)).abs() < 1e-14);
    }
}

#[test]
fn folds_lags_and_inflation_follow_their_definitions() {
    assert_eq!(contiguous_folds(7, 3), [0..2, 2..4, 4..7]);
    assert_eq!(contiguous_folds(2, 5), [0..1, 1..2]);
    assert_eq!((hac_lag(50.0, 10.0), hac_lag(25.0, 20.0)), (10, 4));
    let diagonal = |values: [f64; 2]| Mat::from_fn(2, 2, |i, j| if i == j { values[i] } else { 0.0 });
    assert_eq!(variance_inflation(&diagonal([2.0, 8.0]), &diagonal([1.0, 2.0])), Some(3.0));
    assert_eq!(variance_inflation(&diagonal([0.1, 0.1]), &diagonal([1.0, 1.0])), Some(1.0));
}
