//! Rows of a stream: states, regressor and compact kernel, some samples behind.

use std::sync::Arc;

use dynid_model::{EffortModel, History, MotionBlock, RegressorBlock};
use dynid_motion::live::{LiveBlock, LiveSettings, LiveStates};
use dynid_motion::{Kernel, SignalError};
use dynid_words::Transfer;

use super::rows::KeptColumns;

/// How samples of a stream become rows.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveRowSettings {
    /// Grid, state filter, delay.
    pub states: LiveSettings,
    /// Cut-off of the kernel that columns and effort pass, Hz.
    pub kernel_hz: f64,
    /// Per output: least speed of each of its reversal speeds ([`EffortModel::reversal_speeds`], rad/s or m/s); slower samples,
    /// and those next to a change of sign, spoil every row over them. Empty: no mask.
    pub least_speed: Vec<Vec<f64>>,
}

/// A sample of rows: what all outputs tell at one time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LiveRow {
    /// Time, s.
    pub time: f64,
    /// Per output: base columns through the kernel; zeros where the row is not usable.
    pub columns: Vec<Vec<f64>>,
    /// Per output: effort less what the model knows of it, through the kernel.
    pub effort: Vec<f64>,
    /// Per output: whether nothing unusable lies under the row.
    pub usable: Vec<bool>,
}

/// Samples whose regressor is formed at a time.
const BLOCK: usize = 64;
/// Shorter blocks are padded: single samples take another path through the regressor, with other last digits.
const PADDED: usize = 8;
/// Most elements of a model that a checkpoint is believed.
const MOST_ELEMENTS: usize = 100_000;

/// Forms rows of an effort model from grid samples: positions, efforts, then channels in the order of the model's.
///
/// Rows are formed like those of a log ([`super::LogRows`]), but with a state filter that looks a few samples ahead only
/// ([`dynid_motion::live::LocalPolynomial`]) and without narrower kernels between masked samples. Rows are a quarter of
/// `1 / kernel_hz` apart and appear [`LiveRows::lag_s`] after their time. They depend on the samples alone, never on how these
/// were handed over.
pub struct LiveRows {
    model: Arc<dyn EffortModel>,
    shape: Vec<f64>,
    columns: KeptColumns,
    states: LiveStates,
    kernel: Kernel,
    spacing: usize,
    /// Samples that the state filter smears a reversal over.
    inner: usize,
    rate_hz: f64,
    /// Per output.
    reversals: Vec<Vec<Reversal>>,
    block: LiveBlock,
    regressor: RegressorBlock,
    history: History,
    /// Where in the window the next row is centred.
    centre: usize,
    time: Vec<f64>,
    /// Column after column, output after output; the net effort follows an output's columns.
    window: Vec<Vec<f64>>,
    /// Per output and sample: a reversal.
    bad: Vec<Vec<bool>>,
    row: LiveRow,
}

/// A speed whose change of sign spoils rows.
struct Reversal {
    /// `Σ factor · rate`.
    speed: Vec<(usize, f64)>,
    /// Slower samples spoil them too.
    least: f64,
    /// Sign of the last sample.
    sign: f64,
}

impl std::fmt::Debug for LiveRows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LiveRows")
            .field("columns", &self.columns.total)
            .field("kernel", &self.kernel.cutoff_hz())
            .finish_non_exhaustive()
    }
}

