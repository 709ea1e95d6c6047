//! Consistent estimates of random problems: always feasible, always certified.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "in tests a panic is the report")]

use crate::random_problem::random_problem;
use dynid_estimate::consistent::{Form, Settings, Status, certificate, estimate};
use dynid_model::Inertia;
use dynid_model::symmetric::{cholesky, congruence, least_eigenvalue, lower_inverse};
use rayon::prelude::*;

/// Checks feasibility of every problem; returns iterations and whether each reached the tolerance.
fn run(seeds: std::ops::Range<u64>, settings: &Settings) -> Vec<(usize, Status, f64)> {
    seeds
        .into_par_iter()
        .map(|seed| {
            let (problem, _) = random_problem(seed, None);
            let found = estimate(&problem, settings).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
            assert!(found.x.iter().all(|x| x.is_finite()), "seed {seed}: {found:?}");
            // An eigenvalue is known to rounding of the largest one.
            let rounding = 10.0 * f64::EPSILON * found.largest_trace;
            let least = found.least_eigenvalue.unwrap();
            assert!(least >= 1e-6 - rounding, "seed {seed}: {least}");
            assert!(
                found.gap.is_finite() && found.gap >= -1e-9 * found.objective,
                "seed {seed}: {}",
                found.gap
            );
            assert!(
                found.price() >= -1e-9 * (1.0 + problem.z.iter().map(|z| z * z).sum::<f64>()),
                "seed {seed}"
            );
            // Feasible after the way back to parameters as well, not only where the method works.
            for link in &problem.links {
                let body = Inertia(std::array::from_fn(|k| found.x[link.first_column + k]));
                match settings.form {
                    Form::PseudoInertia => {
                        let white = lower_inverse(&cholesky(&link.prior.pseudo_inertia()).unwrap());
                        let least = least_eigenvalue(&congruence(&white, &body.pseudo_inertia()));
                        assert!(least >= 1e-6 * (1.0 - 1e-6), "seed {seed}: {}: {least}", link.name);
                        assert_eq!(body.physical_fault(), None, "seed {seed}: {}", link.name);
                    }
                    Form::SpatialInertia => {
                        assert!(cholesky(&body.spatial_inertia()).is_some(), "seed {seed}")
                    }
                }
            }
            for scalar in problem.scalars.iter().filter(|s| s.nonnegative) {
                assert!(found.x[scalar.column] > 0.0, "seed {seed}: {}", scalar.name);
            }
            for bound in &problem.bounds {
                let value: f64 = bound.terms.iter().map(|(c, f)| f * found.x[*c]).sum();
                assert!(value <= bound.upper + 1e-9 * bound.upper.abs(), "seed {seed}: {}", bound.name);
            }
            let noise = 2e-14 * problem.z.iter().map(|z| z * z).sum::<f64>();
            let tolerance = (1e-6 * (found.objective - found.unconstrained_fit)).max(1e-6).max(noise);
            (found.iterations, found.status, found.gap / tolerance)
        })
        .collect()
}

fn summary(what: &str, outcomes: &[(usize, Status, f64)]) -> usize {
    let mut iterations: Vec<usize> =
        outcomes.iter().filter(|o| o.1 != Status::Unconstrained).map(|o| o.0).collect();
    iterations.sort_unstable();
    let at = |share: f64| iterations[((iterations.len() - 1) as f64 * share) as usize];
    let stalled: Vec<f64> = outcomes.iter().filter(|o| o.1 == Status::Stalled).map(|o| o.2).collect();
    println!(
        "{what}: {} problems, {} unconstrained, iterations median {}, 95 % {}, most {}; above tolerance: {:?}",
        outcomes.len(),
        outcomes.len() - iterations.len(),
        at(0.5),
        at(0.95),
        at(1.0),
        stalled,
    );
    at(0.5)
}

#[test]
fn random_problems_end_feasible_and_certified() {
    let outcomes = run(0..300, &Settings::default());
    let median = summary("pseudo-inertia", &outcomes);
    assert!(median <= 25, "{median}");
    let stalled = outcomes.iter().filter(|o| o.1 == Status::Stalled);
    assert!(stalled.count() <= 3, "the tolerance is reached but for rounding");
    assert!(outcomes.iter().all(|o| o.2 < 1e3), "every gap is near the tolerance");
}

#[test]
fn random_problems_in_the_weaker_form_and_with_entropic_prior() {
    let weaker = Settings { form: Form::SpatialInertia, ..Settings::default() };
    let outcomes = run(1000..1060, &weaker);
    summary("spatial inertia", &outcomes);
    let entropic = Settings { entropic_weight: 1.0, ..Settings::default() };
    let outcomes = run(2000..2060, &entropic);
    summary("entropic", &outcomes);
    assert!(outcomes.iter().filter(|o| o.1 == Status::Stalled).count() <= 2);
}

/// The whole ten thousand:
/// `cargo test --release -p dynid-estimate --test all consistent_random:: -- --ignored --nocapture`.
#[test]
#[ignore = "takes half a minute on two cores; the ordinary run does the first 300"]
fn ten_thousand_random_problems() {
    let outcomes = run(0..10_000, &Settings::default());
    summary("pseudo-inertia", &outcomes);
    assert!(outcomes.iter().filter(|o| o.1 == Status::Stalled).count() <= 20);
}

#[test]
fn the_certificate_never_promises_less_than_the_true_excess() {
    for seed in 5000..5040 {
        let (problem, truth) = random_problem(seed, Some(1 + seed as usize % 4));
        if !problem.bounds.is_empty() {
            continue;
        }
        let settings = Settings::default();
        let best = estimate(&problem, &settings).unwrap();
        let settled = certificate(&problem, &settings, &best.x).unwrap().unwrap();
        let noise = 1e-11 * problem.z.iter().map(|z| z * z).sum::<f64>();
        assert!(settled <= best.gap + 1e-6 + noise, "seed {seed}: {settled} {}", best.gap);
        // The truth, and points between it and the optimum, are consistent and worse.
        for share in [1.0, 0.3, 0.01] {
            let x: Vec<f64> = best.x.iter().zip(&truth).map(|(b, t)| b + share * (t - b)).collect();
            let Some(gap) = certificate(&problem, &settings, &x).unwrap() else { continue };
            let objective = objective(&problem, &settings, &x);
            assert!(
                gap >= objective - best.objective - 1e-6 - noise,
                "seed {seed}: {gap} {objective} {}",
                best.objective
            );
        }
    }
}

fn objective(problem: &dynid_estimate::consistent::Problem, settings: &Settings, x: &[f64]) -> f64 {
    let fit: f64 = (0..problem.z.len())
        .map(|i| (problem.z[i] - (0..x.len()).map(|j| problem.r[(i, j)] * x[j]).sum::<f64>()).powi(2))
        .sum();
    let body = |v: &[f64], c: usize| Inertia(std::array::from_fn(|k| v[c + k]));
    let links = problem.links.iter().map(|l| {
        dynid_estimate::consistent::entropic::pull_back(&body(x, l.first_column), &l.prior).unwrap()
    });
    let scalars = problem.scalars.iter().map(|s| ((x[s.column] - s.prior) / s.scale).powi(2));
    fit + settings.prior_weight * (links.sum::<f64>() + scalars.sum::<f64>())
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let solve = || {
        (0..20).into_par_iter().map(|s| estimate(&random_problem(s, None).0, &Settings::default()).unwrap().x)
    };
    let runs: Vec<Vec<Vec<f64>>> = [1, 2, 7]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solve().collect())
        })
        .collect();
    assert!(runs[0] == runs[1] && runs[0] == runs[2]);
}
