//! The writer of states, efforts and logs.

use std::io::{BufWriter, Write};
use std::path::Path;

use dynid_files::output::{AtomicFile, OutputError};
use flate2::write::GzEncoder;
use flate2::{Compression, GzBuilder};

/// Comment in the head of compressed files: it tells who wrote them.
pub const GZIP_COMMENT: &str = "written by dynid";

/// Writes columns under a header; see [`RowWriter`].
///
/// # Errors
/// [`OutputError`]; nothing is left behind.
pub fn write<H: AsRef<str>, C: AsRef<[f64]>>(
    path: impl AsRef<Path>,
    header: &[H],
    columns: &[C],
) -> Result<(), OutputError> {
    let mut writer = RowWriter::create(path, header)?;
    writer.rows_of(header, columns)?;
    writer.finish()
}

/// Columns under a header as text, as [`write()`] writes them uncompressed. `name` stands for the file in messages.
///
/// # Errors
/// [`OutputError`]: values that are not finite, columns that do not fit the header.
pub fn text<H: AsRef<str>, C: AsRef<[f64]>>(
    name: &str,
    header: &[H],
    columns: &[C],
) -> Result<String, OutputError> {
    let mut writer = RowWriter::begin(Sink::Text(Vec::new()), name.to_owned(), header)?;
    writer.rows_of(header, columns)?;
    match writer.sink {
        Sink::Text(bytes) => Ok(String::from_utf8_lossy(&bytes).into_owned()),
        Sink::Plain(_) | Sink::Gzip(_) => unreachable!("it was begun as text"),
    }
}

/// Writes rows one by one into a temporary file that [`RowWriter::finish`] renames to its name.
///
/// Numbers are written in the shortest form that reads back to the same `f64`; names ending in `.gz` are compressed.
/// Dropped unfinished, the file is removed.
pub struct RowWriter {
    sink: Sink,
    file: String,
    header: Vec<String>,
    rows: usize,
}

/// A cell of a row.
#[derive(Clone, Copy)]
pub(crate) enum OutCell {
    /// NaN: no value.
    Float(f64),
    Whole(i64),
}

enum Sink {
    Plain(BufWriter<AtomicFile>),
    Gzip(Box<GzEncoder<BufWriter<AtomicFile>>>),
    Text(Vec<u8>),
}

