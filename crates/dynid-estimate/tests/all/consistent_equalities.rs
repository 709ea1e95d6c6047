//! Consistent estimates with equalities: they hold, the optimum is proven, and it is that of problems without.

use crate::random_problem::random_problem;
use dynid_estimate::consistent::{
    Bound, Equality, Form, LinkPrior, Problem, ProblemError, Settings, Status, estimate,
};
use dynid_linalg::Mat;
use dynid_model::Inertia;

/// Random equalities that the truth meets: single parameters, multiples, sums across links.
fn with_equalities(seed: u64) -> (Problem, Vec<f64>) {
    let (mut problem, truth) = random_problem(seed, Some(2 + seed as usize % 4));
    problem.bounds.clear();
    let columns = problem.columns();
    let number = |i: usize| (seed as f64 * 12.9898 + i as f64 * 78.233).sin() * 0.5 + 0.5;
    let count = 1 + seed as usize % 5;
    for i in 0..count {
        // Each equality has a column of its own, so that they are independent.
        let own = (7 * i + seed as usize) % columns;
        let mut terms = vec![(own, 1.0)];
        for k in 0..i % 3 {
            let other = (own + 11 * (k + 1)) % columns;
            if other != own {
                terms.push((other, number(3 * i + k) - 0.5));
            }
        }
        let value = terms.iter().map(|(c, f)| f * truth[*c]).sum();
        problem.equalities.push(Equality { name: format!("equality {i}"), terms, value });
    }
    (problem, truth)
}

fn residuals(problem: &Problem, x: &[f64]) -> Vec<f64> {
    let of = |e: &Equality| {
        let size: f64 = e.terms.iter().map(|(c, f)| (f * x[*c]).abs()).sum::<f64>() + e.value.abs();
        (e.terms.iter().map(|(c, f)| f * x[*c]).sum::<f64>() - e.value) / size.max(1e-3)
    };
    problem.equalities.iter().map(of).collect()
}

fn fit(problem: &Problem, x: &[f64]) -> f64 {
    let row = |i: usize| (0..x.len()).map(|j| problem.r[(i, j)] * x[j]).sum::<f64>() - problem.z[i];
    (0..problem.z.len()).map(|i| row(i).powi(2)).sum()
}

#[test]
fn equalities_hold_and_the_optimum_is_proven_and_that_of_narrow_bounds() {
    for form in [Form::PseudoInertia, Form::SpatialInertia] {
        let settings = Settings { form, ..Settings::default() };
        let mut stalled = 0;
        for seed in 0..120 {
            let (problem, truth) = with_equalities(seed);
            let found = estimate(&problem, &settings).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
            let worst = residuals(&problem, &found.x).into_iter().fold(0.0, |m: f64, r| m.max(r.abs()));
            assert!(worst < 1e-10, "seed {seed}: {worst}");
            assert!(found.least_eigenvalue.unwrap() > 0.0 && found.price() > -1e-6, "seed {seed}: {found:?}");
            let noise = 1e-11 * problem.z.iter().map(|z| z * z).sum::<f64>();
            assert!(found.fit <= fit(&problem, &truth) + 1e-3 + noise, "seed {seed}");
            stalled += usize::from(found.status == Status::Stalled);
            // Both sides of a narrow range instead.
            let mut narrow = problem.clone();
            for e in narrow.equalities.drain(..) {
                let room = 1e-6 * e.value.abs().max(1e-3);
                let less = e.terms.iter().map(|(c, f)| (*c, -f)).collect();
                narrow.bounds.push(Bound { name: e.name.clone(), terms: e.terms, upper: e.value + room });
                narrow.bounds.push(Bound { name: e.name, terms: less, upper: room - e.value });
            }
            let Ok(near) = estimate(&narrow, &settings) else { continue };
            if near.status == Status::Optimal && found.status == Status::Optimal {
                let size = 1e-4
                    * (1.0 + found.objective - found.unconstrained_fit.min(near.unconstrained_fit))
                    + noise;
                // The range has more room: its least is lower, and not by much.
                assert!(
                    near.objective <= found.objective + size,
                    "seed {seed}: {} {}",
                    near.objective,
                    found.objective
                );
                let most = 0.05 * found.objective.abs() + size;
                assert!(
                    found.objective <= near.objective + most,
                    "seed {seed}: {} {}",
                    near.objective,
                    found.objective
                );
            }
        }
        assert!(stalled <= 4, "{form:?}: {stalled}");
    }
}

