//! Robot files of any kind: the door that looks at the file and picks the reader.

use std::path::Path;

pub use crate::robot_error::{Place, RobotFileError};

use crate::digest::SourceFile;
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::toml_robot::{self, ElementSpec, RobotFile};
use crate::urdf;

/// Reads a robot file: `.urdf` and `.xml` as URDF, `.toml` as TOML, anything else by its first character.
///
/// A URDF carries no element list, so its [`ElementSpec`] is empty.
///
/// # Errors
/// [`RobotFileError`]: the file cannot be read, is too large, or is not a robot.
pub fn read(path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    let path = path.as_ref();
    let (text, source) = read_text(path, MAX_ROBOT_FILE_BYTES)?;
    parse_source(&text, path, Some(source))
}

/// Reads a robot from the text of a file; the reader is chosen as [`read`] chooses it, and `path` stands in messages.
///
/// # Errors
/// [`RobotFileError`]: the text is not a robot.
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    parse_source(text, path.as_ref(), None)
}

fn parse_source(text: &str, path: &Path, source: Option<SourceFile>) -> Result<RobotFile, RobotFileError> {
    let name = path.display().to_string();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let is_xml = match extension.as_str() {
        "urdf" | "xml" => true,
        "toml" => false,
        "xacro" => return Err(RobotFileError::Xacro { at: Place::start(&name), found: name }),
        _ => text.trim_start().starts_with('<'),
    };
    if is_xml {
        let plain = RobotFile::plain(urdf::parse(text, &name)?, ElementSpec::default());
        Ok(RobotFile { urdf: Some(name), sources: source.into_iter().collect(), ..plain })
    } else {
        toml_robot::parse_source(text, &name, source)
    }
}
