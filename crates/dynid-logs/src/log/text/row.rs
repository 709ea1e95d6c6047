//! From lines to numbers.

use dynid_files::excerpt::excerpt_bytes;

use super::cell::{is_missing, list};
use super::fault::Fault;
use super::ros::Echo;
use crate::csv::{Delimiter, number, split};

/// What is read of a cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Take {
    /// A number up to a magnitude.
    Number(f64),
    /// A stamp, from which a whole number is taken off.
    Stamp(i64),
    /// So many numbers up to a magnitude.
    List(usize, f64),
    /// Nothing; the text must be this one.
    Name(Vec<u8>),
    /// Nothing; so many values stay as they are.
    Skipped(usize),
}

impl Take {
    /// Values of the cell.
    fn width(&self) -> usize {
        match self {
            Take::List(length, _) | Take::Skipped(length) => *length,
            _ => 1,
        }
    }
}

/// Reads the cells of a row.
pub(super) struct Cells {
    delimiter: Delimiter,
    comma: bool,
    takes: Vec<Take>,
    /// Largest magnitude per cell, where every cell is a plain number between separators that are bytes.
    plain: Option<(u8, Vec<f64>)>,
    keep_missing: bool,
    with_points: Vec<u8>,
}

impl Cells {
    /// `comma`: numbers have decimal commas; `keep_missing`: cells without a value become NaN.
    pub(super) fn new(delimiter: Delimiter, comma: bool, takes: Vec<Take>, keep_missing: bool) -> Self {
        let largest: Option<Vec<f64>> = takes
            .iter()
            .map(|take| match take {
                Take::Number(largest) => Some(*largest),
                _ => None,
            })
            .collect();
        Cells {
            plain: delimiter.byte().zip(largest),
            delimiter,
            comma,
            takes,
            keep_missing,
            with_points: Vec::new(),
        }
    }

    /// Values of a row.
    pub(super) fn width(&self) -> usize {
        self.takes.iter().map(Take::width).sum()
    }

    /// Takes the numbers of a line; cells that are not taken leave what was there.
    pub(super) fn parse(&mut self, line: &[u8], values: &mut [f64]) -> Result<(), Fault> {
        if self.comma && self.delimiter != Delimiter::Comma {
            let mut text = std::mem::take(&mut self.with_points);
            text.clear();
            text.extend_from_slice(line);
            // A point here would be a mark of thousands; such rows are looked at cell by cell.
            if text.contains(&b'.') {
                self.with_points = text;
                return self.parse_fields(line, values);
            }
            text.iter_mut().filter(|b| **b == b',').for_each(|b| *b = b'.');
            let parsed = self.parse_quick(&text, values);
            self.with_points = text;
            return if parsed { Ok(()) } else { self.parse_fields(line, values) };
        }
        if self.parse_quick(line, values) { Ok(()) } else { self.parse_fields(line, values) }
    }

    /// Rows without quotes and lists. `false`: look closer.
    fn parse_quick(&self, line: &[u8], values: &mut [f64]) -> bool {
        if let Some((separator, largest)) = &self.plain
            && number::row(line, *separator, values, largest)
        {
            return true;
        }
        let separator = self.delimiter.byte();
        let is_blank = |b: u8| b == b' ' || (b == b'\t' && separator != Some(b'\t'));
        let ends = |b: u8| separator.map_or(is_blank(b), |s| b == s);
        let past_blanks = |mut at: usize| {
            while line.get(at).is_some_and(|b| is_blank(*b)) {
                at += 1;
            }
            at
        };
        let mut at = past_blanks(0);
        let last = self.takes.len() - 1;
        let mut slot = 0;
        for (k, take) in self.takes.iter().enumerate() {
            let value = &mut values[slot];
            slot += take.width();
            let rest = line.get(at..).unwrap_or_default();
            let length = match take {
                Take::Number(largest) => match number::prefix(rest) {
                    Some((x, length)) if x.abs() <= *largest => {
                        *value = x;
                        length
                    }
                    Some(_) => return false,
                    None if self.keep_missing
                        && separator.is_some()
                        && rest.first().is_none_or(|b| ends(*b)) =>
                    {
                        *value = f64::NAN;
                        0
                    }
                    None => return false,
                },
                Take::Skipped(_) | Take::Name(_) | Take::Stamp(_) => {
                    if rest.first() == Some(&b'"') {
                        return false;
                    }
                    let length = match separator {
                        Some(byte) => memchr::memchr(byte, rest),
                        None => rest.iter().position(|b| is_blank(*b)),
                    };
                    let length = length.unwrap_or(rest.len());
                    match take {
                        Take::Name(name) if rest[..length].trim_ascii() != name.as_slice() => return false,
                        Take::Stamp(origin) => match number::beyond(rest[..length].trim_ascii(), *origin) {
                            Some(x) => *value = x,
                            None => return false,
                        },
                        _ => {}
                    }
                    length
                }
                Take::List(..) => return false,
            };
            let after = past_blanks(at + length);
            at = match (line.get(after), separator) {
                (None, _) if k == last => after,
                (Some(b), Some(s)) if *b == s && k < last => past_blanks(after + 1),
                (Some(_), None) if k < last && after > at + length => after,
                _ => return false,
            };
        }
        true
    }

