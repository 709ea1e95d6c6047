//! Searches on the ER-16 problem.

use crate::er16::{Er16, Motion, median, numbers, reference, value};
use dynid_estimate::effort_objective::{EffortLoss, EffortObjective, EffortObjectiveError};
use dynid_model::EffortModel;
use dynid_search::{Algorithm, Objective, Settings, TentMap, many, rank_sum};

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

/// Residuals of a point, joint after joint, by way of the whole regressor.
fn residuals(robot: &Er16, motion: &Motion, efforts: &[Vec<f64>], x: &[f64]) -> Vec<Vec<f64>> {
    let mut linear = vec![0.0; robot.model.parameters().linear.len()];
    robot.kept.iter().zip(x).for_each(|(c, v)| linear[*c] = *v);
    let n = motion.samples;
    let mut predicted = vec![0.0; 3 * n];
    robot.model.efforts(&motion.block(), &x[robot.kept.len()..], &linear, n, &mut predicted);
    predicted.chunks(n).zip(efforts).map(|(p, e)| e.iter().zip(p).map(|(e, p)| e - p).collect()).collect()
}

/// The 200 samples of the problem over and over, so that there are several groups of rows.
fn long(motion: &Motion, times: usize) -> Motion {
    let repeat = |v: &[f64]| -> Vec<f64> { v.chunks(motion.samples).flat_map(|c| c.repeat(times)).collect() };
    Motion {
        samples: times * motion.samples,
        q: repeat(&motion.q),
        dq: repeat(&motion.dq),
        ddq: repeat(&motion.ddq),
    }
}

#[test]
fn losses_and_weights_are_those_of_the_residuals() {
    let Some(robot) = Er16::load() else { return };
    let motion = long(&robot.motion(), 4);
    let efforts = robot.efforts(&motion, 5);
    let weights = [0.5, 2.0, 0.0];
    let thresholds = [3.0, 1.0, 10.0];
    let mut x = robot.truth();
    x.iter_mut().for_each(|v| *v *= 1.05);
    let all = residuals(&robot, &motion, &efforts, &x);
    let mean = |f: &dyn Fn(usize, f64) -> f64| -> f64 {
        let of = |(j, r): (usize, &Vec<f64>)| weights[j] * r.iter().map(|r| f(j, *r)).sum::<f64>();
        all.iter().enumerate().map(of).sum::<f64>() / motion.samples as f64
    };
    let huber = |j: usize, r: f64| {
        let k: f64 = thresholds[j];
        if r.abs() <= k { 0.5 * r * r } else { k * r.abs() - 0.5 * k * k }
    };
    for (loss, expected) in [
        (EffortLoss::Absolute, mean(&|_, r| r.abs())),
        (EffortLoss::Squared, mean(&|_, r| r * r)),
        (EffortLoss::Huber(thresholds.to_vec()), mean(&huber)),
    ] {
        let found = value(&robot.objective(&motion, &efforts, &weights, loss.clone()), &x);
        assert!((found - expected).abs() <= 1e-11 * expected, "{loss:?}: {found} {expected}");
    }
}

#[test]
fn values_do_not_depend_on_the_group() {
    let Some(robot) = Er16::load() else { return };
    let motion = robot.motion();
    let objective = robot.objective(&motion, &robot.efforts(&motion, 2), &[], EffortLoss::Absolute);
    let truth = robot.truth();
    let points: Vec<f64> =
        (0..27).flat_map(|k| truth.iter().map(move |v| v * (1.0 + 0.01 * k as f64))).collect();
    let mut together = vec![0.0; 27];
    objective.evaluate(&points, &mut together);
    for (point, found) in points.chunks(truth.len()).zip(&together) {
        assert_eq!(value(&objective, point), *found);
    }
}

