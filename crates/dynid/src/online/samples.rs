//! From rows of a stream to samples of a model's outputs.

use dynid_logs::columns::TimeSource;
use dynid_logs::{ColumnMapping, LogHeader, MappingError, MappingSpec, Table};
use dynid_model::element::temperature_channel;

use super::asked::Asked;
use crate::Error;
use crate::log::LogAxis;
use crate::logs;

/// Rows converted at a time.
pub(super) const BATCH: usize = 256;

/// A sample: time and positions, then efforts, then channels of the model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sample {
    pub(super) time: f64,
    pub(super) values: Vec<f64>,
}

/// Knows where in the rows of a stream the signals are.
#[derive(Debug)]
pub(super) struct Samples {
    name: String,
    mapping: ColumnMapping,
    /// Positions may be those of motors.
    motors: bool,
    rows: Table,
    /// Time of the first row of a clock that counts from an epoch.
    origin: Option<f64>,
    taken: u64,
}

impl Samples {
    /// For a stream with these columns. `axes`: of the robot, in their order.
    pub(super) fn new(
        name: &str,
        header: &LogHeader,
        axes: &[LogAxis],
        columns: &MappingSpec,
    ) -> Result<Samples, Error> {
        let named = |source| Error::Columns { file: name.to_owned(), source: Box::new(source) };
        let mapping = logs::map_columns(header, axes, columns).map_err(named)?;
        if columns.position.is_none() {
            logs::check_surplus(&mapping, &crate::log::names(axes), &header.names, name)?;
        }
        logs::check_gains(columns, axes.len())?;
        if mapping.effort.is_none() {
            return Err(Error::Unsupported(format!("{name}: a stream without efforts identifies nothing")));
        }
        Ok(Samples {
            rows: Table {
                source: name.to_owned(),
                header: header.names.clone(),
                origin: vec![0; header.names.len()],
                columns: vec![Vec::with_capacity(BATCH); header.names.len()],
                rows: 0,
                first_row: 1,
                sha256: String::new(),
            },
            name: name.to_owned(),
            motors: axes.iter().any(|a| a.motor),
            mapping,
            origin: None,
            taken: 0,
        })
    }

    /// Joints without columns.
    pub(super) fn not_logged(&self) -> Vec<String> {
        self.mapping.not_logged().into_iter().map(str::to_owned).collect()
    }

    /// What must not differ between a stream and its continuation.
    pub(super) fn header(&self) -> &[String] {
        &self.rows.header
    }

    /// Time of the first row, and how many rows came before; for checkpoints.
    pub(super) fn clock(&mut self) -> (&mut Option<f64>, &mut u64) {
        (&mut self.origin, &mut self.taken)
    }

    /// Takes a row; true if [`Samples::drain`] is due.
    pub(super) fn push(&mut self, row: &[f64]) -> bool {
        for (column, x) in self.rows.columns.iter_mut().zip(row) {
            column.push(*x);
        }
        self.rows.rows += 1;
        self.rows.rows >= BATCH
    }

    /// Samples of the rows taken, in SI. `channels`: names of the model's.
    pub(super) fn drain(&mut self, asked: &Asked, channels: &[String]) -> Result<Vec<Sample>, Error> {
        let rows = self.rows.rows;
        if rows == 0 || !self.settled(asked)? {
            return Ok(Vec::new());
        }
        let named = |source| Error::Columns { file: self.name.clone(), source: Box::new(source) };
        let mut signals = self.mapping.extract(&self.rows).map_err(named)?;
        self.rows.columns.iter_mut().for_each(Vec::clear);
        self.rows.rows = 0;
        let before = match &self.mapping.time {
            TimeSource::Rate(rate) => self.taken as f64 / rate,
            TimeSource::Columns(_) => {
                let origin = *self.origin.get_or_insert(signals.time_origin);
                signals.time_origin - origin
            }
        };
        self.taken += rows as u64;
        if let Some(transmission) = &asked.motor_side {
            logs::to_joint_side(&mut signals, transmission)?;
        }
        let effort = signals.effort.as_deref().unwrap_or(&[]);
        let extra = channels
            .iter()
            .map(|wanted| {
                let stated = signals.channels.iter().find(|(name, _)| name == wanted).map(|(_, v)| v);
                let measured = || {
                    let lists = signals.joints.iter().zip(signals.temperature.iter().flatten());
                    lists
                        .filter(|(joint, _)| temperature_channel(joint) == *wanted)
                        .find_map(|(_, values)| values.as_ref())
                };
                stated.or_else(measured).ok_or_else(|| {
                    let (log, channel) = (self.name.clone(), wanted.clone());
                    Error::Conditioning(dynid_rows::conditioning::ConditioningError::MissingChannel {
                        log,
                        channel,
                    })
                })
            })
            .collect::<Result<Vec<&Vec<f64>>, Error>>()?;
        let lists: Vec<&Vec<f64>> = signals.position.iter().chain(effort).chain(extra).collect();
        let sample = |row: usize| Sample {
            time: before + signals.time[row],
            values: lists.iter().map(|list| list[row]).collect(),
        };
        Ok((0..signals.time.len()).map(sample).collect())
    }

    /// Finds the unit of the time; false: some more rows are needed for that.
    fn settled(&mut self, asked: &Asked) -> Result<bool, Error> {
        let more = self.rows.rows < BATCH;
        let stated = |mapping: &ColumnMapping| match &mapping.time {
            TimeSource::Columns(time) => time.unit_stated,
            TimeSource::Rate(_) => true,
        };
        if stated(&self.mapping) {
            return Ok(true);
        }
        match self.mapping.settle_time(&self.rows, self.motors || asked.motor_side.is_some()) {
            Ok(_) => Ok(stated(&self.mapping) || !more),
            Err(MappingError::TimeUnit { .. } | MappingError::TimeStep { .. }) if more => Ok(false),
            Err(source) => Err(Error::Columns { file: self.name.clone(), source: Box::new(source) }),
        }
    }
}
