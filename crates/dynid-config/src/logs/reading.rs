//! From the file of a log to a table and the meaning of its columns.

use std::path::Path;

use dynid_identify::Error;
use dynid_logs::columns::{ChannelSpec, ClockStart, EffortColumn, columns_of_unnamed, is_time_name};
use dynid_logs::log::{self, LogFormat, Missing, TableBlocks, Wanted};
use dynid_logs::{
    ColumnMapping, LogHeader, LogOptions, LogSource, MappingError, MappingSpec, ReadingNote, Signals, Table,
};
use dynid_model::journal_channels;

use super::{LogAxis, names};
use crate::config::LogConfig;

/// A log as a table, with the meaning of its columns.
#[derive(Debug)]
pub(super) struct Understood {
    pub table: Table,
    pub mapping: ColumnMapping,
    /// What was found out about how to read it.
    pub notes: Vec<ReadingNote>,
}

/// Reads the columns of a log that its robot needs. `motors`: positions may be those of motors before their gears.
pub(super) fn understand(
    log: &LogConfig,
    axes: &[LogAxis],
    spec: &MappingSpec,
    motors: bool,
) -> Result<Understood, Error> {
    let Assigned { text, mapping, unnamed } = assigned(log, axes, spec, &spec.options(log.rows))?;
    let (table, mut notes) = text.read(&mapping.wanted())?;
    notes.extend(unnamed);
    Understood::new(log, axes, table, mapping, notes, motors)
}

/// A log that is read so many rows at a time, whatever its length.
pub(super) struct InBlocks {
    pub(super) blocks: Box<dyn TableBlocks>,
    pub(super) mapping: ColumnMapping,
    /// What was found out before a row was read.
    pub(super) notes: Vec<ReadingNote>,
}

/// Opens the columns of a log that its robot needs.
pub(super) fn in_blocks(
    log: &LogConfig,
    axes: &[LogAxis],
    spec: &MappingSpec,
    rows: usize,
) -> Result<InBlocks, Error> {
    let mut options = spec.options(log.rows);
    // What is not held needs no bound; how hard it is compressed keeps its own.
    options.read.max_bytes = u64::MAX;
    let Assigned { text, mapping, unnamed } = assigned(log, axes, spec, &options)?;
    let blocks = text.blocks(&mapping.wanted(), rows)?;
    let notes = blocks.notes().iter().cloned().chain(unnamed).collect();
    Ok(InBlocks { blocks, mapping, notes })
}

/// A log whose columns are assigned, before its rows are read.
struct Assigned {
    text: Box<dyn LogSource>,
    mapping: ColumnMapping,
    /// How columns without names were told.
    unnamed: Option<ReadingNote>,
}

fn assigned(
    log: &LogConfig,
    axes: &[LogAxis],
    spec: &MappingSpec,
    options: &LogOptions,
) -> Result<Assigned, Error> {
    let named = |source| columns_error(&log.path, source);
    let text = log::open(&log.path, options)?;
    let header = text.header();
    let (mut spec, text, unnamed) = match of_unnamed(log, &header, axes, spec)? {
        Some((found, note)) => (found, text, Some(note)),
        None => (spec.clone(), text, None),
    };
    add_probes(&mut spec, &header, axes);
    let mapping = map_columns(&header, axes, &spec).map_err(named)?;
    if spec.position.is_none() {
        super::check_surplus(&mapping, &names(axes), &header.names, &log.path.display().to_string())?;
    }
    super::check_gains(&spec, axes.len())?;
    Ok(Assigned { text, mapping, unnamed })
}

/// Offsets of journals are known by the names of their channels ([`journal_channels`]).
fn add_probes(spec: &mut MappingSpec, header: &LogHeader, axes: &[LogAxis]) {
    for name in axes.iter().flat_map(|axis| journal_channels(&axis.name)) {
        if header.names.contains(&name) {
            let own = ChannelSpec { column: name.clone(), scale: 1.0, offset: 0.0 };
            spec.channels.entry(name).or_insert(own);
        }
    }
}

impl Understood {
    /// Of a table that was read, whose time is in the unit that it must be.
    pub(super) fn new(
        log: &LogConfig,
        axes: &[LogAxis],
        table: Table,
        mapping: ColumnMapping,
        notes: Vec<ReadingNote>,
        motors: bool,
    ) -> Result<Self, Error> {
        let mut understood = Understood { table, mapping, notes };
        let settled = understood.settle(motors || axes.iter().any(|a| a.motor));
        settled.map_err(|source| columns_error(&log.path, source))?;
        Ok(understood)
    }

    /// Finds the unit of the time.
    fn settle(&mut self, motors: bool) -> Result<(), MappingError> {
        if let Some(found) = self.mapping.settle_time(&self.table, motors)? {
            let column = self.mapping.time_columns().first().map_or("", |c| c.name.as_str());
            let value = format!("`{column}` in {}, {:.4} Hz", found.unit, found.rate_hz);
            self.notes.push(ReadingNote::new("time", value, found.reason));
        } else if let [seconds, rest @ ..] = self.mapping.time_columns()
            && !rest.is_empty()
        {
            let others: Vec<String> = rest.iter().map(|c| format!("`{}`", c.name)).collect();
            let value = format!("`{}` + {}", seconds.name, others.join(" + "));
            self.notes.push(ReadingNote::new("time", value, "whole seconds and their fractions are apart"));
        }
        Ok(())
    }

