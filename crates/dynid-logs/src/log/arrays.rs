//! Files of arrays and tables as logs: which arrays make up the rows, and their numbers.

use std::ops::Range;

use dynid_files::excerpt::listed;

use super::header::LogHeader;
use super::{LogOptions, LogSource, Missing, ReadingNote, TableBlocks, Wanted, one_block, places_of};
use crate::csv::{LogFileError, MAX_COLUMNS, Table};
use crate::signal::is_time_name;

/// Stamps from this size on may have more digits than an `f64` holds.
const LONG_STAMP: f64 = 1e9;

/// Numbers as a file has them.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Float(Vec<f64>),
    /// Whole numbers keep all their digits.
    Whole(Vec<i64>),
}

impl Values {
    /// Puts others behind them. Whole numbers beside floats become floats.
    pub(super) fn append(&mut self, more: Values) {
        match (&mut *self, more) {
            (Values::Whole(own), Values::Whole(more)) => own.extend(more),
            (Values::Float(own), Values::Float(more)) => own.extend(more),
            (Values::Float(own), Values::Whole(more)) => own.extend(more.into_iter().map(|x| x as f64)),
            (Values::Whole(own), Values::Float(more)) => {
                let floats = own.iter().map(|x| *x as f64).chain(more).collect();
                *self = Values::Float(floats);
            }
        }
    }

    /// Values that are not there become NaN.
    pub(super) fn lose(&mut self, places: Range<usize>) {
        if let Values::Whole(own) = self {
            *self = Values::Float(own.iter().map(|x| *x as f64).collect());
        }
        if let Values::Float(own) = self {
            own[places].fill(f64::NAN);
        }
    }
}

/// What an array holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    Numbers,
    Texts,
}

/// An array of a file.
#[derive(Clone, Debug)]
pub(super) struct Array {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) holds: Holds,
    /// Names of the entries along the second axis, where the file has them.
    pub(super) entries: Vec<String>,
}

/// A file of arrays that can be loaded one by one.
pub(super) trait ArrayFile: Send {
    /// Its arrays, in the order of the file.
    fn arrays(&self) -> &[Array];

    /// All numbers of an array of at most two axes, the last axis fastest.
    ///
    /// # Errors
    /// What is wrong with the file.
    fn load(&mut self, array: usize) -> Result<Values, String>;

    /// Rows that lie together in the file, group by group, where some can be loaded without the others.
    fn groups(&self) -> Option<Vec<usize>> {
        None
    }

    /// Numbers of some rows of an array whose first axis is that of the rows.
    ///
    /// # Errors
    /// As [`ArrayFile::load`].
    fn load_rows(&mut self, array: usize, rows: Range<usize>) -> Result<Values, String> {
        let width = self.arrays()[array].shape.get(1).copied().unwrap_or(1);
        let inside = rows.start * width..rows.end * width;
        Ok(match self.load(array)? {
            Values::Float(all) => Values::Float(all[inside].to_vec()),
            Values::Whole(all) => Values::Whole(all[inside].to_vec()),
        })
    }
}

/// Where a column of the table lies.
#[derive(Clone, Copy, Debug)]
struct Place {
    array: usize,
    /// First of its numbers, and the step to the next one.
    first: usize,
    step: usize,
}

/// A log in a file of arrays.
pub(super) struct ArrayLog {
    file: String,
    format: &'static str,
    sha256: String,
    source: Box<dyn ArrayFile>,
    header: LogHeader,
    places: Vec<Place>,
    rows: usize,
    notes: Vec<ReadingNote>,
    file_bytes: u64,
    options: LogOptions,
}

