//! The reader of logs.

use std::collections::HashMap;
use std::path::Path;

use dynid_files::excerpt::excerpt_bytes;

use super::error::LogFileError;
use super::input::{Bounds, Input};
use super::lines::Lines;
use super::number;
use crate::signal::is_time_name;

/// Most columns of a log.
pub(crate) const MAX_COLUMNS: usize = 65_536;

/// What separates the fields of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delimiter {
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tabulator.
    Tab,
    /// Any run of blanks and tabulators.
    Whitespace,
}

impl Delimiter {
    /// The byte that separates fields; `None` for runs of blanks.
    pub(crate) fn byte(self) -> Option<u8> {
        match self {
            Delimiter::Comma => Some(b','),
            Delimiter::Semicolon => Some(b';'),
            Delimiter::Tab => Some(b'\t'),
            Delimiter::Whitespace => None,
        }
    }
}

/// Settings of [`read`].
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// First and last data row to read, from 1, the last included. Default: all.
    pub rows: Option<(usize, usize)>,
    /// Delimiter. Default: the one of `,` `;` tab that is most frequent in the header, else whitespace.
    pub delimiter: Option<Delimiter>,
    /// Columns that are not parsed, such as texts; they are absent from the table. Default: none.
    pub ignore: Vec<String>,
    /// Largest magnitude of a number outside time columns. Default: 1e12.
    pub max_magnitude: f64,
    /// Largest size of the (decompressed) text, bytes. Default: 8 GiB.
    pub max_bytes: u64,
    /// Largest compression ratio, from `ratio_grace` on. Default: 200; logs reach 5 to 20.
    pub max_ratio: u64,
    /// Size of the decompressed text up to which any ratio is allowed, bytes. Default: 64 MiB.
    pub ratio_grace: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        ReadOptions {
            rows: None,
            delimiter: None,
            ignore: Vec::new(),
            max_magnitude: 1e12,
            max_bytes: 8 << 30,
            max_ratio: 200,
            ratio_grace: 64 << 20,
        }
    }
}

/// A log as columns of finite numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// File.
    pub source: String,
    /// Column names, each once.
    pub header: Vec<String>,
    /// Columns, all of length `rows`.
    pub columns: Vec<Vec<f64>>,
    /// Number of rows.
    pub rows: usize,
    /// Number in the file of the first row of the table, from 1.
    pub first_row: usize,
    /// Per column, the whole number that was taken off its values where an `f64` could not have held them exactly
    /// (stamps since 1970); else 0.
    pub origin: Vec<i64>,
    /// SHA-256 of the file's bytes as they were read, rows that were not asked for included; hexadecimal.
    /// Empty for a table that no file was read for.
    pub sha256: String,
}

impl Table {
    /// The column with a name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.header.iter().position(|h| h == name).map(|k| self.columns[k].as_slice())
    }
}

/// Reads a CSV log, gzip-compressed or not (told by its first bytes), streaming.
///
/// The first line that is neither blank nor a comment (`#`) names the columns; every further one is a row of numbers.
/// Fields may be quoted. What follows the last row asked for is hashed and not looked
/// at.
///
/// # Errors
/// [`LogFileError`], the first fault met.
pub fn read(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Table, LogFileError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let (first, last) = options.rows.unwrap_or((1, usize::MAX));
    let bad_range = |found: String| LogFileError::RowRange { file: file.clone(), first, last, found };
    if first == 0 || first > last {
        return Err(bad_range(if first == 0 { "row 0".into() } else { "an empty range".into() }));
    }
    let bounds = Bounds {
        max_bytes: options.max_bytes,
        max_ratio: options.max_ratio,
        ratio_grace: options.ratio_grace,
    };
    let input =
        Input::open(path, bounds).map_err(|error| LogFileError::Unreadable { file: file.clone(), error })?;
    let mut lines = Lines::new(input, &file, options.max_bytes, options.max_ratio);
    let Some(header) = lines.next()? else { return Err(LogFileError::Empty { file }) };
    let delimiter = options.delimiter.unwrap_or_else(|| detect(header));
    let fields = split(header, delimiter);
    let header_line = lines.number();
    let mut rows = Rows::new(RowParser::new(&file, header_line, delimiter, &fields, options)?, &file);
    let mut row = 0;
    while row < last
        && let Some(line) = lines.next()?
    {
        row += 1;
        if row >= first {
            rows.parse(line).map_err(|fault| rows.error(fault, row, lines.number()))?;
        }
    }
    if row == 0 {
        return Err(LogFileError::NoRows { file, line: header_line });
    }
    if row < first || (options.rows.is_some() && row < last) {
        return Err(bad_range(format!("{row} rows")));
    }
    let table = rows.into_table(first, row + 1 - first);
    Ok(Table { sha256: lines.digest()?, ..table })
}

