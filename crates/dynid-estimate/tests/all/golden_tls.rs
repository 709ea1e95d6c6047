//! `estimation_tls.json`: total least squares with one exact column, its refusals, and its bias against least squares.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::golden::{check_close, load, number, vector};
use dynid_estimate::linear::{TlsNoise, TlsRefusal, ols, tls};
use dynid_factor::{Factor, FactorBuilder};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn factor(rows: impl IntoIterator<Item = (Vec<f64>, f64)>, columns: usize) -> Factor {
    let mut builder = FactorBuilder::new(columns);
    rows.into_iter().for_each(|(row, y)| builder.push_row(&row, y).unwrap());
    builder.finish()
}

#[test]
fn solution_singular_values_and_variance() {
    let Some(golden) = load("estimation_tls.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let rows = golden["W"].as_array().unwrap().iter().map(vector);
    let factor = factor(rows.zip(vector(&golden["y"])), 4);
    let std = vector(&golden["noise_std"]);
    let noise = TlsNoise { columns: vec![0.0, std[1], std[2], std[3]], effort: std[4] };
    let found = tls(&factor, &noise).unwrap();
    check_close("x", &found.x, &vector(&golden["x"]), tolerance);
    check_close("ls", &ols(&factor).x, &vector(&golden["ls"]), tolerance);
    let expected = vector(&golden["trailing_singular_values"]);
    check_close("singular values", &found.singular_values, &expected, tolerance);
    check_close("variance", &[found.variance.unwrap()], &[number(&golden["sigma2"])], tolerance);
}

#[test]
fn columns_in_any_order_and_unit_give_the_same_parameters() {
    let row = |k: usize| {
        let t = k as f64;
        vec![1.0, (1.3 * t).sin() + 0.02 * (17.0 * t).cos(), (0.7 * t).cos() + 0.03 * (23.0 * t).sin()]
    };
    let effort = |k: usize| 2.0 + (1.3 * k as f64).sin() - 3.0 * (0.7 * k as f64).cos();
    let straight = factor((0..80).map(|k| (row(k), effort(k))), 3);
    let turned = factor(
        (0..80).map(|k| {
            let w = row(k);
            (vec![1e3 * w[2], w[0], 1e-3 * w[1]], effort(k))
        }),
        3,
    );
    let a = tls(&straight, &TlsNoise { columns: vec![0.0, 0.02, 0.03], effort: 0.01 }).unwrap();
    let b = tls(&turned, &TlsNoise { columns: vec![30.0, 0.0, 2e-5], effort: 0.01 }).unwrap();
    let back = [b.x[1], 1e-3 * b.x[2], 1e3 * b.x[0]];
    check_close("x", &back, &a.x, 1e-11);
}

/// Classical errors in variables: least squares shrinks the parameter by `1/(1 + s²/w²)`, total least squares does not.
#[test]
fn noisy_columns_do_not_bias_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    let rows: Vec<(Vec<f64>, f64)> = (0..20_000)
        .map(|_| {
            let w = normal();
            (vec![1.0, w + 0.5 * normal()], 3.0 + 2.0 * w + 0.5 * normal())
        })
        .collect();
    let factor = factor(rows, 2);
    let found = tls(&factor, &TlsNoise { columns: vec![0.0, 0.5], effort: 0.5 }).unwrap();
    assert!((ols(&factor).x[1] - 1.6).abs() < 0.03, "attenuated to 2/(1 + 0.25)");
    assert!((found.x[1] - 2.0).abs() < 0.03 && (found.x[0] - 3.0).abs() < 0.03, "{:?}", found.x);
    assert!((found.variance.unwrap() - 1.0).abs() < 0.03);
}

#[test]
fn exact_columns_alone_are_least_squares_and_dependent_ones_are_dropped() {
    let rows = |k: usize| vec![1.0, (0.9 * k as f64).sin(), 2.0];
    let effort = |k: usize| 1.0 + 0.3 * (5.0 * k as f64).cos();
    let factor = factor((0..40).map(|k| (rows(k), effort(k))), 3);
    let found = tls(&factor, &TlsNoise { columns: vec![0.0; 3], effort: 1.0 }).unwrap();
    let reference = ols(&factor);
    assert_eq!((&found.kept, found.dropped.len()), (&reference.kept, 1));
    check_close("x", &found.x, &reference.x, 1e-13);
    check_close("variance", &[found.variance.unwrap()], &[reference.residual_variance().unwrap()], 1e-13);
}

#[test]
fn no_unique_solution_is_refused_with_numbers() {
    // Orthogonal columns and effort of the same norm: every singular value agrees.
    let alike = factor([(vec![1.0], 0.0), (vec![0.0], 1.0), (vec![0.0], 0.0)], 1);
    let noise = TlsNoise { columns: vec![1.0], effort: 1.0 };
    assert!(matches!(tls(&alike, &noise), Err(TlsRefusal::RepeatedSingularValue { ratio }) if ratio > 0.999));
    // The column is the smallest direction and the effort has nothing to do with it.
    let apart = factor([(vec![1.0], 0.0), (vec![0.0], 5.0), (vec![0.0], 0.0)], 1);
    assert!(matches!(tls(&apart, &noise), Err(TlsRefusal::EffortNotInvolved { share }) if share < 1e-6));
}