impl ArrayLog {
    /// Finds the arrays that are as long as the log. `about`: what the file says of itself; `file_bytes`: its size.
    ///
    /// # Errors
    /// [`LogFileError`]: no array makes up rows, there are too many columns, or a name is there twice.
    pub(super) fn new(
        file: &str,
        format: &'static str,
        sha256: String,
        source: Box<dyn ArrayFile>,
        about: Vec<ReadingNote>,
        file_bytes: u64,
        options: &LogOptions,
    ) -> Result<Self, LogFileError> {
        let arrays = source.arrays();
        let owned = || file.to_owned();
        // An array alone is a table without a header.
        let is_plain = matches!(arrays, [only] if only.shape.len() == 2 && only.entries.is_empty());
        match is_plain {
            true => LogOptions { names: None, ..options.clone() }.refuse_settings_of_text(file, format)?,
            false => options.refuse_settings_of_text(file, format)?,
        }
        let Some(rows) = length_of_log(arrays) else {
            let shapes: Vec<String> = arrays.iter().map(|a| format!("{} {:?}", a.name, a.shape)).collect();
            let expected = "arrays of two rows or more".to_owned();
            let found = listed(&shapes, 6);
            return Err(LogFileError::Content { file: owned(), format, expected, found });
        };
        let mut notes = vec![ReadingNote::new("format", format, format!("{rows} rows"))];
        notes.extend(about);
        let (mut names, mut in_file, mut text, mut places) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut turned, mut left) = (Vec::new(), Vec::new());
        for (k, array) in arrays.iter().enumerate() {
            let Some((width, across)) = columns_of(&array.shape, rows) else {
                left.push(format!("{} {:?}", array.name, array.shape));
                continue;
            };
            if across && width > 1 {
                turned.push(array.name.clone());
            }
            if names.len() + width > MAX_COLUMNS {
                let (line, limit, found) = (0, MAX_COLUMNS, names.len() + width);
                return Err(LogFileError::TooManyColumns { file: owned(), line, limit, found });
            }
            for entry in 0..width {
                let numbered = format!("{}[{entry}]", array.name);
                let named = array.entries.get(entry).filter(|_| array.entries.len() == width);
                let (name, other) = match (named, width) {
                    (Some(own), _) => (format!("{}/{own}", array.name), numbered),
                    (None, 1) => (array.name.clone(), String::new()),
                    (None, _) => (numbered, String::new()),
                };
                names.push(name);
                in_file.push(other);
                text.push(array.holds == Holds::Texts);
                let (first, step) = if across { (entry * rows, 1) } else { (entry, width) };
                places.push(Place { array: k, first, step });
            }
        }
        if let Some(stated) = options.names.as_ref().filter(|_| is_plain) {
            if stated.len() != names.len() {
                let (line, expected, found) = (0, names.len(), stated.len());
                return Err(LogFileError::NameCount { file: owned(), line, expected, found });
            }
            in_file = std::mem::replace(&mut names, stated.clone());
        }
        if !turned.is_empty() {
            let reason = format!("their second axis is as long as the log, {rows} rows");
            notes.push(ReadingNote::new("turned arrays", listed(&turned, 6), reason));
        }
        if !left.is_empty() {
            let reason = format!("they do not have the {rows} rows of the log");
            notes.push(ReadingNote::new("arrays left out", listed(&left, 6), reason));
        }
        let mut sorted: Vec<&String> = names.iter().collect();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            let places: Vec<usize> = (0..names.len()).filter(|k| &names[*k] == pair[0]).collect();
            let (name, first, second) = (pair[0].clone(), places[0] + 1, places[1] + 1);
            return Err(LogFileError::DuplicateColumn { file: owned(), line: 0, name, first, second });
        }
        let unnamed = is_plain && options.names.is_none();
        let mut header = LogHeader { in_file, text, unnamed, ..LogHeader::of_names(&names) };
        if header.time.is_empty() && !names.iter().any(|name| is_time_name(name)) {
            // Names are paths here; the time may be the end of one.
            let ends = |k: &usize| names[*k].rsplit('/').next().is_some_and(is_time_name) && !header.text[*k];
            let stamps: Vec<usize> = (0..names.len()).filter(ends).collect();
            header.time = if stamps.len() == 1 { stamps } else { Vec::new() };
        }
        if let Some(column) = options.read.ignore.iter().find(|name| header.column(name).is_none()) {
            return Err(LogFileError::UnknownIgnored { file: owned(), column: column.clone() });
        }
        if let Some(format) = header.format {
            notes.push(ReadingNote::new("columns", format.to_string(), format.mark()));
        }
        let options = options.clone();
        Ok(ArrayLog {
            file: owned(),
            format,
            sha256,
            source,
            header,
            places,
            rows,
            notes,
            file_bytes,
            options,
        })
    }

    /// A table of columns; `part`: rows that are loaded alone, which must be those of the builder.
    fn table(
        &mut self,
        mut builder: TableBuilder,
        columns: &[usize],
        times: &[usize],
        missing: Missing,
        part: Option<Range<usize>>,
    ) -> Result<Table, LogFileError> {
        let (file, format) = (|| self.file.clone(), self.format);
        let mut loaded: Option<(usize, Values)> = None;
        for k in columns {
            let Place { array, first, step } = self.places[*k];
            let name = &self.header.names[*k];
            if self.header.text[*k] {
                let (expected, found) = (format!("numbers in `{name}`"), "texts".to_owned());
                return Err(LogFileError::Content { file: file(), format, expected, found });
            }
            if loaded.as_ref().is_none_or(|(of, _)| *of != array) {
                let values = match &part {
                    Some(rows) => self.source.load_rows(array, rows.clone()),
                    None => self.source.load(array),
                };
                let damaged = |reason| LogFileError::Damaged { file: file(), format, reason };
                loaded = Some((array, values.map_err(damaged)?));
            }
            let Some((_, values)) = &loaded else { continue };
            builder.add(name, values, first, step, times.contains(k), missing)?;
        }
        Ok(builder.finish(String::new()))
    }

    /// Bytes that the arrays of these columns take.
    fn bytes(&self, columns: &[usize]) -> u64 {
        let mut arrays: Vec<usize> = columns.iter().map(|k| self.places[*k].array).collect();
        arrays.dedup();
        let all = self.source.arrays();
        let own = |k: &usize| all[*k].shape.iter().fold(8, |n: u64, m| n.saturating_mul(*m as u64));
        arrays.iter().map(own).fold(0, u64::saturating_add)
    }
}

