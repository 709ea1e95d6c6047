//! Triangular factors of small dense matrices.

/// `P A = L U` of a square matrix with row exchanges, reusable.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lu {
    n: usize,
    /// Row-major; unit lower part without its diagonal, upper part.
    factors: Vec<f64>,
    exchanged: Vec<usize>,
}

impl Lu {
    /// Factors a row-major `n × n` matrix. `false` if a pivot is zero or not finite.
    pub(crate) fn factor(&mut self, n: usize, matrix: &[f64]) -> bool {
        self.n = n;
        self.factors.clear();
        self.factors.extend_from_slice(matrix);
        self.exchanged.clear();
        let a = &mut self.factors;
        for j in 0..n {
            let pivot = (j..n).fold(j, |p, i| if a[i * n + j].abs() > a[p * n + j].abs() { i } else { p });
            self.exchanged.push(pivot);
            if pivot != j {
                (0..n).for_each(|k| a.swap(j * n + k, pivot * n + k));
            }
            let inverse = 1.0 / a[j * n + j];
            if !inverse.is_finite() {
                return false;
            }
            for i in j + 1..n {
                let factor = a[i * n + j] * inverse;
                a[i * n + j] = factor;
                for k in j + 1..n {
                    a[i * n + k] -= factor * a[j * n + k];
                }
            }
        }
        true
    }

    /// Solves `A x = b` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let (n, a) = (self.n, &self.factors);
        for (j, pivot) in self.exchanged.iter().enumerate() {
            x.swap(j, *pivot);
        }
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| a[i * n + k] * x[k]).sum();
            x[i] -= sum;
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| a[i * n + k] * x[k]).sum();
            x[i] = (x[i] - sum) / a[i * n + i];
        }
    }
}

/// `A = L Lᵀ` of a symmetric positive definite matrix, reusable.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cholesky {
    n: usize,
    /// `L`, row-major.
    factors: Vec<f64>,
}

impl Cholesky {
    /// Factors a row-major `n × n` matrix, of which the lower half is read.
    ///
    /// # Errors
    /// A vector that the matrix nearly annuls, if it is not positive definite by more than rounding.
    pub(crate) fn factor(&mut self, n: usize, matrix: &[f64]) -> Result<(), Vec<f64>> {
        self.n = n;
        self.factors.clear();
        self.factors.extend_from_slice(matrix);
        let a = &mut self.factors;
        let largest = (0..n).fold(0.0_f64, |m, k| m.max(matrix[k * n + k]));
        for j in 0..n {
            for i in j..n {
                let known: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
                a[i * n + j] -= known;
            }
            let pivot = a[j * n + j];
            if !(pivot > 1e-13 * largest && pivot.is_finite()) {
                let mut null = vec![0.0; n];
                null[j] = 1.0;
                for i in (0..j).rev() {
                    let sum: f64 = (i + 1..=j).map(|k| a[k * n + i] * null[k]).sum();
                    null[i] = -sum / a[i * n + i];
                }
                return Err(null);
            }
            let inverse = 1.0 / pivot.sqrt();
            (j..n).for_each(|i| a[i * n + j] *= inverse);
        }
        Ok(())
    }

    /// Solves `A x = b` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let (n, a) = (self.n, &self.factors);
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| a[i * n + k] * x[k]).sum();
            x[i] = (x[i] - sum) / a[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| a[k * n + i] * x[k]).sum();
            x[i] = (x[i] - sum) / a[i * n + i];
        }
    }
}

/// `y += factor · A x`, row-major.
pub(crate) fn add_product(y: &mut [f64], factor: f64, a: &[f64], x: &[f64]) {
    for (to, row) in y.iter_mut().zip(a.chunks_exact(x.len())) {
        *to += factor * row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_multiply_back_also_where_rows_must_be_exchanged() {
        let a = [0.0, 2.0, 1.0, 1e-14, 1.0, 3.0, 4.0, -1.0, 0.5];
        let b = [3.0, -1.0, 2.0];
        let (mut lu, mut x) = (Lu::default(), b);
        assert!(lu.factor(3, &a));
        lu.solve(&mut x);
        let mut back = [0.0; 3];
        add_product(&mut back, 1.0, &a, &x);
        for (found, expected) in back.iter().zip(&b) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        assert!(!lu.factor(2, &[1.0, 2.0, 2.0, 4.0]));
    }

    #[test]
    fn cholesky_solves_and_names_what_a_matrix_annuls() {
        let a = [4.0, 2.0, -1.0, 2.0, 5.0, 0.5, -1.0, 0.5, 3.0];
        let b = [1.0, -2.0, 0.3];
        let (mut cholesky, mut x) = (Cholesky::default(), b);
        assert_eq!(cholesky.factor(3, &a), Ok(()));
        cholesky.solve(&mut x);
        let mut back = [0.0; 3];
        add_product(&mut back, 1.0, &a, &x);
        for (found, expected) in back.iter().zip(&b) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        let singular = [1.0, 2.0, 3.0, 2.0, 8.0, 10.0, 3.0, 10.0, 13.0];
        let null = cholesky.factor(3, &singular).unwrap_err();
        let mut image = [0.0; 3];
        add_product(&mut image, 1.0, &singular, &null);
        assert!(image.iter().all(|x| x.abs() < 1e-13) && null[2] == 1.0, "{null:?} {image:?}");
    }
}
