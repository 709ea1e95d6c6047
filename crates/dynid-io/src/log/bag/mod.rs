//! Bags: messages of several topics with times of their own, joined to one table.
//!
//! Columns are the numbers of the messages, named by topic and field (`/joint_states/<joint>/position`). Every message is a row; messages
//! of several topics with one stamp share it. What a row does not have is NaN.

mod clock;
mod definition;
mod file;
mod known;
mod mcap;
mod names;
mod rosbag;
mod sqlite;
mod topics;
mod walk;
mod wire;

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use self::clock::{Choice, Clock, Times};
use self::file::{BagFile, End, RawMessage};
use self::mcap::Mcap;
use self::rosbag::RosBag;
use self::sqlite::Sqlite;
use self::topics::{Decoded, Encoding};
use super::arrays::{TableBuilder, Values};
use super::format::LogFormat;
use super::header::LogHeader;
use super::{LogOptions, LogSource, Missing, ReadingNote, Wanted};
use crate::csv::{LogFileError, Table};
use crate::digest::Hashed;
use crate::excerpt::listed;
use crate::input;

/// How a bag is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BagFormat {
    Mcap,
    Ros1,
    Sqlite,
}

impl BagFormat {
    fn name(self) -> &'static str {
        match self {
            BagFormat::Mcap => "MCAP",
            BagFormat::Ros1 => "ROS 1 bag",
            BagFormat::Sqlite => "ROS 2 bag in SQLite",
        }
    }
}

/// Columns in front of those of the topics: the time that suits the topics, and both clocks.
const CLOCKS: [&str; 3] = ["time", "header_stamp", "receive_time"];
/// Messages of a topic that are looked at before any column is known.
const LOOKED_AT: usize = 50;

/// A bag, in one file or several.
struct BagLog {
    name: String,
    format: &'static str,
    files: Vec<Box<dyn BagFile>>,
    paths: Vec<PathBuf>,
    topics: Vec<Decoded>,
    /// Topic of a channel of a file.
    channels: BTreeMap<(usize, u32), usize>,
    header: LogHeader,
    /// Topic and its column, per column behind the clocks.
    places: Vec<(usize, usize)>,
    notes: Vec<ReadingNote>,
    options: LogOptions,
}

/// Opens a bag. `member`: the topic that is read alone, or the beginning of the names of several.
pub(super) fn open(
    format: BagFormat,
    name: &Path,
    paths: &[PathBuf],
    member: Option<&str>,
    options: &LogOptions,
) -> Result<Box<dyn LogSource>, LogFileError> {
    let kind = format;
    let (file, format) = (name.display().to_string(), format.name());
    options.refuse_settings_of_text(&file, format)?;
    let damaged = |reason: String| LogFileError::Damaged { file: file.clone(), format, reason };
    let mut bag = BagLog {
        name: file.clone(),
        format,
        files: Vec::new(),
        paths: paths.to_vec(),
        topics: Vec::new(),
        channels: BTreeMap::new(),
        header: LogHeader::default(),
        places: Vec::new(),
        notes: Vec::new(),
        options: options.clone(),
    };
    for path in paths {
        let (opened, end): (Box<dyn BagFile>, End) = match kind {
            BagFormat::Mcap => Mcap::open(path).map(|(f, end)| (Box::new(f) as _, end)),
            BagFormat::Ros1 => RosBag::open(path).map(|(f, end)| (Box::new(f) as _, end)),
            BagFormat::Sqlite => Sqlite::open(path).map(|f| (Box::new(f) as _, End::Whole)),
        }
        .map_err(damaged)?;
        bag.note_end(&end);
        bag.files.push(opened);
    }
    let passed = bag.find_topics(member);
    if bag.topics.is_empty() {
        let expected = match member {
            Some(member) => format!("topics below `{member}` whose messages can be read"),
            None => "topics whose messages can be read (`ros2msg` or `ros1msg`)".to_owned(),
        };
        return Err(LogFileError::Content { file, format, expected, found: listed(&passed, 6) });
    }
    bag.find_columns().map_err(damaged)?;
    let topics: Vec<String> = bag.topics.iter().map(|t| format!("{} ({})", t.name, t.kind)).collect();
    let mut notes = vec![ReadingNote::new("format", format, format!("topics {}", listed(&topics, 8)))];
    if !passed.is_empty() {
        let reason = "no message of them can be read";
        notes.push(ReadingNote::new("topics left out", listed(&passed, 6), reason));
    }
    notes.append(&mut bag.notes);
    bag.notes = notes;
    if let Some(column) = options.read.ignore.iter().find(|name| bag.header.column(name).is_none()) {
        return Err(LogFileError::UnknownIgnored { file, column: column.clone() });
    }
    Ok(Box::new(bag))
}

