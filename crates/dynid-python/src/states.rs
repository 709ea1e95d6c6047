//! States of a robot on their way to an effort model: checked once, then block by block, one joint after the other.

use dynid::model::{EffortModel, MotionBlock, RobotModel};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Batch, CHUNK, by_chunks, demand_finite, filled, transpose};
use crate::error::raise;

/// Extra channels by name, a value per state.
pub(crate) type Channels = [(String, Vec<f64>)];

/// States as they were given: rows of positions, velocities and accelerations.
pub(crate) struct Given<'py>([Batch<'py>; 3]);

impl<'py> Given<'py> {
    /// Takes arrays that fit a model.
    pub(crate) fn take(
        model: &RobotModel,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
    ) -> PyResult<Self> {
        let (nq, nv) = model.dimensions();
        let batches = [Batch::take("q", q, nq)?, Batch::take("v", v, nv)?, Batch::take("a", a, nv)?];
        for (name, batch) in ["q", "v", "a"].iter().zip(&batches) {
            batch.demand_rows(name, batches[0].rows)?;
            demand_finite(name, batch.values()?, batch.columns)?;
        }
        Ok(Given(batches))
    }

    /// Their numbers, for a model that can be in these states.
    ///
    /// Fails for poses that a mechanism with loops cannot be in.
    pub(crate) fn of<'a>(&'a self, py: Python<'_>, model: &'a RobotModel) -> PyResult<States<'a>> {
        let [q, v, a] = &self.0;
        let states = States {
            model,
            values: [q.values()?, v.values()?, a.values()?],
            columns: [q.columns, v.columns, a.columns],
            rows: q.rows,
            single: q.single,
        };
        if let Some(closed) = model.closed() {
            let found = py.detach(|| closed.reachable(&states.scratch().take(&states, 0, states.rows)));
            found.map_err(|e| {
                let file = "states".to_owned();
                raise(py, &dynid::Error::Pose { file, row: e.sample + 1, fault: Box::new(e.fault) })
            })?;
        }
        Ok(states)
    }
}

/// States of a model.
#[derive(Clone, Copy)]
pub(crate) struct States<'a> {
    model: &'a RobotModel,
    /// Positions, velocities, accelerations, row after row.
    pub(crate) values: [&'a [f64]; 3],
    columns: [usize; 3],
    pub(crate) rows: usize,
    /// Whether there is one, given without the axis of states.
    pub(crate) single: bool,
}

/// States of a block.
pub(crate) struct Scratch([Vec<f64>; 3]);

impl Scratch {
    /// Rows of the states from `from` on.
    pub(crate) fn take(&mut self, states: &States<'_>, from: usize, count: usize) -> MotionBlock<'_> {
        for ((values, columns), to) in states.values.iter().zip(states.columns).zip(&mut self.0) {
            to.resize(columns * count, 0.0);
            transpose(values, columns, from, count, to);
        }
        let [q, dq, ddq] = &self.0;
        MotionBlock::plain(count, q, dq, ddq)
    }
}

impl States<'_> {
    /// Rows that a block takes: all where poses are followed from one to the next.
    pub(crate) fn block(&self) -> usize {
        if self.model.closed().is_some() { self.rows } else { CHUNK.min(self.rows) }
    }

    pub(crate) fn scratch(&self) -> Scratch {
        Scratch([Vec::new(), Vec::new(), Vec::new()])
    }

    /// Efforts, `(n, outputs)`, for given linear parameters.
    pub(crate) fn efforts<'py>(
        &self,
        py: Python<'py>,
        linear: &[f64],
        channels: &Channels,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (model, outputs) = (self.model, self.model.outputs().len());
        let shape = model.parameters().shape_start();
        filled(py, (self.rows, self.single), &[outputs], |out| {
            let scratch = || (self.scratch(), vec![0.0; outputs * self.block()]);
            let work = |from: usize, part: &mut [f64], (scratch, effort): &mut (Scratch, Vec<f64>)| {
                let count = part.len() / outputs;
                let channels: Vec<(&str, &[f64])> =
                    channels.iter().map(|(name, x)| (name.as_str(), &x[from..from + count])).collect();
                let motion = MotionBlock { channels: &channels, ..scratch.take(self, from, count) };
                model.efforts(&motion, &shape, linear, count, &mut effort[..outputs * count]);
                for (s, row) in part.chunks_exact_mut(outputs).enumerate() {
                    row.iter_mut().enumerate().for_each(|(o, to)| *to = effort[o * count + s]);
                }
            };
            py.detach(|| by_chunks((threads, self.block()), outputs, out, scratch, work))
        })
    }
}

/// Channels that a model reads, each as long as the states.
pub(crate) fn channels_of(
    py: Python<'_>,
    model: &RobotModel,
    given: Vec<(String, Vec<f64>)>,
    rows: usize,
) -> PyResult<Vec<(String, Vec<f64>)>> {
    for (name, values) in &given {
        if !model.channels().contains(name) {
            let known = model.channels().join(", ");
            let text = format!("channels: expected one of [{known}], found `{name}`");
            return Err(PyValueError::new_err(text));
        }
        demand_finite(name, values, 1)?;
        if values.len() != rows {
            let text = format!("channels: {name}: expected {rows} values, found {}", values.len());
            return Err(PyValueError::new_err(text));
        }
    }
    match model.channels().iter().find(|c| !given.iter().any(|(name, _)| name == *c)) {
        Some(channel) => Err(raise(py, &dynid::Error::StatesChannel { channel: channel.clone() })),
        None => Ok(given),
    }
}
