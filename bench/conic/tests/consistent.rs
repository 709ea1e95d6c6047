//! Two solvers that share the definition of a body and nothing else, on one set of problems.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

#[path = "../../../crates/dynid-estimate/tests/all/random_problem/mod.rs"]
mod random_problem;

use std::collections::BTreeMap;
use std::path::Path;

use dynid_conic::{Answer, Conic, SolverStatus};

use dynid_estimate::consistent::{
    Bound, ConsistentEstimate, Form, LinkPrior, Margin, Problem, ProblemError, ScalarPrior, Settings, Status,
    certificate, entropic, estimate,
};
use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_model::symmetric::{cholesky, congruence, least_eigenvalue, lower_inverse};
use random_problem::random_problem;
use rayon::prelude::*;
use serde_json::{Value, json};

/// Tolerance of the conic solver for gap and feasibility.
const TIGHT: f64 = 1e-11;
/// The method's own tolerance grows with rounding, `1e-13 ‖z‖²`. Below this it plays no part.
const MODERATE: f64 = 1e7;

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
    theirs: Answer,
    /// Estimate of the conic solver, made feasible.
    x: Vec<f64>,
    /// Objectives from the definition: ours, theirs made feasible, theirs as it came.
    objectives: [f64; 3],
    /// Rounding in an objective: each residual is off by some ulps of an effort.
    rounding: f64,
}

impl Pair {
    fn new(problem: &Problem, settings: &Settings, inside: &[f64], tolerance: f64) -> Self {
        let ours = estimate(problem, settings).unwrap();
        let theirs = Conic::new(problem, settings).solve(tolerance);
        let x = feasible(problem, settings, &theirs.x, inside);
        let objectives = [&ours.x, &x, &theirs.x].map(|x| objective(problem, settings, x));
        let rounding = 16.0 * f64::EPSILON * (square(&problem.z) * objectives[1].max(1.0)).sqrt();
        Pair { ours, theirs, x, objectives, rounding }
    }

    /// Of our objective above theirs; positive by no more than our gap, whatever they found.
    fn excess(&self) -> f64 {
        self.objectives[0] - self.objectives[1]
    }

    fn relative(&self) -> f64 {
        self.excess() / self.objectives[1].max(1.0)
    }

