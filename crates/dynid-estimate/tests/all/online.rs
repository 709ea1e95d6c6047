//! The recursive estimator against batch solutions of the same rows, and what stands beside it.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::extended::{DoubleDouble, ExtendedFactor};
use crate::golden::{check_close, load, number, vector};
use dynid_estimate::consistent::{Problem, Settings as ConsistentSettings, Status, estimate};
use dynid_estimate::linear::ols;
use dynid_estimate::online::{
    BlockWindow, ConsistentPublisher, Estimator, Forgetting, RowNoise, RowWindow, Settings, SquareRoot,
    chow_test, factor_from_root, root_from_factor,
};
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

fn plain(columns: usize, rows: usize, forgetting: Forgetting) -> Settings {
    let mut settings = Settings::new(vec![0.0; columns], vec![1e3; columns], rows);
    settings.forgetting = forgetting;
    settings.detection = None;
    settings.reaction = None;
    settings
}

/// Twelve columns of norms 1e-9 to 1e3, one row a sample; `excited` says which columns a sample has.
struct Graded {
    random: ChaCha8Rng,
    excited: Excited,
}

type Excited = fn(usize, usize) -> bool;

const COLUMNS: usize = 12;

fn grade(column: usize) -> f64 {
    10f64.powf(-9.0 + 12.0 * column as f64 / (COLUMNS - 1) as f64)
}

impl Graded {
    fn row(&mut self, sample: usize) -> Vec<f64> {
        let mut row: Vec<f64> = (0..COLUMNS)
            .map(|c| grade(c) * normal(&mut self.random) * f64::from((self.excited)(sample, c)))
            .collect();
        // Every parameter moves the effort by about as much.
        let clean: f64 = row.iter().enumerate().map(|(c, f)| f / grade(c) * (1.0 + c as f64)).sum();
        row.push(clean + 0.01 * normal(&mut self.random));
        row
    }
}

fn batch(rows: &[Vec<f64>]) -> Vec<f64> {
    let mut factor = ExtendedFactor::new(COLUMNS);
    rows.iter().for_each(|row| factor.push(row.iter().map(|v| DoubleDouble::from(*v))));
    factor.solve().x
}

fn worst(root: &SquareRoot, expected: &[f64]) -> f64 {
    let mut x = vec![0.0; COLUMNS];
    assert!(root.solve(&mut x));
    x.iter().zip(expected).map(|(f, e)| (f / e - 1.0).abs()).fold(0.0, f64::max)
}

/// Against double-double arithmetic over exactly the samples in the window.
#[test]
fn windows_over_graded_columns_keep_eight_digits() {
    const LENGTH: usize = 200;
    let cases: [(&str, Excited); 3] = [
        ("steady", |_, _| true),
        // A third of the columns is silent but for 20 samples of every 150.
        ("intermittent", |sample, column| column % 3 != 0 || sample % 150 < 20),
        // Each of these has one strong sample of 199 and is all but silent otherwise.
        ("rare", |sample, column| column % 4 != 1 || sample % 199 == 7 * column),
    ];
    for (name, excited) in cases {
        let mut stream = Graded { random: ChaCha8Rng::seed_from_u64(5), excited };
        let mut blocks = BlockWindow::new(SquareRoot::new(COLUMNS), LENGTH / 20, 20, 1);
        let mut moving = RowWindow::new(SquareRoot::new(COLUMNS), LENGTH / 20, 20, 1);
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let (mut of_blocks, mut of_moving) = (0.0_f64, 0.0_f64);
        for sample in 0..3000 {
            let row = stream.row(sample);
            blocks.push(&row);
            moving.push(&row);
            rows.push(row);
            if sample > 2 * LENGTH && sample % 7 == 0 {
                let exact = |count: usize| batch(&rows[rows.len() - count..]);
                of_moving = of_moving.max(worst(moving.total(), &exact(LENGTH)));
                assert_eq!(moving.samples(), LENGTH);
                // The rare case leaves columns unseen in windows that are a block shorter.
                if name != "rare" {
                    of_blocks = of_blocks.max(worst(blocks.total(), &exact(blocks.samples())));
                }
            }
        }
        println!("{name}: blocks {of_blocks:.1e}, rows {of_moving:.1e}, {} refreshes", moving.refreshes());
        assert!(of_blocks < 1e-8 && of_moving < 1e-8, "{name}: {of_blocks:e} {of_moving:e}");
    }
}

