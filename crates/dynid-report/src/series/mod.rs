//! Time series on their way to the page: checked, decimated, written compactly; and what the residual looks like.

mod decimation;
mod encoding;
mod motion;
mod payload;
mod residual;

pub(crate) use motion::{Quantity, drawn_limits, motion_payload};
pub(crate) use payload::{PointBudget, log_payload, median_step};
pub(crate) use residual::{Autocorrelation, ResidualSummary, residual, summarise};
