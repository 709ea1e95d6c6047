//! Criteria: what makes one trajectory better than another, with exact sensitivities.
//!
//! All start from the triangle `R` of the weighted observation matrix (with the triangle of information that is there
//! already stacked under it), so `M_f = RᵀR` is the Fisher information. The sensitivity of every criterion is
//! `∂c/∂W = W H` with a symmetric `H` of the size of `R`.
//!
//! Source: Gautier & Khalil 1992 (condition number), Swevers et al. 1997.

mod triangle;

use dynid_linalg::Mat;
pub(crate) use triangle::{inverse, singular_values, triangle};

/// What is minimised.
#[derive(Debug, Clone, PartialEq)]
pub enum Measure {
    /// `ln σ₁/σ_p`.
    Condition,
    /// `ln (w₁ σ₁/σ_p + w₂/σ_p)`.
    ConditionAndSmallest {
        /// `w₁`.
        condition: f64,
        /// `w₂`, unit of `σ`.
        smallest: f64,
    },
    /// E-optimal: `-2 ln σ_p`.
    Smallest,
    /// D-optimal: `-ln det M_f`.
    Determinant,
    /// A-optimal: `ln tr(C M_f⁻¹)` with diagonal `C`, one entry per column; ones give the plain A-optimal design.
    ///
    /// With `C = diag(1/βᵢ²)` it is the mean square of relative standard deviations.
    Trace(Vec<f64>),
    /// Largest deviation of some combinations of the parameters: `1/s ln Σ_i (f_i M_f⁻¹ f_iᵀ)ˢ`, a smooth stand-in for
    /// `ln max_i f_i M_f⁻¹ f_iᵀ` that is at most `ln(k)/s` above it.
    ///
    /// With `f_i` a parameter in units of the deviation that is wanted of it, the measure is negative only where all are met.
    Largest {
        /// `f_i`, one row per combination, one entry per column.
        of: Mat,
        /// `s`, at least 1, where it is the trace.
        order: f64,
    },
}

/// What columns are divided by before the measure is taken.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnScaling {
    /// Nothing: columns in SI units.
    Raw,
    /// Lengths of the columns themselves.
    UnitNorm,
    /// Given numbers, one per column.
    Given(Vec<f64>),
}

/// A criterion: smaller is better.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// What is minimised.
    pub measure: Measure,
    /// Scaling of columns.
    pub scaling: ColumnScaling,
}

/// Symmetric `H` of `∂c/∂W = W H`.
#[derive(Debug, Clone)]
pub(crate) enum GramSensitivity {
    Full(Mat),
    /// `Σ factor · v vᵀ`.
    Outer(Vec<(f64, Vec<f64>)>),
}

/// How the extreme singular values are replaced by smooth ones: power sums of this order instead of the extremes.
pub(crate) type Smoothing = Option<f64>;

impl Criterion {
    /// A measure on columns in SI units.
    pub fn raw(measure: Measure) -> Self {
        Criterion { measure, scaling: ColumnScaling::Raw }
    }

    /// A measure on columns of unit length.
    pub fn unit_norm(measure: Measure) -> Self {
        Criterion { measure, scaling: ColumnScaling::UnitNorm }
    }

    /// Whether the extremes of the spectrum decide, so that it is not differentiable where they meet.
    pub(crate) fn is_extremal(&self) -> bool {
        !matches!(self.measure, Measure::Determinant | Measure::Trace(_) | Measure::Largest { .. })
    }

    /// Value for a triangle; `None` if it is singular or not finite.
    pub fn value(&self, triangle: &Mat) -> Option<f64> {
        self.smooth_value(triangle, None)
    }

    pub(crate) fn smooth_value(&self, triangle: &Mat, smoothing: Smoothing) -> Option<f64> {
        let (scaled, _) = self.scaled(triangle)?;
        let value = match &self.measure {
            Measure::Determinant => {
                -2.0 * (0..scaled.nrows()).map(|i| scaled[(i, i)].abs().ln()).sum::<f64>()
            }
            Measure::Trace(weights) => weighted_trace(&inverse(&scaled)?, weights).ln(),
            Measure::Largest { of, order } => {
                PowerSum::of(&variances(&(of * &inverse(&scaled)?)), *order).logarithm
            }
            _ => {
                let (sigma, _) = singular_values(&scaled, false)?;
                Spectral::new(&sigma, smoothing)?.value(&self.measure)
            }
        };
        value.is_finite().then_some(value)
    }

