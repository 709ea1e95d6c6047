//! Rows that come one after the other, as windows of the grid of their log.

use std::ops::Range;

use dynid_motion::clock::{GridRows, GridSamples};
use dynid_motion::{Channel, ClockReport, Portion};
use dynid_rows::conditioning::{ConditioningError, Window};

use crate::Error;

/// Rows that are laid on the grid at a time.
const AT_ONCE: usize = 1 << 12;

/// A window of a log.
pub(super) struct Stretch {
    /// Sample of the log that the window begins with.
    pub(super) from: usize,
    /// Samples whose rows are those of this window and of no other.
    pub(super) core: Range<usize>,
    pub(super) window: Window,
}

/// Where windows lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// Samples of a core.
    pub(super) samples: usize,
    /// Samples on either side of it.
    pub(super) overlap: usize,
    /// Windows begin at multiples of this.
    pub(super) grid: usize,
}

/// Gives the windows of a log in their order; they are the same however its rows are portioned.
pub(super) struct Windows<I> {
    log: String,
    rest: I,
    layout: Layout,
    /// Per output: place of its joint among those of the log.
    joints: Vec<usize>,
    /// Rows that were read and not yet laid from the place on.
    held: Portion,
    laid: usize,
    /// Rows that were read.
    rows: usize,
    grid: Option<GridRows>,
    /// Samples from `base` on that windows still need.
    buffer: GridSamples,
    base: usize,
    /// Where the next core begins.
    next: usize,
    clock: Option<ClockReport>,
}

impl<I: Iterator<Item = Result<Portion, Error>>> Windows<I> {
    /// `held`: the first rows; `joints`: per output, the place of its joint.
    pub(super) fn new(
        log: &str,
        grid: GridRows,
        layout: Layout,
        joints: Vec<usize>,
        held: Portion,
        rest: I,
    ) -> Self {
        Windows {
            log: log.to_owned(),
            rest,
            layout,
            joints,
            laid: 0,
            rows: held.rows(),
            held,
            grid: Some(grid),
            buffer: GridSamples::default(),
            base: 0,
            next: 0,
            clock: None,
        }
    }

    /// The next window; `None` behind the last one.
    ///
    /// # Errors
    /// What reading gives; [`Error::Log`] for rows that do not follow the others; [`Error::Conditioning`] for a clock beyond repair.
    pub(super) fn next(&mut self) -> Result<Option<Stretch>, Error> {
        let Layout { samples, overlap, grid } = self.layout;
        let end = self.next + samples;
        while self.clock.is_none() && self.end() < end + overlap {
            self.lay()?;
        }
        let core = self.next..end.min(self.end());
        if core.is_empty() {
            return Ok(None);
        }
        let from = core.start.saturating_sub(overlap) / grid * grid;
        let to = (core.end + overlap).min(self.end());
        let gone = from - self.base;
        self.buffer.columns.iter_mut().for_each(|column| drop(column.drain(..gone)));
        self.buffer.usable.drain(..gone);
        (self.base, self.next) = (from, core.end);
        let outputs = self.joints.len();
        let mut columns = self.buffer.columns.iter().map(|column| column[..to - from].to_vec());
        let position = columns.by_ref().take(outputs).collect();
        let effort = columns.by_ref().take(outputs).collect();
        let names = self.held.channels.iter().map(|channel| channel.name.clone());
        let channels = names.zip(columns).map(|(name, values)| Channel { name, values }).collect();
        let usable = self.buffer.usable[..to - from].to_vec();
        Ok(Some(Stretch { from, core, window: Window { position, effort, channels, usable } }))
    }

    /// Samples so far.
    pub(super) fn end(&self) -> usize {
        self.base + self.buffer.usable.len()
    }

    /// What was found about the clock, once the last window was given.
    pub(super) fn clock(&self) -> Option<&ClockReport> {
        self.clock.as_ref()
    }

    /// Rows of the log so far.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Lays the next rows on the grid.
    fn lay(&mut self) -> Result<(), Error> {
        while self.laid == self.held.rows() {
            let Some(portion) = self.rest.next().transpose()? else {
                self.clock = self.grid.take().map(|grid| grid.finish(&mut self.buffer));
                return Ok(());
            };
            portion.check_behind(&self.held, &self.log, self.rows)?;
            self.rows += portion.rows();
            (self.held, self.laid) = (portion, 0);
        }
        let rows = self.laid..(self.laid + AT_ONCE).min(self.held.rows());
        let joints = || self.joints.iter().map(|k| &self.held.joints[*k]);
        let columns: Vec<&[f64]> = joints()
            .map(|joint| &joint.position[rows.clone()])
            .chain(joints().map(|joint| &joint.effort[rows.clone()]))
            .chain(self.held.channels.iter().map(|channel| &channel.values[rows.clone()]))
            .collect();
        if let Some(grid) = &mut self.grid {
            let laid = grid.push(&self.held.time[rows.clone()], &columns, &mut self.buffer);
            laid.map_err(ConditioningError::Clock)?;
        }
        self.laid = rows.end;
        Ok(())
    }
}
