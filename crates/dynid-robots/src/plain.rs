//! Robot files in XML, xacro expanded.

use std::path::Path;

use dynid_files::{FileMember, SourceFile};

use crate::robot_error::RobotFileError;
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::xacro;

/// A robot file in XML without macros.
pub(crate) struct Plain {
    pub(crate) text: String,
    /// Files that were read, the named one first; none of a text.
    pub(crate) sources: Vec<SourceFile>,
    /// The member behind `#`, where it is no arguments of xacro.
    pub(crate) member: Option<String>,
    /// Name of the text in messages: lines of an expanded one are not those of its file.
    pub(crate) name: String,
}

impl Plain {
    /// Reads `FILE` or `FILE#MEMBER`; xacro is expanded, and the member is its arguments.
    pub(crate) fn read(path: &Path) -> Result<Plain, RobotFileError> {
        let FileMember { path: file, member } = FileMember::of(path);
        let (text, source) = read_text(&file, MAX_ROBOT_FILE_BYTES)?;
        let named = SourceFile { path: path.display().to_string(), ..source };
        Plain::of(text, &file, member, Some(named))
    }

    /// A text that was read, or that a program has.
    pub(crate) fn of(
        text: String,
        file: &Path,
        member: Option<String>,
        source: Option<SourceFile>,
    ) -> Result<Plain, RobotFileError> {
        let name = file.display().to_string();
        if !xacro::is_xacro(&text, file) {
            return Ok(Plain { text, sources: source.into_iter().collect(), member, name });
        }
        let expanded = xacro::expand(&text, file, member.as_deref())?;
        Ok(Plain {
            text: expanded.text,
            sources: source.into_iter().chain(expanded.included).collect(),
            member: None,
            name: format!("{name} (expanded)"),
        })
    }
}