/// What is wrong with a row.
pub(crate) enum RowFault {
    FieldCount(usize),
    NotANumber(usize, String),
    NotFinite(usize, String),
    TooBig(usize, String),
}

/// From lines to numbers.
pub(crate) struct RowParser {
    delimiter: Delimiter,
    separator: Option<u8>,
    names: Vec<String>,
    ignored: Vec<bool>,
    any_ignored: bool,
    /// Largest magnitude per column.
    largest: Vec<f64>,
    max_magnitude: f64,
    values: Vec<f64>,
}

impl RowParser {
    /// A parser of the rows under a header line. `times`: columns that hold times besides those whose names say so.
    pub(crate) fn of_header(
        file: &str,
        line: usize,
        header: &[u8],
        times: &[String],
    ) -> Result<Self, LogFileError> {
        let delimiter = detect(header);
        let mut parser =
            Self::new(file, line, delimiter, &split(header, delimiter), &ReadOptions::default())?;
        for (name, largest) in parser.names.iter().zip(&mut parser.largest) {
            if times.contains(name) {
                *largest = f64::MAX;
            }
        }
        Ok(parser)
    }

    fn new(
        file: &str,
        line: usize,
        delimiter: Delimiter,
        fields: &[Vec<u8>],
        options: &ReadOptions,
    ) -> Result<Self, LogFileError> {
        let owned = || file.to_owned();
        if fields.len() > MAX_COLUMNS {
            let (limit, found) = (MAX_COLUMNS, fields.len());
            return Err(LogFileError::TooManyColumns { file: owned(), line, limit, found });
        }
        if fields.iter().all(|f| is_number(f)) {
            let found = excerpt_bytes(&fields.join(&b","[..]));
            return Err(LogFileError::MissingHeader { file: owned(), line, found });
        }
        let mut seen = HashMap::new();
        let mut names = Vec::with_capacity(fields.len());
        for (k, field) in fields.iter().enumerate() {
            let name = match String::from_utf8_lossy(field).trim() {
                "" => format!("column{}", k + 1),
                name => name.to_owned(),
            };
            if let Some(first) = seen.insert(name.clone(), k + 1) {
                let name = excerpt_bytes(name.as_bytes());
                return Err(LogFileError::DuplicateColumn {
                    file: owned(),
                    line,
                    name,
                    first,
                    second: k + 1,
                });
            }
            names.push(name);
        }
        if let Some(column) = options.ignore.iter().find(|n| !seen.contains_key(*n)) {
            return Err(LogFileError::UnknownIgnored { file: owned(), column: column.clone() });
        }
        let ignored: Vec<bool> = names.iter().map(|n| options.ignore.contains(n)).collect();
        let largest =
            names.iter().map(|n| if is_time_name(n) { f64::MAX } else { options.max_magnitude }).collect();
        Ok(RowParser {
            delimiter,
            separator: delimiter.byte(),
            any_ignored: ignored.contains(&true),
            ignored,
            largest,
            max_magnitude: options.max_magnitude,
            values: vec![0.0; names.len()],
            names,
        })
    }

    /// Column names.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The numbers of the line that was parsed last.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Takes the numbers of a line; ignored columns keep what they held.
    pub(crate) fn parse(&mut self, line: &[u8]) -> Result<(), RowFault> {
        if !self.parse_plain(line) {
            self.parse_fields(line)?;
        }
        Ok(())
    }

    /// The common row: unquoted numbers, as many as the header has. `false`: look closer.
    fn parse_plain(&mut self, line: &[u8]) -> bool {
        let (Some(separator), false) = (self.separator, self.any_ignored) else { return false };
        number::row(line, separator, &mut self.values, &self.largest)
    }

    /// Any row, field by field.
    fn parse_fields(&mut self, line: &[u8]) -> Result<(), RowFault> {
        let fields = split(line, self.delimiter);
        if fields.len() != self.names.len() {
            return Err(RowFault::FieldCount(fields.len()));
        }
        for (k, field) in fields.iter().enumerate() {
            if self.ignored[k] {
                continue;
            }
            let parsed = std::str::from_utf8(field).ok().and_then(|text| text.parse::<f64>().ok());
            self.values[k] = match parsed {
                None => return Err(RowFault::NotANumber(k, excerpt_bytes(field))),
                Some(x) if !x.is_finite() => return Err(RowFault::NotFinite(k, excerpt_bytes(field))),
                Some(x) if x.abs() > self.largest[k] => {
                    return Err(RowFault::TooBig(k, excerpt_bytes(field)));
                }
                Some(x) => x,
            };
        }
        Ok(())
    }
}

