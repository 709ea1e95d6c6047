//! Radau IIA collocation for stiff equations of motion `ẍ = g(t, x, ẋ)`.
//!
//! Five stages, order nine, stiffly accurate and L-stable (Hairer & Wanner 1996, section IV.5). With the accelerations of
//! the stages as unknowns, `V_i = v + h Σ A_ij a_j` and `X_i = x + c_i h v + h² Σ (A²)_ij a_j`, a step is one simplified
//! Newton iteration with the real matrix `1 - h A⊗∂g/∂ẋ - h² A²⊗∂g/∂x`, which may be approximate: it decides how fast
//! the iteration converges, not where to.
//!
//! The size of a step follows from the embedded estimate of Hairer & Wanner (IV.8.19), of order five, filtered by the
//! Jacobian. Since the solution itself is of order nine, a tolerance is carried over to the estimate's order as there
//! (`tolerance^((s+1)/2s)`).

use crate::lu::{Lu, add_product};

/// Stages.
pub(crate) const STAGES: usize = 5;
/// Real eigenvalue of the inverse of `A`, Hairer & Wanner's code RADAU; any positive number would do.
const REAL_EIGENVALUE: f64 = 6.286_704_751_729_277;
/// Right Radau nodes, the zeros of `d⁴/dτ⁴ (τ⁴ (τ-1)⁵)`.
const NODES: [f64; STAGES] = [
    0.057_104_196_114_517_704,
    0.276_843_013_638_123_86,
    0.583_590_432_368_916_8,
    0.860_240_135_656_219_5,
    1.0,
];
/// Newton iterations before a step is made smaller.
const MOST_ITERATIONS: usize = 12;

/// `ẍ = g(t, x, ẋ)`.
pub(crate) trait Motion {
    /// Number of coordinates.
    fn dimension(&self) -> usize;
    /// Accelerations; false where they cannot be given.
    fn acceleration(&mut self, t: f64, x: &[f64], v: &[f64], a: &mut [f64]) -> bool;
    /// `∂g/∂x` and `∂g/∂ẋ`, row-major; may be approximate.
    fn jacobian(&mut self, t: f64, x: &[f64], v: &[f64], by_x: &mut [f64], by_v: &mut [f64]);
    /// What an error counts in: per coordinate, of positions and of rates.
    fn scales(&self) -> (&[f64], &[f64]);
}

/// Coefficients of the method.
#[derive(Debug, Clone)]
pub(crate) struct Coefficients {
    /// Nodes; the last is 1.
    pub(crate) c: [f64; STAGES],
    pub(crate) a: [[f64; STAGES]; STAGES],
    /// `A²`.
    pub(crate) squared: [[f64; STAGES]; STAGES],
    /// Weights of the error estimate.
    error: [f64; STAGES],
    /// Inverse of the Vandermonde matrix of the nodes: coefficients of `τ^k` per stage.
    inverse: [[f64; STAGES]; STAGES],
}

impl Coefficients {
    pub(crate) fn new() -> Self {
        let c = NODES;
        let inverse = inverse_vandermonde(&c);
        // ∫_0^{c_i} l_j = Σ_k inverse[k][j] c_i^{k+1}/(k+1).
        let a: [[f64; STAGES]; STAGES] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..STAGES).map(|k| inverse[k][j] * c[i].powi(k as i32 + 1) / (k + 1) as f64).sum()
            })
        });
        let squared =
            std::array::from_fn(|i| std::array::from_fn(|j| (0..STAGES).map(|k| a[i][k] * a[k][j]).sum()));
        // Σ d_i c_i^k = -γ for k = 0 and 0 beyond.
        let error = std::array::from_fn(|i| -inverse[0][i] / REAL_EIGENVALUE);
        Coefficients { c, a, squared, error, inverse }
    }

    /// Coefficients of the polynomial `Σ_k p_k τ^k`, `τ` from 0 to 1 over the step, through values at the nodes.
    pub(crate) fn polynomial(&self, at_nodes: impl Fn(usize) -> f64) -> [f64; STAGES] {
        std::array::from_fn(|k| (0..STAGES).map(|j| self.inverse[k][j] * at_nodes(j)).sum())
    }

    /// Weights of the quadrature over a step.
    pub(crate) fn weights(&self) -> &[f64; STAGES] {
        &self.a[STAGES - 1]
    }
}

