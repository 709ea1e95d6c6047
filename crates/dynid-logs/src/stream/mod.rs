//! Live streams: lines of text as they come, each a row of numbers or skipped and counted.

mod bad_line;
mod fields;
mod json;
mod lines;

pub use bad_line::BadLine;
pub use fields::{LineFormat, StreamRows};
pub use lines::{LineSource, LinesEnd};
