//! Columns as a configuration states them.

use std::collections::BTreeMap;

use dynid_files::excerpt::nearest;
use serde::{Deserialize, Serialize};

use super::error::MappingError;
use super::guess::{Finder, GuessOptions, PerJointColumns, of_logged};
use super::units::{Conversion, conversion};
use super::{ColumnMapping, ColumnUse, EffortColumn, TimeColumns, TimeSource};
use crate::log::{DecimalMark, LogFormat, LogHeader, LogOptions, Missing};
use crate::signal::{ColumnName, Signal, part_of_time};

/// An explicit mapping; signals that it does not mention are found by name as in [`ColumnMapping::guess`].
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MappingSpec {
    /// Time column, or columns that are added up, such as whole seconds and nanoseconds. Without a unit, seconds, ms, us
    /// and ns are told from the size and the steps of the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<SignalSpec>,
    /// Sampling rate, Hz, in place of a time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<SignalSpec>,
    /// Velocities.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<SignalSpec>,
    /// Accelerations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<SignalSpec>,
    /// Efforts, or currents with `scale` = drive gain in N m/A.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effort: Option<SignalSpec>,
    /// Temperatures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<SignalSpec>,
    /// Other columns, by the names to give them.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub channels: BTreeMap<String, ChannelSpec>,
    /// Drive gains for current columns found by name, N m/A or N/A, one per joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub current_gains: Option<Vec<f64>>,
    /// Allow joints without columns. Default: off.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub allow_unlogged: bool,
    /// Accept a log without effort. Default: off.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub allow_no_effort: bool,
    /// Columns that are left alone, as if the log did not have them. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ignore: Vec<String>,
    /// Names of the columns of a file without a header, in their order. Default: `column1`, `column2`, ...
    #[serde(skip_serializing_if = "Option::is_none")]
    pub names: Option<Vec<String>>,
    /// Decimal mark, `"."` or `","`. Default: found from the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimal: Option<DecimalMark>,
    /// What becomes of rows in which a signal has no value: `error`, `drop` or `interpolate`. Default: `drop` for formats
    /// that leave cells empty by design (PlotJuggler, `ros2 topic echo`), `interpolate` for bags, else `error`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<Missing>,
}

impl MappingSpec {
    /// How a log with these columns is to be opened.
    pub fn options(&self, rows: Option<(usize, usize)>) -> LogOptions {
        let read = crate::ReadOptions { rows, ignore: self.ignore.clone(), ..crate::ReadOptions::default() };
        LogOptions { read, names: self.names.clone(), decimal: self.decimal }
    }

    /// Columns of the time that are stated by name.
    pub fn time_names(&self) -> Vec<String> {
        let names = match &self.time {
            None => return Vec::new(),
            Some(SignalSpec::Full(full)) => &full.columns,
            Some(SignalSpec::Names(names)) => names,
        };
        match names {
            ColumnNames::Pattern(name) => vec![name.clone()],
            ColumnNames::List(list) => list.clone(),
            ColumnNames::Table(table) => table.values().cloned().collect(),
        }
    }

    /// The columns of this mapping in files that are read as another says: ignored columns, names of files without a header,
    /// decimal mark, missing values.
    #[must_use]
    pub fn read_as(self, other: &MappingSpec) -> Self {
        MappingSpec {
            ignore: other.ignore.clone(),
            names: other.names.clone(),
            decimal: other.decimal,
            missing: self.missing.or(other.missing),
            ..self
        }
    }
}

/// Columns of one signal: their names alone, or with unit, scale and offset.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(
    untagged,
    expecting = "a pattern such as \"q{}\", a list of columns, a table joint -> column, or { columns, unit, scale, offset }"
)]
pub enum SignalSpec {
    /// `{ columns, unit, scale, offset }`: `value = scale · unit · raw + offset`.
    Full(FullSignal),
    /// Columns in the unit that their names state, else SI.
    Names(ColumnNames),
}

/// Columns with unit, scale and offset.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FullSignal {
    /// Columns.
    pub columns: ColumnNames,
    /// Unit of the columns. Default: the one in the column's name, else SI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<Units>,
    /// Factor per joint, such as a drive gain in N m/A, a gear ratio or -1. Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<PerJoint>,
    /// Offset per joint, added last, SI. Default: 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<PerJoint>,
}

