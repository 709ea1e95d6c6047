//! The configuration that applies the remedies.

use std::path::{Path, PathBuf};

use dynid_logs::columns::{ColumnUse, TimeSource};
use dynid_logs::{ColumnMapping, MappingSpec};
use dynid_rows::preflight::Wiring;
use toml::{Table, Value};

use super::{Check, Finding};
use crate::Error;
use crate::config::{Config, LogConfig};
use crate::estimate::short_name;
use crate::preflight::Fix;

/// Columns of a log, and its joints in the order of a wiring.
#[derive(Debug, Clone)]
pub(super) struct Mapped {
    pub(super) columns: ColumnMapping,
    pub(super) joints: Vec<String>,
}

impl Check {
    /// Findings that change the configuration.
    pub fn mended(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|f| !f.fixes.is_empty())
    }

    /// The configuration with the remedies applied, as a TOML text with absolute paths.
    ///
    /// Columns of a log that are put right are stated in full: names, factors and offsets to SI. Behind a transmission
    /// (`motor_side`) they are left as they are, since joints have no columns of their own there. `source`: the file that
    /// `config` was read from, whose other keys stay as they are.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::Config`] for `source`.
    pub fn corrected(&self, config: &Config, source: Option<&Path>) -> Result<String, Error> {
        let mut table = match source {
            Some(path) => read(path)?,
            None => Table::new(),
        };
        table.insert("robot".to_owned(), absolute(&config.robot));
        let training = config.training_logs();
        let count = training.len();
        let folder = source.and_then(Path::parent).unwrap_or(Path::new(""));
        for (key, logs, first) in [("log", &training, 0), ("validation", &config.validation, count)] {
            let stated = as_read(&table, key, folder);
            let entries: Vec<Value> = logs
                .iter()
                .enumerate()
                .filter(|(k, _)| !self.is_dropped(first + k))
                .map(|(k, log)| {
                    let own = stated.get(k).filter(|(path, _)| *path == log.path);
                    let own = own.map(|(_, entry)| (*entry).clone()).unwrap_or_default();
                    self.log_entry(first + k, log, config, own)
                })
                .collect();
            if entries.is_empty() {
                table.remove(key);
            } else {
                table.insert(key.to_owned(), Value::Array(entries));
            }
        }
        table.remove("trajectory");
        table.remove("period_s");
        if source.is_none() {
            self.run_columns(config, &mut table);
        } else {
            make_absolute(&mut table, config);
        }
        for fix in self.findings.iter().flat_map(|f| &f.fixes) {
            match fix {
                Fix::Delay(samples) => {
                    let section = table.entry("conditioning").or_insert_with(|| Value::Table(Table::new()));
                    if let Some(section) = section.as_table_mut() {
                        section.insert("delay_samples".to_owned(), Value::Float(round(*samples)));
                    }
                }
                Fix::Gravity(g) => {
                    table.insert("gravity".to_owned(), numbers(g.iter().map(|x| round(*x))));
                }
                _ => {}
            }
        }
        let mut out = String::from("# Configuration with remedies for what a pre-flight found:\n");
        for finding in self.mended() {
            let joint = finding.joint.as_ref().map_or_else(String::new, |j| format!(" of {j}"));
            out +=
                &format!("# - {}: {}{joint}: {}\n", short_name(&finding.log), finding.id, finding.evidence);
        }
        out += &toml::to_string(&table).unwrap_or_default();
        Ok(out)
    }

    fn is_dropped(&self, number: usize) -> bool {
        self.findings.iter().any(|f| f.number == number && f.fixes.contains(&Fix::Drop))
    }

    fn log_entry(&self, number: usize, log: &LogConfig, config: &Config, mut entry: Table) -> Value {
        entry.insert("path".to_owned(), absolute(&log.path));
        if let Some(trajectory) = &log.trajectory {
            entry.insert("trajectory".to_owned(), absolute(trajectory));
        }
        if let Some(period) = log.period_s {
            entry.insert("period_s".to_owned(), Value::Float(period));
        }
        if let Some((first, last)) = log.rows {
            entry.insert("rows".to_owned(), Value::Array(vec![whole(first), whole(last)]));
        }
        if let (Some((from, to)), false) = (log.part, entry.contains_key("part")) {
            entry.insert("part".to_owned(), numbers([from, to].into_iter()));
        }
        let own: Vec<&Fix> =
            self.findings.iter().filter(|f| f.number == number).flat_map(|f| &f.fixes).collect();
        let mut leave_out = log.leave_out.clone();
        for fix in &own {
            match fix {
                Fix::LeaveOut(ranges) => leave_out.extend(ranges),
                Fix::DropRepeated => {
                    entry.insert("drop_repeated".to_owned(), Value::Boolean(true));
                }
                _ => {}
            }
        }
        if !leave_out.is_empty() {
            let ranges = merged(leave_out);
            let ranges = ranges.into_iter().map(|(a, b)| Value::Array(vec![whole(a), whole(b)]));
            entry.insert("leave_out".to_owned(), Value::Array(ranges.collect()));
        }
        let columns = own
            .iter()
            .any(|f| matches!(f, Fix::Wiring { .. } | Fix::VelocityScale(..) | Fix::Rate(_) | Fix::Clock(_)));
        if let (true, None, Some(mapped)) = (columns, &config.motor_side, self.mapped.get(number)) {
            let spec = log.columns.as_ref().unwrap_or(&config.columns);
            entry.insert("columns".to_owned(), Value::Table(mapped.stated(&own, spec)));
        }
        Value::Table(entry)
    }

    /// What flags said of the columns, for logs whose columns are not stated in full.
    fn run_columns(&self, config: &Config, table: &mut Table) {
        let columns = Table::try_from(&config.columns)
            .unwrap_or_else(|e| unreachable!("columns are plain values: {e}"));
        if !columns.is_empty() {
            table.insert("columns".to_owned(), Value::Table(columns));
        }
        if let Some(g) = config.gravity {
            table.insert("gravity".to_owned(), numbers(g.into_iter()));
        }
        if !config.locked.is_empty() {
            let locked = config.locked.iter().map(|(j, x)| (j.clone(), Value::Float(*x)));
            table.insert("locked".to_owned(), Value::Table(locked.collect()));
        }
    }
}

