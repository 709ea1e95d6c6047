//! Fits of the three-slider mechanism: rows B7 to B11 of the acceptance table, and what goes beyond the source.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::prr3_machine::{
    DESIGN, LEGS, TRUTH, base_matrix, bounds, circle, efforts, experiment, record, sampled, start,
};
use dynid_friction::load_friction::{
    Design, DesignStatus, FitSettings, Model, PlanarBody, Problem, SignStatus, SquaredResiduals, fit_bounded,
    fit_separated, nearest_to_design,
};
use dynid_search::{self as search, Algorithm, Objective, PatternSearch, SearchResult};
use std::ops::ControlFlow;

const MODELS: [Model; 3] = [Model::Stribeck, Model::CoulombViscous, Model::Constant];

/// Pattern search as published, the mesh doubled after every success; or never wider than a given one.
fn pattern_search(problem: &Problem, largest_mesh: f64) -> SearchResult {
    let algorithm = Algorithm::PatternSearch(PatternSearch { largest_mesh, ..PatternSearch::default() });
    let settings = search::Settings { start: Some(start()), history: 40_000, ..search::Settings::default() };
    let objective = SquaredResiduals::new(problem);
    search::run(&algorithm, &objective, &bounds(), &settings, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn rms(problem: &Problem, sum_of_squares: f64) -> f64 {
    (sum_of_squares / problem.rows() as f64).sqrt()
}

fn circle_error(problem: &Problem, theta: &[f64]) -> f64 {
    let other = record(&sampled(circle, 1000), 0.0);
    let predicted = problem.predict_on(&other, theta).unwrap();
    predicted.rms_error(&efforts(&other, 0.0, 0)).unwrap().unwrap()
}

fn base(phi: &[f64]) -> Vec<f64> {
    let b = base_matrix();
    (0..9).map(|i| (0..13).map(|k| b[(i, k)] * phi[k]).sum()).collect()
}

/// Fits and searches of the three laws without noise.
#[test]
fn clean_efforts_give_back_what_is_identifiable() {
    let mut searched = Vec::new();
    let mut fitted = Vec::new();
    for model in MODELS {
        let problem = experiment(model, 0.0, 0);
        let fit = fit_bounded(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
        // As published it does not get that far in 34 000 evaluations.
        let found = pattern_search(&problem, 1.0);
        println!(
            "{model:?}: bounded LS {:.6} N (J {:.6e}, {} of {} starts), pattern search {:.4} N",
            fit.rms,
            fit.sum_of_squares,
            fit.reached,
            fit.starts.len(),
            rms(&problem, found.value)
        );
        assert!(bounds().contain(&fit.theta) && bounds().contain(&found.point));
        searched.push(rms(&problem, found.value));
        if model == Model::Stribeck {
            assert!(fit.sum_of_squares < 1e-12, "J {}", fit.sum_of_squares);
            for (f, t) in base(&fit.theta).iter().zip(base(&TRUTH)) {
                assert!((f - t).abs() < 1e-6, "{f} against {t}");
            }
            for (f, t) in fit.theta[13..].iter().zip(&TRUTH[13..]) {
                assert!((f / t - 1.0).abs() < 1e-4, "friction {f} against {t}");
            }
        }
        fitted.push(fit.rms);
    }
    assert!(fitted[0] <= 0.01 * fitted[1]);
    assert!(searched[0] <= 0.6 * searched[1], "{searched:?}");
    // By an independent program: 0, 0.429 and 1.855 N.
    assert!((fitted[1] - 0.429).abs() < 5e-4 && (fitted[2] - 1.855).abs() < 5e-4, "{fitted:?}");
}

/// Fits, identifiability and prediction with noise of 2 N.
#[test]
fn noisy_efforts_keep_the_order_of_the_models() {
    keep_the_order(&[1]);
}

#[test]
#[ignore = "two seconds; the ordinary run takes one seed"]
fn noisy_efforts_of_more_seeds_keep_the_order_of_the_models() {
    keep_the_order(&[2, 3]);
}

#[expect(clippy::print_stdout, reason = "what was found is said")]
fn keep_the_order(seeds: &[u64]) {
    for &seed in seeds {
        let mut fits = Vec::new();
        for model in MODELS {
            let problem = experiment(model, 2.0, seed);
            let fit = fit_bounded(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
            assert!(bounds().contain(&fit.theta));
            fits.push((fit.sum_of_squares, fit.rms, circle_error(&problem, &fit.theta)));
        }
        println!("seed {seed}: RMS {:.4} {:.4} {:.4} N", fits[0].1, fits[1].1, fits[2].1);
        println!("  circle {:.4} {:.4} {:.4} N", fits[0].2, fits[1].2, fits[2].2);
        assert!(fits[0].1 < fits[1].1 && fits[0].1 < fits[2].1);
        assert!(fits[0].2 <= 0.3 * fits[2].2);

        let problem = experiment(Model::Stribeck, 2.0, seed);
        let found = pattern_search(&problem, f64::INFINITY);
        let excess = found.value / fits[0].0;
        println!(
            "  pattern search J {excess:.4} of LS, {} evaluations, {:?}, circle {:.4} N",
            found.evaluations,
            found.status,
            circle_error(&problem, &found.point)
        );
        assert!(bounds().contain(&found.point));
        assert!(excess <= 1.06, "seed {seed}: {excess}");
        assert!(found.evaluations <= 34_000);
        assert!(found.history.windows(2).all(|h| h[1].value <= h[0].value));
        let capped = pattern_search(&problem, 1.0).value / fits[0].0;
        assert!(capped <= 1.05, "seed {seed}, mesh kept at 1: {capped}");
    }
}

#[test]
fn separated_and_joint_fits_agree() {
    for seed in 1..=3 {
        let problem = experiment(Model::Stribeck, 2.0, seed);
        let settings = FitSettings { starts: 4, ..FitSettings::default() };
        let joint = fit_bounded(&problem, &bounds(), &start(), &settings).unwrap();
        let separated = fit_separated(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
        assert_eq!(separated.signs, SignStatus::Settled);
        assert_eq!(separated.dependent.len(), 2);
        assert_eq!(joint.reached, joint.starts.len(), "{:?}", joint.starts);
        let gap = (separated.sum_of_squares / joint.sum_of_squares - 1.0).abs();
        assert!(gap < 1e-9, "seed {seed}: {gap}");
        for k in 13..17 {
            assert!((separated.theta[k] / joint.theta[k] - 1.0).abs() < 1e-7, "friction {k}");
        }
        for (a, b) in base(&separated.theta).iter().zip(base(&joint.theta)) {
            assert!((a - b).abs() < 1e-6 * b.abs(), "{a} against {b}");
        }
    }
    let clean =
        fit_separated(&experiment(Model::Stribeck, 0.0, 0), &bounds(), &start(), &FitSettings::default());
    let clean = clean.unwrap();
    assert!(clean.sum_of_squares < 1e-12 && (clean.theta[16] / 0.02 - 1.0).abs() < 1e-8);
}

#[test]
#[ignore = "five seconds"]
fn noise_spreads_estimates_as_their_deviations_say() {
    // χ² over 40 seeds of 9 base and 4 friction parameters: mean 1 each.
    let problem = |seed| experiment(Model::Stribeck, 2.0, seed);
    let mut sums = [0.0; 13];
    let seeds = 40;
    for seed in 100..100 + seeds {
        let problem = problem(seed);
        let fit = fit_bounded(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
        let found = problem.identifiability(&fit.theta, None).unwrap();
        for (k, b) in found.combinations(&base_matrix()).unwrap().iter().enumerate() {
            sums[k] += ((b.value - base(&TRUTH)[k]) / b.std.unwrap()).powi(2);
        }
        for (k, std) in found.standard_deviations()[13..].iter().enumerate() {
            sums[9 + k] += ((fit.theta[13 + k] - TRUTH[13 + k]) / std.unwrap()).powi(2);
        }
    }
    let means = sums.map(|s| s / seeds as f64);
    println!("mean squared standardised errors {means:.2?}");
    // 1 ± 3.9 standard deviations of a mean of 40; μ_s and v_s are far from linear.
    assert!(means[..11].iter().all(|m| (0.13..1.87).contains(m)), "{means:?}");
}

#[test]
fn values_do_not_depend_on_their_group() {
    for model in MODELS {
        let problem = experiment(model, 2.0, 1);
        let objective = SquaredResiduals::new(&problem);
        let shifted = |i: usize| start().into_iter().map(move |x| x * (1.0 + 0.01 * i as f64));
        let candidates: Vec<f64> = (0..40).flat_map(shifted).collect();
        let mut together = vec![0.0; 40];
        objective.evaluate(&candidates, &mut together);
        for (x, value) in candidates.chunks_exact(17).zip(&together) {
            let mut alone = [0.0];
            objective.evaluate(x, &mut alone);
            assert_eq!(alone[0].to_bits(), value.to_bits());
            let expected = problem.sum_of_squares(x).unwrap();
            assert!((value / expected - 1.0).abs() < 1e-12);
        }
    }
}

fn design(centre: f64) -> Design {
    let leg = |i: usize| PlanarBody {
        name: format!("leg {}", i + 1),
        mass: 1 + i,
        moments: vec![5 + i],
        inertia: 9 + i,
        centre: vec![(0.0, centre * LEGS[i])],
    };
    let platform = PlanarBody {
        name: "platform".into(),
        mass: 4,
        moments: vec![8],
        inertia: 12,
        centre: vec![(0.0, 0.4)],
    };
    Design {
        values: DESIGN.to_vec(),
        scales: DESIGN.to_vec(),
        bodies: (0..3).map(leg).chain([platform]).collect(),
        margin: 0.05,
    }
}

#[test]
fn free_directions_are_filled_from_the_design() {
    let problem = experiment(Model::Stribeck, 0.0, 0);
    let fit = fit_bounded(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
    let near = nearest_to_design(&problem, &bounds(), &fit.theta, &design(1.0)).unwrap();
    assert_eq!((near.status, near.gave_way, near.free_directions), (DesignStatus::FreeDirections, 0.0, 2));
    assert!(bounds().contain(&near.theta));
    assert!(near.central_inertias.iter().all(|i| *i > 0.0), "{:?}", near.central_inertias);
    assert!(problem.sum_of_squares(&near.theta).unwrap() < 1e-12);
    // Truth meets all conditions with the same efforts: it cannot be nearer.
    let distance = |phi: &[f64]| (0..13).map(|k| (phi[k] / DESIGN[k] - 1.0).powi(2)).sum::<f64>().sqrt();
    assert!(near.distance <= distance(&TRUTH) + 1e-6, "{} {}", near.distance, distance(&TRUTH));
    // No step along the two free directions that stays inside comes nearer.
    let found = problem.identifiability(&near.theta, None).unwrap();
    for i in 0..2 {
        for step in [1e-3, -1e-3] {
            let mut other = near.theta.clone();
            (0..13).for_each(|k| other[k] += step * found.null_directions[(k, i)]);
            assert!(!bounds().contain(&other) || distance(&other) > near.distance - 1e-9);
        }
    }
    // The basic solution of the separated fit, far outside of bounds, ends at the same point.
    let basic = fit_separated(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
    assert!(!bounds().contain(&basic.theta));
    let again = nearest_to_design(&problem, &bounds(), &basic.theta, &design(1.0)).unwrap();
    for k in 0..17 {
        assert!(
            (again.theta[k] / near.theta[k] - 1.0).abs() < 1e-4,
            "{k}: {} {}",
            again.theta[k],
            near.theta[k]
        );
    }
}

#[test]
fn a_fit_gives_way_to_bodies_that_can_exist() {
    let problem = experiment(Model::Stribeck, 2.0, 1);
    let fit = fit_bounded(&problem, &bounds(), &start(), &FitSettings::default()).unwrap();
    // Leg 1 has its centre of mass at 0.467 of its length, leg 2 at 0.502, leg 3 at 0.418.
    let mut least = f64::INFINITY;
    for (centre, status) in [(0.45, DesignStatus::FreeDirections), (0.30, DesignStatus::GaveWay)] {
        let near = nearest_to_design(&problem, &bounds(), &fit.theta, &design(centre)).unwrap();
        println!(
            "centre {centre}: gave way {:.4} N, distance {:.4}, gap {:.1e}, central inertias {:.3?}",
            near.gave_way, near.distance, near.gap, near.central_inertias
        );
        assert_eq!(near.status, status);
        assert!(bounds().contain(&near.theta) && near.gap < 1e-8);
        for (i, leg) in LEGS.into_iter().enumerate() {
            assert!(near.theta[5 + i] <= centre * leg * near.theta[1 + i] * (1.0 + 1e-12));
        }
        let design = design(centre);
        for (body, inertia) in design.bodies.iter().zip(&near.central_inertias) {
            let of = DESIGN[body.inertia] - DESIGN[body.moments[0]].powi(2) / DESIGN[body.mass];
            assert!(*inertia >= design.margin * of, "{}: {inertia}", body.name);
        }
        let misfit = problem.sum_of_squares(&near.theta).unwrap();
        match status {
            DesignStatus::FreeDirections => {
                assert!((misfit / fit.sum_of_squares - 1.0).abs() < 1e-9 && near.gave_way == 0.0);
                least = near.distance;
            }
            DesignStatus::GaveWay => {
                assert!(misfit > fit.sum_of_squares && near.gave_way > 0.0 && near.distance > least);
            }
        }
    }
    // In the lowest fifth nothing within the bounds can be.
    let refused = nearest_to_design(&problem, &bounds(), &fit.theta, &design(0.20)).unwrap_err();
    assert!(refused.to_string().contains("no parameters lie within the bounds"), "{refused}");
}