impl BagLog {
    fn note_end(&mut self, end: &End) {
        if let End::Broken(reason) = end {
            let note = ReadingNote::new("damaged bag", "read up to the damage", reason.clone());
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// Finds the topics whose messages can be taken apart; gives the others.
    fn find_topics(&mut self, member: Option<&str>) -> Vec<String> {
        let mut passed = BTreeSet::new();
        for (place, file) in self.files.iter().enumerate() {
            for (channel, topic) in file.topics() {
                if member.is_some_and(|member| !topic.name.starts_with(member)) {
                    continue;
                }
                if let Some(known) =
                    self.topics.iter().position(|t| t.name == topic.name && t.kind == topic.kind)
                {
                    self.channels.insert((place, *channel), known);
                    continue;
                }
                let decoded = Encoding::of(&topic.encoding, &topic.schema_encoding)
                    .ok_or_else(|| format!("{} in {}", topic.schema_encoding, topic.encoding))
                    .and_then(|encoding| Decoded::new(&topic.name, &topic.kind, encoding, &topic.schema));
                match decoded {
                    Ok(decoded) => {
                        self.channels.insert((place, *channel), self.topics.len());
                        self.topics.push(decoded);
                    }
                    Err(reason) => {
                        passed.insert(format!("{} ({}: {reason})", topic.name, topic.kind));
                    }
                }
            }
        }
        passed.into_iter().collect()
    }

    /// Finds the columns from the first messages.
    fn find_columns(&mut self) -> Result<(), String> {
        let mut faults: BTreeMap<usize, String> = BTreeMap::new();
        let mut ends = Vec::new();
        for (place, file) in self.files.iter().enumerate() {
            let own: Vec<u32> = self.channels.keys().filter(|(f, _)| *f == place).map(|(_, c)| *c).collect();
            let (topics, channels) = (&mut self.topics, &self.channels);
            let mut take = |message: RawMessage<'_>| {
                let topic = channels[&(place, message.channel)];
                if let Err(reason) = topics[topic].decode(message.data) {
                    faults.entry(topic).or_insert(reason);
                }
            };
            ends.push(file.first_messages(&own, LOOKED_AT, &mut take)?);
        }
        ends.iter().for_each(|end| self.note_end(end));
        for (topic, reason) in faults {
            let name = &self.topics[topic].name;
            self.notes.push(ReadingNote::new("broken messages", format!("`{name}`"), reason));
        }
        let mut names: Vec<String> = CLOCKS.map(str::to_owned).to_vec();
        for (topic, decoded) in self.topics.iter().enumerate() {
            for (column, name) in decoded.columns.iter().enumerate() {
                names.push(name.clone());
                self.places.push((topic, column));
            }
        }
        let width = names.len();
        self.header = LogHeader {
            names,
            in_file: vec![String::new(); width],
            text: vec![false; width],
            format: Some(LogFormat::Bag),
            time: vec![0],
            unnamed: false,
        };
        Ok(())
    }

    /// SHA-256 of all files, one behind the other.
    fn digest(&self) -> std::io::Result<String> {
        let mut all: Box<dyn Read> = Box::new(std::io::empty());
        for path in &self.paths {
            all = Box::new(all.chain(input::open(path)?));
        }
        Hashed::new(all).finish()
    }
}

/// What was read of a topic.
#[derive(Default)]
struct TopicRows {
    times: Times,
    /// Numbers of the wanted columns, message by message.
    columns: Vec<Vec<f64>>,
    no_header: bool,
}

impl LogSource for BagLog {
    fn header(&self) -> LogHeader {
        self.header.without(&self.options.read.ignore)
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.notes
    }

