//! Finding signals by the names of columns.

use super::error::MappingError;
use super::units::{Conversion, conversion};
use super::{ColumnMapping, ColumnUse, TimeColumns, TimeSource};
use crate::log::{LogHeader, Missing};
use crate::signal::{
    CURRENT_NAMES, ColumnName, Signal, TIME_NAMES, is_command, names, names_joint, number_of, part_of_time,
};

/// Settings of [`ColumnMapping::guess`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GuessOptions {
    /// Sampling rate, Hz, in place of a time column. Default: none.
    pub rate_hz: Option<f64>,
    /// Allow joints without columns, such as gripper fingers. Default: off.
    pub allow_unlogged: bool,
    /// Drive gains per joint, N m/A or N/A, which turn current columns (`i1`, `current_1`) into effort. Default: none.
    pub current_gains: Option<Vec<f64>>,
    /// Accept a log without effort. Default: off.
    pub allow_no_effort: bool,
}

impl ColumnMapping {
    /// Assigns columns by their names.
    ///
    /// Names must match wholly, case aside: `q1`, `q_1`, `q[1]`, `q_<joint>`, `<joint>_q`, `<joint>.position`,
    /// `Position1`, .. with numbers in joint order from 1 (from 0 if there is a number 0); a name without number or joint
    /// (`q`, `tau`) serves a robot with one joint. Units follow in brackets or after `_`: `q1[deg]`, `t [ms]`, `time_ms`;
    /// none means SI. Velocity, acceleration and temperature are optional.
    ///
    /// # Errors
    /// [`MappingError`]: a signal is missing, ambiguous, or covers only some of the logged joints.
    pub fn guess(header: &[String], joints: &[String], options: &GuessOptions) -> Result<Self, MappingError> {
        let header = LogHeader::of_names(header);
        let finder = Finder::new(&header, joints);
        let time = finder.time(options.rate_hz)?;
        let position = finder.position(options.allow_unlogged)?;
        let logged: Vec<bool> = position.iter().map(Option::is_some).collect();
        let optional = |signal| finder.covering(signal, finder.find(signal)?, &logged);
        let mapping = ColumnMapping {
            joints: joints.to_vec(),
            velocity: optional(Signal::Velocity)?,
            acceleration: optional(Signal::Acceleration)?,
            temperature: finder.find(Signal::Temperature)?.map(|columns| of_logged(columns, &logged)),
            effort: finder.effort(options, &logged)?,
            undriven: vec![false; joints.len()],
            channels: Vec::new(),
            missing: Missing::Error,
            time,
            position,
        };
        mapping.check_shared()?;
        Ok(mapping)
    }

    /// No column may have two meanings.
    pub(super) fn check_shared(&self) -> Result<(), MappingError> {
        let mut seen: Vec<(usize, String)> = Vec::new();
        let time: PerJointColumns = self.time_columns().iter().cloned().map(Some).collect();
        let lists = [
            (Signal::Time, Some(&time)),
            (Signal::Position, Some(&self.position)),
            (Signal::Velocity, self.velocity.as_ref()),
            (Signal::Acceleration, self.acceleration.as_ref()),
            (Signal::Effort, self.effort.as_ref()),
            (Signal::Temperature, self.temperature.as_ref()),
        ];
        for (signal, list) in lists {
            for (k, use_) in list.into_iter().flatten().enumerate() {
                let Some(use_) = use_ else { continue };
                let meaning = match (signal, self.joints.get(k)) {
                    (Signal::Time, _) | (_, None) => signal.to_string(),
                    (_, Some(joint)) => format!("{signal} of `{joint}`"),
                };
                if let Some((_, first)) = seen.iter().find(|(c, _)| *c == use_.column) {
                    let (column, first) = (use_.name.clone(), first.clone());
                    return Err(MappingError::Shared { column, first, second: meaning });
                }
                seen.push((use_.column, meaning));
            }
        }
        Ok(())
    }
}

/// Columns per joint of one signal.
pub(super) type PerJointColumns = Vec<Option<ColumnUse>>;

/// Looks for signals in a header.
pub(super) struct Finder<'a> {
    log: &'a LogHeader,
    header: &'a [String],
    columns: Vec<ColumnName<'a>>,
    joints: &'a [String],
}

