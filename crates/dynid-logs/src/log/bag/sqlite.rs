//! Bags of ROS 2 in SQLite (`.db3`): the tables `topics`, `messages`, and `message_definitions` where there is one.
//!
//! A reader of tables alone, in the order of their rows: libraries for SQLite are in C. What a bag has not yet moved from its journal
//! (`-wal`) is not seen.

use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use dynid_files::input::{self, Opened};

use super::file::{BagFile, End, RawMessage, Take, Topic};
use super::known;

/// What a file begins with takes this many bytes.
const HEADER: usize = 100;
/// Deepest tree of a table.
const MAX_DEPTH: usize = 20;
/// Most rows of tables that are read whole.
const MAX_ROWS: usize = 100_000;
/// Largest row, bytes.
const MAX_ROW: usize = 256 << 20;

/// A bag in SQLite.
pub(super) struct Sqlite {
    path: PathBuf,
    topics: BTreeMap<u32, Topic>,
    /// First page of the table of messages, and the places of its columns: topic, time, data.
    messages: u32,
    columns: [usize; 3],
}

impl Sqlite {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let mut file = Pages::open(path)?;
        let schema = file.table(1)?;
        let table = |name: &str| {
            let row = schema
                .iter()
                .find(|row| row.first().is_some_and(|v| v.text() == "table") && row[1].text() == name)?;
            Some((row.get(3)?.number() as u32, columns_of(&row.get(4)?.text())))
        };
        let missing = |name: &str| format!("expected the table `{name}` of a bag, found none");
        let place = |columns: &[String], name: &str| {
            columns
                .iter()
                .position(|c| c == name)
                .ok_or_else(|| format!("expected the column `{name}`, found none"))
        };
        let (root, columns) = table("topics").ok_or_else(|| missing("topics"))?;
        let [id, name, kind, format] =
            ["id", "name", "type", "serialization_format"].map(|c| place(&columns, c));
        let [id, name, kind, format] = [id?, name?, kind?, format?];
        let mut definitions: BTreeMap<String, (String, String)> = BTreeMap::new();
        if let Some((root, columns)) = table("message_definitions") {
            let of = ["topic_type", "encoding", "encoded_message_definition"].map(|c| place(&columns, c));
            if let [Ok(kind), Ok(encoding), Ok(text)] = of {
                for row in file.table(root)? {
                    let text_of = |k: usize| row.get(k).map_or_else(String::new, Value::text);
                    definitions.insert(text_of(kind), (text_of(encoding), text_of(text)));
                }
            }
        }
        let mut topics = BTreeMap::new();
        for row in file.table(root)? {
            let text = |k: usize| row.get(k).map_or_else(String::new, Value::text);
            let kind = text(kind);
            let (schema_encoding, schema) = definitions
                .get(&kind)
                .filter(|(_, text)| !text.is_empty())
                .cloned()
                .or_else(|| Some(("ros2msg".to_owned(), known::definition(&kind)?)))
                .unwrap_or_else(|| ("no definition".to_owned(), String::new()));
            let topic = Topic { name: text(name), kind, encoding: text(format), schema_encoding, schema };
            topics.insert(row.get(id).map_or(0, Value::number) as u32, topic);
        }
        let (messages, columns) = table("messages").ok_or_else(|| missing("messages"))?;
        let [topic, time, data] = ["topic_id", "timestamp", "data"].map(|c| place(&columns, c));
        Ok(Sqlite { path: path.to_owned(), topics, messages, columns: [topic?, time?, data?] })
    }
}

impl BagFile for Sqlite {
    fn topics(&self) -> &BTreeMap<u32, Topic> {
        &self.topics
    }

    fn messages(&self, channels: &[u32], take: Take<'_>) -> Result<End, String> {
        let mut file = Pages::open(&self.path)?;
        let [topic, time, data] = self.columns;
        let found = file.rows(self.messages, 0, &mut |row| {
            let (Some(channel), Some(received), Some(Value::Bytes(data))) =
                (row.get(topic), row.get(time), row.get(data))
            else {
                return ControlFlow::Continue(());
            };
            let channel = channel.number() as u32;
            if !channels.contains(&channel) {
                return ControlFlow::Continue(());
            }
            take(RawMessage { channel, received: received.number(), data })
        });
        Ok(found.map_or_else(End::Broken, |_| End::Whole))
    }
}

