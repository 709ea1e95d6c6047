//! From the name of a file to an opened log.

use std::fs;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::arrays::{ArrayFile, ArrayLog};
#[cfg(feature = "bags")]
use super::bag::BagFormat;
use dynid_files::FileMember;

use super::member::{OpenFault, is_manifest, is_pattern};
use super::text::LogText;
#[cfg(feature = "numpy")]
use super::torch::Torch;
use super::{LogOptions, LogSource};
use crate::csv::LogFileError;
use dynid_files::digest::Hashed;
use dynid_files::input::{self, Opened};

/// What the first bytes of a file tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Container {
    Npy,
    Zip,
    Matlab,
    Hdf5,
    Parquet,
    Mcap,
    RosBag,
    Sqlite,
    Arrow,
    Feather,
    Zstd,
}

impl Container {
    fn of(start: &[u8]) -> Option<Self> {
        let begins = |mark: &[u8]| start.starts_with(mark);
        Some(match () {
            () if begins(b"\x93NUMPY") => Container::Npy,
            () if begins(b"PK\x03\x04") || begins(b"PK\x05\x06") => Container::Zip,
            () if begins(b"MATLAB 5.0") => Container::Matlab,
            // A block of MATLAB's own stands before what HDF5 begins with.
            () if begins(b"\x89HDF\r\n\x1a\n") || begins(b"MATLAB 7.3") => Container::Hdf5,
            () if begins(b"PAR1") => Container::Parquet,
            () if begins(b"\x89MCAP0\r\n") => Container::Mcap,
            () if begins(b"#ROSBAG V") => Container::RosBag,
            () if begins(b"SQLite format 3\0") => Container::Sqlite,
            // A stream of messages, the description of the fields first, has no mark of its own.
            () if begins(b"ARROW1") || begins(&[0xff; 4]) => Container::Arrow,
            () if begins(b"FEA1") => Container::Feather,
            () if begins(b"\x28\xb5\x2f\xfd") => Container::Zstd,
            () => return None,
        })
    }

    /// Name of the format, and the feature that reads it.
    fn named(self) -> (&'static str, &'static str) {
        match self {
            Container::Npy => ("NumPy array", "numpy"),
            Container::Zip => ("NumPy arrays", "numpy"),
            Container::Matlab => ("MATLAB file", ""),
            Container::Hdf5 => ("HDF5", "hdf5"),
            Container::Parquet => ("Parquet", "parquet"),
            Container::Mcap => ("MCAP", "bags"),
            Container::RosBag => ("ROS 1 bag", "bags"),
            Container::Sqlite => ("ROS 2 bag in SQLite", "bags"),
            Container::Arrow => ("Arrow", "arrow"),
            Container::Feather => ("Feather of version 1", ""),
            Container::Zstd => ("file compressed with zstd", ""),
        }
    }
}

/// Whether a file is a log rather than a robot: told by its first bytes, else by its name (`.csv`, `.tsv`, `.txt`, `.dat`, `.gz`,
/// `.manifest`), a folder, or a pattern.
pub fn is_log(path: &Path) -> bool {
    // A world and a xacro have members too.
    let FileMember { path, .. } = FileMember::of(path);
    let name = path.to_string_lossy().to_lowercase();
    if path.is_dir()
        || is_manifest(&path)
        || is_pattern(&path)
        || [".csv", ".tsv", ".txt", ".dat", ".gz"].iter().any(|end| name.ends_with(end))
    {
        return true;
    }
    // What is no file gives its bytes once.
    if !path.is_file() {
        return false;
    }
    let mut start = Vec::new();
    let read = fs::File::open(&path).and_then(|file| file.take(16).read_to_end(&mut start));
    read.is_ok() && Container::of(&start).is_some()
}

/// Opens a log of any format that is read, told by its first bytes. `FILE#MEMBER` is a member of a file with several: an episode of
/// a dataset, a group of an HDF5 file, the topics of a bag that begin so.
///
/// # Errors
/// [`LogFileError`]: the file cannot be read, is broken, holds no table, has several members and none is stated, or this build cannot
/// read its format.
pub fn open(path: impl AsRef<Path>, options: &LogOptions) -> Result<Box<dyn LogSource>, LogFileError> {
    let file = FileMember::of(path.as_ref());
    let unreadable = |error| LogFileError::Unreadable { file: file.path.display().to_string(), error };
    if file.path.is_dir() {
        return open_folder(&file, options);
    }
    let mut opened = input::open(&file.path).map_err(unreadable)?;
    let mut start = Vec::with_capacity(16);
    (&mut opened).take(16).read_to_end(&mut start).map_err(unreadable)?;
    let Some(container) = Container::of(&start) else {
        let (format, found) = ("text", file.member.clone().unwrap_or_default());
        return match file.member {
            // A pipe cannot be wound back.
            None => LogText::open(&file.path, start, opened, options)
                .map(|log| Box::new(log) as Box<dyn LogSource>),
            Some(_) => {
                let fault =
                    OpenFault::Member { expected: "a log without members".to_owned(), found, example: None };
                Err(fault.of(&file, format))
            }
        };
    };
    // Files with an index are read at several places; standard input by its own name (`-`) is kept.
    if !file.path.is_file() && file.path != Path::new("-") {
        let (format, _) = container.named();
        let (expected, found) = (
            "a file, which is read at several places".to_owned(),
            "a pipe: write it to a file, or give it as `-`".to_owned(),
        );
        let file = file.path.display().to_string();
        return Err(LogFileError::Content { file, format, expected, found });
    }
    container.open(opened, &file, options)
}

