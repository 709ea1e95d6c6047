//! Efforts that repeat with the position of a joint: torque ripple that residuals show.

/// A cyclic effort `A cos nq + B sin nq` found in residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CyclicFinding {
    /// Repetitions `n` per turn (per `2π` metres for joints that slide).
    pub(super) cycles: u32,
    /// Amplitude `√(A² + B²)` over all samples, effort.
    pub(super) amplitude: f64,
    /// Share of the residual sum of squares that is gone on halves which the coefficients were not fitted to.
    pub(super) gain: f64,
}

/// The cyclic effort of at most `most_cycles` repetitions that explains residuals best; `None` if the best of them gains less
/// than `least_gain` on held-out halves.
///
/// For every `n`, `A`, `B` and a constant are fitted to the first half of the samples and judged on the second, and the other
/// way round. `position`, `residual`: of one joint, in order of time, alike in length.
///
/// # Panics
/// If the lengths differ.
pub(super) fn find_cyclic(
    position: &[f64],
    residual: &[f64],
    most_cycles: u32,
    least_gain: f64,
) -> Option<CyclicFinding> {
    assert_eq!(position.len(), residual.len(), "one residual per position");
    let half = position.len() / 2;
    let halves = [(&position[..half], &residual[..half]), (&position[half..], &residual[half..])];
    let without: f64 = halves
        .iter()
        .map(|(_, r)| {
            let mean = r.iter().sum::<f64>() / r.len().max(1) as f64;
            r.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>()
        })
        .sum();
    let best = (1..=most_cycles)
        .filter_map(|cycles| {
            let [first, second] = halves.map(|(q, r)| Sums::new(q, r, cycles));
            let left = second.rss_about_mean(first.solve()?) + first.rss_about_mean(second.solve()?);
            let [a, b, _] = first.plus(&second).solve()?;
            Some(CyclicFinding { cycles, amplitude: a.hypot(b), gain: 1.0 - left / without })
        })
        .max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    (best.gain >= least_gain).then_some(best)
}

/// Sums of products of `[cos nq, sin nq, 1, residual]`.
struct Sums([[f64; 4]; 4]);

impl Sums {
    fn new(position: &[f64], residual: &[f64], cycles: u32) -> Self {
        let mut sums = [[0.0; 4]; 4];
        for (q, r) in position.iter().zip(residual) {
            let (sin, cos) = (f64::from(cycles) * q).sin_cos();
            let row = [cos, sin, 1.0, *r];
            for (to, a) in sums.iter_mut().zip(row) {
                to.iter_mut().zip(row).for_each(|(s, b)| *s += a * b);
            }
        }
        Sums(sums)
    }

    fn plus(&self, other: &Sums) -> Self {
        Sums(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] + other.0[i][j])))
    }

    /// Least-squares coefficients; `None` if the motion is too small to tell the three columns apart.
    fn solve(&self) -> Option<[f64; 3]> {
        let mut rows: [[f64; 4]; 3] = std::array::from_fn(|i| self.0[i]);
        for k in 0..3 {
            let scale = self.0[k][k];
            if rows[k][k] <= 1e-6 * scale || scale == 0.0 {
                return None;
            }
            let pivot = rows[k];
            for row in rows.iter_mut().skip(k + 1) {
                let factor = row[k] / pivot[k];
                row.iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
            }
        }
        let mut x = [0.0; 3];
        for k in (0..3).rev() {
            let known: f64 = (k + 1..3).map(|j| rows[k][j] * x[j]).sum();
            x[k] = (rows[k][3] - known) / rows[k][k];
        }
        Some(x)
    }

    /// Residual sum of squares with given `A`, `B` and the constant that fits best.
    fn rss_about_mean(&self, [a, b, _]: [f64; 3]) -> f64 {
        let c = &self.0;
        let samples = c[2][2];
        let mean = (c[3][2] - a * c[0][2] - b * c[1][2]) / samples;
        let factors = [-a, -b, -mean, 1.0];
        (0..4).map(|i| (0..4).map(|j| factors[i] * factors[j] * c[i][j]).sum::<f64>()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion() -> Vec<f64> {
        (0..2000).map(|k| 1.7 * (0.004 * f64::from(k)).sin() + 0.6 * (0.013 * f64::from(k)).cos()).collect()
    }

    /// Noise of no special kind.
    fn noise(k: usize) -> f64 {
        (12.9898 * k as f64).sin() * (78.233 * k as f64).cos()
    }

    #[test]
    fn ripple_is_found_with_its_order_and_amplitude() {
        let q = motion();
        let residual: Vec<f64> =
            q.iter().enumerate().map(|(k, q)| 1.2 * (3.0 * q + 0.7).sin() + 0.4 + 0.3 * noise(k)).collect();
        let found = find_cyclic(&q, &residual, 6, 0.1).unwrap();
        assert_eq!(found.cycles, 3);
        assert!((found.amplitude - 1.2).abs() < 0.02 && found.gain > 0.9, "{found:?}");
    }

    #[test]
    fn noise_and_standstill_are_no_ripple() {
        let q = motion();
        let residual: Vec<f64> = (0..q.len()).map(noise).collect();
        assert_eq!(find_cyclic(&q, &residual, 6, 0.1), None);
        assert_eq!(find_cyclic(&vec![0.3; 2000], &residual, 6, 0.1), None);
        assert_eq!(find_cyclic(&[], &[], 6, 0.1), None);
    }
}
