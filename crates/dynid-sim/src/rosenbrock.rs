//! Coefficients of a Rosenbrock-W method of order three (ROS34PW2, Rang & Angermann 2005), and control of its steps.

use crate::error::SimError;

pub(crate) const GAMMA: f64 = 0.435_866_521_508_459;
pub(crate) const STAGES: usize = 4;
/// `α_ij`: states of the stages.
pub(crate) const ALPHA: [[f64; 3]; STAGES] = [
    [0.0, 0.0, 0.0],
    [0.871_733_043_016_918, 0.0, 0.0],
    [0.844_570_600_153_694_2, -0.112_990_642_364_841_85, 0.0],
    [0.0, 0.0, 1.0],
];
/// `γ_ij`, j < i: products with the Jacobian.
pub(crate) const GAMMAS: [[f64; 3]; STAGES] = [
    [0.0, 0.0, 0.0],
    [-0.871_733_043_016_918, 0.0, 0.0],
    [-0.903_380_570_130_440_8, 0.054_180_672_388_095_326, 0.0],
    [0.242_123_807_060_953_46, -1.223_250_583_904_514_7, 0.545_260_255_335_102_1],
];
pub(crate) const WEIGHTS: [f64; STAGES] =
    [0.242_123_807_060_953_46, -1.223_250_583_904_514_7, 1.545_260_255_335_102, 0.435_866_521_508_459];
/// Weights of the embedded method of order two.
pub(crate) const EMBEDDED: [f64; STAGES] =
    [0.378_109_031_458_193_7, -0.096_042_292_212_423_18, 0.5, 0.217_933_260_754_229_5];

/// Steps within one interval before the integrator gives up.
const MOST_STEPS: usize = 20_000;

/// Size of steps that keeps their errors at the tolerance.
#[derive(Debug, Clone, Default)]
pub(crate) struct StepControl {
    /// Size that the errors ask for, s; nothing is known before the first step.
    step: Option<f64>,
    accepted: usize,
    rejected: usize,
}

/// A time to be covered by steps.
#[derive(Debug, Clone)]
pub(crate) struct Interval {
    start: f64,
    duration: f64,
    done: f64,
    steps: usize,
}

impl Interval {
    /// Time that has been reached, s.
    pub(crate) fn now(&self) -> f64 {
        self.start + self.done
    }

    /// Size of an attempt of about `h`: a last sliver would cost a step of its own.
    ///
    /// # Errors
    /// [`SimError::TooFast`] after too many steps, or too short ones.
    pub(crate) fn attempt(&mut self, mut h: f64) -> Result<f64, SimError> {
        self.steps += 1;
        let left = self.duration - self.done;
        if left - h < 0.01 * h {
            h = left;
        }
        if self.steps > MOST_STEPS || h <= 1e-14 * self.duration {
            return Err(SimError::TooFast { time: self.now(), steps: self.steps });
        }
        Ok(h)
    }
}

impl StepControl {
    /// `duration` seconds from `start` on.
    pub(crate) fn interval(&self, start: f64, duration: f64) -> Interval {
        Interval { start, duration, done: 0.0, steps: 0 }
    }

    /// Size of the next step, s; `None` at the end of the interval.
    pub(crate) fn next(&self, interval: &Interval) -> Option<f64> {
        let left = interval.duration - interval.done;
        (left > 0.0).then(|| self.step.unwrap_or(f64::INFINITY).min(left))
    }

    /// Keeps a step with an `error` of at most one tolerance; otherwise gives the size to be tried instead.
    pub(crate) fn judge(&mut self, interval: &mut Interval, h: f64, error: f64) -> Option<f64> {
        // A step that is not finite must shrink too, and NaN fails every comparison.
        let factor =
            if error.is_finite() { (0.9 * error.max(1e-9).powf(-1.0 / 3.0)).clamp(0.1, 5.0) } else { 0.1 };
        if error <= 1.0 {
            self.accepted += 1;
            let step = self.step.unwrap_or(f64::INFINITY);
            // A step cut short by the end of the interval says nothing against the longer one.
            self.step = Some(if h < step { step.max(h * factor) } else { h * factor });
            let left = interval.duration - interval.done;
            interval.done = if h == left { interval.duration } else { interval.done + h };
            return None;
        }
        self.rejected += 1;
        let shorter = h * factor.min(0.9);
        self.step = Some(shorter);
        Some(shorter)
    }

    pub(crate) fn count(&self, evaluations: usize) -> IntegrationCount {
        IntegrationCount { accepted: self.accepted, rejected: self.rejected, evaluations }
    }
}

/// How much work the integrator had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IntegrationCount {
    /// Steps that were kept.
    pub accepted: usize,
    /// Steps that were repeated with a smaller size.
    pub rejected: usize,
    /// Accelerations evaluated.
    pub evaluations: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Conditions of order three that hold whatever matrix is used (Hairer & Wanner 1996, table IV.7.1 and W-methods).
    #[test]
    fn the_coefficients_meet_the_order_conditions_for_any_matrix() {
        let alpha = |i: usize, j: usize| if j < 3 { ALPHA[i][j] } else { 0.0 };
        let gamma = |i: usize, j: usize| match j {
            _ if i == j => GAMMA,
            j if j < 3 => GAMMAS[i][j],
            _ => 0.0,
        };
        let sum = |f: &dyn Fn(usize) -> f64| (0..STAGES).map(f).sum::<f64>();
        let row = |m: &dyn Fn(usize, usize) -> f64, i: usize| sum(&|j| m(i, j));
        let twice = |m: &dyn Fn(usize, usize) -> f64, o: &dyn Fn(usize, usize) -> f64| {
            sum(&|i| WEIGHTS[i] * sum(&|j| m(i, j) * row(o, j)))
        };
        let check = |found: f64, expected: f64, what: &str| {
            assert!((found - expected).abs() < 1e-14, "{what}: {found} {expected}");
        };
        check(sum(&|i| WEIGHTS[i]), 1.0, "order 1");
        check(sum(&|i| WEIGHTS[i] * row(&alpha, i)), 0.5, "order 2");
        check(sum(&|i| WEIGHTS[i] * row(&gamma, i)), 0.0, "order 2, matrix");
        check(sum(&|i| WEIGHTS[i] * row(&alpha, i).powi(2)), 1.0 / 3.0, "order 3, bushy");
        check(twice(&alpha, &alpha), 1.0 / 6.0, "order 3, tall");
        check(twice(&alpha, &gamma), 0.0, "order 3, matrix above");
        check(twice(&gamma, &alpha), 0.0, "order 3, matrix below");
        check(twice(&gamma, &gamma), 0.0, "order 3, matrix twice");
        check(sum(&|i| EMBEDDED[i]), 1.0, "embedded, order 1");
        check(sum(&|i| EMBEDDED[i] * row(&alpha, i)), 0.5, "embedded, order 2");
        check(sum(&|i| EMBEDDED[i] * row(&gamma, i)), 0.0, "embedded, order 2, matrix");
    }
}
