//! Refuses outputs that cannot be written before anything is computed, so that a run writes all of its files or none.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use dynid::io::OutputError;

use crate::message::Failure;

/// Checks the files that a command is about to write.
///
/// `outputs`: argument that names the file, and the file. `inputs`: files that must not be overwritten.
///
/// # Errors
/// A missing folder, a folder in the place of a file, one file named twice, an input.
pub(crate) fn check_files(outputs: &[(&str, &Path)], inputs: &[&Path]) -> Result<(), Failure> {
    for (k, (argument, path)) in outputs.iter().enumerate() {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(unwritable(path, ErrorKind::NotFound));
        }
        if path.is_dir() {
            return Err(unwritable(path, ErrorKind::IsADirectory));
        }
        let place = place(path);
        if inputs.iter().any(|input| self::place(input) == place) {
            return Err(Failure::Usage(
                format!("{argument}: {} would be overwritten, which is read", path.display()),
                "give another name or folder",
            ));
        }
        if let Some((other, _)) = outputs[..k].iter().find(|(_, p)| self::place(p) == place) {
            return Err(Failure::Usage(
                format!("{argument}: {} is written by {other} already", path.display()),
                "give every output a name of its own",
            ));
        }
    }
    Ok(())
}

/// Checks a folder that is to be made, with its parents, if it does not exist, and files in it.
///
/// # Errors
/// Something that is no folder in its place or in that of a parent; as [`check_files`] if it exists.
pub(crate) fn check_folder(folder: &Path, files: &[PathBuf], inputs: &[&Path]) -> Result<(), Failure> {
    let here = Path::new(".");
    let existing =
        folder.ancestors().find(|f| f.exists()).filter(|f| !f.as_os_str().is_empty()).unwrap_or(here);
    if !existing.is_dir() {
        return Err(unwritable(folder, ErrorKind::NotADirectory));
    }
    if !folder.is_dir() {
        return Ok(());
    }
    let outputs: Vec<(&str, &Path)> = files.iter().map(|f| ("--out", f.as_path())).collect();
    check_files(&outputs, inputs)
}

fn unwritable(path: &Path, kind: ErrorKind) -> Failure {
    let file = path.display().to_string();
    Failure::from(OutputError::Unwritable { file, error: Error::from(kind) })
}

/// Where a path leads, links followed.
fn place(path: &Path) -> PathBuf {
    path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned())
}
