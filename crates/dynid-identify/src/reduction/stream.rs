//! Logs of any length, reduced window by window in one pass.

use std::ops::Range;

use dynid_factor::FactorError;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{BlockReducer, GroupShape, RowSource, RowVisitor, Rows, visit_all};
use dynid_motion::clock::GridRows;
use dynid_motion::{Channel, Portion, log::moves};
use dynid_rows::conditioning::{
    Conditioning, ConditioningSettings, LogRows, PreparedLog, Recall, RecordFigures, least_block_samples,
};

use super::Recipe;
use super::reduce::{Examined, Rest};
use super::windows::{Layout, Stretch, Windows};
use super::{LogFacts, ReducedFinding, ReducedLog, Reducer, RowSums};
use crate::Error;
use crate::caution::{self, Caution};
use crate::finding::{FindingId, Severity};
use crate::fitting::conditioning_fault;
use crate::log::Log;
use crate::log::turns::Unwrapped;
use crate::problem::Problem;
use crate::settings::LogSettings;
use crate::trained_log::{TrainedLog, velocities_in};

/// Parts at the beginning of a log of which one is looked at.
const PARTS: usize = 4;
/// Values of a channel that are kept of a log.
const KEPT_VALUES: usize = 1 << 16;

impl Reducer {
    /// Whether logs of these settings can be reduced window by window: not those of a stated period, of mechanisms with loops or journals, or with encoders
    /// on both sides of gears.
    pub fn in_windows(&self, settings: &LogSettings) -> bool {
        let model = &self.problem.model;
        let whole = self.recipe.springs.is_some() || model.closed().is_some() || model.journals().is_some();
        settings.period_s.is_none() && !whole
    }

    /// Reduces a log that comes in parts, in one pass and in memory that does not grow with it.
    ///
    /// `first`: the first rows, with what is to be known of the log; `rest`: the rows behind them, of the same signals, as they are in
    /// [`Log::of_axes`], full turns taken out ([`crate::log::turns::Unwrapper`]). How rows are portioned does not matter.
    ///
    /// A log of at most [`WindowSettings::part_rows`](super::WindowSettings::part_rows) is reduced as [`Reducer::reduce`] does, with the same
    /// bits. Of a longer one a part is examined: the first one in which all joints move that moved in the logs of the recipe, of the first
    /// four; else that of them in which most do. It tells the sample rate, noise, the speeds behind the masks and what is a spike, and the
    /// pre-flight looks at it alone. The log is then conditioned in windows that overlap by what filters, kernels and spikes reach, so that rows
    /// are those of the whole. Its time blocks are the least ones times the power of two that leaves no more than the recipe says.
    ///
    /// # Errors
    /// As [`Reducer::reduce`]; what `rest` gives; [`Error::Log`] for rows of other signals, or numbers that are not finite.
    pub fn reduce_blocks<I>(&self, first: Log, rest: I) -> Result<ReducedLog, Error>
    where
        I: IntoIterator<Item = Result<Portion, Error>>,
        I::IntoIter: Send,
    {
        let mut rest = rest.into_iter();
        let rows = self.windows.part_rows;
        let in_windows = self.in_windows(&first.settings);
        let mut examining = None;
        let mut log = first.map_signals(|signals| {
            let name = signals.name().to_owned();
            let mut held = Portion::of(signals);
            gather(&mut held, &mut rest, &name, if in_windows { rows + 1 } else { usize::MAX })?;
            if held.rows() <= rows || !in_windows {
                return Ok::<_, Error>(held.into_log(name)?);
            }
            let from = self.part_of(&mut held, &mut rest, &name)?;
            let part = from..from + rows;
            let looked_at = held.part(part.clone()).into_log(name)?;
            examining = Some((part, held));
            Ok(looked_at)
        })?;
        let Some((part, held)) = examining else { return self.reduce_whole(log) };
        log.source.rows = data_rows(&log.source.rows, part.clone());
        self.reduce_windows(log, Examining { part, held, rest })
    }

