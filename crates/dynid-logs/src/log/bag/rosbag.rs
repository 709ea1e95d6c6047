//! Bags of ROS 1 (format 2.0): connections with the definitions of their messages, and the messages, in chunks.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use dynid_files::input;

use super::file::{BagFile, End, RawMessage, Take, Topic};

/// What a file begins with.
const VERSION: &str = "#ROSBAG V2.0";
/// Largest record and chunk, bytes, compressed or not.
const MAX_RECORD: usize = 512 << 20;
const MESSAGE: u8 = 0x02;
const CHUNK: u8 = 0x05;
const CONNECTION: u8 = 0x07;

/// A bag of ROS 1.
pub(super) struct RosBag {
    path: PathBuf,
    topics: BTreeMap<u32, Topic>,
}

impl RosBag {
    /// Finds the topics. Their connections stand in the chunks too, so the file is read once.
    pub(super) fn open(path: &Path) -> Result<(Self, End), String> {
        let mut bag = RosBag { path: path.to_owned(), topics: BTreeMap::new() };
        let mut topics = BTreeMap::new();
        let end = bag.records(&mut |record| {
            if record.op()? == CONNECTION {
                topics.insert(record.number("conn")?, topic_of(&record)?);
            }
            Ok(ControlFlow::Continue(()))
        })?;
        bag.topics = topics;
        Ok((bag, end))
    }

    /// Goes through the records of the file and of its chunks.
    fn records(
        &self,
        take: &mut dyn FnMut(Record<'_>) -> Result<ControlFlow<()>, String>,
    ) -> Result<End, String> {
        let file = input::open(&self.path).map_err(|e| e.to_string())?;
        let mut file = BufReader::with_capacity(1 << 20, file);
        let mut line = vec![0; VERSION.len() + 1];
        file.read_exact(&mut line).map_err(|e| e.to_string())?;
        if !line.starts_with(VERSION.as_bytes()) {
            return Err(format!("expected `{VERSION}`, found `{}`", String::from_utf8_lossy(&line).trim()));
        }
        let (mut header, mut data, mut inflated) = (Vec::new(), Vec::new(), Vec::new());
        let mut one = |file: &mut BufReader<_>| -> Result<ControlFlow<()>, String> {
            if !read_part(file, &mut header)? {
                return Ok(ControlFlow::Break(()));
            }
            if !read_part(file, &mut data)? {
                return Err("expected the data of a record, found the end of the file".to_owned());
            }
            let record = Record { header: &header, data: &data };
            if record.op()? != CHUNK {
                return take(record);
            }
            inflated.clear();
            let mut rest = match record.field("compression").unwrap_or_default() {
                b"none" => data.as_slice(),
                b"lz4" => {
                    let read =
                        lz4_flex::frame::FrameDecoder::new(data.as_slice()).take(MAX_RECORD as u64 + 1);
                    inflate(read, &mut inflated)?
                }
                b"bz2" => inflate(
                    bzip2::read::MultiBzDecoder::new(data.as_slice()).take(MAX_RECORD as u64 + 1),
                    &mut inflated,
                )?,
                other => {
                    return Err(format!(
                        "expected chunks as they are, in lz4 or bz2, found `{}`",
                        String::from_utf8_lossy(other)
                    ));
                }
            };
            while !rest.is_empty() {
                let (header, behind) = part(rest)?;
                let (data, behind) = part(behind)?;
                rest = behind;
                if take(Record { header, data })?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            Ok(ControlFlow::Continue(()))
        };
        loop {
            match one(&mut file) {
                Ok(ControlFlow::Continue(())) => {}
                Ok(ControlFlow::Break(())) => return Ok(End::Whole),
                Err(reason) => return Ok(End::Broken(reason)),
            }
        }
    }
}

impl BagFile for RosBag {
    fn topics(&self) -> &BTreeMap<u32, Topic> {
        &self.topics
    }

    fn messages(&self, channels: &[u32], take: Take<'_>) -> Result<End, String> {
        self.records(&mut |record| {
            if record.op()? != MESSAGE {
                return Ok(ControlFlow::Continue(()));
            }
            let channel = record.number("conn")?;
            if !channels.contains(&channel) {
                return Ok(ControlFlow::Continue(()));
            }
            let time = record
                .field("time")
                .and_then(|t| t.get(..8))
                .ok_or("expected the time of a message, found none")?;
            let word =
                |k: usize| i64::from(u32::from_le_bytes([time[k], time[k + 1], time[k + 2], time[k + 3]]));
            let received = word(0) * 1_000_000_000 + word(4);
            Ok(take(RawMessage { channel, received, data: record.data }))
        })
    }
}

/// A record: fields and data.
struct Record<'a> {
    header: &'a [u8],
    data: &'a [u8],
}

impl<'a> Record<'a> {
    fn field(&self, name: &str) -> Option<&'a [u8]> {
        field_of(self.header, name)
    }