#[test]
fn without_forgetting_every_estimate_is_the_batch_solution() {
    let (p, m) = (8, 3);
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut settings = plain(p, m, Forgetting::None);
    settings.scale = (0..p).map(|c| 10f64.powi(c as i32 - 4)).collect();
    settings.prior_std = settings.scale.iter().map(|s| 1e2 * s).collect();
    let mut estimator = Estimator::new(settings.clone()).unwrap();
    let mut builder = FactorBuilder::new(p);
    for (j, std) in settings.prior_std.iter().enumerate() {
        let row: Vec<f64> = (0..p).map(|c| f64::from(c == j) / std).collect();
        builder.push_row(&row, 0.0).unwrap();
    }
    let mut batch = builder.take();
    let mut largest = 0.0_f64;
    for k in 0..400 {
        let phi: Vec<f64> = (0..m * p).map(|k| normal(&mut random) / settings.scale[k % p]).collect();
        let std = [0.1, 0.2, 0.05];
        let effort: Vec<f64> = phi
            .chunks_exact(p)
            .zip(std)
            .map(|(row, s)| {
                row.iter().zip(&settings.scale).map(|(f, s)| f * s).sum::<f64>() + s * normal(&mut random)
            })
            .collect();
        estimator.step(&phi, &effort, RowNoise::Std(&std)).unwrap();
        builder.push_factor(&batch);
        for ((row, y), s) in phi.chunks_exact(p).zip(&effort).zip(std) {
            let row: Vec<f64> = row.iter().map(|f| f / s).collect();
            builder.push_row(&row, y / s).unwrap();
        }
        batch = builder.take();
        if k >= p / m {
            let x = ols(&batch).x;
            for (f, e) in estimator.x().iter().zip(&x) {
                largest = largest.max((f / e - 1.0).abs());
            }
        }
    }
    println!("largest relative difference {largest:.1e}");
    assert!(largest < 1e-9, "{largest:e}");
    // And the whole state, there and back.
    let factor = factor_from_root(estimator.information(), &settings.scale);
    assert!((factor.rho() / batch.rho() - 1.0).abs() < 1e-9);
    assert_eq!(factor.rows(), 400 * m);
    for i in 0..p {
        for j in i..p {
            let size = batch.column_norms()[j];
            assert!((factor.r(i, j) - batch.r(i, j)).abs() < 1e-11 * size, "{i} {j}");
        }
    }
    let back = root_from_factor(&factor, &settings.scale, 1.0);
    let mut x = vec![0.0; p];
    assert!(back.solve(&mut x));
    for ((found, expected), scale) in x.iter().zip(estimator.x()).zip(&settings.scale) {
        assert!((found * scale / expected - 1.0).abs() < 1e-11);
    }
    assert!((back.rss() / estimator.information().rss() - 1.0).abs() < 1e-11);
    assert!((back.weight() - 1200.0).abs() < 1e-9);
    // A run that starts from the log's factor.
    let started = Estimator::starting_from(settings.clone(), back).unwrap();
    for (found, expected) in started.x().iter().zip(estimator.x()) {
        assert!((found / expected - 1.0).abs() < 1e-11);
    }
    assert!(Estimator::starting_from(settings.clone(), SquareRoot::new(p)).is_err());
    assert!(Estimator::starting_from(settings, SquareRoot::new(p + 1)).is_err());
}

#[test]
fn chow_test_matches() {
    let Some(g) = load("estimation_rls.json") else { return };
    let phi = g["Phi"].as_array().unwrap();
    let effort = g["y"].as_array().unwrap();
    let reduce = |range: std::ops::Range<usize>| -> Factor {
        let mut builder = FactorBuilder::new(3);
        for k in range {
            for (row, y) in phi[k].as_array().unwrap().iter().zip(vector(&effort[k])) {
                builder.push_row(&vector(row), y).unwrap();
            }
        }
        builder.finish()
    };
    let test = chow_test(&reduce(0..20), &reduce(20..30), 1.0).unwrap();
    check_close("F", &[test.f], &[number(&g["chow_F"])], 1e-8);
    assert!(test.p_value > 0.5 && test.moved(0.05).count() == 0);
    let inflated = chow_test(&reduce(0..20), &reduce(20..30), 2.0).unwrap();
    check_close("F", &[inflated.f], &[0.5 * test.f], 1e-12);
    assert_eq!(chow_test(&reduce(0..20), &reduce(20..21), 1.0), None);
    assert_eq!(chow_test(&reduce(0..20), &reduce(20..30), 0.5), None);
}

