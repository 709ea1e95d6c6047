//! Straight lines of coefficients over temperature.

use dynid_linalg::Mat;

use dynid_estimate::distribution::t_quantile;

/// `σ(T) = value + slope (T - T_ref)` through the coefficients of several temperatures.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalLine {
    /// `sigma2`, `sigma3` or `sigma4`.
    pub symbol: &'static str,
    /// Value at the reference temperature.
    pub value: f64,
    /// Slope, per K.
    pub slope: f64,
    /// Covariance of value and slope: `[var, cov, var]`.
    pub covariance: [f64; 3],
    /// Factor of standard deviations to intervals of the confidence asked for: Student's quantile.
    pub quantile: f64,
    /// `T_ref`, °C.
    pub reference_temperature: f64,
    /// `χ²` of the levels about the line, and its degrees of freedom.
    pub chi_squared: (f64, usize),
}

impl ThermalLine {
    /// Value of the line at a temperature.
    pub fn at(&self, temperature: f64) -> f64 {
        self.value + self.slope * (temperature - self.reference_temperature)
    }

    /// Half width of the confidence interval of the line at a temperature.
    pub fn half_width(&self, temperature: f64) -> f64 {
        let d = temperature - self.reference_temperature;
        let [vv, vs, ss] = self.covariance;
        self.quantile * (vv + 2.0 * d * vs + d * d * ss).max(0.0).sqrt()
    }

    /// Half width of the confidence interval of the slope.
    pub fn slope_half_width(&self) -> f64 {
        self.quantile * self.covariance[2].max(0.0).sqrt()
    }
}

/// Generalised least squares: levels of one fit are correlated through what they share. Where the levels scatter more about
/// the line than their errors allow, the intervals grow with it (`χ²` over its degrees of freedom, if above 1).
///
/// `freedom`: degrees of freedom of the errors themselves. `None` with fewer than two levels or errors that are not positive.
pub(super) fn line(
    symbol: &'static str,
    temperatures: &[f64],
    values: &[f64],
    errors: &Mat,
    (reference, confidence, freedom): (f64, f64, usize),
) -> Option<ThermalLine> {
    let n = values.len();
    if n < 2 {
        return None;
    }
    // Unit diagonal: levels' errors may differ by orders of magnitude.
    let s: Vec<f64> = (0..n).map(|i| errors[(i, i)].sqrt()).collect();
    if !s.iter().all(|s| *s > 0.0) {
        return None;
    }
    let unit = Mat::from_fn(n, n, |i, j| errors[(i, j)] / (s[i] * s[j]));
    let factor = unit.cholesky()?;
    let columns = Mat::from_fn(n, 3, |i, j| [1.0, temperatures[i] - reference, values[i]][j] / s[i]);
    let solved = factor.solve(&columns);
    let dot = |a: usize, b: usize| (0..n).map(|i| columns[(i, a)] * solved[(i, b)]).sum::<f64>();
    let (aa, ab, bb, ay, by) = (dot(0, 0), dot(0, 1), dot(1, 1), dot(0, 2), dot(1, 2));
    let determinant = aa * bb - ab * ab;
    if determinant <= 1e-12 * aa * bb {
        return None;
    }
    let (value, slope) = ((bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant);
    let chi_squared = (dot(2, 2) - value * ay - slope * by).max(0.0);
    let line_freedom = n - 2;
    let scatter = if line_freedom > 0 { (chi_squared / line_freedom as f64).max(1.0) } else { 1.0 };
    // With scatter beyond the errors, it is the levels that the intervals rest on.
    let counts = if scatter > 1.0 { line_freedom } else { freedom.max(1) };
    Some(ThermalLine {
        symbol,
        value,
        slope,
        covariance: [bb, -ab, aa].map(|x| scatter * x / determinant),
        quantile: t_quantile(0.5 + 0.5 * confidence, counts as f64)?,
        reference_temperature: reference,
        chi_squared: (chi_squared, line_freedom),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_line_is_found_and_its_errors_are_those_of_weighted_least_squares() {
        let t = [19.0, 25.0, 30.0, 51.0];
        let values = t.map(|t| 40.0 - 0.8 * (t - 25.0));
        let errors = Mat::from_fn(4, 4, |i, j| if i == j { [1.0, 4.0, 1.0, 0.25][i] } else { 0.0 });
        let found = line("sigma2", &t, &values, &errors, (25.0, 0.95, 50)).unwrap();
        assert!((found.value - 40.0).abs() < 1e-12 && (found.slope + 0.8).abs() < 1e-13, "{found:?}");
        let w = [1.0, 0.25, 1.0, 4.0];
        let sum = |p: i32| t.iter().zip(w).map(|(t, w)| w * (t - 25.0).powi(p)).sum::<f64>();
        let slope_variance = sum(0) / (sum(0) * sum(2) - sum(1) * sum(1));
        assert!((found.covariance[2] - slope_variance).abs() < 1e-13);
        assert!(found.half_width(51.0) > 0.0 && found.at(51.0) == found.value + found.slope * 26.0);
    }
}