impl LogSource for ArrayLog {
    fn header(&self) -> LogHeader {
        self.header.without(&self.options.read.ignore)
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.notes
    }

    fn read(mut self: Box<Self>, wanted: &Wanted) -> Result<(Table, Vec<ReadingNote>), LogFileError> {
        let (columns, times) = places_of(&self.header, &self.header(), wanted);
        let (read, bytes) = (&self.options.read, self.bytes(&columns));
        let most =
            if bytes > read.ratio_grace { read.max_ratio.saturating_mul(self.file_bytes) } else { u64::MAX };
        if bytes > read.max_bytes.min(most) {
            let reason =
                format!("expected at most {} bytes of numbers, found {bytes}", read.max_bytes.min(most));
            return Err(LogFileError::Damaged { file: self.file, format: self.format, reason });
        }
        let rows = self.options.read.rows;
        let builder = TableBuilder::new(&self.file, self.rows, rows, &self.options)?;
        let table = self.table(builder, &columns, &times, wanted.missing, None)?;
        Ok((Table { sha256: self.sha256, ..table }, self.notes))
    }

    fn blocks(self: Box<Self>, wanted: &Wanted, rows: usize) -> Result<Box<dyn TableBlocks>, LogFileError> {
        let Some(groups) = self.source.groups() else { return one_block(self, wanted) };
        let (columns, times) = places_of(&self.header, &self.header(), wanted);
        let (first, last) = TableBuilder::rows_of(&self.file, self.rows, self.options.read.rows)?;
        let most = (MAX_BLOCK / (8 * columns.len().max(1))).max(rows);
        let mut parts = blocks_of(&groups, first - 1..last, rows.max(MIN_BLOCK), most);
        parts.reverse();
        let (missing, per_block) = (wanted.missing, rows.max(1));
        Ok(Box::new(ArrayBlocks { log: *self, columns, times, missing, per_block, parts, loaded: None }))
    }
}

