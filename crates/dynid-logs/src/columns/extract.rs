//! Signals in SI out of a table.

use super::column_values::raw_column;
use super::{ColumnMapping, ColumnUse, MappingError, Signal, Sparse, TimeSource};
use crate::csv::Table;

/// Clocks beyond this magnitude count from an epoch and are shifted to start at zero, s.
const EPOCH_CLOCK: f64 = 1e6;

/// Signals of the logged joints in SI. Lists are joint by joint, each with one value per sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signals {
    /// Logged joints in joint order.
    pub joints: Vec<String>,
    /// Indices of the logged joints among the robot's joints.
    pub indices: Vec<usize>,
    /// Joints of the robot without a log.
    pub not_logged: Vec<String>,
    /// Time, s, minus `time_origin`.
    pub time: Vec<f64>,
    /// Time that was subtracted, s: the first stamp of a clock beyond 1e6 s, else 0. The difference is taken before the
    /// conversion. Of tables read by [`LogSource::read`](crate::LogSource::read) it is exact; of others, what an `f64` of the raw stamp resolves
    /// (256 ns for nanoseconds since 1970) is all there is.
    pub time_origin: f64,
    /// Position, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Velocity, rad/s or m/s.
    pub velocity: Option<Vec<Vec<f64>>>,
    /// Acceleration, rad/s² or m/s².
    pub acceleration: Option<Vec<Vec<f64>>>,
    /// Effort, N m or N.
    pub effort: Option<Vec<Vec<f64>>>,
    /// Temperature, °C, of logged joints that have a column for it; `None` without any such column.
    pub temperature: Option<Vec<Option<Vec<f64>>>>,
    /// Other columns.
    pub channels: Vec<(String, Vec<f64>)>,
    /// Places of the samples among the rows of the table; `None`: all rows in their order.
    pub rows: Option<Vec<usize>>,
    /// What became of rows without a value.
    pub sparse: Sparse,
}

/// Where the time of a log begins, for rows that come in blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClockStart {
    /// First stamps of the time columns as they stand in the file, and the time that is subtracted, s.
    first: Option<(Vec<f64>, f64)>,
    /// Rows so far.
    rows: usize,
}

impl ColumnMapping {
    /// Takes the signals out of a table, converted to SI.
    ///
    /// # Errors
    /// [`MappingError::UnknownColumn`] if the mapping was made for another header, [`MappingError::Overflow`] if a
    /// conversion leaves the range of numbers, [`MappingError::Sparse`] if hardly any row has all signals.
    pub fn extract(&self, table: &Table) -> Result<Signals, MappingError> {
        self.extract_block(table, &mut ClockStart::default())
    }

    /// [`ColumnMapping::extract`] of the next rows of a log, whose clock counts from its first row. `start`: as the block before left it.
    ///
    /// # Errors
    /// As [`ColumnMapping::extract`], whose share of rows with all signals is that of the block.
    pub fn extract_block(&self, table: &Table, start: &mut ClockStart) -> Result<Signals, MappingError> {
        let mut filled;
        let whole = if self.has_gaps(table) {
            filled = table.clone();
            let kept = self.fill(&mut filled)?;
            if let Some(rows) = &kept.rows {
                for column in &mut filled.columns {
                    *column = rows.iter().map(|row| column[*row]).collect();
                }
                filled.rows = rows.len();
            }
            Some((filled, kept))
        } else {
            None
        };
        let (table, kept) = match &whole {
            Some((table, kept)) => (table, Some(kept)),
            None => (table, None),
        };
        let (time, time_origin) = self.time(table, start)?;
        let indices: Vec<usize> =
            self.position.iter().enumerate().filter(|(_, p)| p.is_some()).map(|(k, _)| k).collect();
        let optional = |signal, columns: &Option<Vec<Option<ColumnUse>>>| {
            columns.as_ref().map(|c| per_joint(table, signal, c)).transpose()
        };
        let channels = self
            .channels
            .iter()
            .map(|(name, column)| Ok((name.clone(), convert(table, &format!("channel `{name}`"), column)?)));
        let temperature = self.temperature.as_ref().map(|columns| {
            let of_joint =
                |k: &usize| columns[*k].as_ref().map(|c| convert(table, "temperature", c)).transpose();
            indices.iter().map(of_joint).collect()
        });
        Ok(Signals {
            joints: indices.iter().map(|k| self.joints[*k].clone()).collect(),
            not_logged: self.not_logged().into_iter().map(str::to_owned).collect(),
            position: per_joint(table, Signal::Position, &self.position)?,
            velocity: optional(Signal::Velocity, &self.velocity)?,
            acceleration: optional(Signal::Acceleration, &self.acceleration)?,
            effort: self.efforts(table, &indices)?,
            temperature: temperature.transpose()?,
            channels: channels.collect::<Result<_, _>>()?,
            rows: kept.and_then(|k| k.rows.clone()),
            sparse: kept.map(|k| k.sparse.clone()).unwrap_or_default(),
            indices,
            time,
            time_origin,
        })
    }