impl Mapped {
    /// All columns in full, put right; how the file is read stays as it is stated.
    fn stated(&self, fixes: &[&Fix], spec: &MappingSpec) -> Table {
        let mut mapping = self.columns.clone();
        let place = |joint: usize| mapping.joints.iter().position(|j| *j == self.joints[joint]);
        let places: Vec<Option<usize>> = (0..self.joints.len()).map(place).collect();
        let mut rate = None;
        for fix in fixes {
            match fix {
                Fix::Wiring { wiring, velocities } => {
                    rewire(&mut mapping, &self.columns, &places, wiring, *velocities);
                }
                Fix::VelocityScale(joint, factor) => {
                    let column = places[*joint].zip(mapping.velocity.as_mut());
                    if let Some(Some(column)) = column.map(|(k, list)| &mut list[k]) {
                        column.factor *= factor;
                        column.offset *= factor;
                    }
                }
                Fix::Rate(hz) => rate = Some(*hz),
                Fix::Clock(factor) => match &mut mapping.time {
                    TimeSource::Columns(time) => time.parts.iter_mut().for_each(|part| {
                        part.factor *= factor;
                        part.offset *= factor;
                    }),
                    TimeSource::Rate(hz) => *hz /= factor,
                },
                _ => {}
            }
        }
        if let Some(hz) = rate {
            mapping.time = TimeSource::Rate(hz);
        }
        let spec = MappingSpec { allow_no_effort: false, ..MappingSpec::from(&mapping) }.read_as(spec);
        Table::try_from(spec).unwrap_or_else(|e| unreachable!("columns are plain values: {e}"))
    }
}

fn rewire(
    to: &mut ColumnMapping,
    from: &ColumnMapping,
    places: &[Option<usize>],
    wiring: &Wiring,
    velocities: bool,
) {
    let scaled = |column: &Option<ColumnUse>, factor: f64, offset: f64| {
        column.as_ref().map(|c| ColumnUse {
            factor: factor * c.factor,
            offset: factor * c.offset + offset,
            ..c.clone()
        })
    };
    for (joint, place) in places.iter().enumerate() {
        let Some(place) = place else { continue };
        let (position, effort) = (wiring.position[joint], wiring.effort[joint]);
        if let Some(source) = places[position.joint] {
            to.position[*place] = scaled(&from.position[source], position.factor, position.offset);
            if let (true, Some(of), Some(list)) = (velocities, from.velocity.as_ref(), to.velocity.as_mut()) {
                list[*place] = scaled(&of[source], position.factor, 0.0);
            }
        }
        if let (Some(source), Some(of), Some(list)) =
            (places[effort.joint], from.effort.as_ref(), to.effort.as_mut())
        {
            list[*place] = scaled(&of[source], effort.factor, 0.0);
        }
    }
}

fn read(path: &Path) -> Result<Table, Error> {
    let text = dynid_files::input::read_text(path)
        .map_err(|source| Error::Read { file: path.to_owned(), source })?;
    crate::config::toml_file::parse(&text, &path.display().to_string())
}

/// Entry of a log as the configuration file states it.
fn as_read<'a>(table: &'a Table, key: &str, folder: &Path) -> Vec<(PathBuf, &'a Table)> {
    let entries = table.get(key).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table);
    let paths = |entry: &Table| {
        let path = entry.get("path").and_then(Value::as_str).map(|path| folder.join(path))?;
        dynid_logs::log::files(&path).ok()
    };
    let of_entry = |entry| paths(entry).into_iter().flatten().map(move |path| (path, entry));
    entries.flat_map(of_entry).collect()
}

fn make_absolute(table: &mut Table, config: &Config) {
    if let (Some(file), Some(elements)) =
        (&config.elements.known_friction, table.get_mut("elements").and_then(Value::as_table_mut))
    {
        elements.insert("known_friction".to_owned(), absolute(file));
    }
    if let Some(out) = &config.out {
        table.insert("out".to_owned(), absolute(out));
    }
    if let (Some(file), Some(online)) =
        (&config.online.checkpoint, table.get_mut("online").and_then(Value::as_table_mut))
    {
        online.insert("checkpoint".to_owned(), absolute(file));
    }
}

fn absolute(path: &Path) -> Value {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    Value::String(path.display().to_string())
}

fn whole(n: usize) -> Value {
    Value::Integer(i64::try_from(n).unwrap_or(i64::MAX))
}

fn numbers(list: impl Iterator<Item = f64>) -> Value {
    Value::Array(list.map(Value::Float).collect())
}

/// To four decimals: more is noise.
fn round(x: f64) -> f64 {
    (1e4 * x).round() / 1e4
}

/// Ranges in order, those that touch as one.
fn merged(mut ranges: Vec<(usize, usize)>) -> Vec<(usize, usize)> {
    ranges.sort_unstable();
    let mut out: Vec<(usize, usize)> = Vec::new();
    for (first, last) in ranges {
        match out.last_mut() {
            Some(before) if first <= before.1 + 1 => before.1 = before.1.max(last),
            _ => out.push((first, last)),
        }
    }
    out
}
