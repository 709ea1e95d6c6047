//! Exact gradients of criteria: golden numbers and central differences.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::problems;
use crate::support::*;
use dynid_excitation::criterion::{ColumnScaling, Criterion, Measure};
use dynid_excitation::*;
use dynid_linalg::Mat;
use serde_json::Value;

const PI: f64 = std::f64::consts::PI;

/// Problem of a robot of the reference data with friction columns, no limits that act.
fn problem(name: &str, weights: Vec<f64>, criterion: Criterion, samples: usize) -> Option<Problem> {
    let data = reference(&format!("robots/{name}.json"))?;
    let mechanism = mechanism(&data);
    let rotors = if name == "indy7" { 2..6 } else { 0..0 };
    Some(Problem {
        coordinates: mechanism.rate_names(),
        limits: limits(&data),
        constraints: Vec::new(),
        base: 0.1 * PI,
        harmonics: 5,
        start: StartConditions::default(),
        criterion,
        output_weights: weights,
        effective_samples: samples as f64,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples,
        model: Box::new(excitation(model(&mechanism, rotors, true))),
    })
}

/// Coefficients of a published row in plain amplitudes.
fn plain(row: &[f64], velocity_form: bool) -> Vec<f64> {
    row.iter().zip(form_factors(velocity_form)).map(|(x, f)| x * f).collect()
}

/// `d(plain)/d(published)` of the eleven entries.
fn form_factors(velocity_form: bool) -> Vec<f64> {
    let rate = |k: usize| if velocity_form { 0.1 * PI * k as f64 } else { 1.0 };
    let sign = if velocity_form { -1.0 } else { 1.0 };
    let mut factors = vec![1.0];
    factors.extend((1..=5).map(|k| 1.0 / rate(k)));
    factors.extend((1..=5).map(|k| sign / rate(k)));
    factors
}

#[test]
fn golden_values_and_gradients() {
    let Some(golden) = reference("golden/excitation_gradient.json") else { return };
    for case in golden["cases"].as_array().unwrap() {
        let name = case["robot"].as_str().unwrap();
        let velocity = case["form"] == "vel";
        let samples = case["M"].as_u64().unwrap() as usize;
        let published = rows(&case["coefficients"]);
        let coefficients: Vec<Vec<f64>> = published.iter().map(|r| plain(r, velocity)).collect();
        let columns = case["columns"].as_u64().unwrap() as usize;
        for (key, expected) in case["criteria"].as_object().unwrap() {
            let measure = match key.as_str() {
                "log_cond" => Measure::Condition,
                "minus_logdet_WtW" => Measure::Determinant,
                "log_trace_inv_WtW" => Measure::Trace(vec![1.0; columns]),
                "minus_log_sigma_min_squared" => Measure::Smallest,
                other => panic!("{other}"),
            };
            let weights = numbers(&case["joint_weights"]);
            let problem = problem(name, weights, Criterion::raw(measure), samples).unwrap();
            assert_eq!(problem.model.columns().len(), columns);
            let (value, gradient) = criterion_gradient(&problem, &coefficients, samples).unwrap();
            let wanted = expected["value"].as_f64().unwrap();
            assert!((value - wanted).abs() <= 1e-9 * wanted.abs(), "{name} {key}: {value} against {wanted}");
            let wanted = gradient_rows(&expected["gradient"]);
            let largest = wanted.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (row, wanted) in gradient.iter().zip(&wanted) {
                for ((g, w), factor) in row.iter().zip(wanted).zip(form_factors(velocity)) {
                    let g = g * factor;
                    assert!((g - w).abs() <= 1e-8 * largest, "{name} {key}: {g} against {w}");
                }
            }
        }
    }
}

fn gradient_rows(value: &Value) -> Vec<Vec<f64>> {
    rows(value)
}

/// Central difference of fourth order of a criterion along one coefficient.
fn difference(problem: &Problem, at: &[Vec<f64>], joint: usize, k: usize, samples: usize) -> f64 {
    let h = 2e-4;
    let value = |shift: f64| {
        let mut x = at.to_vec();
        x[joint][k] += shift * h;
        criterion_gradient(problem, &x, samples).unwrap().0
    };
    (8.0 * (value(1.0) - value(-1.0)) - (value(2.0) - value(-2.0))) / (12.0 * h)
}

/// Three combinations of all columns.
fn combinations(columns: usize, spread: &[f64]) -> Mat {
    Mat::from_fn(3, columns, |i, j| (1.0 + i as f64 + 2.0 * j as f64).cos() * spread[(i + j) % columns])
}

