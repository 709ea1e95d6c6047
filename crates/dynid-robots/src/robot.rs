//! Robot files of any kind: the door that looks at the file and picks the reader.

use std::path::Path;

pub use crate::robot_error::{Place, RobotFileError};

use crate::plain::Plain;
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::toml_robot::{self, ElementSpec, RobotFile};
use crate::urdf::xml::{Tag, Tags};
use crate::{mjcf, sdf, urdf};
use dynid_files::FileMember;
use dynid_files::digest::SourceFile;
use dynid_files::excerpt::excerpt;

/// Reads a robot file: `.toml` as TOML, `.urdf`, `.xml`, `.sdf` and `.xacro` by their outermost element (`<robot>`: URDF, `<mujoco>`: MJCF,
/// `<sdf>`: SDF), anything else by its first character. A file that ends in `.xacro` or has tags of xacro is expanded first;
/// `FILE#name:=value,name:=value` states its arguments. Of an SDF world `FILE#MODEL` is one of several models.
///
/// A URDF carries no element list, so its [`ElementSpec`] is empty; MJCF states values of rotors and friction, SDF of friction.
///
/// # Errors
/// [`RobotFileError`]: the file cannot be read, is too large, cannot be expanded, or is not a robot.
pub fn read(path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    let named = path.as_ref();
    let FileMember { path, member } = FileMember::of(named);
    let (text, source) = read_text(&path, MAX_ROBOT_FILE_BYTES)?;
    let source = SourceFile { path: named.display().to_string(), ..source };
    parse_source(text, &path, member, Some(source))
}

/// The name of a robot file without folders, endings and what stands behind `#`: `arm` of `robots/arm.urdf.xacro#prefix:=left_`.
pub fn stem(path: &Path) -> String {
    let FileMember { path, .. } = FileMember::of(path);
    let name =
        |part: Option<&std::ffi::OsStr>| part.map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let whole = name(path.file_name());
    match whole.strip_suffix(".xacro") {
        Some(inner) => {
            let ends = [".urdf", ".sdf", ".xml"].into_iter().find_map(|end| inner.strip_suffix(end));
            ends.unwrap_or(inner).to_owned()
        }
        None => name(path.file_stem()),
    }
}

/// Reads a robot from the text of a file; the reader is chosen as [`read`] chooses it, and `path` stands in messages, and is where
/// files that the text names are looked for. Behind `#` it has what [`read`] takes.
///
/// # Errors
/// [`RobotFileError`]: the text is not a robot.
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    let FileMember { path, member } = FileMember::of(path.as_ref());
    parse_source(text.to_owned(), &path, member, None)
}

fn parse_source(
    text: String,
    path: &Path,
    member: Option<String>,
    source: Option<SourceFile>,
) -> Result<RobotFile, RobotFileError> {
    let name = path.display().to_string();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let is_xml = match extension.as_str() {
        "sdf" | "urdf" | "world" | "xacro" | "xml" => true,
        "toml" => false,
        _ => text.trim_start().starts_with('<'),
    };
    let named = match &member {
        Some(member) => format!("{name}#{member}"),
        None => name.clone(),
    };
    let plain = match is_xml {
        true => Plain::of(text, path, member, source)?,
        false => Plain { text, sources: source.into_iter().collect(), member, name: name.clone() },
    };
    let Plain { text, sources, member, name } = plain;
    let kind = if is_xml { outermost(&text, &name)? } else { None };
    if kind.as_deref() == Some("sdf") {
        return Ok(RobotFile { sources, ..sdf::parse_model(&text, &name, member.as_deref())? });
    }
    if let Some(member) = member {
        return Err(RobotFileError::Value {
            at: Place::start(&name),
            owner: "the file".to_owned(),
            field: format!("#{}", excerpt(&member)),
            expected: "SDF, which may hold several models, or xacro, which may have arguments".to_owned(),
            found: if is_xml { "another format of XML" } else { "TOML" }.to_owned(),
        });
    }
    if !is_xml {
        return toml_robot::parse_source(&text, &name, sources.into_iter().next());
    }
    if kind.as_deref() == Some("mujoco") {
        let mut robot = mjcf::parse(&text, path)?.file;
        robot.sources.splice(0..0, sources);
        return Ok(RobotFile { xml: Some(text.into()), ..robot });
    }
    let plain = RobotFile::plain(urdf::parse(&text, &name)?, ElementSpec::default());
    Ok(RobotFile { urdf: Some(named), xml: Some(text.into()), sources, ..plain })
}

/// The name of the outermost element of an XML text, if there is one.
fn outermost(text: &str, name: &str) -> Result<Option<String>, RobotFileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    Ok(match Tags::new(text, name).next()? {
        Some((_, Tag::Open { start, .. })) => Some(start.name().0.to_owned()),
        _ => None,
    })
}
