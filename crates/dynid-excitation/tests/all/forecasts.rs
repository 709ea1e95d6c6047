//! What a design promises, against random motion.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::problems;
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;
use dynid_linalg::Mat;

fn best(problem: &Problem, starts: usize) -> Design {
    let settings = Settings { starts, ..Settings::default() };
    let outcome = design(problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    found
}

/// `C = diag(1/max(|β|, β_floor)²)`.
fn relative(problem: &Problem) -> Measure {
    let nominal: Vec<f64> = problem.model.columns().iter().map(|c| c.nominal.unwrap()).collect();
    let mut sorted: Vec<f64> = nominal.iter().map(|x| x.abs()).collect();
    sorted.sort_by(f64::total_cmp);
    let floor = 0.1 * sorted[sorted.len() / 2];
    Measure::Trace(nominal.iter().map(|x| x.abs().max(floor).powi(-2)).collect())
}

#[test]
fn designs_for_standard_deviations_see_three_times_as_much_as_random_motion() {
    let columns = 58;
    let Some(problem) = problems::indy7_weighted(Measure::Trace(vec![1.0; columns])) else { return };
    let found = best(&problem, 4);
    let forecast = forecast(&problem, &found.coefficients, 1000).unwrap();
    let random = forecast.random.unwrap();
    println!("A-optimal: {random:?}, cond {:.1}", forecast.condition);
    assert_eq!(random.trajectories, 10);
    assert!(random.mean_ratio >= 3.0, "{random:?}");
    for start in &found.starts {
        assert!(start.is_feasible());
    }
}

/// Rows of the results' table: one criterion each, best of 4 starts.
#[test]
#[ignore = "half a minute: the table of criteria"]
fn table_of_criteria() {
    let Some(problem) = problems::indy7_weighted(Measure::Condition) else { return };
    let columns = problem.model.columns().len();
    let criteria = [
        ("D", Criterion::raw(Measure::Determinant)),
        ("A", Criterion::raw(Measure::Trace(vec![1.0; columns]))),
        ("E", Criterion::raw(Measure::Smallest)),
        ("cond", Criterion::raw(Measure::Condition)),
        ("cond, unit norm", Criterion::unit_norm(Measure::Condition)),
        ("relative std", Criterion::raw(relative(&problem))),
    ];
    println!("criterion | cond | cond unit norm | mean ratio | geometric | median relative std");
    for (name, criterion) in criteria {
        let mut problem = problems::indy7_weighted(Measure::Condition).unwrap();
        problem.criterion = criterion;
        let begun = std::time::Instant::now();
        let found = best(&problem, 4);
        let seconds = begun.elapsed().as_secs_f64();
        let forecast = forecast(&problem, &found.coefficients, 1000).unwrap();
        let random = forecast.random.unwrap();
        let mut sorted: Vec<f64> = forecast.columns.iter().filter_map(|c| c.relative_std).collect();
        sorted.sort_by(f64::total_cmp);
        let spread: Vec<String> =
            found.starts.iter().map(|s| format!("{:.3}", s.criterion.unwrap())).collect();
        let evaluations: usize = found.starts.iter().map(|s| s.evaluations).sum();
        println!(
            "{name} | {:.1} | {:.1} | {:.2} | {:.2} | {:.4} | values {spread:?} {} ev, {seconds:.1} s",
            forecast.condition,
            forecast.condition_unit_norm,
            random.mean_ratio,
            random.geometric_ratio,
            sorted[sorted.len() / 2],
            evaluations / 4,
        );
    }
}

#[test]
fn standard_deviations_are_those_of_the_covariance() {
    let problem = problems::gantry();
    let found = best(&problem, 1);
    let forecast = forecast(&problem, &found.coefficients, 500).unwrap();
    // Independently: inverse of the information by a general solver.
    let triangle = information(&problem, &found.coefficients, 500);
    let gram = triangle.transpose() * &triangle;
    let n = gram.nrows();
    let covariance = gram.cholesky().unwrap().solve(&Mat::identity(n, n));
    for (k, column) in forecast.columns.iter().enumerate() {
        let wanted = covariance[(k, k)].sqrt();
        assert!((column.std / wanted - 1.0).abs() < 1e-8, "{}: {} {wanted}", column.name, column.std);
        let nominal = column.nominal.unwrap();
        assert_eq!(column.relative_std, (nominal != 0.0).then(|| column.std / nominal.abs()));
    }
    for pair in &forecast.confounded {
        let [a, b] = [0, 1].map(|k| forecast.columns.iter().position(|c| c.name == pair.names[k]).unwrap());
        let wanted = covariance[(a, b)] / (covariance[(a, a)] * covariance[(b, b)]).sqrt();
        assert!(pair.correlation.abs() > 0.95 && (pair.correlation - wanted).abs() < 1e-8);
    }
    let share: f64 = forecast.weakest.iter().map(|w| w.1).sum();
    assert!((0.9..=1.0 + 1e-12).contains(&share));
    let (first, last) = forecast.singular_values;
    assert!((forecast.condition - first / last).abs() < 1e-9 * forecast.condition);
    // More samples with as much information each: deviations shrink with their root.
    let mut longer = problems::gantry();
    longer.effective_samples *= 4.0;
    let more = dynid_excitation::forecast(&longer, &found.coefficients, 500).unwrap();
    for (a, b) in forecast.columns.iter().zip(&more.columns) {
        assert!((a.std / b.std - 2.0).abs() < 1e-9);
    }
}
