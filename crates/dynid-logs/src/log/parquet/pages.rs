//! Pages of a column: their headers, and what they hold, decompressed.
//!
//! The library that decodes pages can read them itself; its own reader needs C for zstd, and trusts headers.

use std::io::Read;

use bytes::Bytes;
use flate2::read::MultiGzDecoder;
use parquet::basic::{Compression, Encoding, Type};
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use parquet::schema::types::ColumnDescriptor;

use crate::log::inflate;

/// Largest page, bytes.
const MAX_PAGE: usize = 1 << 30;
/// The encoding of pages whose numbers are split into streams of bytes.
const SPLIT: i64 = 9;
/// Deepest nesting of a header.
const MAX_DEPTH: usize = 8;

/// The pages of a column in a group of rows.
pub(super) struct Pages {
    bytes: Bytes,
    at: usize,
    compression: Compression,
    /// The page that is next, if its header was read: the header, and where its bytes begin.
    next: Option<(Header, usize)>,
    /// Bytes of a number, and whether pages of the first version begin with levels of repetition and of definition.
    size: usize,
    levels: [bool; 2],
    /// Whether a dictionary came before: pages that refer to one need it.
    has_dictionary: bool,
}

impl Pages {
    /// `bytes`: all pages of the column that is described.
    pub(super) fn new(bytes: Bytes, compression: Compression, column: &ColumnDescriptor) -> Self {
        let size = match column.physical_type() {
            Type::INT32 | Type::FLOAT => 4,
            _ => 8,
        };
        let levels = [column.max_rep_level() > 0, column.max_def_level() > 0];
        Pages { bytes, at: 0, compression, next: None, size, levels, has_dictionary: false }
    }

    /// A page whose numbers are split into streams of first bytes, second bytes, and so on, with its numbers one behind the other. `start`:
    /// where they begin. The library takes for granted that there are as many as it needs.
    fn joined(&self, page: &[u8], start: usize) -> Result<Vec<u8>> {
        let values =
            page.get(start..).ok_or_else(|| wrong("expected numbers in a page, found its end".to_owned()))?;
        let count = values.len() / self.size;
        if count * self.size != values.len() {
            return Err(wrong(format!(
                "expected streams of one length in a page, found {} bytes",
                values.len()
            )));
        }
        let mut out = page[..start].to_vec();
        out.extend((0..count).flat_map(|k| (0..self.size).map(move |byte| values[byte * count + k])));
        Ok(out)
    }

    /// Where the numbers of a page of the first version begin.
    fn behind_levels(&self, page: &[u8]) -> usize {
        let mut at = 0;
        for _ in self.levels.iter().filter(|there| **there) {
            let length =
                page.get(at..at + 4).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
            at = at.saturating_add(4).saturating_add(length);
        }
        at
    }

    /// The header of the next page that holds data or a dictionary.
    fn peek(&mut self) -> Result<Option<(Header, usize)>> {
        while self.next.is_none() && self.at < self.bytes.len() {
            let mut reader = Compact { bytes: &self.bytes, at: self.at };
            let header = Header::read(&mut reader)?;
            let end = reader.at.checked_add(header.compressed).filter(|end| *end <= self.bytes.len());
            if end.is_none() {
                return Err(wrong(format!(
                    "expected a page of {} bytes, found the end of its column",
                    header.compressed
                )));
            }
            match header.kind {
                // Indices of pages are of no use here.
                Kind::Other => self.at = reader.at + header.compressed,
                _ => self.next = Some((header, reader.at)),
            }
        }
        Ok(self.next.clone())
    }

    fn pass(&mut self) {
        if let Some((header, start)) = self.next.take() {
            self.at = start + header.compressed;
        }
    }

    fn inflate(&self, bytes: &[u8], size: usize) -> Result<Vec<u8>> {
        let mut out = Vec::new();
        let failed = |e: std::io::Error| wrong(e.to_string());
        match self.compression {
            Compression::UNCOMPRESSED => out.extend(bytes),
            Compression::SNAPPY => {
                if snap::raw::decompress_len(bytes).map_err(|e| wrong(e.to_string()))? != size {
                    return Err(wrong("expected a page of the size in its header, found another".to_owned()));
                }
                out = snap::raw::Decoder::new().decompress_vec(bytes).map_err(|e| wrong(e.to_string()))?;
            }
            Compression::GZIP(_) => {
                MultiGzDecoder::new(bytes).take(size as u64 + 1).read_to_end(&mut out).map_err(failed)?;
            }
            Compression::LZ4_RAW => {
                // What the header promises is reserved at once: no codec of this kind reaches more.
                if size / 256 > bytes.len() {
                    return Err(wrong("expected a page compressed at most 256:1, found more".to_owned()));
                }
                out = lz4_flex::block::decompress(bytes, size).map_err(|e| wrong(e.to_string()))?;
            }
            Compression::ZSTD(_) => {
                inflate::zstd(bytes, size, &mut out).map_err(failed)?;
            }
            other => {
                let what = "expected pages as they are or in snappy, gzip, LZ4_RAW or zstd";
                return Err(wrong(format!("{what}, found {other:?}")));
            }
        }
        if out.len() == size {
            return Ok(out);
        }
        Err(wrong(format!("expected a page of {size} bytes, found {}", out.len())))
    }
}