    /// Where the part of a log begins that is looked at.
    fn part_of(
        &self,
        held: &mut Portion,
        rest: &mut impl Iterator<Item = Result<Portion, Error>>,
        log: &str,
    ) -> Result<usize, Error> {
        let rows = self.windows.part_rows;
        let outputs = self.recipe.outputs.iter().zip(&self.recipe.velocities);
        let wanted: Vec<&str> = outputs
            .filter(|(_, velocities)| velocities.is_some())
            .map(|(output, _)| output.name.as_str())
            .collect();
        let mut best = (0, 0);
        for k in 0..PARTS {
            gather(held, rest, log, (k + 1) * rows)?;
            let part = k * rows..(k + 1) * rows;
            if held.rows() < part.end {
                break;
            }
            let joints = held.joints.iter().filter(|joint| wanted.contains(&joint.name.as_str()));
            let moving = joints.filter(|joint| moves(&joint.position[part.clone()])).count();
            if moving > best.1 {
                best = (k, moving);
            }
            if moving == wanted.len() {
                break;
            }
        }
        Ok(best.0 * rows)
    }

    fn reduce_windows<I>(&self, log: Log, read: Examining<I>) -> Result<ReducedLog, Error>
    where
        I: Iterator<Item = Result<Portion, Error>> + Send,
    {
        let Examined { name, log, mut findings, mut prepared, conditioned, choices } = self.examine(log)?;
        let model = &self.problem.model;
        let state_hz = choices.state_hz[0];
        let figures = RecordFigures::of(&prepared, model, state_hz, &conditioned)?;
        let delay = choices.delay.samples;
        let reach = figures.overlap(&choices.scales_hz, state_hz, delay, &conditioned)?;
        let layout = Layout { samples: self.windows.samples, overlap: reach.overlap, grid: reach.grid };
        let laid = GridRows::new(&prepared.name, &conditioned.clock, figures.clock(), self.windows.part_rows);
        let place = |name: &String| read.held.joints.iter().position(|joint| joint.name == *name);
        let joints: Vec<usize> =
            self.recipe.outputs.iter().filter_map(|output| place(&output.name)).collect();
        // Samples of the part are gone with it: the windows bring them again.
        (prepared.position, prepared.effort) = (Vec::new(), Vec::new());
        (prepared.channels, prepared.usable) = (Vec::new(), Vec::new());
        prepared.start = read.held.time[0];
        let Examining { part, held, rest } = read;
        let mut windows = Windows::new(&prepared.name, laid, layout, joints, held, rest);
        let mut pass = Pass::new(self, &choices, &conditioned, &figures, reach.kernels, &prepared);
        let mut at_hand: Option<Stretch> = None;
        loop {
            // While a window is reduced, the next one is read.
            let (next, done) = rayon::join(
                || windows.next(),
                || at_hand.take().map_or(Ok(()), |stretch| pass.take(stretch)),
            );
            done?;
            at_hand = next?;
            if at_hand.is_none() {
                break;
            }
        }
        let rest = pass.finish(windows.end());
        prepared.moves.clone_from(&rest.0.trained.moves);
        prepared.channels = rest.1;
        if let Some(clock) = windows.clock() {
            prepared.clock = clock.clone();
        }
        findings.push(looked_at(&part, windows.rows()));
        let mut reduced = self.finish(name, log, findings, &prepared, rest.0)?;
        reduced.facts.cautions.extend(uneven(&prepared, &conditioned));
        Ok(reduced)
    }
}

impl LogFacts {
    /// Tells of positions that were unwrapped while the log was read.
    pub fn tell_unwrapped(&mut self, unwrapped: &[Unwrapped]) {
        let tell = |turns: &Unwrapped| {
            let remedy = "columns and units are stated under `[columns]`, before the log is reduced";
            Caution::warn(caution::LOG, format!("{}: {}", self.name, turns.words()), remedy)
        };
        let told: Vec<Caution> = unwrapped.iter().map(tell).collect();
        self.cautions.extend(told);
    }
}

/// What was read of a log, and the part of it that is looked at.
struct Examining<I> {
    part: Range<usize>,
    held: Portion,
    rest: I,
}

/// Reads on until so many rows are held, or no more come.
fn gather(
    held: &mut Portion,
    rest: &mut impl Iterator<Item = Result<Portion, Error>>,
    log: &str,
    rows: usize,
) -> Result<(), Error> {
    while held.rows() < rows
        && let Some(portion) = rest.next().transpose()?
    {
        portion.check_behind(held, log, held.rows())?;
        held.append(&portion);
    }
    Ok(())
}

/// Data rows of a part of a log. `known`: those of its first rows; empty: rows as they are.
fn data_rows(known: &[usize], part: Range<usize>) -> Vec<usize> {
    let last = known.last().copied().unwrap_or(0);
    part.map(|row| known.get(row).copied().unwrap_or(last + row + 1 - known.len())).collect()
}

