//! Efforts and regressors at given states.

use std::path::Path;

use dynid_logs::{LogHeader, MappingSpec, ReadOptions, States, StatesError, Table, states};
use dynid_model::element::temperature_channel;
use dynid_model::{
    BaseParameters, EffortModel, History, JournalModel, MotionBlock, RegressorBlock, RobotModel,
};

use crate::Error;
use crate::estimate::ReadingRecord;
use crate::logs;
use crate::robot::model_state_joints;

/// Reads states of a model: columns named as in a table of states ([`dynid_logs::states::read`]), else those by which the training
/// logs were read, with their units.
///
/// # Errors
/// [`Error::States`]; [`Error::Columns`] for a table that has neither.
pub fn read_states(
    path: &Path,
    options: &ReadOptions,
    model: &RobotModel,
    reading: Option<&ReadingRecord>,
) -> Result<States, Error> {
    let table = dynid_logs::csv::read(path, options).map_err(StatesError::File)?;
    let joints = model_state_joints(model);
    let named = states::from_table_with_channels(&table, &joints, &wanted_channels(model, &table));
    let recorded = reading.filter(|r| r.columns.position.is_some() && r.motor_side.is_none());
    match (named, recorded) {
        (Err(StatesError::Missing { .. } | StatesError::MissingChannel { .. }), Some(reading)) => {
            let table = with_recorded_columns(table, model, &reading.columns)?;
            Ok(states::from_table_with_channels(&table, &joints, &wanted_channels(model, &table))?)
        }
        (named, _) => Ok(named?),
    }
}

/// Channels of a model, with those of journals of which the table has some: half of what says where a journal is would be left out
/// unseen.
fn wanted_channels(model: &RobotModel, table: &Table) -> Vec<String> {
    let offsets = model.journals().into_iter().flat_map(JournalModel::offset_channels);
    let some = offsets
        .filter(|own| own.iter().flatten().any(|name| table.column(name).is_some()))
        .flatten()
        .flatten();
    model.channels().iter().chain(some).cloned().collect()
}

/// The table with columns of states beside those that a mapping takes for the same.
fn with_recorded_columns(
    mut table: Table,
    model: &RobotModel,
    columns: &MappingSpec,
) -> Result<Table, Error> {
    let spec = MappingSpec {
        // A table of states needs neither time nor effort.
        time: None,
        rate_hz: Some(1.0),
        effort: None,
        current_gains: None,
        allow_no_effort: true,
        ..columns.clone()
    };
    let named = |source| Error::Columns { file: table.source.clone(), source: Box::new(source) };
    let mapping = logs::map_columns(&LogHeader::of_names(&table.header), &crate::log::axes(model), &spec)
        .map_err(named)?;
    let signals = mapping.extract(&table).map_err(named)?;
    let mut columns = signals.channels;
    let quantities = [("q", Some(signals.position)), ("dq", signals.velocity), ("ddq", signals.acceleration)];
    for (prefix, values) in quantities {
        let joints = signals.joints.iter().zip(values.into_iter().flatten());
        columns.extend(joints.map(|(joint, values)| (format!("{prefix}_{joint}"), values)));
    }
    let temperatures = signals.joints.iter().zip(signals.temperature.into_iter().flatten());
    columns.extend(temperatures.filter_map(|(joint, values)| Some((temperature_channel(joint), values?))));
    for (name, values) in columns {
        if table.column(&name).is_none() {
            table.header.push(name);
            table.columns.push(values);
        }
    }
    Ok(table)
}

/// Difference of steps of time, as a share, that counts as rounding.
const SAME_STEP: f64 = 1e-6;

/// Channel-after-channel copy of a states table.
struct Flat {
    rows: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    gravity: Option<Vec<f64>>,
    channels: Vec<(String, Vec<f64>)>,
    time: Option<Vec<f64>>,
}

impl Flat {
    fn new(states: &States) -> Self {
        Flat {
            rows: states.rows,
            q: states.position.concat(),
            dq: states.velocity.concat(),
            ddq: states.acceleration.concat(),
            gravity: states.gravity.as_ref().map(|g| g.concat()),
            channels: states.channels.clone(),
            time: states.time.clone(),
        }
    }

