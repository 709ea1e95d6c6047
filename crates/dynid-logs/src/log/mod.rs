//! Logs as tools write them: which format, which columns, where numbers, lists and texts are, and what is missing.
//!
//! A log is opened first ([`open`]): its first bytes tell the format, and the format tells the names of the columns. Then columns
//! are assigned to signals ([`ColumnMapping::of_log`](crate::ColumnMapping::of_log)), and only those that are used are read
//! ([`LogSource::read`]).
//!
//! Text is read line by line (`text`); files of arrays and tables (`arrays`) column by column; bags (`bag`) message by
//! message, their topics joined by time.

#[cfg_attr(
    not(all(feature = "arrow", feature = "bags", feature = "hdf5", feature = "numpy", feature = "parquet")),
    allow(unused, reason = "a build that leaves formats out has no use for some of what they share")
)]
mod arrays;
#[cfg(feature = "arrow")]
mod arrow;
#[cfg(feature = "bags")]
mod bag;
#[cfg(any(feature = "arrow", feature = "numpy"))]
mod binary;
mod files;
mod format;
#[cfg(feature = "hdf5")]
mod hdf5;
mod header;
#[cfg(any(feature = "arrow", feature = "bags", feature = "parquet"))]
#[cfg_attr(
    not(all(feature = "arrow", feature = "bags")),
    allow(unused, reason = "a build that leaves formats out has no use for some of what they share")
)]
mod inflate;
mod matlab;
#[cfg_attr(
    not(all(feature = "arrow", feature = "bags", feature = "hdf5", feature = "numpy", feature = "parquet")),
    allow(unused, reason = "a build that leaves formats out has no use for some of what they share")
)]
mod member;
#[cfg(feature = "numpy")]
mod numpy;
#[cfg_attr(
    not(all(feature = "arrow", feature = "bags", feature = "hdf5", feature = "numpy", feature = "parquet")),
    allow(unused, reason = "a build that leaves formats out has no use for some of what they share")
)]
mod open;
#[cfg(feature = "parquet")]
mod parquet;
mod text;
#[cfg(feature = "numpy")]
mod torch;

use serde::{Deserialize, Serialize};

pub use files::files;
pub use format::LogFormat;
pub use header::LogHeader;
pub use open::{is_log, open};

use crate::csv::{LogFileError, ReadOptions, Table};

/// What stands between the whole part and the fraction of a number.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub enum DecimalMark {
    /// `0.5`
    #[serde(rename = ".")]
    Point,
    /// `0,5`
    #[serde(rename = ",")]
    Comma,
}

/// What becomes of rows in which a signal has no value: an empty cell, NaN, or a word such as `null`.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Missing {
    /// The log is refused.
    Error,
    /// Rows without all signals are left out; the clock takes what is missing for a gap.
    Drop,
    /// Signals are interpolated linearly at the rows that have all positions, for logs that mix topics with stamps of their
    /// own; where no row has all of them, at those of the position with most values. Where a signal is silent for more than five of
    /// its usual steps the rows are left out. Commands are held until the next one instead.
    Interpolate,
}

/// Places among all columns of those that are wanted of the ones `shown`, and of the times among them.
fn places_of(all: &LogHeader, shown: &LogHeader, wanted: &Wanted) -> (Vec<usize>, Vec<usize>) {
    let place = |k: &usize| all.column(&shown.names[*k]);
    let numbers: Vec<usize> = (0..shown.names.len()).filter(|k| !shown.text[*k]).collect();
    let columns = wanted.columns.as_ref().unwrap_or(&numbers).iter().filter_map(place).collect();
    (columns, wanted.time.iter().filter_map(place).collect())
}

/// Which columns of a log are read.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Columns of the header; `None`: all that hold numbers.
    pub columns: Option<Vec<usize>>,
    /// Those among them that hold times, which may be of any size and keep all their digits.
    pub time: Vec<usize>,
    /// What becomes of cells without a value: unless they are refused, they become NaN.
    pub missing: Missing,
}

/// An opened log: what it holds is known, and nothing was read yet but for that.
pub trait LogSource {
    /// Columns that can be asked for, those to be ignored left out.
    fn header(&self) -> LogHeader;