impl<'a> Finder<'a> {
    pub(super) fn new(log: &'a LogHeader, joints: &'a [String]) -> Self {
        let header = log.names.as_slice();
        Finder { log, header, columns: header.iter().map(|h| ColumnName::new(h)).collect(), joints }
    }

    pub(super) fn time(&self, rate_hz: Option<f64>) -> Result<TimeSource, MappingError> {
        if let Some(rate) = rate_hz {
            if rate.is_finite() && rate > 0.0 {
                return Ok(TimeSource::Rate(rate));
            }
            let (what, expected) = ("rate_hz", "a positive number of Hz");
            return Err(MappingError::Number { owner: "time".to_owned(), what, expected, found: rate });
        }
        if let [_, ..] = self.log.time.as_slice() {
            let part = |k: &usize| {
                let unit = part_of_time(&self.header[*k]).map(|(_, unit)| unit);
                self.column_use(Signal::Time, *k, unit)
            };
            let parts = self.log.time.iter().map(part).collect::<Result<Vec<_>, _>>()?;
            // Nanoseconds are said by the names of a pair alone.
            return Ok(TimeSource::Columns(TimeColumns { unit_stated: parts.len() > 1, parts }));
        }
        let mut found = self.time_columns();
        // Whole seconds alone (`stamp_sec` of `stamp_sec`, `stamp_nanosec`) are no time.
        if let Some(pair) = self.pair()?
            && found.iter().all(|(k, _)| pair.parts.iter().any(|part| part.column == *k))
        {
            return Ok(TimeSource::Columns(pair));
        }
        // `T` beside a time column is a temperature.
        if found.len() > 1 {
            found.retain(|(k, _)| self.columns[*k].raw.trim() != "T");
        }
        match found.as_slice() {
            [(column, unit)] => {
                let parts = vec![self.column_use(Signal::Time, *column, *unit)?];
                Ok(TimeSource::Columns(TimeColumns { parts, unit_stated: unit.is_some() }))
            }
            [] => Err(MappingError::Missing {
                signal: Signal::Time,
                joints: vec!["the log".to_owned()],
                looked_for: TIME_NAMES.map(str::to_owned).to_vec(),
                header: self.header.to_vec(),
            }),
            several => Err(MappingError::Ambiguous {
                signal: Signal::Time,
                owner: "the log".to_owned(),
                candidates: several.iter().map(|(k, _)| self.header[*k].clone()).collect(),
            }),
        }
    }

    /// Columns of whole seconds and nanoseconds, if there is one such pair.
    fn pair(&self) -> Result<Option<TimeColumns>, MappingError> {
        let parts: Vec<(usize, &str, &str)> = self
            .header
            .iter()
            .enumerate()
            .filter_map(|(k, name)| part_of_time(name).map(|(before, unit)| (k, before, unit)))
            .collect();
        let [(seconds, before, "s"), (nanoseconds, other, "ns")] = parts.as_slice() else { return Ok(None) };
        if before != other {
            return Ok(None);
        }
        let part = |k: &usize, unit| self.column_use(Signal::Time, *k, Some(unit));
        let parts = vec![part(seconds, "s")?, part(nanoseconds, "ns")?];
        Ok(Some(TimeColumns { parts, unit_stated: true }))
    }

    fn time_columns(&self) -> Vec<(usize, Option<&'a str>)> {
        let is_time = |(k, c): (usize, &ColumnName<'a>)| {
            let unit = c.reading(|stem| TIME_NAMES.contains(&stem));
            unit.filter(|_| !self.log.text[k]).map(|unit| (k, unit))
        };
        self.columns.iter().enumerate().filter_map(is_time).collect()
    }

    pub(super) fn position(&self, allow_unlogged: bool) -> Result<PerJointColumns, MappingError> {
        let position = self.find(Signal::Position)?.unwrap_or_else(|| vec![None; self.joints.len()]);
        self.check_positions(&position, allow_unlogged)?;
        Ok(position)
    }

    pub(super) fn check_positions(
        &self,
        position: &PerJointColumns,
        allow_unlogged: bool,
    ) -> Result<(), MappingError> {
        let without: Vec<bool> = position.iter().map(Option::is_none).collect();
        if without.contains(&true) && (!allow_unlogged || !without.contains(&false)) {
            return Err(self.missing(Signal::Position, &without));
        }
        Ok(())
    }

