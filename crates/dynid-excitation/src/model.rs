//! What can be designed for: observation matrices with an adjoint.

use dynid_linalg::Mat;
use dynid_model::{MotionAdjoint, MotionBlock};

/// Sensitivity of a criterion to the observation matrix.
#[derive(Debug, Clone, Copy)]
pub enum Sensitivity<'a> {
    /// One number per entry of `W`.
    Full(&'a Mat),
    /// `Σ uᵢ vᵢᵀ`: one number per row and one per column each.
    Outer(&'a [(Vec<f64>, Vec<f64>)]),
}

/// A column of the observation matrix: one parameter to be made visible.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnInfo {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Nominal value, if known.
    pub nominal: Option<f64>,
}

/// A model whose parameters a trajectory is to make visible: linear in the columns of `W(q, q̇, q̈)`.
///
/// Coordinates are whatever the trajectory is written in: joints of a tree, or the pose of a platform.
pub trait ExcitationModel: Send + Sync {
    /// Number of coordinates.
    fn coordinates(&self) -> usize;
    /// Number of outputs (rows of `W` per sample).
    fn outputs(&self) -> usize;
    /// Columns of `W`; linearly independent.
    fn columns(&self) -> &[ColumnInfo];
    /// Response of a coordinate's position to that of the trajectory at `ω` rad/s, real and imaginary part, where the trajectory is a command
    /// that is followed; 1 at `ω = 0`. Position and velocity limits then hold for both. `None` (default): it is where the trajectory is.
    fn response(&self, _coordinate: usize, _rate: f64) -> Option<(f64, f64)> {
        None
    }
    /// Fills `W`: row `output * samples + sample`, one column per parameter.
    ///
    /// # Panics
    /// If `w` has another size.
    fn observe(&self, motion: &MotionBlock<'_>, w: &mut Mat);
    /// Adds to `out` the derivatives of `Σ G ∘ W` with respect to the motion, `G` fixed.
    fn adjoint(&self, motion: &MotionBlock<'_>, sensitivity: Sensitivity<'_>, out: &mut MotionAdjoint);
}
