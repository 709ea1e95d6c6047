//! The messages of one topic as rows, so many at a time: a thread reads ahead of what is done with them.

use std::ops::{ControlFlow, Range};
use std::panic::resume_unwind;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::clock::Clock;
use super::topics::Values as Message;
use super::{BagLog, digest};
use crate::csv::{LogFileError, Table};
use crate::log::arrays::{TableBuilder, Values};
use crate::log::{LogOptions, Missing, ReadingNote, TableBlocks};

/// Blocks that may wait to be used.
const WAITING: usize = 2;

/// What a column of the table is.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    Stamp(Clock),
    /// One of the wanted values of the topic.
    Slot(usize),
}

/// Which values of which messages make up the table.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) topic: usize,
    /// Place among the wanted values, per column of the topic.
    pub(super) slots: Vec<Option<usize>>,
    /// Per column of the table.
    pub(super) names: Vec<String>,
    pub(super) places: Vec<Place>,
    pub(super) is_time: Vec<bool>,
    /// Whether all messages have stamps.
    pub(super) has_headers: bool,
}

type Sent = Result<Table, LogFileError>;

/// Rows of a bag that arrive from the thread that reads it.
struct BagBlocks {
    receiver: Receiver<Sent>,
    thread: Option<JoinHandle<()>>,
    name: String,
    paths: Vec<PathBuf>,
    notes: Vec<ReadingNote>,
}

/// Begins to read some rows of a log, counted from 0.
pub(super) fn start(
    log: BagLog,
    layout: Layout,
    rows: Range<usize>,
    per_block: usize,
    missing: Missing,
) -> Result<Box<dyn TableBlocks>, LogFileError> {
    let (sender, receiver) = sync_channel(WAITING);
    let (name, paths, notes) = (log.name.clone(), log.paths.clone(), log.notes.clone());
    let reader = Reader {
        name: name.clone(),
        format: log.format,
        options: log.options.clone(),
        layout,
        rows,
        per_block,
        missing,
        sender,
        row: 0,
        part: Part::default(),
        origins: None,
    };
    // The thread ends with the rows, or once nobody takes them any longer.
    let spawned = thread::Builder::new().spawn(move || reader.read(log));
    let thread = spawned.map_err(|error| LogFileError::Unreadable { file: name.clone(), error })?;
    Ok(Box::new(BagBlocks { receiver, thread: Some(thread), name, paths, notes }))
}

impl TableBlocks for BagBlocks {
    fn next_block(&mut self) -> Result<Option<Table>, LogFileError> {
        if let Ok(sent) = self.receiver.recv() {
            return sent.map(Some);
        }
        // Nothing more comes once the thread has ended: with the last row, unless it panicked.
        match self.thread.take().map(JoinHandle::join) {
            Some(Err(panic)) => resume_unwind(panic),
            _ => Ok(None),
        }
    }

    fn notes(&self) -> &[ReadingNote] {
        &self.notes
    }

    fn finish(self: Box<Self>) -> Result<(String, Vec<ReadingNote>), LogFileError> {
        Ok((digest(&self.name, &self.paths)?, self.notes))
    }
}

/// Rows that were read and not sent yet.
#[derive(Default)]
struct Part {
    header: Vec<i64>,
    receipt: Vec<i64>,
    columns: Vec<Vec<f64>>,
}

/// The thread's side.
struct Reader {
    name: String,
    format: &'static str,
    options: LogOptions,
    layout: Layout,
    rows: Range<usize>,
    per_block: usize,
    missing: Missing,
    sender: SyncSender<Sent>,
    /// Messages so far.
    row: usize,
    part: Part,
    /// What was taken from long stamps.
    origins: Option<Vec<i64>>,
}

impl Reader {
    fn read(mut self, mut log: BagLog) {
        let topic = self.layout.topic;
        let read = log.each_of(topic, &mut |received, message| {
            let Some(message) = message else { return ControlFlow::Continue(()) };
            self.take(received, &message);
            let is_last = self.row == self.rows.end;
            let flow = match is_last || self.part.receipt.len() == self.per_block {
                true => self.send(),
                false => ControlFlow::Continue(()),
            };
            if is_last { ControlFlow::Break(()) } else { flow }
        });
        let fault = match read {
            Err(error) => error,
            // The messages were counted before.
            Ok(_) if self.row < self.rows.end => {
                let (expected, found) = (self.rows.end, self.row);
                let reason = format!("expected {expected} messages, found {found}: the file has changed");
                LogFileError::Damaged { file: self.name, format: self.format, reason }
            }
            Ok(_) => return,
        };
        // Whoever waits is told; if nobody does there is nothing to tell.
        drop(self.sender.send(Err(fault)));
    }

    /// Sends the rows so far; a break if nobody waits for more, or if there is no going on.
    fn send(&mut self) -> ControlFlow<()> {
        let table = self.table();
        let is_fault = table.is_err();
        match self.sender.send(table).is_err() || is_fault {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn take(&mut self, received: i64, message: &Message<'_>) {
        self.row += 1;
        if self.row <= self.rows.start {
            return;
        }
        self.part.receipt.push(received);
        self.part.header.extend(message.stamp);
        self.part.columns.resize(self.layout.slots.iter().flatten().count(), Vec::new());
        for (number, column) in message.numbers.iter().zip(message.columns) {
            if let Some(Some(slot)) = self.layout.slots.get(*column) {
                self.part.columns[*slot].push(*number);
            }
        }
    }

    /// The rows that were read since the last block.
    fn table(&mut self) -> Sent {
        let part = std::mem::take(&mut self.part);
        let count = part.receipt.len();
        let rows = self.row - count..self.row;
        let mut builder = TableBuilder::of_part(&self.name, rows, self.origins.take(), &self.options)?;
        let header = if self.layout.has_headers { part.header } else { vec![0; count] };
        let (header, receipt) = (Values::Whole(header), Values::Whole(part.receipt));
        let columns: Vec<Values> = part.columns.into_iter().map(Values::Float).collect();
        let all = self.layout.names.iter().zip(&self.layout.places).zip(&self.layout.is_time);
        for ((name, place), is_time) in all {
            let values = match place {
                Place::Stamp(Clock::Header) => &header,
                Place::Stamp(Clock::Receipt) => &receipt,
                Place::Slot(slot) => &columns[*slot],
            };
            let missing = if *is_time { Missing::Error } else { self.missing };
            builder.add(name, values, 0, 1, *is_time, missing)?;
        }
        let table = builder.finish(String::new());
        self.origins = Some(table.origin.clone());
        Ok(table)
    }
}
