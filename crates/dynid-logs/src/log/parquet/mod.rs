//! Parquet files: tables of numbers and of lists of one length, datasets of LeRobot among them.
//!
//! A column of lists is an array of two axes. Of a file with several episodes (`episode_index`) one is read, which the name of the
//! file states: `file.parquet#12`.

mod pages;

use std::fs;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use bytes::Bytes;
use dynid_files::excerpt::listed;
use dynid_files::input::Opened;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::{DataType, Int96};
use parquet::errors::ParquetError;
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};

use self::pages::Pages;
use super::arrays::{Array, ArrayFile, Holds, Values};
use super::member::OpenFault;

/// Records that are read at a time.
const BATCH: usize = 1 << 16;
/// Rows that are looked at for the length of lists.
const LOOKED_AT: usize = 100;
/// Largest description of a dataset, bytes.
const MAX_DESCRIPTION: u64 = 16 << 20;
/// Folders above a file in which the description of its dataset is looked for.
const MAX_ABOVE: usize = 4;
/// Column that numbers the episodes of a dataset.
const EPISODE: &str = "episode_index";

/// A file whose reads share one place.
#[derive(Clone)]
struct Shared {
    file: Arc<Mutex<Opened>>,
    length: u64,
}

impl Length for Shared {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for Shared {
    type T = std::io::Cursor<Bytes>;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        // Headers of pages are read so: they are short, and their pages follow.
        let length = (self.length.saturating_sub(start)).min(1 << 16) as usize;
        self.get_bytes(start, length).map(std::io::Cursor::new)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        let failed = |reason: String| ParquetError::General(reason);
        if start.saturating_add(length as u64) > self.length {
            return Err(failed(format!(
                "expected {length} bytes at byte {start}, found the end of the file"
            )));
        }
        let mut file = self.file.lock().map_err(|e| failed(e.to_string()))?;
        file.seek(SeekFrom::Start(start)).map_err(|e| failed(e.to_string()))?;
        let mut bytes = vec![0; length];
        file.read_exact(&mut bytes).map_err(|e| failed(e.to_string()))?;
        Ok(bytes.into())
    }
}

/// Numbers of episodes, each with its rows.
type Episodes = Vec<(i64, Range<usize>)>;

/// A file of columns, or an episode of it.
pub(super) struct Parquet {
    file: Shared,
    reader: SerializedFileReader<Shared>,
    /// Column of the file per array.
    leaves: Vec<usize>,
    arrays: Vec<Array>,
    /// Rows that are read.
    rows: Range<usize>,
    /// What the dataset says of itself.
    about: Vec<(&'static str, String)>,
}

impl Parquet {
    /// `member`: the episode, where there are several.
    pub(super) fn open(file: Opened, path: &Path, member: Option<&str>) -> Result<Self, OpenFault> {
        let mut parquet = Parquet::of_all_rows(file)?;
        parquet.choose_episode(member)?;
        if let Some(description) = description_of(path) {
            parquet.describe(&description);
        }
        Ok(parquet)
    }

    fn of_all_rows(file: Opened) -> Result<Self, OpenFault> {
        let length = file.length().map_err(|e| OpenFault::Damaged(e.to_string()))?;
        let shared = Shared { file: Arc::new(Mutex::new(file)), length };
        let reader =
            SerializedFileReader::new(shared.clone()).map_err(|e| OpenFault::Damaged(e.to_string()))?;
        let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(0);
        let mut parquet = Parquet {
            file: shared,
            reader,
            leaves: Vec::new(),
            arrays: Vec::new(),
            rows: 0..rows,
            about: Vec::new(),
        };
        parquet.list().map_err(OpenFault::Damaged)?;
        Ok(parquet)
    }

