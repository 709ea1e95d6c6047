//! What comes before a log: test motions, designed motions with their forecast, and virtual experiments.

pub mod design;
pub mod motions;
pub mod simulate;