/// Names of the columns in `CREATE TABLE name(id INTEGER PRIMARY KEY, ..)`.
fn columns_of(statement: &str) -> Vec<String> {
    let inner = statement.split_once('(').map_or("", |(_, inner)| inner);
    let name = |column: &str| {
        column.split_whitespace().next().map(|name| name.trim_matches(['"', '`', '[', ']']).to_owned())
    };
    inner.trim_end().trim_end_matches(')').split(',').filter_map(name).collect()
}

/// A value of a row.
enum Value {
    Null,
    Number(i64),
    Float(f64),
    Bytes(Vec<u8>),
}

impl Value {
    fn text(&self) -> String {
        match self {
            Value::Bytes(bytes) => String::from_utf8_lossy(bytes).into_owned(),
            _ => String::new(),
        }
    }

    fn number(&self) -> i64 {
        match self {
            Value::Number(n) => *n,
            Value::Float(x) => *x as i64,
            _ => 0,
        }
    }
}

type Row = Vec<Value>;

/// The pages of a file.
struct Pages {
    file: Opened,
    size: usize,
    /// Bytes of a page that hold anything.
    usable: usize,
    count: u32,
}

impl Pages {
    fn open(path: &Path) -> Result<Self, String> {
        let mut file = input::open(path).map_err(|e| e.to_string())?;
        let length = file.length().map_err(|e| e.to_string())?;
        let mut header = [0; HEADER];
        file.seek(SeekFrom::Start(0))
            .and_then(|_| file.read_exact(&mut header))
            .map_err(|e| e.to_string())?;
        let size = match u16::from_be_bytes([header[16], header[17]]) {
            1 => 65_536,
            size => usize::from(size),
        };
        let usable = size.saturating_sub(usize::from(header[20]));
        if size < 512 || !size.is_power_of_two() || usable < 480 {
            return Err(format!("expected pages of 512 bytes or more, found {size}"));
        }
        if header[56..60] != [0, 0, 0, 1] {
            return Err("expected texts in UTF-8, found others".to_owned());
        }
        let count = u32::try_from(length / size as u64).unwrap_or(u32::MAX);
        Ok(Pages { file, size, usable, count })
    }

    /// A page, counted from 1.
    fn page(&mut self, number: u32) -> Result<Vec<u8>, String> {
        if number == 0 || number > self.count {
            return Err(format!("expected a page up to {}, found {number}", self.count));
        }
        let mut page = vec![0; self.size];
        let start = (u64::from(number) - 1) * self.size as u64;
        self.file
            .seek(SeekFrom::Start(start))
            .and_then(|_| self.file.read_exact(&mut page))
            .map_err(|e| e.to_string())?;
        Ok(page)
    }