/// Fewest rows of a block: groups may be of single rows.
const MIN_BLOCK: usize = 1 << 16;
/// Bytes of numbers from which on a group is read in parts, at the price of passing over what comes before them.
const MAX_BLOCK: usize = 96 << 20;

/// Parts of the wanted rows: groups put together up to `least` rows, and taken apart from `most` rows on.
fn blocks_of(groups: &[usize], wanted: Range<usize>, least: usize, most: usize) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    let mut start = 0;
    for group in groups {
        let own = start.max(wanted.start)..(start + group).min(wanted.end);
        start += group;
        if own.is_empty() {
            continue;
        }
        match parts.last_mut() {
            Some(last) if last.len() < least && last.len() + own.len() <= most => last.end = own.end,
            _ => {
                parts.extend(own.clone().step_by(most.max(1)).map(|k| k..own.end.min(k.saturating_add(most))))
            }
        }
    }
    parts
}

/// Rows of a file whose groups of rows are loaded one by one, given as many at a time as of text: what is found on the first rows of a log must
/// not depend on its format.
struct ArrayBlocks {
    log: ArrayLog,
    columns: Vec<usize>,
    times: Vec<usize>,
    missing: Missing,
    per_block: usize,
    /// Rows that are still to be loaded, the next ones last.
    parts: Vec<Range<usize>>,
    /// Rows that were loaded, and how many of them were given.
    loaded: Option<(Table, usize)>,
}

impl ArrayBlocks {
    /// Loads the next rows behind those that were not given yet.
    fn load(&mut self, part: Range<usize>) -> Result<(), LogFileError> {
        let origins = self.loaded.as_ref().map(|(table, _)| table.origin.clone());
        let builder = TableBuilder::of_part(&self.log.file, part.clone(), origins, &self.log.options)?;
        let mut more = self.log.table(builder, &self.columns, &self.times, self.missing, Some(part))?;
        if let Some((before, given)) = self.loaded.take() {
            more.rows += before.rows - given;
            more.first_row = before.first_row + given;
            for (column, before) in more.columns.iter_mut().zip(before.columns) {
                column.splice(0..0, before[given..].iter().copied());
            }
        }
        self.loaded = Some((more, 0));
        Ok(())
    }
}

impl TableBlocks for ArrayBlocks {
    fn next_block(&mut self) -> Result<Option<Table>, LogFileError> {
        let left = |own: &Self| own.loaded.as_ref().map_or(0, |(table, given)| table.rows - given);
        while left(self) < self.per_block
            && let Some(part) = self.parts.pop()
        {
            self.load(part)?;
        }
        let count = left(self).min(self.per_block);
        let Some((table, given)) = self.loaded.as_mut().filter(|_| count > 0) else { return Ok(None) };
        let rows = *given..*given + count;
        *given += count;
        Ok(Some(Table {
            source: table.source.clone(),
            header: table.header.clone(),
            columns: table.columns.iter().map(|column| column[rows.clone()].to_vec()).collect(),
            rows: count,
            first_row: table.first_row + rows.start,
            origin: table.origin.clone(),
            sha256: String::new(),
        }))
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.log.notes
    }

    fn finish(self: Box<Self>) -> Result<(String, Vec<ReadingNote>), LogFileError> {
        Ok((self.log.sha256, self.log.notes))
    }
}

/// Puts columns together: the rows asked for, digits of long stamps, and what is no signal.
pub(super) struct TableBuilder {
    table: Table,
    skipped: usize,
    /// What is taken from long stamps, column by column, where rows before these say it.
    origins: Option<Vec<i64>>,
    /// Largest magnitude of a signal.
    max_magnitude: f64,
}

