//! Searches on the ER-16 problem (spec/er16.md sections 7 and 10).

mod er16;

use std::ops::ControlFlow;

use dynid_estimate::search::{
    Algorithm, EffortLoss, Objective, SearchResult, Settings, TentMap, many, rank_sum, run,
};
use er16::{Er16, Motion, median, numbers, reference, value};

#[test]
fn tent_map_agrees_with_golden_numbers() {
    let Some(golden) = reference("golden/er16_tent.json") else { return };
    let expected = numbers(&golden["sequence"]);
    let mut tent = TentMap { slope: golden["gamma"].as_f64().unwrap(), value: expected[0] };
    // Rounding grows by 1.2 per step; the file asks for 25 numbers.
    for e in &expected[1..25] {
        assert!((tent.advance() - e).abs() <= 1e-9, "{} {e}", tent.value);
    }
}

#[test]
fn objective_agrees_with_golden_numbers() {
    let (Some(golden), Some(robot)) = (reference("golden/er16_identification.json"), Er16::load()) else {
        return;
    };
    let motion = Motion::from_rows(&golden["q"], &golden["qd"], &golden["qdd"]);
    let rows: Vec<Vec<f64>> = golden["tau"].as_array().unwrap().iter().map(numbers).collect();
    let efforts: Vec<Vec<f64>> = (0..3).map(|j| rows.iter().map(|r| r[j]).collect()).collect();
    let absolute = robot.objective(&motion, &efforts, &[], EffortLoss::Absolute);
    for case in golden["objective_cases"].as_array().unwrap() {
        let found = value(&absolute, &robot.ours(&numbers(&case["x"])));
        let expected = case["F"].as_f64().unwrap();
        assert!((found - expected).abs() <= 1e-8, "{found} {expected}");
    }
    let squared = robot.objective(&motion, &efforts, &[], EffortLoss::Squared);
    let reference = &golden["reference_ls"];
    let rss = motion.samples as f64 * value(&squared, &robot.ours(&numbers(&reference["x"])));
    let expected = reference["rss"].as_f64().unwrap();
    assert!((rss - expected).abs() <= 1e-8 * expected, "{rss} {expected}");
}

#[test]
fn probe() {
    let Some(robot) = Er16::load() else { return };
    let motion = robot.motion();
    for noise in [1, 2] {
        let efforts = robot.efforts(&motion, noise);
        let objective = robot.objective(&motion, &efforts, &[], EffortLoss::Absolute);
        println!("F(truth) {}", value(&objective, &robot.truth()));
        let seeds: Vec<u64> = (1..=30).collect();
        let mut all = Vec::new();
        for name in Algorithm::NAMES {
            let algorithm: Algorithm = name.parse().unwrap();
            let settings =
                Settings { evaluations: Some(10_025), iterations: Some(100_000), ..Settings::default() };
            let begin = std::time::Instant::now();
            let results = many(&algorithm, &objective, &robot.bounds(), &settings, &seeds).unwrap();
            let values: Vec<f64> = results.iter().map(|r| r.value).collect();
            println!(
                "{name} median {} {:?} evaluations {}",
                median(&values),
                begin.elapsed(),
                results[0].evaluations
            );
            all.push(values);
        }
        println!("{:?}", rank_sum(&all[3], &all[2]));
    }
}
