//! Shares, limits and verdicts against closed forms, an independent formula and simulated truths.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_estimate::identifiability::{
    Carried, Identifiability, Verdict, VisibleSpace, assess, visible_combinations,
};
use dynid_estimate::linear::ols;
use dynid_factor::{Factor, FactorBuilder};
use dynid_linalg::Mat;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A regrouping of `p` columns into `r` kept ones (identity first), sparse, factors over two decades.
fn random_regrouping(rng: &mut impl Rng, r: usize, p: usize) -> Mat {
    Mat::from_fn(r, p, |i, j| {
        if j < r {
            f64::from(u8::from(i == j))
        } else if rng.random_bool(0.4) {
            normal(rng) * 10f64.powf(rng.random_range(-1.0..1.0))
        } else {
            0.0
        }
    })
}

/// Rows in `r` base columns of which those in `silent` are zero and, if `tied`, the last repeats the first.
fn random_log(rng: &mut impl Rng, r: usize, rows: usize, silent: &[usize], tied: bool) -> Factor {
    let mut builder = FactorBuilder::new(r);
    for _ in 0..rows {
        let mut row: Vec<f64> = (0..r).map(|_| 30.0 * normal(rng)).collect();
        silent.iter().for_each(|c| row[*c] = 0.0);
        if tied {
            row[r - 1] = 2.0 * row[0];
        }
        builder.push_row(&row, 0.0).unwrap();
    }
    builder.finish()
}

/// `(J + C0⁻¹)⁻¹` by an LU of the whitened normal matrix: another route, good to about its condition number.
fn direct_covariance(information: &Factor, kappa: f64, k: &Mat, std: &[f64]) -> Mat {
    let p = std.len();
    let whitened = Mat::from_fn(k.nrows(), p, |i, j| k[(i, j)] * std[j]);
    let r = information.r_matrix() * whitened;
    let normal = r.transpose() * &r * (1.0 / kappa) + Mat::identity(p, p);
    let inverse = normal.lu().inverse();
    Mat::from_fn(p, p, |i, j| std[i] * inverse[(i, j)] * std[j])
}

#[test]
fn shares_agree_with_the_covariance_formula_and_keep_their_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for case in 0..200 {
        let r = rng.random_range(1..12);
        let p = r + rng.random_range(0..12);
        let k = random_regrouping(&mut rng, r, p);
        let std: Vec<f64> = (0..p).map(|_| 10f64.powf(rng.random_range(-2.0..2.0))).collect();
        let silent: Vec<usize> = (0..r).filter(|_| rng.random_bool(0.2)).collect();
        let rows = rng.random_range(0..40);
        let tied = case % 3 == 0 && r > 1 && !silent.contains(&0);
        let log = random_log(&mut rng, r, rows, &silent, tied);
        let kappa = rng.random_range(1.0..20.0);
        let found = assess(&log, kappa, &k, &std);
        let direct = direct_covariance(&log, kappa, &k, &std);
        for (j, a) in found.parameters.iter().enumerate() {
            let (s, l, limit) = (a.achieved, a.log_limit, a.structural_limit);
            assert!(s + (1.0 - l) <= 1.0 + 1e-9, "case {case}, parameter {j}: s {s}, l {l}");
            assert!((0.0..=1.0).contains(&s) && s <= l && l <= limit && limit <= 1.0, "{s} {l} {limit}");
            // The direct route loses digits by the condition of the normal matrix, up to 1e10 here.
            let direct_share = 1.0 - direct[(j, j)] / (std[j] * std[j]);
            assert!(
                (s - direct_share).abs() < 1e-5,
                "case {case}, parameter {j}: {s}, direct {direct_share}"
            );
            assert!((a.posterior_std / std[j] - (1.0 - s).sqrt()).abs() < 1e-7);
        }
        let prior = Mat::from_fn(p, p, |i, j| if i == j { std[i] * std[i] } else { 0.0 });
        let base_prior = &k * &prior * k.transpose();
        let base_posterior = &k * &direct * k.transpose();
        for (i, a) in found.base.iter().enumerate() {
            assert!((a.prior_std.powi(2) / base_prior[(i, i)] - 1.0).abs() < 1e-12);
            let share = 1.0 - base_posterior[(i, i)] / base_prior[(i, i)];
            assert!((a.achieved - share).abs() < 1e-5, "case {case}, base {i}: {}, {share}", a.achieved);
            assert!(a.achieved <= a.log_limit && a.log_limit <= 1.0 && a.structural_limit == 1.0);
            assert_ne!(a.verdict, Verdict::NotIdentifiable);
        }
    }
}

