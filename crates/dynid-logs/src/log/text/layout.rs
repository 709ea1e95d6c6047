//! What the first lines of a log say about it.

use std::collections::HashMap;

use dynid_files::excerpt::{excerpt_bytes, listed};

use super::cell::{Cell, classify};
use super::ros::{Echo, name_after_joints};
use crate::csv::{Delimiter, LogFileError, MAX_COLUMNS, detect, number, split};
use crate::log::format::LogFormat;
use crate::log::header::LogHeader;
use crate::log::{DecimalMark, LogOptions, ReadingNote};

/// Names repeated in a note.
const LISTED: usize = 8;

/// A line with its number.
pub(super) type Line = (usize, Vec<u8>);

/// What a column of the file holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Holds {
    Numbers,
    Texts,
    Lists(usize),
    /// The same text in every row.
    Name(Vec<u8>),
}

/// How the lines of a log are to be read.
pub(super) enum Form {
    /// Cells between delimiters.
    Cells { delimiter: Delimiter, comma: bool, holds: Vec<Holds> },
    /// Messages.
    Echo(Echo),
}

/// What the first lines of a log say about it.
pub(super) struct Layout {
    pub(super) form: Form,
    pub(super) header: LogHeader,
    pub(super) notes: Vec<ReadingNote>,
    /// The first line is a row.
    pub(super) first_is_row: bool,
}

impl Layout {
    /// From the first line and some that follow.
    pub(super) fn of(
        file: &str,
        first: &Line,
        sample: &[Line],
        delimiter: Option<Delimiter>,
        options: &LogOptions,
    ) -> Result<Self, LogFileError> {
        let lines = std::iter::once(first).chain(sample).map(|(_, text)| text.as_slice());
        if let Some(echo) = Echo::of_lines(lines) {
            if let Some(names) = &options.names {
                let (expected, found) = (echo.names().len(), names.len());
                return Err(LogFileError::NameCount {
                    file: file.to_owned(),
                    line: first.0,
                    expected,
                    found,
                });
            }
            return Ok(Self::of_echo(echo));
        }
        Sniffer { file, first, sample, options }.layout(delimiter)
    }

    fn of_echo(echo: Echo) -> Self {
        let names = echo.names();
        let header = LogHeader {
            in_file: vec![String::new(); names.len()],
            text: vec![false; names.len()],
            names,
            format: Some(LogFormat::Ros2TopicEcho),
            time: vec![0, 1],
            unnamed: false,
        };
        let mut notes = vec![format_note(LogFormat::Ros2TopicEcho), joints_note(echo.joints())];
        if echo.publishers() > 1 {
            let reason = "messages name different joints; rows without all signals are left out";
            notes.push(ReadingNote::new("publishers", echo.publishers().to_string(), reason));
        }
        Layout { form: Form::Echo(echo), header, notes, first_is_row: true }
    }
}

fn format_note(format: LogFormat) -> ReadingNote {
    ReadingNote::new("format", format.to_string(), format.mark())
}

fn joints_note(joints: &[String]) -> ReadingNote {
    ReadingNote::new("joint order", listed(joints, 64), "as the messages name their joints")
}

struct Sniffer<'a> {
    file: &'a str,
    first: &'a Line,
    sample: &'a [Line],
    options: &'a LogOptions,
}