/// Names of a signal's columns.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum ColumnNames {
    /// A pattern: `{}` is the number of the joint (from 1; from 0 if that column exists), `{joint}` its name.
    Pattern(String),
    /// One name per joint in joint order; an empty one: not logged.
    List(Vec<String>),
    /// Joint to column; joints left out are not logged.
    Table(BTreeMap<String, String>),
}

/// One unit for all columns or one per joint.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum Units {
    /// One unit for all joints.
    One(String),
    /// One per joint.
    List(Vec<String>),
}

/// One number for all joints or one per joint.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum PerJoint {
    /// One number for all joints.
    One(f64),
    /// One per joint.
    List(Vec<f64>),
    /// Joint to number; joints left out keep the default.
    Table(BTreeMap<String, f64>),
}

/// A column besides the joints' signals: `value = scale · raw + offset`.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelSpec {
    /// Column.
    pub column: String,
    /// Factor. Default: 1.
    #[serde(default = "one")]
    pub scale: f64,
    /// Offset. Default: 0.
    #[serde(default)]
    pub offset: f64,
}

fn one() -> f64 {
    1.0
}

/// All columns in full: what was found by name is stated, in SI units.
impl From<&ColumnMapping> for MappingSpec {
    fn from(mapping: &ColumnMapping) -> Self {
        let (time, rate_hz) = match &mapping.time {
            TimeSource::Columns(time) => {
                let parts: PerJointColumns = time.parts.iter().cloned().map(Some).collect();
                (Some(in_full(&parts, "s")), None)
            }
            TimeSource::Rate(hz) => (None, Some(*hz)),
        };
        let signal = |list: &Option<Vec<Option<ColumnUse>>>, unit: &str| Some(in_full(list.as_ref()?, unit));
        let channel = |(name, column): &(String, ColumnUse)| {
            let ColumnUse { name: of, factor, offset, .. } = column.clone();
            (name.clone(), ChannelSpec { column: of, scale: factor, offset })
        };
        MappingSpec {
            time,
            rate_hz,
            position: Some(in_full(&mapping.position, "SI")),
            velocity: signal(&mapping.velocity, "SI"),
            acceleration: signal(&mapping.acceleration, "SI"),
            effort: signal(&mapping.effort, "SI"),
            temperature: signal(&mapping.temperature, "degC"),
            channels: mapping.channels.iter().map(channel).collect(),
            current_gains: None,
            allow_unlogged: mapping.position.iter().any(Option::is_none),
            allow_no_effort: mapping.effort.is_none(),
            missing: (mapping.missing != Missing::Error).then_some(mapping.missing),
            ..MappingSpec::default()
        }
    }
}

/// `{ columns, unit, scale, offset }`.
fn in_full(list: &[Option<ColumnUse>], unit: &str) -> SignalSpec {
    let number = |of: fn(&ColumnUse) -> f64, without: f64| -> Vec<f64> {
        list.iter().map(|c| c.as_ref().map_or(without, of)).collect()
    };
    let name = |c: &Option<ColumnUse>| c.as_ref().map_or_else(String::new, |c| c.name.clone());
    let moved = list.iter().flatten().any(|c| c.offset != 0.0);
    SignalSpec::Full(FullSignal {
        columns: ColumnNames::List(list.iter().map(name).collect()),
        unit: Some(Units::One(unit.to_owned())),
        scale: Some(PerJoint::List(number(|c| c.factor, 1.0))),
        offset: moved.then(|| PerJoint::List(number(|c| c.offset, 0.0))),
    })
}

impl ColumnMapping {
    /// Assigns columns as a configuration says, and the rest by name.
    ///
    /// # Errors
    /// [`MappingError`].
    pub fn from_spec(header: &[String], joints: &[String], spec: &MappingSpec) -> Result<Self, MappingError> {
        Self::with_efforts(header, joints, &vec![EffortColumn::Drive; joints.len()], spec)
    }

    /// Maps the columns of a log for joints whose effort is not always that of their drive.
    ///
    /// # Errors
    /// [`MappingError`]; [`MappingError::Undriven`] for a column of an effort that is known to be zero.
    ///
    /// # Panics
    /// If there is not one entry of `efforts` per joint.
    pub fn with_efforts(
        header: &[String],
        joints: &[String],
        efforts: &[EffortColumn],
        spec: &MappingSpec,
    ) -> Result<Self, MappingError> {
        Self::of_log(&LogHeader::of_names(header), joints, efforts, spec)
    }