    /// Value and sensitivity `H` for a triangle.
    pub(crate) fn sensitivity(&self, triangle: &Mat, smoothing: Smoothing) -> Option<(f64, GramSensitivity)> {
        let (scaled, scale) = self.scaled(triangle)?;
        let (value, sensitivity) = match &self.measure {
            Measure::Determinant => {
                let inverse = inverse(&scaled)?;
                let value = -2.0 * (0..scaled.nrows()).map(|i| scaled[(i, i)].abs().ln()).sum::<f64>();
                (value, GramSensitivity::Full((&inverse * inverse.transpose()) * -2.0))
            }
            Measure::Trace(weights) => {
                let inverse = inverse(&scaled)?;
                let trace = weighted_trace(&inverse, weights);
                let covariance = &inverse * inverse.transpose();
                let n = covariance.nrows();
                let left = Mat::from_fn(n, n, |i, j| covariance[(i, j)] * weights[j]);
                (trace.ln(), GramSensitivity::Full((left * &covariance) * (-2.0 / trace)))
            }
            Measure::Largest { of, order } => {
                let inverse = inverse(&scaled)?;
                let rows = of * &inverse;
                let PowerSum { logarithm, slopes } = PowerSum::of(&variances(&rows), *order);
                // Rows of `F M⁻¹`: d(f M⁻¹ fᵀ) = -f M⁻¹ dM M⁻¹ fᵀ.
                let images = rows * inverse.transpose();
                let n = images.ncols();
                let left = Mat::from_fn(n, images.nrows(), |j, i| -2.0 * slopes[i] * images[(i, j)]);
                (logarithm, GramSensitivity::Full(left * images))
            }
            _ => {
                let (sigma, v) = singular_values(&scaled, true)?;
                let spectral = Spectral::new(&sigma, smoothing)?;
                let slope = spectral.slope(&self.measure);
                let acting = (0..sigma.len()).filter(|i| slope[*i] != 0.0);
                let outer = acting.map(|i| (slope[i] / sigma[i], v.col(i).to_vec())).collect::<Vec<_>>();
                (spectral.value(&self.measure), GramSensitivity::Outer(outer).condensed(sigma.len()))
            }
        };
        value.is_finite().then(|| (value, self.unscaled(sensitivity, &scaled, &scale)))
    }

    fn scaled(&self, triangle: &Mat) -> Option<(Mat, Vec<f64>)> {
        let n = triangle.nrows();
        let scale = match &self.scaling {
            ColumnScaling::Raw => return Some((triangle.clone(), vec![1.0; n])),
            ColumnScaling::UnitNorm => (0..n).map(|j| triangle.col_norm(j)).collect(),
            ColumnScaling::Given(scale) => scale.clone(),
        };
        if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
            return None;
        }
        Some((Mat::from_fn(n, n, |i, j| triangle[(i, j)] / scale[j]), scale))
    }

    /// From the scaled matrix back to the columns themselves.
    fn unscaled(&self, sensitivity: GramSensitivity, scaled: &Mat, scale: &[f64]) -> GramSensitivity {
        match self.scaling {
            ColumnScaling::Raw => sensitivity,
            ColumnScaling::Given(_) => match sensitivity {
                GramSensitivity::Full(h) => GramSensitivity::Full(divided(&h, scale)),
                GramSensitivity::Outer(mut terms) => {
                    for (_, v) in &mut terms {
                        v.iter_mut().zip(scale).for_each(|(x, s)| *x /= s);
                    }
                    GramSensitivity::Outer(terms)
                }
            },
            ColumnScaling::UnitNorm => {
                // Lengths move with the columns: d(w/|w|) = (dw - w̃ (w̃·dw))/|w|.
                let mut h = sensitivity.dense(scaled.nrows());
                let gram = scaled.transpose() * scaled;
                for j in 0..h.nrows() {
                    let along: f64 = (0..h.nrows()).map(|k| gram[(j, k)] * h[(k, j)]).sum();
                    h[(j, j)] -= along;
                }
                GramSensitivity::Full(divided(&h, scale))
            }
        }
    }
}

fn divided(h: &Mat, scale: &[f64]) -> Mat {
    Mat::from_fn(h.nrows(), h.ncols(), |i, j| h[(i, j)] / (scale[i] * scale[j]))
}

