//! Robot files of any kind: the door that looks at the file and picks the reader.

mod error;

use std::path::Path;

pub use error::{Place, RobotFileError};

use crate::digest::SourceFile;
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::toml_robot::{self, ElementSpec, RobotFile};
use crate::urdf;

/// Least limit of a velocity or an effort, rad/s, m/s, N m or N: what is smaller is a slip.
pub(crate) const LEAST_LIMIT: f64 = 1e-9;

/// Whether a robot file may state a number: finite, of moderate size, and no denormal, of which there is no quotient.
pub(crate) fn is_in_range(x: f64) -> bool {
    x == 0.0 || (x.is_normal() && x.abs() <= 1e30)
}

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
