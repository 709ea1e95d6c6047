//! How sharply a minimum is defined, from values of the objective alone.

use dynid_linalg::Mat;

/// Covariance of the coordinates at the minimum of a sum of squares, from the parabola through values around it.
///
/// `objective`: the sum of squares; `minimum`: its coordinates there, on the scale on which steps are meant (logarithms, where a
/// search is logarithmic); `steps`: one per coordinate, large enough for the rise to stand above rounding; `variance`: of
/// one residual. `C = 2 variance H⁻¹` with `H` from second differences. `None` where `H` is not positive
/// definite: the data leave a direction open, or this is no minimum.
///
/// For simulations, which have no derivative at hand; everything that has one is differentiated exactly.
pub fn covariance_of_values(
    objective: &dyn Fn(&[f64]) -> f64,
    minimum: &[f64],
    steps: &[f64],
    variance: f64,
) -> Option<Mat> {
    let n = minimum.len();
    let at = |moves: &[(usize, f64)]| {
        let mut x = minimum.to_vec();
        moves.iter().for_each(|(k, sign)| x[*k] += sign * steps[*k]);
        objective(&x)
    };
    let least = at(&[]);
    let mut hessian = Mat::zeros(n, n);
    for i in 0..n {
        hessian[(i, i)] = at(&[(i, 1.0)]) - 2.0 * least + at(&[(i, -1.0)]);
        for j in 0..i {
            let mixed = at(&[(i, 1.0), (j, 1.0)]) - at(&[(i, 1.0), (j, -1.0)]) - at(&[(i, -1.0), (j, 1.0)])
                + at(&[(i, -1.0), (j, -1.0)]);
            (hessian[(i, j)], hessian[(j, i)]) = (0.25 * mixed, 0.25 * mixed);
        }
    }
    if (0..n).any(|i| !(hessian[(i, i)] > 0.0 && hessian[(i, i)].is_finite())) {
        return None;
    }
    let scale: Vec<f64> = (0..n).map(|i| hessian[(i, i)].sqrt()).collect();
    let unit = Mat::from_fn(n, n, |i, j| hessian[(i, j)] / (scale[i] * scale[j]));
    let inverse = unit.cholesky()?.solve(&Mat::identity(n, n));
    Some(Mat::from_fn(n, n, |i, j| {
        2.0 * variance * inverse[(i, j)] * steps[i] * steps[j] / (scale[i] * scale[j])
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_gives_its_inverse() {
        let f = |x: &[f64]| {
            3.0 + 2.0 * (x[0] - 1.0).powi(2) + (x[0] - 1.0) * (x[1] + 2.0) + 0.5 * (x[1] + 2.0).powi(2)
        };
        let c = covariance_of_values(&f, &[1.0, -2.0], &[0.1, 0.2], 0.7).unwrap();
        // H = [4 1; 1 1], its inverse [1 -1; -1 4] / 3.
        for (i, j, exact) in [(0, 0, 1.0), (0, 1, -1.0), (1, 1, 4.0)] {
            assert!((c[(i, j)] - 1.4 * exact / 3.0).abs() < 1e-12, "{}", c[(i, j)]);
        }
        assert!(covariance_of_values(&|x| x[0] * x[0], &[0.0, 0.0], &[0.1; 2], 1.0).is_none());
    }
}
