//! Reading whole text files of bounded size.

use std::io::Read;
use std::path::Path;

use crate::digest::{SourceFile, sha256};
use crate::input;
use crate::robot_error::RobotFileError;

/// Largest robot file that is read, bytes (64 MiB).
pub(crate) const MAX_ROBOT_FILE_BYTES: u64 = 64 << 20;

/// Why a text cannot be had.
pub(crate) enum TextFault {
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

/// The text of a robot file without a byte order mark, and what was read.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<(String, SourceFile), RobotFileError> {
    text(path, limit).map_err(|fault| {
        let file = path.display().to_string();
        match fault {
            TextFault::Unreadable(error) => RobotFileError::Unreadable { file, error },
            TextFault::TooLarge { limit } => RobotFileError::TooLarge { file, limit },
            TextFault::NotText { offset, byte } => RobotFileError::NotText { file, offset, byte },
        }
    })
}

/// The file's text without a byte order mark, and what was read.
pub(crate) fn text(path: &Path, limit: u64) -> Result<(String, SourceFile), TextFault> {
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