    /// Signals of the log, and what became of rows without a value.
    pub(super) fn signals(&mut self) -> Result<Signals, MappingError> {
        self.first_signals(&mut ClockStart::default())
    }

    /// [`Understood::signals`] of the first rows of a log, where its clock starts.
    pub(super) fn first_signals(&mut self, start: &mut ClockStart) -> Result<Signals, MappingError> {
        let signals = self.mapping.extract_block(&self.table, start)?;
        let sparse = &signals.sparse;
        if !sparse.columns.is_empty() {
            let most = sparse.columns.iter().max_by_key(|(_, count)| *count);
            let reason = most.map_or_else(String::new, |(name, count)| {
                format!("`{name}` has no value in {count} of {} rows", self.table.rows)
            });
            let value = match self.mapping.missing {
                Missing::Interpolate => {
                    let held = match sparse.held {
                        0 => String::new(),
                        held => format!(", {held} of commands held"),
                    };
                    format!(
                        "interpolate, {} values{held}; {} rows left out",
                        sparse.interpolated, sparse.left_out
                    )
                }
                _ => format!("drop, {} of {} rows left out", sparse.left_out, self.table.rows),
            };
            self.notes.push(ReadingNote::new("missing values", value, reason));
        }
        Ok(signals)
    }
}

/// Rows of a file without a header that tell its columns.
const ROWS_THAT_TELL: usize = 1 << 17;

/// Columns of a file without a header, where its numbers tell them.
fn of_unnamed(
    log: &LogConfig,
    header: &LogHeader,
    axes: &[LogAxis],
    spec: &MappingSpec,
) -> Result<Option<(MappingSpec, ReadingNote)>, Error> {
    let stated = spec.position.is_some() || spec.effort.is_some() || spec.time.is_some();
    if !header.unnamed || stated || spec.rate_hz.is_some() {
        return Ok(None);
    }
    let all = Wanted { columns: None, time: vec![0], missing: Missing::Error };
    let mut rows = log::open(&log.path, &spec.options(log.rows))?.blocks(&all, ROWS_THAT_TELL)?;
    let Some(table) = rows.next_block()? else { return Ok(None) };
    let found = columns_of_unnamed(&table, axes.len()).map_err(|e| columns_error(&log.path, e))?;
    let merged = MappingSpec {
        time: found.time.clone(),
        position: found.position.clone(),
        velocity: found.velocity.clone(),
        effort: found.effort.clone(),
        ..spec.clone()
    };
    let mapping = map_columns(header, axes, &merged).map_err(|e| columns_error(&log.path, e))?;
    let shown = |list: Option<&Vec<Option<dynid_logs::columns::ColumnUse>>>| {
        let names: Vec<&str> = list.into_iter().flatten().flatten().map(|c| c.name.as_str()).collect();
        names.join(" ")
    };
    let value = format!(
        "position {}, velocity {}, effort {}",
        shown(Some(&mapping.position)),
        shown(mapping.velocity.as_ref()),
        shown(mapping.effort.as_ref())
    );
    let reason = "one block of columns is the rate of another, the third must be the effort; joints in the order of the robot";
    Ok(Some((merged, ReadingNote::new("columns", value, reason))))
}

/// A log as a table of all its columns that hold numbers.
#[derive(Debug)]
pub struct WholeTable {
    /// Numbers; cells without a value are NaN where rows without one are not refused.
    pub table: Table,
    /// The columns of the table.
    pub header: LogHeader,
    /// Columns that hold texts.
    pub texts: Vec<String>,
    /// What was found out about how to read it.
    pub notes: Vec<ReadingNote>,
}

/// Reads all columns of a log that hold numbers.
///
/// # Errors
/// [`Error::LogFile`].
pub fn table(log: &LogConfig, spec: &MappingSpec) -> Result<WholeTable, Error> {
    let source = log::open(&log.path, &spec.options(log.rows))?;
    let header = source.header();
    let missing = spec.missing.unwrap_or(header.format.map_or(Missing::Error, LogFormat::missing));
    let columns: Vec<usize> = (0..header.names.len()).filter(|k| !header.text[*k]).collect();
    let stated = spec.time_names();
    let is_time = |k: &usize| {
        header.time.contains(k) || stated.contains(&header.names[*k]) || is_time_name(&header.names[*k])
    };
    let time = columns.iter().copied().filter(is_time).collect();
    let (table, notes) = source.read(&Wanted { columns: Some(columns.clone()), time, missing })?;
    let texts: Vec<String> =
        (0..header.names.len()).filter(|k| header.text[*k]).map(|k| header.names[k].clone()).collect();
    Ok(WholeTable { table, header: header.without(&texts), texts, notes })
}

/// Columns of a robot's signals. The sign of torque sensors is that of efforts from here on.
pub fn map_columns(
    header: &LogHeader,
    axes: &[LogAxis],
    spec: &MappingSpec,
) -> Result<ColumnMapping, MappingError> {
    let efforts: Vec<EffortColumn> = axes.iter().map(|a| a.effort).collect();
    ColumnMapping::of_log(header, &names(axes), &efforts, spec)
}

fn columns_error(path: &Path, source: MappingError) -> Error {
    Error::Columns { file: path.display().to_string(), source: Box::new(source) }
}