    /// What the dataset says of itself, such as its robot.
    pub(super) fn about(&self) -> &[(&'static str, String)] {
        &self.about
    }

    /// Finds the columns of numbers and of lists of numbers.
    fn list(&mut self) -> Result<(), String> {
        let schema = self.reader.metadata().file_metadata().schema_descr_ptr();
        for leaf in 0..schema.num_columns() {
            let column = schema.column(leaf);
            let inner = ["list", "element", "item", "array", "bag", "array_element"];
            let parts = column.path().parts();
            let is_list = column.max_rep_level() > 0;
            let shown =
                parts.iter().enumerate().filter(|(k, p)| !is_list || *k == 0 || !inner.contains(&p.as_str()));
            let name = shown.map(|(_, p)| p.as_str()).collect::<Vec<_>>().join("/");
            use parquet::basic::Type;
            let holds = match column.physical_type() {
                Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY => Holds::Texts,
                _ => Holds::Numbers,
            };
            let shape = match (column.max_rep_level(), holds) {
                (0, _) => vec![self.rows.len()],
                (1, Holds::Numbers) if !self.rows.is_empty() => {
                    vec![self.rows.len(), self.first_length(leaf)?]
                }
                // Lists of lists, such as images.
                _ => vec![self.rows.len(), 0, 0],
            };
            self.leaves.push(leaf);
            self.arrays.push(Array { name, shape, holds, entries: Vec::new() });
        }
        Ok(())
    }

    /// Length of the first list of a column that is there.
    fn first_length(&self, leaf: usize) -> Result<usize, String> {
        let mut lists = Lists { width: None, values: Collected::default(), rows: 0 };
        self.walk(leaf, 0..self.rows.len().min(LOOKED_AT), &mut lists)?;
        Ok(lists.width.unwrap_or(0))
    }

    /// Episodes with their rows; `None`: the file has no column that numbers them.
    fn episodes(&mut self) -> Result<Option<Episodes>, OpenFault> {
        let Some(column) = self.arrays.iter().position(|a| a.name == EPISODE && a.shape.len() == 1) else {
            return Ok(None);
        };
        let index = match self.load(column).map_err(OpenFault::Damaged)? {
            Values::Whole(index) => index,
            Values::Float(index) => index.iter().map(|x| *x as i64).collect(),
        };
        let mut episodes = Episodes::new();
        for (k, episode) in index.iter().enumerate() {
            match episodes.last_mut() {
                Some((last, rows)) if last == episode => rows.end = k + 1,
                _ => episodes.push((*episode, k..k + 1)),
            }
        }
        Ok(Some(episodes))
    }

    fn choose_episode(&mut self, member: Option<&str>) -> Result<(), OpenFault> {
        let Some(episodes) = self.episodes()? else {
            return match member {
                None => Ok(()),
                Some(member) => Err(OpenFault::Member {
                    expected: format!("a file without members: it has no column `{EPISODE}`"),
                    found: member.to_owned(),
                    example: None,
                }),
            };
        };
        let chosen = match member {
            None if episodes.len() <= 1 => return Ok(()),
            None => None,
            Some(member) => episodes.iter().find(|(episode, _)| episode.to_string() == member),
        };
        let Some((_, rows)) = chosen else {
            let names: Vec<String> = episodes.iter().map(|(e, _)| e.to_string()).collect();
            return Err(OpenFault::Member {
                expected: format!("one of the episodes {}", listed(&names, 8)),
                found: member.map_or_else(|| "none stated".to_owned(), |member| format!("`{member}`")),
                example: names.first().cloned(),
            });
        };
        self.rows = rows.clone();
        let length = rows.len();
        self.arrays.iter_mut().for_each(|a| a.shape[0] = length);
        self.about.push(("episode", member.unwrap_or_default().to_owned()));
        Ok(())
    }

    /// Takes names of entries from the description of a dataset.
    fn describe(&mut self, description: &serde_json::Value) {
        for (key, shown) in [("robot_type", "robot"), ("codebase_version", "LeRobot dataset")] {
            if let Some(text) = description.get(key).and_then(|v| v.as_str()) {
                self.about.push((shown, text.to_owned()));
            }
        }
        for array in &mut self.arrays {
            let names =
                description.get("features").and_then(|f| f.get(&array.name)).and_then(|f| f.get("names"));
            // A list, or a list under some heading such as `motors`.
            let list = match names {
                Some(serde_json::Value::Object(headed)) => headed.values().next(),
                other => other,
            };
            let names = list.and_then(|l| l.as_array()).into_iter().flatten();
            array.entries = names.filter_map(|n| n.as_str().map(str::to_owned)).collect();
        }
    }

    /// Reads rows of a column.
    fn walk(&self, leaf: usize, rows: Range<usize>, lists: &mut Lists) -> Result<(), String> {
        let mut start = 0;
        for group in 0..self.reader.num_row_groups() {
            let metadata = self.reader.metadata().row_group(group);
            let count = usize::try_from(metadata.num_rows()).unwrap_or(0);
            let wanted = rows.start.clamp(start, start + count)..rows.end.clamp(start, start + count);
            let (skip, take) = (wanted.start - start, wanted.len());
            start += count;
            if take == 0 {
                continue;
            }
            let chunk = metadata
                .columns()
                .get(leaf)
                .ok_or("expected as many columns in every group of rows, found fewer")?;
            let described = chunk.column_descr_ptr();
            let (at, length) = chunk_range(chunk)?;
            let bytes = self.file.get_bytes(at, length).map_err(|e| e.to_string())?;
            let column = get_column_reader(
                described.clone(),
                Box::new(Pages::new(bytes, chunk.compression(), &described)),
            );
            let levels = (described.max_def_level(), described.max_rep_level());
            match column {
                ColumnReader::BoolColumnReader(c) => {
                    lists.read(c, levels, skip, take, |x| Number::Whole(i64::from(*x)))
                }
                ColumnReader::Int32ColumnReader(c) => {
                    lists.read(c, levels, skip, take, |x| Number::Whole(i64::from(*x)))
                }
                ColumnReader::Int64ColumnReader(c) => {
                    lists.read(c, levels, skip, take, |x| Number::Whole(*x))
                }
                ColumnReader::Int96ColumnReader(c) => {
                    lists.read(c, levels, skip, take, |x: &Int96| Number::Whole(x.to_nanos()))
                }
                ColumnReader::FloatColumnReader(c) => {
                    lists.read(c, levels, skip, take, |x| Number::Float(f64::from(*x)))
                }
                ColumnReader::DoubleColumnReader(c) => {
                    lists.read(c, levels, skip, take, |x| Number::Float(*x))
                }
                ColumnReader::ByteArrayColumnReader(_) | ColumnReader::FixedLenByteArrayColumnReader(_) => {
                    Err("expected numbers, found texts".to_owned())
                }
            }?;
        }
        Ok(())
    }
}

impl ArrayFile for Parquet {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, array: usize) -> Result<Values, String> {
        self.load_rows(array, 0..self.rows.len())
    }

