//! MCAP: topics with the definitions of their messages, and the messages, in compressed chunks.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use dynid_files::input::{self, Opened};
use mcap::MAGIC;

use super::file::{BagFile, End, RawMessage, Take, Topic, Waiting};
use super::mcap_records::{self, Fields};

/// Bytes that are read at a time.
const BUFFER: usize = 1 << 18;
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
        let file = input::open(&self.path).map_err(|e| e.to_string())?;
        let source = Stretches { file, waiting: stretches.iter().rev().copied().collect(), left: 0 };
        let mut schemas: BTreeMap<u16, (String, String, String)> = BTreeMap::new();
        let is_whole = stretches == [self.whole()];
        mcap_records::walk(BufReader::with_capacity(BUFFER, source), is_whole, &mut |opcode, data| {
            Ok(match found(opcode, data, &mut schemas)? {
                Some(found) => take(found),
                None => ControlFlow::Continue(()),
            })
        })
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

/// Where the summary of a file begins, if it has one.
fn summary_start(file: &mut Opened, length: u64) -> Option<u64> {
    let mut footer = [0; FOOTER as usize];
    file.seek(SeekFrom::Start(length.checked_sub(FOOTER)?)).ok()?;
    file.read_exact(&mut footer).ok()?;
    let mut fields = Fields(&footer);
    let is_footer = fields.number(1) == Ok(2) && fields.number(8) == Ok(20);
    let start = fields.number(8).ok()?;
    (is_footer && footer.ends_with(MAGIC) && start > 0 && start < length - FOOTER).then_some(start)
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
