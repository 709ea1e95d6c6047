//! What a log holds.

use dynid_logs::columns::{Signal, is_held, signal_of_name};
use dynid_logs::log::{LogFormat, Missing};
use dynid_logs::{ColumnMapping, MappingSpec, ReadingNote, Table};
use serde::Serialize;

use crate::Error;
use crate::config::LogConfig;
use crate::logs;

/// What a log holds, before any robot is known.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct LogInspection {
    /// File.
    pub log: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Rows.
    pub rows: usize,
    /// Length, s, if the time is understood.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// What was found out about reading it.
    pub notes: Vec<ReadingNote>,
    /// Columns of numbers.
    pub columns: Vec<LogColumn>,
    /// Columns of texts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub texts: Vec<String>,
    /// What could not be understood.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// A column of numbers.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
pub struct LogColumn {
    /// Name.
    pub name: String,
    /// Signal that its name suggests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signal: Option<String>,
    /// Rows that have a value.
    pub values: usize,
    /// Rate of its values by the median of their steps, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Longest step between two values, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_gap_s: Option<f64>,
    /// Steps that do not go forward in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out_of_order: Option<usize>,
    /// Least value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least: Option<f64>,
    /// Greatest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub greatest: Option<f64>,
}

/// Looks at all columns of a log.
///
/// # Errors
/// [`Error::LogFile`].
pub fn inspect_log(log: &LogConfig, columns: &MappingSpec) -> Result<LogInspection, Error> {
    let logs::WholeTable { table, header, texts, mut notes } = logs::table(log, columns)?;
    let mut warnings = Vec::new();
    // A mapping without joints: the time alone is understood.
    let without_joints = MappingSpec { allow_no_effort: true, ..columns.clone() };
    let time = ColumnMapping::of_log(&header, &[], &[], &without_joints).and_then(|mut mapping| {
        if let Some(found) = mapping.settle_time(&table, false)? {
            let column = mapping.time_columns().first().map_or("", |c| c.name.as_str());
            let value = format!("`{column}` in {}, {:.4} Hz", found.unit, found.rate_hz);
            notes.push(ReadingNote::new("time", value, found.reason));
        }
        mapping.extract(&table).map(|signals| signals.time)
    });
    let time = match time {
        Ok(time) => Some(time),
        Err(fault) => {
            let hint = fault.hint().map_or_else(String::new, |hint| format!(" ({hint})"));
            warnings.push(format!("{fault}{hint}"));
            None
        }
    };
    if header.format.map(LogFormat::missing) == Some(Missing::Interpolate) {
        notes.extend(held(&table));
    }
    let rows = table.rows;
    let described = (table.header.iter().zip(&table.columns).zip(&table.origin))
        .map(|((name, values), origin)| column(name, values, *origin, time.as_deref()))
        .collect();
    let duration_s = time.as_ref().and_then(|t| Some(t.last()? - t.first()?));
    Ok(LogInspection {
        log: table.source,
        sha256: table.sha256,
        rows,
        duration_s,
        notes,
        columns: described,
        texts,
        warnings,
    })
}

/// Commands with stamps of their own, which are held where topics are joined.
fn held(table: &Table) -> Option<ReadingNote> {
    let with_gaps = table.header.iter().zip(&table.columns).filter(|(_, x)| x.iter().any(|x| x.is_nan()));
    let names: Vec<String> = with_gaps.map(|(name, _)| name.clone()).filter(|name| is_held(name)).collect();
    let shown = names.iter().take(4).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let more = if names.len() > 4 { ", .." } else { "" };
    let reason =
        "what is asked of the robot holds until the next value; measurements are interpolated linearly";
    (!names.is_empty()).then(|| ReadingNote::new("commands held", format!("{shown}{more}"), reason))
}

fn column(name: &str, values: &[f64], origin: i64, time: Option<&[f64]>) -> LogColumn {
    let present: Vec<usize> = (0..values.len()).filter(|k| !values[*k].is_nan()).collect();
    let steps: Option<Vec<f64>> =
        time.map(|t| present.windows(2).map(|pair| t[pair[1]] - t[pair[0]]).collect());
    let mut sorted = steps.clone().unwrap_or_default();
    sorted.sort_unstable_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().filter(|step| *step > 0.0);
    let all = || present.iter().map(|k| values[*k] + origin as f64);
    LogColumn {
        name: name.to_owned(),
        signal: signal_of_name(name).map(|signal: Signal| signal.to_string()),
        values: present.len(),
        rate_hz: usual.map(|step| 1.0 / step),
        longest_gap_s: usual.and(sorted.last().copied()),
        out_of_order: steps.map(|steps| steps.iter().filter(|step| **step <= 0.0).count()),
        least: all().reduce(f64::min),
        greatest: all().reduce(f64::max),
    }
}
