//! `.mat` files of MATLAB 5 to 7.2 (MAT-file level 5): matrices of numbers, and structures of them.
//!
//! Files of version 7.3 are HDF5.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::arrays::{Array, ArrayFile, Holds, Values};

/// Bytes before the first element.
const HEADER: usize = 128;
/// Deepest nesting of structures.
const MAX_DEPTH: usize = 16;
/// Most arrays of a file.
const MAX_ARRAYS: usize = 10_000;
/// Largest decompressed element for each byte of the file; zlib reaches 1032.
const MAX_RATIO: u64 = 1100;

/// A file whose elements are known.
pub(super) struct MatFile {
    bytes: Vec<u8>,
    big_endian: bool,
    arrays: Vec<Array>,
    places: Vec<Place>,
}

/// Where the numbers of an array lie.
#[derive(Clone, Copy)]
struct Place {
    /// Offset of the element of the file that holds them.
    element: usize,
    /// Offset of the tag of the numbers in the element, decompressed if it is compressed.
    data: usize,
}

impl MatFile {
    /// Finds the arrays in the bytes of a file; `max_bytes` bounds what is decompressed at a time.
    pub(super) fn parse(bytes: Vec<u8>, max_bytes: u64) -> Result<Self, String> {
        let big_endian = match bytes.get(HEADER - 2..HEADER) {
            Some(b"IM") => false,
            Some(b"MI") => true,
            _ => return Err("expected the header of a MAT-file of level 5, found something else".to_owned()),
        };
        let mut file = MatFile { bytes, big_endian, arrays: Vec::new(), places: Vec::new() };
        let mut at = HEADER;
        while at + 8 <= file.bytes.len() {
            let tag = Tag::at(&file.bytes, at, big_endian)?;
            let (content, next) = file.element(at, max_bytes)?;
            let (mut arrays, mut places) = (Vec::new(), Vec::new());
            if content.kind(tag)? == MATRIX {
                let mut found = |name: String, shape: Vec<usize>, holds: Holds, data: usize| {
                    arrays.push(Array { name, shape, holds, entries: Vec::new() });
                    places.push(Place { element: at, data });
                };
                content.matrix(content.matrix_start, "", 0, &mut found)?;
            }
            file.arrays.extend(arrays);
            file.places.extend(places);
            if file.arrays.len() > MAX_ARRAYS {
                return Err(format!("expected at most {MAX_ARRAYS} arrays, found more"));
            }
            at = next;
        }
        Ok(file)
    }

    /// The content of the element at an offset, and the offset of the next one.
    fn element(&self, at: usize, max_bytes: u64) -> Result<(Content<'_>, usize), String> {
        let tag = Tag::at(&self.bytes, at, self.big_endian)?;
        let end = tag.data.checked_add(tag.size).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| {
            format!("expected an element of {} bytes at byte {at}, found the end of the file", tag.size)
        })?;
        if tag.kind != COMPRESSED {
            let bytes = std::borrow::Cow::Borrowed(&self.bytes[..end]);
            let content = Content { bytes, big_endian: self.big_endian, matrix_start: at };
            // Elements begin at multiples of eight bytes.
            return Ok((content, end.next_multiple_of(8)));
        }
        let mut out = Vec::new();
        let limit = max_bytes.min(MAX_RATIO.saturating_mul(tag.size as u64 + 64));
        let read = ZlibDecoder::new(&self.bytes[tag.data..end]).take(limit + 1).read_to_end(&mut out);
        read.map_err(|e| format!("compressed element at byte {at}: {e}"))?;
        if out.len() as u64 > limit {
            return Err(format!(
                "compressed element at byte {at}: expected at most {limit} bytes, found more"
            ));
        }
        let content = Content { bytes: out.into(), big_endian: self.big_endian, matrix_start: 0 };
        Ok((content, end))
    }
}

impl ArrayFile for MatFile {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, array: usize) -> Result<Values, String> {
        let place = self.places[array];
        let (content, _) = self.element(place.element, u64::MAX)?;
        let shape = &self.arrays[array].shape;
        let values = content.numbers(place.data)?;
        let count = shape.iter().try_fold(1_usize, |n, m| n.checked_mul(*m));
        if Some(values.len()) != count {
            let name = &self.arrays[array].name;
            return Err(format!("array `{name}`: expected {shape:?} numbers, found {}", values.len()));
        }
        // MATLAB has its first axis fastest.
        let [rows, columns] = shape[..] else { return Err("expected two axes".to_owned()) };
        let turned = (0..rows).flat_map(|r| (0..columns).map(move |c| c * rows + r));
        Ok(match values {
            Numbers::Float(x) => Values::Float(turned.map(|k| x[k]).collect()),
            Numbers::Whole(x) => Values::Whole(turned.map(|k| x[k]).collect()),
        })
    }
}

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Type, size and place of an element.
#[derive(Clone, Copy)]
struct Tag {
    kind: u32,
    size: usize,
    /// Offset of its bytes.
    data: usize,
    /// Offset of the element behind it.
    next: usize,
}

impl Tag {
    fn at(bytes: &[u8], at: usize, big_endian: bool) -> Result<Self, String> {
        let word = |at: usize| word(bytes, at, 4, big_endian).map(|w| w as u32);
        let first = word(at)?;
        if first >> 16 != 0 {
            // Up to four bytes stand in the tag itself.
            let size = (first >> 16) as usize;
            return Ok(Tag { kind: first & 0xffff, size: size.min(4), data: at + 4, next: at + 8 });
        }
        let (size, data) = (word(at + 4)? as usize, at + 8);
        let next = data.checked_add(size).and_then(|n| n.checked_next_multiple_of(8));
        Ok(Tag { kind: first, size, data, next: next.ok_or("expected a size, found one beyond any file")? })
    }
}

