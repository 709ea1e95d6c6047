//! Inertia of coordinates without bodies.

use crate::lu::Lu;

/// Inertia of the elements, `[A_bb A_bm; A_mb A_mm]`, split into joints `b` and coordinates without bodies `m`. It does not
/// depend on the state, so the coordinates can be eliminated once and for all:
/// `(M + A_bb - A_bm A_mm⁻¹ A_mb) q̈_b = e_b - A_bm A_mm⁻¹ e_m`, `q̈_m = A_mm⁻¹ (e_m - A_mb q̈_b)`.
#[derive(Debug)]
pub(crate) struct Bodiless {
    joints: usize,
    /// Factors of `A_mm`.
    own: Lu,
    /// `A_mm⁻¹ A_mb`, row-major.
    coupling: Vec<f64>,
}

impl Bodiless {
    /// From the inertia of all `n` rates, row-major and symmetric; also what is left of it for the joints.
    ///
    /// # Errors
    /// The rate of a coordinate that has no inertia.
    pub(crate) fn new(n: usize, joints: usize, added: &[f64]) -> Result<(Bodiless, Vec<f64>), usize> {
        if let Some(rate) =
            (joints..n).find(|k| !(added[k * (n + 1)] > 0.0 && added[k * (n + 1)].is_finite()))
        {
            return Err(rate);
        }
        let count = n - joints;
        let block = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| -> Vec<f64> {
            rows.flat_map(|i| columns.clone().map(move |j| added[i * n + j])).collect()
        };
        let mut own = Lu::default();
        if !own.factor(count, &block(joints..n, joints..n)) {
            return Err(joints);
        }
        let mut coupling = vec![0.0; count * joints];
        let mut left = block(0..joints, 0..joints);
        for b in 0..joints {
            let mut column: Vec<f64> = (joints..n).map(|m| added[m * n + b]).collect();
            own.solve(&mut column);
            for (m, x) in column.into_iter().enumerate() {
                coupling[m * joints + b] = x;
                for row in 0..joints {
                    left[row * joints + b] -= added[row * n + joints + m] * x;
                }
            }
        }
        Ok((Bodiless { joints, own, coupling }, left))
    }

    /// From efforts of all rates to those that the joints feel, followed by `A_mm⁻¹ e_m`.
    pub(crate) fn eliminate(&self, effort: &mut [f64]) {
        let (joints, own) = effort.split_at_mut(self.joints);
        for (e, row) in own.iter().zip(self.coupling.chunks_exact(self.joints.max(1))) {
            joints.iter_mut().zip(row).for_each(|(to, c)| *to -= c * e);
        }
        self.own.solve(own);
    }

    /// Accelerations of the coordinates from those of the joints and what [`Bodiless::eliminate`] left.
    pub(crate) fn complete(&self, eliminated: &[f64], ddq: &mut [f64]) {
        let (joints, own) = ddq.split_at_mut(self.joints);
        own.copy_from_slice(&eliminated[self.joints..]);
        for (a, row) in own.iter_mut().zip(self.coupling.chunks_exact(self.joints.max(1))) {
            *a -= row.iter().zip(&*joints).map(|(c, x)| c * x).sum::<f64>();
        }
    }
}
