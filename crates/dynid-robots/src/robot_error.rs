//! Faults of robot files.

use std::fmt;
use std::io;

use thiserror::Error;

use crate::law::LawFault;
use crate::xacro_fault::XacroFault;

/// A place in a text file, printed `file:line:column`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// File or source name.
    pub file: Box<str>,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

impl Place {
    /// The place of a byte offset in a text.
    pub fn of(file: &str, text: &str, offset: usize) -> Self {
        let mut offset = offset.min(text.len());
        while !text.is_char_boundary(offset) {
            offset -= 1;
        }
        let before = &text[..offset];
        let line_start = before.rfind('\n').map_or(0, |k| k + 1);
        Place {
            file: file.into(),
            line: count(before.bytes().filter(|b| *b == b'\n').count()),
            column: count(before[line_start..].chars().count()),
        }
    }

    /// The first character of a file.
    pub fn start(file: &str) -> Self {
        Place { file: file.into(), line: 1, column: 1 }
    }
}

/// The ordinal of what has `before` predecessors; files are far smaller than `u32::MAX`.
fn count(before: usize) -> u32 {
    u32::try_from(before).unwrap_or(u32::MAX).saturating_add(1)
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// Why a robot file was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RobotFileError {
    /// The operating system would not give the file.
    #[error("{file}: cannot be read: {error}")]
    Unreadable {
        /// File.
        file: String,
        /// Reason.
        error: io::Error,
    },
    /// The file is larger than the cap.
    #[error("{file}: expected at most {limit} bytes, found more")]
    TooLarge {
        /// File.
        file: String,
        /// Cap, bytes.
        limit: u64,
    },
    /// The file is not UTF-8.
    #[error("{file}: expected text in UTF-8, found byte 0x{byte:02X} at offset {offset}")]
    NotText {
        /// File.
        file: String,
        /// Offset of the byte, from 0.
        offset: usize,
        /// The byte.
        byte: u8,
    },
    /// The text breaks the grammar of XML or TOML, or a key or type of the schema.
    #[error("{at}: {message}")]
    Syntax {
        /// Where.
        at: Place,
        /// What the parser says.
        message: String,
    },
    /// More levels, elements or attributes than any robot has.
    #[error("{at}: expected at most {limit} {what}, found more")]
    TooMany {
        /// Where the cap was passed.
        at: Place,
        /// What was counted.
        what: &'static str,
        /// Cap.
        limit: usize,
    },
    /// A tag or an expression of xacro in what was not expanded.
    #[error("{at}: expected plain XML, found xacro: `{found}`")]
    Unexpanded {
        /// Where.
        at: Place,
        /// The tag or expression.
        found: String,
    },
    /// xacro that cannot be expanded.
    #[error("{at}: {fault}")]
    Xacro {
        /// Where.
        at: Box<Place>,
        /// What is wrong.
        fault: Box<XacroFault>,
    },
    /// The outermost element is none of `<robot>`, `<mujoco>` and `<sdf>`.
    #[error(
        "{at}: expected <robot> (URDF), <mujoco> (MJCF) or <sdf> (SDF) as the outermost element, found {found}"
    )]
    NotARobot {
        /// Where.
        at: Place,
        /// What stands there.
        found: String,
    },
    /// A required element or key is absent.
    #[error("{at}: {owner}: expected {expected}, found none")]
    Missing {
        /// Place of the owner.
        at: Place,
        /// Link, joint or table that lacks it.
        owner: String,
        /// What is required.
        expected: String,
    },
    /// Something that may stand once stands twice.
    #[error("{at}: {owner}: expected {what} once, found it again")]
    Repeated {
        /// Place of the second one.
        at: Place,
        /// Owner.
        owner: String,
        /// What is repeated.
        what: String,
    },
    /// A value is not what it must be.
    #[error("{at}: {owner}: {field}: expected {expected}, found `{found}`")]
    Value {
        /// Where the value stands.
        at: Place,
        /// Link, joint or table it belongs to.
        owner: String,
        /// Element and attribute, or key.
        field: String,
        /// What is required.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A law of the file's own cannot be one.
    #[error("{at}: law `{name}`: {fault}")]
    Law {
        /// Where it stands.
        at: Place,
        /// Its name.
        name: String,
        /// Why.
        fault: Box<LawFault>,
    },
    /// A name is used twice.
    #[error("{at}: expected every {kind} name once, found `{name}` again (first on line {first_line})")]
    Duplicate {
        /// Place of the second use.
        at: Place,
        /// `link`, `joint`, `body`.
        kind: &'static str,
        /// The name.
        name: String,
        /// Line of the first use.
        first_line: u32,
    },
    /// A joint kind that is unknown or not supported.
    #[error(
        "{at}: joint `{joint}`: type: expected revolute, continuous, prismatic, fixed or floating, found `{found}`"
    )]
    JointKind {
        /// Where.
        at: Place,
        /// Joint.
        joint: String,
        /// The kind found.
        found: String,
    },
    /// Something that changes efforts and has no place here.
    #[error("{at}: {owner}: cannot be carried: {reason}")]
    NotCarried {
        /// Where.
        at: Place,
        /// Element that states it.
        owner: String,
        /// Why.
        reason: String,
        /// What to do about it.
        hint: &'static str,
    },
    /// A link or joint that is referred to does not exist.
    #[error("{at}: {context}: expected the name of a {kind}, found `{name}`")]
    UnknownName {
        /// Where.
        at: Place,
        /// Who refers to it.
        context: String,
        /// `link` or `joint`.
        kind: &'static str,
        /// The name.
        name: String,
        /// A close name that exists.
        meant: Option<String>,
    },
    /// A description holds something that a format cannot say.
    #[error("{what} `{name}`: cannot be written as {format}: {reason}")]
    Unwritable {
        /// `URDF` or `MJCF`.
        format: &'static str,
        /// `link` or `joint`.
        what: &'static str,
        /// Name of the link or joint.
        name: String,
        /// Why.
        reason: String,
    },
}

