//! Consistent estimates beside those of a conic solver, on problems that it solved once: `tests/data/solved_problems.json`
//! says which solver, how it was set and how the table was made. The two share the definition of a body and nothing else.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::consistent_golden;
use crate::golden::{load, number, vector};
use crate::random_problem::random_problem;
use dynid_estimate::consistent::{
    Bound, ConsistentEstimate, Form, Margin, Problem, ProblemError, Settings, Status, certificate, entropic,
    estimate,
};
use dynid_model::Inertia;
use dynid_model::symmetric::{cholesky, congruence, least_eigenvalue, lower_inverse};
use rayon::prelude::*;
use serde_json::Value;

fn table() -> Value {
    serde_json::from_str(include_str!("../data/solved_problems.json")).unwrap()
}

fn text<'a>(entry: &'a Value, key: &str) -> &'a str {
    entry[key].as_str().unwrap()
}

fn entries<'a>(table: &'a Value, key: &str) -> &'a [Value] {
    table[key].as_array().unwrap()
}

/// A random problem of the table, by its seed and number of links, with its truth.
fn rebuilt(entry: &Value) -> (Problem, Vec<f64>) {
    random_problem(entry["seed"].as_u64().unwrap(), Some(entry["links"].as_u64().unwrap() as usize))
}

fn square(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum()
}

fn body(x: &[f64], first: usize) -> Inertia {
    Inertia(std::array::from_fn(|k| x[first + k]))
}

fn fitted(problem: &Problem, x: &[f64]) -> Vec<f64> {
    (0..problem.z.len()).map(|i| (0..x.len()).map(|j| problem.r[(i, j)] * x[j]).sum()).collect()
}

/// The objective from its definition.
fn objective(problem: &Problem, settings: &Settings, x: &[f64]) -> f64 {
    let residual: Vec<f64> = fitted(problem, x).iter().zip(&problem.z).map(|(a, b)| a - b).collect();
    let links =
        problem.links.iter().map(|l| entropic::pull_back(&body(x, l.first_column), &l.prior).unwrap());
    let scalars = problem.scalars.iter().map(|s| ((x[s.column] - s.prior) / s.scale).powi(2));
    square(&residual) + settings.prior_weight * (links.sum::<f64>() + scalars.sum::<f64>())
}

/// Rounding in an objective: each residual is off by some ulps of an effort.
fn rounding(problem: &Problem, objective: f64) -> f64 {
    16.0 * f64::EPSILON * (square(&problem.z) * objective.max(1.0)).sqrt()
}

/// What each constraint leaves, in whitened units; concave in `x`.
fn rooms(problem: &Problem, settings: &Settings, x: &[f64]) -> Vec<f64> {
    let Margin::Relative(margin) = settings.margin else { panic!("relative margin") };
    let links = problem.links.iter().map(|link| {
        let (body, prior) = (body(x, link.first_column), link.prior);
        let least = match settings.form {
            Form::PseudoInertia => {
                let back = lower_inverse(&cholesky(&prior.pseudo_inertia()).unwrap());
                least_eigenvalue(&congruence(&back, &body.pseudo_inertia()))
            }
            Form::SpatialInertia => {
                let back = lower_inverse(&cholesky(&prior.spatial_inertia()).unwrap());
                least_eigenvalue(&congruence(&back, &body.spatial_inertia()))
            }
        };
        least - margin
    });
    let scalars = problem.scalars.iter().filter(|s| s.nonnegative).map(|s| x[s.column] / s.scale - margin);
    let along = |b: &Bound| b.terms.iter().map(|(c, f)| f * x[*c]).sum::<f64>();
    let bounds = problem.bounds.iter().map(|b| (b.upper - along(b)) / b.upper.abs());
    links.chain(scalars).chain(bounds).collect()
}

/// The nearest point on the way to `inside` that meets every constraint.
fn feasible(problem: &Problem, settings: &Settings, x: &[f64], inside: &[f64]) -> Vec<f64> {
    const ROOM: f64 = 1e-12;
    let (here, there) = (rooms(problem, settings, x), rooms(problem, settings, inside));
    let mut share = 0.0_f64;
    for (here, there) in here.into_iter().zip(there).filter(|(here, _)| *here < ROOM) {
        assert!(there > 1e3 * ROOM, "the way leads inside: {there}");
        share = share.max((ROOM - here) / (there - here));
    }
    x.iter().zip(inside).map(|(x, i)| x + share * (i - x)).collect()
}

