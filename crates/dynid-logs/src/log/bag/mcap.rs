//! MCAP: topics with the definitions of their messages, and the messages, in compressed chunks.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use dynid_files::input::{self, Opened};
use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};

use super::file::{BagFile, End, RawMessage, Take, Topic, Waiting};

/// Largest chunk and record, bytes, compressed or not.
const MAX_RECORD: usize = 512 << 20;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK_INDEX: u8 = 0x08;
/// The last record of a file and the mark behind it, bytes.
const FOOTER: u64 = 1 + 8 + 20 + 8;
/// Channel, sequence number, time of receipt, time of publication.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

/// A file of a bag.
pub(super) struct Mcap {
    path: PathBuf,
    length: u64,
    topics: BTreeMap<u32, Topic>,
    /// Chunks with the channels that have messages in them; empty: the file has no index.
    chunks: Vec<Chunk>,
}

struct Chunk {
    start: u64,
    length: u64,
    channels: Vec<u32>,
}

/// A part of a file, first byte and the one behind the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stretch {
    start: u64,
    end: u64,
}

impl Mcap {
    /// Reads the index, or the whole file where there is none.
    pub(super) fn open(path: &Path) -> Result<(Self, End), String> {
        let mut opened = input::open(path).map_err(|e| e.to_string())?;
        let length = opened.length().map_err(|e| e.to_string())?;
        let mut file = Mcap { path: path.to_owned(), length, topics: BTreeMap::new(), chunks: Vec::new() };
        if let Some(start) = summary_start(&mut opened, length) {
            file.read_index(Stretch { start, end: length - FOOTER })?;
        }
        if !file.topics.is_empty() {
            return Ok((file, End::Whole));
        }
        file.chunks.clear();
        let mut topics = BTreeMap::new();
        let end = file.records(&[file.whole()], &mut |record| {
            if let Found::Topic(channel, topic) = record {
                topics.entry(channel).or_insert(topic);
            }
            ControlFlow::Continue(())
        })?;
        file.topics = topics;
        Ok((file, end))
    }

    /// Reads topics and places of chunks at the end of the file; what is broken there is not taken.
    fn read_index(&mut self, summary: Stretch) -> Result<(), String> {
        let (mut topics, mut chunks) = (BTreeMap::new(), Vec::new());
        let end = self.records(&[summary], &mut |record| {
            match record {
                Found::Topic(channel, topic) => {
                    topics.insert(channel, topic);
                }
                Found::Chunk(chunk) => chunks.push(chunk),
                Found::Message(_) => {}
            }
            ControlFlow::Continue(())
        })?;
        if end == End::Whole {
            chunks.sort_by_key(|c: &Chunk| c.start);
            (self.topics, self.chunks) = (topics, chunks);
        }
        Ok(())
    }

    fn whole(&self) -> Stretch {
        Stretch { start: 0, end: self.length }
    }

    /// Where messages of some channels lie: the chunks that have any, or the whole file.
    fn stretches(&self, wanted: impl Fn(u32) -> bool) -> Vec<Stretch> {
        if self.chunks.is_empty() {
            return vec![self.whole()];
        }
        let has = |c: &&Chunk| c.channels.is_empty() || c.channels.iter().any(|k| wanted(*k));
        let of = |c: &Chunk| Stretch { start: c.start, end: c.start.saturating_add(c.length) };
        self.chunks.iter().filter(has).map(of).collect()
    }

