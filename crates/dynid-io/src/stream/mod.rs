//! Live streams: lines of text as they come, each a row of numbers or skipped and counted.

mod fields;
mod json;
mod lines;

pub use fields::{BadLine, LineFormat, StreamRows};
pub use lines::{LineSource, LinesEnd};
