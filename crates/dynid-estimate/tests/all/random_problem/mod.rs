//! Random identification problems with known truth, from easy to hopeless.

use dynid_estimate::consistent::{Bound, LinkPrior, Problem, ScalarPrior};
use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_model::symmetric::{Square, cholesky, congruence};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Twelve points of mass in a box: always a body.
pub(crate) fn random_body(rng: &mut ChaCha8Rng) -> Inertia {
    let size: [f64; 3] = std::array::from_fn(|_| rng.random_range(0.02..0.3));
    let centre: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.3..0.3));
    let mut p: Square<4> = [[0.0; 4]; 4];
    for _ in 0..12 {
        let m = rng.random_range(0.02..1.0);
        let r: [f64; 4] =
            std::array::from_fn(|k| if k == 3 { 1.0 } else { centre[k] + size[k] * normal(rng) });
        for i in 0..4 {
            (0..4).for_each(|j| p[i][j] += m * r[i] * r[j]);
        }
    }
    Inertia::from_pseudo_inertia(&p)
}

fn perturbed(body: &Inertia, size: f64, rng: &mut ChaCha8Rng) -> Inertia {
    let l = cholesky(&body.pseudo_inertia()).expect("points in general position");
    let half: Square<4> = std::array::from_fn(|i| {
        std::array::from_fn(|j| match i.cmp(&j) {
            std::cmp::Ordering::Less => 0.2 * size * normal(rng),
            std::cmp::Ordering::Equal => 0.5 + 0.5 * size * rng.random_range(-1.0..1.0),
            std::cmp::Ordering::Greater => 0.0,
        })
    });
    let change: Square<4> = std::array::from_fn(|i| std::array::from_fn(|j| half[i][j] + half[j][i]));
    let factor = if size > 0.35 { 10f64.powf(rng.random_range(-1.0..1.0)) } else { 1.0 };
    let mut p = congruence(&l, &change);
    p.iter_mut().flatten().for_each(|x| *x *= factor);
    Inertia::from_pseudo_inertia(&p)
}

/// A problem of 1 to 14 links with a rotor inertia, Coulomb and viscous friction and an offset each.
///
/// Fewer rows than columns as after a reduction, columns of very different lengths, signal-to-noise ratios of 1 to 1e6,
/// links without data in 40 % of the problems, priors off by up to 40 % (some of these also by a factor of ten), bounds
/// that the truth meets in every fifth problem.
pub(crate) fn random_problem(seed: u64, links: Option<usize>) -> (Problem, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = links.unwrap_or_else(|| rng.random_range(1..=14));
    let truth: Vec<Inertia> = (0..n).map(|_| random_body(&mut rng)).collect();
    let mut x: Vec<f64> = truth.iter().flat_map(|b| b.0).collect();
    for _ in 0..n {
        x.extend([
            rng.random_range(0.0..0.5),
            rng.random_range(0.0..8.0),
            rng.random_range(0.0..15.0),
            normal(&mut rng),
        ]);
    }
    let p = x.len();
    let silent: Vec<bool> = {
        let some = rng.random_bool(0.4);
        (0..n).map(|_| some && rng.random_bool(0.3)).collect()
    };
    let rows = p - 3 * n - usize::from(n > 1);
    let noise_free = 10f64.powf(rng.random_range(0.0..6.0));
    let grading = rng.random_range(0.0..2.5);
    let grades: Vec<f64> = (0..rows).map(|_| 10f64.powf(-grading * rng.random_range(0.0..1.0))).collect();
    let r = Mat::from_fn(rows, p, |i, j| {
        if j < 10 * n && silent[j / 10] { 0.0 } else { noise_free * grades[i] * normal(&mut rng) }
    });
    let z = (0..rows).map(|i| (0..p).map(|j| r[(i, j)] * x[j]).sum::<f64>() + normal(&mut rng)).collect();
    let size = rng.random_range(0.0..0.4);
    let priors = truth
        .iter()
        .enumerate()
        .map(|(i, b)| LinkPrior {
            name: format!("link{i}"),
            first_column: 10 * i,
            prior: perturbed(b, size, &mut rng),
        })
        .collect();
    let scales = [0.1, 2.0, 4.0, 1.0];
    let scalars = (10 * n..p)
        .map(|column| ScalarPrior {
            name: format!("s{column}"),
            column,
            prior: 0.0,
            scale: scales[(column - 10 * n) % 4],
            nonnegative: (column - 10 * n) % 4 != 3,
        })
        .collect();
    let mut bounds = Vec::new();
    if rng.random_bool(0.2) {
        let total: f64 = truth.iter().map(Inertia::mass).sum();
        let masses: Vec<(usize, f64)> = (0..n).map(|i| (10 * i, 1.0)).collect();
        bounds.push(Bound { name: "total".to_owned(), terms: masses.clone(), upper: 1.02 * total });
        let least = masses.iter().map(|(c, f)| (*c, -f)).collect();
        bounds.push(Bound { name: "least total".to_owned(), terms: least, upper: -0.98 * total });
        bounds.push(Bound { name: "mass 0".to_owned(), terms: vec![(0, 1.0)], upper: 1.3 * truth[0].mass() });
    }
    (Problem { r, z, links: priors, scalars, bounds, equalities: Vec::new(), prior_std: Vec::new() }, x)
}
