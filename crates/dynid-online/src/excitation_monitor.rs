//! What the last samples told about each parameter.

use alloc::vec;
use alloc::vec::Vec;

use crate::forgetting::orthonormalise;
use crate::square_root::SquareRoot;
use dynid_words::Transfer;

/// Share of the prior's information that keeps the monitor's factor regular.
const REGULARISATION: f64 = 1e-8;

/// Information gained along each parameter in a stretch of samples, and what is not excited by it.
///
/// The figure is `1/((ΦᵀΦ)⁻¹)_jj` over the stretch: what is left of a parameter's information when all others
/// are unknown too. The plain column norm would call viscous and Coulomb friction excited at any one speed,
/// where only their sum is. Parameters that gain less than the threshold are frozen: their joint covariance
/// is kept when the rest forgets.
///
/// Figures are formed once per stretch and hold for the next; nothing is frozen in the first.
#[derive(Debug, Clone)]
pub struct ExcitationMonitor {
    samples: usize,
    threshold: Vec<f64>,
    stretch: SquareRoot,
    start: SquareRoot,
    count: usize,
    information: Vec<f64>,
    frozen: Vec<bool>,
    frozen_count: usize,
    basis: Vec<f64>,
    kept: Vec<f64>,
    scratch: Vec<f64>,
    rows: Vec<f64>,
}

impl ExcitationMonitor {
    /// Stretches of `samples` with up to `rows` rows each; `threshold`: least information per parameter, in
    /// inverse squares of its unit, positive.
    pub fn new(threshold: &[f64], samples: usize, rows: usize) -> Self {
        let p = threshold.len();
        let std: Vec<f64> = threshold.iter().map(|t| 1.0 / libm::sqrt(REGULARISATION * t)).collect();
        let start = SquareRoot::from_prior(&vec![0.0; p], &std);
        Self {
            samples,
            threshold: threshold.to_vec(),
            stretch: start.clone(),
            start,
            count: 0,
            information: vec![0.0; p],
            frozen: vec![false; p],
            frozen_count: 0,
            basis: vec![0.0; p * p],
            kept: vec![0.0; p * (p + 1)],
            scratch: vec![0.0; p],
            rows: vec![0.0; rows * (p + 1)],
        }
    }

    /// Takes a sample: weighted rows `[φ y]`.
    pub fn push(&mut self, rows: &[f64]) {
        let copy = &mut self.rows[..rows.len()];
        copy.copy_from_slice(rows);
        self.stretch.push(copy);
        self.count += 1;
        if self.count < self.samples {
            return;
        }
        self.frozen_count = 0;
        for j in 0..self.threshold.len() {
            let own = REGULARISATION * self.threshold[j];
            self.information[j] = (1.0 / self.stretch.variance(j, &mut self.scratch) - own).max(0.0);
            self.frozen[j] = self.information[j] < self.threshold[j];
            self.frozen_count += usize::from(self.frozen[j]);
        }
        self.stretch.copy_from(&self.start);
        self.count = 0;
    }

    /// Information gained per parameter in the last whole stretch, in inverse squares of its unit; zeros
    /// before.
    pub fn information(&self) -> &[f64] {
        &self.information
    }

    /// Parameters that do not forget.
    pub fn frozen(&self) -> &[bool] {
        &self.frozen
    }

    /// Number of parameters that do not forget.
    pub fn frozen_count(&self) -> usize {
        self.frozen_count
    }

    /// Discounts information by `lambda`, but keeps the joint covariance of the frozen parameters; the
    /// estimate stays.
    ///
    /// With `U` an orthonormal basis of the columns `R⁻ᵀ e_j` of frozen `j`, `RᵀR ← λ RᵀR + (1 - λ) RᵀU UᵀR`:
    /// a discount and one row per frozen parameter. `root` must be regular.
    pub fn discount(&mut self, root: &mut SquareRoot, lambda: f64) {
        let p = root.columns();
        if self.frozen_count == p {
            return root.discount_remainder(lambda);
        }
        let size = libm::sqrt(1.0 - lambda);
        let mut found = 0;
        for j in (0..p).filter(|j| self.frozen[*j]) {
            let (basis, rest) = self.basis.split_at_mut(found * p);
            let own = &mut rest[..p];
            root.unit_solution(j, own);
            if !orthonormalise(own, basis, 1e-12) {
                continue;
            }
            let row = &mut self.kept[found * (p + 1)..(found + 1) * (p + 1)];
            root.times_transposed(own, row);
            row.iter_mut().for_each(|v| *v *= size);
            found += 1;
        }
        root.discount(lambda);
        for row in self.kept[..found * (p + 1)].chunks_exact_mut(p + 1) {
            root.push_pseudo(0, row);
        }
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        self.stretch.transfer(transfer);
        transfer.count(&mut self.count, self.samples + 1);
        transfer.finites(&mut self.information);
        self.frozen.iter_mut().for_each(|frozen| transfer.flag(frozen));
        self.frozen_count = self.frozen.iter().filter(|frozen| **frozen).count();
    }
}