/// A link that swings about a fixed axis with a rotor on it: `Izz + Ia` acts as one, `mx` alone, `m` never.
#[test]
fn a_sum_of_two_shares_its_variance_by_the_priors() {
    let k = Mat::from_fn(2, 4, |i, j| [[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]][i][j]);
    let std = [3.0, 1.0, 2.0, 5.0];
    let mut builder = FactorBuilder::new(2);
    builder.push_row(&[2.0, 0.0], 0.0).unwrap();
    builder.push_row(&[0.0, 0.1], 0.0).unwrap();
    let kappa = 4.0;
    let found = assess(&builder.finish(), kappa, &k, &std);
    // One visible direction (3, 1)/√10 of strength d² = 2² (3² + 1²)/κ; the second of strength (0.1·2)²/κ.
    let d2: f64 = 4.0 * 10.0 / kappa;
    let share = d2 / (1.0 + d2);
    let e2: f64 = 0.04 / kappa;
    let check = |j: usize, s: f64, l: f64, p: f64| {
        let a = &found.parameters[j];
        for (found, expected) in [(a.achieved, s), (a.log_limit, l), (a.structural_limit, p)] {
            assert!((found - expected).abs() < 1e-14, "parameter {j}: {found} against {expected}");
        }
    };
    check(0, 0.9 * share, 0.9, 0.9);
    check(1, 0.1 * share, 0.1, 0.1);
    check(2, e2 / (1.0 + e2), 1.0, 1.0);
    check(3, 0.0, 0.0, 0.0);
    assert_eq!(found.parameters[1].verdict, Verdict::CarriedByPrior(Carried::OnlyInCombination));
    assert_eq!(found.parameters[2].verdict, Verdict::CarriedByPrior(Carried::TooNoisy));
    assert_eq!(found.parameters[3].verdict, Verdict::NotIdentifiable);
    assert!(found.parameters[2].hidden < 1e-20 && (found.parameters[0].hidden - 0.1).abs() < 1e-14);
    assert!((found.base[0].prior_std - 10f64.sqrt()).abs() < 1e-14);
    assert!((found.base[0].posterior_std - (10.0 / (1.0 + d2)).sqrt()).abs() < 1e-14);
    assert_eq!(found.excited, 2);
}

#[test]
fn posterior_deviations_keep_their_digits_when_nearly_everything_is_seen() {
    let mut builder = FactorBuilder::new(1);
    builder.push_row(&[1e11], 0.0).unwrap();
    let found = assess(&builder.finish(), 1.0, &Mat::identity(1, 1), &[2.0]);
    let expected = 1.0 / (1e22 + 0.25f64).sqrt();
    assert!((found.parameters[0].posterior_std / expected - 1.0).abs() < 1e-14);
}

#[test]
fn what_never_moves_is_never_seen_whatever_the_prior() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for scale in [1e-9, 1e-3, 1.0, 1e6, 1e12] {
        let k = random_regrouping(&mut rng, 6, 9);
        let log = random_log(&mut rng, 6, 400, &[2, 4], false).scaled(1e3);
        let std: Vec<f64> = (0..9).map(|j| if j == 2 || j == 4 { scale } else { 1.0 }).collect();
        let found = assess(&log, 1.0, &k, &std);
        for c in [2, 4] {
            let alone = (6..9).all(|j| k[(c, j)] == 0.0);
            let a = &found.parameters[c];
            assert!(a.verdict != Verdict::Seen && a.achieved < 1e-9, "share {}", a.achieved);
            assert!(a.log_limit < 1e-9, "l = {}", a.log_limit);
            assert!(found.base[c].achieved < 1e-9 || !alone);
        }
        assert_eq!(found.excited, 4);
    }
    let none = assess(&Factor::empty(6), 1.0, &random_regrouping(&mut rng, 6, 9), &[1.0; 9]);
    assert_eq!(none.excited, 0);
    assert!(
        none.parameters
            .iter()
            .all(|a| a.log_limit == 0.0 && (a.posterior_std / a.prior_std - 1.0).abs() < 1e-14)
    );
}

