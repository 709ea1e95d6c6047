//! Instrumental variables, and the test of least squares against them.
//!
//! Positions measured in a control loop spoil least squares twice: noise of the positions makes the regressor `W` noisy, and the
//! controller feeds that noise back into the effort `y`. Instruments `Z` are rows that know nothing of the noise: the regressor of
//! the motion that a noise-free simulation makes along the same reference (IDIM-IV). With `Zᵀ(W x - y) = 0` estimates are free of
//! that bias whatever the noise, and the distance between them and least squares is the size of the bias.
//!
//! Everything works on factors of paired rows `[Z | W | y]`, one per log, output, kernel scale and time block: a
//! [`ReducedGroup`](dynid_factor::groups::ReducedGroup) whose `2 k` columns are those of the instruments, base columns `c` of `total`, then
//! those of the measured rows as columns `total + c`. Samples are not touched again, by neither
//! estimate, jackknife nor test.
//!
//! | question | function |
//! |---|---|
//! | one estimate from given instruments, weights found along the way | [`instrumental`] |
//! | simulate, estimate, simulate again until estimates settle | [`iterate`] |
//! | one step of DIDIM or of closed-loop output error, on rows of a simulated motion | [`along_simulation`] |
//! | is least squares biased, by how much (Durbin, Wu, Hausman) | [`exogeneity()`] |
//!
//! Sources: Janot, Vandanjon & Gautier 2014, *A generic instrumental variable approach for industrial robot identification*; 2016 for the
//! test; Gautier, Janot & Vandanjon 2013, *A new closed-loop output error method for parameter identification of robot dynamics* (DIDIM).

mod estimate;
mod exogeneity;
mod iterate;

pub use estimate::{InstrumentSettings, InstrumentalEstimate, Strength, instrumental};
pub use exogeneity::{Effect, Exogeneity, ExogeneitySettings, ExogeneityVerdict, FTest, exogeneity};
pub use iterate::{Iteration, IterationEnd, Simulated, along_simulation, iterate};

pub use crate::oblique::{crossed, half, measured, paired_columns, simulated};
