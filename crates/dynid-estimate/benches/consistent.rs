//! Consistent estimates of reduced problems: `cargo bench -p dynid-estimate --bench consistent`.
#![expect(clippy::unwrap_used, reason = "a benchmark that fails should stop")]

#[path = "../tests/all/random_problem/mod.rs"]
mod random_problem;

use divan::Bencher;
use dynid_estimate::consistent::{Form, Settings, estimate};
use random_problem::random_problem;

fn main() {
    divan::main();
}

/// Solves twenty problems of one size; the figure is for all twenty.
fn solve(bencher: Bencher<'_, '_>, links: usize, form: Form) {
    let problems: Vec<_> = (0..20).map(|seed| random_problem(seed, Some(links)).0).collect();
    let settings = Settings { form, ..Settings::default() };
    bencher.bench(|| problems.iter().map(|p| estimate(p, &settings).unwrap().iterations).sum::<usize>());
}

#[divan::bench(args = [1, 7, 14], sample_count = 20)]
fn pseudo_inertia_twenty(bencher: Bencher<'_, '_>, links: usize) {
    solve(bencher, links, Form::PseudoInertia);
}

#[divan::bench(args = [7], sample_count = 20)]
fn spatial_inertia_twenty(bencher: Bencher<'_, '_>, links: usize) {
    solve(bencher, links, Form::SpatialInertia);
}
