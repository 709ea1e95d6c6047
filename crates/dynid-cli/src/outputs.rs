//! Output files of commands: whether they can be written is found out before anything is computed, and they appear together.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use dynid::io::output::{OutputError, OutputSet};

use crate::message::{Failure, note};

/// Readies the files that a command is about to write, the most telling first; their folders must exist.
///
/// `outputs`: argument that names the file, and the file. `inputs`: files that must not be overwritten.
///
/// # Errors
/// A missing folder, a folder in the place of a file, one file named twice, an input, what cannot be written.
pub(crate) fn prepare_files(outputs: &[(&str, &Path)], inputs: &[&Path]) -> Result<OutputSet, Failure> {
    for (_, path) in outputs {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(unwritable(path, ErrorKind::NotFound));
        }
    }
    prepare(outputs, inputs)
}

/// Readies files of a folder that is made, with its parents, if it does not exist.
///
/// # Errors
/// Fails as [`prepare_files`] does, and for something that is no folder in the place of the folder or of a parent.
pub(crate) fn prepare_folder(files: &[PathBuf], inputs: &[&Path]) -> Result<OutputSet, Failure> {
    let outputs: Vec<(&str, &Path)> = files.iter().map(|f| ("--out", f.as_path())).collect();
    prepare(&outputs, inputs)
}

/// Refuses outputs that are folders, inputs, or each other.
///
/// # Errors
/// The first such output.
pub(crate) fn check(outputs: &[(&str, &Path)], inputs: &[&Path]) -> Result<(), Failure> {
    for (k, (argument, path)) in outputs.iter().enumerate() {
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

fn prepare(outputs: &[(&str, &Path)], inputs: &[&Path]) -> Result<OutputSet, Failure> {
    check(outputs, inputs)?;
    let set = OutputSet::prepare(&outputs.iter().map(|(_, path)| *path).collect::<Vec<_>>())?;
    for other in set.others() {
        note(&format!(
            "another run (process {}, begun {} s ago) is going to write into {} too: the one that ends later stays",
            other.process,
            other.age.as_secs(),
            other.folder.display()
        ));
    }
    Ok(set)
}

fn unwritable(path: &Path, kind: ErrorKind) -> Failure {
    let file = path.display().to_string();
    Failure::from(OutputError::Unwritable { file, error: Error::from(kind) })
}

/// Where a path leads, links followed.
fn place(path: &Path) -> PathBuf {
    path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned())
}