/// Members of a file or a folder that are logs of their own, in the order of the file: episodes of a dataset, groups of an HDF5 file. `None`: a
/// file of another format.
///
/// # Errors
/// The file cannot be read, or is broken.
pub(super) fn members(path: &Path) -> Result<Option<Vec<String>>, LogFileError> {
    let file = FileMember { path: path.to_owned(), member: None };
    #[cfg(feature = "parquet")]
    if is_dataset(path) {
        let found = super::parquet::episodes_of_dataset(path);
        return found.map(Some).map_err(|fault| fault.of(&file, "LeRobot dataset"));
    }
    if !path.is_file() {
        return Ok(None);
    }
    let unreadable = |error| LogFileError::Unreadable { file: path.display().to_string(), error };
    let mut opened = input::open(path).map_err(unreadable)?;
    let mut start = Vec::with_capacity(16);
    (&mut opened).take(16).read_to_end(&mut start).map_err(unreadable)?;
    let found: Result<Vec<String>, OpenFault> = match Container::of(&start) {
        #[cfg(feature = "hdf5")]
        Some(Container::Hdf5) => {
            super::hdf5::Hdf5::open(opened, "").map(|read| read.logs()).map_err(OpenFault::Damaged)
        }
        #[cfg(feature = "parquet")]
        Some(Container::Parquet) => super::parquet::episodes_of_file(opened),
        _ => return Ok(None),
    };
    let (format, _) = Container::of(&start).map_or(("file", ""), Container::named);
    found.map(Some).map_err(|fault| fault.of(&file, format))
}

/// Whether a folder is a log: a dataset, or a bag in one file or several.
pub(super) fn is_log_folder(path: &Path) -> bool {
    is_dataset(path) || BAGS.iter().any(|ending| !bags_in(path, ending).is_empty())
}

fn is_dataset(path: &Path) -> bool {
    path.join("meta/info.json").is_file()
}

/// What names of the files of bags end in.
const BAGS: [&str; 2] = ["mcap", "db3"];

/// Files of a bag in a folder, in the order of their names.
fn bags_in(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut bags: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|e| e == ending)).collect();
    bags.sort();
    bags
}

/// Opens a folder: a dataset of LeRobot, or a bag of ROS 2 in one file or several.
fn open_folder(file: &FileMember, options: &LogOptions) -> Result<Box<dyn LogSource>, LogFileError> {
    #[cfg(feature = "parquet")]
    if is_dataset(&file.path) {
        let found = super::parquet::file_of_episode(&file.path, file.member.as_deref());
        let path = found.map_err(|fault| fault.of(file, "LeRobot dataset"))?;
        let opened = input::open(&path)
            .map_err(|error| LogFileError::Unreadable { file: path.display().to_string(), error })?;
        return Container::Parquet.open(opened, &FileMember { path, member: file.member.clone() }, options);
    }
    #[cfg(feature = "bags")]
    for (ending, format) in BAGS.into_iter().zip([BagFormat::Mcap, BagFormat::Sqlite]) {
        let bags = bags_in(&file.path, ending);
        if !bags.is_empty() {
            return super::bag::open(format, &file.path, &bags, file.member.as_deref(), options);
        }
    }
    let error = io::Error::from(io::ErrorKind::IsADirectory);
    Err(LogFileError::Unreadable { file: file.path.display().to_string(), error })
}

