//! Logs as CSV, plain or gzip-compressed.

mod error;
mod input;
mod lines;
mod number;
mod read;
mod write;

pub use error::LogFileError;
pub use read::{Delimiter, ReadOptions, Table, read};
pub(crate) use read::{RowFault, RowParser};
pub use write::{GZIP_COMMENT, RowWriter, text, write};
