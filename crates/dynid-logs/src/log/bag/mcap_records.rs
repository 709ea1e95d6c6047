//! Records of an MCAP one behind the other, those in chunks among them.

use std::io::Read;
use std::ops::ControlFlow;

use mcap::MAGIC;

use super::file::End;
use crate::log::inflate;

/// Largest chunk and record, bytes, compressed or not.
const MAX_RECORD: usize = 512 << 20;
/// Kind and length of a record.
const HEAD: usize = 1 + 8;
const FOOTER: u8 = 0x02;
const CHUNK: u8 = 0x06;

/// What a record's kind and bytes are handed to.
type Take<'a> = &'a mut dyn FnMut(u8, &[u8]) -> Result<ControlFlow<()>, String>;

/// Goes through the records of a file from its first byte (`is_whole`), or of parts of one. Chunks are handed over as the records in them; of one
/// that was cut off and is not compressed, those that are whole.
///
/// # Errors
/// The operating system's. A broken file is an [`End`].
pub(super) fn walk(mut source: impl Read, is_whole: bool, take: Take<'_>) -> Result<End, String> {
    let broken = |reason: &str| Ok(End::Broken(reason.to_owned()));
    let (mut data, mut inflated) = (Vec::new(), Vec::new());
    if is_whole {
        read(&mut source, MAGIC.len() as u64, &mut data)?;
        if data != MAGIC {
            return broken("expected the mark of an MCAP, found something else");
        }
    }
    loop {
        read(&mut source, HEAD as u64, &mut data)?;
        let (opcode, length) = match head(&data) {
            Some(head) => head,
            // Parts end with a record; a file with its footer.
            None if data.is_empty() && !is_whole => return Ok(End::Whole),
            None => return broken("expected a record, found the end: the file is cut off"),
        };
        if length > MAX_RECORD as u64 {
            return broken(&format!(
                "expected a record of at most {MAX_RECORD} bytes, found one of {length}"
            ));
        }
        read(&mut source, length, &mut data)?;
        let is_cut = (data.len() as u64) < length;
        let outcome = match opcode {
            FOOTER => return Ok(End::Whole),
            CHUNK => records_of(&data, is_cut, &mut inflated).and_then(|records| each(records, take)),
            _ if is_cut => Ok(ControlFlow::Continue(())),
            _ => take(opcode, &data),
        };
        match outcome {
            Ok(ControlFlow::Continue(())) if is_cut => {
                return broken("expected more bytes of a record: the file is cut off");
            }
            Ok(ControlFlow::Continue(())) => {}
            Ok(ControlFlow::Break(())) => return Ok(End::Whole),
            Err(reason) => return Ok(End::Broken(reason)),
        }
    }
}

/// Reads so many bytes, or as many as there are: what a broken length promises is not reserved.
fn read(source: &mut impl Read, count: u64, data: &mut Vec<u8>) -> Result<(), String> {
    data.clear();
    source.take(count).read_to_end(data).map(|_| ()).map_err(|e| e.to_string())
}

fn head(data: &[u8]) -> Option<(u8, u64)> {
    let (opcode, length) = data.split_first()?;
    Some((*opcode, u64::from_le_bytes(length.first_chunk().copied()?)))
}

/// Bytes of the records of a chunk.
fn records_of<'a>(chunk: &'a [u8], is_cut: bool, inflated: &'a mut Vec<u8>) -> Result<&'a [u8], String> {
    let mut fields = Fields(chunk);
    // Times of the first and the last message.
    fields.take(16)?;
    let (size, checksum, compression) = (fields.number(8)?, fields.number(4)? as u32, fields.part()?);
    let length = fields.number(8)?;
    let records = match usize::try_from(length).ok().and_then(|length| fields.0.get(..length)) {
        Some(records) => records,
        None if is_cut && compression.is_empty() => return Ok(fields.0),
        None => return Err("expected the records of a chunk, found its end".to_owned()),
    };
    let records = match compression {
        b"" => records,
        b"lz4" | b"zstd" => {
            inflated.clear();
            let inflate = if compression == b"lz4" { inflate::lz4 } else { inflate::zstd };
            inflate(records, MAX_RECORD, inflated).map_err(|e| e.to_string())?;
            inflated.as_slice()
        }
        other => {
            let found = String::from_utf8_lossy(other);
            return Err(format!("expected chunks as they are, in lz4 or zstd, found `{found}`"));
        }
    };
    if records.len() as u64 != size {
        return Err(format!("expected a chunk of {size} bytes, found {}", records.len()));
    }
    // Zero: the writer did not form one.
    if checksum != 0 && crc32fast::hash(records) != checksum {
        return Err("the checksum of a chunk is not that of its bytes".to_owned());
    }
    Ok(records)
}

/// Hands the records of a chunk over.
fn each(mut records: &[u8], take: Take<'_>) -> Result<ControlFlow<()>, String> {
    while let Some((opcode, length)) = head(records) {
        let behind = &records[HEAD..];
        let Some(length) = usize::try_from(length).ok().filter(|length| *length <= behind.len()) else {
            break;
        };
        let (data, rest) = behind.split_at(length);
        if take(opcode, data)?.is_break() {
            return Ok(ControlFlow::Break(()));
        }
        records = rest;
    }
    match records.is_empty() {
        true => Ok(ControlFlow::Continue(())),
        false => Err("expected a record in a chunk, found its end".to_owned()),
    }
}

/// Fields of a record one behind the other.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (part, rest) =
            self.0.split_at_checked(count).ok_or("expected a field of a record, found its end")?;
        self.0 = rest;
        Ok(part)
    }

    pub(super) fn number(&mut self, size: usize) -> Result<u64, String> {
        Ok(self.take(size)?.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
    }

    /// Bytes behind their length.
    pub(super) fn part(&mut self) -> Result<&'a [u8], String> {
        let length = self.number(4)? as usize;
        self.take(length)
    }

    pub(super) fn text(&mut self) -> Result<String, String> {
        Ok(String::from_utf8_lossy(self.part()?).into_owned())
    }
}
