//! Quantiles and tail probabilities of the distributions that intervals and tests use.
//!
//! Degrees of freedom must be positive and probabilities inside (0, 1); otherwise the result is `None`.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, StudentsT};

/// Quantile of Student's t with `freedom` degrees of freedom; `t_quantile(0.975, B - 1)` for a 95 % interval.
pub fn t_quantile(probability: f64, freedom: f64) -> Option<f64> {
    let law = StudentsT::new(0.0, 1.0, freedom).ok()?;
    inside(probability).then(|| law.inverse_cdf(probability))
}

/// Probability that Student's t with `freedom` degrees of freedom exceeds `value`.
pub fn t_exceedance(value: f64, freedom: f64) -> Option<f64> {
    Some(StudentsT::new(0.0, 1.0, freedom).ok()?.sf(value))
}

/// Quantile of Fisher's F with `(numerator, denominator)` degrees of freedom.
pub fn f_quantile(probability: f64, numerator: f64, denominator: f64) -> Option<f64> {
    let law = FisherSnedecor::new(numerator, denominator).ok()?;
    inside(probability).then(|| law.inverse_cdf(probability))
}

/// Probability that Fisher's F with `(numerator, denominator)` degrees of freedom exceeds `value ≥ 0`.
pub fn f_exceedance(value: f64, numerator: f64, denominator: f64) -> Option<f64> {
    let law = FisherSnedecor::new(numerator, denominator).ok()?;
    (value >= 0.0).then(|| law.sf(value))
}

/// Quantile of `χ²` with `freedom` degrees of freedom.
pub fn chi_squared_quantile(probability: f64, freedom: f64) -> Option<f64> {
    let law = ChiSquared::new(freedom).ok()?;
    inside(probability).then(|| law.inverse_cdf(probability))
}

/// Probability that `χ²` with `freedom` degrees of freedom exceeds `value ≥ 0`.
pub fn chi_squared_exceedance(value: f64, freedom: f64) -> Option<f64> {
    let law = ChiSquared::new(freedom).ok()?;
    (value >= 0.0).then(|| law.sf(value))
}

fn inside(probability: f64) -> bool {
    probability > 0.0 && probability < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(found: Option<f64>, expected: f64) {
        let found = found.unwrap();
        assert!((found - expected).abs() <= 1e-11 * expected, "{found} against {expected}");
    }

    /// References: SciPy 1.17 `stats.t.ppf`, `f.ppf`, `chi2.ppf`.
    #[test]
    fn quantiles_agree_with_scipy() {
        check(t_quantile(0.975, 9.0), 2.262157162798205);
        check(t_quantile(0.995, 59.0), 2.661758752162967);
        check(t_quantile(0.975, 1.0), 12.70620473617469);
        check(t_quantile(0.9, 2.5), 1.730250928807177);
        check(f_quantile(0.95, 1.0, 9.0), 5.117355029199225);
        check(f_quantile(0.95, 1.0, 59.0), 4.003982503130608);
        check(f_quantile(0.99, 5.0, 100.0), 3.205871771423001);
        check(chi_squared_quantile(0.95, 20.0), 31.41043284423092);
        check(chi_squared_quantile(0.01, 10.0), 2.558212160187206);
        check(chi_squared_exceedance(9.46976102972671, 1.0), 0.0020888658259136674);
    }

    #[test]
    fn impossible_arguments_have_no_quantile() {
        assert_eq!(t_quantile(0.975, 0.0), None);
        assert_eq!(t_quantile(1.0, 5.0), None);
        assert_eq!(f_quantile(f64::NAN, 1.0, 5.0), None);
    }
}