/// One problem and both answers to it.
struct Pair {
    ours: ConsistentEstimate,
    /// Estimate of the conic solver, made feasible.
    x: Vec<f64>,
    /// Objectives from the definition: ours, theirs made feasible, theirs as it came.
    objectives: [f64; 3],
    rounding: f64,
}

impl Pair {
    #[track_caller]
    fn new(problem: &Problem, settings: &Settings, inside: &[f64], theirs: &Value) -> Self {
        let ours = estimate(problem, settings).unwrap();
        let raw = vector(&theirs["x"]);
        let x = feasible(problem, settings, &raw, inside);
        let objectives = [&ours.x, &x, &raw].map(|x| objective(problem, settings, x));
        let pair = Pair { ours, x, objectives, rounding: rounding(problem, objectives[1]) };
        let written = number(&theirs["objective"]);
        assert!(
            (objectives[2] - written).abs() <= rounding(problem, written),
            "the problem is another one than that of the table: {} {written}",
            objectives[2]
        );
        pair
    }

    /// Of our objective above theirs; positive by no more than our gap, whatever they found.
    fn excess(&self) -> f64 {
        self.objectives[0] - self.objectives[1]
    }

    fn relative(&self) -> f64 {
        self.excess() / self.objectives[1].max(1.0)
    }

    #[track_caller]
    fn check(&self, problem: &Problem, theirs: &Value, what: &str) {
        let Pair { ours, x, objectives, rounding } = self;
        let status = text(theirs, "status");
        let said = format!("{what}: {objectives:?} gap {:e} {:?} {status}", ours.gap, ours.status);
        assert!(["Solved", "AlmostSolved"].contains(&status), "{said}");
        assert_ne!(ours.status, Status::Stalled, "{said}");
        assert!(self.excess() <= ours.gap + rounding, "ours is above theirs: {said}");
        let moving = (objectives[1] - objectives[2]).max(0.0);
        assert!(self.relative() >= -1e-6 - moving / objectives[1].max(1.0), "theirs is above ours: {said}");
        assert!(self.relative() <= 1e-6, "objectives differ: {said}");
        // F(x) ≥ F* + ‖R (x - x*)‖² for consistent x, and F* ≥ ours - gap.
        let (a, b) = (fitted(problem, &ours.x), fitted(problem, x));
        let distance = square(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()).sqrt();
        let theirs_above = (ours.gap - self.excess() + rounding).max(0.0).sqrt();
        assert!(distance <= (ours.gap + rounding).sqrt() + theirs_above, "{distance:e}: {said}");
    }
}

#[test]
fn both_solvers_find_the_same_optimum() {
    let table = table();
    for (form, count) in [(Form::PseudoInertia, 40), (Form::SpatialInertia, 12)] {
        let settings = Settings { form, ..Settings::default() };
        let of_this_form = |e: &&Value| text(e, "form") == format!("{form:?}");
        let (mut solved, mut constrained, mut bounded, mut worst) = (0, 0, 0, 0.0_f64);
        for entry in entries(&table, "problems").iter().filter(of_this_form) {
            let (problem, truth) = rebuilt(entry);
            let pair = Pair::new(&problem, &settings, &truth, entry);
            pair.check(&problem, entry, &format!("{form:?} seed {}", entry["seed"]));
            solved += 1;
            constrained += usize::from(pair.ours.status == Status::Optimal);
            bounded += usize::from(!problem.bounds.is_empty());
            worst = worst.max(pair.relative().abs());
        }
        println!(
            "{form:?}: {constrained} of {solved} constrained, {bounded} with bounds, differ by {worst:.1e}"
        );
        assert_eq!(solved, count);
        assert!(2 * constrained > count && bounded > 0, "problems that say something");
    }
}

#[test]
fn the_certificate_covers_what_the_conic_solver_leaves() {
    let (table, settings) = (table(), Settings::default());
    let tight = entries(&table, "problems").iter().filter(|e| text(e, "form") == "PseudoInertia").take(30);
    let (mut solved, mut large) = (0, 0);
    for entry in tight.chain(entries(&table, "rough")) {
        let (problem, truth) = rebuilt(entry);
        let pair = Pair::new(&problem, &settings, &truth, entry);
        let gap = certificate(&problem, &settings, &pair.x).unwrap().unwrap();
        // Ours is above the optimum, so that this is less than their true excess.
        let excess = -pair.excess();
        let what = format!("seed {}, {}", entry["seed"], entry["tolerance"]);
        assert!(gap >= excess - pair.rounding, "{what}: {gap:e} {excess:e}");
        solved += 1;
        large += usize::from(excess > 1e-3);
    }
    assert_eq!(solved, 90);
    assert!(large >= 10, "some answers are far from the optimum: {large}");
}

