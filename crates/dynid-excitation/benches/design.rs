//! Time of one value and gradient per criterion, and of whole starts.

#![expect(clippy::unwrap_used, reason = "the bench's robots are sound")]

#[path = "../tests/all/plain_urdf/mod.rs"]
mod plain_urdf;
#[path = "../tests/all/problems/mod.rs"]
mod problems;
#[path = "../tests/all/support/mod.rs"]
mod support;

use divan::{Bencher, black_box};
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;

fn main() {
    divan::main();
}

const CRITERIA: [&str; 5] = ["cond", "E", "D", "A", "cond, unit norm"];

/// Value and gradient on 100 samples of Indy7's 58 columns.
#[divan::bench(args = CRITERIA)]
fn value_and_gradient(bencher: Bencher<'_, '_>, name: &str) {
    let Some(mut problem) = problems::indy7(false) else { return };
    problem.criterion = match name {
        "cond" => Criterion::raw(Measure::Condition),
        "E" => Criterion::raw(Measure::Smallest),
        "D" => Criterion::raw(Measure::Determinant),
        "A" => Criterion::raw(Measure::Trace(vec![1.0; problem.model.columns().len()])),
        _ => Criterion::unit_norm(Measure::Condition),
    };
    let coefficients: Vec<Vec<f64>> =
        (0..6).map(|j| (0..11).map(|k| 0.2 * ((3 * j + 2 * k) as f64).sin()).collect()).collect();
    bencher.bench_local(|| criterion_gradient(&problem, black_box(&coefficients), 100).unwrap().0);
}

/// One start, restoration included.
#[divan::bench(args = ["indy7", "indy7 at rest", "er16, 15", "er16, 24", "ur10", "ur10, capsules"], sample_count = 5)]
fn one_start(bencher: Bencher<'_, '_>, name: &str) {
    let problem = match name {
        "indy7" => problems::indy7(false),
        "indy7 at rest" => problems::indy7(true),
        "er16, 15" => problems::er16(false),
        "er16, 24" => problems::er16(true),
        "ur10" => problems::ur10(false),
        _ => problems::ur10(true),
    };
    let Some(problem) = problem else { return };
    let settings = Settings { starts: 1, ..Settings::default() };
    bencher.bench_local(|| design(&problem, &settings, Vec::new(), &mut |_| {}).unwrap());
}
