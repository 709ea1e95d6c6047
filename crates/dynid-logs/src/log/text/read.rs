//! Opening and reading logs.

use std::collections::VecDeque;
use std::path::Path;

use dynid_files::input::Opened;

use super::fault::Fault;
use super::layout::{Form, Holds, Layout, Line};
use super::row::{Cells, LineParser, Take};
use crate::csv::input::{Bounds, Input};
use crate::csv::lines::Lines;
use crate::csv::{Delimiter, LogFileError, Table, number, split};
use crate::log::header::LogHeader;
use crate::log::{LogOptions, LogSource, Missing, ReadingNote, TableBlocks, Wanted, places_of};

/// Lines that are looked at before anything is read.
const SAMPLE_LINES: usize = 64;
/// Stamps from this size on may have more digits than an `f64` holds.
const LONG_STAMP: i64 = 1_000_000_000;

/// A log whose first lines were read.
pub(in crate::log) struct LogText {
    file: String,
    lines: Lines,
    /// Lines that were looked at and not yet read.
    held: VecDeque<Line>,
    header_line: usize,
    layout: Layout,
    options: LogOptions,
}

impl std::fmt::Debug for LogText {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LogText").field("file", &self.file).finish_non_exhaustive()
    }
}

impl LogText {
    /// Finds out how a log, gzip-compressed or not, is to be read. `front`: its first bytes, which were read of it.
    ///
    /// # Errors
    /// [`LogFileError`]: the file cannot be read, has no line, a column name twice, or numbers whose commas may mean two
    /// things.
    pub(in crate::log) fn open(
        path: &Path,
        front: Vec<u8>,
        opened: Opened,
        options: &LogOptions,
    ) -> Result<Self, LogFileError> {
        let file = path.display().to_string();
        let read = &options.read;
        if let Some((first, last)) = read.rows.filter(|(first, last)| *first == 0 || first > last) {
            let found = if first == 0 { "row 0" } else { "an empty range" }.to_owned();
            return Err(LogFileError::RowRange { file, first, last, found });
        }
        let bounds =
            Bounds { max_bytes: read.max_bytes, max_ratio: read.max_ratio, ratio_grace: read.ratio_grace };
        let input = Input::of(front, opened, bounds);
        let mut lines = Lines::new(input, &file, read.max_bytes, read.max_ratio);
        let Some(mut first) = next(&mut lines)? else { return Err(LogFileError::Empty { file }) };
        let mut delimiter = read.delimiter;
        if let Some(stated) = stated_delimiter(&first.1) {
            delimiter = delimiter.or(Some(stated));
            first = next(&mut lines)?.ok_or_else(|| LogFileError::Empty { file: file.clone() })?;
        }
        let mut held = VecDeque::new();
        while held.len() < SAMPLE_LINES
            && let Some(line) = next(&mut lines)?
        {
            held.push_back(line);
        }
        let header_line = first.0;
        let layout = Layout::of(&file, &first, held.make_contiguous(), delimiter, options)?;
        if let Some(column) = read.ignore.iter().find(|name| layout.header.column(name).is_none()) {
            return Err(LogFileError::UnknownIgnored { file, column: column.clone() });
        }
        if layout.first_is_row {
            held.push_front(first);
        }
        Ok(LogText { file, lines, held, header_line, layout, options: options.clone() })
    }

    /// A reader of rows that keeps columns, by their places among all of the header.
    fn rows(&self, columns: Vec<usize>, time: &[usize], keep_missing: bool) -> Rows {
        let width = self.layout.header.names.len();
        let mut origin = vec![0; width];
        let parser = match &self.layout.form {
            Form::Echo(echo) => {
                origin[0] = echo.origin();
                LineParser::Echo(echo.clone())
            }
            Form::Cells { delimiter, comma, holds } => {
                let first = self.held.front().map(|(_, text)| split(text, *delimiter)).unwrap_or_default();
                let mut slot = 0;
                let mut takes = Vec::with_capacity(holds.len());
                for (cell, holds) in holds.iter().enumerate() {
                    let largest =
                        if time.contains(&slot) { f64::MAX } else { self.options.read.max_magnitude };
                    let width = if let Holds::Lists(length) = holds { *length } else { 1 };
                    let used = (slot..slot + width).any(|k| columns.contains(&k));
                    takes.push(match holds {
                        Holds::Name(name) => Take::Name(name.clone()),
                        _ if !used => unread(holds),
                        Holds::Lists(length) => Take::List(*length, largest),
                        Holds::Numbers if time.contains(&slot) => {
                            let whole = first.get(cell).and_then(|field| number::whole_part(field));
                            match whole.filter(|whole| whole.abs() >= LONG_STAMP) {
                                Some(whole) => {
                                    origin[slot] = whole;
                                    Take::Stamp(whole)
                                }
                                None => Take::Number(largest),
                            }
                        }
                        // A text that is asked for is told to be no number.
                        Holds::Numbers | Holds::Texts => Take::Number(largest),
                    });
                    slot += width;
                }
                LineParser::Cells(Cells::new(*delimiter, *comma, takes, keep_missing))
            }
        };
        let values = vec![
            0.0;
            match &parser {
                LineParser::Cells(cells) => cells.width(),
                LineParser::Echo(_) => width,
            }
        ];
        Rows { parser, values, origin, values_of: vec![Vec::new(); columns.len()], columns }
    }

