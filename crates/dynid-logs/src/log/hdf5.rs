//! HDF5 files, `.mat` files of MATLAB 7.3 among them: every dataset of numbers is an array, named by its path.

use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom};

use dynid_files::input::Opened;
use hdf5_pure::{Chunk, DType, Dataset, File, Group};

use super::arrays::{Array, ArrayFile, Holds, Values};

/// What groups are called that are logs of their own, before their numbers.
const NAMES_OF_LOGS: [&str; 10] =
    ["demo", "ep", "episode", "log", "rollout", "run", "sequence", "traj", "trajectory", "trial"];
/// Deepest nesting of groups.
const MAX_DEPTH: usize = 16;
/// Largest chunk, bytes.
const MAX_CHUNK: u64 = 512 << 20;
/// Most datasets of a file.
const MAX_DATASETS: usize = 50_000;

/// A file of datasets, or one of its groups.
pub(super) struct Hdf5 {
    file: File,
    /// Bytes of the file.
    length: u64,
    /// Path per array.
    paths: Vec<String>,
    arrays: Vec<Array>,
}

impl Hdf5 {
    /// Lists the datasets below a group, `""` for the whole file.
    pub(super) fn open(mut file: Opened, group: &str) -> Result<Self, String> {
        file.seek(SeekFrom::Start(0)).map_err(|e| e.to_string())?;
        let length = file.length().map_err(|e| e.to_string())?;
        let source = hdf5_pure::ReadSeekSource::new(file).map_err(|e| e.to_string())?;
        let file = File::from_source(source).map_err(|e| e.to_string())?;
        let mut found = Found { paths: Vec::new(), arrays: Vec::new() };
        let group = group.trim_matches('/');
        let root =
            if group.is_empty() { file.root() } else { file.group(group).map_err(|e| e.to_string())? };
        found.list(&root, group, "", 0)?;
        let Found { paths, arrays } = found;
        Ok(Hdf5 { file, length, paths, arrays })
    }

    /// Chunks lie within the file, and are of a size that can be read: the library reserves what they promise.
    fn check_chunks(&self, dataset: &Dataset) -> Result<(), String> {
        if !dataset.is_chunked() {
            return Ok(());
        }
        let text = |e: hdf5_pure::Error| e.to_string();
        let size = dataset.chunk_shape().map_err(text)?.unwrap_or_default();
        let size = size.iter().fold(dataset.element_size().map_err(text)?, |n, m| n.saturating_mul(*m));
        if size > MAX_CHUNK {
            return Err(format!("expected chunks of at most {MAX_CHUNK} bytes, found {size}"));
        }
        let chunks = dataset.chunks().map_err(text)?;
        let is_outside = |c: &&Chunk| c.address.saturating_add(c.storage_size) > self.length;
        match chunks.iter().find(is_outside) {
            None => Ok(()),
            Some(chunk) => Err(format!(
                "expected chunks within the file, found one of {} bytes at byte {}",
                chunk.storage_size, chunk.address
            )),
        }
    }

    /// Groups that are logs of their own, such as the demonstrations of a dataset: they hold the same datasets, their names differ in a number alone, and
    /// they are called so or are of different lengths. Groups of joints are none.
    pub(super) fn logs(&self) -> Vec<String> {
        let mut groups: BTreeMap<&str, Vec<(&str, usize)>> = BTreeMap::new();
        for (path, array) in self.paths.iter().zip(&self.arrays) {
            let ends = path.match_indices('/').map(|(end, _)| &path[..end]);
            if let Some(group) = ends.into_iter().find(|group| stem(group) != *group) {
                let length = array.shape.first().copied().unwrap_or(0);
                groups.entry(group).or_default().push((&path[group.len()..], length));
            }
        }
        let Some((first, datasets)) = groups.first_key_value().filter(|_| groups.len() > 1) else {
            return Vec::new();
        };
        let names =
            |list: &[(&str, usize)]| list.iter().map(|(name, _)| (*name).to_owned()).collect::<Vec<_>>();
        let are_alike =
            groups.iter().all(|(group, d)| stem(group) == stem(first) && names(d) == names(datasets));
        let called = stem(first).rsplit('/').next().unwrap_or_default().trim_end_matches(['_', '-', ' ']);
        let are_logs =
            NAMES_OF_LOGS.contains(&called.to_lowercase().as_str()) || groups.values().any(|d| d != datasets);
        match are_alike && are_logs {
            true => groups.into_keys().map(str::to_owned).collect(),
            false => Vec::new(),
        }
    }
}

/// A name without the number at its end.
fn stem(name: &str) -> &str {
    name.trim_end_matches(|c: char| c.is_ascii_digit())
}

struct Found {
    paths: Vec<String>,
    arrays: Vec<Array>,
}

impl Found {
    /// `name`: the path below the group that was asked for.
    fn list(&mut self, group: &Group, path: &str, name: &str, depth: usize) -> Result<(), String> {
        let below = |of: &str, child: &str| {
            if of.is_empty() { child.to_owned() } else { format!("{of}/{child}") }
        };
        for child in group.datasets().map_err(|e| e.to_string())? {
            if self.arrays.len() >= MAX_DATASETS {
                return Err(format!("expected at most {MAX_DATASETS} datasets, found more"));
            }
            // References of MATLAB cells, and what it keeps for itself.
            let Ok(dataset) = group.dataset(&child) else { continue };
            let (Ok(shape), Ok(kind)) = (dataset.shape(), dataset.dtype()) else { continue };
            let holds = match kind {
                DType::F32 | DType::F64 | DType::I8 | DType::I16 | DType::I32 | DType::I64 => Holds::Numbers,
                DType::U8 | DType::U16 | DType::U32 | DType::U64 => Holds::Numbers,
                _ => Holds::Texts,
            };
            let shape = shape.iter().map(|n| usize::try_from(*n).unwrap_or(usize::MAX)).collect();
            self.paths.push(below(path, &child));
            self.arrays.push(Array { name: below(name, &child), shape, holds, entries: Vec::new() });
        }
        if depth < MAX_DEPTH {
            for child in group.groups().map_err(|e| e.to_string())? {
                if child.starts_with('#') {
                    continue;
                }
                let inner = group.group(&child).map_err(|e| e.to_string())?;
                self.list(&inner, &below(path, &child), &below(name, &child), depth + 1)?;
            }
        }
        Ok(())
    }
}

impl ArrayFile for Hdf5 {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, array: usize) -> Result<Values, String> {
        let path = &self.paths[array];
        let opened = self.file.dataset(path).map_err(|e| e.to_string());
        opened.and_then(|d| self.check_chunks(&d)).map_err(|e| format!("dataset `{path}`: {e}"))?;
        let read = || {
            let dataset = self.file.dataset(path)?;
            Ok::<_, hdf5_pure::Error>(match dataset.dtype()? {
                DType::F32 | DType::F64 | DType::U64 => Values::Float(dataset.read_f64()?),
                _ => Values::Whole(dataset.read_i64()?),
            })
        };
        let values = read().map_err(|e| format!("dataset `{path}`: {e}"))?;
        let found = match &values {
            Values::Float(x) => x.len(),
            Values::Whole(x) => x.len(),
        };
        let shape = &self.arrays[array].shape;
        match shape.iter().try_fold(1_usize, |n, m| n.checked_mul(*m)) {
            Some(count) if count == found => Ok(values),
            _ => Err(format!("dataset `{path}`: expected {shape:?} numbers, found {found}")),
        }
    }
}
