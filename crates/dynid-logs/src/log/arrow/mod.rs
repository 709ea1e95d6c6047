//! Tables of Arrow: files (Feather of version 2) and streams, with their batches of rows as they are or compressed.
//!
//! A column of lists of one length is an array of two axes; fields of a structure are columns of their own.

mod batch;
mod fields;

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

use dynid_files::input::Opened;
use planus::ReadAsRoot;
use polars_arrow_format::ipc::{FooterRef, MessageHeaderRef, MessageRef, SchemaRef};

use self::batch::Batch;
use self::fields::{Column, Kept, columns};
use super::arrays::{Array, ArrayFile, Holds, Values};

/// Where a file begins and ends, and what each message of a stream begins with.
pub(super) const MARK: &[u8] = b"ARROW1";
pub(super) const CONTINUED: [u8; 4] = [0xff; 4];
/// Largest description of a batch, of the fields or of the file, bytes.
const MAX_DESCRIPTION: usize = 64 << 20;
/// Most batches of a file.
const MAX_BATCHES: usize = 1_000_000;
const NO_FIELDS: &str = "expected fields, found none";

/// Where a batch lies: its message, the bytes of its description, and those of its numbers.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    at: u64,
    described: usize,
    body: u64,
}

/// A file or a stream of batches.
pub(super) struct Arrow {
    file: Opened,
    arrays: Vec<Array>,
    columns: Vec<Column>,
    batches: Vec<Stretch>,
    /// First row of each batch, and the number of rows.
    starts: Vec<usize>,
    is_cut: bool,
}

impl Arrow {
    pub(super) fn open(mut file: Opened) -> Result<Self, String> {
        let length = file.length().map_err(|e| e.to_string())?;
        let mut start = [0; 6];
        read_at(&mut file, 0, &mut start)?;
        let (columns, batches, is_cut) = match start == MARK {
            true => of_file(&mut file, length).map(|(columns, batches)| (columns, batches, false))?,
            false => of_stream(&mut file, length)?,
        };
        let mut starts: Vec<usize> = vec![0];
        for stretch in &batches {
            let rows = Batch::read(&mut file, *stretch, None)?.rows();
            starts.push(starts[starts.len() - 1].checked_add(rows).ok_or("more rows than there can be")?);
        }
        let rows = starts[starts.len() - 1];
        let mut arrow = Arrow { file, arrays: Vec::new(), columns, batches, starts, is_cut };
        for k in 0..arrow.columns.len() {
            let column = &arrow.columns[k];
            let (name, holds) = (column.name.clone(), column.holds());
            let shape = match column.kept {
                Kept::Numbers(_) | Kept::Texts => vec![rows],
                Kept::Other => vec![rows, 0, 0],
                Kept::Lists { width: Some(width), .. } => vec![rows, width],
                Kept::Lists { width: None, .. } => vec![rows, arrow.first_length(k)?],
            };
            arrow.arrays.push(Array { name, shape, holds, entries: Vec::new() });
        }
        Ok(arrow)
    }

    /// Whether a stream ends within a batch: it has the rows before that.
    pub(super) fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Length of the first list of a column that has entries.
    fn first_length(&mut self, column: usize) -> Result<usize, String> {
        for k in 0..self.batches.len() {
            let batch = Batch::read(&mut self.file, self.batches[k], Some(&self.columns[column]))?;
            if let Some(width) = batch.first_length(&self.columns[column])? {
                return Ok(width);
            }
        }
        Ok(0)
    }
}

impl ArrayFile for Arrow {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, array: usize) -> Result<Values, String> {
        let rows = self.starts[self.starts.len() - 1];
        self.load_rows(array, 0..rows)
    }

    fn groups(&self) -> Option<Vec<usize>> {
        Some(self.starts.windows(2).map(|pair| pair[1] - pair[0]).collect())
    }

    fn load_rows(&mut self, array: usize, rows: Range<usize>) -> Result<Values, String> {
        let (column, width) = (&self.columns[array], self.arrays[array].shape.get(1).copied());
        if self.arrays[array].holds == Holds::Texts || matches!(column.kept, Kept::Other) {
            return Err(format!("column `{}`: expected numbers, found something else", column.name));
        }
        let mut values = Values::Whole(Vec::new());
        for (k, stretch) in self.batches.iter().enumerate() {
            let (first, end) = (self.starts[k], self.starts[k + 1]);
            let own = rows.start.clamp(first, end) - first..rows.end.clamp(first, end) - first;
            if own.is_empty() {
                continue;
            }
            let batch = Batch::read(&mut self.file, *stretch, Some(column))?;
            let read = batch.numbers(column, width.unwrap_or(1), own);
            values.append(read.map_err(|e| format!("column `{}`, batch {}: {e}", column.name, k + 1))?);
        }
        Ok(values)
    }
}