/// What the pre-flight did not look at.
fn looked_at(part: &Range<usize>, rows: usize) -> ReducedFinding {
    ReducedFinding {
        id: FindingId::NotExamined,
        severity: Severity::Info,
        joint: None,
        evidence: format!(
            "of {rows} rows, those from {} to {} were examined, and told noise, spikes and the speeds behind the masks",
            part.start + 1,
            part.end
        ),
        remedy: "nothing: `dynid check` looks at a whole log".to_owned(),
    }
}

/// A clock that is less even than it was in the part that was looked at.
fn uneven(log: &PreparedLog, settings: &ConditioningSettings) -> Option<Caution> {
    let found = log.clock.jitter;
    (!log.clock.resampled && found >= settings.clock.jitter_limit).then(|| {
        let message = format!(
            "{}: steps of the clock vary by {found:.4} samples, which the part that was looked at does not show: rows were used as they are",
            log.name
        );
        Caution::warn(caution::LOG, message, "see whether the logger lost rows or was slowed down")
    })
}

/// The pass over the windows of a log.
struct Pass<'a> {
    problem: &'a Problem,
    name: &'a str,
    choices: &'a Conditioning,
    /// Windows are not cut into time blocks by themselves.
    settings: ConditioningSettings,
    figures: &'a RecordFigures,
    /// Samples that rows reach before a window.
    reach: usize,
    /// What elements remember before a sample of the log.
    recall: Recall,
    most_blocks: usize,
    recipe: &'a Recipe,
    blocks: Vec<(GroupShape, Blocks)>,
    trained: TrainedLog,
    channels: Vec<Thinned>,
}

impl<'a> Pass<'a> {
    fn new(
        reducer: &'a Reducer,
        choices: &'a Conditioning,
        conditioned: &ConditioningSettings,
        figures: &'a RecordFigures,
        reach: usize,
        part: &'a PreparedLog,
    ) -> Self {
        // Rungs above those of the recipe are nobody's.
        let mut settings = ConditioningSettings { most_blocks: Some(1), ..conditioned.clone() };
        settings.ladder.truncate(choices.rung.iter().copied().max().unwrap_or(0));
        Pass {
            problem: &reducer.problem,
            name: &part.name,
            choices,
            settings,
            figures,
            reach,
            recall: Recall::default(),
            most_blocks: reducer.recipe.blocks.most.max(1),
            recipe: &reducer.recipe,
            blocks: Vec::new(),
            trained: TrainedLog::of_moves(part),
            channels: Vec::new(),
        }
    }

    fn take(&mut self, stretch: Stretch) -> Result<(), Error> {
        let Stretch { from, core, window } = stretch;
        let prepared = PreparedLog::of_window(self.name, window, self.figures, &self.settings)?;
        self.look(&prepared, core.start - from..core.end - from);
        let Problem { model, structure, .. } = self.problem;
        let logs = std::slice::from_ref(&prepared);
        let (shape, kept) = (&structure.shape, &structure.base.kept);
        let rows = LogRows::new(model, shape, kept, logs, self.choices, &self.settings)?;
        let rows = if self.recipe.has_delays() { rows.with_delay_columns()? } else { rows };
        // From where the rows of this window begin: states there are free of the ends of this window and of the one before.
        let Recall { sample, history } = std::mem::take(&mut self.recall);
        let rows = rows.recalling(vec![Recall { sample: sample.saturating_sub(from), history }]);
        let next = core.end.saturating_sub(self.reach);
        self.recall = Recall { sample: next, history: rows.history_at(0, next.saturating_sub(from)) };
        if self.blocks.is_empty() {
            let length = least_block_samples(self.choices.kernel_hz, prepared.rate_hz, &self.settings);
            let blocks = |shape: &GroupShape| {
                (shape.clone(), Blocks::new(shape.columns.len(), length, self.most_blocks))
            };
            self.blocks = rows.groups().iter().map(blocks).collect();
        }
        let mut cores: Vec<CoreRows<'_>> =
            self.blocks.iter_mut().map(|(_, blocks)| CoreRows { blocks, from, core: core.clone() }).collect();
        visit_all(&rows, &mut cores).map_err(|e| conditioning_fault(&rows, e))
    }