#[test]
fn objectives_without_meaning_are_refused() {
    let Some(robot) = Er16::load() else { return };
    let motion = robot.motion();
    let mut efforts = robot.efforts(&motion, 2);
    let make = |efforts: &[Vec<f64>], linear: &[usize], weights: &[f64], loss| {
        let efforts: Vec<&[f64]> = efforts.iter().map(Vec::as_slice).collect();
        let made = EffortObjective::new(&robot.model, motion.block(), &efforts, linear, weights, loss);
        made.map(|o| o.dimensions())
    };
    let kept = &robot.kept;
    assert_eq!(make(&efforts, kept, &[], EffortLoss::Absolute), Ok(30));
    let error = make(&efforts, &[999], &[], EffortLoss::Absolute).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::Column { column: 999, .. }), "{error}");
    let error = make(&efforts, &[kept[0], kept[0]], &[], EffortLoss::Absolute).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::Column { .. }), "{error}");
    let error = make(&efforts, kept, &[1.0, -1.0, 1.0], EffortLoss::Absolute).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::Value { output: 1, .. }), "{error}");
    let error = make(&efforts, kept, &[1.0], EffortLoss::Absolute).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::Length { expected: 3, found: 1, .. }), "{error}");
    let error = make(&efforts, kept, &[], EffortLoss::Huber(vec![1.0, 0.0, 1.0])).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::Value { output: 1, .. }), "{error}");
    let error = make(&efforts[..2], kept, &[], EffortLoss::Absolute).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::Length { expected: 3, found: 2, .. }), "{error}");
    efforts[2][17] = f64::NAN;
    let error = make(&efforts, kept, &[], EffortLoss::Absolute).unwrap_err();
    assert!(matches!(error, EffortObjectiveError::NotFinite { output: 2, sample: 17, .. }), "{error}");
}

/// Rows 7 and 8 of the acceptance table, 60 seeds each.
#[test]
fn improved_cuckoos_beat_plain_ones_and_both_beat_the_swarm() {
    let Some(robot) = Er16::load() else { return };
    let motion = robot.motion();
    let efforts = robot.efforts(&motion, 1);
    let objective = robot.objective(&motion, &efforts, &[], EffortLoss::Absolute);
    let of_truth = value(&objective, &robot.truth());
    // E|noise| of standard deviations 4, 5, 3 is 9.57; 600 draws scatter by 0.17.
    assert!((of_truth - 9.57).abs() < 0.5, "{of_truth}");
    let seeds: Vec<u64> = (1..=60).collect();
    let search = |name: &str| {
        let algorithm: Algorithm = name.parse().unwrap();
        many(&algorithm, &objective, &robot.bounds(), &Settings::default(), &seeds).unwrap()
    };
    let [ics, cs, pso] = ["ics", "cs", "pso"].map(search);
    let values = |results: &[_]| -> Vec<f64> {
        results.iter().map(|r: &dynid_search::SearchResult| r.value).collect()
    };
    let medians = [&ics, &cs, &pso].map(|r| median(&values(r)));
    let ics_below_cs = rank_sum(&values(&ics), &values(&cs)).unwrap().less;
    let cs_below_pso = rank_sum(&values(&cs), &values(&pso)).unwrap().less;
    println!("medians {medians:?}, p {ics_below_cs:e} {cs_below_pso:e}");
    assert!(medians[0] < medians[1] && medians[1] < medians[2], "{medians:?}");
    assert!(ics_below_cs < 0.05 && cs_below_pso < 0.05, "{ics_below_cs} {cs_below_pso}");

    let correlations = |results: &[dynid_search::SearchResult]| -> Vec<f64> {
        let best_of_three = results.chunks_exact(3).map(|three| {
            let best = three.iter().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap();
            let rest = residuals(&robot, &motion, &efforts, &best.point);
            let of = |j: usize| {
                let predicted: Vec<f64> = efforts[j].iter().zip(&rest[j]).map(|(e, r)| e - r).collect();
                correlation(&efforts[j], &predicted)
            };
            [of(0), of(1), of(2)]
        });
        let triples: Vec<[f64; 3]> = best_of_three.collect();
        (0..3).map(|j| median(&triples.iter().map(|t| t[j]).collect::<Vec<_>>())).collect()
    };
    for (name, results, required) in
        [("ics", &ics, [0.990, 0.9950, 0.995]), ("cs", &cs, [0.9803, 0.9927, 0.9928])]
    {
        let found = correlations(results);
        println!("{name}: correlations {found:?}");
        assert!(found.iter().zip(required).all(|(f, r)| *f >= r), "{name}: {found:?}");
    }
    println!("pso: correlations {:?}", correlations(&pso));
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (a0, b0) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - a0, b - b0)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}
