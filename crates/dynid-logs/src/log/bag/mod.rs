//! Bags: messages of several topics with times of their own, joined to one table.
//!
//! Columns are the numbers of the messages, named by topic and field (`/joint_states/<joint>/position`). Every message is a row; messages
//! of several topics with one stamp share it. What a row does not have is NaN.

mod blocks;
mod clock;
mod definition;
mod file;
mod joined;
mod json;
mod known;
mod mcap;
mod mcap_records;
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

use dynid_files::digest::Hashed;
use dynid_files::excerpt::listed;
use dynid_files::input;

use self::blocks::{Layout, Place};
use self::clock::{Choice, Clock, Stamps, Times};
use self::file::{BagFile, End, RawMessage};
use self::joined::{Joined, TopicRows, Topics};
use self::mcap::Mcap;
use self::rosbag::RosBag;
use self::sqlite::Sqlite;
use self::topics::{Decoded, Encoding, Values};
use super::arrays::TableBuilder;
use super::format::LogFormat;
use super::header::LogHeader;
use super::{LogOptions, LogSource, Missing, ReadingNote, TableBlocks, Wanted, one_block, places_of};
use crate::csv::{LogFileError, Table};

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
            None => "topics whose messages can be read (`ros2msg`, `ros1msg` or JSON)".to_owned(),
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
}

/// SHA-256 of all files, one behind the other.
fn digest(name: &str, paths: &[PathBuf]) -> Result<String, LogFileError> {
    let mut all: Box<dyn Read> = Box::new(std::io::empty());
    let unreadable = |error| LogFileError::Unreadable { file: name.to_owned(), error };
    for path in paths {
        all = Box::new(all.chain(input::open(path).map_err(unreadable)?));
    }
    Hashed::new(all).finish().map_err(unreadable)
}

/// Per topic, where its columns go among those that are read of it.
type Slots = BTreeMap<usize, Vec<Option<usize>>>;

impl LogSource for BagLog {
    fn header(&self) -> LogHeader {
        self.header.without(&self.options.read.ignore)
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.notes
    }

    fn read(mut self: Box<Self>, wanted: &Wanted) -> Result<(Table, Vec<ReadingNote>), LogFileError> {
        let (columns, times) = places_of(&self.header, &self.header(), wanted);
        let (slots, slot_of) = self.slots(&columns);
        let read = self.collect(&slots)?;
        let choice = self.clock(&read, &times)?;
        let joined = Joined::of(&read, choice.clock);
        if joined.rows == 0 {
            return Err(LogFileError::NoRows { file: self.name, line: 0 });
        }
        let mut out = TableBuilder::new(&self.name, joined.rows, self.options.read.rows, &self.options)?;
        for k in columns {
            let (values, is_time) = match k {
                0 => (joined.stamps(choice.clock), true),
                1 => (joined.stamps(Clock::Header), true),
                2 => (joined.stamps(Clock::Receipt), true),
                _ => {
                    let (topic, slot) = slot_of[&k];
                    (joined.column(topic, slot), times.contains(&k))
                }
            };
            let missing = if is_time { Missing::Error } else { wanted.missing };
            out.add(&self.header.names[k], &values, 0, 1, is_time, missing)?;
        }
        let sha256 = digest(&self.name, &self.paths)?;
        self.notes.push(choice.note());
        if read.len() > 1 {
            let names: Vec<&str> = read.keys().map(|k| self.topics[*k].name.as_str()).collect();
            let reason = format!("{} have stamps of their own", listed(&names, 6));
            self.notes.push(ReadingNote::new("topics", format!("joined, {} rows", joined.rows), reason));
        }
        Ok((out.finish(sha256), self.notes))
    }

