//! Logs as text: CSV, plain or gzip-compressed, and what tools print.

mod cell;
mod fault;
mod layout;
mod read;
mod ros;
mod row;

pub(super) use read::LogText;