    fn read(mut self: Box<Self>, wanted: &Wanted) -> Result<(Table, Vec<ReadingNote>), LogFileError> {
        let shown = self.header();
        let place = |k: &usize| self.header.column(&shown.names[*k]);
        let all: Vec<usize> = (0..shown.names.len()).collect();
        let columns: Vec<usize> = wanted.columns.as_ref().unwrap_or(&all).iter().filter_map(place).collect();
        let times: Vec<usize> = wanted.time.iter().filter_map(place).collect();
        let (file, damaged) = (self.name.clone(), |reason: String| LogFileError::Damaged {
            file: self.name.clone(),
            format: self.format,
            reason,
        });
        // Where a wanted column goes among those of its topic.
        let mut slots: BTreeMap<usize, Vec<Option<usize>>> = BTreeMap::new();
        let mut slot_of: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
        for k in columns.iter().filter(|k| **k >= CLOCKS.len()) {
            let (topic, column) = self.places[*k - CLOCKS.len()];
            let slots = slots.entry(topic).or_insert_with(|| vec![None; self.topics[topic].columns.len()]);
            let next = slots.iter().flatten().count();
            let slot = *slots[column].get_or_insert(next);
            slot_of.insert(*k, (topic, slot));
        }
        let mut read: BTreeMap<usize, TopicRows> = BTreeMap::new();
        for (topic, slots) in &slots {
            let columns = vec![Vec::new(); slots.iter().flatten().count()];
            read.insert(*topic, TopicRows { columns, ..TopicRows::default() });
        }
        let (mut ends, mut broken) = (Vec::new(), 0_usize);
        for (place, source) in self.files.iter().enumerate() {
            let wanted: Vec<u32> = self
                .channels
                .iter()
                .filter(|((f, _), topic)| *f == place && slots.contains_key(topic))
                .map(|((_, c), _)| *c)
                .collect();
            let (topics, channels) = (&mut self.topics, &self.channels);
            let mut take = |message: RawMessage<'_>| {
                let topic = channels[&(place, message.channel)];
                let (Some(slots), Some(read)) = (slots.get(&topic), read.get_mut(&topic)) else {
                    return ControlFlow::Continue(());
                };
                let Ok(values) = topics[topic].decode(message.data) else {
                    broken += 1;
                    return ControlFlow::Continue(());
                };
                let row = read.times.receipt.len();
                for (number, column) in values.numbers.iter().zip(values.columns) {
                    if let Some(Some(slot)) = slots.get(*column) {
                        let list = &mut read.columns[*slot];
                        list.resize(row, f64::NAN);
                        list.push(*number);
                    }
                }
                read.times.receipt.push(message.received);
                match values.stamp {
                    Some(ns) => read.times.header.push(ns),
                    None => read.no_header = true,
                }
                ControlFlow::Continue(())
            };
            ends.push(source.messages(&wanted, &mut take).map_err(&damaged)?);
        }
        ends.iter().for_each(|end| self.note_end(end));
        for topic in read.values_mut() {
            let rows = topic.times.receipt.len();
            topic.columns.iter_mut().for_each(|column| column.resize(rows, f64::NAN));
            if topic.no_header {
                topic.times.header.clear();
            }
        }
        if broken > 0 {
            self.notes.push(ReadingNote::new("broken messages", broken.to_string(), "they were left out"));
        }
        let choice = self.clock(&read, &times)?;
        let joined = Joined::of(&read, choice.clock);
        if joined.rows == 0 {
            return Err(LogFileError::NoRows { file, line: 0 });
        }
        let mut out = TableBuilder::new(&file, joined.rows, &self.options)?;
        for k in columns {
            let (values, is_time) = match k {
                0 => (joined.stamps(choice.clock, &read), true),
                1 => (joined.stamps(Clock::Header, &read), true),
                2 => (joined.stamps(Clock::Receipt, &read), true),
                _ => (joined.column(&read, slot_of[&k]), times.contains(&k)),
            };
            let missing = if is_time { Missing::Error } else { wanted.missing };
            out.add(&self.header.names[k], &values, 0, 1, is_time, missing)?;
        }
        let digest = self.digest();
        let sha256 = digest.map_err(|error| LogFileError::Unreadable { file: file.clone(), error })?;
        let clock = match choice.clock {
            Clock::Header => "stamps of headers",
            Clock::Receipt => "times of receipt",
        };
        self.notes.push(ReadingNote::new("clock", clock, choice.reason));
        if read.len() > 1 {
            let names: Vec<&str> = read.keys().map(|k| self.topics[*k].name.as_str()).collect();
            let reason = format!("{} have stamps of their own", listed(&names, 6));
            self.notes.push(ReadingNote::new("topics", format!("joined, {} rows", joined.rows), reason));
        }
        Ok((out.finish(sha256), self.notes))
    }
}

