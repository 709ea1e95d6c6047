//! Efforts that repeat with the position of a joint, found in residuals: torque ripple, and friction that changes over a turn.
//!
//! A spectrum over position proposes orders, held-out parts of the motion judge them.

mod rows;
mod score;
mod search;
mod slow;
mod spectrum;

pub use rows::{CyclicRows, CyclicSettings};
pub use search::{CyclicFinding, find_cyclic};
pub use slow::{SlowFinding, find_slow};