    /// Any row, field by field.
    fn parse_fields(&self, line: &[u8], values: &mut [f64]) -> Result<(), Fault> {
        let fields = split(line, self.delimiter);
        if fields.len() != self.takes.len() {
            return Err(Fault::FieldCount(fields.len()));
        }
        let mut slot = 0;
        for (k, (field, take)) in fields.iter().zip(&self.takes).enumerate() {
            let cell = &mut values[slot..slot + take.width()];
            slot += take.width();
            match take {
                Take::Skipped(_) => {}
                Take::Name(name) if field == name => {}
                Take::Name(_) => return Err(Fault::OtherName(k, excerpt_bytes(field))),
                Take::Number(largest) => cell[0] = self.number(k, field, *largest)?,
                Take::Stamp(origin) => cell[0] = self.stamp(k, field, *origin)?,
                Take::List(length, largest) => self.list(k, field, *length, *largest, cell)?,
            }
        }
        Ok(())
    }

    fn number(&self, cell: usize, field: &[u8], largest: f64) -> Result<f64, Fault> {
        if self.keep_missing && is_missing(field) {
            return Ok(f64::NAN);
        }
        let parsed = std::str::from_utf8(field).ok().and_then(|text| match self.comma {
            false => text.parse::<f64>().ok(),
            true if text.contains('.') => None,
            true => text.replacen(',', ".", 1).parse().ok(),
        });
        checked(cell, field, parsed, largest)
    }

    fn stamp(&self, cell: usize, field: &[u8], origin: i64) -> Result<f64, Fault> {
        match number::beyond(field, origin) {
            Some(x) => Ok(x),
            None => Ok(self.number(cell, field, f64::MAX)? - origin as f64),
        }
    }

    fn list(
        &self,
        cell: usize,
        field: &[u8],
        length: usize,
        largest: f64,
        values: &mut [f64],
    ) -> Result<(), Fault> {
        let text = String::from_utf8_lossy(field);
        let numbers = match is_missing(field) {
            true if self.keep_missing => Some(Vec::new()),
            _ => list(&text),
        };
        match numbers {
            Some(numbers) if numbers.is_empty() && self.keep_missing => values.fill(f64::NAN),
            Some(numbers) if numbers.len() == length => {
                for (value, x) in values.iter_mut().zip(numbers) {
                    *value = match x.is_nan() && self.keep_missing {
                        true => x,
                        false => checked(cell, field, Some(x), largest)?,
                    };
                }
            }
            Some(numbers) => return Err(Fault::ListLength(cell, numbers.len())),
            None => return Err(Fault::NotANumber(cell, excerpt_bytes(field))),
        }
        Ok(())
    }
}

fn checked(cell: usize, field: &[u8], parsed: Option<f64>, largest: f64) -> Result<f64, Fault> {
    match parsed {
        None => Err(Fault::NotANumber(cell, excerpt_bytes(field))),
        Some(x) if !x.is_finite() => Err(Fault::NotFinite(cell, excerpt_bytes(field))),
        Some(x) if x.abs() > largest => Err(Fault::TooBig(cell, excerpt_bytes(field))),
        Some(x) => Ok(x),
    }
}

/// Reads the lines of a log.
pub(super) enum LineParser {
    Cells(Cells),
    Echo(Echo),
}

impl LineParser {
    /// Takes the numbers of a line; false: it holds no row.
    pub(super) fn parse(&mut self, line: &[u8], values: &mut [f64]) -> Result<bool, Fault> {
        match self {
            LineParser::Cells(cells) => cells.parse(line, values).map(|()| true),
            LineParser::Echo(echo) => echo.parse(line, values),
        }
    }
}