impl Sniffer<'_> {
    fn layout(&self, stated: Option<Delimiter>) -> Result<Layout, LogFileError> {
        let (line, text) = (self.first.0, self.first.1.as_slice());
        let without_names = match stated {
            Some(delimiter) => is_data(&split(text, delimiter)).then_some(delimiter),
            None => delimiter_of_data(text),
        };
        let first_is_row = without_names.is_some();
        let delimiter = without_names.or(stated).unwrap_or_else(|| detect(text));
        let fields = split(text, delimiter);
        if fields.len() > MAX_COLUMNS {
            let (limit, found) = (MAX_COLUMNS, fields.len());
            return Err(LogFileError::TooManyColumns { file: self.file.to_owned(), line, limit, found });
        }
        let mut rows: Vec<Vec<Vec<u8>>> =
            self.sample.iter().map(|(_, text)| split(text, delimiter)).collect();
        if first_is_row {
            rows.insert(0, fields.clone());
        }
        let mut notes = Vec::new();
        let mut names = self.names(fields, first_is_row, &mut notes)?;
        // A delimiter behind the last field makes one more.
        if rows
            .first()
            .is_some_and(|row| row.len() == names.len() + 1 && row.last().is_some_and(Vec::is_empty))
        {
            names.push(format!("column{}", names.len() + 1));
        }
        rows.retain(|row| row.len() == names.len());
        behind_mark(&mut names);
        self.refuse_twice(&names)?;
        let cells: Vec<Vec<Cell>> =
            (0..names.len()).map(|k| rows.iter().map(|row| classify(&row[k])).collect()).collect();
        let comma = self.decimal(&names, &rows, &cells, &mut notes)?;
        let mut holds: Vec<Holds> = cells.iter().map(|column| held(column)).collect();
        let mut header =
            LogHeader { unnamed: first_is_row && self.options.names.is_none(), ..of_columns(names, &holds) };
        if let Some(format) = header.format {
            notes.insert(0, format_note(format));
        }
        if header.format == Some(LogFormat::RostopicEcho)
            && let Some(row) = rows.first()
        {
            self.follow_joints(&mut header, row, &mut holds, &mut notes)?;
        }
        prefer_moving_stamps(&mut header, &holds, &rows);
        self.tell_of_columns(&header, &holds, &mut notes);
        Ok(Layout { form: Form::Cells { delimiter, comma, holds }, header, notes, first_is_row })
    }

    /// Names of the columns of the file.
    fn names(
        &self,
        fields: Vec<Vec<u8>>,
        first_is_row: bool,
        notes: &mut Vec<ReadingNote>,
    ) -> Result<Vec<String>, LogFileError> {
        let (file, line) = (|| self.file.to_owned(), self.first.0);
        match (&self.options.names, first_is_row) {
            (Some(_), false) => {
                let found = excerpt_bytes(&self.first.1);
                Err(LogFileError::NamesBesideHeader { file: file(), line, found })
            }
            (Some(names), true) if names.len() != fields.len() => {
                let (expected, found) = (fields.len(), names.len());
                Err(LogFileError::NameCount { file: file(), line, expected, found })
            }
            (Some(names), true) => Ok(names.clone()),
            (None, true) => {
                let value = format!("none, {} columns", fields.len());
                notes.push(ReadingNote::new("header", value, "the first line holds numbers"));
                Ok((1..=fields.len()).map(|k| format!("column{k}")).collect())
            }
            (None, false) => Ok(fields
                .iter()
                .enumerate()
                .map(|(k, field)| match String::from_utf8_lossy(field).trim() {
                    "" => format!("column{}", k + 1),
                    name => name.to_owned(),
                })
                .collect()),
        }
    }

    fn refuse_twice(&self, names: &[String]) -> Result<(), LogFileError> {
        let mut seen = HashMap::new();
        for (k, name) in names.iter().enumerate() {
            if let Some(first) = seen.insert(name, k + 1) {
                let (file, line, name) = (self.file.to_owned(), self.first.0, excerpt_bytes(name.as_bytes()));
                return Err(LogFileError::DuplicateColumn { file, line, name, first, second: k + 1 });
            }
        }
        Ok(())
    }

    /// Whether numbers have decimal commas.
    fn decimal(
        &self,
        names: &[String],
        rows: &[Vec<Vec<u8>>],
        cells: &[Vec<Cell>],
        notes: &mut Vec<ReadingNote>,
    ) -> Result<bool, LogFileError> {
        let file = || self.file.to_owned();
        let shown = |k: usize, row: usize| excerpt_bytes(&rows[row][k]);
        let find = |wanted: &dyn Fn(&Cell) -> bool| {
            let of_column = |(k, column): (usize, &Vec<Cell>)| Some((k, column.iter().position(wanted)?));
            cells.iter().enumerate().find_map(of_column)
        };
        if let Some(mark) = self.options.decimal {
            return Ok(mark == DecimalMark::Comma);
        }
        if let Some((k, row)) = find(&|c| *c == Cell::BothMarks) {
            return Err(LogFileError::Thousands {
                file: file(),
                column: names[k].clone(),
                found: shown(k, row),
            });
        }
        let Some((k, row)) = find(&|c| matches!(c, Cell::Comma { .. })) else { return Ok(false) };
        let point = rows.iter().enumerate().find_map(|(row, fields)| {
            let with_point = |k: &usize| cells[*k][row] == Cell::Number && fields[*k].contains(&b'.');
            Some(((0..names.len()).find(with_point)?, row))
        });
        if let Some((other, other_row)) = point {
            return Err(LogFileError::MixedMarks {
                file: file(),
                comma: shown(k, row).into(),
                of_comma: names[k].as_str().into(),
                point: shown(other, other_row).into(),
                of_point: names[other].as_str().into(),
            });
        }
        let Some((k, row)) = find(&|c| *c == Cell::Comma { grouped: false }) else {
            return Err(LogFileError::AmbiguousComma {
                file: file(),
                column: names[k].clone(),
                found: shown(k, row),
            });
        };
        let reason = format!("`{}` in column `{}`", shown(k, row), names[k]);
        notes.push(ReadingNote::new("decimal mark", "comma", reason));
        Ok(true)
    }

    /// Columns of joint states named after the joints.
    fn follow_joints(
        &self,
        header: &mut LogHeader,
        row: &[Vec<u8>],
        holds: &mut [Holds],
        notes: &mut Vec<ReadingNote>,
    ) -> Result<(), LogFileError> {
        let named = name_after_joints(header, row);
        let joints: Vec<String> =
            named.iter().map(|k| String::from_utf8_lossy(&row[*k]).into_owned()).collect();
        for column in named {
            holds[column] = Holds::Name(row[column].clone());
        }
        if !joints.is_empty() {
            notes.push(joints_note(&joints));
        }
        self.refuse_twice(&header.names)
    }

    fn tell_of_columns(&self, header: &LogHeader, holds: &[Holds], notes: &mut Vec<ReadingNote>) {
        let lists: Vec<&str> = holds
            .iter()
            .filter(|h| matches!(h, Holds::Lists(_)))
            .zip(header.in_file.iter().zip(&header.names).filter(|(_, n)| n.ends_with("[0]")))
            .map(|(_, (_, name))| name.trim_end_matches("[0]"))
            .collect();
        if !lists.is_empty() {
            notes.push(ReadingNote::new(
                "list cells",
                listed(&lists, LISTED),
                "one column per entry, numbered from 0",
            ));
        }
        let texts: Vec<&String> =
            header.names.iter().zip(&header.text).filter(|(_, text)| **text).map(|(name, _)| name).collect();
        if !texts.is_empty() && header.format != Some(LogFormat::RostopicEcho) {
            notes.push(ReadingNote::new("skipped columns", listed(&texts, LISTED), "they hold texts"));
        }
    }
}

