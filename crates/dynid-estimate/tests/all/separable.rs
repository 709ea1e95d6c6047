//! Separable fits against golden numbers, Monte-Carlo draws, closed forms and bad input.

use crate::golden;
use dynid_estimate::separable::{
    Bound, Deviations, RowGroup, SeparableError, SeparableLoss, SeparableProblem, SeparableSettings,
    ShapeVerdict, ShapedColumns, Weighting, fit,
};
use dynid_model::ShapeParameter;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// `y = c0 s(v) + c1 s(v) exp(-(v/vs)²) + c2 v + c3` in groups of rows.
#[derive(Debug, Clone)]
struct StribeckRows {
    speeds: Vec<Vec<f64>>,
    groups: Vec<RowGroup>,
    shape: Vec<ShapeParameter>,
}

fn sign(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

fn vs(start: f64, lower: f64, upper: f64) -> ShapeParameter {
    ShapeParameter { name: "joint.vs".into(), unit: "rad/s", start, lower, upper, logarithmic: true }
}

impl StribeckRows {
    fn new(speeds: &[&[f64]], efforts: &[&[f64]], blocks: usize, shape: ShapeParameter) -> Self {
        let group = |(output, (v, y)): (usize, (&&[f64], &&[f64]))| {
            let length = v.len().div_ceil(blocks).max(1);
            let columns = [v.iter().map(|v| sign(*v)).collect(), v.to_vec(), vec![1.0; v.len()]];
            RowGroup {
                output,
                block_rows: v.chunks(length).map(<[f64]>::len).collect(),
                fixed: vec![0, 2, 3],
                fixed_values: columns.concat(),
                effort: y.to_vec(),
                shaped: vec![Some(1)],
                dependence: vec![(0, 0)],
                ..RowGroup::default()
            }
        };
        StribeckRows {
            groups: speeds.iter().zip(efforts).enumerate().map(group).collect(),
            speeds: speeds.iter().map(|v| v.to_vec()).collect(),
            shape: vec![shape],
        }
    }
}

impl SeparableProblem for StribeckRows {
    fn linear(&self) -> usize {
        4
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.shape
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        for (speeds, out) in self.speeds.iter().zip(out).filter(|_| !shape.is_empty()) {
            for (i, v) in speeds.iter().enumerate() {
                let x = (v / shape[0]).powi(2);
                out.value_mut(0)[i] = sign(*v) * (-x).exp();
                out.derivative_mut(0)[i] = sign(*v) * (-x).exp() * 2.0 * x / shape[0];
            }
        }
    }
}

fn equal() -> SeparableSettings {
    SeparableSettings { weighting: Weighting::Equal, ..SeparableSettings::default() }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn speeds(count: usize) -> Vec<f64> {
    (0..count).map(|k| 1.5 * (0.61 * k as f64).sin() * (0.05 + (0.0173 * k as f64).cos().abs())).collect()
}

fn efforts(v: &[f64], c: [f64; 4], vs: f64, mut noise: impl FnMut() -> f64) -> Vec<f64> {
    let clean = |v: f64| c[0] * sign(v) + c[1] * sign(v) * (-(v / vs).powi(2)).exp() + c[2] * v + c[3];
    v.iter().map(|v| clean(*v) + noise()).collect()
}

#[test]
fn golden_numbers_of_variable_projection() {
    let Some(golden) = golden::load("estimation_varpro.json") else { return };
    let (v, y) = (golden::vector(&golden["v"]), golden::vector(&golden["y"]));
    let problem = StribeckRows::new(&[&v], &[&y], 1, vs(0.3, 0.005, 2.0));
    let estimate = fit(&problem, &equal()).unwrap();
    golden::check_close("vs", &estimate.shape, &[golden::number(&golden["vs"])], 1e-6);
    golden::check_close("c", &estimate.linear, &golden::vector(&golden["c"]), 1e-6);
    golden::check_close("rss", &[estimate.rss], &[golden::number(&golden["rss"])], 1e-6);
    let covariance = estimate.linearised.as_ref().unwrap().model_covariance();
    for (i, row) in golden["covariance"].as_array().unwrap().iter().enumerate() {
        for (j, expected) in golden::vector(row).into_iter().enumerate() {
            let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            assert!((covariance[(i, j)] - expected).abs() <= 1e-6 * size, "covariance[{i}, {j}]");
        }
    }
    println!("golden: {} of {} starts", estimate.starts.reached, estimate.starts.outcomes.len());
    assert_eq!(estimate.findings[0].verdict, ShapeVerdict::Seen);
}

/// z-scores of all five parameters over 400 draws; two outputs with different noise, weights estimated.
#[test]
fn covariance_of_all_parameters_is_that_of_repeated_draws() {
    let (draws, truth, truth_vs) = (400, [4.0, 2.0, 3.0, 0.3], 0.15);
    let (v, w) = (speeds(300), speeds(200));
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut squares, mut inside, mut count) = ([0.0; 5], 0, 0);
    for _ in 0..draws {
        let y = efforts(&v, truth, truth_vs, || 0.2 * normal(&mut rng));
        let z = efforts(&w, truth, truth_vs, || 0.05 * normal(&mut rng));
        let problem = StribeckRows::new(&[&v, &w], &[&y, &z], 1, vs(0.3, 0.01, 2.0));
        let settings = SeparableSettings { starts: 3, profile_points: 0, ..SeparableSettings::default() };
        let estimate = fit(&problem, &settings).unwrap();
        let Deviations { linear, shape } = estimate.standard_deviations().unwrap();
        let found = estimate.linear.iter().chain(&estimate.shape);
        for (k, ((x, s), t)) in
            found.zip(linear.iter().chain(&shape)).zip(truth.iter().chain([&truth_vs])).enumerate()
        {
            let score = (x - t) / s.unwrap();
            squares[k] += score * score;
            inside += usize::from(score.abs() < 1.96);
            count += 1;
        }
    }
    let spread = squares.map(|s| (s / f64::from(draws)).sqrt());
    let coverage = 100.0 * inside as f64 / f64::from(count);
    println!("spread of z-scores {spread:.3?}, 95 % intervals hold {coverage:.1} %");
    // The standard error of a spread over 400 draws is 0.035.
    assert!(spread.iter().all(|s| (0.93..1.07).contains(s)));
    assert!((93.0..97.0).contains(&coverage));
}

#[test]
fn weights_follow_the_noise_of_each_output() {
    let (v, w) = (speeds(800), speeds(700));
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let y = efforts(&v, [4.0, 2.0, 3.0, 0.3], 0.15, || 0.5 * normal(&mut rng));
    let z = efforts(&w, [4.0, 2.0, 3.0, 0.3], 0.15, || 0.01 * normal(&mut rng));
    let problem = StribeckRows::new(&[&v, &w], &[&y, &z], 12, vs(0.3, 0.01, 2.0));
    let estimate = fit(&problem, &SeparableSettings::default()).unwrap();
    assert!((estimate.variances[0].sqrt() / 0.5 - 1.0).abs() < 0.1);
    assert!((estimate.variances[1].sqrt() / 0.01 - 1.0).abs() < 0.1);
    let fitted = estimate.linearised.as_ref().unwrap();
    let shares: f64 = fitted.groups.iter().map(|g| g.leverage).sum();
    assert!((shares - 5.0).abs() < 1e-6, "the shape takes a degree of freedom: {shares}");
    assert!((estimate.rss - 1495.0).abs() < 1e-3, "weighted rss is N - p: {}", estimate.rss);
    let deviation = estimate.jackknife_deviations().unwrap().shape;
    assert!(deviation[0].unwrap() > 0.0 && estimate.inflation >= 1.0);
}

#[test]
fn gross_errors_are_survived_by_robust_losses() {
    let v = speeds(600);
    let truth = [4.0, 2.0, 3.0, 0.3];
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut k = 0;
    let y = efforts(&v, truth, 0.15, || {
        k += 1;
        if k % 20 == 0 { 8.0 } else { 0.05 * normal(&mut rng) }
    });
    let problem = StribeckRows::new(&[&v], &[&y], 12, vs(0.3, 0.01, 2.0));
    let error = |loss| {
        let estimate = fit(&problem, &SeparableSettings { loss, ..SeparableSettings::default() }).unwrap();
        println!("{loss:?}: {:?} {:?}, {} passes", estimate.linear, estimate.shape, estimate.passes);
        assert!(estimate.settled);
        (estimate.linear.iter().zip(&truth).map(|(x, t)| (x - t).abs()).fold(0.0, f64::max), estimate)
    };
    let (plain, _) = error(SeparableLoss::Squares);
    let (huber, of_huber) = error(SeparableLoss::Huber);
    let (absolute, of_absolute) = error(SeparableLoss::Absolute);
    assert!(10.0 * huber < plain && 10.0 * absolute < plain, "{plain} {huber} {absolute}");
    assert!(of_absolute.linearised.is_none());
    // The robust fit of the linearised rows moves nothing: both are the same minimum.
    let linearised = of_huber.linearised.as_ref().unwrap();
    let Deviations { linear, shape } = of_huber.standard_deviations().unwrap();
    for (k, s) in linear.iter().chain(&shape).enumerate() {
        let moved = if k < 4 { linearised.x[k] - of_huber.linear[k] } else { linearised.x[k] };
        assert!(moved.abs() < 0.05 * s.unwrap(), "parameter {k} moves by {moved}");
    }
}

#[test]
fn a_shape_the_data_do_not_see_is_said_and_not_invented() {
    let v = speeds(400);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    // No Stribeck term at all: its speed multiplies nothing.
    let y = efforts(&v, [4.0, 0.0, 3.0, 0.3], 0.15, || 0.2 * normal(&mut rng));
    let problem = StribeckRows::new(&[&v], &[&y], 12, vs(0.3, 0.05, 1.0));
    let estimate = fit(&problem, &equal()).unwrap();
    println!("{:?}", estimate.findings[0].verdict);
    assert_eq!(estimate.findings[0].verdict, ShapeVerdict::NotSeen);
    assert_eq!(estimate.shape, [0.3], "held at the start");
    assert_eq!(estimate.standard_deviations().unwrap().shape, [None]);
    assert!(estimate.active.is_empty());
    assert_eq!(estimate.findings[0].profile.len(), 16);
}

#[test]
fn a_shape_seen_from_one_side_gets_an_interval_and_its_limit_a_name() {
    // No sample below 0.2 rad/s: Stribeck speeds below some 0.07 cannot be told from none.
    let v: Vec<f64> = speeds(400).into_iter().map(|v| v + 0.2 * sign(v)).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let y = efforts(&v, [4.0, 0.0, 3.0, 0.3], 0.15, || 0.02 * normal(&mut rng));
    let mut problem = StribeckRows::new(&[&v], &[&y], 1, vs(0.3, 0.005, 1.0));
    // The Stribeck coefficient is known to be 1 here, so that its speed acts by itself.
    for group in &mut problem.groups {
        group.shaped = vec![None];
    }
    let estimate = fit(&problem, &equal()).unwrap();
    let finding = &estimate.findings[0];
    println!("{:?} at {:?}: {:?} {:?}", finding.verdict, estimate.shape, finding.at_bound, finding.limit);
    let ShapeVerdict::OneSided { lower, upper } = finding.verdict else { panic!("{:?}", finding.verdict) };
    assert!(lower == 0.005 && (0.05..0.15).contains(&upper), "{lower} .. {upper}");
    assert_eq!(problem.limit(0, Bound::Lower).map(|l| l.starts_with("Coulomb")), Some(true));
}

#[test]
fn the_same_bits_from_any_number_of_threads() {
    let v = speeds(900);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let y = efforts(&v, [4.0, 2.0, 3.0, 0.3], 0.15, || 0.3 * normal(&mut rng));
    let problem = StribeckRows::new(&[&v, &v[..500]], &[&y, &y[..500]], 12, vs(0.3, 0.01, 2.0));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit(&problem, &SeparableSettings::default()).unwrap())
    };
    let one = with(1);
    assert!([2, 7].into_iter().all(|threads| with(threads) == one));
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let (v, y) = (speeds(50), vec![1.0; 50]);
    let good = || StribeckRows::new(&[&v], &[&y], 1, vs(0.3, 0.01, 2.0));
    let refused = |problem: &StribeckRows| fit(problem, &equal()).unwrap_err();

    assert_eq!(refused(&StribeckRows::new(&[&[]], &[&[]], 1, vs(0.3, 0.01, 2.0))), SeparableError::NoRows);
    let mut problem = good();
    problem.groups[0].effort[7] = f64::NAN;
    let error = refused(&problem);
    assert!(matches!(error, SeparableError::NotFinite { group: 0, column: None, row: 7, .. }), "{error}");
    problem = good();
    problem.groups[0].fixed_values[60] = f64::INFINITY;
    let error = refused(&problem);
    assert!(matches!(error, SeparableError::NotFinite { column: Some(2), row: 10, .. }), "{error}");
    problem = good();
    problem.shape[0] = vs(0.3, 2.0, 0.01);
    assert!(matches!(refused(&problem), SeparableError::Bounds { lower: 2.0, upper: 0.01, .. }));
    problem.shape[0] = vs(f64::NAN, 0.01, 2.0);
    assert!(matches!(refused(&problem), SeparableError::Start { .. }));
    problem.shape[0] = vs(0.3, -1.0, 2.0);
    assert!(matches!(refused(&problem), SeparableError::Logarithm { .. }));
    problem = good();
    problem.groups[0].block_rows = vec![49];
    assert!(matches!(refused(&problem), SeparableError::Size { expected: 50, found: 49, .. }));
    problem = good();
    problem.groups[0].dependence = vec![(0, 1)];
    assert!(matches!(refused(&problem), SeparableError::Size { .. }));
}

