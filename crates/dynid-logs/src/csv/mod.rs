//! Logs as CSV, plain or gzip-compressed.

mod error;
pub(crate) mod input;
pub(crate) mod lines;
pub(crate) mod number;
mod read;
mod write;

pub use error::LogFileError;
pub use read::{Delimiter, ReadOptions, Table, read};
pub(crate) use read::{MAX_COLUMNS, RowFault, RowParser, detect, split};
pub(crate) use write::OutCell;
pub use write::{GZIP_COMMENT, RowWriter, text, write};
