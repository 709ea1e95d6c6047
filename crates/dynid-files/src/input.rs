//! Opening files, and reading whole ones of bounded size: configurations, results, checkpoints.
//!
//! `-` in the place of a file is standard input; a file of this name is `./-`.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::OnceLock;

/// Largest file that is read whole, bytes (256 MiB).
pub const MAX_BYTES: u64 = 256 << 20;
/// Most bytes of standard input (4 GiB).
const MAX_STANDARD_INPUT: u64 = 4 << 30;

/// A file that is open, or standard input.
#[derive(Debug)]
pub struct Opened(Source);

#[derive(Debug)]
enum Source {
    File(File),
    StandardInput(Cursor<&'static [u8]>),
}

impl Opened {
    /// Length in bytes where it is known beforehand: not of pipes.
    ///
    /// # Errors
    /// The operating system's.
    pub fn length(&self) -> io::Result<u64> {
        match &self.0 {
            Source::File(file) => Ok(file.metadata()?.len()),
            Source::StandardInput(bytes) => Ok(bytes.get_ref().len() as u64),
        }
    }
}

impl Read for Opened {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match &mut self.0 {
            Source::File(file) => file.read(buffer),
            Source::StandardInput(bytes) => bytes.read(buffer),
        }
    }
}

impl Seek for Opened {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.0 {
            Source::File(file) => file.seek(to),
            Source::StandardInput(bytes) => bytes.seek(to),
        }
    }
}

/// Opens a file for reading; `-` is standard input, which is read to its end once and may be opened as often as a file.
///
/// # Errors
/// The operating system's; [`io::ErrorKind::IsADirectory`]; [`io::ErrorKind::FileTooLarge`] for more than 4 GiB of standard input.
pub fn open(path: &Path) -> io::Result<Opened> {
    if path == Path::new("-") {
        return Ok(Opened(Source::StandardInput(Cursor::new(standard_input()?))));
    }
    let file = File::open(path)?;
    match file.metadata()?.is_dir() {
        true => Err(io::ErrorKind::IsADirectory.into()),
        false => Ok(Opened(Source::File(file))),
    }
}

/// Bytes of standard input, which only gives them once.
fn standard_input() -> io::Result<&'static [u8]> {
    static BYTES: OnceLock<Result<Vec<u8>, io::ErrorKind>> = OnceLock::new();
    let read = || {
        let mut bytes = Vec::new();
        io::stdin().lock().take(MAX_STANDARD_INPUT + 1).read_to_end(&mut bytes).map_err(|e| e.kind())?;
        if bytes.len() as u64 > MAX_STANDARD_INPUT { Err(io::ErrorKind::FileTooLarge) } else { Ok(bytes) }
    };
    BYTES.get_or_init(read).as_deref().map_err(|kind| (*kind).into())
}

/// The bytes of a file, or of standard input ([`open`]).
///
/// # Errors
/// The operating system's; [`io::ErrorKind::FileTooLarge`] beyond [`MAX_BYTES`], for devices without an end too.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let too_large = || {
        let reason = format!("expected at most {} MiB, found more", MAX_BYTES >> 20);
        io::Error::new(io::ErrorKind::FileTooLarge, reason)
    };
    if file.length()? > MAX_BYTES {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES { Err(too_large()) } else { Ok(bytes) }
}

/// The text of a file.
///
/// # Errors
/// Fails as [`read`] does; [`io::ErrorKind::InvalidData`] unless it is UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e.utf8_error()))
}

/// The message of a fault in a TOML text, with the key that is given twice.
pub fn toml_message(message: &str, text: &str, span: Option<Range<usize>>) -> String {
    match span.and_then(|span| text.get(span)).map(str::trim).filter(|key| !key.is_empty()) {
        Some(key) if message == "duplicate key" => {
            format!("duplicate key `{}`", key.lines().next().unwrap_or_default())
        }
        _ => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_without_an_end_is_refused() {
        let error = super::read(std::path::Path::new("/dev/zero")).unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::FileTooLarge);
    }
}