    /// Signals that depend on the motion before, signal after signal; empty where the states have no time.
    ///
    /// States that are equally far apart go through the model together.
    fn remembered(&self, model: &RobotModel) -> Vec<f64> {
        let Some(time) = self.time.as_ref().filter(|_| !model.signals().is_empty() && self.rows > 1) else {
            return Vec::new();
        };
        let channels: Vec<(&str, &[f64])> =
            self.channels.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect();
        let step = |k: usize| time[(k + 1).min(self.rows - 1)] - time[k.min(self.rows - 2)];
        let mut values = vec![0.0; model.signals().len() * self.rows];
        let (mut history, mut start) = (History::default(), 0);
        while start < self.rows {
            let held = step(start);
            let alike = |k: &usize| (step(*k) - held).abs() <= SAME_STEP * held;
            let end = start + (start..self.rows).take_while(alike).count().max(1);
            let channels: Vec<(&str, &[f64])> =
                channels.iter().map(|(name, values)| (*name, &values[start..end])).collect();
            let motion = MotionBlock {
                stride: self.rows,
                channels: &channels,
                ..MotionBlock::plain(end - start, &self.q[start..], &self.dq[start..], &self.ddq[start..])
            };
            let shape = model.parameters().shape_start();
            model.remember(&motion, held, &shape, &mut history, self.rows, &mut values[start..]);
            start = end;
        }
        values
    }

    fn regressor(&self, model: &RobotModel) -> Result<RegressorBlock, Error> {
        for channel in model.channels() {
            if !self.channels.iter().any(|(name, _)| name == channel) {
                return Err(Error::StatesChannel { channel: channel.clone() });
            }
        }
        let remembered = self.remembered(model);
        let channels: Vec<(&str, &[f64])> = self
            .channels
            .iter()
            .map(|(name, values)| (name.as_str(), values.as_slice()))
            .chain(model.signals().iter().map(String::as_str).zip(remembered.chunks_exact(self.rows.max(1))))
            .collect();
        let mut block = RegressorBlock::new(model.layout().clone(), self.rows);
        let motion = MotionBlock {
            samples: self.rows,
            stride: self.rows,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.ddq,
            gravity: self.gravity.as_deref(),
            channels: &channels,
            sign_width: 0.0,
        };
        if let Some(closed) = model.closed() {
            closed.reachable(&motion).map_err(|e| Error::Pose {
                file: "states".to_owned(),
                row: e.sample + 1,
                fault: Box::new(e.fault),
            })?;
        }
        model.regressor(&motion, &model.parameters().shape_start(), &mut block);
        Ok(block)
    }
}

/// Effort of every output at every state, for given linear parameters; that of known elements included. Friction that remembers
/// the motion (`lugre`, `maxwell_slip`) follows states that have a [time](States::time), from the steady state of the first; elsewhere it is in its steady state.
///
/// # Errors
/// [`Error::StatesChannel`]: the states lack a channel that the model reads, a temperature; [`Error::Pose`]: a mechanism with
/// loops cannot be in a state.
pub fn efforts(model: &RobotModel, values: &[f64], states: &States) -> Result<Vec<Vec<f64>>, Error> {
    let block = Flat::new(states).regressor(model)?;
    Ok((0..model.outputs().len()).map(|output| block.effort(output, values)).collect())
}

/// Effort of known elements alone, of every output at every state; zero where none are known.
///
/// # Errors
/// As [`efforts`].
pub(crate) fn known_efforts(model: &RobotModel, states: &States) -> Result<Vec<Vec<f64>>, Error> {
    let block = Flat::new(states).regressor(model)?;
    Ok((0..model.outputs().len()).map(|output| block.offset(output).to_vec()).collect())
}

/// Regressor at every state: `rows[state][output][column]`, in standard columns or, with `base`, in base columns.
///
/// # Errors
/// Fails as [`efforts`] does.
pub fn regressors(
    model: &RobotModel,
    base: Option<&BaseParameters>,
    states: &States,
) -> Result<Vec<Vec<Vec<f64>>>, Error> {
    let block = Flat::new(states).regressor(model)?;
    let layout = model.layout();
    let columns: Vec<usize> = base.map_or_else(|| (0..layout.parameters()).collect(), |b| b.kept.clone());
    let mut out = vec![vec![vec![0.0; columns.len()]; layout.outputs()]; states.rows];
    for output in 0..layout.outputs() {
        for (k, column) in layout.columns(output).iter().enumerate() {
            let Ok(position) = columns.binary_search(column) else { continue };
            for (state, value) in out.iter_mut().zip(block.column(output, k)) {
                state[output][position] = *value;
            }
        }
    }
    Ok(out)
}