    /// Takes down what is to be known of the core of a window.
    fn look(&mut self, log: &PreparedLog, core: Range<usize>) {
        for (output, position) in log.position.iter().enumerate() {
            self.trained.moves[output] = self.trained.moves[output] || moves(&position[core.clone()]);
            let found = velocities_in(log, output, core.clone());
            let range = &mut self.trained.velocities[output];
            *range = match (*range, found) {
                (Some((low, high)), Some((least, most))) => Some((low.min(least), high.max(most))),
                (known, found) => known.or(found),
            };
        }
        self.channels.resize_with(log.channels.len(), Thinned::default);
        for (kept, channel) in self.channels.iter_mut().zip(&log.channels) {
            kept.add(&channel.name, &channel.values[core.clone()]);
        }
    }

    /// What is left of a log of so many samples, and its channels at some samples.
    fn finish(self, samples: usize) -> (Rest, Vec<Channel>) {
        let mut efforts = vec![RowSums::NONE; self.recipe.outputs.len()];
        let mut groups = Vec::with_capacity(self.blocks.len());
        for (shape, blocks) in self.blocks {
            if shape.scale == 0 {
                efforts[shape.output] = blocks.sums;
            }
            groups.push(self.recipe.coarsened(&blocks.finish(shape, samples)));
        }
        let mut trained = self.trained;
        for (velocities, moves) in trained.velocities.iter_mut().zip(&trained.moves) {
            *velocities = velocities.filter(|_| *moves);
        }
        trained.samples = samples;
        trained.duration_s = samples as f64 / trained.rate_hz;
        trained.channels = self.channels.iter().map(|c| (c.name.clone(), c.least, c.greatest)).collect();
        let kept = |c: Thinned| Channel { name: c.name, values: c.values };
        (Rest { groups, efforts, trained }, self.channels.into_iter().map(kept).collect())
    }
}

/// A channel at every so many samples.
struct Thinned {
    name: String,
    least: f64,
    greatest: f64,
    stride: usize,
    samples: usize,
    values: Vec<f64>,
}

impl Default for Thinned {
    fn default() -> Self {
        let (least, greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        Thinned { name: String::new(), least, greatest, stride: 1, samples: 0, values: Vec::new() }
    }
}

impl Thinned {
    fn add(&mut self, name: &str, values: &[f64]) {
        name.clone_into(&mut self.name);
        for x in values {
            (self.least, self.greatest) = (self.least.min(*x), self.greatest.max(*x));
            if self.samples.is_multiple_of(self.stride) {
                self.values.push(*x);
            }
            self.samples += 1;
            if self.values.len() > KEPT_VALUES {
                let mut place = 0;
                self.values.retain(|_| {
                    place += 1;
                    place % 2 == 1
                });
                self.stride *= 2;
            }
        }
    }
}

/// Time blocks of a group of rows whose log may be of any length: they are as long as they must be for there to be no more than so many.
struct Blocks {
    reducer: BlockReducer,
    sums: RowSums,
    /// Samples of a block.
    length: usize,
    most: usize,
}

impl Blocks {
    fn new(columns: usize, length: usize, most: usize) -> Self {
        Blocks { reducer: BlockReducer::new(columns), sums: RowSums::NONE, length, most }
    }

    /// Makes room for a sample of the log.
    fn reach(&mut self, sample: usize) {
        while sample / self.length >= self.most {
            self.reducer.pair();
            self.length *= 2;
        }
    }

    fn finish(mut self, shape: GroupShape, samples: usize) -> ReducedGroup {
        self.reach(samples.saturating_sub(1));
        // What is left behind the last whole block belongs to it.
        let blocks = (samples / self.length).max(1);
        self.reducer.finish(&GroupShape { blocks, ..shape })
    }
}

/// Takes the rows of a window that are centred in its core.
struct CoreRows<'a> {
    blocks: &'a mut Blocks,
    from: usize,
    core: Range<usize>,
}

impl RowVisitor for CoreRows<'_> {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        let from = self.from;
        let mut start = rows.samples.partition_point(|sample| sample + from < self.core.start);
        let end = rows.samples.partition_point(|sample| sample + from < self.core.end);
        while start < end {
            let first = rows.samples[start] + from;
            self.blocks.reach(first);
            let (length, block) = (self.blocks.length, first / self.blocks.length);
            let count = rows.samples[start..end].partition_point(|sample| (sample + from) / length == block);
            let part = Rows {
                block,
                samples: &rows.samples[start..start + count],
                regressor: &rows.regressor[start..],
                stride: rows.stride,
                effort: &rows.effort[start..start + count],
            };
            self.blocks.reducer.push(&part, None)?;
            part.effort.iter().for_each(|effort| self.blocks.sums.add(*effort));
            start += count;
        }
        Ok(())
    }
}
