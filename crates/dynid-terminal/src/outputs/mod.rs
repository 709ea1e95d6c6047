//! Output files of commands: whether they may be written is found out before anything is computed, and they appear together.
//!
//! `-` in the place of a file is standard output.

mod origin;

use std::cell::RefCell;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use dynid::io::csv;
use dynid::io::output::{OutputError, OutputSet};

use crate::args::ForceArgs;
use crate::message::{self, Failure, note};
use origin::Origin;
pub use origin::{marked_roff, marked_toml, marked_xml};

/// Files that a command is about to write, by their numbers.
#[derive(Debug)]
pub struct Outputs {
    set: OutputSet,
    /// Number in the set; `None` for standard output.
    places: Vec<Option<usize>>,
    /// What goes to standard output.
    printed: RefCell<Vec<u8>>,
}

/// Whether a path stands for standard output.
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Readies the files that a command is about to write, the most telling first; their folders must exist.
///
/// `outputs`: argument that names the file, and the file. `inputs`: files that must not be overwritten.
///
/// # Errors
/// A missing folder, a folder in the place of a file, one file named twice, an input, what cannot be written, what dynid did not write.
pub fn prepare_files(
    outputs: &[(&str, &Path)],
    inputs: &[&Path],
    force: ForceArgs,
) -> Result<Outputs, Failure> {
    for (_, path) in outputs.iter().filter(|(_, path)| !is_stdout(path)) {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(unwritable(path, ErrorKind::NotFound));
        }
    }
    check(outputs, inputs)?;
    let foreign = |(_, path): &&(&str, &Path)| !is_stdout(path) && Origin::of(path) != Origin::Dynid;
    refuse(outputs.iter().find(foreign).copied(), force)?;
    prepare(outputs)
}

/// Readies files of a folder that is made, with its parents, if it does not exist.
///
/// # Errors
/// As [`prepare_files`]; something that is no folder in the place of the folder or of a parent.
pub fn prepare_folder(files: &[PathBuf], inputs: &[&Path], force: ForceArgs) -> Result<Outputs, Failure> {
    if let Some(file) = files.iter().find(|file| file.parent().is_some_and(is_stdout)) {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        return Err(Failure::Usage(
            format!("--out: expected a folder for {name} and the files beside it, found `-`"),
            "`--json` prints the result to standard output; a folder of this name is `./-`",
        ));
    }
    let outputs: Vec<(&str, &Path)> = files.iter().map(|f| ("--out", f.as_path())).collect();
    check(&outputs, inputs)?;
    let origins: Vec<Origin> = files.iter().map(|file| Origin::of(file)).collect();
    // Files without a place for a mark go with the marked ones beside them.
    let vouched = files.iter().zip(&origins).any(|(file, o)| *o == Origin::Dynid && file.exists());
    let foreign = origins.iter().position(|origin| match origin {
        Origin::Dynid => false,
        Origin::Unmarked => !vouched,
        Origin::Foreign => true,
    });
    refuse(foreign.map(|k| outputs[k]), force)?;
    prepare(&outputs)
}

/// Refuses outputs that are folders, inputs, or each other.
///
/// # Errors
/// The first such output.
pub fn check(outputs: &[(&str, &Path)], inputs: &[&Path]) -> Result<(), Failure> {
    let files: Vec<(&str, &Path)> = outputs.iter().filter(|(_, path)| !is_stdout(path)).copied().collect();
    for (k, (argument, path)) in files.iter().enumerate() {
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
        if let Some((other, _)) = files[..k].iter().find(|(_, p)| self::place(p) == place) {
            return Err(Failure::Usage(
                format!("{argument}: {} is written by {other} already", path.display()),
                "give every output a name of its own",
            ));
        }
    }
    Ok(())
}

/// Refuses to replace a file, unless by force.
fn refuse(foreign: Option<(&str, &Path)>, force: ForceArgs) -> Result<(), Failure> {
    match foreign {
        Some((argument, path)) if !force.force => Err(Failure::Usage(
            format!("{argument}: {} exists and is not known to come from dynid", path.display()),
            "give another name or folder, or replace it with --force",
        )),
        _ => Ok(()),
    }
}

fn prepare(outputs: &[(&str, &Path)]) -> Result<Outputs, Failure> {
    let mut files = Vec::new();
    let place = |(_, path): &(&str, &Path)| {
        (!is_stdout(path)).then(|| {
            files.push(path.to_path_buf());
            files.len() - 1
        })
    };
    let places: Vec<Option<usize>> = outputs.iter().map(place).collect();
    let set = OutputSet::prepare(&files.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
    for other in set.others() {
        note(&format!(
            "another run (process {}, begun {} s ago) is going to write into {} too: the one that ends later stays",
            other.process,
            other.age.as_secs(),
            other.folder.display()
        ));
    }
    Ok(Outputs { set, places, printed: RefCell::default() })
}

impl Outputs {
    /// Whether standard output is taken by a file.
    pub fn take_stdout(&self) -> bool {
        self.places.contains(&None)
    }

    /// Where to write the file of this number; not for one that may be standard output.
    ///
    /// # Panics
    /// If there is none.
    pub fn staged(&self, number: usize) -> &Path {
        let place = self.places[number].unwrap_or_else(|| unreachable!("a file of a folder"));
        self.set.staged(place)
    }

    /// Writes the file of this number.
    ///
    /// # Errors
    /// The place where the file is to appear cannot be written.
    ///
    /// # Panics
    /// If there is none.
    pub fn write(&self, number: usize, bytes: &[u8]) -> Result<(), Failure> {
        match self.places[number] {
            Some(place) => self.set.write(place, bytes)?,
            None => self.printed.borrow_mut().extend_from_slice(bytes),
        }
        Ok(())
    }

    /// Writes columns under a header as the file of this number.
    ///
    /// # Errors
    /// As [`Outputs::write`]; values that are not finite.
    ///
    /// # Panics
    /// If there is none.
    pub fn write_table<H: AsRef<str>, C: AsRef<[f64]>>(
        &self,
        number: usize,
        header: &[H],
        columns: &[C],
    ) -> Result<(), Failure> {
        match self.places[number] {
            Some(place) => csv::write(self.set.staged(place), header, columns)?,
            None => self.write(number, csv::text("standard output", header, columns)?.as_bytes())?,
        }
        Ok(())
    }

    /// Makes all files that were written appear, and prints what goes to standard output. Gives the files that appeared.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn publish(self) -> Result<Vec<PathBuf>, Failure> {
        let written = self.set.publish()?;
        let printed = self.printed.into_inner();
        if !printed.is_empty() {
            message::bytes(&printed)?;
        }
        Ok(written)
    }
}

fn unwritable(path: &Path, kind: ErrorKind) -> Failure {
    let file = path.display().to_string();
    Failure::from(OutputError::Unwritable { file, error: Error::from(kind) })
}

/// Where a path leads, links followed.
fn place(path: &Path) -> PathBuf {
    path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned())
}
