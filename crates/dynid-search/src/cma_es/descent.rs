//! One descent of the strategy, from a mean to where it gets stuck.

use dynid_linalg::Mat;

use crate::random::Random;
use dynid_words::Transfer;

/// Differences of values, and steps over the width of the box, that count as none.
const TOLERANCE: f64 = 1e-12;
const LARGEST_CONDITION: f64 = 1e14;

/// Coefficients, functions of dimension and population alone.
#[derive(Clone)]
struct Coefficients {
    weights: Vec<f64>,
    mass: f64,
    path: f64,
    step: f64,
    damping: f64,
    rank_one: f64,
    rank_many: f64,
    /// `E‖N(0, 1)‖`.
    norm: f64,
    /// Iterations between decompositions of `C`.
    pause: usize,
    window: usize,
    longest: usize,
}

impl Coefficients {
    fn new(dimensions: usize, population: usize) -> Coefficients {
        let (n, lambda) = (dimensions as f64, population as f64);
        let parents = (population / 2).max(1);
        let raw: Vec<f64> = (1..=parents).map(|i| (0.5 * (lambda + 1.0)).ln() - (i as f64).ln()).collect();
        let sum: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
        let mass = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let step = (mass + 2.0) / (n + mass + 5.0);
        let rank_one = 2.0 / ((n + 1.3).powi(2) + mass);
        let rank_many =
            (1.0 - rank_one).min(2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0).powi(2) + mass)).max(0.0);
        Coefficients {
            path: (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n),
            damping: 1.0 + 2.0 * (((mass - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + step,
            norm: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            pause: (1.0 / ((rank_one + rank_many) * n * 10.0)) as usize,
            window: 10 + (30.0 * n / lambda).ceil() as usize,
            longest: 100 + (50.0 * (n + 3.0).powi(2) / lambda.sqrt()) as usize,
            weights,
            mass,
            step,
            rank_one,
            rank_many,
        }
    }
}

#[derive(Clone)]
pub(super) struct Descent {
    coefficients: Coefficients,
    mean: Vec<f64>,
    sigma: f64,
    step_path: Vec<f64>,
    path: Vec<f64>,
    /// Column-major, as are the axes.
    covariance: Vec<f64>,
    axes: Vec<f64>,
    lengths: Vec<f64>,
    iteration: usize,
    since_axes: usize,
    /// Best values of the last iterations, the oldest first.
    recent: Vec<f64>,
    stuck: bool,
    /// `y_k` and `x_k`, one candidate after the other.
    moves: Vec<f64>,
    points: Vec<f64>,
}

impl Descent {
    pub(super) fn new(mean: Vec<f64>, sigma: f64, population: usize) -> Descent {
        let n = mean.len();
        let mut identity = vec![0.0; n * n];
        (0..n).for_each(|i| identity[i * (n + 1)] = 1.0);
        Descent {
            coefficients: Coefficients::new(n, population),
            mean,
            sigma,
            step_path: vec![0.0; n],
            path: vec![0.0; n],
            axes: identity.clone(),
            covariance: identity,
            lengths: vec![1.0; n],
            iteration: 0,
            since_axes: 0,
            recent: Vec::new(),
            stuck: false,
            moves: vec![0.0; population * n],
            points: vec![0.0; population * n],
        }
    }

    pub(super) fn mean(&self) -> &[f64] {
        &self.mean
    }

    pub(super) fn sample(&mut self, random: &mut Random) {
        let n = self.mean.len();
        for (y, x) in self.moves.chunks_exact_mut(n).zip(self.points.chunks_exact_mut(n)) {
            y.fill(0.0);
            for (axis, length) in self.axes.chunks_exact(n).zip(&self.lengths) {
                let along = length * random.normal();
                y.iter_mut().zip(axis).for_each(|(y, b)| *y += along * b);
            }
            for (i, x) in x.iter_mut().enumerate() {
                *x = self.mean[i] + self.sigma * y[i];
            }
        }
    }

    /// Coordinates of a candidate.
    pub(super) fn sampled(&self, candidate: usize) -> impl Iterator<Item = f64> + '_ {
        let n = self.mean.len();
        self.points[candidate * n..][..n].iter().copied()
    }

    pub(super) fn update(&mut self, values: &[f64]) {
        let n = self.mean.len();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let mut shift = vec![0.0; n];
        for (&k, w) in order.iter().zip(&self.coefficients.weights) {
            shift.iter_mut().zip(&self.moves[k * n..][..n]).for_each(|(s, y)| *s += w * y);
        }
        self.mean.iter_mut().zip(&shift).for_each(|(m, s)| *m += self.sigma * s);
        let slow = self.update_paths(&shift);
        self.update_covariance(&order, slow);
        self.iteration += 1;
        self.since_axes += 1;
        if self.since_axes > self.coefficients.pause {
            self.decompose();
        }
        self.judge(values[order[0]], values[order[order.len() / 2]]);
    }

    /// Both evolution paths and the step size; returns `h_σ`.
    fn update_paths(&mut self, shift: &[f64]) -> bool {
        let n = self.mean.len();
        let c = &self.coefficients;
        let gain = (c.step * (2.0 - c.step) * c.mass).sqrt();
        self.step_path.iter_mut().for_each(|p| *p *= 1.0 - c.step);
        for (axis, length) in self.axes.chunks_exact(n).zip(&self.lengths) {
            let along = gain * axis.iter().zip(shift).map(|(b, s)| b * s).sum::<f64>() / length;
            self.step_path.iter_mut().zip(axis).for_each(|(p, b)| *p += along * b);
        }
        let norm = self.step_path.iter().map(|p| p * p).sum::<f64>().sqrt();
        let faded = 1.0 - (1.0 - c.step).powf(2.0 * (self.iteration + 1) as f64);
        let slow = norm / faded.sqrt() / c.norm < 1.4 + 2.0 / (n as f64 + 1.0);
        let gain = if slow { (c.path * (2.0 - c.path) * c.mass).sqrt() } else { 0.0 };
        self.path.iter_mut().zip(shift).for_each(|(p, s)| *p = (1.0 - c.path) * *p + gain * s);
        // At most e per iteration: a long first path must not throw the search out of the box.
        self.sigma *= (c.step / c.damping * (norm / c.norm - 1.0)).min(1.0).exp();
        slow
    }

    fn update_covariance(&mut self, order: &[usize], slow: bool) {
        let n = self.mean.len();
        let c = &self.coefficients;
        let lost = if slow { 0.0 } else { c.rank_one * c.path * (2.0 - c.path) };
        let kept = 1.0 - c.rank_one - c.rank_many + lost;
        for (j, column) in self.covariance.chunks_exact_mut(n).enumerate() {
            let factor = c.rank_one * self.path[j];
            column.iter_mut().zip(&self.path).for_each(|(v, p)| *v = kept * *v + factor * p);
            for (&k, w) in order.iter().zip(&c.weights) {
                let y = &self.moves[k * n..][..n];
                let factor = c.rank_many * w * y[j];
                column.iter_mut().zip(y).for_each(|(v, y)| *v += factor * y);
            }
        }
    }

    fn decompose(&mut self) {
        let n = self.mean.len();
        self.since_axes = 0;
        let covariance = Mat::from_fn(n, n, |i, j| self.covariance[i.max(j) + n * i.min(j)]);
        let Some(eigen) = covariance.symmetric_eigen() else {
            self.stuck = true;
            return;
        };
        let values = || eigen.values.iter().copied();
        let (least, largest) = values().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        // Written so that values that are no numbers end the descent too.
        if !(least > 0.0 && largest < LARGEST_CONDITION * least) {
            self.stuck = true;
            return;
        }
        self.lengths = values().map(f64::sqrt).collect();
        for (j, axis) in self.axes.chunks_exact_mut(n).enumerate() {
            axis.iter_mut().enumerate().for_each(|(i, b)| *b = eigen.vectors[(i, j)]);
        }
    }

    /// Whether the descent has come to its end.
    fn judge(&mut self, best: f64, median: f64) {
        let n = self.mean.len();
        self.recent.push(best);
        if self.recent.len() > self.coefficients.window {
            self.recent.remove(0);
            let finite = self.recent.iter().all(|v| v.is_finite());
            let (low, high) = self
                .recent
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
            let none = TOLERANCE.max(4.0 * f64::EPSILON * low.abs());
            let flat = finite && high.max(median) - low < none;
            self.stuck |= flat || self.recent.iter().all(|v| v.is_infinite());
        }
        let wide = |i: usize| self.covariance[i * (n + 1)].sqrt().max(self.path[i].abs());
        self.stuck |= (0..n).all(|i| self.sigma * wide(i) < TOLERANCE) || !self.sigma.is_finite();
        self.stuck |= self.iteration >= self.coefficients.longest;
    }

    pub(super) fn is_over(&self) -> bool {
        self.stuck
    }

    pub(super) fn fields(&mut self, transfer: &mut Transfer<'_>) {
        transfer.reals(&mut self.mean);
        transfer.real(&mut self.sigma);
        transfer.reals(&mut self.step_path);
        transfer.reals(&mut self.path);
        transfer.reals(&mut self.covariance);
        transfer.reals(&mut self.axes);
        transfer.reals(&mut self.lengths);
        transfer.count(&mut self.iteration, usize::MAX);
        transfer.count(&mut self.since_axes, usize::MAX);
        transfer.list(&mut self.recent, 1);
        transfer.flag(&mut self.stuck);
    }
}
