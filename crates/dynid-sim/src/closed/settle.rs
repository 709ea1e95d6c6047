//! Back to the closed poses, and to rates that the loops allow.

use super::plant::{ClosedPlant, ClosedWorkspace};
use crate::error::ForwardError;

/// Gap at which a pose counts as closed, m.
const CLOSED: f64 = 1e-13;
/// Largest gap where rounding keeps it from falling further.
const STALLED: f64 = 1e-12;
const ITERATIONS: usize = 6;

impl ClosedPlant {
    /// Takes positions to a closed pose next to them by Newton steps of least length, and rates to the nearest that the loops
    /// allow, as kinetic energy measures distance: `q̇ ← Z (Zᵀ M Z)⁻¹ Zᵀ M q̇`.
    ///
    /// # Errors
    /// [`ForwardError`].
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn settle(
        &self,
        q: &mut [f64],
        dq: &mut [f64],
        work: &mut ClosedWorkspace,
    ) -> Result<(), ForwardError> {
        let mut step = vec![0.0; dq.len()];
        let mut last = f64::INFINITY;
        for left in (0..ITERATIONS).rev() {
            self.machine.free_at(&mut work.free, q);
            let gap = work.free.gap();
            if gap <= CLOSED || (gap <= STALLED && gap > 0.5 * last) {
                break;
            }
            if left == 0 || !gap.is_finite() {
                return Err(ForwardError::Open { gap });
            }
            last = gap;
            let against: Vec<f64> = work.free.residual().iter().map(|r| -r).collect();
            work.free.shortest(&against, &mut step);
            self.machine.displace(q, &step);
        }
        self.reduce(q, work)?;
        for (to, image) in work.right.iter_mut().zip(work.mass_free.chunks_exact(dq.len())) {
            *to = image.iter().zip(&*dq).map(|(m, v)| m * v).sum();
        }
        work.factor.solve(&mut work.right);
        dq.fill(0.0);
        crate::lu::add_product(dq, 1.0, work.free.basis(), &work.right);
        Ok(())
    }
}
