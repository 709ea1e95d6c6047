//! Text files of bounded size, with the digest of what was read.

use std::io::Read;
use std::path::Path;

use crate::digest::{SourceFile, sha256};
use crate::input;

/// Why a text cannot be had.
#[derive(Debug)]
pub enum TextFault {
    /// The operating system would not give the file.
    Unreadable(std::io::Error),
    /// More bytes than the cap.
    TooLarge {
        /// Cap, bytes.
        limit: u64,
    },
    /// Not UTF-8.
    NotText {
        /// Bytes before the fault.
        offset: usize,
        /// The byte there.
        byte: u8,
    },
}

/// The text of a file of at most `limit` bytes without its byte order mark, and what was read.
///
/// # Errors
/// [`TextFault`].
pub fn read(path: &Path, limit: u64) -> Result<(String, SourceFile), TextFault> {
    let handle = input::open(path).map_err(TextFault::Unreadable)?;
    if handle.length().map_err(TextFault::Unreadable)? > limit {
        return Err(TextFault::TooLarge { limit });
    }
    let mut bytes = Vec::new();
    handle.take(limit + 1).read_to_end(&mut bytes).map_err(TextFault::Unreadable)?;
    if bytes.len() as u64 > limit {
        return Err(TextFault::TooLarge { limit });
    }
    let source = SourceFile { path: path.display().to_string(), sha256: sha256(&bytes) };
    let text = String::from_utf8(bytes).map_err(|e| {
        let offset = e.utf8_error().valid_up_to();
        TextFault::NotText { offset, byte: e.as_bytes().get(offset).copied().unwrap_or_default() }
    })?;
    let text = match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    };
    Ok((text, source))
}
