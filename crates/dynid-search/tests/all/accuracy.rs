//! Every search on functions with known minima.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::ops::ControlFlow;

use dynid_search::{Algorithm, Bounds, PointObjective, Progress, SearchResult, Settings, Status, many, run};

const SEEDS: [u64; 5] = [1, 2, 3, 4, 5];

/// `Σ (x_i - 0.3)²`, minimum 0 off the middle of any symmetric box.
fn bowl(x: &[f64]) -> f64 {
    x.iter().map(|x| (x - 0.3).powi(2)).sum()
}

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
}

fn rastrigin(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x - 10.0 * (std::f64::consts::TAU * x).cos() + 10.0).sum()
}

/// Axes of lengths 1 to 1000, turned by 1 rad in every plane of neighbours.
fn turned_ellipsoid(x: &[f64]) -> f64 {
    let mut y = x.to_vec();
    let (sin, cos) = 1.0_f64.sin_cos();
    for i in 1..y.len() {
        (y[i - 1], y[i]) = (cos * y[i - 1] - sin * y[i], sin * y[i - 1] + cos * y[i]);
    }
    let last = (y.len() - 1) as f64;
    y.iter().enumerate().map(|(i, y)| 1e6_f64.powf(i as f64 / last) * y * y).sum()
}

/// Observes nothing.
fn quiet(_: &Progress<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn runs(name: &str, dimensions: usize, f: fn(&[f64]) -> f64, settings: &Settings) -> Vec<SearchResult> {
    let algorithm: Algorithm = name.parse().unwrap();
    let bounds = Bounds::new(vec![-5.0; dimensions], vec![5.0; dimensions]).unwrap();
    many(&algorithm, &PointObjective::new(dimensions, f), &bounds, settings, &SEEDS).unwrap()
}

#[track_caller]
fn check(name: &str, dimensions: usize, f: fn(&[f64]) -> f64, settings: &Settings, most: f64) {
    let worst = runs(name, dimensions, f, settings).iter().fold(0.0_f64, |m, r| m.max(r.value));
    assert!(worst <= most, "{name}: {worst:e} > {most:e}");
}

/// Default budgets: 200 iterations of the published settings, 10 000 d evaluations of the others.
#[test]
fn every_algorithm_finds_the_bottom_of_a_bowl() {
    let settings = Settings::default();
    for (name, most) in [
        ("abc", 1e-6),
        ("abc-general", 1e-12),
        ("cs", 1e-6),
        ("ics", 1e-2),
        ("pso-general", 1e-12),
        ("gps", 1e-10),
        ("cma-es", 1e-12),
        ("de", 1e-12),
    ] {
        check(name, 5, bowl, &settings, most);
    }
    // Its velocities die out before it gets there, whatever the budget: the stall of the published settings.
    let stalled = runs("pso", 5, bowl, &settings);
    assert!(stalled.iter().all(|r| (1e-6..5.0).contains(&r.value)), "{stalled:?}");
}

#[test]
fn adaptive_algorithms_follow_a_curved_valley() {
    let settings = Settings { target: Some(1e-9), ..Settings::default() };
    check("cma-es", 6, rosenbrock, &settings, 1e-9);
    check("de", 6, rosenbrock, &settings, 1e-9);
}

#[test]
fn adaptive_algorithms_stretch_along_turned_axes() {
    let settings = Settings { target: Some(1e-9), ..Settings::default() };
    check("cma-es", 8, turned_ellipsoid, &settings, 1e-9);
    check("de", 8, turned_ellipsoid, &settings, 1e-9);
}

#[test]
fn many_minima_are_passed() {
    let settings = Settings { target: Some(1e-8), ..Settings::default() };
    for name in ["abc-general", "cma-es", "de"] {
        check(name, 5, rastrigin, &settings, 1e-8);
    }
}

/// The minimum of `Σ (x_i - 7)²` within ±5 is the corner.
#[test]
fn minima_outside_of_the_box_are_found_on_its_bound() {
    let corner: fn(&[f64]) -> f64 = |x| x.iter().map(|x| (x - 7.0).powi(2)).sum();
    for name in ["abc", "abc-general", "cs", "pso-general", "gps", "cma-es", "de"] {
        for result in runs(name, 4, corner, &Settings::default()) {
            assert!(result.value <= 16.0 + 1e-6, "{name}: {result:?}");
        }
    }
}

/// `|ln x - ln 0.001|` over nine decades.
#[test]
fn logarithmic_coordinates_see_decades() {
    let bounds = Bounds::new(vec![1e-6; 3], vec![1e3; 3]).unwrap().with_logarithmic(&[0, 1, 2]).unwrap();
    let objective =
        PointObjective::new(3, |x: &[f64]| x.iter().map(|x| (x.ln() - 1e-3_f64.ln()).abs()).sum());
    for name in ["cma-es", "de", "pso-general", "gps"] {
        let algorithm: Algorithm = name.parse().unwrap();
        for result in many(&algorithm, &objective, &bounds, &Settings::default(), &SEEDS).unwrap() {
            assert!(result.point.iter().all(|x| (x / 1e-3 - 1.0).abs() < 1e-4), "{name}: {result:?}");
        }
    }
}

/// Half spaces of NaN and of infinities around a bowl whose bottom is on the edge to them.
#[test]
fn regions_without_values_are_avoided_and_counted() {
    let objective = PointObjective::new(4, |x: &[f64]| match () {
        () if x[0] < 0.3 => f64::NAN,
        () if x[1] < -2.0 => f64::NEG_INFINITY,
        () if x[2] < -2.0 => f64::INFINITY,
        () => bowl(x),
    });
    let bounds = Bounds::new(vec![-5.0; 4], vec![5.0; 4]).unwrap();
    for name in Algorithm::NAMES {
        let settings = Settings { start: Some(vec![1.0; 4]), ..Settings::default() };
        let algorithm: Algorithm = name.parse().unwrap();
        let result = run(&algorithm, &objective, &bounds, &settings, &mut quiet).unwrap();
        assert!(result.value.is_finite() && result.point[0] >= 0.3, "{name}");
        assert!(0 < result.not_finite && result.not_finite < result.evaluations, "{name}");
        assert!(result.history.iter().all(|p| p.value.is_finite()), "{name}");
        if name != "pso" {
            assert!(result.value < 0.05, "{name}: {}", result.value);
        }
    }
}

#[test]
fn ends_are_told_apart() {
    let end = |name: &str, settings: Settings| {
        let statuses: Vec<Status> = runs(name, 3, bowl, &settings).iter().map(|r| r.status).collect();
        assert!(statuses.iter().all(|s| *s == statuses[0]), "{statuses:?}");
        statuses[0]
    };
    let few = Settings { iterations: Some(3), ..Settings::default() };
    let low = Settings { target: Some(1e-4), ..Settings::default() };
    let patient = Settings { stall: Some(30), iterations: Some(100_000), ..Settings::default() };
    for name in Algorithm::NAMES {
        assert_eq!(end(name, few.clone()), Status::BudgetUsed, "{name}");
    }
    for name in ["abc", "cs", "pso-general", "gps", "cma-es", "de"] {
        assert_eq!(end(name, low.clone()), Status::TargetReached, "{name}");
    }
    assert_eq!(end("pso", patient), Status::Stalled);
    assert_eq!(end("gps", Settings::default()), Status::Converged);
    assert_eq!(end("de", Settings::default()), Status::Converged);
    let once = Algorithm::CmaEs(dynid_search::CmaEs { restarts: 0, ..Default::default() });
    let bounds = Bounds::new(vec![-5.0; 3], vec![5.0; 3]).unwrap();
    let objective = PointObjective::new(3, bowl);
    let result = run(&once, &objective, &bounds, &Settings::default(), &mut quiet);
    assert_eq!(result.unwrap().status, Status::Converged);
}