    /// What was found out about the file.
    fn notes(&self) -> &[ReadingNote];

    /// Reads columns of [`LogSource::header`]; others are not looked at. Notes: those of [`LogSource::notes`] and what reading told
    /// besides.
    ///
    /// # Errors
    /// [`LogFileError`], the first fault met.
    fn read(self: Box<Self>, wanted: &Wanted) -> Result<(Table, Vec<ReadingNote>), LogFileError>;

    /// Reads columns as [`LogSource::read`] does, about so many rows at a time where the format allows it: text, groups of rows of Parquet and
    /// Arrow, and bags of which one topic is wanted whose messages all have it. Other logs give all rows at once.
    ///
    /// # Errors
    /// [`LogFileError`], the first fault met; later ones come with the rows.
    fn blocks(self: Box<Self>, wanted: &Wanted, rows: usize) -> Result<Box<dyn TableBlocks>, LogFileError> {
        let _ = rows;
        one_block(self, wanted)
    }
}

/// All rows of a log as one block.
fn one_block<S: LogSource + ?Sized>(
    log: Box<S>,
    wanted: &Wanted,
) -> Result<Box<dyn TableBlocks>, LogFileError> {
    let (mut table, notes) = log.read(wanted)?;
    let sha256 = std::mem::take(&mut table.sha256);
    Ok(Box::new(OneBlock { table: Some(table), sha256, notes }))
}

/// Rows of a log, block by block.
pub trait TableBlocks: Send {
    /// The next rows, without a digest; `None` behind the last ones.
    ///
    /// # Errors
    /// [`LogFileError`], the first fault met.
    fn next_block(&mut self) -> Result<Option<Table>, LogFileError>;

    /// What was found out so far.
    fn notes(&self) -> &[ReadingNote];

    /// SHA-256 of all bytes of the file, hexadecimal, and what was found out by reading: [`TableBlocks::notes`] behind the last row.
    ///
    /// # Errors
    /// [`LogFileError::Unreadable`].
    fn finish(self: Box<Self>) -> Result<(String, Vec<ReadingNote>), LogFileError>;
}

/// All rows at once.
struct OneBlock {
    table: Option<Table>,
    sha256: String,
    notes: Vec<ReadingNote>,
}

impl TableBlocks for OneBlock {
    fn next_block(&mut self) -> Result<Option<Table>, LogFileError> {
        Ok(self.table.take())
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.notes
    }

    fn finish(self: Box<Self>) -> Result<(String, Vec<ReadingNote>), LogFileError> {
        Ok((self.sha256, self.notes))
    }
}

/// Settings of [`open`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogOptions {
    /// Rows, delimiter, columns to ignore and bounds.
    pub read: ReadOptions,
    /// Names of the columns of a file without a header. Default: `column1`, `column2`, ...
    pub names: Option<Vec<String>>,
    /// Decimal mark. Default: found from the numbers.
    pub decimal: Option<DecimalMark>,
}

impl LogOptions {
    /// Files that are no text have no use for settings of text.
    fn refuse_settings_of_text(&self, file: &str, format: &'static str) -> Result<(), LogFileError> {
        let stated = [
            ("names", self.names.is_some()),
            ("decimal", self.decimal.is_some()),
            ("delimiter", self.read.delimiter.is_some()),
        ];
        match stated.into_iter().find(|(_, is_stated)| *is_stated) {
            Some((key, _)) => Err(LogFileError::SettingOfText { file: file.to_owned(), key, format }),
            None => Ok(()),
        }
    }
}

/// A setting of the reading that was found, with its reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReadingNote {
    /// What was found out: `format`, `header`, `decimal`, `time`, ...
    pub setting: String,
    /// The value that was taken.
    pub value: String,
    /// Why.
    pub reason: String,
}

impl ReadingNote {
    /// A setting with its value and reason.
    pub fn new(setting: &str, value: impl Into<String>, reason: impl Into<String>) -> Self {
        ReadingNote { setting: setting.to_owned(), value: value.into(), reason: reason.into() }
    }
}
