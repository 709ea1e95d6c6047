//! Reading whole files of bounded size: configurations, results, checkpoints.

use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

/// Largest file that is read whole, bytes (256 MiB).
pub const MAX_BYTES: u64 = 256 << 20;

/// The bytes of a file.
///
/// # Errors
/// The operating system's; [`io::ErrorKind::FileTooLarge`] beyond [`MAX_BYTES`], for devices without an end too.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let too_large = || {
        let reason = format!("expected at most {} MiB, found more", MAX_BYTES >> 20);
        io::Error::new(io::ErrorKind::FileTooLarge, reason)
    };
    if metadata.len() > MAX_BYTES {
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
