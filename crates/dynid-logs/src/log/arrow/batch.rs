//! Rows of a table that lie together: their buffers, decompressed, and the numbers in them.

use std::ops::Range;

use dynid_files::input::Opened;
use planus::ReadAsRoot;
use polars_arrow_format::ipc::{CompressionType, MessageHeaderRef, MessageRef, RecordBatchRef};

use super::fields::{Column, Kept, Numbers, Offsets};
use super::{Stretch, description, read_at, wrong};
use crate::log::arrays::Values;
use crate::log::binary::{self, Kind};
use crate::log::inflate;

/// Largest buffer, bytes.
const MAX_BUFFER: usize = 1 << 30;
/// Bytes before a message: a mark and the size of its description.
const HEAD: u64 = 8;

/// A batch, with the buffers of one column.
pub(super) struct Batch {
    rows: usize,
    /// Numbers of values per node.
    lengths: Vec<usize>,
    /// Buffers by the places that fields give them.
    buffers: Vec<(usize, Vec<u8>)>,
}

impl Batch {
    /// Reads what a batch says of itself, and the buffers of a column.
    pub(super) fn read(file: &mut Opened, at: Stretch, column: Option<&Column>) -> Result<Self, String> {
        let size = at.described.checked_sub(HEAD as usize).ok_or("expected a description, found none")?;
        let bytes = description(file, at.at.saturating_add(HEAD), size)?;
        let message = MessageRef::read_as_root(&bytes).map_err(wrong)?;
        let Some(MessageHeaderRef::RecordBatch(batch)) = message.header().map_err(wrong)? else {
            return Err("expected a batch of rows, found another message".to_owned());
        };
        let rows = usize::try_from(batch.length().map_err(wrong)?).map_err(|e| e.to_string())?;
        let mut lengths = Vec::new();
        for node in batch.nodes().map_err(wrong)?.into_iter().flatten() {
            lengths.push(usize::try_from(node.length()).map_err(|e| e.to_string())?);
        }
        let mut buffers = Vec::new();
        if let Some(column) = column {
            let before = more_buffers(&batch, column.views)?;
            for place in buffers_of(column.kept) {
                buffers.push((place, buffer(file, at, &batch, place.saturating_add(before))?));
            }
        }
        Ok(Batch { rows, lengths, buffers })
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    fn buffer(&self, place: usize) -> Result<&[u8], String> {
        let found = self.buffers.iter().find(|(own, _)| *own == place);
        found.map(|(_, bytes)| bytes.as_slice()).ok_or_else(|| "expected a buffer, found none".to_owned())
    }

    /// Whether a value is there: all are where no bits say so.
    fn is_there(&self, valid: usize, k: usize) -> Result<bool, String> {
        let bits = self.buffer(valid)?;
        Ok(bits.is_empty() || bits.get(k / 8).is_some_and(|byte| byte >> (k % 8) & 1 == 1))
    }

    /// Where the list of a row begins, and where it ends.
    fn list(&self, offsets: Offsets, row: usize) -> Result<Range<usize>, String> {
        let bytes = self.buffer(offsets.buffer)?;
        let offset = |k: usize| {
            let size = if offsets.long { 8 } else { 4 };
            let own =
                bytes.get(k * size..(k + 1) * size).ok_or("expected where a list begins, found the end")?;
            let mut word = [0; 8];
            word[..size].copy_from_slice(own);
            usize::try_from(u64::from_le_bytes(word)).map_err(|e| e.to_string())
        };
        let (start, end) = (offset(row)?, offset(row + 1)?);
        if end < start {
            return Err(format!("row {}: expected a list, found its end before its beginning", row + 1));
        }
        Ok(start..end)
    }

    /// Length of the first list that has entries.
    pub(super) fn first_length(&self, column: &Column) -> Result<Option<usize>, String> {
        let Kept::Lists { offsets: Some(offsets), valid, inner, .. } = column.kept else { return Ok(None) };
        for row in 0..self.rows {
            let own = self.list(offsets, row)?;
            if !own.is_empty() && self.is_there(valid, row)? {
                // As many numbers as it promises are there.
                self.plain(inner, own.clone())?;
                return Ok(Some(own.len()));
            }
        }
        Ok(None)
    }

    /// Numbers of some rows; of lists those of `width` entries each.
    pub(super) fn numbers(
        &self,
        column: &Column,
        width: usize,
        rows: Range<usize>,
    ) -> Result<Values, String> {
        if rows.end > self.rows {
            return Err(format!("expected {} rows, found {}", rows.end, self.rows));
        }
        match column.kept {
            Kept::Numbers(numbers) => self.plain(numbers, rows),
            Kept::Lists { valid, offsets, inner, .. } => {
                let Some(offsets) = offsets else {
                    let inside = rows.start.saturating_mul(width)..rows.end.saturating_mul(width);
                    let mut values = self.plain(inner, inside)?;
                    for (k, row) in rows.enumerate() {
                        if !self.is_there(valid, row)? {
                            values.lose(k * width..(k + 1) * width);
                        }
                    }
                    return Ok(values);
                };
                let mut values = Values::Whole(Vec::new());
                let mut lost = Vec::new();
                let mut run: Option<Range<usize>> = None;
                for (k, row) in rows.enumerate() {
                    let own = self.list(offsets, row)?;
                    if !self.is_there(valid, row)? || own.is_empty() {
                        // A list that is not there has no value of any of its entries.
                        values.append(
                            run.take().map_or(Ok(Values::Whole(Vec::new())), |run| self.plain(inner, run))?,
                        );
                        values.append(Values::Whole(vec![0; width]));
                        lost.push(k);
                        continue;
                    }
                    if own.len() != width {
                        let found = own.len();
                        return Err(format!(
                            "row {}: expected a list of {width} numbers, found {found}",
                            row + 1
                        ));
                    }
                    run = match run {
                        Some(run) if run.end == own.start => Some(run.start..own.end),
                        Some(run) => {
                            values.append(self.plain(inner, run)?);
                            Some(own)
                        }
                        None => Some(own),
                    };
                }
                if let Some(run) = run {
                    values.append(self.plain(inner, run)?);
                }
                lost.into_iter().for_each(|k| values.lose(k * width..(k + 1) * width));
                Ok(values)
            }
            Kept::Texts | Kept::Other => Err("expected numbers, found something else".to_owned()),
        }
    }

    /// Numbers of a field by their places.
    fn plain(&self, numbers: Numbers, places: Range<usize>) -> Result<Values, String> {
        let Numbers { kind, node, valid } = numbers;
        let length = self.lengths.get(node).copied().unwrap_or(0);
        if places.end > length {
            return Err(format!("expected {} numbers, found {length}", places.end));
        }
        let bytes = self.buffer(valid + 1)?;
        let short = || format!("expected {} numbers, found {} bytes", places.end, bytes.len());
        let mut values = match kind {
            Kind::Bool => {
                let bit =
                    |k: usize| bytes.get(k / 8).map(|byte| i64::from(byte >> (k % 8) & 1)).ok_or_else(short);
                Values::Whole(places.clone().map(bit).collect::<Result<_, _>>()?)
            }
            _ => {
                let kept = binary::Numbers { kind, big_endian: false };
                let size = kept.size();
                let own = bytes.get(places.start.saturating_mul(size)..places.end.saturating_mul(size));
                kept.read(&mut own.ok_or_else(short)?, places.len())?
            }
        };
        for (k, place) in places.enumerate() {
            if !self.is_there(valid, place)? {
                values.lose(k..k + 1);
            }
        }
        Ok(values)
    }
}

/// Buffers that the first columns of texts have besides the two counted for each.
fn more_buffers(batch: &RecordBatchRef<'_>, views: usize) -> Result<usize, String> {
    if views == 0 {
        return Ok(0);
    }
    let counts: Vec<i64> = batch.variadic_buffer_counts().map_err(wrong)?.into_iter().flatten().collect();
    let own = counts.get(..views).ok_or("expected numbers of buffers of texts, found too few")?;
    let add = |sum: usize, count: &i64| usize::try_from(*count).ok().and_then(|count| sum.checked_add(count));
    own.iter().try_fold(0, add).ok_or_else(|| "expected numbers of buffers, found others".to_owned())
}

/// Places of the buffers of a column.
fn buffers_of(kept: Kept) -> Vec<usize> {
    let of_numbers = |numbers: Numbers| [numbers.valid, numbers.valid + 1];
    match kept {
        Kept::Numbers(numbers) => of_numbers(numbers).to_vec(),
        Kept::Lists { valid, offsets, inner, .. } => {
            let own = [Some(valid), offsets.map(|offsets| offsets.buffer)];
            own.into_iter().flatten().chain(of_numbers(inner)).collect()
        }
        Kept::Texts | Kept::Other => Vec::new(),
    }
}

/// Bytes of a buffer, decompressed.
fn buffer(
    file: &mut Opened,
    at: Stretch,
    batch: &RecordBatchRef<'_>,
    place: usize,
) -> Result<Vec<u8>, String> {
    let all = batch.buffers().map_err(wrong)?;
    let found = all.and_then(|all| all.get(place)).ok_or("expected a buffer, found none")?;
    let whole = |x: i64| u64::try_from(x).map_err(|_| "expected a buffer within its batch".to_owned());
    let (offset, length) = (whole(found.offset())?, whole(found.length())?);
    if offset.saturating_add(length) > at.body || length > MAX_BUFFER as u64 {
        return Err("expected a buffer within its batch, found one beyond it".to_owned());
    }
    // What a description promises is read only as far as the file goes.
    let start = at.at.saturating_add(at.described as u64).saturating_add(offset);
    let stated = file.length().map_err(|e| e.to_string())?;
    if start.saturating_add(length) > stated {
        return Err("expected a buffer within the file, found its end".to_owned());
    }
    let mut bytes = vec![0; length as usize];
    read_at(file, start, &mut bytes)?;
    let Some(compression) = batch.compression().map_err(wrong)? else { return Ok(bytes) };
    let Some((head, rest)) = bytes.split_first_chunk::<8>() else { return Ok(Vec::new()) };
    let size = i64::from_le_bytes(*head);
    if size == -1 {
        return Ok(rest.to_vec());
    }
    let size = usize::try_from(size).unwrap_or(usize::MAX);
    if size > MAX_BUFFER {
        return Err(format!("expected a buffer of at most {MAX_BUFFER} bytes, found one of {size}"));
    }
    let mut out = Vec::new();
    match compression.codec().map_err(wrong)? {
        CompressionType::Lz4Frame => inflate::lz4(rest, size, &mut out),
        CompressionType::Zstd => inflate::zstd(rest, size, &mut out),
    }
    .map_err(|e| e.to_string())?;
    match out.len() == size {
        true => Ok(out),
        false => Err(format!("expected a buffer of {size} bytes, found {}", out.len())),
    }
}
