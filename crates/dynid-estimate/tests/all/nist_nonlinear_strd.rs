//! Nonlinear-regression sets of the NIST Statistical Reference Datasets through separable and general least squares.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "in tests a panic is the report")]

use crate::nist_nonlinear::{NistProblem, Published, SETS};
use dynid_estimate::separable::{Deviations, SeparableSettings, Weighting, fit};

fn settings() -> SeparableSettings {
    SeparableSettings {
        weighting: Weighting::Equal,
        starts: 1,
        max_iterations: 2000,
        ..SeparableSettings::default()
    }
}

/// Fewest agreeing digits, `-log10` of the relative deviation, at most 11: NIST certifies that many.
fn agreeing_digits(found: &[f64], certified: &[f64]) -> f64 {
    assert_eq!(found.len(), certified.len());
    let digits = |(f, c): (&f64, &f64)| -((f / c - 1.0).abs().max(1e-11)).log10();
    found.iter().zip(certified).map(digits).fold(11.0, f64::min)
}

/// Digits of parameters, standard deviations and rss from one start.
fn digits(set: &'static Published, start: usize, separate: bool) -> [f64; 3] {
    let problem = NistProblem::new(set, start, separate);
    let estimate = fit(&problem, &settings()).unwrap();
    let mut parameters = problem.assemble(&estimate.linear, &estimate.shape);
    let Deviations { linear, shape } = estimate.standard_deviations().unwrap();
    let mut deviations: Vec<f64> =
        problem.assemble(&linear, &shape).into_iter().map(|d| d.unwrap_or(f64::NAN)).collect();
    if set.name == "MGH17" && parameters[3] > parameters[4] {
        // The two exponentials may come in either order.
        for list in [&mut parameters, &mut deviations] {
            list.swap(1, 2);
            list.swap(3, 4);
        }
    }
    let found = [
        agreeing_digits(&parameters, set.certified),
        agreeing_digits(&deviations, set.deviations),
        agreeing_digits(&[estimate.rss], &[set.rss]),
    ];
    println!(
        "{:9} start {} {}: {:5.1} digits of parameters, {:5.1} of deviations, {:5.1} of the rss, {} iterations, {:?}",
        set.name,
        start + 1,
        if separate { "separable" } else { "general  " },
        found[0],
        found[1],
        found[2],
        estimate.starts.outcomes[0].iterations,
        estimate.status
    );
    found
}

/// Digits asked of parameters and standard deviations. The residuals of Lanczos1 are 1e-13 of efforts near 1, so that
/// rounding in double precision leaves three digits of them, and of deviations that are a multiple of them.
fn check(set: &'static Published, start: usize, separate: bool) {
    let [parameters, deviations, rss] = digits(set, start, separate);
    let asked = if set.name == "Lanczos1" { 2.5 } else { 6.0 };
    let name = set.name;
    assert!(parameters >= 6.0, "{name}, start {}: {parameters:.1} digits of parameters", start + 1);
    assert!(deviations >= asked, "{name}, start {}: {deviations:.1} digits of deviations", start + 1);
    assert!(rss >= asked, "{name}, start {}: {rss:.1} digits of the rss", start + 1);
}

#[test]
fn separable_fits_have_the_certified_digits_from_both_starts() {
    for set in SETS {
        (0..2).for_each(|start| check(set, start, true));
    }
}

/// Without the separation three of the far starts lead elsewhere, as they do other general solvers: to infinity on
/// BoxBOD, into a valley on MGH10, to another minimum on MGH17.
#[test]
fn general_fits_have_the_certified_digits_from_all_but_three_far_starts() {
    for set in SETS {
        let lost = ["BoxBOD", "MGH10", "MGH17"].contains(&set.name);
        (usize::from(lost)..2).for_each(|start| check(set, start, false));
    }
}