    fn op(&self) -> Result<u8, String> {
        let op = self.field("op").and_then(|value| value.first()).copied();
        op.ok_or_else(|| "expected the kind of a record, found none".to_owned())
    }

    fn number(&self, name: &str) -> Result<u32, String> {
        let bytes = self.field(name).and_then(|value| <[u8; 4]>::try_from(value).ok());
        bytes.map(u32::from_le_bytes).ok_or_else(|| format!("expected `{name}` in a record, found none"))
    }
}

/// The value of a field, `name=value` each behind its length.
fn field_of<'a>(mut header: &'a [u8], name: &str) -> Option<&'a [u8]> {
    while !header.is_empty() {
        let (field, rest) = part(header).ok()?;
        let at = field.iter().position(|b| *b == b'=')?;
        if &field[..at] == name.as_bytes() {
            return Some(&field[at + 1..]);
        }
        header = rest;
    }
    None
}

fn topic_of(record: &Record<'_>) -> Result<Topic, String> {
    let text = |value: Option<&[u8]>, what: &str| {
        let value = value.ok_or_else(|| format!("expected `{what}` of a connection, found none"))?;
        Ok::<_, String>(String::from_utf8_lossy(value).into_owned())
    };
    Ok(Topic {
        name: text(record.field("topic"), "topic")?,
        kind: text(field_of(record.data, "type"), "type")?,
        encoding: "ros1".to_owned(),
        schema_encoding: "ros1msg".to_owned(),
        schema: text(field_of(record.data, "message_definition"), "message_definition")?,
    })
}

/// Bytes behind their length, and what follows.
fn part(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    let short = "expected a record, found the end of its chunk";
    let (length, rest) = bytes.split_at_checked(4).ok_or(short)?;
    let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
    Ok(rest.split_at_checked(length).ok_or(short)?)
}

/// Reads bytes behind their length; false at the end of the file.
fn read_part(file: &mut impl Read, into: &mut Vec<u8>) -> Result<bool, String> {
    let mut length = [0; 4];
    match file.read_exact(&mut length) {
        Ok(()) => {}
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(false),
        Err(e) => return Err(e.to_string()),
    }
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_RECORD {
        return Err(format!("expected a record of at most {MAX_RECORD} bytes, found {length}"));
    }
    into.clear();
    file.take(length as u64).read_to_end(into).map_err(|e| e.to_string())?;
    if into.len() == length {
        Ok(true)
    } else {
        Err("expected a record, found the end of the file".to_owned())
    }
}

fn inflate(mut from: impl Read, into: &mut Vec<u8>) -> Result<&[u8], String> {
    from.read_to_end(into).map_err(|e| e.to_string())?;
    if into.len() > MAX_RECORD {
        return Err(format!("expected a chunk of at most {MAX_RECORD} bytes, found more"));
    }
    Ok(into)
}
