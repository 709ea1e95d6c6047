//! Robot files of any kind: the door that looks at the file and picks the reader.

use std::path::Path;

pub use crate::robot_error::{Place, RobotFileError};

use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::toml_robot::{self, ElementSpec, RobotFile};
use crate::urdf::xml::{Tag, Tags};
use crate::{mjcf, sdf, urdf};
use dynid_files::FileMember;
use dynid_files::digest::SourceFile;
use dynid_files::excerpt::excerpt;

/// Reads a robot file: `.toml` as TOML, `.urdf`, `.xml` and `.sdf` by their outermost element (`<robot>`: URDF, `<mujoco>`: MJCF, `<sdf>`: SDF),
/// anything else by its first character. `FILE#MODEL` is one of several models of an SDF world.
///
/// A URDF carries no element list, so its [`ElementSpec`] is empty; MJCF states values of rotors and friction, SDF of friction.
///
/// # Errors
/// [`RobotFileError`]: the file cannot be read, is too large, or is not a robot.
pub fn read(path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    let FileMember { path, member } = FileMember::of(path.as_ref());
    let (text, mut source) = read_text(&path, MAX_ROBOT_FILE_BYTES)?;
    if let Some(model) = &member {
        source.path = format!("{}#{model}", source.path);
    }
    parse_source(&text, &path, member.as_deref(), Some(source))
}

/// Reads a robot from the text of a file; the reader is chosen as [`read`] chooses it, and `path` stands in messages.
///
/// # Errors
/// [`RobotFileError`]: the text is not a robot.
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    parse_source(text, path.as_ref(), None, None)
}

fn parse_source(
    text: &str,
    path: &Path,
    model: Option<&str>,
    source: Option<SourceFile>,
) -> Result<RobotFile, RobotFileError> {
    let name = path.display().to_string();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let is_xml = match extension.as_str() {
        "sdf" | "urdf" | "world" | "xml" => true,
        "toml" => false,
        "xacro" => return Err(RobotFileError::Xacro { at: Place::start(&name), found: name }),
        _ => text.trim_start().starts_with('<'),
    };
    let sources: Vec<SourceFile> = source.into_iter().collect();
    let kind = if is_xml { outermost(text, &name)? } else { None };
    if kind.as_deref() == Some("sdf") {
        return Ok(RobotFile { sources, ..sdf::parse_model(text, &name, model)? });
    }
    if let Some(model) = model {
        return Err(RobotFileError::Value {
            at: Place::start(&name),
            owner: "the file".to_owned(),
            field: format!("#{}", excerpt(model)),
            expected: "SDF, which may hold several models".to_owned(),
            found: if is_xml { "another format of XML" } else { "TOML" }.to_owned(),
        });
    }
    if !is_xml {
        return toml_robot::parse_source(text, &name, sources.into_iter().next());
    }
    if kind.as_deref() == Some("mujoco") {
        let mut robot = mjcf::parse(text, path)?.file;
        robot.sources.splice(0..0, sources);
        return Ok(robot);
    }
    let plain = RobotFile::plain(urdf::parse(text, &name)?, ElementSpec::default());
    Ok(RobotFile { urdf: Some(name), sources, ..plain })
}

/// The name of the outermost element of an XML text, if there is one.
fn outermost(text: &str, name: &str) -> Result<Option<String>, RobotFileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    Ok(match Tags::new(text, name).next()? {
        Some((_, Tag::Open { start, .. })) => Some(start.name().0.to_owned()),
        _ => None,
    })
}
