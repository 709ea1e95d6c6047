//! Sampled trajectories as tables.

use std::path::Path;

use dynid_files::output::OutputError;
use dynid_motion::trajectory::{Phase, Sampled};

use crate::csv::RowWriter;

/// Writes `t, q_<joint>.., dq_<joint>.., ddq_<joint>..` (s; rad or m and their derivatives) and, if phases are given, `phase`:
/// 0 approach, 1 record, 2 return. The table reads back as states ([`crate::states`]) and, with efforts added, as a log.
///
/// `joints`: one name per coordinate; `phases`: one per sample.
///
/// # Errors
/// [`OutputError`]: names or phases of another number, a failed write.
pub fn write_csv(
    path: impl AsRef<Path>,
    joints: &[String],
    sampled: &Sampled,
    phases: Option<&[Phase]>,
) -> Result<(), OutputError> {
    write_csv_with_channels(path, joints, sampled, &[], phases)
}

/// Writes what [`write_csv`] does, with a column per channel before the phase: loads, temperatures, a value per sample each. The table
/// reads back as [`TrajectorySamples`](super::TrajectorySamples).
///
/// # Errors
/// Fails as [`write_csv`] does; also for channels of another length.
pub fn write_csv_with_channels(
    path: impl AsRef<Path>,
    joints: &[String],
    sampled: &Sampled,
    channels: &[(String, Vec<f64>)],
    phases: Option<&[Phase]>,
) -> Result<(), OutputError> {
    let path = path.as_ref();
    let n = sampled.samples();
    check_shape(path, "joint names", sampled.coordinates(), joints.len())?;
    if let Some(phases) = phases {
        check_shape(path, "phases", n, phases.len())?;
    }
    for (name, values) in channels {
        check_shape(path, &format!("values of `{name}`"), n, values.len())?;
    }
    let mut header = vec!["t".to_owned()];
    for prefix in ["q", "dq", "ddq"] {
        header.extend(joints.iter().map(|j| format!("{prefix}_{j}")));
    }
    header.extend(channels.iter().map(|(name, _)| name.clone()));
    header.extend(phases.map(|_| "phase".to_owned()));
    let mut writer = RowWriter::create(path, &header)?;
    let mut row = Vec::with_capacity(header.len());
    for s in 0..n {
        row.clear();
        row.push(sampled.time[s]);
        for signal in [&sampled.q, &sampled.dq, &sampled.ddq] {
            row.extend((0..joints.len()).map(|c| signal[c * n + s]));
        }
        row.extend(channels.iter().map(|(_, values)| values[s]));
        row.extend(phases.map(|p| f64::from(p[s].number())));
        writer.row(&row)?;
    }
    writer.finish()
}

/// Writes what drives are told: `t`, then `cmd_<joint>` of every joint. Beside readings in the same rows it is a log of commands and positions.
///
/// `commands`: per joint a value per sample.
///
/// # Errors
/// [`OutputError`]: names or commands of another number, a failed write.
pub fn write_commands(
    path: impl AsRef<Path>,
    joints: &[String],
    time: &[f64],
    commands: &[Vec<f64>],
) -> Result<(), OutputError> {
    let path = path.as_ref();
    check_shape(path, "joint names", commands.len(), joints.len())?;
    for (joint, values) in joints.iter().zip(commands) {
        check_shape(path, &format!("commands of `{joint}`"), time.len(), values.len())?;
    }
    let header: Vec<String> =
        std::iter::once("t".to_owned()).chain(joints.iter().map(|j| format!("cmd_{j}"))).collect();
    let mut writer = RowWriter::create(path, &header)?;
    let mut row = Vec::with_capacity(header.len());
    for (s, t) in time.iter().enumerate() {
        row.clear();
        row.push(*t);
        row.extend(commands.iter().map(|values| values[s]));
        writer.row(&row)?;
    }
    writer.finish()
}

/// Fails unless the counts agree.
pub(super) fn check_shape(path: &Path, what: &str, expected: usize, found: usize) -> Result<(), OutputError> {
    if expected == found {
        return Ok(());
    }
    Err(OutputError::Shape { file: path.display().to_string(), what: what.to_owned(), expected, found })
}