/// Of single columns at order 1 the measure is the weighted trace; at a high order it is the largest variance.
#[test]
fn largest_deviations_lie_between_the_largest_and_the_trace() {
    let weights = numbers(&serde_json::json!([1.0, 1.0, 1.0, 1.0, 1.0, 1.0]));
    let columns = problem("indy7", weights.clone(), Criterion::raw(Measure::Determinant), 40)
        .map(|p| p.model.columns().len());
    let Some(columns) = columns else { return };
    let coefficients: Vec<Vec<f64>> = (0..6)
        .map(|j| (0..11).map(|k| 0.3 * (1.0 + 3.0 * j as f64 + 7.0 * k as f64).sin()).collect())
        .collect();
    let value = |measure: Measure| {
        let problem = problem("indy7", weights.clone(), Criterion::raw(measure), 40).unwrap();
        criterion_gradient(&problem, &coefficients, 40).unwrap().0
    };
    let single = |column: usize| {
        value(Measure::Trace((0..columns).map(|k| if k == column { 1.0 } else { 0.0 }).collect()))
    };
    let chosen = [2, 7, 11];
    let of = Mat::from_fn(3, columns, |i, j| if j == chosen[i] { 1.0 } else { 0.0 });
    let trace = value(Measure::Trace((0..columns).map(|k| f64::from(chosen.contains(&k))).collect()));
    let largest = chosen.map(single).into_iter().fold(f64::NEG_INFINITY, f64::max);
    assert!((value(Measure::Largest { of: of.clone(), order: 1.0 }) - trace).abs() < 1e-9);
    for order in [4.0, 40.0, 400.0] {
        let found = value(Measure::Largest { of: of.clone(), order });
        assert!(
            found >= largest - 1e-9 && found <= largest + 3_f64.ln() / order + 1e-9,
            "{order}: {found} {largest}"
        );
    }
}

#[test]
fn every_criterion_agrees_with_differences() {
    let Some(golden) = reference("golden/excitation_gradient.json") else { return };
    for case in golden["cases"].as_array().unwrap() {
        let name = case["robot"].as_str().unwrap();
        let velocity = case["form"] == "vel";
        let columns = case["columns"].as_u64().unwrap() as usize;
        let coefficients: Vec<Vec<f64>> =
            rows(&case["coefficients"]).iter().map(|r| plain(r, velocity)).collect();
        let spread: Vec<f64> = (0..columns).map(|k| (2.0 * (3.0 * k as f64).sin()).exp()).collect();
        let measures = [
            Measure::Condition,
            Measure::ConditionAndSmallest { condition: 1.0, smallest: 10.0 },
            Measure::Smallest,
            Measure::Determinant,
            Measure::Trace(spread.clone()),
            Measure::Largest { of: combinations(columns, &spread), order: 1.0 },
            Measure::Largest { of: combinations(columns, &spread), order: 6.0 },
        ];
        for measure in measures {
            for scaling in [ColumnScaling::Raw, ColumnScaling::UnitNorm, ColumnScaling::Given(spread.clone())]
            {
                for prior in [false, true] {
                    let criterion = Criterion { measure: measure.clone(), scaling: scaling.clone() };
                    let weights = numbers(&case["joint_weights"]);
                    let mut problem = problem(name, weights, criterion, 40).unwrap();
                    problem.sign_width = 0.1;
                    if prior {
                        // Information of another motion, so that the smallest singular values are not its own.
                        let other: Vec<Vec<f64>> =
                            coefficients.iter().map(|r| r.iter().map(|x| 0.7 * x + 0.01).collect()).collect();
                        problem.prior = Some(information(&problem, &other, 50));
                    }
                    let (_, gradient) = criterion_gradient(&problem, &coefficients, 40).unwrap();
                    let largest = gradient.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
                    for (joint, k) in [(0, 1), (1, 0), (1, 7), (2, 3), (2, 10)] {
                        let found = gradient[joint][k];
                        let wanted = difference(&problem, &coefficients, joint, k, 40);
                        assert!(
                            (found - wanted).abs() <= 1e-6 * largest,
                            "{name} {measure:?} {scaling:?} prior {prior}: {found} against {wanted} of {largest}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn criteria_of_files_and_slides_agree_with_differences() {
    let mut problems = vec![problems::gantry()];
    problems.extend(problems::ur10(false));
    for mut problem in problems {
        let columns = problem.model.columns().len();
        problem.sign_width = 0.3;
        let coefficients: Vec<Vec<f64>> = (0..problem.limits.len())
            .map(|j| (0..11).map(|k| 0.4 * ((3 * j + 2 * k) as f64).sin()).collect())
            .collect();
        for measure in [Measure::Condition, Measure::Determinant, Measure::Trace(vec![1.0; columns])] {
            problem.criterion = Criterion::unit_norm(measure.clone());
            let (_, gradient) = criterion_gradient(&problem, &coefficients, 60).unwrap();
            let largest = gradient.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (joint, k) in [(0, 1), (1, 0), (1, 7), (2, 3), (3, 10)] {
                let wanted = difference(&problem, &coefficients, joint, k, 60);
                let found = gradient[joint][k];
                assert!((found - wanted).abs() <= 1e-6 * largest, "{measure:?}: {found} {wanted} {largest}");
            }
        }
    }
}
