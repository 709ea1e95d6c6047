//! `χ²` without the standard library.

/// Probability that `χ²` with `freedom > 0` degrees of freedom does not exceed `value`:
/// `P(freedom/2, value/2)`.
///
/// Series below `value = freedom + 2`, continued fraction above (Press et al., *Numerical Recipes*, section
/// 6.2); some 14 digits.
pub(crate) fn chi_squared_probability(value: f64, freedom: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let (a, x) = (0.5 * freedom, 0.5 * value);
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > f64::EPSILON * sum * 0.1 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return front * sum;
    }
    // Lentz's method for the fraction of the upper tail.
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut fraction = d;
    for i in 1..1000 {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        let change = c * d;
        fraction *= change;
        if (change - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    1.0 - front * fraction
}

/// Value that `χ²` exceeds with probability `level` in (0, 1), by bisection.
pub(crate) fn chi_squared_upper_quantile(level: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, freedom + 10.0);
    while 1.0 - chi_squared_probability(high, freedom) > level && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match 1.0 - chi_squared_probability(middle, freedom) > level {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// References: SciPy 1.17 `stats.chi2.cdf`, `isf`.
    #[test]
    fn chi_squared_agrees_with_scipy() {
        let close = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
        };
        close(1.0 - chi_squared_probability(40.0, 20.0), 4.995412308307579e-3);
        close(chi_squared_probability(0.1, 1.0), 0.24817036595415073);
        close(chi_squared_probability(2.0, 2.0), 0.632_120_558_828_557_7);
        close(chi_squared_upper_quantile(0.05, 20.0), 31.41043284423092);
        close(chi_squared_upper_quantile(0.99, 10.0), 2.558212160187206);
    }
}