    /// All rows of a small table.
    fn table(&mut self, root: u32) -> Result<Vec<Row>, String> {
        let mut rows = Vec::new();
        let end = self.rows(root, 0, &mut |row| {
            rows.push(row);
            if rows.len() > MAX_ROWS { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        match end {
            ControlFlow::Continue(()) => Ok(rows),
            ControlFlow::Break(()) => Err(format!("expected at most {MAX_ROWS} topics, found more")),
        }
    }

    /// Hands over the rows of a table in the order of their numbers.
    fn rows(
        &mut self,
        root: u32,
        depth: usize,
        take: &mut dyn FnMut(Row) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, String> {
        if depth > MAX_DEPTH {
            return Err(format!("expected a tree of pages at most {MAX_DEPTH} deep, found more"));
        }
        let page = self.page(root)?;
        let start = if root == 1 { HEADER } else { 0 };
        let is_inner = match page[start] {
            5 => true,
            13 => false,
            kind => return Err(format!("expected a page of a table, found one of kind {kind} at {root}")),
        };
        let cells = usize::from(u16::from_be_bytes([page[start + 3], page[start + 4]]));
        let pointers = start + if is_inner { 12 } else { 8 };
        for cell in 0..cells {
            let at = page
                .get(pointers + 2 * cell..pointers + 2 * cell + 2)
                .ok_or("expected the place of a row, found none")?;
            let at = usize::from(u16::from_be_bytes([at[0], at[1]]));
            let found = match is_inner {
                true => {
                    let child = number(&page, at, 4)? as u32;
                    self.rows(child, depth + 1, take)?
                }
                false => {
                    let (length, used) = varint(&page, at)?;
                    let (id, more) = varint(&page, at + used)?;
                    let payload = self.payload(&page, at + used + more, length)?;
                    take(row_of(&payload, id as i64)?)
                }
            };
            if found.is_break() {
                return Ok(found);
            }
        }
        match is_inner {
            true => {
                let last = number(&page, start + 8, 4)? as u32;
                self.rows(last, depth + 1, take)
            }
            false => Ok(ControlFlow::Continue(())),
        }
    }

    /// The bytes of a row: what does not fit its page stands in a chain of others.
    fn payload(&mut self, page: &[u8], at: usize, length: u64) -> Result<Vec<u8>, String> {
        let length = usize::try_from(length).ok().filter(|n| *n <= MAX_ROW);
        let length =
            length.ok_or_else(|| format!("expected a row of at most {MAX_ROW} bytes, found more"))?;
        let most = self.usable - 35;
        let here = if length <= most {
            length
        } else {
            let least = (self.usable - 12) * 32 / 255 - 23;
            let local = least + (length - least) % (self.usable - 4);
            if local <= most { local } else { least }
        };
        let short = "expected a row, found the end of its page";
        let mut out = page.get(at..at + here).ok_or(short)?.to_vec();
        if here == length {
            return Ok(out);
        }
        let mut next = number(page, at + here, 4)? as u32;
        let mut steps = 0;
        while out.len() < length {
            steps += 1;
            if steps > self.count {
                return Err("expected a chain of pages, found a circle".to_owned());
            }
            let page = self.page(next)?;
            next = number(&page, 0, 4)? as u32;
            let take = (length - out.len()).min(self.usable - 4);
            out.extend(&page[4..4 + take]);
        }
        Ok(out)
    }
}

/// A whole number, its greatest byte first.
fn number(bytes: &[u8], at: usize, size: usize) -> Result<i64, String> {
    let part = bytes.get(at..at + size).ok_or("expected a number, found the end of its page")?;
    let negative = part.first().is_some_and(|b| b & 0x80 != 0 && size != 4);
    let start = if negative { -1 } else { 0 };
    Ok(part.iter().fold(start, |sum: i64, byte| sum << 8 | i64::from(*byte)))
}

/// A number of one to nine bytes, and how many it takes.
fn varint(bytes: &[u8], at: usize) -> Result<(u64, usize), String> {
    let mut value = 0;
    for used in 0..9 {
        let byte = *bytes.get(at + used).ok_or("expected a number, found the end of its page")?;
        if used == 8 {
            return Ok((value << 8 | u64::from(byte), 9));
        }
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Ok((value, used + 1));
        }
    }
    Ok((value, 9))
}

/// Takes a row apart; a column that is the number of the row is null in it.
fn row_of(payload: &[u8], id: i64) -> Result<Row, String> {
    let (head, used) = varint(payload, 0)?;
    let head = usize::try_from(head)
        .ok()
        .filter(|n| *n <= payload.len())
        .ok_or("expected the kinds of a row, found none")?;
    let (mut at, mut place, mut row) = (used, head, Vec::new());
    while at < head {
        let (kind, used) = varint(payload, at)?;
        at += used;
        let size = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind as usize,
            5 => 6,
            6 | 7 => 8,
            _ => usize::try_from(kind.saturating_sub(12) / 2).unwrap_or(usize::MAX),
        };
        let end = place.checked_add(size).filter(|end| *end <= payload.len());
        let end = end.ok_or("expected a value, found the end of its row")?;
        let bytes = &payload[place..end];
        row.push(match kind {
            0 if row.is_empty() => Value::Number(id),
            0 => Value::Null,
            8 => Value::Number(0),
            9 => Value::Number(1),
            4 => Value::Number(i64::from(number(payload, place, 4)? as u32 as i32)),
            1..=6 => Value::Number(number(payload, place, size)?),
            7 => Value::Float(f64::from_bits(number(payload, place, 8)? as u64)),
            _ => Value::Bytes(bytes.to_vec()),
        });
        place = end;
    }
    Ok(row)
}