impl BagLog {
    /// The clock that is stated, else the better one.
    fn clock(&self, read: &BTreeMap<usize, TopicRows>, times: &[usize]) -> Result<Choice, LogFileError> {
        let topics: Vec<(&str, &Times)> =
            read.iter().map(|(k, topic)| (self.topics[*k].name.as_str(), &topic.times)).collect();
        let stated = |clock: Clock| Choice { clock, reason: "stated".to_owned() };
        match times {
            [1] => match topics.iter().find(|(_, t)| t.header.len() != t.receipt.len()) {
                None => Ok(stated(Clock::Header)),
                Some(_) => Err(LogFileError::Content {
                    file: self.name.clone(),
                    format: self.format,
                    expected: "messages with stamps in their headers".to_owned(),
                    found: "some without: take `receive_time`".to_owned(),
                }),
            },
            [2] => Ok(stated(Clock::Receipt)),
            _ => Ok(clock::choose(&topics)),
        }
    }
}

/// Rows that topics share.
struct Joined {
    rows: usize,
    /// Per topic, the message of each row.
    messages: BTreeMap<usize, Vec<Option<usize>>>,
}

impl Joined {
    fn of(read: &BTreeMap<usize, TopicRows>, clock: Clock) -> Self {
        if let [(topic, only)] = read.iter().collect::<Vec<_>>()[..] {
            // As they come: whether stamps may run backwards is for others to say.
            let rows = only.times.receipt.len();
            return Joined { rows, messages: [(*topic, (0..rows).map(Some).collect())].into() };
        }
        let mut stamps: Vec<i64> = read.values().flat_map(|topic| topic.times.of(clock)).copied().collect();
        stamps.sort_unstable();
        stamps.dedup();
        let place = |topic: &TopicRows| {
            let mut messages = vec![None; stamps.len()];
            for (k, stamp) in topic.times.of(clock).iter().enumerate() {
                if let Ok(row) = stamps.binary_search(stamp) {
                    messages[row] = Some(k);
                }
            }
            messages
        };
        Joined { rows: stamps.len(), messages: read.iter().map(|(k, topic)| (*k, place(topic))).collect() }
    }

    /// Stamps of a clock; of rows that several topics share, those of the first.
    fn stamps(&self, clock: Clock, read: &BTreeMap<usize, TopicRows>) -> Values {
        let stamp = |row: usize| {
            let of = |(topic, messages): (&usize, &Vec<Option<usize>>)| {
                let message = messages[row]?;
                read[topic].times.of(clock).get(message).copied()
            };
            self.messages.iter().find_map(of).unwrap_or(0)
        };
        Values::Whole((0..self.rows).map(stamp).collect())
    }

    fn column(&self, read: &BTreeMap<usize, TopicRows>, (topic, slot): (usize, usize)) -> Values {
        let column = &read[&topic].columns[slot];
        let number = |message: &Option<usize>| message.map_or(f64::NAN, |k| column[k]);
        Values::Float(self.messages[&topic].iter().map(number).collect())
    }
}
