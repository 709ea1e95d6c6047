//! Triangular factors: what a log leaves behind once its rows are reduced.
//!
//! A log enters estimators through factors [`Factor`], one per group of rows (a joint, or a joint of one log) and time block.
//! Everything quadratic then works on factors, never on samples:
//!
//! | question | module |
//! |---|---|
//! | reduce rows of `[W y]`, merge, scale, choose columns | [`factor`] |
//! | which columns are excited, which depend on others | [`rank`] |
//! | rows of all groups, in any number of passes | [`rows`] |
//! | the factors of one output of one log at one kernel scale | [`groups`] |
//! | the same as bytes | [`wire`] |
//!
//! Notation: `W` is the regressor (rows × `p` columns), `y` the effort, `x` the parameters, `(R, z, ρ, N)` a factor.

pub mod factor;
pub mod groups;
pub mod rank;
pub mod rows;
pub mod wire;

pub use factor::{Factor, FactorBuilder, FactorError};