    fn groups(&self) -> Option<Vec<usize>> {
        let mut start = 0;
        let own = self.reader.metadata().row_groups().iter().map(|group| {
            let end = start + usize::try_from(group.num_rows()).unwrap_or(0);
            let own = self.rows.start.clamp(start, end)..self.rows.end.clamp(start, end);
            start = end;
            own.len()
        });
        Some(own.collect())
    }

    fn load_rows(&mut self, array: usize, rows: Range<usize>) -> Result<Values, String> {
        let width = self.arrays[array].shape.get(1).copied();
        let mut lists = Lists { width: Some(width.unwrap_or(1)), values: Collected::default(), rows: 0 };
        let name = &self.arrays[array].name;
        let inside = self.rows.start + rows.start..self.rows.start + rows.end;
        self.walk(self.leaves[array], inside, &mut lists).map_err(|e| format!("column `{name}`: {e}"))?;
        if lists.rows != rows.len() {
            return Err(format!("column `{name}`: expected {} rows, found {}", rows.len(), lists.rows));
        }
        Ok(lists.values.finish())
    }
}

/// Where the pages of a column lie: first byte and number of bytes.
fn chunk_range(chunk: &ColumnChunkMetaData) -> Result<(u64, usize), String> {
    let first =
        chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset()).min(chunk.data_page_offset());
    match (u64::try_from(first), usize::try_from(chunk.compressed_size())) {
        (Ok(first), Ok(length)) => Ok((first, length)),
        _ => Err("expected a column within the file, found another place".to_owned()),
    }
}

enum Number {
    Whole(i64),
    Float(f64),
    Missing,
}

/// Whole numbers until one is none.
#[derive(Default)]
struct Collected {
    whole: Vec<i64>,
    float: Option<Vec<f64>>,
}

impl Collected {
    fn push(&mut self, number: &Number) {
        match (number, &mut self.float) {
            (Number::Whole(x), None) => self.whole.push(*x),
            (Number::Whole(x), Some(all)) => all.push(*x as f64),
            (other, _) => {
                let whole = std::mem::take(&mut self.whole);
                let all = self.float.get_or_insert_with(|| whole.into_iter().map(|x| x as f64).collect());
                all.push(if let Number::Float(x) = other { *x } else { f64::NAN });
            }
        }
    }

    fn finish(self) -> Values {
        match self.float {
            Some(float) => Values::Float(float),
            None => Values::Whole(self.whole),
        }
    }
}

/// Numbers of a column, whose rows are numbers or lists of one length.
struct Lists {
    /// Length of the lists, if it is known; else it becomes that of the first one.
    width: Option<usize>,
    values: Collected,
    rows: usize,
}