    pub(super) fn effort(
        &self,
        options: &GuessOptions,
        logged: &[bool],
    ) -> Result<Option<PerJointColumns>, MappingError> {
        let effort = match (self.find(Signal::Effort)?, &options.current_gains) {
            (None, Some(gains)) => self.currents(gains)?,
            (Some(effort), Some(_)) => {
                let column = effort.iter().flatten().next().map_or_else(String::new, |c| c.name.clone());
                return Err(MappingError::Idle {
                    key: "current_gains",
                    beside: format!("columns of the effort itself (`{column}`)"),
                });
            }
            (effort, None) => effort,
        };
        match self.covering(Signal::Effort, effort, logged)? {
            None if !options.allow_no_effort => Err(self.missing(Signal::Effort, logged)),
            effort => Ok(effort),
        }
    }

    fn currents(&self, gains: &[f64]) -> Result<Option<PerJointColumns>, MappingError> {
        let signal = Signal::Effort;
        if gains.len() != self.joints.len() {
            let (expected, found) = (self.joints.len(), gains.len());
            return Err(MappingError::Count { signal, what: "current_gains", expected, found });
        }
        if let Some(found) = gains.iter().find(|g| !g.is_finite() || **g == 0.0) {
            let (what, expected) = ("current_gains", "finite numbers that are not zero");
            return Err(MappingError::Number { owner: signal.to_string(), what, expected, found: *found });
        }
        let of_format = self.log.format.and_then(|f| f.currents()).and_then(|p| self.numbered(p));
        let mut found = match of_format {
            Some(columns) => Some(self.uses(signal, columns, Some("A"))?),
            None => self.find_group(signal, &CURRENT_NAMES, Some("A"))?,
        };
        for (column, gain) in found.iter_mut().flatten().zip(gains) {
            if let Some(column) = column {
                column.factor *= gain;
            }
        }
        Ok(found)
    }