/// The rows read so far.
struct Rows<'a> {
    file: &'a str,
    parser: RowParser,
    columns: Vec<Vec<f64>>,
}

impl<'a> Rows<'a> {
    fn new(parser: RowParser, file: &'a str) -> Self {
        Rows { file, columns: vec![Vec::new(); parser.names.len()], parser }
    }

    fn parse(&mut self, line: &[u8]) -> Result<(), RowFault> {
        self.parser.parse(line)?;
        let RowParser { values, ignored, any_ignored, .. } = &self.parser;
        for (k, (column, x)) in self.columns.iter_mut().zip(values).enumerate() {
            if !any_ignored || !ignored[k] {
                column.push(*x);
            }
        }
        Ok(())
    }

    fn error(&self, fault: RowFault, row: usize, line: usize) -> LogFileError {
        let file = self.file.to_owned();
        let name = |k: usize| self.parser.names[k].clone();
        match fault {
            RowFault::FieldCount(found) => {
                LogFileError::FieldCount { file, row, line, expected: self.parser.names.len(), found }
            }
            RowFault::NotANumber(k, found) => {
                LogFileError::NotANumber { file, row, line, column: name(k), found }
            }
            RowFault::NotFinite(k, found) => {
                LogFileError::NotFinite { file, row, line, column: name(k), found }
            }
            RowFault::TooBig(k, found) => {
                let (column, limit) = (name(k), self.parser.max_magnitude);
                LogFileError::TooBig { file, row, line, column, limit, found }
            }
        }
    }

    fn into_table(self, first_row: usize, rows: usize) -> Table {
        let RowParser { names, ignored, .. } = self.parser;
        let kept = |k: usize| !ignored[k];
        let header: Vec<String> =
            names.into_iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, n)| n).collect();
        Table {
            source: self.file.to_owned(),
            origin: vec![0; header.len()],
            header,
            columns: self.columns.into_iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, c)| c).collect(),
            rows,
            first_row,
            sha256: String::new(),
        }
    }
}

fn is_number(field: &[u8]) -> bool {
    std::str::from_utf8(field).is_ok_and(|text| text.trim().parse::<f64>().is_ok())
}

/// The delimiter that is most frequent outside quotes; whitespace if there is none.
pub(crate) fn detect(header: &[u8]) -> Delimiter {
    let mut quoted = false;
    let mut counts = [(0, Delimiter::Comma), (0, Delimiter::Semicolon), (0, Delimiter::Tab)];
    for b in header {
        match b {
            b'"' => quoted = !quoted,
            b',' if !quoted => counts[0].0 += 1,
            b';' if !quoted => counts[1].0 += 1,
            b'\t' if !quoted => counts[2].0 += 1,
            _ => {}
        }
    }
    // The first of equals wins, in the order comma, semicolon, tab.
    counts
        .into_iter()
        .rev()
        .max_by_key(|(n, _)| *n)
        .filter(|(n, _)| *n > 0)
        .map_or(Delimiter::Whitespace, |(_, d)| d)
}

/// The fields of a line, trimmed and without their quotes (`""` inside quotes is one quote).
pub(crate) fn split(line: &[u8], delimiter: Delimiter) -> Vec<Vec<u8>> {
    let ends_field = |b: u8| match delimiter {
        Delimiter::Comma => b == b',',
        Delimiter::Semicolon => b == b';',
        Delimiter::Tab => b == b'\t',
        Delimiter::Whitespace => b == b' ' || b == b'\t',
    };
    let line = if delimiter == Delimiter::Whitespace { line.trim_ascii() } else { line };
    let mut fields = Vec::new();
    let mut field = Vec::new();
    let mut quoted = false;
    let mut bytes = line.iter().copied().peekable();
    while let Some(b) = bytes.next() {
        match b {
            b'"' if quoted && bytes.peek() == Some(&b'"') => {
                field.push(b);
                bytes.next();
            }
            b'"' => quoted = !quoted,
            _ if !quoted && ends_field(b) => {
                fields.push(field.trim_ascii().to_vec());
                field.clear();
                while delimiter == Delimiter::Whitespace && bytes.next_if(|b| ends_field(*b)).is_some() {}
            }
            _ => field.push(b),
        }
    }
    fields.push(field.trim_ascii().to_vec());
    fields
}