#[test]
fn a_model_in_which_nothing_acts_has_verdicts_all_the_same() {
    let found = assess(&Factor::empty(0), 1.0, &Mat::zeros(0, 2), &[1.0, 2.0]);
    assert!(found.base.is_empty() && found.excited == 0);
    assert!(found.parameters.iter().all(|a| a.verdict == Verdict::NotIdentifiable && a.hidden == 1.0));
}

/// Two columns that the motion ties together: their difference is rounding, and however wide the prior and however good
/// the data, neither is seen.
#[test]
fn rounding_is_not_evidence() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut builder = FactorBuilder::new(3);
    for _ in 0..5000 {
        let (a, b) = (normal(&mut rng), normal(&mut rng));
        builder.push_row(&[a, 0.3 * a, b], 0.0).unwrap();
    }
    let precise = builder.finish().scaled(1e15);
    let found = assess(&precise, 1.0, &Mat::identity(3, 3), &[1.0; 3]);
    assert_eq!(found.excited, 2);
    // Prior 1 each on a x1 + 0.3 a x2: shares 1/1.09 and 0.09/1.09.
    assert!((found.parameters[0].achieved - 1.0 / 1.09).abs() < 1e-9);
    assert!((found.parameters[1].achieved - 0.09 / 1.09).abs() < 1e-9);
    assert_eq!(found.parameters[1].verdict, Verdict::CarriedByPrior(Carried::NotExcited));
    assert_eq!(found.parameters[2].verdict, Verdict::Seen);
}

/// Truths drawn from the prior, logs with noise: the posterior interval of what is seen holds the truth as often as it
/// says, and so does that of everything else.
#[test]
fn intervals_of_seen_parameters_hold_the_truth() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut inside, mut all, mut inside_rest, mut rest) = (0usize, 0usize, 0usize, 0usize);
    for _ in 0..400 {
        let (r, p) = (8, 12);
        let k = random_regrouping(&mut rng, r, p);
        let std: Vec<f64> = (0..p).map(|_| 10f64.powf(rng.random_range(-1.5..1.5))).collect();
        let x0: Vec<f64> = (0..p).map(|_| normal(&mut rng)).collect();
        let truth: Vec<f64> = (0..p).map(|j| x0[j] + std[j] * normal(&mut rng)).collect();
        let (mut base_log, mut log) = (FactorBuilder::new(r), FactorBuilder::new(p));
        let sizes: Vec<f64> = (0..r).map(|_| 10f64.powf(rng.random_range(-2.0..1.5))).collect();
        for _ in 0..60 {
            let row: Vec<f64> =
                (0..r).map(|c| if c == 3 { 0.0 } else { sizes[c] * normal(&mut rng) }).collect();
            let full: Vec<f64> = (0..p).map(|j| (0..r).map(|i| row[i] * k[(i, j)]).sum()).collect();
            let effort: f64 = full.iter().zip(&truth).map(|(w, x)| w * x).sum::<f64>() + normal(&mut rng);
            base_log.push_row(&row, effort).unwrap();
            log.push_row(&full, effort).unwrap();
        }
        let found = assess(&base_log.finish(), 1.0, &k, &std);
        let weights: Vec<f64> = std.iter().map(|s| 1.0 / s).collect();
        let estimate = ols(&log.finish().with_prior_rows(&weights, &x0));
        assert!(estimate.dropped.is_empty());
        for (j, a) in found.parameters.iter().enumerate() {
            let hit = usize::from((estimate.x[j] - truth[j]).abs() <= 2.575_829 * a.posterior_std);
            if a.verdict == Verdict::Seen {
                (inside, all) = (inside + hit, all + 1);
            } else {
                (inside_rest, rest) = (inside_rest + hit, rest + 1);
            }
        }
    }
    let (seen, others) = (inside as f64 / all as f64, inside_rest as f64 / rest as f64);
    assert!(all > 1000 && rest > 500, "{all} seen, {rest} not");
    assert!(seen >= 0.95, "{seen} of {all}");
    // 99 % by construction; four binomial standard errors of about 0.3 %.
    assert!((seen - 0.99).abs() < 0.012 && (others - 0.99).abs() < 0.012, "{seen}, {others}");
}