    #[track_caller]
    fn check(&self, problem: &Problem, what: &str) {
        let Pair { ours, theirs, x, objectives, rounding } = self;
        let said = format!("{what}: {objectives:?} gap {:e} {:?} {:?}", ours.gap, ours.status, theirs.status);
        assert!(matches!(theirs.status, SolverStatus::Solved | SolverStatus::AlmostSolved), "{said}");
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

/// The first `count` problems of moderate noise, of 1 to 7 links, with their truths.
fn moderate(count: usize) -> impl Iterator<Item = (u64, Problem, Vec<f64>)> {
    let all = (0..).map(|seed| {
        let (problem, truth) = random_problem(seed, Some(1 + seed as usize % 7));
        (seed, problem, truth)
    });
    all.filter(|(_, problem, _)| square(&problem.z) < MODERATE).take(count)
}

#[test]
fn both_solvers_find_the_same_optimum() {
    for (form, count) in [(Form::PseudoInertia, 40), (Form::SpatialInertia, 12)] {
        let settings = Settings { form, ..Settings::default() };
        let (mut constrained, mut bounded, mut worst) = (0, 0, 0.0_f64);
        for (seed, problem, truth) in moderate(count) {
            let pair = Pair::new(&problem, &settings, &truth, TIGHT);
            pair.check(&problem, &format!("{form:?} seed {seed}"));
            constrained += usize::from(pair.ours.status == Status::Optimal);
            bounded += usize::from(!problem.bounds.is_empty());
            worst = worst.max(pair.relative().abs());
        }
        println!(
            "{form:?}: {constrained} of {count} constrained, {bounded} with bounds, differ by {worst:.1e}"
        );
        assert!(2 * constrained > count && bounded > 0, "problems that say something");
    }
}

#[test]
fn the_certificate_covers_what_the_conic_solver_leaves() {
    let settings = Settings::default();
    let mut large = 0;
    for (seed, problem, truth) in moderate(30) {
        for tolerance in [TIGHT, 1e-3, 1e-2] {
            let pair = Pair::new(&problem, &settings, &truth, tolerance);
            let gap = certificate(&problem, &settings, &pair.x).unwrap().unwrap();
            // Ours is above the optimum, so that this is less than their true excess.
            let excess = -pair.excess();
            assert!(gap >= excess - pair.rounding, "seed {seed}, {tolerance:e}: {gap:e} {excess:e}");
            large += usize::from(excess > 1e-3);
        }
    }
    assert!(large >= 10, "some answers are far from the optimum: {large}");
}

fn bound(name: &str, terms: &[(usize, f64)], upper: f64) -> Bound {
    Bound { name: name.to_owned(), terms: terms.to_vec(), upper }
}

/// A problem of three links with bounds that bodies meet, and with two sets of bounds that none meets.
fn bounded() -> (u64, [Problem; 3], Vec<f64>) {
    let (seed, mut problem, truth) = moderate(60).find(|(_, p, _)| p.links.len() == 3).unwrap();
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
    (seed, [possible, thick, problem], truth)
}

#[test]
fn both_solvers_refuse_bounds_that_no_body_meets() {
    let settings = Settings::default();
    let (seed, [possible, thick, heavy], truth) = bounded();
    Pair::new(&possible, &settings, &truth, TIGHT).check(&possible, &format!("possible, seed {seed}"));
    for impossible in [&thick, &heavy] {
        let ours = estimate(impossible, &settings).unwrap_err();
        let ProblemError::Infeasible { conflict, violation } = ours else { panic!("{ours}") };
        for bound in &impossible.bounds {
            assert!(conflict.contains(&bound.name), "{}: {conflict:?}", bound.name);
        }
        assert!(violation > 1e-3, "{violation}");
        // Data do not matter here, and with them it gives up ("insufficient progress") on the second problem.
        let bare = Problem { r: Mat::zeros(0, impossible.columns()), z: Vec::new(), ..impossible.clone() };
        let theirs = Conic::new(&bare, &Settings { prior_weight: 1.0, ..settings.clone() }).solve(TIGHT);
        assert_eq!(theirs.status, SolverStatus::PrimalInfeasible);
    }
}

struct Case {
    name: String,
    problem: Problem,
    settings: Settings,
    objective: f64,
}

/// Two links with friction and offsets from the reference data, whose optima were found by yet another programme.
fn reference_cases() -> Option<Vec<Case>> {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/spec/golden/estimation_consistent.json");
    let text = std::fs::read_to_string(path).ok()?;
    let g: Value = serde_json::from_str(&text).unwrap();
    let vector =
        |v: &Value| -> Vec<f64> { v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    let rows: Vec<Vec<f64>> = g["R"].as_array().unwrap().iter().map(vector).collect();
    let [prior, scale, nonnegative] = ["prior", "scale", "kind_nonneg"].map(|key| vector(&g[key]));
    let mut cases = Vec::new();
    for case in g["cases"].as_array().unwrap() {
        let number = |key: &str| case[key].as_f64().unwrap();
        if number("gamma") != 0.0 {
            continue;
        }
        let given = case["bounds"].as_array().into_iter().flatten().map(|b| Bound {
            name: "given".to_owned(),
            terms: vector(&b["row"]).into_iter().enumerate().filter(|(_, f)| *f != 0.0).collect(),
            upper: b["upper"].as_f64().unwrap(),
        });
        let link =
            |i: usize| LinkPrior { name: format!("l{i}"), first_column: 10 * i, prior: body(&prior, 10 * i) };
        let scalar = |k: usize| ScalarPrior {
            name: format!("s{k}"),
            column: 20 + k,
            prior: prior[20 + k],
            scale: scale[k],
            nonnegative: nonnegative[k] == 1.0,
        };
        let problem = Problem {
            r: Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]),
            z: vector(&g["z"]),
            links: (0..2).map(link).collect(),
            scalars: (0..scale.len()).map(scalar).collect(),
            bounds: given.collect(),
            prior_std: Vec::new(),
        };
        let settings = Settings {
            prior_weight: number("delta"),
            margin: Margin::Relative(number("eps")),
            ..Settings::default()
        };
        let name = case["name"].as_str().unwrap().to_owned();
        cases.push(Case { name, problem, settings, objective: number("objective") });
    }
    Some(cases)
}

#[test]
fn both_solvers_meet_the_reference_numbers() {
    let Some(cases) = reference_cases() else {
        println!("skipped: ../shared not present");
        return;
    };
    assert!(!cases.is_empty());
    for Case { name, problem, settings, objective: expected } in cases {
        let ours = estimate(&problem, &settings).unwrap();
        let theirs = Conic::new(&problem, &settings).solve(TIGHT);
        for found in [ours.objective, objective(&problem, &settings, &theirs.x)] {
            assert!((found / expected - 1.0).abs() < 1e-6, "{name}: {found} {expected}");
        }
    }
}

/// Answers as entries of the table, a line each.
fn entries(form: Form, count: usize, tolerance: f64) -> Vec<Value> {
    let settings = Settings { form, ..Settings::default() };
    let entry = |(seed, problem, _): (u64, Problem, Vec<f64>)| {
        let theirs = Conic::new(&problem, &settings).solve(tolerance);
        json!({
            "seed": seed, "links": problem.links.len(), "form": format!("{form:?}"), "tolerance": tolerance,
            "status": format!("{:?}", theirs.status), "objective": objective(&problem, &settings, &theirs.x),
            "x": theirs.x,
        })
    };
    moderate(count).map(entry).collect()
}

/// `cargo test --release the_table -- --ignored` writes what `dynid-estimate` compares itself with.
#[test]
#[ignore = "writes a file"]
fn the_table_of_solved_problems() {
    let settings = Settings::default();
    let mut problems = entries(Form::PseudoInertia, 40, TIGHT);
    problems.extend(entries(Form::SpatialInertia, 12, TIGHT));
    let rough = [1e-3, 1e-2].into_iter().flat_map(|tolerance| entries(Form::PseudoInertia, 30, tolerance));

    let (seed, [possible, thick, heavy], _) = bounded();
    let theirs = Conic::new(&possible, &settings).solve(TIGHT);
    let possible = json!({
        "seed": seed, "status": format!("{:?}", theirs.status),
        "objective": objective(&possible, &settings, &theirs.x), "x": theirs.x,
    });
    let refused = [&thick, &heavy].map(|problem| {
        let bare = Problem { r: Mat::zeros(0, problem.columns()), z: Vec::new(), ..problem.clone() };
        let theirs = Conic::new(&bare, &Settings { prior_weight: 1.0, ..settings.clone() }).solve(TIGHT);
        json!(format!("{:?}", theirs.status))
    });
    let reference = reference_cases().expect("the reference numbers").into_iter().map(|case| {
        let theirs = Conic::new(&case.problem, &case.settings).solve(TIGHT);
        json!({
            "name": case.name, "status": format!("{:?}", theirs.status),
            "objective": objective(&case.problem, &case.settings, &theirs.x), "x": theirs.x,
        })
    });
    let survey = |seed: u64| {
        let (problem, truth) = random_problem(seed, Some(1 + seed as usize % 7));
        let pair = Pair::new(&problem, &settings, &truth, TIGHT);
        json!([seed, format!("{:?}", pair.theirs.status), pair.objectives[1]])
    };
    let survey: Vec<Value> = (0..1000).into_par_iter().map(survey).collect();

    let lines = |values: Vec<Value>| {
        let lines: Vec<String> = values.iter().map(Value::to_string).collect();
        format!("[\n{}\n]", lines.join(",\n"))
    };
    let about = json!({
        "solver": "Clarabel.rs 0.11.1, features sdp and serde (Goulart and Chen 2024, arXiv:2405.12762)",
        "dense_routines": "plain loops in place of BLAS and LAPACK (bench/conic/blas-src)",
        "settings": "tol_gap_abs = tol_gap_rel = tol_feas = tolerance, 1e-11 where none is said; \
            chordal decomposition off; all others as they come",
        "posed_as": "min t such that |(R xi - q, rho)| <= t, links positive semidefinite, scalars and bounds on \
            half-lines, xi whitened by the priors; the objective is t^2",
        "made_by": "the last revision that holds bench/conic, `git log -- bench/conic`: in it \
            `cargo test --release the_table -- --ignored`",
        "problems": "random_problem(seed, links): the first of |z|^2 < 1e7 with links = 1 + seed mod 7; x as the \
            solver left it, consistent up to its tolerance; objective from its definition at that x",
        "rough": "as problems, at loose tolerances",
        "bounded": "the first problem of three links with the bounds of the test; refused: status with bounds that \
            no body meets, without data",
        "reference": "cases of estimation_consistent.json without entropic weight",
        "survey": "seed, status, objective from its definition at the nearest consistent point on the way to the \
            truth; problems of any noise, links = 1 + seed mod 7",
    });
    let bounded = json!({ "possible": possible, "refused": refused });
    let text = format!(
        "{{\n\"about\": {about:#},\n\"problems\": {},\n\"rough\": {},\n\"bounded\": {bounded},\n\"reference\": {},\n\
        \"survey\": {}\n}}\n",
        lines(problems),
        lines(rough.collect()),
        lines(reference.collect()),
        lines(survey),
    );
    let path = "../../crates/dynid-estimate/tests/data/solved_problems.json";
    std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join(path), text).unwrap();
}

