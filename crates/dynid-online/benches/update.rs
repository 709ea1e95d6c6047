//! Time per sample, against the covariance recursion: `cargo bench -p dynid-online --bench update`.
//!
//! Prints ratios of best times first.
#![expect(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark reports to the terminal")]

use divan::{Bencher, black_box};
use dynid_online::{DetectionSettings, Estimator, Forgetting, RowNoise, Settings, SquareRoot, Whiteness};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::time::Instant;

const SIZES: [(usize, usize); 3] = [(6, 1), (6, 2), (60, 6)];

fn main() {
    for (p, m) in SIZES {
        let count = 2_000_000 / (p * p * m);
        let mut covariance = Covariance::new(p, m);
        let mut root = Root::new(p, m);
        let mut whole = Whole::new(p, m, Forgetting::Constant { lambda: 0.999 });
        let best = |run: &mut dyn FnMut()| {
            let timed = |run: &mut dyn FnMut()| {
                let start = Instant::now();
                (0..count).for_each(|_| run());
                start.elapsed().as_secs_f64() / count as f64 * 1e6
            };
            (0..9).map(|_| timed(run)).fold(f64::INFINITY, f64::min)
        };
        let old = best(&mut || covariance.update());
        let new = best(&mut || root.update());
        let all = best(&mut || whole.step());
        println!(
            "{p} parameters, {m} rows: square root {new:.2} us, covariance {old:.2} us (ratio {:.2}), whole step {all:.2} us",
            new / old
        );
    }
    divan::main();
}

#[divan::bench(args = SIZES)]
fn covariance_update(bencher: Bencher<'_, '_>, (p, m): (usize, usize)) {
    let mut run = Covariance::new(p, m);
    bencher.bench_local(|| run.update());
}

#[divan::bench(args = SIZES)]
fn square_root_update(bencher: Bencher<'_, '_>, (p, m): (usize, usize)) {
    let mut run = Root::new(p, m);
    bencher.bench_local(|| run.update());
}

/// Every kind of forgetting; the step also evaluates innovations, change detection and the estimate.
#[divan::bench(args = ["none", "constant", "directional", "drift", "block window", "row window"])]
fn step_of_60_by_6(bencher: Bencher<'_, '_>, kind: &str) {
    let forgetting = match kind {
        "none" => Forgetting::None,
        "constant" => Forgetting::Constant { lambda: 0.999 },
        "directional" => Forgetting::Directional { lambda: 0.999, tolerance: 1e-6 },
        "drift" => Forgetting::Drift { rate: vec![1e-3; 60], interval: 1e-3 },
        "block window" => Forgetting::BlockWindow { samples: 2000, blocks: 20 },
        _ => Forgetting::RowWindow { samples: 2000, blocks: 20 },
    };
    let mut run = Whole::new(60, 6, forgetting);
    (0..4000).for_each(|_| run.step());
    bencher.bench_local(|| run.step());
}

#[divan::bench(args = [1, 6], sample_count = 20)]
fn threshold(rows: usize) -> f64 {
    dynid_online::cusum_threshold(black_box(rows), 1.5, 1e8)
}

/// Blocks of a window are merged twice each on average, and as many as the window has when its front runs out.
#[divan::bench(args = [6, 60])]
fn merge(bencher: Bencher<'_, '_>, p: usize) {
    let mut run = Root::new(p, 6);
    (0..100).for_each(|_| run.update());
    let (other, mut scratch) = (run.root.clone(), vec![0.0; p * (p + 1)]);
    bencher.bench_local(|| run.root.merge(&other, &mut scratch));
}

/// Rows of 64 samples, again and again.
struct Rows {
    entries: Vec<f64>,
    size: usize,
    next: usize,
}

impl Rows {
    fn new(width: usize, m: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let size = width * m;
        Self { entries: (0..64 * size).map(|_| StandardNormal.sample(&mut random)).collect(), size, next: 0 }
    }

    fn take(&mut self) -> &[f64] {
        self.next = (self.next + 1) % 64;
        &self.entries[self.next * self.size..][..self.size]
    }
}

struct Root {
    rows: Rows,
    copy: Vec<f64>,
    root: SquareRoot,
    x: Vec<f64>,
}

impl Root {
    fn new(p: usize, m: usize) -> Self {
        let root = SquareRoot::from_prior(&vec![0.0; p], &vec![1.0; p]);
        Self { rows: Rows::new(p + 1, m), copy: vec![0.0; m * (p + 1)], root, x: vec![0.0; p] }
    }

    fn update(&mut self) {
        self.copy.copy_from_slice(self.rows.take());
        self.root.discount(0.999);
        self.root.push(&mut self.copy);
        black_box(self.root.solve(&mut self.x));
    }
}

/// `L = Pφ/(λ + φᵀPφ)`, `x ← x + L e`, `P ← (P - LφᵀP)/λ`, row by row, `P` kept symmetric.
struct Covariance {
    rows: Rows,
    p: usize,
    covariance: Vec<f64>,
    gain: Vec<f64>,
    x: Vec<f64>,
}

impl Covariance {
    fn new(p: usize, m: usize) -> Self {
        let covariance = (0..p * p).map(|k| f64::from(k / p == k % p)).collect();
        Self { rows: Rows::new(p + 1, m), p, covariance, gain: vec![0.0; p], x: vec![0.0; p] }
    }

    fn update(&mut self) {
        let p = self.p;
        let mut lambda = 0.999;
        for row in self.rows.take().chunks_exact(p + 1) {
            self.gain.fill(0.0);
            for (f, own) in row.iter().zip(self.covariance.chunks_exact(p)) {
                self.gain.iter_mut().zip(own).for_each(|(g, c)| *g += f * c);
            }
            let size = lambda + row.iter().zip(&self.gain).map(|(f, g)| f * g).sum::<f64>();
            let error = row[p] - row.iter().zip(&self.x).map(|(f, x)| f * x).sum::<f64>();
            self.x.iter_mut().zip(&self.gain).for_each(|(x, g)| *x += g / size * error);
            for (g, own) in self.gain.iter().zip(self.covariance.chunks_exact_mut(p)) {
                let factor = g / size;
                own.iter_mut().zip(&self.gain).for_each(|(c, h)| *c = (*c - factor * h) / lambda);
            }
            lambda = 1.0;
        }
        black_box(&self.x);
    }
}

struct Whole {
    regressor: Rows,
    effort: Rows,
    estimator: Estimator,
    std: Vec<f64>,
}

impl Whole {
    fn new(p: usize, m: usize, forgetting: Forgetting) -> Self {
        let mut settings = Settings::new(vec![0.0; p], vec![10.0; p], m);
        settings.forgetting = forgetting;
        settings.reaction = None;
        settings.detection =
            Some(DetectionSettings { whiteness: Whiteness::White, ..DetectionSettings::default() });
        let estimator = Estimator::new(settings).unwrap();
        Self { regressor: Rows::new(p, m), effort: Rows::new(1, m), estimator, std: vec![1.0; m] }
    }

    fn step(&mut self) {
        let noise = RowNoise::Std(&self.std);
        black_box(self.estimator.step(self.regressor.take(), self.effort.take(), noise).unwrap());
    }
}