fn read_at(file: &mut Opened, at: u64, bytes: &mut [u8]) -> Result<(), String> {
    file.seek(SeekFrom::Start(at)).map_err(|e| e.to_string())?;
    file.read_exact(bytes).map_err(|_| format!("expected {} bytes at byte {at}, found the end", bytes.len()))
}

/// Bytes of a description, which is aligned as its reader needs.
fn description(file: &mut Opened, at: u64, length: usize) -> Result<Vec<u8>, String> {
    if length > MAX_DESCRIPTION {
        return Err(format!("expected a description of at most {MAX_DESCRIPTION} bytes, found {length}"));
    }
    file.seek(SeekFrom::Start(at)).map_err(|e| e.to_string())?;
    let mut bytes = Vec::new();
    file.take(length as u64).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    match bytes.len() == length {
        true => Ok(bytes),
        false => Err(format!("expected a description of {length} bytes at byte {at}, found {}", bytes.len())),
    }
}

fn of_schema(schema: SchemaRef<'_>) -> Result<Vec<Column>, String> {
    use polars_arrow_format::ipc::Endianness;
    if schema.endianness().map_err(wrong)? != Endianness::Little {
        return Err("expected numbers with their low byte first, found high bytes first".to_owned());
    }
    columns(schema.fields().map_err(wrong)?)
}

/// By the list at the end of a file.
fn of_file(file: &mut Opened, length: u64) -> Result<(Vec<Column>, Vec<Stretch>), String> {
    let mut end = [0; 10];
    read_at(file, length.checked_sub(10).ok_or("expected the end of a file, found none")?, &mut end)?;
    if !end.ends_with(MARK) {
        return Err("expected `ARROW1` at the end, found something else: the file is cut off".to_owned());
    }
    let size = u32::from_le_bytes([end[0], end[1], end[2], end[3]]) as usize;
    let at = (length - 10).checked_sub(size as u64).ok_or("expected a list of the batches, found none")?;
    let bytes = description(file, at, size)?;
    let footer = FooterRef::read_as_root(&bytes).map_err(wrong)?;
    let schema = footer.schema().map_err(wrong)?.ok_or(NO_FIELDS)?;
    let mut batches = Vec::new();
    for block in footer.record_batches().map_err(wrong)?.into_iter().flatten() {
        let whole = |x: i64| u64::try_from(x).map_err(|_| "expected a place within the file".to_owned());
        let described = usize::try_from(block.meta_data_length()).map_err(|e| e.to_string())?;
        batches.push(Stretch { at: whole(block.offset())?, described, body: whole(block.body_length())? });
        if batches.len() > MAX_BATCHES {
            return Err(format!("expected at most {MAX_BATCHES} batches, found more"));
        }
    }
    Ok((of_schema(schema)?, batches))
}

/// Message by message, and whether the last one is cut off. A stream may end with its last batch or with a mark behind it.
fn of_stream(file: &mut Opened, length: u64) -> Result<(Vec<Column>, Vec<Stretch>, bool), String> {
    let (mut at, mut columns, mut batches) = (0, None, Vec::new());
    while at < length {
        if at + 8 > length {
            return Ok((columns.ok_or(NO_FIELDS)?, batches, true));
        }
        let mut head = [0; 8];
        read_at(file, at, &mut head)?;
        let size = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        if head[..4] != CONTINUED {
            return Err(format!("expected a message at byte {at}, found something else"));
        }
        if size == 0 {
            break;
        }
        let described = size.saturating_add(8);
        if at + described as u64 > length {
            return Ok((columns.ok_or(NO_FIELDS)?, batches, true));
        }
        let bytes = description(file, at + 8, size)?;
        let message = MessageRef::read_as_root(&bytes).map_err(wrong)?;
        let body = u64::try_from(message.body_length().map_err(wrong)?).map_err(|e| e.to_string())?;
        let next = at.saturating_add(described as u64).saturating_add(body);
        if next > length {
            return Ok((columns.ok_or(NO_FIELDS)?, batches, true));
        }
        match message.header().map_err(wrong)? {
            Some(MessageHeaderRef::Schema(schema)) => columns = Some(of_schema(schema)?),
            Some(MessageHeaderRef::RecordBatch(_)) => batches.push(Stretch { at, described, body }),
            _ => {}
        }
        if batches.len() > MAX_BATCHES {
            return Err(format!("expected at most {MAX_BATCHES} batches, found more"));
        }
        at = next;
    }
    Ok((columns.ok_or(NO_FIELDS)?, batches, false))
}

fn wrong(error: planus::Error) -> String {
    format!("a description is damaged: {error}")
}