    /// Goes through the records of stretches of the file.
    fn records(
        &self,
        stretches: &[Stretch],
        take: &mut dyn FnMut(Found<'_>) -> ControlFlow<()>,
    ) -> Result<End, String> {
        let is_all = stretches == [self.whole()];
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(!is_all)
            .with_skip_end_magic(!is_all)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD);
        let mut reader = LinearReader::new_with_options(options);
        for added in [reader.add_decompressor(Inflated::zstd()), reader.add_decompressor(Inflated::lz4())] {
            added.map_err(|e| e.to_string())?;
        }
        let file = input::open(&self.path).map_err(|e| e.to_string())?;
        let mut source = Stretches { file, waiting: stretches.iter().rev().copied().collect(), left: 0 };
        let mut schemas: BTreeMap<u16, (String, String, String)> = BTreeMap::new();
        while let Some(event) = reader.next_event() {
            let event = match event {
                Ok(event) => event,
                Err(e) => return Ok(End::Broken(e.to_string())),
            };
            match event {
                LinearReadEvent::ReadRequest(count) => {
                    // A stretch at a time, in pieces: what a broken length asks for is not there.
                    let count = count.clamp(1, 1 << 20);
                    let read = source.read(reader.insert(count)).map_err(|e| e.to_string())?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { opcode, data } => {
                    let found = match found(opcode, data, &mut schemas) {
                        Ok(Some(found)) => found,
                        Ok(None) => continue,
                        Err(e) => return Ok(End::Broken(e)),
                    };
                    if take(found).is_break() {
                        return Ok(End::Whole);
                    }
                }
            }
        }
        Ok(End::Whole)
    }
}

impl BagFile for Mcap {
    fn topics(&self) -> &BTreeMap<u32, Topic> {
        &self.topics
    }

    fn messages(&self, channels: &[u32], take: Take<'_>) -> Result<End, String> {
        self.records(&self.stretches(|c| channels.contains(&c)), &mut |record| match record {
            Found::Message(message) if channels.contains(&message.channel) => take(message),
            _ => ControlFlow::Continue(()),
        })
    }

    fn first_messages(
        &self,
        channels: &[u32],
        enough: usize,
        take: &mut dyn FnMut(RawMessage<'_>),
    ) -> Result<End, String> {
        let mut waiting = Waiting::new(channels, enough);
        let mut end = End::Whole;
        for stretch in self.stretches(|c| channels.contains(&c)) {
            let chunk = self.chunks.iter().find(|c| c.start == stretch.start);
            if chunk.is_some_and(|c| !c.channels.is_empty() && !c.channels.iter().any(|k| waiting.wants(*k)))
            {
                continue;
            }
            let found = self.records(&[stretch], &mut |record| match record {
                Found::Message(message) => waiting.take(message, take),
                _ => ControlFlow::Continue(()),
            })?;
            if found != End::Whole {
                end = found;
            }
            if waiting.is_done() {
                break;
            }
        }
        Ok(end)
    }
}

/// A record that matters.
enum Found<'a> {
    Topic(u32, Topic),
    Chunk(Chunk),
    Message(RawMessage<'a>),
}

fn found<'a>(
    opcode: u8,
    data: &'a [u8],
    schemas: &mut BTreeMap<u16, (String, String, String)>,
) -> Result<Option<Found<'a>>, String> {
    match opcode {
        MESSAGE => {
            let header =
                data.get(..MESSAGE_HEADER).ok_or("expected a message, found less than its header")?;
            let channel = u16::from_le_bytes([header[0], header[1]]).into();
            let mut time = [0; 8];
            time.copy_from_slice(&header[6..14]);
            let received = i64::try_from(u64::from_le_bytes(time)).unwrap_or(i64::MAX);
            Ok(Some(Found::Message(RawMessage { channel, received, data: &data[MESSAGE_HEADER..] })))
        }
        SCHEMA => {
            let mut fields = Fields(data);
            let id = fields.number(2)? as u16;
            let (name, encoding) = (fields.text()?, fields.text()?);
            schemas.insert(id, (name, encoding, fields.text()?));
            Ok(None)
        }
        CHANNEL => {
            let mut fields = Fields(data);
            let (id, schema) = (fields.number(2)? as u32, fields.number(2)? as u16);
            let (name, encoding) = (fields.text()?, fields.text()?);
            let (kind, schema_encoding, schema) = schemas.get(&schema).cloned().unwrap_or_default();
            Ok(Some(Found::Topic(id, Topic { name, kind, encoding, schema_encoding, schema })))
        }
        CHUNK_INDEX => {
            let mut fields = Fields(data);
            // Times of the first and the last message.
            fields.take(16)?;
            let (start, length) = (fields.number(8)?, fields.number(8)?);
            let mut indices = Fields(fields.part()?);
            let mut channels = Vec::new();
            while !indices.0.is_empty() {
                channels.push(indices.number(2)? as u32);
                indices.take(8)?;
            }
            Ok(Some(Found::Chunk(Chunk { start, length, channels })))
        }
        _ => Ok(None),
    }
}

