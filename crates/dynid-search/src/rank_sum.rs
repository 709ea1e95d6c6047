//! Comparison of two samples by ranks.

use statrs::distribution::{ContinuousCDF, Normal};

/// Result of [`rank_sum`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RankSum {
    /// `U`: pairs in which the first sample's value is the greater, equal ones counting half.
    pub statistic: f64,
    /// Probability of a `U` as small or smaller if both samples are of one distribution: small if values of the first
    /// tend to be less than those of the second.
    pub less: f64,
}

/// Most values in a sample without ties for which probabilities are exact.
const EXACT: usize = 60;

/// One-sided test of Mann and Whitney: whether values of `first` tend to be less than those of `second`.
///
/// Without ties and with at most 60 values each, the probability is exact (counted by recursion over the orders);
/// otherwise from the normal distribution with the variance corrected for ties and a continuity correction of 1/2.
/// `None` for an empty sample, a value that is not a number, or samples of one and the same value.
///
/// Source: Mann & Whitney 1947. Same numbers as SciPy's `mannwhitneyu(first, second, alternative="less")`.
pub fn rank_sum(first: &[f64], second: &[f64]) -> Option<RankSum> {
    if first.is_empty() || second.is_empty() || first.iter().chain(second).any(|v| v.is_nan()) {
        return None;
    }
    let (m, n) = (first.len(), second.len());
    let mut twice = 0_u64;
    for a in first {
        twice += second.iter().map(|b| 2 * u64::from(a > b) + u64::from(a == b)).sum::<u64>();
    }
    let ties = tie_sizes(first, second);
    let less = if ties.is_empty() && m <= EXACT && n <= EXACT {
        exact_probability(m, n, (twice / 2) as usize)
    } else {
        normal_probability(m as f64, n as f64, 0.5 * twice as f64, &ties)?
    };
    Some(RankSum { statistic: 0.5 * twice as f64, less })
}

/// Sizes of groups of equal values.
fn tie_sizes(first: &[f64], second: &[f64]) -> Vec<f64> {
    let mut all: Vec<f64> = first.iter().chain(second).copied().collect();
    all.sort_unstable_by(f64::total_cmp);
    all.chunk_by(|a, b| a == b).filter(|group| group.len() > 1).map(|group| group.len() as f64).collect()
}

/// `P(U ≤ u)`. The number of orders of `m` and `n` values with statistic `u` is a coefficient of the Gaussian binomial
/// `Π_{i=1..m} (1 - q^{n+i})/(1 - q^i)`; the factors are multiplied in as probabilities, so that nothing overflows.
fn exact_probability(m: usize, n: usize, u: usize) -> f64 {
    let mut law = vec![0.0; m * n + 1];
    law[0] = 1.0;
    for i in 1..=m {
        for k in (n + i..law.len()).rev() {
            law[k] -= law[k - n - i];
        }
        for k in i..law.len() {
            law[k] += law[k - i];
        }
        let share = i as f64 / (n + i) as f64;
        law.iter_mut().for_each(|p| *p *= share);
    }
    law[..=u].iter().sum::<f64>().min(1.0)
}

fn normal_probability(m: f64, n: f64, u: f64, ties: &[f64]) -> Option<f64> {
    let total = m + n;
    let correction = ties.iter().map(|t| t * t * t - t).sum::<f64>() / (total * (total - 1.0));
    let deviation = (m * n / 12.0 * (total + 1.0 - correction)).sqrt();
    let law = Normal::new(0.0, 1.0).ok()?;
    (deviation > 0.0).then(|| law.cdf((u + 0.5 - 0.5 * m * n) / deviation))
}