    /// Columns of the first group of names that matches anything.
    pub(super) fn find(&self, signal: Signal) -> Result<Option<PerJointColumns>, MappingError> {
        let patterns = self.log.format.map_or(&[][..], |format| format.patterns(signal));
        if let Some(columns) = patterns.iter().find_map(|pattern| self.numbered(pattern)) {
            return self.uses(signal, columns, None).map(Some);
        }
        for group in names(signal) {
            if let Some(found) = self.find_group(signal, group, None)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Columns of a pattern whose `{}` counts joints from 0 and whose `{joint}` is their name; `None` if there is no such column.
    fn numbered(&self, pattern: &str) -> Option<Vec<Option<usize>>> {
        let column = |k: usize| {
            self.log.column(&pattern.replace("{joint}", &self.joints[k]).replace("{}", &k.to_string()))
        };
        let columns: Vec<Option<usize>> = (0..self.joints.len()).map(column).collect();
        columns.iter().any(Option::is_some).then_some(columns)
    }

    fn uses(
        &self,
        signal: Signal,
        columns: Vec<Option<usize>>,
        current: Option<&str>,
    ) -> Result<PerJointColumns, MappingError> {
        let use_of = |k: usize| self.column_use_of(signal, k, current, current.is_some());
        columns.into_iter().map(|column| column.map(use_of).transpose()).collect()
    }

    /// `current`: the unit of columns that state none, and the sign that gains are known.
    fn find_group(
        &self,
        signal: Signal,
        group: &[&str],
        current: Option<&str>,
    ) -> Result<Option<PerJointColumns>, MappingError> {
        let mut found: Vec<Vec<(usize, Option<&str>)>> = vec![Vec::new(); self.joints.len()];
        let times = self.time_columns();
        for name in group {
            let zero_based =
                self.columns.iter().any(|c| c.reading_of_path(|s| number_of(s, name) == Some(0)).is_some());
            for (k, column) in self.columns.iter().enumerate().filter(|(k, _)| !self.log.text[*k]) {
                if let Some((joint, unit)) = self.meant(column, name, zero_based) {
                    // A lone `t` or `T` is the time.
                    if signal == Signal::Temperature && times.len() < 2 && times.iter().any(|(t, _)| *t == k)
                    {
                        continue;
                    }
                    if signal == Signal::Temperature && column.raw.trim() == "t" {
                        continue;
                    }
                    found[joint].push((k, unit));
                }
            }
        }
        if found.iter().all(Vec::is_empty) {
            return Ok(None);
        }
        let mut columns = Vec::with_capacity(found.len());
        for (joint, mut candidates) in self.joints.iter().zip(found) {
            // What was asked of the robot is no measurement, where there is one.
            if candidates.iter().any(|(k, _)| !is_command(&self.header[*k])) {
                candidates.retain(|(k, _)| !is_command(&self.header[*k]));
            }
            columns.push(match candidates.as_slice() {
                [] => None,
                [(column, unit)] => {
                    let found = self.column_use_of(signal, *column, unit.or(current), current.is_some())?;
                    Some(found)
                }
                several => {
                    let candidates = several.iter().map(|(k, _)| self.header[*k].clone()).collect();
                    return Err(MappingError::Ambiguous { signal, owner: format!("`{joint}`"), candidates });
                }
            });
        }
        Ok(Some(columns))
    }

    /// The joint that a column means under a name of its signal, and the column's unit.
    fn meant(
        &self,
        column: &ColumnName<'a>,
        name: &str,
        zero_based: bool,
    ) -> Option<(usize, Option<&'a str>)> {
        for (k, joint) in self.joints.iter().enumerate() {
            if let Some(unit) = column.reading_of_path(|stem| names_joint(stem, name, joint)) {
                return Some((k, unit));
            }
        }
        for number in usize::from(!zero_based)..self.joints.len() + usize::from(!zero_based) {
            if let Some(unit) = column.reading_of_path(|stem| number_of(stem, name) == Some(number)) {
                return Some((number - usize::from(!zero_based), unit));
            }
        }
        let alone = column.reading(|stem| stem == name).filter(|_| self.joints.len() == 1);
        alone.map(|unit| (0, unit))
    }

    /// Demands that an optional signal, if there, covers every logged joint; drops the others.
    pub(super) fn covering(
        &self,
        signal: Signal,
        columns: Option<PerJointColumns>,
        logged: &[bool],
    ) -> Result<Option<PerJointColumns>, MappingError> {
        let Some(columns) = columns else { return Ok(None) };
        let without: Vec<bool> = columns.iter().zip(logged).map(|(c, l)| *l && c.is_none()).collect();
        if without.contains(&true) {
            return Err(self.missing(signal, &without));
        }
        Ok(Some(of_logged(columns, logged)))
    }

    /// The error for the joints that are marked.
    fn missing(&self, signal: Signal, marked: &[bool]) -> MappingError {
        let mut looked_for = Vec::new();
        let (mut joints, mut first) = (Vec::new(), None);
        for (k, joint) in self.joints.iter().enumerate().filter(|(k, _)| marked[*k]) {
            joints.push(format!("`{joint}`"));
            first.get_or_insert((k, joint));
        }
        if let Some((k, joint)) = first {
            for name in names(signal).iter().copied().flatten() {
                looked_for.extend([format!("{name}{}", k + 1), format!("{name}_{joint}")]);
            }
        }
        MappingError::Missing { signal, joints, looked_for, header: self.header.to_vec() }
    }

    fn column_use(
        &self,
        signal: Signal,
        column: usize,
        unit: Option<&str>,
    ) -> Result<ColumnUse, MappingError> {
        self.column_use_of(signal, column, unit, false)
    }

    fn column_use_of(
        &self,
        signal: Signal,
        column: usize,
        unit: Option<&str>,
        gains_known: bool,
    ) -> Result<ColumnUse, MappingError> {
        let name = self.header[column].clone();
        let conversion = unit.map_or(Ok(Conversion::IDENTITY), |unit| conversion(signal, unit, &name))?;
        if conversion.current && !gains_known {
            return Err(MappingError::NoGain { column: name });
        }
        Ok(ColumnUse { column, name, factor: conversion.factor, offset: conversion.offset })
    }
}

/// Columns of logged joints alone.
pub(super) fn of_logged(mut columns: PerJointColumns, logged: &[bool]) -> PerJointColumns {
    for (column, logged) in columns.iter_mut().zip(logged) {
        if !logged {
            *column = None;
        }
    }
    columns
}
