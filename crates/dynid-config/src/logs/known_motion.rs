//! Logs of a motion that a trajectory file describes.

use std::path::Path;

use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_logs::TrajectoryFile;
use dynid_motion::Log;

/// Channel that tells approach (0), record (1) and return (2) apart.
const PHASE: &str = "phase";

/// The record without approach and return, its period, s, and the trajectory file as it was read.
///
/// With a channel `phase`, rows of phase 1 are kept. Without one the log is taken to start with the approach if it is long
/// enough for approach and record, else to be the record alone. Nothing is cut unless `cut`.
///
/// `joints`: joints of the robot, which those of the file must be among.
pub(super) fn record(
    log: Log,
    path: &Path,
    joints: &[String],
    cut: bool,
) -> Result<(Log, f64, SourceFile), Error> {
    let (file, source) = TrajectoryFile::read_source(path)?;
    check_joints(&file, path, joints)?;
    let period_s = file.motion.period();
    if !cut {
        return Ok((log, period_s, source));
    }
    let rows = match log.channels().iter().find(|c| c.name == PHASE) {
        Some(phase) => rows_of_record(&phase.values),
        None => rows_by_time(log.time(), &file),
    };
    Ok((log.slice(rows)?, period_s, source))
}

/// From the first to the last row of phase 1.
fn rows_of_record(phase: &[f64]) -> std::ops::Range<usize> {
    let first = phase.iter().position(|p| *p == 1.0).unwrap_or(0);
    let last = phase.iter().rposition(|p| *p == 1.0).map_or(0, |k| k + 1);
    first..last
}

fn rows_by_time(time: &[f64], file: &TrajectoryFile) -> std::ops::Range<usize> {
    let record = file.motion.period() * file.motion.periods() as f64;
    let approach = file.approach.as_ref().map_or(0.0, |leg| leg.duration_s);
    let (start, end) = (time[0], time[time.len() - 1]);
    let step = (end - start) / (time.len() - 1) as f64;
    let from = if end - start + 1.5 * step >= approach + record { start + approach } else { start };
    // Clocks of controller and logger part by less than a step in a record.
    let first = time.partition_point(|t| *t < from - 0.5 * step);
    let last = time.partition_point(|t| *t < from + record + 0.5 * step);
    first..last
}

fn check_joints(file: &TrajectoryFile, path: &Path, joints: &[String]) -> Result<(), Error> {
    let fault = |expected: String, found: String| Error::TrajectoryJoints {
        file: path.display().to_string(),
        expected,
        found,
    };
    let foreign = file.joints.iter().filter_map(|j| j.name.as_ref()).find(|n| !joints.contains(*n));
    if let Some(name) = foreign {
        return Err(fault(format!("joints of the robot ({})", joints.join(", ")), format!("`{name}`")));
    }
    if file.joints.len() > joints.len() {
        return Err(fault(format!("at most {} joints", joints.len()), file.joints.len().to_string()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(approach: &str) -> TrajectoryFile {
        let text = format!(
            r#"{{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": 1.5707963267948966,
            "periods": 2, "joints": [{{"q0": 0, "a": [1], "b": [0]}}], "approach": {approach}}}"#
        );
        TrajectoryFile::parse(&text, "t").unwrap()
    }

    #[test]
    fn approach_and_return_are_cut_where_the_log_holds_them() {
        let time = |end: f64| (0..=(end * 10.0) as usize).map(|k| 5.0 + 0.1 * k as f64).collect::<Vec<f64>>();
        let approach = file(r#"{"from": [0], "duration_s": 3}"#);
        assert_eq!(rows_by_time(&time(14.0), &approach), 30..111);
        assert_eq!(rows_by_time(&time(11.0), &approach), 30..111);
        assert_eq!(rows_by_time(&time(8.0), &approach), 0..81);
        assert_eq!(rows_by_time(&time(9.0), &file("null")), 0..81);
        assert_eq!(rows_of_record(&[0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 2.0]), 3..6);
        assert_eq!(rows_of_record(&[0.0, 2.0]), 0..0);
    }
}
