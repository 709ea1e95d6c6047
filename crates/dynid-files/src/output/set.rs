//! Files that appear together.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{OutputError, folder_of, fresh, owner, remove_abandoned, temporary};

/// Longest time that publishing waits for another run to publish, s. It takes milliseconds.
const PATIENCE_S: u64 = 30;

/// Another run that is going to write into the same folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OtherRun {
    /// Folder.
    pub folder: PathBuf,
    /// Process of the other run.
    pub process: u32,
    /// Time since it began.
    pub age: Duration,
}

/// Output files of one run that appear together.
///
/// [`OutputSet::prepare`] finds out whether every file can be written, before anything is computed. Files are then written under the names of
/// [`OutputSet::staged`], in folders of their own beside their places, and [`OutputSet::publish`] moves them there. Of files that are not
/// written, the old ones go: they belong to another run.
///
/// What was there before stays until all new files are complete and on the disk. It is then removed, but for the first file, which the new one
/// replaces; the others follow. So a fault at any moment leaves files of one run, never a mixture: at worst, within the milliseconds of publishing,
/// not all of them. Two runs publish one after the other: the later one stays whole. What a run that was killed leaves behind is hidden, blocks
/// nothing, and is removed by the next one.
#[derive(Debug)]
pub struct OutputSet {
    outputs: Vec<Output>,
    stages: Vec<Stage>,
    /// Folders that did not exist before, outermost first.
    made: Vec<PathBuf>,
    others: Vec<OtherRun>,
    published: bool,
}

#[derive(Debug)]
struct Output {
    /// Path as it was given.
    path: PathBuf,
    /// Links followed.
    target: PathBuf,
    staged: PathBuf,
}

/// Folder of files that are not published yet.
#[derive(Debug)]
struct Stage {
    folder: PathBuf,
    path: PathBuf,
    /// Locked while the run lives.
    _owner: File,
}

fn unwritable(path: &Path, error: io::Error) -> OutputError {
    OutputError::Unwritable { file: path.display().to_string(), error }
}

impl OutputSet {
    /// Files that a run is going to write, the most telling first; folders that do not exist are made.
    ///
    /// A symbolic link is followed; what exists and is no regular file (a pipe, `/dev/stdout`) is written directly.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`] with the file that cannot be written: no folder, no right, no space, a name that the file system refuses.
    pub fn prepare(paths: &[&Path]) -> Result<OutputSet, OutputError> {
        let mut set = OutputSet {
            outputs: Vec::new(),
            stages: Vec::new(),
            made: Vec::new(),
            others: Vec::new(),
            published: false,
        };
        for path in paths {
            set.add(path).map_err(|error| unwritable(path, error))?;
        }
        Ok(set)
    }