impl LiveRows {
    /// Rows of the base columns `kept` (ascending) of a model at given shape parameters.
    ///
    /// # Errors
    /// [`SignalError`] for a rate, a cut-off or a delay without sense.
    ///
    /// # Panics
    /// If `shape` or `least_speed` have the wrong length.
    pub fn new(
        model: Arc<dyn EffortModel>,
        shape: &[f64],
        kept: &[usize],
        settings: &LiveRowSettings,
    ) -> Result<LiveRows, SignalError> {
        let outputs = model.outputs().len();
        assert_eq!(shape.len(), model.parameters().shape.len(), "length of shape");
        assert_eq!(settings.least_speed.len(), outputs, "least speeds, one list per output");
        let states = LiveStates::new(outputs, model.channels().len(), &settings.states)?;
        let kernel = Kernel::new(settings.kernel_hz, settings.states.rate_hz)?;
        let reversals = (0..outputs)
            .map(|output| {
                let speeds = model.reversal_speeds(output).into_iter().zip(&settings.least_speed[output]);
                speeds.map(|(speed, least)| Reversal { speed, least: *least, sign: 0.0 }).collect()
            })
            .collect();
        let columns = KeptColumns::new(&*model, kept);
        let lists = columns.local.iter().map(|l| l.len() + 1).sum();
        Ok(LiveRows {
            states,
            spacing: kernel.spacing(),
            inner: (0.5 * settings.states.rate_hz / settings.states.state_hz).ceil() as usize,
            rate_hz: settings.states.rate_hz,
            reversals,
            block: LiveBlock::default(),
            regressor: RegressorBlock::new(model.layout().clone(), BLOCK),
            history: History::default(),
            centre: kernel.half_width(),
            time: Vec::new(),
            window: vec![Vec::new(); lists],
            bad: vec![Vec::new(); outputs],
            row: LiveRow {
                time: 0.0,
                columns: vec![vec![0.0; columns.total]; outputs],
                effort: vec![0.0; outputs],
                usable: vec![false; outputs],
            },
            kernel,
            columns,
            shape: shape.to_vec(),
            model,
        })
    }

    /// Time between rows, s.
    pub fn spacing_s(&self) -> f64 {
        self.spacing as f64 / self.rate_hz
    }

    /// Time by which rows lie behind, s.
    pub fn lag_s(&self) -> f64 {
        (self.states.lag() + self.kernel.half_width() + self.inner + 1) as f64 / self.rate_hz
    }

    /// Takes a grid sample; `first`: what came before does not connect to it. Rows are formed by [`LiveRows::drain`].
    ///
    /// # Panics
    /// If the sample has another number of values.
    pub fn push(&mut self, time: f64, values: &[f64], first: bool, take: impl FnMut(&LiveRow)) {
        if first {
            // What is behind the gap still gives its rows.
            self.drain(take);
            self.restart();
        }
        self.states.push(time, values, first);
    }

    fn restart(&mut self) {
        self.history = History::default();
        self.centre = self.kernel.half_width();
        self.time.clear();
        self.window.iter_mut().for_each(Vec::clear);
        self.bad.iter_mut().for_each(Vec::clear);
        self.reversals.iter_mut().flatten().for_each(|r| r.sign = 0.0);
    }

    /// Forms the rows that the samples so far allow and hands them on in time order.
    pub fn drain(&mut self, mut take: impl FnMut(&LiveRow)) {
        self.states.drain(&mut self.block);
        let mut from = 0;
        while from < self.block.samples {
            let to = (from + BLOCK).min(self.block.samples);
            self.extend(from..to);
            from = to;
            self.emit(&mut take);
        }
    }

    /// Appends the columns of a part of the block of states.
    fn extend(&mut self, part: std::ops::Range<usize>) {
        let (n, stride) = (part.len(), self.block.samples);
        let padded = n.max(PADDED);
        let copy = |from: &[f64], lists: usize| -> Vec<f64> {
            let list = |k: usize| {
                let taken = &from[k * stride + part.start..][..n];
                let last = taken[n - 1];
                taken.iter().copied().chain(std::iter::repeat_n(last, padded - n))
            };
            (0..lists).flat_map(list).collect()
        };
        let outputs = self.bad.len();
        let [q, dq, ddq] = [&self.block.q, &self.block.dq, &self.block.ddq].map(|x| copy(x, outputs));
        let names = self.model.channels();
        let values = copy(&self.block.channels, names.len());
        let channels: Vec<(&str, &[f64])> =
            names.iter().map(String::as_str).zip(values.chunks_exact(padded)).collect();
        let plain = MotionBlock { channels: &channels, ..MotionBlock::plain(padded, &q, &dq, &ddq) };
        let signals = self.model.signals();
        let mut remembered = vec![0.0; signals.len() * padded];
        if !signals.is_empty() {
            let (step, measured) = (1.0 / self.rate_hz, MotionBlock { samples: n, ..plain });
            self.model.remember(&measured, step, &self.shape, &mut self.history, padded, &mut remembered);
        }
        let formed = signals.iter().map(String::as_str).zip(remembered.chunks_exact(padded));
        let channels: Vec<(&str, &[f64])> = channels.iter().copied().chain(formed).collect();
        let motion = MotionBlock { channels: &channels, ..plain };
        self.model.regressor(&motion, &self.shape, &mut self.regressor);
        let mut list = 0;
        for (output, local) in self.columns.local.iter().enumerate() {
            for k in local {
                self.window[list].extend_from_slice(&self.regressor.column(output, *k)[..n]);
                list += 1;
            }
            let effort = &self.block.effort[output * stride + part.start..][..n];
            let net = effort.iter().zip(self.regressor.offset(output)).map(|(e, o)| e - o);
            self.window[list].extend(net);
            list += 1;
        }
        for output in 0..self.bad.len() {
            self.mark_reversals(output, part.clone());
        }
        self.time.extend_from_slice(&self.block.time[part]);
    }

