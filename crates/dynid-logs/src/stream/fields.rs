//! From lines to rows of numbers.

use super::bad_line::BadLine;
use super::json::JsonFields;
use crate::csv::{LogFileError, RowFault, RowParser};

/// How a line holds a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFormat {
    /// Numbers between commas (semicolons, tabulators, blanks) under a header line.
    Csv,
    /// One JSON object per line: numbers, or lists of numbers `"q": [..]` that stand for `q1`, `q2`, ...
    Json,
}

/// Rows of a stream. The first line that is neither blank nor a comment (`#`) names the columns; of JSON objects it is a row as
/// well.
pub struct StreamRows {
    name: String,
    format: LineFormat,
    times: Vec<String>,
    header: Option<Header>,
}

enum Header {
    Csv(RowParser),
    Json(JsonFields),
}

impl std::fmt::Debug for StreamRows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StreamRows")
            .field("name", &self.name)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

impl StreamRows {
    /// Rows of a stream with a name for messages.
    pub fn new(name: &str, format: LineFormat) -> Self {
        StreamRows { name: name.to_owned(), format, times: Vec::new(), header: None }
    }

    /// Names columns that hold times besides those whose names say so: their numbers may be of any size.
    #[must_use]
    pub fn with_times(self, times: Vec<String>) -> Self {
        StreamRows { times, ..self }
    }

    /// Column names, once the first line has come.
    pub fn header(&self) -> Option<&[String]> {
        match self.header.as_ref()? {
            Header::Csv(parser) => Some(parser.names()),
            Header::Json(fields) => Some(fields.names()),
        }
    }

    /// The numbers of a line in the order of the header; `None` for the header, blanks and comments.
    ///
    /// # Errors
    /// [`LogFileError`] for a header without names, with a name twice or more columns than any log has: the stream cannot be
    /// read. A bad row is the inner error.
    pub fn read(
        &mut self,
        number: u64,
        line: &[u8],
    ) -> Result<Option<Result<&[f64], BadLine>>, LogFileError> {
        let line =
            if self.header.is_none() { line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line) } else { line };
        if matches!(line.iter().find(|b| !b.is_ascii_whitespace()), None | Some(b'#')) {
            return Ok(None);
        }
        if self.header.is_none() {
            let place = usize::try_from(number).unwrap_or(usize::MAX);
            self.header = Some(match self.format {
                LineFormat::Csv => Header::Csv(RowParser::of_header(&self.name, place, line, &self.times)?),
                LineFormat::Json => match JsonFields::of_line(line, &self.times) {
                    Ok(fields) => Header::Json(fields),
                    // The next line may be better.
                    Err(bad) => return Ok(Some(Err(bad))),
                },
            });
            if self.format == LineFormat::Csv {
                return Ok(None);
            }
        }
        Ok(match &mut self.header {
            Some(Header::Csv(parser)) => Some(csv_row(parser, line)),
            Some(Header::Json(fields)) => Some(fields.row(line)),
            None => None,
        })
    }
}

fn csv_row<'a>(parser: &'a mut RowParser, line: &[u8]) -> Result<&'a [f64], BadLine> {
    // Told apart first: what is borrowed for a good row cannot serve a bad one.
    if let Err(fault) = parser.parse(line) {
        let column = |k: usize| parser.names()[k].clone();
        return Err(match fault {
            RowFault::FieldCount(found) => BadLine::FieldCount { expected: parser.names().len(), found },
            RowFault::NotANumber(k, found) => BadLine::NotANumber { column: column(k), found },
            RowFault::NotFinite(k, found) => BadLine::NotFinite { column: column(k), found },
            RowFault::TooBig(k, found) => BadLine::TooBig { column: column(k), found },
        });
    }
    Ok(parser.values())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(format: LineFormat, lines: &[&str]) -> Vec<Option<Result<Vec<f64>, String>>> {
        let mut stream = StreamRows::new("stdin", format);
        lines
            .iter()
            .enumerate()
            .map(|(n, line)| {
                let row = stream.read(n as u64 + 1, line.as_bytes()).unwrap();
                row.map(|r| r.map(<[f64]>::to_vec).map_err(|e| e.to_string()))
            })
            .collect()
    }

    #[test]
    fn csv_rows_and_bad_lines() {
        let found = rows(
            LineFormat::Csv,
            &["# made up", "t,q1", "0,1.5", "", "0.1,nan", "0.2", "0.3,x", "0.4,1e13", "0.5, 2"],
        );
        assert!(found[0].is_none() && found[1].is_none() && found[3].is_none());
        assert_eq!(found[2], Some(Ok(vec![0.0, 1.5])));
        assert_eq!(found[4], Some(Err("column `q1`: expected a finite number, found `nan`".into())));
        assert_eq!(found[5], Some(Err("expected 2 fields, found 1".into())));
        assert_eq!(found[6], Some(Err("column `q1`: expected a number, found `x`".into())));
        assert_eq!(
            found[7],
            Some(Err("column `q1`: expected at most 1e12 in magnitude, found `1e13`".into()))
        );
        assert_eq!(found[8], Some(Ok(vec![0.5, 2.0])));
    }

    #[test]
    fn json_rows_and_bad_lines() {
        let found = rows(
            LineFormat::Json,
            &[
                "garbage",
                r#"{"t": 0, "q": [1, 2], "mode": "auto"}"#,
                r#"{"q": [3, 4], "t": 0.1}"#,
                r#"{"t": 0.2, "q": [3]}"#,
                r#"{"t": 0.3, "q": [3, null]}"#,
                r#"{"t": 0.4, "q": [3, "x"]}"#,
                "[1]",
                r#"{"t": 0.5, "q1": 5, "q2": 6}"#,
            ],
        );
        assert!(matches!(found[0], Some(Err(_))));
        assert_eq!(found[1], Some(Ok(vec![1.0, 2.0, 0.0])));
        assert_eq!(found[2], Some(Ok(vec![3.0, 4.0, 0.1])));
        assert_eq!(found[3], Some(Err("expected a field `q2`, found none".into())));
        assert_eq!(found[4], Some(Err("column `q2`: expected a finite number, found `null`".into())));
        assert_eq!(found[5], Some(Err("column `q2`: expected a number, found `\"x\"`".into())));
        assert_eq!(found[6], Some(Err("expected a JSON object, found a list".into())));
        assert_eq!(found[7], Some(Ok(vec![5.0, 6.0, 0.5])));
    }

    #[test]
    fn stamps_may_be_of_any_size_under_any_name_that_is_said_to_be_a_time() {
        for (format, header, row) in [
            (LineFormat::Csv, "clock,q1", "1700000000000000000,1"),
            (
                LineFormat::Json,
                r#"{"clock": 1700000000000000000, "q1": 1}"#,
                r#"{"clock": 1700000000000000001, "q1": 1}"#,
            ),
        ] {
            for (times, good) in [(vec![], false), (vec!["clock".to_owned()], true)] {
                let mut stream = StreamRows::new("stdin", format).with_times(times);
                let _ = stream.read(1, header.as_bytes()).unwrap();
                assert_eq!(stream.read(2, row.as_bytes()).unwrap().unwrap().is_ok(), good);
            }
        }
    }

    #[test]
    fn a_header_that_names_nothing_is_refused() {
        let mut stream = StreamRows::new("stdin", LineFormat::Csv);
        assert!(stream.read(1, b"0.1,0.2").is_err());
        let mut stream = StreamRows::new("stdin", LineFormat::Csv);
        assert!(stream.read(1, b"t,q1,q1").is_err());
    }
}