    fn error(&self, fault: Fault, row: usize, line: usize) -> LogFileError {
        let file = self.file.clone();
        let column = |cell: usize| self.column_of_cell(cell);
        match fault {
            Fault::FieldCount(found) => {
                let expected = match &self.layout.form {
                    Form::Cells { holds, .. } => holds.len(),
                    Form::Echo(_) => self.layout.header.names.len(),
                };
                LogFileError::FieldCount { file, row, line, expected, found }
            }
            Fault::NotANumber(cell, found) if found.eq_ignore_ascii_case("nan") => {
                LogFileError::NotFinite { file, row, line, column: column(cell), found }
            }
            Fault::NotANumber(cell, found) => {
                LogFileError::NotANumber { file, row, line, column: column(cell), found }
            }
            Fault::NotFinite(cell, found) => {
                LogFileError::NotFinite { file, row, line, column: column(cell), found }
            }
            Fault::TooBig(cell, found) => {
                let limit = self.options.read.max_magnitude;
                LogFileError::TooBig { file, row, line, column: column(cell), limit, found }
            }
            Fault::ListLength(cell, found) => {
                let expected = match &self.layout.form {
                    Form::Cells { holds, .. } => match holds[cell] {
                        Holds::Lists(length) => length,
                        _ => 1,
                    },
                    Form::Echo(_) => 1,
                };
                LogFileError::ListLength { file, row, line, column: column(cell), expected, found }
            }
            Fault::OtherName(cell, found) => {
                let expected = match &self.layout.form {
                    Form::Cells { holds, .. } => match &holds[cell] {
                        Holds::Name(name) => String::from_utf8_lossy(name).into_owned(),
                        _ => String::new(),
                    },
                    Form::Echo(_) => String::new(),
                };
                let (expected, found) = (expected.into(), found.into());
                LogFileError::OtherJoint { file, row, line, column: column(cell), expected, found }
            }
            Fault::OtherJoints(found) => LogFileError::OtherJoints { file, row, line, found },
            Fault::NoMessage(found) => LogFileError::NoMessage { file, row, line, found },
        }
    }

    /// Name of a cell's column.
    fn column_of_cell(&self, cell: usize) -> String {
        let (Form::Cells { holds, .. }, header) = (&self.layout.form, &self.layout.header) else {
            return String::new();
        };
        let width = |holds: &Holds| if let Holds::Lists(length) = holds { *length } else { 1 };
        let slot: usize = holds[..cell].iter().map(width).sum();
        let name = &header.names[slot];
        match holds[cell] {
            Holds::Lists(_) => name.trim_end_matches("[0]").to_owned(),
            _ if header.in_file[slot].is_empty() => name.clone(),
            _ => header.in_file[slot].clone(),
        }
    }
}

impl LogSource for LogText {
    fn header(&self) -> LogHeader {
        self.layout.header.without(&self.options.read.ignore)
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.layout.notes
    }

    /// What follows the last row asked for is hashed and not looked at.
    fn read(self: Box<Self>, wanted: &Wanted) -> Result<(Table, Vec<ReadingNote>), LogFileError> {
        let mut blocks = Box::new(TextBlocks::new(*self, wanted, usize::MAX));
        let table = blocks.next_block()?;
        let (sha256, notes) = blocks.finish()?;
        let table = table.unwrap_or_else(|| unreachable!("a log without rows is refused"));
        Ok((Table { sha256, ..table }, notes))
    }

    fn blocks(self: Box<Self>, wanted: &Wanted, rows: usize) -> Result<Box<dyn TableBlocks>, LogFileError> {
        Ok(Box::new(TextBlocks::new(*self, wanted, rows)))
    }
}

/// The rows of a log, so many at a time.
struct TextBlocks {
    text: LogText,
    rows: Rows,
    /// First and last data row that are asked for.
    range: (usize, usize),
    per_block: usize,
    /// Data rows that were passed.
    row: usize,
    ended: bool,
}

impl TextBlocks {
    fn new(text: LogText, wanted: &Wanted, per_block: usize) -> Self {
        let (columns, time) = places_of(&text.layout.header, &text.header(), wanted);
        let rows = text.rows(columns, &time, wanted.missing != Missing::Error);
        let range = text.options.read.rows.unwrap_or((1, usize::MAX));
        TextBlocks { text, rows, range, per_block: per_block.max(1), row: 0, ended: false }
    }