/// True if most of the fields of a line are values.
fn is_data(fields: &[Vec<u8>]) -> bool {
    let is_value =
        |field: &&Vec<u8>| matches!(classify(field), Cell::Number | Cell::Comma { .. } | Cell::List(_));
    2 * fields.iter().filter(is_value).count() > fields.len()
}

/// The delimiter under which a line is a row of values, the one with most of them; `None`: it is a header.
fn delimiter_of_data(line: &[u8]) -> Option<Delimiter> {
    let all = [Delimiter::Tab, Delimiter::Semicolon, Delimiter::Whitespace, Delimiter::Comma];
    let rows = all.into_iter().map(|d| (d, split(line, d))).filter(|(_, fields)| is_data(fields));
    // The first of equals wins: a comma may be a decimal mark.
    let best = rows.rev().max_by_key(|(_, fields)| fields.len())?;
    Some(best.0)
}

/// Older versions of libfranka repeat names for what was sent, behind an empty column.
fn behind_mark(names: &mut [String]) {
    let Some(mark) = names.iter().position(|n| n == "sent commands") else { return };
    for name in &mut names[mark + 1..] {
        name.insert_str(0, "sent.");
    }
}

/// What a column holds: a single number among texts is looked at as a number, so that a damaged cell is told.
fn held(cells: &[Cell]) -> Holds {
    let any = |wanted: fn(&Cell) -> bool| cells.iter().any(wanted);
    if any(|c| matches!(c, Cell::Number | Cell::Comma { .. } | Cell::BothMarks)) {
        return Holds::Numbers;
    }
    let list = cells.iter().find_map(|c| match c {
        Cell::List(length) => Some(*length),
        _ => None,
    });
    match list {
        Some(length) => Holds::Lists(length),
        None if any(|c| *c == Cell::Text) => Holds::Texts,
        None => Holds::Numbers,
    }
}

/// Columns with one name per value.
fn of_columns(names: Vec<String>, holds: &[Holds]) -> LogHeader {
    let mut all = Vec::with_capacity(names.len());
    let mut text = Vec::with_capacity(names.len());
    let plain = LogHeader::of_names(&names);
    for (name, holds) in names.into_iter().zip(holds) {
        match holds {
            Holds::Lists(length) => all.extend((0..*length).map(|k| format!("{name}[{k}]"))),
            _ => all.push(name),
        }
        text.resize(all.len(), *holds == Holds::Texts);
    }
    LogHeader { text, format: plain.format, ..LogHeader::of_names(&all) }
}

/// Takes the stamp of the receiver where that of the messages does not advance.
fn prefer_moving_stamps(header: &mut LogHeader, holds: &[Holds], rows: &[Vec<Vec<u8>>]) {
    if header.format != Some(LogFormat::RostopicEcho) || holds.len() != header.names.len() {
        return;
    }
    let advances = |k: &usize| {
        let stamp = |row: &Vec<Vec<u8>>| number::whole_part(&row[*k]);
        rows.len() < 2 || rows.first().map(stamp) != rows.last().map(stamp)
    };
    let known = ["field.header.stamp", "%time"].into_iter().filter_map(|name| header.column(name));
    if let Some(time) = known.into_iter().find(advances) {
        header.time = vec![time];
    }
}
