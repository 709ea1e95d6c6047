//! Efforts that repeat with the position of a joint, found in residuals: torque ripple, and friction that changes over a turn.
//!
//! A spectrum over position proposes orders, held-out parts of the motion judge them.

mod score;
mod search;
mod spectrum;

pub use search::{CyclicFinding, CyclicRows, CyclicSettings, find_cyclic};

/// A row of residuals of a joint that moves.
#[derive(Debug, Clone, Copy)]
struct Row {
    position: f64,
    velocity: f64,
    residual: f64,
    weight: f64,
    part: usize,
}

impl Row {
    /// What the kernel leaves of a ripple of `n` repetitions at the speed of the row; `kernel_s`: standard deviation of the kernel.
    fn passes(&self, n: f64, kernel_s: f64) -> f64 {
        let turn = n * self.velocity * kernel_s;
        (-0.5 * turn * turn).exp()
    }
}