#[test]
fn equal_bodies_are_one_body_with_the_columns_of_both() {
    for seed in 300..330 {
        let (problem, _) = random_problem(seed, Some(2));
        let [a, b] = [0, 1].map(|k| problem.links[k].first_column);
        let mut tied = Problem { bounds: Vec::new(), ..problem.clone() };
        tied.links[1] = LinkPrior { first_column: b, ..problem.links[0].clone() };
        for k in 0..10 {
            let terms = vec![(a + k, 1.0), (b + k, -1.0)];
            tied.equalities.push(Equality { name: format!("{k}"), terms, value: 0.0 });
        }
        let settings = Settings::default();
        let found = estimate(&tied, &settings).unwrap();
        let columns: Vec<usize> = (0..problem.columns()).filter(|c| !(b..b + 10).contains(c)).collect();
        let place = |c: usize| columns.iter().position(|own| *own == c).unwrap();
        let one = Problem {
            r: Mat::from_fn(problem.r.nrows(), columns.len(), |i, j| {
                let c = columns[j];
                let twin = (a..a + 10).contains(&c).then(|| problem.r[(i, b + c - a)]);
                problem.r[(i, c)] + twin.unwrap_or(0.0)
            }),
            links: vec![LinkPrior { first_column: place(a), ..problem.links[0].clone() }],
            scalars: problem
                .scalars
                .iter()
                .cloned()
                .map(|mut s| {
                    s.column = place(s.column);
                    s
                })
                .collect(),
            bounds: Vec::new(),
            prior_std: Vec::new(),
            ..problem.clone()
        };
        let alone = estimate(&one, &settings).unwrap();
        let noise = 1e-11 * problem.z.iter().map(|z| z * z).sum::<f64>();
        let room = found.gap.max(alone.gap) + 1e-4 * (1.0 + alone.price().abs()) + noise;
        assert!((found.fit - alone.fit).abs() <= room, "seed {seed}: {} {}", found.fit, alone.fit);
        for k in 0..10 {
            let (x, y) = (found.x[a + k], found.x[b + k]);
            assert!((x - y).abs() <= 1e-10 * found.x[a].max(x.abs()), "seed {seed}: {x} {y}");
        }
    }
}

/// A body whose prior is far from what the equalities say of it; the start has to be looked for.
#[test]
fn equalities_far_from_the_prior_are_met_inside_the_cone() {
    let prior = Inertia([2.0, 0.9, 0.0, 0.0, 0.05, 0.0, 0.0, 0.45, 0.0, 0.45]);
    let equality =
        |column: usize, value: f64| Equality { name: format!("{column}"), terms: vec![(column, 1.0)], value };
    let problem = |equalities: Vec<Equality>| Problem {
        r: Mat::from_fn(1, 10, |_, j| if j == 0 { 1.0 } else { 0.0 }),
        z: vec![1.0],
        links: vec![LinkPrior { name: "link".into(), first_column: 0, prior }],
        scalars: Vec::new(),
        bounds: Vec::new(),
        equalities,
        prior_std: Vec::new(),
    };
    let far = problem(vec![equality(1, 0.0), equality(0, 40.0), equality(4, 1e-3)]);
    let found = estimate(&far, &Settings::default()).unwrap();
    assert!((found.x[0] - 40.0).abs() < 1e-9 && found.x[1].abs() < 1e-9 && (found.x[4] - 1e-3).abs() < 1e-9);
    assert_eq!(Inertia(std::array::from_fn(|k| found.x[k])).physical_fault(), None);
    // No body has a first moment without mass.
    let refused =
        estimate(&problem(vec![equality(0, 0.0), equality(1, 1.0)]), &Settings::default()).unwrap_err();
    assert!(
        matches!(&refused, ProblemError::Infeasible { conflict, .. } if !conflict.is_empty()),
        "{refused}"
    );
}