    /// Of one topic whose messages all have what is wanted, message by message; else all rows at once, since a row may be filled up from others.
    fn blocks(
        mut self: Box<Self>,
        wanted: &Wanted,
        rows: usize,
    ) -> Result<Box<dyn TableBlocks>, LogFileError> {
        let (columns, times) = places_of(&self.header, &self.header(), wanted);
        let (slots, slot_of) = self.slots(&columns);
        let [(topic, own)] = slots.iter().collect::<Vec<_>>()[..] else { return one_block(self, wanted) };
        let Some(read) = self.times_of(*topic, own)? else { return one_block(self, wanted) };
        self.note_late_columns(&slots);
        let choice = self.clock(&read, &times)?;
        let place = |k: &usize| match k {
            0 => Place::Stamp(choice.clock),
            1 => Place::Stamp(Clock::Header),
            2 => Place::Stamp(Clock::Receipt),
            _ => Place::Slot(slot_of[k].1),
        };
        let only = &read[topic].times;
        let total = only.receipt.len();
        if total == 0 {
            return Err(LogFileError::NoRows { file: self.name, line: 0 });
        }
        let (first, last) = TableBuilder::rows_of(&self.name, total, self.options.read.rows)?;
        let layout = Layout {
            topic: *topic,
            slots: own.clone(),
            names: columns.iter().map(|k| self.header.names[*k].clone()).collect(),
            places: columns.iter().map(place).collect(),
            is_time: columns.iter().map(|k| *k < CLOCKS.len() || times.contains(k)).collect(),
            has_headers: !only.header.is_empty(),
        };
        self.notes.push(choice.note());
        blocks::start(*self, layout, first - 1..last, rows.max(1), wanted.missing)
    }
}

