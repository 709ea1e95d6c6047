//! Faults of logs.

use std::io;

use thiserror::Error;

/// Why a log was refused. Rows are data rows counted from 1, lines are lines of the (decompressed) text.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogFileError {
    /// The operating system would not give the file.
    #[error("{file}: cannot be read: {error}")]
    Unreadable {
        /// File.
        file: String,
        /// Reason.
        error: io::Error,
    },
    /// The gzip stream ends too early.
    #[error("{file}: expected a whole gzip file, found its end after line {line}")]
    TruncatedGzip {
        /// File.
        file: String,
        /// Last whole line.
        line: usize,
    },
    /// The gzip stream is damaged.
    #[error("{file}: expected a gzip file, found a damaged stream after line {line}: {reason}")]
    DamagedGzip {
        /// File.
        file: String,
        /// Last whole line.
        line: usize,
        /// What the decoder says.
        reason: String,
    },
    /// More text than the cap.
    #[error("{file}: expected at most {limit} bytes of text, found more after line {line}")]
    TooLarge {
        /// File.
        file: String,
        /// Cap, bytes.
        limit: u64,
        /// Last whole line.
        line: usize,
    },
    /// A compression ratio that no log has.
    #[error("{file}: expected text compressed at most {limit}:1, found more after line {line}")]
    Bomb {
        /// File.
        file: String,
        /// Largest ratio.
        limit: u64,
        /// Last whole line.
        line: usize,
    },
    /// A line longer than the cap.
    #[error("{file}: line {line}: expected at most {limit} bytes, found more")]
    LongLine {
        /// File.
        file: String,
        /// Line.
        line: usize,
        /// Cap, bytes.
        limit: usize,
    },
    /// The file is not text.
    #[error("{file}: expected text, found {found}")]
    NotText {
        /// File.
        file: String,
        /// What it looks like.
        found: &'static str,
    },
    /// No header.
    #[error("{file}: expected a header and rows of numbers, found an empty file")]
    Empty {
        /// File.
        file: String,
    },
    /// A header and nothing else.
    #[error("{file}: expected rows of numbers after the header (line {line}), found none")]
    NoRows {
        /// File.
        file: String,
        /// Line of the header.
        line: usize,
    },
    /// The first row holds numbers.
    #[error("{file}: line {line}: expected column names, found numbers `{found}`")]
    MissingHeader {
        /// File.
        file: String,
        /// Line.
        line: usize,
        /// The row.
        found: String,
    },
    /// Too many columns.
    #[error("{file}: line {line}: expected at most {limit} columns, found {found}")]
    TooManyColumns {
        /// File.
        file: String,
        /// Line of the header.
        line: usize,
        /// Cap.
        limit: usize,
        /// Columns.
        found: usize,
    },
    /// Two columns with one name.
    #[error(
        "{file}: line {line}: expected every column name once, found `{name}` in columns {first} and {second}"
    )]
    DuplicateColumn {
        /// File.
        file: String,
        /// Line of the header.
        line: usize,
        /// Name.
        name: String,
        /// First column, from 1.
        first: usize,
        /// Second column, from 1.
        second: usize,
    },
    /// A row with another number of fields than the header.
    #[error("{file}: row {row} (line {line}): expected {expected} fields as in the header, found {found}")]
    FieldCount {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Columns of the header.
        expected: usize,
        /// Fields of the row.
        found: usize,
    },
    /// A field that is not a number.
    #[error("{file}: row {row} (line {line}), column `{column}`: expected a number, found `{found}`")]
    NotANumber {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Column name.
        column: String,
        /// The field.
        found: String,
    },
    /// NaN or infinity.
    #[error("{file}: row {row} (line {line}), column `{column}`: expected a finite number, found `{found}`")]
    NotFinite {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Column name.
        column: String,
        /// The field.
        found: String,
    },
    /// A number larger than any signal.
    #[error(
        "{file}: row {row} (line {line}), column `{column}`: expected a magnitude up to {limit:e}, found `{found}`"
    )]
    TooBig {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Column name.
        column: String,
        /// Cap.
        limit: f64,
        /// The field.
        found: String,
    },
    /// A row range that the log does not have.
    #[error("{file}: rows {first} to {last}: expected a range within the log's rows, found {found}")]
    RowRange {
        /// File.
        file: String,
        /// First row asked for.
        first: usize,
        /// Last row asked for.
        last: usize,
        /// What is wrong.
        found: String,
    },
    /// Names for the columns of a file that has names of its own.
    #[error("{file}: line {line}: `names`: expected a file without a header, found `{found}`")]
    NamesBesideHeader {
        /// File.
        file: String,
        /// Line of the header.
        line: usize,
        /// The header.
        found: String,
    },
    /// Another number of names than there are columns.
    #[error("{file}: line {line}: `names`: expected {expected} names, one per column, found {found}")]
    NameCount {
        /// File.
        file: String,
        /// Line of the first row.
        line: usize,
        /// Columns.
        expected: usize,
        /// Names.
        found: usize,
    },
    /// Commas in numbers that may be decimal marks or set thousands apart.
    #[error(
        "{file}: column `{column}`: expected one decimal mark, found `{found}`: the comma may be a decimal mark or set thousands apart"
    )]
    AmbiguousComma {
        /// File.
        file: String,
        /// Column name.
        column: String,
        /// A cell.
        found: String,
    },
    /// Numbers with commas beside numbers with points.
    #[error(
        "{file}: expected one decimal mark, found `{comma}` in column `{of_comma}` and `{point}` in column `{of_point}`"
    )]
    MixedMarks {
        /// File.
        file: String,
        /// A cell with a comma.
        comma: Box<str>,
        /// Its column.
        of_comma: Box<str>,
        /// A cell with a point.
        point: Box<str>,
        /// Its column.
        of_point: Box<str>,
    },
    /// A number with both marks.
    #[error("{file}: column `{column}`: expected numbers without marks of thousands, found `{found}`")]
    Thousands {
        /// File.
        file: String,
        /// Column name.
        column: String,
        /// The cell.
        found: String,
    },
    /// A list of another length than that of the first row.
    #[error(
        "{file}: row {row} (line {line}), column `{column}`: expected a list of {expected} numbers as in the first row, found {found}"
    )]
    ListLength {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Column name.
        column: String,
        /// Entries of the first row.
        expected: usize,
        /// Entries.
        found: usize,
    },
    /// A message of other joints than the first one.
    #[error(
        "{file}: row {row} (line {line}), column `{column}`: expected the joint `{expected}` as in the first row, found `{found}`"
    )]
    OtherJoint {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Column name.
        column: String,
        /// Joint of the first row.
        expected: Box<str>,
        /// Joint of this row.
        found: Box<str>,
    },
    /// A message of joints that none of the first ones had.
    #[error(
        "{file}: row {row} (line {line}): expected a message of the joints that the first ones have, found `{found}`"
    )]
    OtherJoints {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// Joints of this row.
        found: String,
    },
    /// A line that is no joint state.
    #[error("{file}: row {row} (line {line}): expected a joint state as in the first row, found `{found}`")]
    NoMessage {
        /// File.
        file: String,
        /// Data row.
        row: usize,
        /// Line.
        line: usize,
        /// The line.
        found: String,
    },
    /// A number of a file of arrays or messages that is no value of a signal.
    #[error("{file}: row {row}, column `{column}`: expected {expected}, found {found}")]
    Cell {
        /// File.
        file: String,
        /// Row, from 1.
        row: usize,
        /// Column name.
        column: String,
        /// What a signal may be.
        expected: String,
        /// The number.
        found: f64,
    },
    /// A file of a known format that holds something else than is needed.
    #[error("{file}: {format}: expected {expected}, found {found}")]
    Content {
        /// File.
        file: String,
        /// Format of the file.
        format: &'static str,
        /// What is needed.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A file of a known format that is broken, or beyond what is read of the format.
    #[error("{file}: {format}: {reason}")]
    Damaged {
        /// File.
        file: String,
        /// Format of the file.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A format that this build cannot read.
    #[error("{file}: {format}: expected a build with the feature `{feature}`, found one without")]
    NotBuilt {
        /// File.
        file: String,
        /// Format of the file.
        format: &'static str,
        /// Feature that reads it.
        feature: &'static str,
    },
    /// A setting of text for a file that is none.
    #[error("{file}: `{key}`: expected a log in text, found {format}")]
    SettingOfText {
        /// File.
        file: String,
        /// Setting.
        key: &'static str,
        /// Format of the file.
        format: &'static str,
    },
    /// A member of the file (`FILE#MEMBER`) that does not exist, or that has to be stated.
    #[error("{file}: {format}: expected {expected}, found {found}")]
    Member {
        /// File.
        file: String,
        /// Format of the file.
        format: &'static str,
        /// Members that there are.
        expected: Box<str>,
        /// Member that was asked for.
        found: Box<str>,
        /// Name of the file with a member of it.
        example: Box<str>,
    },
    /// No log is called as a path says, or a folder has none.
    #[error("{pattern}: expected logs in `{place}`, found {there}")]
    NoLogs {
        /// Path, as it was stated.
        pattern: String,
        /// Folder or file that was looked into.
        place: String,
        /// What is there.
        there: Box<str>,
    },
    /// A line of a list of logs.
    #[error("{file}: line {line}: expected {expected}, found {found}")]
    Listed {
        /// The list.
        file: String,
        /// Line.
        line: usize,
        /// What a line may say.
        expected: &'static str,
        /// What it says.
        found: Box<str>,
    },
    /// A column that shall be ignored does not exist.
    #[error("{file}: column `{column}` to be ignored: expected a column of the header, found none")]
    UnknownIgnored {
        /// File.
        file: String,
        /// Name.
        column: String,
    },
}

impl LogFileError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        use LogFileError as E;
        let hint = match self {
            E::Unreadable { error, .. } if error.kind() == io::ErrorKind::NotFound => {
                "check the path of the log"
            }
            E::Unreadable { .. } => "check that the path is a file and may be read",
            E::TruncatedGzip { .. } => "the file is cut off: copy or record it again",
            E::DamagedGzip { .. } => "test it with `gzip -t`; copy or record it again",
            E::TooLarge { .. } => "split the log, read a range of rows, or raise the cap on the text's size",
            E::Bomb { .. } => "this is not a log; if it is, decompress it first",
            E::LongLine { .. } => "the file has no line ends where a CSV has them",
            E::NotText { .. } => "export the log as CSV in UTF-8",
            E::Empty { .. } => "the first line names the columns, such as `t,q1,q2,tau1,tau2`",
            E::NoRows { .. } => "the recording may have failed",
            E::MissingHeader { .. } => "add a first line with names, such as `t,q1,q2,tau1,tau2`",
            E::NamesBesideHeader { .. } => {
                "leave `names` out; `position = \"..\"` and so on under [columns] say which column is which signal"
            }
            E::NameCount { .. } => {
                "one name per column in their order under [columns], such as `names = [\"t\", \"q1\", \"q2\", \"tau1\", \"tau2\"]`"
            }
            E::AmbiguousComma { .. } => {
                "say what the comma is under [columns]: `decimal = \",\"` if it is the decimal mark; numbers with marks of thousands are not read"
            }
            E::MixedMarks { .. } => {
                "write the log with one decimal mark, or leave the column with the other one out: `ignore = [\"..\"]` under [columns]"
            }
            E::Thousands { .. } => "write the log without marks of thousands",
            E::ListLength { .. } => "leave the row out: `leave_out = [[first, last]]` in its [[log]]",
            E::OtherJoint { .. } | E::OtherJoints { .. } => {
                "record the joint states of one publisher alone, all joints in every message"
            }
            E::NoMessage { .. } => "remove the line: it is no message",
            E::TooManyColumns { .. } => "check the delimiter",
            E::DuplicateColumn { .. } => "rename one of them",
            E::FieldCount { found, expected, .. } if found < expected => {
                "the row is cut off, or the delimiter differs from the header's"
            }
            E::FieldCount { .. } => "a decimal comma or a comma inside a field splits it",
            E::NotANumber { found, .. } if found.is_empty() => {
                "a value is missing: `missing = \"drop\"` under [columns] (or `--missing drop`) leaves such rows out"
            }
            E::NotANumber { found, .. } if is_decimal_comma(found) => {
                "use a point as decimal mark; of logs, `decimal = \",\"` under [columns] says that it is a comma"
            }
            E::NotANumber { .. } => "correct the field, or ignore the column if it is not a signal",
            E::NotFinite { found, .. } if found.to_lowercase().contains("nan") => {
                "remove the row, or `missing = \"drop\"` under [columns] (or `--missing drop`) to leave out rows without a value"
            }
            E::NotFinite { .. } => "remove the row or limit the range of rows, or ignore the column",
            E::TooBig { .. } => "a sentinel or a damaged value: remove the row, or ignore the column",
            E::RowRange { .. } => "rows are counted from 1 after the header, the last one included",
            E::UnknownIgnored { .. } => "use a name of the header",
            E::Cell { found, .. } if found.is_nan() => {
                "`missing = \"drop\"` under [columns] (or `--missing drop`) leaves rows without a value out"
            }
            E::Cell { .. } => "limit the range of rows, or ignore the column",
            E::Content { .. } => "`dynid inspect` shows what the file holds",
            E::Damaged { .. } => "copy or record the file again, or write it in another format",
            E::NotBuilt { feature, .. } => {
                return Some(format!("take a released binary, or build with `--features {feature}`"));
            }
            E::NoLogs { .. } => "check the path: `*` is any text within a name, `**` any number of folders",
            E::Listed { .. } => {
                "a list has one path per line, relative to itself; lines that begin with `#` count for nothing"
            }
            E::SettingOfText { .. } => "leave the setting out",
            E::Member { example, .. } => return Some(format!("such as `{example}`")),
        };
        Some(hint.to_owned())
    }
}

fn is_decimal_comma(field: &str) -> bool {
    field.contains(',') && field.replacen(',', ".", 1).parse::<f64>().is_ok()
}