    fn add(&mut self, path: &Path) -> io::Result<()> {
        let target = match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if !metadata.is_file() => {
                let [path, target, staged] = [(); 3].map(|()| path.to_owned());
                self.outputs.push(Output { path, target, staged });
                return Ok(());
            }
            Ok(_) => fs::canonicalize(path)?,
            Err(_) => path.to_owned(),
        };
        let name = target.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
        let stage = self.stage(&folder_of(&target))?;
        let staged = self.stages[stage].path.join(name);
        // What cannot be made now could not be made later.
        fs::write(&staged, b"?")?;
        fs::remove_file(&staged)?;
        self.outputs.push(Output { path: path.to_owned(), target, staged });
        Ok(())
    }

    /// The stage of a folder.
    fn stage(&mut self, folder: &Path) -> io::Result<usize> {
        if folder.ancestors().any(|f| f.exists() && !f.is_dir()) {
            return Err(io::ErrorKind::NotADirectory.into());
        }
        let missing: Vec<PathBuf> = folder
            .ancestors()
            .take_while(|f| !f.as_os_str().is_empty() && !f.exists())
            .map(Path::to_owned)
            .collect();
        fs::create_dir_all(folder)?;
        self.made.extend(missing.into_iter().rev());
        // One folder may have several names.
        let folder = &fs::canonicalize(folder)?;
        if let Some(known) = self.stages.iter().position(|s| s.folder == *folder) {
            return Ok(known);
        }
        remove_abandoned(folder, true);
        remove_abandoned(folder, false);
        let stages = temporary(folder).into_iter().filter(|path| path.is_dir());
        self.others.extend(stages.filter_map(|stage| {
            let (process, age) = owner(&stage)?;
            Some(OtherRun { folder: folder.to_owned(), process, age })
        }));
        let ((), path) = fresh(folder, |path| fs::create_dir(path))?;
        let held = File::open(&path)?;
        // Where folders cannot be locked they are not removed either.
        let _ = held.try_lock();
        self.stages.push(Stage { folder: folder.to_owned(), path, _owner: held });
        Ok(self.stages.len() - 1)
    }

    /// Other runs that were going to write into the same folders when this one began.
    pub fn others(&self) -> &[OtherRun] {
        &self.others
    }

    /// Where to write the file of this number.
    ///
    /// # Panics
    /// If there is none.
    pub fn staged(&self, number: usize) -> &Path {
        &self.outputs[number].staged
    }

    /// Writes the file of this number.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`], with the place where the file is to appear.
    ///
    /// # Panics
    /// If there is none.
    pub fn write(&self, number: usize, bytes: &[u8]) -> Result<(), OutputError> {
        let Output { target, staged, .. } = &self.outputs[number];
        let written = match staged == target {
            true => {
                File::options().write(true).open(staged).and_then(|mut f| io::Write::write_all(&mut f, bytes))
            }
            false => fs::write(staged, bytes),
        };
        written.map_err(|error| unwritable(target, error))
    }

    /// Makes all files that were written appear, and removes old ones that were not written again. Gives the files that appeared.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`]; [`OutputError::Busy`] if another run publishes into one of the folders for more than 30 s. Before the first
    /// file has appeared everything is as it was.
    pub fn publish(mut self) -> Result<Vec<PathBuf>, OutputError> {
        let (direct, staged): (Vec<&Output>, Vec<&Output>) =
            self.outputs.iter().partition(|o| o.staged == o.target);
        let (new, gone): (Vec<&Output>, Vec<&Output>) = staged.into_iter().partition(|o| o.staged.exists());
        for output in &new {
            File::open(&output.staged)
                .and_then(|f| f.sync_all())
                .map_err(|e| unwritable(&output.target, e))?;
        }
        let mut folders: Vec<&Path> = self.stages.iter().map(|s| s.folder.as_path()).collect();
        // In one order, so that two runs never wait for each other.
        folders.sort_unstable();
        let locks = folders.iter().map(|f| lock(f)).collect::<Result<Vec<File>, OutputError>>()?;
        let old = new.iter().skip(1).chain(&gone);
        for output in old {
            match fs::remove_file(&output.target) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(unwritable(&output.target, error));
                }
                _ => {}
            }
        }
        for output in &new {
            fs::rename(&output.staged, &output.target).map_err(|e| unwritable(&output.target, e))?;
        }
        for folder in &folders {
            // Not every file system lets a folder be synchronised; the files are.
            let _ = File::open(folder).and_then(|f| f.sync_all());
        }
        drop(locks);
        let written = direct.into_iter().chain(new).map(|o| o.path.clone()).collect();
        self.published = true;
        Ok(written)
    }
}

impl Drop for OutputSet {
    fn drop(&mut self) {
        for stage in &self.stages {
            // Nobody is left to tell if even the removal fails.
            let _ = fs::remove_dir_all(&stage.path);
        }
        if !self.published {
            for folder in self.made.iter().rev() {
                // Only empty folders go.
                let _ = fs::remove_dir(folder);
            }
        }
    }
}

