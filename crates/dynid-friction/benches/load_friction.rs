//! Friction that follows reactions: `cargo bench -p dynid-estimate --bench load_friction`.
//!
//! Three drives of 1000 samples with 17 parameters, the planar machine of Rosyid & El-Khasawneh 2020.
#![expect(clippy::unwrap_used, reason = "a benchmark that fails should stop")]

#[path = "../tests/all/prr3_machine/mod.rs"]
mod prr3_machine;

use divan::Bencher;
use dynid_friction::load_friction::{FitSettings, Model, SquaredResiduals, fit_bounded, fit_separated};
use dynid_search::{self as search, Algorithm, Objective};
use prr3_machine::{bounds, experiment, start};
use std::ops::ControlFlow;

const MODELS: [Model; 3] = [Model::Stribeck, Model::CoulombViscous, Model::Constant];

fn main() {
    divan::main();
}

/// 34,000 evaluations, one after the other.
#[divan::bench(args = MODELS, sample_count = 3)]
fn pattern_search(bencher: Bencher<'_, '_>, model: Model) {
    let problem = experiment(model, 2.0, 1);
    let (objective, bounds) = (SquaredResiduals::new(&problem), bounds());
    let settings = search::Settings { start: Some(start()), ..search::Settings::default() };
    let algorithm: Algorithm = "gps".parse().unwrap();
    bencher.bench_local(|| {
        let found =
            search::run(&algorithm, &objective, &bounds, &settings, &mut |_| ControlFlow::Continue(()));
        found.unwrap().value
    });
}

/// 1024 candidates at once, each with its own Stribeck speed.
#[divan::bench(args = MODELS, sample_count = 10)]
fn group_of_candidates(bencher: Bencher<'_, '_>, model: Model) {
    let problem = experiment(model, 2.0, 1);
    let objective = SquaredResiduals::new(&problem);
    let start = start();
    let shifted = |i: usize| start.iter().map(move |x| x * (1.0 + 1e-4 * i as f64)).collect::<Vec<_>>();
    let candidates: Vec<f64> = (0..1024).flat_map(shifted).collect();
    let mut values = vec![0.0; 1024];
    bencher.bench_local(|| objective.evaluate(&candidates, &mut values));
}

#[divan::bench(args = MODELS, sample_count = 10)]
fn bounded_fit(bencher: Bencher<'_, '_>, model: Model) {
    let (problem, bounds, start) = (experiment(model, 2.0, 1), bounds(), start());
    bencher.bench_local(|| fit_bounded(&problem, &bounds, &start, &FitSettings::default()).unwrap());
}

#[divan::bench(args = MODELS, sample_count = 10)]
fn separated_fit(bencher: Bencher<'_, '_>, model: Model) {
    let (problem, bounds, start) = (experiment(model, 2.0, 1), bounds(), start());
    bencher.bench_local(|| fit_separated(&problem, &bounds, &start, &FitSettings::default()).unwrap());
}