fn wrong(reason: String) -> ParquetError {
    ParquetError::General(reason)
}

fn encoding(number: i64) -> Result<Encoding> {
    Ok(match number {
        0 => Encoding::PLAIN,
        2 => Encoding::PLAIN_DICTIONARY,
        3 => Encoding::RLE,
        5 => Encoding::DELTA_BINARY_PACKED,
        6 => Encoding::DELTA_LENGTH_BYTE_ARRAY,
        7 => Encoding::DELTA_BYTE_ARRAY,
        8 => Encoding::RLE_DICTIONARY,
        _ => return Err(wrong(format!("expected an encoding of pages, found the number {number}"))),
    })
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let Some((header, start)) = self.peek()? else { return Ok(None) };
        let bytes = self.bytes.slice(start..start + header.compressed);
        self.pass();
        let whole = |pages: &Self| pages.inflate(&bytes, header.uncompressed).map(Bytes::from);
        let refers = matches!(header.encoding, 2 | 8) && !matches!(header.kind, Kind::Dictionary { .. });
        if refers && !self.has_dictionary {
            return Err(wrong("expected a dictionary before pages that refer to it, found none".to_owned()));
        }
        self.has_dictionary |= matches!(header.kind, Kind::Dictionary { .. });
        let values = u32::try_from(header.values).map_err(|e| wrong(e.to_string()))?;
        let is_split = header.encoding == SPLIT;
        let own_encoding = encoding(if is_split { 0 } else { header.encoding });
        Ok(Some(match header.kind {
            Kind::Data { definitions, repetitions } => Page::DataPage {
                buf: match is_split {
                    true => {
                        let page = whole(self)?;
                        self.joined(&page, self.behind_levels(&page))?.into()
                    }
                    false => whole(self)?,
                },
                num_values: values,
                encoding: own_encoding?,
                def_level_encoding: encoding(definitions)?,
                rep_level_encoding: encoding(repetitions)?,
                statistics: None,
            },
            Kind::Dictionary { sorted } => Page::DictionaryPage {
                buf: whole(self)?,
                num_values: values,
                encoding: encoding(header.encoding)?,
                is_sorted: sorted,
            },
            Kind::DataV2 { nulls, rows, definitions, repetitions, compressed } => {
                // Levels stand in front as they are.
                let levels = definitions
                    .checked_add(repetitions)
                    .filter(|n| *n <= bytes.len() && *n <= header.uncompressed);
                let levels = levels
                    .ok_or_else(|| wrong("expected levels within their page, found more".to_owned()))?;
                let mut out = bytes[..levels].to_vec();
                match compressed && bytes.len() > levels {
                    true => out.extend(self.inflate(&bytes[levels..], header.uncompressed - levels)?),
                    false => out.extend(&bytes[levels..]),
                }
                if is_split {
                    out = self.joined(&out, levels)?;
                }
                Page::DataPageV2 {
                    buf: out.into(),
                    num_values: values,
                    encoding: own_encoding?,
                    num_nulls: nulls,
                    num_rows: rows,
                    def_levels_byte_len: definitions as u32,
                    rep_levels_byte_len: repetitions as u32,
                    is_compressed: false,
                    statistics: None,
                }
            }
            Kind::Other => return Ok(None),
        }))
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        let metadata = |(header, _): (Header, usize)| PageMetadata {
            num_rows: match header.kind {
                Kind::DataV2 { rows, .. } => Some(rows as usize),
                _ => None,
            },
            num_levels: match header.kind {
                Kind::Dictionary { .. } => None,
                _ => Some(header.values),
            },
            is_dict: matches!(header.kind, Kind::Dictionary { .. }),
        };
        Ok(self.peek()?.map(metadata))
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.peek()?;
        self.pass();
        Ok(())
    }
}