/// `tr(C R⁻¹R⁻ᵀ)`.
fn weighted_trace(inverse: &Mat, weights: &[f64]) -> f64 {
    (0..inverse.nrows())
        .map(|i| weights[i] * (i..inverse.ncols()).map(|j| inverse[(i, j)].powi(2)).sum::<f64>())
        .sum()
}

/// Squared lengths of rows.
fn variances(rows: &Mat) -> Vec<f64> {
    (0..rows.nrows()).map(|i| (0..rows.ncols()).map(|j| rows[(i, j)].powi(2)).sum()).collect()
}

/// `1/s ln Σ xˢ` of positive numbers with its slopes.
struct PowerSum {
    logarithm: f64,
    slopes: Vec<f64>,
}

impl PowerSum {
    fn of(x: &[f64], order: f64) -> Self {
        // Relative to the largest: powers of the numbers themselves may overflow.
        let largest = x.iter().copied().fold(0.0, f64::max);
        let sum: f64 = x.iter().map(|x| (x / largest).powf(order)).sum();
        PowerSum {
            logarithm: largest.ln() + sum.ln() / order,
            slopes: x.iter().map(|x| (x / largest).powf(order - 1.0) / (largest * sum)).collect(),
        }
    }
}

impl GramSensitivity {
    /// More than a few outer products are cheaper as one matrix.
    fn condensed(self, n: usize) -> Self {
        match &self {
            GramSensitivity::Outer(terms) if terms.len() > 2 => GramSensitivity::Full(self.dense(n)),
            _ => self,
        }
    }

    fn dense(&self, n: usize) -> Mat {
        match self {
            GramSensitivity::Full(h) => h.clone(),
            GramSensitivity::Outer(terms) => {
                let v = Mat::from_fn(n, terms.len(), |i, k| terms[k].1[i]);
                let scaled = Mat::from_fn(n, terms.len(), |i, k| terms[k].0 * terms[k].1[i]);
                scaled * v.transpose()
            }
        }
    }
}

/// Logarithms of the (smooth) extremes of a spectrum with their slopes.
struct Spectral<'a> {
    sigma: &'a [f64],
    smoothing: Smoothing,
    /// `ln σ₁` or `(1/s) ln Σ σˢ`.
    largest: f64,
    /// `-ln σ_p` or `(1/s) ln Σ σ⁻ˢ`.
    reciprocal: f64,
    sums: (f64, f64),
}

impl<'a> Spectral<'a> {
    fn new(sigma: &'a [f64], smoothing: Smoothing) -> Option<Self> {
        let (first, last) = (*sigma.first()?, *sigma.last()?);
        if !(last > 0.0 && first.is_finite()) {
            return None;
        }
        let sums = smoothing.map_or((1.0, 1.0), |s| {
            let up = sigma.iter().map(|x| (x / first).powf(s)).sum();
            let down = sigma.iter().map(|x| (last / x).powf(s)).sum();
            (up, down)
        });
        let share = |sum: f64| smoothing.map_or(0.0, |s| sum.ln() / s);
        Some(Spectral {
            sigma,
            smoothing,
            largest: first.ln() + share(sums.0),
            reciprocal: -last.ln() + share(sums.1),
            sums,
        })
    }

    fn value(&self, measure: &Measure) -> f64 {
        match measure {
            Measure::Condition => self.largest + self.reciprocal,
            Measure::ConditionAndSmallest { condition, smallest } => {
                (condition * self.largest.exp() + smallest).ln() + self.reciprocal
            }
            Measure::Smallest => 2.0 * self.reciprocal,
            Measure::Determinant | Measure::Trace(_) | Measure::Largest { .. } => f64::NAN,
        }
    }