#[test]
fn the_same_numbers_give_the_same_bits() {
    let run = |threads: usize| -> Identifiability {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut rng = ChaCha8Rng::seed_from_u64(9);
            let k = random_regrouping(&mut rng, 40, 60);
            let log = random_log(&mut rng, 40, 300, &[7], true);
            assess(&log, 1.5, &k, &vec![0.7; 60])
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(7));
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let k = random_regrouping(&mut rng, 40, 60);
    let log = random_log(&mut rng, 40, 300, &[7], true);
    let shares = VisibleSpace::new(&k, &vec![0.7; 60]).shares(&log, 1.5);
    assert!(shares.iter().zip(&one.parameters).all(|(s, a)| (s - a.achieved).abs() < 1e-14));
}

#[test]
fn a_combination_names_its_largest_terms() {
    // Columns: mx2, m3, m4, my9, tiny. Base 0 is named after mx2, base 1 after my9.
    let k = Mat::from_fn(2, 5, |i, j| [[1.0, 0.45, 0.45, 0.0, 1e-3], [0.0, -0.01, 0.0, 1.0, 0.0]][i][j]);
    let symbols = ["mx2", "m3", "m4", "my9", "tiny"];
    let found = visible_combinations(&k, &[1.0; 5], &[0, 3], 1);
    assert_eq!(found.iter().map(|c| c.base).collect::<Vec<_>>(), [0, 1]);
    let largest = &found[0];
    assert!((largest.share - 0.2025 / (1.0 + 2.0 * 0.2025 + 1e-6)).abs() < 1e-12);
    assert!(largest.shortened);
    assert_eq!(largest.expression(&symbols), "mx2 + 0.45·(m3 + m4) + …");
    assert_eq!(
        largest.sentence(&symbols, Some((4.8123, 0.021)), "kg m"),
        "the data see mx2 + 0.45·(m3 + m4) + … = 4.81 ± 0.02 kg m; the split follows the prior"
    );
    assert_eq!(
        found[1].sentence(&symbols, None, "kg m"),
        "only my9 + … acts on the effort, and these data do not determine it"
    );
    let lengths = [(0.45, "distance joint 2-3".to_owned())];
    assert_eq!(largest.constants(&lengths), ["0.45 = distance joint 2-3"]);
    assert!(visible_combinations(&k, &[1.0; 5], &[0, 3], 4).len() == 1);
}

/// Variances of standard parameters by way of the base parameters are those of the assessment.
#[test]
fn base_parameters_tell_what_is_known_of_standard_ones() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for _ in 0..50 {
        let r = rng.random_range(1..10);
        let p = r + rng.random_range(0..10);
        let k = random_regrouping(&mut rng, r, p);
        let std: Vec<f64> = (0..p).map(|_| 10f64.powf(rng.random_range(-2.0..1.0))).collect();
        let log = random_log(&mut rng, r, 3 * r, &[], false);
        let space = VisibleSpace::new(&k, &std);
        let (prior, information) = (space.prior_information(), log.r_matrix());
        let sum = prior.transpose() * &prior + information.transpose() * &information;
        let covariance = sum.lu().inverse();
        for (j, assessed) in space.assess(&log, 1.0).parameters.iter().enumerate() {
            let c = Mat::column(&space.seen_through(j));
            let seen = (c.transpose() * &covariance * &c)[(0, 0)];
            let found = (seen + assessed.hidden * std[j].powi(2)).sqrt();
            let wanted = assessed.posterior_std;
            // The inverse of the normal matrix is good to its condition number.
            assert!((found - wanted).abs() < 1e-6 * std[j].max(wanted), "{j}: {found} against {wanted}");
        }
    }
}