/// Two stretches of 60 rows, four parameters; rows of the second with `change` added to the third.
fn two_stretches(seed: u64, change: f64) -> (Factor, Factor) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut reduce = |truth: [f64; 4]| {
        let mut builder = FactorBuilder::new(4);
        for _ in 0..60 {
            let row: Vec<f64> = (0..4).map(|_| normal(&mut random)).collect();
            let clean: f64 = row.iter().zip(truth).map(|(f, x)| f * x).sum();
            builder.push_row(&row, clean + 0.3 * normal(&mut random)).unwrap();
        }
        builder.finish()
    };
    (reduce([1.0, -2.0, 3.0, 0.5]), reduce([1.0, -2.0, 3.0 + change, 0.5]))
}

#[test]
fn chow_test_keeps_its_level_and_names_what_moved() {
    let (mut rejected, mut any) = (0, 0);
    for seed in 0..2000 {
        let (first, second) = two_stretches(seed, 0.0);
        let test = chow_test(&first, &second, 1.0).unwrap();
        rejected += usize::from(test.p_value < 0.05);
        any += usize::from(test.moved(0.05).count() > 0);
    }
    println!("{rejected} of 2000 rejected, {any} named a parameter at 5 %");
    // 100 expected; 4.75 binomial deviations. Holm is at most the level.
    assert!((54..=147).contains(&rejected), "{rejected}");
    assert!(any <= 147, "{any}");
    for seed in 0..50 {
        let (first, second) = two_stretches(seed, 0.5);
        let test = chow_test(&first, &second, 1.0).unwrap();
        assert!(test.p_value < 0.01 && test.parameters[0].parameter == 2, "{test:?}");
        assert!((test.parameters[0].change - 0.5).abs() < 0.3);
    }
}

/// Rows of a random robot through the estimator, and the same with the prior's rows in one problem.
#[test]
fn published_estimates_are_the_consistent_optimum_of_the_state() {
    for seed in [1, 4, 9] {
        let (problem, _) = crate::random_problem::random_problem(seed, Some(2));
        let p = problem.columns();
        let mut settings = plain(p, 1, Forgetting::None);
        settings.prior_std = vec![30.0; p];
        settings.scale = vec![1.0; p];
        let mut estimator = Estimator::new(settings).unwrap();
        let mut publisher = ConsistentPublisher::new(problem.clone(), ConsistentSettings::default(), 10);
        let mut published = 0;
        for i in 0..problem.r.nrows() {
            let row: Vec<f64> = (0..p).map(|j| problem.r[(i, j)]).collect();
            estimator.step(&row, &[problem.z[i]], RowNoise::Std(&[1.0])).unwrap();
            let before = estimator.save();
            published += usize::from(publisher.step(&estimator).unwrap().is_some());
            assert_eq!(estimator.save(), before, "the state is not projected");
        }
        assert_eq!(published, problem.r.nrows() / 10);
        let found = publisher.publish(&estimator).unwrap().clone();
        assert_eq!(found.samples, problem.r.nrows() as u64);
        let rows = problem.r.nrows();
        let whole = Problem {
            r: Mat::from_fn(rows + p, p, |i, j| match i.checked_sub(rows) {
                None => problem.r[(i, j)],
                Some(k) => f64::from(k == j) / 30.0,
            }),
            z: problem.z.iter().copied().chain(vec![0.0; p]).collect(),
            ..problem
        };
        let expected = estimate(&whole, &ConsistentSettings::default()).unwrap();
        let got = &found.estimate;
        println!("seed {seed}: {:?}, price {:.3}, against {:.3}", got.status, got.price(), expected.price());
        assert!(got.status != Status::Stalled && got.least_eigenvalue.unwrap() > 0.0);
        // The same problem but for what the residual adds to both fits; each is within its own gap.
        let tolerance = got.gap + expected.gap + 1e-9 * (1.0 + expected.unconstrained_fit);
        assert!((got.price() - expected.price()).abs() <= tolerance, "{} {}", got.price(), expected.price());
    }
}