    /// `∂c/∂σ`.
    fn slope(&self, measure: &Measure) -> Vec<f64> {
        let (up, down) = match measure {
            Measure::Condition => (1.0, 1.0),
            Measure::ConditionAndSmallest { condition, smallest } => {
                let term = condition * self.largest.exp();
                (term / (term + smallest), 1.0)
            }
            Measure::Smallest => (0.0, 2.0),
            Measure::Determinant | Measure::Trace(_) | Measure::Largest { .. } => (0.0, 0.0),
        };
        let (n, first, last) = (self.sigma.len(), self.sigma[0], self.sigma[self.sigma.len() - 1]);
        (0..n)
            .map(|i| {
                let x = self.sigma[i];
                let (large, small) = match self.smoothing {
                    Some(s) => {
                        ((x / first).powf(s) / (x * self.sums.0), (last / x).powf(s) / (x * self.sums.1))
                    }
                    None => (if i == 0 { 1.0 / x } else { 0.0 }, if i == n - 1 { 1.0 / x } else { 0.0 }),
                };
                up * large - down * small
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const ORDERS: [f64; 4] = [5.0, 15.0, 50.0, 150.0];

    fn measures() -> [Measure; 3] {
        let both = Measure::ConditionAndSmallest { condition: 0.7, smallest: 3.0 };
        [Measure::Condition, both, Measure::Smallest]
    }

    /// Tall matrices with spectra from flat to spread over six decades.
    fn matrices() -> Vec<Mat> {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        [0.0, 1.0, 3.0, 6.0]
            .map(|decades| {
                let scale: Vec<f64> = (0..7).map(|j| 10_f64.powf(-decades * f64::from(j) / 6.0)).collect();
                Mat::from_fn(30, 7, |_, j| scale[j] * rng.random_range(-1.0..=1.0))
            })
            .to_vec()
    }

    fn triangle_of(w: &Mat) -> Mat {
        triangle(&mut w.clone())
    }

    #[test]
    fn smooth_sensitivities_agree_with_differences() {
        for w in matrices() {
            for measure in measures() {
                for scaling in [ColumnScaling::Raw, ColumnScaling::UnitNorm] {
                    let criterion = Criterion { measure: measure.clone(), scaling };
                    for order in ORDERS {
                        let (value, h) = criterion.sensitivity(&triangle_of(&w), Some(order)).unwrap();
                        assert_eq!(Some(value), criterion.smooth_value(&triangle_of(&w), Some(order)));
                        let g = &w * h.dense(7);
                        for (row, column) in [(0, 0), (3, 2), (11, 6), (29, 4)] {
                            // In units of the column, whose length may be 1e-6.
                            let unit = w.col_norm(column);
                            let moved = |steps: f64| {
                                let mut w = w.clone();
                                w[(row, column)] += steps * 1e-4 * unit;
                                criterion.smooth_value(&triangle_of(&w), Some(order)).unwrap()
                            };
                            let difference = (8.0 * (moved(1.0) - moved(-1.0)) - (moved(2.0) - moved(-2.0)))
                                / (12.0 * 1e-4);
                            let found = g[(row, column)] * unit;
                            assert!(
                                (found - difference).abs() <= 1e-7 * (1.0 + difference.abs()),
                                "{criterion:?} {order}: {found} {difference}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// `ln cond ≤ P_s ≤ ln cond + 2 ln p / s`, also where powers of the singular values themselves would overflow.
    #[test]
    fn smooth_values_close_in_on_the_extremes() {
        for w in matrices() {
            for unit in [1e-30, 1.0, 1e30] {
                let triangle = triangle_of(&(&w * unit));
                let criterion = Criterion::raw(Measure::Condition);
                let exact = criterion.value(&triangle).unwrap();
                let mut before = f64::INFINITY;
                for order in ORDERS {
                    let smooth = criterion.smooth_value(&triangle, Some(order)).unwrap();
                    assert!(smooth >= exact - 1e-12 && smooth <= exact + 2.0 * 7_f64.ln() / order + 1e-12);
                    assert!(smooth <= before);
                    before = smooth;
                }
            }
        }
    }

    #[test]
    fn singular_and_broken_triangles_have_no_value() {
        let mut triangle = triangle_of(&matrices()[0]);
        triangle[(6, 6)] = 0.0;
        let trace = Measure::Trace(vec![1.0; 7]);
        let largest = Measure::Largest { of: Mat::identity(7, 7), order: 4.0 };
        for measure in measures().into_iter().chain([Measure::Determinant, trace, largest]) {
            for broken in [0.0, f64::NAN] {
                triangle[(6, 6)] = broken;
                let criterion = Criterion::raw(measure.clone());
                let value = criterion.value(&triangle);
                // A singular value of rounding size is a number, if a huge one.
                assert!(value.is_none_or(|v| broken == 0.0 && v > 30.0), "{measure:?} {broken}: {value:?}");
            }
        }
    }
}
