//! Files that appear whole or not at all, and sets of files that appear together or not at all.

mod set;

pub use set::{OtherRun, OutputSet};

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

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
    /// Another run has been publishing into the folder for too long.
    #[error("{folder}: another run has been writing its files there for more than {seconds} s")]
    Busy {
        /// Folder.
        folder: String,
        /// Time that was waited, s.
        seconds: u64,
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
    /// The name of the file tells no format that can hold what is written.
    #[error("{file}: expected {expected}, found {found}")]
    Format {
        /// File.
        file: String,
        /// What can be written.
        expected: &'static str,
        /// What the name tells.
        found: String,
    },
    /// A motion that what it is written for cannot play.
    #[error("{file}: {subject}: expected {expected}, found {found}")]
    Refused {
        /// File.
        file: String,
        /// What is beyond.
        subject: String,
        /// What can be played.
        expected: String,
        /// What the motion has.
        found: String,
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
            OutputError::Busy { .. } => {
                Some("let it end, or give a folder of its own to each run".to_owned())
            }
            OutputError::Format { .. } => Some("give the file a name with such an end".to_owned()),
            OutputError::Refused { .. } => Some(
                "other limits (`[limits]`), rates or a motion from rest may do; or leave the format out"
                    .to_owned(),
            ),
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
pub struct AtomicFile {
    file: File,
    target: PathBuf,
    /// `None` if the target is written directly, or once it has been renamed.
    temporary: Option<PathBuf>,
}

impl AtomicFile {
    /// Opens a file under a temporary name beside `path`; a path that is no regular file is opened itself.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        Self::open(path).map_err(|error| OutputError::Unwritable { file: path.display().to_string(), error })
    }

    fn open(path: &Path) -> io::Result<Self> {
        let target = match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if !metadata.is_file() => {
                let file = File::options().write(true).open(path)?;
                return Ok(AtomicFile { file, target: path.to_owned(), temporary: None });
            }
            Ok(_) => fs::canonicalize(path)?,
            Err(_) => path.to_owned(),
        };
        if target.file_name().is_none() {
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let folder = folder_of(&target);
        remove_abandoned(&folder, false);
        // What a run that was killed left behind, of the same process number in a container too, must not stand in the way.
        let (file, temporary) = fresh(&folder, |path| File::create_new(path))?;
        // Held until the file is closed: it tells that somebody still writes. Where locks do not exist nothing is removed.
        let _ = file.try_lock();
        Ok(AtomicFile { file, target, temporary: Some(temporary) })
    }

    /// The error of a failed write to this file.
    pub fn fault(&self, error: io::Error) -> OutputError {
        OutputError::Unwritable { file: self.target.display().to_string(), error }
    }

    /// Makes the file appear under its name.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`]; the temporary file is removed.
    pub fn finish(mut self) -> Result<(), OutputError> {
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

/// Beginning and end of names of temporary files and folders.
const TEMPORARY: (&str, &str) = (".dynid-", ".tmp");

/// Folder of a file.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Makes something under a temporary name that nothing has; the name tells process and time, s since 1970.
fn fresh<T>(folder: &Path, make: impl Fn(&Path) -> io::Result<T>) -> io::Result<(T, PathBuf)> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let process = std::process::id();
    loop {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let count = COUNTER.fetch_add(1, Ordering::Relaxed);
        let name = format!(
            "{}{process}-{}-{}-{count}{}",
            TEMPORARY.0,
            now.as_secs(),
            now.subsec_nanos(),
            TEMPORARY.1
        );
        let path = folder.join(name);
        match make(&path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|made| (made, path)),
        }
    }
}

/// Younger temporary files are left alone, s: their owner may not have locked them yet.
const YOUNG_S: u64 = 10;

/// Removes temporary files, or folders of sets, whose owner has gone: those that can be locked. Failures leave them to a later run.
fn remove_abandoned(folder: &Path, folders: bool) {
    for path in temporary(folder) {
        let is_folder = path.is_dir();
        let is_young = owner(&path).is_none_or(|(_, age)| age.as_secs() < YOUNG_S);
        if is_folder != folders || is_young {
            continue;
        }
        // A lock that is free tells that nobody holds the file open any more.
        let free = File::open(&path).and_then(|file| Ok(file.try_lock()?)).is_ok();
        if free {
            let _ = if is_folder { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        }
    }
}

/// Process and age of the run that made a temporary file or folder, by its name.
fn owner(temporary: &Path) -> Option<(u32, Duration)> {
    let mut parts = temporary.file_name()?.to_str()?.strip_prefix(TEMPORARY.0)?.split('-');
    let process = parts.next()?.parse().ok()?;
    let since = UNIX_EPOCH + Duration::from_secs(parts.next()?.parse().ok()?);
    Some((process, SystemTime::now().duration_since(since).unwrap_or_default()))
}

/// Temporary files and folders of this program in a folder.
fn temporary(folder: &Path) -> Vec<PathBuf> {
    let is_ours = |name: &str| name.starts_with(TEMPORARY.0) && name.ends_with(TEMPORARY.1);
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|e| e.file_name().to_str().is_some_and(is_ours)).map(|e| e.path()).collect()
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
    fn what_a_killed_run_left_is_removed_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let left = format!(".dynid-{}-1-2-0.tmp", std::process::id());
        fs::write(folder.path().join(&left), b"half").unwrap();
        let other = AtomicFile::create(&folder.path().join("other.txt")).unwrap();
        write_atomically(folder.path().join("out.txt"), b"x").unwrap();
        assert_eq!(names(folder.path()).len(), 2, "{:?}", names(folder.path()));
        other.finish().unwrap();
        assert_eq!(names(folder.path()), ["other.txt", "out.txt"]);
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