fn bound(name: &str, terms: &[(usize, f64)], upper: f64) -> Bound {
    Bound { name: name.to_owned(), terms: terms.to_vec(), upper }
}

/// A problem of three links with bounds that bodies meet, and with two sets of bounds that none meets.
fn bounded(mut problem: Problem, truth: &[f64]) -> [Problem; 3] {
    let [xx, yy, zz] = [4, 7, 9].map(|k| truth[k]);
    let total: f64 = (0..3).map(|i| truth[10 * i]).sum();
    // Ixx + Iyy ≥ Izz in any body.
    let mut shape = |least: f64| {
        problem.bounds = vec![
            bound("Ixx", &[(4, 1.0)], 1.01 * xx),
            bound("Iyy", &[(7, 1.0)], 1.01 * yy),
            bound("Izz", &[(9, -1.0)], -least),
        ];
        problem.clone()
    };
    let (possible, thick) = (shape(0.99 * zz), shape(1.02 * 1.01 * (xx + yy)));
    problem.bounds = (0..3).map(|i| bound(&format!("m{i}"), &[(10 * i, -1.0)], -0.4 * total)).collect();
    problem.bounds.push(bound("total", &[(0, 1.0), (10, 1.0), (20, 1.0)], total));
    [possible, thick, problem]
}

#[test]
fn both_solvers_refuse_bounds_that_no_body_meets() {
    let (table, settings) = (table(), Settings::default());
    let theirs = &table["bounded"]["possible"];
    let (problem, truth) = random_problem(theirs["seed"].as_u64().unwrap(), Some(3));
    let [possible, thick, heavy] = bounded(problem, &truth);
    Pair::new(&possible, &settings, &truth, theirs).check(&possible, theirs, "possible");
    for (impossible, theirs) in [thick, heavy].iter().zip(entries(&table["bounded"], "refused")) {
        let ours = estimate(impossible, &settings).unwrap_err();
        let ProblemError::Infeasible { conflict, violation } = ours else { panic!("{ours}") };
        for bound in &impossible.bounds {
            assert!(conflict.contains(&bound.name), "{}: {conflict:?}", bound.name);
        }
        assert!(violation > 1e-3, "{violation}");
        assert_eq!(theirs, "PrimalInfeasible");
    }
}

/// Two links with friction and offsets from the reference data, whose optima were found by yet another programme.
#[test]
fn both_solvers_meet_the_reference_numbers() {
    let Some(g) = load("estimation_consistent.json") else { return };
    let table = table();
    let mut checked = 0;
    for case in entries(&g, "cases").iter().filter(|case| number(&case["gamma"]) == 0.0) {
        let (problem, settings) = consistent_golden::case(&g, case);
        let name = text(case, "name");
        let theirs = entries(&table, "reference").iter().find(|e| text(e, "name") == name).unwrap();
        let ours = estimate(&problem, &settings).unwrap();
        let expected = number(&case["objective"]);
        for found in [ours.objective, objective(&problem, &settings, &vector(&theirs["x"]))] {
            assert!((found / expected - 1.0).abs() < 1e-6, "{name}: {found} {expected}");
        }
        checked += 1;
    }
    assert_eq!(checked, entries(&table, "reference").len());
}

/// Problems of any noise: the conic solver fails in every tenth, and still its consistent point bounds the optimum.
#[test]
fn never_above_any_of_a_thousand_consistent_points() {
    let (table, settings) = (table(), Settings::default());
    let survey = entries(&table, "survey");
    assert_eq!(survey.len(), 1000);
    survey.par_iter().for_each(|entry| {
        let (seed, theirs) = (entry[0].as_u64().unwrap(), number(&entry[2]));
        let (problem, _) = random_problem(seed, Some(1 + seed as usize % 7));
        let ours = estimate(&problem, &settings).unwrap();
        let excess = objective(&problem, &settings, &ours.x) - theirs;
        let allowed = ours.gap + rounding(&problem, theirs);
        assert!(excess <= allowed, "seed {seed}: {excess:e} above theirs, {allowed:e} allowed");
    });
}
