//! The rank test against SciPy 1.16 `mannwhitneyu`.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_search::rank_sum;

/// `count` numbers without order or ties, `factor k mod 101 + shift`.
fn scattered(factor: usize, shift: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| (k * factor % 101) as f64 + shift).collect()
}

#[track_caller]
fn check(first: &[f64], second: &[f64], statistic: f64, less: f64, tolerance: f64) {
    let found = rank_sum(first, second).unwrap();
    assert_eq!(found.statistic, statistic);
    assert!((found.less - less).abs() <= tolerance * less, "{} {less}", found.less);
}

/// Counting rounds some thousand times.
const EXACT: f64 = 1e-12;
/// The normal distribution function behind it is good to ten digits.
const NORMAL: f64 = 1e-9;

#[test]
fn exact_probabilities_agree_with_scipy() {
    let (a, b) = ([1.1, 2.3, 0.4, 5.6, 3.3], [2.2, 4.1, 6.7, 8.0, 3.9, 7.7, 1.9]);
    check(&a, &b, 8.0, 0.0744949494949495, EXACT);
    let a = scattered(37, 0.0, 60);
    check(&a, &scattered(53, 20.5, 60), 1126.0, 0.00017196983644177257, EXACT);
    check(&a, &scattered(53, 80.5, 60), 71.0, 3.5967857773811986e-28, EXACT);
}

#[test]
fn approximate_probabilities_agree_with_scipy() {
    let (a, b) = ([1.0, 2.0, 2.0, 3.0, 5.0, 8.0, 8.0], [2.0, 3.0, 4.0, 4.0, 8.0, 9.0]);
    check(&a, &b, 15.5, 0.23443948847926788, NORMAL);
    check(&scattered(37, 0.0, 70), &scattered(53, 10.5, 65), 1877.0, 0.04001934196915706, NORMAL);
}

#[test]
fn small_samples_count_orders() {
    // Of the 10 orders of two and three values, one has statistic 0 and one has 1.
    check(&[1.0, 2.0], &[3.0, 4.0, 5.0], 0.0, 0.1, EXACT);
    check(&[1.0, 3.0], &[2.0, 4.0, 5.0], 1.0, 0.2, EXACT);
    check(&[7.0], &[6.0], 1.0, 1.0, EXACT);
}

#[test]
fn samples_without_order_have_no_probability() {
    assert_eq!(rank_sum(&[], &[1.0]), None);
    assert_eq!(rank_sum(&[f64::NAN], &[1.0]), None);
    assert_eq!(rank_sum(&[2.0; 4], &[2.0; 3]), None);
}