impl RowWriter {
    /// Opens the temporary file and writes the header.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn create<H: AsRef<str>>(path: impl AsRef<Path>, header: &[H]) -> Result<Self, OutputError> {
        let path = path.as_ref();
        let buffered = BufWriter::with_capacity(1 << 16, AtomicFile::create(path)?);
        let gzip = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        let sink = if gzip {
            let encoder = GzBuilder::new().comment(GZIP_COMMENT).write(buffered, Compression::default());
            Sink::Gzip(Box::new(encoder))
        } else {
            Sink::Plain(buffered)
        };
        Self::begin(sink, path.display().to_string(), header)
    }

    fn begin<H: AsRef<str>>(sink: Sink, file: String, header: &[H]) -> Result<Self, OutputError> {
        let header: Vec<String> = header.iter().map(|h| h.as_ref().to_owned()).collect();
        let mut writer = RowWriter { sink, file, header, rows: 0 };
        let line = writer.header.iter().map(|h| quoted(h)).collect::<Vec<_>>().join(",") + "\n";
        writer.put(line.as_bytes())?;
        Ok(writer)
    }

    /// Writes the rows of columns.
    fn rows_of<H: AsRef<str>, C: AsRef<[f64]>>(
        &mut self,
        header: &[H],
        columns: &[C],
    ) -> Result<(), OutputError> {
        let shape =
            |what, expected, found| OutputError::Shape { file: self.file.clone(), what, expected, found };
        if header.len() != columns.len() {
            return Err(shape("columns".to_owned(), header.len(), columns.len()));
        }
        let rows = columns.first().map_or(0, |c| c.as_ref().len());
        if let Some((name, column)) = header.iter().zip(columns).find(|(_, c)| c.as_ref().len() != rows) {
            let what = format!("rows of column `{}`", name.as_ref());
            return Err(shape(what, rows, column.as_ref().len()));
        }
        let mut row = vec![0.0; columns.len()];
        for k in 0..rows {
            for (x, column) in row.iter_mut().zip(columns) {
                *x = column.as_ref()[k];
            }
            self.row(&row)?;
        }
        Ok(())
    }

    /// Writes a row.
    ///
    /// # Errors
    /// [`OutputError`]: another number of values than the header has names, a value that is not finite, a failed write.
    pub fn row(&mut self, values: &[f64]) -> Result<(), OutputError> {
        self.rows += 1;
        if values.len() != self.header.len() {
            let (file, what) = (self.file.clone(), format!("values of row {}", self.rows));
            return Err(OutputError::Shape { file, what, expected: self.header.len(), found: values.len() });
        }
        if let Some(k) = values.iter().position(|x| !x.is_finite()) {
            let (file, column) = (self.file.clone(), self.header[k].clone());
            return Err(OutputError::NotFinite { file, row: self.rows, column, found: values[k] });
        }
        self.line(values.iter().map(|x| OutCell::Float(*x)))
    }

    /// Writes a row as [`RowWriter::row`] does; NaN is a cell without a value.
    ///
    /// # Errors
    /// [`OutputError`]: an infinite value, a failed write.
    pub(crate) fn cells(&mut self, cells: impl Iterator<Item = OutCell> + Clone) -> Result<(), OutputError> {
        self.rows += 1;
        let infinite = |cell: OutCell| matches!(cell, OutCell::Float(x) if x.is_infinite());
        if let Some(k) = cells.clone().position(infinite) {
            let (file, column) = (self.file.clone(), self.header[k].clone());
            return Err(OutputError::NotFinite { file, row: self.rows, column, found: f64::INFINITY });
        }
        self.line(cells)
    }

    fn line(&mut self, cells: impl Iterator<Item = OutCell>) -> Result<(), OutputError> {
        let mut line = String::with_capacity(20 * self.header.len());
        for (k, cell) in cells.enumerate() {
            if k > 0 {
                line.push(',');
            }
            match cell {
                OutCell::Float(x) if x.is_nan() => {}
                OutCell::Float(x) => push_shortest(&mut line, x),
                OutCell::Whole(x) => line.push_str(&x.to_string()),
            }
        }
        line.push('\n');
        self.put(line.as_bytes())
    }

    /// Makes the file appear under its name.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn finish(self) -> Result<(), OutputError> {
        let fault = |error| OutputError::Unwritable { file: self.file.clone(), error };
        let buffered = match self.sink {
            Sink::Plain(buffered) => buffered,
            Sink::Gzip(encoder) => encoder.finish().map_err(fault)?,
            Sink::Text(_) => unreachable!("text is not finished"),
        };
        buffered.into_inner().map_err(|e| fault(e.into_error()))?.finish()
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), OutputError> {
        let written = match &mut self.sink {
            Sink::Plain(sink) => sink.write_all(bytes),
            Sink::Gzip(sink) => sink.write_all(bytes),
            Sink::Text(sink) => sink.write_all(bytes),
        };
        written.map_err(|error| OutputError::Unwritable { file: self.file.clone(), error })
    }
}

/// The shortest decimal form of a finite number, with an exponent where zeros would fill the field.
fn push_shortest(line: &mut String, x: f64) {
    use std::fmt::Write;
    let plain = x == 0.0 || (1e-5..1e16).contains(&x.abs());
    let _ = if plain { write!(line, "{x}") } else { write!(line, "{x:e}") };
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', ';', '\t', '\n', '\r', '#']) {
        format!("\"{}\"", name.replace('"', "\"\"").replace(['\n', '\r'], " "))
    } else {
        name.to_owned()
    }
}
