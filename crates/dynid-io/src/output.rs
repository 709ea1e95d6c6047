//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

/// Why a file was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The operating system refused.
    #[error("{file}: cannot be written: {error}")]
    Unwritable {
        /// File.
        file: String,
        /// Reason.
        error: io::Error,
    },
    /// A value is NaN or infinite.
    #[error("{file}: row {row}, column `{column}`: expected a finite number, found {found}")]
    NotFinite {
        /// File.
        file: String,
        /// Data row, from 1.
        row: usize,
        /// Column name.
        column: String,
        /// The value.
        found: f64,
    },
    /// Rows or columns do not fit the header.
    #[error("{file}: {what}: expected {expected}, found {found}")]
    Shape {
        /// File.
        file: String,
        /// What was counted.
        what: String,
        /// Expected count.
        expected: usize,
        /// Found count.
        found: usize,
    },
}

impl OutputError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            OutputError::Unwritable { .. } => {
                Some("check that the folder exists and may be written".to_owned())
            }
            OutputError::NotFinite { .. } | OutputError::Shape { .. } => None,
        }
    }
}

/// Writes `bytes` to a temporary file in the folder of `path` and renames it to `path`.
///
/// A reader sees the old file or the new one, never a part. A symbolic link is followed; a path that is no regular file
/// (a pipe, `/dev/stdout`) is written directly.
///
/// # Errors
/// [`OutputError::Unwritable`]; the temporary file is removed.
pub fn write_atomically(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), OutputError> {
    let mut file = AtomicFile::create(path.as_ref())?;
    file.write_all(bytes).map_err(|error| file.fault(error))?;
    file.finish()
}

/// A file under a temporary name that [`AtomicFile::finish`] renames; dropped before that, it is removed.
#[derive(Debug)]
pub(crate) struct AtomicFile {
    file: File,
    target: PathBuf,
    /// `None` if the target is written directly, or once it has been renamed.
    temporary: Option<PathBuf>,
}

impl AtomicFile {
    pub(crate) fn create(path: &Path) -> Result<Self, OutputError> {
        Self::open(path).map_err(|error| OutputError::Unwritable { file: path.display().to_string(), error })
    }

    fn open(path: &Path) -> io::Result<Self> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let target = match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if !metadata.is_file() => {
                let file = File::options().write(true).open(path)?;
                return Ok(AtomicFile { file, target: path.to_owned(), temporary: None });
            }
            Ok(_) => fs::canonicalize(path)?,
            Err(_) => path.to_owned(),
        };
        let name = target.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let unique = (std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed));
        let name = format!(".{}.{}-{}.tmp", name.to_string_lossy(), unique.0, unique.1);
        let temporary = target.with_file_name(name);
        let file = File::create_new(&temporary)?;
        Ok(AtomicFile { file, target, temporary: Some(temporary) })
    }

    /// The error of a failed write to this file.
    pub(crate) fn fault(&self, error: io::Error) -> OutputError {
        OutputError::Unwritable { file: self.target.display().to_string(), error }
    }

    /// Makes the file appear under its name.
    pub(crate) fn finish(mut self) -> Result<(), OutputError> {
        if let Some(temporary) = self.temporary.take() {
            let renamed = self.file.sync_all().and_then(|()| fs::rename(&temporary, &self.target));
            if let Err(error) = renamed {
                self.temporary = Some(temporary);
                return Err(self.fault(error));
            }
        }
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // Nobody is left to tell if even the removal fails.
            let _ = fs::remove_file(temporary);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_replaces_the_old_one_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.txt");
        write_atomically(&path, b"one").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["out.txt"]);
    }

    #[test]
    fn an_unfinished_file_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = AtomicFile::create(&folder.path().join("out.txt")).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_missing_folder_and_a_folder_are_errors_with_the_path() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().join("no/such/out.txt"), folder.path().to_owned()] {
            let error = write_atomically(&path, b"x").unwrap_err();
            assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
        }
    }
}
