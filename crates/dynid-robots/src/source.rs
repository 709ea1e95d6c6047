//! Reading whole robot files of bounded size.

use std::path::Path;

use dynid_files::SourceFile;
use dynid_files::text::{self, TextFault};

use crate::robot_error::RobotFileError;

/// Largest robot file that is read, bytes (64 MiB).
pub(crate) const MAX_ROBOT_FILE_BYTES: u64 = 64 << 20;

/// The text of a robot file without a byte order mark, and what was read.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<(String, SourceFile), RobotFileError> {
    text::read(path, limit).map_err(|fault| {
        let file = path.display().to_string();
        match fault {
            TextFault::Unreadable(error) => RobotFileError::Unreadable { file, error },
            TextFault::TooLarge { limit } => RobotFileError::TooLarge { file, limit },
            TextFault::NotText { offset, byte } => RobotFileError::NotText { file, offset, byte },
        }
    })
}
