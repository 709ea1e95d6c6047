//! Linear-regression sets of the NIST Statistical Reference Datasets through the reduction and least squares.
#![expect(clippy::print_stdout, reason = "in tests a panic is the report")]

use crate::extended::{DoubleDouble, ExtendedFactor};
use crate::nist::{Dataset, datasets};
use dynid_estimate::linear::ols;
use dynid_factor::FactorBuilder;

/// With 32 digits every figure of every set is the certified one, so that what double precision loses below is the rounding of
/// its reduction. What remains lost of 15 digits is the rounding of decimal data to double.
#[test]
fn an_extended_reduction_gives_the_certified_digits_of_every_set() {
    for data in datasets() {
        let mut factor = ExtendedFactor::new(data.certified.len());
        for (predictors, y) in data.rows() {
            factor.push(data.model.extended_row(predictors).into_iter().chain([DoubleDouble::from(y)]));
        }
        let found = factor.solve();
        check(&data, &found.x, found.residual_std, &found.std, 12.0);
    }
}

/// What double precision reaches. The sets that stay below nine digits do so for a reason:
///
/// - Filip: scaled condition number 5e9, and powers rounded to double.
/// - Wampler4 and Wampler5: residuals are 1e5 and 1e7 times the constant to be found. Rounding the efforts at
///   `ε ‖y‖`, amplified by a scaled condition number of 2e3, costs digits of any reduction in double precision.
#[test]
fn double_precision_gives_what_rounding_leaves() {
    for data in datasets() {
        let mut builder = FactorBuilder::new(data.certified.len());
        for (predictors, y) in data.rows() {
            builder.push_row(&data.model.row(predictors), y).unwrap();
        }
        let digits = match data.name {
            "Filip" | "Wampler4" => 7.0,
            "Wampler5" => 5.0,
            _ => 9.0,
        };
        let found = ols(&builder.finish());
        assert_eq!(found.rows, data.y.len());
        assert!(found.rank.is_full(), "{}: {:?}", data.name, found.rank);
        let variance = found.residual_variance().unwrap();
        let std: Vec<f64> = found.standard_deviations(variance).into_iter().flatten().collect();
        check(&data, &found.x, variance.sqrt(), &std, digits);
    }
}

/// Requires `digits` agreeing digits of every certified parameter and standard deviation.
#[track_caller]
fn check(data: &Dataset, x: &[f64], residual_std: f64, std: &[f64], digits: f64) {
    let name = data.name;
    let parameters = agreeing_digits(x, data.certified);
    let deviations = if data.residual_std > 0.0 {
        let residual = agreeing_digits(&[residual_std], &[data.residual_std]);
        residual.min(agreeing_digits(std, data.certified_std))
    } else {
        // An exact fit leaves only rounding of the efforts.
        let size = data.y.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(residual_std <= 10_f64.powf(-digits) * size, "{name}: {residual_std}");
        assert!(data.certified_std.iter().all(|s| *s == 0.0));
        16.0
    };
    println!("{name}: {parameters:.2} digits of parameters, {deviations:.2} of standard deviations");
    assert!(parameters >= digits, "{name}: {parameters:.2} digits of parameters, {digits} asked");
    assert!(deviations >= digits, "{name}: {deviations:.2} digits of standard deviations, {digits} asked");
}

/// Fewest agreeing digits, `-log10` of the relative deviation, at most 16.
fn agreeing_digits(found: &[f64], certified: &[f64]) -> f64 {
    assert_eq!(found.len(), certified.len());
    let digits = |(f, c): (&f64, &f64)| -((f / c - 1.0).abs().max(1e-16)).log10();
    found.iter().zip(certified).map(digits).fold(16.0, f64::min)
}