impl BagLog {
    /// Times of all messages of a topic; `None` if one of them lacks a wanted value or cannot be taken apart.
    fn times_of(&mut self, topic: usize, slots: &[Option<usize>]) -> Result<Option<Topics>, LogFileError> {
        let wanted = slots.iter().flatten().count();
        let is_wanted = |column: &usize| slots.get(*column).is_some_and(Option::is_some);
        let (mut header, mut receipt) = (Stamps::default(), Stamps::default());
        let (mut lacks, mut headers) = (false, true);
        let scanned = self.each_of(topic, &mut |received, values| {
            let Some(values) = values else {
                lacks = true;
                return ControlFlow::Break(());
            };
            let all = values.numbers.iter().zip(values.columns);
            lacks |= all.filter(|(x, column)| is_wanted(column) && !x.is_nan()).count() != wanted;
            receipt.push(received);
            match values.stamp.filter(|_| headers) {
                Some(stamp) => header.push(stamp),
                None => headers = false,
            }
            if lacks { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        scanned.iter().for_each(|end| self.note_end(end));
        let header = if headers { header.finish() } else { Vec::new() };
        let times = Times { header, receipt: receipt.finish() };
        Ok((!lacks).then(|| [(topic, TopicRows { times, ..TopicRows::default() })].into()))
    }

    /// Hands over the messages of a topic: the time of receipt, and the values unless they cannot be taken apart.
    fn each_of(
        &mut self,
        topic: usize,
        take: &mut dyn FnMut(i64, Option<Values<'_>>) -> ControlFlow<()>,
    ) -> Result<Vec<End>, LogFileError> {
        let (mut ends, mut is_done) = (Vec::new(), false);
        for (place, source) in self.files.iter().enumerate() {
            let own = |((file, _), of): &(&(usize, u32), &usize)| *file == place && **of == topic;
            let wanted: Vec<u32> = self.channels.iter().filter(own).map(|((_, c), _)| *c).collect();
            let decoded = &mut self.topics[topic];
            let end = source.messages(&wanted, &mut |message| {
                let flow = take(message.received, decoded.decode(message.data).ok());
                is_done = flow.is_break();
                flow
            });
            let damaged =
                |reason| LogFileError::Damaged { file: self.name.clone(), format: self.format, reason };
            ends.push(end.map_err(damaged)?);
            if is_done {
                break;
            }
        }
        Ok(ends)
    }
}

impl BagLog {
    /// Where the columns of each topic go, and topic and place of each column.
    fn slots(&self, columns: &[usize]) -> (Slots, BTreeMap<usize, (usize, usize)>) {
        let (mut slots, mut slot_of) = (Slots::new(), BTreeMap::new());
        for k in columns.iter().filter(|k| **k >= CLOCKS.len()) {
            let (topic, column) = self.places[*k - CLOCKS.len()];
            let slots = slots.entry(topic).or_insert_with(|| vec![None; self.topics[topic].columns.len()]);
            let next = slots.iter().flatten().count();
            let slot = *slots[column].get_or_insert(next);
            slot_of.insert(*k, (topic, slot));
        }
        (slots, slot_of)
    }

    /// Reads the messages of the topics of which columns are wanted.
    fn collect(&mut self, slots: &Slots) -> Result<Topics, LogFileError> {
        let of_topic = |(topic, slots): (&usize, &Vec<Option<usize>>)| {
            let columns = vec![Vec::new(); slots.iter().flatten().count()];
            (*topic, TopicRows { columns, ..TopicRows::default() })
        };
        let mut read: Topics = slots.iter().map(of_topic).collect();
        let (mut ends, mut broken) = (Vec::new(), 0_usize);
        for (place, source) in self.files.iter().enumerate() {
            let of_file =
                |((file, _), topic): &(&(usize, u32), &usize)| *file == place && slots.contains_key(*topic);
            let wanted: Vec<u32> = self.channels.iter().filter(of_file).map(|((_, c), _)| *c).collect();
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
                // One without leaves the list shorter than that of the times of receipt, which says so.
                read.times.header.extend(values.stamp);
                ControlFlow::Continue(())
            };
            ends.push(source.messages(&wanted, &mut take).map_err(|reason| LogFileError::Damaged {
                file: self.name.clone(),
                format: self.format,
                reason,
            })?);
        }
        ends.iter().for_each(|end| self.note_end(end));
        for topic in read.values_mut() {
            let rows = topic.times.receipt.len();
            topic.columns.iter_mut().for_each(|column| column.resize(rows, f64::NAN));
            if topic.times.header.len() < rows {
                topic.times.header.clear();
            }
        }
        if broken > 0 {
            self.notes.push(ReadingNote::new("broken messages", broken.to_string(), "they were left out"));
        }
        self.note_late_columns(slots);
        Ok(read)
    }

    /// Columns that no message had among the first, so that nobody could ask for them.
    fn note_late_columns(&mut self, slots: &Slots) {
        let late: Vec<&str> = slots
            .iter()
            .flat_map(|(topic, known)| self.topics[*topic].columns[known.len()..].iter())
            .map(String::as_str)
            .collect();
        if !late.is_empty() {
            let reason = format!("none of the first {LOOKED_AT} messages of their topic has them");
            self.notes.push(ReadingNote::new("columns left out", listed(&late, 6), reason));
        }
    }

    /// The clock that is stated, else the better one.
    fn clock(&self, read: &Topics, times: &[usize]) -> Result<Choice, LogFileError> {
        let topics: Vec<(&str, &Times)> =
            read.iter().map(|(k, topic)| (self.topics[*k].name.as_str(), &topic.times)).collect();
        let stated = |clock: Clock| Choice { clock, reason: "stated".to_owned() };
        match times {
            [1] => match topics.iter().find(|(_, t)| t.header.len() != t.receipt.len()) {
                None => Ok(stated(Clock::Header)),
                Some((name, _)) => Err(LogFileError::Content {
                    file: self.name.clone(),
                    format: self.format,
                    expected: "stamps in the headers of all messages".to_owned(),
                    found: format!("messages of `{name}` without: take `receive_time`"),
                }),
            },
            [2] => Ok(stated(Clock::Receipt)),
            _ => Ok(clock::choose(&topics)),
        }
    }
}
