//! Polynomials on the unit interval.

/// `c0 + c1 s + c2 s^2 + ..`, lowest power first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Polynomial(pub(super) Vec<f64>);

impl Polynomial {
    pub(super) fn at(&self, s: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * s + c)
    }

    pub(super) fn derivative(&self) -> Polynomial {
        Polynomial(self.0.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect())
    }

    /// Least and greatest value on `[0, 1]`.
    pub(super) fn range(&self) -> (f64, f64) {
        let mut inside = self.derivative().roots();
        inside.extend([0.0, 1.0]);
        let values = inside.into_iter().map(|s| self.at(s));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }

    /// Numbers between which all values on `[0, 1]` lie: the least and greatest coefficient of Bernstein,
    /// `b_i = Σ_k C(i, k) / C(n, k) c_k`, which are cheap and not always attained.
    pub(super) fn hull(&self) -> (f64, f64) {
        let degree = self.0.len().saturating_sub(1);
        let of = |i: usize| {
            // C(i, k) / C(n, k), from one k to the next.
            let mut ratio = 1.0;
            let mut sum = 0.0;
            for (k, c) in self.0.iter().enumerate().take(i + 1) {
                sum += ratio * c;
                ratio *= (i - k) as f64 / (degree - k).max(1) as f64;
            }
            sum
        };
        let values = (0..=degree).map(of);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }

    /// Sign changes inside `(0, 1)`, ascending: between two neighbouring roots of the derivative lies one at most.
    fn roots(&self) -> Vec<f64> {
        if self.0.len() < 2 {
            return Vec::new();
        }
        let mut borders = vec![0.0];
        borders.extend(self.derivative().roots());
        borders.push(1.0);
        borders.windows(2).filter_map(|w| self.root_between(w[0], w[1])).collect()
    }

    fn root_between(&self, mut left: f64, mut right: f64) -> Option<f64> {
        let at_left = self.at(left);
        if at_left * self.at(right) >= 0.0 {
            return None;
        }
        // Bisection to the last bit: 60 steps, and no case in which it fails.
        for _ in 0..60 {
            let middle = 0.5 * (left + right);
            if self.at(middle) * at_left > 0.0 { left = middle } else { right = middle }
        }
        Some(0.5 * (left + right))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_roots_of_a_quartic_are_found() {
        let roots = Polynomial(expanded(&[0.2, 0.3, 0.6, 0.9])).roots();
        assert_eq!(roots.len(), 4);
        for (root, expected) in roots.iter().zip([0.2, 0.3, 0.6, 0.9]) {
            assert!((root - expected).abs() < 1e-12, "{root}");
        }
    }

    fn expanded(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |p, r| {
            let mut out = vec![0.0; p.len() + 1];
            for (k, c) in p.iter().enumerate() {
                out[k + 1] += c;
                out[k] -= r * c;
            }
            out
        })
    }

    #[test]
    fn ranges_hold_the_values_of_a_fine_grid_and_are_attained() {
        let p = Polynomial(vec![0.3, -2.0, 5.0, 7.0, -30.0, 20.0]);
        let (low, high) = p.range();
        let values: Vec<f64> = (0..=100_000).map(|k| p.at(f64::from(k) * 1e-5)).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(low <= least && least - low < 1e-8 && high >= most && high - most < 1e-8);
        assert_eq!(Polynomial(vec![4.0]).range(), (4.0, 4.0));
        let (least_of_hull, most_of_hull) = p.hull();
        assert!(least_of_hull <= least && most <= most_of_hull);
        // Of straight lines the hull is attained.
        assert_eq!(Polynomial(vec![1.0, -3.0]).hull(), (-2.0, 1.0));
        assert_eq!(Polynomial(vec![4.0]).hull(), (4.0, 4.0));
    }
}
