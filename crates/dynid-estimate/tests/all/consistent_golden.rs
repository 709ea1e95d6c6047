//! Physically consistent estimates against numbers of a conic solver: `estimation_consistent.json`,
//! `estimation_entropic.json`, `indy7_feasible_projection.json`.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::golden::{check_close, load, number, vector};
use dynid_estimate::consistent::{
    Bound, Form, LinkPrior, Margin, Problem, ProblemError, ScalarPrior, Settings, Status, certificate,
    entropic, estimate,
};
use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_model::symmetric::least_eigenvalue;
use serde_json::Value;

fn ten(values: &[f64]) -> Inertia {
    Inertia(std::array::from_fn(|k| values[k]))
}

fn matrix(value: &Value) -> Mat {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(vector).collect();
    Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn bound(name: &str, row: &[f64], upper: f64) -> Bound {
    let terms = row.iter().enumerate().filter(|(_, f)| **f != 0.0).map(|(k, f)| (k, *f)).collect();
    Bound { name: name.to_owned(), terms, upper }
}

fn problem(g: &Value) -> Problem {
    let prior = vector(&g["prior"]);
    let scale = vector(&g["scale"]);
    let nonnegative = vector(&g["kind_nonneg"]);
    let links = (0..2)
        .map(|i| LinkPrior { name: format!("l{i}"), first_column: 10 * i, prior: ten(&prior[10 * i..]) })
        .collect();
    let scalars = (0..scale.len())
        .map(|k| ScalarPrior {
            name: format!("s{k}"),
            column: 20 + k,
            prior: prior[20 + k],
            scale: scale[k],
            nonnegative: nonnegative[k] == 1.0,
        })
        .collect();
    Problem {
        r: matrix(&g["R"]),
        z: vector(&g["z"]),
        links,
        scalars,
        bounds: Vec::new(),
        equalities: Vec::new(),
        prior_std: Vec::new(),
    }
}

/// A case of `estimation_consistent.json`.
pub(crate) fn case(g: &Value, case: &Value) -> (Problem, Settings) {
    let mut problem = problem(g);
    for b in case["bounds"].as_array().into_iter().flatten() {
        problem.bounds.push(bound("given", &vector(&b["row"]), number(&b["upper"])));
    }
    let settings = Settings {
        prior_weight: number(&case["delta"]),
        entropic_weight: number(&case["gamma"]),
        margin: Margin::Relative(number(&case["eps"])),
        ..Settings::default()
    };
    (problem, settings)
}

#[test]
fn consistent_estimates_match_the_conic_solver() {
    let Some(g) = load("estimation_consistent.json") else { return };
    for case in g["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let (problem, settings) = self::case(&g, case);
        let found = estimate(&problem, &settings).unwrap();
        assert_eq!(found.status, Status::Optimal, "{name}");
        let expected = number(&case["objective"]);
        assert!((found.objective / expected - 1.0).abs() < 1e-5, "{name}: {} {expected}", found.objective);
        assert!(
            (found.unconstrained_fit - number(&case["unconstrained_fit"])).abs() < 1e-4,
            "{name}: {found:?}"
        );
        for (k, expected) in vector(&case["Rx"]).iter().enumerate() {
            let rx: f64 = (0..28).map(|j| problem.r[(k, j)] * found.x[j]).sum();
            assert!((rx - expected).abs() < 2e-3, "{name}: row {k}: {rx} {expected}");
        }
        assert!(
            found.least_eigenvalue.unwrap() >= number(&case["eps"]) && found.gap <= 1e-5,
            "{name}: {found:?}"
        );
        // The certificate, which knows nothing of how a point was found, never promises too much for theirs.
        if problem.bounds.is_empty() {
            let theirs = certificate(&problem, &settings, &vector(&case["x"])).unwrap();
            if let Some(gap) = theirs {
                assert!(gap >= expected - found.objective - 1e-9, "{name}: {gap}");
            }
        }
    }
}

#[test]
fn bounds_that_exclude_each_other_are_both_named() {
    let Some(g) = load("estimation_consistent.json") else { return };
    let mut problem = problem(&g);
    let rows = &g["infeasible"]["rows"];
    let upper = vector(&g["infeasible"]["upper"]);
    problem.bounds.push(bound("light", &vector(&rows[0]), upper[0]));
    problem.bounds.push(bound("heavy", &vector(&rows[1]), upper[1]));
    let error = estimate(&problem, &Settings::default()).unwrap_err();
    assert!(matches!(error, ProblemError::Contradiction { .. }), "{error}");
    assert!(error.to_string().contains("heavy") && error.to_string().contains("light"), "{error}");
    // The same hidden from a comparison of pairs: phase I must find it.
    problem.bounds[0].terms.push((0, 1e-3));
    let ProblemError::Infeasible { conflict, violation } =
        estimate(&problem, &Settings::default()).unwrap_err()
    else {
        panic!("expected an infeasible problem")
    };
    assert!(conflict.contains(&"light".to_owned()) && conflict.contains(&"heavy".to_owned()), "{conflict:?}");
    assert!(violation > 1e-3);
}

#[test]
fn entropic_distance_and_its_derivatives() {
    let Some(g) = load("estimation_entropic.json") else { return };
    for case in g["cases"].as_array().unwrap() {
        let (prior, body) = (ten(&vector(&case["prior"])), ten(&vector(&case["x"])));
        let close = |found: f64, expected: f64, what: &str| {
            assert!(
                (found - expected).abs() <= 1e-8 * expected.abs().max(1e-3),
                "{what}: {found} {expected}"
            );
        };
        let p = matrix(&case["P"]);
        for (i, row) in body.pseudo_inertia().iter().enumerate() {
            (0..4).for_each(|j| assert!((row[j] - p[(i, j)]).abs() < 1e-12));
        }
        let d = entropic::divergence(&body, &prior).unwrap();
        close(d.value, number(&case["divergence"]), "divergence");
        check_close("gradient", &d.gradient, &vector(&case["gradient"]), 1e-8);
        let hessian: Vec<f64> = case["hessian"].as_array().unwrap().iter().flat_map(vector).collect();
        check_close("Hessian", d.hessian.as_flattened(), &hessian, 1e-8);
        close(entropic::pull_back(&body, &prior).unwrap(), number(&case["pullback_quadratic"]), "pull-back");
    }
}

/// Columns of the golden grouping matrix: links, then rotor inertias.
fn indy7(base: &Value) -> (Mat, Vec<usize>) {
    let names: Vec<&str> =
        base["names_standard"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let symbols = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
    let at =
        |name: String| names.iter().position(|n| *n == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
    let links = (1..=6).flat_map(|i| symbols.map(|s| at(format!("{s}{i}"))));
    let order: Vec<usize> = links.chain((1..=6).map(|i| at(format!("Ia{i}")))).collect();
    (matrix(&base["grouping_matrix"]), order)
}

#[test]
fn indy7_projections_onto_feasible_bodies() {
    let (Some(g), Some(base)) = (load("indy7_feasible_projection.json"), load("indy7_base.json")) else {
        return;
    };
    let (grouping, order) = indy7(&base);
    // The golden problem has no noise level; with one of 1e-4 the default weights mean what they should.
    let weight = 1e4;
    let r = Mat::from_fn(40, 66, |i, j| weight * grouping[(i, order[j])]);
    let ball = Inertia([4.0, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.04, 0.0, 0.04]);
    let links: Vec<LinkPrior> = (0..6)
        .map(|i| LinkPrior { name: format!("link{}", i + 1), first_column: 10 * i, prior: ball })
        .collect();
    let scalars: Vec<ScalarPrior> = (0..6)
        .map(|i| ScalarPrior {
            name: format!("Ia{i}"),
            column: 60 + i,
            prior: 0.5,
            scale: 0.5,
            nonnegative: true,
        })
        .collect();
    for (c, case) in g["cases"].as_array().unwrap().iter().enumerate() {
        let target = vector(&case["target"]);
        let z: Vec<f64> = target.iter().map(|t| weight * t).collect();
        let problem = Problem {
            r: r.clone(),
            z,
            links: links.clone(),
            scalars: scalars.clone(),
            bounds: Vec::new(),
            equalities: Vec::new(),
            prior_std: Vec::new(),
        };
        for (form, key) in [(Form::SpatialInertia, "bl"), (Form::PseudoInertia, "pseudo_inertia")] {
            let settings = Settings { form, margin: Margin::Absolute(1e-6), ..Settings::default() };
            let found = estimate(&problem, &settings).unwrap();
            for link in found.x.chunks(10).take(6).map(ten) {
                let (p, b) =
                    (least_eigenvalue(&link.pseudo_inertia()), least_eigenvalue(&link.spatial_inertia()));
                assert!(
                    b >= -1e-9 && (form == Form::SpatialInertia || p >= -1e-9),
                    "case {c} {key}: {p} {b}"
                );
            }
            assert!(found.x[60..].iter().all(|ia| *ia >= 1e-6 - 1e-15), "case {c} {key}");
            let beta: Vec<f64> =
                (0..40).map(|i| (0..66).map(|j| grouping[(i, order[j])] * found.x[j]).sum()).collect();
            let objective: f64 = beta.iter().zip(&target).map(|(b, t)| (b - t) * (b - t)).sum();
            let worst = beta.iter().zip(&target).map(|(b, t)| (b - t).abs()).fold(0.0, f64::max);
            println!(
                "case {c} {key}: {objective:.6e} worst {worst:.3e} {:?} gap {:.1e} {} iterations",
                found.status, found.gap, found.iterations
            );
            if let Some(expected) = case[format!("objective_{key}")].as_f64() {
                let close = (objective - expected).abs() <= 1e-3 * expected + 1e-10;
                assert!(close, "case {c} {key}: {objective} {expected}");
            }
            if let Some(solution) = case.get(format!("solution_{key}")) {
                for (k, (b, expected)) in beta.iter().zip(vector(solution)).enumerate() {
                    assert!((b - expected).abs() < 5e-4, "case {c} {key}: {k}: {b} {expected}");
                }
            }
        }
    }
}