impl Lists {
    /// Takes records of a column; `levels`: its largest definition and repetition level.
    fn read<T: DataType>(
        &mut self,
        mut column: ColumnReaderImpl<T>,
        levels: (i16, i16),
        skip: usize,
        take: usize,
        number: impl Fn(&T::T) -> Number,
    ) -> Result<(), String> {
        let (defined, repeated) = levels;
        let text = |e: ParquetError| e.to_string();
        if column.skip_records(skip).map_err(text)? != skip {
            return Err("expected more rows, found the end of the column".to_owned());
        }
        let (mut definitions, mut repetitions, mut values) = (Vec::new(), Vec::new(), Vec::new());
        let mut left = take;
        while left > 0 {
            definitions.clear();
            repetitions.clear();
            values.clear();
            let (def, rep) = (Some(&mut definitions), Some(&mut repetitions));
            let (records, _, count) =
                column.read_records(left.min(BATCH), def, rep, &mut values).map_err(text)?;
            if records == 0 {
                return Err("expected more rows, found the end of the column".to_owned());
            }
            left -= records;
            let mut present = values.iter();
            let mut length = 0;
            for k in 0..count {
                let begins = repeated == 0 || repetitions.get(k).is_none_or(|r| *r == 0);
                if begins && k > 0 {
                    self.end_row(length)?;
                    length = 0;
                }
                let level = definitions.get(k).copied().unwrap_or(defined);
                match if level == defined { present.next() } else { None } {
                    Some(x) => self.values.push(&number(x)),
                    // A list without entries; one of another length than the others is told below.
                    None if repeated > 0 && level + 1 < defined => continue,
                    None => self.values.push(&Number::Missing),
                }
                length += 1;
            }
            self.end_row(length)?;
        }
        Ok(())
    }

    fn end_row(&mut self, length: usize) -> Result<(), String> {
        self.rows += 1;
        match self.width {
            // A list that is not there has no value of any of its entries.
            Some(width) if length == 0 => (0..width).for_each(|_| self.values.push(&Number::Missing)),
            None if length == 0 => {}
            Some(expected) if length != expected => {
                return Err(format!(
                    "row {}: expected a list of {expected} numbers as in the first row, found {length}",
                    self.rows
                ));
            }
            _ => self.width = Some(length),
        }
        Ok(())
    }
}

/// The description of the dataset that a file belongs to: `meta/info.json` in a folder above it.
fn description_of(path: &Path) -> Option<serde_json::Value> {
    let above = path.ancestors().skip(1).take(MAX_ABOVE);
    let file = above.map(|folder| folder.join("meta/info.json")).find(|file| file.is_file())?;
    let mut text = String::new();
    fs::File::open(file).ok()?.take(MAX_DESCRIPTION).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

/// Numbers of the episodes of a file, in its order; none, if nothing numbers them.
///
/// # Errors
/// [`OpenFault`]: the file is broken.
pub(super) fn episodes_of_file(file: Opened) -> Result<Vec<String>, OpenFault> {
    let episodes = Parquet::of_all_rows(file)?.episodes()?.unwrap_or_default();
    Ok(episodes.iter().map(|(episode, _)| episode.to_string()).collect())
}

/// Numbers of the episodes of a LeRobot dataset, in their order.
///
/// # Errors
/// [`OpenFault`]: one of its files is broken.
pub(super) fn episodes_of_dataset(dataset: &Path) -> Result<Vec<String>, OpenFault> {
    let mut files = Vec::new();
    collect(&dataset.join("data"), 0, &mut files);
    let mut episodes: Vec<u64> = Vec::new();
    for file in &files {
        let name = file.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        match name.strip_prefix("episode_").map(str::parse::<u64>) {
            Some(Ok(episode)) => episodes.push(episode),
            _ => {
                let opened = dynid_files::input::open(file).map_err(|e| OpenFault::Damaged(e.to_string()))?;
                episodes.extend(episodes_of_file(opened)?.iter().filter_map(|e| e.parse::<u64>().ok()));
            }
        }
    }
    episodes.sort_unstable();
    episodes.dedup();
    Ok(episodes.iter().map(u64::to_string).collect())
}

/// The file of a LeRobot dataset that holds an episode.
///
/// # Errors
/// [`OpenFault`]: no episode is stated, or none of the files has it.
pub(super) fn file_of_episode(dataset: &Path, member: Option<&str>) -> Result<PathBuf, OpenFault> {
    let mut files = Vec::new();
    collect(&dataset.join("data"), 0, &mut files);
    files.sort();
    let unknown = |found: String| OpenFault::Member {
        expected: format!("an episode of the dataset, which has {} Parquet files", files.len()),
        found,
        example: Some("0".to_owned()),
    };
    let Some(member) = member else { return Err(unknown("none stated".to_owned())) };
    let named = member.parse::<u64>().map(|n| format!("episode_{n:06}.parquet"));
    if let Ok(name) = &named
        && let Some(file) = files.iter().find(|f| f.file_name().is_some_and(|n| n == name.as_str()))
    {
        return Ok(file.clone());
    }
    for file in &files {
        let opened = dynid_files::input::open(file).map_err(|e| OpenFault::Damaged(e.to_string()))?;
        match Parquet::open(opened, file, Some(member)) {
            Ok(_) => return Ok(file.clone()),
            Err(OpenFault::Member { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    Err(unknown(format!("`{member}`")))
}

fn collect(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() && depth < MAX_ABOVE {
            collect(&path, depth + 1, files);
        } else if path.extension().is_some_and(|e| e == "parquet") {
            files.push(path);
        }
    }
}
