//! All starts of the acceptance table, with what they cost. Run by hand:
//! `cargo test --release -p dynid-excitation --test all statistics:: -- --ignored --nocapture --test-threads 1`.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests outside of test functions")]

use std::time::Instant;

use crate::problems;
use dynid_excitation::*;

/// Runs `starts` starts, prints them, checks every limit of every start at 10 000 and 100 000 instants.
fn run(name: &str, problem: &Problem, starts: usize) -> Vec<f64> {
    let settings = Settings { starts, ..Settings::default() };
    let begun = Instant::now();
    let outcome = design(problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let seconds = begun.elapsed().as_secs_f64();
    let Outcome::Found(found) = outcome else { panic!("{name}: {outcome:?}") };
    assert_eq!(found.starts.len(), starts, "{name}: starts without an end");
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    let mut excess = [f64::NEG_INFINITY; 3];
    let mut values = Vec::new();
    for start in &found.starts {
        let coefficients = map.coefficients(&start.unknowns);
        excess[0] = excess[0].max(start.excess);
        for (k, samples) in [10_000, 100_000].into_iter().enumerate() {
            let worst = limit_points(problem, &coefficients, samples, f64::NEG_INFINITY);
            excess[k + 1] = excess[k + 1].max(worst[0].excess);
        }
        values.push(if start.is_feasible() { start.criterion.unwrap().exp() } else { f64::INFINITY });
    }
    let evaluations: usize = found.starts.iter().map(|s| s.evaluations).sum();
    let mut sorted = values.clone();
    sorted.sort_by(f64::total_cmp);
    println!(
        "{name:24} {starts:3} starts: best {:8.2} median {:8.2} worst {:8.2}; {:4} evaluations, {:.2} s each; excess {:+.1e} {:+.1e} {:+.1e}; scaled {}",
        sorted[0],
        sorted[starts / 2],
        sorted[starts - 1],
        evaluations / starts,
        seconds * rayon::current_num_threads() as f64 / starts as f64,
        excess[0],
        excess[1],
        excess[2],
        found.starts.iter().filter(|s| s.share < 1.0).count(),
    );
    assert!(excess[1] <= 1e-6 && excess[2] <= 1e-6, "{name}: {excess:?}");
    values
}

/// The bounds of the acceptance table: best of all starts, every start.
fn require(values: &[f64], best: f64, worst: f64) {
    let found = values.iter().fold((f64::INFINITY, 0.0_f64), |(b, w), x| (b.min(*x), w.max(*x)));
    assert!(found.0 <= best && found.1 <= worst, "{found:?}, required {best} and {worst}");
}

#[test]
#[ignore = "half a minute of two cores: every start of every problem; the ordinary run takes a few of each"]
fn acceptance_table() {
    if let Some(problem) = problems::indy7(false) {
        require(&run("indy7, 58", &problem, 16), 28.0, 31.5);
    }
    if let Some(problem) = problems::indy7(true) {
        run("indy7, 58, at rest", &problem, 16);
    }
    if let Some(problem) = problems::er16(false) {
        require(&run("er16, 15", &problem, 16), 30.5, 34.0);
    }
    if let Some(problem) = problems::er16(true) {
        require(&run("er16, 24", &problem, 16), 65.0, f64::INFINITY);
    }
    if let Some(problem) = problems::ur10(false) {
        let values = run("ur10, 36", &problem, 20);
        assert_eq!(values.len(), 20);
        require(&values, 16.0, 20.0);
    }
    if let Some(problem) = problems::ur10(true) {
        run("ur10, 36, capsules", &problem, 20);
    }
    run("gantry", &problems::gantry(), 16);
    let mut still = problems::gantry();
    still.start = StartConditions { rest: true, zero_jerk: true, pose: Some(vec![0.1, 0.1, 0.2, -0.3]) };
    run("gantry, rest, jerk, pose", &still, 16);
}