    /// Efforts of the logged joints, zeros where no drive acts.
    fn efforts(&self, table: &Table, indices: &[usize]) -> Result<Option<Vec<Vec<f64>>>, MappingError> {
        let Some(columns) = &self.effort else { return Ok(None) };
        let of_joint = |k: &usize| match &columns[*k] {
            Some(column) => convert(table, &Signal::Effort.to_string(), column).map(Some),
            None => Ok(self.undriven[*k].then(|| vec![0.0; table.rows])),
        };
        let efforts: Vec<Option<Vec<f64>>> = indices.iter().map(of_joint).collect::<Result<_, _>>()?;
        Ok(Some(efforts.into_iter().flatten().collect()))
    }

    fn time(&self, table: &Table, clock: &mut ClockStart) -> Result<(Vec<f64>, f64), MappingError> {
        let before = clock.rows;
        clock.rows += table.rows;
        match &self.time {
            TimeSource::Rate(rate) => {
                Ok(((0..table.rows).map(|k| (before + k) as f64 / rate).collect(), 0.0))
            }
            TimeSource::Columns(time) => {
                let (first, start) = match &clock.first {
                    Some(known) => known,
                    None => {
                        let mut start = 0.0;
                        let mut stamps = Vec::with_capacity(time.parts.len());
                        for part in &time.parts {
                            let (raw, origin) = raw_column(table, "time", part)?;
                            let first = raw.first().copied().unwrap_or(0.0);
                            start += part.factor * (first + origin as f64) + part.offset;
                            stamps.push(first);
                        }
                        &*clock.first.insert((stamps, start))
                    }
                };
                if let ([column], true) = (time.parts.as_slice(), start.abs() <= EPOCH_CLOCK) {
                    return Ok((convert(table, "time", column)?, 0.0));
                }
                let mut out = vec![0.0; table.rows];
                for (part, first) in time.parts.iter().zip(first) {
                    let (raw, _) = raw_column(table, "time", part)?;
                    out.iter_mut().zip(raw).for_each(|(t, x)| *t += scaled(x - first, part.factor));
                }
                Ok((out, *start))
            }
        }
    }

    fn has_gaps(&self, table: &Table) -> bool {
        let used = self.signal_columns().chain(self.time_columns());
        used.filter_map(|c| raw_column(table, "", c).ok())
            .any(|(values, _)| values.iter().any(|x| x.is_nan()))
    }
}

fn per_joint(
    table: &Table,
    signal: Signal,
    columns: &[Option<ColumnUse>],
) -> Result<Vec<Vec<f64>>, MappingError> {
    columns.iter().flatten().map(|c| convert(table, &signal.to_string(), c)).collect()
}

/// `factor` times `x`. A thousandth and its powers are no binary fractions: what they scale is divided instead, so that 15 ms are the
/// `f64` next to 0.015 s.
fn scaled(x: f64, factor: f64) -> f64 {
    let divisor = [1e-3, 1e-6, 1e-9].into_iter().zip([1e3, 1e6, 1e9]).find(|(small, _)| *small == factor);
    divisor.map_or_else(|| factor * x, |(_, divisor)| x / divisor)
}

fn convert(table: &Table, signal: &str, column: &ColumnUse) -> Result<Vec<f64>, MappingError> {
    let (raw, origin) = raw_column(table, signal, column)?;
    let values: Vec<f64> = if column.factor == 1.0 && column.offset == 0.0 && origin == 0 {
        raw.to_vec()
    } else {
        raw.iter().map(|x| scaled(x + origin as f64, column.factor) + column.offset).collect()
    };
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(values),
        Some(k) => Err(MappingError::Overflow {
            signal: signal.to_owned(),
            column: column.name.clone(),
            row: table.first_row + k,
            found: values[k],
        }),
    }
}
