//! Searches on five classical functions and on the ER-16 problem, one thread, figures as JSON.
//!
//! ```text
//! search_functions problem                     the ER-16 problem as plain numbers, for other programs
//! search_functions run SEEDS ALGORITHM...      best values of every seed, evaluations per second of the fastest
//! ```
//!
//! `bench/search/compare.py` puts them beside those of a Python package.

#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

#[path = "../tests/all/er16/mod.rs"]
mod er16;

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Instant;

use dynid_estimate::effort_objective::EffortLoss;
use dynid_model::{EffortModel, RegressorBlock};
use dynid_search::{Algorithm, Bounds, Objective, PointObjective, Settings, run};
use er16::{Er16, Motion};
use serde_json::json;

/// Evaluations per coordinate on the functions.
const EVALUATIONS_PER_COORDINATE: u64 = 1000;
/// Evaluations on the ER-16 problem: those of 25 nests in 200 iterations.
const EVALUATIONS_ER16: u64 = 10_025;
/// Seed of the noise of the ER-16 problem.
const NOISE: u64 = 1;

/// The first seed; settings were chosen on seeds 1 to 15.
const FIRST_SEED: u64 = 101;

type Function = fn(&[f64]) -> f64;

/// Name, half width of the box, function; all have their minimum 0 inside.
const FUNCTIONS: [(&str, f64, Function); 5] = [
    ("sphere", 100.0, sphere),
    ("rosenbrock", 30.0, rosenbrock),
    ("rastrigin", 5.12, rastrigin),
    ("ackley", 32.0, ackley),
    ("griewank", 600.0, griewank),
];

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
}

fn rastrigin(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x - 10.0 * (std::f64::consts::TAU * x).cos() + 10.0).sum()
}

fn ackley(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    let waves = x.iter().map(|x| (std::f64::consts::TAU * x).cos()).sum::<f64>() / n;
    20.0 - 20.0 * (-0.2 * (sphere(x) / n).sqrt()).exp() + std::f64::consts::E - waves.exp()
}

fn griewank(x: &[f64]) -> f64 {
    let product: f64 = x.iter().enumerate().map(|(i, x)| (x / (i as f64 + 1.0).sqrt()).cos()).product();
    1.0 + sphere(x) / 4000.0 - product
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["problem"] => print_problem(),
        ["run", seeds, names @ ..] => measure(seeds.parse()?, names),
        _ => Err("expected: problem | run SEEDS ALGORITHM...".into()),
    }
}

fn measure(seeds: usize, names: &[&str]) -> Result<(), Box<dyn Error>> {
    for name in names {
        let algorithm: Algorithm = name.parse()?;
        for dimensions in [10, 30] {
            for (function, half, f) in FUNCTIONS {
                let bounds = Bounds::new(vec![-half; dimensions], vec![half; dimensions])?;
                let objective = PointObjective::new(dimensions, f);
                let budget = EVALUATIONS_PER_COORDINATE * dimensions as u64;
                report((name, &algorithm), (function, &objective), &bounds, budget, seeds)?;
            }
        }
        if let Some(robot) = Er16::load() {
            let motion = robot.motion();
            let efforts = robot.efforts(&motion, NOISE);
            let objective = robot.objective(&motion, &efforts, &[], EffortLoss::Absolute);
            report((name, &algorithm), ("er16", &objective), &robot.bounds(), EVALUATIONS_ER16, seeds)?;
        }
    }
    Ok(())
}

fn report(
    (name, algorithm): (&str, &Algorithm),
    (function, objective): (&str, &dyn Objective),
    bounds: &Bounds,
    budget: u64,
    seeds: usize,
) -> Result<(), Box<dyn Error>> {
    let mut values = Vec::new();
    let mut fastest = 0.0_f64;
    for seed in (FIRST_SEED..).take(seeds) {
        let settings = Settings { evaluations: Some(budget), seed, ..Settings::default() };
        let begin = Instant::now();
        let result = run(algorithm, objective, bounds, &settings, &mut |_| ControlFlow::Continue(()))?;
        fastest = fastest.max(result.evaluations as f64 / begin.elapsed().as_secs_f64());
        values.push(result.value);
    }
    let line = json!({
        "algorithm": name, "function": function, "dimensions": bounds.dimensions(), "budget": budget,
        "values": values, "evaluations_per_second": fastest,
    });
    println!("{line}");
    Ok(())
}

/// Everything that another program needs for the same objective.
fn print_problem() -> Result<(), Box<dyn Error>> {
    let robot = Er16::load().ok_or("no reference data")?;
    let motion: Motion = robot.motion();
    let model = &robot.model;
    let mut block = RegressorBlock::new(model.layout().clone(), motion.samples);
    model.regressor(&motion.block(), &model.parameters().shape_start(), &mut block);
    let shaped: Vec<usize> = model.shaped_columns().iter().map(|(_, column)| *column).collect();
    let outputs: Vec<_> = (0..3)
        .map(|j| {
            let column = |c: usize| -> Vec<f64> {
                let place = model.layout().columns(j).iter().position(|k| *k == c);
                place.map_or(vec![0.0; motion.samples], |k| block.column(j, k).to_vec())
            };
            let fixed = |c: &usize| if shaped.contains(c) { vec![0.0; motion.samples] } else { column(*c) };
            robot.kept.iter().map(fixed).collect::<Vec<_>>()
        })
        .collect();
    let amplitude = |c: &usize| robot.kept.iter().position(|k| k == c);
    let (bounds, efforts) = (robot.bounds(), robot.efforts(&motion, NOISE));
    let objective = robot.objective(&motion, &efforts, &[], EffortLoss::Absolute);
    let line = json!({
        "lower": bounds.lower(), "upper": bounds.upper(), "columns": outputs, "effort": efforts,
        "velocity": motion.dq.chunks(motion.samples).collect::<Vec<_>>(),
        "amplitudes": shaped.iter().map(amplitude).collect::<Vec<_>>(),
        "truth": robot.truth(), "value_of_truth": er16::value(&objective, &robot.truth()),
    });
    println!("{line}");
    Ok(())
}