    fn mark_reversals(&mut self, output: usize, part: std::ops::Range<usize>) {
        let stride = self.block.samples;
        let bad = &mut self.bad[output];
        for sample in part {
            let mut spoilt = false;
            for reversal in &mut self.reversals[output] {
                let rates = &self.block.dq;
                let v: f64 = reversal.speed.iter().map(|(rate, f)| f * rates[rate * stride + sample]).sum();
                let sign = dynid_model::element::sign(v);
                if let Some(before) = bad.last_mut()
                    && reversal.sign != sign
                {
                    (*before, spoilt) = (true, true);
                }
                reversal.sign = sign;
                spoilt |= v.abs() < reversal.least;
            }
            bad.push(spoilt);
        }
    }

    fn emit(&mut self, take: &mut impl FnMut(&LiveRow)) {
        let half = self.kernel.half_width();
        let ahead = half + self.inner;
        // A change of sign spoils the sample before it too, so one more sample must be known.
        while self.centre + ahead + 1 < self.time.len() {
            self.form();
            take(&self.row);
            self.centre += self.spacing;
        }
        // Kept: what the next row can reach.
        let unused = self.centre.saturating_sub(ahead).min(self.time.len());
        if unused > 2 * ahead + BLOCK {
            self.centre -= unused;
            self.time.drain(..unused);
            self.window.iter_mut().for_each(|list| drop(list.drain(..unused)));
            self.bad.iter_mut().for_each(|list| drop(list.drain(..unused)));
        }
    }

    /// The row about the centre.
    fn form(&mut self) {
        let half = self.kernel.half_width();
        let reach = half + self.inner;
        let around = self.centre.saturating_sub(reach)..self.centre + reach + 1;
        self.row.time = self.time[self.centre];
        let mut list = 0;
        for (output, global) in self.columns.global.iter().enumerate() {
            let usable = !self.bad[output][around.clone()].contains(&true);
            self.row.usable[output] = usable;
            let row = &mut self.row.columns[output];
            row.fill(0.0);
            if usable {
                for (k, place) in global.iter().enumerate() {
                    row[*place] = self.kernel.apply_at(&self.window[list + k], self.centre);
                }
                self.row.effort[output] =
                    self.kernel.apply_at(&self.window[list + global.len()], self.centre);
            } else {
                self.row.effort[output] = 0.0;
            }
            list += global.len() + 1;
        }
    }

    /// Carries the state to or from a checkpoint; what was pushed must have been drained.
    pub fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        self.states.transfer(transfer);
        let mut states = self.history.states().to_vec();
        let mut elements = states.len();
        transfer.count(&mut elements, MOST_ELEMENTS);
        states.resize(elements, Vec::new());
        states.iter_mut().for_each(|state| transfer.list(state, 1));
        self.history = History::of_states(states);
        let mut centre = self.centre as u64;
        transfer.integer(&mut centre);
        self.centre = usize::try_from(centre).unwrap_or(usize::MAX);
        transfer.list(&mut self.time, 1);
        let samples = self.time.len();
        for list in &mut self.window {
            transfer.list(list, 1);
            if list.len() != samples {
                transfer.fail();
            }
        }
        for (bad, reversals) in self.bad.iter_mut().zip(&mut self.reversals) {
            bad.resize(samples, false);
            bad.iter_mut().for_each(|b| transfer.flag(b));
            reversals.iter_mut().for_each(|r| transfer.real(&mut r.sign));
        }
        if self.centre > samples + self.spacing + self.kernel.half_width() {
            transfer.fail();
        }
    }
}
