//! Logs of any length, read part by part.

use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_identify::estimate::{InputKind, InputRecord};
use dynid_identify::log::turns::{Unwrapped, Unwrapper};
use dynid_identify::log::{Log, LogAxis, check_behind, portion};
use dynid_identify::reduction::ReductionError;
use dynid_logs::columns::ClockStart;
use dynid_logs::log::{Missing, TableBlocks};
use dynid_logs::{ColumnMapping, MappingSpec, Table};
use dynid_motion::Portion;

use super::reading::{self, InBlocks, Understood};
use super::{check, columns_error, finish, names, of_signals, state_temperatures, to_joint_side};
use crate::config::{LogConfig, MotorSide};

/// Rows that are read at a time: their columns stay in the second-level cache.
const BLOCK_ROWS: usize = 1 << 12;

/// A log, or the beginning of a long one.
pub enum Opened {
    /// As [`super::load`] gives it.
    Whole(Box<Log>),
    /// The first rows, and those behind them.
    Long(Box<Log>, Box<Portions>),
}

/// Whether a log can be read part by part: not if a share of its rows is wanted, or if values are missing whose neighbours may lie in another part.
fn in_parts(config: &LogConfig, spec: &MappingSpec) -> bool {
    let LogConfig { part, trajectory, leave_out, drop_repeated, .. } = config;
    part.is_none()
        && trajectory.is_none()
        && leave_out.is_empty()
        && !drop_repeated
        && spec.missing != Some(Missing::Interpolate)
}

/// Reads a log as [`super::load`] does, and no more than the first rows of one that has more than `rows`.
///
/// # Errors
/// As [`super::load`].
pub fn open(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
    rows: usize,
) -> Result<Opened, Error> {
    let spec = config.columns.as_ref().unwrap_or(run_columns);
    if !in_parts(config, spec) {
        return Ok(Opened::Whole(Box::new(super::load(config, axes, run_columns, motor_side)?)));
    }
    let InBlocks { mut blocks, mapping, mut notes } = reading::in_blocks(config, axes, spec, BLOCK_ROWS)?;
    let mut first = blocks.next_block()?;
    let mut is_whole = first.is_none();
    while let Some(table) = first.as_mut().filter(|table| table.rows <= rows) {
        match blocks.next_block()? {
            Some(more) => append(table, more),
            None => {
                is_whole = true;
                break;
            }
        }
    }
    let Some(mut table) = first else { unreachable!("a log without rows is refused") };
    let mut rest = Some(blocks);
    if is_whole && let Some(blocks) = rest.take() {
        let (sha256, found) = blocks.finish()?;
        table.sha256 = sha256;
        let new: Vec<_> = found.into_iter().filter(|note| !notes.contains(note)).collect();
        notes.extend(new);
    }
    let file = config.path.display().to_string();
    let mut clock = ClockStart::default();
    let mut understood = Understood::new(config, axes, table, mapping, notes, motor_side.is_some())?;
    let signals = understood.first_signals(&mut clock).map_err(|source| columns_error(config, source))?;
    let motors = motor_side.map(|side| (side.clone(), Unwrapper::behind(&signals, axes)));
    let read = of_signals(config, axes, spec, motor_side, understood, signals)?;
    check(&read.signals, axes, &file)?;
    let turns = Unwrapper::behind(&read.signals, axes);
    let mapping = read.mapping.clone();
    let log = Box::new(finish(config, &file, read, axes)?);
    let Some(blocks) = rest else { return Ok(Opened::Whole(log)) };
    let joints = names(axes);
    let (config, digest) = (config.clone(), None);
    let portions =
        Portions { config, file, joints, blocks: Some(blocks), digest, mapping, clock, motors, turns };
    Ok(Opened::Long(log, Box::new(portions)))
}

fn append(table: &mut Table, more: Table) {
    table.rows += more.rows;
    table.columns.iter_mut().zip(more.columns).for_each(|(column, more)| column.extend(more));
}

/// The rows of a log behind its first ones.
pub struct Portions {
    config: LogConfig,
    file: String,
    joints: Vec<String>,
    blocks: Option<Box<dyn TableBlocks>>,
    /// Of the whole file, once its last row was read.
    digest: Option<String>,
    mapping: ColumnMapping,
    clock: ClockStart,
    motors: Option<(MotorSide, Unwrapper)>,
    turns: Unwrapper,
}

impl Iterator for Portions {
    type Item = Result<Portion, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}

impl Portions {
    fn read(&mut self) -> Result<Option<Portion>, Error> {
        let Some(mut blocks) = self.blocks.take() else { return Ok(None) };
        let Some(table) = blocks.next_block()? else {
            self.digest = Some(blocks.finish()?.0);
            return Ok(None);
        };
        self.blocks = Some(blocks);
        let signals = self.mapping.extract_block(&table, &mut self.clock);
        let mut signals = signals.map_err(|source| columns_error(&self.config, source))?;
        let log = || self.file.clone();
        let turned = |(joint, row)| Error::from(ReductionError::Turns { log: log(), joint, row });
        if let Some((side, turns)) = &mut self.motors {
            turns.unwrap(&mut signals).map_err(turned)?;
            to_joint_side(&mut signals, side)?;
        }
        state_temperatures(&mut signals, &self.config, &self.joints)?;
        check_behind(&signals, &self.file, table.first_row - 1)?;
        self.turns.unwrap(&mut signals).map_err(turned)?;
        Ok(Some(portion(signals)))
    }

    /// The file that was read to its end.
    pub fn inputs(&self) -> Vec<InputRecord> {
        let of_file = |sha256: &String| SourceFile { path: self.file.clone(), sha256: sha256.clone() };
        self.digest.iter().map(|sha256| InputRecord::of(InputKind::Log, &of_file(sha256))).collect()
    }

    /// Positions that were unwrapped, of all rows so far.
    pub fn unwrapped(&self) -> Vec<Unwrapped> {
        let motors = self.motors.iter().flat_map(|(_, turns)| turns.unwrapped());
        motors.chain(self.turns.unwrapped()).collect()
    }
}
