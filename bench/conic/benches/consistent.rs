//! Consistent estimates by our method and by the conic solver on the same problems: `cargo bench`.
//!
//! A figure is for twenty problems of moderate noise in which a constraint is active. Theirs is without the time to bring
//! them into conic form. Iterations are printed first.
#![expect(clippy::unwrap_used, reason = "a benchmark that fails should stop")]

#[path = "../../../crates/dynid-estimate/tests/all/random_problem/mod.rs"]
mod random_problem;

use divan::Bencher;
use dynid_conic::Conic;
use dynid_estimate::consistent::{Problem, Settings, Status, estimate};
use random_problem::random_problem;

fn main() {
    for links in LINKS {
        let problems = problems(links);
        let ours = problems.iter().map(|p| estimate(p, &Settings::default()).unwrap().iterations as u32);
        println!("{links} links: iterations ours {}", median(ours.collect()));
        for tolerance in [1e-8, 1e-11] {
            let posed = problems.iter().map(|p| Conic::new(p, &Settings::default()));
            let theirs = posed.map(|c| c.solve(tolerance).iterations).collect();
            println!("    theirs at {tolerance:e}: {}", median(theirs));
        }
    }
    divan::main();
}

const LINKS: [usize; 3] = [1, 7, 14];

fn median(mut counts: Vec<u32>) -> String {
    counts.sort_unstable();
    format!("median {}, most {}", counts[counts.len() / 2], counts[counts.len() - 1])
}

fn problems(links: usize) -> Vec<Problem> {
    let all = (0..).map(|seed| random_problem(seed, Some(links)).0);
    let constrained = |p: &Problem| estimate(p, &Settings::default()).unwrap().status == Status::Optimal;
    let moderate = |p: &Problem| p.z.iter().map(|z| z * z).sum::<f64>() < 1e7;
    all.filter(|p| moderate(p) && constrained(p)).take(20).collect()
}

#[divan::bench(args = LINKS, sample_count = 20)]
fn ours_twenty(bencher: Bencher<'_, '_>, links: usize) {
    let (problems, settings) = (problems(links), Settings::default());
    bencher.bench(|| problems.iter().map(|p| estimate(p, &settings).unwrap().iterations).sum::<usize>());
}

fn conic(bencher: Bencher<'_, '_>, links: usize, tolerance: f64) {
    let posed: Vec<_> = problems(links).iter().map(|p| Conic::new(p, &Settings::default())).collect();
    bencher.bench(|| posed.iter().map(|p| p.solve(tolerance).iterations).sum::<u32>());
}

#[divan::bench(args = LINKS, sample_count = 20)]
fn conic_twenty_at_1e_11(bencher: Bencher<'_, '_>, links: usize) {
    conic(bencher, links, 1e-11);
}

#[divan::bench(args = LINKS, sample_count = 20)]
fn conic_twenty_at_1e_8(bencher: Bencher<'_, '_>, links: usize) {
    conic(bencher, links, 1e-8);
}