/// Inverse of `V_jk = c_j^k`: row `k` holds the coefficients of `τ^k` of the Lagrange polynomials.
fn inverse_vandermonde(c: &[f64; STAGES]) -> [[f64; STAGES]; STAGES] {
    let mut inverse = [[0.0; STAGES]; STAGES];
    for j in 0..STAGES {
        let mut polynomial = [0.0; STAGES];
        polynomial[0] = 1.0;
        let mut degree = 0;
        for (k, node) in c.iter().enumerate() {
            if k == j {
                continue;
            }
            let scale = 1.0 / (c[j] - node);
            for m in (0..=degree + 1).rev() {
                let lower = if m > 0 { polynomial[m - 1] } else { 0.0 };
                let own = if m <= degree { polynomial[m] } else { 0.0 };
                polynomial[m] = scale * (lower - node * own);
            }
            degree += 1;
        }
        for k in 0..STAGES {
            inverse[k][j] = polynomial[k];
        }
    }
    inverse
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Attempt {
    /// With an error in units of the tolerance.
    Solved(f64),
    /// The iteration did not converge.
    Diverged,
}

/// Memory of steps of one size of system.
#[derive(Debug)]
pub(crate) struct Collocation {
    method: Coefficients,
    n: usize,
    tolerance: f64,
    /// Tolerance of the error estimate where the solution is smooth.
    estimate: f64,
    /// See [`Collocation::set_rough`].
    rough: bool,
    /// Largest change of the last Newton iteration.
    converged: f64,
    /// Accelerations of the stages of the last attempt, stage after stage.
    stages: Vec<f64>,
    /// Accelerations of the stages of the last step that was kept, with its size, to predict from.
    kept: Vec<f64>,
    kept_step: Option<f64>,
    lu: Lu,
    filter: Lu,
    by_x: Vec<f64>,
    by_v: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    residual: Vec<f64>,
    evaluations: usize,
    jacobians: usize,
}

impl Collocation {
    /// `tolerance`: largest error of one step in units of the system's scales.
    pub(crate) fn new(n: usize, tolerance: f64) -> Self {
        let s = STAGES as f64;
        let estimate = tolerance.powf((s + 1.0) / (2.0 * s));
        Collocation {
            method: Coefficients::new(),
            n,
            tolerance,
            estimate,
            rough: false,
            // Fine enough for instants to be located to, however coarse the steps.
            converged: (0.03 * tolerance).clamp(1e-14, 1e-9),
            stages: vec![0.0; n * STAGES],
            kept: vec![0.0; n * STAGES],
            kept_step: None,
            lu: Lu::default(),
            filter: Lu::default(),
            by_x: vec![0.0; n * n],
            by_v: vec![0.0; n * n],
            x: vec![0.0; n],
            v: vec![0.0; n],
            a: vec![0.0; n],
            residual: vec![0.0; n * STAGES],
            evaluations: 0,
            jacobians: 0,
        }
    }

    pub(crate) fn method(&self) -> &Coefficients {
        &self.method
    }

    /// Accelerations asked for, Jacobians asked for.
    pub(crate) fn counts(&self) -> (usize, usize) {
        (self.evaluations, self.jacobians)
    }

    /// Says whether the solution is so rough over the next attempts that no order is to be hoped for: errors then count at the
    /// tolerance itself.
    pub(crate) fn set_rough(&mut self, rough: bool) {
        self.rough = rough;
    }

    /// Forgets the last step: the equations have changed.
    pub(crate) fn restart(&mut self) {
        self.kept_step = None;
    }

    /// Accelerations of the last attempt's stages: stage `i`, coordinate `k` at `i * n + k`.
    pub(crate) fn stages(&self) -> &[f64] {
        &self.stages
    }

    /// Exponent by which errors shrink with the step.
    pub(crate) const ERROR_ORDER: f64 = STAGES as f64 + 1.0;

    /// Jacobian at the start of a step, for all attempts from there.
    pub(crate) fn linearise(&mut self, system: &mut impl Motion, t: f64, x: &[f64], v: &[f64]) {
        system.jacobian(t, x, v, &mut self.by_x, &mut self.by_v);
        self.jacobians += 1;
    }

    /// Tries a step of size `h` from `(x, v)` with acceleration `a0`, after [`Collocation::linearise`] there.
    pub(crate) fn attempt(
        &mut self,
        system: &mut impl Motion,
        (t, h): (f64, f64),
        (x, v, a0): (&[f64], &[f64], &[f64]),
    ) -> Attempt {
        let n = self.n;
        if !self.factor(h) {
            return Attempt::Diverged;
        }
        self.predict(h, a0);
        let mut before = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            for i in 0..STAGES {
                self.load(i, h, x, v);
                if !system.acceleration(t + self.method.c[i] * h, &self.x, &self.v, &mut self.a) {
                    return Attempt::Diverged;
                }
                self.evaluations += 1;
                for k in 0..n {
                    self.residual[i * n + k] = self.a[k] - self.stages[i * n + k];
                }
            }
            self.lu.solve(&mut self.residual);
            let change = self.change(system, h);
            if !change.is_finite() {
                return Attempt::Diverged;
            }
            self.stages.iter_mut().zip(&self.residual).for_each(|(a, d)| *a += d);
            if change <= self.converged {
                return Attempt::Solved(self.error(system, h, a0));
            }
            if before < f64::INFINITY {
                let rate = change / before;
                if rate >= 1.0 {
                    return Attempt::Diverged;
                }
                if change * rate / (1.0 - rate) <= self.converged {
                    return Attempt::Solved(self.error(system, h, a0));
                }
            }
            before = change;
        }
        Attempt::Diverged
    }

    /// State at the end of the last attempt.
    pub(crate) fn end(&self, h: f64, x: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let n = self.n;
        let (weights, squared) = (self.method.weights(), &self.method.squared[STAGES - 1]);
        for k in 0..n {
            let sum = |w: &[f64; STAGES]| (0..STAGES).map(|j| w[j] * self.stages[j * n + k]).sum::<f64>();
            x[k] += h * (v[k] + h * sum(squared));
            v[k] += h * sum(weights);
            a[k] = self.stages[(STAGES - 1) * n + k];
        }
    }

    /// Keeps the last attempt as what the next step is predicted from.
    pub(crate) fn keep(&mut self, h: f64) {
        self.kept.copy_from_slice(&self.stages);
        self.kept_step = Some(h);
    }

    /// Position and rate of a coordinate as polynomials of `τ` over the last attempt, from start values.
    pub(crate) fn path(&self, k: usize, h: f64, x: f64, v: f64) -> Path {
        let a = self.method.polynomial(|j| self.stages[j * self.n + k]);
        Path { x, v: h * v, a: a.map(|p| h * h * p) }
    }

    fn load(&mut self, i: usize, h: f64, x: &[f64], v: &[f64]) {
        let n = self.n;
        let (row, squared) = (&self.method.a[i], &self.method.squared[i]);
        for k in 0..n {
            let sum = |w: &[f64; STAGES]| (0..STAGES).map(|j| w[j] * self.stages[j * n + k]).sum::<f64>();
            self.x[k] = x[k] + h * (self.method.c[i] * v[k] + h * sum(squared));
            self.v[k] = v[k] + h * sum(row);
        }
    }

    /// Stage values `(X_i, V_i)` of the last attempt.
    pub(crate) fn stage(&mut self, i: usize, h: f64, x: &[f64], v: &[f64]) -> (&[f64], &[f64]) {
        self.load(i, h, x, v);
        (&self.x, &self.v)
    }

    fn predict(&mut self, h: f64, a0: &[f64]) {
        let n = self.n;
        match self.kept_step {
            Some(kept) if h <= 4.0 * kept => {
                for k in 0..n {
                    let p = self.method.polynomial(|j| self.kept[j * n + k]);
                    for (i, c) in self.method.c.iter().enumerate() {
                        let tau = 1.0 + c * h / kept;
                        self.stages[i * n + k] = p.iter().rev().fold(0.0, |sum, p| sum * tau + p);
                    }
                }
            }
            _ => self.stages.chunks_exact_mut(n).for_each(|stage| stage.copy_from_slice(a0)),
        }
    }

    fn factor(&mut self, h: f64) -> bool {
        let (n, m) = (self.n, self.n * STAGES);
        let mut matrix = vec![0.0; m * m];
        for i in 0..STAGES {
            for j in 0..STAGES {
                let (by_v, by_x) = (h * self.method.a[i][j], h * h * self.method.squared[i][j]);
                for row in 0..n {
                    for column in 0..n {
                        let of = row * n + column;
                        let at = (i * n + row) * m + j * n + column;
                        matrix[at] = -by_v * self.by_v[of] - by_x * self.by_x[of];
                        if i == j && row == column {
                            matrix[at] += 1.0;
                        }
                    }
                }
            }
        }
        let g = h / REAL_EIGENVALUE;
        let filter: Vec<f64> = (0..n * n)
            .map(|k| f64::from(u8::from(k % (n + 1) == 0)) - g * (self.by_v[k] + g * self.by_x[k]))
            .collect();
        self.lu.factor(m, &matrix) && self.filter.factor(n, &filter)
    }

    /// Largest change of positions and rates by the last Newton step, in units of the scales.
    fn change(&self, system: &impl Motion, h: f64) -> f64 {
        let (of_x, of_v) = system.scales();
        let n = self.n;
        let largest = |scale: &[f64], factor: f64| {
            self.residual.iter().enumerate().fold(0.0_f64, |worst, (k, d)| {
                let size = factor * d.abs() / scale[k % n];
                if size.is_nan() { f64::INFINITY } else { worst.max(size) }
            })
        };
        largest(of_v, h).max(largest(of_x, h * h))
    }

    fn error(&mut self, system: &impl Motion, h: f64, a0: &[f64]) -> f64 {
        let n = self.n;
        let g = h / REAL_EIGENVALUE;
        let d = &self.method.error;
        let mut by_x: Vec<f64> = vec![0.0; n];
        let mut by_v: Vec<f64> = vec![0.0; n];
        for k in 0..n {
            let at = |j: usize| self.stages[j * n + k];
            by_v[k] = g * a0[k] + h * (0..STAGES).map(|i| d[i] * at(i)).sum::<f64>();
            let stage_rate = |i: usize| (0..STAGES).map(|j| self.method.a[i][j] * at(j)).sum::<f64>();
            by_x[k] = h * h * (0..STAGES).map(|i| d[i] * stage_rate(i)).sum::<f64>();
        }
        // (1 - hγJ)⁻¹ of both, reduced to the rates.
        let mut rates = by_v.clone();
        add_product(&mut rates, g, &self.by_x, &by_x);
        self.filter.solve(&mut rates);
        let (of_x, of_v) = system.scales();
        let tolerance = if self.rough { self.tolerance } else { self.estimate };
        let mut worst = 0.0_f64;
        for k in 0..n {
            let position = (by_x[k] + g * rates[k]).abs() / of_x[k];
            let size = position.max(rates[k].abs() / of_v[k]) / tolerance;
            worst = if size.is_nan() { f64::INFINITY } else { worst.max(size) };
        }
        worst
    }
}

