//! Arrays of NumPy: `.npy`, and `.npz`, which is a zip of them.
//!
//! Arrays of Python objects are refused: reading them runs code of the file.

use std::io::{Read, Seek, SeekFrom};

use dynid_files::input::Opened;
use zip::ZipArchive;

use super::arrays::{Array, ArrayFile, Holds, Values};
use super::binary::{Kind, Numbers};

/// Longest header that is read, bytes.
const MAX_HEADER: usize = 1 << 20;
/// Most arrays of a file.
const MAX_ARRAYS: usize = 10_000;

/// What the header of an array says.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Header {
    entries: Entries,
    big_endian: bool,
    column_major: bool,
    shape: Vec<usize>,
}

/// What an array is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entries {
    Numbers(Kind),
    Text,
}

/// A file with one array.
pub(super) struct Npy {
    file: Opened,
    start: u64,
    header: Header,
    arrays: [Array; 1],
}

impl Npy {
    /// `name`: the array's, since the file has none for it.
    pub(super) fn open(mut file: Opened, name: &str) -> Result<Self, String> {
        file.seek(SeekFrom::Start(0)).map_err(|e| e.to_string())?;
        let header = read_header(&mut file)?;
        let start = file.stream_position().map_err(|e| e.to_string())?;
        let arrays = [array_of(name, &header)];
        Ok(Npy { file, start, header, arrays })
    }
}

impl ArrayFile for Npy {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, _array: usize) -> Result<Values, String> {
        self.file.seek(SeekFrom::Start(self.start)).map_err(|e| e.to_string())?;
        read_values(&mut self.file, &self.header)
    }
}

/// A zip of arrays.
pub(super) struct Npz {
    zip: ZipArchive<Opened>,
    /// Entry of the zip per array.
    entries: Vec<usize>,
    arrays: Vec<Array>,
}

impl Npz {
    pub(super) fn open(mut zip: ZipArchive<Opened>) -> Result<Self, String> {
        if zip.len() > MAX_ARRAYS {
            return Err(format!("expected at most {MAX_ARRAYS} arrays, found {}", zip.len()));
        }
        let (mut entries, mut arrays) = (Vec::new(), Vec::new());
        for k in 0..zip.len() {
            let mut entry = zip.by_index(k).map_err(|e| e.to_string())?;
            let name = entry.name().map_err(|e| e.to_string())?.into_owned();
            let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else { continue };
            let header = read_header(&mut entry).map_err(|reason| format!("array `{name}`: {reason}"))?;
            entries.push(k);
            arrays.push(array_of(&name, &header));
        }
        Ok(Npz { zip, entries, arrays })
    }
}

impl ArrayFile for Npz {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, array: usize) -> Result<Values, String> {
        let mut entry = self.zip.by_index(self.entries[array]).map_err(|e| e.to_string())?;
        let header = read_header(&mut entry)?;
        read_values(&mut entry, &header).map_err(|e| format!("array `{}`: {e}", self.arrays[array].name))
    }
}

fn array_of(name: &str, header: &Header) -> Array {
    let holds = if header.entries == Entries::Text { Holds::Texts } else { Holds::Numbers };
    Array { name: name.to_owned(), shape: header.shape.clone(), holds, entries: Vec::new() }
}

fn read_header(file: &mut impl Read) -> Result<Header, String> {
    let mut start = [0; 8];
    file.read_exact(&mut start).map_err(|_| "expected the header of an array, found its end".to_owned())?;
    if &start[..6] != b"\x93NUMPY" {
        return Err("expected an array of NumPy, found something else".to_owned());
    }
    let mut length = [0; 4];
    let size = if start[6] == 1 { 2 } else { 4 };
    file.read_exact(&mut length[..size]).map_err(|e| e.to_string())?;
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_HEADER {
        return Err(format!("expected a header of at most {MAX_HEADER} bytes, found {length}"));
    }
    let mut text = vec![0; length];
    file.read_exact(&mut text).map_err(|e| e.to_string())?;
    parse_header(&String::from_utf8_lossy(&text))
}