/// `size` bytes as a whole number.
fn word(bytes: &[u8], at: usize, size: usize, big_endian: bool) -> Result<u64, String> {
    let end = at.checked_add(size);
    let part = end.and_then(|end| bytes.get(at..end)).ok_or("expected an element, found its end")?;
    let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
    Ok(if big_endian { part.iter().fold(0, add) } else { part.iter().rev().fold(0, add) })
}

enum Numbers {
    Float(Vec<f64>),
    Whole(Vec<i64>),
}

impl Numbers {
    fn len(&self) -> usize {
        match self {
            Numbers::Float(x) => x.len(),
            Numbers::Whole(x) => x.len(),
        }
    }
}

/// The bytes that hold an element.
struct Content<'a> {
    bytes: std::borrow::Cow<'a, [u8]>,
    big_endian: bool,
    /// Offset of its tag.
    matrix_start: usize,
}

impl Content<'_> {
    fn tag(&self, at: usize) -> Result<Tag, String> {
        Tag::at(&self.bytes, at, self.big_endian)
    }

    /// Type of the element, that of the compressed one if it is compressed.
    fn kind(&self, outer: Tag) -> Result<u32, String> {
        if outer.kind == COMPRESSED { self.tag(0).map(|tag| tag.kind) } else { Ok(outer.kind) }
    }

    fn part(&self, tag: Tag) -> Result<&[u8], String> {
        let end = tag.data.checked_add(tag.size);
        end.and_then(|end| self.bytes.get(tag.data..end))
            .ok_or_else(|| "expected an element, found its end".to_owned())
    }

    fn word(&self, at: usize) -> Result<u32, String> {
        word(&self.bytes, at, 4, self.big_endian).map(|w| w as u32)
    }

    /// Tells of the arrays of numbers and texts in the matrix at an offset.
    fn matrix(
        &self,
        at: usize,
        path: &str,
        depth: usize,
        found: &mut impl FnMut(String, Vec<usize>, Holds, usize),
    ) -> Result<(), String> {
        let matrix = self.tag(at)?;
        self.part(matrix)?;
        if matrix.kind != MATRIX || matrix.size == 0 || depth > MAX_DEPTH {
            return Ok(());
        }
        let flags = self.tag(matrix.data)?;
        let class = self.word(flags.data)? & 0xff;
        let dimensions = self.tag(flags.next)?;
        let shape: Vec<usize> = (0..dimensions.size / 4)
            .take(32)
            .map(|k| self.word(dimensions.data + 4 * k).map(|n| n as usize))
            .collect::<Result<_, _>>()?;
        let name = self.tag(dimensions.next)?;
        let own = String::from_utf8_lossy(self.part(name)?).into_owned();
        let path = match (path.is_empty(), own.is_empty()) {
            (true, _) => own,
            (false, true) => path.to_owned(),
            (false, false) => format!("{path}/{own}"),
        };
        match class {
            // A structure; one of several is no log.
            2 if shape.iter().all(|n| *n == 1) => {
                let length = self.tag(name.next)?;
                let width = self.word(length.data)? as usize;
                let names = self.tag(length.next)?;
                let listed = self.part(names)?;
                let mut next = names.next;
                for field in listed.chunks_exact(width.max(1)).take(MAX_ARRAYS) {
                    let end = field.iter().position(|b| *b == 0).unwrap_or(field.len());
                    let field = String::from_utf8_lossy(&field[..end]);
                    self.matrix(next, &format!("{path}/{field}"), depth + 1, found)?;
                    next = self.tag(next)?.next;
                }
            }
            4 => found(path, shape, Holds::Texts, name.next),
            6..=15 => found(path, shape, Holds::Numbers, name.next),
            _ => {}
        }
        Ok(())
    }

    /// The numbers of an element, whatever they are kept as.
    fn numbers(&self, at: usize) -> Result<Numbers, String> {
        let tag = self.tag(at)?;
        let bytes = self.part(tag)?;
        let words = |size: usize| {
            let of = move |chunk: &[u8]| word(chunk, 0, size, self.big_endian).unwrap_or_default();
            bytes.chunks_exact(size).map(of)
        };
        Ok(match tag.kind {
            1 => Numbers::Whole(bytes.iter().map(|b| i64::from(*b as i8)).collect()),
            2 => Numbers::Whole(bytes.iter().map(|b| i64::from(*b)).collect()),
            3 => Numbers::Whole(words(2).map(|w| i64::from(w as u16 as i16)).collect()),
            4 => Numbers::Whole(words(2).map(|w| w as i64).collect()),
            5 => Numbers::Whole(words(4).map(|w| i64::from(w as u32 as i32)).collect()),
            6 => Numbers::Whole(words(4).map(|w| w as i64).collect()),
            7 => Numbers::Float(words(4).map(|w| f64::from(f32::from_bits(w as u32))).collect()),
            9 => Numbers::Float(words(8).map(f64::from_bits).collect()),
            12 => Numbers::Whole(words(8).map(|w| w as i64).collect()),
            13 => Numbers::Whole(words(8).map(|w| w as i64).collect()),
            kind => return Err(format!("expected numbers, found data of type {kind}")),
        })
    }
}