    /// Refuses a log that ended before the rows that are asked for.
    fn check_end(&self) -> Result<(), LogFileError> {
        let (file, (first, last)) = (|| self.text.file.clone(), self.range);
        if self.row == 0 {
            return Err(LogFileError::NoRows { file: file(), line: self.text.header_line });
        }
        if self.row < first || (self.text.options.read.rows.is_some() && self.row < last) {
            let found = format!("{} rows", self.row);
            return Err(LogFileError::RowRange { file: file(), first, last, found });
        }
        Ok(())
    }
}

impl TableBlocks for TextBlocks {
    fn next_block(&mut self) -> Result<Option<Table>, LogFileError> {
        if self.ended {
            return Ok(None);
        }
        let (first, last) = self.range;
        let begin = first.max(self.row + 1);
        let end = last.min((begin - 1).saturating_add(self.per_block));
        while self.row < end
            && let Some((line, text)) = self.text.held.pop_front()
        {
            self.rows.take(&mut self.row, first, line, &text, &self.text)?;
        }
        while self.row < end {
            // What is said of a faulty row needs the whole of the text, which lines are borrowed from.
            let taken = match self.text.lines.next()? {
                None => {
                    self.ended = true;
                    break;
                }
                Some(text) => self.rows.parse(self.row + 1 >= first, text),
            };
            let line = self.text.lines.number();
            self.rows.settle(taken, &mut self.row, line, &self.text)?;
        }
        self.ended |= self.row == last;
        if self.ended {
            self.check_end()?;
        }
        let count = (self.row + 1).saturating_sub(begin);
        if count == 0 {
            return Ok(None);
        }
        let rows = &mut self.rows;
        let next = if self.ended { 0 } else { count };
        let columns = rows.values_of.iter_mut();
        Ok(Some(Table {
            source: self.text.file.clone(),
            header: rows.columns.iter().map(|k| self.text.layout.header.names[*k].clone()).collect(),
            origin: rows.columns.iter().map(|k| rows.origin[*k]).collect(),
            columns: columns.map(|c| std::mem::replace(c, Vec::with_capacity(next))).collect(),
            rows: count,
            first_row: begin,
            sha256: String::new(),
        }))
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.text.layout.notes
    }

    fn finish(self: Box<Self>) -> Result<(String, Vec<ReadingNote>), LogFileError> {
        let mut notes = self.text.layout.notes;
        if let LineParser::Echo(echo) = &self.rows.parser
            && echo.remarks > 0
        {
            let reason = "the recorder says that it lost some; the clock takes them for gaps";
            notes.push(ReadingNote::new("lost messages", echo.remarks.to_string(), reason));
        }
        Ok((self.text.lines.digest()?, notes))
    }
}

/// A cell that is passed over; a list keeps its places.
fn unread(holds: &Holds) -> Take {
    match holds {
        Holds::Lists(length) => Take::Skipped(*length),
        _ => Take::Skipped(1),
    }
}

/// The rows read so far.
struct Rows {
    parser: LineParser,
    values: Vec<f64>,
    origin: Vec<i64>,
    columns: Vec<usize>,
    values_of: Vec<Vec<f64>>,
}

impl Rows {
    /// Takes a line as a row; what is wanted of it is kept.
    fn parse(&mut self, wanted: bool, text: &[u8]) -> Result<bool, Fault> {
        if !wanted && matches!(self.parser, LineParser::Cells(_)) {
            return Ok(true);
        }
        let is_row = self.parser.parse(text, &mut self.values)?;
        if is_row && wanted {
            for (column, k) in self.values_of.iter_mut().zip(&self.columns) {
                column.push(self.values[*k]);
            }
        }
        Ok(is_row)
    }

    fn settle(
        &mut self,
        taken: Result<bool, Fault>,
        row: &mut usize,
        line: usize,
        text: &LogText,
    ) -> Result<(), LogFileError> {
        match taken {
            Ok(is_row) => *row += usize::from(is_row),
            Err(fault) => return Err(text.error(fault, *row + 1, line)),
        }
        Ok(())
    }

    fn take(
        &mut self,
        row: &mut usize,
        first: usize,
        line: usize,
        text: &[u8],
        of: &LogText,
    ) -> Result<(), LogFileError> {
        let taken = self.parse(*row + 1 >= first, text);
        self.settle(taken, row, line, of)
    }
}

fn next(lines: &mut Lines) -> Result<Option<Line>, LogFileError> {
    let text = lines.next()?.map(<[u8]>::to_vec);
    Ok(text.map(|text| (lines.number(), text)))
}

/// The delimiter that spreadsheets state in a line of its own, `sep=;`.
fn stated_delimiter(line: &[u8]) -> Option<Delimiter> {
    match line.trim_ascii() {
        b"sep=;" => Some(Delimiter::Semicolon),
        b"sep=," => Some(Delimiter::Comma),
        b"sep=\t" | b"sep=" => Some(Delimiter::Tab),
        _ => None,
    }
}
