//! Recursive low-pass filters as second-order sections, run forward and backward.

pub mod butterworth;
pub mod chebyshev;
pub mod decimate;
mod prototype;
pub mod sections;
pub mod zero_phase;

pub use butterworth::butterworth;
pub use chebyshev::chebyshev;
pub use decimate::{Alignment, anti_alias, decimate, pick};
pub use sections::{Section, Sections};
pub use zero_phase::{forward_backward, forward_backward_all, forward_backward_in_step};