#[test]
fn fewer_rows_than_parameters_is_a_status() {
    let v = [0.1, -0.4, 0.9];
    let y = efforts(&v, [4.0, 2.0, 3.0, 0.3], 0.15, || 0.0);
    let estimate = fit(&StribeckRows::new(&[&v], &[&y], 1, vs(0.3, 0.01, 2.0)), &equal()).unwrap();
    assert!(!estimate.dependent.is_empty());
    assert_eq!(estimate.findings[0].verdict, ShapeVerdict::NotSeen);
    assert!(estimate.rss < 1e-20);
}

/// Without shape parameters nothing is searched: weighted least squares.
#[test]
fn a_linear_problem_is_solved_as_such() {
    let v = speeds(100);
    let y = efforts(&v, [4.0, 0.0, 3.0, 0.3], 0.15, || 0.0);
    let mut problem = StribeckRows::new(&[&v], &[&y], 1, vs(0.3, 0.01, 2.0));
    problem.shape.clear();
    problem.groups[0].shaped.clear();
    problem.groups[0].dependence.clear();
    for settings in [equal(), SeparableSettings::default()] {
        let estimate = fit(&problem, &settings).unwrap();
        golden::check_close("c", &estimate.linear, &[4.0, 0.0, 3.0, 0.3], 1e-12);
        assert_eq!((estimate.dependent, estimate.findings.len()), (vec![1], 0));
    }
}