/// Fields of a record one behind the other. The library has types for records, which reserve what a length promises before they look for it.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (part, rest) =
            self.0.split_at_checked(count).ok_or("expected a field of a record, found its end")?;
        self.0 = rest;
        Ok(part)
    }

    fn number(&mut self, size: usize) -> Result<u64, String> {
        Ok(self.take(size)?.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
    }

    /// Bytes behind their length.
    fn part(&mut self) -> Result<&'a [u8], String> {
        let length = self.number(4)? as usize;
        self.take(length)
    }

    fn text(&mut self) -> Result<String, String> {
        Ok(String::from_utf8_lossy(self.part()?).into_owned())
    }
}

/// Where the summary of a file begins, if it has one.
fn summary_start(file: &mut Opened, length: u64) -> Option<u64> {
    let mut footer = [0; FOOTER as usize];
    file.seek(SeekFrom::Start(length.checked_sub(FOOTER)?)).ok()?;
    file.read_exact(&mut footer).ok()?;
    let mut fields = Fields(&footer);
    let is_footer = fields.number(1) == Ok(2) && fields.number(8) == Ok(20);
    let start = fields.number(8).ok()?;
    (is_footer && footer.ends_with(mcap::MAGIC) && start > 0 && start < length - FOOTER).then_some(start)
}

/// Stretches of a file one behind the other.
struct Stretches {
    file: Opened,
    /// Those that were not begun, the last one first.
    waiting: Vec<Stretch>,
    left: u64,
}

impl Read for Stretches {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.left == 0 {
            let Some(range) = self.waiting.pop() else { return Ok(0) };
            self.file.seek(SeekFrom::Start(range.start))?;
            self.left = range.end.saturating_sub(range.start);
        }
        let most = usize::try_from(self.left).unwrap_or(usize::MAX).min(buffer.len());
        let read = self.file.read(&mut buffer[..most])?;
        self.left -= read as u64;
        Ok(read)
    }
}

/// Decompresses chunks whole: they are a few megabytes long.
struct Inflated {
    name: &'static str,
    inflate: fn(&[u8], &mut Vec<u8>) -> io::Result<()>,
    out: Vec<u8>,
    at: usize,
}

impl Inflated {
    fn zstd() -> Self {
        Inflated { name: "zstd", inflate: inflate_zstd, out: Vec::new(), at: 0 }
    }

    fn lz4() -> Self {
        Inflated { name: "lz4", inflate: inflate_lz4, out: Vec::new(), at: 0 }
    }
}

fn inflate_zstd(mut bytes: &[u8], out: &mut Vec<u8>) -> io::Result<()> {
    while !bytes.is_empty() && out.len() <= MAX_RECORD {
        let left = (MAX_RECORD + 1 - out.len()) as u64;
        let decoder = ruzstd::decoding::StreamingDecoder::new(&mut bytes).map_err(io::Error::other)?;
        decoder.take(left).read_to_end(out)?;
    }
    Ok(())
}

fn inflate_lz4(bytes: &[u8], out: &mut Vec<u8>) -> io::Result<()> {
    lz4_flex::frame::FrameDecoder::new(bytes).take(MAX_RECORD as u64 + 1).read_to_end(out).map(|_| ())
}

impl Decompressor for Inflated {
    fn next_read_size(&self) -> usize {
        if self.out.is_empty() { usize::MAX } else { 0 }
    }

    fn decompress(&mut self, source: &[u8], target: &mut [u8]) -> McapResult<DecompressResult> {
        let mut consumed = 0;
        if self.out.is_empty() {
            (self.inflate)(source, &mut self.out)?;
            if self.out.len() > MAX_RECORD {
                let reason = format!("expected a chunk of at most {MAX_RECORD} bytes, found more");
                return Err(McapError::DecompressionError(reason));
            }
            consumed = source.len();
        }
        let wrote = target.len().min(self.out.len() - self.at);
        target[..wrote].copy_from_slice(&self.out[self.at..self.at + wrote]);
        self.at += wrote;
        Ok(DecompressResult { consumed, wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        self.out.clear();
        self.at = 0;
        Ok(())
    }

    fn name(&self) -> &'static str {
        self.name
    }
}