/// Locks a folder for publishing; the lock goes with the handle, however the run ends.
fn lock(folder: &Path) -> Result<File, OutputError> {
    let fault = |error| unwritable(folder, error);
    // Windows opens no folders as files.
    let file = match cfg!(unix) {
        true => File::open(folder),
        false => File::options().create(true).append(true).open(folder.join(".dynid.lock")),
    };
    let file = file.map_err(fault)?;
    let begun = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(fs::TryLockError::WouldBlock) if begun.elapsed().as_secs() >= PATIENCE_S => {
                return Err(OutputError::Busy { folder: folder.display().to_string(), seconds: PATIENCE_S });
            }
            Err(fs::TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(2)),
            // File systems without locks have one writer.
            Err(fs::TryLockError::Error(_)) => return Ok(file),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn prepare(folder: &Path) -> OutputSet {
        let paths = ["a.json", "b.html", "c.urdf"].map(|name| folder.join(name));
        OutputSet::prepare(&paths.each_ref().map(PathBuf::as_path)).unwrap()
    }

    #[test]
    fn files_appear_together_and_old_ones_that_are_not_written_go() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("deep/er");
        for (text, count) in [("one", 3), ("two", 2)] {
            let set = prepare(&out);
            (0..count).for_each(|k| set.write(k, text.as_bytes()).unwrap());
            assert_eq!(set.publish().unwrap().len(), count);
            assert_eq!(names(&out).len(), count);
            assert!(names(&out).iter().all(|n| fs::read_to_string(out.join(n)).unwrap() == text));
        }
    }

    #[test]
    fn files_that_exist_and_files_that_do_not_are_one_set() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("b.html"), b"old").unwrap();
        let link = folder.path().with_extension("link");
        #[cfg(unix)]
        std::os::unix::fs::symlink(folder.path(), &link).unwrap();
        let set = prepare(if cfg!(unix) { &link } else { folder.path() });
        assert_eq!((set.stages.len(), set.others()), (1, &[][..]));
        (0..3).for_each(|k| set.write(k, b"new").unwrap());
        set.publish().unwrap();
        assert_eq!(fs::read(folder.path().join("b.html")).unwrap(), b"new");
        let _ = fs::remove_file(link);
    }

    #[test]
    fn a_set_that_is_dropped_leaves_everything_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("new");
        let set = prepare(&out);
        set.write(0, b"half").unwrap();
        drop(set);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_name_that_cannot_be_written_is_told_before() {
        let folder = tempfile::tempdir().unwrap();
        let long = folder.path().join("x".repeat(300));
        let error = OutputSet::prepare(&[&folder.path().join("a"), &long]).unwrap_err();
        assert!(error.to_string().starts_with(&long.display().to_string()), "{error}");
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn two_runs_into_one_folder_leave_the_files_of_one() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().to_owned();
        let runs: Vec<_> = (0..8)
            .map(|run| {
                let out = out.clone();
                std::thread::spawn(move || {
                    let set = prepare(&out);
                    (0..3).for_each(|k| set.write(k, format!("{run}").as_bytes()).unwrap());
                    set.publish().unwrap();
                })
            })
            .collect();
        runs.into_iter().for_each(|run| run.join().unwrap());
        let mut texts: Vec<_> =
            names(&out).iter().map(|n| fs::read_to_string(out.join(n)).unwrap()).collect();
        assert_eq!(texts.len(), 3);
        texts.dedup();
        assert_eq!(texts.len(), 1, "{texts:?}");
    }

    #[test]
    fn another_run_is_seen_and_what_a_killed_one_left_goes() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join(".dynid-1-2-3-4.tmp")).unwrap();
        let first = prepare(folder.path());
        assert_eq!(first.others(), []);
        let second = prepare(folder.path());
        assert_eq!(second.others().len(), 1);
        assert_eq!(second.others()[0].process, std::process::id());
        drop((first, second));
        assert!(names(folder.path()).is_empty());
    }
}
