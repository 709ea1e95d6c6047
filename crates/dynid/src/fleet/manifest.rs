//! The table of a fleet's logs: which robot each is of, when it began, and what is known of it as a whole.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_identify::reduction::Origin;

use super::FleetFault;
use crate::Error;

/// A log of a manifest.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The log as the manifest states it.
    pub log: String,
    /// Where it lies.
    pub path: PathBuf,
    /// Where it comes from.
    pub origin: Origin,
}

/// Reads a manifest: a CSV table with the columns `log` and `robot`, and if need be `start` and covariates.
///
/// - `log`: path of a log, relative to the manifest; a part of a file as `FILE#MEMBER`.
/// - `robot`: name or serial number of the robot.
/// - `start`: when the log began, as `2026-03-01T12:00:00Z`, with another offset from UTC, as a day, or in seconds since 1970.
/// - any other column holds numbers that are true for the whole log, or nothing; columns whose name begins with `#` are comments.
///
/// # Errors
/// [`FleetFault::Manifest`], [`Error::Read`].
pub fn manifest(path: &Path) -> Result<Vec<Entry>, Error> {
    let bytes = dynid_files::input::read(path).map_err(|source| Error::Read { file: path.into(), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(entries(&bytes, &path.display().to_string(), folder)?)
}

fn entries(bytes: &[u8], file: &str, folder: &Path) -> Result<Vec<Entry>, FleetFault> {
    let fault = |row: u64, column: &str, expected: &str, found: String| FleetFault::Manifest {
        file: file.to_owned(),
        row,
        column: column.to_owned(),
        expected: expected.to_owned(),
        found,
    };
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
    let named = |e: csv::Error| {
        let row = e.position().map_or(0, csv::Position::line);
        fault(row, "-", "a table of comma-separated values, every row as long as the first", e.to_string())
    };
    let names = table.headers().map_err(named)?.clone();
    let mut seen = std::collections::BTreeSet::new();
    if let Some(twice) = names.iter().find(|name| !seen.insert(name.to_string())) {
        return Err(fault(1, twice, "every column once", "it twice".to_owned()));
    }
    let column = |name: &str| names.iter().position(|n| n == name);
    let needed = |name: &str| {
        let there = names.iter().collect::<Vec<_>>().join(", ");
        column(name).ok_or_else(|| fault(1, name, "this column", there))
    };
    let (log, robot, start) = (needed("log")?, needed("robot")?, column("start"));
    let mut out = Vec::new();
    for record in table.records() {
        let record = record.map_err(named)?;
        let row = record.position().map_or(0, csv::Position::line);
        let text = |at: usize| record.get(at).unwrap_or_default();
        let stated = |at: usize, what: &str| match text(at) {
            "" => Err(fault(row, &names[at], what, "nothing".to_owned())),
            text => Ok(text.to_owned()),
        };
        let (log, robot) = (stated(log, "the path of a log")?, stated(robot, "the name of a robot")?);
        let start_s = match start.map(text).filter(|text| !text.is_empty()) {
            None => None,
            Some(text) => Some(date(text).ok_or_else(|| {
                fault(
                    row,
                    "start",
                    "a date as 2026-03-01T12:00:00Z, 2026-03-01, or seconds since 1970",
                    format!("`{text}`"),
                )
            })?),
        };
        let mut covariates = BTreeMap::new();
        for (at, name) in names.iter().enumerate() {
            if ["log", "robot", "start"].contains(&name) || name.starts_with('#') || text(at).is_empty() {
                continue;
            }
            let number: Option<f64> = text(at).parse().ok().filter(|x: &f64| x.is_finite());
            let expected = "a number that holds for the whole log, or nothing";
            let number = number.ok_or_else(|| fault(row, name, expected, format!("`{}`", text(at))))?;
            covariates.insert(name.to_owned(), number);
        }
        out.push(Entry { path: folder.join(&log), log, origin: Origin { robot, start_s, covariates } });
    }
    match out.is_empty() {
        true => Err(fault(2, "log", "at least one log", "none".to_owned())),
        false => Ok(out),
    }
}

/// Seconds since 1970 of a date as the column `start` of a manifest states it.
pub fn date(text: &str) -> Option<f64> {
    if let Ok(seconds) = text.parse::<f64>() {
        return seconds.is_finite().then_some(seconds);
    }
    let day = text.parse::<jiff::civil::Date>().ok().filter(|_| !text.contains(['T', 't', ' ']));
    let stamp: jiff::Timestamp =
        day.map_or_else(|| text.to_owned(), |day| format!("{day}T00:00:00Z")).parse().ok()?;
    Some(stamp.as_second() as f64 + 1e-9 * f64::from(stamp.subsec_nanosecond()))
}

/// The day of a date, and its time: `2026-03-01 12:00`.
pub(super) fn day(seconds: f64) -> String {
    let stamp = jiff::Timestamp::from_second(seconds.round() as i64);
    stamp.map_or_else(|_| format!("{seconds:.0} s"), |stamp| stamp.strftime("%Y-%m-%d %H:%M").to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Entry>, FleetFault> {
        entries(text.as_bytes(), "m.csv", Path::new("logs"))
    }

    #[test]
    fn dates_numbers_and_comments_are_read() {
        let text = "log, robot, start, temperature, #who\na.csv,r1,2026-03-01T12:00:00+02:00,31.5,me\nb.csv,r2,2026-03-01,,\nc.csv,r1,1.5,20,\n";
        let found = read(text).expect("reads");
        assert_eq!(found[0].path, Path::new("logs/a.csv"));
        let starts: Vec<Option<f64>> = found.iter().map(|e| e.origin.start_s).collect();
        assert_eq!(starts, [Some(1_772_359_200.0), Some(1_772_323_200.0), Some(1.5)]);
        assert_eq!(found[0].origin.covariates, BTreeMap::from([("temperature".to_owned(), 31.5)]));
        assert!(found[1].origin.covariates.is_empty());
        assert_eq!(day(1_772_359_200.0), "2026-03-01 10:00");
    }

    #[test]
    fn what_cannot_be_read_is_named_by_row_and_column() {
        let found = |text: &str| match read(text) {
            Err(FleetFault::Manifest { row, column, .. }) => (row, column),
            other => panic!("{other:?}"),
        };
        assert_eq!(found("log,start\na.csv,\n"), (1, "robot".to_owned()));
        assert_eq!(found("log,robot\na.csv,\n"), (2, "robot".to_owned()));
        assert_eq!(found("log,robot,start\na.csv,r,soon\n"), (2, "start".to_owned()));
        assert_eq!(found("log,robot,load\na.csv,r,1\nb.csv,r,heavy\n"), (3, "load".to_owned()));
        assert_eq!(found("log,robot,robot\na.csv,r,1\n"), (1, "robot".to_owned()));
        assert_eq!(found("log,robot\na.csv,r,1\n").0, 2);
        assert_eq!(found("log,robot\n"), (2, "log".to_owned()));
    }
}
