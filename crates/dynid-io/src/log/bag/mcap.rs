//! MCAP: topics with the definitions of their messages, and the messages, in compressed chunks.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::{ChunkIndex, Record};
use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{McapError, McapResult, Summary};

use super::file::{BagFile, End, RawMessage, Take, Topic, Waiting};
use crate::input::{self, Opened};

/// Largest chunk and record, bytes, compressed or not.
const MAX_RECORD: usize = 512 << 20;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
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
        if let Ok(Some(summary)) = summary_of(&mut opened, length)
            && !summary.channels.is_empty()
        {
            file.take_summary(&summary);
            return Ok((file, End::Whole));
        }
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

    fn take_summary(&mut self, summary: &Summary) {
        for (id, channel) in &summary.channels {
            let schema = channel.schema.as_ref();
            let text = |of: fn(&mcap::Schema<'_>) -> String| schema.map_or_else(String::new, |s| of(s));
            let topic = Topic {
                name: channel.topic.clone(),
                kind: text(|s| s.name.clone()),
                encoding: channel.message_encoding.clone(),
                schema_encoding: text(|s| s.encoding.clone()),
                schema: text(|s| String::from_utf8_lossy(&s.data).into_owned()),
            };
            self.topics.insert(u32::from(*id), topic);
        }
        let chunk = |index: &ChunkIndex| Chunk {
            start: index.chunk_start_offset,
            length: index.chunk_length,
            channels: index.message_index_offsets.keys().map(|c| u32::from(*c)).collect(),
        };
        self.chunks = summary.chunk_indexes.iter().map(chunk).collect();
        self.chunks.sort_by_key(|c| c.start);
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
                Found::Topic(..) => ControlFlow::Continue(()),
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
        SCHEMA | CHANNEL => match mcap::parse_record(opcode, data).map_err(|e| e.to_string())? {
            Record::Schema { header, data } => {
                let text = String::from_utf8_lossy(&data).into_owned();
                schemas.insert(header.id, (header.name, header.encoding, text));
                Ok(None)
            }
            Record::Channel(channel) => {
                let (kind, schema_encoding, schema) =
                    schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let topic = Topic {
                    name: channel.topic,
                    kind,
                    encoding: channel.message_encoding,
                    schema_encoding,
                    schema,
                };
                Ok(Some(Found::Topic(channel.id.into(), topic)))
            }
            _ => Ok(None),
        },
        _ => Ok(None),
    }
}

fn summary_of(file: &mut Opened, length: u64) -> McapResult<Option<Summary>> {
    let options = SummaryReaderOptions::default().with_file_size(length).with_record_length_limit(MAX_RECORD);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(count) => {
                let read = file.read(reader.insert(count.clamp(1, 1 << 20)))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => {
                let place = file.seek(to)?;
                reader.notify_seeked(place);
            }
        }
    }
    Ok(reader.finish())
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
