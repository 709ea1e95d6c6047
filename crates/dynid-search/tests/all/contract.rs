//! What all searches promise: counts, bounds, the same bits, refusals.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use dynid_search::{
    Algorithm, BeeColony, Bounds, BoundsError, Checkpoint, CheckpointError, Objective, PatternSearch,
    PointObjective, Progress, SearchError, SearchResult, Settings, Status, many, resume, run,
};

const D: usize = 6;

fn valley(x: &[f64]) -> f64 {
    x.windows(2).map(|w| 10.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).abs()).sum()
}

fn objective() -> PointObjective<fn(&[f64]) -> f64> {
    PointObjective::new(D, valley)
}

fn bounds() -> Bounds {
    Bounds::new(vec![-3.0, -3.0, 0.1, -3.0, 0.1, 2.0], vec![3.0, 4.0, 3.0, 3.0, 5.0, 2.0])
        .unwrap()
        .with_logarithmic(&[2, 4])
        .unwrap()
}

/// Observes nothing.
fn quiet(_: &Progress<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn algorithm(name: &str) -> Algorithm {
    name.parse().unwrap()
}

fn go(name: &str, settings: &Settings) -> Result<SearchResult, SearchError> {
    run(&algorithm(name), &objective(), &bounds(), settings, &mut quiet)
}

/// Counts evaluations and points outside of the bounds.
struct Watched {
    bounds: Bounds,
    evaluations: AtomicU64,
    outside: AtomicBool,
}

impl Objective for Watched {
    fn dimensions(&self) -> usize {
        D
    }
    fn evaluate(&self, candidates: &[f64], values: &mut [f64]) {
        assert_eq!(candidates.len(), D * values.len());
        self.evaluations.fetch_add(values.len() as u64, Ordering::Relaxed);
        for (x, value) in candidates.chunks_exact(D).zip(values) {
            if !self.bounds.contain(x) {
                self.outside.store(true, Ordering::Relaxed);
            }
            // Downhill towards a corner, so that bounds are pushed against.
            *value = x.iter().sum::<f64>() + (3.0 * x[0]).sin();
        }
    }
}

#[test]
fn counts_are_exact_and_bounds_are_kept() {
    for name in Algorithm::NAMES {
        for evaluations in [1, 7, 333, 5000] {
            let watched =
                Watched { bounds: bounds(), evaluations: 0.into(), outside: AtomicBool::new(false) };
            let settings = Settings { evaluations: Some(evaluations), ..Settings::default() };
            let result = run(&algorithm(name), &watched, &bounds(), &settings, &mut quiet).unwrap();
            assert_eq!(result.evaluations, watched.evaluations.into_inner(), "{name}");
            assert!(!watched.outside.into_inner(), "{name} left the bounds");
            assert!(result.evaluations <= evaluations, "{name}");
            if result.status == Status::BudgetUsed {
                assert_eq!(result.evaluations, evaluations, "{name}");
            }
            assert!(bounds().contain(&result.point), "{name}: {:?}", result.point);
        }
    }
}

#[test]
fn published_budgets_are_those_of_the_papers() {
    for name in ["cs", "ics"] {
        assert_eq!(go(name, &Settings::default()).unwrap().evaluations, 10_025, "{name}");
    }
    assert_eq!(go("pso", &Settings::default()).unwrap().evaluations, 25 * 201);
    // Scouts come on top of 100 + 200 · 200; with a limit that is never reached there are none.
    let patient = Algorithm::BeeColony(BeeColony { trial_limit: Some(1_000_000), ..BeeColony::published() });
    let result = run(&patient, &objective(), &bounds(), &Settings::default(), &mut quiet);
    assert_eq!(result.unwrap().evaluations, 40_100);
    assert!(go("abc", &Settings::default()).unwrap().evaluations >= 40_100);
    let hasty = Algorithm::BeeColony(BeeColony { trial_limit: Some(5), ..BeeColony::published() });
    let result = run(&hasty, &objective(), &bounds(), &Settings::default(), &mut quiet);
    assert!(result.unwrap().evaluations > 40_100);
    let pattern = go("gps", &Settings::default()).unwrap();
    assert!(pattern.evaluations <= 2000 * D as u64 && pattern.iterations <= 100 * D as u64);
}

#[test]
fn histories_fall_and_stay_short() {
    for name in Algorithm::NAMES {
        for history in [2, 10, 500] {
            let settings = Settings { history, evaluations: Some(4000), ..Settings::default() };
            let result = go(name, &settings).unwrap();
            let points = &result.history;
            assert!(points.len() <= history + 1, "{name}: {}", points.len());
            assert!(points.windows(2).all(|p| p[0].evaluations < p[1].evaluations), "{name}");
            assert!(points.windows(2).all(|p| p[0].value >= p[1].value), "{name}");
            let last = points.last().unwrap();
            assert_eq!((last.evaluations, last.value), (result.evaluations, result.value), "{name}");
        }
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let seeds: Vec<u64> = (10..19).collect();
    let settings = Settings { evaluations: Some(2000), ..Settings::default() };
    for name in Algorithm::NAMES {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let objective = objective().in_parallel();
            pool.install(|| many(&algorithm(name), &objective, &bounds(), &settings, &seeds).unwrap())
        };
        let one = on(1);
        assert_eq!(one, on(2), "{name}");
        assert_eq!(one, on(7), "{name}");
        for (seed, result) in seeds.iter().zip(&one) {
            let alone = go(name, &Settings { seed: *seed, ..settings.clone() }).unwrap();
            assert_eq!(*result, alone, "{name}, seed {seed}");
        }
        if name != "gps" {
            assert_ne!(one[0].point, one[1].point, "{name}: seeds matter");
        }
    }
}

/// Saves after the given iteration and stops there.
fn save(name: &str, settings: &Settings, after: u64) -> (Checkpoint, SearchResult) {
    let mut saved = None;
    let result = run(&algorithm(name), &objective(), &bounds(), settings, &mut |progress| {
        if progress.iteration < after {
            return ControlFlow::Continue(());
        }
        saved = Some(progress.checkpoint());
        ControlFlow::Break(())
    });
    (saved.unwrap(), result.unwrap())
}

#[test]
fn a_resumed_run_has_the_bits_of_an_uninterrupted_one() {
    // CMA-ES restarts several times within this budget.
    let settings = Settings { evaluations: Some(20_000), history: 20, seed: 3, ..Settings::default() };
    for name in Algorithm::NAMES {
        let whole = go(name, &settings).unwrap();
        for after in [1, 13, whole.iterations / 2] {
            let (saved, stopped) = save(name, &settings, after);
            assert_eq!((stopped.status, stopped.iterations), (Status::Stopped, after), "{name}");
            let rest = resume(&algorithm(name), &objective(), &bounds(), &settings, &saved, &mut quiet);
            assert_eq!(rest.unwrap(), whole, "{name} after {after} of {}", whole.iterations);
        }
    }
}

#[test]
fn a_longer_run_begins_as_the_shorter_one() {
    for name in Algorithm::NAMES {
        let short = go(name, &Settings { iterations: Some(20), ..Settings::default() }).unwrap();
        let mut at = None;
        let long = Settings { iterations: Some(60), ..Settings::default() };
        run(&algorithm(name), &objective(), &bounds(), &long, &mut |progress| {
            if progress.iteration == 20 {
                at = Some((progress.point.unwrap().to_vec(), progress.value, progress.evaluations));
            }
            ControlFlow::Continue(())
        })
        .unwrap();
        assert_eq!(at.unwrap(), (short.point, short.value, short.evaluations), "{name}");
    }
}

#[test]
fn foreign_and_damaged_checkpoints_are_refused() {
    let settings = Settings { evaluations: Some(2000), ..Settings::default() };
    for name in Algorithm::NAMES {
        let (saved, _) = save(name, &settings, 5);
        let from = |saved: &Checkpoint, settings: &Settings, bounds: &Bounds| {
            let result = resume(&algorithm(name), &objective(), bounds, settings, saved, &mut quiet);
            match result {
                Err(SearchError::Checkpoint(error)) => error,
                other => panic!("{name}: {other:?}"),
            }
        };
        let shorter = Checkpoint { words: saved.words[..saved.words.len() - 1].to_vec(), ..saved.clone() };
        let longer = Checkpoint { words: [&saved.words[..], &[0]].concat(), ..saved.clone() };
        for damaged in [shorter, longer] {
            assert_eq!(from(&damaged, &settings, &bounds()), CheckpointError::Damaged, "{name}");
        }
        let seeded = Settings { seed: 8, ..settings.clone() };
        assert_eq!(from(&saved, &seeded, &bounds()), CheckpointError::Seed { expected: 8, found: 1 });
        let wider = Bounds::new(vec![-9.0; D], vec![9.0; D]).unwrap();
        assert_eq!(from(&saved, &settings, &wider), CheckpointError::Bounds);
        let crowd = Settings { population: Some(31), ..settings.clone() };
        assert!(matches!(from(&saved, &crowd, &bounds()), CheckpointError::Algorithm { .. }));
    }
}

#[test]
fn every_word_of_a_checkpoint_may_be_garbage() {
    let settings = Settings { evaluations: Some(3000), ..Settings::default() };
    for name in Algorithm::NAMES {
        let (saved, _) = save(name, &settings, 4);
        for garbage in [u64::MAX, 1 << 40] {
            for place in 0..saved.words.len().min(400) {
                let mut words = saved.words.clone();
                words[place] = garbage;
                let damaged = Checkpoint { words, ..saved.clone() };
                // Either refused or a run from another state, but never a panic.
                let _ = resume(&algorithm(name), &objective(), &bounds(), &settings, &damaged, &mut |_| {
                    ControlFlow::Break(())
                });
            }
        }
    }
}

#[test]
fn a_start_point_is_used() {
    let start = vec![1.0, 1.0, 1.0, 1.0, 1.0, 2.0];
    let value = valley(&start);
    for name in Algorithm::NAMES {
        let settings = Settings { start: Some(start.clone()), evaluations: Some(300), ..Settings::default() };
        let result = go(name, &settings).unwrap();
        if name != "cma-es" {
            assert!(result.value <= value + 1e-12, "{name}: {} {value}", result.value);
        }
    }
}

#[test]
fn bad_bounds_are_refused_with_their_index() {
    let new = |lower: &[f64], upper: &[f64]| Bounds::new(lower.to_vec(), upper.to_vec()).unwrap_err();
    assert_eq!(new(&[], &[]), BoundsError::Empty);
    assert_eq!(new(&[0.0, 1.0], &[1.0]), BoundsError::Length { lower: 2, upper: 1 });
    assert_eq!(new(&[0.0, 2.0], &[1.0, 1.0]), BoundsError::Reversed { index: 1, lower: 2.0, upper: 1.0 });
    assert!(matches!(new(&[0.0, 0.0], &[1.0, f64::NAN]), BoundsError::NotFinite { index: 1, .. }));
    assert!(matches!(new(&[f64::INFINITY], &[f64::INFINITY]), BoundsError::NotFinite { index: 0, .. }));
    assert!(matches!(new(&[-1e308], &[1e308]), BoundsError::NotFinite { index: 0, .. }));
    let bounds = Bounds::new(vec![0.0, -1.0], vec![1.0, 1.0]).unwrap();
    let error = bounds.clone().with_logarithmic(&[1]).unwrap_err();
    assert_eq!(error, BoundsError::NotPositive { index: 1, lower: -1.0 });
    let error = bounds.with_logarithmic(&[2]).unwrap_err();
    assert_eq!(error, BoundsError::NoSuchCoordinate { index: 2, dimensions: 2 });
}

#[test]
fn bad_settings_are_refused() {
    for (name, settings, part) in [
        ("cs", Settings { iterations: Some(0), ..Settings::default() }, "0 iterations"),
        ("de", Settings { evaluations: Some(0), ..Settings::default() }, "0 evaluations"),
        ("de", Settings { target: Some(f64::NAN), ..Settings::default() }, "target"),
        ("de", Settings { population: Some(3), ..Settings::default() }, "at least 4, found 3"),
        ("pso", Settings { population: Some(0), ..Settings::default() }, "at least 1, found 0"),
        ("gps", Settings { start: Some(vec![1.0; 2]), ..Settings::default() }, "2 coordinates, expected 6"),
        ("gps", Settings { start: Some(vec![f64::NAN; D]), ..Settings::default() }, "coordinate 0"),
        ("ics", Settings { start: Some(vec![2.5; D]), ..Settings::default() }, "coordinate 5"),
    ] {
        let message = go(name, &settings).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    let error = "tabu".parse::<Algorithm>().unwrap_err().to_string();
    assert!(error.contains("`tabu`") && Algorithm::NAMES.iter().all(|n| error.contains(n)), "{error}");
    let odd = Algorithm::BeeColony(BeeColony { acceleration: f64::NAN, ..BeeColony::published() });
    let error = run(&odd, &objective(), &bounds(), &Settings::default(), &mut quiet).unwrap_err();
    assert!(error.to_string().contains("acceleration is NaN"), "{error}");
    let narrow_mesh =
        Algorithm::PatternSearch(PatternSearch { largest_mesh: 0.5, ..PatternSearch::default() });
    let error = run(&narrow_mesh, &objective(), &bounds(), &Settings::default(), &mut quiet).unwrap_err();
    assert!(error.to_string().contains("largest_mesh is 0.5, expected the first mesh or more"), "{error}");
    let narrow = Bounds::new(vec![0.0], vec![1.0]).unwrap();
    let error = run(&algorithm("cs"), &objective(), &narrow, &Settings::default(), &mut quiet).unwrap_err();
    assert_eq!(error, SearchError::Dimensions { expected: D, found: 1 });
    let nowhere = PointObjective::new(D, |_: &[f64]| f64::NAN);
    for name in Algorithm::NAMES {
        let settings = Settings { evaluations: Some(500), ..Settings::default() };
        let error = run(&algorithm(name), &nowhere, &bounds(), &settings, &mut quiet).unwrap_err();
        assert!(matches!(error, SearchError::NowhereFinite { .. }), "{name}: {error}");
    }
}

#[test]
fn only_pattern_search_with_a_start_goes_without_a_box() {
    let open = Bounds::new(vec![0.0; D], vec![f64::INFINITY; D]).unwrap();
    for name in Algorithm::NAMES {
        let error = run(&algorithm(name), &objective(), &open, &Settings::default(), &mut quiet).unwrap_err();
        assert!(matches!(error, SearchError::Unbounded { index: 0, .. }), "{name}");
    }
    let settings = Settings { start: Some(vec![2.0; D]), ..Settings::default() };
    let result = run(&algorithm("gps"), &objective(), &open, &settings, &mut quiet).unwrap();
    assert!(result.value < valley(&[2.0; D]));
    // Downhill without end: the mesh grows until steps are no numbers, and the search ends all the same.
    let falling = PointObjective::new(1, |x: &[f64]| -x[0].ln_1p());
    let open = Bounds::new(vec![0.0], vec![f64::INFINITY]).unwrap();
    let settings = Settings { start: Some(vec![1.0]), iterations: Some(5000), ..Settings::default() };
    assert!(run(&algorithm("gps"), &falling, &open, &settings, &mut quiet).unwrap().value < -600.0);
}
