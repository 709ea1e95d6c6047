//! Reading whole text files of bounded size.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::robot::RobotFileError;

/// Largest robot file that is read, bytes (64 MiB).
pub(crate) const MAX_ROBOT_FILE_BYTES: u64 = 64 << 20;

/// The file's text without a byte order mark.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<String, RobotFileError> {
    let file = path.display().to_string();
    let unreadable = |error| RobotFileError::Unreadable { file: path.display().to_string(), error };
    let handle = File::open(path).map_err(unreadable)?;
    let metadata = handle.metadata().map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(unreadable(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    if metadata.len() > limit {
        return Err(RobotFileError::TooLarge { file, limit });
    }
    let mut bytes = Vec::new();
    handle.take(limit + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > limit {
        return Err(RobotFileError::TooLarge { file, limit });
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let offset = e.utf8_error().valid_up_to();
        RobotFileError::NotText { file, offset, byte: e.as_bytes().get(offset).copied().unwrap_or_default() }
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}