/// A coordinate over a step, `τ` from 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Path {
    x: f64,
    /// Rate at the start times the step.
    v: f64,
    /// Coefficients of the acceleration times the step squared.
    a: [f64; STAGES],
}

impl Path {
    /// Position, and rate times the step.
    pub(crate) fn at(&self, tau: f64) -> [f64; 2] {
        let (mut x, mut v) = (self.x + self.v * tau, self.v);
        let mut power = tau;
        for (k, a) in self.a.iter().enumerate() {
            let k = k as f64;
            v += a * power / (k + 1.0);
            power *= tau;
            x += a * power / ((k + 1.0) * (k + 2.0));
        }
        [x, v]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coefficients_meet_the_simplifying_conditions() {
        let m = Coefficients::new();
        // B(9): quadrature of order nine. C(5): stages of order five.
        for k in 1..=9 {
            let sum: f64 = (0..STAGES).map(|i| m.weights()[i] * m.c[i].powi(k - 1)).sum();
            assert!((sum - 1.0 / f64::from(k)).abs() < 1e-13, "B({k}): {sum}");
        }
        for k in 1..=5 {
            for i in 0..STAGES {
                let sum: f64 = (0..STAGES).map(|j| m.a[i][j] * m.c[j].powi(k - 1)).sum();
                assert!((sum - m.c[i].powi(k) / f64::from(k)).abs() < 1e-13, "C({k}) {i}");
            }
        }
    }

    /// `ẍ = -ω² x`, and a strongly damped one beside it.
    struct Pair([f64; 2]);

    impl Motion for Pair {
        fn dimension(&self) -> usize {
            2
        }
        fn acceleration(&mut self, t: f64, x: &[f64], v: &[f64], a: &mut [f64]) -> bool {
            a[0] = -x[0];
            a[1] = -1e6 * (v[1] + t.sin()) - 1e6 * (x[1] - t.cos()) - t.cos();
            true
        }
        fn jacobian(&mut self, _: f64, _: &[f64], _: &[f64], by_x: &mut [f64], by_v: &mut [f64]) {
            by_x.copy_from_slice(&[-1.0, 0.0, 0.0, -1e6]);
            by_v.copy_from_slice(&[0.0, 0.0, 0.0, -1e6]);
        }
        fn scales(&self) -> (&[f64], &[f64]) {
            (&self.0, &self.0)
        }
    }

    #[test]
    fn an_oscillation_and_a_stiff_decay_end_where_they_must() {
        let error = |steps: usize| {
            let mut system = Pair([1.0; 2]);
            let mut method = Collocation::new(2, 1e-12);
            let h = 4.0 / steps as f64;
            let (mut x, mut v, mut a) = ([1.0, 1.0], [0.0, 0.0], [-1.0, -1.0]);
            for k in 0..steps {
                let t = k as f64 * h;
                method.linearise(&mut system, t, &x, &v);
                let outcome = method.attempt(&mut system, (t, h), (&x, &v, &a));
                assert!(matches!(outcome, Attempt::Solved(_)), "{outcome:?}");
                method.keep(h);
                method.end(h, &mut x, &mut v, &mut a);
            }
            let of = |k: usize| (x[k] - 4.0_f64.cos()).abs().max((v[k] + 4.0_f64.sin()).abs());
            [of(0), of(1)]
        };
        let (coarse, fine) = (error(4), error(8));
        let order = (coarse[0] / fine[0]).log2();
        assert!((8.5..9.8).contains(&order), "{order}: {coarse:?} {fine:?}");
        assert!(fine[1] < 1e-10, "{fine:?}");
    }
}