    /// Assigns columns of a log that was opened: as a configuration says, the rest by format and name.
    ///
    /// # Errors
    /// [`MappingError`].
    ///
    /// # Panics
    /// If there is not one entry of `efforts` per joint.
    pub fn of_log(
        header: &LogHeader,
        joints: &[String],
        efforts: &[EffortColumn],
        spec: &MappingSpec,
    ) -> Result<Self, MappingError> {
        assert_eq!(efforts.len(), joints.len(), "one entry of efforts per joint");
        let finder = Finder::new(header, joints);
        let undriven: Vec<bool> = efforts.iter().map(|e| *e == EffortColumn::Absent).collect();
        let resolver = Resolver { header, joints, undriven: &undriven };
        let idle = |key, beside: &str| Err(MappingError::Idle { key, beside: beside.to_owned() });
        if spec.effort.is_some() && spec.current_gains.is_some() {
            return idle("current_gains", "`effort`, which states its own `scale`");
        }
        let time = match (&spec.time, spec.rate_hz) {
            (Some(_), Some(_)) => return idle("time", "`rate_hz`, which takes the place of a time column"),
            (Some(time), None) => resolver.time(time)?,
            (None, rate_hz) => finder.time(rate_hz)?,
        };
        let position = match &spec.position {
            Some(stated) => {
                let position = resolver.signal(Signal::Position, stated)?;
                finder.check_positions(&position, spec.allow_unlogged)?;
                position
            }
            None => finder.position(spec.allow_unlogged)?,
        };
        let logged: Vec<bool> = position.iter().map(Option::is_some).collect();
        let optional = |signal, stated: &Option<SignalSpec>| {
            let columns = match stated {
                Some(stated) => Some(resolver.signal(signal, stated)?),
                None => finder.find(signal)?,
            };
            finder.covering(signal, columns, &logged)
        };
        let driven: Vec<bool> = logged.iter().zip(&undriven).map(|(logged, u)| *logged && !u).collect();
        let mut effort = if let Some(stated) = &spec.effort {
            let columns = resolver.signal(Signal::Effort, stated)?;
            resolver.refuse_undriven(&columns)?;
            finder.covering(Signal::Effort, Some(columns), &driven)?
        } else {
            let options = GuessOptions {
                current_gains: spec.current_gains.clone(),
                allow_no_effort: spec.allow_no_effort,
                ..GuessOptions::default()
            };
            finder.effort(&options, &driven)?
        };
        for (column, _) in
            effort.iter_mut().flatten().zip(efforts).filter(|(_, e)| **e == EffortColumn::Sensor)
        {
            if let Some(column) = column {
                (column.factor, column.offset) = (-column.factor, -column.offset);
            }
        }
        // Some joints may be without a sensor.
        let temperature = match &spec.temperature {
            Some(stated) => Some(resolver.signal(Signal::Temperature, stated)?),
            None => finder.find(Signal::Temperature)?,
        };
        let channels = spec.channels.iter().map(|(name, channel)| resolver.channel(name, channel));
        let mapping = ColumnMapping {
            joints: joints.to_vec(),
            velocity: optional(Signal::Velocity, &spec.velocity)?,
            acceleration: optional(Signal::Acceleration, &spec.acceleration)?,
            temperature: temperature.map(|columns| of_logged(columns, &logged)),
            effort,
            undriven: undriven.clone(),
            channels: channels.collect::<Result<_, _>>()?,
            missing: spec.missing.unwrap_or(header.format.map_or(Missing::Error, LogFormat::missing)),
            time,
            position,
        };
        mapping.check_shared()?;
        Ok(mapping)
    }
}

struct Resolver<'a> {
    header: &'a LogHeader,
    joints: &'a [String],
    /// Joints whose effort a pattern does not mean; empty: none.
    undriven: &'a [bool],
}