/// Parses `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`.
fn parse_header(text: &str) -> Result<Header, String> {
    let after = |key: &str| {
        let at = text
            .find(&format!("'{key}'"))
            .ok_or_else(|| format!("expected `{key}` in the header of an array, found none"))?;
        let rest = &text[at + key.len() + 2..];
        Ok::<&str, String>(rest.trim_start().strip_prefix(':').unwrap_or(rest).trim_start())
    };
    let descr = after("descr")?;
    if descr.starts_with('[') {
        return Err(
            "expected an array of numbers, found records: save each field as an array of its own".to_owned()
        );
    }
    let descr = descr.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let column_major = after("fortran_order")?.starts_with("True");
    let shape = after("shape")?;
    let inner = shape
        .strip_prefix('(')
        .and_then(|s| s.split_once(')'))
        .ok_or("expected a shape in brackets, found none")?
        .0;
    let shape: Vec<usize> = inner
        .split(',')
        .map(str::trim)
        .filter(|n| !n.is_empty())
        .map(|n| n.parse().map_err(|_| format!("expected a shape, found `{inner}`")))
        .collect::<Result<_, _>>()?;
    let (order, kind) = descr.split_at_checked(1).ok_or("expected a type, found none")?;
    let (letter, size) = kind.split_at_checked(1).ok_or("expected a type, found none")?;
    let kind = match (letter, size.parse::<usize>().unwrap_or(0)) {
        ("f", 2) => Kind::Half,
        ("f", 4) => Kind::Single,
        ("f", 8) => Kind::Double,
        ("i", n @ (1 | 2 | 4 | 8)) => Kind::Signed(n),
        ("u", n @ (1 | 2 | 4 | 8)) => Kind::Unsigned(n),
        ("b", 1) => Kind::Bool,
        // Times in a unit of `np.datetime64` or `np.timedelta64`.
        ("M" | "m", _) => Kind::Signed(8),
        ("U" | "S", _) => {
            return Ok(Header { entries: Entries::Text, big_endian: false, column_major, shape });
        }
        ("O", _) => {
            return Err(
                "expected an array of numbers, found Python objects, whose reading would run code".to_owned()
            );
        }
        _ => return Err(format!("expected an array of numbers, found the type `{descr}`")),
    };
    Ok(Header { entries: Entries::Numbers(kind), big_endian: order == ">", column_major, shape })
}

fn read_values(file: &mut impl Read, header: &Header) -> Result<Values, String> {
    let count = header.shape.iter().try_fold(1_usize, |n, m| n.checked_mul(*m));
    let Entries::Numbers(kind) = header.entries else {
        return Err("expected numbers, found texts".to_owned());
    };
    let numbers = Numbers { kind, big_endian: header.big_endian };
    let values = numbers.read(file, count.ok_or("expected a shape that fits memory")?)?;
    Ok(match (header.column_major, header.shape.as_slice()) {
        (true, [rows, columns]) => turned(&values, *rows, *columns),
        _ => values,
    })
}

/// Numbers whose first axis runs fastest, with the last one fastest.
fn turned(values: &Values, rows: usize, columns: usize) -> Values {
    let places = || (0..rows).flat_map(move |r| (0..columns).map(move |c| c * rows + r));
    match values {
        Values::Float(x) => Values::Float(places().map(|k| x[k]).collect()),
        Values::Whole(x) => Values::Whole(places().map(|k| x[k]).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_read_and_objects_refused() {
        let header = parse_header("{'descr': '<f8', 'fortran_order': True, 'shape': (3, 4), }").unwrap();
        assert_eq!(
            header,
            Header {
                entries: Entries::Numbers(Kind::Double),
                big_endian: false,
                column_major: true,
                shape: vec![3, 4]
            }
        );
        assert_eq!(
            parse_header("{'descr': '>i2', 'fortran_order': False, 'shape': (7,), }").unwrap().shape,
            [7]
        );
        assert!(
            parse_header("{'descr': '|O', 'fortran_order': False, 'shape': (7,), }")
                .unwrap_err()
                .contains("objects")
        );
        for text in [
            "",
            "{'descr': ",
            "{'descr': '<', 'fortran_order': F, 'shape': (",
            "{'descr':'<f8','fortran_order':,'shape':(x)}",
        ] {
            parse_header(text).unwrap_err();
        }
    }
}