impl TableBuilder {
    /// The first and the last row that are wanted, from 1.
    ///
    /// # Errors
    /// [`LogFileError::RowRange`]: the log does not have these rows.
    pub(super) fn rows_of(
        file: &str,
        rows: usize,
        wanted: Option<(usize, usize)>,
    ) -> Result<(usize, usize), LogFileError> {
        let (first, last) = wanted.unwrap_or((1, rows));
        if first == 0 || first > last || last > rows {
            let found = if first == 0 { "row 0".to_owned() } else { format!("{rows} rows") };
            return Err(LogFileError::RowRange { file: file.to_owned(), first, last, found });
        }
        Ok((first, last))
    }

    /// `wanted`: the first and the last row, from 1.
    ///
    /// # Errors
    /// As [`TableBuilder::rows_of`].
    pub(super) fn new(
        file: &str,
        rows: usize,
        wanted: Option<(usize, usize)>,
        options: &LogOptions,
    ) -> Result<Self, LogFileError> {
        let (first, last) = TableBuilder::rows_of(file, rows, wanted)?;
        let table = Table {
            source: file.to_owned(),
            header: Vec::new(),
            columns: Vec::new(),
            rows: last + 1 - first,
            first_row: first,
            origin: Vec::new(),
            sha256: String::new(),
        };
        let max_magnitude = options.read.max_magnitude;
        Ok(TableBuilder { table, skipped: first - 1, origins: None, max_magnitude })
    }

    /// Rows of a table whose numbers are handed over without those before them. `origins`: what is taken from long stamps, where rows before
    /// these said it.
    ///
    /// # Errors
    /// As [`TableBuilder::rows_of`].
    pub(super) fn of_part(
        file: &str,
        part: Range<usize>,
        origins: Option<Vec<i64>>,
        options: &LogOptions,
    ) -> Result<Self, LogFileError> {
        let whole = TableBuilder::new(file, part.end, Some((part.start + 1, part.end)), options)?;
        Ok(TableBuilder { skipped: 0, origins, ..whole })
    }

    /// Adds a column; of its numbers, row `k` has that at `first + k * step`.
    ///
    /// # Errors
    /// [`LogFileError::Cell`]: a number is missing where none may be, infinite, or larger than any signal.
    pub(super) fn add(
        &mut self,
        name: &str,
        values: &Values,
        first: usize,
        step: usize,
        is_time: bool,
        missing: Missing,
    ) -> Result<(), LogFileError> {
        let places = (0..self.table.rows).map(|k| first + (self.skipped + k) * step);
        let given = self.origins.as_ref().and_then(|all| all.get(self.table.origin.len()).copied());
        let (column, origin): (Vec<f64>, i64) = match values {
            Values::Whole(whole) => {
                let start = whole.get(first + self.skipped * step).copied().unwrap_or(0);
                let is_long = is_time && start.unsigned_abs() as f64 >= LONG_STAMP;
                let origin = given.unwrap_or(if is_long { start } else { 0 });
                (
                    places
                        .map(|k| whole.get(k).map_or(f64::NAN, |x| x.wrapping_sub(origin) as f64))
                        .collect(),
                    origin,
                )
            }
            Values::Float(numbers) => {
                let start = numbers.get(first + self.skipped * step).copied().unwrap_or(0.0);
                // Floats that fit, so that the difference to their neighbours is exact.
                let is_long = is_time && (LONG_STAMP..9e15).contains(&start.abs());
                let origin = given.map_or(if is_long { start.trunc() } else { 0.0 }, |origin| origin as f64);
                (places.map(|k| numbers.get(k).map_or(f64::NAN, |x| x - origin)).collect(), origin as i64)
            }
        };
        let limit = if is_time { f64::MAX } else { self.max_magnitude };
        let wrong = |x: &f64| !(x.abs() <= limit || (x.is_nan() && missing != Missing::Error));
        if let Some(k) = column.iter().position(wrong) {
            let expected = match column[k] {
                x if x.is_nan() => "a value".to_owned(),
                x if x.is_infinite() => "a finite number".to_owned(),
                _ => format!("a magnitude up to {limit:e}"),
            };
            return Err(LogFileError::Cell {
                file: self.table.source.clone(),
                row: self.table.first_row + k,
                column: name.to_owned(),
                expected,
                found: column[k],
            });
        }
        self.table.header.push(name.to_owned());
        self.table.columns.push(column);
        self.table.origin.push(origin);
        Ok(())
    }

