//! What is wrong with a xacro file.

use thiserror::Error;

/// Why a xacro file cannot be expanded.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum XacroFault {
    /// An expression that cannot be computed.
    #[error("`{text}`: {reason}")]
    Expression {
        /// The expression.
        text: String,
        /// Why.
        reason: String,
    },
    /// An argument without a value.
    #[error("expected a value of the argument `{name}`, found none")]
    Argument {
        /// Its name.
        name: String,
    },
    /// An argument that the file does not have.
    #[error("expected an argument of the file, found `{name}`; it has {has}")]
    UnknownArgument {
        /// Its name.
        name: String,
        /// Names of those that it has.
        has: String,
    },
    /// Arguments behind `#` that are no `name:=value`.
    #[error("expected arguments `name:=value`, separated by commas, found `{found}`")]
    Arguments {
        /// What stands there.
        found: String,
    },
    /// A package that is nowhere.
    #[error("expected the package `{name}`, found none called so")]
    Package {
        /// Its name.
        name: String,
    },
    /// A file that is included or read cannot be had.
    #[error("`{file}` cannot be read: {reason}")]
    File {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// A tag of a macro that is not defined.
    #[error("expected a macro, found `xacro:{name}`, which is not defined")]
    Macro {
        /// Its name.
        name: String,
    },
    /// A call of a macro that does not fit its parameters.
    #[error("macro `{name}`: {reason}")]
    Call {
        /// Its name.
        name: String,
        /// What does not fit.
        reason: String,
    },
    /// A tag of xacro without what it needs, or with what it does not take.
    #[error("<xacro:{tag}>: expected {expected}, found {found}")]
    Tag {
        /// Its name.
        tag: String,
        /// What it needs.
        expected: &'static str,
        /// What it has.
        found: String,
    },
    /// A file that is there to be included.
    #[error("expected a robot, found definitions alone, from which nothing follows")]
    Empty,
    /// The expansion grows without end, or nearly.
    #[error("expected at most {limit} {what}, found more")]
    TooMuch {
        /// What was counted.
        what: &'static str,
        /// Cap.
        limit: usize,
    },
}

impl XacroFault {
    /// What to do about it; `file` is the file that is expanded.
    pub fn hint(&self, file: &str) -> String {
        let file = file.rsplit_once('#').map_or(file, |(path, _)| path);
        match self {
            XacroFault::Argument { name } => format!("state it behind the file: `'{file}#{name}:=VALUE'`"),
            XacroFault::UnknownArgument { .. } => "correct the name, or leave it out".to_owned(),
            XacroFault::Arguments { .. } => format!("for example `'{file}#prefix:=left_,limited:=true'`"),
            XacroFault::Package { name } => format!(
                "packages are looked for in ROS_PACKAGE_PATH, in AMENT_PREFIX_PATH, and beside and above the file, by the name \
                 in their `package.xml`: `ROS_PACKAGE_PATH=FOLDER_OF_{}`",
                name.to_uppercase()
            ),
            XacroFault::Empty => "name the file that includes it and calls its macros".to_owned(),
            XacroFault::TooMuch { .. } => {
                "a macro that calls itself needs a condition that ends it".to_owned()
            }
            _ => format!(
                "correct it there, or expand the file with xacro itself: `xacro {file} > robot.urdf` (behind the file its \
                 arguments, `name:=value`)"
            ),
        }
    }
}
