//! A motion for what plays it, beside its own files.

use std::path::{Path, PathBuf};

use dynid::Error;
use dynid::io::trajectory::Playback;
use dynid_terminal::message::{Failure, note};
use dynid_terminal::outputs::Outputs;

use crate::args::PlaybackArg;

/// The formats that are asked for, each once, with their files.
pub(super) fn files(asked: &[PlaybackArg], out: &Path) -> Vec<(Playback, PathBuf)> {
    let mut formats: Vec<(Playback, PathBuf)> = Vec::new();
    for format in asked.iter().map(|format| format.of()) {
        if formats.iter().all(|(known, _)| *known != format) {
            formats.push((format, out.join(format!("trajectory.{}", format.ending()))));
        }
    }
    formats
}

/// Writes these files, the first of which has a number among the outputs. What cannot be played is told, and no reason to lose the motion: gives
/// whether all are written.
pub(super) fn write(
    formats: &[(Playback, PathBuf)],
    (set, first): (&Outputs, usize),
    text: impl Fn(Playback, &Path) -> Result<String, Error>,
) -> Result<bool, Failure> {
    let mut all = true;
    for (number, (format, path)) in formats.iter().enumerate() {
        match text(*format, path) {
            Ok(text) => set.write(first + number, text.as_bytes())?,
            Err(reason) => {
                all = false;
                let hint = reason.hint().map_or_else(String::new, |hint| format!(" ({hint})"));
                note(&format!("not written: {reason}{hint}"));
            }
        }
    }
    Ok(all)
}