impl Iterator for Pages {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

/// What stands in front of a page.
#[derive(Clone, Debug)]
struct Header {
    compressed: usize,
    uncompressed: usize,
    values: usize,
    encoding: i64,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Data { definitions: i64, repetitions: i64 },
    DataV2 { nulls: u32, rows: u32, definitions: usize, repetitions: usize, compressed: bool },
    Dictionary { sorted: bool },
    Other,
}

impl Header {
    fn read(reader: &mut Compact<'_>) -> Result<Self> {
        let (mut kind, mut uncompressed, mut compressed) = (-1, -1, -1);
        // Of the header that belongs to the kind of the page: its numbers by their fields.
        let mut inner = [None; 16];
        reader.fields(0, &mut |reader, field, kind_of| {
            match field {
                1 => kind = reader.number(kind_of)?,
                2 => uncompressed = reader.number(kind_of)?,
                3 => compressed = reader.number(kind_of)?,
                5 | 7 | 8 if kind_of == STRUCT => {
                    return reader.fields(1, &mut |reader, field, kind_of| match (field, kind_of) {
                        (1..=7, TRUE | FALSE | I16..=I64) => {
                            inner[field] = Some(reader.number(kind_of)?);
                            Ok(())
                        }
                        _ => reader.skip(kind_of, 2),
                    });
                }
                _ => return reader.skip(kind_of, 1),
            }
            Ok(())
        })?;
        let size = |n: i64, what: &str| {
            let size = usize::try_from(n).ok().filter(|n| *n <= MAX_PAGE);
            size.ok_or_else(|| wrong(format!("expected {what} of a page up to {MAX_PAGE}, found {n}")))
        };
        let need = |field: usize| {
            inner[field]
                .ok_or_else(|| wrong(format!("expected field {field} in the header of a page, found none")))
        };
        let count = |field: usize| need(field).and_then(|n| size(n, "a number"));
        let kind = match kind {
            0 => Kind::Data { definitions: need(3)?, repetitions: need(4)? },
            2 => Kind::Dictionary { sorted: inner[3] == Some(1) },
            3 => Kind::DataV2 {
                nulls: count(2)? as u32,
                rows: count(3)? as u32,
                definitions: count(5)?,
                repetitions: count(6)?,
                compressed: inner[7] != Some(0),
            },
            _ => Kind::Other,
        };
        let is_page = !matches!(kind, Kind::Other);
        // The encoding is the second field but of pages of the second version.
        let place = if matches!(kind, Kind::DataV2 { .. }) { 4 } else { 2 };
        Ok(Header {
            compressed: size(compressed, "the size")?,
            uncompressed: size(uncompressed, "the size")?,
            values: if is_page { count(1)? } else { 0 },
            encoding: if is_page { need(place)? } else { 0 },
            kind,
        })
    }
}

const TRUE: u8 = 1;
const FALSE: u8 = 2;
const I16: u8 = 4;
const I64: u8 = 6;
const STRUCT: u8 = 12;

/// The compact protocol of Thrift.
struct Compact<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Compact<'_> {
    fn byte(&mut self) -> Result<u8> {
        let byte = self.bytes.get(self.at).copied();
        self.at += 1;
        byte.ok_or_else(|| wrong("expected the header of a page, found the end of its column".to_owned()))
    }

    fn varint(&mut self) -> Result<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(wrong("expected a number of at most ten bytes, found more".to_owned()))
    }

    fn zigzag(&mut self) -> Result<i64> {
        let n = self.varint()?;
        Ok((n >> 1) as i64 ^ -((n & 1) as i64))
    }

    /// A number of a kind; of truth values, 1 or 0.
    fn number(&mut self, kind: u8) -> Result<i64> {
        match kind {
            TRUE => Ok(1),
            FALSE => Ok(0),
            I16..=I64 => self.zigzag(),
            _ => {
                Err(wrong(format!("expected a number in the header of a page, found a value of kind {kind}")))
            }
        }
    }

    /// Hands over the fields of a structure; each has to be read or skipped.
    fn fields(
        &mut self,
        depth: usize,
        take: &mut dyn FnMut(&mut Self, usize, u8) -> Result<()>,
    ) -> Result<()> {
        if depth > MAX_DEPTH {
            return Err(wrong("expected a header of a page, found structures in structures".to_owned()));
        }
        let mut field = 0_i64;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Ok(());
            }
            field = match head >> 4 {
                0 => self.zigzag()?,
                step => field.saturating_add(i64::from(step)),
            };
            take(self, usize::try_from(field).unwrap_or(usize::MAX), head & 0x0f)?;
        }
    }

    fn skip(&mut self, kind: u8, depth: usize) -> Result<()> {
        match kind {
            TRUE | FALSE => {}
            3 => self.at += 1,
            I16..=I64 => {
                self.varint()?;
            }
            7 => self.at += 8,
            8 => {
                let length = self.varint()?;
                self.at = self.at.saturating_add(usize::try_from(length).unwrap_or(usize::MAX));
            }
            9 | 10 => {
                let head = self.byte()?;
                let length = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
                for _ in 0..length {
                    // Truth values in lists take a byte.
                    match head & 0x0f {
                        TRUE | FALSE => self.at += 1,
                        kind => self.skip(kind, depth + 1)?,
                    }
                    if self.at > self.bytes.len() {
                        break;
                    }
                }
            }
            STRUCT => return self.fields(depth, &mut |reader, _, kind| reader.skip(kind, depth + 1)),
            _ => return Err(wrong(format!("expected the header of a page, found a value of kind {kind}"))),
        }
        if self.at > self.bytes.len() {
            return Err(wrong("expected the header of a page, found the end of its column".to_owned()));
        }
        Ok(())
    }
}