fn figures(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    format!("median {:.1e}, 95 % {:.1e}, most {:.1e}", at(0.5), at(0.95), at(1.0))
}

fn counts(ends: impl Iterator<Item = String>) -> String {
    let mut counts = BTreeMap::new();
    ends.for_each(|end| *counts.entry(end).or_insert(0) += 1);
    format!("{counts:?}")
}

/// Both solvers on a thousand problems of any noise: `cargo test --release -- --ignored --nocapture`.
#[test]
#[ignore = "a survey of 1000 problems that measures and prints; the ordinary run checks the moderate ones"]
fn a_thousand_problems() {
    let settings = Settings::default();
    let solve = |seed: u64| {
        let (problem, truth) = random_problem(seed, Some(1 + seed as usize % 7));
        let pair = Pair::new(&problem, &settings, &truth, TIGHT);
        let (excess, allowed) = (pair.excess(), pair.ours.gap + pair.rounding);
        assert!(excess <= allowed, "seed {seed}: {excess:e} above theirs, {allowed:e} allowed");
        (square(&problem.z) < MODERATE, pair)
    };
    let pairs: Vec<(bool, Pair)> = (0..1000).into_par_iter().map(solve).collect();
    for (what, wanted) in [("moderate noise", true), ("little noise", false)] {
        let pairs: Vec<&Pair> = pairs.iter().filter(|(m, _)| *m == wanted).map(|(_, p)| p).collect();
        println!("{what}: {} problems", pairs.len());
        println!("  ours end {}", counts(pairs.iter().map(|p| format!("{:?}", p.ours.status))));
        println!("  theirs end {}", counts(pairs.iter().map(|p| format!("{:?}", p.theirs.status))));
        println!("  ours above theirs: {}", figures(pairs.iter().map(|p| p.relative()).collect()));
        println!("  theirs above ours: {}", figures(pairs.iter().map(|p| -p.relative()).collect()));
        println!("  iterations ours {}", figures(pairs.iter().map(|p| p.ours.iterations as f64).collect()));
        println!(
            "  iterations theirs {}",
            figures(pairs.iter().map(|p| p.theirs.iterations.into()).collect())
        );
    }
}