    pub(super) fn finish(self, sha256: String) -> Table {
        Table { sha256, ..self.table }
    }
}

/// The length of the array that is called a time, else the longest axis of arrays that hold most numbers; of equals, the longer.
fn length_of_log(arrays: &[Array]) -> Option<usize> {
    let numbers = || arrays.iter().filter(|a| a.holds == Holds::Numbers && a.shape.len() <= 2);
    let stamps = |a: &&Array| {
        let name = a.name.rsplit(['/', '.']).next().unwrap_or(&a.name);
        let length = a.shape.iter().copied().max().unwrap_or(0);
        is_time_name(name) && length > 1 && a.shape.iter().product::<usize>() == length
    };
    if let Some(time) = numbers().find(stamps) {
        return time.shape.iter().copied().max();
    }
    let mut votes: Vec<(usize, usize)> = Vec::new();
    for array in numbers() {
        // A log is longer than it is wide.
        let Some(length) = array.shape.iter().copied().max().filter(|n| *n > 1) else { continue };
        let size = array.shape.iter().fold(1_usize, |n, m| n.saturating_mul(*m));
        match votes.iter_mut().find(|(_, n)| *n == length) {
            Some((count, _)) => *count = count.saturating_add(size),
            None => votes.push((size, length)),
        }
    }
    votes.into_iter().max().map(|(_, length)| length)
}

/// How many columns an array gives, and whether its rows lie along its second axis.
fn columns_of(shape: &[usize], rows: usize) -> Option<(usize, bool)> {
    match *shape {
        [n] if n == rows => Some((1, false)),
        [n, width] if n == rows => Some((width, false)),
        [width, n] if n == rows => Some((width, true)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(name: &str, shape: &[usize]) -> Array {
        Array { name: name.to_owned(), shape: shape.to_vec(), holds: Holds::Numbers, entries: Vec::new() }
    }

    #[test]
    fn the_length_that_most_arrays_share_is_that_of_the_log() {
        let arrays = [array("t", &[100]), array("q", &[100, 6]), array("tau", &[6, 100]), array("lim", &[6])];
        assert_eq!(length_of_log(&arrays), Some(100));
        assert_eq!(length_of_log(&arrays[1..]), Some(100));
        assert_eq!(columns_of(&[6, 100], 100), Some((6, true)));
        assert_eq!(columns_of(&[100, 1], 100), Some((1, false)));
        assert_eq!(length_of_log(&[array("dt", &[1]), array("name", &[])]), None);
    }

    #[test]
    fn groups_are_put_together_and_taken_apart() {
        assert_eq!(blocks_of(&[3, 3, 10, 1], 1..16, 4, 8), [1..6, 6..14, 14..16]);
        assert_eq!(blocks_of(&[100], 0..100, 1, 40), [0..40, 40..80, 80..100]);
        assert_eq!(blocks_of(&[2, 2], 0..0, 1, 40), [0..0; 0]);
    }

    #[test]
    fn digits_of_long_stamps_are_kept() {
        let options = LogOptions::default();
        let start = 1_700_000_000_123_456_789_i64;
        let stamps = Values::Whole((0..3).map(|k| start + 1_000_001 * k).collect());
        let mut builder = TableBuilder::new("log", 3, None, &options).unwrap();
        builder.add("t", &stamps, 0, 1, true, Missing::Error).unwrap();
        let table = builder.finish(String::new());
        assert_eq!(
            (table.origin[0], table.columns[0].as_slice()),
            (start, &[0.0, 1_000_001.0, 2_000_002.0][..])
        );
    }
}