impl Resolver<'_> {
    fn column(&self, signal: &str, name: &str) -> Result<usize, MappingError> {
        self.header.column(name).ok_or_else(|| MappingError::UnknownColumn {
            signal: signal.to_owned(),
            column: name.to_owned(),
            header: self.header.names.clone(),
            nearest: nearest(name, &self.header.names),
        })
    }

    fn is_undriven(&self, joint: usize) -> bool {
        self.undriven.get(joint).copied().unwrap_or(false)
    }

    /// Refuses a stated column for an effort that is known to be zero.
    fn refuse_undriven(&self, columns: &PerJointColumns) -> Result<(), MappingError> {
        let stated = self.joints.iter().zip(columns).enumerate().filter(|(k, _)| self.is_undriven(*k));
        match stated.filter_map(|(_, (joint, column))| Some((joint, column.as_ref()?))).next() {
            None => Ok(()),
            Some((joint, column)) => {
                Err(MappingError::Undriven { joint: joint.clone(), column: column.name.clone() })
            }
        }
    }

    fn channel(&self, name: &str, stated: &ChannelSpec) -> Result<(String, ColumnUse), MappingError> {
        let owner = format!("channel `{name}`");
        let column = self.column(&owner, &stated.column)?;
        check_scale(&owner, stated.scale)?;
        check_offset(&owner, stated.offset)?;
        let own = self.header.names[column].clone();
        let use_ = ColumnUse { column, name: own, factor: stated.scale, offset: stated.offset };
        Ok((name.to_owned(), use_))
    }

    fn time(&self, stated: &SignalSpec) -> Result<TimeSource, MappingError> {
        let names = match stated {
            SignalSpec::Full(full) => &full.columns,
            SignalSpec::Names(names) => names,
        };
        let count = if let ColumnNames::List(list) = names { list.len() } else { 1 };
        let parts = vec!["time".to_owned(); count];
        let alone = Resolver { header: self.header, joints: &parts, undriven: &[] };
        let mut parts: Vec<ColumnUse> = alone.signal(Signal::Time, stated)?.into_iter().flatten().collect();
        if parts.is_empty() {
            return Err(MappingError::Count { signal: Signal::Time, what: "columns", expected: 1, found: 0 });
        }
        let said = |full: &FullSignal| full.unit.is_some() || full.scale.is_some();
        let mut unit_stated = matches!(stated, SignalSpec::Full(full) if said(full));
        if !unit_stated {
            let in_name =
                |part: &ColumnUse| ColumnName::new(&part.name).reading(|_| true).flatten().is_some();
            unit_stated = parts.iter().all(in_name);
        }
        if !unit_stated && parts.len() > 1 {
            // Columns are added up: each must say what it counts.
            for part in &mut parts {
                let Some((_, unit)) = part_of_time(&part.name) else {
                    return Err(MappingError::PartOfTime { column: part.name.clone() });
                };
                part.factor = conversion(Signal::Time, unit, &part.name)?.factor;
            }
            unit_stated = true;
        }
        Ok(TimeSource::Columns(TimeColumns { parts, unit_stated }))
    }

    fn signal(&self, signal: Signal, stated: &SignalSpec) -> Result<PerJointColumns, MappingError> {
        let plain;
        let full = match stated {
            SignalSpec::Full(full) => full,
            SignalSpec::Names(columns) => {
                plain = FullSignal { columns: columns.clone(), unit: None, scale: None, offset: None };
                &plain
            }
        };
        let owner = signal.to_string();
        let names = self.names(signal, &full.columns)?;
        let scales = self.numbers(signal, "scale", full.scale.as_ref(), 1.0)?;
        let offsets = self.numbers(signal, "offset", full.offset.as_ref(), 0.0)?;
        let units = self.units(signal, full.unit.as_ref())?;
        let mut columns = Vec::with_capacity(names.len());
        for (k, name) in names.into_iter().enumerate() {
            let Some(name) = name else {
                columns.push(None);
                continue;
            };
            let column = self.column(&owner, &name)?;
            check_scale(&owner, scales[k])?;
            check_offset(&owner, offsets[k])?;
            let in_name = ColumnName::new(&name).reading(|_| true).flatten();
            let conversion = match units[k].or(in_name) {
                Some(unit) => conversion(signal, unit, &name)?,
                None => Conversion::IDENTITY,
            };
            if conversion.current && full.scale.is_none() {
                return Err(MappingError::NoGain { column: name });
            }
            columns.push(Some(ColumnUse {
                column,
                factor: conversion.factor * scales[k],
                offset: conversion.offset * scales[k] + offsets[k],
                name: self.header.names[column].clone(),
            }));
        }
        Ok(columns)
    }

    fn names(&self, signal: Signal, stated: &ColumnNames) -> Result<Vec<Option<String>>, MappingError> {
        let n = self.joints.len();
        match stated {
            ColumnNames::Pattern(pattern) => {
                let entry = |k: usize| format!("{pattern}[{k}]");
                if self.header.column(pattern).is_none()
                    && self.header.column(&entry(0)).is_some()
                    && !pattern.contains(['{', '}'])
                {
                    // Cells with lists: one entry per joint.
                    if self.header.column(&entry(n)).is_some() {
                        let found = (0..).take_while(|k| self.header.column(&entry(*k)).is_some()).count();
                        let what = "entries of the list";
                        return Err(MappingError::Count { signal, what, expected: n, found });
                    }
                    return Ok((0..n).map(|k| Some(entry(k))).collect());
                }
                if n > 1 && !pattern.contains("{}") && !pattern.contains("{joint}") {
                    let what = "columns (a pattern needs `{}` or `{joint}`)";
                    return Err(MappingError::Count { signal, what, expected: n, found: 1 });
                }
                let numbered = |k: usize| pattern.replace("{}", &k.to_string());
                let has = |k: usize| self.header.column(&numbered(k)).is_some();
                let from = usize::from(!(pattern.contains("{}") && has(0) && !has(n)));
                let named = self.joints.iter().enumerate();
                let meant = |k: usize| signal != Signal::Effort || !self.is_undriven(k);
                let column = |(k, joint): (usize, &String)| {
                    meant(k).then(|| numbered(k + from).replace("{joint}", joint))
                };
                Ok(named.map(column).collect())
            }
            ColumnNames::List(list) if list.len() == n => {
                Ok(list.iter().map(|c| (!c.is_empty()).then(|| c.clone())).collect())
            }
            ColumnNames::List(list) => {
                Err(MappingError::Count { signal, what: "columns", expected: n, found: list.len() })
            }
            ColumnNames::Table(table) => {
                self.check_joints(signal, table.keys())?;
                Ok(self.joints.iter().map(|j| table.get(j).cloned()).collect())
            }
        }
    }

    fn numbers(
        &self,
        signal: Signal,
        what: &'static str,
        stated: Option<&PerJoint>,
        default: f64,
    ) -> Result<Vec<f64>, MappingError> {
        let n = self.joints.len();
        match stated {
            None => Ok(vec![default; n]),
            Some(PerJoint::One(x)) => Ok(vec![*x; n]),
            Some(PerJoint::List(list)) if list.len() == n => Ok(list.clone()),
            Some(PerJoint::List(list)) => {
                Err(MappingError::Count { signal, what, expected: n, found: list.len() })
            }
            Some(PerJoint::Table(table)) => {
                self.check_joints(signal, table.keys())?;
                Ok(self.joints.iter().map(|j| table.get(j).copied().unwrap_or(default)).collect())
            }
        }
    }

    fn units<'u>(
        &self,
        signal: Signal,
        stated: Option<&'u Units>,
    ) -> Result<Vec<Option<&'u str>>, MappingError> {
        let n = self.joints.len();
        match stated {
            None => Ok(vec![None; n]),
            Some(Units::One(unit)) => Ok(vec![Some(unit); n]),
            Some(Units::List(list)) if list.len() == n => Ok(list.iter().map(|u| Some(u.as_str())).collect()),
            Some(Units::List(list)) => {
                Err(MappingError::Count { signal, what: "units", expected: n, found: list.len() })
            }
        }
    }

    fn check_joints<'n>(
        &self,
        signal: Signal,
        mut names: impl Iterator<Item = &'n String>,
    ) -> Result<(), MappingError> {
        match names.find(|n| !self.joints.contains(n)) {
            None => Ok(()),
            Some(joint) => {
                let meant = dynid_files::excerpt::closest(joint, self.joints).map(str::to_owned);
                Err(MappingError::UnknownJoint { signal, joint: joint.clone(), meant })
            }
        }
    }
}

fn check_scale(owner: &str, scale: f64) -> Result<(), MappingError> {
    if scale.is_finite() && scale != 0.0 {
        return Ok(());
    }
    let expected = "a finite number that is not zero";
    Err(MappingError::Number { owner: owner.to_owned(), what: "scale", expected, found: scale })
}

fn check_offset(owner: &str, offset: f64) -> Result<(), MappingError> {
    if offset.is_finite() {
        return Ok(());
    }
    let expected = "a finite number";
    Err(MappingError::Number { owner: owner.to_owned(), what: "offset", expected, found: offset })
}
