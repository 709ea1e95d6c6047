//! Output error: parameters whose closed-loop simulation gives the measured positions.

mod evaluation;
mod gauss_newton;
mod spread;

pub(crate) use evaluation::readings;
pub use evaluation::{Block, BlockSums, Evaluation, ServoProblem, blocks};
pub(crate) use gauss_newton::with_priors;
pub use gauss_newton::{Ending, Fitted, GaussNewton, Place, fit};
pub use spread::{Deviations, deviations};