impl Container {
    fn open(
        self,
        mut opened: Opened,
        file: &FileMember,
        options: &LogOptions,
    ) -> Result<Box<dyn LogSource>, LogFileError> {
        let (format, feature) = self.named();
        let name = file.path.display().to_string();
        let (path, member) = (file.path.as_path(), file.member.as_deref());
        let fault = |fault: OpenFault| fault.of(file, format);
        let damaged = |reason: String| OpenFault::Damaged(reason).of(file, format);
        let no_member = || match member {
            None => Ok(()),
            Some(member) => {
                let expected = "a file without members".to_owned();
                Err(OpenFault::Member { expected, found: format!("`{member}`"), example: None }
                    .of(file, format))
            }
        };
        let mut notes = Vec::new();
        let (source, format): (Box<dyn ArrayFile>, &'static str) = match self {
            #[cfg(feature = "numpy")]
            Container::Npy => {
                no_member()?;
                let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
                (
                    Box::new(
                        super::numpy::Npy::open(reopened(path).map_err(damaged)?, &stem).map_err(damaged)?,
                    ),
                    format,
                )
            }
            #[cfg(feature = "numpy")]
            Container::Zip => {
                no_member()?;
                let zip = zip::ZipArchive::new(reopened(path).map_err(damaged)?);
                let zip = zip.map_err(|e| damaged(e.to_string()))?;
                match Torch::pickle_of(&zip) {
                    Some(pickle) => {
                        (Box::new(Torch::open(zip, &pickle).map_err(damaged)?), "PyTorch tensors")
                    }
                    None => (Box::new(super::numpy::Npz::open(zip).map_err(damaged)?), format),
                }
            }
            Container::Matlab => {
                no_member()?;
                let bytes = input::read(path).map_err(|e| damaged(e.to_string()))?;
                let parsed = super::matlab::MatFile::parse(bytes, options.read.max_bytes);
                (Box::new(parsed.map_err(damaged)?), format)
            }
            #[cfg(feature = "hdf5")]
            Container::Hdf5 => {
                let group = member.unwrap_or_default();
                let read =
                    super::hdf5::Hdf5::open(reopened(path).map_err(damaged)?, group).map_err(damaged)?;
                // `FILE#/` is the whole file, whatever its groups are called.
                let alike = if group == "/" { Vec::new() } else { read.logs() };
                if let Some(first) = alike.first() {
                    let expected = format!("one of the groups {}", dynid_files::excerpt::listed(&alike, 6));
                    let found =
                        member.map_or_else(|| "none stated".to_owned(), |member| format!("`{member}`"));
                    return Err(fault(OpenFault::Member { expected, found, example: Some(first.clone()) }));
                }
                (Box::new(read), format)
            }
            #[cfg(feature = "parquet")]
            Container::Parquet => {
                let read = super::parquet::Parquet::open(reopened(path).map_err(damaged)?, path, member)
                    .map_err(fault)?;
                for (setting, value) in read.about() {
                    notes.push(super::ReadingNote::new(setting, value.clone(), "the dataset says so"));
                }
                (Box::new(read), format)
            }
            #[cfg(feature = "arrow")]
            Container::Arrow => {
                no_member()?;
                let read = super::arrow::Arrow::open(reopened(path).map_err(damaged)?).map_err(damaged)?;
                if read.is_cut() {
                    let reason = "it ends within a batch of rows, and those before it are whole";
                    notes.push(super::ReadingNote::new("damaged file", "read up to its end", reason));
                }
                (Box::new(read), format)
            }
            #[cfg(feature = "bags")]
            Container::Mcap | Container::RosBag | Container::Sqlite => {
                let format = match self {
                    Container::RosBag => BagFormat::Ros1,
                    Container::Sqlite => BagFormat::Sqlite,
                    _ => BagFormat::Mcap,
                };
                return super::bag::open(format, path, &[path.to_owned()], member, options);
            }
            _ => {
                return Err(match feature {
                    "" => LogFileError::Content {
                        file: name,
                        format,
                        expected: "a format that is read".to_owned(),
                        found: match self {
                            Container::Zstd => "one to decompress first: `zstd -d FILE`".to_owned(),
                            _ => "one that is not: write it as Arrow, MCAP, Parquet, HDF5 or CSV".to_owned(),
                        },
                    },
                    _ => LogFileError::NotBuilt { file: name, format, feature },
                });
            }
        };
        let digest = rewound(&mut opened).and_then(|()| Hashed::new(opened).finish());
        let sha256 = digest.map_err(|error| LogFileError::Unreadable { file: name.clone(), error })?;
        let bounds = input_bytes(path);
        let log = ArrayLog::new(&name, format, sha256, source, notes, bounds, options)?;
        Ok(Box::new(log))
    }
}

fn rewound(file: &mut Opened) -> io::Result<()> {
    file.seek(SeekFrom::Start(0)).map(|_| ())
}

/// The file once more, with a place of its own.
fn reopened(path: &Path) -> Result<Opened, String> {
    input::open(path).map_err(|e| e.to_string())
}

fn input_bytes(path: &Path) -> u64 {
    fs::metadata(path).map_or(u64::MAX, |m| m.len())
}