impl RobotFileError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        use RobotFileError as E;
        Some(match self {
            E::Unreadable { error, .. } if error.kind() == io::ErrorKind::NotFound => {
                "check the path; relative paths start at the current folder (in a robot file: at its folder)"
                    .into()
            }
            E::Unreadable { .. } => "check that the path is a file and may be read".into(),
            E::TooLarge { .. } => {
                "a robot file holds links and joints only; meshes belong in files of their own".into()
            }
            E::NotText { .. } => {
                "save the file as UTF-8; compressed and binary files are not robot files".into()
            }
            E::Syntax { message, .. } if message.contains("unknown field") => {
                "unknown keys are errors so that a misspelt one cannot be ignored".into()
            }
            E::Syntax { .. } => "the file is damaged or cut off at or before this place".into(),
            E::TooMany { .. } => "this does not look like a robot".into(),
            E::Unexpanded { at, .. } => {
                format!("call the file `{}.xacro`, so that it is expanded", at.file.trim_end_matches(".urdf"))
            }
            E::Xacro { at, fault } => fault.hint(&at.file),
            E::NotARobot { .. } => {
                "a URDF starts with <robot name=\"...\">, MJCF with <mujoco>, SDF with <sdf version=\"...\">"
                    .into()
            }
            E::Missing { expected, .. } if expected.contains("<mass>") || expected.contains("<inertia>") => {
                "complete the <inertial> or remove it: a link without one counts as not stated".into()
            }
            E::Law { .. } => LawFault::HINT.into(),
            E::Missing { .. } => "add it".into(),
            E::Repeated { .. } => "remove one of them".into(),
            E::Value { found, .. } if found.contains(',') => {
                "numbers are separated by spaces, with a point as decimal mark".into()
            }
            E::Value { expected, .. } if expected.starts_with("this key only") => "remove the key".into(),
            E::Value { .. } => "correct the value".into(),
            E::Duplicate { .. } => "rename one of them".into(),
            E::JointKind { found, .. } if found == "planar" => {
                "write a planar joint as two prismatic joints and a revolute one with massless links between"
                    .into()
            }
            E::JointKind { .. } => "correct the `type` of the joint".into(),
            E::NotCarried { hint, .. } => (*hint).to_owned(),
            E::UnknownName { meant: Some(meant), .. } => format!("did you mean `{meant}`?"),
            E::UnknownName { kind, .. } => format!("use the {kind} names of the robot file"),
            E::Unwritable { .. } => "keep the robot as TOML".into(),
        })
    }
}
